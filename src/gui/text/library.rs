//! The sentences of the library in the window's language: refusals, reasons, gates, warnings, problems.
//!
//! The library, its reports and the command line speak English, and keep to it: a result is the same bytes whoever looks at it. The window
//! finds the template that a sentence was made of by its text, as gettext does, and writes it again. `assets/text/library.LANGUAGE.toml`
//! holds them, under the format strings of the sources. What has no template stays English.

use super::pattern::Pattern;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Sentences within sentences: a scan refused for one that was refused for a third. What goes deeper stays English.
const DEEPEST: usize = 6;
/// Places and names that stand before a sentence, each with a colon: a plan's table, its key, a file with its line.
const MOST_PLACES: usize = 6;
/// Sentences that are kept; a window shows fewer.
const MOST_LATELY: usize = 1000;
/// What stands before the last of several.
const JOINTS: [&str; 2] = [" and ", " or "];
/// Pieces between semicolons that are one sentence.
const MOST_PIECES: usize = 3;

/// The sentences of one language.
#[derive(Debug, Default)]
pub(super) struct Library {
    /// Those without values.
    whole: BTreeMap<String, String>,
    /// Those with values, the longest first.
    patterns: Vec<Pattern>,
    /// What stands before the last of several, English and this language's.
    joints: [[String; 2]; 2],
    /// What was asked for lately: a window asks for the same in every frame.
    lately: Mutex<BTreeMap<String, Option<String>>>,
}

impl Library {
    /// Reads a catalogue; what is not one is left out, which a test forbids.
    pub(super) fn read(catalogue: &str) -> Self {
        let document = catalogue.parse::<toml_edit::DocumentMut>().unwrap_or_default();
        let mut library = Self::default();
        for (template, translation) in document.iter().filter_map(|(key, item)| Some((key, item.as_str()?))) {
            if !template.contains('{') {
                library.whole.insert(template.to_owned(), translation.to_owned());
            } else if let Some(pattern) = Pattern::new(template, translation) {
                library.patterns.push(pattern);
            }
        }
        library.sorted()
    }

    /// The library's own language: what a catalogue tells of its sentences' values, in their own words.
    pub(super) fn own(catalogue: &str) -> Self {
        let mut library = Self::read(catalogue);
        library.whole.clear();
        library.patterns = library.patterns.into_iter().map(Pattern::in_its_own_words).collect();
        library.joints = JOINTS.map(|joint| [joint.to_owned(), joint.to_owned()]);
        library
    }

    fn sorted(mut self) -> Self {
        let library = &mut self;
        library.patterns.sort_by_key(|pattern| std::cmp::Reverse(pattern.own_letters()));
        library.joints =
            JOINTS.map(|joint| [joint.to_owned(), library.whole.get(joint).map_or(joint, String::as_str).to_owned()]);
        self
    }

    /// The sentence in this language, numbers by the function given; `None` where it is not known.
    pub(super) fn sentence(&self, text: &str, number: &dyn Fn(&str) -> String) -> Option<String> {
        let mut lately = self.lately.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(told) = lately.get(text) {
            return told.clone();
        }
        let told = self.at_depth(text, number, 0);
        if lately.len() >= MOST_LATELY {
            lately.clear();
        }
        lately.insert(text.to_owned(), told.clone());
        told
    }

    fn at_depth(&self, text: &str, number: &dyn Fn(&str) -> String, depth: usize) -> Option<String> {
        if depth > DEEPEST || text.is_empty() {
            return None;
        }
        let deeper = |text: &str| self.at_depth(text, number, depth + 1);
        let one = |text: &str| self.placed(text, number, &deeper);
        // These words stand in sentences, too: they join only what is told within one.
        let [and, or] = self.joints.each_ref().map(|joint| joint.each_ref().map(String::as_str));
        let within = || list(text, and).or_else(|| list(text, or)).or_else(|| joined(text, and, one, deeper));
        let within = || (depth > 0).then(within).flatten();
        let whole = self.known(text, number, &deeper);
        whole.or_else(|| joined(text, ["; "; 2], one, deeper)).or_else(|| one(text)).or_else(within)
    }

    /// A sentence, behind the places and names that stand before it.
    fn placed(
        &self,
        text: &str,
        number: &dyn Fn(&str) -> String,
        deeper: &dyn Fn(&str) -> Option<String>,
    ) -> Option<String> {
        let places = text.match_indices(": ").take(MOST_PLACES).map(|(at, colon)| at + colon.len());
        let known = |at: usize| Some(format!("{}{}", &text[..at], self.known(&text[at..], number, deeper)?));
        std::iter::once(0).chain(places).find_map(known)
    }

    /// A sentence that is one of the catalogue's.
    fn known(
        &self,
        text: &str,
        number: &dyn Fn(&str) -> String,
        deeper: &dyn Fn(&str) -> Option<String>,
    ) -> Option<String> {
        if let Some(whole) = self.whole.get(text) {
            return Some(whole.clone());
        }
        self.patterns.iter().find_map(|pattern| pattern.translated(text, number, deeper))
    }
}

/// Names, keys or quoted words in a row, `"mm", "cm" or "inch"`, or one alone that is no plain word; `None` where there are others in it.
fn list(text: &str, [last, with]: [&str; 2]) -> Option<String> {
    let is_word = |word: &str| !word.is_empty() && !word.contains(char::is_whitespace);
    let are_words = |words: &str| words.split(", ").all(is_word);
    match text.split_once(last) {
        Some((first, end)) if are_words(first) && is_word(end) => Some(format!("{first}{with}{end}")),
        None if is_word(text) && text.contains(['"', '[', '_']) => Some(text.to_owned()),
        _ => None,
    }
}

/// Sentences in a row, each translated; `None` where there is but one, or none is known. What stands between them may stand in them, too:
/// a few pieces can be one sentence.
fn joined(
    text: &str,
    [between, with]: [&str; 2],
    sentence: impl Fn(&str) -> Option<String>,
    piece: impl Fn(&str) -> Option<String>,
) -> Option<String> {
    let pieces: Vec<&str> = text.split(between).collect();
    let (mut told, mut at, mut any) = (Vec::with_capacity(pieces.len()), 0, false);
    while at < pieces.len() {
        // All of them are the text itself.
        let most = MOST_PIECES.min(pieces.len() - at).min(pieces.len() - 1);
        let several = (2..=most).rev().find_map(|n| Some((n, sentence(&pieces[at..at + n].join(between))?)));
        let known = several.or_else(|| (most > 0).then(|| piece(pieces[at])).flatten().map(|words| (1, words)));
        any |= known.is_some();
        let (n, words) = known.unwrap_or_else(|| (1, pieces[at].to_owned()));
        told.push(words);
        at += n;
    }
    any.then(|| told.join(with))
}
