//! The button beside a field that names a file or folder: the system's dialog, and the path as the plan names it.

use super::state::EngineerView;
use crate::gui::later::Asked;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::plan::document::{Holds, Setting};
use egui::{Button, RichText, Ui, WidgetInfo};
use std::path::Path;

/// The endings of CAD files.
const CADS: &[&str] = &["stl", "obj", "ply"];

/// What the button takes of a line, with the gap before it.
pub fn button_width(ui: &Ui, words: &Words) -> f32 {
    let text = words.text("tables.choose_file");
    crate::gui::widgets::words::width(ui, text, crate::gui::fonts::regular(size::TABLE)) + 22.0
}

/// Draws the button; returns the path that was chosen, once, relative to the plan where it lies below the plan's folder.
pub fn choose_ui(
    ui: &mut Ui,
    scope: &Scope,
    view: &mut EngineerView,
    setting: &Setting,
    label: &str,
) -> Option<String> {
    let of = (setting.table, setting.key);
    let text = scope.words.text("tables.choose_file");
    let button = ui.add(Button::new(RichText::new(text).size(size::TABLE)).min_size(egui::vec2(0.0, 26.0)));
    button.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, format!("{label}: {text}")));
    let folder = scope.facts.editing.as_ref().and_then(|e| e.document.path().parent());
    if button.clicked() && !view.dialog.is_open() {
        let asked = if setting.holds == Holds::Folder { Asked::Folder } else { Asked::Open(CADS) };
        view.dialog.ask(ui.ctx(), asked, folder);
        view.dialog_for = Some(of);
    }
    let path = (view.dialog_for == Some(of)).then(|| view.dialog.answer()).flatten()?;
    Some(crate::plan::document::seen_from(folder.unwrap_or(Path::new("")), &path))
}
