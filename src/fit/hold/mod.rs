//! A body that is held by its datums: numbers of it that must vanish, and the motion that makes them.
//!
//! **Problem.** With the motion T (rotation R) of the body, measured values m and nominal values n, each row is one of
//!
//! ```text
//! point     d·(T m - n)              a point of the body, held along a fixed direction d
//! surface   (R n_m)·(T m - n)        a surface of the body through m, normal n_m, that passes through n
//! axis      e·(R a)                  a direction a of the body that has no part along e
//! ```
//!
//! Hole, slot and surface point, 3-2-1 and any other points with locked directions are lists of such rows.
//!
//! **Answer.** Gauss-Newton from where the body is. Six rows are met exactly, more by least squares, each weighed by its own
//! standard uncertainty. The numbers are told about the middle of the nominal places, so that they are of the body's size however far
//! from the origin it was drawn; turns are told by what they move at the body's size, so that the condition has a meaning.

mod freedom;
#[cfg(test)]
mod tests;

pub use freedom::{Named, Twist, WEAK_CONDITION};

use crate::geometry::{Isometry3, Point3, UnitVector3, Vector3, decompose};
use freedom::Strengths;
use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion, Vector6};

/// Steps after which there is no hope. From a best fit three to five are made.
const STEPS: usize = 50;
/// The least weight of a row as a share of the largest: a value told with no uncertainty at all outvotes others, but is not alone.
const LEAST_WEIGHT: f64 = 1e-2;
/// A row that shares less than this of itself with the others cannot be checked by them.
const CHECKABLE: f64 = 1e-6;

/// A number that must vanish. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Told {
    /// A point of the body, held at its nominal place along a fixed direction.
    Point {
        /// As measured.
        measured: Point3,
        /// As it should be.
        nominal: Point3,
        /// The direction.
        along: UnitVector3,
    },
    /// A surface of the body, which moves with it, through its nominal place.
    Surface {
        /// A point of it as measured.
        measured: Point3,
        /// Its normal as measured.
        normal: UnitVector3,
        /// The place through which it should pass.
        nominal: Point3,
    },
    /// A direction of the body that has no part along a fixed one.
    Axis {
        /// As measured.
        measured: UnitVector3,
        /// Perpendicular to the nominal direction.
        across: UnitVector3,
    },
}

/// One row, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// What must vanish.
    pub told: Told,
    /// Standard uncertainty: mm, for an axis rad. It weighs rows against each other where there are more than six.
    pub u: f64,
}

/// A body held.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// From where the body was measured to where its datums want it.
    pub motion: Isometry3,
    /// How many times more strongly the best held motion is held than the weakest, turns told by what they move at the body's size.
    pub condition: f64,
    /// The weakest motion, of size one.
    pub weakest: Twist,
    /// What is left of each row, in order: mm, for an axis rad. Rounding where there are six.
    pub residuals: Vec<f64>,
    /// Each residual in its own standard deviations; `None` where the row cannot be checked by the others (with six rows: all).
    pub normalised: Vec<Option<f64>>,
}

/// Why rows hold no body.
#[derive(Debug, Clone, PartialEq)]
pub enum HoldError {
    /// These motions stay free.
    Free(Vec<Twist>),
    /// The iteration did not settle.
    NotConverged {
        /// Steps made.
        iterations: usize,
    },
    /// A row is not finite.
    NotFinite,
}

/// What rows hold, as they stand: the condition and the weakest motion.
///
/// # Errors
/// The rows leave motions free, or are not finite.
pub fn hold(rows: &[Row], length_mm: f64) -> Result<(f64, Twist), HoldError> {
    let middle = middle_of(rows);
    let local: Vec<Row> = rows.iter().map(|row| row.seen_from(&middle)).collect();
    let strengths = Strengths::of(&matrix(&local, &Isometry3::identity(), length_mm)).ok_or(HoldError::NotFinite)?;
    strengths.judged(&middle, length_mm).map_err(HoldError::Free)
}

/// The motion that makes the rows vanish, about a body of that size.
///
/// # Errors
/// The rows leave a motion free or are not finite, or the iteration does not settle.
pub fn solve(rows: &[Row], length_mm: f64) -> Result<Held, HoldError> {
    let middle = middle_of(rows);
    let local: Vec<Row> = rows.iter().map(|row| row.seen_from(&middle)).collect();
    let held = solve_about_middle(&local, length_mm, &middle)?;
    Ok(Held { motion: told_about(&middle, &held.motion), ..held })
}

impl Row {
    /// With coordinates from another origin.
    fn seen_from(&self, origin: &Point3) -> Self {
        let here = |p: &Point3| Point3::from(p - origin);
        let told = match self.told {
            Told::Point { measured, nominal, along } => {
                Told::Point { measured: here(&measured), nominal: here(&nominal), along }
            }
            Told::Surface { measured, normal, nominal } => {
                Told::Surface { measured: here(&measured), normal, nominal: here(&nominal) }
            }
            axis @ Told::Axis { .. } => axis,
        };
        Self { told, ..*self }
    }

    fn places(&self) -> Option<[Point3; 2]> {
        match self.told {
            Told::Point { measured, nominal, .. } | Told::Surface { measured, nominal, .. } => {
                Some([measured, nominal])
            }
            Told::Axis { .. } => None,
        }
    }

    /// Its number for a body moved so, mm; of an axis what its end does at a length.
    fn value_mm(&self, motion: &Isometry3, length_mm: f64) -> f64 {
        match &self.told {
            Told::Point { measured, nominal, along } => along.dot(&(motion * measured - nominal)),
            Told::Surface { measured, normal, nominal } => {
                (motion * normal.into_inner()).dot(&(motion * measured - nominal))
            }
            Told::Axis { measured, across } => across.dot(&(motion * measured.into_inner())) * length_mm,
        }
    }

    /// What a further shift (mm) and a turn about the origin (mm at the length) add to it.
    fn slope(&self, motion: &Isometry3, length_mm: f64) -> Vector6<f64> {
        let (shift, turn) = match &self.told {
            Told::Point { measured, along, .. } => {
                (along.into_inner(), (motion * measured).coords.cross(along) / length_mm)
            }
            Told::Surface { normal, nominal, .. } => {
                let normal = motion * normal.into_inner();
                (normal, nominal.coords.cross(&normal) / length_mm)
            }
            Told::Axis { measured, across } => (Vector3::zeros(), (motion * measured.into_inner()).cross(across)),
        };
        Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    }

    /// Standard uncertainty in mm at the length.
    fn u_mm(&self, length_mm: f64) -> f64 {
        match self.told {
            Told::Axis { .. } => self.u * length_mm,
            _ => self.u,
        }
    }
}

fn middle_of(rows: &[Row]) -> Point3 {
    let places: Vec<Point3> = rows.iter().filter_map(|row| row.places().map(|[_, nominal]| nominal)).collect();
    let sum = places.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
    Point3::from(sum / places.len().max(1) as f64)
}

/// A motion told about another origin, in the frame of which that origin is given.
fn told_about(origin: &Point3, motion: &Isometry3) -> Isometry3 {
    let shift = origin.coords + motion.translation.vector - motion.rotation * origin.coords;
    Isometry3::from_parts(Translation3::from(shift), motion.rotation)
}

/// Rounding of lengths of a size, after a few dozen operations, mm.
fn rounding_mm(size_mm: f64) -> f64 {
    32.0 * f64::EPSILON * size_mm
}

/// One line a row, at least six lines.
fn matrix(rows: &[Row], motion: &Isometry3, length_mm: f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(rows.len().max(6), 6);
    for (k, row) in rows.iter().enumerate() {
        matrix.set_row(k, &row.slope(motion, length_mm).transpose());
    }
    matrix
}

/// One for each of six rows, which are met whatever they weigh; else in proportion to 1 / u, the largest one.
fn weights(rows: &[Row], length_mm: f64) -> Vec<f64> {
    let largest_u = rows.iter().map(|row| row.u_mm(length_mm)).fold(0.0, f64::max);
    if rows.len() <= 6 || largest_u <= 0.0 || !largest_u.is_finite() {
        return vec![1.0; rows.len()];
    }
    let u = |row: &Row| row.u_mm(length_mm).max(LEAST_WEIGHT * largest_u);
    let least_u = rows.iter().map(u).fold(f64::INFINITY, f64::min);
    rows.iter().map(|row| least_u / u(row)).collect()
}

fn solve_about_middle(rows: &[Row], length_mm: f64, middle: &Point3) -> Result<Held, HoldError> {
    let weights = weights(rows, length_mm);
    let sizes = rows.iter().filter_map(|row| row.places().map(|[a, b]| a.coords.norm() + b.coords.norm()));
    let size_mm = sizes.fold(length_mm, f64::max);
    let mut motion = Isometry3::identity();
    for _ in 0..STEPS {
        let mut matrix = matrix(rows, &motion, length_mm);
        let strengths = Strengths::of(&matrix).ok_or(HoldError::NotFinite)?;
        let (condition, weakest) = strengths.judged(middle, length_mm).map_err(HoldError::Free)?;
        let mut right = DVector::zeros(matrix.nrows());
        for (k, (row, weight)) in rows.iter().zip(&weights).enumerate() {
            matrix.row_mut(k).scale_mut(*weight);
            right[k] = -weight * row.value_mm(&motion, length_mm);
        }
        let svd = decompose::svd(matrix, true, true).ok_or(HoldError::NotFinite)?;
        let Ok(step) = svd.solve(&right, 0.0) else { return Err(HoldError::NotConverged { iterations: STEPS }) };
        let turn = Vector3::new(step[3], step[4], step[5]) / length_mm;
        let shift = Vector3::new(step[0], step[1], step[2]);
        motion = Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn)) * motion;
        // Rows that hold a motion weakly pass the rounding on so many times larger.
        let passed_on = svd.singular_values.max() / svd.singular_values.min();
        if shift.norm() + turn.norm() * length_mm < (rounding_mm(size_mm) * passed_on).max(1e-11) {
            let left = svd.u.as_ref().map_or_else(|| vec![0.0; rows.len()], |u| redundancies(u, rows.len()));
            let normalised = normalised(rows, &motion, length_mm, &left);
            let in_unit = |row: &Row| match row.told {
                Told::Axis { .. } => row.value_mm(&motion, length_mm) / length_mm,
                _ => row.value_mm(&motion, length_mm),
            };
            let residuals = rows.iter().map(in_unit).collect();
            return Ok(Held { motion, condition, weakest, residuals, normalised });
        }
    }
    Err(HoldError::NotConverged { iterations: STEPS })
}

/// Which share of an error of each row is left in its own residual: one minus the diagonal of the hat matrix.
fn redundancies(u: &DMatrix<f64>, count: usize) -> Vec<f64> {
    (0..count).map(|k| if count > 6 { 1.0 - u.row(k).norm_squared() } else { 0.0 }).collect()
}

/// Residuals in their own standard deviations (Baarda's w).
fn normalised(rows: &[Row], motion: &Isometry3, length_mm: f64, redundancies: &[f64]) -> Vec<Option<f64>> {
    let one = |(row, left): (&Row, &f64)| {
        let u_mm = row.u_mm(length_mm);
        (*left > CHECKABLE && u_mm > 0.0).then(|| row.value_mm(motion, length_mm) / (u_mm * left.sqrt()))
    };
    rows.iter().zip(redundancies).map(one).collect()
}
