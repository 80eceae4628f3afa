//! The deviation map of the last part, with flags at its worst points; on wide screens only.

use crate::gui::action::{Action, Screen};
use crate::gui::facts::FinishedPart;
use crate::gui::fonts;
use crate::gui::picture::Painter;
use crate::gui::scene::overlay::{self, Mark, Placed};
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::words;
use crate::inspect::{Outcome, PointResult, Verdict};
use crate::report::palette::Palette;
use crate::report::words::{clean, is_distance, worst_first};
use egui::{Align2, Color32, CornerRadius, Mesh, Rect, Shape, Stroke, StrokeKind, Ui, pos2, vec2};
use std::sync::Arc;

/// Room beside the picture for flags, points.
const MARGIN: f32 = 140.0;
/// How many points get a flag.
const FLAGS: usize = 4;

/// Draws the card of a part.
pub(super) fn map_ui(ui: &mut Ui, place: Rect, part: &Arc<FinishedPart>, painter: &mut Painter, scope: &mut Scope) {
    let theme = scope.theme;
    let stroke = Stroke::new(1.0, theme.stroke);
    ui.painter().rect(place, CornerRadius::same(6), theme.scene, stroke, StrokeKind::Inside);
    let room = place.shrink2(vec2(MARGIN, 12.0));
    let scale = ui.ctx().pixels_per_point();
    let size_px = [room.width(), room.height()].map(|s| (s * scale).max(1.0) as usize);
    let Some(shown) = painter.of(ui.ctx(), part, size_px) else { return };
    let size = vec2(shown.picture.width_px as f32, shown.picture.height_px as f32) / scale;
    let at = Align2::CENTER_CENTER.align_size_within_rect(size, room);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(shown.texture.id(), at, whole, Color32::WHITE);
    let name = scope.words.fill("operator.map", &[("n", &scope.words.thousands(part.index))]);
    words::named(ui, at, &name);
    let Outcome::Measured(inspection) = &part.result.outcome else { return };
    let worst = worst_first(&inspection.points);
    let bad: Vec<usize> =
        worst.into_iter().filter(|k| inspection.points[*k].verdict != Verdict::Pass).take(FLAGS).collect();
    let marks: Vec<Mark> = bad.iter().map(|k| mark(&inspection.points[*k], scope.words)).collect();
    let placed = |mark: &Mark| {
        let [x, y] = shown.picture.place_px(&mark.place);
        Some(Placed { pos: at.min + vec2(x as f32, y as f32) / scale, hidden: false })
    };
    let places: Vec<Option<Placed>> = marks.iter().map(placed).collect();
    let all: Vec<usize> = (0..marks.len()).collect();
    let banners = overlay::banners(ui, place, &marks, &places, &all, &[]);
    overlay::leaders(&ui.painter_at(place), &banners, None, theme);
    overlay::markers(ui.painter(), &marks, &places, None, theme);
    let clicked = overlay::flags(ui, &banners, &marks, None, theme);
    legend(ui, place, part.result.map_range_mm, scope);
    if let Some(k) = clicked {
        scope.ask(Action::ChoosePart(Some(scope.facts.parts.len() - 1)));
        scope.ask(Action::ChoosePoint(Some(bad[k])));
        scope.ask(Action::Show(Screen::Results));
    }
}

fn mark(point: &PointResult, w: &Words) -> Mark {
    let value = point.measurement.as_ref().map(|m| match is_distance(point) {
        true => w.number(m.deviation_mm.abs(), 3),
        false => w.signed_mm(m.deviation_mm),
    });
    Mark {
        kind: point.kind,
        verdict: point.verdict,
        place: point.nominal,
        name: clean(&point.name),
        value: value.unwrap_or_else(|| w.text("results.no_value").to_owned()),
    }
}

/// The colours and what they stand for, in the lower right.
fn legend(ui: &Ui, place: Rect, range_mm: f64, scope: &Scope) {
    let bar = Rect::from_min_size(place.right_bottom() + vec2(-160.0, -40.0), vec2(146.0, 10.0));
    let mut mesh = Mesh::default();
    let stops = Palette::default().stops();
    for (k, stop) in stops.iter().enumerate() {
        let x = bar.left() + bar.width() * k as f32 / (stops.len() - 1) as f32;
        let colour = Color32::from_rgb(stop[0], stop[1], stop[2]);
        mesh.colored_vertex(pos2(x, bar.top()), colour);
        mesh.colored_vertex(pos2(x, bar.bottom()), colour);
        if k > 0 {
            let last = 2 * k as u32;
            mesh.add_triangle(last - 2, last - 1, last);
            mesh.add_triangle(last - 1, last, last + 1);
        }
    }
    ui.painter().add(Shape::mesh(mesh));
    let (font, colour) = (fonts::mono(size::NOTE), scope.theme.text);
    let below = bar.bottom() + 3.0;
    let decimals = if range_mm < 1.0 { 2 } else { 1 };
    let end = |sign: f64| scope.words.number(sign * range_mm, decimals);
    ui.painter().text(pos2(bar.left(), below), Align2::LEFT_TOP, end(-1.0), font.clone(), colour);
    ui.painter().text(pos2(bar.center().x, below), Align2::CENTER_TOP, "0", font.clone(), colour);
    ui.painter().text(pos2(bar.right(), below), Align2::RIGHT_TOP, format!("+{} mm", end(1.0)), font, colour);
}
