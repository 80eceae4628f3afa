//! What is loaded: part, number, revision, plan, scan folder.

use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words;
use egui::{Align2, Rect, Ui, pos2};
use std::path::Path;

/// Draws the line over the cards.
pub(super) fn loaded_ui(ui: &mut Ui, place: Rect, scope: &Scope) {
    let w = scope.words;
    let fields = fields(scope);
    let gap = 40.0;
    let mut x = place.left() + 8.0;
    for (key, value) in fields {
        let caption = w.text(key);
        let font = fonts::semibold(size::CARD);
        let wide = words::width(ui, &value, font.clone()).max(words::width(ui, caption, fonts::regular(size::TABLE)));
        let left = place.right() - x;
        if left < 80.0 {
            return;
        }
        let cell = Rect::from_min_max(pos2(x, place.top()), pos2(x + (wide + 2.0).min(left), place.bottom()));
        words::line(ui, cell, Align2::LEFT_TOP, caption, fonts::regular(size::TABLE), scope.theme.quiet);
        words::line(ui, cell.with_min_y(cell.top() + 18.0), Align2::LEFT_TOP, &value, font, scope.theme.text);
        x += wide + gap;
    }
}

fn fields(scope: &Scope) -> Vec<(&'static str, String)> {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut fields = Vec::new();
    if let Some(plan) = &scope.facts.plan {
        for (key, value) in [
            ("operator.part", &plan.part.name),
            ("operator.number", &plan.part.number),
            ("operator.revision", &plan.part.revision),
        ] {
            if !value.is_empty() {
                fields.push((key, crate::report::words::clean(value)));
            }
        }
    }
    if let Some(path) = &scope.facts.plan_path {
        fields.push(("operator.plan", name(path)));
    }
    if let Some(plan) = &scope.facts.plan {
        let count = match &scope.facts.scans {
            Some(Ok(scans)) => scope.words.count("operator.scans", scans.len()),
            _ => scope.words.text("operator.not_readable").to_owned(),
        };
        fields.push(("operator.scan_folder", format!("{}, {count}", name(&plan.scans.path))));
    }
    fields
}
