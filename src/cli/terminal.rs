//! Where words go: results to standard output, everything else to standard error. A reader that has gone away (a closed
//! pipe) is no fault of ours and never a panic.

use crate::diagnostic::Diagnostic;
use crate::worker::StopSwitch;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fmt::Display;
use std::io::Write;
use std::time::Duration;

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
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(parts, target);
    set_template(&bar, if parts.is_some() { "{bar:20} {wide_msg}" } else { "{spinner} {wide_msg}" });
    if !bar.is_hidden() {
        // The time left and the spinner move between two stages, too.
        bar.enable_steady_tick(Duration::from_millis(250));
    }
    bar
}

/// Shows how long the rest will take: known once a part is done, and of use until the last is.
pub(super) fn show_time_left(bar: &ProgressBar) {
    if bar.length().is_some_and(|parts| bar.position() < parts) {
        set_template(bar, "{bar:20} {eta} left, {wide_msg}");
    }
}

fn set_template(bar: &ProgressBar, template: &str) {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}

/// The first Ctrl-C ends the job after what is under way, with a word; the second one at once.
pub(super) fn stop_on_ctrl_c(stop: &StopSwitch, words: &'static str) -> Result<(), Diagnostic> {
    let switch = stop.clone();
    let handler = ctrlc::set_handler(move || {
        if switch.after_part.is_cancelled() {
            switch.now.cancel();
        } else {
            switch.after_part.cancel();
            note(words);
        }
    });
    handler.map_err(|e| Diagnostic::error(format!("Ctrl-C cannot be caught: {e}")))
}
