//! The plan's features and comparison points in the picture: features in green, points in blue, the chosen ones ringed.

use super::labels::{self, Taken, Wish};
use crate::geometry::{Point3, Vector3};
use crate::gui::engineer::Chosen;
use crate::gui::fonts;
use crate::gui::scene::camera::Camera;
use crate::gui::scene::content::PartContent;
use crate::gui::scene::linked::size_of;
use crate::gui::scene::overlay::{form, outline, project};
use crate::gui::scene::pick;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::words as write;
use crate::plan::Geometry;
use crate::plan::document::{Document, List};
use egui::{Align2, Color32, CornerRadius, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, Vec2, vec2};

/// A row of the plan that has a shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Its list.
    pub list: List,
    /// Its index there.
    pub row: usize,
    /// Its name.
    pub name: String,
    /// Its shape, CAD frame.
    pub geometry: Geometry,
}

/// A mark in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// In the window.
    pub pos: Pos2,
    /// The part stands before it.
    pub hidden: bool,
}

/// How something is seen.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// From where.
    pub camera: &'a Camera,
    /// Where in the window.
    pub at: Rect,
    /// In which colours.
    pub theme: &'static Theme,
}

impl Sight<'_> {
    /// Where a place stands in the window; `None` behind the eye.
    pub fn project(&self, place: &Point3) -> Option<Pos2> {
        project(self.camera, place, self.at, size_of(self.at))
    }
}

/// All rows that have a shape, features first.
pub fn marks(document: &Document) -> Vec<Mark> {
    let of = |list: List| {
        let rows = document.rows(list).into_iter().enumerate();
        rows.filter_map(move |(row, info)| {
            let geometry = info.geometry(list)?;
            Some(Mark { list, row, name: info.name, geometry })
        })
    };
    of(List::Feature).chain(of(List::Comparison)).collect()
}

/// Where marks stand; `None` behind the eye and outside of the view.
pub fn placed(marks: &[Mark], sight: &Sight<'_>, content: &PartContent) -> Vec<Option<Placed>> {
    let Sight { camera, at, .. } = *sight;
    let size = size_of(at);
    let face = content.part.face(content.face);
    let one = |mark: &Mark| {
        let place = mark.geometry.position();
        let pos = sight.project(&place).filter(|pos| at.contains(*pos))?;
        Some(Placed { pos, hidden: pick::is_hidden(&face.bvh, camera, &place, size) })
    };
    marks.iter().map(one).collect()
}

/// The mark under the pointer: of what is seen first, then of what is hidden.
pub fn under(marks: &[Option<Placed>], pos: Pos2) -> Option<usize> {
    const REACH: f32 = 12.0;
    let near = marks.iter().enumerate().filter_map(|(k, p)| Some((k, (*p)?)));
    let near = near.map(|(k, p)| (k, p.hidden, p.pos.distance(pos))).filter(|(_, _, d)| *d <= REACH);
    near.min_by(|a, b| a.1.cmp(&b.1).then(a.2.total_cmp(&b.2))).map(|(k, ..)| k)
}

/// Radius of the disc that stands for a surface feature, mm.
const DISC_MM: f64 = 2.5;

/// The outline of a shape in the window, closed; empty where it has none or part of it is behind the eye.
pub fn outline_in(geometry: &Geometry, sight: &Sight<'_>) -> Vec<Pos2> {
    let rim = outline(geometry);
    let line: Vec<Pos2> = rim.iter().filter_map(|p| sight.project(p)).collect();
    if line.len() == rim.len() { line } else { Vec::new() }
}

/// A disc in the sheet around a surface feature.
fn disc(geometry: &Geometry) -> Option<Geometry> {
    let Geometry::Surface { position, direction } = geometry else { return None };
    Some(Geometry::Hole { centre: *position, axis: *direction, diameter_mm: 2.0 * DISC_MM, direction: None })
}

/// Draws all marks; those that are chosen last and with a ring.
pub fn paint(painter: &Painter, marks: &[Mark], places: &[Option<Placed>], chosen: &Chosen, sight: &Sight<'_>) {
    let theme = sight.theme;
    let is_chosen = |mark: &Mark| chosen.has(mark.list, mark.row);
    for last in [false, true] {
        for (mark, place) in marks.iter().zip(places).filter(|(mark, _)| is_chosen(mark) == last) {
            let Some(Placed { pos, hidden }) = *place else { continue };
            let mut painter = painter.clone();
            if hidden && !last {
                painter.multiply_opacity(0.3);
            }
            match mark.list {
                List::Feature => feature(&painter, &mark.geometry, pos, sight),
                List::Comparison => form(&painter, mark.geometry.kind(), theme.accent, pos),
            }
            if last {
                ring(&painter, pos, theme);
            }
        }
    }
}

/// The ring of what is chosen.
pub fn ring(painter: &Painter, pos: Pos2, theme: &Theme) {
    painter.circle_stroke(pos, 12.0, Stroke::new(4.5, theme.panel));
    painter.circle_stroke(pos, 12.0, Stroke::new(2.5, theme.accent));
}

/// A feature: its rim, or a disc in the sheet.
pub fn feature(painter: &Painter, geometry: &Geometry, pos: Pos2, sight: &Sight<'_>) {
    let colour = sight.theme.feature;
    match disc(geometry).map(|disc| outline_in(&disc, sight)) {
        Some(line) if line.len() > 2 => {
            painter.add(Shape::convex_polygon(line.clone(), colour, Stroke::new(1.5, Color32::WHITE)));
            painter.circle_filled(pos, 2.0, Color32::WHITE);
        }
        _ => {
            let line = outline_in(geometry, sight);
            if line.len() > 2 {
                painter.add(Shape::closed_line(line.clone(), Stroke::new(6.5, Color32::WHITE)));
                painter.add(Shape::closed_line(line, Stroke::new(4.5, colour)));
            } else {
                form(painter, geometry.kind(), colour, pos);
            }
        }
    }
}

/// Writes the names of marks where they cover nothing; those that are chosen and the features first. Hidden marks have none.
pub fn names(
    ui: &mut Ui,
    marks: &[Mark],
    places: &[Option<Placed>],
    chosen: &Chosen,
    sight: &Sight<'_>,
    taken: &mut Taken,
) {
    for place in places.iter().flatten() {
        taken.add(Rect::from_center_size(place.pos, Vec2::splat(15.0)));
    }
    // The green rims of features are part of the picture, too.
    for (mark, _) in marks.iter().zip(places).filter(|(m, p)| m.list == List::Feature && p.is_some()) {
        outline_in(&mark.geometry, sight).iter().for_each(|p| taken.add(Rect::from_center_size(*p, Vec2::splat(8.0))));
    }
    let rank = |mark: &Mark| match mark.list {
        _ if chosen.has(mark.list, mark.row) => 0,
        List::Feature => 1,
        List::Comparison => 2,
    };
    let mut order: Vec<usize> =
        (0..marks.len()).filter(|k| places[*k].is_some_and(|p| !p.hidden || rank(&marks[*k]) == 0)).collect();
    order.sort_by_key(|k| (rank(&marks[*k]), *k));
    let wishes: Vec<Wish> = order.iter().map(|k| wish(ui, &marks[*k], places[*k], sight)).collect();
    let found = labels::place(&wishes, taken, sight.at.shrink(4.0));
    for (k, place) in order.into_iter().zip(found) {
        let Some(place) = place else { continue };
        name(ui, place, &marks[k], chosen.has(marks[k].list, marks[k].row), sight.theme);
    }
}

fn wish(ui: &Ui, mark: &Mark, placed: Option<Placed>, sight: &Sight<'_>) -> Wish {
    let anchor = placed.map_or(Pos2::ZERO, |p| p.pos);
    let wide = write::width(ui, &mark.name, fonts::mono(size::TABLE));
    // The name of a hole or slot stands beside its rim.
    let rim = outline_in(&mark.geometry, sight);
    let out = rim.iter().map(|p| p.distance(anchor)).fold(0.0, f32::max).min(60.0);
    let padded = if mark.list == List::Feature { vec2(14.0, 6.0) } else { vec2(6.0, 2.0) };
    Wish { anchor, size: vec2(wide, 16.0) + padded, gap: 9.0_f32.max(out + 3.0), reach: out + 34.0 }
}

fn name(ui: &mut Ui, place: Rect, mark: &Mark, chosen: bool, theme: &Theme) {
    let painter = ui.painter();
    let font = fonts::mono(size::TABLE);
    if mark.list == List::Feature || chosen {
        let colour = if chosen { theme.accent } else { theme.feature };
        let width = if chosen { 2.0 } else { 1.0 };
        painter.rect(place, CornerRadius::same(3), theme.panel, Stroke::new(width, colour), StrokeKind::Inside);
    } else {
        // A light rim: the name can be read on any shade of the part.
        for off in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            let at = place.center() + off;
            painter.text(at, Align2::CENTER_CENTER, &mark.name, font.clone(), theme.panel.gamma_multiply(0.85));
        }
    }
    painter.text(place.center(), Align2::CENTER_CENTER, &mark.name, font, theme.text);
}

/// A direction as an arrow in the window: from a place so many points along it, foreshortened as the eye sees it.
pub fn arrow(place: &Point3, direction: &Vector3, length: f64, sight: &Sight<'_>) -> Option<[Pos2; 2]> {
    let (camera, size) = (sight.camera, size_of(sight.at));
    let seen = camera.project(place, size)?;
    let length_mm = length / camera.px_per_mm(seen.depth_mm, size)?;
    let tip = sight.project(&(place + direction * length_mm))?;
    Some([sight.project(place)?, tip])
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn what_is_seen_is_hit_before_what_is_hidden_and_what_is_near_before_what_is_far() {
        let at = |x: f32, hidden| Some(Placed { pos: pos2(x, 10.0), hidden });
        let places = [at(10.0, true), at(14.0, false), None, at(20.0, false)];
        assert_eq!(under(&places, pos2(10.0, 10.0)), Some(1));
        assert_eq!(under(&places, pos2(18.0, 10.0)), Some(3));
        assert_eq!(under(&places, pos2(0.0, 10.0)), Some(0));
        assert_eq!(under(&places, pos2(60.0, 10.0)), None);
    }
}
