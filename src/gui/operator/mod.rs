//! The operator's screen: is the last part good, and does the line keep up? Nothing here changes the plan.

use super::action::Action;
use super::scope::Scope;
use egui::Ui;

/// Draws the screen.
pub(super) fn operator_ui(ui: &mut Ui, scope: &mut Scope) {
    if ui.button(scope.words.text("operator.run")).clicked() {
        scope.ask(Action::Run);
    }
}
