//! A distance between two places that were clicked.

use super::camera::Camera;
use super::linked::size_of;
use super::pick::{self, Pick};
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use egui::{Align2, Pos2, Rect, Stroke, Ui, pos2, vec2};

/// The two ends of a distance and what lies between them.
pub fn distance_ui(ui: &mut Ui, at: Rect, camera: &Camera, picks: &[Pick], scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let size = size_of(at);
    let place = |p: &Pick| camera.project(&p.place, size).map(|s| pos2(at.left() + s.x as f32, at.top() + s.y as f32));
    let ends: Vec<Pos2> = picks.iter().filter_map(place).collect();
    let painter = ui.painter_at(at);
    if let [a, b] = ends[..] {
        painter.line_segment([a, b], Stroke::new(4.0, theme.panel));
        painter.line_segment([a, b], Stroke::new(2.0, theme.accent));
    }
    for end in &ends {
        painter.circle_filled(*end, 5.0, theme.panel);
        painter.circle_stroke(*end, 4.0, Stroke::new(2.0, theme.accent));
    }
    let text = match picks {
        [a, b] => {
            let d = pick::distance(a, b);
            let along = d.along_mm;
            words.fill(
                "results.distance",
                &[
                    ("mm", &words.number(d.straight_mm, 3)),
                    ("x", &words.signed_mm(along.x)),
                    ("y", &words.signed_mm(along.y)),
                    ("z", &words.signed_mm(along.z)),
                    ("deg", &words.number(d.angle_deg, 1)),
                ],
            )
        }
        [_] => words.text("results.measure_second").to_owned(),
        _ => words.text("results.measure_first").to_owned(),
    };
    let wide = write::width(ui, &text, fonts::regular(size::BODY)) + 24.0;
    let box_at = Rect::from_center_size(pos2(at.center().x, at.top() + 26.0), vec2(wide, 30.0));
    ui.painter().rect(box_at, 4, theme.panel, Stroke::new(2.0, theme.accent), egui::StrokeKind::Inside);
    write::line(ui, box_at, Align2::CENTER_CENTER, &text, fonts::regular(size::BODY), theme.text);
}
