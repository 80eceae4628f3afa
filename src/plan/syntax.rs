//! From bytes to a TOML document in which every key still knows its place, with all faults of the notation told.
//!
//! After a fault in a `key = value` line that line is blanked and the rest is read on, so that one slip does not hide
//! the other problems of the plan. A fault in anything else (a header, an open bracket) ends the reading: what follows it
//! would be told under the wrong table.

use super::problems::{Lines, Problems};
use toml_edit::Document;

/// Faults of one kind after which the reading gives up: each costs a pass over the file.
const MOST_REPAIRS: usize = 30;

/// A key whose value could not be read: it must not be reported as missing too.
pub(super) struct LostKey {
    /// The key as written.
    pub key: String,
    /// Line of the header above it; 0 above the first header.
    pub header_line: usize,
}

/// A document with the places of its keys.
pub(super) struct Readable {
    /// The tree, with spans.
    pub document: Document<String>,
    /// Bytes to lines.
    pub lines: Lines,
    /// Keys whose line was blanked.
    pub lost: Vec<LostKey>,
}

/// The text of a file, without its byte order mark; tells what is no UTF-8, and where.
pub(super) fn read_text<'b>(bytes: &'b [u8], problems: &Problems) -> Option<&'b str> {
    const SAVE: &str = "save the file as UTF-8 text";
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        problems.error(1, "found text in UTF-16, expected UTF-8", SAVE);
        return None;
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Some(text.strip_prefix('\u{feff}').unwrap_or(text)),
        Err(fault) => {
            let at = fault.valid_up_to();
            let byte = bytes.get(at).copied().unwrap_or(0);
            problems.error(
                Lines::new(bytes).at(at),
                format!("found the byte 0x{byte:02x}, expected text in UTF-8"),
                SAVE,
            );
            None
        }
    }
}

/// Reads TOML. `None` when so much is wrong that nothing more can be said about the plan.
pub(super) fn read_document(text: &str, problems: &Problems) -> Option<Readable> {
    let lines = Lines::new(text.as_bytes());
    let mut lost = Vec::new();
    let mut rest = text.to_owned();
    let faults = notation_faults(text, &lines);
    for (line, message) in &faults {
        let line_text = text.get(lines.range(*line, text.len())).unwrap_or_default();
        problems.error(*line, message.clone(), help_for(line_text, message));
    }
    for (line, _) in &faults {
        lost.push(LostKey { key: blank(&mut rest, &lines, *line)?, header_line: header_above(text, &lines, *line) });
    }
    if !faults.is_empty() && !notation_faults(&rest, &lines).is_empty() {
        return None;
    }
    for _ in 0..MOST_REPAIRS {
        match Document::parse(rest.clone()) {
            Ok(document) => return Some(Readable { document, lines, lost }),
            Err(fault) => {
                let line = fault.span().map_or(1, |span| lines.at(span.start));
                let (message, help, twice) = tree_fault(&fault, &rest);
                problems.error(line, message, help);
                fault.span()?;
                let key = blank(&mut rest, &lines, line)?;
                if !twice {
                    lost.push(LostKey { key, header_line: header_above(text, &lines, line) });
                }
            }
        }
    }
    None
}

/// What the grammar objects to, one a line: later faults of the same line follow from its first.
fn notation_faults(text: &str, lines: &Lines) -> Vec<(usize, String)> {
    let source = toml_parser::Source::new(text);
    let tokens = source.lex().into_vec();
    let mut errors: Vec<toml_parser::ParseError> = Vec::new();
    let mut events: Vec<toml_parser::parser::Event> = Vec::new();
    {
        let mut receiver = toml_parser::parser::RecursionGuard::new(&mut events, 80);
        toml_parser::parser::parse_document(&tokens, &mut receiver, &mut errors);
    }
    let mut faults: Vec<(usize, String)> = errors
        .iter()
        .map(|error| {
            let at = error.unexpected().or(error.context()).map_or(0, |span| span.start());
            (lines.at(at.min(text.len())), in_words(error))
        })
        .collect();
    faults.sort_by_key(|(line, _)| *line);
    faults.dedup_by_key(|(line, _)| *line);
    faults
}

/// The parser's description with what it expected.
fn in_words(error: &toml_parser::ParseError) -> String {
    let mut words = error.description().to_owned();
    let expected: Vec<String> = error
        .expected()
        .unwrap_or_default()
        .iter()
        .map(|e| match e {
            toml_parser::Expected::Literal("\n") => "a line break".to_owned(),
            toml_parser::Expected::Literal(text) => format!("`{}`", text.escape_debug()),
            toml_parser::Expected::Description(text) => (*text).to_owned(),
            _ => "something else".to_owned(),
        })
        .collect();
    if let Some((last, rest)) = expected.split_last() {
        words.push_str(", expected ");
        if !rest.is_empty() {
            words.push_str(&rest.join(", "));
            words.push_str(" or ");
        }
        words.push_str(last);
    }
    words
}

/// The next step for a fault of the notation, from the look of its line.
fn help_for(line: &str, message: &str) -> String {
    let value = line.split_once('=').map_or("", |(_, value)| value).split('#').next().unwrap_or_default().trim();
    let bytes = value.as_bytes();
    let decimal_comma = !value.starts_with(['[', '"', '{'])
        && bytes.windows(3).any(|w| w[0].is_ascii_digit() && w[1] == b',' && w[2].is_ascii_digit());
    if decimal_comma {
        return "numbers have a decimal point, such as 1.2".to_owned();
    }
    if message.contains("recursion") {
        return "brackets are nested too deeply; a plan needs three levels at most".to_owned();
    }
    if value.is_empty() && line.contains('=') {
        return "write a value after the equals sign".to_owned();
    }
    if value.starts_with(|c: char| c.is_alphabetic()) && !value.contains('"') {
        return format!("put text in quotes: \"{}\"", value.chars().take(40).collect::<String>());
    }
    "a line reads `key = value`, text stands in \"quotes\", numbers do not, and every bracket is closed".to_owned()
}

/// A fault found on building the tree: words, help, and whether it is a key given twice.
fn tree_fault(fault: &toml_edit::TomlError, text: &str) -> (String, String, bool) {
    let word = fault.span().and_then(|span| text.get(span)).unwrap_or_default();
    let word: String = word.chars().take(60).flat_map(char::escape_debug).collect();
    let message = fault.message();
    if message.starts_with("duplicate key") {
        let help =
            "keep one of them; a further feature or point begins with its own [[feature]] or [[comparison]] line";
        return (format!("found {word} a second time in the same table, expected it once"), help.to_owned(), true);
    }
    if message.contains("recursion") {
        let help = "a plan needs three levels at most".to_owned();
        return ("found names or brackets nested too deeply, expected a few levels".to_owned(), help, false);
    }
    if message.contains("overflowed") {
        return (format!("found {word}, expected a number of ordinary size"), "check the number".to_owned(), false);
    }
    (message.to_owned(), help_for("", message), false)
}

/// Replaces a `key = value` line by blanks and says its key; `None` when the line is something else.
fn blank(text: &mut String, lines: &Lines, line: usize) -> Option<String> {
    let range = lines.range(line, text.len());
    let line_text = text.get(range.clone())?;
    let (key, _) = line_text.split_once('=')?;
    let key = key.trim().trim_matches(['"', '\'']).rsplit('.').next().unwrap_or_default().to_owned();
    let is_key = !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    if !is_key {
        return None;
    }
    let kept_break = line_text.len() - line_text.trim_end_matches(['\r', '\n']).len();
    let blanks = " ".repeat(range.len() - kept_break);
    text.replace_range(range.start..range.end - kept_break, &blanks);
    Some(key)
}

/// Line of the last header at or above a line; 0 without one.
fn header_above(text: &str, lines: &Lines, line: usize) -> usize {
    let is_header = |l: &usize| text.get(lines.range(*l, text.len())).is_some_and(|t| t.trim_start().starts_with('['));
    (1..=line).rev().find(is_header).unwrap_or(0)
}
