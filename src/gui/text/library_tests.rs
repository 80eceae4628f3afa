//! The catalogues of the library's sentences against its sources, and what the window makes of sentences.

use super::pattern::{Kind, Pattern, taken_apart};
use super::{Language, Words};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Folders and files below `src` whose every sentence has a translation: what operators read of a scan, of files and folders, and what
/// engineers read of a CAD. Of the others some have one; what has none stays English (ARCHITECTURE.md tells what that is).
const COVERED: &[&str] = &[
    "align",
    "fit/hold/freedom.rs",
    "inspect/comparison.rs",
    "inspect/expected_warnings.rs",
    "inspect/pipeline.rs",
    "inspect/plan_check.rs",
    "inspect/region_check.rs",
    "inspect/verdict.rs",
    "io",
    "measure",
    "part/propose/surface.rs",
    "part/prepare.rs",
    "plan/alignment.rs",
    "plan/comparison_file.rs",
    "plan/document/edit_error.rs",
    "plan/document/import.rs",
    "plan/load.rs",
    "plan/notation.rs",
    "plan/problems.rs",
    "plan/reader.rs",
    "plan/regions.rs",
    "plan/sections.rs",
    "plan/shapes.rs",
    "plan/syntax.rs",
    "plan/values.rs",
    "report/atomic.rs",
    "scan",
    "stitch",
    "worker",
];

/// Files there that say nothing in a window: lines of the command line, writers, their tests.
const NOT_SHOWN: &[&str] = &["io/fuzz.rs", "io/write.rs", "worker/words.rs"];

/// What is in quotes there and is no sentence of a window: marks and names of files, keywords, examples, units, places before a sentence,
/// what the window has words of its own for, what a programmer reads. The last one stays English.
const NO_SENTENCES: &[&str] = &[
    "a pose is a proper rotation",
    "a rank for every point",
    "a sensor for every point",
    "write {\"views\": [{\"index\": 0, \"approx\": {\"R\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"t\": [0, 0, 0]}}, ..]}",
    "points are numbered in 32 bits",
    "facts of every view",
    "at least one round",
    "members have a difference",
    "a region has points",
    "the least one is within",
    "[mask] {}",
    "[merge] metric",
    "[merge]: {words}",
    "[density] cell: {}: {e}",
    "[views] pattern: {e}",
    "[output] compare_with: {}: {fault}",
    "# shapeline autosave of ",
    "what was not saved",
    "\"schema\": \"shapeline-result/",
    "{name} (earlier {number})",
    "\"schema\": \"{family}/",
    "%Y-%m-%d %H:%M UTC",
    "# .PCD",
    "VERSION .",
    "\"outer loop\"",
    "\"element NAME COUNT\"",
    "standard deviations",
    "duplicate key",
    "schema = 1",
    "{} points",
    "{place} number {}",
    "[[feature]] \"{}\"",
    "[[comparison]] \"{}\"",
    "[\"x\", \"rz\"]",
    "[\"ascii\", \"json\", \"pdf\"]",
    "name, kind, x, y, z, i, j, k, lower_mm, upper_mm",
    "{article} {kind} has {own_words}",
];

/// Rooms whose literals are not the library's.
const OTHERS: &[&str] = &["cli", "gui/text"];

/// The text literals of a source file without its comments, its tests and what people never read: `expect`, `reason`.
fn literals(source: &str) -> Vec<String> {
    let end = source.find("#[cfg(test)]\nmod tests {").unwrap_or(source.len());
    let mut rest = &source[..end];
    let mut found = Vec::new();
    let mut before = String::new();
    while let Some(letter) = rest.chars().next() {
        let next = &rest[letter.len_utf8()..];
        if rest.starts_with("//") {
            rest = rest.find('\n').map_or("", |at| &rest[at..]);
        } else if let Some(raw) = rest.strip_prefix("r#\"").filter(|_| !before.ends_with(char::is_alphanumeric)) {
            let at = raw.find("\"#").unwrap_or(raw.len());
            found.push(raw[..at].to_owned());
            rest = &raw[(at + 2).min(raw.len())..];
            before.clear();
        } else if letter == '"' {
            let (text, after) = literal(next);
            if !["expect(", "reason = "].iter().any(|end| before.ends_with(end)) {
                found.push(text);
            }
            rest = after;
            before.clear();
        } else if let Some(after) = character(rest) {
            rest = after;
        } else {
            before.push(letter);
            rest = next;
        }
    }
    found
}

/// A literal from behind its first quote, and what follows.
fn literal(source: &str) -> (String, &str) {
    let (mut text, mut letters) = (String::new(), source.char_indices());
    while let Some((at, letter)) = letters.next() {
        match letter {
            '"' => return (text, &source[at + 1..]),
            '\\' => match letters.next().map(|(_, letter)| letter) {
                // The line goes on below.
                Some('\n') => {
                    let below = letters.as_str().trim_start();
                    let (rest, after) = literal(below);
                    return (text + &rest, after);
                }
                Some('n') => text.push('\n'),
                Some('t') => text.push('\t'),
                Some(other @ ('"' | '\\' | '\'')) => text.push(other),
                other => text.extend(['\\'].into_iter().chain(other)),
            },
            _ => text.push(letter),
        }
    }
    (text, "")
}

/// What follows a character literal; a lifetime is none.
fn character(source: &str) -> Option<&str> {
    let inside = source.strip_prefix('\'')?;
    let escaped = inside.strip_prefix('\\');
    let after = escaped.unwrap_or(inside).chars().next().map(|c| &escaped.unwrap_or(inside)[c.len_utf8()..])?;
    match escaped {
        Some(_) => after.find('\'').filter(|at| *at < 12).map(|at| &after[at + 1..]),
        None => after.strip_prefix('\''),
    }
}

/// The literals of all sources but those of other rooms and of tests, by their file below `src`.
fn sources() -> BTreeMap<String, Vec<String>> {
    fn read(folder: &Path, root: &Path, found: &mut BTreeMap<String, Vec<String>>) {
        for entry in std::fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
            if OTHERS.iter().any(|other| name.starts_with(other)) {
                continue;
            }
            if path.is_dir() {
                read(&path, root, found);
            } else if name.ends_with(".rs") && !name.contains("test") && !name.contains("synthetic") {
                found.insert(name, literals(&std::fs::read_to_string(path).unwrap()));
            }
        }
    }
    let (root, mut found) = (Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), BTreeMap::new());
    read(&root, &root, &mut found);
    found
}

fn catalogue(language: Language) -> Vec<(String, String)> {
    let document = language.catalogue().parse::<toml_edit::DocumentMut>().expect("a catalogue");
    document.iter().map(|(key, item)| (key.to_owned(), item.as_str().expect("a text").to_owned())).collect()
}

const TRANSLATED: [Language; 2] = [Language::Swedish, Language::German];

#[test]
fn every_template_stands_in_the_sources_and_both_languages_have_it() {
    let sources = sources();
    let all: BTreeSet<&str> = sources.values().flatten().map(String::as_str).collect();
    assert!(all.len() > 1500, "the sources were not read: {}", all.len());
    let [swedish, german] = TRANSLATED.map(catalogue);
    let keys = |of: &[(String, String)]| of.iter().map(|(key, _)| key.clone()).collect::<Vec<_>>();
    assert_eq!(keys(&swedish), keys(&german));
    let stale: Vec<_> = keys(&german).into_iter().filter(|key| !all.contains(key.as_str())).collect();
    assert!(stale.is_empty(), "no source says any longer:\n{}", stale.join("\n"));
}

#[test]
fn translations_take_the_values_of_their_templates_alike() {
    let mut faults = Vec::new();
    let [swedish, german] = TRANSLATED.map(catalogue);
    for ((key, swedish), (_, german)) in swedish.iter().zip(&german) {
        if key == swedish || key == german {
            // Words of file formats.
            if !key.starts_with('"') && !taken_apart(key).0.concat().trim_matches([' ', '%']).is_empty() {
                faults.push(format!("left in English: {key}"));
            }
        }
        match [Pattern::new(key, swedish), Pattern::new(key, german)] {
            [Some(a), Some(b)] if a.kinds() != b.kinds() => faults.push(format!("two kinds of values: {key}")),
            [Some(a), Some(_)] if key.contains('{') && !a.is_told_apart() => {
                faults.push(format!("runs together: {key}"))
            }
            [Some(_), Some(_)] => {}
            _ => faults.push(format!("other values: {key}\n    {swedish}\n    {german}")),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a literal is made of words that people read.
fn is_sentence(text: &str) -> bool {
    let own: String = taken_apart(text).0.concat();
    let words = own.split_whitespace().filter(|word| word.chars().filter(|c| c.is_alphabetic()).count() > 1);
    text.trim().contains(' ') && words.count() > 0
}

#[test]
fn every_sentence_of_the_covered_sources_is_translated() {
    // By what is between the values: how they are called there matters to nobody.
    let known: BTreeSet<Vec<String>> = catalogue(Language::German).iter().map(|(key, _)| taken_apart(key).0).collect();
    let mut missing = Vec::new();
    let mut seen = BTreeSet::new();
    for (file, literals) in sources() {
        let Some(covered) = COVERED.iter().find(|c| file == **c || file.starts_with(&format!("{c}/"))) else {
            continue;
        };
        if NOT_SHOWN.contains(&file.as_str()) {
            continue;
        }
        seen.insert(covered);
        for text in literals.iter().filter(|text| is_sentence(text)) {
            let told = || !text.contains('{') && told(Language::German, text) != *text;
            if !known.contains(&taken_apart(text).0) && !told() && !NO_SENTENCES.contains(&text.as_str()) {
                missing.push(format!("{file}: {text}"));
            }
        }
    }
    assert_eq!(seen.len(), COVERED.len(), "only {seen:?} were read");
    assert!(missing.is_empty(), "no translation of\n{}", missing.join("\n"));
}

fn told(language: Language, text: &str) -> String {
    Words::of(language).library(text).into_owned()
}

/// A template with values put in: a number, words of the library, a name.
fn filled(template: &str, pattern: &Pattern) -> String {
    let (literals, _) = taken_apart(template);
    let value = |kind: &Kind| match kind {
        Kind::Number => "3",
        Kind::Words | Kind::Known => "the points show no edge here",
        Kind::Name => "X1",
    };
    let values = pattern.kinds().iter().map(value).chain([""]);
    literals.iter().zip(values).flat_map(|(literal, value)| [literal.as_str(), value]).collect()
}

#[test]
fn every_template_is_told_from_all_others() {
    let mut faults = Vec::new();
    for language in TRANSLATED {
        for (key, translation) in catalogue(language) {
            let pattern = Pattern::new(&key, &translation).expect("a pattern");
            let text = filled(&key, &pattern);
            let words = |words: &str| Some(told(language, words));
            let expected = pattern.translated(&text, str::to_owned, words).unwrap_or_default();
            let told = told(language, &text);
            if told != expected {
                faults.push(format!("{text}\n    {told}\n    {expected}"));
            }
        }
    }
    assert!(faults.is_empty(), "taken for another one:\n{}", faults.join("\n"));
}

#[test]
fn numbers_are_written_as_the_language_does_and_names_stay() {
    let (de, sv) = (|text| told(Language::German, text), |text| told(Language::Swedish, text));
    assert_eq!(
        de("the scan holds 12 points (1204331 without a position were skipped), at least 1000 are needed"),
        "der Scan hat 12 Punkte (1\u{2009}204\u{2009}331 ohne Ort wurden übergangen), mindestens 1\u{2009}000 sind nötig"
    );
    assert_eq!(
        sv("the edge at the place itself lies -0.8 mm off the edge beside it"),
        "kanten på själva platsen ligger \u{2212}0,8 mm från kanten bredvid"
    );
    assert_eq!(de("datum 1.5 not measured"), "Bezug 1.5 nicht gemessen");
    let en = |text| told(Language::English, text);
    assert_eq!(
        en("the scan holds 12 points, at least 1000 are needed"),
        "the scan holds 12 points, at least 1,000 are needed"
    );
    assert_eq!(
        en("datum 12345 not measured: no hole within ±3.0 mm of its place"),
        "datum 12345 not measured: no hole within ±3.0 mm of its place"
    );
    assert_eq!(en("make room, or give another folder with --out"), "make room, or give another folder");
}

#[test]
fn sentences_within_sentences_are_translated() {
    let de = |text: &str| told(Language::German, text);
    assert_eq!(
        de(
            "A.ply: no points found, expected a measured cloud; 2 of 2 views cannot be used, expected two or more that can be merged"
        ),
        "A.ply: keine Punkte gefunden; erwartet eine gemessene Punktwolke; 2 von 2 Ansichten sind unbrauchbar, nötig sind zwei oder mehr, die sich zusammenführen lassen"
    );
    assert_eq!(
        de(
            "datum A; B: C not measured: no hole within ±3.0 mm of its place; datum S1 not measured: the points show no slot here"
        ),
        "Bezug A; B: C nicht gemessen: kein Loch innerhalb ±3,0 mm um seinen Ort; Bezug S1 nicht gemessen: die Punkte zeigen hier kein \
         Langloch"
    );
    assert_eq!(
        de(
            "the datums leave a motion free: turn about the line through H1 and S1 with a shift along it of 2.50 mm a degree and shift along x"
        ),
        "die Bezüge lassen eine Bewegung frei: Drehung um die Linie durch H1 und S1 mit einer Verschiebung entlang der Achse von 2,50 mm \
         je Grad und Verschiebung entlang x"
    );
    assert_eq!(
        de("the gap found here is 12.0 mm wide, the hole is 16.0 mm wide"),
        "die Lücke hier: Durchmesser 12,0 mm, Soll (Loch): Durchmesser 16,0 mm"
    );
    // A place before it, what to do behind it, and a semicolon in that.
    assert_eq!(
        de("a: b.ply:7: the file is empty; copy the scan again; the sequence goes on"),
        "a: b.ply:7: die Datei ist leer; den Scan noch einmal kopieren; die Folge geht weiter"
    );
}

#[test]
fn a_sentence_that_is_not_known_stays_as_it_is() {
    for text in [
        "",
        "no edge within ±x mm",
        "no edge within ±3.0 mm of here",
        "No edge within ±3.0 mm",
        " no edge within ±3.0 mm",
        "something, expected somebody",
        "this hole and slot",
        "datum",
        "{} points",
    ] {
        assert_eq!(told(Language::German, text), text);
    }
    // What is not known in a sentence that is.
    assert_eq!(told(Language::German, "datum A: because"), "Bezug A: because");
}

#[test]
fn a_hostile_name_is_neither_read_nor_slow() {
    let names = [
        "{name} {0} {} {{".to_owned(),
        "no edge within ±3.0 mm".to_owned(),
        "a\nb\u{202e}\0".to_owned(),
        "x".repeat(10_000),
        "; ".repeat(5_000),
        ": ".repeat(5_000),
        " and ".repeat(2_000),
        "datum a: ".repeat(1_100),
        "datum H not measured: ".repeat(470),
        "[[comparison]] \"a\": found ".repeat(380),
    ];
    let start = std::time::Instant::now();
    for name in &names {
        let german = told(Language::German, &format!("datum {name} not measured"));
        // A name that says what the sentence says is taken for it.
        assert!(german == format!("Bezug {name} nicht gemessen") || name.contains("datum"), "{}", &german[..60]);
        let _ = told(Language::German, name);
        let _ = told(Language::Swedish, &format!("datum H1: {name}"));
    }
    // Thirty texts of 10 kB; even a debug build does it in a second or two. What is not linear takes minutes.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}
