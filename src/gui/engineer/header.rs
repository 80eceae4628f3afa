//! The line below the bar: which plan, what of it is not saved, undo and redo, trying and saving.

use super::act::Command;
use super::editing::{Edit, Editing};
use super::layout::Breadth;
use super::save;
use super::state::{EngineerView, Section};
use super::tree;
use crate::gui::action::Action;
use crate::gui::facts::Job;
use crate::gui::fonts;
use crate::gui::operator::stage_words;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use egui::{Align, Align2, Button, ComboBox, Layout, Rect, RichText, Role, Ui, WidgetInfo, vec2};

/// Draws it.
pub fn header_ui(
    ui: &mut Ui,
    at: Rect,
    breadth: Breadth,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
) {
    let builder = egui::UiBuilder::new().max_rect(at).layout(Layout::right_to_left(Align::Center));
    let shown = ui.scope_builder(builder, |ui| {
        let narrow = matches!(breadth, Breadth::Narrow | Breadth::Small);
        save_ui(ui, scope, view, editing, narrow);
        try_ui(ui, scope, narrow);
        ui.add_space(12.0);
        steps_ui(ui, scope, editing, breadth == Breadth::Wide);
        ui.min_rect()
    });
    let left = at.with_max_x(shown.inner.left() - 16.0);
    if breadth == Breadth::Small {
        sections_ui(ui, left, scope, view);
    } else {
        name_ui(ui, left, scope, editing);
    }
}

fn name_ui(ui: &mut Ui, at: Rect, scope: &Scope, editing: &Editing) {
    let (words, theme) = (scope.words, scope.theme);
    let path = editing.document.path();
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let wide = write::width(ui, &name, fonts::semibold(size::BAR)) + 12.0;
    write::line(ui, at, Align2::LEFT_CENTER, &name, fonts::semibold(size::BAR), theme.text);
    let mut parts = Vec::new();
    let revision = save::revision(editing);
    if !revision.is_empty() {
        parts.push(words.fill("engineer.revision", &[("revision", &revision)]));
    }
    match editing.changes().len() {
        0 => parts.push(words.text("engineer.all_saved").to_owned()),
        n => {
            parts.push(words.count("engineer.not_saved", n));
            parts.extend(kept_words(scope, editing));
        }
    }
    let note = at.with_min_x(at.left() + wide);
    if note.width() > 40.0 {
        write::line(ui, note, Align2::LEFT_CENTER, &parts.join(", "), fonts::regular(size::TABLE), theme.quiet);
    }
}

/// Whether the unsaved text lies beside the plan.
fn kept_words(scope: &Scope, editing: &Editing) -> Option<String> {
    let words = scope.words;
    let kept = &editing.autosave;
    if kept.fault.is_some() {
        return Some(words.text("engineer.not_kept").to_owned());
    }
    let at = kept.at.filter(|_| kept.version == editing.version)?;
    let seconds = scope.now.saturating_duration_since(at).as_secs();
    Some(match seconds {
        0..60 => words.fill("engineer.kept_s", &[("s", &seconds.to_string())]),
        _ => words.fill("engineer.kept_min", &[("min", &(seconds / 60).to_string())]),
    })
}

/// In a small window the sections are a menu.
fn sections_ui(ui: &mut Ui, at: Rect, scope: &Scope, view: &mut EngineerView) {
    let builder = egui::UiBuilder::new().max_rect(at).layout(Layout::left_to_right(Align::Center));
    ui.scope_builder(builder, |ui| {
        let name = scope.words.text(tree::section_key(view.section));
        let combo = ComboBox::from_id_salt("engineer sections").selected_text(name).show_ui(ui, |ui| {
            for section in Section::ALL {
                let text = scope.words.text(tree::section_key(section));
                if ui.selectable_label(view.section == section, text).clicked() {
                    tree::choose(view, section);
                }
            }
        });
        combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, scope.words.text("engineer.plan")));
    });
}

/// A button with its key behind it, known by its words alone.
fn key_button(ui: &mut Ui, scope: &Scope, text: &str, key: &str, enabled: bool) -> egui::Response {
    let mut job = egui::text::LayoutJob::default();
    let format = |font, colour| egui::text::TextFormat::simple(font, colour);
    let colour = if enabled { scope.theme.text } else { scope.theme.quiet };
    job.append(text, 0.0, format(fonts::regular(size::TABLE), colour));
    if !key.is_empty() {
        job.append(key, 10.0, format(fonts::mono(11.0), scope.theme.quiet));
    }
    let response = ui.add_enabled(enabled, Button::new(job).min_size(vec2(0.0, 28.0)));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, text));
    response
}

fn steps_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing, wide: bool) {
    let words = scope.words;
    let keys = |key: &'static str| if wide { key } else { "" };
    let steps = [
        (editing.document.redo_step(), "engineer.redo", keys("Ctrl Y"), Edit::Redo),
        (editing.document.undo_step(), "engineer.undo", keys("Ctrl Z"), Edit::Undo),
    ];
    for (step, key, shortcut, edit) in steps {
        let response = key_button(ui, scope, words.text(key), shortcut, step.is_some());
        let response = match step {
            Some(step) => response.on_hover_text(super::told::step(words, step)),
            None => response,
        };
        if response.clicked() {
            scope.ask(Action::Edit(edit));
        }
    }
}

fn try_ui(ui: &mut Ui, scope: &mut Scope, narrow: bool) {
    let words = scope.words;
    if let Job::Trying { stage, .. } = &scope.facts.job {
        let stage = stage_words(words, *stage);
        let stop = words.text("engineer.stop_trying");
        let text = if stage.is_empty() { stop.to_owned() } else { format!("{stop}: {stage}") };
        let response = key_button(ui, scope, &text, "Esc", true);
        if response.clicked() {
            scope.ask(Action::Engineer(Command::StopTrying));
        }
        return;
    }
    match super::trial::scan(scope.facts) {
        Ok((scan, _)) => {
            let name = scan.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            let text = words.fill("engineer.try_on", &[("scan", &shortened(&name))]);
            if key_button(ui, scope, &text, if narrow { "" } else { "F6" }, true).clicked() {
                scope.ask(Action::Engineer(Command::Try));
            }
        }
        Err(why) => {
            let text = words.text("engineer.try");
            key_button(ui, scope, text, "F6", false).on_disabled_hover_text(words.text(why));
        }
    }
}

/// A name that is no longer than a button bears.
fn shortened(name: &str) -> String {
    if name.chars().count() <= 16 {
        name.to_owned()
    } else {
        format!("{}…", name.chars().take(15).collect::<String>())
    }
}

fn save_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing, narrow: bool) {
    let words = scope.words;
    let may = save::may_save(editing);
    if let Err((key, n)) = may {
        let why = if n == 0 { words.text(key).to_owned() } else { words.count(key, n) };
        if !narrow {
            // Its place is kept, so that nothing moves when the reason changes.
            ui.allocate_ui_with_layout(vec2(118.0, 34.0), Layout::left_to_right(Align::Center), |ui| {
                ui.set_width(118.0);
                ui.add(egui::Label::new(RichText::new(why).size(size::NOTE).color(scope.theme.quiet)).wrap());
            });
        }
    }
    let next = save::next_revision(&save::revision(editing));
    let text = words.fill("engineer.save_as", &[("revision", &next)]);
    if key_button(ui, scope, &text, if narrow { "" } else { "Ctrl S" }, may.is_ok()).clicked() {
        view.ask_to_save(Some(editing));
    }
}
