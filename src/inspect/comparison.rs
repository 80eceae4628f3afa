//! The plan's comparison points, measured in the alignment to which all deviations refer.

use super::budget::{Along, Known, Own, Scatter};
use super::result::{HoleMeasurement, Measurement, PointResult, Verdict};
use super::verdict::decide;
use crate::align::{FeatureAlignment, PoseUncertainty};
use crate::geometry::{Point3, Vector3};
use crate::measure::{self, Card, Local, NotFound};
use crate::plan::{ComparisonPoint, Geometry, Plan};
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
        card: Card::default(),
        measurement: None,
    }
}

fn not_measured(point: &ComparisonPoint, reason: String, points: usize) -> PointResult {
    PointResult { reason: Some(reason), points_used: points, ..blank(point) }
}

/// One value before it is judged.
struct Value {
    measured: Point3,
    deviation_mm: f64,
    own: Own,
    rms_mm: f64,
    points_used: usize,
    hole: Option<HoleMeasurement>,
    warning: Option<String>,
}

fn measure_point(
    plan: &Plan,
    local: &Local,
    pose: &PoseUncertainty,
    point: &ComparisonPoint,
) -> (PointResult, Option<String>) {
    let mut card = Card::default();
    let value = match measure_value(local, point, &mut card) {
        Ok(value) => value,
        Err(not) => return (PointResult { card, ..not_measured(point, not.reason, not.points) }, None),
    };
    let known =
        Known { features: &plan.features, settings: &plan.uncertainty, seen: Some((local.part, local.face)), pose };
    let budget = known.of_value(point, &value.own);
    let uncertainty_mm = 2.0 * budget.standard_mm();
    let lower_mm = point.judged_lower_mm();
    let (verdict, reason) = decide(plan.part.decision, value.deviation_mm, uncertainty_mm, lower_mm, point.upper_mm);
    if verdict == Verdict::NotMeasured {
        let result = not_measured(point, reason.unwrap_or_default(), value.points_used);
        return (PointResult { card, ..result }, value.warning);
    }
    let measurement = Measurement {
        measured: value.measured,
        deviation_mm: value.deviation_mm,
        uncertainty_mm,
        budget,
        rms_mm: value.rms_mm,
        hole: value.hole,
    };
    let points_used = value.points_used;
    let result = PointResult { verdict, reason, points_used, measurement: Some(measurement), card, ..blank(point) };
    (result, value.warning)
}

/// How far from its nominal place a point is looked for, mm.
pub(super) fn search_mm(point: &ComparisonPoint) -> f64 {
    (point.lower_mm.abs().max(point.upper_mm.abs()) + SEARCH_BEYOND_TOLERANCE_MM).min(MOST_SEARCH_MM)
}

fn measure_value(local: &Local, point: &ComparisonPoint, card: &mut Card) -> Result<Value, NotFound> {
    let search_mm = search_mm(point);
    match &point.geometry {
        Geometry::Surface { position, direction } => {
            let found = measure::surface_with_card(local, position, direction, search_mm, &point.surface_fit, card)?;
            Ok(Value {
                measured: found.position,
                deviation_mm: found.deviation_mm,
                own: Own::along(found.standard_uncertainty_mm, direction, false),
                rms_mm: found.rms_mm,
                points_used: found.points_used,
                hole: None,
                warning: None,
            })
        }
        Geometry::Edge { position, direction, normal } => {
            let found = measure::edge_with_card(local, position, direction, normal, search_mm, card)?;
            Ok(Value {
                measured: found.position,
                deviation_mm: found.deviation_mm,
                own: Own::along(found.standard_uncertainty_mm, direction, true),
                rms_mm: found.rms_mm,
                points_used: found.points_used,
                hole: None,
                warning: None,
            })
        }
        Geometry::Hole { centre, axis, diameter_mm, direction } => {
            let found = measure::hole_with_card(local, centre, axis, *diameter_mm, search_mm, card)?;
            let shift = found.centre - centre;
            let delta_mm = shift - axis.into_inner() * shift.dot(axis);
            let radial_mm = delta_mm.norm();
            let deviation_mm = direction.map_or(radial_mm, |d| delta_mm.dot(&d));
            Ok(Value {
                measured: found.centre,
                deviation_mm,
                own: Own {
                    scatter: Scatter::Centre(found.centre_covariance),
                    along: direction.map_or(Along::Distance(delta_mm), |d| Along::Direction(d.into_inner())),
                    is_edge: false,
                },
                rms_mm: found.rms_mm,
                points_used: found.points_used,
                hole: Some(HoleMeasurement {
                    position_mm: 2.0 * radial_mm,
                    delta_mm,
                    diameter_mm: found.diameter_mm,
                    diameter_deviation_mm: found.diameter_mm - diameter_mm,
                }),
                warning: found.warning,
            })
        }
        Geometry::Slot { .. } => Err(NotFound { reason: "a slot cannot be a comparison point".into(), points: 0 }),
    }
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
}
