//! The views of a merge as they are looked at before anything is merged: all metrics, nothing masked, nothing written.

use super::MergeEvent;
use super::files::{list_views, name_of, read_named, read_view};
use super::study::{check_units, fault_of, tools};
use crate::diagnostic::Diagnostic;
use crate::geometry::Isometry3;
use crate::plan::merge::{Mask, MergePlan, Metric, Prealign};
use crate::run::{RunContext, Stage};
use crate::stitch::columns::{Asked, complete};
use crate::stitch::mask_study::{MaskStudy, mask_study};
use crate::stitch::mask_worth::Starts;
use crate::stitch::{Measured, StitchError, Tools, View, poses, wanted};
use std::path::Path;

/// Points that are looked at in all; of more a fixed part of each view.
const MOST_POINTS: usize = 4_000_000;

/// What became of a view's file.
#[derive(Debug, Clone)]
pub struct PreviewView {
    /// Its file.
    pub name: String,
    /// Points read: records of the file.
    pub read: usize,
    /// Points with a place.
    pub points: usize,
    /// Its place among [`Preview::views`]; or why it cannot be used.
    pub at: Result<usize, Diagnostic>,
}

/// The views of a merge.
#[derive(Debug, Clone)]
pub struct Preview {
    /// All files, in the order of names.
    pub files: Vec<PreviewView>,
    /// Those that can be read, each in its own frame: every point, or one in so many.
    pub views: Vec<View>,
    /// Of each of them its place among the files.
    pub numbers: Vec<usize>,
    /// Of each of them, where it stands before registration; none where nobody knows.
    pub starts: Vec<Option<Isometry3>>,
    /// One point in how many of each view; 1 = all of them.
    pub every: Vec<usize>,
    /// Shapes near the features.
    pub shapes: Starts,
    /// Why poses cannot be used, where they cannot.
    pub no_poses: Option<Diagnostic>,
}

impl Preview {
    /// Points with a place, of all views that can be read.
    pub fn points(&self) -> usize {
        self.numbers.iter().map(|file| self.files[*file].points).sum()
    }

    /// Points that are looked at.
    pub fn looked_at(&self) -> usize {
        self.views.iter().map(|view| view.positions.len()).sum()
    }

    /// Metrics that every view knows.
    pub fn metrics(&self) -> Vec<Metric> {
        let known =
            |metric: &Metric| !self.views.is_empty() && self.views.iter().all(|view| view.columns.contains_key(metric));
        Metric::ALL.into_iter().filter(known).collect()
    }
}

/// Reads all views. `tell` hears of each that is begun.
///
/// # Errors
/// No view at all, settings that name something that cannot be used, or the job was stopped.
pub fn preview(plan: &MergePlan, run: &RunContext, tell: &(dyn Fn(MergeEvent) + Sync)) -> Result<Preview, StitchError> {
    let paths = list_views(plan, &plan.views.folder.path, 1)?;
    let tools = tools(plan, run)?;
    let names: Vec<String> = paths.iter().map(|path| name_of(path)).collect();
    let (poses, no_poses) = poses_of(plan, &names, run)?;
    let most = (MOST_POINTS / paths.len()).max(1);
    let mut found = Preview {
        files: Vec::new(),
        views: Vec::new(),
        numbers: Vec::new(),
        starts: Vec::new(),
        every: Vec::new(),
        shapes: Starts::default(),
        no_poses,
    };
    for (number, path) in paths.iter().enumerate() {
        tell(MergeEvent::View { index: number + 1, of: paths.len(), name: names[number].clone() });
        run.enter(Stage::Read)?;
        let (at, read, points) = match one(plan, &tools, path, most, run) {
            Ok(measured) => {
                let (points, read) = (measured.view.positions.len(), measured.points_read);
                let (view, every) = thinned(measured.view, most);
                found.views.push(view);
                found.numbers.push(number);
                found.starts.push(start(plan, poses.as_deref(), number));
                found.every.push(every);
                (Ok(found.views.len() - 1), read, points)
            }
            Err(StitchError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(StitchError::Fault(fault) | StitchError::CutOff(fault)) => (Err(*fault), 0, 0),
        };
        found.files.push(PreviewView { name: names[number].clone(), read, points, at });
    }
    found.shapes = Starts::of(&found.views, &plan.features, run)?;
    Ok(found)
}

/// A view with every metric that can be known of it; what stands off its surroundings takes long, and is computed of a large view only
/// where the settings ask for it.
fn one(plan: &MergePlan, tools: &Tools, path: &Path, most: usize, run: &RunContext) -> Result<Measured, StitchError> {
    let (_, read) = read_view(plan, path, run);
    let mut measured = read?;
    check_units(plan, tools, &measured.view)?;
    let wanted = wanted(plan);
    let takes_long = |metric| matches!(metric, Metric::NonUniformity | Metric::NonUniformityAngle);
    let is_large = measured.view.positions.len() > most;
    for metric in Metric::ALL {
        if is_large && takes_long(metric) && wanted.iter().all(|(asked, _)| *asked != metric) {
            continue;
        }
        // What nothing is known of has no slider.
        let asked = [(metric, Asked { words: metric.key().to_owned(), line: 1 })];
        if let Err(StitchError::Cancelled(cancelled)) = complete(plan, tools, &mut measured, &asked, run) {
            return Err(cancelled.into());
        }
    }
    Ok(measured)
}

/// One point in so many that no more than `most` are left; which ones is fixed by their places in the file.
fn thinned(mut view: View, most: usize) -> (View, usize) {
    let every = view.positions.len().div_ceil(most).max(1);
    if every > 1 {
        view.positions = view.positions.into_iter().step_by(every).collect();
        for values in view.columns.values_mut() {
            *values = values.iter().copied().step_by(every).collect();
        }
        view.pixels = view.pixels.map(|pixels| pixels.into_iter().step_by(every).collect());
    }
    (view, every)
}

type Poses = (Option<Vec<Isometry3>>, Option<Diagnostic>);

/// The poses, where a file names them. A fault of it is told beside the views.
fn poses_of(plan: &MergePlan, names: &[String], run: &RunContext) -> Result<Poses, StitchError> {
    let Prealign::Poses(named) = &plan.views.prealign else { return Ok((None, None)) };
    let read = || -> Result<_, StitchError> {
        let (bytes, _) = read_named(&named.path, run)?;
        Ok(poses(&bytes, names).map_err(|fault| fault.in_file(&named.path))?)
    };
    match read() {
        Ok(poses) => Ok((Some(poses), None)),
        Err(StitchError::Cancelled(cancelled)) => Err(cancelled.into()),
        Err(StitchError::Fault(fault) | StitchError::CutOff(fault)) => Ok((None, Some(*fault))),
    }
}

fn start(plan: &MergePlan, poses: Option<&[Isometry3]>, number: usize) -> Option<Isometry3> {
    match &plan.views.prealign {
        Prealign::Poses(_) => poses?.get(number).copied(),
        Prealign::None if !plan.registration.enabled => Some(Isometry3::identity()),
        Prealign::None | Prealign::Cad(_) => None,
    }
}

/// What masks are worth for these views: as `shapeline mask-study` tells it of all their points.
///
/// # Errors
/// No view shows the feature, or the job was stopped.
pub fn study_preview(
    plan: &MergePlan,
    preview: &Preview,
    run: &RunContext,
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<MaskStudy, StitchError> {
    let masks: Vec<Mask> = plan.masks.iter().map(|mask| mask.value).collect();
    mask_study(&preview.views, &plan.features, &masks, run, told).map_err(|error| fault_of(plan, error))
}
