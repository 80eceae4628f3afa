//! `shapeline verify`: a results folder against its manifest.

use super::{Exit, Manner, terminal};
use crate::diagnostic::Diagnostic;
use crate::report::manifest;
use clap::Args;
use std::path::PathBuf;

/// `shapeline verify DIR`.
#[derive(Debug, Args)]
pub(super) struct VerifyArguments {
    /// A results folder.
    folder: PathBuf,
}

pub(super) fn run(arguments: &VerifyArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let verified = manifest::verify(&arguments.folder)?;
    for problem in &verified.problems {
        terminal::error(problem);
    }
    if !verified.interrupted.is_empty() && !manner.quiet {
        let files = verified.interrupted.join(", ");
        let words = format!("a run is writing these files now, or was ended while it did: {files}");
        let warning = Diagnostic::warning(words).in_file(&arguments.folder);
        terminal::error(&warning.with_help("the files are whole; the next run into this folder completes them"));
    }
    if verified.problems.is_empty() {
        if !manner.quiet {
            terminal::line(format!("{} files as written", verified.intact));
        }
        return Ok(Exit::Good);
    }
    let (n, s) = (verified.problems.len(), if verified.problems.len() == 1 { "" } else { "s" });
    terminal::line(format!("{n} problem{s}, {} files as written", verified.intact));
    Ok(Exit::NotGood)
}
