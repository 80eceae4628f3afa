//! `shapeline check`: every problem of a plan, with its place and what to do.

use super::{Exit, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan;
use crate::report;
use crate::run::{Cancelled, RunContext};
use crate::worker::{check_plan, foretell_plan};
use clap::Args;
use std::path::PathBuf;

/// `shapeline check PLAN.toml`.
#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// The inspection plan.
    plan: PathBuf,
    /// Print the uncertainty to expect at every comparison point, and what other datums would cost.
    #[arg(long)]
    expected: bool,
}

pub(super) fn run(arguments: &CheckArguments) -> Result<Exit, Diagnostic> {
    let stopped = |cancelled: Cancelled| Diagnostic::error(cancelled.to_string());
    let problems = check_plan(&arguments.plan, &RunContext::silent()).map_err(stopped)?;
    let errors = problems.iter().filter(|p| p.severity == Severity::Error).count();
    let warnings = problems.len() - errors;
    for problem in &problems {
        terminal::error(problem);
    }
    if let Some(rig) = plan::load(&arguments.plan).draft.rig {
        terminal::line(format!("rig: {}", rig.figures()));
    }
    if arguments.expected {
        match foretell_plan(&arguments.plan, &RunContext::silent()).map_err(stopped)? {
            Some(told) => terminal::line(format!("{}\n", report::foretold(&told))),
            None => terminal::line(
                "what to expect cannot be told: no comparison points, or no alignment that holds the part by itself",
            ),
        }
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
