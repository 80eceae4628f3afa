//! How a file's text is written down: byte order mark and line ends, which an edit must not change.

use crate::diagnostic::Diagnostic;
use crate::plan::load::{LARGEST_PLAN, too_large};
use crate::plan::problems::Problems;
use crate::plan::syntax::read_text;
use std::path::Path;

/// The marks of a text file. The default: none, lines ending with `\n`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Layout {
    /// Whether it begins with a byte order mark.
    pub byte_order_mark: bool,
    /// Whether lines end with `\r\n`: where most of them do.
    pub carriage_returns: bool,
}

impl Layout {
    /// The layout of some bytes, and their text with `\n` at its lines' ends.
    pub(in crate::plan) fn read(bytes: &[u8], path: &Path) -> Result<(Self, String), Box<Diagnostic>> {
        if bytes.len() as u64 > LARGEST_PLAN {
            return Err(Box::new(too_large(bytes.len() as u64, LARGEST_PLAN, "a plan").in_file(path)));
        }
        let problems = Problems::new(path);
        let Some(text) = read_text(bytes, &problems) else {
            let told = problems.into_sorted().into_iter().next();
            let told = told.unwrap_or_else(|| Diagnostic::error("found no text, expected UTF-8").in_file(path));
            return Err(Box::new(told));
        };
        let all = text.matches('\n').count();
        let carriage_returns = 2 * text.matches("\r\n").count() > all;
        let layout = Self { byte_order_mark: text.len() < bytes.len(), carriage_returns };
        Ok((layout, text.replace("\r\n", "\n")))
    }

    pub(in crate::plan) fn write(self, text: &str) -> Vec<u8> {
        let text = if self.carriage_returns { text.replace('\n', "\r\n") } else { text.to_owned() };
        let mark: &[u8] = if self.byte_order_mark { "\u{feff}".as_bytes() } else { &[] };
        [mark, text.as_bytes()].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_and_line_ends_come_back() {
        for bytes in ["a = 1\n# b\n", "\u{feff}a = 1\r\n# b\r\n", "a = 1", ""] {
            let (layout, text) = Layout::read(bytes.as_bytes(), Path::new("p.toml")).unwrap();
            assert!(!text.contains(['\r', '\u{feff}']));
            assert_eq!(layout.write(&text), bytes.as_bytes());
        }
        let latin = Layout::read(b"# \xe5", Path::new("p.toml")).unwrap_err();
        assert!(latin.message.contains("expected text in UTF-8") && latin.help.is_some(), "{latin}");
    }
}
