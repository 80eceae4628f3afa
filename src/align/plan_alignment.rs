//! The plan's alignment: datum features measured in the best fit, solved, measured again in the better pose until
//! nothing moves.

use super::datum::DatumError;
use super::datum_values::{DatumErrors, DatumValue, Datums, datum_indices, pose_uncertainty, solve};
use super::pose::{BestFit, FeatureAlignment, MeasuredFeature, PoseUncertainty};
use crate::geometry::{CadFromScan, Isometry3, Point3, UnitVector3, Vector3};
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
const DATUM_SEARCH_MM: f64 = 4.0;
/// Rounds of measuring and solving. Two or three suffice: each shrinks the remaining motion by about the ratio of the
/// windows' curvature to the best fit's error.
const MOST_ROUNDS: usize = 12;
/// A round that moves no corner of the part's box by more than this ends the iteration, mm.
const SETTLED_MM: f64 = 1e-6;

/// Aligns on the plan's datum features. A feature that cannot be measured leaves the best fit, marked `degraded`.
pub fn align_on_plan(
    input: &AlignmentInput,
    best_fit: &BestFit,
    run: &RunContext,
) -> Result<(FeatureAlignment, PoseUncertainty), Cancelled> {
    if input.plan.alignment == AlignmentMethod::BestFit {
        let alignment = FeatureAlignment {
            method: "best_fit",
            cad_from_scan: best_fit.cad_from_scan,
            degraded: None,
            features: Vec::new(),
        };
        return Ok((alignment, best_fit.uncertainty.clone()));
    }
    let mut pose = best_fit.cad_from_scan;
    let mut last_shift = f64::INFINITY;
    for _ in 0..MOST_ROUNDS {
        run.check()?;
        let round = match measure_datums(input, best_fit, pose).and_then(|found| {
            let motion = solved(input, &found).map_err(|e| (e.to_string(), found.clone()))?;
            Ok((found, motion))
        }) {
            Ok(round) => round,
            Err((reason, found)) => return Ok(degraded(input, best_fit, reason, &found)),
        };
        let (found, motion) = round;
        pose = CadFromScan::new(motion * pose.isometry());
        let shift = largest_corner_shift(input.part, &motion);
        // Windows of whole points toggle single points in and out; once the motion no longer shrinks it is that
        // toggling, far below the noise, and going on would only wander.
        if shift < SETTLED_MM || (shift < 0.01 && shift > 0.5 * last_shift) {
            let mut uncertainty = match uncertainty_of(input, &found) {
                Ok(uncertainty) => uncertainty,
                Err(error) => return Ok(degraded(input, best_fit, error.to_string(), &found)),
            };
            uncertainty.add(motion);
            let features = match measure_datums(input, best_fit, pose) {
                Ok(found) => report(input, &found),
                Err((reason, found)) => return Ok(degraded(input, best_fit, reason, &found)),
            };
            let method = method_key(&input.plan.alignment);
            let alignment = FeatureAlignment { method, cad_from_scan: pose, degraded: None, features };
            return Ok((alignment, uncertainty));
        }
        last_shift = shift;
    }
    let reason =
        format!("the datum features did not settle: the last round still moved the part by {last_shift:.3} mm");
    Ok(degraded(input, best_fit, reason, &[]))
}

fn method_key(method: &AlignmentMethod) -> &'static str {
    match method {
        AlignmentMethod::Features { .. } => "features",
        AlignmentMethod::Rps(_) => "rps",
        AlignmentMethod::BestFit => "best_fit",
    }
}

/// A datum feature as measured, with its index in the plan.
#[derive(Debug, Clone)]
enum Found {
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
    fn value(&self) -> DatumValue {
        let (direction, normal) = match self {
            Found::Slot(_, slot) => (Some(UnitVector3::new_normalize(slot.direction)), None),
            Found::Surface(_, surface) => (None, Some(UnitVector3::new_normalize(surface.normal))),
            Found::Hole(..) | Found::Edge(..) => (None, None),
        };
        let errors = DatumErrors { shifts: self.shifts(), turns: self.turns() };
        DatumValue { index: self.index(), position: self.position(), direction, normal, errors }
    }

    /// Independent shifts of the position, each by one standard uncertainty: the axes of its covariance.
    fn shifts(&self) -> Vec<Vector3> {
        let covariance = match self {
            Found::Hole(_, hole) => hole.centre_covariance,
            Found::Slot(_, slot) => slot.centre_covariance,
            Found::Surface(_, surface) => return vec![surface.normal * surface.standard_uncertainty_mm],
            Found::Edge(_, edge, outwards) => return vec![outwards.into_inner() * edge.standard_uncertainty_mm],
        };
        let axes = covariance.symmetric_eigen();
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

/// Measures every datum; the error carries the reason and what was measured before it.
fn measure_datums(
    input: &AlignmentInput,
    best_fit: &BestFit,
    pose: CadFromScan,
) -> Result<Vec<Found>, (String, Vec<Found>)> {
    let local = Local {
        part: input.part,
        face: input.part.face(best_fit.face),
        scan: input.scan,
        grid: input.grid,
        cad_from_scan: pose,
        uncertainty: &input.plan.uncertainty,
    };
    let mut found = Vec::new();
    let mut missing = Vec::new();
    for index in datum_indices(&input.plan.alignment) {
        let feature = &input.plan.features[index];
        match measure_one(&local, feature, index) {
            Ok(one) => found.push(one),
            Err(not) => missing.push(format!("datum {} not measured: {}", feature.name, not.reason)),
        }
    }
    if missing.is_empty() { Ok(found) } else { Err((missing.join("; "), found)) }
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

/// The motion that the datums ask for.
fn solved(input: &AlignmentInput, found: &[Found]) -> Result<Isometry3, DatumError> {
    solve(datums(input), &values(found))
}

fn uncertainty_of(input: &AlignmentInput, found: &[Found]) -> Result<PoseUncertainty, DatumError> {
    pose_uncertainty(datums(input), &values(found), pivot(input))
}

fn datums<'a>(input: &AlignmentInput<'a>) -> Datums<'a> {
    let AlignmentInput { plan, part, .. } = *input;
    Datums { method: &plan.alignment, features: &plan.features, length_mm: part.diagonal_mm() }
}

fn values(found: &[Found]) -> Vec<DatumValue> {
    found.iter().map(Found::value).collect()
}

/// The point that the alignment holds: the hole of the features, else the middle of the part.
fn pivot(input: &AlignmentInput) -> Point3 {
    match &input.plan.alignment {
        AlignmentMethod::Features { hole, .. } => input.plan.features[*hole].geometry.position(),
        AlignmentMethod::Rps(_) | AlignmentMethod::BestFit => input.part.bounds.centre(),
    }
}

fn largest_corner_shift(part: &Part, motion: &Isometry3) -> f64 {
    let (min, max) = (part.bounds.min, part.bounds.max);
    (0..8)
        .map(|k| {
            let corner = Point3::new(
                if k & 1 == 0 { min.x } else { max.x },
                if k & 2 == 0 { min.y } else { max.y },
                if k & 4 == 0 { min.z } else { max.z },
            );
            (motion * corner - corner).norm()
        })
        .fold(0.0, f64::max)
}

fn degraded(
    input: &AlignmentInput,
    best_fit: &BestFit,
    reason: String,
    found: &[Found],
) -> (FeatureAlignment, PoseUncertainty) {
    let alignment = FeatureAlignment {
        method: "best_fit",
        cad_from_scan: best_fit.cad_from_scan,
        degraded: Some(reason),
        features: report(input, found),
    };
    (alignment, PoseUncertainty::none(pivot(input)))
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
    };
    match one {
        Found::Hole(_, hole) => MeasuredFeature {
            axis: hole.axis,
            diameter_mm: Some(hole.diameter_mm),
            points_used: hole.points_used,
            rms_mm: hole.rms_mm,
            ..blank
        },
        Found::Slot(_, slot) => MeasuredFeature {
            axis: slot.axis,
            direction: Some(slot.direction),
            diameter_mm: Some(slot.width_mm),
            length_mm: Some(slot.length_mm),
            points_used: slot.points_used,
            rms_mm: slot.rms_mm,
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
        AlignmentMethod::BestFit => String::new(),
    }
}
