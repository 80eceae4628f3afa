//! The part, as it is picked on.

use super::state::EngineerView;
use crate::gui::scope::Scope;
use crate::gui::widgets::cards;
use egui::{Rect, Ui};

/// The view's own state.
#[derive(Debug, Default)]
pub struct View3d {}

/// Draws the toolbar and the part into a place.
pub(super) fn view_ui(ui: &mut Ui, at: Rect, scope: &mut Scope, _view: &mut EngineerView) {
    cards::card(ui, at, scope.theme);
}
