//! The small cards: takt, parts waiting, watching, and the way to the part in detail.

use super::now::seconds_a_part;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::buttons::{self, Weight};
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::{cards, sign, words};
use egui::{Align2, Rect, Stroke, Ui, Vec2, pos2, vec2};

/// Seconds a part against the takt.
pub(super) fn takt_ui(ui: &mut Ui, place: Rect, scope: &Scope) {
    let (w, theme) = (scope.words, scope.theme);
    cards::card(ui, place, theme);
    let inner = place.shrink2(vec2(18.0, 12.0));
    let mean = seconds_a_part(scope);
    let takt = scope.facts.plan_path.as_ref().and_then(|path| scope.settings.takt_s(path));
    let tall = inner.height() > 100.0;
    let row = inner.with_max_y(inner.top() + if tall { 46.0 } else { 36.0 });
    let figure = mean.map_or_else(|| "–".to_owned(), |s| w.number(s, 1));
    let font = fonts::mono(if tall { 40.0 } else { 32.0 });
    let number = words::line(ui, row, Align2::LEFT_CENTER, &figure, font, theme.text);
    let beside = row.with_min_x(number.right() + 10.0);
    let unit = w.text("operator.seconds_a_part");
    let told = match takt {
        Some(takt) => w.fill("operator.takt", &[("s", &w.number(takt, 1))]),
        None => w.text("operator.no_takt").to_owned(),
    };
    // Both shrink alike where a language needs more room.
    let both = format!("{unit}   {told}");
    let fit = words::fitting_size(ui, &both, fonts::regular, beside.width(), size::CARD, size::NOTE);
    words::line(ui, beside, Align2::LEFT_CENTER, unit, fonts::regular(fit), theme.text);
    words::line(ui, beside, Align2::RIGHT_CENTER, &told, fonts::regular(fit.min(size::BAR)), theme.quiet);
    let bar = Rect::from_min_max(pos2(inner.left(), row.bottom() + 6.0), pos2(inner.right(), row.bottom() + 24.0));
    let (Some(takt), true) = (takt, bar.bottom() <= inner.bottom()) else {
        let hint = w.text("operator.takt_hint");
        words::line(ui, inner.with_min_y(row.bottom()), Align2::LEFT_CENTER, hint, fonts::regular(15.0), theme.quiet);
        return;
    };
    // The bar is 1.25 takts long.
    let share = mean.map_or(0.0, |s| s / (1.25 * takt)) as f32;
    let missed = mean.is_some_and(|s| s > takt);
    cards::bar(ui, bar, share, if missed { theme.text } else { theme.accent }, theme);
    let tick = bar.left() + 0.8 * bar.width();
    ui.painter().vline(tick, bar.top() - 5.0..=bar.bottom() + 5.0, Stroke::new(3.0, theme.text));
    let Some(by) = mean.map(|s| s - takt) else { return };
    let note = Rect::from_min_max(pos2(inner.left(), bar.bottom() + 4.0), inner.max);
    if note.height() >= 16.0 || missed {
        let note = if note.height() >= 16.0 { note } else { bar.translate(vec2(0.0, 2.0)) };
        takt_note(ui, note, by, missed, scope);
    }
}

/// By how much the takt is kept or missed; a miss has the sign of a warning, never a verdict's.
fn takt_note(ui: &mut Ui, place: Rect, by: f64, missed: bool, scope: &Scope) {
    let w = scope.words;
    let key = if missed { "operator.slower" } else { "operator.faster" };
    let text = w.fill(key, &[("s", &w.number(by.abs(), 1))]);
    if missed {
        let side = place.height().min(22.0);
        let mark = Rect::from_min_size(place.left_center() - vec2(0.0, 0.5 * side), Vec2::splat(side));
        sign::problem(ui.painter(), mark, false, scope.theme);
        let rest = place.with_min_x(mark.right() + 8.0);
        words::line(ui, rest, Align2::LEFT_CENTER, &text, fonts::semibold(15.0), scope.theme.undecided_text);
    } else {
        words::line(ui, place, Align2::LEFT_CENTER, &text, fonts::regular(15.0), scope.theme.quiet);
    }
}

/// How many parts wait.
pub(super) fn waiting_ui(ui: &mut Ui, place: Rect, scope: &Scope) {
    let (w, theme) = (scope.words, scope.theme);
    cards::card(ui, place, theme);
    let count = match (scope.facts.running(), &scope.facts.scans) {
        (Some(running), _) => {
            let at_hand = running.scan.as_ref().map(|scan| &scan.path);
            running.waiting + scope.facts.troubles.unfinished.iter().filter(|u| Some(&u.scan) != at_hand).count()
        }
        (None, Some(Ok(scans))) if scope.facts.last_end.is_none() => scans.len(),
        _ => scope.facts.left_over + scope.facts.arrived.len(),
    };
    let (figure, text) = (w.thousands(count), w.text("operator.parts_waiting"));
    let inner = place.shrink2(vec2(12.0, 10.0));
    if place.width() < 240.0 {
        let middle = inner.top() + 0.62 * inner.height();
        words::line(ui, inner.with_max_y(middle), Align2::CENTER_CENTER, &figure, fonts::mono(42.0), theme.text);
        let fit = words::fitting_size(ui, text, fonts::semibold, inner.width(), size::BODY, 11.0);
        words::line(ui, inner.with_min_y(middle), Align2::CENTER_CENTER, text, fonts::semibold(fit), theme.text);
        return;
    }
    let inner = inner.with_min_x(inner.left() + 8.0);
    let number = words::line(ui, inner, Align2::LEFT_CENTER, &figure, fonts::mono(44.0), theme.text);
    let rest = inner.with_min_x(number.right() + 18.0);
    let shift = shift_ui(ui, rest, scope);
    let rest = rest.with_max_x(shift);
    let fit = words::fitting_size(ui, text, fonts::semibold, rest.width(), 20.0, 13.0);
    words::line(ui, rest, Align2::LEFT_CENTER, text, fonts::semibold(fit), theme.text);
}

/// Good, bad and other parts of this shift on the right of a place; returns where they begin.
fn shift_ui(ui: &mut Ui, place: Rect, scope: &Scope) -> f32 {
    let (w, theme, shift) = (scope.words, scope.theme, &scope.settings.shift);
    let others = shift.undecided + shift.incomplete + shift.refused;
    let counts = [(Sign::Refused, others), (Sign::Fail, shift.fail), (Sign::Pass, shift.pass)];
    let font = fonts::mono(26.0);
    let caption = w.text("operator.this_shift");
    let figures = counts.map(|(_, n)| w.thousands(n));
    let wide: f32 = figures.iter().map(|n| words::width(ui, n, font.clone()) + 48.0).sum();
    let wide = wide.max(words::width(ui, caption, fonts::regular(size::NOTE)));
    if shift.total() == 0 || wide > 0.62 * place.width() {
        return place.right();
    }
    let left = place.right() - wide;
    let below = Rect::from_min_max(pos2(left, place.top() + 18.0), place.max);
    let said = format!("{caption}: {}, {}, {}", figures[2], figures[1], figures[0]);
    words::named(ui, place.with_min_x(left), &said);
    let top = Rect::from_min_max(pos2(left, place.top() - 4.0), pos2(place.right(), place.top() + 16.0));
    words::line(ui, top, Align2::RIGHT_CENTER, caption, fonts::regular(size::NOTE), theme.quiet);
    let mut x = place.right();
    for ((sign, _), figure) in counts.into_iter().zip(figures) {
        let number = Rect::from_min_max(
            pos2(x - words::width(ui, &figure, font.clone()) - 2.0, below.top()),
            pos2(x, below.bottom()),
        );
        words::line(ui, number, Align2::RIGHT_CENTER, &figure, font.clone(), theme.text);
        let mark = Rect::from_center_size(pos2(number.left() - 16.0, below.center().y), Vec2::splat(24.0));
        sign.paint(ui.painter(), mark, theme);
        x = mark.left() - 18.0;
    }
    left - 12.0
}

/// Whether a run watches the folder.
pub(super) fn watch_ui(ui: &mut Ui, place: Rect, scope: &mut Scope) {
    let w = scope.words;
    let on = scope.settings.watch;
    let can = on || scope.facts.plan.is_some();
    let note = match (scope.facts.running(), on) {
        _ if !can => "operator.watch_needs_plan",
        (Some(running), _) if running.watch != on => "operator.from_next_run",
        (Some(_), true) => "operator.watch_on",
        (None, true) => "operator.press_watch",
        (_, false) => "operator.watch_off",
    };
    let note = if place.width() < 280.0 && !on && can { "" } else { w.text(note) };
    if buttons::switch(ui, place, on, can, [w.text("operator.watch"), note], scope.theme).clicked() {
        scope.ask(Action::Watch(!on));
    }
}

/// To the newest part in detail; before there is one, to another plan.
pub(super) fn show_ui(ui: &mut Ui, place: Rect, scope: &mut Scope) {
    let w = scope.words;
    let (title, note, action) = match scope.facts.parts.last() {
        Some(part) => {
            let title = w.fill("operator.show_part", &[("n", &w.thousands(part.index))]);
            (title, w.text("operator.opens_results").to_owned(), Action::ChoosePart(Some(scope.facts.parts.len() - 1)))
        }
        None => {
            let recent = w.count("operator.recent", scope.settings.recent.len());
            (w.text("operator.choose_plan").to_owned(), recent, Action::AskForPlan)
        }
    };
    let (response, colour) = buttons::at(ui, "show", place, Weight::Plain, true, &title, scope.theme);
    let fit = words::fitting_size(ui, &title, fonts::semibold, place.width() - 24.0, 20.0, 13.0);
    let middle = place.center();
    ui.painter().text(middle, Align2::CENTER_BOTTOM, &title, fonts::semibold(fit), colour);
    let below = middle + vec2(0.0, 3.0);
    ui.painter().text(below, Align2::CENTER_TOP, note, fonts::regular(15.0), scope.theme.quiet);
    if response.clicked() {
        scope.ask(action);
    }
}
