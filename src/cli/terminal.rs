//! Where words go: results to standard output, everything else to standard error. A reader that has gone away (a closed
//! pipe) is no fault of ours and never a panic.

use crate::diagnostic::Diagnostic;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fmt::Display;
use std::io::Write;

/// One line of result.
pub(super) fn line(text: impl Display) {
    let _ = writeln!(std::io::stdout().lock(), "{text}");
}

/// One line beside the result.
pub(super) fn note(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// A message with its place and help.
pub(super) fn error(diagnostic: &Diagnostic) {
    note(diagnostic);
}

/// A bar on standard error; hidden where that is no terminal.
pub(super) fn bar(quiet: bool, parts: Option<u64>) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(parts, ProgressDrawTarget::stderr());
    if quiet {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let template = match parts {
        Some(_) => "{bar:30} {msg}, {eta} left",
        None => "{spinner} {msg}",
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}
