//! The plan's alignment: datum features measured in the best fit, solved, measured again in the better pose until
//! nothing moves.

use super::datum::{DatumError, HoleLinePoint, LockRow, MeasuredPlane, solve_hole_line_point, solve_locks};
use super::pose::{BestFit, FeatureAlignment, MeasuredFeature};
use crate::geometry::{CadFromScan, Isometry3, Point3, UnitVector3, Vector3};
use crate::measure::slot::NominalSlot;
use crate::measure::{self, EdgeFound, HoleFound, Local, NotFound, SlotFound, SurfaceFound};
use crate::part::Part;
use crate::plan::{AlignmentMethod, Feature, Geometry, Plan, RpsLock, SlotReading};
use crate::run::{Cancelled, RunContext};
use crate::scan::{ConditionedScan, PointGrid};

/// How well the pose is known: for every datum value the motion of the part when that value is off by its own
/// standard uncertainty. Independent of each other; their squares add.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseUncertainty {
    motions: Vec<Isometry3>,
    pivot: Point3,
}

impl PoseUncertainty {
    /// The point that the alignment holds, CAD frame: errors of scale grow with the distance from it.
    pub fn pivot(&self) -> Point3 {
        self.pivot
    }

    /// Standard uncertainty in mm, along a direction, of where a point of the part lies.
    pub fn at(&self, point_cad: &Point3, direction: &Vector3) -> f64 {
        self.motions.iter().map(|m| (m * point_cad - point_cad).dot(direction).powi(2)).sum::<f64>().sqrt()
    }
}

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
        return Ok((alignment, nothing_known(input)));
    }
    let mut pose = best_fit.cad_from_scan;
    let mut last_shift = f64::INFINITY;
    for _ in 0..MOST_ROUNDS {
        run.check()?;
        let round = match measure_datums(input, best_fit, pose).and_then(|found| {
            let motion = solve(input, &found, None).map_err(|e| (e.to_string(), found.clone()))?;
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
            let mut uncertainty = match pose_uncertainty(input, &found) {
                Ok(uncertainty) => uncertainty,
                Err(error) => return Ok(degraded(input, best_fit, error.to_string(), &found)),
            };
            uncertainty.motions.push(motion);
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

    /// Independent shifts of the position, each by one standard uncertainty: the axes of its covariance.
    fn nudges(&self) -> Vec<Vector3> {
        let covariance = match self {
            Found::Hole(_, hole) => hole.centre_covariance,
            Found::Slot(_, slot) => slot.centre_covariance,
            Found::Surface(_, surface) => return vec![surface.normal * surface.standard_uncertainty_mm],
            Found::Edge(_, edge, outwards) => return vec![outwards.into_inner() * edge.standard_uncertainty_mm],
        };
        let axes = covariance.symmetric_eigen();
        (0..3).map(|k| axes.eigenvectors.column(k) * axes.eigenvalues[k].max(0.0).sqrt()).collect()
    }

    /// Independent turns of a slot's long axis, rad, each by one standard uncertainty.
    fn turns(&self) -> Vec<Vector3> {
        match self {
            Found::Slot(_, slot) => vec![slot.axis * slot.u_direction_rad],
            _ => Vec::new(),
        }
    }
}

/// The features that the plan's alignment uses, each once, in the order of their first mention.
fn datum_indices(method: &AlignmentMethod) -> Vec<usize> {
    match method {
        AlignmentMethod::Features { hole, slot, point, .. } => vec![*hole, *slot, *point],
        AlignmentMethod::Rps(locks) => {
            let mut seen = Vec::new();
            for lock in locks {
                if !seen.contains(&lock.feature) {
                    seen.push(lock.feature);
                }
            }
            seen
        }
        AlignmentMethod::BestFit => Vec::new(),
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

/// Which datum value is moved by how much, to see what it does to the pose.
#[derive(Clone, Copy)]
struct Nudge {
    datum: usize,
    by: Vector3,
}

fn solve(input: &AlignmentInput, found: &[Found], nudge: Option<Nudge>) -> Result<Isometry3, DatumError> {
    let position = |k: usize| match nudge {
        Some(n) if n.datum == k => found[k].position() + n.by,
        _ => found[k].position(),
    };
    let features = &input.plan.features;
    match &input.plan.alignment {
        AlignmentMethod::Features { hole, slot, slot_reading, point } => {
            let (hole_nominal, slot_nominal) =
                (features[*hole].geometry.position(), features[*slot].geometry.position());
            let (line_measured, line_nominal) = match slot_reading {
                SlotReading::CentreLine => (
                    UnitVector3::new_normalize(position(1) - position(0)),
                    UnitVector3::new_normalize(slot_nominal - hole_nominal),
                ),
                SlotReading::Axis => slot_axes(&features[*slot], &found[1], nudge.filter(|n| n.datum == 1)),
            };
            let normal = match &found[2] {
                Found::Surface(_, surface) => UnitVector3::new_normalize(surface.normal),
                _ => UnitVector3::new_normalize(features[*point].geometry.sheet_normal()),
            };
            solve_hole_line_point(&HoleLinePoint {
                hole_measured: position(0),
                hole_nominal,
                line_measured,
                line_nominal,
                surface_measured: MeasuredPlane { point: position(2), normal },
                surface_nominal: features[*point].geometry.position(),
            })
        }
        AlignmentMethod::Rps(locks) => {
            let place = |lock: &RpsLock| found.iter().position(|f| f.index() == lock.feature).unwrap_or(0);
            let rows: Vec<LockRow> = locks
                .iter()
                .map(|lock| LockRow {
                    measured: position(place(lock)),
                    nominal: features[lock.feature].geometry.position(),
                    lock: lock.lock,
                })
                .collect();
            solve_locks(&rows, input.part.diagonal_mm())
        }
        AlignmentMethod::BestFit => Ok(Isometry3::identity()),
    }
}

/// The slot's long axis, measured in the sense of the plan, and nominal. A nudge turns it: its length is read as
/// rad about the nudge's direction.
fn slot_axes(feature: &Feature, found: &Found, nudge: Option<Nudge>) -> (UnitVector3, UnitVector3) {
    let nominal = match &feature.geometry {
        Geometry::Slot { direction, .. } => *direction,
        other => UnitVector3::new_normalize(other.sheet_normal()),
    };
    let measured = match found {
        Found::Slot(_, slot) => {
            let sense = if slot.direction.dot(&nominal) < 0.0 { -1.0 } else { 1.0 };
            UnitVector3::new_normalize(slot.direction * sense)
        }
        _ => nominal,
    };
    match nudge {
        Some(n) => (nalgebra::UnitQuaternion::from_scaled_axis(n.by) * measured, nominal),
        None => (measured, nominal),
    }
}

/// Moves every datum value by its standard uncertainty and keeps what that does to the part.
fn pose_uncertainty(input: &AlignmentInput, found: &[Found]) -> Result<PoseUncertainty, DatumError> {
    let base = solve(input, found, None)?;
    let axis_reading =
        matches!(input.plan.alignment, AlignmentMethod::Features { slot_reading: SlotReading::Axis, .. });
    let mut known = nothing_known(input);
    for (datum, one) in found.iter().enumerate() {
        let slot_axis = axis_reading && matches!(one, Found::Slot(..));
        for by in if slot_axis { one.turns() } else { one.nudges() } {
            let nudged = solve(input, found, Some(Nudge { datum, by }))?;
            known.motions.push(nudged * base.inverse());
        }
    }
    Ok(known)
}

/// No motion yet, and the point that the alignment holds: the hole of the features, else the middle of the part.
fn nothing_known(input: &AlignmentInput) -> PoseUncertainty {
    let pivot = match &input.plan.alignment {
        AlignmentMethod::Features { hole, .. } => input.plan.features[*hole].geometry.position(),
        AlignmentMethod::Rps(_) | AlignmentMethod::BestFit => input.part.bounds.centre(),
    };
    PoseUncertainty { motions: Vec::new(), pivot }
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
    (alignment, nothing_known(input))
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
