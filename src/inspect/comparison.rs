//! The plan's comparison points, measured in the alignment to which all deviations refer.

use super::result::{HoleMeasurement, Measurement, PointResult, Verdict};
use super::verdict::decide;
use crate::align::{FeatureAlignment, PoseUncertainty};
use crate::geometry::{Point3, Vector3};
use crate::measure::{self, Local, NotFound};
use crate::plan::{ComparisonPoint, Geometry, Plan, UncertaintySettings};
use crate::run::{Cancelled, RunContext};
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
                Some(reason) => (not_measured(point, datum_reason(reason), 0), None),
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

/// `datum S1 not measured` without the details that stand in the alignment's reason.
fn datum_reason(reason: &str) -> String {
    let datums = reason.split("; ").filter(|r| r.starts_with("datum "));
    let parts: Vec<&str> = datums.map(|r| r.split(": ").next().unwrap_or(r)).collect();
    if parts.is_empty() { reason.to_string() } else { parts.join("; ") }
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

/// One value before it is judged: `u_fit_mm` is standard (k = 1).
struct Value {
    measured: Point3,
    deviation_mm: f64,
    u_fit_mm: f64,
    /// Direction along which pose and system act on it.
    along: Vector3,
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
                u_fit_mm: found.standard_uncertainty_mm,
                along: direction.into_inner(),
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
                u_fit_mm: found.standard_uncertainty_mm,
                along: direction.into_inner(),
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
            let along = match direction {
                Some(d) => d.into_inner(),
                None if radial_mm > 0.0 => delta_mm / radial_mm,
                None => axis.cross(&Vector3::x()).try_normalize(0.1).unwrap_or_else(Vector3::y),
            };
            Ok(Value {
                measured: found.centre,
                deviation_mm,
                u_fit_mm: along.dot(&(found.centre_covariance * along)).max(0.0).sqrt(),
                along,
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

/// Fit, pose and the plan's own contributions, added in squares (GUM): thickness where it was compensated, scale with
/// the distance from the point that the alignment holds, the calibrated edge offset, the measuring system.
fn standard_uncertainty_mm(
    plan: &Plan,
    local: &Local,
    pose: &PoseUncertainty,
    point: &ComparisonPoint,
    value: &Value,
) -> f64 {
    let UncertaintySettings { scale_ppm, thickness_mm, system_mm, edge_offset_u_mm, .. } = plan.uncertainty;
    let nominal = point.geometry.position();
    let offset_mm = plan.part.cad_side.face_offset_mm(local.face.side, 1.0);
    let across_sheet = value.along.dot(&point.geometry.sheet_normal());
    let scale_mm = scale_ppm * 1e-6 * (nominal - pose.pivot()).dot(&value.along);
    let edge_mm = if value.is_edge { edge_offset_u_mm } else { 0.0 };
    [
        value.u_fit_mm,
        pose.at(&nominal, &value.along),
        thickness_mm * offset_mm * across_sheet,
        scale_mm,
        edge_mm,
        system_mm,
    ]
    .iter()
    .map(|u| u * u)
    .sum::<f64>()
    .sqrt()
}

#[cfg(test)]
mod tests {
    use super::datum_reason;

    #[test]
    fn the_point_names_the_datum_and_leaves_the_detail_to_the_alignment() {
        let reason = "datum S1 not measured: 3 points stand within the window, 40 are needed";
        assert_eq!(datum_reason(reason), "datum S1 not measured");
        let two = "datum H1 not measured: no rim; datum S1 not measured: no rim";
        assert_eq!(datum_reason(two), "datum H1 not measured; datum S1 not measured");
        assert_eq!(datum_reason("the datum features did not settle"), "the datum features did not settle");
    }
}
