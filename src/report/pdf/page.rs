//! A page to draw on: millimetres from the top left corner, text with the fonts' own widths.
//!
//! Only this file and `document` know the PDF library.

use super::theme::PAGE;
use crate::report::palette::Rgb;
use crate::report::words::clean;
use printpdf::{
    Color, FontId, Line, LineCapStyle, LineDashPattern, LineJoinStyle, LinePoint, Op, PaintMode, ParsedFont,
    PdfFontHandle, Point, Polygon, PolygonRing, Pt, Rgb as PdfRgb, TextItem, TextMatrix, WindingOrder, XObjectId,
    XObjectTransform,
};

/// Points a millimetre.
const PT: f64 = 72.0 / 25.4;

/// The fonts of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Font {
    /// Text.
    Regular,
    /// Headings.
    SemiBold,
    /// The verdict.
    Bold,
    /// Numbers and hashes.
    Mono,
    /// Names of points, deviations.
    MonoBold,
}

const FONT_FILES: [(Font, &str, &[u8]); 5] = [
    (Font::Regular, "Inter-Regular", include_bytes!("../../../assets/fonts/Inter-Regular.ttf")),
    (Font::SemiBold, "Inter-SemiBold", include_bytes!("../../../assets/fonts/Inter-SemiBold.ttf")),
    (Font::Bold, "Inter-Bold", include_bytes!("../../../assets/fonts/Inter-Bold.ttf")),
    (Font::Mono, "DejaVuSansMono", include_bytes!("../../../assets/fonts/DejaVuSansMono.ttf")),
    (Font::MonoBold, "DejaVuSansMono-Bold", include_bytes!("../../../assets/fonts/DejaVuSansMono-Bold.ttf")),
];

/// A font and its size in points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Type {
    /// The font.
    pub font: Font,
    /// Points.
    pub size_pt: f64,
}

/// Short for a [`Type`].
pub const fn set(font: Font, size_pt: f64) -> Type {
    Type { font, size_pt }
}

/// The parsed fonts.
pub struct Fonts {
    parsed: Vec<(FontId, ParsedFont)>,
}

impl Fonts {
    /// Parses the fonts that are part of the program.
    pub fn new() -> Fonts {
        let parse = |&(_, name, bytes): &(Font, &str, &[u8])| {
            let mut font = ParsedFont::from_bytes(bytes, 0, &mut Vec::new())
                .expect("the fonts are compiled in and a test reads them all");
            font.font_name = Some(name.to_owned());
            (FontId(name.to_owned()), font)
        };
        Fonts { parsed: FONT_FILES.iter().map(parse).collect() }
    }

    /// Names and parsed fonts, for the document.
    pub(super) fn parsed(&self) -> &[(FontId, ParsedFont)] {
        &self.parsed
    }

    fn get(&self, font: Font) -> &(FontId, ParsedFont) {
        &self.parsed[font as usize]
    }

    /// The text as it can be printed: one line, every character that the font lacks as "?".
    pub fn printable(&self, font: Font, text: &str) -> String {
        let known = |c: char| self.get(font).1.lookup_glyph_index(c as u32).is_some_and(|g| g != 0);
        clean(text).chars().map(|c| if known(c) { c } else { '?' }).collect()
    }

    /// Width of a text in mm.
    pub fn width_mm(&self, set: Type, text: &str) -> f64 {
        let font = &self.get(set.font).1;
        let glyph = |c: char| font.lookup_glyph_index(c as u32).or(font.lookup_glyph_index('?' as u32)).unwrap_or(0);
        let units: u64 = clean(text).chars().map(|c| u64::from(font.get_glyph_width(glyph(c)).unwrap_or(0))).sum();
        units as f64 / f64::from(font.units_per_em) * set.size_pt / PT
    }

    /// The text, with an ellipsis in its middle when it is wider than there is room: both ends of a name tell most.
    pub fn fitted(&self, set: Type, text: &str, room_mm: f64) -> String {
        self.shortened(set, text, room_mm, |kept| kept.div_ceil(2))
    }

    /// The text, with an ellipsis at its end when it is wider than there is room.
    pub fn cut(&self, set: Type, text: &str, room_mm: f64) -> String {
        self.shortened(set, text, room_mm, |kept| kept)
    }

    /// Of `kept` characters, `head(kept)` stand before the ellipsis.
    fn shortened(&self, set: Type, text: &str, room_mm: f64, head: impl Fn(usize) -> usize) -> String {
        if self.width_mm(set, text) <= room_mm {
            return text.to_owned();
        }
        let chars: Vec<char> = text.chars().collect();
        let with = |kept: usize| -> String {
            let start = head(kept);
            let end = &chars[chars.len() - (kept - start)..];
            chars[..start].iter().chain(['…'].iter()).chain(end).collect()
        };
        // Widths grow with every character kept: bisect.
        let (mut fits, mut too_wide) = (0, chars.len());
        while fits + 1 < too_wide {
            let middle = (fits + too_wide) / 2;
            if self.width_mm(set, &with(middle)) <= room_mm { fits = middle } else { too_wide = middle }
        }
        with(fits)
    }

    /// Literal texts and values in turn on one line: when it is too wide, the widest values are shortened, never the
    /// literal texts.
    pub fn shared(&self, set: Type, pieces: &[(&str, &str)], room_mm: f64) -> String {
        let values: Vec<String> = pieces.iter().map(|(_, value)| self.printable(set.font, value)).collect();
        let literals: f64 = pieces.iter().map(|(literal, _)| self.width_mm(set, literal)).sum();
        let widths: Vec<f64> = values.iter().map(|value| self.width_mm(set, value)).collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| widths[a].total_cmp(&widths[b]));
        let (mut left, mut rooms) = ((room_mm - literals).max(0.0), vec![0.0; values.len()]);
        for (k, &i) in order.iter().enumerate() {
            rooms[i] = widths[i].min(left / (order.len() - k) as f64);
            left -= rooms[i];
        }
        // What is shortened by a rounding error only is not shortened.
        let piece = |k: usize| format!("{}{}", pieces[k].0, self.fitted(set, &values[k], rooms[k] + 1e-6));
        (0..pieces.len()).map(piece).collect()
    }

    /// The text in lines no wider than the room, broken at blanks; a word wider than that is broken anywhere.
    pub fn wrapped(&self, set: Type, text: &str, room_mm: f64) -> Vec<String> {
        let mut lines = vec![String::new()];
        for word in clean(text).split_whitespace() {
            let line = lines.last_mut().expect("there is always a line");
            let joined = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
            if self.width_mm(set, &joined) <= room_mm {
                *line = joined;
                continue;
            }
            let mut piece = String::new();
            if !line.is_empty() {
                lines.push(String::new());
            }
            for c in word.chars() {
                piece.push(c);
                if self.width_mm(set, &piece) > room_mm && piece.chars().count() > 1 {
                    piece.pop();
                    *lines.last_mut().expect("there is always a line") = std::mem::take(&mut piece);
                    lines.push(String::new());
                    piece.push(c);
                }
            }
            *lines.last_mut().expect("there is always a line") = piece;
        }
        lines
    }
}

/// How a path is painted.
#[derive(Debug, Clone, Copy, Default)]
pub struct Paint {
    /// Colour inside.
    pub fill: Option<Rgb>,
    /// Colour and width (mm) of the line.
    pub stroke: Option<(Rgb, f64)>,
    /// Dash and gap, mm.
    pub dash: Option<(f64, f64)>,
}

impl Paint {
    /// Only filled.
    pub const fn fill(colour: Rgb) -> Paint {
        Paint { fill: Some(colour), stroke: None, dash: None }
    }

    /// Only a line of that width, mm.
    pub const fn stroke(colour: Rgb, width_mm: f64) -> Paint {
        Paint { fill: None, stroke: Some((colour, width_mm)), dash: None }
    }

    /// Filled, with a line around.
    pub const fn both(fill: Rgb, stroke: Rgb, width_mm: f64) -> Paint {
        Paint { fill: Some(fill), stroke: Some((stroke, width_mm)), dash: None }
    }
}

/// One page being drawn.
pub struct Page<'a> {
    /// The fonts, to measure text.
    pub fonts: &'a Fonts,
    ops: Vec<Op>,
}

impl<'a> Page<'a> {
    /// An empty page.
    pub fn new(fonts: &'a Fonts) -> Page<'a> {
        let ops =
            vec![Op::SetLineCapStyle { cap: LineCapStyle::Butt }, Op::SetLineJoinStyle { join: LineJoinStyle::Round }];
        Page { fonts, ops }
    }

    pub(super) fn into_ops(self) -> Vec<Op> {
        self.ops
    }

    /// Text from `x` on, its baseline at `y`.
    pub fn text(&mut self, x: f64, y: f64, set: Type, colour: Rgb, text: &str) {
        let text = self.fonts.printable(set.font, text);
        if text.trim().is_empty() {
            return;
        }
        let font = PdfFontHandle::External(self.fonts.get(set.font).0.clone());
        let at = point(x, y);
        self.ops.extend([
            Op::StartTextSection,
            Op::SetFillColor { col: rgb(colour) },
            Op::SetFont { font, size: Pt(set.size_pt as f32) },
            Op::SetTextMatrix { matrix: TextMatrix::Translate(at.x, at.y) },
            Op::ShowText { items: vec![TextItem::Text(text)] },
            Op::EndTextSection,
        ]);
    }

    /// Text that ends at `x`.
    pub fn text_right(&mut self, x: f64, y: f64, set: Type, colour: Rgb, text: &str) {
        self.text(x - self.fonts.width_mm(set, text), y, set, colour, text);
    }

    /// Text with its middle at `x`.
    pub fn text_centre(&mut self, x: f64, y: f64, set: Type, colour: Rgb, text: &str) {
        self.text(x - 0.5 * self.fonts.width_mm(set, text), y, set, colour, text);
    }

    /// A line across the page.
    pub fn rule(&mut self, x0: f64, x1: f64, y: f64, colour: Rgb, width_mm: f64) {
        self.line(&[[x0, y], [x1, y]], colour, width_mm, false);
    }

    /// An open line through points.
    pub fn line(&mut self, points: &[[f64; 2]], colour: Rgb, width_mm: f64, round: bool) {
        let cap = |round: bool| if round { LineCapStyle::Round } else { LineCapStyle::Butt };
        let points = points.iter().map(|p| LinePoint { p: point(p[0], p[1]), bezier: false }).collect();
        self.ops.extend([
            Op::SetLineCapStyle { cap: cap(round) },
            Op::SetOutlineColor { col: rgb(colour) },
            Op::SetOutlineThickness { pt: Pt((width_mm * PT) as f32) },
            Op::DrawLine { line: Line { points, is_closed: false } },
            Op::SetLineCapStyle { cap: LineCapStyle::Butt },
        ]);
    }

    /// A closed path through corners.
    pub fn polygon(&mut self, corners: &[[f64; 2]], paint: &Paint) {
        self.ring(corners.iter().map(|c| (*c, false)).collect(), paint);
    }

    /// A rectangle from its top left corner.
    pub fn rect(&mut self, x: f64, y: f64, width: f64, height: f64, paint: &Paint) {
        self.polygon(&[[x, y], [x + width, y], [x + width, y + height], [x, y + height]], paint);
    }

    /// A rectangle with rounded corners.
    pub fn round_rect(&mut self, x: f64, y: f64, width: f64, height: f64, radius: f64, paint: &Paint) {
        let corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
        let directions = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
        let mut path = Vec::new();
        for k in 0..4 {
            // Into the corner along one side, out of it along the next.
            let (c, before, after) = (corners[k], directions[k], directions[(k + 1) % 4]);
            let at = |d: [f64; 2], reach: f64| [c[0] + d[0] * radius * reach, c[1] + d[1] * radius * reach];
            let back = |d: [f64; 2]| [-d[0], -d[1]];
            path.push((at(back(before), 1.0), false));
            path.push((at(back(before), 1.0 - ARC), true));
            path.push((at(after, 1.0 - ARC), true));
            path.push((at(after, 1.0), false));
        }
        self.ring(path, paint);
    }

    /// A circle.
    pub fn circle(&mut self, x: f64, y: f64, radius: f64, paint: &Paint) {
        let a = radius * ARC;
        let ring = [
            ([x + radius, y], false),
            ([x + radius, y + a], true),
            ([x + a, y + radius], true),
            ([x, y + radius], false),
            ([x - a, y + radius], true),
            ([x - radius, y + a], true),
            ([x - radius, y], false),
            ([x - radius, y - a], true),
            ([x - a, y - radius], true),
            ([x, y - radius], false),
            ([x + a, y - radius], true),
            ([x + radius, y - a], true),
            ([x + radius, y], false),
        ];
        self.ring(ring.to_vec(), paint);
    }

    /// An image that was added to the document, in a rectangle from its top left corner.
    pub fn image(&mut self, id: &XObjectId, x: f64, y: f64, width: f64, height: f64) {
        let corner = point(x, y + height);
        let transform = XObjectTransform {
            translate_x: Some(corner.x),
            translate_y: Some(corner.y),
            scale_x: Some((width * PT) as f32),
            scale_y: Some((height * PT) as f32),
            no_auto_scale: true,
            ..XObjectTransform::default()
        };
        self.ops.push(Op::UseXobject { id: id.clone(), transform });
    }

    fn ring(&mut self, path: Vec<([f64; 2], bool)>, paint: &Paint) {
        let mode = match (paint.fill, paint.stroke) {
            (Some(_), Some(_)) => PaintMode::FillStroke,
            (Some(_), None) => PaintMode::Fill,
            (None, Some(_)) => PaintMode::Stroke,
            (None, None) => return,
        };
        if let Some(fill) = paint.fill {
            self.ops.push(Op::SetFillColor { col: rgb(fill) });
        }
        if let Some((colour, width_mm)) = paint.stroke {
            self.ops.push(Op::SetOutlineColor { col: rgb(colour) });
            self.ops.push(Op::SetOutlineThickness { pt: Pt((width_mm * PT) as f32) });
        }
        if let Some((dash, gap)) = paint.dash {
            let dash = LineDashPattern::new(0.0, &[(dash * PT) as f32, (gap * PT) as f32]);
            self.ops.push(Op::SetLineDashPattern { dash });
        }
        let points = path.iter().map(|(p, bezier)| LinePoint { p: point(p[0], p[1]), bezier: *bezier }).collect();
        let rings = vec![PolygonRing { points }];
        self.ops.push(Op::DrawPolygon { polygon: Polygon { rings, mode, winding_order: WindingOrder::NonZero } });
        if paint.dash.is_some() {
            self.ops.push(Op::SetLineDashPattern { dash: LineDashPattern::new(0.0, &[]) });
        }
    }
}

/// A text as it stands on a page: where it begins, its baseline, its width, mm from the top left.
#[cfg(test)]
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
    pub text: String,
}

#[cfg(test)]
impl Page<'_> {
    /// Every text on the page.
    pub fn texts(&self) -> Vec<Placed> {
        let mut texts = Vec::new();
        let (mut at, mut type_) = ([0.0; 2], set(Font::Regular, 1.0));
        for op in &self.ops {
            match op {
                Op::SetFont { font: PdfFontHandle::External(id), size } => {
                    let k = self.fonts.parsed.iter().position(|(known, _)| known == id).unwrap();
                    type_ = set(FONT_FILES[k].0, f64::from(size.0));
                }
                Op::SetTextMatrix { matrix: TextMatrix::Translate(x, y) } => {
                    at = [f64::from(x.0) / PT, PAGE[1] - f64::from(y.0) / PT];
                }
                Op::ShowText { items } => {
                    let TextItem::Text(text) = &items[0] else { panic!("only plain text is shown") };
                    let (width, height) = (self.fonts.width_mm(type_, text), 0.727 * type_.size_pt / PT);
                    texts.push(Placed { x: at[0], y: at[1], width, height, text: text.clone() });
                }
                _ => {}
            }
        }
        texts
    }
}

/// Handle length of the cubic that stands for a quarter of a circle.
const ARC: f64 = 0.552_284_75;

fn point(x: f64, y: f64) -> Point {
    // A hundredth of a point is finer than any printer and keeps the stream short.
    let round = |v: f64| Pt(((v * PT * 100.0).round() / 100.0) as f32);
    Point { x: round(x), y: round(PAGE[1] - y) }
}

fn rgb(colour: Rgb) -> Color {
    let [r, g, b] = colour.map(|c| (f32::from(c) / 255.0 * 1000.0).round() / 1000.0);
    Color::Rgb(PdfRgb::new(r, g, b, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_font_has_the_signs_that_reports_print() {
        let fonts = Fonts::new();
        for (font, _, _) in FONT_FILES {
            let signs = "ABCxyz019 .,;()\\/%+-−–…°µ±Ø×²≤≥ΔσÅÄÖåäößłŻžŐ?!";
            assert_eq!(fonts.printable(font, signs), signs, "{font:?}");
            assert_eq!(fonts.printable(font, "a漢\u{1F600}\tb"), "a?? b");
        }
    }

    #[test]
    fn widths_are_those_of_the_font() {
        let fonts = Fonts::new();
        // DejaVu Sans Mono is 0.602 em wide: ten characters at 10 pt are 60.2 pt.
        let width = fonts.width_mm(set(Font::Mono, 10.0), "0123456−89");
        assert!((width - 60.2 / PT).abs() < 1e-9, "{width}");
    }

    #[test]
    fn shortened_text_fits_and_keeps_its_ends() {
        let fonts = Fonts::new();
        let set = set(Font::Regular, 9.0);
        let long = format!("start{}end", "x".repeat(400));
        for room in [5.0, 20.0, 60.0] {
            let fitted = fonts.fitted(set, &long, room);
            assert!(fonts.width_mm(set, &fitted) <= room);
            assert!(fitted.starts_with('s') && fitted.ends_with('d') || room < 6.0, "{fitted}");
            assert!(fonts.width_mm(set, &fonts.cut(set, &long, room)) <= room);
        }
        assert_eq!(fonts.fitted(set, "short", 60.0), "short");
    }

    #[test]
    fn wrapped_lines_fit_and_lose_nothing() {
        let fonts = Fonts::new();
        let set = set(Font::Regular, 9.0);
        let text = format!("one two three {} four five", "w".repeat(90));
        let lines = fonts.wrapped(set, &text, 30.0);
        assert!(lines.iter().all(|l| fonts.width_mm(set, l) <= 30.0 && !l.is_empty()), "{lines:?}");
        assert_eq!(lines.concat().replace(' ', ""), text.replace(' ', ""));
    }
}
