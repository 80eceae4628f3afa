//! Cards, and the bars that stand on them.

use super::words;
use crate::gui::fonts;
use crate::gui::theme::{Theme, size};
use egui::{Align2, CornerRadius, Rect, Stroke, StrokeKind, Ui, pos2};

/// An empty card.
pub fn card(ui: &Ui, place: Rect, theme: &Theme) {
    let stroke = Stroke::new(1.0, theme.stroke);
    ui.painter().rect(place, CornerRadius::same(6), theme.panel, stroke, StrokeKind::Inside);
}

/// A frame over the screen that takes all clicks until it is shut.
pub fn modal(ui: &Ui, id: egui::Id) -> egui::Modal {
    egui::Modal::new(id).frame(egui::Frame::popup(ui.style()).inner_margin(24))
}

/// A share of a place's width, filled; 0 to 1.
pub fn bar(ui: &Ui, place: Rect, share: f32, fill: egui::Color32, theme: &Theme) {
    let radius = CornerRadius::same(3);
    ui.painter().rect_filled(place, radius, theme.raised);
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    if share > 0.0 {
        let filled = Rect::from_min_max(place.min, pos2(place.left() + share * place.width(), place.bottom()));
        ui.painter().rect_filled(filled, radius, fill);
    }
}

/// Steps side by side with their names below: done, under way, to come. `at` is how many are done.
pub fn steps(ui: &mut Ui, place: Rect, names: &[&str], at: Option<usize>, theme: &Theme) {
    let gap = 6.0;
    let each = (place.width() - gap * (names.len() as f32 - 1.0)) / names.len() as f32;
    // All names in one size, none cut: in one line, else by turns in two, else only the one that is under way, with the whole line for it.
    let fits = |wide: f32| {
        let fit = |name: &&str| words::fitting_size(ui, name, fonts::semibold, wide, size::TABLE, 1.0);
        names.iter().map(fit).fold(size::TABLE, f32::min)
    };
    let (in_one, in_two) = (fits(each + gap - 10.0), fits(2.0 * (each + gap) - 10.0).min(size::NOTE));
    let lines = if in_one >= 11.0 { 1 } else { 2 };
    let points = if lines == 1 { in_one } else { in_two };
    let whole = points >= 11.0 && (lines == 1 || place.height() >= 38.0);
    for (k, name) in names.iter().enumerate() {
        let left = place.left() + k as f32 * (each + gap);
        let step = Rect::from_min_max(pos2(left, place.top()), pos2(left + each, place.top() + 12.0));
        let share = match at {
            Some(now) if k < now => 1.0,
            // How far a stage has come is not known: half, until the next begins.
            Some(now) if k == now => 0.5,
            _ => 0.0,
        };
        bar(ui, step, share, theme.accent, theme);
        let under_way = at == Some(k);
        if !whole {
            if under_way {
                let line = Rect::from_min_max(pos2(place.left(), step.bottom() + 5.0), place.max);
                words::line(ui, line, Align2::LEFT_TOP, name, fonts::semibold(size::TABLE), theme.text);
            }
            continue;
        }
        let font = if under_way { fonts::semibold } else { fonts::regular };
        let colour = if under_way { theme.text } else { theme.quiet };
        let top = step.bottom() + if lines == 1 { 5.0 } else { 13.0 * (k % 2) as f32 };
        // The last one of two lines ends with the bar.
        let wide = lines as f32 * (each + gap) - 6.0;
        let left = left.min(place.right() - words::width(ui, name, font(points)) - 1.0).max(place.left());
        let below = Rect::from_min_max(pos2(left, top), pos2(left + wide, place.bottom()));
        words::line(ui, below, Align2::LEFT_TOP, name, font(points), colour);
    }
}
