//! `shapeline check`: every problem of a plan, with its place and what to do.

use super::{Exit, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::run::RunContext;
use crate::worker::check_plan;
use clap::Args;
use std::path::PathBuf;

/// `shapeline check PLAN.toml`.
#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// The inspection plan.
    plan: PathBuf,
}

pub(super) fn run(arguments: &CheckArguments) -> Result<Exit, Diagnostic> {
    let problems = check_plan(&arguments.plan, &RunContext::silent())
        .map_err(|cancelled| Diagnostic::error(cancelled.to_string()))?;
    let errors = problems.iter().filter(|p| p.severity == Severity::Error).count();
    let warnings = problems.len() - errors;
    for problem in &problems {
        terminal::error(problem);
    }
    Ok(match (errors, warnings) {
        (0, 0) => {
            terminal::line("no problems");
            Exit::Good
        }
        (0, n) => {
            terminal::line(format!("{n} warning{}", plural(n)));
            Exit::NotGood
        }
        (e, w) => {
            terminal::line(format!("{e} error{}, {w} warning{}", plural(e), plural(w)));
            Exit::Unusable
        }
    })
}

fn plural(n: usize) -> &'static str {
    if n == 1 { "" } else { "s" }
}
