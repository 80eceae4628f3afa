//! The last step: of all points of all views, those that stay.

use super::adaptive::{MergeError, Rank, survivors};
use super::cells::Cells;
use super::metric::{Metric, rank_sum};
use super::noise::mean_of_numbers;
use super::place::PlacedViews;
use super::units::{check_radius, feature_warnings};
use super::{StitchError, voxel};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point3;
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
    let d_s = match plan.merge.radius.value {
        MergeRadius::Grid(multiple) => multiple * placed.d_grid,
        MergeRadius::Length(length) => length,
    };
    check_radius(plan, d_s, placed.d_grid, placed.size)?;
    run.enter(Stage::Merge)?;
    let all = together(placed);
    if u32::try_from(all.positions.len()).is_err() {
        let message = format!("found {} points, expected 4294967295 at most", all.positions.len());
        return Err(Diagnostic::error(message).with_help("ask for [density], or merge in parts").into());
    }
    let mut merged = match &plan.merge.judge.value {
        Judge::Metrics(metrics) => by_quality(plan, placed, &all, metrics, d_s, run)?,
        Judge::Mean => by_mean(plan, placed, &all, d_s)?,
    };
    merged.warnings = feature_warnings(plan, placed.size);
    Ok(merged)
}

fn by_quality(
    plan: &MergePlan,
    placed: &PlacedViews,
    all: &Together,
    metrics: &[Metric],
    d_s: f64,
    run: &RunContext,
) -> Result<Merged, StitchError> {
    let scores = scores(placed, metrics);
    let ranks: Vec<Rank> = all
        .sources
        .par_iter()
        .zip(&scores)
        .map(|((view, index), score)| Rank { score: *score, view: *view, index: *index })
        .collect();
    drop(scores);
    let kept = survivors(&all.positions, &ranks, d_s, run).map_err(|error| match error {
        MergeError::TooManyCells(cells) => too_far(plan, &cells.to_string()).into(),
        MergeError::Cancelled(cancelled) => StitchError::Cancelled(cancelled),
    })?;
    let positions = kept.iter().map(|k| all.positions[*k as usize]).collect();
    let view = kept.iter().map(|k| all.numbers[all.sources[*k as usize].0 as usize]).collect();
    let pick = |metric: Metric| {
        let values = column(placed, metric);
        (metric, kept.iter().map(|k| values[*k as usize]).collect())
    };
    let columns = known(placed).into_iter().map(pick).collect();
    Ok(Merged { positions, columns, view, d_s, points_in: all.positions.len(), warnings: Vec::new() })
}

/// The larger the better: a metric's own score, or the sum of ranks by several.
fn scores(placed: &PlacedViews, metrics: &[Metric]) -> Vec<f64> {
    if let [metric] = metrics {
        return column(placed, *metric).into_par_iter().map(|value| metric.score(f64::from(value))).collect();
    }
    let columns: Vec<(Metric, Vec<f32>)> = metrics.iter().map(|metric| (*metric, column(placed, *metric))).collect();
    let columns: Vec<(Metric, &[f32])> = columns.iter().map(|(metric, values)| (*metric, values.as_slice())).collect();
    rank_sum(&columns)
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
