//! One message at a time, in a line over the screen: what was found and what to do, in the words of the command line.

use super::action::Action;
use super::fonts;
use super::scope::Scope;
use super::text::Words;
use super::theme::size;
use super::widgets::buttons::{self, Weight};
use super::widgets::{sign, words};
use crate::diagnostic::{Diagnostic, Severity};
use crate::report::words::clean;
use egui::{Align2, Frame, Panel, Rect, Ui, Vec2, pos2, vec2};

/// A message as one text: place, what was found. The severity is told by its sign.
pub(super) fn sentence(diagnostic: &Diagnostic, words: &Words) -> String {
    let text = Diagnostic { help: None, ..words.diagnostic(diagnostic) }.to_string();
    let text = text.strip_prefix("error: ").or_else(|| text.strip_prefix("warning: ")).unwrap_or(&text);
    text.to_owned()
}

/// Where it is, and what to do.
fn note(message: &Diagnostic, words: &Words) -> String {
    let place = message.place();
    let help = message.help.as_deref().map(|help| words.told(help));
    [place, help].into_iter().flatten().collect::<Vec<_>>().join("   ")
}

/// How high a message is.
pub(super) const HEIGHT: f32 = 52.0;

/// Shows the message that nobody put away yet, over a screen that has no place for it.
pub(super) fn message_ui(ui: &mut Ui, scope: &mut Scope) {
    if scope.facts.message.is_some() {
        let frame = Frame::NONE.fill(scope.theme.raised);
        Panel::top("message").frame(frame).exact_size(HEIGHT).show(ui, |ui| place_ui(ui, ui.max_rect(), scope));
    }
}

/// Shows the message in a place of a screen.
pub(super) fn place_ui(ui: &mut Ui, place: Rect, scope: &mut Scope) {
    let Some(message) = &scope.facts.message else { return };
    let theme = scope.theme;
    // The colours of verdicts are for verdicts.
    ui.painter().rect_filled(place, 0, theme.raised);
    let inside = place.shrink2(vec2(16.0, 4.0));
    let mark = Rect::from_center_size(inside.left_center() + vec2(18.0, 0.0), Vec2::splat(34.0));
    sign::problem(ui.painter(), mark, message.severity == Severity::Error, theme);
    let close = scope.words.text("messages.dismiss");
    let wide = words::width(ui, close, fonts::semibold(size::BAR)) + 40.0;
    let button = inside.with_min_x(inside.right() - wide);
    let text = Rect::from_min_max(pos2(mark.right() + 14.0, inside.top()), button.left_bottom() - vec2(16.0, 0.0));
    let what = scope.words.told(&message.message);
    let upper = text.with_max_y(text.center().y);
    words::line(ui, upper, Align2::LEFT_CENTER, &what, fonts::semibold(size::BAR), theme.text);
    let lower = text.with_min_y(text.center().y);
    words::line(
        ui,
        lower,
        Align2::LEFT_CENTER,
        &clean(&note(message, scope.words)),
        fonts::regular(size::BODY),
        theme.text,
    );
    let font = fonts::semibold(size::BAR);
    if buttons::with_words(ui, "dismiss", button, Weight::Quiet, close, font, theme).clicked() {
        scope.ask(Action::Dismiss);
    }
}
