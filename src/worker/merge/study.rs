//! `shapeline mask-study`: settings and views to a table and plots of what each mask is worth.

use super::calibrated::{Calibrated, check_units};
use super::files::{Listed, list_views, name_of, read_view};
use super::outputs::{Called, Outputs, check_apart, check_place, inputs, put_all};
use super::views::same_file;
use super::{MergeEvent, in_one_line};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::merge::{self, Mask, MergePlan, Metric, ViewsOf};
use crate::report::atomic::Staged;
use crate::report::mask_study::csv;
use crate::report::pdf::mask_study::mask_study_pdf;
use crate::run::{RunContext, Stage};
use crate::stitch::columns::{Asked, complete};
use crate::stitch::mask_study::{MaskStudy, StudyError, mask_study};
use crate::stitch::{Measured, StitchError, Tools, View};
use std::path::{Path, PathBuf};

/// A study that is done and written.
#[derive(Debug)]
pub struct MaskStudyJob {
    /// The settings.
    pub plan: MergePlan,
    /// What came out.
    pub study: MaskStudy,
    /// Views that could not be read.
    pub unusable: usize,
    /// Table and plots.
    pub files: [PathBuf; 2],
}

/// Studies masks for the views and features of a `MERGE.toml`; `out` names the files, without their endings, where they are not to lie beside the
/// merged cloud.
///
/// # Errors
/// `None` when the settings have errors, which `problems` got; else why nothing was studied or written.
pub fn study_masks(
    plan_path: &Path,
    out: Option<&Path>,
    run: &RunContext,
    problems: &mut Vec<Diagnostic>,
    tell: &(dyn Fn(MergeEvent) + Sync),
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<MaskStudyJob, Option<StitchError>> {
    let loaded = merge::load(plan_path, ViewsOf::OwnFolder);
    let any_error = loaded.problems.iter().any(|p| p.severity == Severity::Error);
    problems.extend(loaded.problems);
    let Some(plan) = loaded.plan.filter(|_| !any_error) else { return Err(None) };
    if plan.features.is_empty() {
        let help = "add one that the views show: kind = \"plane\", \"sphere\" or \"cylinder\"";
        let message = "no [[feature]], expected at least one: masks are judged by how points scatter about it";
        return Err(Some(Diagnostic::error(message).in_file(&plan.path).with_help(help).into()));
    }
    let beside = || plan.output.file.path.with_file_name("mask-study");
    let base = out.map_or_else(beside, Path::to_path_buf);
    let files = ["csv", "pdf"].map(|ending| with_ending(&base, ending));
    let merged = Outputs::new(&plan, None);
    let folder = &plan.views.folder.path;
    let listed = list_views(&plan, folder, &merged.paths(), 1).map_err(StitchError::from)?;
    check_files(&plan, &files, &merged, &listed).map_err(StitchError::from)?;
    let (views, unusable) = read_views(&plan, &listed, run, tell)?;
    let masks: Vec<Mask> = plan.masks.iter().map(|mask| mask.value).collect();
    let study = mask_study(&views, &plan.features, &masks, run, told).map_err(|error| fault_of(&plan, error))?;
    run.enter(Stage::Report).map_err(StitchError::from)?;
    let table = Staged::try_new(&files[0], csv(&study, &plan.features).as_bytes()).map_err(StitchError::from)?;
    let plots = Staged::try_new(&files[1], &mask_study_pdf(&plan, &study)).map_err(StitchError::from)?;
    put_all([table, plots])?;
    Ok(MaskStudyJob { plan, study, unusable, files })
}

/// A name with an ending, which it may have already.
fn with_ending(base: &Path, ending: &str) -> PathBuf {
    let is_known = base.extension().is_some_and(|own| own == "csv" || own == "pdf");
    let mut name = if is_known { base.with_extension("") } else { base.to_path_buf() }.into_os_string();
    name.push(".");
    name.push(ending);
    name.into()
}

/// Before anything is read: a study that cannot be kept is no use, nor one that takes the place of what it reads or of what a merge writes.
fn check_files(plan: &MergePlan, files: &[PathBuf; 2], merged: &Outputs, listed: &Listed) -> Result<(), Diagnostic> {
    files.iter().try_for_each(|path| check_place(path))?;
    let mut others = inputs(plan, &listed.views);
    others.extend(merged.called());
    let written: [Called; 2] = [("the table", &files[0]), ("the plots", &files[1])];
    check_apart(&written, &others)
}

pub(super) fn fault_of(plan: &MergePlan, error: StudyError) -> StitchError {
    match error {
        StudyError::Cancelled(cancelled) => StitchError::Cancelled(cancelled),
        fault @ StudyError::NoFit { .. } => {
            let help = "each view has to show the feature: check its kind, and leave views of other things out by [views] pattern";
            Diagnostic::error(fault.to_string()).in_file(&plan.path).with_help(help).into()
        }
    }
}

/// Every metric of a view that is asked for and can be known; of others there is no curve and no slider.
pub(super) fn complete_all(
    plan: &MergePlan,
    tools: &Tools,
    measured: &mut Measured,
    asked_for: impl Fn(Metric) -> bool,
    run: &RunContext,
) -> Result<(), StitchError> {
    for metric in Metric::ALL.into_iter().filter(|metric| asked_for(*metric)) {
        let asked = [(metric, Asked { words: metric.key().to_owned(), line: 1 })];
        if let Err(StitchError::Cancelled(cancelled)) = complete(plan, tools, measured, &asked, run) {
            return Err(cancelled.into());
        }
    }
    Ok(())
}

/// Every view with every metric that can be known of it, nothing masked; and how many cannot be read.
fn read_views(
    plan: &MergePlan,
    listed: &Listed,
    run: &RunContext,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<(Vec<View>, usize), StitchError> {
    for words in listed.warnings() {
        tell(MergeEvent::Unusable(Diagnostic::warning(words)));
    }
    let paths = &listed.views;
    let tools = Calibrated::read(plan, run)?.tools;
    let (mut views, mut hashes, mut faults) = (Vec::<View>::new(), Vec::new(), Vec::new());
    for (index, path) in paths.iter().enumerate() {
        tell(MergeEvent::View { index: index + 1, of: paths.len(), name: name_of(path) });
        run.enter(Stage::Read)?;
        let (sha256, read) = read_view(plan, path, run);
        match read {
            Ok(mut measured) => {
                if let Some(first) = hashes.iter().position(|known| *known == sha256) {
                    faults.push(same_file(path, &views[first].name));
                    continue;
                }
                hashes.push(sha256);
                check_units(plan, &tools, &measured.view)?;
                complete_all(plan, &tools, &mut measured, |_| true, run)?;
                views.push(measured.view);
            }
            Err(StitchError::Fault(fault) | StitchError::CutOff(fault)) => faults.push(*fault),
            Err(cancelled) => return Err(cancelled),
        }
    }
    if views.is_empty()
        && let Some(fault) = faults.first()
    {
        let words = in_one_line(fault);
        return Err(Diagnostic { message: format!("{words}; no view can be used"), ..fault.clone() }.into());
    }
    let unusable = faults.len();
    faults.into_iter().for_each(|fault| tell(MergeEvent::Unusable(fault)));
    Ok((views, unusable))
}
