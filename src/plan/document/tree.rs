//! Values put into a tree of TOML so that comments and layout around them stay.

use super::EditError;
use super::keys::TABLES;
use crate::plan::problems::Problems;
use crate::plan::syntax::read_document;
use std::path::Path;
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// The tree of a text.
pub(super) fn parse(text: &str) -> Result<DocumentMut, EditError> {
    text.parse::<DocumentMut>().map_err(|fault| {
        // The plan's own words for the fault, and its line.
        let problems = Problems::new(Path::new(""));
        let _ = read_document(text, &problems);
        let first = problems.into_sorted().into_iter().next();
        first.map_or_else(
            || EditError::NotToml { line: 1, message: fault.message().to_owned() },
            |d| EditError::NotToml { line: d.line.unwrap_or(1), message: d.message },
        )
    })
}

/// Puts a value under a key. One that stands there hands on its comment, and keeps its place; where comments stand in a
/// column, the new one stands in it too.
pub(super) fn put(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key) {
        Some(Item::Value(old)) => {
            let prefix = old.decor().prefix().and_then(|p| p.as_str()).unwrap_or(" ").to_owned();
            let suffix = old.decor().suffix().and_then(|s| s.as_str()).unwrap_or("").to_owned();
            let length = |value: &Value| {
                let mut bare = value.clone();
                bare.decor_mut().clear();
                bare.to_string().trim().chars().count()
            };
            let suffix = in_column(&suffix, length(old), length(&value));
            *value.decor_mut() = toml_edit::Decor::new(prefix, suffix);
            *old = value;
        }
        _ => drop(table.insert(key, Item::Value(value))),
    }
}

/// Blanks before a comment, as many as keep its column when the value before it has another length.
fn in_column(suffix: &str, old_length: usize, new_length: usize) -> String {
    let comment = suffix.trim_start_matches(' ');
    let blanks = suffix.len() - comment.len();
    if !comment.starts_with('#') || blanks < 2 {
        return suffix.to_owned();
    }
    let wanted = (blanks + old_length).saturating_sub(new_length).max(1);
    format!("{}{comment}", " ".repeat(wanted))
}

/// Takes a key out. Comments on lines above it stay, with the next key or else the one before; the one on its own line goes.
pub(super) fn take(table: &mut dyn TableLike, key: &str) -> bool {
    let above = table.key(key).and_then(|k| k.leaf_decor().prefix()).and_then(|p| p.as_str()).unwrap_or("").to_owned();
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    if table.remove(key).is_none() {
        return false;
    }
    let at = keys.iter().position(|k| k == key).unwrap_or(0);
    if !above.contains('#') {
        return true;
    }
    if let Some(mut next) = keys.get(at + 1).and_then(|k| table.key_mut(k)) {
        let own = next.leaf_decor().prefix().and_then(|p| p.as_str()).unwrap_or("").to_owned();
        next.leaf_decor_mut().set_prefix(format!("{above}{own}"));
    } else if let Some(Item::Value(last)) = at.checked_sub(1).and_then(|k| table.get_mut(&keys[k])) {
        let own = last.decor().suffix().and_then(|s| s.as_str()).unwrap_or("").to_owned();
        last.decor_mut().set_suffix(format!("{own}\n{}", above.trim_end_matches('\n')));
    }
    true
}

/// The table of a section, made where it is missing: after the tables that come before it in plans.
pub(super) fn section<'t>(tree: &'t mut DocumentMut, name: &'static str) -> Result<&'t mut dyn TableLike, EditError> {
    if tree.get(name).is_none_or(Item::is_none) {
        let mut table = Table::new();
        table.set_position(Some(position_for(tree, name)));
        tree.insert(name, Item::Table(table));
    }
    let wrong = EditError::WrongShape { place: format!("[{name}]"), expected: "a table" };
    let item = tree.get_mut(name).ok_or_else(|| wrong.clone())?;
    if let Item::Table(table) = item
        && table.is_implicit()
    {
        table.set_implicit(false);
    }
    item.as_table_like_mut().ok_or(wrong)
}

/// Where a new table belongs: tables of the same position come in the order in which they were made.
pub(super) fn position_for(tree: &DocumentMut, name: &str) -> isize {
    let rank = TABLES.iter().position(|t| *t == name).unwrap_or(TABLES.len());
    let before = TABLES[..rank].iter().rev().filter_map(|t| tree.get(t)).find_map(last_position);
    before.unwrap_or(0)
}

/// The position of the last table of a section.
pub(super) fn end_of(tree: &DocumentMut, name: &str) -> isize {
    tree.get(name).and_then(last_position).unwrap_or_else(|| position_for(tree, name))
}

/// The last position of an item's tables.
fn last_position(item: &Item) -> Option<isize> {
    match item {
        Item::Table(table) => last_position_of_table(table),
        Item::ArrayOfTables(rows) => rows.iter().filter_map(last_position_of_table).max(),
        _ => None,
    }
}

fn last_position_of_table(table: &Table) -> Option<isize> {
    table.iter().filter_map(|(_, item)| last_position(item)).chain(table.position()).max()
}

/// What stands above a header: the part that belongs to what came before or to several tables (all up to the last empty line), and
/// the comment of this table alone.
pub(super) fn split_comment(prefix: &str) -> (&str, &str) {
    let mut at = 0;
    let mut from = 0;
    for line in prefix.split_inclusive('\n') {
        from += line.len();
        if line.trim().is_empty() {
            at = from;
        }
    }
    prefix.split_at(at)
}

/// Gives comments to the first table behind a position, or else to the end of the text.
pub(super) fn hand_on(tree: &mut DocumentMut, behind: isize, comments: &str) {
    if !comments.contains('#') {
        return;
    }
    let mut next: Option<isize> = None;
    visit(tree.as_table_mut(), &mut |table| {
        if let Some(at) = table.position().filter(|at| *at > behind) {
            next = Some(next.map_or(at, |n| n.min(at)));
        }
    });
    match next {
        Some(next) => visit(tree.as_table_mut(), &mut |table| {
            if table.position() == Some(next) {
                let own = prefix_of(table);
                let prefix = format!("{}\n\n{}", comments.trim_end_matches('\n'), own.trim_start_matches('\n'));
                table.decor_mut().set_prefix(prefix);
            }
        }),
        None => {
            let own = tree.trailing().as_str().unwrap_or("").to_owned();
            tree.set_trailing(format!("{comments}{own}"));
        }
    }
}

pub(super) fn prefix_of(table: &Table) -> String {
    table.decor().prefix().and_then(|p| p.as_str()).unwrap_or("").to_owned()
}

/// Every table that has a header.
fn visit(table: &mut Table, told: &mut dyn FnMut(&mut Table)) {
    told(table);
    for (_, item) in table.iter_mut() {
        match item {
            Item::Table(below) => visit(below, told),
            Item::ArrayOfTables(rows) => rows.iter_mut().for_each(|row| visit(row, told)),
            _ => {}
        }
    }
}
