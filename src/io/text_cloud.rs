//! Clouds as delimited text: one point a line, columns parted by blanks, tabs, commas or semicolons, with or without a
//! line of names, comment lines (`#`, `//`), and a leading line with the number of points (PTS).
//!
//! Without names the columns are x y z, and behind them, in any order, three that are unit normals in every row of the
//! beginning, three whole numbers 0..255 that are a colour, and further properties called `column_4` and so on.

use super::columns::{ColourScale, Layout, Lengths, Role, Rows, read_chunks, too_many_points};
use super::fault::Fault;
use super::field::{excerpt, has_decimal_comma, integer, not_a_number, number, words};
use super::format;
use super::lines::{Chunks, FixedDecimals, Line, Lines, may_be_cut_off};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::PointCloud;
use crate::run::RunContext;

/// Rows that are looked at to tell what the columns are.
const ROWS_LOOKED_AT: usize = 256;

/// How fields are parted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Delimiter {
    Blank,
    Sign(u8),
}

impl Delimiter {
    /// The delimiter of a line: a semicolon wins over a comma, a comma over blanks.
    fn of(line: &[u8]) -> Delimiter {
        match line {
            _ if line.contains(&b';') => Delimiter::Sign(b';'),
            // `1,5 2,5 3,5` has decimal commas and is parted by blanks.
            _ if words(line).count() >= 3 && words(line).all(has_decimal_comma) => Delimiter::Blank,
            _ if line.contains(&b',') => Delimiter::Sign(b','),
            _ => Delimiter::Blank,
        }
    }

    /// The fields of a line. One delimiter at the end of the line is no further field.
    fn split(self, line: &[u8]) -> Fields<'_> {
        match self {
            Delimiter::Blank => Fields { rest: Some(line), delimiter: self },
            Delimiter::Sign(sign) => Fields { rest: Some(line.strip_suffix(&[sign]).unwrap_or(line)), delimiter: self },
        }
    }
}

/// The fields of a line, without the blanks around them.
#[derive(Debug, Clone)]
struct Fields<'a> {
    rest: Option<&'a [u8]>,
    delimiter: Delimiter,
}

impl<'a> Iterator for Fields<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        let end = match self.delimiter {
            Delimiter::Blank => {
                let rest = rest.trim_ascii_start();
                if rest.is_empty() {
                    self.rest = None;
                    return None;
                }
                let end = rest.iter().position(u8::is_ascii_whitespace);
                self.rest = end.map(|end| &rest[end..]);
                return Some(&rest[..end.unwrap_or(rest.len())]);
            }
            Delimiter::Sign(sign) => rest.iter().position(|&byte| byte == sign),
        };
        self.rest = end.map(|end| &rest[end + 1..]);
        Some(rest[..end.unwrap_or(rest.len())].trim_ascii())
    }
}

/// The text of a comment line; `None` for a row.
fn comment(line: &[u8]) -> Option<&[u8]> {
    line.strip_prefix(b"//").or_else(|| line.strip_prefix(b"#")).map(<[u8]>::trim_ascii)
}

/// What stands before the first row.
struct Head<'a> {
    /// The line of names, with its number.
    names: Option<Line<'a>>,
    /// The comment line right before the rows: names, perhaps.
    comment: Option<&'a [u8]>,
    /// How many points the first line promises, with its number.
    count: Option<(u64, usize)>,
}

/// Reads a cloud.
pub fn read(bytes: &[u8], lengths: Lengths, run: &RunContext) -> Result<PointCloud, ReadError> {
    let mut lines = Lines::new(format::without_mark(bytes), 0, 1);
    let head = read_head(&mut lines)?;
    let chunks = lines.take_chunks(u64::MAX)?;
    let sample = sample_rows(&chunks)?;
    let Some(first) = sample.first() else {
        check_promise(&head, 0, lines.next_number())?;
        return Ok(PointCloud::default());
    };
    let delimiter = Delimiter::of(first.text);
    let columns = delimiter.split(first.text).count();
    check_last_line(&chunks, delimiter, columns)?;
    let layout = layout_of(&head, delimiter, first, &sample)?;
    check_count_fits(chunks.filled)?;
    let expected = chunks.filled as usize;
    let rows = read_chunks(&chunks.chunks, &layout, lengths, expected, run, |chunk| {
        let mut chunk = chunk.clone();
        let mut rows = Rows::new(&layout, lengths, 0);
        let mut values = vec![0.0; columns];
        while let Some(line) = chunk.next_filled()? {
            if comment(line.text).is_none() {
                read_row(&mut rows, line.text, delimiter, &mut values).map_err(|d| d.at_line(line.number))?;
            }
        }
        Ok(rows)
    })?;
    let cloud = rows.into_cloud();
    check_promise(&head, (cloud.len() + cloud.skipped_invalid) as u64, lines.next_number())?;
    Ok(cloud)
}

/// Steps over comments, the line of names and the number of points.
fn read_head<'a>(lines: &mut Lines<'a>) -> Result<Head<'a>, Diagnostic> {
    let mut head = Head { names: None, comment: None, count: None };
    loop {
        let before = lines.clone();
        let Some(line) = lines.next_filled()? else { return Ok(head) };
        if let Some(text) = comment(line.text) {
            head.comment = Some(text);
            continue;
        }
        let mut fields = Delimiter::of(line.text).split(line.text);
        let (first, second) = (fields.next().unwrap_or_default(), fields.next());
        let count = integer(first).and_then(|count| u64::try_from(count).ok());
        match (count, second) {
            (Some(count), None) if head.count.is_none() && head.names.is_none() => {
                head.count = Some((count, line.number));
            }
            _ if head.names.is_none() && number(first).is_none() && !has_decimal_comma(first) => {
                head.names = Some(line);
            }
            _ => {
                *lines = before;
                return Ok(head);
            }
        }
    }
}

/// The first rows, without comments.
fn sample_rows<'a>(chunks: &Chunks<'a>) -> Result<Vec<Line<'a>>, Diagnostic> {
    let mut sample = Vec::new();
    for chunk in &chunks.chunks {
        let mut chunk = chunk.clone();
        while let Some(line) = chunk.next_filled()? {
            if comment(line.text).is_none() {
                sample.push(line);
            }
            if sample.len() == ROWS_LOOKED_AT {
                return Ok(sample);
            }
        }
    }
    Ok(sample)
}

fn read_row(rows: &mut Rows, line: &[u8], delimiter: Delimiter, values: &mut [f64]) -> Result<(), Diagnostic> {
    let mut found = 0;
    for field in delimiter.split(line) {
        if let Some(value) = values.get_mut(found) {
            *value = number(field).ok_or_else(|| not_a_number(field, "a number"))?;
        }
        found += 1;
    }
    if found != values.len() {
        return Err(Diagnostic::error(format!("{found} columns found, expected {} as in the first row", values.len()))
            .with_help("the file was cut off or damaged, or mixes delimiters; copy or export it again"));
    }
    rows.push(|column| Ok(values[column]))
}

fn layout_of(head: &Head, delimiter: Delimiter, first: &Line, sample: &[Line]) -> Result<Layout, Diagnostic> {
    let columns = delimiter.split(first.text).count();
    if columns < 3 {
        let field = delimiter.split(first.text).next().unwrap_or_default();
        return Err(Diagnostic::error(format!(
            "{columns} columns found (\"{}\"), expected x, y and z",
            excerpt(field)
        ))
        .at_line(first.number)
        .with_help("write one point a line: x y z, parted by blanks, tabs, commas or semicolons"));
    }
    let with_point = sample.iter().any(|line| line.text.contains(&b'.'));
    let mut layout = if let Some(line) = head.names {
        let names = names_of(line.text);
        if names.len() != columns {
            return Err(Diagnostic::error(format!("{} column names for {columns} columns", names.len()))
                .at_line(line.number)
                .with_help("give each column a name, or leave the line of names out"));
        }
        let names: Vec<Option<&str>> = names.iter().map(|name| Some(name.as_str())).collect();
        Layout::by_names(&names).map_err(|diagnostic| diagnostic.at_line(line.number))?
    } else {
        let named = head.comment.map(names_of).filter(|names| names.len() == columns);
        let named = named.and_then(|names| {
            let names: Vec<Option<&str>> = names.iter().map(|name| Some(name.as_str())).collect();
            Layout::by_names(&names).ok()
        });
        named.unwrap_or_else(|| layout_by_values(head, delimiter, columns, sample))
    };
    layout.colour_scale = if with_point && has_fractions(&layout, delimiter, sample) {
        ColourScale::ByLargest
    } else {
        ColourScale::Byte
    };
    Ok(layout)
}

/// The names in a line: without quotes, and without a unit in brackets behind them.
fn names_of(line: &[u8]) -> Vec<String> {
    Delimiter::of(line)
        .split(line)
        .map(|field| {
            let text = String::from_utf8_lossy(field);
            let name = text.trim_matches(|c: char| c == '"' || c == '\'' || c.is_whitespace());
            let name = name.split(['[', '(']).next().unwrap_or_default().trim_end();
            if name.is_empty() { text.into_owned() } else { name.to_owned() }
        })
        .collect()
}

/// Whether the colours are written with a decimal point, and so may be parts of one.
fn has_fractions(layout: &Layout, delimiter: Delimiter, sample: &[Line]) -> bool {
    sample.iter().any(|line| {
        let fields = delimiter.split(line.text).zip(&layout.roles);
        fields.into_iter().any(|(field, role)| matches!(role, Role::Colour(_)) && field.contains(&b'.'))
    })
}

/// Columns without names.
fn layout_by_values(head: &Head, delimiter: Delimiter, columns: usize, sample: &[Line]) -> Layout {
    let rows: Vec<Vec<f64>> = sample
        .iter()
        .map(|line| delimiter.split(line.text).map(|field| number(field).unwrap_or(f64::NAN)).collect::<Vec<_>>())
        .filter(|row| row.len() == columns)
        .collect();
    let all = |at: usize, test: fn(&[f64]) -> bool| {
        at + 3 <= columns && !rows.is_empty() && rows.iter().all(|row| test(&row[at..at + 3]))
    };
    let names: Vec<String> = (1..=columns).map(|column| format!("column_{column}")).collect();
    let mut roles = vec![None; columns];
    for axis in 0..3 {
        roles[usize::from(axis)] = Some(Role::Position(axis));
    }
    // PTS: the promised number of points above, then x y z intensity red green blue.
    let mut at = if head.count.is_some() && columns == 7 { 4 } else { 3 };
    let (mut normals, mut colours) = (false, false);
    while at < columns {
        let role: fn(u8) -> Role = match () {
            () if !normals && all(at, is_unit) => {
                normals = true;
                Role::Normal
            }
            () if !colours && all(at, is_colour) => {
                colours = true;
                Role::Colour
            }
            () => {
                at += 1;
                continue;
            }
        };
        for axis in 0..3 {
            roles[at + usize::from(axis)] = Some(role(axis));
        }
        at += 3;
    }
    let names: Vec<Option<&str>> = names.iter().map(|name| Some(name.as_str())).collect();
    Layout::completed(roles, &names)
}

/// A direction of length one, as far as three decimals tell.
fn is_unit(v: &[f64]) -> bool {
    let length_sq: f64 = v.iter().map(|x| x * x).sum();
    (length_sq - 1.0).abs() < 0.02
}

/// Three whole numbers 0..255.
fn is_colour(v: &[f64]) -> bool {
    v.iter().all(|x| (0.0..=255.0).contains(x) && x.fract() == 0.0)
}

fn check_count_fits(found: u64) -> Result<(), Diagnostic> {
    if found > u64::from(u32::MAX) { Err(too_many_points(found)) } else { Ok(()) }
}

/// A promised number of points must be kept.
fn check_promise(head: &Head, found: u64, end: usize) -> Result<(), Fault> {
    match head.count {
        Some((count, line)) if count != found => {
            let diagnostic = Diagnostic::error(format!("{found} points found, expected {count} as line {line} says"))
                .at_line(end.saturating_sub(1))
                .with_help("the file was cut off, is still being written, or counts wrong; copy it again");
            Err(Fault::from(diagnostic).cut_off_if(found < count))
        }
        _ => Ok(()),
    }
}

/// Refuses a last line without line end, unless it has all columns and every row has the same number of decimals in its
/// last one, which a cut would have shortened.
fn check_last_line(chunks: &Chunks, delimiter: Delimiter, columns: usize) -> Result<(), Fault> {
    let Some(last) = chunks.last.filter(|line| !line.ended) else { return Ok(()) };
    if comment(last.text).is_some() {
        return Ok(());
    }
    let last_field = |line: &Line| -> Vec<u8> { delimiter.split(line.text).last().unwrap_or_default().to_vec() };
    let mut fixed = FixedDecimals::default();
    for chunk in &chunks.chunks {
        let mut chunk = chunk.clone();
        while let Some(line) = chunk.next_filled()? {
            if line.ended && comment(line.text).is_none() {
                fixed.see(&last_field(&line));
            }
        }
    }
    let mut own = FixedDecimals::default();
    own.see(&last_field(&last));
    let is_whole = matches!(own, FixedDecimals::Always(_)) && fixed == own;
    let has_all = delimiter.split(last.text).count() == columns;
    if is_whole && has_all { Ok(()) } else { Err(may_be_cut_off(&last)) }
}

#[cfg(test)]
mod tests;
