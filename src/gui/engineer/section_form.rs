//! The form of a section: a line for each of its settings.

use super::choose_file;
use super::editing::{Edit, Editing};
use super::fields::{Commit, Field, line_ui, note_ui, plain_number, problems_of, problems_ui, worst};
use super::labels;
use super::state::EngineerView;
use crate::gui::action::Action;
use crate::gui::scope::Scope;
use crate::gui::text::typed_number;
use crate::gui::theme::size;
use crate::plan::document::{At, FORM, FieldValue, Holds, LeftOut, List, Setting};
use egui::{Button, Checkbox, ComboBox, RichText, Ui, WidgetInfo};

/// The settings of a table, but for some keys.
pub fn table_ui(
    ui: &mut Ui,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
    table: &'static str,
    but: &[&str],
) {
    for setting in FORM.iter().filter(|s| s.table == table && !but.contains(&s.key)) {
        setting_ui(ui, scope, view, editing, setting);
    }
    rest_ui(ui, scope, editing, table);
}

/// Problems of a table that stand at none of its fields, and a way to be rid of keys that no plan has.
fn rest_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing, table: &'static str) {
    let known = |key: &str| FORM.iter().any(|s| s.table == table && s.key == key);
    let rest = editing.problems.iter().filter(|p| p.place.at == At::Settings(table));
    for problem in rest.filter(|p| p.place.key.as_deref().is_none_or(|key| !known(key))) {
        problems_ui(ui, scope, &[problem]);
        if let Some(key) = problem.place.key.clone().filter(|key| editing.document.setting(table, key).is_some()) {
            let text = scope.words.fill("engineer.leave_out_key", &[("key", &key)]);
            if ui.button(RichText::new(text).size(size::TABLE)).clicked() {
                scope.ask(Action::Edit(Edit::RemoveSetting(table.to_owned(), key)));
            }
        }
    }
}

/// One setting.
pub fn setting_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing, setting: &Setting) {
    let label = labels::setting(scope.words, setting.table, setting.key);
    let written = editing.document.setting(setting.table, setting.key);
    let problems = problems_of(editing, At::Settings(setting.table), Some(setting.key));
    line_ui(ui, scope, &label, |ui, scope| {
        let line = Line { setting, label: &label, written: written.as_ref(), severity: worst(&problems) };
        let value = line.value_ui(ui, scope, view, editing);
        line.take(value, scope);
        line.left_out_ui(ui, scope);
    });
    if view.dialog.failed && view.dialog_for == Some((setting.table, setting.key)) {
        note_ui(ui, scope, scope.words.text("tables.no_dialog"));
    }
    problems_ui(ui, scope, &problems);
}

/// What a person did to a setting.
enum Made {
    Nothing,
    Value(FieldValue),
    LeftOut,
}

struct Line<'a> {
    setting: &'a Setting,
    label: &'a str,
    written: Option<&'a FieldValue>,
    severity: Option<crate::diagnostic::Severity>,
}

impl Line<'_> {
    fn take(&self, made: Made, scope: &mut Scope) {
        let (table, key) = (self.setting.table.to_owned(), self.setting.key.to_owned());
        match made {
            Made::Nothing => {}
            Made::Value(value) => scope.ask(Action::Edit(Edit::SetSetting(table, key, value))),
            Made::LeftOut => scope.ask(Action::Edit(Edit::RemoveSetting(table, key))),
        }
    }

    fn value_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) -> Made {
        match self.setting.holds {
            Holds::Number(unit) => self.number_ui(ui, scope, view, unit),
            Holds::Whole => self.number_ui(ui, scope, view, ""),
            Holds::Truth => self.truth_ui(ui, scope),
            Holds::OneOf(all) => self.one_of_ui(ui, scope, all.iter().map(|w| (*w).to_owned()).collect()),
            Holds::FeatureOf(kind) => {
                let rows = editing.rows(List::Feature).iter().filter(|r| r.kind == kind);
                self.one_of_ui(ui, scope, rows.map(|r| r.name.clone()).collect())
            }
            Holds::AnyOf(all) => self.any_of_ui(ui, scope, all),
            Holds::Direction => self.direction_ui(ui, scope, view),
            Holds::Colours => self.colours_ui(ui, scope),
            Holds::Text | Holds::File | Holds::Folder => self.text_ui(ui, scope, view),
        }
    }

    fn key(&self) -> String {
        format!("{}.{}", self.setting.table, self.setting.key)
    }

    fn text_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) -> Made {
        let now = match self.written {
            Some(FieldValue::Text(text)) => text.clone(),
            Some(other) => plain(scope, other),
            None => String::new(),
        };
        let hint = match self.setting.left_out {
            LeftOut::Text(text) if self.written.is_none() => text.to_owned(),
            _ => String::new(),
        };
        // A path or pattern that is half typed is none.
        let commit = if self.setting.holds == Holds::Text { Commit::Typed } else { Commit::Left };
        let key = self.key();
        let in_files = matches!(self.setting.holds, Holds::File | Holds::Folder);
        let button = if in_files { choose_file::button_width(ui, scope.words) } else { 0.0 };
        let width = (ui.available_width() - 34.0 - button).max(120.0);
        let field = Field {
            key: &key,
            label: self.label,
            shown: now.clone(),
            full: now,
            hint,
            width,
            number: false,
            severity: self.severity,
            commit,
        };
        let typed = field.ui(ui, scope, view);
        let chosen = if in_files { choose_file::choose_ui(ui, scope, view, self.setting, self.label) } else { None };
        typed.or(chosen).map_or(Made::Nothing, |text| Made::Value(FieldValue::Text(text)))
    }

    fn number_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, unit: &str) -> Made {
        let words = scope.words;
        let full = match self.written {
            Some(FieldValue::Number(v)) => plain_number(words, *v),
            Some(other) => plain(scope, other),
            None => String::new(),
        };
        let shown = match self.written {
            Some(FieldValue::Number(v)) if unit == "mm" && has_three_decimals(*v) => words.number(*v, 3),
            _ => full.clone(),
        };
        let hint = match self.setting.left_out {
            LeftOut::Number(v) => plain_number(words, v),
            _ => String::new(),
        };
        let key = self.key();
        let field = Field {
            key: &key,
            label: self.label,
            shown,
            full,
            hint,
            width: 110.0,
            number: true,
            severity: self.severity,
            commit: Commit::Typed,
        };
        let typed = field.ui(ui, scope, view);
        note_ui(ui, scope, unit_words(unit));
        match typed {
            Some(text) if text.trim().is_empty() && self.written.is_some() => Made::LeftOut,
            Some(text) => typed_number(&text).map_or(Made::Nothing, |v| Made::Value(FieldValue::Number(v))),
            None => Made::Nothing,
        }
    }

    fn truth_ui(&self, ui: &mut Ui, scope: &Scope) -> Made {
        let mut truth = match self.written {
            Some(FieldValue::Truth(truth)) => *truth,
            _ => self.setting.left_out == LeftOut::True,
        };
        let words = scope.words;
        let text = words.text(if truth { "engineer.on" } else { "engineer.off" });
        let response = ui.add(Checkbox::new(&mut truth, text));
        response.widget_info(|| WidgetInfo::selected(egui::Role::CheckBox, true, truth, self.label));
        if response.changed() { Made::Value(FieldValue::Truth(truth)) } else { Made::Nothing }
    }

    fn one_of_ui(&self, ui: &mut Ui, scope: &Scope, all: Vec<String>) -> Made {
        let words = scope.words;
        let now = match self.written {
            Some(FieldValue::Text(text)) => Some(text.as_str()),
            _ => None,
        };
        let by_default = match self.setting.left_out {
            LeftOut::Text(text) => labels::choice(words, text).to_owned(),
            _ => words.text("engineer.none_chosen").to_owned(),
        };
        let shown = now.map_or(by_default, |now| labels::choice(words, now).to_owned());
        let mut made = Made::Nothing;
        let combo = ComboBox::from_id_salt(self.key()).selected_text(RichText::new(shown).size(size::TABLE));
        let combo = combo.truncate().width((ui.available_width() - 84.0).clamp(100.0, 300.0)).show_ui(ui, |ui| {
            for word in all {
                if ui.selectable_label(now == Some(word.as_str()), labels::choice(words, &word)).clicked() {
                    made = Made::Value(FieldValue::Text(word));
                }
            }
        });
        combo.response.widget_info(|| WidgetInfo::labeled(egui::Role::ComboBox, true, self.label));
        made
    }

    fn any_of_ui(&self, ui: &mut Ui, scope: &Scope, all: &[&str]) -> Made {
        let by_default = self.setting.left_out.value();
        let mut now = match self.written.or(by_default.as_ref()) {
            Some(FieldValue::Texts(texts)) => texts.clone(),
            _ => Vec::new(),
        };
        let mut made = Made::Nothing;
        ui.horizontal_wrapped(|ui| {
            for word in all {
                let mut on = now.iter().any(|w| w == word);
                let response = ui.checkbox(&mut on, RichText::new(*word).size(size::TABLE));
                response.widget_info(|| {
                    WidgetInfo::selected(egui::Role::CheckBox, true, on, format!("{} {word}", self.label))
                });
                if response.changed() {
                    now.retain(|w| w != word);
                    now.extend(on.then(|| (*word).to_owned()));
                    // In the order of the form, whatever order they were chosen in.
                    now.sort_by_key(|w| all.iter().position(|known| known == w));
                    made = Made::Value(FieldValue::Texts(now.clone()));
                }
            }
        });
        let _ = scope;
        made
    }

    fn direction_ui(&self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) -> Made {
        let now = match self.written {
            Some(FieldValue::Numbers(v)) if v.len() == 3 => Some([v[0], v[1], v[2]]),
            _ => None,
        };
        let key = self.key();
        let asked = super::row_form::Triple {
            key: &key,
            label: self.label,
            now,
            decimals: 4,
            room: if now.is_some() { 34.0 } else { 90.0 },
            severity: self.severity,
        };
        match asked.ui(ui, scope, view) {
            Some(v) => Made::Value(FieldValue::Numbers(v.to_vec())),
            None => Made::Nothing,
        }
    }

    fn colours_ui(&self, ui: &mut Ui, scope: &Scope) -> Made {
        let mut colours = match self.written {
            Some(FieldValue::Colours(colours)) => colours.clone(),
            _ => Vec::new(),
        };
        let mut made = Made::Nothing;
        let mut gone = None;
        for (k, colour) in colours.iter_mut().enumerate() {
            let response = ui.color_edit_button_srgb(colour);
            response
                .widget_info(|| WidgetInfo::labeled(egui::Role::ColorWell, true, format!("{} {}", self.label, k + 1)));
            if response.changed() {
                made = Made::Value(FieldValue::Colours(Vec::new()));
            }
            let name = scope.words.fill("engineer.remove_colour", &[("n", &(k + 1).to_string())]);
            if small_button(ui, "−", &name).clicked() {
                gone = Some(k);
            }
        }
        if small_button(ui, "+", scope.words.text("engineer.add_colour")).clicked() {
            // Green, as belts are; it is changed by a click on it.
            colours.push([58, 74, 69]);
            made = Made::Value(FieldValue::Colours(Vec::new()));
        }
        if let Some(k) = gone {
            colours.remove(k);
            made = if colours.is_empty() { Made::LeftOut } else { Made::Value(FieldValue::Colours(Vec::new())) };
        }
        match made {
            Made::Value(_) => Made::Value(FieldValue::Colours(colours)),
            other => other,
        }
    }

    /// What holds without it, or a way to leave it out.
    fn left_out_ui(&self, ui: &mut Ui, scope: &mut Scope) {
        let words = scope.words;
        if self.written.is_none() {
            if !matches!(self.setting.left_out, LeftOut::Needed) {
                note_ui(ui, scope, words.text("engineer.by_default"));
            }
            return;
        }
        if self.setting.left_out != LeftOut::Needed {
            let name = words.fill("engineer.leave_out", &[("what", self.label)]);
            if small_button(ui, "×", &name).on_hover_text(name).clicked() {
                self.take(Made::LeftOut, scope);
            }
        }
    }
}

/// A button of one sign, known by its words.
pub fn small_button(ui: &mut Ui, sign: &str, name: &str) -> egui::Response {
    let button = Button::new(RichText::new(sign).size(size::BODY)).min_size(egui::vec2(24.0, 24.0));
    let response = ui.add(button);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, name));
    response
}

/// A unit as people write it.
pub fn unit_words(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "pixels" => "px",
        other => other,
    }
}

/// Whether three decimals tell a number whole.
pub fn has_three_decimals(v: f64) -> bool {
    (1e3 * v - (1e3 * v).round()).abs() < 1e-6
}

fn plain(scope: &Scope, value: &FieldValue) -> String {
    match value {
        FieldValue::Text(text) | FieldValue::Other(text) => text.clone(),
        FieldValue::Number(v) => plain_number(scope.words, *v),
        FieldValue::Truth(truth) => truth.to_string(),
        FieldValue::Numbers(list) => list.iter().map(|v| plain_number(scope.words, *v)).collect::<Vec<_>>().join("; "),
        FieldValue::Texts(list) => list.join("; "),
        FieldValue::Colours(list) => format!("{list:?}"),
    }
}
