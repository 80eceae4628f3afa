//! Comparison points from a delimited text file.
//!
//! The first line that is neither empty nor a `#` comment names the columns; they are separated by tabs, semicolons, commas
//! or blanks, whichever of these occurs first in that order. Columns are named like the keys of `[[comparison]]`: `name`,
//! `kind`, `diameter_mm`, `radius_mm`, `method`, `lower_mm`, `upper_mm`. A vector takes three columns, `position_x`, `position_y`, `position_z` and so
//! on for `direction`, `normal` and `axis`; `x`, `y`, `z` stand for the position and `i`, `j`, `k` for the direction as well. Or
//! else one column `position` holds all three numbers, `[1.0, 2.0, 3.0]`. A cell may be quoted with `"`; an empty cell means
//! that the point does not have the key. Numbers have a decimal point.

use super::problems::Problems;
use super::reader::{Places, TableReader, quoted};
use super::shapes::{ReadPoint, comparison_point};
use super::suggest::{list_or, nearest};
use super::syntax::read_text;
use toml_edit::{Array, Table, Value};

/// Largest comparison file, bytes.
pub(super) const LARGEST: u64 = 16 << 20;

const TEXTS: [&str; 3] = ["name", "kind", "method"];
const NUMBERS: [&str; 4] = ["diameter_mm", "radius_mm", "lower_mm", "upper_mm"];
const VECTORS: [&str; 4] = ["position", "direction", "normal", "axis"];
const EXAMPLE: &str = "name, kind, x, y, z, i, j, k, lower_mm, upper_mm";

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    Text(&'static str),
    Number(&'static str),
    Component(&'static str, usize),
    Triple(&'static str),
}

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Decimals {
    /// With a decimal point.
    Point,
    /// With a decimal point, or with a comma where no comma parts the cells: a table from a spreadsheet. Names of columns,
    /// kinds and methods may be written with capitals.
    Spreadsheet,
}

/// Reads the points as far as they are sound; faults go to `problems`.
pub(super) fn read(bytes: &[u8], problems: &Problems, decimals: Decimals) -> Vec<ReadPoint> {
    let Some(text) = read_text(bytes, problems) else { return Vec::new() };
    let mut rows = text
        .lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line))
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let Some((header_line, header)) = rows.next() else {
        problems.error(
            1,
            "found no line with columns, expected comparison points",
            format!("begin the file with a line {EXAMPLE}"),
        );
        return Vec::new();
    };
    let separator = ['\t', ';', ','].into_iter().find(|c| header.contains(*c));
    let spreadsheet = decimals == Decimals::Spreadsheet;
    let header = if spreadsheet { header.to_lowercase() } else { header.to_owned() };
    let Some(columns) = read_header(&header, separator, header_line, problems) else { return Vec::new() };
    let table = Columns { separator, columns, comma: spreadsheet && separator != Some(','), capitals: spreadsheet };
    let mut points = Vec::new();
    for (line, row) in rows {
        points.extend(read_row(row, &table, line, problems));
    }
    points
}

/// How the rows of a file are read.
struct Columns {
    /// Between cells; `None`: blanks.
    separator: Option<char>,
    columns: Vec<Column>,
    /// Whether a number may have a decimal comma.
    comma: bool,
    /// Whether the plan's own words may have capitals.
    capitals: bool,
}

fn read_header(header: &str, separator: Option<char>, line: usize, problems: &Problems) -> Option<Vec<Column>> {
    let names = cells(header, separator).unwrap_or_default();
    let mut known: Vec<String> = TEXTS.iter().chain(&NUMBERS).map(|n| (*n).to_owned()).collect();
    known.extend(VECTORS.iter().flat_map(|v| ["x", "y", "z"].map(|c| format!("{v}_{c}"))));
    let mut columns = Vec::with_capacity(names.len());
    let mut good = true;
    for name in &names {
        match column(name) {
            Some(column) if columns.contains(&column) => {
                problems.error(
                    line,
                    format!("column {}: found twice, expected once", quoted(name)),
                    "keep one of them",
                );
                good = false;
            }
            Some(column) => columns.push(column),
            None => {
                let help = match nearest(name, known.iter().map(String::as_str)) {
                    Some((near, true)) => format!("did you mean \"{near}\"?"),
                    _ => format!("columns are named such as {EXAMPLE}"),
                };
                problems.error(line, format!("unknown column {}", quoted(name)), help);
                good = false;
            }
        }
    }
    if !good {
        return None;
    }
    for key in VECTORS {
        let parts: Vec<usize> = (0..3).filter(|c| columns.contains(&Column::Component(key, *c))).collect();
        let whole = columns.contains(&Column::Triple(key));
        if (!parts.is_empty() && parts.len() < 3) || (whole && !parts.is_empty()) {
            let found: Vec<String> = parts.iter().map(|c| format!("{key}_{}", ["x", "y", "z"][*c])).collect();
            let found = list_or(&found.iter().map(String::as_str).collect::<Vec<_>>(), "").replace(" or ", " and ");
            let message = format!("columns of {key}: found {found}, expected {key}_x, {key}_y and {key}_z");
            problems.error(line, message, "a vector takes three columns, or one column with [x, y, z]");
            good = false;
        }
    }
    let missing: Vec<&str> = ["name", "kind", "position", "lower_mm", "upper_mm"]
        .into_iter()
        .filter(|key| {
            !columns.iter().any(|c| match c {
                Column::Text(k) | Column::Number(k) | Column::Component(k, _) | Column::Triple(k) => k == key,
            })
        })
        .collect();
    for key in missing {
        let (what, found) = match key {
            "position" => ("columns position_x, position_y, position_z (or x, y, z)", "no such columns"),
            _ => ("a column of this name", "no such column"),
        };
        let help = format!(
            "begin the file with a line such as {EXAMPLE}; vectors: position, direction, normal, axis with _x, _y, _z"
        );
        problems.error(line, format!("column {key}: found {found}, expected {what}"), help);
        good = false;
    }
    good.then_some(columns)
}

fn column(name: &str) -> Option<Column> {
    if let Some(key) = TEXTS.iter().find(|k| **k == name) {
        return Some(Column::Text(key));
    }
    if let Some(key) = NUMBERS.iter().find(|k| **k == name) {
        return Some(Column::Number(key));
    }
    if let Some(key) = VECTORS.iter().find(|k| **k == name) {
        return Some(Column::Triple(key));
    }
    if let Some(c) = ["x", "y", "z"].iter().position(|c| *c == name) {
        return Some(Column::Component("position", c));
    }
    if let Some(c) = ["i", "j", "k"].iter().position(|c| *c == name) {
        return Some(Column::Component("direction", c));
    }
    let (vector, part) = name.rsplit_once('_')?;
    let key = VECTORS.iter().find(|k| **k == vector)?;
    let c = ["x", "y", "z"].iter().position(|c| *c == part)?;
    Some(Column::Component(key, c))
}

/// Turns a row into the table that the plan would have held, and reads it as such.
fn read_row(row: &str, table: &Columns, line: usize, problems: &Problems) -> Option<ReadPoint> {
    let Columns { separator, columns, comma, capitals } = table;
    let (separator, comma, capitals) = (*separator, *comma, *capitals);
    let number = |cell: &str| number(cell, comma);
    let Some(cells) = cells(row, separator) else {
        problems.error(
            line,
            "found a quote that is not closed, expected it closed on its line",
            "close the quote with \"",
        );
        return None;
    };
    if cells.len() != columns.len() {
        let message = format!("found {} cells, expected {} as in the first line", cells.len(), columns.len());
        let help = if separator == Some(',') && cells.len() > columns.len() {
            "numbers have a decimal point; with decimal commas the columns would be cut in two"
        } else {
            "leave a cell empty where a point has no value, and quote names that hold the separator"
        };
        problems.error(line, message, help);
        return None;
    }
    let mut table = Table::new();
    let mut vectors: [[Option<Value>; 3]; 4] = Default::default();
    for (column, cell) in columns.iter().zip(&cells) {
        let cell = cell.trim();
        if cell.is_empty() {
            continue;
        }
        match column {
            Column::Text(key) if capitals && *key != "name" => {
                drop(table.insert(key, toml_edit::value(cell.to_lowercase())));
            }
            Column::Text(key) => drop(table.insert(key, toml_edit::value(cell))),
            Column::Number(key) => drop(table.insert(key, toml_edit::Item::Value(number(cell)))),
            Column::Triple(key) => drop(table.insert(key, toml_edit::Item::Value(triple(cell)))),
            Column::Component(key, c) => {
                if let Some(k) = VECTORS.iter().position(|v| v == key) {
                    vectors[k][*c] = Some(number(cell));
                }
            }
        }
    }
    for (key, parts) in VECTORS.iter().zip(vectors) {
        if parts.iter().any(Option::is_some) {
            let array: Array = parts.into_iter().flatten().collect();
            table.insert(key, toml_edit::value(array));
        }
    }
    Some(comparison_point(TableReader::new(&table, "[[comparison]]", line, Places::OneLine, problems)))
}

/// A cell as a number, or as the text that it is, for the message.
fn number(cell: &str, comma: bool) -> Value {
    let point = if comma && cell.matches(',').count() == 1 { cell.replace(',', ".") } else { cell.to_owned() };
    point.parse::<f64>().map_or_else(|_| Value::from(cell), Value::from)
}

/// `[1, 2, 3]` or `1 2 3`.
fn triple(cell: &str) -> Value {
    let inner = cell.trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
    let array: Array = inner.split([',', ';', ' ']).filter(|c| !c.is_empty()).map(|c| number(c, false)).collect();
    Value::from(array)
}

/// The cells of a row; `None` when a quote stays open. Without a separator, runs of blanks separate.
fn cells(row: &str, separator: Option<char>) -> Option<Vec<String>> {
    let mut cells = Vec::new();
    let mut cell = String::new();
    let mut quoted = false;
    let mut was_quoted = false;
    let mut letters = row.chars().peekable();
    while let Some(letter) = letters.next() {
        let separates = separator.map_or(letter.is_whitespace(), |s| letter == s);
        if quoted {
            match letter {
                '"' if letters.peek() == Some(&'"') => cell.extend(letters.next()),
                '"' => quoted = false,
                _ => cell.push(letter),
            }
        } else if letter == '"' && cell.trim().is_empty() {
            cell.clear();
            (quoted, was_quoted) = (true, true);
        } else if separates {
            if separator.is_some() || !cell.is_empty() || was_quoted {
                cells.push(cell.trim().to_owned());
            }
            cell.clear();
            was_quoted = false;
        } else {
            cell.push(letter);
        }
    }
    if quoted {
        return None;
    }
    if separator.is_some() || !cell.is_empty() || was_quoted {
        cells.push(cell.trim().to_owned());
    }
    Some(cells)
}
