//! What a form needs to know of every setting: its words, what it holds, what holds where it is left out.

use super::{FieldValue, List, words};

/// What a setting holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// One line of text.
    Text,
    /// A number in this unit, or without one.
    Number(&'static str),
    /// A whole number.
    Whole,
    /// True or false.
    Truth,
    /// One of these words.
    OneOf(&'static [&'static str]),
    /// Any of these words.
    AnyOf(&'static [&'static str]),
    /// A file.
    File,
    /// A folder.
    Folder,
    /// Three numbers, a direction.
    Direction,
    /// Colours.
    Colours,
    /// The name of a feature of this kind.
    FeatureOf(&'static str),
}

/// What holds where a setting is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LeftOut {
    /// It must not be left out where its table is there.
    Needed,
    /// Nothing, or what the data tell.
    Nothing,
    /// A word or text.
    Text(&'static str),
    /// A number.
    Number(f64),
    /// True.
    True,
    /// Several words.
    Texts(&'static [&'static str]),
}

impl LeftOut {
    /// As a value; `None` where there is none.
    pub fn value(self) -> Option<FieldValue> {
        match self {
            LeftOut::Needed | LeftOut::Nothing => None,
            LeftOut::Text(text) => Some(FieldValue::Text(text.to_owned())),
            LeftOut::Number(number) => Some(FieldValue::Number(number)),
            LeftOut::True => Some(FieldValue::Truth(true)),
            LeftOut::Texts(texts) => Some(FieldValue::Texts(texts.iter().map(|t| (*t).to_owned()).collect())),
        }
    }
}

/// A setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Its table.
    pub table: &'static str,
    /// Its key.
    pub key: &'static str,
    /// What it holds.
    pub holds: Holds,
    /// What holds without it.
    pub left_out: LeftOut,
}

impl Setting {
    const fn new(table: &'static str, key: &'static str, holds: Holds, left_out: LeftOut) -> Self {
        Self { table, key, holds, left_out }
    }

    /// What people call it, in English: `sheet thickness`.
    pub fn label(&self) -> &'static str {
        words::setting(self.table, self.key)
    }
}

const UNITS: Holds = Holds::OneOf(&["mm", "cm", "m", "inch", "um"]);
const MM: Holds = Holds::Number("mm");
const ZERO: LeftOut = LeftOut::Number(0.0);

/// Every setting of a plan that is written key by key, in the order of a form. Datums of a method other than the plan's are left out, not needed.
pub const FORM: [Setting; 40] = [
    Setting::new("part", "name", Holds::Text, LeftOut::Needed),
    Setting::new("part", "number", Holds::Text, LeftOut::Text("")),
    Setting::new("part", "revision", Holds::Text, LeftOut::Text("")),
    Setting::new("part", "thickness_mm", MM, LeftOut::Needed),
    Setting::new("part", "decision", Holds::OneOf(&["iso14253", "plain"]), LeftOut::Text("iso14253")),
    Setting::new("part", "cad_side", Holds::OneOf(&["top", "bottom", "middle", "solid"]), LeftOut::Text("top")),
    Setting::new("cad", "file", Holds::File, LeftOut::Needed),
    Setting::new("cad", "unit", UNITS, LeftOut::Text("mm")),
    Setting::new("scans", "folder", Holds::Folder, LeftOut::Text("scans")),
    Setting::new("scans", "pattern", Holds::Text, LeftOut::Text("*.ply")),
    Setting::new("scans", "unit", UNITS, LeftOut::Text("mm")),
    Setting::new("scans", "order", Holds::OneOf(&["name", "modified"]), LeftOut::Text("name")),
    Setting::new("scans", "taken", Holds::Text, LeftOut::Text("none")),
    Setting::new("scans", "view_direction", Holds::Direction, LeftOut::Nothing),
    Setting::new("background", "belt_plane", Holds::Truth, LeftOut::True),
    Setting::new("background", "belt_clearance_mm", MM, LeftOut::Nothing),
    Setting::new("background", "belt_colours", Holds::Colours, LeftOut::Nothing),
    Setting::new("background", "colour_tolerance", Holds::Number(""), LeftOut::Number(18.0)),
    Setting::new("background", "luminance_min", Holds::Number(""), LeftOut::Nothing),
    Setting::new("alignment", "method", Holds::OneOf(&["features", "rps", "best_fit"]), LeftOut::Needed),
    Setting::new("alignment", "hole", Holds::FeatureOf("hole"), LeftOut::Nothing),
    Setting::new("alignment", "slot", Holds::FeatureOf("slot"), LeftOut::Nothing),
    Setting::new("alignment", "slot_reading", Holds::OneOf(&["centre_line", "axis"]), LeftOut::Text("centre_line")),
    Setting::new("alignment", "point", Holds::FeatureOf("surface"), LeftOut::Nothing),
    Setting::new("alignment", "freeze", Holds::AnyOf(&["x", "y", "z", "rx", "ry", "rz"]), LeftOut::Nothing),
    Setting::new("rig", "distance_mm", MM, LeftOut::Needed),
    Setting::new("rig", "base_mm", MM, LeftOut::Needed),
    Setting::new("rig", "focal_mm", MM, LeftOut::Needed),
    Setting::new("rig", "pixel_um", Holds::Number("um"), LeftOut::Needed),
    Setting::new("rig", "image_accuracy_px", Holds::Number("pixels"), LeftOut::Needed),
    Setting::new("rig", "resolution_level", Holds::Whole, LeftOut::Number(1.0)),
    Setting::new("rig", "point_spacing_mm", MM, LeftOut::Nothing),
    Setting::new("uncertainty", "scale_ppm", Holds::Number("ppm"), ZERO),
    Setting::new("uncertainty", "thickness_mm", MM, ZERO),
    Setting::new("uncertainty", "system_mm", MM, ZERO),
    Setting::new("uncertainty", "edge_offset_mm", MM, ZERO),
    Setting::new("uncertainty", "edge_offset_u_mm", MM, ZERO),
    Setting::new("output", "folder", Holds::Folder, LeftOut::Text("results")),
    Setting::new(
        "output",
        "formats",
        Holds::AnyOf(&["ascii", "json", "pdf", "csv", "ply"]),
        LeftOut::Texts(&["ascii", "json", "pdf"]),
    ),
    Setting::new("output", "map_range_mm", MM, LeftOut::Number(1.0)),
];

/// A key of a feature or comparison point of some kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowKey {
    /// The key.
    pub key: &'static str,
    /// Whether it must be there.
    pub needed: bool,
}

impl RowKey {
    /// What people call it, in English: `upper tolerance`.
    pub fn label(&self) -> &'static str {
        words::row_key(self.key).0
    }
}

/// The keys of a row beside its name and kind, in the order of a form; none of a kind that the list does not have.
pub fn row_form(list: List, kind: &str) -> Vec<RowKey> {
    let (needed, optional): (&[&str], &[&str]) = match (list, kind) {
        (_, "surface") => (&["position", "direction"], &["method", "radius_mm"]),
        (_, "edge") => (&["position", "direction", "normal"], &[]),
        (List::Feature, "hole") => (&["centre", "axis", "diameter_mm"], &[]),
        (List::Comparison, "hole") => (&["position", "axis", "diameter_mm"], &["direction"]),
        (List::Feature, "slot") => (&["centre", "axis", "direction", "length_mm", "width_mm"], &[]),
        _ => return Vec::new(),
    };
    let (optional, limits): (&[&str], &[&str]) = match list {
        List::Feature => (&[], &[]),
        List::Comparison => (optional, &["lower_mm", "upper_mm"]),
    };
    let keys = |keys: &[&'static str], needed| keys.iter().map(|key| RowKey { key, needed }).collect::<Vec<_>>();
    [keys(needed, true), keys(optional, false), keys(limits, true)].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Severity;
    use crate::plan::document::tests::{FULL, errors, open};
    use crate::plan::document::{SETTINGS, keys};
    use crate::plan::parse;

    #[test]
    fn every_setting_of_the_reader_stands_in_the_form_once() {
        let of_form: Vec<(&str, &str)> = FORM.iter().map(|s| (s.table, s.key)).collect();
        let of_reader = SETTINGS.iter().flat_map(|(table, keys)| keys.iter().map(move |key| (*table, *key)));
        // `views` is named in the file: its settings are another file.
        let expected: Vec<(&str, &str)> =
            of_reader.filter(|(table, key)| keys::is_setting(table, key) && *key != "views").collect();
        assert_eq!(of_form, expected);
        assert!(FORM.iter().all(|s| s.label() != "another key"));
    }

    #[test]
    fn what_the_form_says_is_what_the_reader_does() {
        for setting in FORM {
            let Setting { table, key, holds, left_out } = setting;
            let at_this_field = |value: Option<FieldValue>| {
                let mut document = open(FULL);
                match value {
                    Some(value) => document.set_setting(table, key, &value).unwrap(),
                    None => document.remove_setting(table, key).unwrap(),
                }
                let problems = document.locate(parse(&document.bytes(), document.path()).problems);
                problems.iter().any(|p| p.diagnostic.severity == Severity::Error && p.place.key.as_deref() == Some(key))
            };
            let needed = at_this_field(None);
            let is_datum = ["hole", "slot", "point"].contains(&key);
            assert_eq!(needed, left_out == LeftOut::Needed || is_datum, "[{table}] {key}");
            let text = |word: &str| FieldValue::Text(word.to_owned());
            let (good, bad): (Vec<FieldValue>, FieldValue) = match holds {
                Holds::OneOf(words) if key != "method" => (words.iter().map(|w| text(w)).collect(), text("odd")),
                Holds::AnyOf(words) => {
                    let list = |w: &str| FieldValue::Texts(vec![w.to_owned()]);
                    (words.iter().map(|w| list(w)).collect(), list("odd"))
                }
                Holds::Number(_) => (vec![FieldValue::Number(0.5)], text("odd")),
                Holds::Whole => (vec![FieldValue::Number(2.0)], FieldValue::Number(2.5)),
                Holds::Truth => (vec![FieldValue::Truth(false)], text("odd")),
                Holds::Direction => (vec![FieldValue::Numbers(vec![0.0, 0.6, 0.8])], FieldValue::Numbers(vec![1.0])),
                Holds::Colours => (vec![FieldValue::Colours(vec![[1, 2, 3]])], FieldValue::Numbers(vec![1.0])),
                Holds::OneOf(_) | Holds::Text | Holds::File | Holds::Folder | Holds::FeatureOf(_) => {
                    (Vec::new(), FieldValue::Number(1.0))
                }
            };
            // Frozen freedoms are read with regions only.
            if key != "freeze" {
                assert!(at_this_field(Some(bad)), "[{table}] {key}");
            }
            for value in good {
                assert!(!at_this_field(Some(value.clone())), "[{table}] {key} {value:?}");
            }
        }
    }

    /// Beyond every rule, and of either sign.
    #[test]
    fn a_number_out_of_its_range_is_told_at_its_field_and_in_short() {
        let told = |document: &crate::plan::document::Document, key: &str, what: &str| {
            let problems = document.problems();
            let at_key = |p: &&crate::plan::document::PlanProblem| {
                p.diagnostic.severity == Severity::Error && p.place.key.as_deref() == Some(key)
            };
            assert!(problems.iter().any(|p| at_key(&p)), "{what}: {problems:?}");
            let changes = document.changes().iter().map(ToString::to_string).collect::<Vec<_>>();
            let messages = problems.iter().map(|p| p.diagnostic.to_string());
            for text in messages.chain(changes) {
                assert!(text.chars().filter(|c| *c == '0').count() < 40 && text.len() < 400, "{what}: {text}");
            }
        };
        for v in [1e300, -1e300] {
            for Setting { table, key, holds, .. } in FORM {
                let value = match holds {
                    Holds::Number(_) | Holds::Whole => FieldValue::Number(v),
                    _ => continue,
                };
                let mut document = open(FULL);
                document.set_setting(table, key, &value).unwrap();
                told(&document, key, &format!("[{table}] {key} = {v:e}"));
            }
            for list in [List::Feature, List::Comparison] {
                for (index, row) in open(FULL).rows(list).iter().enumerate() {
                    for RowKey { key, .. } in row_form(list, &row.kind) {
                        let value = match key {
                            // Of a direction only its direction counts, whatever its length.
                            "direction" | "axis" | "normal" | "method" => continue,
                            "position" | "centre" => FieldValue::Numbers(vec![v, 0.0, 1.0]),
                            _ => FieldValue::Number(v),
                        };
                        let mut document = open(FULL);
                        document.set_value(list, index, key, &value).unwrap();
                        told(&document, key, &format!("{} {key} = {v:e}", row.name));
                    }
                }
            }
        }
    }

    #[test]
    fn a_limit_that_limits_nothing_is_told_and_holds() {
        let mut document = open(FULL);
        document.set_value(List::Comparison, 0, "upper_mm", &FieldValue::Number(1e4)).unwrap();
        let problems = document.problems();
        let told = problems.iter().find(|p| p.place.key.as_deref() == Some("upper_mm")).expect("a word about it");
        assert_eq!(told.diagnostic.severity, Severity::Warning);
        assert!(told.diagnostic.message.contains("found 10000 mm, farther off"), "{told:?}");
        assert!(parse(&document.bytes(), document.path()).plan.is_some());
    }

    #[test]
    fn what_is_left_out_holds_as_the_form_says() {
        for setting in FORM {
            let Some(value) = setting.left_out.value() else { continue };
            let mut without = open(FULL);
            without.remove_setting(setting.table, setting.key).unwrap();
            let mut with = without.clone();
            with.set_setting(setting.table, setting.key, &value).unwrap();
            assert_eq!((errors(&without), errors(&with)), (Vec::new(), Vec::new()), "{setting:?}");
            let read = |document: &crate::plan::document::Document| {
                let plan = parse(&document.bytes(), document.path()).plan.unwrap();
                (
                    plan.part,
                    plan.cad,
                    plan.scans,
                    plan.background,
                    plan.alignment,
                    plan.rig,
                    plan.uncertainty,
                    plan.output,
                )
            };
            assert_eq!(read(&without), read(&with), "{setting:?}");
        }
    }

    #[test]
    fn rows_need_what_their_form_says_and_take_nothing_else() {
        for list in [List::Feature, List::Comparison] {
            for (index, row) in open(FULL).rows(list).iter().enumerate() {
                let form = row_form(list, &row.kind);
                let known: Vec<&str> = form.iter().map(|k| k.key).chain(["name", "kind"]).collect();
                assert!(row.values.iter().all(|(key, _)| known.contains(&key.as_str())), "{row:?}");
                for RowKey { key, needed } in form {
                    let mut document = open(FULL);
                    document.remove_value(list, index, key).unwrap();
                    assert_eq!(!errors(&document).is_empty(), needed, "{} {key}", row.name);
                }
                for key in crate::plan::document::LISTED_KEYS.into_iter().filter(|key| !known.contains(key)) {
                    let mut document = open(FULL);
                    if document.set_value(list, index, key, &FieldValue::Number(1.0)).is_ok() {
                        assert!(!errors(&document).is_empty(), "{} {key}", row.name);
                    }
                }
            }
        }
        assert!(row_form(List::Comparison, "slot").is_empty());
    }
}
