//! The colour map on paper: picture, markers, labels with leaders, legend.

use super::document;
use super::page::{Font, Page, Paint, Type, set};
use super::signs::{kinds, marker, sign};
use super::theme::{HATCH, LEFT, QUIET, REVERSE, RIGHT, STRONG, Sign, TEXT, WHITE};
use crate::inspect::{Inspection, InspectionResult, PointResult, Verdict};
use crate::part::Part;
use crate::report::flags::{Flag, Margin, Room, place, split};
use crate::report::palette::Palette;
use crate::report::raster::{MapInput, MapPicture, MapStyle, draw};
use crate::report::words::{deviation as deviation_words, kind, signed_mm, thousands, worst_first};
use crate::run::{Cancelled, RunContext};
use crate::scan::ConditionedScan;

/// What the map needs beside the result: the part's shape and the scan's points.
#[derive(Clone, Copy)]
pub struct MapScene<'a> {
    /// The part.
    pub part: &'a Part,
    /// The scan that the result was measured in.
    pub scan: &'a ConditionedScan,
}

/// How many points get a label.
const LABELS: usize = 8;
/// Height of a label and the distance between the middles of two, mm.
const FLAG: [f64; 2] = [8.6, 10.2];
/// Where the legend begins, mm from the left.
const LEGEND: f64 = 175.4;
/// Pixels a millimetre of paper in the picture: 300 dpi.
const PX_PER_MM: f64 = 300.0 / 25.4;

const NAME: Type = set(Font::MonoBold, 8.0);
const VALUE: Type = set(Font::Mono, 8.0);
/// Where the name begins in its label, mm.
const NAME_AT: f64 = 4.8;

/// A number for paper: with the true minus sign.
pub fn paper(ascii: &str) -> String {
    ascii.replace('-', "\u{2212}")
}

/// The worst points, which get a label; none when nothing was judged.
fn labelled(inspection: &Inspection) -> Vec<&PointResult> {
    if inspection.alignment.degraded.is_some() {
        return Vec::new();
    }
    worst_first(&inspection.points).into_iter().take(LABELS).map(|i| &inspection.points[i]).collect()
}

/// Width of the labels, mm: that of the longest name, within limits.
fn flag_width(page: &Page<'_>, labelled: &[&PointResult]) -> f64 {
    let name = labelled.iter().map(|p| page.fonts.width_mm(NAME, &p.name)).fold(0.0, f64::max);
    (NAME_AT + name.clamp(4.8, 15.0) + 1.3).max(1.4 + page.fonts.width_mm(VALUE, "no value") + 1.3)
}

/// The room of the map on paper.
#[derive(Debug, Clone, Copy)]
pub struct MapRoom {
    /// Its top, mm from the top of the page.
    pub top: f64,
    /// The picture is at most this high, mm.
    pub height: f64,
}

/// A map ready to be put on a page.
pub struct PreparedMap<'a> {
    /// The picture.
    pub picture: MapPicture,
    labelled: Vec<&'a PointResult>,
    flag_width: f64,
    room: MapRoom,
}

/// Draws the picture as large as it fits between the labels. `None` when there is nothing to draw.
pub fn prepare<'a>(
    page: &Page<'_>,
    result: &InspectionResult,
    inspection: &'a Inspection,
    scene: &MapScene<'_>,
    room: MapRoom,
    run: &RunContext,
) -> Result<Option<PreparedMap<'a>>, Cancelled> {
    let labelled = labelled(inspection);
    let flag_width = if labelled.is_empty() { 0.0 } else { flag_width(page, &labelled) + 3.0 };
    let width = LEGEND - 5.0 - LEFT - 2.0 * flag_width;
    let (points, deviations) = inspection.map_in_cad(&scene.scan.cloud.positions);
    let face = &scene.part.face(inspection.best_fit.face).mesh;
    let input = MapInput { face, points: &points, deviations_mm: &deviations, spacing_mm: scene.scan.spacing_mm };
    let style = MapStyle {
        range_mm: result.map_range_mm,
        palette: Palette::default(),
        max_width_px: (width * PX_PER_MM) as usize,
        max_height_px: (room.height * PX_PER_MM) as usize,
        line_px: 2,
    };
    let picture = draw(&input, &style, run)?;
    Ok(picture.map(|picture| PreparedMap { picture, labelled, flag_width, room }))
}

impl PreparedMap<'_> {
    /// Height of what is drawn, mm: the picture, or the legend beside a flat part.
    pub fn height(&self) -> f64 {
        (self.picture.height_px as f64 / PX_PER_MM).max(84.0)
    }

    /// Puts picture, markers, labels and legend on the page; returns where it ends.
    pub fn put(&self, page: &mut Page<'_>, result: &InspectionResult, inspection: &Inspection) -> f64 {
        let height = self.height();
        let (left, right) = (LEFT + self.flag_width, LEGEND - 5.0 - self.flag_width);
        let size = [self.picture.width_px as f64 / PX_PER_MM, self.picture.height_px as f64 / PX_PER_MM];
        let corner = [0.5 * (left + right - size[0]), self.room.top + 0.5 * (height - size[1])];
        page.image(&document::map_id(), corner[0], corner[1], size[0], size[1]);
        let at = |p: &PointResult| {
            let [x, y] = self.picture.place_px(&p.nominal);
            [corner[0] + x / PX_PER_MM, corner[1] + y / PX_PER_MM]
        };
        let crowded = inspection.points.len() > 60;
        for &i in worst_first(&inspection.points).iter().rev() {
            let p = &inspection.points[i];
            let [x, y] = at(p);
            marker(page, p.kind, p.verdict, x, y, if crowded { 0.6 } else { 0.95 });
        }
        let places: Vec<[f64; 2]> = self.labelled.iter().map(|p| at(p)).collect();
        self.labels(page, &places, height);
        legend(page, result, &self.picture, self.room.top);
        self.room.top + height
    }

    fn labels(&self, page: &mut Page<'_>, places: &[[f64; 2]], height: f64) {
        let width = self.flag_width - 3.0;
        let room = Room {
            left_x: LEFT + width,
            right_x: LEGEND - 5.0 - width,
            top: self.room.top + 0.5 * FLAG[0],
            bottom: self.room.top + height - 0.5 * FLAG[0],
            pitch: FLAG[1],
        };
        let margins = split(places, 0.5 * (room.left_x + room.right_x), room.capacity());
        let flags = place(places, &margins, &room);
        let inner = |flag: &Flag| if flag.margin == Margin::Left { room.left_x } else { room.right_x };
        for (colour, width_mm) in [(WHITE, 0.85), (TEXT, 0.28)] {
            for flag in &flags {
                page.line(&[[inner(flag), flag.y], places[flag.point]], colour, width_mm, false);
            }
        }
        for flag in &flags {
            let p = self.labelled[flag.point];
            let [x, y] = places[flag.point];
            marker(page, p.kind, p.verdict, x, y, 1.3);
            let x = if flag.margin == Margin::Left { LEFT } else { room.right_x };
            let of = Sign::Verdict(p.verdict);
            // What is out of tolerance has its colour around the label, the worst point also inside.
            let frame = match (p.verdict, flag.point) {
                (Verdict::Fail, 0) => Paint::both(of.fill(), of.colour(), 0.6),
                (Verdict::Fail, _) => Paint::both(WHITE, of.colour(), 0.4),
                _ => Paint::both(WHITE, STRONG, 0.22),
            };
            page.round_rect(x, flag.y - 0.5 * FLAG[0], width, FLAG[0], 0.8, &frame);
            sign(page, of, x + 2.7, flag.y - 1.9, 1.3);
            let value = match &p.measurement {
                Some(m) => paper(&deviation_words(p, m)),
                None => "no value".to_owned(),
            };
            let name = page.fonts.fitted(NAME, &page.fonts.printable(NAME.font, &p.name), width - NAME_AT - 1.2);
            page.text(x + NAME_AT, flag.y - 0.9, NAME, TEXT, &name);
            page.text_right(x + width - 1.3, flag.y + 2.9, VALUE, TEXT, &value);
        }
    }
}

/// The line under the map: forms of markers, from where it is seen.
pub fn caption(page: &mut Page<'_>, baseline: f64, inspection: &Inspection, map: Option<&PreparedMap<'_>>) {
    kinds(page, LEFT, baseline);
    let Some(map) = map else { return };
    let labels = match map.labelled.len() {
        0 => "",
        1 => " Label: the worst point.",
        LABELS => " Labels: the eight worst points.",
        _ => " Labels: all points, the worst first in the table.",
    };
    let from = match inspection.best_fit.side {
        Some(side) => format!("from the {}", side.key()),
        None => "along the mean normal".to_owned(),
    };
    let words = format!("Seen {from}.{labels}");
    page.text_right(RIGHT, baseline, set(Font::Regular, 7.8), QUIET, &words);
}

fn legend(page: &mut Page<'_>, result: &InspectionResult, picture: &MapPicture, top: f64) {
    let range = result.map_range_mm;
    let (x, width, bar_top, height) = (LEGEND, 3.8, top + 5.6, 60.0);
    let small = set(Font::Regular, 7.4);
    page.text(x, top + 1.6, set(Font::SemiBold, 8.0), TEXT, "Deviation, mm");
    const SLICES: usize = 96;
    for k in 0..SLICES {
        let value = 1.0 - 2.0 * (k as f64 + 0.5) / SLICES as f64;
        let y = bar_top + height * k as f64 / SLICES as f64;
        // Slices overlap a little, so that no viewer shows seams.
        let tall = if k + 1 == SLICES { height / SLICES as f64 } else { 1.4 * height / SLICES as f64 };
        page.rect(x, y, width, tall, &Paint::fill(Palette::default().colour(value)));
    }
    page.rect(x, bar_top, width, height, &Paint::stroke(STRONG, 0.2));
    for k in 0..=8 {
        let value = range * (1.0 - f64::from(k) / 4.0);
        let y = bar_top + height * f64::from(k) / 8.0;
        page.rule(x + width, x + width + 1.2, y, STRONG, 0.2);
        page.text(x + width + 1.9, y + 0.95, set(Font::Mono, 7.4), TEXT, &paper(&signed_mm(value)));
    }
    let mut y = bar_top + height + 5.2;
    let [below, above] = picture.beyond;
    for (count, up) in [(above, true), (below, false)] {
        if count > 0 {
            let (tip, foot) = if up { (y - 2.2, y) } else { (y, y - 2.2) };
            let colour = Palette::default().colour(if up { 1.0 } else { -1.0 });
            page.polygon(&[[x + 1.9, tip], [x + 3.4, foot], [x + 0.4, foot]], &Paint::fill(colour));
            page.text(x + 5.7, y, small, TEXT, &format!("{} {}", thousands(count), if up { "over" } else { "under" }));
            y += 4.4;
        }
    }
    hatch(page, x, y - 2.4, 3.8, 2.8);
    page.text(x + 5.7, y, small, TEXT, "No data");
    y += 4.4;
    page.rule(x, x + 3.8, y - 1.0, QUIET, 0.2);
    page.text(x + 5.7, y, small, TEXT, &format!("Line {:.3}", 0.25 * range));
    if picture.reverse_seen {
        y += 4.4;
        page.rect(x, y - 2.4, 3.8, 2.8, &Paint::both(REVERSE, STRONG, 0.15));
        page.text(x + 5.7, y, small, TEXT, "Other side");
    }
}

/// The swatch of "no data": stripes at 45 degrees, cut off at its sides.
fn hatch(page: &mut Page<'_>, x: f64, y: f64, width: f64, height: f64) {
    page.rect(x, y, width, height, &Paint::fill(HATCH[0]));
    let mut start = -height;
    while start < width {
        // Where a stripe from (start, bottom) to (start + height, top) enters and leaves the swatch.
        let (from, to) = (start.max(0.0), (start + height).min(width));
        if to > from {
            let point = |along: f64| [x + along, y + height - (along - start)];
            page.line(&[point(from), point(to)], HATCH[1], 0.35, false);
        }
        start += 1.0;
    }
    page.rect(x, y, width, height, &Paint::stroke(STRONG, 0.15));
}

/// What a point without a value says in a table: its kind in words, for both tables.
pub fn kind_words(point: &PointResult) -> &'static str {
    kind(point.kind)
}

/// Whether a row gets the colour of its verdict.
pub fn row_fill(verdict: Verdict) -> Option<Sign> {
    (verdict != Verdict::Pass).then_some(Sign::Verdict(verdict))
}
