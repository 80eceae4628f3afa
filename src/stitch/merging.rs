//! The last step: of all points of all views, those that stay.

use super::adaptive::{MergeError, survivors_of};
use super::bands::{BandError, PartJudge, Parts, Room, survivors_in_bands};
use super::cells::Cells;
use super::judged::{Judged, by_part};
use super::metric::{Metric, rank_sum};
use super::noise::mean_of_numbers;
use super::place::PlacedViews;
use super::shelf::Shelf;
use super::units::{check_radius, feature_warnings};
use super::{PointCounts, StitchError, View, voxel};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Isometry3, Point3};
use crate::plan::merge::{Judge, MergePlan, MergeRadius};
use crate::run::{RunContext, Stage};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// The number of a point that is the mean of several views'.
pub const SEVERAL: i32 = -1;

/// The merged cloud, world frame, in the views' unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Places.
    pub positions: Vec<Point3>,
    /// Metrics of each point; no number where its view does not know the metric.
    pub columns: BTreeMap<Metric, Vec<f32>>,
    /// The view each comes from, by its place in the order of names; [`SEVERAL`] for a mean over views.
    pub view: Vec<i32>,
    /// The distance within which points were merged, or the side of a cell.
    pub d_s: f64,
    /// Points before.
    pub points_in: usize,
    /// What people should know.
    pub warnings: Vec<String>,
}

/// All points of the merged views together.
pub struct Together {
    /// Places, world frame.
    pub positions: Vec<Point3>,
    /// Place of the view among the placed ones, and of the point in it.
    pub sources: Vec<(u32, u32)>,
    /// The number of each view in results.
    pub numbers: Vec<i32>,
}

/// The points of the merged views, in the world, view after view.
pub fn together(placed: &PlacedViews) -> Together {
    let mut all = Together { positions: Vec::new(), sources: Vec::new(), numbers: Vec::new() };
    for (k, view, world_from_view) in placed.merged() {
        let which = all.numbers.len() as u32;
        all.numbers.push(i32::try_from(placed.indices[k]).unwrap_or(i32::MAX));
        all.positions.par_extend(view.positions.par_iter().map(|p| world_from_view * p));
        all.sources.extend((0..view.positions.len() as u32).map(|index| (which, index)));
    }
    all
}

/// A metric of all points together; no number where a view does not know it.
pub fn column(placed: &PlacedViews, metric: Metric) -> Vec<f32> {
    let mut values = Vec::new();
    for (_, view, _) in placed.merged() {
        match view.columns.get(&metric) {
            Some(known) => values.extend_from_slice(known),
            None => values.resize(values.len() + view.positions.len(), f32::NAN),
        }
    }
    values
}

/// Merges views by the plan's judge.
///
/// # Errors
/// A radius that fits no view, points that reach too far, more than four thousand million of them, or the job was stopped.
pub fn merge(plan: &MergePlan, placed: &PlacedViews, run: &RunContext) -> Result<Merged, StitchError> {
    let d_s = radius_of(plan, placed)?;
    run.enter(Stage::Merge)?;
    let points_in: usize = placed.merged().map(|(_, view, _)| view.positions.len()).sum();
    check_count(points_in)?;
    let mut merged = match &plan.merge.judge.value {
        Judge::Metrics(metrics) => by_quality(plan, placed, metrics, d_s, run)?,
        Judge::Mean => by_mean(plan, placed, &together(placed), d_s)?,
    };
    merged.warnings = warnings(plan, placed);
    Ok(merged)
}

/// The same of views whose points lie on a shelf, of which no more than there is room for are in memory at once beside one view a thread.
///
/// # Errors
/// Those of [`merge`] and of the shelf; more points survive than there is room for, or the judge needs all points at once.
pub fn merge_from(
    plan: &MergePlan,
    placed: &PlacedViews,
    shelf: &dyn Shelf,
    room: Room,
    run: &RunContext,
) -> Result<Merged, StitchError> {
    let d_s = radius_of(plan, placed)?;
    run.enter(Stage::Merge)?;
    let of: Vec<(usize, Isometry3, usize)> =
        placed.merged().map(|(k, _, pose)| (k, *pose, placed.counts[k].points_kept)).collect();
    let points_in = of.iter().map(|(_, _, count)| count).sum();
    check_count(points_in)?;
    let judge = match &plan.merge.judge.value {
        Judge::Metrics(metrics) if metrics.len() == 1 => PartJudge::One(metrics[0]),
        Judge::Metrics(metrics) => PartJudge::Sums(sums_from(&of, shelf, metrics, run)?),
        Judge::Mean => return Err(all_at_once(plan).into()),
    };
    let parts = Parts { shelf, of, judge };
    let kept = survivors_in_bands(&parts, d_s, room, run).map_err(|error| match error {
        BandError::Merge(error) => not_merged(plan, error),
        BandError::View(error) => error,
        BandError::NoRoom => no_room(plan, room.kept).into(),
    })?;
    let mut merged = Merged::with_room(placed, kept.len(), d_s);
    let mut rest = kept.as_slice();
    for (place, pose, count) in &parts.of {
        run.check()?;
        let (first, number) = (merged.points_in, i32::try_from(placed.indices[*place]).unwrap_or(i32::MAX));
        merged.points_in += count;
        let (own, later) = rest.split_at(rest.partition_point(|k| (*k as usize) < merged.points_in));
        rest = later;
        if !own.is_empty() {
            merged.take(shelf.view(*place)?.as_ref(), pose, number, own.iter().map(|k| *k as usize - first));
        }
    }
    merged.warnings = warnings(plan, placed);
    Ok(merged)
}

/// Scores by several metrics of views on a shelf.
fn sums_from(
    of: &[(usize, Isometry3, usize)],
    shelf: &dyn Shelf,
    metrics: &[Metric],
    run: &RunContext,
) -> Result<Vec<Vec<f64>>, StitchError> {
    let mut columns: Vec<(Metric, Vec<f32>)> = metrics.iter().map(|metric| (*metric, Vec::new())).collect();
    for (place, _, count) in of {
        run.check()?;
        let view = shelf.view(*place)?;
        for (metric, values) in &mut columns {
            match view.columns.get(metric) {
                Some(known) => values.extend_from_slice(known),
                None => values.resize(values.len() + count, f32::NAN),
            }
        }
    }
    let columns: Vec<(Metric, &[f32])> = columns.iter().map(|(m, values)| (*m, values.as_slice())).collect();
    Ok(by_part(&rank_sum(&columns), of.iter().map(|(_, _, count)| *count)))
}

/// What people should know of what decided, and of the features.
fn warnings(plan: &MergePlan, placed: &PlacedViews) -> Vec<String> {
    let sum = |count: fn(&PointCounts) -> usize| placed.merged().map(|(k, ..)| count(&placed.counts[k])).sum();
    let (without, of): (usize, usize) = (sum(|counts| counts.points_unjudged), sum(|counts| counts.points_kept));
    let judge = match &plan.merge.judge.value {
        Judge::Metrics(metrics) => metrics.iter().map(|metric| metric.key()).collect::<Vec<_>>().join(" + "),
        Judge::Mean => String::new(),
    };
    let words = || format!("{without} of {of} points have no {judge}: each stays only where no point that has is near");
    (without > 0).then(words).into_iter().chain(feature_warnings(plan, placed.size)).collect()
}

fn all_at_once(plan: &MergePlan) -> Diagnostic {
    let message = "[merge] metric: \"mean\" needs all points in memory at once, which the limit does not allow";
    let help = "raise --memory-limit, ask for [density], or take a metric as the judge";
    Diagnostic::error(message).in_file(&plan.path).at_line(plan.merge.judge.line).with_help(help)
}

fn no_room(plan: &MergePlan, most: usize) -> Diagnostic {
    let key = match plan.merge.radius.value {
        MergeRadius::Grid(_) => "radius_grid",
        MergeRadius::Length(_) => "radius",
    };
    let message = format!("[merge] {key}: more than {most} points survive, for which the memory limit has no room");
    let help = "raise --memory-limit, take a larger radius, or ask for [density]";
    Diagnostic::error(message).in_file(&plan.path).at_line(plan.merge.radius.line).with_help(help)
}

fn radius_of(plan: &MergePlan, placed: &PlacedViews) -> Result<f64, StitchError> {
    let d_s = match plan.merge.radius.value {
        MergeRadius::Grid(multiple) => multiple * placed.d_grid,
        MergeRadius::Length(length) => length,
    };
    check_radius(plan, d_s, placed.d_grid, placed.size)?;
    Ok(d_s)
}

/// Points are numbered in 32 bits.
pub(super) fn check_count(points: usize) -> Result<(), StitchError> {
    if u32::try_from(points).is_ok() {
        return Ok(());
    }
    let message = format!("found {points} points, expected 4294967295 at most");
    Err(Diagnostic::error(message).with_help("ask for [density], or leave views out").into())
}

fn by_quality(
    plan: &MergePlan,
    placed: &PlacedViews,
    metrics: &[Metric],
    d_s: f64,
    run: &RunContext,
) -> Result<Merged, StitchError> {
    let kept = survivors_of(&Judged::new(placed, metrics), d_s, run).map_err(|error| not_merged(plan, error))?;
    let mut merged = Merged::with_room(placed, kept.len(), d_s);
    let mut rest = kept.as_slice();
    for (k, view, world_from_view) in placed.merged() {
        let (first, number) = (merged.points_in, i32::try_from(placed.indices[k]).unwrap_or(i32::MAX));
        merged.points_in += view.positions.len();
        let (own, later) = rest.split_at(rest.partition_point(|k| (*k as usize) < merged.points_in));
        rest = later;
        merged.take(view, world_from_view, number, own.iter().map(|k| *k as usize - first));
    }
    Ok(merged)
}

impl Merged {
    /// No points, with room for some.
    fn with_room(placed: &PlacedViews, count: usize, d_s: f64) -> Self {
        let columns = known(placed).into_iter().map(|metric| (metric, Vec::with_capacity(count))).collect();
        let (positions, view) = (Vec::with_capacity(count), Vec::with_capacity(count));
        Self { positions, columns, view, d_s, points_in: 0, warnings: Vec::new() }
    }

    /// Adds points of a view, by their indices in it.
    pub(super) fn take(
        &mut self,
        view: &View,
        world_from_view: &Isometry3,
        number: i32,
        kept: impl Iterator<Item = usize> + Clone,
    ) {
        self.positions.extend(kept.clone().map(|k| world_from_view * view.positions[k]));
        self.view.resize(self.positions.len(), number);
        for (metric, values) in &mut self.columns {
            match view.columns.get(metric) {
                Some(known) => values.extend(kept.clone().map(|k| known[k])),
                None => values.resize(self.positions.len(), f32::NAN),
            }
        }
    }
}

pub(super) fn not_merged(plan: &MergePlan, error: MergeError) -> StitchError {
    match error {
        MergeError::TooManyCells(cells) => too_far(plan, &cells.to_string()).into(),
        MergeError::Cancelled(cancelled) => StitchError::Cancelled(cancelled),
    }
}

/// Metrics that some merged view knows.
fn known(placed: &PlacedViews) -> BTreeSet<Metric> {
    placed.merged().flat_map(|(_, view, _)| view.columns.keys().copied()).collect()
}

fn by_mean(plan: &MergePlan, placed: &PlacedViews, all: &Together, side: f64) -> Result<Merged, StitchError> {
    let cells = Cells::new(&all.positions, side).map_err(|e| too_far(plan, &e.to_string()))?;
    let positions = voxel::means(&cells).into_iter().map(|(mean, _)| mean).collect();
    let members = |cell: usize| cells.order[cells.points(cell)].iter().map(|k| *k as usize);
    let number = |cell: usize| {
        let mut numbers = members(cell).map(|k| all.numbers[all.sources[k].0 as usize]);
        let first = numbers.next().unwrap_or(SEVERAL);
        if numbers.all(|number| number == first) { first } else { SEVERAL }
    };
    let view = (0..cells.len()).into_par_iter().map(number).collect();
    let average = |metric: Metric| {
        let values = column(placed, metric);
        let mean = |cell: usize| mean_of_numbers(members(cell).map(|k| values[k]));
        (metric, (0..cells.len()).into_par_iter().map(mean).collect())
    };
    let columns = known(placed).into_iter().map(average).collect();
    Ok(Merged { positions, columns, view, d_s: side, points_in: all.positions.len(), warnings: Vec::new() })
}

fn too_far(plan: &MergePlan, words: &str) -> Diagnostic {
    let help = "check the unit of the radius, and the poses; ask for [noise] where single points lie far outside";
    Diagnostic::error(format!("[merge]: {words}")).in_file(&plan.path).at_line(plan.merge.radius.line).with_help(help)
}
