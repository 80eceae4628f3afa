//! What the dialogs are made of: fields for numbers, a line that says what is wrong, the buttons at the foot.

use super::End;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::typed_number;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign;
use egui::{Button, Key, Layout, Rect, RichText, Stroke, StrokeKind, TextEdit, Ui, vec2};

/// A number that may be typed: nothing, a number, or something else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Typed {
    /// Nothing stands there.
    Nothing,
    /// A number.
    Number(f64),
    /// Something that is none.
    Wrong,
}

impl Typed {
    /// What stands in a field; comma or point.
    pub fn of(text: &str) -> Self {
        match typed_number(text) {
            _ if text.trim().is_empty() => Typed::Nothing,
            Some(number) => Typed::Number(number),
            None => Typed::Wrong,
        }
    }

    /// Whether it is a number farther from zero than this.
    pub fn is_beyond(self, most: f64) -> bool {
        self.number().is_some_and(|number| number.abs() > most)
    }

    /// The number, if it is one.
    pub fn number(self) -> Option<f64> {
        match self {
            Typed::Number(number) => Some(number),
            Typed::Nothing | Typed::Wrong => None,
        }
    }
}

/// A field of its own row: words, field, unit. `first`: it takes the focus when the dialog opens.
pub fn text_ui(ui: &mut Ui, label: &str, text: &mut String, unit: &str, wrong: bool, first: bool, theme: &Theme) {
    ui.horizontal(|ui| {
        let column = Layout::left_to_right(egui::Align::Center);
        let label = ui.allocate_ui_with_layout(vec2(150.0, 30.0), column, |ui| {
            ui.set_min_width(150.0);
            ui.label(label)
        });
        let label = label.inner;
        let edit = TextEdit::singleline(text).font(fonts::mono(size::BODY)).desired_width(130.0);
        let field = ui.add(edit).labelled_by(label.id);
        if wrong {
            ui.painter().rect_stroke(field.rect, 4, Stroke::new(2.0, theme.fail), StrokeKind::Outside);
        }
        if first && ui.memory(|m| m.focused().is_none()) {
            field.request_focus();
        }
        ui.label(RichText::new(unit).color(theme.quiet));
    });
}

/// A fault as a sentence with its square.
pub fn fault_ui(ui: &mut Ui, text: &str, theme: &Theme) {
    ui.horizontal_top(|ui| {
        let (at, _) = ui.allocate_exact_size(vec2(16.0, 18.0), egui::Sense::hover());
        sign::problem(ui.painter(), Rect::from_center_size(at.center(), vec2(15.0, 15.0)), true, theme);
        ui.add(egui::Label::new(text).wrap());
    });
}

/// The buttons at the foot; `may`: the words of the first one, or why it cannot be pressed. Returns whether it was, and what becomes of the
/// dialog. Enter presses it, too, unless `own_enter`: a field takes it.
pub fn foot_ui(ui: &mut Ui, may: &Result<String, String>, name: &str, own_enter: bool, scope: &Scope) -> (bool, End) {
    ui.add_space(12.0);
    let theme = scope.theme;
    let (mut pressed, mut end) = (false, End::Open);
    let row = vec2(ui.available_width(), 36.0);
    ui.allocate_ui_with_layout(row, Layout::right_to_left(egui::Align::Center), |ui| {
        let cancel = Button::new(scope.words.text("dialog.cancel")).min_size(vec2(96.0, 32.0));
        if ui.add(cancel).clicked() {
            end = End::Shut;
        }
        // A button that has the focus takes Enter for itself.
        let typing = ui.ctx().text_edit_focused() || ui.memory(|m| m.focused().is_none());
        let enter = !own_enter && typing && ui.input(|i| i.key_pressed(Key::Enter));
        match may {
            Ok(text) => {
                let button = Button::new(RichText::new(text).color(theme.on_accent)).fill(theme.accent);
                pressed = ui.add(button.min_size(vec2(140.0, 32.0))).clicked() || enter;
            }
            Err(why) => {
                let button = Button::new(RichText::new(name).color(theme.quiet)).min_size(vec2(140.0, 32.0));
                ui.add_enabled(false, button);
                ui.add(egui::Label::new(RichText::new(why).color(theme.quiet)).wrap());
            }
        }
    });
    (pressed, if pressed { End::Shut } else { end })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_typed_with_comma_or_point_or_not_at_all() {
        assert_eq!(Typed::of("  "), Typed::Nothing);
        assert_eq!([Typed::of("-0,25"), Typed::of("\u{2212}0.25")], [Typed::Number(-0.25); 2]);
        assert_eq!([Typed::of("0,2,5"), Typed::of("inf")], [Typed::Wrong; 2]);
    }
}
