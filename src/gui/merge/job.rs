//! How far a merge under way is, and how it is stopped.

use super::act::Command;
use super::facts::MergeRun;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::operator::stage_words;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::buttons::{self, Weight};
use crate::gui::widgets::{cards, words as write};
use egui::{Align2, Rect, Role, Ui, WidgetInfo, pos2};

/// Draws the line.
pub fn job_ui(ui: &mut Ui, at: Rect, run: &MergeRun, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let inside = at.shrink2(egui::vec2(14.0, 4.0));
    let text = format!("{}  Esc", words.text("merge.stop"));
    let wide = write::width(ui, &text, fonts::semibold(size::BODY)) + 32.0;
    let stop = inside.with_min_x(inside.right() - wide);
    let name = words.text("merge.stop");
    let (response, colour) = buttons::at(ui, "stop merge", stop, Weight::Quiet, !run.stopping, name, theme);
    ui.painter().text(stop.center(), Align2::CENTER_CENTER, &text, fonts::semibold(size::BODY), colour);
    if response.clicked() {
        scope.ask(Action::Merge(Command::Stop));
    }
    let mut right = stop.left() - 14.0;
    let seconds = scope.now.saturating_duration_since(run.since).as_secs_f64();
    let told = told(run, seconds, scope);
    let font = fonts::regular(size::BODY);
    let wide = write::width(ui, &told, font.clone()) + 4.0;
    if wide < 0.4 * inside.width() {
        let place = Rect::from_min_max(pos2(right - wide, inside.top()), pos2(right, inside.bottom()));
        write::line(ui, place, Align2::RIGHT_CENTER, &told, font, theme.quiet);
        right = place.left() - 14.0;
    }
    let title = title(run, scope);
    let half = inside.with_max_x(right);
    let wide = write::width(ui, &title, fonts::semibold(size::BODY)).min(0.7 * half.width()) + 2.0;
    let place = half.with_max_x(half.left() + wide);
    write::line(ui, place, Align2::LEFT_CENTER, &title, fonts::semibold(size::BODY), theme.text);
    let bar = Rect::from_min_max(pos2(place.right() + 14.0, at.center().y - 5.0), pos2(right, at.center().y + 5.0));
    if bar.width() > 20.0 {
        cards::bar(ui, bar, run.share(), theme.accent, theme);
        let response = ui.interact(bar, ui.scope_id().with("progress"), egui::Sense::hover());
        let percent = words.number(100.0 * f64::from(run.share()), 0);
        response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, format!("{percent} %")));
    }
}

/// What is done now.
fn title(run: &MergeRun, scope: &Scope) -> String {
    let words = scope.words;
    if run.stopping {
        return words.text("merge.stopping").to_owned();
    }
    let stage = stage_words(words, run.stage);
    match (&run.view, run.stage) {
        (_, Some(crate::run::Stage::Register | crate::run::Stage::Merge | crate::run::Stage::Report)) | (None, _) => {
            words.fill("merge.under_way", &[("stage", stage)])
        }
        (Some((index, of, name)), _) => {
            let values = [("n", words.thousands(*index)), ("of", words.thousands(*of)), ("name", name.clone())];
            words.fill("merge.view_of", &values.each_ref().map(|(key, value)| (*key, value.as_str())))
        }
    }
}

/// How long it has been at it, and about how long it will.
fn told(run: &MergeRun, seconds: f64, scope: &Scope) -> String {
    let words = scope.words;
    let share = f64::from(run.share());
    let so_far = words.number(seconds, 0);
    if share < 0.1 || seconds < 2.0 {
        return format!("{so_far} s");
    }
    let left = words.number((seconds * (1.0 - share) / share).max(1.0), 0);
    words.fill("merge.seconds", &[("s", &so_far), ("left", &left)])
}
