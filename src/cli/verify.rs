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
    if verified.problems.is_empty() {
        if !manner.quiet {
            terminal::line(format!("{} files as written", verified.intact));
        }
        return Ok(Exit::Good);
    }
    terminal::line(format!("{} problems, {} files as written", verified.problems.len(), verified.intact));
    Ok(Exit::NotGood)
}
