//! Keys of the results screen, while no field or dialog owns them.

use super::ResultsView;
use super::layout::Places;
use super::order::next_out;
use crate::gui::action::Action;
use crate::gui::scene::content::PartContent;
use crate::gui::scope::Scope;
use crate::inspect::PointResult;
use egui::{Key, Modifiers, Ui};
use std::sync::Arc;

/// Acts on keys.
pub fn keys(
    ui: &Ui,
    points: &[PointResult],
    places: &Places,
    content: Option<&Arc<PartContent>>,
    view: &mut ResultsView,
    scope: &mut Scope,
) {
    if !scope.letters_are_free(ui) {
        return;
    }
    let pressed = |modifiers: Modifiers, key: Key| ui.input_mut(|i| i.consume_key(modifiers, key));
    for (modifiers, backwards) in [(Modifiers::SHIFT, true), (Modifiers::NONE, false)] {
        if pressed(modifiers, Key::N)
            && let Some(k) = next_out(points, scope.view.point, backwards)
        {
            scope.ask(Action::ChoosePoint(Some(k)));
        }
    }
    if pressed(Modifiers::NONE, Key::M) {
        view.toggle_measuring();
    }
    let layer = view.layer(places.cad.is_none());
    let (scene, _) = super::views::parts(places.map, layer);
    if ui.input_mut(|i| i.consume_key(Modifiers::COMMAND | Modifiers::SHIFT, Key::S)) {
        view.picture.save(ui.ctx(), scene);
    }
    if ui.input(|i| i.events.iter().any(|e| matches!(e, egui::Event::Copy))) {
        view.picture.copy(ui.ctx(), scene);
    }
    if view.measuring && pressed(Modifiers::NONE, Key::Escape) {
        view.measuring = false;
        view.picks.clear();
    }
    // Arrows walk among controls while one of them has the focus.
    if let Some(content) = content
        && ui.memory(|m| m.focused().is_none())
    {
        view.linked.keys(ui, super::views::map_scene(places.map, layer), content, view.margin);
    }
}
