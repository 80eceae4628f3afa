//! What is wrong with a file, and whether it ends in the middle.

use crate::diagnostic::{Diagnostic, ReadError};

/// A message, with the mark of a file that may still be being written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    diagnostic: Diagnostic,
    is_cut_off: bool,
}

impl Fault {
    /// The file ends in the middle.
    pub fn cut_off(diagnostic: Diagnostic) -> Self {
        Self { diagnostic, is_cut_off: true }
    }

    /// Marks the fault as an end in the middle if it is one.
    #[must_use]
    pub fn cut_off_if(self, is_cut_off: bool) -> Self {
        Self { is_cut_off: self.is_cut_off || is_cut_off, ..self }
    }

    /// Attaches the line, from 1.
    #[must_use]
    pub fn at_line(self, line: usize) -> Self {
        Self { diagnostic: self.diagnostic.at_line(line), ..self }
    }

    /// Puts the record before the message, from 0 as indices in such files count.
    #[must_use]
    pub fn at_record(mut self, element: &str, record: u64) -> Self {
        let element = super::field::excerpt(element.as_bytes());
        self.diagnostic.message = format!("{element} {record} (from 0): {}", self.diagnostic.message);
        self
    }
}

impl From<Diagnostic> for Fault {
    fn from(diagnostic: Diagnostic) -> Self {
        Self { diagnostic, is_cut_off: false }
    }
}

impl From<Fault> for ReadError {
    fn from(fault: Fault) -> Self {
        let diagnostic = Box::new(fault.diagnostic);
        if fault.is_cut_off { ReadError::CutOff(diagnostic) } else { ReadError::Bad(diagnostic) }
    }
}
