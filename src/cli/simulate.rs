//! `shapeline simulate`: synthetic scans of a plan's part with their truth beside them.

use super::{Exit, Manner, diagnostic_of, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan;
use crate::run::RunContext;
use crate::simulate::files::simulate_series;
use crate::worker::prepare_part;
use clap::Args;
use std::path::PathBuf;

/// `shapeline simulate PLAN.toml --out DIR --count N --seed S`.
#[derive(Debug, Args)]
pub(super) struct SimulateArguments {
    /// The inspection plan.
    plan: PathBuf,
    /// Folder for the scans.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How many scans.
    #[arg(long, value_name = "N", default_value_t = 1)]
    count: u64,
    /// Seed: the same seed gives the same scans.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

pub(super) fn run(arguments: &SimulateArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let loaded = plan::load(&arguments.plan);
    for problem in loaded.problems.iter().filter(|p| p.severity == Severity::Error || !manner.quiet) {
        terminal::error(problem);
    }
    let Some(plan) = loaded.plan else { return Ok(Exit::Unusable) };
    let run = RunContext::silent();
    let (part, _) = prepare_part(&plan, &run).map_err(diagnostic_of)?;
    simulate_series(&plan, &part, &arguments.out, arguments.count, arguments.seed, &run, |path, scan| {
        terminal::line(format!("{}\t{} points\tseen from the {}", path.display(), scan.cloud.len(), scan.truth.side));
    })
    .map_err(diagnostic_of)?;
    Ok(Exit::Good)
}
