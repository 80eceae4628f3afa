//! The features that camera and projector were calibrated with: marks of a board that was held into the volume in many poses.

use super::sensor::SensorModel;
use super::{Stream, stream};
use crate::geometry::{Isometry3, Point3, Vector3};
use nalgebra::{Translation3, UnitQuaternion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A mark that was used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationMark {
    /// Where it was, view frame.
    pub position: Point3,
    /// Norm of its reprojection error, pixels.
    pub reprojection_px: f32,
}

/// The volume that is calibrated.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedVolume {
    /// Marks that the camera saw.
    pub camera: Vec<CalibrationMark>,
    /// Marks whose place in the projector's picture is known: fewer, and not up to where its light ends.
    pub projector: Vec<CalibrationMark>,
}

/// The board leans by up to this in the hand.
const LEAN_RAD: f64 = 0.1;
/// Marks that were missed.
const MISSED: f64 = 0.05;
/// Reprojection error along each axis, pixels.
const REPROJECTION_PX: f64 = 0.1;

impl CalibratedVolume {
    /// Calibrates a sensor; another seed is another calibration.
    pub fn new(sensor: &SensorModel, seed: u64) -> Self {
        let mut rng = stream(seed, Stream::Boards);
        let mut volume = Self { camera: Vec::new(), projector: Vec::new() };
        for board in 0..sensor.boards {
            let view_from_board = held(sensor, board, &mut rng);
            let reach = (sensor.calibrated_radius / sensor.board_pitch).ceil() as i32 + 1;
            for (k, l) in (-reach..=reach).flat_map(|k| (-reach..=reach).map(move |l| (k, l))) {
                let flat = Point3::new(f64::from(k), f64::from(l), 0.0) * sensor.board_pitch;
                let position = view_from_board * flat;
                // The light comes from the side of x: what lies far on the other side it does not reach.
                let [seen, lit] = [0.0, 0.15 * sensor.calibrated_radius]
                    .map(|shift| (position.x - shift).hypot(position.y) < sensor.calibrated_radius);
                for (inside, marks) in [(seen, &mut volume.camera), (seen && lit, &mut volume.projector)] {
                    let error = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng)) * REPROJECTION_PX;
                    if rng.random::<f64>() >= MISSED && inside {
                        marks.push(CalibrationMark { position, reprojection_px: error.xy().norm() as f32 });
                    }
                }
            }
        }
        volume
    }
}

/// Where the board was held.
fn held(sensor: &SensorModel, board: u32, rng: &mut ChaCha8Rng) -> Isometry3 {
    let mut even = |reach: f64| reach * (2.0 * rng.random::<f64>() - 1.0);
    let step = 2.0 * (f64::from(board) + 0.5) / f64::from(sensor.boards) - 1.0;
    let shift = [even(0.5 * sensor.board_pitch), even(0.5 * sensor.board_pitch)];
    let turn = Vector3::new(even(LEAN_RAD), even(LEAN_RAD), even(std::f64::consts::FRAC_PI_4));
    let place = Translation3::new(shift[0], shift[1], sensor.working_distance + step * sensor.calibrated_depth);
    Isometry3::from_parts(place, UnitQuaternion::new(turn))
}

/// Distance to the nearest mark, and that mark, by looking at every one.
pub(super) fn nearest<'a>(marks: &'a [CalibrationMark], place: &Point3) -> Option<(f64, &'a CalibrationMark)> {
    let mut best: Option<(f64, &CalibrationMark)> = None;
    for mark in marks {
        let squared = (mark.position - place).norm_squared();
        if best.is_none_or(|(least, _)| squared < least) {
            best = Some((squared, mark));
        }
    }
    best.map(|(squared, mark)| (squared.sqrt(), mark))
}
