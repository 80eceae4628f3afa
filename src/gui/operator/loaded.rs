//! What is loaded: part, number, revision, plan, scan folder.

use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words;
use egui::{Align2, Rect, Ui, pos2};
use std::path::Path;

/// Between two fields.
const GAP: f32 = 32.0;

/// Draws the line over the cards.
pub(super) fn loaded_ui(ui: &mut Ui, place: Rect, scope: &Scope) {
    draw(ui, place, fields(scope), scope);
}

/// Draws which part it is, beside a message; returns where that ends.
pub(super) fn who_ui(ui: &mut Ui, place: Rect, scope: &Scope) -> f32 {
    let who: Vec<_> = fields(scope).into_iter().filter(|(key, _)| WHO.contains(key)).collect();
    let place = place.with_max_x(place.left() + 0.42 * place.width());
    draw(ui, place, who, scope)
}

/// What a part is known by: it stays whatever else has no room.
const WHO: [&str; 3] = ["operator.part", "operator.number", "operator.revision"];

fn draw(ui: &mut Ui, place: Rect, mut fields: Vec<(&'static str, String)>, scope: &Scope) -> f32 {
    let w = scope.words;
    let font = || fonts::semibold(size::CARD);
    let caption = |ui: &Ui, key: &str| words::width(ui, w.text(key), fonts::regular(size::TABLE));
    let wide = |ui: &Ui, (key, value): &(&str, String)| words::width(ui, value, font()).max(caption(ui, key)) + 2.0;
    let mut widths: Vec<f32> = fields.iter().map(|field| wide(ui, field)).collect();
    let least: Vec<f32> = fields.iter().map(|(key, _)| caption(ui, key).max(least(key)) + 2.0).collect();
    let room = place.width() - 8.0;
    while fields.len() > WHO.len() && sum(&least_of(&widths, &least)) > room {
        // Folder and plan leave before the part is not known any more.
        fields.pop();
        widths.pop();
    }
    shrink(&mut widths, &least, room);
    let mut x = place.left() + 8.0;
    for ((key, value), wide) in fields.iter().zip(widths) {
        let cell = Rect::from_min_max(pos2(x, place.top()), pos2((x + wide).min(place.right()), place.bottom()));
        words::line(ui, cell, Align2::LEFT_TOP, w.text(key), fonts::regular(size::TABLE), scope.theme.quiet);
        // What tells files apart stands at their ends.
        let name = value.split_once(", ").map_or(&**value, |(name, _)| name);
        let shown = words::with_name_in(ui, value, name, &font(), cell.width());
        words::line(ui, cell.with_min_y(cell.top() + 18.0), Align2::LEFT_TOP, &shown, font(), scope.theme.text);
        x += wide + GAP;
    }
    x - GAP
}

/// To what a field may be shortened. A number or revision is no other one by its first letters.
fn least(key: &str) -> f32 {
    match key {
        "operator.number" | "operator.revision" => f32::INFINITY,
        "operator.part" => 120.0,
        _ => 90.0,
    }
}

fn least_of(widths: &[f32], least: &[f32]) -> Vec<f32> {
    widths.iter().zip(least).map(|(wide, least)| wide.min(*least)).collect()
}

fn sum(widths: &[f32]) -> f32 {
    widths.iter().sum::<f32>() + GAP * widths.len().saturating_sub(1) as f32
}

/// Takes what is too much from the widest first, so that one long name shortens nothing else.
fn shrink(widths: &mut [f32], least: &[f32], room: f32) {
    loop {
        let over = sum(widths) - room;
        let can = |k: &usize| widths[*k] > least[*k] + 0.5;
        let widest = (0..widths.len()).filter(can).max_by(|a, b| widths[*a].total_cmp(&widths[*b]));
        let (true, Some(k)) = (over > 0.0, widest) else { return };
        let next = (0..widths.len()).filter(|other| *other != k).map(|other| widths[other]).fold(0.0, f32::max);
        let to = if next < widths[k] { next } else { least[k] };
        widths[k] = to.max(least[k]).max(widths[k] - over);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_is_shortened_and_number_and_revision_stay() {
        let least = [120.0, f32::INFINITY, f32::INFINITY, 90.0, 90.0];
        for (name, room) in [(1100.0, 1200.0), (1100.0, 776.0), (200.0, 776.0), (100.0, 776.0), (5000.0, 3000.0)] {
            let natural = [name, 90.0, 70.0, 110.0, 230.0];
            let mut widths = natural;
            shrink(&mut widths, &least, room);
            assert_eq!(widths[1..3], natural[1..3]);
            assert!(sum(&widths) <= room + 1.0, "{widths:?} in {room}");
            assert!(widths.iter().zip(&least).zip(&natural).all(|((w, l), n)| *w >= l.min(*n) - 0.5), "{widths:?}");
            if sum(&natural) <= room {
                assert_eq!(widths, natural);
            }
        }
    }
}
