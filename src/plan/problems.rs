//! Collects what is wrong with one file, so that all of it is told together.

use crate::diagnostic::{Diagnostic, Severity};
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};

/// More problems than this in one file are counted, not listed: nobody reads them, and a broken file of 16 MB must not
/// fill the memory with messages.
const LISTED: usize = 500;

/// The problems of one file.
pub(super) struct Problems {
    file: PathBuf,
    list: RefCell<Vec<Diagnostic>>,
    errors: Cell<usize>,
    unlisted: Cell<usize>,
}

impl Problems {
    /// None yet.
    pub fn new(file: &Path) -> Self {
        Self { file: file.to_path_buf(), list: RefCell::default(), errors: Cell::default(), unlisted: Cell::default() }
    }

    /// The file concerned.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Whether the file can not be used.
    pub fn any_error(&self) -> bool {
        self.errors.get() > 0
    }

    /// An error on a line.
    pub fn error(&self, line: usize, message: impl Into<String>, help: impl Into<String>) {
        self.add(Diagnostic::error(message).at_line(line).with_help(help));
    }

    /// A warning on a line.
    pub fn warning(&self, line: usize, message: impl Into<String>, help: impl Into<String>) {
        self.add(Diagnostic::warning(message).at_line(line).with_help(help));
    }

    /// Any message; the file is attached here.
    pub fn add(&self, diagnostic: Diagnostic) {
        if diagnostic.severity == Severity::Error {
            self.errors.set(self.errors.get() + 1);
        }
        if self.list.borrow().len() < LISTED {
            self.list.borrow_mut().push(diagnostic.in_file(&self.file));
        } else {
            self.unlisted.set(self.unlisted.get() + 1);
        }
    }

    /// All of them by line; in the order of finding where the line is the same.
    pub fn into_sorted(self) -> Vec<Diagnostic> {
        let mut list = self.list.into_inner();
        list.sort_by_key(|d| d.line.unwrap_or(0));
        let unlisted = self.unlisted.get();
        if unlisted > 0 {
            list.push(Diagnostic::error(format!("{unlisted} more problems are not listed")).in_file(&self.file));
        }
        list
    }
}

/// Turns byte offsets into lines.
pub(super) struct Lines {
    starts: Vec<usize>,
}

impl Lines {
    /// Of a text.
    pub fn new(text: &[u8]) -> Self {
        let after_breaks = text.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(k, _)| k + 1);
        Self { starts: std::iter::once(0).chain(after_breaks).collect() }
    }

    /// The line, from 1, in which a byte stands.
    pub fn at(&self, offset: usize) -> usize {
        self.starts.partition_point(|start| *start <= offset)
    }

    /// The bytes of a line, from 1, with its line break.
    pub fn range(&self, line: usize, text_length: usize) -> std::ops::Range<usize> {
        let start = self.starts.get(line.saturating_sub(1)).copied().unwrap_or(text_length);
        let end = self.starts.get(line).copied().unwrap_or(text_length);
        start..end.max(start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_count_from_one_and_the_break_belongs_to_its_line() {
        let text = b"ab\n\ncd";
        let lines = Lines::new(text);
        let found: Vec<usize> = (0..6).map(|k| lines.at(k)).collect();
        assert_eq!(found, [1, 1, 1, 2, 3, 3]);
        assert_eq!(lines.range(1, text.len()), 0..3);
        assert_eq!(lines.range(3, text.len()), 4..6);
        assert!(lines.range(9, text.len()).is_empty());
    }

    #[test]
    fn a_flood_is_counted_not_listed() {
        let problems = Problems::new(Path::new("p"));
        for line in (1..=LISTED + 7).rev() {
            problems.error(line, "odd", "mend it");
        }
        let list = problems.into_sorted();
        assert_eq!(list.len(), LISTED + 1);
        assert!(list[..LISTED].is_sorted_by_key(|d| d.line));
        assert_eq!(list[LISTED].message, "7 more problems are not listed");
    }
}
