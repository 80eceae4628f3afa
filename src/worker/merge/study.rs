//! `shapeline mask-study`: settings and views to a table and plots of what each mask is worth.

use super::calibrated::{Calibrated, check_units};
use super::files::{Listed, list_views, name_of, read_view};
use super::outputs::{Called, Outputs, check_apart, check_place, inputs, put_all};
use super::views::same_file;
use super::{MergeEvent, in_one_line};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::merge::{self, Judge, Mask, MergePlan, Metric, NonUniformitySettings, ViewsOf};
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

/// What to study.
#[derive(Debug, Clone, Default)]
pub struct MaskStudyRequest {
    /// `MERGE.toml`.
    pub plan_path: PathBuf,
    /// Name of the files, without their endings, where they are not to lie beside the merged cloud.
    pub out: Option<PathBuf>,
    /// These metrics only; with none, every one that can be known of all views.
    pub metrics: Vec<Metric>,
}

/// Studies masks for the views and features of a `MERGE.toml`. `problems` gets those of the settings, and why a metric that they ask for has no
/// curve.
///
/// # Errors
/// `None` when the settings have errors, which `problems` got; else why nothing was studied or written, also that a metric which was asked
/// for by name cannot be known of a view.
pub fn study_masks(
    request: &MaskStudyRequest,
    run: &RunContext,
    problems: &mut Vec<Diagnostic>,
    tell: &(dyn Fn(MergeEvent) + Sync),
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<MaskStudyJob, Option<StitchError>> {
    let loaded = merge::load(&request.plan_path, ViewsOf::OwnFolder);
    let any_error = loaded.problems.iter().any(|p| p.severity == Severity::Error);
    problems.extend(loaded.problems);
    let Some(plan) = loaded.plan.filter(|_| !any_error) else { return Err(None) };
    if plan.features.is_empty() {
        let help = "add one that the views show: kind = \"plane\", \"sphere\" or \"cylinder\"";
        let message = "no [[feature]], expected at least one: masks are judged by how points scatter about it";
        return Err(Some(Diagnostic::error(message).in_file(&plan.path).with_help(help).into()));
    }
    let beside = || plan.output.file.path.with_file_name("mask-study");
    let base = request.out.clone().unwrap_or_else(beside);
    let files = ["csv", "pdf"].map(|ending| with_ending(&base, ending));
    let merged = Outputs::new(&plan, None);
    let folder = &plan.views.folder.path;
    let listed = list_views(&plan, folder, &merged.paths(), 1).map_err(StitchError::from)?;
    check_files(&plan, &files, &merged, &listed).map_err(StitchError::from)?;
    let Read { views, unusable, unknown, own } = read_views(&plan, &listed, &request.metrics, run, tell)?;
    if let Some(fault) = unknown.iter().find(|one| request.metrics.contains(&one.metric)) {
        return Err(Some(fault.fault.clone().into()));
    }
    problems.extend(not_studied(&plan, &views, &unknown));
    problems.extend(radii_not_used(&plan, &own, views.len()));
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

/// A metric that cannot be known of a view.
#[derive(Debug, Clone)]
pub(super) struct Unknown {
    metric: Metric,
    /// Why, with the view's name.
    fault: Diagnostic,
}

/// Every metric of a view that is asked for and can be known; of others there is no curve and no slider, for the reasons given back.
pub(super) fn complete_all(
    plan: &MergePlan,
    tools: &Tools,
    measured: &mut Measured,
    asked_for: impl Fn(Metric) -> bool,
    run: &RunContext,
) -> Result<Vec<Unknown>, StitchError> {
    let mut unknown = Vec::new();
    for metric in Metric::ALL.into_iter().filter(|metric| asked_for(*metric)) {
        let mask = plan.masks.iter().find(|mask| mask.value.metric == metric);
        let asked = [(metric, Asked { words: metric.key().to_owned(), line: mask.map_or(1, |mask| mask.line) })];
        match complete(plan, tools, measured, &asked, run) {
            Ok(()) => {}
            Err(StitchError::Fault(fault) | StitchError::CutOff(fault)) => {
                let line = fault.line.filter(|_| mask.is_some());
                unknown.push(Unknown { metric, fault: Diagnostic { line, ..*fault } });
            }
            Err(cancelled) => return Err(cancelled),
        }
    }
    Ok(unknown)
}

/// That a metric has no curve though the settings ask for it, or though some of the views know it.
fn not_studied(plan: &MergePlan, views: &[View], unknown: &[Unknown]) -> Vec<Diagnostic> {
    let is_asked_for = |metric: Metric| {
        let by_radii = matches!(metric, Metric::NonUniformity | Metric::NonUniformityAngle)
            && plan.non_uniformity != NonUniformitySettings::default();
        let by_judge = match &plan.merge.judge.value {
            // Nobody wrote the judge that is taken where none is named.
            Judge::Metrics(metrics) => *metrics != [Metric::CalibrationDistance] && metrics.contains(&metric),
            Judge::Mean => false,
        };
        let known = views.iter().filter(|view| view.columns.contains_key(&metric)).count();
        by_radii || by_judge || known > 0 || plan.masks.iter().any(|mask| mask.value.metric == metric)
    };
    let all = views.len();
    let of = |metric: Metric| {
        let of_metric = || unknown.iter().filter(|one| one.metric == metric);
        let (first, count) = (of_metric().next().filter(|_| is_asked_for(metric))?, of_metric().count());
        let (key, words) = (metric.key(), &first.fault.message);
        let why = words.strip_prefix(&format!("{key}: ")).unwrap_or(words);
        let message = format!("{key} is not studied, {count} of {all} views do not know it: {why}");
        Some(Diagnostic { severity: Severity::Warning, message, ..first.fault.clone() })
    };
    Metric::ALL.into_iter().filter_map(of).collect()
}

/// That the radii of `[delta_n]` say nothing of views whose files have the column. `own`: their names.
fn radii_not_used(plan: &MergePlan, own: &[String], views: usize) -> Option<Diagnostic> {
    let first = own.first().filter(|_| plan.non_uniformity != NonUniformitySettings::default())?;
    let count = own.len();
    let message = format!(
        "[delta_n]: its radii are not used for {count} of {views} views, whose files have delta_n already ({first} first)"
    );
    let help = "leave the column out of the files to have it computed with these radii, or remove [delta_n]";
    Some(Diagnostic::warning(message).in_file(&plan.path).with_help(help))
}

/// The views of a study.
struct Read {
    /// With every metric that is to be studied and can be known, nothing masked.
    views: Vec<View>,
    /// How many cannot be read.
    unusable: usize,
    /// What cannot be known of them.
    unknown: Vec<Unknown>,
    /// Names of those whose files have `delta_n`.
    own: Vec<String>,
}

/// Reads the views with the metrics wanted, or all.
fn read_views(
    plan: &MergePlan,
    listed: &Listed,
    wanted: &[Metric],
    run: &RunContext,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<Read, StitchError> {
    for words in listed.warnings() {
        tell(MergeEvent::Unusable(Diagnostic::warning(words)));
    }
    let paths = &listed.views;
    let tools = Calibrated::read(plan, run)?.tools;
    let is_wanted = |metric: Metric| wanted.is_empty() || wanted.contains(&metric);
    let (mut views, mut hashes, mut faults) = (Vec::<View>::new(), Vec::new(), Vec::new());
    let (mut unknown, mut own) = (Vec::new(), Vec::new());
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
                if measured.view.columns.contains_key(&Metric::NonUniformity) {
                    own.push(measured.view.name.clone());
                }
                unknown.extend(complete_all(plan, &tools, &mut measured, is_wanted, run)?);
                measured.view.columns.retain(|metric, _| is_wanted(*metric));
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
    Ok(Read { views, unusable, unknown, own })
}
