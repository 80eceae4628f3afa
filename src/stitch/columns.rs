//! Metrics that are asked for and not in the file: computed of what is there.

use super::calibration::Calibration;
use super::intake::Measured;
use super::metric::{Metric, attenuation};
use super::non_uniformity::{MEAN_RADIUS_GRID, NORMAL_RADIUS_GRID, non_uniformity};
use super::organised::Picture;
use super::spacing::grid_distance;
use super::{StitchError, View};
use crate::diagnostic::Diagnostic;
use crate::plan::merge::{Judge, MergePlan, NonUniformitySettings};
use crate::plan::short_number;
use crate::run::RunContext;
use rayon::prelude::*;

/// What metrics are computed with beside the view itself.
#[derive(Default)]
pub struct Tools {
    /// Features that the camera was calibrated with.
    pub camera: Option<Calibration>,
    /// The same of the projector.
    pub projector: Option<Calibration>,
}

/// Points between two looks at whether the job was stopped.
const CHUNK: usize = 1 << 14;

/// Metrics that the settings ask for, each with who asks, for messages: masks first, then the judge.
pub fn wanted(plan: &MergePlan) -> Vec<(Metric, Asked)> {
    let masks = plan.masks.iter().map(|mask| {
        let metric = mask.value.metric;
        (metric, Asked { words: format!("[mask] {}", metric.key()), line: mask.line })
    });
    let judges = match &plan.merge.judge.value {
        Judge::Metrics(metrics) => metrics.as_slice(),
        Judge::Mean => &[],
    };
    let asked = |metric: &Metric| (*metric, Asked { words: "[merge] metric".to_owned(), line: plan.merge.judge.line });
    let mut wanted: Vec<(Metric, Asked)> = Vec::new();
    for (metric, asked) in masks.chain(judges.iter().map(asked)) {
        if wanted.iter().all(|(known, _)| *known != metric) {
            wanted.push((metric, asked));
        }
    }
    wanted
}

/// Who asks for a metric.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asked {
    /// The key.
    pub words: String,
    /// Its line, from 1.
    pub line: usize,
}

/// Adds the metrics that are wanted and not there.
///
/// # Errors
/// What a metric is made of is not there either; the message names the line that asks. Or the job was stopped.
pub fn complete(
    plan: &MergePlan,
    tools: &Tools,
    measured: &mut Measured,
    wanted: &[(Metric, Asked)],
    run: &RunContext,
) -> Result<(), StitchError> {
    for (metric, asked) in wanted {
        if measured.view.columns.contains_key(metric) {
            continue;
        }
        run.check()?;
        let missing = |needs: &str, help: &str| {
            let (view, column) = (&measured.view.name, metric.key());
            let words = match needs {
                "" => format!("{view} has no column {column}"),
                _ => format!("{view} has no column {column}, and {needs}"),
            };
            let message = format!("{}: {words}", asked.words);
            StitchError::from(Diagnostic::error(message).in_file(&plan.path).at_line(asked.line).with_help(help))
        };
        match metric {
            Metric::Attenuation => {
                let strength = measured.view.columns.get(&Metric::Strength);
                let Some((a, b)) = measured.background.as_ref().zip(strength) else {
                    return Err(missing("not both a and b, of which it is made", OTHER_METRIC));
                };
                let values = a.iter().zip(b).map(|(a, b)| attenuation(*a, *b)).collect();
                measured.view.columns.insert(Metric::Attenuation, values);
            }
            Metric::CalibrationDistance | Metric::Reprojection | Metric::Density => {
                let Some(camera) = &tools.camera else {
                    return Err(missing("[calibration] names no camera features", CALIBRATION));
                };
                by_calibration(&mut measured.view, *metric, camera, run)?;
            }
            Metric::CalibrationDistanceProjector => {
                let Some(projector) = &tools.projector else {
                    return Err(missing("[calibration] names no projector features", CALIBRATION));
                };
                by_calibration(&mut measured.view, *metric, projector, run)?;
            }
            Metric::NonUniformity | Metric::NonUniformityAngle => {
                by_surroundings(&mut measured.view, plan.non_uniformity, run)?;
            }
            Metric::Strength | Metric::PhaseShiftVariation => return Err(missing("", OTHER_METRIC)),
        }
    }
    Ok(())
}

const OTHER_METRIC: &str =
    "export it with the points, or go by another metric: delta_n needs nothing but the points themselves";
const CALIBRATION: &str = "name the file of features under [calibration], export the column, or go by delta_n, which needs nothing but the points";

const LARGER_RADII: &str =
    "make the radii of [delta_n] larger, or leave them out: 2.5 and 6 times the distance of points are usual";
/// A point that is its own mean differs from it by rounding.
const LEAST_DELTA: f32 = 1e-6;

fn by_calibration(
    view: &mut View,
    metric: Metric,
    calibration: &Calibration,
    run: &RunContext,
) -> Result<(), StitchError> {
    let value = |near: super::calibration::Near| match metric {
        Metric::Reprojection => near.reprojection_px,
        Metric::Density => near.density,
        _ => near.distance,
    };
    let chunks: Vec<Vec<f32>> = view
        .positions
        .par_chunks(CHUNK)
        .map(|chunk| {
            run.check()?;
            Ok(chunk.iter().map(|place| value(calibration.near(place))).collect())
        })
        .collect::<Result<_, StitchError>>()?;
    view.columns.insert(metric, chunks.concat());
    Ok(())
}

fn by_surroundings(view: &mut View, radii: NonUniformitySettings, run: &RunContext) -> Result<(), StitchError> {
    let fault = |words: String| Diagnostic::error(format!("{}: {words}", view.name)).with_help(OTHER_METRIC);
    let d_grid = grid_distance(&view.positions).map_err(|e| fault(e.to_string()))?;
    let Some(d_grid) = d_grid else {
        let points = view.positions.len();
        return Err(fault(format!("its {points} points are too few, or in one place: delta_n cannot be told")).into());
    };
    run.check()?;
    let normal_radius = radii.normal_radius.unwrap_or(NORMAL_RADIUS_GRID * d_grid);
    let mean_radius = radii.mean_radius.unwrap_or(MEAN_RADIUS_GRID * d_grid);
    let found = match view.pixels.as_deref().and_then(Picture::new) {
        Some(picture) => picture.non_uniformity(&view.positions, &view.sensor, [normal_radius, mean_radius], d_grid),
        None => non_uniformity(&view.positions, &view.sensor, normal_radius, mean_radius)
            .map_err(|e| fault(e.to_string()))?,
    };
    let told = found.delta_n.iter().filter(|delta| delta.is_finite());
    if told.clone().next().is_none() || mean_radius < d_grid && told.clone().all(|delta| *delta < LEAST_DELTA) {
        let (normal_radius, mean_radius) = (short_number(normal_radius), short_number(mean_radius));
        let words = format!(
            "delta_n cannot be told: too few points lie within normal_radius {normal_radius} and mean_radius {mean_radius}, which stand {} apart",
            short_number(d_grid)
        );
        return Err(Diagnostic::error(format!("{}: {words}", view.name)).with_help(LARGER_RADII).into());
    }
    // What is in the file stays as it is.
    view.columns.entry(Metric::NonUniformity).or_insert(found.delta_n);
    view.columns.entry(Metric::NonUniformityAngle).or_insert(found.angle_rad);
    Ok(())
}
