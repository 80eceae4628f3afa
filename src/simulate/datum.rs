//! The plan's alignment on the exact features of the actual part: the reference that deviations are told in.
//!
//! Every datum becomes one or more numbers that must vanish (mm); the motion is found by Newton's method with differences
//! of those numbers, whatever their kind. It shares nothing with the program's own alignment.

use super::actual::Actual;
use crate::geometry::{Isometry3, Point3, Vector3, decompose};
use crate::plan::{AlignmentMethod, Geometry, SlotReading};
use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion};

/// Directions are told as displacements at this lever, so that all numbers are mm.
const LEVER_MM: f64 = 100.0;
/// Newton steps; the start is near, four are enough.
const STEPS: usize = 12;

/// The motion that puts the actual part, from its true pose, where the plan's alignment wants it. `None` for a best fit
/// (no exact answer), for a feature that is not there, and for datums that leave a motion free.
pub(super) fn alignment(actual: &Actual) -> Option<Isometry3> {
    if matches!(actual.subject.plan.alignment, AlignmentMethod::BestFit | AlignmentMethod::Regions(_)) {
        return None;
    }
    let centre = actual.subject.plan.features.first()?.geometry.position();
    let mut motion = Isometry3::identity();
    for _ in 0..STEPS {
        let now = open(actual, &motion)?;
        let mut slope = DMatrix::zeros(now.len(), 6);
        for k in 0..6 {
            let mut step = [0.0; 6];
            step[k] = 1e-3;
            let ahead = open(actual, &moved(&step, &centre, &motion))?;
            step[k] = -1e-3;
            let back = open(actual, &moved(&step, &centre, &motion))?;
            slope.set_column(k, &((ahead - back) / 2e-3));
        }
        let svd = decompose::svd(slope, true, true)?;
        if svd.singular_values.min() < 1e-6 * svd.singular_values.max() {
            return None;
        }
        let step = svd.solve(&-now, 0.0).ok()?;
        motion = moved(&std::array::from_fn(|k| step[k]), &centre, &motion);
        if step.norm() < 1e-12 {
            break;
        }
    }
    Some(motion)
}

/// A further motion: translation in mm, and rotation about `centre` in mm at the lever.
fn moved(step: &[f64; 6], centre: &Point3, motion: &Isometry3) -> Isometry3 {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]) / LEVER_MM);
    let about = Isometry3::rotation_wrt_point(turn, *centre);
    Translation3::new(step[0], step[1], step[2]) * about * motion
}

/// The numbers that must vanish, for the part moved so.
fn open(actual: &Actual, motion: &Isometry3) -> Option<DVector<f64>> {
    let plan = &actual.subject.plan;
    let mut numbers = Vec::new();
    match &plan.alignment {
        AlignmentMethod::BestFit | AlignmentMethod::Regions(_) => return None,
        AlignmentMethod::Rps(locks) => {
            for lock in locks {
                let found = actual.feature(lock.feature, motion)?;
                numbers.push((found.place - plan.features[lock.feature].geometry.position()).dot(&lock.lock));
            }
        }
        AlignmentMethod::Features { hole, slot, slot_reading, point } => {
            let nominal = |k: usize| &plan.features[k].geometry;
            let (hole_found, slot_found) = (actual.feature(*hole, motion)?, actual.feature(*slot, motion)?);
            numbers.extend((hole_found.place - nominal(*hole).position()).iter());
            let (is, wanted) = match slot_reading {
                SlotReading::CentreLine => (
                    (slot_found.place - hole_found.place).normalize(),
                    (nominal(*slot).position() - nominal(*hole).position()).normalize(),
                ),
                SlotReading::Axis => {
                    let Geometry::Slot { direction, .. } = nominal(*slot) else { return None };
                    (slot_found.direction?, direction.into_inner())
                }
            };
            let x = super::placing::across(&nalgebra::Unit::new_normalize(wanted));
            numbers.extend([is.dot(&x) * LEVER_MM, is.dot(&wanted.cross(&x)) * LEVER_MM]);
            let found = actual.feature(*point, motion)?;
            numbers.push((found.place - nominal(*point).position()).dot(&found.axis));
        }
    }
    Some(DVector::from_vec(numbers))
}
