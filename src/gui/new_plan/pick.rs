//! Step 4: features and points, on the engineer's own screen; above it, how the part is held so far.

use super::Assistant;
use crate::gui::action::Action;
use crate::gui::engineer::{self, Edit, EngineerView};
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::plan::document::{Document, FieldValue, List};
use egui::{Align, Button, Layout, Rect, RichText, Ui, vec2};

const LINE: f32 = 40.0;

/// Draws the step.
pub fn pick_ui(ui: &mut Ui, body: Rect, scope: &mut Scope<'_>, assistant: &Assistant, view: &mut EngineerView) {
    let line = body.with_max_y(body.top() + LINE);
    // The line stands where the engineer's header would.
    let rest = body.with_min_y(line.bottom() - engineer::HEADER);
    let mut line = line.shrink2(vec2(16.0, 4.0));
    let Some(editing) = &scope.facts.editing else { return };
    let breadth = engineer::breadth(rest, view);
    line.min.x = engineer::panes_ui(ui, line, breadth, scope, view, editing);
    if let Some(document) = super::document(scope, assistant) {
        held_ui(ui, line, document, scope);
    }
    engineer::body_ui(ui, rest, scope, view, editing);
}

/// The first hole, slot and surface feature, once all three are there.
fn datums(document: &Document) -> Option<[String; 3]> {
    let rows = document.rows(List::Feature);
    let first = |kind: &str| rows.iter().find(|row| row.kind == kind).map(|row| row.name.clone());
    Some([first("hole")?, first("slot")?, first("surface")?])
}

/// Which feature is missing, as a key among the texts; `None` = none.
fn missing(document: &Document) -> Option<&'static str> {
    let rows = document.rows(List::Feature);
    let kinds = [("hole", "new_plan.no_hole"), ("slot", "new_plan.no_slot"), ("surface", "new_plan.no_surface")];
    kinds.into_iter().find(|(kind, _)| !rows.iter().any(|row| row.kind == *kind)).map(|(_, key)| key)
}

/// How the part is held, and the button that holds it by its features.
fn held_ui(ui: &mut Ui, at: Rect, document: &Document, scope: &mut Scope) {
    let words = scope.words;
    let text = |key: &str| match document.setting("alignment", key) {
        Some(FieldValue::Text(text)) => text,
        _ => String::new(),
    };
    let now = ["hole", "slot", "point"].map(text);
    let by_features = text("method") == "features";
    let all = datums(document);
    let names = |names: &[String; 3]| names.join(", ");
    let sentence = match (&all, missing(document)) {
        _ if by_features => words.fill("new_plan.held_by", &[("names", &names(&now))]),
        (_, Some(key)) => words.text(key).to_owned(),
        _ => words.text("new_plan.held_best_fit").to_owned(),
    };
    let builder = egui::UiBuilder::new().max_rect(at).layout(Layout::left_to_right(Align::Center));
    ui.scope_builder(builder, |ui| {
        if let Some(all) = all.filter(|all| !by_features || *all != now) {
            let text = words.fill("new_plan.hold_by", &[("names", &names(&all))]);
            if !by_features && ui.add(Button::new(text).min_size(vec2(0.0, 28.0))).clicked() {
                scope.ask(Action::Edit(Edit::HoldByFeatures(all)));
            }
        }
        let text = RichText::new(sentence).font(fonts::regular(size::BODY)).color(scope.theme.quiet);
        ui.add(egui::Label::new(text).truncate());
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_part_can_be_held_once_hole_slot_and_surface_are_there() {
        let demo = include_bytes!("../../../settings/demo.toml");
        let mut document = Document::from_bytes(demo, Path::new("demo.toml")).unwrap();
        assert_eq!(datums(&document), Some(["H1", "S1", "A1"].map(str::to_owned)));
        assert_eq!(missing(&document), None);
        let slot = document.rows(List::Feature).iter().position(|row| row.kind == "slot").unwrap();
        document.remove(List::Feature, &[slot]).unwrap();
        assert_eq!((datums(&document), missing(&document)), (None, Some("new_plan.no_slot")));
    }
}
