//! Comparison points from a table: what would change is told before it is done.

use super::changes::row_changes;
use super::fields::{free_rows, infos};
use super::rows::{self, new_row, push};
use super::shape::write_point;
use super::{Change, Document, EditError, List, PointSpec, RowInfo, Step, Verb};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::comparison_file::{self, Decimals, LARGEST};
use crate::plan::load::too_large;
use crate::plan::problems::Problems;
use std::collections::BTreeMap;
use std::path::Path;
use toml_edit::{Table, TableLike};

/// What becomes of points of the plan that the table does not name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// They stay.
    Keep,
    /// They are removed.
    Remove,
}

/// What a row of the table does to the plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RowChange {
    /// A new point.
    Added,
    /// The point of that name becomes another, in these ways.
    Changed(Vec<Change>),
    /// The point of that name is the same.
    Same,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedRow {
    /// The point.
    pub point: PointSpec,
    /// Line in the table, from 1.
    pub line: usize,
    /// What it does.
    pub change: RowChange,
}

/// A table that was read, and what it would do to a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// Its sound rows, in order.
    pub rows: Vec<ImportedRow>,
    /// Every fault, with its line.
    pub problems: Vec<Diagnostic>,
    /// Points of the plan that it does not name.
    pub not_named: Vec<String>,
}

impl Import {
    /// Faults that keep it from being imported.
    pub fn faults(&self) -> usize {
        self.problems.iter().filter(|d| d.severity == Severity::Error).count()
    }
}

impl Document {
    /// Reads a table of comparison points, of all three kinds: a comparison file, or cells pasted from a spreadsheet (tabs or semicolons,
    /// decimal commas allowed where no comma parts the cells). `source` names it in messages. Points are known by their names.
    ///
    /// # Errors
    /// Points that stand in a file of their own, a plan that is no TOML. Faults of the table are in what comes back.
    pub fn read_import(&self, table: &[u8], source: &Path) -> Result<Import, EditError> {
        self.points_here(List::Comparison)?;
        let tree = self.tree()?;
        let existing = infos(tree, List::Comparison);
        let problems = Problems::new(source);
        if table.len() as u64 > LARGEST {
            problems.add(too_large(table.len() as u64, LARGEST, "a table"));
            return Ok(Import { rows: Vec::new(), problems: problems.into_sorted(), not_named: Vec::new() });
        }
        let read = comparison_file::read(table, &problems, Decimals::Spreadsheet);
        refuse_shared_names(&read, &problems);
        let places = by_name(&existing);
        let mut rows = Vec::new();
        for point in read.iter().filter_map(|read| read.point.as_ref()) {
            let spec = PointSpec::from(point);
            let change = match places.get(spec.name.as_str()) {
                None => RowChange::Added,
                Some(at) => {
                    let row = rows::rows(tree, List::Comparison.path());
                    row.get(*at).map_or(Ok(RowChange::Added), |row| change_of(*row, &spec))?
                }
            };
            rows.push(ImportedRow { point: spec, line: point.line, change });
        }
        if read.is_empty() && !problems.any_error() {
            problems.error(1, "found no point below the names of the columns", "add a line for each point");
        }
        let named: Vec<&str> = read.iter().filter_map(|r| r.name.as_ref()).map(|(name, _)| name.as_str()).collect();
        let not_named = existing.iter().map(|row| row.name.clone()).filter(|name| !named.contains(&name.as_str()));
        Ok(Import { rows, not_named: not_named.collect(), problems: problems.into_sorted() })
    }

    /// Does what an import tells: new points come last, changed ones stay in their places.
    ///
    /// # Errors
    /// A table with faults; a plan that has changed otherwise since, so that a row does not fit any more.
    pub fn import(&mut self, import: &Import, rest: Rest) -> Result<(), EditError> {
        if import.faults() > 0 {
            return Err(EditError::FaultyTable(import.faults()));
        }
        self.points_here(List::Comparison)?;
        let places: BTreeMap<String, usize> =
            by_name(&self.rows(List::Comparison)).into_iter().map(|(name, at)| (name.to_owned(), at)).collect();
        let step = Step::new(Verb::Import, format!("{} points", import.rows.len()));
        self.edit(step, |tree| {
            for row in &import.rows {
                match places.get(&row.point.name) {
                    Some(at) => {
                        write_point(super::fields::row(tree, List::Comparison, *at)?, &row.point, List::Comparison)?
                    }
                    None => {
                        let mut new = new_row(tree, List::Comparison.path());
                        write_point(&mut new, &row.point, List::Comparison)?;
                        push(tree, List::Comparison.path(), new)?;
                    }
                }
            }
            if rest == Rest::Remove {
                free_rows(tree, List::Comparison, &import.not_named);
            }
            Ok(())
        })
    }
}

/// The first row of each name.
fn by_name(rows: &[RowInfo]) -> BTreeMap<&str, usize> {
    rows.iter().enumerate().rev().map(|(k, row)| (row.name.as_str(), k)).collect()
}

/// What a point would change in a row.
fn change_of(row: &dyn TableLike, point: &PointSpec) -> Result<RowChange, EditError> {
    let mut copy = Table::new();
    row.iter().for_each(|(key, item)| drop(copy.insert(key, item.clone())));
    write_point(&mut copy, point, List::Comparison)?;
    let mut changes = Vec::new();
    row_changes(&RowInfo::of(row), &RowInfo::of(&copy), List::Comparison, &point.name, &mut changes);
    Ok(if changes.is_empty() { RowChange::Same } else { RowChange::Changed(changes) })
}

/// A name used twice leaves open which row is meant.
fn refuse_shared_names(read: &[crate::plan::shapes::ReadPoint], problems: &Problems) {
    let mut first: BTreeMap<&str, usize> = BTreeMap::new();
    for (name, line) in read.iter().filter_map(|read| read.name.as_ref()) {
        let first = *first.entry(name).or_insert(*line);
        if first != *line {
            let message = format!("found the name \"{name}\" again, first used on line {first}");
            problems.error(*line, message, "give each point a name of its own");
        }
    }
}
