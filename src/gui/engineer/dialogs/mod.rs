//! Dialogs over the engineer's screen: tolerances of many points, the other hand, tables.
//!
//! Each one tells what would change before it is done, and does all of it as one step or nothing.

mod csv_export;
mod csv_import;
mod fields;
mod mirror;
mod tolerances;

use super::state::EngineerView;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use csv_export::CsvExport;
use csv_import::CsvImport;
use egui::{Button, Rect, RichText, ScrollArea, Ui, vec2};
use mirror::MirrorForm;
use tolerances::TolerancesForm;

/// A dialog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Limits of many points at once.
    Tolerances,
    /// The plan of the other hand.
    Mirror,
    /// Points to and from tables.
    Csv,
}

/// Which of them is open, with what was typed into it.
#[derive(Debug, Default)]
pub struct Dialogs {
    open: Option<Open>,
}

#[derive(Debug)]
enum Open {
    Tolerances(TolerancesForm),
    Mirror(MirrorForm),
    Csv(Box<(CsvImport, CsvExport)>),
}

/// What became of a dialog in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// It stays open.
    Open,
    /// It is shut.
    Shut,
}

impl Dialogs {
    /// Whether one is open.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Opens one, empty.
    pub fn show(&mut self, which: Which) {
        self.open = Some(match which {
            Which::Tolerances => Open::Tolerances(TolerancesForm::default()),
            Which::Mirror => Open::Mirror(MirrorForm::default()),
            Which::Csv => Open::Csv(Box::default()),
        });
    }
}

const BUTTONS: [(&str, Which); 3] =
    [("tables.tolerances", Which::Tolerances), ("tables.mirror", Which::Mirror), ("tables.csv", Which::Csv)];

/// Room around the words of a button.
fn padding(tree: f32) -> f32 {
    if tree < 260.0 { 5.0 } else { 10.0 }
}

/// The buttons that open the dialogs, at the foot of the tree.
pub(in crate::gui) fn buttons_ui(ui: &mut Ui, tree: Rect, scope: &Scope, view: &mut EngineerView) {
    let foot = tree.with_min_y(tree.bottom() - foot(ui, tree.width(), scope.words)).shrink2(vec2(10.0, 8.0));
    let builder = egui::UiBuilder::new().max_rect(foot);
    ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing = vec2(6.0, 6.0);
        ui.spacing_mut().button_padding.x = padding(tree.width());
        ui.horizontal_wrapped(|ui| {
            for (key, which) in BUTTONS {
                let text = RichText::new(scope.words.text(key)).size(size::TABLE);
                if ui.add(Button::new(text).min_size(vec2(0.0, 28.0))).clicked() {
                    view.dialogs.show(which);
                }
            }
        });
    });
}

/// Height of the foot of a tree in which they stand: two rows where one has no room.
pub(in crate::gui) fn foot(ui: &Ui, tree: f32, words: &Words) -> f32 {
    let of = |key: &str| write::width(ui, words.text(key), fonts::regular(size::TABLE)) + 2.0 * padding(tree) + 8.0;
    let all: f32 = BUTTONS.iter().map(|(key, _)| of(key)).sum();
    if all + 20.0 > tree { 76.0 } else { 44.0 }
}

/// Draws the dialog that is open.
pub(in crate::gui) fn dialogs_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
    let Some(mut open) = view.dialogs.open.take() else { return };
    let Some(document) = scope.facts.editing.as_ref().map(|editing| &editing.document) else { return };
    let (key, wide) = match open {
        Open::Tolerances(_) => ("tables.tolerances_title", 560.0),
        Open::Mirror(_) => ("tables.mirror_title", 620.0),
        Open::Csv(_) => ("tables.csv_title", 860.0),
    };
    let room = ui.ctx().content_rect().size() - egui::vec2(96.0, 96.0);
    let shown = cards::modal(ui, egui::Id::unique(key)).show(ui.ctx(), |ui| {
        ui.set_width(f32::min(wide, room.x));
        ui.set_max_height(room.y);
        ui.heading(scope.words.text(key));
        ui.add_space(8.0);
        // What a low window cannot show is scrolled.
        let area = ScrollArea::vertical().id_salt(key).max_height(room.y - 40.0);
        let shown = area.show(ui, |ui| match &mut open {
            Open::Tolerances(form) => tolerances::form_ui(ui, form, document, &view.chosen, scope),
            Open::Mirror(form) => mirror::form_ui(ui, form, document, scope),
            Open::Csv(both) => csv_import::form_ui(ui, &mut both.0, &mut both.1, document, scope),
        });
        shown.inner
    });
    if shown.inner == End::Open && !shown.should_close() {
        view.dialogs.open = Some(open);
    }
}
