//! What a merge tells beside its cloud: features before and after, and the difference to an earlier cloud.

use super::away::Away;
use super::files::name_of;
use crate::diagnostic::Diagnostic;
use crate::fit::Fitted;
use crate::geometry::Point3;
use crate::io;
use crate::plan::merge::{FeatureKind, Judge, MergePlan, Metric, NamedFile};
use crate::report::mask_study::short;
use crate::report::merged_unit;
use crate::report::pdf::merge::FeatureRow;
use crate::run::{Cancelled, RunContext};
use crate::stitch::feature::{FeatureFit, fit_feature, fit_feature_near, misfit};
use crate::stitch::merging::together;
use crate::stitch::odd_radius::{OddRadius, ViewRadius, odd_radii};
use crate::stitch::wear::{NewCloud, OldCloud, Wear, WearError, compare};
use crate::stitch::{MergeResult, Shelf, StitchError};

/// The features that the settings name, fitted to all placed points and to the merged cloud, and what is wrong with those fits.
pub(super) fn features(
    plan: &MergePlan,
    result: &MergeResult,
    away: &Away,
    run: &RunContext,
) -> Result<(Vec<FeatureRow>, Vec<String>), StitchError> {
    if plan.features.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let before = before(result, away, run)?;
    let (mut rows, mut warnings) = (Vec::new(), Vec::new());
    for feature in &plan.features {
        run.check()?;
        let fit = |points: &[Point3]| fit_feature(feature.kind, points).map_err(|e| e.to_string());
        let certified = feature.radius.map(|radius| (radius, feature.radius_u));
        let earlier = before.as_ref().map_err(String::clone).and_then(|points| fit(points));
        let row =
            FeatureRow { name: feature.name.clone(), certified, before: earlier, after: fit(&result.merged.positions) };
        warnings.extend(misfit_words(plan, &row, before.as_deref().unwrap_or_default(), &result.merged.positions));
        if let (Ok(fit), true) = (&row.after, feature.kind != FeatureKind::Plane) {
            let found = radii(&fit.shape, result, away, run)?;
            warnings.extend(odd_radii(&found).iter().map(|odd| odd_words(plan, &feature.name, result, odd)));
        }
        rows.push(row);
    }
    Ok((rows, warnings))
}

/// That a feature is not what the settings say, if it is not.
fn misfit_words(plan: &MergePlan, row: &FeatureRow, before: &[Point3], after: &[Point3]) -> Option<String> {
    let name = &row.name;
    let off = |fit: &Result<FeatureFit, String>, points| {
        let fit = fit.as_ref().ok()?;
        Some((fit.sigma_dev, misfit(&fit.shape, fit.sigma_dev, points)?))
    };
    if let Err(why) = &row.after {
        return Some(format!("{name} does not fit the merged points: {why}"));
    }
    let (sigma_dev, noise) = off(&row.after, after).or_else(|| off(&row.before, before))?;
    let (sigma_dev, noise, unit) = (short(sigma_dev), short(noise), plan.unit.key());
    Some(format!(
        "{name} does not fit: its points lie off it by {sigma_dev} {unit} (sigma_dev) and scatter by {noise} {unit} beside their neighbours, check its kind in [[feature]]"
    ))
}

/// Most points of a view by which its own radius is told.
const FITTED: usize = 50_000;

/// The radius of a feature in each placed view by itself, where it can be fitted.
fn radii(shape: &Fitted, result: &MergeResult, away: &Away, run: &RunContext) -> Result<Vec<ViewRadius>, StitchError> {
    let shelf = away.is_begun().then(|| away.shelf(run));
    let mut found = Vec::new();
    for (k, view, world_from_view) in result.placed.merged() {
        run.check()?;
        let fetched = shelf.as_ref().map(|shelf| shelf.view(k)).transpose()?;
        let positions = &fetched.as_deref().unwrap_or(view).positions;
        let step = positions.len().div_ceil(FITTED).max(1);
        let points: Vec<Point3> = positions.iter().step_by(step).map(|p| world_from_view * p).collect();
        let fit = fit_feature_near(shape, &points).ok();
        let known = fit.and_then(|fit| Some((fit.radius?, fit.radius_u?)));
        found.extend(known.map(|(radius, radius_u)| ViewRadius { view: k, radius, radius_u }));
    }
    Ok(found)
}

fn odd_words(plan: &MergePlan, feature: &str, result: &MergeResult, odd: &OddRadius) -> String {
    let (view, unit) = (&result.placed.views[odd.view].name, plan.unit.key());
    // To a tenth of what is to be expected.
    let decimals = (1 - odd.expected.log10().floor() as i64).clamp(0, 12) as usize;
    let told = |length: f64| format!("{length:.decimals$}");
    let (radius, others, expected) = (told(odd.radius), told(odd.others), told(odd.expected));
    let count = odd.of;
    format!(
        "{view}: the radius of {feature} is {radius} {unit} in it and {others} {unit} in {count} other views, where a difference of {expected} {unit} (one standard deviation) is to be expected: it may show something else"
    )
}

/// All points of the placed views, world frame; or why they are not had.
fn before(result: &MergeResult, away: &Away, run: &RunContext) -> Result<Result<Vec<Point3>, String>, StitchError> {
    if !away.is_begun() {
        return Ok(Ok(together(&result.placed).positions));
    }
    let points = result.merged.points_in;
    if !away.has_room_for(points) {
        return Ok(Err(format!("{points} points take more memory than the limit allows for a fit")));
    }
    let shelf = away.shelf(run);
    let mut positions = Vec::with_capacity(points);
    for (k, _, world_from_view) in result.placed.merged() {
        positions.extend(shelf.view(k)?.positions.iter().map(|p| world_from_view * p));
    }
    Ok(Ok(positions))
}

/// Looks at the earlier cloud before anything is merged: whether it can be compared with at all.
///
/// # Errors
/// It is no cloud, or in another unit; or the job was stopped.
pub(super) fn check_earlier(plan: &MergePlan, run: &RunContext) -> Result<(), StitchError> {
    let Some(named) = &plan.output.compare_with else { return Ok(()) };
    let bytes = io::read_file_while(&named.path, run)?;
    if let Some(unit) = merged_unit(&bytes).filter(|unit| *unit != plan.unit) {
        let (found, expected) = (unit.key(), plan.unit.key());
        let message = format!("[output] compare_with: lengths of {} are in {found}, expected {expected}", named.file);
        return Err(Diagnostic::error(message).in_file(&plan.path).at_line(named.line).with_help(COMPARABLE).into());
    }
    io::read_cloud_in_its_unit(&bytes, &named.path, plan.unit, run)?;
    Ok(())
}

/// The difference to the earlier cloud that the settings name, or why it is not known.
///
/// # Errors
/// The job was stopped.
pub(super) fn wear(
    plan: &MergePlan,
    result: &MergeResult,
    run: &RunContext,
) -> Result<Option<Result<Wear, String>>, Cancelled> {
    let Some(named) = &plan.output.compare_with else { return Ok(None) };
    match wear_since(plan, named, result, run) {
        Ok(wear) => Ok(Some(Ok(wear))),
        Err(StitchError::Cancelled(cancelled)) => Err(cancelled),
        Err(StitchError::Fault(fault) | StitchError::CutOff(fault)) => {
            let help = fault.help.as_ref().map_or_else(String::new, |help| format!("; {help}"));
            Ok(Some(Err(format!("{}{help}", fault.message))))
        }
    }
}

fn wear_since(
    plan: &MergePlan,
    named: &NamedFile,
    result: &MergeResult,
    run: &RunContext,
) -> Result<Wear, StitchError> {
    let bytes = io::read_file_while(&named.path, run)?;
    let cloud = io::read_cloud_in_its_unit(&bytes, &named.path, plan.unit, run)?;
    let metric = match &plan.merge.judge.value {
        Judge::Metrics(metrics) => metrics.first().copied(),
        Judge::Mean => None,
    };
    let worse = |values: &[f32], metric: Metric| -> Vec<f32> {
        values.iter().map(|v| -metric.score(f64::from(*v)) as f32).collect()
    };
    let new_badness = metric.and_then(|m| result.merged.columns.get(&m).map(|values| worse(values, m)));
    let old_badness = metric.and_then(|m| cloud.scalar(m.key()).map(|values| worse(values, m)));
    let (sensors, seen_from) = sensors(result);
    let new = NewCloud {
        positions: &result.merged.positions,
        sensors: &sensors,
        seen_from: &seen_from,
        badness: new_badness.as_deref(),
    };
    let old = OldCloud { positions: &cloud.positions, badness: old_badness.as_deref() };
    match compare(&new, &old, run) {
        Ok(wear) => Ok(wear),
        Err(WearError::Cancelled(cancelled)) => Err(cancelled.into()),
        Err(fault) => Err(not_comparable(named, &fault).into()),
    }
}

fn not_comparable(named: &NamedFile, fault: &WearError) -> Diagnostic {
    Diagnostic::error(format!("[output] compare_with: {}: {fault}", name_of(&named.path))).with_help(COMPARABLE)
}

const COMPARABLE: &str = "the earlier cloud must be of the same tool, in the same unit and merged from poses in the same frame; or leave compare_with out";

/// Where the sensors of the placed views stood, world frame, and of each merged point the one that saw it; means over several take the
/// first.
fn sensors(result: &MergeResult) -> (Vec<Point3>, Vec<u32>) {
    let mut sensors = Vec::new();
    let mut of_view = std::collections::BTreeMap::new();
    for (k, view, world_from_view) in result.placed.merged() {
        of_view.insert(result.placed.indices[k], sensors.len() as u32);
        sensors.push(world_from_view * view.sensor);
    }
    let seen = |view: &i32| usize::try_from(*view).ok().and_then(|v| of_view.get(&v).copied()).unwrap_or(0);
    let seen_from = result.merged.view.iter().map(seen).collect();
    (sensors, seen_from)
}

/// The middle of where the sensors stood.
pub(super) fn eye(result: &MergeResult) -> Point3 {
    let (sensors, _) = sensors(result);
    let sum: crate::geometry::Vector3 = sensors.iter().map(|p| p.coords).sum();
    Point3::from(sum / sensors.len().max(1) as f64)
}
