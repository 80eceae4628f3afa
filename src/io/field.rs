//! Numbers as they stand in text files.

use crate::diagnostic::Diagnostic;

/// Reads a decimal number. Words for empty pixels (`nan`, `inf`, and `1.#QNAN`, `-1.#IND`, `1.#INF` of older programs)
/// give a value that is not finite; `None` when it is no number at all.
pub fn number(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?;
    text.parse().ok().or_else(|| not_a_number_of_older_programs(text))
}

fn not_a_number_of_older_programs(text: &str) -> Option<f64> {
    let (_, tail) = text.split_once(".#")?;
    let tail = tail.to_ascii_uppercase();
    ["INF", "IND", "QNAN", "SNAN", "NAN"].iter().any(|word| tail.starts_with(word)).then_some(f64::NAN)
}

/// Reads a whole number.
pub fn integer(field: &[u8]) -> Option<i64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// The words of a line, parted by blanks and tabs.
pub fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(|byte| matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)).filter(|word| !word.is_empty())
}

/// A piece of the file for a message: at most 40 characters, nothing unprintable.
pub fn excerpt(field: &[u8]) -> String {
    let text = String::from_utf8_lossy(&field[..field.len().min(160)]);
    let mut shown: String = text.chars().take(40).map(|c| if is_plain(c) { c } else { '?' }).collect();
    if text.chars().count() > 40 || field.len() > 160 {
        shown.push_str("...");
    }
    shown
}

/// Neither a control character nor one that turns the direction of writing.
fn is_plain(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The message for a field that should have been a number.
pub fn not_a_number(field: &[u8], what: &str) -> Diagnostic {
    let message = format!("\"{}\" found, expected {what}", excerpt(field));
    let help = if has_decimal_comma(field) {
        "is this a decimal comma? write numbers with a decimal point"
    } else {
        "the file is damaged or of another kind; export it again"
    };
    Diagnostic::error(message).with_help(help)
}

/// Whether a field looks like `12,5`: digits, one comma, digits.
pub fn has_decimal_comma(field: &[u8]) -> bool {
    let mut parts = field.split(|&byte| byte == b',');
    let (Some(left), Some(right), None) = (parts.next(), parts.next(), parts.next()) else { return false };
    let left = left.strip_prefix(b"-").or(left.strip_prefix(b"+")).unwrap_or(left);
    let begins = |part: &[u8]| part.first().is_some_and(u8::is_ascii_digit);
    begins(left) && begins(right) && left.iter().all(u8::is_ascii_digit)
}

/// How many digits stand behind the decimal point of a plain decimal number; `None` for whole numbers, powers of ten
/// and words.
pub fn decimals(field: &[u8]) -> Option<usize> {
    let point = field.iter().position(|&byte| byte == b'.')?;
    let tail = &field[point + 1..];
    tail.iter().all(u8::is_ascii_digit).then_some(tail.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_many_programs() {
        assert_eq!(number(b"-1.5e3"), Some(-1500.0));
        assert_eq!(number(b"+.25"), Some(0.25));
        for word in ["nan", "NaN", "-inf", "1.#QNAN", "-1.#IND00", "1.#INF"] {
            assert!(!number(word.as_bytes()).unwrap().is_finite(), "{word}");
        }
        for word in ["", "1,5", "abc", "1.5x", "0x10", "\u{ff11}"] {
            assert!(number(word.as_bytes()).is_none(), "{word}");
        }
    }

    #[test]
    fn decimal_comma_is_told_from_a_list() {
        for yes in ["1,5", "-12,25", "0,1e-3"] {
            assert!(has_decimal_comma(yes.as_bytes()), "{yes}");
        }
        for no in ["1,", ",5", "1,2,3", "a,b", "1.5"] {
            assert!(!has_decimal_comma(no.as_bytes()), "{no}");
        }
    }

    #[test]
    fn excerpts_are_short_and_printable() {
        let shown = excerpt(&[b'\x1b', b'[', 0xff, b'a']);
        assert!(shown.chars().all(|c| !c.is_control()), "{shown}");
        assert!(excerpt(&[b'x'; 100_000]).len() < 50);
    }

    #[test]
    fn decimals_count_only_plain_decimals() {
        assert_eq!(decimals(b"-12.250"), Some(3));
        assert_eq!(decimals(b"5."), Some(0));
        assert_eq!(decimals(b"5"), None);
        assert_eq!(decimals(b"5.1e2"), None);
    }
}
