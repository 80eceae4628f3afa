//! From bytes to a TOML document in which every key still knows its place, with all faults of the notation told.
//!
//! After a fault in a `key = value` line that line is blanked and the rest is read on, so that one slip does not hide
//! the other problems of the plan. A fault in anything else (a header, an open bracket) ends the reading: what follows it
//! would be told under the wrong table.

use super::notation;
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
    for _ in 0..MOST_REPAIRS {
        let Some(fault) = notation::first_fault(&rest, &lines) else { break };
        problems.error(fault.line, fault.message, fault.help);
        let key = blank(&mut rest, &lines, fault.line, fault.last_line)?;
        lost.push(LostKey { key, header_line: header_above(text, &lines, fault.line) });
    }
    if notation::first_fault(&rest, &lines).is_some() {
        return None;
    }
    for _ in 0..MOST_REPAIRS {
        match Document::parse(rest.clone()) {
            Ok(document) => return Some(Readable { document, lines, lost }),
            Err(fault) => {
                let line = fault.span().map_or(1, |span| lines.at(span.start));
                let (message, help, twice) = tree_fault(&fault, &rest, line_text(&rest, &lines, line));
                problems.error(line, message, help);
                fault.span()?;
                let key = blank(&mut rest, &lines, line, line)?;
                if !twice {
                    lost.push(LostKey { key, header_line: header_above(text, &lines, line) });
                }
            }
        }
    }
    None
}

fn line_text<'t>(text: &'t str, lines: &Lines, line: usize) -> &'t str {
    text.get(lines.range(line, text.len())).unwrap_or_default().trim_end_matches(['\r', '\n'])
}

/// A fault found on building the tree: words, help, and whether it is a key given twice.
fn tree_fault(fault: &toml_edit::TomlError, text: &str, line_text: &str) -> (String, String, bool) {
    let word = fault.span().and_then(|span| text.get(span)).unwrap_or_default();
    let word: String = word.chars().take(60).flat_map(char::escape_debug).collect();
    let message = fault.message();
    if message.starts_with("duplicate key") && line_text.trim_start().starts_with('[') {
        let help = "keep a table's settings under one header; several features or points each begin with [[feature]] or \
                    [[comparison]], in double brackets";
        return (format!("found the table {word} a second time, expected it once"), help.to_owned(), false);
    }
    if message.starts_with("duplicate key") {
        let help =
            "keep one of them; a further feature or point begins with its own line [[feature]] or [[comparison]]";
        return (format!("found {word} a second time in the same table, expected it once"), help.to_owned(), true);
    }
    if message.contains("recursion") {
        let help = "a plan needs three levels at most".to_owned();
        return (notation::TOO_DEEP.to_owned(), help, false);
    }
    if message.contains("overflowed") {
        return (format!("found {word}, expected a number of ordinary size"), "check the number".to_owned(), false);
    }
    (format!("found {word}: {message}"), "check this line".to_owned(), false)
}

/// Replaces the lines of a `key = value` by blanks and says its key; `None` when they are something else.
fn blank(text: &mut String, lines: &Lines, first: usize, last: usize) -> Option<String> {
    let key = notation::key_of(line_text(text, lines, first))?.to_owned();
    let range = lines.range(first, text.len()).start..lines.range(last, text.len()).end;
    let blanks: String = text.get(range.clone())?.bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }).collect();
    text.replace_range(range, &blanks);
    Some(key)
}

/// Line of the last header at or above a line; 0 without one.
fn header_above(text: &str, lines: &Lines, line: usize) -> usize {
    (1..=line).rev().find(|l| notation::is_header(line_text(text, lines, *l))).unwrap_or(0)
}
