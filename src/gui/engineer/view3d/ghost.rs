//! What is proposed and not in the plan yet: its shape, its directions as arrows with their names, the piece of edge it stands on, its flag.

use super::labels::{self, Taken, Wish};
use super::marks::{Sight, arrow, feature, outline_in, ring};
use crate::geometry::{Point3, Vector3};
use crate::gui::fonts;
use crate::gui::scene::overlay::form;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::words as write;
use crate::plan::Geometry;
use crate::plan::document::List;
use egui::{Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, Vec2, vec2};

/// Length of an arrow that is seen from the side, points of the window.
const ARROW: f64 = 64.0;

/// A direction to be shown.
struct Pointing {
    direction: Vector3,
    key: &'static str,
    colour: Color32,
}

/// The directions that a shape has. `inwards`: an edge's direction points into the sheet.
fn directions(geometry: &Geometry, inwards: bool, theme: &Theme) -> Vec<Pointing> {
    let (blue, red) = (theme.accent, theme.outward);
    let one = |direction: Vector3, key, colour| Pointing { direction, key, colour };
    match geometry {
        Geometry::Surface { direction, .. } => vec![one(direction.into_inner(), "pick.along_normal", blue)],
        Geometry::Edge { direction, normal, .. } => {
            let key = if inwards { "pick.inwards" } else { "pick.outwards" };
            vec![one(normal.into_inner(), "pick.normal", blue), one(direction.into_inner(), key, red)]
        }
        Geometry::Hole { axis, direction, .. } => {
            let told = direction.map(|d| one(d.into_inner(), "pick.direction", red));
            std::iter::once(one(axis.into_inner(), "pick.axis", blue)).chain(told).collect()
        }
        Geometry::Slot { axis, direction, .. } => {
            vec![one(axis.into_inner(), "pick.axis", blue), one(direction.into_inner(), "pick.long_axis", red)]
        }
    }
}

/// What is known of a shape that is shown large.
#[derive(Debug, Clone, Copy)]
pub struct Ghost<'a> {
    /// It.
    pub geometry: &'a Geometry,
    /// Its list.
    pub list: List,
    /// The piece of the trimmed edge it stands on; empty of other kinds.
    pub piece: &'a [Point3],
    /// An edge's direction points into the sheet.
    pub inwards: bool,
}

/// Draws shape, edge and arrows below the names; returns the arrows' tips, and keeps their lines free.
pub fn paint(painter: &Painter, ghost: &Ghost<'_>, sight: &Sight<'_>, taken: &mut Taken) -> Vec<Pos2> {
    let theme = sight.theme;
    paint_edge(painter, ghost.piece, sight);
    let place = ghost.geometry.position();
    let Some(pos) = sight.project(&place) else { return Vec::new() };
    let rim = outline_in(ghost.geometry, sight);
    if rim.len() > 2 {
        painter.add(Shape::closed_line(rim.clone(), Stroke::new(6.0, theme.panel)));
        painter.add(Shape::closed_line(rim, Stroke::new(3.5, theme.snap)));
    }
    let mut tips = Vec::new();
    for Pointing { direction, colour, .. } in directions(ghost.geometry, ghost.inwards, theme) {
        let ends = arrow(&place, &direction, ARROW, sight).unwrap_or([pos, pos]);
        paint_arrow(painter, ends, colour, theme);
        taken.add_line(ends);
        tips.push(ends[1]);
    }
    if ghost.list == List::Feature {
        feature(painter, ghost.geometry, pos, sight);
    }
    painter.circle_filled(pos, 8.5, theme.text);
    painter.circle_filled(pos, 6.5, theme.panel);
    painter.circle_filled(pos, 3.0, theme.text);
    taken.add(Rect::from_center_size(pos, Vec2::splat(20.0)));
    tips
}

/// The snap under the pointer, before a click: thin, and nothing is kept free for it.
pub fn paint_hover(painter: &Painter, geometry: &Geometry, piece: &[Point3], sight: &Sight<'_>) {
    let theme = sight.theme;
    paint_edge(painter, piece, sight);
    let place = geometry.position();
    let Some(pos) = sight.project(&place) else { return };
    let rim = outline_in(geometry, sight);
    if rim.len() > 2 {
        painter.add(Shape::closed_line(rim, Stroke::new(2.5, theme.snap)));
    }
    let towards = match geometry {
        Geometry::Edge { direction, .. } => direction.into_inner(),
        other => other.sheet_normal(),
    };
    if let Some(ends) = arrow(&place, &towards, 0.5 * ARROW, sight) {
        painter.line_segment(ends, Stroke::new(3.0, theme.panel));
        painter.line_segment(ends, Stroke::new(1.5, theme.accent));
    }
    form(painter, geometry.kind(), theme.accent, pos);
}

/// Arrows of a row that is chosen alone, without names.
pub fn paint_chosen(painter: &Painter, geometry: &Geometry, sight: &Sight<'_>, taken: &mut Taken) {
    let (place, theme) = (geometry.position(), sight.theme);
    for Pointing { direction, colour, .. } in directions(geometry, false, theme) {
        if let Some(ends) = arrow(&place, &direction, 0.75 * ARROW, sight) {
            paint_arrow(painter, ends, colour, theme);
            taken.add_line(ends);
        }
    }
    if let Some(pos) = sight.project(&place) {
        ring(painter, pos, theme);
    }
}

/// A piece of a trimmed edge.
pub fn paint_edge(painter: &Painter, piece: &[Point3], sight: &Sight<'_>) {
    let theme = sight.theme;
    let line: Vec<Pos2> = piece.iter().filter_map(|p| sight.project(p)).collect();
    if line.len() > 1 {
        painter.add(Shape::line(line.clone(), Stroke::new(6.5, theme.panel)));
        painter.add(Shape::line(line, Stroke::new(4.0, theme.snap)));
    }
}

fn paint_arrow(painter: &Painter, [from, to]: [Pos2; 2], colour: Color32, theme: &Theme) {
    let along = to - from;
    // Seen from its end an arrow is a dot.
    if along.length() < 6.0 {
        painter.circle_filled(to, 4.5, theme.panel);
        painter.circle_filled(to, 3.2, colour);
        return;
    }
    let unit = along.normalized();
    let head = 11.0_f32.min(0.7 * along.length());
    let neck = to - unit * head;
    painter.line_segment([from, neck], Stroke::new(4.5, theme.panel));
    painter.line_segment([from, neck], Stroke::new(2.5, colour));
    let corners = vec![to, neck + unit.rot90() * 0.42 * head, neck - unit.rot90() * 0.42 * head];
    painter.add(Shape::convex_polygon(corners, colour, Stroke::new(1.0, theme.panel)));
}

/// Words that stand beside something, with a leader.
struct Callout {
    anchor: Pos2,
    text: String,
    colour: Color32,
    font: FontId,
    width: f32,
    gap: f32,
}

/// Writes what the arrows mean, what was snapped to, and the flag with the name, where they cover nothing.
pub fn callouts(
    ui: &mut Ui,
    ghost: &Ghost<'_>,
    name: &str,
    tips: &[Pos2],
    sight: &Sight<'_>,
    taken: &mut Taken,
    words: &Words,
) {
    let theme = sight.theme;
    let Some(pos) = sight.project(&ghost.geometry.position()) else { return };
    let beside = |anchor, text: String, colour| {
        let font = fonts::regular(size::TABLE);
        Callout { anchor, text, colour, font, width: 1.0, gap: 10.0 }
    };
    let flag = format!("{name}  {}", words.text("pick.new"));
    let font = fonts::mono(size::BODY);
    let mut all = vec![Callout { anchor: pos, text: flag, colour: theme.accent, font, width: 2.0, gap: 34.0 }];
    for (pointing, tip) in directions(ghost.geometry, ghost.inwards, theme).into_iter().zip(tips) {
        all.push(beside(*tip, words.text(pointing.key).to_owned(), pointing.colour));
    }
    if let Some((anchor, text)) = snapped(ghost, pos, sight, words) {
        all.push(beside(anchor, text, theme.snap));
    }
    let wish = |c: &Callout| {
        let size = vec2(write::width(ui, &c.text, c.font.clone()) + 16.0, 24.0);
        Wish { anchor: c.anchor, size, gap: c.gap, reach: 190.0 }
    };
    let wishes: Vec<Wish> = all.iter().map(wish).collect();
    let found = labels::place(&wishes, taken, sight.at.shrink(6.0));
    for (callout, place) in all.into_iter().zip(found) {
        let Some(place) = place else { continue };
        let Callout { anchor, text, colour, font, width, .. } = callout;
        let painter = ui.painter();
        let end = labels::leader_end(anchor, place);
        painter.line_segment([anchor, end], Stroke::new(width + 1.5, theme.panel));
        painter.line_segment([anchor, end], Stroke::new(width, colour));
        let frame = Stroke::new(1.0 + 0.5 * width, colour);
        painter.rect(place, CornerRadius::same(4), theme.panel, frame, StrokeKind::Inside);
        painter.text(place.center(), Align2::CENTER_CENTER, &text, font, theme.text);
        write::named(ui, place, &text);
    }
}

/// What the shape was snapped to, and where that is told.
fn snapped(ghost: &Ghost<'_>, pos: Pos2, sight: &Sight<'_>, words: &Words) -> Option<(Pos2, String)> {
    let side = |points: &[Pos2]| points.iter().copied().max_by(|a, b| a.distance(pos).total_cmp(&b.distance(pos)));
    match ghost.geometry {
        Geometry::Surface { .. } => None,
        Geometry::Edge { .. } => {
            let ends = [ghost.piece.first()?, ghost.piece.last()?].map(|p| sight.project(p));
            let ends: Vec<Pos2> = ends.into_iter().flatten().filter(|p| sight.at.contains(*p)).collect();
            Some((side(&ends)?, words.text("pick.snapped_edge").to_owned()))
        }
        Geometry::Hole { diameter_mm, .. } => {
            let text = words.fill("pick.snapped_hole", &[("mm", &words.number(*diameter_mm, 3))]);
            Some((rightmost(&outline_in(ghost.geometry, sight)).unwrap_or(pos), text))
        }
        Geometry::Slot { length_mm, width_mm, .. } => {
            let (length, width) = (words.number(*length_mm, 3), words.number(*width_mm, 3));
            let text = words.fill("pick.snapped_slot", &[("length", &length), ("width", &width)]);
            Some((rightmost(&outline_in(ghost.geometry, sight)).unwrap_or(pos), text))
        }
    }
}

fn rightmost(points: &[Pos2]) -> Option<Pos2> {
    points.iter().copied().max_by(|a, b| a.x.total_cmp(&b.x))
}
