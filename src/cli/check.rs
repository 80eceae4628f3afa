//! `shapeline check`: every problem of a plan, with its place and what to do.

use super::{Exit, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::inspect::plan_check::check_against_part;
use crate::plan;
use crate::run::RunContext;
use crate::worker::prepare_part;
use clap::Args;
use std::path::PathBuf;

/// `shapeline check PLAN.toml`.
#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// The inspection plan.
    plan: PathBuf,
}

pub(super) fn run(arguments: &CheckArguments) -> Result<Exit, Diagnostic> {
    let mut loaded = plan::load(&arguments.plan);
    if let Some(plan) = &loaded.plan {
        match prepare_part(plan, &RunContext::silent()) {
            Ok((part, _)) => {
                loaded.problems.extend(part.warnings.iter().map(|w| Diagnostic::warning(w).in_file(&plan.cad.path)));
                loaded.problems.extend(check_against_part(plan, &part));
            }
            Err(error) => loaded.problems.push(super::diagnostic_of(error)),
        }
    }
    let errors = loaded.problems.iter().filter(|p| p.severity == Severity::Error).count();
    let warnings = loaded.problems.len() - errors;
    for problem in &loaded.problems {
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
