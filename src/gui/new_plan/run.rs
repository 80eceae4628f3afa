//! Step 5: what `check` tells, what to expect, the plan's name and place; then the first run.

use super::steps::{fault, note};
use super::{Assistant, Command};
use crate::diagnostic::Severity;
use crate::gui::action::Action;
use crate::gui::engineer::Editing;
use crate::gui::fonts;
use crate::gui::later::Asked;
use crate::gui::results::order::kind_key;
use crate::gui::scope::Scope;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::cards;
use crate::inspect::Foretold;
use crate::plan::document::FieldValue;
use egui::{Align, Button, Grid, Layout, Rect, RichText, ScrollArea, TextEdit, Ui, vec2};

const FORM: f32 = 520.0;

/// Draws the step.
pub fn run_ui(ui: &mut Ui, body: Rect, scope: &mut Scope, assistant: &mut Assistant) {
    let facts = scope.facts;
    let Some(editing) = facts.editing.as_ref() else { return };
    let inner = body.shrink2(vec2(16.0, 8.0));
    let narrow = inner.width() < 1.6 * FORM;
    let form = if narrow { inner } else { inner.with_max_x(inner.left() + FORM) };
    column(ui, form, "new plan run", scope.theme, |ui| {
        names_ui(ui, assistant, scope);
        ui.add_space(14.0);
        problems_ui(ui, editing, scope);
        if narrow {
            ui.add_space(14.0);
            expected_ui(ui, editing, scope);
        }
    });
    if !narrow {
        let right = inner.with_min_x(form.right() + 8.0);
        column(ui, right, "new plan expected", scope.theme, |ui| expected_ui(ui, editing, scope));
    }
}

fn column(ui: &mut Ui, at: Rect, id: &str, theme: &Theme, add: impl FnOnce(&mut Ui)) {
    cards::card(ui, at, theme);
    let builder = egui::UiBuilder::new().max_rect(at.shrink(18.0)).layout(Layout::top_down(Align::Min));
    ui.scope_builder(builder, |ui| {
        ScrollArea::vertical().id_salt(id).auto_shrink(false).show(ui, add);
    });
}

fn title(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).font(fonts::semibold(size::BAR)));
    ui.add_space(4.0);
}

/// Name and place.
fn names_ui(ui: &mut Ui, assistant: &mut Assistant, scope: &mut Scope) {
    let words = scope.words;
    title(ui, words.text("new_plan.name_and_place"));
    let entries = &mut assistant.entries;
    // It may have been given another name among the settings of step 4.
    let edited = scope.facts.editing.as_ref().and_then(|e| e.document.setting("part", "name"));
    if let (None, Some(FieldValue::Text(name))) = (&entries.name, edited) {
        entries.name = Some(name);
    }
    let label = ui.label(words.text("new_plan.part_name"));
    let mut name = entries.part_name();
    if ui.add(TextEdit::singleline(&mut name).desired_width(f32::INFINITY)).labelled_by(label.id).changed() {
        entries.name = Some(name);
    }
    ui.add_space(4.0);
    let label = ui.label(words.text("new_plan.plan_file"));
    let mut file = entries.file.clone().unwrap_or_else(|| entries.plan_file().display().to_string());
    ui.horizontal(|ui| {
        let room = (ui.available_width() - 110.0).max(120.0);
        if ui.add(TextEdit::singleline(&mut file).desired_width(room)).labelled_by(label.id).changed() {
            entries.file = Some(file);
        }
        if ui.add(Button::new(words.text("tables.choose_file")).min_size(vec2(0.0, 28.0))).clicked() {
            let path = entries.plan_file();
            let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            assistant.dialog.ask(ui.ctx(), Asked::Save(name), path.parent());
        }
    });
    if let Some(path) = assistant.dialog.answer() {
        assistant.entries.file = Some(path.display().to_string());
    }
    if assistant.dialog.failed {
        note(ui, words.text("tables.no_dialog"), scope.theme);
    }
    replace_ui(ui, assistant, scope);
    ui.add_space(4.0);
    let scan = assistant.entries.scan.file();
    let scan = scan.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    note(ui, &words.fill("new_plan.run_note", &[("scan", &scan)]), scope.theme);
}

/// Another file lies under that name: it is replaced when a person says so, and only that one.
fn replace_ui(ui: &mut Ui, assistant: &Assistant, scope: &mut Scope) {
    let Some(taken) = assistant.taken.clone().filter(|taken| *taken == assistant.entries.plan_file()) else { return };
    let name = taken.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let text = scope.words.fill("new_plan.replace", &[("file", &name)]);
    if ui.add(Button::new(text).min_size(vec2(0.0, 32.0))).clicked() {
        scope.ask(Action::NewPlan(Command::Replace(taken)));
    }
}

/// What `check` tells, as it is told on the command line.
fn problems_ui(ui: &mut Ui, editing: &Editing, scope: &Scope) {
    let words = scope.words;
    title(ui, words.text("new_plan.checked"));
    if editing.checked.is_none() {
        return note(ui, words.text("new_plan.being_checked"), scope.theme);
    }
    if editing.problems.is_empty() {
        return note(ui, words.text("new_plan.no_problems"), scope.theme);
    }
    for problem in &editing.problems {
        let d = &problem.diagnostic;
        let told = scope.words.with_help(&d.message, d.help.as_deref());
        fault(ui, &told, d.severity == Severity::Error, scope.theme);
    }
}

/// The uncertainty to expect at every point, beside its limits.
fn expected_ui(ui: &mut Ui, editing: &Editing, scope: &Scope) {
    let (words, theme) = (scope.words, scope.theme);
    title(ui, words.text("new_plan.expected"));
    let Some(foretold) = editing.foretold() else {
        return note(ui, words.text("new_plan.not_foretold"), theme);
    };
    let Foretold { points, spacing_mm, .. } = foretold;
    note(ui, &words.fill("new_plan.expected_note", &[("mm", &words.number(*spacing_mm, 2))]), theme);
    ui.add_space(6.0);
    Grid::new("expected").striped(true).spacing([24.0, 5.0]).show(ui, |ui| {
        for key in
            ["new_plan.point", "new_plan.kind_of_point", "new_plan.limits", "new_plan.expected_u", "new_plan.share"]
        {
            ui.label(RichText::new(words.text(key)).size(size::NOTE).color(theme.quiet));
        }
        ui.end_row();
        let mono = |text: String| RichText::new(text).font(fonts::mono(size::TABLE));
        for point in points {
            let share = point.share();
            ui.label(mono(point.name.clone()));
            ui.label(RichText::new(words.text(kind_key(point.kind))).size(size::TABLE));
            ui.label(mono(format!("{} … {}", words.signed_mm(point.lower_mm), words.signed_mm(point.upper_mm))));
            ui.label(mono(words.number(point.expected.u_mm, 3)));
            let colour = if share < 1.0 { theme.text } else { theme.undecided_text };
            let percent = mono(format!("{} %", words.number(100.0 * share, 0))).color(colour);
            let told = if share < 1.0 { "" } else { words.text("new_plan.cannot_pass") };
            ui.label(percent);
            ui.label(RichText::new(told).size(size::NOTE).color(theme.undecided_text));
            ui.end_row();
        }
    });
}
