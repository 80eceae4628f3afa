//! `shapeline prepare`: the CAD's cache, made ahead of the first part.

use super::{Exit, Manner, diagnostic_of, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::part::{CacheUse, cache_path};
use crate::plan;
use crate::run::RunContext;
use crate::worker::prepare_part;
use clap::Args;
use std::path::PathBuf;

/// `shapeline prepare PLAN.toml`.
#[derive(Debug, Args)]
pub(super) struct PrepareArguments {
    /// The inspection plan.
    plan: PathBuf,
}

pub(super) fn run(arguments: &PrepareArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let loaded = plan::load(&arguments.plan);
    for problem in loaded.problems.iter().filter(|p| p.severity == Severity::Error || !manner.quiet) {
        terminal::error(problem);
    }
    let Some(plan) = loaded.plan else { return Ok(Exit::Unusable) };
    let (part, cache) = prepare_part(&plan, &RunContext::silent()).map_err(diagnostic_of)?;
    for warning in part.warnings.iter().filter(|_| !manner.quiet) {
        terminal::note(format!("warning: {warning}"));
    }
    let path = cache_path(&plan.cad.path);
    let (triangles, poses) = (part.triangles_in_file, part.resting_poses.len());
    let how = match cache {
        CacheUse::Built => "prepared",
        CacheUse::Loaded => "up to date",
        CacheUse::NotStored(_) | CacheUse::NotWanted => {
            let why = if let CacheUse::NotStored(why) = cache { format!(": {why}") } else { String::new() };
            return Err(Diagnostic::error(format!("the CAD was prepared, but its cache could not be written{why}"))
                .in_file(&path)
                .with_help("give write access to the CAD's folder; without it every start prepares the CAD again"));
        }
    };
    terminal::line(format!("{how}: {triangles} triangles, {poses} resting poses, {}", path.display()));
    Ok(Exit::Good)
}
