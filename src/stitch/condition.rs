//! A view made ready for merging: metrics, masks, the steps of noise and density.

use super::columns::{Asked, Tools, complete};
use super::intake::{Measured, retain};
use super::metric::Metric;
use super::noise::{grid_average, statistical_inliers};
use super::{Mask, StitchError, View, mask};
use crate::diagnostic::Diagnostic;
use crate::plan::merge::{Judge, MergePlan};
use crate::run::RunContext;
use serde::Serialize;

/// How many points a view has at each step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointCounts {
    /// Records in the file.
    pub points_read: usize,
    /// Without a place.
    pub points_invalid: usize,
    /// Left out by some mask.
    pub points_masked: usize,
    /// Left out by each mask by itself: a point may be counted by several.
    pub masked_by: std::collections::BTreeMap<&'static str, usize>,
    /// Removed as noise.
    pub points_noise: usize,
    /// What the density step made fewer.
    pub points_averaged: usize,
    /// What is left for registration and merging.
    pub points_kept: usize,
    /// Of these, without a number of a metric that decides which point stays: worse than any that has one.
    pub points_unjudged: usize,
}

/// A view that is ready.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditioned {
    /// Its points that are left, with all metrics that are known of them.
    pub view: View,
    /// What became of the others.
    pub counts: PointCounts,
}

/// Takes a view through masks, noise and density. `wanted` is of [`super::columns::wanted`].
///
/// # Errors
/// A metric that is asked for cannot be had, no point is left, or the job was stopped.
pub fn condition(
    plan: &MergePlan,
    tools: &Tools,
    mut measured: Measured,
    wanted: &[(Metric, Asked)],
    run: &RunContext,
) -> Result<Conditioned, StitchError> {
    complete(plan, tools, &mut measured, wanted, run)?;
    let Measured { mut view, points_read, points_invalid, .. } = measured;
    let (points_masked, masked_by) = apply_masks(plan, &mut view)?;
    let points_noise = remove_noise(plan, &mut view, run)?;
    let points_averaged = average(plan, &mut view)?;
    let points_kept = view.positions.len();
    let counts = PointCounts {
        points_read,
        points_invalid,
        points_masked,
        masked_by,
        points_noise,
        points_averaged,
        points_kept,
        points_unjudged: unjudged(plan, &view),
    };
    Ok(Conditioned { view, counts })
}

fn unjudged(plan: &MergePlan, view: &View) -> usize {
    let Judge::Metrics(metrics) = &plan.merge.judge.value else { return 0 };
    let columns: Vec<&Vec<f32>> = metrics.iter().filter_map(|metric| view.columns.get(metric)).collect();
    (0..view.positions.len()).filter(|k| columns.iter().any(|column| column[*k].is_nan())).count()
}

type MaskedBy = std::collections::BTreeMap<&'static str, usize>;

fn apply_masks(plan: &MergePlan, view: &mut View) -> Result<(usize, MaskedBy), StitchError> {
    let masks: Vec<Mask> = plan.masks.iter().map(|mask| mask.value).collect();
    let column = |metric: Metric| view.columns.get(&metric).map_or(&[][..], Vec::as_slice);
    let (keep, left_out) = mask::kept(view.positions.len(), &masks, column);
    let masked_by: MaskedBy = masks.iter().map(|mask| mask.metric.key()).zip(left_out).collect();
    let masked = keep.iter().filter(|keep| !**keep).count();
    if masked == view.positions.len() {
        return Err(all_masked(plan, view, &masked_by).into());
    }
    keep_points(view, &keep);
    Ok((masked, masked_by))
}

fn all_masked(plan: &MergePlan, view: &View, masked_by: &MaskedBy) -> Diagnostic {
    let each: Vec<String> = masked_by.iter().map(|(key, count)| format!("{key} {count}")).collect();
    let points = view.positions.len();
    let message = format!("the masks leave none of the {points} points of {} ({})", view.name, each.join(", "));
    let line = plan.masks.iter().map(|mask| mask.line).min().unwrap_or(1);
    let help =
        "check the bounds in [mask] and the units of the columns; `shapeline mask-study` shows what each bound leaves";
    Diagnostic::error(message).in_file(&plan.path).at_line(line).with_help(help)
}

/// Leaves out points with all that is known of them.
fn keep_points(view: &mut View, keep: &[bool]) {
    if keep.iter().all(|keep| *keep) {
        return;
    }
    retain(&mut view.positions, keep);
    view.columns.values_mut().for_each(|values| retain(values, keep));
    if let Some(pixels) = &mut view.pixels {
        retain(pixels, keep);
    }
}

fn remove_noise(plan: &MergePlan, view: &mut View, run: &RunContext) -> Result<usize, StitchError> {
    let Some(noise) = plan.noise else { return Ok(0) };
    let keep = statistical_inliers(&view.positions, noise.neighbours, noise.sigmas, run)?;
    keep_points(view, &keep);
    Ok(keep.iter().filter(|keep| !**keep).count())
}

fn average(plan: &MergePlan, view: &mut View) -> Result<usize, StitchError> {
    let Some(density) = plan.density else { return Ok(0) };
    let before = view.positions.len();
    let averaged = grid_average(&view.positions, &view.columns, density.cell.value);
    let (positions, columns) = averaged.map_err(|e| {
        let message = format!("[density] cell: {}: {e}", view.name);
        let help = "check the unit of cell and of the views: a cell should hold some points";
        Diagnostic::error(message).in_file(&plan.path).at_line(density.cell.line).with_help(help)
    })?;
    (view.positions, view.columns, view.pixels) = (positions, columns, None);
    Ok(before - view.positions.len())
}
