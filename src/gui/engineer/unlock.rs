//! What stands in the place of the plan while it is locked.

use super::act::Command;
use super::lock::{Fault, LEAST, Secret};
use super::state::EngineerView;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::settings::PASSWORD_KEY;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, sign};
use egui::{Button, Id, Key, Rect, RichText, TextEdit, Ui, Vec2, vec2};

/// Draws it.
pub fn unlock_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
    let first = scope.settings.password.is_none();
    let all = ui.max_rect();
    let height = if first { 380.0 } else { 372.0 };
    let size = vec2(520.0_f32.min(all.width() - 32.0), f32::min(height, all.height() - 16.0));
    let card = Rect::from_center_size(all.center(), size);
    cards::card(ui, card, scope.theme);
    // In a low window the card is one to scroll.
    let margin = if card.height() < height { 12.0 } else { 28.0 };
    let builder = egui::UiBuilder::new().max_rect(card.shrink(margin));
    ui.scope_builder(builder, |ui| egui::ScrollArea::vertical().show(ui, |ui| card_ui(ui, scope, view, first)));
}

fn card_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, first: bool) {
    let words = scope.words;
    let title = words.text(if first { "lock.set_title" } else { "lock.title" });
    ui.label(RichText::new(title).font(fonts::semibold(size::HEADER)));
    ui.add_space(4.0);
    let least = LEAST.to_string();
    let note = match first {
        true => words.fill("lock.set_note", &[("n", &least)]),
        false => words.text("lock.note").to_owned(),
    };
    ui.add(egui::Label::new(RichText::new(note).color(scope.theme.quiet)).wrap());
    ui.add_space(12.0);
    let entered = fields_ui(ui, scope, view, first);
    fault_ui(ui, scope);
    ui.add_space(10.0);
    let text = words.text(if first { "lock.set" } else { "lock.unlock" });
    let may = !scope.lock.busy && scope.lock.wait(scope.now).is_none();
    let fill = if may { scope.theme.accent } else { scope.theme.accent.gamma_multiply(0.45) };
    let button = Button::new(RichText::new(text).size(size::BAR).color(scope.theme.on_accent)).fill(fill);
    let clicked = ui.add_enabled(may, button.min_size(vec2(0.0, 44.0))).clicked();
    if (clicked || entered) && may {
        let [one, two] = std::mem::take(&mut view.passwords).map(Secret::new);
        let command = if first { Command::SetPassword(one, two) } else { Command::Unlock(one) };
        scope.ask(Action::Engineer(command));
    }
    ui.add_space(14.0);
    if !first {
        forgotten_ui(ui, scope);
    }
}

/// One field, or two for a new password. Returns whether Enter was pressed in the last of them.
fn fields_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, first: bool) -> bool {
    let words = scope.words;
    let labels: &[&str] = if first { &["lock.new_password", "lock.again"] } else { &["lock.password"] };
    let (mut entered, mut on) = (false, false);
    for (k, key) in labels.iter().enumerate() {
        let label = words.text(key);
        let name = ui.label(RichText::new(label).size(size::TABLE));
        let id = Id::unique("password").with(k);
        let field = TextEdit::singleline(&mut view.passwords[k]).password(true).id(id).desired_width(f32::INFINITY);
        let field =
            ui.add(field.font(fonts::regular(size::BAR)).align(egui::Align2::LEFT_CENTER).min_size(vec2(0.0, 36.0)));
        let field = field.labelled_by(name.id);
        // Before it is given the focus again: Enter takes that away.
        let enter = field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        let nothing = ui.memory(|m| m.focused().is_none());
        if k == 0 && nothing && !scope.lock.busy {
            field.request_focus();
        }
        match k + 1 < labels.len() {
            true => on |= enter,
            false => entered |= enter,
        }
    }
    // Only now: the field that gets the focus must not take the same Enter for its own.
    if on {
        ui.memory_mut(|m| m.request_focus(Id::unique("password").with(1)));
    }
    entered
}

fn fault_ui(ui: &mut Ui, scope: &Scope) {
    let words = scope.words;
    let text = match &scope.lock.fault {
        _ if scope.lock.busy => words.text("lock.busy").to_owned(),
        None => return ui.add_space(24.0),
        Some(Fault::Wrong) => match scope.lock.wait(scope.now) {
            Some(wait) => {
                let seconds = wait.as_secs_f64().ceil() as u64;
                words.fill("lock.wrong_wait", &[("s", &seconds.to_string())])
            }
            None => words.text("lock.wrong").to_owned(),
        },
        Some(Fault::Short) => words.fill("lock.short", &[("n", &LEAST.to_string())]),
        Some(Fault::Different) => words.text("lock.different").to_owned(),
        Some(Fault::Failed(why)) => words.fill("lock.failed", &[("why", why)]),
    };
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        if !scope.lock.busy {
            let (square, _) = ui.allocate_exact_size(Vec2::splat(18.0), egui::Sense::hover());
            sign::problem(ui.painter(), square, true, scope.theme);
        }
        ui.label(text);
    });
}

/// Which line of which file to delete.
fn forgotten_ui(ui: &mut Ui, scope: &Scope) {
    let words = scope.words;
    let text = match scope.settings_file {
        Some(file) => {
            let file = file.display().to_string();
            words.fill("lock.forgotten", &[("key", PASSWORD_KEY), ("file", &file)])
        }
        None => words.text("lock.forgotten_nowhere").to_owned(),
    };
    ui.add(egui::Label::new(RichText::new(text).size(size::NOTE).color(scope.theme.quiet)).wrap());
}
