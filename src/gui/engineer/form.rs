//! The form on the right: of the row that is proposed, of the rows that are chosen, else of the section.

use super::editing::{Edit, Editing};
use super::fields::{Commit, Field, line_ui, note_ui, problems_of, problems_ui, sentence, worst};
use super::row_form::{Of, Row};
use super::state::{Draft, EngineerView, Section};
use super::{alignment_form, labels, section_form, uncertainty};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::typed_number;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::plan::document::{At, FieldValue, List, PlanProblem};
use egui::{Button, Key, Modifiers, Rect, RichText, ScrollArea, Ui, vec2};

/// Height of the buttons that take what is proposed or leave it.
pub const TAKE: f32 = 44.0;

/// Draws it.
pub fn form_ui(ui: &mut Ui, at: Rect, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    cards::card(ui, at, scope.theme);
    let draft = view.draft.clone();
    let buttons = if draft.is_some() { TAKE + 12.0 } else { 0.0 };
    let inner = at.shrink2(vec2(16.0, 12.0));
    let body = inner.with_max_y(inner.bottom() - buttons);
    ui.scope_builder(egui::UiBuilder::new().max_rect(body), |ui| {
        ui.set_clip_rect(body.expand2(vec2(4.0, 0.0)).intersect(ui.clip_rect()));
        ui.spacing_mut().scroll = egui::style::ScrollStyle { bar_width: 6.0, ..ui.spacing().scroll };
        let of = (view.section, view.chosen.clone(), draft.is_some());
        let area = ScrollArea::vertical().id_salt(egui::Id::unique("engineer form").with(format!("{of:?}")));
        // As wide as its place, or its bar would lie over the fields.
        area.auto_shrink([false, true]).show(ui, |ui| {
            // The bar for scrolling comes to lie beside the fields.
            ui.set_width(body.width() - 12.0);
            match (&draft, view.chosen.list, view.chosen.rows.len()) {
                (Some(draft), ..) => draft_ui(ui, scope, view, editing, draft),
                (None, Some(list), 1) => row_ui(ui, scope, view, editing, list, view.chosen.rows[0]),
                (None, Some(list), 2..) => many_ui(ui, scope, view, editing, list),
                _ => section_ui(ui, scope, view, editing),
            }
        });
    });
    if draft.is_some() {
        let foot = inner.with_min_y(body.bottom() + 12.0);
        ui.scope_builder(egui::UiBuilder::new().max_rect(foot), |ui| take_ui(ui, scope, view, editing));
    }
}

fn title_ui(ui: &mut Ui, scope: &Scope, text: &str) {
    ui.label(RichText::new(text).font(fonts::semibold(size::CARD)).color(scope.theme.text));
    ui.add_space(6.0);
}

fn draft_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing, draft: &Draft) {
    let kind = draft.spec.geometry.kind();
    let what = labels::row_of_kind(scope.words, draft.list, kind);
    title_ui(ui, scope, &scope.words.fill("engineer.new_row", &[("what", what)]));
    if let Some(note) = &draft.note {
        note_ui(ui, scope, &scope.words.told(note));
    }
    let values = draft.spec.values(draft.list).into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    let name = draft.spec.name.clone();
    let row = Row { of: Of::Draft(draft.list), name: name.clone(), kind: kind.to_owned(), values, editing };
    row.ui(ui, scope, view);
    if draft.list == List::Comparison {
        let name = if name.is_empty() { editing.document.next_name(draft.list, kind) } else { name };
        uncertainty::panel_ui(ui, scope, editing, &name);
    }
}

/// The buttons in a card of their own, below the view of a window whose form is not in sight.
pub fn take_below_ui(ui: &mut Ui, at: Rect, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let card = at.with_min_y(at.bottom() - TAKE);
    cards::card(ui, card, scope.theme);
    let inner = card.shrink2(vec2(8.0, 4.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(inner), |ui| take_ui(ui, scope, view, editing));
}

/// The buttons below a row that is proposed.
fn take_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let Some(draft) = view.draft.clone() else { return };
    let sound = editing.would_take(&draft);
    let words = scope.words;
    ui.horizontal(|ui| {
        let text = words.text(if draft.list == List::Feature { "engineer.add_feature" } else { "engineer.add_point" });
        let wide = (ui.available_width() - 130.0).max(120.0);
        // The key gives way to the words.
        let with_key = |text: &str, key: &str, room: f32| {
            let both = format!("{text}   {key}");
            if write::width(ui, &both, fonts::regular(size::BODY)) + 20.0 <= room { both } else { text.to_owned() }
        };
        let (add_text, leave_text) =
            (with_key(text, "Enter", wide), with_key(words.text("engineer.cancel"), "Esc", 110.0));
        let add = Button::new(RichText::new(add_text).color(scope.theme.on_accent))
            .fill(if sound { scope.theme.accent } else { scope.theme.accent.gamma_multiply(0.45) })
            .min_size(vec2(wide, 36.0));
        let add = ui.add_enabled(sound, add);
        add.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, sound, text));
        let add = add.on_disabled_hover_text(words.text("engineer.not_sound"));
        let leave = words.text("engineer.cancel");
        let cancel = ui.add(Button::new(leave_text).min_size(vec2(110.0, 36.0)));
        cancel.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, leave));
        // A field that Enter was pressed in has just given up the focus; a button with the focus takes Enter for itself.
        let free = !scope.view.help && view.saving.is_none() && !view.dialogs.is_open();
        let enter = free
            && ui.memory(|m| m.focused().is_none())
            && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Enter));
        if (add.clicked() || enter) && sound {
            scope.ask(Action::Edit(Edit::AddRows(draft.list, vec![draft.spec.clone()])));
            view.draft = None;
        } else if cancel.clicked() {
            view.draft = None;
        }
    });
}

fn row_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing, list: List, index: usize) {
    let Some(info) = editing.rows(list).get(index) else { return };
    let words = scope.words;
    title_ui(ui, scope, &format!("{} {}", labels::row_of_kind(words, list, &info.kind), info.name));
    let (name, kind, values) = (info.name.clone(), info.kind.clone(), info.values.clone());
    Row { of: Of::Row(list, index), name: name.clone(), kind, values, editing }.ui(ui, scope, view);
    ui.add_space(4.0);
    ui.horizontal_wrapped(|ui| {
        let button = |text: &str| Button::new(RichText::new(text).size(size::TABLE));
        let last = editing.rows(list).len().saturating_sub(1);
        if ui.add_enabled(index > 0, button(words.text("engineer.move_up"))).clicked() {
            scope.ask(Action::Edit(Edit::Reorder { list, from: index, to: index - 1 }));
        }
        if ui.add_enabled(index < last, button(words.text("engineer.move_down"))).clicked() {
            scope.ask(Action::Edit(Edit::Reorder { list, from: index, to: index + 1 }));
        }
        if ui.add(button(words.text("engineer.remove"))).clicked() {
            scope.ask(Action::Edit(Edit::Remove(list, vec![index])));
        }
        if list == List::Feature && ui.add(button(words.text("engineer.to_alignment"))).clicked() {
            view.chosen = Default::default();
        }
    });
    if list == List::Comparison {
        uncertainty::panel_ui(ui, scope, editing, &name);
    }
}

/// Limits of many points at once.
fn many_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing, list: List) {
    let words = scope.words;
    let indices = view.chosen.rows.clone();
    title_ui(ui, scope, &words.count("engineer.chosen", indices.len()));
    let names: Vec<&str> =
        indices.iter().filter_map(|k| editing.rows(list).get(*k)).map(|row| row.name.as_str()).collect();
    ui.label(RichText::new(names.join("  ")).font(fonts::mono(size::NOTE)).color(scope.theme.quiet));
    ui.add_space(8.0);
    if list == List::Comparison {
        for key in ["lower_mm", "upper_mm"] {
            limit_ui(ui, scope, view, editing, &indices, key);
        }
        ui.add_space(8.0);
    }
    if ui.button(words.count("engineer.remove_many", indices.len())).clicked() {
        scope.ask(Action::Edit(Edit::Remove(list, indices)));
    }
}

fn limit_ui(
    ui: &mut Ui,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
    indices: &[usize],
    key: &'static str,
) {
    let words = scope.words;
    let value = |k: &usize| match editing.rows(List::Comparison).get(*k)?.value(key) {
        Some(FieldValue::Number(v)) => Some(*v),
        _ => None,
    };
    let all: Vec<Option<f64>> = indices.iter().map(value).collect();
    let same = all.first().copied().flatten().filter(|first| all.iter().all(|v| *v == Some(*first)));
    let label = labels::row_key(words, key);
    let problems: Vec<_> = indices.iter().flat_map(|k| problems_of(editing, At::Comparison(*k), Some(key))).collect();
    line_ui(ui, scope, &label, |ui, scope| {
        let field_key = format!("many.{key}");
        let field = Field {
            key: &field_key,
            label: &label,
            shown: same.map(|v| words.signed_mm(v)).unwrap_or_default(),
            full: same.map(|v| super::fields::plain_number(words, v)).unwrap_or_default(),
            hint: words.text("engineer.various").to_owned(),
            width: 110.0,
            number: true,
            severity: worst(&problems),
            commit: Commit::Typed,
        };
        if let Some(v) = field.ui(ui, scope, view).and_then(|text| typed_number(&text)) {
            let limit = |this: &str| (key == this).then_some(v);
            let (lower_mm, upper_mm) = (limit("lower_mm"), limit("upper_mm"));
            scope.ask(Action::Edit(Edit::SetTolerances { indices: indices.to_vec(), lower_mm, upper_mm }));
        }
        note_ui(ui, scope, "mm");
    });
    // What is told of many of them alike is told once.
    let mut told: Vec<&PlanProblem> = Vec::new();
    for problem in problems {
        let same = |other: &&PlanProblem| sentence(&other.diagnostic, words) == sentence(&problem.diagnostic, words);
        if !told.iter().any(same) {
            told.push(problem);
        }
    }
    told.truncate(3);
    problems_ui(ui, scope, &told);
}

fn section_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    title_ui(ui, scope, scope.words.text(super::tree::section_key(view.section)));
    match view.section {
        Section::Part => section_form::table_ui(ui, scope, view, editing, "part", &[]),
        Section::Cad => {
            section_form::table_ui(ui, scope, view, editing, "cad", &[]);
            others_ui(ui, scope, editing, At::OtherFile);
        }
        Section::Scans => section_form::table_ui(ui, scope, view, editing, "scans", &[]),
        Section::Background => section_form::table_ui(ui, scope, view, editing, "background", &[]),
        Section::Alignment => alignment_form::alignment_ui(ui, scope, view, editing),
        Section::Points => points_ui(ui, scope, editing),
        Section::Rig => optional_ui(ui, scope, view, editing, "rig", "engineer.no_rig"),
        Section::Uncertainty => optional_ui(ui, scope, view, editing, "uncertainty", "engineer.no_uncertainty"),
        Section::Output => section_form::table_ui(ui, scope, view, editing, "output", &[]),
    }
    if view.section == Section::Part {
        others_ui(ui, scope, editing, At::Plan);
    }
}

/// Problems of what has no fields.
fn others_ui(ui: &mut Ui, scope: &Scope, editing: &Editing, at: At) {
    let there: Vec<_> = editing.problems.iter().filter(|p| p.place.at == at).collect();
    problems_ui(ui, scope, &there);
}

/// A table that a plan may do without.
fn optional_ui(
    ui: &mut Ui,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
    table: &'static str,
    without: &'static str,
) {
    let keys = crate::plan::document::FORM.iter().filter(|s| s.table == table);
    let there = keys.clone().any(|s| editing.document.setting(table, s.key).is_some());
    if !there {
        ui.label(RichText::new(scope.words.text(without)).size(size::TABLE).color(scope.theme.quiet));
        ui.add_space(6.0);
    }
    section_form::table_ui(ui, scope, view, editing, table, &[]);
    if there {
        ui.add_space(8.0);
        let text = scope.words.text("engineer.leave_out_table");
        if ui.button(RichText::new(text).size(size::TABLE)).clicked() {
            scope.ask(Action::Edit(Edit::RemoveTable(table.to_owned())));
        }
    }
}

/// What is to be said of the points as a whole.
fn points_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing) {
    let words = scope.words;
    for (kind, key) in
        [("surface", "engineer.surface_points"), ("edge", "engineer.edge_points"), ("hole", "engineer.holes")]
    {
        let count = editing.rows(List::Comparison).iter().filter(|row| row.kind == kind).count();
        ui.label(words.count(key, count));
    }
    ui.add_space(8.0);
    ui.label(RichText::new(words.text("engineer.naming_rule")).size(size::TABLE).color(scope.theme.quiet));
    if let Some(file) = editing.document.points_file() {
        ui.add_space(8.0);
        ui.label(words.fill("engineer.points_in_file", &[("file", &file.display().to_string())]));
        if ui.button(words.text("engineer.take_points")).clicked() {
            scope.ask(Action::Edit(Edit::TakePointsIntoPlan));
        }
    }
    problems_ui(ui, scope, &problems_of(editing, At::PointsFile, None));
}
