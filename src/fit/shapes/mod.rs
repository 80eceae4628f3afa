//! Least-squares shapes: line, plane, circle, sphere, cylinder, cone. Orthogonal distances are minimised; lengths are in
//! the unit of the points. After Forbes, NPL report DITC 140/89.

pub mod circle;
pub mod cone;
pub mod cylinder;
pub(super) mod fixed;
pub mod line;
pub mod plane;
pub mod sphere;

use super::gauss_newton::{Shape, minimise};
use crate::geometry::{Point3, UnitVector3, Vector3};

/// Why a shape could not be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There are too few points.
    #[error("{found} points, at least {needed} are needed")]
    TooFewPoints {
        /// How many there are.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The points do not fix the shape.
    #[error("the points do not fix the shape: they are in one place, in line, or leave a size free")]
    Degenerate,
    /// A simpler set of points explains them as well.
    #[error("the points do not fix the shape: {why}")]
    NotFixed {
        /// What they are instead.
        why: &'static str,
    },
    /// The points of a circle do not lie in the plane given.
    #[error("the points lie {off:.6} off the plane that was given; on average its coordinate is {mean_value:.6}")]
    OffPlane {
        /// How far, in their unit.
        off: f64,
        /// Where they are.
        mean_value: f64,
    },
    /// The iteration did not end.
    #[error("the fit did not settle after {iterations} steps")]
    NotConverged {
        /// Steps made.
        iterations: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {index} is not finite")]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
    },
}

/// How the points were brought to size one about the origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Normaliser {
    pub(crate) centroid: Point3,
    pub(crate) scale: f64,
}

impl Normaliser {
    /// Centroid and root mean square distance from it; refuses too few points, points that are not finite, and points
    /// that are all in one place.
    pub(crate) fn of(points: &[Point3], needed: usize) -> Result<Self, FitError> {
        if points.len() < needed {
            return Err(FitError::TooFewPoints { found: points.len(), needed });
        }
        if let Some(index) = points.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(FitError::NotFinite { index });
        }
        // The first point as origin keeps digits of clouds that lie far out.
        let origin = points[0];
        let n = points.len() as f64;
        let mean = points.iter().fold(Vector3::zeros(), |sum, p| sum + (p - origin)) / n;
        let centroid = origin + mean;
        let scale = (points.iter().map(|p| (p - centroid).norm_squared()).sum::<f64>() / n).sqrt();
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(FitError::Degenerate);
        }
        Ok(Self { centroid, scale })
    }

    pub(crate) fn apply(&self, points: &[Point3]) -> Vec<Point3> {
        points.iter().map(|p| Point3::from((p - self.centroid) / self.scale)).collect()
    }

    pub(crate) fn to(self, point: &Point3) -> Point3 {
        Point3::from((point - self.centroid) / self.scale)
    }

    pub(crate) fn back(&self, point: &Point3) -> Point3 {
        self.centroid + point.coords * self.scale
    }
}

/// Two unit vectors that complete a direction to a right-handed frame.
pub(crate) fn frame(direction: &UnitVector3) -> (Vector3, Vector3) {
    let least = (0..3).min_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs())).unwrap_or(0);
    let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    let u = direction.cross(&axis).normalize();
    (u, direction.cross(&u))
}

/// A direction turned by a small step within its tangent frame.
pub(crate) fn turned(direction: &UnitVector3, along_u: f64, along_v: f64) -> UnitVector3 {
    let (u, v) = frame(direction);
    UnitVector3::new_normalize(direction.into_inner() + u * along_u + v * along_v)
}

/// Directions spread evenly over a half sphere (Fibonacci lattice).
fn half_sphere(count: usize) -> impl Iterator<Item = UnitVector3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (k as f64 + 0.5) / count as f64;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (golden * k as f64).sin_cos();
        UnitVector3::new_normalize(Vector3::new(r * cos, r * sin, z))
    })
}

/// A start for a shape with an axis: of many directions, each with the shape that `start` makes of it, the best are carried to their
/// minimum over at most 400 points.
pub(crate) fn best_start<S, const N: usize>(
    points: &[Point3],
    directions: usize,
    carried: usize,
    start: impl Fn(&[Point3], UnitVector3) -> Option<S>,
) -> Result<S, FitError>
where
    S: Shape<N, 1>,
{
    const START_POINTS: usize = 400;
    let few = thinned(points, START_POINTS);
    let sum_of_squares = |shape: &S| few.iter().map(|p| shape.residuals(p).0[0].powi(2)).sum::<f64>();
    let starts = half_sphere(directions).filter_map(|axis| start(&few, axis));
    let mut starts: Vec<(f64, S)> = starts.map(|shape| (sum_of_squares(&shape), shape)).collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ended = starts.into_iter().take(carried).filter_map(|(_, shape)| minimise::<S, N, 1>(shape, &few, &[]).ok());
    let best = ended.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    Ok(best.ok_or(FitError::Degenerate)?.shape)
}

/// At most `most` points, evenly through the list: enough to find a start.
fn thinned(points: &[Point3], most: usize) -> Vec<Point3> {
    let step = points.len().div_ceil(most).max(1);
    points.iter().step_by(step).copied().collect()
}
