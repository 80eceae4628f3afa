//! Buttons of the standard views.

use super::camera::StandardView;
use super::linked::Linked;
use crate::gui::text::Words;
use crate::gui::theme::size;
use egui::{Button, RichText, Role, Ui, WidgetInfo, vec2};

/// The standard views.
pub fn standard_ui(ui: &mut Ui, linked: &mut Linked, words: &Words) {
    let names = ["1", "2", "3", "4", "5", "6", "Iso"];
    let keys = [
        "results.view_front",
        "results.view_back",
        "results.view_left",
        "results.view_right",
        "results.view_top",
        "results.view_bottom",
        "results.view_isometric",
    ];
    let mut all: Vec<_> = names.into_iter().zip(StandardView::ALL).zip(keys).collect();
    // In a bar whose buttons are added from the right, they stand in the same order.
    if ui.layout().prefer_right_to_left() {
        all.reverse();
    }
    for ((name, standard), key) in all {
        let button = ui.add(Button::new(RichText::new(name).size(size::TABLE)).min_size(vec2(26.0, 26.0)));
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text(key)));
        if button.on_hover_text(words.text(key)).clicked() {
            linked.show(standard);
        }
    }
}
