//! Features and comparison points: added, removed, moved, renamed, changed.

use super::names::{is_good, next};
use super::rows::{self, new_row, push, row_mut, shift};
use super::{At, Document, EditError, FieldValue, LISTED_KEYS, PlanProblem, Step, Verb, shape, words};
use crate::diagnostic::Severity;
use crate::plan::{ComparisonPoint, Feature, Geometry, SurfaceFit, SurfaceMethod};
use std::path::PathBuf;
use toml_edit::{DocumentMut, Item, TableLike};

/// A list of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum List {
    /// `[[feature]]`.
    Feature,
    /// `[[comparison]]`.
    Comparison,
}

impl List {
    pub(super) fn path(self) -> &'static [&'static str] {
        match self {
            List::Feature => &["feature"],
            List::Comparison => &["comparison"],
        }
    }

    /// One of it, in words.
    pub(super) fn word(self) -> &'static str {
        match self {
            List::Feature => "feature",
            List::Comparison => "comparison point",
        }
    }

    pub(super) fn plural(self) -> &'static str {
        match self {
            List::Feature => "features",
            List::Comparison => "points",
        }
    }
}

/// A feature or comparison point to be written. Features have no limits and no fit.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSpec {
    /// Its name; empty: the next one by the naming rule.
    pub name: String,
    /// Its nominal shape, CAD frame.
    pub geometry: Geometry,
    /// Of a surface point: how it is measured.
    pub surface_fit: SurfaceFit,
    /// Lower limit of the deviation, mm.
    pub lower_mm: f64,
    /// Upper limit of the deviation, mm.
    pub upper_mm: f64,
}

impl PointSpec {
    /// A comparison point.
    pub fn point(name: impl Into<String>, geometry: Geometry, lower_mm: f64, upper_mm: f64) -> Self {
        Self { name: name.into(), geometry, surface_fit: SurfaceFit::default(), lower_mm, upper_mm }
    }

    /// A feature.
    pub fn feature(name: impl Into<String>, geometry: Geometry) -> Self {
        Self::point(name, geometry, 0.0, 0.0)
    }
}

impl PointSpec {
    /// The keys of its row with what they hold, name and kind left out, in the order of a form.
    pub fn values(&self, list: List) -> Vec<(&'static str, FieldValue)> {
        let mut values = shape::values(&self.geometry, list);
        if list == List::Comparison {
            if matches!(self.geometry, Geometry::Surface { .. }) {
                let plane = self.surface_fit.method == SurfaceMethod::Plane;
                values.extend(plane.then(|| ("method", FieldValue::Text("plane".to_owned()))));
                values.extend(self.surface_fit.radius_mm.map(|r| ("radius_mm", FieldValue::Number(r))));
            }
            values.push(("lower_mm", FieldValue::Number(self.lower_mm)));
            values.push(("upper_mm", FieldValue::Number(self.upper_mm)));
        }
        values
    }

    /// The same with another value of one key, `None` leaving it out; `None` where the key cannot hold that: a direction without
    /// length, a number where text should be, a key of another kind.
    #[must_use]
    pub fn with_value(&self, key: &str, value: Option<&FieldValue>) -> Option<Self> {
        let mut spec = self.clone();
        match (key, value) {
            ("name", Some(FieldValue::Text(name))) => spec.name.clone_from(name),
            ("lower_mm", Some(FieldValue::Number(v))) => spec.lower_mm = *v,
            ("upper_mm", Some(FieldValue::Number(v))) => spec.upper_mm = *v,
            ("method", None) => spec.surface_fit.method = SurfaceMethod::Local,
            ("method", Some(FieldValue::Text(word))) => {
                spec.surface_fit.method = if word == "plane" { SurfaceMethod::Plane } else { SurfaceMethod::Local };
            }
            ("radius_mm", None) => spec.surface_fit.radius_mm = None,
            ("radius_mm", Some(FieldValue::Number(v))) => spec.surface_fit.radius_mm = Some(*v),
            _ => shape::set_key(&mut spec.geometry, key, value)?,
        }
        Some(spec)
    }
}

impl From<&ComparisonPoint> for PointSpec {
    fn from(point: &ComparisonPoint) -> Self {
        Self {
            surface_fit: point.surface_fit,
            ..Self::point(point.name.as_str(), point.geometry.clone(), point.lower_mm, point.upper_mm)
        }
    }
}

impl From<&Feature> for PointSpec {
    fn from(feature: &Feature) -> Self {
        Self::feature(feature.name.as_str(), feature.geometry.clone())
    }
}

/// A row as it is written, sound or not.
#[derive(Debug, Clone, PartialEq)]
pub struct RowInfo {
    /// Its name; empty where it has none.
    pub name: String,
    /// Its kind as written; empty where it has none.
    pub kind: String,
    /// Its keys with their values, in the order of the text.
    pub values: Vec<(String, FieldValue)>,
}

impl RowInfo {
    pub(super) fn of(row: &dyn TableLike) -> Self {
        let text = |key: &str| row.get(key).and_then(Item::as_str).unwrap_or_default().to_owned();
        let values = row.iter().map(|(key, item)| (key.to_owned(), FieldValue::of(item))).collect();
        Self { name: text("name"), kind: text("kind"), values }
    }

    /// The value of a key.
    pub fn value(&self, key: &str) -> Option<&FieldValue> {
        self.values.iter().find(|(k, _)| k == key).map(|(_, value)| value)
    }

    /// The shape that it tells, CAD frame; `None` where a key that makes it is missing or no number. Whether it makes sense is for
    /// [`Document::read`] to tell.
    pub fn geometry(&self, list: List) -> Option<Geometry> {
        shape::read(self, list)
    }

    /// What people call it.
    pub(super) fn label(&self, list: List, index: usize) -> String {
        if self.name.is_empty() { format!("{} {}", list.word(), index + 1) } else { self.name.clone() }
    }
}

impl Document {
    /// The rows of a list as the plan's text has them; none when it is no TOML, or points stand in a file of their own.
    pub fn rows(&self, list: List) -> Vec<RowInfo> {
        self.tree().map_or_else(|_| Vec::new(), |tree| infos(tree, list))
    }

    /// The comparison file, as the plan names it.
    pub fn points_file(&self) -> Option<PathBuf> {
        let tree = self.tree().ok()?;
        let table = tree.get("comparison_file")?.as_table_like()?;
        Some(table.get("file").and_then(Item::as_str).unwrap_or_default().into())
    }

    /// The next free name by the naming rule: P01, E01, C01 for points by kind; H1, S1, A1, B1 for features.
    pub fn next_name(&self, list: List, kind: &str) -> String {
        next(list, kind, self.rows(list).iter().map(|row| row.name.as_str()))
    }

    /// Adds rows at the end of a list, all or none, and tells the index of the first.
    ///
    /// # Errors
    /// A name that is taken or cannot be read, a slot among the comparison points, points that stand in a file of their own.
    pub fn add(&mut self, list: List, points: &[PointSpec]) -> Result<usize, EditError> {
        self.points_here(list)?;
        let rows = self.rows(list);
        let mut names: Vec<String> = rows.iter().map(|row| row.name.clone()).collect();
        let first = names.len();
        let mut named = Vec::with_capacity(points.len());
        for point in points {
            let mut point = point.clone();
            if point.name.is_empty() {
                point.name = next(list, point.geometry.kind(), names.iter().map(String::as_str));
            }
            free_name(&point.name, &names)?;
            names.push(point.name.clone());
            named.push(point);
        }
        let step = Step::of_many(Verb::Add, &names[first..], list.plural());
        self.edit(step, |tree| {
            for point in &named {
                let mut row = new_row(tree, list.path());
                shape::write_point(&mut row, point, list)?;
                push(tree, list.path(), row)?;
            }
            Ok(first)
        })
    }

    /// Removes rows, by index. What refers to a removed feature becomes a problem of the plan.
    ///
    /// # Errors
    /// An index that is not there, a text that is no TOML.
    pub fn remove(&mut self, list: List, indices: &[usize]) -> Result<(), EditError> {
        let names = self.names_of(list, indices)?;
        let mut sorted = indices.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        self.edit(Step::of_many(Verb::Remove, &names, list.plural()), |tree| {
            for index in sorted.iter().rev() {
                rows::remove(tree, list.path(), *index);
            }
            Ok(())
        })
    }

    /// Moves a row to another place in the order of its list.
    ///
    /// # Errors
    /// An index that is not there, a text that is no TOML.
    pub fn reorder(&mut self, list: List, from: usize, to: usize) -> Result<(), EditError> {
        let names = self.names_of(list, &[from, to])?;
        self.edit(Step::new(Verb::Reorder, names[0].as_str()), |tree| {
            shift(tree, list.path(), from, to);
            Ok(())
        })
    }

    /// Gives a row another name; the alignment follows a feature's.
    ///
    /// # Errors
    /// A name that is taken or cannot be read, an index that is not there.
    pub fn rename(&mut self, list: List, index: usize, name: &str) -> Result<(), EditError> {
        let old = self.names_of(list, &[index])?.remove(0);
        let rows = self.rows(list);
        let others = rows.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, row)| row.name.clone());
        free_name(name, &others.collect::<Vec<_>>())?;
        let shared = rows.iter().filter(|row| row.name == old).count() > 1;
        self.edit(Step::new(Verb::Rename, old.as_str()), |tree| {
            shape::set(row(tree, list, index)?, "name", &FieldValue::Text(name.to_owned()))?;
            if list == List::Feature && !shared {
                super::alignment::follow(tree, &old, name)?;
            }
            Ok(())
        })
    }

    /// Gives a row another place and shape. Values that are as before stay as they are written.
    ///
    /// # Errors
    /// An index that is not there, a slot among the comparison points, numbers that are not finite.
    pub fn reshape(&mut self, list: List, index: usize, geometry: &Geometry) -> Result<(), EditError> {
        let names = self.names_of(list, &[index])?;
        self.edit(Step::new(Verb::Move, names[0].as_str()), |tree| {
            shape::write(row(tree, list, index)?, geometry, list)
        })
    }

    /// Writes one key of a row, whether it makes sense or not; a name by [`Self::rename`].
    ///
    /// # Errors
    /// An unknown key, an index that is not there, numbers that are not finite.
    pub fn set_value(&mut self, list: List, index: usize, key: &str, value: &FieldValue) -> Result<(), EditError> {
        let name = self.names_of(list, &[index])?.remove(0);
        known_key(list, key)?;
        if let ("name", FieldValue::Text(name)) = (key, value) {
            return self.rename(list, index, name);
        }
        self.edit(Step::new(Verb::Change, format!("{} of {name}", words::row_key(key).0)), |tree| {
            shape::set(row(tree, list, index)?, key, value)
        })
    }

    /// Leaves one key of a row out.
    ///
    /// # Errors
    /// An index that is not there, a text that is no TOML.
    pub fn remove_value(&mut self, list: List, index: usize, key: &str) -> Result<(), EditError> {
        let name = self.names_of(list, &[index])?.remove(0);
        self.edit(Step::new(Verb::Remove, format!("{} of {name}", words::row_key(key).0)), |tree| {
            super::tree::take(row(tree, list, index)?, key);
            Ok(())
        })
    }

    /// Sets limits of many comparison points at once, mm; `None` leaves one as it is.
    ///
    /// # Errors
    /// An index that is not there, numbers that are not finite.
    pub fn set_tolerances(
        &mut self,
        indices: &[usize],
        lower_mm: Option<f64>,
        upper_mm: Option<f64>,
    ) -> Result<(), EditError> {
        let names = self.names_of(List::Comparison, indices)?;
        let what = match names.as_slice() {
            [only] => format!("tolerance of {only}"),
            _ => format!("tolerances of {} points", names.len()),
        };
        self.edit(Step::new(Verb::Change, what), |tree| {
            for index in indices {
                let row = row(tree, List::Comparison, *index)?;
                for (key, value) in [("lower_mm", lower_mm), ("upper_mm", upper_mm)] {
                    value.map_or(Ok(()), |v| shape::set(row, key, &FieldValue::Number(v)))?;
                }
            }
            Ok(())
        })
    }

    /// Takes the points of the comparison file into the plan, which then names no file any more.
    ///
    /// # Errors
    /// Faults of that file; no such file.
    pub fn take_points_into_plan(&mut self) -> Result<(), EditError> {
        let Some(file) = self.points_file() else { return Ok(()) };
        let loaded = self.read();
        let problems = self.locate(loaded.problems);
        let is_fault = |p: &&PlanProblem| p.place.at == At::PointsFile && p.diagnostic.severity == Severity::Error;
        let faults = problems.iter().filter(is_fault).count();
        if faults > 0 {
            return Err(EditError::BadPointsFile { file, faults });
        }
        let of_plan = self.rows(List::Comparison).len();
        let points: Vec<PointSpec> = loaded.draft.comparison.iter().skip(of_plan).map(PointSpec::from).collect();
        self.edit(Step::new(Verb::Import, format!("{} points of {}", points.len(), file.display())), |tree| {
            tree.remove("comparison_file");
            for point in &points {
                let mut row = new_row(tree, List::Comparison.path());
                shape::write_point(&mut row, point, List::Comparison)?;
                push(tree, List::Comparison.path(), row)?;
            }
            Ok(())
        })
    }

    /// The names of some rows as steps tell them.
    fn names_of(&self, list: List, indices: &[usize]) -> Result<Vec<String>, EditError> {
        let tree = self.tree()?;
        let rows = infos(tree, list);
        let name = |index: &usize| {
            let missing = EditError::NoSuchRow { what: list.word(), number: index + 1 };
            rows.get(*index).map(|row| row.label(list, *index)).ok_or(missing)
        };
        indices.iter().map(name).collect()
    }

    pub(super) fn points_here(&self, list: List) -> Result<(), EditError> {
        match self.points_file().filter(|_| list == List::Comparison) {
            Some(file) => Err(EditError::PointsInFile { file }),
            None => Ok(()),
        }
    }
}

pub(super) fn infos(tree: &DocumentMut, list: List) -> Vec<RowInfo> {
    rows::rows(tree, list.path()).into_iter().map(RowInfo::of).collect()
}

/// Removes the rows of some names.
pub(super) fn free_rows(tree: &mut DocumentMut, list: List, names: &[String]) {
    let rows = infos(tree, list);
    for (k, _) in rows.iter().enumerate().rev().filter(|(_, row)| names.contains(&row.name)) {
        rows::remove(tree, list.path(), k);
    }
}

pub(super) fn row(tree: &mut DocumentMut, list: List, index: usize) -> Result<&mut dyn TableLike, EditError> {
    row_mut(tree, list.path(), index).ok_or(EditError::NoSuchRow { what: list.word(), number: index + 1 })
}

fn free_name(name: &str, taken: &[String]) -> Result<(), EditError> {
    if !is_good(name) {
        return Err(EditError::BadName(name.to_owned()));
    }
    if taken.iter().any(|t| t == name) {
        return Err(EditError::NameTaken(name.to_owned()));
    }
    Ok(())
}

fn known_key(list: List, key: &str) -> Result<(), EditError> {
    let only_compared = ["method", "radius_mm", "lower_mm", "upper_mm"];
    if !LISTED_KEYS.contains(&key) || (list == List::Feature && only_compared.contains(&key)) {
        return Err(EditError::UnknownKey { table: list.path()[0].to_owned(), key: key.to_owned() });
    }
    Ok(())
}
