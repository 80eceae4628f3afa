//! The list of shortcuts (F1).

use super::action::Action;
use super::fonts;
use super::keys;
use super::scope::Scope;
use super::theme::size;
use super::widgets::cards;
use egui::{Grid, RichText, Ui, vec2};

/// Shows the list while it is asked for.
pub(super) fn help_ui(ui: &mut Ui, scope: &mut Scope) {
    if !scope.view.help {
        return;
    }
    let words = scope.words;
    let shown = cards::modal(ui, egui::Id::unique("help")).show(ui.ctx(), |ui| {
        ui.heading(words.text("help.title"));
        ui.add_space(8.0);
        let room = (ui.ctx().content_rect().height() - 220.0).max(120.0);
        egui::ScrollArea::vertical().max_height(room).show(ui, |ui| {
            Grid::new("shortcuts").num_columns(2).spacing([24.0, 8.0]).show(ui, |ui| {
                for (keys, what) in keys::EVERYWHERE.iter().chain(keys::RESULTS).chain(keys::ENGINEER) {
                    ui.label(RichText::new(*keys).font(fonts::mono(size::BODY)));
                    ui.label(words.text(what));
                    ui.end_row();
                }
            });
        });
        ui.add_space(8.0);
        ui.label(RichText::new(crate::report::words::PROGRAM).color(scope.theme.quiet));
        ui.add_space(8.0);
        let close = RichText::new(words.text("help.close")).size(size::BAR);
        ui.add(egui::Button::new(close).min_size(vec2(120.0, 48.0))).clicked()
    });
    if shown.inner || shown.should_close() {
        scope.ask(Action::Help(false));
    }
}
