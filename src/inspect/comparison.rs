//! The plan's comparison points, measured in the alignment to which all deviations refer.

use super::result::{HoleMeasurement, Measurement, PointResult, Verdict};
use super::verdict::decide;
use crate::align::{FeatureAlignment, PoseUncertainty};
use crate::geometry::{Point3, Vector3};
use crate::measure::{self, Local, NotFound};
use crate::plan::{ComparisonPoint, Geometry, Plan, UncertaintySettings};
use crate::run::{Cancelled, RunContext};
use nalgebra::Matrix3;
use rayon::prelude::*;

/// How far beyond its tolerance a feature is looked for, mm.
const SEARCH_BEYOND_TOLERANCE_MM: f64 = 2.0;
/// And how far at most, however wide the tolerance: what lies further out is another feature, or another fold.
pub(super) const MOST_SEARCH_MM: f64 = 5.0;

/// Every comparison point, in the plan's order, and what somebody should know of single ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Compared {
    /// The results.
    pub points: Vec<PointResult>,
    /// Warnings, each with the point's name.
    pub warnings: Vec<String>,
}

/// Measures and judges every comparison point.
pub fn compare(
    plan: &Plan,
    local: &Local,
    alignment: &FeatureAlignment,
    pose: &PoseUncertainty,
    run: &RunContext,
) -> Result<Compared, Cancelled> {
    let each: Vec<(PointResult, Option<String>)> = plan
        .comparison
        .par_iter()
        .map(|point| {
            run.check()?;
            Ok(match &alignment.degraded {
                Some(reason) => (not_measured(point, datum_reason(reason, &alignment.missing), 0), None),
                None => measure_point(plan, local, pose, point),
            })
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut compared = Compared::default();
    for (point, warning) in each {
        compared.warnings.extend(warning.map(|w| format!("{}: {w}", point.name)));
        compared.points.push(point);
    }
    Ok(compared)
}

/// `datum S1 not measured`, without the details that stand in the alignment's reason; that reason where no datum is missing.
fn datum_reason(reason: &str, missing: &[String]) -> String {
    let each: Vec<String> = missing.iter().map(|name| format!("datum {name} not measured")).collect();
    if each.is_empty() { reason.to_string() } else { each.join("; ") }
}

fn blank(point: &ComparisonPoint) -> PointResult {
    let direction = match &point.geometry {
        Geometry::Hole { direction, .. } => direction.map_or(Vector3::zeros(), |d| d.into_inner()),
        Geometry::Surface { direction, .. } | Geometry::Edge { direction, .. } | Geometry::Slot { direction, .. } => {
            direction.into_inner()
        }
    };
    PointResult {
        name: point.name.clone(),
        kind: point.geometry.kind(),
        nominal: point.geometry.position(),
        direction,
        lower_mm: point.lower_mm,
        upper_mm: point.upper_mm,
        verdict: Verdict::NotMeasured,
        reason: None,
        points_used: 0,
        measurement: None,
    }
}

fn not_measured(point: &ComparisonPoint, reason: String, points: usize) -> PointResult {
    PointResult { reason: Some(reason), points_used: points, ..blank(point) }
}

/// How far the points alone leave a value open, k = 1.
enum Scatter {
    /// Along its direction, mm.
    Along(f64),
    /// Covariance of a hole's centre, mm².
    Centre(Matrix3<f64>),
}

/// One value before it is judged.
struct Value {
    measured: Point3,
    deviation_mm: f64,
    scatter: Scatter,
    /// Direction along which pose and system act on it. `None`: a hole's distance, `delta_mm` from its nominal place.
    along: Option<Vector3>,
    rms_mm: f64,
    points_used: usize,
    hole: Option<HoleMeasurement>,
    is_edge: bool,
    warning: Option<String>,
}

fn measure_point(
    plan: &Plan,
    local: &Local,
    pose: &PoseUncertainty,
    point: &ComparisonPoint,
) -> (PointResult, Option<String>) {
    let value = match measure_value(local, point) {
        Ok(value) => value,
        Err(not) => return (not_measured(point, not.reason, not.points), None),
    };
    let uncertainty_mm = 2.0 * standard_uncertainty_mm(plan, local, pose, point, &value);
    let (verdict, reason) =
        decide(plan.part.decision, value.deviation_mm, uncertainty_mm, point.lower_mm, point.upper_mm);
    if verdict == Verdict::NotMeasured {
        return (not_measured(point, reason.unwrap_or_default(), value.points_used), value.warning);
    }
    let measurement = Measurement {
        measured: value.measured,
        deviation_mm: value.deviation_mm,
        uncertainty_mm,
        rms_mm: value.rms_mm,
        hole: value.hole,
    };
    let points_used = value.points_used;
    let result = PointResult { verdict, reason, points_used, measurement: Some(measurement), ..blank(point) };
    (result, value.warning)
}

fn measure_value(local: &Local, point: &ComparisonPoint) -> Result<Value, NotFound> {
    let wanted_mm = point.lower_mm.abs().max(point.upper_mm.abs()) + SEARCH_BEYOND_TOLERANCE_MM;
    let search_mm = wanted_mm.min(MOST_SEARCH_MM);
    match &point.geometry {
        Geometry::Surface { position, direction } => {
            let found = measure::surface(local, position, direction, search_mm)?;
            Ok(Value {
                measured: found.position,
                deviation_mm: found.deviation_mm,
                scatter: Scatter::Along(found.standard_uncertainty_mm),
                along: Some(direction.into_inner()),
                rms_mm: found.rms_mm,
                points_used: found.points_used,
                hole: None,
                is_edge: false,
                warning: None,
            })
        }
        Geometry::Edge { position, direction, normal } => {
            let found = measure::edge(local, position, direction, normal, search_mm)?;
            Ok(Value {
                measured: found.position,
                deviation_mm: found.deviation_mm,
                scatter: Scatter::Along(found.standard_uncertainty_mm),
                along: Some(direction.into_inner()),
                rms_mm: found.rms_mm,
                points_used: found.points_used,
                hole: None,
                is_edge: true,
                warning: found.warning,
            })
        }
        Geometry::Hole { centre, axis, diameter_mm, direction } => {
            let found = measure::hole(local, centre, axis, *diameter_mm, search_mm)?;
            let shift = found.centre - centre;
            let delta_mm = shift - axis.into_inner() * shift.dot(axis);
            let radial_mm = delta_mm.norm();
            let deviation_mm = direction.map_or(radial_mm, |d| delta_mm.dot(&d));
            Ok(Value {
                measured: found.centre,
                deviation_mm,
                scatter: Scatter::Centre(found.centre_covariance),
                along: direction.map(|d| d.into_inner()),
                rms_mm: found.rms_mm,
                points_used: found.points_used,
                hole: Some(HoleMeasurement {
                    position_mm: 2.0 * radial_mm,
                    delta_mm,
                    diameter_mm: found.diameter_mm,
                    diameter_deviation_mm: found.diameter_mm - diameter_mm,
                }),
                is_edge: false,
                warning: found.warning,
            })
        }
        Geometry::Slot { .. } => Err(NotFound { reason: "a slot cannot be a comparison point".into(), points: 0 }),
    }
}

/// Of a value along its direction. A hole that has none is told by its distance: an error across that hardly changes it, unless it
/// is not much longer than the errors themselves. Then its direction is theirs, and the worst one in the sheet counts.
fn standard_uncertainty_mm(
    plan: &Plan,
    local: &Local,
    pose: &PoseUncertainty,
    point: &ComparisonPoint,
    value: &Value,
) -> f64 {
    let at = |along: &Vector3| standard_uncertainty_along_mm(plan, local, pose, point, value, along);
    match (&value.along, &value.hole) {
        (Some(along), _) => at(along),
        (None, hole) => {
            let delta_mm = hole.as_ref().map_or(Vector3::zeros(), |hole| hole.delta_mm);
            u_of_distance_mm(&delta_mm, &point.geometry.sheet_normal(), at)
        }
    }
}

/// A distance counts as one from here on, in standard uncertainties of the worst direction.
const TELLING_DISTANCE: f64 = 2.0;
/// Directions in the half-circle that are looked at: the worst one is met to 1 - cos(2.5 degrees), 0.1 %.
const DIRECTIONS: u32 = 36;

/// Standard uncertainty of the length of a vector in the sheet, from that along any direction.
fn u_of_distance_mm(delta_mm: &Vector3, normal: &Vector3, at: impl Fn(&Vector3) -> f64) -> f64 {
    let x = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let y = normal.cross(&x);
    let direction = |k: u32| {
        let (sin, cos) = (std::f64::consts::PI * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
        x * cos + y * sin
    };
    let worst_mm = (0..DIRECTIONS).map(|k| at(&direction(k))).fold(0.0, f64::max);
    match delta_mm.try_normalize(0.0) {
        Some(along) if delta_mm.norm() >= TELLING_DISTANCE * worst_mm => at(&along),
        _ => worst_mm,
    }
}

/// Fit, pose and the plan's own contributions, added in squares (GUM): thickness where it was compensated, scale with
/// the distance from the point that the alignment holds, the calibrated edge offset (which the pose may have in common with the
/// point), the measuring system.
fn standard_uncertainty_along_mm(
    plan: &Plan,
    local: &Local,
    pose: &PoseUncertainty,
    point: &ComparisonPoint,
    value: &Value,
    along: &Vector3,
) -> f64 {
    let UncertaintySettings { scale_ppm, thickness_mm, system_mm, edge_offset_u_mm, .. } = plan.uncertainty;
    let nominal = point.geometry.position();
    let u_fit_mm = match &value.scatter {
        Scatter::Along(u_mm) => *u_mm,
        Scatter::Centre(covariance) => along.dot(&(covariance * along)).max(0.0).sqrt(),
    };
    let offset_mm = plan.part.cad_side.face_offset_mm(local.face.side, 1.0);
    let across_sheet = along.dot(&point.geometry.sheet_normal());
    let scale_mm = scale_ppm * 1e-6 * (nominal - pose.pivot()).dot(along);
    let edge_mm = if value.is_edge { edge_offset_u_mm } else { 0.0 };
    [
        u_fit_mm,
        pose.without_edge_offset(&nominal, along),
        thickness_mm * offset_mm * across_sheet,
        scale_mm,
        pose.edge_offset_mm(&nominal, along, edge_mm),
        system_mm,
    ]
    .iter()
    .map(|u| u * u)
    .sum::<f64>()
    .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_point_names_the_datum_and_leaves_the_detail_to_the_alignment() {
        let reason = "datum A; B: C not measured: no rim; datum S1 not measured: no rim";
        let told = datum_reason(reason, &["A; B: C".to_string(), "S1".to_string()]);
        assert_eq!(told, "datum A; B: C not measured; datum S1 not measured");
        assert_eq!(datum_reason("the datum features did not settle", &[]), "the datum features did not settle");
    }

    /// Known to 0.01 mm along x and 0.05 mm along y: a distance of 0.03 mm along x may as well be all noise along y.
    #[test]
    fn a_short_distance_is_as_uncertain_as_its_worst_direction() {
        let at = |d: &Vector3| (0.01 * d.x).hypot(0.05 * d.y);
        let told = |x: f64, y: f64| u_of_distance_mm(&Vector3::new(x, y, 0.0), &Vector3::z(), at);
        for short in [told(0.0, 0.0), told(0.03, 0.0), told(0.0, 0.03), told(0.07, -0.07)] {
            assert!((0.04995..=0.05).contains(&short), "{short}");
        }
        // Longer than two of the worst: its own direction.
        assert!((told(0.2, 0.0) - 0.01).abs() < 1e-12 && (told(0.0, 0.2) - 0.05).abs() < 1e-12);
    }
}
