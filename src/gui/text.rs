//! All words of the window, by key, in three languages. A key is `section.name` of `assets/text/LANGUAGE.toml`.
//!
//! A key without a text fails a test, and so does a text that nobody asks for.

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
}

/// The words of one language.
#[derive(Debug)]
pub struct Words {
    language: Language,
    texts: BTreeMap<String, String>,
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
        Words { language, texts }
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

    /// The text for a count: `KEY_one` for 1, else `KEY_other`; `{n}` is the count with its thousands parted.
    pub fn count(&self, key: &str, n: usize) -> String {
        let form = if n == 1 { "one" } else { "other" };
        self.fill(&format!("{key}_{form}"), &[("n", &self.thousands(n))])
    }

    /// A number with a fixed count of decimals and the language's decimal sign; minus is U+2212.
    pub fn number(&self, value: f64, decimals: usize) -> String {
        let text = format!("{value:.decimals$}");
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
