//! Saving a plan as a revision: what it is called, why, what changed; and what to do when another file lies there.

use super::act::Command;
use super::editing::Editing;
use super::state::EngineerView;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::cards;
use crate::plan::document::FieldValue;
use crate::worker::plan_file::{Overwrite, SaveError};
use egui::{Align2, Button, Key, RichText, ScrollArea, TextEdit, Ui, WidgetInfo, vec2};
use std::path::PathBuf;

/// The revision that lies on the disk.
pub fn revision(editing: &Editing) -> String {
    match editing.document.setting("part", "revision") {
        Some(FieldValue::Text(revision)) => revision,
        _ => String::new(),
    }
}

/// The one that follows: C after B, AA after Z, 08 after 07.
pub fn next_revision(now: &str) -> String {
    let digits = now.len() - now.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    if digits > 0 && digits <= 9 {
        let (stem, number) = now.split_at(now.len() - digits);
        let next = number.parse::<u64>().unwrap_or(0) + 1;
        return format!("{stem}{next:0digits$}");
    }
    let mut letters: Vec<char> = now.chars().collect();
    for k in (0..letters.len()).rev() {
        match letters[k] {
            'Z' => letters[k] = 'A',
            'z' => letters[k] = 'a',
            c if c.is_ascii_alphabetic() => {
                letters[k] = (c as u8 + 1) as char;
                return letters.into_iter().collect();
            }
            _ => return format!("{now}1"),
        }
    }
    let first = letters.first().copied().unwrap_or('A');
    letters.into_iter().chain([first]).collect()
}

/// Whether the plan can be saved; else why not, as the key of a text, with a count where it has one.
pub fn may_save(editing: &Editing) -> Result<(), (&'static str, usize)> {
    match editing.errors() {
        _ if editing.changes().is_empty() => Err(("engineer.nothing_to_save", 0)),
        0 if editing.checked != Some(editing.version) => Err(("engineer.being_checked", 0)),
        0 => Ok(()),
        n => Err(("engineer.to_solve", n)),
    }
}

/// Draws the dialog while it is open.
pub fn save_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let Some(mut form) = view.saving.clone() else { return };
    let words = scope.words;
    let mut asked = None;
    let shown = cards::modal(ui, egui::Id::unique("save plan")).show(ui.ctx(), |ui| {
        ui.set_width(560.0_f32.min(ui.ctx().content_rect().width() - 64.0));
        ui.heading(words.fill("save.title", &[("revision", form.revision.trim())]));
        ui.add_space(8.0);
        let field = |ui: &mut Ui, key: &'static str, text: &mut String, focus: bool| {
            let label = words.text(key);
            let name = ui.label(RichText::new(label).size(size::TABLE));
            let response = ui.add(
                TextEdit::singleline(text)
                    .desired_width(f32::INFINITY)
                    .min_size(vec2(0.0, 30.0))
                    .align(Align2::LEFT_CENTER),
            );
            let response = response.labelled_by(name.id);
            // Before it is given the focus again: Enter takes that away.
            let enter = response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            if focus && ui.memory(|m| m.focused().is_none()) {
                response.request_focus();
            }
            enter
        };
        field(ui, "save.revision", &mut form.revision, false);
        let enter = field(ui, "save.reason", &mut form.reason, true);
        ui.add_space(8.0);
        changes_ui(ui, scope, editing);
        ui.add_space(8.0);
        let ready = !form.revision.trim().is_empty() && !form.reason.trim().is_empty() && !editing.saving;
        let save = |overwrite, path: Option<PathBuf>| Command::Save {
            revision: form.revision.clone(),
            reason: form.reason.clone(),
            path,
            overwrite,
        };
        if let Some(fault) = view.save_fault.clone() {
            asked = fault_ui(ui, scope, &fault, &mut form.path, ready, &save);
        }
        ui.horizontal(|ui| {
            let big = |text: &str| Button::new(RichText::new(text).size(size::BODY)).min_size(vec2(120.0, 36.0));
            let fill = if ready { scope.theme.accent } else { scope.theme.accent.gamma_multiply(0.45) };
            let text = RichText::new(words.text("save.save")).size(size::BODY).color(scope.theme.on_accent);
            let main = Button::new(text).fill(fill).min_size(vec2(120.0, 36.0));
            let clicked = ui.add_enabled(ready, main).clicked();
            if (clicked || enter) && ready {
                asked = Some(save(Overwrite::Own, None));
            }
            let cancelled = ui.add(big(words.text("save.cancel"))).clicked();
            if !ready && !editing.saving {
                ui.label(RichText::new(words.text("save.needs")).size(size::NOTE).color(scope.theme.quiet));
            }
            cancelled
        })
        .inner
    });
    view.saving = Some(form);
    if let Some(command) = asked {
        scope.ask(Action::Engineer(command));
    } else if shown.inner || shown.should_close() {
        view.saving = None;
        view.save_fault = None;
    }
}

/// Height of a list in a dialog: what the window leaves it beside fields and buttons.
fn list_height(ui: &Ui, most: f32) -> f32 {
    most.min(ui.ctx().content_rect().height() - 330.0).max(36.0)
}

/// What will be noted at the end of the file.
fn changes_ui(ui: &mut Ui, scope: &Scope, editing: &Editing) {
    let words = scope.words;
    ui.label(RichText::new(words.count("engineer.changes", editing.changes().len())).font(fonts::semibold(size::BODY)));
    ScrollArea::vertical().max_height(list_height(ui, 180.0)).auto_shrink([false, true]).show(ui, |ui| {
        for change in editing.changes() {
            let text = super::told::change(words, change);
            ui.add(egui::Label::new(RichText::new(text).size(size::TABLE)).wrap());
        }
    });
    ui.add_space(6.0);
    let note = RichText::new(words.text("save.note")).size(size::NOTE).color(scope.theme.quiet);
    ui.add(egui::Label::new(note).wrap());
}

/// Why it was not saved. Of a file that somebody else changed, all ways out.
fn fault_ui(
    ui: &mut Ui,
    scope: &Scope,
    fault: &SaveError,
    path: &mut String,
    ready: bool,
    save: &dyn Fn(Overwrite, Option<PathBuf>) -> Command,
) -> Option<Command> {
    let words = scope.words;
    let (told, by_others) = match fault {
        SaveError::ChangedByOthers(told, theirs) => (told, Some(theirs)),
        SaveError::Failed(told) => (told, None),
    };
    super::fields::sentence_ui(ui, scope, told, 0.0);
    if let Some(theirs) = by_others.filter(|theirs| !theirs.is_empty()) {
        let title = words.count("save.theirs", theirs.len());
        ui.label(RichText::new(title).font(fonts::semibold(size::TABLE)));
        let height = list_height(ui, 90.0);
        ScrollArea::vertical().id_salt("theirs").max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            for change in theirs {
                let text = super::told::change(words, change);
                ui.add(egui::Label::new(RichText::new(text).size(size::TABLE)).wrap());
            }
        });
        ui.add_space(6.0);
    }
    let mut asked = None;
    let label = words.text("save.other_name");
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(path).hint_text(label).desired_width(300.0);
        let response = ui.add(field);
        response.widget_info(|| WidgetInfo::labeled(egui::Role::TextInput, true, label));
        let typed = path.trim().trim_matches('"');
        if ui.add_enabled(ready && !typed.is_empty(), Button::new(words.text("save.save_there"))).clicked() {
            let path = PathBuf::from(typed);
            asked = Some(save(Overwrite::Own, Some(std::path::absolute(&path).unwrap_or(path))));
        }
    });
    if by_others.is_some() {
        ui.horizontal(|ui| {
            if ui.add_enabled(ready, Button::new(words.text("save.overwrite"))).clicked() {
                asked = Some(save(Overwrite::Anything, None));
            }
            if ui.button(words.text("save.take_theirs")).clicked() {
                asked = Some(Command::TakeTheirs);
            }
        });
    }
    ui.add_space(8.0);
    asked
}

/// Asks what is to become of unsaved work that was found beside the plan.
pub fn recovery_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing) {
    let Some(recovery) = &editing.recovery else { return };
    let words = scope.words;
    let mut take = None;
    cards::modal(ui, egui::Id::unique("recover plan")).show(ui.ctx(), |ui| {
        ui.set_width(560.0_f32.min(ui.ctx().content_rect().width() - 64.0));
        ui.heading(words.text("save.found_title"));
        ui.add_space(6.0);
        let key = if recovery.of_this_file { "save.found" } else { "save.found_of_other" };
        ui.add(egui::Label::new(words.text(key)).wrap());
        ui.add_space(6.0);
        ScrollArea::vertical().max_height(list_height(ui, 220.0)).auto_shrink([false, true]).show(ui, |ui| {
            for change in editing.document.changes_to(&recovery.text) {
                let text = super::told::change(words, &change);
                ui.add(egui::Label::new(RichText::new(text).size(size::TABLE)).wrap());
            }
        });
        ui.add_space(10.0);
        ui.horizontal(|ui| {
            let big = |text: &str| Button::new(RichText::new(text).size(size::BODY)).min_size(vec2(140.0, 36.0));
            if ui.add(big(words.text("save.take"))).clicked() {
                take = Some(true);
            }
            if ui.add(big(words.text("save.forget"))).clicked() {
                take = Some(false);
            }
        });
    });
    if let Some(take) = take {
        scope.ask(Action::Engineer(Command::Recover(take)));
    }
}

/// Asks before somebody leaves work that is not saved.
pub(in crate::gui) fn leave_ui(ui: &mut Ui, scope: &mut Scope) {
    if scope.view.leaving.is_none() {
        return;
    }
    let words = scope.words;
    let open = scope.lock.is_open(scope.now);
    let mut asked = None;
    let shown = cards::modal(ui, egui::Id::unique("leave plan")).show(ui.ctx(), |ui| {
        ui.set_width(560.0_f32.min(ui.ctx().content_rect().width() - 64.0));
        ui.heading(words.text("save.leave_title"));
        ui.add_space(6.0);
        let changes = scope.facts.editing.as_ref().map_or(0, |editing| editing.changes().len());
        ui.add(egui::Label::new(words.count("save.leave_note", changes)).wrap());
        ui.add_space(10.0);
        ui.horizontal_wrapped(|ui| {
            let big = |text: &str| Button::new(RichText::new(text).size(size::BODY)).min_size(vec2(120.0, 36.0));
            if ui.add(big(words.text("save.leave_later"))).clicked() {
                asked = Some(Command::LeaveLater);
            }
            if open && ui.add(big(words.text("save.leave_forget"))).clicked() {
                asked = Some(Command::LeaveForgetting);
            }
            if ui.add(big(words.text("save.stay"))).clicked() {
                asked = Some(Command::Stay);
            }
        });
    });
    if let Some(command) = asked.or(shown.should_close().then_some(Command::Stay)) {
        scope.ask(Action::Engineer(command));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn revisions_follow_each_other() {
        for (now, next) in [
            ("C", "D"),
            ("Z", "AA"),
            ("AZ", "BA"),
            ("", "A"),
            ("07", "08"),
            ("9", "10"),
            ("rev 3", "rev 4"),
            ("b", "c"),
            ("1.", "1.1"),
            ("ö", "ö1"),
        ] {
            assert_eq!(next_revision(now), next, "{now}");
        }
    }
}
