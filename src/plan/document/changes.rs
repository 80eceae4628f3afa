//! What differs between two texts of a plan, in words that a person reads.

use super::fields::infos;
use super::rows::rows;
use super::settings::{in_full, in_mm};
use super::shape::is_same;
use super::{Document, FieldValue, List, RowInfo, SETTINGS, tree, words};
use crate::geometry::{Point3, Vector3};
use std::collections::BTreeMap;
use std::fmt;
use toml_edit::{DocumentMut, Item, TableLike};

/// One thing that changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// What is concerned: the name of a point or feature, or a setting in words.
    pub subject: String,
    /// What became of it.
    pub what: String,
    /// Where, for who wants to take it back.
    pub at: ChangedAt,
}

/// Where something changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChangedAt {
    /// A key of a table of settings.
    Setting(&'static str, &'static str),
    /// A key of a row, by the name that it has now.
    Key(List, String, String),
    /// A row that was not there, by its name.
    Added(List, String),
    /// A row that is gone, by its name and its index then.
    Removed(List, String, usize),
    /// A row with another name: its name then, its name now.
    Renamed(List, String, String),
    /// Something that only undo takes back.
    Other,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.what)
    }
}

impl Change {
    fn other(subject: impl Into<String>, what: impl Into<String>) -> Self {
        Self { subject: subject.into(), what: what.into(), at: ChangedAt::Other }
    }

    /// Whether [`Document::take_back`] can take it back by itself.
    pub fn can_be_taken_back(&self) -> bool {
        self.at != ChangedAt::Other
    }
}

impl Document {
    /// What changed since the plan was saved, the settings first, then features and points in their order. Of a plan that was
    /// never saved it is one line.
    pub fn changes(&self) -> Vec<Change> {
        if self.saved.is_none() {
            return vec![Change::other("plan", "new")];
        }
        changes(self.saved_text(), &self.text)
    }

    /// What somebody else changed since the plan was opened or saved, by the text that lies there now.
    pub fn changes_by_others(&self, text: &str) -> Vec<Change> {
        changes(self.saved_text(), &text.replace("\r\n", "\n"))
    }

    /// What would change if this plan's text became another one: one that was not saved, or that somebody else saved.
    pub fn changes_to(&self, text: &str) -> Vec<Change> {
        changes(&self.text, &text.replace("\r\n", "\n"))
    }
}

/// What changed from one text to another.
pub(super) fn changes(old: &str, new: &str) -> Vec<Change> {
    if old == new {
        return Vec::new();
    }
    let (Ok(before), Ok(after)) = (tree::parse(old), tree::parse(new)) else {
        return vec![Change::other("plan", "edited as text, which cannot be read as TOML")];
    };
    let mut found = Vec::new();
    top(&before, &after, &mut found);
    for (table, keys) in SETTINGS {
        settings(&before, &after, table, keys, &mut found);
    }
    held_by(&before, &after, &mut found);
    for list in [List::Feature, List::Comparison] {
        listed(&infos(&before, list), &infos(&after, list), list, &mut found);
    }
    settings(&before, &after, "comparison_file", &["file"], &mut found);
    if found.is_empty() {
        found.push(Change::other("plan", "comments or layout"));
    }
    found
}

fn top(before: &DocumentMut, after: &DocumentMut, found: &mut Vec<Change>) {
    let value = |tree: &DocumentMut| tree.get("schema").map(FieldValue::of);
    if let Some(what) = from_to("", value(before).as_ref(), value(after).as_ref(), false) {
        found.push(Change::other("schema", what));
    }
}

fn settings(
    before: &DocumentMut,
    after: &DocumentMut,
    table: &'static str,
    keys: &[&'static str],
    found: &mut Vec<Change>,
) {
    let value = |tree: &DocumentMut, key: &str| {
        let item = tree.get(table)?.as_table_like()?.get(key)?;
        (!item.is_none()).then(|| FieldValue::of(item))
    };
    for key in keys.iter().filter(|key| !["rps", "region"].contains(key)) {
        let (label, unit) = words::key(table, key);
        // `sheet thickness: 1.200 -> 1.500 mm`.
        let (old, new) = (value(before, key), value(after, key));
        if let Some(what) = from_to(unit, old.as_ref(), new.as_ref(), *key == "view_direction") {
            let at = match table {
                "comparison_file" => ChangedAt::Other,
                _ => ChangedAt::Setting(table, key),
            };
            found.push(Change { subject: label.to_owned(), what, at });
        }
    }
}

fn from_to(unit: &str, before: Option<&FieldValue>, after: Option<&FieldValue>, direction: bool) -> Option<String> {
    let same = match (before, after) {
        (Some(a), Some(b)) => is_same(a, b, direction),
        (None, None) => true,
        _ => false,
    };
    if same {
        return None;
    }
    // Three decimals, unless they hide the change.
    let in_mm = |value: &FieldValue| value.in_words(unit == "mm");
    let hidden = before.zip(after).is_some_and(|(a, b)| in_mm(a) == in_mm(b));
    let shown = |value: Option<&FieldValue>| match value {
        None => "left out".to_owned(),
        Some(FieldValue::Number(v)) if hidden => in_full(*v),
        Some(FieldValue::Numbers(v)) if hidden => {
            format!("[{}]", v.iter().map(|v| in_full(*v)).collect::<Vec<_>>().join(", "))
        }
        Some(value) => in_mm(value),
    };
    let unit = if unit.is_empty() || after.is_none() { String::new() } else { format!(" {unit}") };
    Some(format!("{} -> {}{unit}", shown(before), shown(after)))
}

/// Locks and regions, row by row.
fn held_by(before: &DocumentMut, after: &DocumentMut, found: &mut Vec<Change>) {
    let line = |row: &dyn TableLike| {
        let value =
            |(key, item): (&str, &Item)| format!("{} {}", words::row_key(key).0, FieldValue::of(item).in_words(false));
        row.iter().map(value).collect::<Vec<_>>().join(", ")
    };
    for (path, what) in [(["alignment", "rps"], "lock"), (["alignment", "region"], "region")] {
        let lines = |tree| -> Vec<String> { rows(tree, &path).into_iter().map(line).collect() };
        let (old, new) = (lines(before), lines(after));
        for k in 0..old.len().max(new.len()) {
            let what_became = match (old.get(k), new.get(k)) {
                (Some(a), Some(b)) if a != b => format!("{a} -> {b}"),
                (Some(a), None) => format!("removed ({a})"),
                (None, Some(b)) => format!("added ({b})"),
                _ => continue,
            };
            found.push(Change::other(format!("{what} {}", k + 1), what_became));
        }
    }
}

/// Rows by name; one that lost its name to another with the same values was renamed.
fn listed(before: &[RowInfo], after: &[RowInfo], list: List, found: &mut Vec<Change>) {
    let partners = partners(before, after);
    let taken: Vec<usize> = partners.iter().flatten().copied().collect();
    for (k, row) in before.iter().enumerate().filter(|(k, _)| !taken.contains(k)) {
        let at = ChangedAt::Removed(list, row.name.clone(), k);
        found.push(Change { subject: row.label(list, k), what: format!("{} removed", list.word()), at });
    }
    for (k, row) in after.iter().enumerate() {
        match partners[k] {
            None => {
                let what = format!("{} added ({})", list.word(), row.kind);
                let at = ChangedAt::Added(list, row.name.clone());
                found.push(Change { subject: row.label(list, k), what, at });
            }
            Some(old) => row_changes(&before[old], row, list, &row.label(list, k), found),
        }
    }
    let order: Vec<usize> = partners.into_iter().flatten().collect();
    if !order.is_sorted() {
        let what = "in another order".to_owned();
        found.push(Change::other(format!("{}s", list.word()), what));
    }
}

/// For each row after the change the one that it was before.
fn partners(before: &[RowInfo], after: &[RowInfo]) -> Vec<Option<usize>> {
    let mut free: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, row) in before.iter().enumerate().rev() {
        free.entry(&row.name).or_default().push(k);
    }
    let mut partners: Vec<Option<usize>> =
        after.iter().map(|row| free.get_mut(row.name.as_str()).and_then(Vec::pop)).collect();
    let mut left: Vec<usize> = free.into_values().flatten().collect();
    left.sort_unstable();
    for (k, row) in after.iter().enumerate() {
        if partners[k].is_some() {
            continue;
        }
        let bare = |row: &RowInfo| row.values.iter().filter(|(key, _)| key != "name").cloned().collect::<Vec<_>>();
        if let Some(at) = left.iter().position(|old| bare(&before[*old]) == bare(row)) {
            partners[k] = Some(left.remove(at));
        }
    }
    partners
}

pub(super) fn row_changes(before: &RowInfo, after: &RowInfo, list: List, subject: &str, found: &mut Vec<Change>) {
    let mut tell = |what: String, at: ChangedAt| found.push(Change { subject: subject.to_owned(), what, at });
    if before.name != after.name {
        let at = ChangedAt::Renamed(list, before.name.clone(), after.name.clone());
        tell(format!("was {}", before.name), at);
    }
    let old_keys = before.values.iter().map(|(key, _)| key.as_str()).filter(|key| after.value(key).is_none());
    let keys: Vec<&str> = after.values.iter().map(|(key, _)| key.as_str()).chain(old_keys).collect();
    for key in keys.into_iter().filter(|key| *key != "name") {
        let (label, unit) = words::row_key(key);
        let is_direction = ["axis", "direction", "normal"].contains(&key);
        let (old, new) = (before.value(key), after.value(key));
        let at = || ChangedAt::Key(list, after.name.clone(), key.to_owned());
        match (place(old), place(new)) {
            (Some(a), Some(b)) if ["position", "centre"].contains(&key) && a != b => {
                let places = from_to("mm", old, new, false).unwrap_or_default();
                tell(format!("moved by {} mm, {label} {places}", in_mm(length(b - a))), at());
            }
            _ => {
                if let Some(what) = from_to(unit, old, new, is_direction) {
                    tell(format!("{label} {what}"), at());
                }
            }
        }
    }
}

/// A length whose squares may be beyond all numbers.
fn length(v: Vector3) -> f64 {
    let largest = v.amax();
    if largest > 0.0 { largest * (v / largest).norm() } else { 0.0 }
}

fn place(value: Option<&FieldValue>) -> Option<Point3> {
    match value {
        Some(FieldValue::Numbers(v)) if v.len() == 3 => Some(Point3::new(v[0], v[1], v[2])),
        _ => None,
    }
}
