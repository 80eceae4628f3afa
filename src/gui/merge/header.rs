//! The line below the bar: which merge, what of its masks is not kept, and the button that merges. What has no room folds into a menu.

use super::act::{Command, is_locked, may_merge};
use super::facts::{Merging, ViewsState};
use super::figures;
use super::state::{MergeView, Pane};
use crate::gui::action::Action;
use crate::gui::breadth::Breadth;
use crate::gui::facts::Job;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::buttons::{self, Weight};
use crate::gui::widgets::words as write;
use egui::{Align2, Button, Popup, Rect, RichText, Role, Ui, WidgetInfo, pos2, vec2};

const GAP: f32 = 8.0;
const HIGH: f32 = 32.0;

/// Draws it.
pub fn header_ui(ui: &mut Ui, at: Rect, breadth: Breadth, merging: &Merging, scope: &mut Scope) {
    let texts = scope.words;
    let font = fonts::semibold(size::BODY);
    let wide = |ui: &Ui, text: &str| write::width(ui, text, fonts::semibold(size::BODY)) + 28.0;
    let can = may_merge(&scope.facts.job, merging);
    let label = texts.text(if merging.done.is_some() { "merge.again" } else { "merge.merge" });
    let mut right = at.right();
    let mut place = |ui: &Ui, text: &str| {
        let place = Rect::from_min_max(
            pos2(right - wide(ui, text), at.center().y - 0.5 * HIGH),
            pos2(right, at.center().y + 0.5 * HIGH),
        );
        right = place.left() - GAP;
        place
    };
    let main = place(ui, label);
    let (response, colour) = buttons::at(ui, "merge", main, Weight::Main, can.is_ok(), label, scope.theme);
    ui.painter().text(main.center(), Align2::CENTER_CENTER, label, font.clone(), colour);
    if response.clicked() {
        scope.ask(Action::Merge(Command::Merge));
    }
    let items = items(merging, scope);
    let words: Vec<&str> = items.iter().map(|(key, ..)| texts.text(key)).collect();
    let all: f32 = words.iter().map(|text| wide(ui, text) + GAP).sum();
    let folded = breadth == Breadth::Narrow || all + 340.0 > main.left() - at.left();
    if folded {
        let more = texts.text("bar.more");
        let at = place(ui, more);
        let button = buttons::with_words(ui, "merge more", at, Weight::Quiet, more, font, scope.theme);
        Popup::menu(&button).show(|ui| {
            for ((_, enabled, command), text) in items.iter().zip(&words) {
                let row = Button::new(RichText::new(*text).size(size::BODY)).min_size(vec2(200.0, 32.0));
                if ui.add_enabled(*enabled, row).clicked() {
                    scope.ask(Action::Merge(command.clone()));
                    ui.close();
                }
            }
        });
    } else {
        for ((key, enabled, command), text) in items.iter().zip(&words) {
            let at = place(ui, text);
            let (response, colour) = buttons::at(ui, key, at, Weight::Quiet, *enabled, text, scope.theme);
            ui.painter().text(at.center(), Align2::CENTER_CENTER, *text, font.clone(), colour);
            if response.clicked() {
                scope.ask(Action::Merge(command.clone()));
            }
        }
    }
    name_ui(ui, at.with_max_x(right - GAP), merging, can.err(), scope);
}

/// The other buttons from the right: the key of the words, whether it can be pressed, what it does.
fn items(merging: &Merging, scope: &Scope) -> [(&'static str, bool, Command); 4] {
    let changed = merging.is_changed();
    let idle = !matches!(scope.facts.job, Job::Merging(_));
    let locked = is_locked(scope.settings, scope.lock, scope.now);
    [
        (if locked { "merge.keep_locked" } else { "merge.keep" }, changed && merging.is_sound(), Command::Keep),
        ("merge.revert", changed, Command::Revert),
        ("merge.copy_lines", merging.plan.is_some(), Command::CopyLines),
        ("merge.read_again", idle, Command::Reload),
    ]
}

/// The file's name, and below it what it is about or why nothing can be merged.
fn name_ui(ui: &mut Ui, at: Rect, merging: &Merging, why_not: Option<&str>, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let upper = at.with_max_y(at.center().y + 1.0);
    write::line(ui, upper, Align2::LEFT_BOTTOM, &merging.name(), fonts::semibold(size::BAR), theme.text);
    let lower = at.with_min_y(at.center().y + 1.0);
    let note = match why_not {
        Some("merge.merging_already") | None => about(merging, scope),
        Some(why) => words.text(why).to_owned(),
    };
    write::line(ui, lower, Align2::LEFT_TOP, &note, fonts::regular(size::NOTE), theme.quiet);
}

fn about(merging: &Merging, scope: &Scope) -> String {
    let words = scope.words;
    let Some(plan) = &merging.plan else { return String::new() };
    let views = match &merging.views {
        ViewsState::Ready(preview) => Some(words.count("merge.count_views", preview.files.len())),
        _ => None,
    };
    let unit = words.fill("merge.unit", &[("unit", figures::unit(plan.unit))]);
    let features = plan.features.iter().map(|feature| match feature.radius {
        Some(radius) => format!("{}, r = {}", feature.name, figures::with_unit(radius, plan.unit, words)),
        None => feature.name.clone(),
    });
    let changed = merging.is_changed().then(|| words.text("merge.not_kept").to_owned());
    let all: Vec<String> = changed.into_iter().chain(views).chain([unit]).chain(features).collect();
    all.join("   ")
}

/// The tabs of a small window.
pub fn tabs_ui(ui: &mut Ui, at: Rect, view: &mut MergeView, scope: &Scope) {
    let words = scope.words;
    let pad = 22.0;
    let texts = Pane::ALL.map(|pane| words.text(pane.key()));
    let all = |ui: &Ui, points: f32| -> f32 {
        texts.iter().map(|text| write::width(ui, text, fonts::semibold(points)) + pad + 6.0).sum()
    };
    let points = [size::BODY, size::TABLE, size::NOTE].into_iter().find(|p| all(ui, *p) <= at.width()).unwrap_or(11.0);
    let squeeze = (at.width() / all(ui, points)).min(1.0);
    let mut x = at.left();
    for (pane, text) in Pane::ALL.into_iter().zip(texts) {
        let wide = squeeze * (write::width(ui, text, fonts::semibold(points)) + pad);
        let place = Rect::from_min_size(pos2(x, at.center().y - 15.0), vec2(wide, 30.0));
        ui.scope(|ui| {
            ui.spacing_mut().button_padding.x = 2.0;
            let chosen = view.pane == pane;
            let button = Button::selectable(chosen, RichText::new(text).font(fonts::semibold(points)));
            let response = ui.put(place, button.frame_when_inactive(true));
            response.widget_info(|| WidgetInfo::selected(Role::Tab, true, chosen, text));
            if response.clicked() {
                view.pane = pane;
            }
        });
        x = place.right() + 6.0 * squeeze;
    }
}
