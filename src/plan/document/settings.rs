//! Settings: one key of one table, as a form shows it.

use super::keys::{WHOLE, is_setting};
use super::tree::{put, section, take};
use super::{Document, EditError, SETTINGS, Step, Verb, words};
use crate::plan::values::short;
use std::path::Path;
use toml_edit::{Array, Item, Value};

/// What a key holds.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValue {
    /// Text.
    Text(String),
    /// A number, whole or not.
    Number(f64),
    /// True or false.
    Truth(bool),
    /// A list of numbers: a position, a direction.
    Numbers(Vec<f64>),
    /// A list of texts.
    Texts(Vec<String>),
    /// Colours, 8-bit RGB.
    Colours(Vec<[u8; 3]>),
    /// Something that no key of a plan should hold, as written.
    Other(String),
}

impl FieldValue {
    /// What a value of TOML holds.
    pub(super) fn of(item: &Item) -> Self {
        let other = || FieldValue::Other(item.to_string().trim().to_owned());
        match item {
            Item::Value(Value::String(text)) => FieldValue::Text(text.value().clone()),
            Item::Value(Value::Integer(number)) => FieldValue::Number(*number.value() as f64),
            Item::Value(Value::Float(number)) => FieldValue::Number(*number.value()),
            Item::Value(Value::Boolean(truth)) => FieldValue::Truth(*truth.value()),
            Item::Value(Value::Array(list)) => Self::of_list(list).unwrap_or_else(other),
            _ => other(),
        }
    }

    fn of_list(list: &Array) -> Option<Self> {
        let number = crate::plan::reader::value_number;
        let colour = |value: &Value| {
            let channels: Vec<f64> = value.as_array()?.iter().map(number).collect::<Option<_>>()?;
            let whole = channels.iter().all(|c| c.fract() == 0.0 && (0.0..=255.0).contains(c));
            <[f64; 3]>::try_from(channels).ok().filter(|_| whole).map(|c| c.map(|v| v as u8))
        };
        let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
        let texts = || list.iter().map(|v| v.as_str().map(str::to_owned)).collect::<Option<Vec<_>>>();
        let colours = || list.iter().map(colour).collect::<Option<Vec<_>>>();
        let numbers = numbers.map(FieldValue::Numbers);
        numbers.or_else(|| texts().map(FieldValue::Texts)).or_else(|| colours().map(FieldValue::Colours))
    }

    /// The value for TOML; `whole` numbers are written without a decimal point.
    pub(super) fn to_toml(&self, whole: bool) -> Result<Value, EditError> {
        let finite = |v: &f64| if v.is_finite() { Ok(*v) } else { Err(EditError::NotFinite(*v)) };
        Ok(match self {
            FieldValue::Text(text) => text.as_str().into(),
            FieldValue::Number(v) if whole && v.fract() == 0.0 && v.abs() < 1e15 => (*v as i64).into(),
            FieldValue::Number(v) => finite(v)?.into(),
            FieldValue::Truth(truth) => (*truth).into(),
            FieldValue::Numbers(list) => Value::Array(list.iter().map(finite).collect::<Result<Array, _>>()?),
            FieldValue::Texts(list) => Value::Array(list.iter().map(String::as_str).collect()),
            FieldValue::Colours(list) => {
                let colour = |c: &[u8; 3]| Value::Array(c.iter().map(|v| i64::from(*v)).collect());
                Value::Array(list.iter().map(colour).collect())
            }
            FieldValue::Other(text) => text
                .parse::<Value>()
                .map_err(|_| EditError::WrongShape { place: text.clone(), expected: "a value of TOML" })?,
        })
    }

    /// The value as people read it; `mm` with three decimals where `lengths` are told.
    pub(super) fn in_words(&self, length: bool) -> String {
        let number = |v: &f64| if length { in_mm(*v) } else { short(*v) };
        match self {
            FieldValue::Text(text) => format!("\"{text}\""),
            FieldValue::Number(v) => number(v),
            FieldValue::Truth(truth) => truth.to_string(),
            FieldValue::Numbers(list) => format!("[{}]", list.iter().map(number).collect::<Vec<_>>().join(", ")),
            FieldValue::Texts(list) => format!("[{}]", list.join(", ")),
            FieldValue::Colours(list) => format!("{list:?}"),
            FieldValue::Other(text) => text.clone(),
        }
    }
}

/// A length with three decimals; one that no part has, in short: nobody reads three hundred zeros.
pub(super) fn in_mm(v: f64) -> String {
    if v.abs() < 1e7 { format!("{v:.3}") } else { short(v) }
}

/// All digits of a number, of a huge one without its zeros.
pub(super) fn in_full(v: f64) -> String {
    if v.abs() < 1e15 { v.to_string() } else { format!("{v:e}") }
}

impl Document {
    /// What stands under a key of a table; `None` when it is left out, or the text cannot be read.
    pub fn setting(&self, table: &str, key: &str) -> Option<FieldValue> {
        let tree = self.tree().ok()?;
        let item = tree.get(table)?.as_table_like()?.get(key)?;
        (!item.is_none()).then(|| FieldValue::of(item))
    }

    /// Writes a key of `[part]`, `[cad]`, `[scans]`, `[background]`, `[alignment]`, `[rig]`, `[uncertainty]` or `[output]`. Whether the
    /// value makes sense is for [`Document::read`] to tell.
    ///
    /// # Errors
    /// An unknown key, a number that is not finite, a text that is no TOML.
    pub fn set_setting(&mut self, table: &str, key: &str, value: &FieldValue) -> Result<(), EditError> {
        let table = known(table, key)?;
        if self.setting(table, key).as_ref() == Some(value) {
            return Ok(());
        }
        let step = Step::new(Verb::Change, words::setting(table, key));
        self.edit(step, |tree| {
            let section = section(tree, table)?;
            let was_whole = section.get(key).is_some_and(Item::is_integer);
            put(section, key, value.to_toml(was_whole || WHOLE.contains(&key))?);
            Ok(())
        })
    }

    /// Leaves a key out, so that its default holds; a key that no plan has is taken out as well.
    ///
    /// # Errors
    /// An unknown table, a text that is no TOML.
    pub fn remove_setting(&mut self, table: &str, key: &str) -> Result<(), EditError> {
        let named = SETTINGS.iter().find(|(name, _)| *name == table);
        let unknown = || EditError::UnknownKey { table: table.to_owned(), key: key.to_owned() };
        let (table, _) = named.ok_or_else(unknown)?;
        if self.setting(table, key).is_none() {
            return Ok(());
        }
        let what = if is_setting(table, key) { words::setting(table, key) } else { key };
        self.edit(Step::new(Verb::Remove, what), |tree| {
            take(section(tree, table)?, key);
            Ok(())
        })
    }

    /// Leaves out a whole table, such as `[rig]`, with its comments; also one that no plan has.
    ///
    /// # Errors
    /// A text that is no TOML.
    pub fn remove_table(&mut self, table: &str) -> Result<(), EditError> {
        self.edit(Step::new(Verb::Remove, format!("[{table}]")), |tree| {
            tree.remove(table);
            Ok(())
        })
    }

    /// Names the plan's files by their whole paths: `folder` is the one from which they were named.
    pub(super) fn name_whole_paths(&mut self, folder: &Path) -> Result<(), EditError> {
        let whole = |text: &str| std::path::absolute(folder.join(text)).map(|p| p.to_string_lossy().into_owned()).ok();
        for (table, key, otherwise) in [
            ("cad", "file", None),
            ("scans", "folder", Some("scans")),
            ("output", "folder", Some("results")),
            ("comparison_file", "file", None),
        ] {
            let written = match self.setting(table, key) {
                Some(FieldValue::Text(text)) => Some(text),
                Some(_) => None,
                None => otherwise.map(str::to_owned),
            };
            if let Some(path) = written.as_deref().and_then(whole) {
                self.edit(Step::new(Verb::Change, "the paths"), |tree| {
                    put(section(tree, table)?, key, path.into());
                    Ok(())
                })?;
            }
        }
        Ok(())
    }
}

fn known(table: &str, key: &str) -> Result<&'static str, EditError> {
    let unknown = || EditError::UnknownKey { table: table.to_owned(), key: key.to_owned() };
    if !is_setting(table, key) {
        return Err(unknown());
    }
    SETTINGS.iter().find(|(name, _)| *name == table).map(|(name, _)| *name).ok_or_else(unknown)
}
