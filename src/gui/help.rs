//! The list of shortcuts (F1).

use super::action::Action;
use super::fonts;
use super::keys;
use super::scope::Scope;
use super::theme::size;
use super::widgets::{cards, words as write};
use egui::{RichText, Ui, vec2};

/// Shows the list while it is asked for.
pub(super) fn help_ui(ui: &mut Ui, scope: &mut Scope) {
    if !scope.view.help {
        return;
    }
    let words = scope.words;
    let shown = cards::modal(ui, egui::Id::unique("help")).show(ui.ctx(), |ui| {
        ui.heading(words.text("help.title"));
        ui.add_space(8.0);
        let window = ui.ctx().content_rect().size();
        let all = || keys::EVERYWHERE.iter().chain(keys::RESULTS).chain(keys::ENGINEER).chain(keys::MERGE);
        let wide = |keys: &str| write::width(ui, keys, fonts::mono(size::BODY));
        let keys_width = all().map(|(keys, _)| wide(keys)).fold(0.0, f32::max) + 24.0;
        ui.set_width(f32::min(keys_width + 420.0, window.x - 80.0));
        egui::ScrollArea::vertical().max_height((window.y - 220.0).max(120.0)).show(ui, |ui| {
            for (keys, what) in all() {
                ui.horizontal_top(|ui| {
                    ui.spacing_mut().item_spacing.x = 0.0;
                    let (at, _) = ui.allocate_exact_size(vec2(keys_width, 24.0), egui::Sense::hover());
                    let line = at.with_max_y(at.top() + 18.0);
                    let font = fonts::mono(size::BODY);
                    write::line(ui, line, egui::Align2::LEFT_CENTER, keys, font, scope.theme.text);
                    ui.add(egui::Label::new(words.text(what)).wrap());
                });
            }
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
