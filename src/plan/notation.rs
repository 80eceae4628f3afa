//! Faults of the TOML notation in words for people who do not know TOML.
//!
//! The parser says where it stumbled. What is told is read off the line there; a list or inline table that was never closed is told
//! where it was opened, since the parser stumbles only over what follows it.

use super::problems::Lines;
use toml_parser::{ParseError, Source};

/// Deepest nesting of brackets that is read; the plan itself needs three levels.
const DEEPEST: u32 = 80;
/// Message for what is nested deeper.
pub(super) const TOO_DEEP: &str = "found names or brackets nested too deeply, expected a few levels";
/// An open bracket is looked for this many lines up and its end this many lines down.
const LONGEST_LIST: usize = 500;

/// The first fault of a text.
pub(super) struct Fault {
    /// Where it is told, from 1.
    pub line: usize,
    /// Last line of the faulty value.
    pub last_line: usize,
    /// What was found and expected.
    pub message: String,
    /// What to do.
    pub help: String,
}

/// The first fault; `None` when the notation is right.
pub(super) fn first_fault(text: &str, lines: &Lines) -> Option<Fault> {
    let source = Source::new(text);
    let tokens = source.lex().into_vec();
    let mut errors: Vec<ParseError> = Vec::new();
    {
        let mut events: Vec<toml_parser::parser::Event> = Vec::new();
        let mut checked = toml_parser::parser::ValidateWhitespace::new(&mut events, source);
        let mut guarded = toml_parser::parser::RecursionGuard::new(&mut checked, DEEPEST);
        toml_parser::parser::parse_document(&tokens, &mut guarded, &mut errors);
        decode(&events, source, &mut errors);
    }
    let at = |error: &ParseError| error.unexpected().or(error.context()).map_or(0, |span| span.start()).min(text.len());
    let error = errors.iter().min_by_key(|error| at(error))?;
    Some(tell(text, lines, at(error), error))
}

/// Keys and values are only decoded after the grammar is through; their faults belong to the notation too.
fn decode(events: &[toml_parser::parser::Event], source: Source<'_>, errors: &mut Vec<ParseError>) {
    use toml_parser::parser::EventKind;
    for event in events {
        let Some(raw) = source.get(event) else { continue };
        let mut text = std::borrow::Cow::Borrowed("");
        match event.kind() {
            EventKind::SimpleKey => raw.decode_key(&mut text, errors),
            EventKind::Scalar => drop(raw.decode_scalar(&mut text, errors)),
            EventKind::Comment => raw.decode_comment(errors),
            EventKind::Newline => raw.decode_newline(errors),
            _ => {}
        }
    }
}

fn tell(text: &str, lines: &Lines, at: usize, error: &ParseError) -> Fault {
    let line = lines.at(at);
    let here = line_of(text, lines, line);
    if let Some(opening) = open_list_above(text, lines, line, at) {
        let begun_anew = key_of(here).is_some() || is_header(here) || at >= text.len();
        if begun_anew {
            let last_line = if at >= text.len() { line } else { line - 1 };
            let message = "found a list or table that is not closed, expected its closing bracket".to_owned();
            let message = with_key(line_of(text, lines, opening), message);
            return Fault { line: opening, last_line, message, help: "close it with ] or }".to_owned() };
        }
        let (message, help) = in_words(here.trim(), here.trim(), error);
        let message = with_key(line_of(text, lines, opening), message);
        return Fault { line: opening, last_line: end_of_list(text, lines, opening), message, help };
    }
    let here = without_comment(here).trim();
    let value = here.split_once('=').map_or("", |(_, value)| value).trim();
    let (message, help) = in_words(here, value, error);
    Fault { line, last_line: line, message: if value.is_empty() { message } else { with_key(here, message) }, help }
}

/// The key of the line before the message, as everywhere else.
fn with_key(line: &str, message: String) -> String {
    match key_of(line).filter(|_| line.contains('=')) {
        Some(key) => format!("{key}: {message}"),
        None => message,
    }
}

/// A line up to its comment; a `#` within quotes begins none.
fn without_comment(line: &str) -> &str {
    let mut quote: Option<char> = None;
    for (at, letter) in line.char_indices() {
        match quote {
            Some(open) if letter == open => quote = None,
            Some(_) => {}
            None if letter == '"' || letter == '\'' => quote = Some(letter),
            None if letter == '#' => return &line[..at],
            None => {}
        }
    }
    line
}

/// Message and help from the look of a line.
fn in_words(line: &str, value: &str, error: &ParseError) -> (String, String) {
    let shown = |text: &str| -> String {
        let mut shown: String = text.chars().take(40).flat_map(char::escape_debug).collect();
        if text.chars().nth(40).is_some() {
            shown.push_str("...");
        }
        shown.replace("\\\"", "\"").replace("\\'", "'")
    };
    let told = |message: String, help: &str| (message, help.to_owned());
    let description = error.description();
    if description.contains("recursion") {
        return told(TOO_DEEP.to_owned(), "a plan needs three levels at most");
    }
    if line.starts_with('[') && value.is_empty() {
        let message = format!("found {}, expected a table name in brackets", shown(line));
        if !line.contains(']') {
            return told(message, "close the bracket that the line opens");
        }
        return told(message, "write [part] for a table, [[feature]] for one of several");
    }
    if !line.contains('=') && !line.is_empty() && value.is_empty() {
        let message = format!("found {}, expected key = value", shown(line));
        return told(message, "put an equals sign between key and value, or # before a comment");
    }
    if value.is_empty() {
        return told(
            format!("found {} without a value, expected one", shown(line)),
            "write a value after the equals sign",
        );
    }
    if quotes_are_open(value) {
        return told(
            format!("found {} without its closing quote, expected \"", shown(value)),
            "close the quote on the same line",
        );
    }
    if has_decimal_comma(value) {
        return told(
            format!("found {}, expected a number with a decimal point", shown(value)),
            "write a decimal point, such as 1.2",
        );
    }
    if value.starts_with('[') && value.split_whitespace().count() > value.matches(',').count() + 1 {
        return told(
            format!("found {} without commas between the values", shown(value)),
            "write it such as [10.0, 40.0, 8.0]",
        );
    }
    if value.starts_with(|c: char| c.is_alphabetic()) && !value.contains('"') {
        let help = format!("put it in quotes: \"{}\"", shown(value));
        return (format!("found {} without quotes, expected text in quotes", shown(value)), help);
    }
    if value.contains('\\') {
        let help = "in \"...\" a backslash is written twice; use / in paths, or '...' quotes";
        return told(format!("found {}: {description}", shown(value)), help);
    }
    let help = "a line reads key = value; text stands in \"quotes\", numbers do not, and every bracket is closed";
    told(format!("found {}, expected one value ({description})", shown(value)), help)
}

/// `1,2` outside a list.
fn has_decimal_comma(value: &str) -> bool {
    let mut parts = value.splitn(2, ',');
    let digits = |part: Option<&str>| part.is_some_and(|p| !p.is_empty() && p.bytes().all(|b| b.is_ascii_digit()));
    let whole = parts.next().map(|w| w.trim_start_matches(['-', '+']));
    digits(whole) && digits(parts.next())
}

fn quotes_are_open(value: &str) -> bool {
    let Some(quote) = value.chars().next().filter(|c| *c == '"' || *c == '\'') else { return false };
    value.matches(quote).count() == 1
}

/// The last part of the key with which a line begins, if it does.
pub(super) fn key_of(line: &str) -> Option<&str> {
    let line = line.trim();
    let key = match line.split_once('=') {
        Some((key, _)) => key.trim(),
        None => line.split_whitespace().next()?,
    };
    let key = key.trim_matches(['"', '\'']);
    let key = key.rsplit('.').next().unwrap_or_default().trim();
    let starts = key.starts_with(|c: char| c.is_alphabetic() || c == '_');
    (starts && key.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-')).then_some(key)
}

/// Whether a line is a table's header, well formed or not; not a list within a list.
pub(super) fn is_header(line: &str) -> bool {
    let inner = line.trim_start();
    inner.starts_with('[')
        && inner.trim_start_matches('[').trim_start().starts_with(|c: char| c.is_alphabetic() || c == '_')
}

fn line_of<'t>(text: &'t str, lines: &Lines, line: usize) -> &'t str {
    text.get(lines.range(line, text.len())).unwrap_or_default()
}

/// The line of the key whose list or inline table is still open where a later line stumbles.
fn open_list_above(text: &str, lines: &Lines, line: usize, at: usize) -> Option<usize> {
    let lowest = line.saturating_sub(LONGEST_LIST).max(1);
    let top = if at >= text.len() { line } else { line.checked_sub(1)? };
    let opening = (lowest..=top).rev().find(|l| {
        let here = line_of(text, lines, *l);
        is_header(here) || (key_of(here).is_some() && here.contains('='))
    })?;
    if is_header(line_of(text, lines, opening)) {
        return None;
    }
    let end = lines.range(line, text.len()).start.max(if at >= text.len() { at } else { 0 });
    let between = text.get(lines.range(opening, text.len()).start..end)?;
    (depth(between) > 0).then_some(opening)
}

/// The line on which a list ends that begins on a line, or the last before something new begins.
fn end_of_list(text: &str, lines: &Lines, opening: usize) -> usize {
    let start = lines.range(opening, text.len()).start;
    let mut last = opening;
    for line in opening..opening + LONGEST_LIST {
        let range = lines.range(line, text.len());
        let here = text.get(range.clone()).unwrap_or_default();
        if range.is_empty() || (line > opening && (is_header(here) || (key_of(here).is_some() && here.contains('=')))) {
            break;
        }
        last = line;
        if text.get(start..range.end).is_none_or(|t| depth(t) <= 0) {
            break;
        }
    }
    last
}

/// Brackets opened less brackets closed, outside of text and comments.
fn depth(text: &str) -> i32 {
    let mut depth = 0;
    let mut quote: Option<char> = None;
    let mut comment = false;
    let mut escaped = false;
    for letter in text.chars() {
        if letter == '\n' {
            (quote, comment, escaped) = (None, false, false);
            continue;
        }
        match quote {
            _ if comment => {}
            Some('"') if escaped => escaped = false,
            Some('"') if letter == '\\' => escaped = true,
            Some(open) if letter == open => quote = None,
            Some(_) => {}
            None => match letter {
                '"' | '\'' => quote = Some(letter),
                '#' => comment = true,
                '[' | '{' => depth += 1,
                ']' | '}' => depth -= 1,
                _ => {}
            },
        }
    }
    depth
}
