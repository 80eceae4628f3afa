//! Rows of a plan: `[[feature]]`, `[[comparison]]`, `[[alignment.rps]]`; also where they are written as a list of inline tables.

use super::EditError;
use super::tree::{hand_on, position_for, prefix_of, split_comment};
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, TableLike, Value};

/// The item that holds rows, by its path.
pub(super) fn rows_item<'t>(tree: &'t DocumentMut, path: &[&str]) -> Option<&'t Item> {
    let mut item = tree.as_item();
    for key in path {
        item = item.as_table_like()?.get(key)?;
    }
    Some(item)
}

fn rows_item_mut<'t>(tree: &'t mut DocumentMut, path: &[&str]) -> Option<&'t mut Item> {
    let mut item = tree.as_item_mut();
    for key in path {
        item = item.as_table_like_mut()?.get_mut(key)?;
    }
    Some(item)
}

/// All rows, read only.
pub(super) fn rows<'t>(tree: &'t DocumentMut, path: &[&str]) -> Vec<&'t dyn TableLike> {
    match rows_item(tree, path) {
        Some(Item::ArrayOfTables(rows)) => rows.iter().map(|row| row as &dyn TableLike).collect(),
        Some(Item::Value(Value::Array(rows))) => {
            rows.iter().filter_map(Value::as_inline_table).map(|row| row as &dyn TableLike).collect()
        }
        _ => Vec::new(),
    }
}

/// One row, to be changed.
pub(super) fn row_mut<'t>(tree: &'t mut DocumentMut, path: &[&str], index: usize) -> Option<&'t mut dyn TableLike> {
    match rows_item_mut(tree, path)? {
        Item::ArrayOfTables(rows) => rows.get_mut(index).map(|row| row as &mut dyn TableLike),
        Item::Value(Value::Array(rows)) => {
            let tables = rows.iter_mut().filter_map(Value::as_inline_table_mut);
            tables.map(|row| row as &mut dyn TableLike).nth(index)
        }
        _ => None,
    }
}

/// Adds a row at the end.
pub(super) fn push(tree: &mut DocumentMut, path: &[&'static str], row: Table) -> Result<(), EditError> {
    if rows_item(tree, path).is_none_or(Item::is_none) {
        make_list(tree, path)?;
    }
    match rows_item_mut(tree, path) {
        Some(Item::ArrayOfTables(rows)) => rows.push(row),
        Some(Item::Value(Value::Array(rows))) => rows.push(Value::InlineTable(row.into_inline_table())),
        _ => {
            let place = format!("[[{}]]", path.join("."));
            return Err(EditError::WrongShape { place, expected: "a list of tables" });
        }
    }
    Ok(())
}

/// An empty list of tables where it belongs. The first row takes the list's place in the text.
fn make_list(tree: &mut DocumentMut, path: &[&'static str]) -> Result<(), EditError> {
    let [parents @ .., key] = path else { return Ok(()) };
    let list = Item::ArrayOfTables(ArrayOfTables::new());
    match parents {
        [] => drop(tree.insert(key, list)),
        [parent, ..] => drop(super::tree::section(tree, parent)?.insert(key, list)),
    }
    Ok(())
}

/// A row's table with the position that it needs: that of a list's later rows follows from the first.
pub(super) fn new_row(tree: &DocumentMut, path: &[&str]) -> Table {
    let mut row = Table::new();
    if rows(tree, path).is_empty() {
        let name = path.first().copied().unwrap_or_default();
        let position = match path {
            [_] => position_for(tree, name),
            // Rows of a section come after it: as if they were the table that follows.
            _ => super::tree::end_of(tree, name),
        };
        row.set_position(Some(position));
    }
    row
}

/// Takes a row out. A comment right above it goes with it; what stands above an empty line stays.
pub(super) fn remove(tree: &mut DocumentMut, path: &[&str], index: usize) -> bool {
    let Some(item) = rows_item_mut(tree, path) else { return false };
    let mut left_behind = None;
    let empty = match item {
        Item::ArrayOfTables(rows) if index < rows.len() => {
            let row = rows.remove(index);
            let prefix = prefix_of(&row);
            left_behind = row.position().map(|at| (at, split_comment(&prefix).0.to_owned()));
            rows.is_empty()
        }
        Item::Value(Value::Array(rows)) => {
            let Some(at) = nth_table(rows, index) else { return false };
            rows.remove(at);
            rows.is_empty()
        }
        _ => return false,
    };
    if empty {
        remove_list(tree, path);
    }
    if let Some((at, comments)) = left_behind {
        hand_on(tree, at, &comments);
    }
    true
}

fn remove_list(tree: &mut DocumentMut, path: &[&str]) {
    let [parents @ .., key] = path else { return };
    let mut item = tree.as_item_mut();
    for parent in parents {
        let Some(below) = item.as_table_like_mut().and_then(|table| table.get_mut(parent)) else { return };
        item = below;
    }
    if let Some(table) = item.as_table_like_mut() {
        table.remove(key);
    }
}

fn nth_table(rows: &Array, index: usize) -> Option<usize> {
    rows.iter().enumerate().filter(|(_, value)| value.is_inline_table()).map(|(k, _)| k).nth(index)
}

/// Moves a row to another index. Its own comment goes with it; headings of several rows stay where they are.
pub(super) fn shift(tree: &mut DocumentMut, path: &[&str], from: usize, to: usize) -> bool {
    match rows_item_mut(tree, path) {
        Some(Item::ArrayOfTables(rows)) if from < rows.len() && to < rows.len() => {
            let positions: Vec<Option<isize>> = rows.iter().map(Table::position).collect();
            let above: Vec<String> = rows.iter().map(|row| split_comment(&prefix_of(row)).0.to_owned()).collect();
            let row = rows.remove(from);
            rows.insert(to, row);
            for ((row, position), above) in rows.iter_mut().zip(positions).zip(above) {
                row.set_position(position);
                let own = split_comment(&prefix_of(row)).1.to_owned();
                row.decor_mut().set_prefix(format!("{above}{own}"));
            }
            true
        }
        Some(Item::Value(Value::Array(rows))) => {
            let (Some(from), Some(to)) = (nth_table(rows, from), nth_table(rows, to)) else { return false };
            let row = rows.remove(from);
            rows.insert_formatted(to, row);
            true
        }
        _ => false,
    }
}

/// A list of rows written anew, those that stay in their places with their comments: `fill` puts row `k`'s values into its table.
pub(super) fn rewrite(
    tree: &mut DocumentMut,
    path: &[&'static str],
    count: usize,
    fill: impl Fn(usize, &mut dyn TableLike) -> Result<(), EditError>,
) -> Result<(), EditError> {
    let there = rows(tree, path).len();
    for k in (count..there).rev() {
        remove(tree, path, k);
    }
    for k in 0..count {
        if k >= there {
            let row = new_row(tree, path);
            push(tree, path, row)?;
        }
        if let Some(row) = row_mut(tree, path, k) {
            fill(k, row)?;
        }
    }
    Ok(())
}
