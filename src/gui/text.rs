//! All words of the window, by key, in three languages. A key is `section.name` of `assets/text/LANGUAGE.toml`.
//!
//! A key without a text fails a test, and so does a text that nobody asks for. What the library says is English; [`Words::library`] finds
//! it in the language's catalogue of the library's sentences.

mod library;
#[cfg(test)]
mod library_tests;
mod pattern;

use self::library::Library;
use crate::diagnostic::Diagnostic;
use crate::report::words::{capital, clean};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// A language of the window. Files and the command line are English.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Language {
    /// English.
    #[default]
    English,
    /// Swedish.
    Swedish,
    /// German.
    German,
}

impl Language {
    /// In the order of the menu.
    pub const ALL: [Language; 3] = [Language::English, Language::Swedish, Language::German];

    /// Its own name.
    pub fn name(self) -> &'static str {
        match self {
            Language::English => "English",
            Language::Swedish => "Svenska",
            Language::German => "Deutsch",
        }
    }

    /// Its code in the settings.
    pub fn code(self) -> &'static str {
        match self {
            Language::English => "en",
            Language::Swedish => "sv",
            Language::German => "de",
        }
    }

    fn source(self) -> &'static str {
        match self {
            Language::English => include_str!("../../assets/text/en.toml"),
            Language::Swedish => include_str!("../../assets/text/sv.toml"),
            Language::German => include_str!("../../assets/text/de.toml"),
        }
    }

    /// The library's sentences under their English templates; none in English.
    fn catalogue(self) -> &'static str {
        match self {
            Language::English => "",
            Language::Swedish => include_str!("../../assets/text/library.sv.toml"),
            Language::German => include_str!("../../assets/text/library.de.toml"),
        }
    }
}

/// The words of one language.
#[derive(Debug)]
pub struct Words {
    language: Language,
    texts: BTreeMap<String, String>,
    library: Library,
}

impl Words {
    /// The words of a language; read once.
    pub fn of(language: Language) -> &'static Words {
        static WORDS: LazyLock<[Words; 3]> = LazyLock::new(|| Language::ALL.map(Words::read));
        let place = Language::ALL.iter().position(|l| *l == language).unwrap_or(0);
        &WORDS[place]
    }

    fn read(language: Language) -> Words {
        let document = language.source().parse::<toml_edit::DocumentMut>().unwrap_or_default();
        let mut texts = BTreeMap::new();
        for (section, table) in document.iter() {
            for (name, text) in table.as_table_like().into_iter().flat_map(|t| t.iter()) {
                if let Some(text) = text.as_str() {
                    texts.insert(format!("{section}.{name}"), text.to_owned());
                }
            }
        }
        let library = match language {
            // Which of a sentence's values are numbers is the same in all languages.
            Language::English => Library::own(Language::German.catalogue()),
            Language::Swedish | Language::German => Library::read(language.catalogue()),
        };
        Words { language, texts, library }
    }

    /// Which language these are of.
    pub fn language(&self) -> Language {
        self.language
    }

    /// The text of a key; the key itself where there is none, which a test forbids.
    pub fn text<'a>(&'a self, key: &'a str) -> &'a str {
        self.texts.get(key).map_or(key, String::as_str)
    }

    /// The text of a key with `{name}` replaced by values.
    pub fn fill(&self, key: &str, values: &[(&str, &str)]) -> String {
        let mut rest = self.text(key);
        let mut filled = String::with_capacity(rest.len() + 16);
        // One pass: a value that holds braces stays as it is.
        while let Some(open) = rest.find('{') {
            let (before, from) = rest.split_at(open);
            filled.push_str(before);
            let Some(close) = from.find('}') else {
                rest = from;
                break;
            };
            let name = &from[1..close];
            match values.iter().find(|(key, _)| *key == name) {
                Some((_, value)) => filled.push_str(value),
                None => filled.push_str(&from[..=close]),
            }
            rest = &from[close + 1..];
        }
        filled.push_str(rest);
        filled
    }

    /// What the library says, in this language: refusals, reasons, gates, warnings, problems. Numbers are written as the language does,
    /// names and paths stay as they are; a sentence that is not known stays English.
    pub fn library<'t>(&self, text: &'t str) -> Cow<'t, str> {
        let told = self.library.sentence(text, &|number| self.written(number)).filter(|told| told != text);
        let told = told.map_or(Cow::Borrowed(text), Cow::Owned);
        match self.language {
            // What only the command line can do.
            Language::English if told.contains(" with --out") => Cow::Owned(told.replace(" with --out", "")),
            _ => told,
        }
    }

    /// What the library says as a sentence of its own: with a capital letter, in one line.
    pub fn told(&self, text: &str) -> String {
        capital(&clean(&self.library(text)))
    }

    /// What the library says, and after a semicolon what to do.
    pub fn with_help(&self, message: &str, help: Option<&str>) -> String {
        let told = self.library(message);
        help.map_or_else(|| told.clone().into_owned(), |help| format!("{told}; {}", self.library(help)))
    }

    /// A message in this language, its place as it is.
    pub fn diagnostic(&self, told: &Diagnostic) -> Diagnostic {
        Diagnostic {
            message: self.library(&told.message).into_owned(),
            help: told.help.as_deref().map(|help| self.library(help).into_owned()),
            ..told.clone()
        }
    }

    /// A number of the library as this language writes it.
    fn written(&self, number: &str) -> String {
        let plain = number.replace(',', "");
        match (plain.parse(), plain.split_once('.')) {
            (Ok(count), None) if !number.starts_with('+') => self.thousands(count),
            _ if self.language == Language::English => number.to_owned(),
            _ => number.replace('.', ",").replace('-', "\u{2212}"),
        }
    }

    /// A noun that begins with a capital letter, as it stands within a sentence: in German as it is.
    pub fn noun_within(&self, noun: &str) -> String {
        match self.language {
            Language::German => noun.to_owned(),
            Language::English | Language::Swedish => noun.to_lowercase(),
        }
    }

    /// The text for a count: `KEY_one` for 1, else `KEY_other`; `{n}` is the count with its thousands parted.
    pub fn count(&self, key: &str, n: usize) -> String {
        let form = if n == 1 { "one" } else { "other" };
        self.fill(&format!("{key}_{form}"), &[("n", &self.thousands(n))])
    }

    /// A number with a fixed count of decimals and the language's decimal sign; minus is U+2212.
    pub fn number(&self, value: f64, decimals: usize) -> String {
        // Nobody reads three hundred zeros.
        let text = if value.abs() < 1e15 { format!("{value:.decimals$}") } else { format!("{value:e}") };
        let zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
        let text = if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "\u{2212}") };
        match self.language {
            Language::English => text,
            Language::Swedish | Language::German => text.replace('.', ","),
        }
    }

    /// A length in mm with three decimals and always a sign; zero has none.
    pub fn signed_mm(&self, value_mm: f64) -> String {
        let text = self.number(value_mm, 3);
        let zero = !text.bytes().any(|b| (b'1'..=b'9').contains(&b));
        if zero || text.starts_with('\u{2212}') { text } else { format!("+{text}") }
    }

    /// A count with its thousands parted.
    pub fn thousands(&self, count: usize) -> String {
        let text = crate::report::words::thousands(count);
        match self.language {
            Language::English => text,
            Language::Swedish | Language::German => text.replace(',', "\u{2009}"),
        }
    }
}

/// A number as somebody types it: comma or point, an ASCII or a true minus.
pub fn typed_number(text: &str) -> Option<f64> {
    let text = text.trim().replace(',', ".").replace('\u{2212}', "-");
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    /// Texts that are the same in another language, rightly: key and language.
    const SAME: &[(&str, Language)] = &[
        ("pick.parallel", Language::German),
        ("engineer.plan", Language::Swedish),
        ("engineer.cad", Language::Swedish),
        ("engineer.cad", Language::German),
        ("engineer.scans", Language::German),
        ("engineer.revision", Language::Swedish),
        ("engineer.revision", Language::German),
        ("operator.revision", Language::Swedish),
        ("operator.revision", Language::German),
        ("results.revision", Language::Swedish),
        ("setting.diameter", Language::Swedish),
        ("setting.radius", Language::German),
        ("setting.name", Language::German),
        ("results.scan", Language::German),
        ("new_plan.step_scan", Language::German),
        ("new_plan.belt", Language::German),
        ("new_plan.point", Language::Swedish),
        ("new_plan.point", Language::German),
        ("new_plan.expected_u", Language::Swedish),
        ("new_plan.expected_u", Language::German),
    ];
    /// Families of keys that are put together while the program runs.
    const FAMILIES: &[&str] = &["view.system", "view.light", "view.dark"];

    /// Every text literal of the window's sources that looks like a key of a section that there is.
    fn keys_in_sources() -> BTreeSet<String> {
        fn read(folder: &Path, found: &mut String) {
            for entry in std::fs::read_dir(folder).unwrap().flatten() {
                let path = entry.path();
                match path.is_dir() {
                    true => read(&path, found),
                    false => found.push_str(&std::fs::read_to_string(path).unwrap()),
                }
            }
        }
        let mut sources = String::new();
        read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/gui"), &mut sources);
        let sections: BTreeSet<&str> =
            Words::of(Language::English).texts.keys().filter_map(|k| k.split_once('.')).map(|(s, _)| s).collect();
        let word = |text: &str| {
            !text.is_empty() && text.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
        };
        let literals = sources.split('"').filter(|text| {
            text.split_once('.').is_some_and(|(section, name)| sections.contains(section) && word(name))
        });
        literals.map(str::to_owned).collect()
    }

    #[test]
    fn every_key_has_a_text_in_every_language_and_every_text_a_key() {
        let sources = keys_in_sources();
        assert!(sources.len() > 100, "the sources were not read: {}", sources.len());
        let mut faults = Vec::new();
        for language in Language::ALL {
            let texts = &Words::of(language).texts;
            let has = |key: &str| texts.contains_key(key);
            let counted = |key: &str| has(&format!("{key}_one")) && has(&format!("{key}_other"));
            for key in sources.iter().filter(|k| !(has(k) || counted(k))) {
                faults.push(format!("{} has no text for {key}", language.name()));
            }
            for key in texts.keys() {
                let stem = key.strip_suffix("_one").or_else(|| key.strip_suffix("_other")).unwrap_or(key);
                if !sources.contains(key) && !sources.contains(stem) && !FAMILIES.contains(&key.as_str()) {
                    faults.push(format!("nobody asks for {key} ({})", language.name()));
                }
            }
        }
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    #[test]
    fn no_text_was_left_in_english_and_all_take_the_same_values() {
        let values = |text: &str| -> BTreeSet<String> {
            text.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(name, _)| name.to_owned()).collect()
        };
        let english = &Words::of(Language::English).texts;
        let mut faults = Vec::new();
        for language in [Language::Swedish, Language::German] {
            for (key, text) in &Words::of(language).texts {
                let Some(original) = english.get(key) else { continue };
                if values(text) != values(original) {
                    faults.push(format!("{key}: {text} takes other values than {original}"));
                }
                let says_something = text.chars().filter(|c| c.is_alphabetic()).count() > 1 && !only_values(text);
                if text == original && says_something && !SAME.contains(&(key.as_str(), language)) {
                    faults.push(format!("{key} is the same in English and {}: {text}", language.name()));
                }
            }
        }
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    /// Whether nothing but values and units is left of a text.
    fn only_values(text: &str) -> bool {
        let mut rest = text.to_owned();
        while let (Some(open), Some(close)) = (rest.find('{'), rest.find('}')) {
            rest.replace_range(open..=close, "");
        }
        rest.split_whitespace().all(|word| matches!(word, "s" | "mm" | "min" | "%"))
    }

    /// At most 11 letters, so that the word stays large (24 minutes of arc at three metres).
    #[test]
    fn words_of_verdicts_are_short() {
        for language in Language::ALL {
            for (key, text) in Words::of(language).texts.iter().filter(|(key, _)| key.starts_with("verdict.")) {
                assert!(text.chars().count() <= 11, "{key}: {text}");
            }
        }
    }

    #[test]
    fn numbers_are_written_as_each_language_does() {
        let [en, sv] = [Language::English, Language::Swedish].map(Words::of);
        assert_eq!(
            [en.signed_mm(0.3364), en.signed_mm(-0.9584), en.signed_mm(-0.0004)],
            ["+0.336", "\u{2212}0.958", "0.000"]
        );
        assert_eq!([sv.signed_mm(0.3364), sv.thousands(1_204_331)], ["+0,336", "1\u{2009}204\u{2009}331"]);
        assert_eq!(
            [typed_number("1,5"), typed_number(" \u{2212}2.25 "), typed_number("x"), typed_number("inf")],
            [Some(1.5), Some(-2.25), None, None]
        );
    }

    #[test]
    fn values_are_put_in_once() {
        let words = Words::of(Language::English);
        let filled = words.fill("operator.last_part", &[("n", "{scan}"), ("scan", "a.ply")]);
        assert_eq!(filled, "Last part: {scan}, scan a.ply");
    }

    /// Inter's subset must hold every letter that is shown.
    #[test]
    fn the_fonts_hold_every_character_of_every_text() {
        use crate::gui::fonts::{bold, install, regular, semibold};
        let ctx = egui::Context::default();
        install(&ctx);
        let _ = ctx.run_ui(egui::RawInput::default(), |_| {});
        let texts = Language::ALL.into_iter().flat_map(|l| Words::of(l).texts.values());
        let mut shown: BTreeSet<char> = texts.flat_map(|text| text.chars()).collect();
        shown.extend(Language::ALL.into_iter().flat_map(|l| l.catalogue().chars()).filter(|c| !c.is_control()));
        shown.extend("µ±°Ø≤≥−…–åäöüßÅÄÖÜ\u{2009}".chars());
        let missing =
            |c: &char| [regular, semibold, bold].iter().any(|f| !ctx.fonts_mut(|g| g.has_glyph(&f(14.0), *c)));
        let missing: Vec<char> = shown.into_iter().filter(missing).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
}
