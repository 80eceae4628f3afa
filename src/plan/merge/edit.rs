//! Masks put into the text of a `MERGE.toml`: comments and every other line stay as they are.

use super::{Mask, Metric, parse};
use crate::diagnostic::Diagnostic;
use crate::plan::document::Layout;
use crate::plan::short_number;
use std::path::Path;
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value, value};

/// The settings' bytes with these masks and no others.
///
/// # Errors
/// The text is no TOML, or something other than a table stands where masks do.
pub fn with_masks(bytes: &[u8], path: &Path, masks: &[Mask]) -> Result<Vec<u8>, Box<Diagnostic>> {
    let cannot = |why: String| {
        let help = "mend the file in a text editor, then open it again";
        Box::new(Diagnostic::error(format!("[mask] cannot be changed: {why}")).in_file(path).with_help(help))
    };
    let (layout, text) = Layout::read(bytes, path)?;
    let mut document: DocumentMut = text.parse().map_err(|_| cannot("the file is no TOML".to_owned()))?;
    if document.get("mask").is_none() && !masks.is_empty() {
        document.insert("mask", Item::Table(Table::new()));
    }
    if let Some(item) = document.get_mut("mask") {
        let table = item.as_table_like_mut().ok_or_else(|| cannot("mask is no table".to_owned()))?;
        for metric in Metric::ALL {
            set(table, metric, masks.iter().find(|mask| mask.metric == metric));
        }
    }
    let changed = layout.write(&document.to_string());
    let read: Option<Vec<Mask>> =
        parse(&changed, path).plan.map(|plan| plan.masks.iter().map(|mask| mask.value).collect());
    let mut wanted = masks.to_vec();
    wanted.sort_by_key(|mask| mask.metric);
    let same = read.is_some_and(|mut read| {
        read.sort_by_key(|mask| mask.metric);
        read == wanted
    });
    if same { Ok(changed) } else { Err(cannot("its masks would not be read as they are meant".to_owned())) }
}

/// Puts one metric's bounds in; what is the same stays as it is written.
fn set(table: &mut dyn TableLike, metric: Metric, mask: Option<&Mask>) {
    let key = metric.key();
    let Some(mask) = mask else { return remove(table, key) };
    let bounds = [("min", mask.min), ("max", mask.max)];
    match table.get_mut(key).and_then(Item::as_table_like_mut) {
        Some(known) => {
            for (bound, number) in bounds {
                put(known, bound, number);
            }
        }
        None => {
            let mut inline = InlineTable::new();
            for (bound, number) in bounds.into_iter().filter(|(_, number)| number.is_finite()) {
                inline.insert(bound, Value::from(number));
            }
            table.insert(key, Item::Value(Value::InlineTable(inline)));
        }
    }
}

/// Sets a bound, or takes it away where there is none.
fn put(bounds: &mut dyn TableLike, bound: &str, number: f64) {
    if !number.is_finite() {
        bounds.remove(bound);
        return;
    }
    match bounds.get_mut(bound) {
        Some(Item::Value(old)) => {
            let same = old.as_float() == Some(number) || old.as_integer().is_some_and(|old| old as f64 == number);
            if !same {
                let decor = old.decor().clone();
                *old = Value::from(number);
                *old.decor_mut() = decor;
            }
        }
        _ => {
            bounds.insert(bound, value(number));
        }
    }
}

/// Takes a mask away; a comment above it goes to the next one.
fn remove(table: &mut dyn TableLike, key: &str) {
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    let Some(at) = keys.iter().position(|known| known == key) else { return };
    let above = |table: &dyn TableLike, key: &str| -> String {
        let prefix =
            table.key(key).and_then(|key| key.leaf_decor().prefix().and_then(|p| p.as_str().map(str::to_owned)));
        prefix.unwrap_or_default()
    };
    let comment = above(table, key);
    if let Some(next) = keys.get(at + 1).filter(|_| comment.contains('#')) {
        let joined = format!("{comment}{}", above(table, next));
        if let Some(mut key) = table.key_mut(next) {
            key.leaf_decor_mut().set_prefix(joined);
        }
    }
    table.remove(key);
}

/// The lines of `[mask]` that say the same, for a text editor.
pub fn mask_lines(masks: &[Mask]) -> String {
    let mut lines = String::from("[mask]\n");
    for mask in masks {
        let bound = |key: &str, number: f64| number.is_finite().then(|| format!("{key} = {number:?}"));
        let bounds: Vec<String> = [bound("min", mask.min), bound("max", mask.max)].into_iter().flatten().collect();
        lines.push_str(&format!("{} = {{ {} }}\n", mask.metric.key(), bounds.join(", ")));
    }
    lines
}

impl Mask {
    /// In words: `sigma_i at least 0.002`, for lists.
    pub fn in_words(&self) -> String {
        let bound = |word: &str, number: f64| number.is_finite().then(|| format!("{word} {}", short_number(number)));
        let bounds: Vec<String> =
            [bound("at least", self.min), bound("at most", self.max)].into_iter().flatten().collect();
        format!("{} {}", self.metric.key(), bounds.join(" and "))
    }
}

/// Whether a text is, or was meant to be, the settings of a merge and no inspection plan: told by its tables, so that a broken one is known, too.
pub fn looks_like_merge(text: &str) -> bool {
    const OWN: [&str; 8] = ["views", "mask", "calibration", "delta_n", "noise", "density", "registration", "merge"];
    const OTHERS: [&str; 6] = ["part", "scans", "background", "alignment", "comparison", "comparison_file"];
    let mut at_top = true;
    let (mut own, mut others) = (false, false);
    for line in text.trim_start_matches('\u{feff}').lines().map(str::trim_start) {
        if let Some(header) = line.strip_prefix('[') {
            at_top = false;
            let name = header.trim_start_matches('[').split([']', '.']).next().unwrap_or_default().trim();
            own |= OWN.contains(&name);
            others |= OTHERS.contains(&name);
        } else if at_top && line.strip_prefix("unit").is_some_and(|rest| rest.trim_start().starts_with('=')) {
            own = true;
        }
    }
    own && !others
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# the pin\nschema = 1\nunit = \"um\" # as the sensor\n\n[mask]\n# dark pixels\nsigma_i = { min = 0.002 } # paper\n# far ones\nd_cal = { max = 150 }\nb = { min = 1.0, max = 9.0 }\n[merge]\nmetric = \"d_cal\" # best\n";

    fn mask(metric: Metric, min: f64, max: f64) -> Mask {
        Mask { metric, min, max }
    }

    fn changed(text: &str, masks: &[Mask]) -> String {
        String::from_utf8(with_masks(text.as_bytes(), Path::new("m.toml"), masks).unwrap()).unwrap()
    }

    const ALL: f64 = f64::INFINITY;

    #[test]
    fn a_threshold_changes_and_every_comment_stays() {
        let all = [
            mask(Metric::PhaseShiftVariation, 0.003, ALL),
            mask(Metric::CalibrationDistance, -ALL, 150.0),
            mask(Metric::Strength, 1.0, 9.0),
        ];
        assert_eq!(changed(TEXT, &all), TEXT.replace("0.002", "0.003"));
        // A bound taken away, a mask taken away with its comment kept, one more.
        let other = [
            mask(Metric::CalibrationDistance, -ALL, 150.0),
            mask(Metric::Strength, 1.0, ALL),
            mask(Metric::NonUniformity, -ALL, 2.5),
        ];
        let text = changed(TEXT, &other);
        assert!(text.contains("# dark pixels\n# far ones\nd_cal = { max = 150 }\nb = { min = 1.0"), "{text}");
        assert!(
            text.contains("delta_n = { max = 2.5 }") && !text.contains("sigma_i") && text.contains("# best"),
            "{text}"
        );
        // The same again changes nothing.
        assert_eq!(changed(&text, &other), text);
    }

    #[test]
    fn a_file_without_masks_gets_a_table_and_line_ends_stay() {
        let text = "\u{feff}schema = 1\r\nunit = \"um\"\r\n[merge]\r\nmetric = \"b\"\r\n";
        let with = changed(text, &[mask(Metric::Strength, 2.0, ALL)]);
        assert!(with.starts_with(text) && with.contains("\r\n[mask]\r\nb = { min = 2.0 }\r\n"), "{with:?}");
        assert_eq!(changed(text, &[]), text);
    }

    #[test]
    fn other_ways_to_write_masks_are_changed_in_their_place() {
        let dotted = "schema = 1\nunit = \"um\"\n[mask]\nb.min = 2.0 # low\n[mask.d_cal]\nmax = 9.0 # far\n";
        let with = changed(dotted, &[mask(Metric::Strength, 3.0, ALL), mask(Metric::CalibrationDistance, -ALL, 8.0)]);
        assert_eq!(with, dotted.replace("2.0", "3.0").replace("9.0", "8.0"));
    }

    #[test]
    fn what_is_no_toml_is_told_and_not_changed() {
        for text in ["schema = ", "mask = 3\nschema = 1\nunit = \"um\"\n", "schema = 1\n"] {
            let told =
                with_masks(text.as_bytes(), Path::new("m.toml"), &[mask(Metric::Strength, 3.0, ALL)]).unwrap_err();
            assert!(told.message.contains("[mask] cannot be changed") && told.help.is_some(), "{told}");
        }
    }

    #[test]
    fn lines_for_an_editor_read_back() {
        let masks = [mask(Metric::PhaseShiftVariation, 0.002, ALL), mask(Metric::CalibrationDistance, 1.0, 150.0)];
        let text = format!("schema = 1\nunit = \"um\"\n{}", mask_lines(&masks));
        let read: Vec<Mask> =
            parse(text.as_bytes(), Path::new("m.toml")).plan.unwrap().masks.iter().map(|m| m.value).collect();
        assert_eq!(read, masks);
        assert_eq!(masks[1].in_words(), "d_cal at least 1 and at most 150");
    }

    #[test]
    fn settings_of_a_merge_are_told_from_a_plan() {
        for merge in [TEXT, "unit = \"um\"\n", "schema = 1\n[views\n[mask]\n", "\u{feff}unit=\"mm\""] {
            assert!(looks_like_merge(merge), "{merge}");
        }
        let plan = include_str!("../../../settings/demo.toml");
        let stitched = "schema = 1\n[part]\n[scans]\nviews = \"merge.toml\"\nunit = \"um\"\n";
        for other in [plan, stitched, "", "name = 3\n[output]\n"] {
            assert!(!looks_like_merge(other), "{other}");
        }
    }
}
