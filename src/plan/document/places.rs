//! From the line of a message to the field of a form.

use super::keys::TABLES;
use super::{Document, SETTINGS};
use crate::diagnostic::Diagnostic;
use crate::plan::problems::{Lines, Problems};
use crate::plan::syntax::read_document;
use toml_edit::{Item, TableLike, Value};

/// A table of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// Above the first table, or nowhere in particular.
    Plan,
    /// A table of settings, such as `part`.
    Settings(&'static str),
    /// A feature, by its index.
    Feature(usize),
    /// A comparison point, by its index.
    Comparison(usize),
    /// A row of `[[alignment.rps]]`, by its index.
    Lock(usize),
    /// A row of `[[alignment.region]]`, by its index.
    Region(usize),
    /// The comparison file, or its mention in the plan.
    PointsFile,
    /// Another file, such as the CAD.
    OtherFile,
}

/// A field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Its table.
    pub at: At,
    /// Its key, where one is meant.
    pub key: Option<String>,
}

/// A problem of a plan with its field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanProblem {
    /// What it is.
    pub diagnostic: Diagnostic,
    /// Where it stands.
    pub place: Place,
}

/// A key or header with its line.
struct Mark {
    line: usize,
    at: At,
    key: Option<String>,
}

impl Document {
    /// The problems of the text alone, as `check` tells them, each with its field.
    pub fn problems(&self) -> Vec<PlanProblem> {
        self.locate(self.read().problems)
    }

    /// Finds the fields of messages about this plan.
    pub fn locate(&self, diagnostics: Vec<Diagnostic>) -> Vec<PlanProblem> {
        let marks = marks(&self.text);
        let points_file = self.points_file();
        let place = |d: &Diagnostic| {
            if d.file.as_deref().is_none_or(|file| file == self.path) {
                return place_of(&marks, d);
            }
            let folder = self.path.parent().unwrap_or(std::path::Path::new(""));
            let is_points = points_file.as_ref().is_some_and(|p| d.file.as_deref() == Some(&folder.join(p)));
            Place { at: if is_points { At::PointsFile } else { At::OtherFile }, key: None }
        };
        diagnostics.into_iter().map(|diagnostic| PlanProblem { place: place(&diagnostic), diagnostic }).collect()
    }

    /// The line, from 1, on which a table or row begins.
    pub fn line_of(&self, at: At) -> Option<usize> {
        marks(&self.text).iter().find(|mark| mark.at == at && mark.key.is_none()).map(|mark| mark.line)
    }
}

fn place_of(marks: &[Mark], d: &Diagnostic) -> Place {
    let key = d.key.as_deref().map(str::to_owned);
    let nowhere = Place { at: At::Plan, key: key.clone() };
    let Some(line) = d.line else { return nowhere };
    let on_line = |key: Option<&str>| marks.iter().find(|m| m.line == line && m.key.as_deref() == key);
    let by_key = d.key.as_deref().and_then(|key| on_line(Some(key)));
    if let (None, Some(at)) = (by_key, d.key.as_deref().and_then(table_named)) {
        return Place { at, key: None };
    }
    // The key itself; else the header on this line; else any key on it; else the table around it.
    let found = by_key
        .or_else(|| on_line(None))
        .or_else(|| marks.iter().find(|m| m.line == line && d.key.is_none()))
        .or_else(|| marks.iter().rfind(|m| m.line <= line && m.key.is_none()));
    found.map_or(nowhere, |mark| Place { at: mark.at, key: key.or_else(|| mark.key.clone()) })
}

/// A table that is missing is told by its own name.
fn table_named(key: &str) -> Option<At> {
    SETTINGS.iter().find(|(name, _)| *name == key).map(|(name, _)| At::Settings(name))
}

/// All keys and headers, by line.
fn marks(text: &str) -> Vec<Mark> {
    let problems = Problems::new(std::path::Path::new(""));
    let Some(readable) = read_document(text, &problems) else { return Vec::new() };
    let (root, lines) = (readable.document.as_table(), &readable.lines);
    let mut marks = Vec::new();
    keys(root, At::Plan, lines, &mut marks, &[]);
    for (name, _) in SETTINGS {
        if let Some(table) = root.get(name).and_then(Item::as_table_like) {
            header(root, name, At::Settings(name), lines, &mut marks);
            keys(table, At::Settings(name), lines, &mut marks, &["rps", "region"]);
            rows(table.get("rps").filter(|_| name == "alignment"), lines, &mut marks, At::Lock);
            rows(table.get("region").filter(|_| name == "alignment"), lines, &mut marks, At::Region);
        }
    }
    if let Some(table) = root.get("comparison_file").and_then(Item::as_table_like) {
        header(root, "comparison_file", At::PointsFile, lines, &mut marks);
        keys(table, At::PointsFile, lines, &mut marks, &[]);
    }
    rows(root.get("feature"), lines, &mut marks, At::Feature);
    rows(root.get("comparison"), lines, &mut marks, At::Comparison);
    marks.sort_by_key(|mark| mark.line);
    marks
}

/// Where a table begins: its header, or the first of its dotted keys.
fn header(root: &dyn TableLike, name: &str, at: At, lines: &Lines, marks: &mut Vec<Mark>) {
    let item = root.get(name);
    let span = item.and_then(Item::span).or_else(|| root.key(name).and_then(toml_edit::Key::span));
    marks.extend(span.map(|span| Mark { line: lines.at(span.start), at, key: None }));
}

fn keys(table: &dyn TableLike, at: At, lines: &Lines, marks: &mut Vec<Mark>, but: &[&str]) {
    for (key, item) in table.iter() {
        if but.contains(&key) || (at == At::Plan && !item.is_none() && TABLES.contains(&key)) {
            continue;
        }
        let span = table.get_key_value(key).and_then(|(key, _)| key.span());
        marks.extend(span.map(|span| Mark { line: lines.at(span.start), at, key: Some(key.to_owned()) }));
    }
}

fn rows(item: Option<&Item>, lines: &Lines, marks: &mut Vec<Mark>, at: fn(usize) -> At) {
    let mut row = |k: usize, table: &dyn TableLike, span: Option<std::ops::Range<usize>>| {
        marks.extend(span.map(|span| Mark { line: lines.at(span.start), at: at(k), key: None }));
        keys(table, at(k), lines, marks, &[]);
    };
    match item {
        Some(Item::ArrayOfTables(tables)) => tables.iter().enumerate().for_each(|(k, t)| row(k, t, t.span())),
        Some(Item::Value(Value::Array(values))) => {
            let tables = values.iter().filter_map(Value::as_inline_table);
            tables.enumerate().for_each(|(k, t)| row(k, t, t.span()));
        }
        _ => {}
    }
}
