//! Changes and steps in the words of the window's language. The plan's file keeps them in English.

use super::labels;
use crate::gui::text::{Language, Words};
use crate::plan::document::{Change, ChangedAt, FORM, LISTED_KEYS, List, Step, Verb, row_form};
use crate::report::words::clean;

/// A change: `P01: Lower limit −0.500 to −0.400 mm`. The fonts have no arrows.
pub fn change(words: &Words, change: &Change) -> String {
    let what = clean(&change.what)
        .replace("->", words.text("engineer.to"))
        .replace("left out", words.text("engineer.left_out"));
    let (subject, what) = match &change.at {
        ChangedAt::Setting(table, key) => (labels::setting(words, table, key), what),
        ChangedAt::Key(_, name, key) => (name.clone(), key_change(words, key, &what)),
        ChangedAt::Added(list, name) => {
            let kind = what.rsplit_once('(').and_then(|(_, rest)| rest.strip_suffix(')')).unwrap_or_default();
            let row = labels::row_of_kind(words, *list, kind);
            (name.clone(), words.fill("engineer.row_added", &[("what", row)]))
        }
        ChangedAt::Removed(_, name, _) => (name.clone(), words.text("engineer.row_removed").to_owned()),
        ChangedAt::Renamed(_, old, new) => (new.clone(), words.fill("engineer.row_was", &[("name", old)])),
        ChangedAt::Other => (change.subject.clone(), what),
    };
    format!("{subject}: {}", with_numbers_of(words, &what))
}

/// A true minus before numbers, and the language's decimal sign in them; names such as `4711-02` stay as they are.
fn with_numbers_of(words: &Words, text: &str) -> String {
    let comma = words.language() != Language::English;
    let all: Vec<char> = text.chars().collect();
    let digit = |k: Option<usize>| k.and_then(|k| all.get(k)).is_some_and(char::is_ascii_digit);
    let mut inside = false;
    let mut told = String::with_capacity(text.len() + 8);
    for (k, c) in all.iter().enumerate() {
        let begins = k.checked_sub(1).is_none_or(|before| matches!(all[before], ' ' | '['));
        match c {
            '[' | ']' => {
                inside = *c == '[';
                told.push(*c);
            }
            '-' if begins && digit(Some(k + 1)) => told.push('\u{2212}'),
            '.' if comma && digit(k.checked_sub(1)) && digit(Some(k + 1)) => told.push(','),
            ',' if comma && inside => told.push(';'),
            other => told.push(*other),
        }
    }
    told
}

/// What became of a key of a row, its own name in the window's language.
fn key_change(words: &Words, key: &str, what: &str) -> String {
    let label = labels::row_key(words, key);
    if let Some((mm, rest)) = what.strip_prefix("moved by ").and_then(|rest| rest.split_once(" mm, ")) {
        let places = rest.split_once(' ').map_or(rest, |(_, places)| places);
        return words.fill("engineer.row_moved", &[("mm", mm), ("places", places)]);
    }
    match english(key).and_then(|english| what.strip_prefix(english)) {
        Some(rest) => format!("{label}{rest}"),
        None => what.to_owned(),
    }
}

/// What the plan's file calls a key of a row.
fn english(key: &str) -> Option<&'static str> {
    let kinds = ["surface", "edge", "hole", "slot"];
    let lists = [List::Feature, List::Comparison];
    let all = lists.into_iter().flat_map(|list| kinds.into_iter().flat_map(move |kind| row_form(list, kind)));
    all.into_iter().find(|row| row.key == key).map(|row| row.label()).or((key == "kind").then_some("kind"))
}

/// What a step does.
pub fn step(words: &Words, step: &Step) -> String {
    let key = match step.verb {
        Verb::Add => "engineer.verb_add",
        Verb::Remove => "engineer.verb_remove",
        Verb::Move => "engineer.verb_move",
        Verb::Rename => "engineer.verb_rename",
        Verb::Change => "engineer.verb_change",
        Verb::Reorder => "engineer.verb_reorder",
        Verb::Mirror => "engineer.verb_mirror",
        Verb::Import => "engineer.verb_import",
        Verb::Edit => "engineer.verb_edit",
        Verb::Recover => "engineer.verb_recover",
    };
    words.fill(key, &[("what", &concerned(words, &step.what))])
}

/// To what: a setting, a key of a row, or a name that is the same in every language.
fn concerned(words: &Words, what: &str) -> String {
    if let Some(setting) = FORM.iter().find(|setting| setting.label() == what) {
        return labels::setting(words, setting.table, setting.key);
    }
    if let Some((label, name)) = what.rsplit_once(" of ") {
        let key = LISTED_KEYS.iter().find(|key| english(key) == Some(label));
        if let Some(key) = key {
            return format!("{} ({name})", labels::row_key(words, key));
        }
    }
    what.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::document::{Document, FieldValue};
    use std::path::Path;

    #[test]
    fn changes_and_steps_are_told_in_each_language() {
        let text = include_str!("../../../settings/demo.toml");
        let mut document = Document::from_bytes(text.as_bytes(), Path::new("demo.toml")).unwrap();
        document.set_setting("part", "thickness_mm", &FieldValue::Number(1.5)).unwrap();
        document.set_value(List::Comparison, 0, "lower_mm", &FieldValue::Number(-0.4)).unwrap();
        document
            .set_value(List::Comparison, 1, "position", &FieldValue::Numbers(vec![-29.9999, 44.9999, 3.0]))
            .unwrap();
        document.rename(List::Comparison, 2, "Rib").unwrap();
        document.remove(List::Comparison, &[3]).unwrap();
        let told =
            |language| -> Vec<String> { document.changes().iter().map(|c| change(Words::of(language), c)).collect() };
        let english = told(Language::English);
        assert_eq!(
            english,
            [
                "Sheet thickness: 1.200 to 1.500 mm",
                "P04: removed",
                "P01: Lower limit −0.500 to −0.400 mm",
                "P02: moved by 0.366 mm, [−30.000, 45.000, 2.634] to [−30.000, 45.000, 3.000] mm",
                "Rib: was P03",
            ]
        );
        let german = told(Language::German);
        assert_eq!(german[0], "Blechdicke: 1,200 auf 1,500 mm");
        assert!(german[3].ends_with("[−30,000; 45,000; 2,634] auf [−30,000; 45,000; 3,000] mm"), "{german:?}");
        assert_eq!(
            with_numbers_of(Words::of(Language::German), "\"4711-02\" auf \"4711-03\""),
            "\"4711-02\" auf \"4711-03\""
        );
        assert!(german.iter().zip(&english).all(|(de, en)| de != en), "{german:?}");
        let undo = |language| step(Words::of(language), document.undo_step().unwrap());
        assert_eq!([undo(Language::English), undo(Language::Swedish)], ["Remove P04", "Ta bort P04"]);
        document.undo();
        document.undo();
        document.undo();
        let undo = |language| step(Words::of(language), document.undo_step().unwrap());
        assert_eq!(
            [undo(Language::English), undo(Language::German)],
            ["Change Lower limit (P01)", "Untere Grenze (P01) ändern"]
        );
    }
}
