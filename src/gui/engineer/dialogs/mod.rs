//! Dialogs over the engineer's screen: tolerances of many points, the other hand, tables.

use super::state::EngineerView;
use crate::gui::scope::Scope;
use egui::Ui;

/// Which of them is open, with what was typed into it.
#[derive(Debug, Default)]
pub struct Dialogs {}

impl Dialogs {
    /// Whether one is open.
    pub fn is_open(&self) -> bool {
        false
    }
}

/// Draws the dialog that is open.
pub(super) fn dialogs_ui(_ui: &mut Ui, _scope: &mut Scope, _view: &mut EngineerView) {}
