//! The alignment on the plan's datum features: pure geometry, no cloud.
//!
//! The paper's scheme (Bergström et al., SIVPRO, section 5.2) holds the hole's centre (three translations), a direction
//! (two rotations) and the surface point along its direction (the last rotation). Any other scheme is a set of rows
//! `lock · (T measured - nominal) = 0`, solved by Gauss-Newton; six independent rows are met exactly, more in the sense
//! of least squares.
//!
//! Everything is in the CAD frame as the current pose has it; the answer is the motion `corrected_from_current`. It is
//! solved about the nominal hole, or the middle of the locks: however far from the CAD's origin the part was drawn, the numbers
//! at hand are of its size, and so is their rounding, which tells where an iteration has to end.

use crate::geometry::{Isometry3, Point3, UnitVector3, Vector3};
use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion, Vector6};

/// A measured surface near a datum point: the tangent plane of what was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPlane {
    /// A point of it.
    pub point: Point3,
    /// Its unit normal.
    pub normal: UnitVector3,
}

/// Measured and nominal values of the hole, the direction and the surface point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoleLinePoint {
    /// Hole centre as measured.
    pub hole_measured: Point3,
    /// Hole centre of the plan.
    pub hole_nominal: Point3,
    /// Direction as measured: hole to slot, or the slot's long axis in the plan's sense.
    pub line_measured: UnitVector3,
    /// The same in the plan.
    pub line_nominal: UnitVector3,
    /// Surface as measured near the surface point.
    pub surface_measured: MeasuredPlane,
    /// Surface point of the plan.
    pub surface_nominal: Point3,
}

/// Why datums do not fix a part.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatumError {
    /// The surface point does not resist the turn about the line.
    #[error(
        "the surface point cannot stop the turn about the datum line: its lever is {lever_mm:.3} mm along its normal, at least {needed_mm:.1} mm are needed"
    )]
    NoLever {
        /// Movement along the surface normal per rad, mm.
        lever_mm: f64,
        /// The least that is accepted.
        needed_mm: f64,
    },
    /// The rows leave a motion free.
    #[error("the locks leave a motion free: {motion}")]
    FreeMotion {
        /// The motion in words.
        motion: String,
    },
    /// The iteration did not settle.
    #[error("the datum equations did not settle after {iterations} steps")]
    NotConverged {
        /// How many were made.
        iterations: usize,
    },
}

/// The least lever of the surface point about the datum line, mm per rad along the surface normal.
const LEAST_LEVER_MM: f64 = 1.0;

/// Rounding of lengths of a size, after a few dozen operations, mm.
fn rounding_mm(size_mm: f64) -> f64 {
    32.0 * f64::EPSILON * size_mm
}

/// A motion told about another origin, in the frame of which that origin is given.
fn about(origin: &Point3, motion: &Isometry3) -> Isometry3 {
    let shift = origin.coords + motion.translation.vector - motion.rotation * origin.coords;
    Isometry3::from_parts(Translation3::from(shift), motion.rotation)
}

/// Solves the paper's scheme exactly.
pub fn solve_hole_line_point(d: &HoleLinePoint) -> Result<Isometry3, DatumError> {
    let origin = d.hole_nominal;
    let here = |p: &Point3| Point3::from(p - origin);
    let local = HoleLinePoint {
        hole_measured: here(&d.hole_measured),
        hole_nominal: Point3::origin(),
        surface_measured: MeasuredPlane { point: here(&d.surface_measured.point), ..d.surface_measured },
        surface_nominal: here(&d.surface_nominal),
        ..*d
    };
    solve_about_hole(&local).map(|motion| about(&origin, &motion))
}

/// The same where the nominal hole is the origin.
fn solve_about_hole(d: &HoleLinePoint) -> Result<Isometry3, DatumError> {
    let align = UnitQuaternion::rotation_between(&d.line_measured, &d.line_nominal).unwrap_or_else(|| {
        let side = any_perpendicular(&d.line_nominal);
        UnitQuaternion::from_axis_angle(&side, std::f64::consts::PI)
    });
    let to_nominal = |rotation: UnitQuaternion<f64>| {
        let shift = -(rotation * d.hole_measured.coords);
        Isometry3::from_parts(Translation3::from(shift), rotation)
    };
    let size_mm =
        d.hole_measured.coords.norm() + d.surface_measured.point.coords.norm() + d.surface_nominal.coords.norm();
    let exact_mm = rounding_mm(size_mm).max(1e-12);
    let mut angle = 0.0;
    for _ in 0..50 {
        let turn = UnitQuaternion::from_axis_angle(&d.line_nominal, angle);
        let motion = to_nominal(turn * align);
        let point = motion * d.surface_measured.point;
        let normal = motion * d.surface_measured.normal.into_inner();
        let gap = (point - d.surface_nominal).dot(&normal);
        // d/dangle of (point - nominal)·normal: both turn about the line through the hole.
        let lever = d.line_nominal.cross(&d.surface_nominal.coords).dot(&normal);
        if lever.abs() < LEAST_LEVER_MM {
            return Err(DatumError::NoLever { lever_mm: lever.abs(), needed_mm: LEAST_LEVER_MM });
        }
        if gap.abs() < exact_mm {
            return Ok(motion);
        }
        angle -= gap / lever;
        if angle.abs() > 1.0 {
            break;
        }
        if (gap / lever).abs() < 1e-16 {
            return Ok(to_nominal(UnitQuaternion::from_axis_angle(&d.line_nominal, angle) * align));
        }
    }
    Err(DatumError::NotConverged { iterations: 50 })
}

/// One lock: the measured point is held at its nominal place along one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LockRow {
    /// As measured.
    pub measured: Point3,
    /// As in the plan.
    pub nominal: Point3,
    /// Direction, CAD frame.
    pub lock: UnitVector3,
}

/// Solves any set of locks. Rotations are scaled by `length_mm` (the part's size), so that the condition has a meaning.
pub fn solve_locks(rows: &[LockRow], length_mm: f64) -> Result<Isometry3, DatumError> {
    let sum = rows.iter().fold(Vector3::zeros(), |sum, r| sum + r.nominal.coords);
    let middle = Point3::from(sum / rows.len().max(1) as f64);
    let here = |p: &Point3| Point3::from(p - middle);
    let local: Vec<LockRow> =
        rows.iter().map(|r| LockRow { measured: here(&r.measured), nominal: here(&r.nominal), lock: r.lock }).collect();
    solve_about_middle(&local, length_mm).map(|motion| about(&middle, &motion))
}

/// The same where the middle of the nominal places is the origin.
fn solve_about_middle(rows: &[LockRow], length_mm: f64) -> Result<Isometry3, DatumError> {
    let mut motion = Isometry3::identity();
    let size_mm = rows.iter().map(|r| r.measured.coords.norm() + r.nominal.coords.norm()).fold(length_mm, f64::max);
    const STEPS: usize = 50;
    for _ in 0..STEPS {
        let mut matrix = DMatrix::zeros(rows.len().max(6), 6);
        let mut right = DVector::zeros(rows.len().max(6));
        for (k, row) in rows.iter().enumerate() {
            let point = motion * row.measured;
            let turn = point.coords.cross(&row.lock) / length_mm;
            for c in 0..3 {
                matrix[(k, c)] = row.lock[c];
                matrix[(k, c + 3)] = turn[c];
            }
            right[k] = -row.lock.dot(&(point - row.nominal));
        }
        let svd = matrix.svd(true, true);
        let largest = svd.singular_values.max();
        if let Some(weak) = (0..6).find(|&k| svd.singular_values[k] < 1e-4 * largest) {
            let v_t = svd.v_t.as_ref().expect("asked for");
            return Err(DatumError::FreeMotion {
                motion: motion_in_words(&Vector6::from_fn(|c, _| v_t[(weak, c)]), length_mm),
            });
        }
        let Ok(step) = svd.solve(&right, 0.0) else {
            return Err(DatumError::NotConverged { iterations: STEPS });
        };
        let turn = Vector3::new(step[3], step[4], step[5]) / length_mm;
        let shift = Vector3::new(step[0], step[1], step[2]);
        motion = Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn)) * motion;
        // Locks that hold a motion weakly pass the rounding on so many times larger.
        let weakest = svd.singular_values.min();
        if shift.norm() + turn.norm() * length_mm < (rounding_mm(size_mm) * largest / weakest).max(1e-11) {
            return Ok(motion);
        }
    }
    Err(DatumError::NotConverged { iterations: STEPS })
}

/// A free motion as people would say it: shift and turn with their directions.
fn motion_in_words(v: &Vector6<f64>, length_mm: f64) -> String {
    let shift = Vector3::new(v[0], v[1], v[2]);
    let turn = Vector3::new(v[3], v[4], v[5]);
    let words = |d: &Vector3| {
        let d = d.normalize();
        // Both senses of a free direction mean the same; the one with a positive largest component is shown.
        let d = if d[d.iamax()] < 0.0 { -d } else { d };
        format!("[{:.2}, {:.2}, {:.2}]", d.x + 0.0, d.y + 0.0, d.z + 0.0)
    };
    match (shift.norm(), turn.norm()) {
        (s, t) if t < 0.1 * s => format!("shifting along {}", words(&shift)),
        (s, t) if s < 0.1 * t => format!("turning about {}", words(&turn)),
        _ => format!(
            "shifting along {} while turning about {} ({:.2} mm per degree)",
            words(&shift),
            words(&turn),
            shift.norm() / (turn.norm() / length_mm).to_degrees()
        ),
    }
}

fn any_perpendicular(direction: &UnitVector3) -> UnitVector3 {
    let least = (0..3).min_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs())).unwrap_or(0);
    let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    UnitVector3::new_normalize(direction.cross(&axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planted() -> Isometry3 {
        Isometry3::new(Vector3::new(1.3, -0.7, 0.4), Vector3::new(0.02, -0.013, 0.031))
    }

    #[test]
    fn exact_features_bring_the_planted_motion_back() {
        let hole = Point3::new(-76.0, 56.0, 4.1);
        let slot = Point3::new(72.0, -54.0, 3.0);
        let point = Point3::new(10.0, 40.0, 8.0);
        let normal = UnitVector3::new_normalize(Vector3::new(0.1, -0.05, 1.0));
        let current_from_true = planted();
        // The measured plane is told by another of its points, as a fit would tell it.
        let across = any_perpendicular(&normal).into_inner() * 2.3;
        let d = HoleLinePoint {
            hole_measured: current_from_true * hole,
            hole_nominal: hole,
            line_measured: UnitVector3::new_normalize(current_from_true * (slot - hole)),
            line_nominal: UnitVector3::new_normalize(slot - hole),
            surface_measured: MeasuredPlane {
                point: current_from_true * (point + across),
                normal: current_from_true * normal,
            },
            surface_nominal: point,
        };
        let motion = solve_hole_line_point(&d).unwrap();
        let back = motion * current_from_true;
        // f64 at 150 mm keeps 3e-14 mm; a few dozen operations stay well below 1e-9 mm and 1e-12 rad.
        assert!(back.rotation.angle() < 1e-12, "{}", back.rotation.angle());
        for corner in [Point3::new(150.0, 100.0, 0.0), Point3::new(-150.0, 100.0, 30.0)] {
            assert!((back * corner - corner).norm() < 1e-9);
        }
    }

    /// A part drawn a hundred metres from the CAD's origin is held as well as one at it. Places there are told to 1.5e-11 mm
    /// (f64 at 1e5 mm), which a lever of ten makes 1.5e-10 mm and a rotation 1e-12 rad; at 1e5 mm those are 1e-7 mm in the
    /// motion's shift, not at the part.
    #[test]
    fn the_distance_of_the_part_from_the_origin_does_not_matter() {
        let normal = UnitVector3::new_normalize(Vector3::new(0.1, -0.05, 1.0));
        let at = |p: [f64; 3], away: &Vector3| Point3::from(p) + away;
        for k in 0..60 {
            let size = 1e5 * f64::from(k) / 59.0;
            let away = Vector3::new(1.0, -0.7 + 0.02 * f64::from(k), 0.37) * size;
            let [hole, slot, point] = [[-76.0, 56.0, 4.1], [72.0, -54.0, 3.0], [10.0, 40.0, 8.0]].map(|p| at(p, &away));
            // As planted, but about the part.
            let planted = Translation3::from(away) * planted() * Translation3::from(-away);
            let surface_measured = MeasuredPlane { point: planted * point, normal: planted * normal };
            let motion = solve_hole_line_point(&HoleLinePoint {
                hole_measured: planted * hole,
                hole_nominal: hole,
                line_measured: UnitVector3::new_normalize(planted * (slot - hole)),
                line_nominal: UnitVector3::new_normalize(slot - hole),
                surface_measured,
                surface_nominal: point,
            });
            let motion = motion.unwrap_or_else(|e| panic!("{size} mm away: {e}"));
            let three = three_two_one(&Isometry3::identity()).into_iter().map(|row| {
                let nominal = row.nominal + away;
                LockRow { measured: planted * nominal, nominal, lock: row.lock }
            });
            let rows: Vec<LockRow> = three.collect();
            let held = solve_locks(&rows, 250.0).unwrap_or_else(|e| panic!("{size} mm away: {e}"));
            for corner in [[150.0, 100.0, 0.0], [-150.0, 100.0, 30.0]].map(|p| at(p, &away)) {
                for back in [motion * planted, held * planted] {
                    assert!(
                        (back * corner - corner).norm() < 1e-8,
                        "{size} mm away: {}",
                        (back * corner - corner).norm()
                    );
                }
            }
        }
    }

    #[test]
    fn a_surface_point_on_the_line_is_refused() {
        let d = HoleLinePoint {
            hole_measured: Point3::origin(),
            hole_nominal: Point3::origin(),
            line_measured: Vector3::x_axis(),
            line_nominal: Vector3::x_axis(),
            surface_measured: MeasuredPlane { point: Point3::new(50.0, 0.0, 0.1), normal: Vector3::z_axis() },
            surface_nominal: Point3::new(50.0, 0.0, 0.0),
        };
        assert!(matches!(solve_hole_line_point(&d), Err(DatumError::NoLever { .. })));
    }

    fn three_two_one(motion: &Isometry3) -> Vec<LockRow> {
        let p = [
            (Point3::new(0.0, 0.0, 0.0), Vector3::z_axis()),
            (Point3::new(200.0, 0.0, 0.0), Vector3::z_axis()),
            (Point3::new(0.0, 150.0, 0.0), Vector3::z_axis()),
            (Point3::new(0.0, 0.0, 0.0), Vector3::y_axis()),
            (Point3::new(200.0, 0.0, 0.0), Vector3::y_axis()),
            (Point3::new(0.0, 0.0, 0.0), Vector3::x_axis()),
        ];
        p.iter().map(|(nominal, lock)| LockRow { measured: motion * nominal, nominal: *nominal, lock: *lock }).collect()
    }

    #[test]
    fn three_two_one_holds_every_lock_whatever_the_order_of_rows() {
        let mut rows = three_two_one(&planted());
        let first = solve_locks(&rows, 250.0).unwrap();
        for row in &rows {
            assert!(row.lock.dot(&(first * row.measured - row.nominal)).abs() < 1e-9);
        }
        rows.reverse();
        let second = solve_locks(&rows, 250.0).unwrap();
        assert!((first.inverse() * second).rotation.angle() < 1e-12);
    }

    #[test]
    fn missing_locks_name_the_free_motion() {
        let mut rows = three_two_one(&Isometry3::identity());
        rows.remove(5);
        let Err(DatumError::FreeMotion { motion }) = solve_locks(&rows, 250.0) else { panic!("must be refused") };
        assert_eq!(motion, "shifting along [1.00, 0.00, 0.00]");
    }
}
