//! One message at a time, in a line over the screen: what was found and what to do, in the words of the command line.

use super::action::Action;
use super::fonts;
use super::scope::Scope;
use super::theme::size;
use super::widgets::sign;
use crate::diagnostic::{Diagnostic, Severity};
use egui::{Frame, Margin, Panel, RichText, Ui, Vec2};

/// A message as one text: place, what was found. The severity is told by its sign.
pub(super) fn sentence(diagnostic: &Diagnostic) -> String {
    let text = Diagnostic { help: None, ..diagnostic.clone() }.to_string();
    let text = text.strip_prefix("error: ").or_else(|| text.strip_prefix("warning: ")).unwrap_or(&text);
    text.to_owned()
}

/// Shows the message that nobody put away yet.
pub(super) fn message_ui(ui: &mut Ui, scope: &mut Scope) {
    let Some(message) = scope.facts.message.clone() else { return };
    let theme = scope.theme;
    let fill = if message.severity == Severity::Error { theme.fail_fill } else { theme.undecided_fill };
    let frame = Frame::NONE.fill(fill).inner_margin(Margin::symmetric(16, 8));
    Panel::top("message").frame(frame).show(ui, |ui| {
        ui.horizontal(|ui| {
            let (place, _) = ui.allocate_exact_size(Vec2::splat(28.0), egui::Sense::hover());
            sign::problem(ui.painter(), place, message.severity == Severity::Error, theme);
            let close = scope.words.text("messages.dismiss");
            let width = ui.available_width() - 150.0;
            ui.allocate_ui(egui::vec2(width, 0.0), |ui| {
                ui.vertical(|ui| {
                    ui.label(RichText::new(sentence(&message)).font(fonts::semibold(size::BAR)).color(theme.text));
                    if let Some(help) = &message.help {
                        ui.label(RichText::new(help).size(size::BODY).color(theme.text));
                    }
                });
            });
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let button = egui::Button::new(RichText::new(close).size(size::BAR)).min_size(Vec2::new(96.0, 40.0));
                if ui.add(button).clicked() {
                    scope.ask(Action::Dismiss);
                }
            });
        });
    });
}
