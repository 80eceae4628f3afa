//! Limits of many comparison points at once.

use super::End;
use super::fields::{Typed, fault_ui, foot_ui, text_ui};
use crate::gui::action::Action;
use crate::gui::engineer::{Chosen, Edit};
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::plan::LARGEST_MM;
use crate::plan::document::{Document, FieldValue, List, RowInfo};
use egui::{RichText, ScrollArea, Ui};

/// Which points get the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Which {
    /// Those that are chosen in the table.
    Chosen,
    /// All.
    All,
    /// All of a kind.
    Kind(&'static str),
}

const KINDS: [(&str, &str); 3] =
    [("surface", "tables.all_surface"), ("edge", "tables.all_edge"), ("hole", "tables.all_hole")];

/// What was typed.
#[derive(Debug, Default)]
pub struct TolerancesForm {
    which: Option<Which>,
    lower: String,
    upper: String,
}

/// A point whose limits would change.
#[derive(Debug, Clone, PartialEq)]
struct LimitChange {
    index: usize,
    name: String,
    before: [Option<f64>; 2],
    after: [Option<f64>; 2],
}

fn limits(row: &RowInfo) -> [Option<f64>; 2] {
    ["lower_mm", "upper_mm"].map(|key| match row.value(key) {
        Some(FieldValue::Number(v)) => Some(*v),
        _ => None,
    })
}

/// The indices of the points that are meant.
fn meant(rows: &[RowInfo], which: Which, chosen: &Chosen) -> Vec<usize> {
    let is_meant = |k: &usize| match which {
        Which::Chosen => chosen.has(List::Comparison, *k),
        Which::All => true,
        Which::Kind(kind) => rows[*k].kind == kind,
    };
    (0..rows.len()).filter(is_meant).collect()
}

/// What would change; `None` leaves a limit as it is.
fn changes(rows: &[RowInfo], meant: &[usize], new: [Option<f64>; 2]) -> Vec<LimitChange> {
    let change = |index: &usize| {
        let before = limits(&rows[*index]);
        let after = [new[0].or(before[0]), new[1].or(before[1])];
        let name = rows[*index].name.clone();
        (after != before).then_some(LimitChange { index: *index, name, before, after })
    };
    meant.iter().filter_map(change).collect()
}

/// Why the limits cannot be set, as a key among the texts with a point's name.
fn refusal(typed: [Typed; 2], changes: &[LimitChange]) -> Option<(&'static str, String)> {
    if typed.contains(&Typed::Wrong) {
        return Some(("tables.not_a_number", String::new()));
    }
    if typed.iter().any(|t| t.is_beyond(LARGEST_MM)) {
        return Some(("tables.limit_too_large", String::new()));
    }
    if typed == [Typed::Nothing; 2] {
        return Some(("tables.type_a_limit", String::new()));
    }
    let crossed = |c: &&LimitChange| matches!(c.after, [Some(lower), Some(upper)] if lower >= upper);
    if let Some(change) = changes.iter().find(crossed) {
        return Some(("tables.limits_crossed", change.name.clone()));
    }
    changes.is_empty().then_some(("tables.nothing_changes", String::new()))
}

/// Draws the dialog.
pub fn form_ui(ui: &mut Ui, form: &mut TolerancesForm, document: &Document, chosen: &Chosen, scope: &mut Scope) -> End {
    let (words, theme) = (scope.words, scope.theme);
    let rows = document.rows(List::Comparison);
    let some_chosen = chosen.list == Some(List::Comparison);
    let which = *form.which.get_or_insert(if some_chosen { Which::Chosen } else { Which::All });
    let all = [("tables.chosen_points", Which::Chosen), ("tables.all_points", Which::All)];
    for (key, choice) in all.into_iter().chain(KINDS.map(|(kind, key)| (key, Which::Kind(kind)))) {
        let n = meant(&rows, choice, chosen).len();
        let text = words.fill(key, &[("n", &words.thousands(n))]);
        if ui.add_enabled(n > 0, egui::RadioButton::new(which == choice, text)).clicked() {
            form.which = Some(choice);
        }
    }
    ui.add_space(8.0);
    let typed = [Typed::of(&form.lower), Typed::of(&form.upper)];
    let wrong = typed.map(|t| t == Typed::Wrong || t.is_beyond(LARGEST_MM));
    text_ui(ui, words.text("tables.lower"), &mut form.lower, words.text("tables.mm_or_nothing"), wrong[0], true, theme);
    text_ui(
        ui,
        words.text("tables.upper"),
        &mut form.upper,
        words.text("tables.mm_or_nothing"),
        wrong[1],
        false,
        theme,
    );
    let typed = [Typed::of(&form.lower), Typed::of(&form.upper)];
    let meant = meant(&rows, which, chosen);
    let changes = changes(&rows, &meant, typed.map(Typed::number));
    let refusal = refusal(typed, &changes);
    ui.add_space(8.0);
    if let Some((key @ ("tables.not_a_number" | "tables.limit_too_large" | "tables.limits_crossed"), name)) = &refusal {
        fault_ui(ui, &words.fill(key, &[("name", name)]), theme);
    }
    preview_ui(ui, &changes, meant.len(), words);
    let may = match &refusal {
        None => Ok(words.count("tables.set_limits", changes.len())),
        Some((key, name)) => Err(words.fill(key, &[("name", name)])),
    };
    let (pressed, end) = foot_ui(ui, &may, words.text("tables.set"), false, scope);
    if pressed {
        let [lower_mm, upper_mm] = typed.map(Typed::number);
        let indices = changes.iter().map(|c| c.index).collect();
        scope.ask(Action::Edit(Edit::SetTolerances { indices, lower_mm, upper_mm }));
    }
    end
}

fn preview_ui(ui: &mut Ui, changes: &[LimitChange], meant: usize, words: &Words) {
    let (n, rest) = (words.thousands(changes.len()), words.thousands(meant - changes.len()));
    ui.label(words.fill("tables.limits_change", &[("n", &n), ("rest", &rest)]));
    let mm = |limit: Option<f64>| limit.map_or_else(|| "–".to_owned(), |v| words.signed_mm(v));
    let height = (ui.ctx().content_rect().height() * 0.3).max(90.0);
    ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
        egui::Grid::new("limits").striped(true).spacing([20.0, 4.0]).show(ui, |ui| {
            for change in changes {
                let mono = |text: String| RichText::new(text).font(fonts::mono(size::TABLE));
                let ([lower, upper], [new_lower, new_upper]) = (change.before.map(mm), change.after.map(mm));
                ui.label(mono(change.name.clone()));
                ui.label(mono(format!("{lower} … {upper}")).weak());
                ui.label(mono(format!("{new_lower} … {new_upper}")));
                ui.end_row();
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn rows() -> Vec<RowInfo> {
        let demo = include_bytes!("../../../../settings/demo.toml");
        Document::from_bytes(demo, Path::new("demo.toml")).unwrap().rows(List::Comparison)
    }

    #[test]
    fn only_points_that_are_meant_and_have_other_limits_change() {
        let rows = rows();
        let edges: Vec<usize> = (0..rows.len()).filter(|k| rows[*k].kind == "edge").collect();
        assert!(!edges.is_empty());
        let none = Chosen::default();
        assert_eq!(meant(&rows, Which::Kind("edge"), &none), edges);
        assert_eq!(meant(&rows, Which::All, &none).len(), rows.len());
        assert!(meant(&rows, Which::Chosen, &none).is_empty());
        let chosen = Chosen { list: Some(List::Comparison), rows: vec![1, 3] };
        assert_eq!(meant(&rows, Which::Chosen, &chosen), [1, 3]);
        let own = limits(&rows[1]);
        assert!(changes(&rows, &[1], own).is_empty());
        let told = changes(&rows, &[1, 3], [None, Some(0.125)]);
        assert!(told.iter().all(|c| c.after == [c.before[0], Some(0.125)]) && told.len() == 2);
    }

    #[test]
    fn limits_that_cross_or_are_no_numbers_are_refused_with_the_point() {
        let rows = rows();
        let key = |typed: [Typed; 2]| refusal(typed, &changes(&rows, &[0], typed.map(Typed::number)));
        let upper = limits(&rows[0])[1].unwrap();
        assert_eq!(key([Typed::Wrong, Typed::Nothing]).unwrap().0, "tables.not_a_number");
        assert_eq!(key([Typed::Nothing; 2]).unwrap().0, "tables.type_a_limit");
        let crossed = key([Typed::Number(upper), Typed::Nothing]).unwrap();
        assert_eq!(crossed, ("tables.limits_crossed", rows[0].name.clone()));
        assert_eq!(key([Typed::Nothing, Typed::Number(upper)]).unwrap().0, "tables.nothing_changes");
        assert_eq!(key([Typed::Number(-1.0), Typed::Number(1.0)]), None);
    }
}
