//! The plan of the other hand.

use super::End;
use super::fields::{Typed, fault_ui, foot_ui, text_ui};
use crate::gui::action::Action;
use crate::gui::engineer::Edit;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::plan::document::{Axis, Document, EditError, List, MirrorNames, MirrorPlane};
use egui::{RichText, ScrollArea, Ui};

const AXES: [(Axis, &str); 3] = [(Axis::X, "x"), (Axis::Y, "y"), (Axis::Z, "z")];

/// What was typed.
#[derive(Debug)]
pub struct MirrorForm {
    across: Axis,
    at: String,
    swap: bool,
    one: String,
    other: String,
    /// What it was foretold for, and what.
    foretold: Option<(Key, Result<Vec<Row>, EditError>)>,
}

/// What a preview depends on.
#[derive(Debug, Clone, PartialEq)]
struct Key {
    plane: MirrorPlane,
    names: MirrorNames,
    text: String,
}

/// A row before and after.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    names: [String; 2],
    places: [Option<[f64; 3]>; 2],
}

impl Default for MirrorForm {
    fn default() -> Self {
        let (one, other) = ("_L".to_owned(), "_R".to_owned());
        Self { across: Axis::Y, at: "0".to_owned(), swap: false, one, other, foretold: None }
    }
}

/// All rows before and after mirroring.
fn preview(document: &Document, plane: MirrorPlane, names: &MirrorNames) -> Result<Vec<Row>, EditError> {
    let mut copy = Document::unsaved(document.text(), document.path());
    copy.mirror(plane, names)?;
    let of = |document: &Document| {
        let lists = [List::Feature, List::Comparison].into_iter();
        let row = |(list, info): (List, crate::plan::document::RowInfo)| {
            let place = info.geometry(list).map(|g| g.position()).map(|p| [p.x, p.y, p.z]);
            (info.name, place)
        };
        lists
            .flat_map(|list| document.rows(list).into_iter().map(move |info| (list, info)))
            .map(row)
            .collect::<Vec<_>>()
    };
    let (before, after) = (of(document), of(&copy));
    let both = before.into_iter().zip(after);
    Ok(both.map(|((a, p), (b, q))| Row { names: [a, b], places: [p, q] }).collect())
}

/// Draws the dialog.
pub fn form_ui(ui: &mut Ui, form: &mut MirrorForm, document: &Document, scope: &mut Scope) -> End {
    let (words, theme) = (scope.words, scope.theme);
    ui.label(RichText::new(words.text("tables.mirror_note")).color(theme.quiet));
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        ui.label(words.text("tables.mirror_across"));
        for (axis, name) in AXES {
            if ui.radio(form.across == axis, name).clicked() {
                form.across = axis;
            }
        }
    });
    let at = Typed::of(&form.at);
    text_ui(ui, words.text("tables.mirror_at"), &mut form.at, "mm", at.number().is_none(), true, theme);
    ui.add_space(4.0);
    if ui.radio(!form.swap, words.text("tables.names_keep")).clicked() {
        form.swap = false;
    }
    if ui.radio(form.swap, words.text("tables.names_swap")).clicked() {
        form.swap = true;
    }
    let empty = form.swap && (form.one.trim().is_empty() || form.other.trim().is_empty() || form.one == form.other);
    if form.swap {
        text_ui(ui, words.text("tables.ending_one"), &mut form.one, "", empty, false, theme);
        text_ui(ui, words.text("tables.ending_other"), &mut form.other, "", empty, false, theme);
    }
    let names = match form.swap {
        true => MirrorNames::Swap { one: form.one.trim().to_owned(), other: form.other.trim().to_owned() },
        false => MirrorNames::Keep,
    };
    let plane = Typed::of(&form.at).number().map(|at_mm| MirrorPlane { across: form.across, at_mm });
    let may = match plane {
        None => Err(words.text("tables.not_a_number").to_owned()),
        Some(_) if empty => Err(words.text("tables.endings_empty").to_owned()),
        Some(plane) => foretell_ui(ui, form, document, plane, &names, scope),
    };
    let (pressed, end) = foot_ui(ui, &may, words.text("tables.mirror_do"), false, scope);
    if let Some(plane) = plane.filter(|_| pressed) {
        scope.ask(Action::Edit(Edit::Mirror(plane, names)));
    }
    end
}

/// Shows what would become of the rows; tells whether it may be done.
fn foretell_ui(
    ui: &mut Ui,
    form: &mut MirrorForm,
    document: &Document,
    plane: MirrorPlane,
    names: &MirrorNames,
    scope: &Scope,
) -> Result<String, String> {
    let words = scope.words;
    let key = Key { plane, names: names.clone(), text: document.text().to_owned() };
    if form.foretold.as_ref().is_none_or(|(of, _)| *of != key) {
        form.foretold = Some((key, preview(document, plane, names)));
    }
    match form.foretold.as_ref().map(|(_, told)| told) {
        Some(Ok(rows)) if !rows.is_empty() => {
            let renamed = rows.iter().filter(|row| row.names[0] != row.names[1]).count();
            let (n, renamed) = (words.thousands(rows.len()), words.thousands(renamed));
            ui.add_space(8.0);
            ui.label(words.fill("tables.mirror_changes", &[("n", &n), ("renamed", &renamed)]));
            rows_ui(ui, rows, words);
            Ok(words.text("tables.mirror_do").to_owned())
        }
        Some(Ok(_)) | None => Err(words.text("tables.no_rows").to_owned()),
        Some(Err(fault)) => {
            let told = words.with_help(&fault.to_string(), Some(fault.help()));
            fault_ui(ui, &told, scope.theme);
            Err(words.text("tables.cannot").to_owned())
        }
    }
}

fn rows_ui(ui: &mut Ui, rows: &[Row], words: &Words) {
    let place = |at: Option<[f64; 3]>| {
        at.map_or_else(|| "–".to_owned(), |v| v.map(|c| format!("{:>10}", words.signed_mm(c))).join(" "))
    };
    let mono = |text: String| RichText::new(text).font(fonts::mono(size::TABLE));
    let height = (ui.ctx().content_rect().height() * 0.3).max(90.0);
    ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
        egui::Grid::new("mirrored").striped(true).spacing([20.0, 4.0]).show(ui, |ui| {
            for Row { names: [before, after], places } in rows {
                let name = if before == after { before.clone() } else { format!("{before} → {after}") };
                ui.label(mono(name));
                ui.label(mono(place(places[0])).weak());
                ui.label(mono(place(places[1])));
                ui.end_row();
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_row_is_shown_before_and_after_and_the_plan_stays() {
        let demo = include_bytes!("../../../../settings/demo.toml");
        let document = Document::from_bytes(demo, Path::new("demo.toml")).unwrap();
        let plane = MirrorPlane { across: Axis::Y, at_mm: 10.0 };
        let names = MirrorNames::Swap { one: "1".into(), other: "_one".into() };
        let rows = preview(&document, plane, &names).unwrap();
        let count = |list| document.rows(list).len();
        assert_eq!(rows.len(), count(List::Feature) + count(List::Comparison));
        for Row { names: [before, after], places } in &rows {
            let expected = before.strip_suffix('1').map_or_else(|| before.clone(), |stem| format!("{stem}_one"));
            assert_eq!(*after, expected);
            let [Some(p), Some(q)] = places else { panic!("{before}") };
            assert!((p[0], p[2]) == (q[0], q[2]) && (p[1] + q[1] - 20.0).abs() < 1e-8, "{before} {p:?} {q:?}");
        }
        assert!(!document.is_modified());
    }
}
