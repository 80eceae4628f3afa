//! The views of a merge as they are looked at before anything is merged: all metrics, nothing masked, nothing written.

use super::MergeEvent;
use super::calibrated::{Calibrated, check_units};
use super::files::{list_views, name_of, read_named, read_view};
use super::outputs::Outputs;
use super::study::{complete_all, fault_of};
use super::views::same_file;
use crate::diagnostic::Diagnostic;
use crate::geometry::Isometry3;
use crate::plan::merge::{Mask, MergePlan, Metric, Prealign};
use crate::run::{RunContext, Stage};
use crate::stitch::mask_study::{MaskStudy, mask_study};
use crate::stitch::mask_worth::Starts;
use crate::stitch::{Measured, StitchError, Tools, View, poses, wanted};
use std::collections::BTreeMap;
use std::path::Path;

/// Points that are looked at in all; of more a fixed part of each view.
const MOST_POINTS: usize = 4_000_000;

/// Points that a study of masks looks at in all; of more a fixed part.
const STUDIED_POINTS: usize = 100_000;

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
    /// Of each metric that every view knows: thresholds with the share of the points that they keep, from the loosest on.
    pub keeps: BTreeMap<Metric, Vec<[f64; 2]>>,
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

    /// The study looks at one point in how many of those that are here.
    pub fn study_every(&self) -> usize {
        self.looked_at().div_ceil(STUDIED_POINTS).max(1)
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
    let paths = list_views(plan, &plan.views.folder.path, &Outputs::new(plan, None).paths(), 1)?.views;
    let tools = Calibrated::read(plan, run)?.tools;
    let names: Vec<String> = paths.iter().map(|path| name_of(path)).collect();
    let (poses, no_poses) = poses_of(plan, &names, run)?;
    let most = (MOST_POINTS / paths.len()).max(1);
    let mut first = BTreeMap::new();
    let mut found = Preview {
        files: Vec::new(),
        views: Vec::new(),
        numbers: Vec::new(),
        starts: Vec::new(),
        every: Vec::new(),
        shapes: Starts::default(),
        keeps: BTreeMap::new(),
        no_poses,
    };
    for (number, path) in paths.iter().enumerate() {
        tell(MergeEvent::View { index: number + 1, of: paths.len(), name: names[number].clone() });
        run.enter(Stage::Read)?;
        let (at, read, points) = match one(plan, &tools, path, most, &mut first, run) {
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
    for metric in found.metrics() {
        run.check()?;
        found.keeps.insert(metric, keeps(&found.views, metric));
    }
    found.shapes = Starts::of(&found.views, &plan.features, run)?;
    Ok(found)
}

/// Steps of such a curve, and values that it is told by at most.
const STEPS: usize = 100;
const MOST_VALUES: usize = 200_000;

/// Thresholds of a metric with the share of the points that each keeps; what lies outermost is left to typed numbers.
fn keeps(views: &[View], metric: Metric) -> Vec<[f64; 2]> {
    let all = || views.iter().flat_map(|view| &view.columns[&metric]);
    let every = all().count().div_ceil(MOST_VALUES).max(1);
    let some: Vec<f64> = all().step_by(every).map(|value| f64::from(*value)).collect();
    let mut known: Vec<f64> = some.iter().copied().filter(|value| value.is_finite()).collect();
    // The better ones last: a threshold keeps itself and what stands behind it.
    known.sort_by(|a, b| metric.score(*a).total_cmp(&metric.score(*b)));
    let at = |share: f64| (share * known.len().saturating_sub(1) as f64).round() as usize;
    let step = |k: usize| at(OUTERMOST + (1.0 - 2.0 * OUTERMOST) * k as f64 / STEPS as f64);
    let steps = (0..=STEPS).map(step).filter(|k| *k < known.len());
    let mut curve: Vec<[f64; 2]> =
        steps.map(|k| [known[k], (known.len() - k) as f64 / some.len().max(1) as f64]).collect();
    curve.dedup_by_key(|[threshold, _]| *threshold);
    curve
}

/// The share of the points at either end that no slider reaches.
const OUTERMOST: f64 = 0.001;

/// A view with every metric that can be known of it; what stands off its surroundings takes long, and is computed of a large view only
/// where the settings ask for it. `first` holds names by hash.
fn one(
    plan: &MergePlan,
    tools: &Tools,
    path: &Path,
    most: usize,
    first: &mut BTreeMap<Option<String>, String>,
    run: &RunContext,
) -> Result<Measured, StitchError> {
    let (sha256, read) = read_view(plan, path, run);
    let mut measured = read?;
    if let Some(name) = first.get(&sha256) {
        return Err(same_file(path, name).into());
    }
    first.insert(sha256, name_of(path));
    check_units(plan, tools, &measured.view)?;
    let wanted = wanted(plan);
    let takes_long = |metric| matches!(metric, Metric::NonUniformity | Metric::NonUniformityAngle);
    let is_large = measured.view.positions.len() > most;
    let asked_for = |metric| !(is_large && takes_long(metric)) || wanted.iter().any(|(asked, _)| *asked == metric);
    complete_all(plan, tools, &mut measured, asked_for, run)?;
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
    let every = preview.study_every();
    let thin = |view: &View| thinned(view.clone(), view.positions.len().div_ceil(every).max(1)).0;
    let few: Vec<View> = if every > 1 { preview.views.iter().map(thin).collect() } else { Vec::new() };
    let views = if every > 1 { &few } else { &preview.views };
    mask_study(views, &plan.features, &masks, run, told).map_err(|error| fault_of(plan, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;

    fn view(count: usize) -> View {
        let values = |k: usize| if k % 10 == 9 { f32::NAN } else { k as f32 };
        View {
            name: "v".into(),
            positions: (0..count).map(|k| Point3::new(k as f64, 0.0, 0.0)).collect(),
            columns: BTreeMap::from([
                (Metric::Strength, (0..count).map(values).collect()),
                (Metric::CalibrationDistance, (0..count).map(values).collect()),
            ]),
            pixels: Some((0..count as u32).map(|k| [k, k]).collect()),
            sensor: Point3::origin(),
        }
    }

    #[test]
    fn of_a_large_view_every_so_many_points_are_looked_at_with_all_that_is_known_of_them() {
        let (few, every) = thinned(view(1000), 300);
        assert_eq!((few.positions.len(), every), (250, 4));
        for (k, place) in few.positions.iter().enumerate() {
            assert_eq!((place.x, few.pixels.as_ref().unwrap()[k][0]), (4.0 * k as f64, 4 * k as u32));
        }
        assert!(few.columns.values().all(|values| values.len() == 250 && values[3] == 12.0));
        let (all, every) = thinned(view(1000), 1000);
        assert_eq!((all.positions.len(), every), (1000, 1));
    }

    /// A tenth of the values is no number: no threshold keeps them.
    #[test]
    fn a_curve_falls_from_all_that_is_known_to_the_best() {
        let views = [view(10_000)];
        for metric in [Metric::Strength, Metric::CalibrationDistance] {
            let curve = keeps(&views, metric);
            let mask = |threshold: f64| match metric {
                Metric::Strength => Mask { metric, min: threshold, max: f64::INFINITY },
                _ => Mask { metric, min: f64::NEG_INFINITY, max: threshold },
            };
            for [threshold, share] in &curve {
                let kept = views[0].columns[&metric].iter().filter(|value| mask(*threshold).keeps(**value)).count();
                assert_eq!(*share, kept as f64 / 10_000.0, "{metric:?} {threshold}");
            }
            assert!(curve.len() == STEPS + 1 && curve[0][1] > 0.89 && curve[STEPS][1] < 0.01);
            assert!(curve.windows(2).all(|w| w[0][1] > w[1][1]));
        }
    }
}
