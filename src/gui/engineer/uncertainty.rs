//! The uncertainty to expect at a point before anything is measured, and what other datums would leave there.

use super::desk::ChoiceKind;
use super::editing::Editing;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use crate::inspect::{Foretold, ForetoldPoint};
use egui::{Align2, CornerRadius, Rect, RichText, Sense, Stroke, Ui, pos2, vec2};

fn of<'f>(foretold: &'f Foretold, name: &str) -> Option<&'f ForetoldPoint> {
    foretold.points.iter().find(|point| point.name == name)
}

/// Bars of what it is made of, and the choices.
pub fn panel_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing, name: &str) {
    let (words, theme) = (scope.words, scope.theme);
    ui.add_space(6.0);
    ui.separator();
    ui.label(RichText::new(words.text("engineer.expected_u")).font(fonts::semibold(size::BODY)));
    let now = editing.choices.first().and_then(|choice| choice.foretold.as_ref());
    let Some((foretold, point)) = now.and_then(|foretold| Some((foretold, of(foretold, name)?))) else {
        let key = if editing.choices.is_empty() { "engineer.u_is_told_soon" } else { "engineer.u_not_told" };
        ui.label(RichText::new(words.text(key)).size(size::NOTE).color(theme.quiet));
        return;
    };
    let spacing = words.number(foretold.spacing_mm, 3);
    let source = if foretold.from_rig { "engineer.u_from_rig" } else { "engineer.u_without_rig" };
    let source = words.fill(source, &[("spacing", &spacing)]);
    ui.label(RichText::new(source).size(size::NOTE).color(theme.quiet));
    ui.add_space(4.0);
    let e = &point.expected;
    let half_mm = 0.5 * (point.upper_mm - point.lower_mm);
    let shares = [
        ("engineer.u_point", e.point_mm, theme.accent),
        ("engineer.u_datums", e.pose_mm, theme.accent.gamma_multiply(0.6)),
        ("engineer.u_common", e.common_mm, theme.strong_stroke),
        ("engineer.u_together", e.u_mm, theme.text),
    ];
    // The limit is in sight unless it is far away from what can be expected.
    let most = e.u_mm.max(if half_mm < 4.0 * e.u_mm { half_mm } else { 0.0 }) * 1.08;
    let mut bars = Rect::NOTHING;
    for (key, mm, colour) in shares {
        let bar = bar_ui(ui, scope, words.text(key), mm, most, colour, key == "engineer.u_together");
        bars = bars.union(bar);
    }
    let limit = bars.left() + (half_mm / most) as f32 * bars.width();
    let needed = words.fill("engineer.u_needed", &[("mm", &words.number(half_mm, 3))]);
    if limit <= bars.right() && half_mm > 0.0 {
        let line = [pos2(limit, bars.top() - 2.0), pos2(limit, bars.bottom() + 4.0)];
        ui.painter().extend(egui::Shape::dashed_line(&line, Stroke::new(1.5, theme.fail), 4.0, 3.0));
    }
    ui.label(RichText::new(needed).size(size::NOTE).color(theme.quiet));
    choices_ui(ui, scope, editing, name);
}

fn bar_ui(ui: &mut Ui, scope: &Scope, label: &str, mm: f64, most: f64, colour: egui::Color32, together: bool) -> Rect {
    let theme = scope.theme;
    let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), 20.0), Sense::hover());
    let words_end = line.left() + 0.36 * line.width();
    let number_from = line.right() - 72.0;
    let font = if together { fonts::semibold(size::NOTE) } else { fonts::regular(size::NOTE) };
    write::line(ui, line.with_max_x(words_end - 6.0), Align2::LEFT_CENTER, label, font, theme.text);
    let track = Rect::from_min_max(pos2(words_end, line.top() + 5.0), pos2(number_from, line.bottom() - 5.0));
    let share = if most > 0.0 { (mm / most).clamp(0.0, 1.0) as f32 } else { 0.0 };
    let bar = track.with_max_x(track.left() + (share * track.width()).max(1.0));
    ui.painter().rect_filled(bar, CornerRadius::same(1), colour);
    let text = format!("{} mm", scope.words.number(mm, 3));
    let place = line.with_min_x(number_from + 4.0);
    write::line(ui, place, Align2::RIGHT_CENTER, &text, fonts::mono(size::NOTE), theme.text);
    track
}

/// What a choice is called.
pub fn choice_words(words: &Words, kind: &ChoiceKind) -> String {
    let of = |key: &str, [hole, slot, point]: &[String; 3]| {
        words.fill(key, &[("hole", hole), ("slot", slot), ("point", point)])
    };
    match kind {
        ChoiceKind::Now => words.text("engineer.as_now").to_owned(),
        ChoiceKind::CentreLine(names) => of("engineer.by_centre_line", names),
        ChoiceKind::Axis(names) => of("engineer.by_axis", names),
        ChoiceKind::BestFit => words.text("choice.best_fit").to_owned(),
    }
}

fn choices_ui(ui: &mut Ui, scope: &Scope, editing: &Editing, name: &str) {
    let (words, theme) = (scope.words, scope.theme);
    ui.add_space(6.0);
    let line = |ui: &mut Ui, left: &str, right: &str, head: bool, chosen: bool| {
        let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), 22.0), Sense::hover());
        if chosen {
            ui.painter().rect_filled(line, 2, theme.choice);
        }
        let inner = line.shrink2(vec2(6.0, 0.0));
        let colour = if head { theme.quiet } else { theme.text };
        let font = if head { fonts::semibold(size::NOTE) } else { fonts::regular(size::NOTE) };
        let number = inner.with_min_x(inner.right() - 96.0);
        write::line(ui, inner.with_max_x(number.left() - 6.0), Align2::LEFT_CENTER, left, font.clone(), colour);
        let font = if head { font } else { fonts::mono(size::NOTE) };
        write::line(ui, number, Align2::RIGHT_CENTER, right, font, colour);
        ui.painter().hline(line.x_range(), line.bottom(), Stroke::new(1.0, theme.stroke));
    };
    let u_of = words.fill("engineer.u_of", &[("name", name)]);
    line(ui, words.text("engineer.held_by"), &u_of, true, false);
    for (k, choice) in editing.choices.iter().enumerate() {
        let point = choice.foretold.as_ref().and_then(|foretold| of(foretold, name));
        let u = point.map_or_else(|| "–".to_owned(), |p| format!("{} mm", words.number(p.expected.u_mm, 3)));
        line(ui, &choice_words(words, &choice.kind), &u, false, k == 0);
    }
}
