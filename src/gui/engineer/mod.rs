//! The engineer's screen: what of the plan is to change, and what it costs.
//!
//! `Facts::editing` is the plan as it is edited; `EngineerView` is what is looked at. Everything that changes the plan is an
//! `Action::Edit`, and only while the screen is unlocked.

pub mod dialogs;
pub mod editing;
mod layout;
pub mod state;
pub mod view3d;

pub use editing::{Edit, Editing};
pub use state::{Chosen, Draft, EngineerView, Section, Tool};

use super::scope::Scope;
use super::widgets::cards;
use egui::Ui;

/// Draws the screen.
pub(super) fn engineer_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
    let places = layout::places(ui.max_rect());
    view3d::view_ui(ui, places.view, scope, view);
    for at in [Some(places.form), Some(places.problems), Some(places.changes), places.tree].into_iter().flatten() {
        cards::card(ui, at, scope.theme);
    }
    if let (Some(tree), true) = (places.tree, scope.facts.editing.is_some()) {
        dialogs::buttons_ui(ui, tree, scope, view);
    }
    dialogs::dialogs_ui(ui, scope, view);
}
