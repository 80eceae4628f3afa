//! `shapeline merge`: settings to files.

use super::away::{Away, usual_limit};
use super::files::{Listed, list_views};
use super::outputs::{Outputs, check_apart, inputs, put_all};
use super::{MergeEvent, Place, compare, merge_beside};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::merge::{self, MergePlan, ViewsOf};
use crate::report::atomic::Staged;
use crate::report::{MergeExtras, merge_json, merge_pages, merge_ply};
use crate::run::{RunContext, Stage};
use crate::stitch::{MergeResult, StitchError};
use std::path::PathBuf;

/// What to merge.
#[derive(Debug, Clone, Default)]
pub struct MergeRequest {
    /// `MERGE.toml`.
    pub plan_path: PathBuf,
    /// The merged cloud, instead of the file that the settings name.
    pub out: Option<PathBuf>,
    /// Bytes that the points may take, else three quarters of what the system has free; beyond, views are put away on the disk.
    pub memory_limit: Option<u64>,
    /// The settings as somebody edited them, instead of those in the file; their paths start at its folder all the same.
    pub settings: Option<Vec<u8>>,
}

/// A merge that is done and written.
#[derive(Debug)]
pub struct MergeJob {
    /// Its settings.
    pub plan: MergePlan,
    /// What came out.
    pub result: MergeResult,
    /// The merged cloud.
    pub cloud: PathBuf,
    /// The report.
    pub report: PathBuf,
    /// The report on paper, where it is wanted.
    pub pdf: Option<PathBuf>,
    /// Features before and after, and the wear since an earlier cloud.
    pub extras: MergeExtras,
}

/// Reads, merges and writes. `problems` gets those of the settings, errors and warnings.
///
/// # Errors
/// `None` when the settings have errors, which `problems` got; else why nothing was merged or written.
pub fn merge_files(
    request: &MergeRequest,
    run: &RunContext,
    problems: &mut Vec<Diagnostic>,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<MergeJob, Option<StitchError>> {
    let loaded = match &request.settings {
        Some(bytes) => merge::check(bytes, &request.plan_path, ViewsOf::OwnFolder),
        None => merge::load(&request.plan_path, ViewsOf::OwnFolder),
    };
    let any_error = loaded.problems.iter().any(|p| p.severity == Severity::Error);
    problems.extend(loaded.problems);
    let Some(plan) = loaded.plan.filter(|_| !any_error) else { return Err(None) };
    let outputs = Outputs::new(&plan, request.out.as_deref());
    outputs.check().map_err(StitchError::from)?;
    let listed = list_views(&plan, &plan.views.folder.path, &outputs.paths(), 2).map_err(StitchError::from)?;
    check_apart(&outputs.called(), &inputs(&plan, &listed.views)).map_err(StitchError::from)?;
    let limit = request.memory_limit.or_else(usual_limit).unwrap_or(u64::MAX);
    let mut away = Away::new(&outputs.cloud, limit);
    let before = away.folder().is_dir();
    let ended = make(plan, outputs, listed, &mut away, run, tell);
    if let Err(error) = ended {
        let was_stopped = matches!(error, StitchError::Cancelled(_));
        // They took long to make, and whatever went wrong may be mended.
        if was_stopped && away.is_begun() || away.is_complete() {
            let message = if was_stopped {
                format!("stopped with {} views ready, which the same command goes on with", away.len())
            } else {
                format!("{} views are ready, which the same command goes on with", away.len())
            };
            problems.push(note(message, &away, "run it again, or delete the folder"));
        } else if !was_stopped {
            away.remove();
        }
        return Err(Some(error));
    }
    if before && away.found > 0 {
        problems.push(note(format!("went on with {} views that a run before had made ready", away.found), &away, ""));
    } else if before {
        let message = "what a run before had left is of other settings or views: begun again".to_owned();
        problems.push(note(message, &away, ""));
    }
    away.remove();
    Ok(ended?)
}

fn note(message: String, away: &Away, help: &str) -> Diagnostic {
    let note = Diagnostic { severity: Severity::Warning, ..Diagnostic::error(message).in_file(away.folder()) };
    if help.is_empty() { note } else { note.with_help(help) }
}

/// From the views to the files.
fn make(
    plan: MergePlan,
    outputs: Outputs,
    listed: Listed,
    away: &mut Away,
    run: &RunContext,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<MergeJob, StitchError> {
    compare::check_earlier(&plan, run)?;
    let mut result = merge_beside(&plan, &Place::default(), listed, Some(away), run, tell)?;
    let (features, misfits) = compare::features(&plan, &result, away, run)?;
    result.merged.warnings.extend(misfits);
    let (wear, not_compared) = match compare::wear(&plan, &result, run)? {
        Some(Ok(wear)) => (Some(wear), None),
        Some(Err(why)) => (None, Some(why)),
        None => (None, None),
    };
    result.merged.warnings.extend(not_compared.as_ref().map(|why| format!("no wear is told: {why}")));
    let Outputs { cloud, report, pdf } = outputs;
    let extras = MergeExtras { features, wear, not_compared };
    let job = MergeJob { plan, result, cloud, report, pdf, extras };
    write(&job, run)?;
    Ok(job)
}

/// What lies there belongs together: every file is on the disk before the first one takes its place.
fn write(job: &MergeJob, run: &RunContext) -> Result<(), StitchError> {
    let MergeJob { plan, result, cloud, report, pdf, extras } = job;
    run.enter(Stage::Report)?;
    let text = merge_json(plan, result, extras);
    let text = Staged::try_new(report, text.as_bytes())?;
    let pages = match pdf {
        Some(path) => Some(Staged::try_new(path, &merge_pages(plan, result, extras, compare::eye(result)))?),
        None => None,
    };
    run.check()?;
    let wear = extras.wear.as_ref();
    let points = Staged::try_with(cloud, |out| merge_ply(out, &result.merged, wear, plan.unit, run));
    // A job that was stopped has no fault to tell.
    run.check()?;
    // The cloud last: one that lies there has its report.
    put_all([text].into_iter().chain(pages).chain([points?]))
}
