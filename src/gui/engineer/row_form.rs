//! The form of one row: a feature or comparison point of the plan, or one that is proposed.

use super::editing::{Edit, Editing};
use super::fields::{Commit, Field, LEAST_NUMBER, line_ui, note_ui, plain_number, problems_of, problems_ui, worst};
use super::labels;
use super::section_form::{has_three_decimals, small_button};
use super::state::EngineerView;
use crate::diagnostic::Severity;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::typed_number;
use crate::gui::theme::size;
use crate::plan::document::{At, FieldValue, List, row_form};
use egui::{Button, ComboBox, RichText, Ui, WidgetInfo};

/// Three numbers: a place or a direction.
pub struct Triple<'a> {
    /// Its field: `comparison.3.position`.
    pub key: &'a str,
    /// Its name; the axes are added.
    pub label: &'a str,
    /// What it holds, if that can be read.
    pub now: Option<[f64; 3]>,
    /// How many decimals are shown while nobody types.
    pub decimals: usize,
    /// Room that is left behind it.
    pub room: f32,
    /// The worst that is told of it.
    pub severity: Option<Severity>,
}

impl Triple<'_> {
    /// Draws it; returns what it holds when somebody typed.
    pub fn ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) -> Option<[f64; 3]> {
        let least = match self.now {
            Some(_) if self.decimals == 3 => LEAST_NUMBER,
            // A component of a direction has one digit before the point; an empty field shows its axis.
            Some(_) => 70.0,
            None => 56.0,
        };
        let width = ((ui.available_width() - self.room - 12.0) / 3.0).clamp(least, 96.0);
        let mut typed = None;
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (key, label) = (format!("{}.{k}", self.key), format!("{} {axis}", self.label));
            let value = self.now.map(|v| v[k]);
            let shown = |v: f64| {
                let text = scope.words.number(v, self.decimals);
                if v > 0.0 && self.decimals == 3 { format!("+{text}") } else { text }
            };
            let field = Field {
                key: &key,
                label: &label,
                shown: value.map(shown).unwrap_or_default(),
                full: value.map(|v| plain_number(scope.words, v)).unwrap_or_default(),
                hint: axis.to_owned(),
                width,
                number: true,
                severity: self.severity,
                commit: Commit::Typed,
            };
            if let Some(v) = field.ui(ui, scope, view).and_then(|text| typed_number(&text)) {
                let mut all = self.now.unwrap_or_default();
                all[k] = v;
                typed = Some(all);
            }
        }
        typed
    }
}

/// What the form is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// A row of the plan.
    Row(List, usize),
    /// The row that is proposed.
    Draft(List),
}

impl Of {
    fn list(self) -> List {
        match self {
            Of::Row(list, _) | Of::Draft(list) => list,
        }
    }

    fn key(self, key: &str) -> String {
        match self {
            Of::Row(list, row) => row_key(list, row, key),
            Of::Draft(_) => format!("draft.{key}"),
        }
    }

    fn place(self, editing: &Editing) -> Option<At> {
        match self {
            Of::Row(List::Feature, row) => Some(At::Feature(row)),
            Of::Row(List::Comparison, row) => Some(At::Comparison(row)),
            Of::Draft(_) => editing.proposed(),
        }
    }
}

/// The field of a row's key.
pub fn row_key(list: List, row: usize, key: &str) -> String {
    let list = if list == List::Feature { "feature" } else { "comparison" };
    format!("{list}.{row}.{key}")
}

/// A row as the form shows it.
pub struct Row<'e> {
    /// Which one.
    pub of: Of,
    /// Its name as written.
    pub name: String,
    /// Its kind as written.
    pub kind: String,
    /// Its keys with what they hold.
    pub values: Vec<(String, FieldValue)>,
    /// The plan.
    pub editing: &'e Editing,
}

impl Row<'_> {
    fn value(&self, key: &str) -> Option<&FieldValue> {
        self.values.iter().find(|(k, _)| k == key).map(|(_, value)| value)
    }

    fn triple(&self, key: &str) -> Option<[f64; 3]> {
        match self.value(key) {
            Some(FieldValue::Numbers(v)) => v.as_slice().try_into().ok(),
            _ => None,
        }
    }

    /// All lines of the form.
    pub fn ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
        self.name_ui(ui, scope, view);
        self.kind_ui(ui, scope);
        let form = row_form(self.of.list(), &self.kind);
        for row_key in &form {
            if row_key.key == "lower_mm" || (row_key.key == "method" && self.of.list() == List::Comparison) {
                ui.separator();
            }
            self.key_ui(ui, scope, view, row_key.key, row_key.needed);
        }
        let known = |key: &str| ["name", "kind"].contains(&key) || form.iter().any(|k| k.key == key);
        for (key, _) in self.values.iter().filter(|(key, _)| !known(key)) {
            self.odd_key_ui(ui, scope, key);
        }
        if let Some(at) = self.of.place(self.editing) {
            let shown = |key: &str| known(key) || self.value(key).is_some();
            let rest: Vec<_> = self
                .editing
                .problems
                .iter()
                .filter(|p| p.place.at == at && p.place.key.as_deref().is_none_or(|key| !shown(key)))
                .collect();
            problems_ui(ui, scope, &rest);
        }
    }

    fn problems(&self, key: &str) -> Vec<&crate::plan::document::PlanProblem> {
        self.of.place(self.editing).map_or_else(Vec::new, |at| problems_of(self.editing, at, Some(key)))
    }

    /// Another value of a key; `None` leaves it out.
    fn put(&self, key: &str, value: Option<FieldValue>, scope: &mut Scope, view: &mut EngineerView) {
        match self.of {
            Of::Row(list, index) => scope.ask(Action::Edit(match value {
                Some(value) => Edit::SetValue { list, index, key: key.to_owned(), value },
                None => Edit::RemoveValue { list, index, key: key.to_owned() },
            })),
            Of::Draft(_) => {
                if let Some(draft) = &mut view.draft
                    && let Some(spec) = draft.spec.with_value(key, value.as_ref())
                {
                    draft.spec = spec;
                }
            }
        }
    }

    fn name_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
        let label = labels::row_key(scope.words, "name");
        let problems = self.problems("name");
        let (list, key) = (self.of.list(), self.of.key("name"));
        let is_draft = matches!(self.of, Of::Draft(_));
        let taken = is_draft && self.editing.rows(list).iter().any(|row| row.name == self.name);
        line_ui(ui, scope, &label, |ui, scope| {
            let hint = self.editing.document.next_name(list, &self.kind);
            let field = Field {
                key: &key,
                label: &label,
                shown: self.name.clone(),
                full: self.name.clone(),
                hint,
                width: if is_draft { 110.0 } else { 130.0 },
                number: false,
                severity: if taken { Some(Severity::Error) } else { worst(&problems) },
                commit: if is_draft { Commit::Typed } else { Commit::Left },
            };
            if let Some(name) = field.ui(ui, scope, view) {
                self.put("name", Some(FieldValue::Text(name.trim().to_owned())), scope, view);
            }
            if is_draft && self.name.is_empty() {
                note_ui(ui, scope, scope.words.text("engineer.by_rule"));
            }
        });
        if taken {
            let fault = crate::plan::document::EditError::NameTaken(self.name.clone());
            let told = crate::diagnostic::Diagnostic::error(fault.to_string()).with_help(fault.help());
            super::fields::sentence_ui(ui, scope, &told, super::fields::indent(ui));
        }
        problems_ui(ui, scope, &problems);
    }

    fn kind_ui(&self, ui: &mut Ui, scope: &mut Scope) {
        let Of::Row(list, index) = self.of else { return };
        let label = labels::row_key(scope.words, "kind");
        let problems = self.problems("kind");
        line_ui(ui, scope, &label, |ui, scope| {
            let kinds: &[&str] = match list {
                List::Feature => &["hole", "slot", "surface", "edge"],
                List::Comparison => &["surface", "edge", "hole"],
            };
            let shown = RichText::new(labels::choice(scope.words, &self.kind)).size(size::TABLE);
            let combo = ComboBox::from_id_salt(self.of.key("kind")).selected_text(shown).width(130.0);
            let shown = combo.show_ui(ui, |ui| {
                for kind in kinds {
                    if ui.selectable_label(self.kind == *kind, labels::choice(scope.words, kind)).clicked() {
                        let value = FieldValue::Text((*kind).to_owned());
                        scope.ask(Action::Edit(Edit::SetValue { list, index, key: "kind".into(), value }));
                    }
                }
            });
            shown.response.widget_info(|| WidgetInfo::labeled(egui::Role::ComboBox, true, &label));
        });
        problems_ui(ui, scope, &problems);
    }

    fn key_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, key: &str, needed: bool) {
        let label = labels::row_key(scope.words, key);
        let problems = self.problems(key);
        let severity = worst(&problems);
        line_ui(ui, scope, &label, |ui, scope| match key {
            "position" | "centre" | "direction" | "axis" | "normal" => {
                let decimals = if matches!(key, "position" | "centre") { 3 } else { 4 };
                let (now, field) = (self.triple(key), self.of.key(key));
                let room = if needed || self.value(key).is_none() { 0.0 } else { 30.0 };
                let triple = Triple { key: &field, label: &label, now, decimals, room, severity };
                if let Some(v) = triple.ui(ui, scope, view) {
                    self.put(key, Some(FieldValue::Numbers(v.to_vec())), scope, view);
                }
                self.leave_out_ui(ui, scope, view, key, needed);
            }
            "method" => self.method_ui(ui, scope, view, &label),
            _ => self.number_ui(ui, scope, view, key, &label, needed, severity),
        });
        if key == "direction" && self.triple(key).is_some() {
            self.turn_ui(ui, scope, view);
        }
        problems_ui(ui, scope, &problems);
    }

    #[allow(clippy::too_many_arguments, reason = "one line of a form, called once")]
    fn number_ui(
        &self,
        ui: &mut Ui,
        scope: &mut Scope,
        view: &mut EngineerView,
        key: &str,
        label: &str,
        needed: bool,
        severity: Option<Severity>,
    ) {
        let words = scope.words;
        let number = match self.value(key) {
            Some(FieldValue::Number(v)) => Some(*v),
            _ => None,
        };
        let is_limit = matches!(key, "lower_mm" | "upper_mm");
        let shown = |v: f64| match (has_three_decimals(v) && v.abs() < 1e6, is_limit) {
            (true, true) => words.signed_mm(v),
            (true, false) => words.number(v, 3),
            (false, _) => plain_number(words, v),
        };
        let odd = || match self.value(key) {
            Some(FieldValue::Text(text) | FieldValue::Other(text)) => text.clone(),
            _ => String::new(),
        };
        let field_key = self.of.key(key);
        let field = Field {
            key: &field_key,
            label,
            shown: number.map_or_else(odd, shown),
            full: number.map_or_else(odd, |v| plain_number(words, v)),
            hint: String::new(),
            width: 110.0,
            number: true,
            severity,
            commit: Commit::Typed,
        };
        if let Some(text) = field.ui(ui, scope, view) {
            match typed_number(&text) {
                Some(v) => self.put(key, Some(FieldValue::Number(v)), scope, view),
                None if text.trim().is_empty() && !needed => self.put(key, None, scope, view),
                None => {}
            }
        }
        note_ui(ui, scope, "mm");
        if number.is_none() && !needed {
            note_ui(ui, scope, words.text("engineer.by_default"));
        }
        self.leave_out_ui(ui, scope, view, key, needed);
    }

    fn method_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, label: &str) {
        let now = match self.value("method") {
            Some(FieldValue::Text(text)) => text.as_str(),
            _ => "local",
        };
        let words = scope.words;
        let shown = RichText::new(labels::choice(words, now)).size(size::TABLE);
        let combo = ComboBox::from_id_salt(self.of.key("method")).selected_text(shown);
        let combo = combo.truncate().width(ui.available_width().min(200.0));
        let shown = combo.show_ui(ui, |ui| {
            for word in ["local", "plane"] {
                if ui.selectable_label(now == word, labels::choice(words, word)).clicked() {
                    self.put("method", Some(FieldValue::Text(word.to_owned())), scope, view);
                }
            }
        });
        shown.response.widget_info(|| WidgetInfo::labeled(egui::Role::ComboBox, true, label));
    }

    fn leave_out_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, key: &str, needed: bool) {
        if needed || self.value(key).is_none() {
            return;
        }
        let name = scope.words.fill("engineer.leave_out", &[("what", &labels::row_key(scope.words, key))]);
        if small_button(ui, "×", &name).on_hover_text(&name).clicked() {
            self.put(key, None, scope, view);
        }
    }

    /// A direction the other way round, with where it came from.
    fn turn_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
        let Some(v) = self.triple("direction").filter(|_| self.kind != "slot") else { return };
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            ui.add_space(super::fields::indent(ui));
            let text = scope.words.text("engineer.turn_round");
            if ui.add(Button::new(RichText::new(text).font(fonts::regular(size::NOTE)))).clicked() {
                let turned = v.iter().map(|c| 0.0 - c).collect();
                self.put("direction", Some(FieldValue::Numbers(turned)), scope, view);
            }
        });
    }

    /// A key that its kind does not have.
    fn odd_key_ui(&self, ui: &mut Ui, scope: &mut Scope, key: &str) {
        let Of::Row(list, index) = self.of else { return };
        problems_ui(ui, scope, &self.problems(key));
        let text = scope.words.fill("engineer.leave_out_key", &[("key", key)]);
        if ui.button(RichText::new(text).size(size::TABLE)).clicked() {
            scope.ask(Action::Edit(Edit::RemoveValue { list, index, key: key.to_owned() }));
        }
    }
}
