//! Messages for people: what was found, where, what was expected, and what to do next.

use crate::run::Cancelled;
use std::fmt;
use std::path::{Path, PathBuf};

/// How much a message weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The work can go on, but somebody should look.
    Warning,
    /// The work cannot be done.
    Error,
}

/// One message with its place and, where we know one, the next step.
///
/// Printed as `error: FILE:LINE: message` and a second line `help: ...`. The words start in lower case and end without
/// a full stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// The file concerned.
    pub file: Option<PathBuf>,
    /// Line in that file, from 1.
    pub line: Option<usize>,
    /// The key of a plan whose value is meant, so that a form can show the message at its field.
    pub key: Option<Box<str>>,
    /// What was found and what was expected.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error without a place yet.
    pub fn error(message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, file: None, line: None, key: None, message: message.into(), help: None }
    }

    /// A warning without a place yet.
    pub fn warning(message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(message) }
    }

    /// Attaches the file, unless one is known already: the innermost place is the most telling one.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        self.file.get_or_insert_with(|| file.to_path_buf());
        self
    }

    /// Attaches the line, from 1.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Attaches the key.
    #[must_use]
    pub fn at_key(mut self, key: impl Into<Box<str>>) -> Self {
        self.key = Some(key.into());
        self
    }

    /// Attaches the next step.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Its file and line, as people write them.
    pub fn place(&self) -> Option<String> {
        let file = self.file.as_ref()?.display().to_string();
        Some(self.line.map_or(file.clone(), |line| format!("{file}:{line}")))
    }

    /// What was found and what to do in a row, without the place: `message; help`.
    pub fn in_a_row(&self) -> String {
        let help = self.help.as_ref().map(|help| format!("; {help}")).unwrap_or_default();
        format!("{}{help}", self.message)
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.severity {
            Severity::Error => write!(f, "error: ")?,
            Severity::Warning => write!(f, "warning: ")?,
        }
        if let Some(file) = &self.file {
            write!(f, "{}:", file.display())?;
            if let Some(line) = self.line {
                write!(f, "{line}:")?;
            }
            write!(f, " ")?;
        }
        write!(f, "{}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "\nhelp: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

/// What the system says of a file, in words that people on the shop floor know.
pub fn os_words(error: &std::io::Error) -> String {
    use std::io::ErrorKind as Kind;
    let words = match error.kind() {
        Kind::NotFound => "there is no such file or folder",
        Kind::PermissionDenied => "this user may not do that",
        Kind::ReadOnlyFilesystem => "the disk is read-only",
        Kind::StorageFull | Kind::QuotaExceeded => "the disk is full",
        Kind::NotADirectory => "a file has this name",
        Kind::IsADirectory => "a folder has this name",
        Kind::AlreadyExists => "something has this name already",
        _ => return error.to_string(),
    };
    words.to_owned()
}

/// Why a scan was not measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct Refusal {
    /// What was found.
    pub reason: String,
    /// What to do.
    pub help: String,
    /// The two poses between which nothing could be decided, when that is the reason.
    pub rivals: Option<Rivals>,
}

/// Two poses of a part that fit a scan almost alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rivals {
    /// Cost of the second over the cost of the first.
    pub margin: f64,
    /// What it must be at least.
    pub margin_limit: f64,
    /// By how much they differ: a turn in rad and the distance of the part's middle in mm; `None` where nobody knows the second.
    pub apart: Option<(f64, f64)>,
}

impl Refusal {
    /// A refusal with its reason and its help.
    pub fn new(reason: impl Into<String>, help: impl Into<String>) -> Self {
        Self { reason: reason.into(), help: help.into(), rivals: None }
    }
}

/// Why a computation came back without its result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Stop {
    /// The scan cannot be measured; that is a result, with a reason.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// Somebody cancelled the job.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Why a file could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// The file is at fault.
    #[error("{0}")]
    Bad(Box<Diagnostic>),
    /// The file ends in the middle: it may still be being written.
    #[error("{0}")]
    CutOff(Box<Diagnostic>),
    /// Somebody cancelled the job.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<Diagnostic> for ReadError {
    fn from(diagnostic: Diagnostic) -> Self {
        ReadError::Bad(Box::new(diagnostic))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prints_place_message_and_help() {
        let d = Diagnostic::error("direction has length 0, expected a unit vector")
            .in_file(Path::new("plan.toml"))
            .at_line(41)
            .with_help("give a direction such as [0, 0, 1]");
        assert_eq!(
            d.to_string(),
            "error: plan.toml:41: direction has length 0, expected a unit vector\nhelp: give a direction such as [0, 0, 1]"
        );
    }

    #[test]
    fn the_innermost_file_wins() {
        let d = Diagnostic::warning("odd").in_file(Path::new("inner")).in_file(Path::new("outer"));
        assert_eq!(d.file.as_deref(), Some(Path::new("inner")));
    }
}
