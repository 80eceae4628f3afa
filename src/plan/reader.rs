//! Reads a table key by key: remembers which keys were asked for, so that the others can be refused with the nearest
//! known name, and tells every wrong value with its line.

use super::problems::{Lines, Problems};
use super::suggest::{list_or, nearest};
use super::syntax::LostKey;
use crate::diagnostic::Diagnostic;
use std::cell::RefCell;
use toml_edit::{Item, TableLike, Value};

/// How lines are told of a table.
#[derive(Clone, Copy)]
pub(super) enum Places<'a> {
    /// From the spans of the document.
    Document(&'a Lines, &'a [LostKey]),
    /// Everything stands on one line (a row of a comparison file).
    OneLine,
}

/// What a key that is missing was expected to hold.
struct Missing {
    key: &'static str,
    expected: &'static str,
    help: String,
}

/// One table of the plan, or one row of a comparison file.
pub(super) struct TableReader<'a> {
    table: &'a dyn TableLike,
    place: String,
    line: usize,
    places: Places<'a>,
    problems: &'a Problems,
    asked: RefCell<Vec<&'static str>>,
    missing: RefCell<Vec<Missing>>,
}

impl<'a> TableReader<'a> {
    /// `place` names the table in messages (`[part]`), empty for the plan itself; `line` is where it begins.
    pub fn new(
        table: &'a dyn TableLike,
        place: impl Into<String>,
        line: usize,
        places: Places<'a>,
        problems: &'a Problems,
    ) -> Self {
        let (asked, missing) = Default::default();
        Self { table, place: place.into(), line, places, problems, asked, missing }
    }

    /// The line on which the table begins, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Where problems go.
    pub fn problems(&self) -> &'a Problems {
        self.problems
    }

    /// Whether there is no key in it.
    pub fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// Renames the table in messages, once its own name is known.
    pub fn call(&mut self, place: String) {
        self.place = place;
    }

    /// `[part] name`, or `name` at the top of the plan.
    pub fn label(&self, key: &str) -> String {
        if self.place.is_empty() { key.to_owned() } else { format!("{} {key}", self.place) }
    }

    /// A key that may be left out.
    pub fn optional(&self, key: &'static str) -> Option<Entry<'_>> {
        let mut asked = self.asked.borrow_mut();
        if !asked.contains(&key) {
            asked.push(key);
        }
        drop(asked);
        let (_, item) = self.table.get_key_value(key)?;
        (!item.is_none()).then_some(Entry { reader: self, key, item, line: self.line_of(key) })
    }

    /// A key that must be there; that it is not is told when the table is finished.
    pub fn required(&self, key: &'static str, expected: &'static str, help: impl Into<String>) -> Option<Entry<'_>> {
        let entry = self.optional(key);
        if entry.is_none() {
            self.missing.borrow_mut().push(Missing { key, expected, help: help.into() });
        }
        entry
    }

    /// A table of its own that must be there, such as `[part]`; `holds` says what stands in it.
    pub fn required_section(&self, key: &'static str, holds: &str) -> Option<TableReader<'_>> {
        let help = format!("add a line [{key}] and under it {holds}");
        self.required(key, "this table", help)?;
        self.section(key)
    }

    /// A table of its own below this one, such as `[part]`.
    pub fn section(&self, key: &'static str) -> Option<TableReader<'_>> {
        let entry = self.optional(key)?;
        let place = format!("[{key}]");
        match entry.item.as_table_like() {
            Some(table) => {
                let line = entry.item.span().map_or(entry.line, |span| self.line_at(span.start, entry.line));
                Some(TableReader::new(table, place, line, self.places, self.problems))
            }
            None if entry.item.is_array_of_tables() => {
                entry.wrong(format!("found [[{key}]], expected {place}"), "write it once, in single brackets");
                None
            }
            None => {
                let found = describe(entry.item);
                entry.wrong(format!("found {found}, expected a table"), format!("begin it with a line {place}"));
                None
            }
        }
    }

    /// The tables of a list such as `[[feature]]`, in the file's order. Each is named by `place` and its number from 1.
    pub fn sections<'r>(&'r self, key: &'static str, place: &str) -> Vec<TableReader<'r>> {
        let Some(entry) = self.optional(key) else { return Vec::new() };
        let name = |k: usize| format!("{place} number {}", k + 1);
        let reader = |k: usize, table: &'r dyn TableLike, span: Option<std::ops::Range<usize>>| {
            let line = span.map_or(entry.line, |span| self.line_at(span.start, entry.line));
            TableReader::new(table, name(k), line, self.places, self.problems)
        };
        match entry.item {
            Item::ArrayOfTables(tables) => tables.iter().enumerate().map(|(k, t)| reader(k, t, t.span())).collect(),
            Item::Value(Value::Array(values)) => {
                let mut readers = Vec::new();
                for (k, value) in values.iter().enumerate() {
                    match value.as_inline_table() {
                        Some(table) => readers.push(reader(k, table, table.span())),
                        None => entry.wrong(
                            format!("found a list whose value {} is no table, expected tables", k + 1),
                            format!("begin each with a line {place}"),
                        ),
                    }
                }
                readers
            }
            other => {
                let found =
                    if other.is_table() { place.replace("[[", "[").replace("]]", "]") } else { describe(other) };
                entry.wrong(format!("found {found}, expected {place}"), format!("begin each with a line {place}"));
                Vec::new()
            }
        }
    }

    /// Refuses every key that nobody asked for, and tells the missing ones. A missing key that an unknown one most
    /// likely stands for is not told twice. `explain` may give its own (message, help) for a key that is known elsewhere.
    pub fn finish(self, explain: impl Fn(&str, &[&'static str]) -> Option<(String, String)>) {
        let asked = self.asked.borrow();
        let mut meant: Vec<&'static str> = Vec::new();
        for (key, item) in self.table.iter() {
            if item.is_none() || asked.contains(&key) {
                continue;
            }
            let (message, help) = self.unknown(key, &asked, &explain, &mut meant);
            let place = if self.place.is_empty() { String::new() } else { format!("{}: ", self.place) };
            let told = Diagnostic::error(format!("{place}{message}")).at_line(self.line_of(key)).at_key(key);
            self.problems.add(told.with_help(help));
        }
        for missing in self.missing.borrow().iter().filter(|m| !meant.contains(&m.key) && !self.is_lost(m.key)) {
            let label = if self.place.is_empty() { format!("[{}]", missing.key) } else { self.label(missing.key) };
            let label = if ["schema", "unit"].contains(&missing.key) { self.label(missing.key) } else { label };
            let message = format!("{label}: found nothing, expected {}", missing.expected);
            let told = Diagnostic::error(message).at_line(self.line).at_key(missing.key);
            self.problems.add(told.with_help(missing.help.clone()));
        }
    }

    /// Words and help for an unknown key: most likely it stands for a key that is not there yet, else it may be known elsewhere.
    fn unknown(
        &self,
        key: &str,
        asked: &[&'static str],
        explain: &impl Fn(&str, &[&'static str]) -> Option<(String, String)>,
        meant: &mut Vec<&'static str>,
    ) -> (String, String) {
        let shown: String = key.chars().take(60).flat_map(char::escape_debug).collect();
        let words = format!("unknown key \"{shown}\"");
        let free = asked.iter().copied().filter(|k| !self.table.contains_key(k) && !meant.contains(k));
        if let Some((known, true)) = nearest(key, free) {
            meant.push(known);
            return (words, format!("did you mean \"{known}\"?"));
        }
        if let Some(explained) = explain(key, asked) {
            return explained;
        }
        let help = match nearest(key, asked.iter().copied()) {
            Some((known, true)) => format!("remove it, or mend it if \"{known}\" is meant"),
            Some((known, false)) => {
                format!(
                    "the nearest known key is \"{known}\"; known here are {}",
                    list_or(asked, "").replace(" or ", " and ")
                )
            }
            None => "remove it".to_owned(),
        };
        (words, help)
    }

    fn is_lost(&self, key: &str) -> bool {
        match self.places {
            Places::OneLine => false,
            Places::Document(_, lost) => {
                let header_line = if self.place.is_empty() { 0 } else { self.line };
                lost.iter().any(|l| l.header_line == header_line && l.key == key)
            }
        }
    }

    fn line_of(&self, key: &str) -> usize {
        let span = self.table.get_key_value(key).and_then(|(key, _)| key.span());
        span.map_or(self.line, |span| self.line_at(span.start, self.line))
    }

    fn line_at(&self, offset: usize, otherwise: usize) -> usize {
        match self.places {
            Places::Document(lines, _) => lines.at(offset),
            Places::OneLine => otherwise,
        }
    }
}

/// What a number must be.
#[derive(Clone, Copy)]
pub(super) struct NumberRule {
    /// In words: `a length in mm above 0`.
    pub expected: &'static str,
    /// Whether a finite number will do.
    pub accepts: fn(f64) -> bool,
}

/// A value with its key and line.
#[derive(Clone, Copy)]
pub(super) struct Entry<'r> {
    reader: &'r TableReader<'r>,
    key: &'static str,
    item: &'r Item,
    /// Line of the key, from 1.
    pub line: usize,
}

impl<'r> Entry<'r> {
    /// Tells that the value is wrong; `words` read `found .., expected ..`.
    pub fn wrong(&self, words: impl AsRef<str>, help: impl Into<String>) {
        let message = format!("{}: {}", self.reader.label(self.key), words.as_ref());
        self.reader.problems.add(Diagnostic::error(message).at_line(self.line).at_key(self.key).with_help(help));
    }

    /// Warns of a value that is allowed.
    pub fn warn(&self, words: impl AsRef<str>, help: impl Into<String>) {
        let message = format!("{}: {}", self.reader.label(self.key), words.as_ref());
        self.reader.problems.add(Diagnostic::warning(message).at_line(self.line).at_key(self.key).with_help(help));
    }

    /// Tells that the value is odd.
    pub fn odd(&self, words: impl AsRef<str>, help: impl Into<String>) {
        let message = format!("{}: {}", self.reader.label(self.key), words.as_ref());
        self.reader.problems.add(Diagnostic::warning(message).at_line(self.line).at_key(self.key).with_help(help));
    }

    /// What was found, in words.
    pub fn found(&self) -> String {
        describe(self.item)
    }

    /// Text as written.
    pub fn text(&self) -> Option<&'r str> {
        let text = self.item.as_str();
        if text.is_none() {
            let help = match self.item {
                Item::Value(Value::Integer(_) | Value::Float(_) | Value::Boolean(_)) => {
                    format!("put it in quotes: \"{}\"", self.found())
                }
                _ => "put one text in quotes".to_owned(),
            };
            self.wrong(format!("found {}, expected text in quotes", self.found()), help);
        }
        text
    }

    /// `true` or `false`.
    pub fn truth(&self) -> Option<bool> {
        let truth = self.item.as_bool();
        if truth.is_none() {
            self.wrong(format!("found {}, expected true or false", self.found()), "write true or false without quotes");
        }
        truth
    }

    /// A number; whole ones do as well.
    pub fn number(&self, rule: NumberRule) -> Option<f64> {
        match as_number(self.item) {
            Some(number) if number.is_finite() && (rule.accepts)(number) => Some(number),
            Some(_) => {
                self.wrong(
                    format!("found {}, expected {}", self.found(), rule.expected),
                    "check the number and its unit",
                );
                None
            }
            None => {
                let help = number_help(self.item.as_str());
                self.wrong(format!("found {}, expected {}", self.found(), rule.expected), help);
                None
            }
        }
    }

    /// A list of numbers; `expected` in words, `example` as it should be written. The count is the caller's to check.
    pub fn numbers(&self, expected: &str, example: &str) -> Option<Vec<f64>> {
        let Some(values) = self.item.as_array() else {
            self.wrong(format!("found {}, expected {expected}", self.found()), format!("write it such as {example}"));
            return None;
        };
        let mut numbers = Vec::with_capacity(values.len());
        for (k, value) in values.iter().enumerate() {
            match value_number(value).filter(|number| number.is_finite()) {
                Some(number) => numbers.push(number),
                None => {
                    let found = describe_value(value);
                    let words = format!("found {found} as value {}, expected {expected}", k + 1);
                    let help = match value.as_str() {
                        Some(text) => number_help(Some(text)),
                        None => format!("write it such as {example}"),
                    };
                    self.wrong(words, help);
                    return None;
                }
            }
        }
        Some(numbers)
    }

    /// One text, or the texts of a list that is not empty; `expected` in words.
    pub fn texts(&self, expected: &str, example: &str) -> Option<Vec<&'r str>> {
        if let Some(text) = self.item.as_str() {
            return Some(vec![text]);
        }
        let values = self.list(expected, example)?;
        let texts: Option<Vec<&str>> = values.iter().map(|value| value.as_str()).collect();
        let texts = texts.filter(|texts| !texts.is_empty());
        if texts.is_none() {
            let found = values.iter().find(|value| value.as_str().is_none());
            let found = found
                .map_or_else(|| "an empty list".to_owned(), |value| format!("{} in the list", describe_value(value)));
            self.wrong(format!("found {found}, expected {expected}"), format!("write it such as {example}"));
        }
        texts
    }

    /// A table written as the value of the key, such as `{ min = 0.002 }`; `expected` in words.
    pub fn table(&self, expected: &str, example: &str) -> Option<TableReader<'r>> {
        let reader = self.reader;
        match self.item.as_table_like() {
            Some(table) => {
                Some(TableReader::new(table, reader.label(self.key), self.line, reader.places, reader.problems))
            }
            None => {
                self.wrong(
                    format!("found {}, expected {expected}", self.found()),
                    format!("write it such as {example}"),
                );
                None
            }
        }
    }

    /// The values of a list; `expected` in words.
    pub fn list(&self, expected: &str, example: &str) -> Option<Vec<&'r Value>> {
        let Some(values) = self.item.as_array() else {
            self.wrong(format!("found {}, expected {expected}", self.found()), format!("write it such as {example}"));
            return None;
        };
        Some(values.iter().collect())
    }

    /// One of some words.
    pub fn choice<T: Copy>(&self, options: &[(&'static str, T)]) -> Option<T> {
        let text = self.text()?;
        if let Some((_, value)) = options.iter().find(|(word, _)| *word == text) {
            return Some(*value);
        }
        let words: Vec<&str> = options.iter().map(|(word, _)| *word).collect();
        let help = match nearest(text, words.iter().copied()) {
            Some((known, true)) => format!("did you mean \"{known}\"?"),
            _ => format!("write {}", list_or(&words, "\"")),
        };
        self.wrong(format!("found {}, expected {}", self.found(), list_or(&words, "\"")), help);
        None
    }
}

/// A value in words.
pub(super) fn describe(item: &Item) -> String {
    match item {
        Item::None => "nothing".to_owned(),
        Item::Value(value) => describe_value(value),
        Item::Table(_) => "a table".to_owned(),
        Item::ArrayOfTables(_) => "a list of tables".to_owned(),
    }
}

/// A value in words, text cut to a readable length.
pub(super) fn describe_value(value: &Value) -> String {
    match value {
        Value::String(text) => format!("text {}", quoted(text.value())),
        Value::Integer(number) => number.value().to_string(),
        // Nobody reads three hundred zeros.
        Value::Float(number) if number.value().abs() >= 1e15 => format!("{:e}", number.value()),
        Value::Float(number) => number.value().to_string(),
        Value::Boolean(truth) => truth.value().to_string(),
        Value::Datetime(date) => format!("the date {}", date.value()),
        Value::Array(values) if values.len() == 1 => "a list of 1 value".to_owned(),
        Value::Array(values) => format!("a list of {} values", values.len()),
        Value::InlineTable(_) => "a table".to_owned(),
    }
}

/// Text in quotes, control characters made visible, cut after 40 characters.
pub(super) fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().nth(40).is_some() {
        shown.push_str("...");
    }
    format!("\"{shown}\"")
}

fn as_number(item: &Item) -> Option<f64> {
    item.as_value().and_then(value_number)
}

/// A number, whole or not; it may still be NaN or infinite.
pub(super) fn value_number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number.value()),
        Value::Integer(number) => Some(*number.value() as f64),
        _ => None,
    }
}

/// The next step for text where a number belongs.
fn number_help(text: Option<&str>) -> String {
    let Some(text) = text.map(str::trim) else { return "write one number, such as 1.2".to_owned() };
    if text.parse::<f64>().is_ok_and(f64::is_finite) {
        return format!("write it without quotes: {text}");
    }
    let point = text.replacen(',', ".", 1);
    if text.contains(',') && point.parse::<f64>().is_ok_and(f64::is_finite) {
        return format!("write it with a decimal point: {point}");
    }
    "write a number with a decimal point and without unit, such as 1.2".to_owned()
}
