//! `shapeline merge`: settings to files.

use super::away::{Away, usual_limit};
use super::{MergeEvent, Place, compare, merge_beside};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::merge::{self, MergePlan, ViewsOf};
use crate::report::{MergeExtras, atomic, merge_json, merge_pages, merge_ply};
use crate::run::{RunContext, Stage};
use crate::stitch::{MergeResult, StitchError};
use std::path::{Path, PathBuf};

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
    let cloud = request.out.clone().unwrap_or_else(|| plan.output.file.path.clone());
    let report = plan.output.report.as_ref().map_or_else(|| cloud.with_extension("json"), |file| file.path.clone());
    let pdf = plan.output.report_pdf.as_ref().map(|file| file.path.clone());
    check_outputs(&cloud, &report)?;
    if let Some(pdf) = &pdf {
        check_outputs(&cloud, pdf)?;
    }
    let limit = request.memory_limit.or_else(usual_limit).unwrap_or(u64::MAX);
    let mut away = Away::new(&cloud, limit);
    let before = away.folder().is_dir();
    let ended = make(plan, [cloud, report], pdf, &mut away, run, tell);
    if let Err(StitchError::Cancelled(cancelled)) = ended {
        if away.is_begun() {
            let message = format!("stopped with {} views ready, which the same command goes on with", away.len());
            problems.push(note(message, &away, "run it again, or delete the folder"));
        }
        return Err(Some(cancelled.into()));
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
    [cloud, report]: [PathBuf; 2],
    pdf: Option<PathBuf>,
    away: &mut Away,
    run: &RunContext,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<MergeJob, StitchError> {
    let result = merge_beside(&plan, &Place::default(), Some(away), run, tell)?;
    let features = compare::features(&plan, &result, away, run)?;
    let extras = MergeExtras { features, wear: compare::wear(&plan, &result, run)? };
    let job = MergeJob { plan, result, cloud, report, pdf, extras };
    write(&job, run)?;
    Ok(job)
}

/// Before anything is read: a merge that cannot be kept is no use.
fn check_outputs(cloud: &Path, report: &Path) -> Result<(), StitchError> {
    if cloud == report {
        let message = "the cloud and its report would be one file, expected two";
        return Err(Diagnostic::error(message)
            .in_file(cloud)
            .with_help("give the cloud another name, such as merged.ply")
            .into());
    }
    for path in [cloud, report] {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let fault = match atomic::try_folder(folder) {
            Ok(()) if path.is_dir() => "a folder has this name".to_owned(),
            Ok(()) => continue,
            Err(why) if folder.is_dir() => why,
            Err(_) => "the folder does not exist".to_owned(),
        };
        let help = "make the folder, or give another file with --out";
        return Err(Diagnostic::error(format!("cannot write, {fault}")).in_file(path).with_help(help).into());
    }
    Ok(())
}

/// The report first: a cloud that lies there has its report.
fn write(job: &MergeJob, run: &RunContext) -> Result<(), StitchError> {
    let MergeJob { plan, result, cloud, report, pdf, extras } = job;
    run.enter(Stage::Report)?;
    let text = merge_json(plan, result, extras);
    if let Some(pdf) = pdf {
        let pages = merge_pages(plan, result, extras, compare::eye(result));
        run.check()?;
        atomic::write(pdf, &pages)?;
    }
    let wear = extras.wear.as_ref();
    let written = atomic::write_with(cloud, |out| merge_ply(out, &result.merged, wear, plan.unit, run));
    // A job that was stopped has no fault to tell.
    run.check()?;
    written?;
    atomic::write(report, text.as_bytes())?;
    Ok(())
}
