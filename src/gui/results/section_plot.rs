//! The section of the chosen point as a picture: the sheet's faces, the points, the window, nominal and measured place.

use super::section::{Frame, Section, cut};
use super::sheet_normal;
use crate::gui::facts::FinishedPart;
use crate::gui::fonts;
use crate::gui::scene::builder::{Pending, pending};
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::words as write;
use crate::inspect::{Inspection, InspectionResult, PointResult};
use egui::{Align2, Color32, CornerRadius, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;

/// Of which result and which point.
#[derive(Clone)]
struct Key {
    result: Arc<InspectionResult>,
    point: String,
}

impl Key {
    fn is(&self, other: &Key) -> bool {
        Arc::ptr_eq(&self.result, &other.result) && self.point == other.point
    }
}

/// Cuts on a thread of their own, so that the window never waits; the last one is kept.
#[derive(Default)]
pub struct Sections {
    pending: Option<Pending<Key, Option<Section>>>,
    last: Option<(Key, Option<Section>)>,
}

impl Sections {
    /// The section of a point; `None` while it is being cut.
    fn of(&mut self, wanted: &Key, frame: Frame, part: &FinishedPart, of: &Inspection, ui: &Ui) -> Option<&Section> {
        if let Some(pending) = &self.pending {
            match pending.answer() {
                Ok(section) => {
                    self.last = Some((pending.key.clone(), section));
                    self.pending = None;
                }
                Err(TryRecvError::Disconnected) => self.pending = None,
                Err(TryRecvError::Empty) => {}
            }
        }
        let is_there = self.last.as_ref().is_some_and(|(key, _)| key.is(wanted));
        if !is_there && !self.pending.as_ref().is_some_and(|p| p.key.is(wanted)) {
            let scan = part.scan.clone()?;
            let (cad, pose) = (part.part.clone(), of.alignment.cad_from_scan);
            self.pending =
                pending(wanted.clone(), ui.ctx(), move |run| Some(cut(&frame, &cad, &scan, &pose, run).ok()));
        }
        self.last.as_ref().filter(|(key, _)| key.is(wanted)).and_then(|(_, section)| section.as_ref())
    }
}

/// Draws the section of a point in a place of that size.
pub fn section_ui(
    ui: &mut Ui,
    room: Vec2,
    (part, of, point): (&FinishedPart, &Inspection, &PointResult),
    sections: &mut Sections,
    (words, theme): (&Words, &Theme),
) {
    let (at, response) = ui.allocate_exact_size(room, Sense::hover());
    let Some(frame) = Frame::of(point, &sheet_normal(&part.plan, point)) else { return };
    let key = Key { result: part.result.clone(), point: point.name.clone() };
    let section = sections.of(&key, frame, part, of, ui);
    let said = match section {
        Some(section) => {
            words.fill("results.section_of", &[("point", &point.name), ("n", &words.thousands(section.points.len()))])
        }
        None if part.scan.is_none() => words.text("results.no_section").to_owned(),
        None => words.text("results.section_is_cut").to_owned(),
    };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &said));
    ui.painter().rect(at, CornerRadius::same(4), theme.scene, Stroke::new(1.0, theme.stroke), StrokeKind::Inside);
    let title = Rect::from_min_size(at.min + vec2(8.0, 2.0), vec2(at.width() - 16.0, 20.0));
    write::line(ui, title, Align2::LEFT_CENTER, &said, fonts::semibold(size::NOTE), theme.text);
    if let Some(section) = section {
        let inside = Rect::from_min_max(pos2(at.left(), title.bottom()), at.max).shrink(2.0);
        let px_per_mm = 0.5 * inside.width() / frame.reach_mm as f32;
        let scale = Scale { middle: inside.center(), px_per_mm, rise: rise(point, inside.height(), px_per_mm) };
        paint(ui, inside, section, &frame, point, &scale, theme);
        paint_words(ui, inside, &frame, point, &scale, (words, theme));
    }
}

/// From the cut to the screen.
struct Scale {
    middle: Pos2,
    px_per_mm: f32,
    /// How many times higher heights are drawn.
    rise: f32,
}

impl Scale {
    fn pos(&self, [x, y]: [f32; 2]) -> Pos2 {
        self.middle + vec2(x * self.px_per_mm, -y * self.px_per_mm * self.rise)
    }
}

/// How many times higher the heights of a surface point are drawn, so that its deviation and its limits can be seen: the largest of
/// some factors with which they stay within a quarter of the picture's height about its middle.
fn rise(point: &PointResult, height: f32, px_per_mm: f32) -> f32 {
    const FACTORS: [f32; 4] = [20.0, 10.0, 5.0, 2.0];
    if point.kind != "surface" {
        return 1.0;
    }
    let deviation = point.measurement.as_ref().map_or(0.0, |m| m.deviation_mm.abs());
    let largest = deviation.max(point.lower_mm.abs()).max(point.upper_mm.abs()) as f32;
    FACTORS.into_iter().find(|factor| factor * largest * px_per_mm <= 0.25 * height).unwrap_or(1.0)
}

fn paint(ui: &Ui, inside: Rect, section: &Section, frame: &Frame, point: &PointResult, scale: &Scale, theme: &Theme) {
    let painter = ui.painter_at(inside);
    if let Some(window_mm) = frame.window_mm {
        let half = window_mm as f32 * scale.px_per_mm;
        let band = Rect::from_x_y_ranges(scale.middle.x - half..=scale.middle.x + half, inside.y_range());
        painter.rect_filled(band, CornerRadius::ZERO, theme.raised);
    }
    for piece in &section.sheet {
        painter.line_segment(piece.map(|end| scale.pos(end)), Stroke::new(1.2, theme.quiet));
    }
    for place in &section.points {
        painter.circle_filled(scale.pos(*place), 1.5, theme.accent);
    }
    mark(&painter, inside, point, [0.0, 0.0], scale, (theme.text, true));
    if let Some(m) = &point.measurement {
        let place = frame.place(&m.measured).map(|mm| mm as f32);
        let colour = Sign::from(point.verdict).colour(theme);
        mark(&painter, inside, point, place, scale, (colour, false));
    }
}

/// A line where an edge or hole stands, or how high a surface does; dashed for the nominal place.
fn mark(
    painter: &egui::Painter,
    inside: Rect,
    point: &PointResult,
    place: [f32; 2],
    scale: &Scale,
    (colour, dashed): (Color32, bool),
) {
    let at = scale.pos(place);
    let half = if dashed { 0.42 } else { 0.34 };
    let ends = if point.kind == "surface" {
        let along = vec2(half * inside.width(), 0.0);
        [at - along, at + along]
    } else {
        let along = vec2(0.0, half * inside.height());
        [at - along, at + along]
    };
    let stroke = Stroke::new(if dashed { 1.2 } else { 2.0 }, colour);
    if dashed {
        painter.extend(egui::Shape::dashed_line(&ends, stroke, 5.0, 4.0));
    } else {
        painter.line_segment(ends, stroke);
    }
}

/// What the lines are, and how long a millimetre is.
fn paint_words(
    ui: &mut Ui,
    inside: Rect,
    frame: &Frame,
    point: &PointResult,
    scale: &Scale,
    (words, theme): (&Words, &Theme),
) {
    let font = fonts::regular(size::NOTE);
    let long_mm = if frame.reach_mm > 12.0 { 5.0 } else { 1.0 };
    let right = inside.right() - 8.0;
    let mut legend = vec![(words.text("results.section_nominal"), theme.text, true)];
    if point.measurement.is_some() {
        legend.push((words.text("results.section_measured"), Sign::from(point.verdict).colour(theme), false));
    }
    let mut x = inside.left() + 8.0;
    let y = inside.bottom() - 10.0;
    for (text, colour, dashed) in legend {
        let ends = [pos2(x, y), pos2(x + 18.0, y)];
        let stroke = Stroke::new(if dashed { 1.2 } else { 2.0 }, colour);
        if dashed {
            ui.painter().extend(egui::Shape::dashed_line(&ends, stroke, 5.0, 4.0));
        } else {
            ui.painter().line_segment(ends, stroke);
        }
        let wide = write::width(ui, text, font.clone()) + 2.0;
        let place = Rect::from_center_size(pos2(x + 22.0 + 0.5 * wide, y), vec2(wide, 16.0));
        write::line(ui, place, Align2::LEFT_CENTER, text, font.clone(), theme.text);
        x = place.right() + 12.0;
    }
    if scale.rise > 1.0 {
        let text = words.fill("results.section_heights", &[("n", &words.number(f64::from(scale.rise), 0))]);
        let wide = write::width(ui, &text, font.clone()) + 2.0;
        // Below the title where the scale's bar begins too soon: above the others stands the sheet.
        let fits = x + wide + 12.0 <= right - (long_mm * scale.px_per_mm).max(60.0);
        let (x, y) = if fits { (x, y) } else { (inside.left() + 8.0, inside.top() + 8.0) };
        let place = Rect::from_center_size(pos2(x + 0.5 * wide, y), vec2(wide, 16.0));
        write::line(ui, place, Align2::LEFT_CENTER, &text, font.clone(), theme.quiet);
    }
    let ends = [pos2(right - long_mm * scale.px_per_mm, y), pos2(right, y)];
    ui.painter().line_segment(ends, Stroke::new(2.0, theme.text));
    let place = Rect::from_min_max(pos2(right - 60.0, y - 20.0), pos2(right, y - 4.0));
    write::line(ui, place, Align2::RIGHT_CENTER, &format!("{long_mm:.0} mm"), font, theme.text);
}
