//! The plan's alignment: datum features measured in the best fit, solved, measured again in the better pose until
//! nothing moves.

use super::common::Common;
use super::datum::{DatumError, hold_of, solve};
use super::datum_values::{DatumErrors, DatumValue, Datums, datum_indices, pose_uncertainty};
use super::pose::{BestFit, FeatureAlignment, MeasuredFeature, PoseUncertainty};
use super::region_fit::align_on_regions;
use super::rounds::{Rounds, corners};
use crate::geometry::{CadFromScan, Isometry3, Point3, UnitVector3, Vector3, decompose};
use crate::measure::slot::NominalSlot;
use crate::measure::{self, EdgeFound, HoleFound, Local, NotFound, SlotFound, SurfaceFound};
use crate::part::Part;
use crate::plan::{AlignmentMethod, Feature, Geometry, Plan};
use crate::run::{Cancelled, RunContext};
use crate::scan::{ConditionedScan, PointGrid};

/// What the alignment needs to look at.
#[derive(Clone, Copy)]
pub struct AlignmentInput<'a> {
    /// The plan.
    pub plan: &'a Plan,
    /// The CAD.
    pub part: &'a Part,
    /// The scan.
    pub scan: &'a ConditionedScan,
    /// Its kept points by place.
    pub grid: &'a PointGrid,
}

/// How far from its nominal place a datum feature is looked for, mm: the error of the best fit on a deformed part.
pub(super) const DATUM_SEARCH_MM: f64 = 4.0;
/// Rounds of measuring and solving. Two or three suffice: each shrinks the remaining motion by about the ratio of the
/// windows' curvature to the best fit's error.
pub(super) const MOST_ROUNDS: usize = 12;
/// Rounds after which datums keep their weights: what windows tell of their own uncertainty toggles with single points, and more locks
/// than are needed would follow it for ever.
const WEIGHING_ROUNDS: usize = 3;

/// Aligns on the plan's datum features. A feature that cannot be measured leaves the best fit, marked `degraded`.
pub fn align_on_plan(
    input: &AlignmentInput,
    best_fit: &BestFit,
    run: &RunContext,
) -> Result<(FeatureAlignment, PoseUncertainty), Cancelled> {
    if input.plan.alignment == AlignmentMethod::BestFit {
        let (alignment, mut uncertainty) = on_best_fit(best_fit);
        common(input, best_fit).move_best_fit(&mut uncertainty);
        return Ok((alignment, uncertainty));
    }
    if let AlignmentMethod::Regions(fit) = &input.plan.alignment {
        return align_on_regions(input, best_fit, fit, run);
    }
    if let Some(reason) = best_fit.open_face.clone() {
        return Ok(degraded(input, best_fit, Missing { reason, names: Vec::new(), found: Vec::new() }));
    }
    let mut rounds = Rounds::from(best_fit.cad_from_scan, &input.part.bounds);
    let mut last = Vec::new();
    let mut weights: Vec<DatumErrors> = Vec::new();
    for round in 0..MOST_ROUNDS {
        run.check()?;
        let found = match measure_datums(input, best_fit, rounds.pose(), run)? {
            Ok(found) => found,
            Err(missing) => return Ok(degraded(input, best_fit, missing)),
        };
        let mut values = values(input, &found);
        if round < WEIGHING_ROUNDS {
            weights = values.iter().map(|value| value.errors.clone()).collect();
        }
        values.iter_mut().zip(&weights).for_each(|(value, errors)| value.errors.clone_from(errors));
        let motion = match solve(datums(input), &values, None) {
            Ok(held) => held.motion,
            Err(error) => return Ok(degraded(input, best_fit, Missing::because(error, found))),
        };
        rounds.add(&motion);
        last = found;
        if rounds.have_settled() {
            return ended(input, best_fit, rounds.pose(), &last, &[motion], run);
        }
    }
    if let Some(cycle) = rounds.cycle()
        && let Ok(uncertainty) = uncertainty_of(input, best_fit, &last)
        && cycle.iter().all(|motion| is_within(input.part, motion, &uncertainty))
    {
        return ended(input, best_fit, rounds.pose(), &last, &cycle, run);
    }
    let moved = rounds.last_moved_mm();
    let reason = format!("the datum features did not settle: the last round still moved the part by {moved:.3} mm");
    Ok(degraded(input, best_fit, Missing { reason, names: Vec::new(), found: Vec::new() }))
}

/// The best fit as the alignment that the plan asks for.
fn on_best_fit(best_fit: &BestFit) -> (FeatureAlignment, PoseUncertainty) {
    let alignment = FeatureAlignment {
        method: "best_fit",
        cad_from_scan: best_fit.cad_from_scan,
        degraded: best_fit.open_face.clone().or_else(|| best_fit.left_undone()),
        missing: Vec::new(),
        features: Vec::new(),
        hold: None,
    };
    (alignment, best_fit.uncertainty.clone())
}

/// Whether no corner of the part's box moves further than two standard uncertainties: two values of the same datum, told in two
/// windows, may be that far apart.
fn is_within(part: &Part, motion: &Isometry3, known: &PoseUncertainty) -> bool {
    corners(&part.bounds).iter().all(|c| (motion * c - c).norm() <= 2.0 * known.anywhere_at(c))
}

/// The alignment once its rounds have ended, `unsure` being motions that they left open: parts of its uncertainty.
fn ended(
    input: &AlignmentInput,
    best_fit: &BestFit,
    pose: CadFromScan,
    found: &[Found],
    unsure: &[Isometry3],
    run: &RunContext,
) -> Result<(FeatureAlignment, PoseUncertainty), Cancelled> {
    run.check()?;
    let mut uncertainty = match uncertainty_of(input, best_fit, found) {
        Ok(uncertainty) => uncertainty,
        Err(error) => return Ok(degraded(input, best_fit, Missing::because(error, found.to_vec()))),
    };
    unsure.iter().for_each(|motion| uncertainty.add(*motion));
    run.check()?;
    let features = match measure_datums(input, best_fit, pose, run)? {
        Ok(found) => report(input, &found),
        Err(missing) => return Ok(degraded(input, best_fit, missing)),
    };
    let method = method_key(&input.plan.alignment);
    let hold = solve(datums(input), &values(input, found), None).ok().map(|held| hold_of(datums(input), &held));
    let alignment =
        FeatureAlignment { method, cad_from_scan: pose, degraded: None, missing: Vec::new(), features, hold };
    Ok((alignment, uncertainty))
}

/// Why the plan's alignment is not possible.
pub(super) struct Missing {
    pub reason: String,
    /// Datums that could not be measured.
    pub names: Vec<String>,
    /// Those that could.
    pub found: Vec<Found>,
}

impl Missing {
    fn because(error: DatumError, found: Vec<Found>) -> Self {
        Self { reason: error.to_string(), names: Vec::new(), found }
    }
}

fn method_key(method: &AlignmentMethod) -> &'static str {
    match method {
        AlignmentMethod::Features { .. } => "features",
        AlignmentMethod::Rps(_) => "rps",
        AlignmentMethod::BestFit | AlignmentMethod::Regions(_) => "best_fit",
    }
}

/// A datum feature as measured, with its index in the plan.
#[derive(Debug, Clone)]
pub(super) enum Found {
    Hole(usize, HoleFound),
    Slot(usize, SlotFound),
    Surface(usize, SurfaceFound),
    /// With the plan's outward direction, along which it was measured.
    Edge(usize, EdgeFound, UnitVector3),
}

impl Found {
    fn index(&self) -> usize {
        match self {
            Found::Hole(k, _) | Found::Slot(k, _) | Found::Surface(k, _) | Found::Edge(k, ..) => *k,
        }
    }

    fn position(&self) -> Point3 {
        match self {
            Found::Hole(_, hole) => hole.centre,
            Found::Slot(_, slot) => slot.centre,
            Found::Surface(_, surface) => surface.position,
            Found::Edge(_, edge, _) => edge.position,
        }
    }

    /// What the alignment uses of it.
    fn value(&self, plan: &Plan) -> DatumValue {
        let (direction, normal) = match self {
            Found::Slot(_, slot) => (Some(UnitVector3::new_normalize(slot.direction)), None),
            Found::Surface(_, surface) => (None, Some(UnitVector3::new_normalize(surface.normal))),
            Found::Hole(..) | Found::Edge(..) => (None, None),
        };
        let geometry = &plan.features[self.index()].geometry;
        let scatter = DatumErrors { shifts: self.shifts(geometry), turns: self.turns(), ..DatumErrors::default() };
        let errors = scatter.with_settings(geometry, &plan.uncertainty);
        DatumValue { index: self.index(), position: self.position(), direction, normal, errors }
    }

    /// Independent shifts of the position, each by one standard uncertainty, from the points alone: the axes of its covariance,
    /// or the directions in which it was told.
    fn shifts(&self, geometry: &Geometry) -> Vec<Vector3> {
        let covariance = match self {
            Found::Hole(_, hole) => hole.centre_covariance,
            Found::Slot(_, slot) => slot.centre_covariance,
            Found::Surface(_, surface) => {
                let direction = match geometry {
                    Geometry::Surface { direction, .. } => direction.into_inner(),
                    _ => surface.normal,
                };
                return vec![direction * surface.standard_uncertainty_mm];
            }
            Found::Edge(_, edge, outwards) => {
                return vec![outwards.into_inner() * edge.standard_uncertainty_mm, edge.normal * edge.u_height_mm];
            }
        };
        // What is not a number is told as such by the datums' equations.
        let Some(axes) = decompose::symmetric_eigen(covariance) else { return vec![Vector3::repeat(f64::NAN)] };
        (0..3).map(|k| axes.eigenvectors.column(k) * axes.eigenvalues[k].max(0.0).sqrt()).collect()
    }

    /// Independent turns of a slot's long axis, rad, each by one standard uncertainty: in the sheet and out of it. Turning
    /// the sheet about the long axis leaves that where it is.
    fn turns(&self) -> Vec<Vector3> {
        match self {
            Found::Slot(_, slot) => {
                vec![slot.axis * slot.u_direction_rad, slot.axis.cross(&slot.direction) * slot.u_tilt_rad]
            }
            _ => Vec::new(),
        }
    }
}

/// Measures every datum.
fn measure_datums(
    input: &AlignmentInput,
    best_fit: &BestFit,
    pose: CadFromScan,
    run: &RunContext,
) -> Result<Result<Vec<Found>, Missing>, Cancelled> {
    let local = Local {
        part: input.part,
        face: input.part.face(best_fit.face),
        scan: input.scan,
        grid: input.grid,
        cad_from_scan: pose,
        uncertainty: &input.plan.uncertainty,
    };
    let mut found = Vec::new();
    let (mut names, mut reasons) = (Vec::new(), Vec::new());
    for index in datum_indices(&input.plan.alignment) {
        run.check()?;
        let feature = &input.plan.features[index];
        match measure_one(&local, feature, index) {
            Ok(one) => found.push(one),
            Err(not) => {
                reasons.push(format!("datum {} not measured: {}", feature.name, not.reason));
                names.push(feature.name.clone());
            }
        }
    }
    Ok(if names.is_empty() { Ok(found) } else { Err(Missing { reason: reasons.join("; "), names, found }) })
}

fn measure_one(local: &Local, feature: &Feature, index: usize) -> Result<Found, NotFound> {
    match &feature.geometry {
        Geometry::Hole { centre, axis, diameter_mm, .. } => {
            measure::hole(local, centre, axis, *diameter_mm, DATUM_SEARCH_MM).map(|hole| Found::Hole(index, hole))
        }
        Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
            let nominal = NominalSlot {
                centre: *centre,
                axis: *axis,
                direction: *direction,
                length_mm: *length_mm,
                width_mm: *width_mm,
            };
            measure::slot(local, &nominal, DATUM_SEARCH_MM).map(|slot| Found::Slot(index, slot))
        }
        Geometry::Surface { position, direction } => {
            measure::surface(local, position, direction, DATUM_SEARCH_MM).map(|surface| Found::Surface(index, surface))
        }
        Geometry::Edge { position, direction, normal } => {
            measure::edge(local, position, direction, normal, DATUM_SEARCH_MM)
                .map(|edge| Found::Edge(index, edge, *direction))
        }
    }
}

fn uncertainty_of(input: &AlignmentInput, best_fit: &BestFit, found: &[Found]) -> Result<PoseUncertainty, DatumError> {
    let mut values = values(input, found);
    common(input, best_fit).displace(&mut values, &input.plan.features);
    pose_uncertainty(datums(input), &values, input.part.bounds.centre())
}

/// What the plan states of errors that everything has in common.
pub(super) fn common<'a>(input: &AlignmentInput<'a>, best_fit: &BestFit) -> Common<'a> {
    let AlignmentInput { plan, part, .. } = *input;
    Common { part, face: part.face(best_fit.face), settings: &plan.uncertainty }
}

fn datums<'a>(input: &AlignmentInput<'a>) -> Datums<'a> {
    let AlignmentInput { plan, part, .. } = *input;
    Datums { method: &plan.alignment, features: &plan.features, length_mm: part.diagonal_mm() }
}

fn values(input: &AlignmentInput, found: &[Found]) -> Vec<DatumValue> {
    found.iter().map(|one| one.value(input.plan)).collect()
}

pub(super) fn degraded(
    input: &AlignmentInput,
    best_fit: &BestFit,
    missing: Missing,
) -> (FeatureAlignment, PoseUncertainty) {
    let alignment = FeatureAlignment {
        method: "best_fit",
        cad_from_scan: best_fit.cad_from_scan,
        degraded: Some(missing.reason),
        missing: missing.names,
        features: report(input, &missing.found),
        hold: None,
    };
    (alignment, PoseUncertainty::none(input.part.bounds.centre()))
}

fn report(input: &AlignmentInput, found: &[Found]) -> Vec<MeasuredFeature> {
    found.iter().map(|one| report_one(input, one)).collect()
}

fn report_one(input: &AlignmentInput, one: &Found) -> MeasuredFeature {
    let feature = &input.plan.features[one.index()];
    let fixes = fixes_in_words(&input.plan.alignment, one.index());
    let (nominal_diameter_mm, nominal_length_mm) = match &feature.geometry {
        Geometry::Hole { diameter_mm, .. } => (Some(*diameter_mm), None),
        Geometry::Slot { length_mm, width_mm, .. } => (Some(*width_mm), Some(*length_mm)),
        _ => (None, None),
    };
    let blank = MeasuredFeature {
        name: feature.name.clone(),
        kind: feature.geometry.kind(),
        fixes,
        centre: one.position(),
        axis: feature.geometry.sheet_normal(),
        direction: None,
        diameter_mm: None,
        length_mm: None,
        nominal_diameter_mm,
        nominal_length_mm,
        points_used: 0,
        rms_mm: 0.0,
        warning: None,
    };
    match one {
        Found::Hole(_, hole) => MeasuredFeature {
            axis: hole.axis,
            diameter_mm: Some(hole.diameter_mm),
            points_used: hole.points_used,
            rms_mm: hole.rms_mm,
            warning: hole.warning.clone(),
            ..blank
        },
        Found::Slot(_, slot) => MeasuredFeature {
            axis: slot.axis,
            direction: Some(slot.direction),
            diameter_mm: Some(slot.width_mm),
            length_mm: Some(slot.length_mm),
            points_used: slot.points_used,
            rms_mm: slot.rms_mm,
            warning: slot.warning.clone(),
            ..blank
        },
        Found::Surface(_, surface) => {
            MeasuredFeature { points_used: surface.points_used, rms_mm: surface.rms_mm, ..blank }
        }
        Found::Edge(_, edge, outwards) => MeasuredFeature {
            direction: Some(outwards.into_inner()),
            points_used: edge.points_used,
            rms_mm: edge.rms_mm,
            ..blank
        },
    }
}

fn fixes_in_words(method: &AlignmentMethod, index: usize) -> String {
    match method {
        AlignmentMethod::Features { hole, slot, .. } => match index {
            k if k == *hole => "three translations".into(),
            k if k == *slot => "two rotations".into(),
            _ => "one rotation".into(),
        },
        AlignmentMethod::Rps(locks) => match locks.iter().filter(|lock| lock.feature == index).count() {
            1 => "one lock".into(),
            n => format!("{n} locks"),
        },
        AlignmentMethod::BestFit | AlignmentMethod::Regions(_) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::UncertaintySettings;
    use crate::simulate::{BracketParameters, bracket};

    fn best_fit(converged: bool) -> BestFit {
        let mut uncertainty = PoseUncertainty::none(Point3::origin());
        uncertainty.add(Isometry3::translation(0.01, 0.0, 0.0));
        BestFit {
            cad_from_scan: CadFromScan::new(Isometry3::identity()),
            side: None,
            face: crate::plan::Side::Top,
            rms_mm: 0.1,
            inlier_ratio: 0.9,
            margin: 3.0,
            margin_limit: 1.5,
            poses_tried: 10,
            uncertainty,
            converged,
            unfinished_mm: 0.25,
            open_face: None,
        }
    }

    #[test]
    fn nothing_is_judged_in_a_best_fit_that_did_not_settle() {
        let (alignment, _) = on_best_fit(&best_fit(false));
        let reason = alignment.degraded.unwrap();
        assert!(reason.contains("did not settle") && reason.contains("0.250 mm"), "{reason}");
        assert_eq!(on_best_fit(&best_fit(true)).0.degraded, None);
    }

    fn edge_found() -> EdgeFound {
        EdgeFound {
            position: Point3::origin(),
            normal: Vector3::z(),
            deviation_mm: 0.0,
            standard_uncertainty_mm: 0.02,
            u_height_mm: 0.007,
            rms_mm: 0.03,
            points_used: 100,
        }
    }

    /// A lock along the sheet's normal uses the sheet's height at the edge.
    #[test]
    fn an_edge_datum_is_uncertain_along_the_sheets_normal_too() {
        let x = Vector3::x_axis();
        let geometry = Geometry::Edge { position: Point3::origin(), direction: x, normal: Vector3::z_axis() };
        let shifts = Found::Edge(0, edge_found(), x).shifts(&geometry);
        let along = |d: Vector3| shifts.iter().map(|s| s.dot(&d).powi(2)).sum::<f64>().sqrt();
        assert!((along(Vector3::z()) - 0.007).abs() < 1e-12 && (along(Vector3::x()) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_datum_is_as_uncertain_as_the_plan_says_the_measuring_system_is() {
        let mut plan = bracket(&BracketParameters { spacing_mm: 8.0, ..BracketParameters::default() }).plan();
        plan.features[0].geometry =
            Geometry::Edge { position: Point3::origin(), direction: Vector3::x_axis(), normal: Vector3::z_axis() };
        plan.uncertainty = UncertaintySettings { system_mm: 0.03, edge_offset_u_mm: 0.04, ..plan.uncertainty };
        let errors = Found::Edge(0, edge_found(), Vector3::x_axis()).value(&plan).errors;
        let along = |d: Vector3| errors.shifts.iter().map(|s| s.dot(&d).powi(2)).sum::<f64>().sqrt();
        let found = [Vector3::x(), Vector3::y(), Vector3::z()].map(along);
        for (found, expected) in found.into_iter().zip([0.02_f64.hypot(0.03), 0.03, 0.007_f64.hypot(0.03)]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert_eq!(errors.edge_offset, Vector3::x() * 0.04);
    }

    /// The uncertainty of a surface point is one along the plan's direction, which may lean by up to 60 degrees.
    #[test]
    fn a_surface_datum_is_uncertain_along_the_plans_direction() {
        let direction = UnitVector3::new_normalize(Vector3::new(0.0, 0.6, 0.8));
        let geometry = Geometry::Surface { position: Point3::origin(), direction };
        let found = SurfaceFound {
            position: Point3::origin(),
            normal: Vector3::z(),
            deviation_mm: 0.0,
            standard_uncertainty_mm: 0.01,
            window_mm: 5.0,
            rms_mm: 0.03,
            points_used: 100,
        };
        let shifts = Found::Surface(0, found).shifts(&geometry);
        assert!(shifts.len() == 1 && (shifts[0] - direction.into_inner() * 0.01).norm() < 1e-12, "{shifts:?}");
    }
}
