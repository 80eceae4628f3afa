//! Fields of forms: what stands in them while they are typed into, and the problems below them.

use super::editing::{Edit, Editing};
use super::state::{EngineerView, Typing};
use crate::diagnostic::{Diagnostic, Severity};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::{Words, typed_number};
use crate::gui::theme::size;
use crate::gui::widgets::sign;
use crate::plan::document::{At, PlanProblem};
use crate::report::words::{capital, clean};
use egui::{
    Align, Align2, Id, Rect, Response, RichText, Stroke, StrokeKind, TextEdit, Ui, Vec2, WidgetInfo, pos2, vec2,
};

/// Height of a line of a form.
pub const LINE: f32 = 32.0;
/// Height of a field.
pub const FIELD: f32 = 26.0;

/// Width of a form under which the words of a line stand above its fields.
const STACKED: f32 = 340.0;

/// The room that a line of a form has. Nothing that is too wide moves the fields of other lines.
fn room(ui: &Ui) -> f32 {
    ui.available_width().min(ui.clip_rect().width())
}

/// How wide the words before the fields are; nothing where they stand above them.
pub fn label_width(ui: &Ui) -> f32 {
    let room = room(ui);
    if room < STACKED { 0.0 } else { (0.34 * room).clamp(92.0, 160.0).min(room - TRIPLE) }
}

/// How far what stands below a line's fields is from the left: below the fields.
pub fn indent(ui: &Ui) -> f32 {
    let label = label_width(ui);
    if label > 0.0 { label + SPACE } else { 0.0 }
}

/// The least width of a field for one of three numbers: `−1234.567` whole, with its frame.
pub const LEAST_NUMBER: f32 = 82.0;
/// What three of them take.
const TRIPLE: f32 = 3.0 * LEAST_NUMBER + 3.0 * SPACE;
/// Between the things of a line.
const SPACE: f32 = 6.0;

/// When what was typed is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Commit {
    /// With every letter; all of them are one step.
    Typed,
    /// When the field is left: a name that is half typed may be another one's.
    Left,
}

/// A field for text.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    /// Which one: `part.thickness_mm`.
    pub key: &'a str,
    /// Its accessible name.
    pub label: &'a str,
    /// What stands in it while nobody types.
    pub shown: String,
    /// What is to be edited.
    pub full: String,
    /// Words in it while it is empty.
    pub hint: String,
    /// How wide it is.
    pub width: f32,
    /// Whether it holds a number: monospaced, on the right.
    pub number: bool,
    /// The worst that is told of it.
    pub severity: Option<Severity>,
    /// When it is taken.
    pub commit: Commit,
}

impl Field<'_> {
    /// Draws it; returns what was typed when it is to be taken.
    pub fn ui(self, ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) -> Option<String> {
        let id = Id::unique("engineer field").with(self.key);
        let focused = ui.memory(|m| m.has_focus(id));
        let typed = view.typing.as_ref().filter(|t| focused && t.field == self.key).map(|t| t.text.clone());
        let mut text = typed.unwrap_or_else(|| if focused { self.full.clone() } else { self.shown.clone() });
        let before = text.clone();
        let font = if self.number { fonts::mono(size::TABLE) } else { fonts::regular(size::TABLE) };
        let edit = TextEdit::singleline(&mut text)
            .id(id)
            .font(font.clone())
            .hint_text(RichText::new(&self.hint).font(font).color(scope.theme.quiet))
            .desired_width(self.width)
            .min_size(vec2(self.width, FIELD))
            .margin(egui::Margin::symmetric(if self.number { 5 } else { 8 }, 2))
            .align(if self.number { Align2::RIGHT_CENTER } else { Align2::LEFT_CENTER });
        let response = ui.add_sized([self.width, FIELD], edit);
        response.widget_info(|| WidgetInfo {
            label: Some(self.label.to_owned()),
            ..WidgetInfo::text_edit(true, &before, &text, &self.hint)
        });
        let refused = view.refused.clone().filter(|(key, _)| !focused && *key == self.key);
        let odd = self.number && !text.trim().is_empty() && typed_number(&text).is_none();
        self.frame(ui, &response, (focused && odd) || refused.is_some(), scope);
        if let Some((_, typed)) = refused {
            refused_ui(ui, &response, &typed, scope);
        }
        if view.focus.as_deref() == Some(self.key) {
            view.focus = None;
            response.request_focus();
            response.scroll_to_me(Some(Align::Center));
        }
        self.taken(&response, text, scope, view)
    }

    fn frame(&self, ui: &Ui, response: &Response, unreadable: bool, scope: &Scope) {
        let colour = match self.severity {
            _ if unreadable => scope.theme.fail,
            Some(Severity::Error) => scope.theme.fail,
            Some(Severity::Warning) => scope.theme.undecided,
            None if response.has_focus() => scope.theme.accent,
            None => return,
        };
        ui.painter().rect_stroke(response.rect, 4, Stroke::new(2.0, colour), StrokeKind::Inside);
    }

    fn taken(self, response: &Response, text: String, scope: &mut Scope, view: &mut EngineerView) -> Option<String> {
        let changed = response.changed();
        if response.has_focus() && view.typing.as_ref().is_none_or(|t| t.field != self.key) {
            view.refused.take_if(|(key, _)| *key == self.key);
            // Everything that is typed into it from now on is one step.
            scope.ask(Action::Edit(Edit::BeginGesture));
            let text = if changed { text.clone() } else { self.full.clone() };
            if !changed {
                select_all(response, text.chars().count());
            }
            view.typing = Some(Typing { field: self.key.to_owned(), text, id: response.id });
        }
        if let Some(typing) = view.typing.as_mut().filter(|t| changed && t.field == self.key) {
            typing.text.clone_from(&text);
        }
        if self.number
            && response.lost_focus()
            && !text.trim().is_empty()
            && typed_number(&text).is_none()
            && view.typing.take_if(|t| t.field == self.key).is_some()
        {
            // Nor what it was on the way there: 1e4 before 1e400.
            scope.ask(Action::Edit(Edit::DropGesture));
            view.refused = Some((self.key.to_owned(), text));
            return None;
        }
        if changed && self.commit == Commit::Typed {
            return Some(text);
        }
        let left = response.lost_focus() && self.commit == Commit::Left && text != self.full;
        left.then_some(text)
    }
}

/// What was typed and is no number, below the field that has its value as before.
fn refused_ui(ui: &Ui, response: &Response, typed: &str, scope: &Scope) {
    let typed = clean(typed).chars().take(24).collect::<String>();
    let text = scope.words.fill("engineer.no_number", &[("typed", &typed)]);
    let area = egui::Area::new(response.id.with("refused")).order(egui::Order::Foreground);
    area.fixed_pos(response.rect.left_bottom() + vec2(0.0, 2.0)).constrain(true).show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(280.0);
            ui.horizontal_top(|ui| {
                let (square, _) = ui.allocate_exact_size(Vec2::splat(16.0), egui::Sense::hover());
                sign::problem(ui.painter(), square, true, scope.theme);
                let text = RichText::new(text).size(size::NOTE).color(scope.theme.text);
                ui.add(egui::Label::new(text).wrap());
            });
        });
    });
}

/// Who comes into a field by Tab or click types over what stands there, or goes on in it with the arrows.
fn select_all(response: &Response, letters: usize) {
    if let Some(mut state) = TextEdit::load_state(&response.ctx, response.id) {
        let all = egui::text::CCursorRange::two(egui::text::CCursor::new(0), egui::text::CCursor::new(letters));
        state.cursor.set_char_range(Some(all));
        TextEdit::store_state(&response.ctx, response.id, state);
    }
}

/// The step of a field ends when the field is left, however that happens. Called after the form is drawn.
pub fn end_typing(ui: &Ui, scope: &mut Scope, view: &mut EngineerView) {
    if view.typing.as_ref().is_some_and(|typing| ui.memory(|m| !m.has_focus(typing.id))) {
        view.typing = None;
        // Before what the click that left it asks for, which is a step of its own.
        scope.actions.insert(0, Action::Edit(Edit::EndGesture));
    }
}

/// A line of a form: words, then what `add` puts behind them, or below them in a narrow form.
pub fn line_ui<R>(ui: &mut Ui, scope: &mut Scope, label: &str, add: impl FnOnce(&mut Ui, &mut Scope) -> R) -> R {
    let width = label_width(ui);
    if width == 0.0 {
        let (at, _) = ui.allocate_exact_size(vec2(room(ui), 20.0), egui::Sense::hover());
        label_ui(ui, at, label, scope);
    }
    ui.horizontal(|ui| {
        ui.set_min_height(LINE);
        ui.spacing_mut().item_spacing.x = SPACE;
        if width > 0.0 {
            let (at, _) = ui.allocate_exact_size(vec2(width, LINE), egui::Sense::hover());
            label_ui(ui, at, label, scope);
        }
        add(ui, scope)
    })
    .inner
}

/// The words of a line. The fields themselves bear them for who does not see.
fn label_ui(ui: &Ui, at: Rect, label: &str, scope: &Scope) {
    let wide = crate::gui::widgets::words::fitting_size(ui, label, fonts::regular, at.width(), size::TABLE, 11.0);
    let at_left = at.left_center();
    ui.painter_at(at).text(at_left, Align2::LEFT_CENTER, label, fonts::regular(wide), scope.theme.text);
}

/// A quiet word behind a field.
pub fn note_ui(ui: &mut Ui, scope: &Scope, text: &str) {
    if !text.is_empty() {
        ui.label(RichText::new(text).size(size::NOTE).color(scope.theme.quiet));
    }
}

/// Problems below a field, in sentences.
pub fn problems_ui(ui: &mut Ui, scope: &Scope, problems: &[&PlanProblem]) {
    for problem in problems {
        sentence_ui(ui, scope, &problem.diagnostic, indent(ui));
    }
}

/// One of them, so far from the left.
pub fn sentence_ui(ui: &mut Ui, scope: &Scope, told: &Diagnostic, indent: f32) {
    ui.horizontal_top(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.add_space(indent);
        let (square, _) = ui.allocate_exact_size(Vec2::splat(16.0), egui::Sense::hover());
        sign::problem(ui.painter(), square, told.severity == Severity::Error, scope.theme);
        let text = RichText::new(sentence(told, scope.words)).size(size::NOTE).color(scope.theme.text);
        ui.add(egui::Label::new(text).wrap());
    });
    ui.add_space(2.0);
}

/// What was found and what to do, without the place, which the field tells.
pub fn sentence(told: &Diagnostic, words: &Words) -> String {
    let what = capital(&clean(without_place(&words.library(&told.message))));
    match &told.help {
        Some(help) => format!("{what}. {}", words.told(help)),
        None => what,
    }
}

/// `[[comparison]] "E07": found ...` without what stands before the colon.
pub fn without_place(message: &str) -> &str {
    match message.split_once(": ") {
        Some((place, rest)) if place.starts_with('[') => rest,
        _ => message,
    }
}

/// The problems of a key of a table or row; `None` as key = those that name none.
pub fn problems_of<'e>(editing: &'e Editing, at: At, key: Option<&str>) -> Vec<&'e PlanProblem> {
    editing.problems.iter().filter(|p| p.place.at == at && p.place.key.as_deref() == key).collect()
}

/// The worst of some problems.
pub fn worst(problems: &[&PlanProblem]) -> Option<Severity> {
    problems.iter().map(|p| p.diagnostic.severity).max()
}

/// A number as a person would type it: all its digits, the language's decimal sign.
pub fn plain_number(words: &Words, value: f64) -> String {
    // Nobody reads three hundred zeros.
    let text = if value.abs() >= 1e15 { format!("{value:e}") } else { format!("{value}") };
    // The decimal sign of a language is that of its numbers with one decimal.
    let comma = words.number(0.5, 1).contains(',');
    if comma { text.replace('.', ",") } else { text }
}

/// A square with its mark in a line of text.
pub fn square_ui(ui: &Ui, at: Rect, severity: Severity, scope: &Scope) {
    let square = Rect::from_center_size(pos2(at.right() - 8.0, at.center().y), Vec2::splat(16.0));
    sign::problem(ui.painter(), square, severity == Severity::Error, scope.theme);
}
