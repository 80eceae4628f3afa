//! The error of the pose to expect from a plan's datums, before anything is measured: expected errors of the datum features,
//! pushed through the alignment itself.

use crate::align::{
    BEST_FIT_POINTS, Common, DatumErrors, Datums, PoseUncertainty, REGION_POINTS, expected_best_fit,
    expected_pose_uncertainty, expected_region_fit,
};
use crate::diagnostic::Diagnostic;
use crate::geometry::{UnitVector3, Vector3, decompose};
use crate::measure::Reading;
use crate::part::Part;
use crate::plan::expected::{Expected, OpeningStd};
use crate::plan::{
    AlignmentMethod, ComparisonPoint, Draft, Feature, Geometry, Plan, Rig, Side, SlotReading, UncertaintySettings,
};
use nalgebra::Matrix2;

/// What of a plan the expected error of its pose depends on.
#[derive(Debug, Clone, Copy)]
pub struct Outlook<'a> {
    /// How the part is held.
    pub method: &'a AlignmentMethod,
    /// By which features.
    pub features: &'a [Feature],
    /// Where its deviations are wanted.
    pub comparison: &'a [ComparisonPoint],
    /// What measures it.
    pub rig: Option<&'a Rig>,
    /// What the scans cannot show.
    pub uncertainty: UncertaintySettings,
    /// The CAD, the surface of which holds a best fit.
    pub part: Option<&'a Part>,
}

/// What to expect of a comparison point: expanded uncertainties (k = 2), mm along its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedU {
    /// In all.
    pub u_mm: f64,
    /// What the point's own measurement owes.
    pub point_mm: f64,
    /// What the alignment owes.
    pub pose_mm: f64,
    /// What the sheet's thickness (on the side where that shows more) and the scale owe, at the point and through the alignment.
    pub common_mm: f64,
}

impl<'a> Outlook<'a> {
    /// Of a plan.
    pub fn of(plan: &'a Plan) -> Self {
        let Plan { alignment, features, comparison, rig, uncertainty, .. } = plan;
        Self { method: alignment, features, comparison, rig: rig.as_ref(), uncertainty: *uncertainty, part: None }
    }

    /// Of what is sound of a plan, if that tells its alignment.
    pub fn of_draft(draft: &'a Draft) -> Option<Self> {
        let Draft { alignment, features, comparison, rig, .. } = draft;
        let uncertainty = draft.uncertainty.unwrap_or_default();
        Some(Self { method: alignment.as_ref()?, features, comparison, rig: rig.as_ref(), uncertainty, part: None })
    }

    /// What the pose's error will do to each comparison point along its direction, mm (standard deviation); `None` where the
    /// datums do not hold the part, and for a best fit to a CAD that is not known, or whose surface does not hold the part by itself.
    pub fn pose_errors_mm(&self) -> Option<Vec<f64>> {
        let pose = pose(self, self.method, Side::Top)?;
        Some(self.comparison.iter().map(|point| error_mm(&pose, &point.geometry)).collect())
    }

    /// The expanded uncertainty (k = 2) to expect at each comparison point of a good scan, mm. `None` where the datums do not hold
    /// the part.
    pub fn expected_u_mm(&self) -> Option<Vec<f64>> {
        Some(self.expected()?.iter().map(|expected| expected.u_mm).collect())
    }

    /// The same with its parts: the datums through the pose (a best fit to a CAD that is not known owes next to nothing), the point's
    /// own fit, the measuring system and the edges' offset, and, of a CAD that is known, thickness and scale. What it leaves out
    /// (shadows, points seen at a slant) only adds to it.
    pub fn expected(&self) -> Option<Vec<ExpectedU>> {
        let pose_mm = match (self.method, self.part) {
            (AlignmentMethod::BestFit | AlignmentMethod::Regions(_), None) => vec![0.0; self.comparison.len()],
            _ => self.pose_errors_mm()?,
        };
        let common_mm = self.common_mm();
        let expected = Expected::of(self.rig);
        let UncertaintySettings { system_mm, edge_offset_u_mm, .. } = self.uncertainty;
        let one = |((point, pose_mm), common_mm): ((&ComparisonPoint, f64), f64)| {
            let own_mm = match &point.geometry {
                Geometry::Surface { .. } => expected.surface_mm(),
                Geometry::Edge { .. } => expected.edge_mm().hypot(edge_offset_u_mm),
                Geometry::Hole { diameter_mm, .. } => expected.opening(*diameter_mm, *diameter_mm).across_mm,
                Geometry::Slot { length_mm, width_mm, .. } => expected.opening(*length_mm, *width_mm).along_mm,
            };
            let point_mm = 2.0 * own_mm.hypot(system_mm);
            let (pose_mm, common_mm) = (2.0 * pose_mm, 2.0 * common_mm);
            ExpectedU { u_mm: point_mm.hypot(pose_mm).hypot(common_mm), point_mm, pose_mm, common_mm }
        };
        Some(self.comparison.iter().zip(pose_mm).zip(common_mm).map(one).collect())
    }

    /// What thickness and scale do to each comparison point, mm (k = 1), seen from the side where that is more. Nothing where the CAD is
    /// not known.
    fn common_mm(&self) -> Vec<f64> {
        let nothing = vec![0.0; self.comparison.len()];
        let Some(part) = self.part else { return nothing };
        [Side::Top, Side::Bottom].into_iter().fold(nothing, |most, side| {
            let Some(pose) = pose(self, self.method, side) else { return most };
            let seen = Seen { part, side, pose: &pose, settings: &self.uncertainty };
            most.iter().zip(self.comparison).map(|(most, point)| most.max(seen.common_mm(&point.geometry))).collect()
        })
    }
}

/// A part of which one side is seen, in a pose of which something is known.
struct Seen<'a> {
    part: &'a Part,
    side: Side,
    pose: &'a PoseUncertainty,
    settings: &'a UncertaintySettings,
}

impl Seen<'_> {
    /// What thickness and scale do to a point along its direction, mm (k = 1); of a hole that has none by how much its centre is off
    /// in the sheet.
    fn common_mm(&self, geometry: &Geometry) -> f64 {
        let place = geometry.position();
        let reading = Reading::of(self.part, self.part.face(self.side), geometry);
        let UncertaintySettings { thickness_mm, scale_ppm, .. } = *self.settings;
        let told = |by: Vector3| {
            let by = reading.of_displacement(&by);
            match geometry {
                Geometry::Surface { direction, .. }
                | Geometry::Edge { direction, .. }
                | Geometry::Slot { direction, .. }
                | Geometry::Hole { direction: Some(direction), .. } => by.dot(direction),
                Geometry::Hole { axis, direction: None, .. } => (by - axis.into_inner() * by.dot(axis)).norm(),
            }
        };
        let thickness = told(reading.of_thickness(thickness_mm) + self.pose.by_thickness(&place));
        thickness.hypot(told(self.pose.by_scale(&place, scale_ppm)))
    }
}

/// Warns of every comparison point whose tolerance the measuring system cannot judge: with U as large as half of the tolerance's
/// width (of a distance that may be 0: as its upper limit), or larger, not even the best deviation could pass.
pub fn tolerance_warnings(outlook: &Outlook) -> Vec<Diagnostic> {
    let source = if outlook.rig.is_some() { "by [rig]" } else { "without [rig]" };
    let warning = |(point, u_mm): (&ComparisonPoint, f64)| {
        let (lower_mm, upper_mm) = (point.lower_mm, point.upper_mm);
        // A distance of 0 passes when U is within its only limit.
        let most_mm = if point.judged_lower_mm().is_finite() { 0.5 * (upper_mm - lower_mm) } else { upper_mm };
        // The plan's own check tells limits that nobody can measure.
        if upper_mm - lower_mm < crate::plan::NARROWEST_MM || u_mm < most_mm {
            return None;
        }
        let message = format!(
            "[[comparison]] \"{}\": U (k = 2) is expected to be about {} {source}, too much for the tolerance from {lower_mm} \
             to {upper_mm} mm: no deviation could pass",
            point.name,
            mm(u_mm),
        );
        let help = "widen the tolerance, measure with a finer rig, or hold the part by datums nearer to this point";
        Some(Diagnostic::warning(message).in_file(&point.file).at_line(point.line).with_help(help))
    };
    outlook.comparison.iter().zip(outlook.expected_u_mm().unwrap_or_default()).filter_map(warning).collect()
}

/// Warns of a plan that reads the slot's axis, with the expected error at the comparison point where it is largest. `None` for
/// the other readings, and for datums that do not hold the part (which has its own message). The warning has no place yet.
pub fn axis_reading_warning(outlook: &Outlook) -> Option<Diagnostic> {
    let AlignmentMethod::Features { hole, slot, slot_reading: SlotReading::Axis, point } = *outlook.method else {
        return None;
    };
    let feature = outlook.features.get(slot)?;
    let Geometry::Slot { length_mm, width_mm, .. } = feature.geometry else { return None };
    let by_line = AlignmentMethod::Features { hole, slot, slot_reading: SlotReading::CentreLine, point };
    let errors = outlook.pose_errors_mm()?;
    let (worst, error) = outlook.comparison.iter().zip(&errors).max_by(|a, b| a.1.total_cmp(b.1))?;
    let line = pose(outlook, &by_line, Side::Top);
    let expected = Expected::of(outlook.rig);
    let OpeningStd { turn_rad, tilt_rad, .. } = expected.opening(length_mm, width_mm);
    let source = if outlook.rig.is_some() { "from [rig]" } else { "without [rig]" };
    let other = line.map_or(String::new(), |line| {
        format!("; \"centre_line\" would be about {}", mm(error_mm(&line, &worst.geometry)))
    });
    let message = format!(
        "[alignment] slot_reading: the axis of slot \"{}\" ({length_mm} x {width_mm} mm) is only known to about {:.2} mrad in the \
         sheet and {:.2} mrad out of it at {:.3} mm between points ({source}); expected error (standard deviation) about {} at \
         point \"{}\"{other}",
        feature.name,
        1e3 * turn_rad,
        1e3 * tilt_rad,
        expected.spacing_mm,
        mm(*error),
        worst.name,
    );
    let help = "write slot_reading = \"centre_line\", unless the drawing asks for the slot's axis";
    Some(Diagnostic::warning(message).with_help(help))
}

/// The uncertainty of the pose to expect, that side of the part seen; `None` where the datums do not hold the part.
fn pose(outlook: &Outlook, method: &AlignmentMethod, side: Side) -> Option<PoseUncertainty> {
    let common = outlook.part.map(|part| Common { part, face: part.face(side), settings: &outlook.uncertainty });
    if let AlignmentMethod::BestFit | AlignmentMethod::Regions(_) = method {
        let mut known = fitted_pose(outlook, method, side)?;
        common?.move_best_fit(&mut known);
        return Some(known);
    }
    let positions = outlook.features.iter().map(|f| f.geometry.position());
    let first = outlook.features.first()?.geometry.position();
    let length_mm = positions.map(|p| (p - first).norm()).fold(1.0, f64::max);
    let datums = Datums { method, features: outlook.features, length_mm };
    let expected = Expected::of(outlook.rig);
    let of_datum = |geometry: &Geometry| errors(&expected, geometry).with_settings(geometry, &outlook.uncertainty);
    expected_pose_uncertainty(datums, of_datum, common).ok()
}

/// The same of a fit to the CAD's surface, from the scatter of the points alone.
fn fitted_pose(outlook: &Outlook, method: &AlignmentMethod, side: Side) -> Option<PoseUncertainty> {
    let expected = Expected::of(outlook.rig);
    let part = outlook.part?;
    let face = part.face(side);
    let mm2_per_point = face.mesh.area() / BEST_FIT_POINTS as f64;
    let whole = expected_best_fit(face, expected.thinned_variance_mm4(mm2_per_point));
    let AlignmentMethod::Regions(fit) = method else { return whole };
    let variance_mm4 = |area_mm2: f64| expected.thinned_variance_mm4(area_mm2 / REGION_POINTS as f64);
    expected_region_fit(part, side, fit, whole.as_ref(), variance_mm4)
}

/// What to expect of one datum feature.
fn errors(expected: &Expected, geometry: &Geometry) -> DatumErrors {
    let opening = |axis: &UnitVector3, long: Vector3, std: OpeningStd| {
        let across = axis.cross(&long);
        vec![long * std.along_mm, across * std.across_mm, axis.into_inner() * std.height_mm]
    };
    match geometry {
        Geometry::Hole { axis, diameter_mm, .. } => {
            let std = expected.opening(*diameter_mm, *diameter_mm);
            DatumErrors { shifts: opening(axis, across(axis), std), ..DatumErrors::default() }
        }
        Geometry::Slot { axis, direction, length_mm, width_mm, .. } => {
            let std = expected.opening(*length_mm, *width_mm);
            let turns = vec![axis.into_inner() * std.turn_rad, axis.cross(direction) * std.tilt_rad];
            DatumErrors { shifts: opening(axis, direction.into_inner(), std), turns, ..DatumErrors::default() }
        }
        Geometry::Surface { direction, .. } => {
            DatumErrors { shifts: vec![direction.into_inner() * expected.surface_mm()], ..DatumErrors::default() }
        }
        Geometry::Edge { direction, .. } => {
            DatumErrors { shifts: vec![direction.into_inner() * expected.edge_mm()], ..DatumErrors::default() }
        }
    }
}

/// What the pose's error does to a comparison point, mm (k = 1): along its direction; of a hole that has none along the worst
/// direction in the sheet.
fn error_mm(pose: &PoseUncertainty, geometry: &Geometry) -> f64 {
    let at = |direction: &Vector3| pose.at(&geometry.position(), direction);
    match geometry {
        Geometry::Surface { direction, .. } | Geometry::Edge { direction, .. } | Geometry::Slot { direction, .. } => {
            at(direction)
        }
        Geometry::Hole { direction: Some(direction), .. } => at(direction),
        Geometry::Hole { axis, direction: None, .. } => {
            let x = across(axis);
            let y = axis.cross(&x);
            // Variances along x, y and the diagonal give the covariance.
            let (xx, yy) = (at(&x).powi(2), at(&y).powi(2));
            let xy = at(&((x + y) * std::f64::consts::FRAC_1_SQRT_2)).powi(2) - 0.5 * (xx + yy);
            let worst = decompose::symmetric_eigenvalues(Matrix2::new(xx, xy, xy, yy));
            worst.map_or(f64::NAN, |worst| worst.max().max(0.0).sqrt())
        }
    }
}

/// Some unit vector across another.
fn across(axis: &UnitVector3) -> Vector3 {
    axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize()
}

/// A length with two telling digits.
fn mm(length_mm: f64) -> String {
    let digits = if length_mm >= 0.1 { 2 } else { 3 };
    format!("{length_mm:.digits$} mm")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{BracketParameters, bracket};

    fn demo(reading: SlotReading) -> Plan {
        let mut plan = bracket(&BracketParameters { spacing_mm: 8.0, ..BracketParameters::default() }).plan();
        let AlignmentMethod::Features { slot_reading, .. } = &mut plan.alignment else {
            panic!("the bracket has datums")
        };
        *slot_reading = reading;
        plan
    }

    /// No datum and nothing else can make U smaller than the point's own fit; a plan's contributions add in squares.
    #[test]
    fn a_tolerance_below_the_expected_u_is_told_with_both_figures() {
        let mut plan = demo(SlotReading::CentreLine);
        assert_eq!(tolerance_warnings(&Outlook::of(&plan)), []);
        let u = Outlook::of(&plan).expected_u_mm().unwrap();
        let own = 2.0 * Expected::of(None).surface_mm();
        assert!(u[0] > own && u.iter().all(|u| *u < 0.3), "{u:?}");
        (plan.comparison[0].lower_mm, plan.comparison[0].upper_mm) = (-0.9 * u[0], 0.9 * u[0]);
        (plan.comparison[1].lower_mm, plan.comparison[1].upper_mm) = (-1.1 * u[1], 1.1 * u[1]);
        let told = tolerance_warnings(&Outlook::of(&plan));
        let (name, figure) = (&plan.comparison[0].name, mm(u[0]));
        assert!(told.len() == 1 && told[0].message.contains(name) && told[0].message.contains(&figure), "{told:?}");
        plan.uncertainty.system_mm = 10.0;
        // At the point itself, and at the datums, which lever it.
        let with_system = Outlook::of(&plan).expected().unwrap()[0];
        assert!((with_system.point_mm - own.hypot(20.0)).abs() < 1e-9 && with_system.pose_mm > 10.0);
        assert_eq!(tolerance_warnings(&Outlook::of(&plan)).len(), plan.comparison.len());
        plan.alignment = AlignmentMethod::BestFit;
        plan.uncertainty.system_mm = 0.0;
        assert_eq!(Outlook::of(&plan).expected_u_mm().unwrap()[0], own);
    }

    #[test]
    fn only_the_axis_reading_is_warned_of() {
        assert_eq!(axis_reading_warning(&Outlook::of(&demo(SlotReading::CentreLine))), None);
        let told = axis_reading_warning(&Outlook::of(&demo(SlotReading::Axis))).unwrap().to_string();
        assert!(told.contains("at point \"P0"), "{told}");
    }
}
