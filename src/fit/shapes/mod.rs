//! Least-squares shapes: line, plane, circle, sphere, cylinder, cone. Orthogonal distances are minimised; lengths are in
//! the unit of the points. After Forbes, NPL report DITC 140/89.

pub mod circle;
pub mod cone;
pub mod cylinder;
pub(super) mod fixed;
pub mod line;
pub mod plane;
pub mod sphere;

use super::gauss_newton::{Shape, Solved, minimise};
use crate::geometry::{Point3, UnitVector3, Vector3};
use line::principal_axes;

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
    /// No shape of the radius given lies closer to the points than a simpler set does.
    #[error("no shape of the radius given lies closer to the points than a plane or a line does")]
    NotOfRadius,
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

/// A start for a shape with an axis, over at most 400 points: of directions spread over the half sphere the best are carried to their
/// minimum. Unless one of them explains the points to rounding, more are tried: the minimum of a long shape is only about its radius over
/// its length wide and lies a few times that from the longest principal axis, which a single winding draws aside; so the
/// best of a finer lattice around that axis, the principal axes themselves and the best from before are turned downhill first.
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
    let tried = |axis: UnitVector3| {
        let shape = start(&few, axis)?;
        let sum = few.iter().map(|p| shape.residuals(p).0[0].powi(2)).sum::<f64>();
        (!sum.is_nan()).then_some(Tried { sum, axis, shape })
    };
    let mut starts: Vec<Tried<S>> = half_sphere(directions).filter_map(tried).collect();
    starts.sort_by(|a, b| a.sum.total_cmp(&b.sum));
    starts.truncate(carried);
    let carry = |start: &Tried<S>| minimise::<S, N, 1>(start.shape.clone(), &few, &[]).ok();
    let best_of = |a: &Solved<S>, b: &Solved<S>| a.sum_of_squares.total_cmp(&b.sum_of_squares);
    let first = starts.iter().filter_map(carry).min_by(best_of);
    // As many points as parameters may lie on several shapes; what the wide lattice finds is then as good as any.
    const ROUNDING: f64 = 1e-12;
    if let Some(exact) = first.as_ref().filter(|s| s.sum_of_squares < few.len() as f64 * ROUNDING * ROUNDING) {
        return Ok(exact.shape.clone());
    }
    // The lattice's spacing: directions share the half sphere's 2 pi.
    let spacing_rad = (std::f64::consts::TAU / directions as f64).sqrt();
    let (near, step_rad) = around_longest_axis(&few, carried, spacing_rad, tried)?;
    let downhill = starts.into_iter().map(|start| turned_downhill(start, 0.5 * spacing_rad, tried));
    let downhill = downhill.chain(near.into_iter().map(|start| turned_downhill(start, 0.5 * step_rad, tried)));
    let best = downhill.filter_map(|start| carry(&start)).chain(first).min_by(best_of);
    Ok(best.ok_or(FitError::Degenerate)?.shape)
}

/// The best starts of a lattice of directions around the longest principal axis, and the principal axes; also the lattice's step, rad.
fn around_longest_axis<S>(
    points: &[Point3],
    wanted: usize,
    most_rad: f64,
    tried: impl Fn(UnitVector3) -> Option<Tried<S>>,
) -> Result<(Vec<Tried<S>>, f64), FitError> {
    // In quarters of the points' width over their length, out to three of it.
    const STEPS: i32 = 12;
    let (_, spreads, axes) = principal_axes(points, &[])?;
    let step_rad = (0.25 * spreads[1] / spreads[0].max(f64::MIN_POSITIVE)).min(most_rad);
    let lattice = (-STEPS..=STEPS).flat_map(|k| (-STEPS..=STEPS).map(move |l| (f64::from(k), f64::from(l))));
    let directions = lattice.map(|(k, l)| axes[0] + axes[1] * (k * step_rad) + axes[2] * (l * step_rad));
    let mut near: Vec<Tried<S>> = directions.filter_map(|d| tried(UnitVector3::new_normalize(d))).collect();
    near.sort_by(|a, b| a.sum.total_cmp(&b.sum));
    near.truncate(wanted);
    near.extend(axes.into_iter().filter_map(|axis| tried(UnitVector3::new_normalize(axis))));
    Ok((near, step_rad))
}

/// A shape made of the points for a direction of its axis, and its sum of squares.
struct Tried<S> {
    sum: f64,
    axis: UnitVector3,
    shape: S,
}

/// Turns the axis by steps in four directions as long as that helps, then by half as much, down to a ten-thousandth of a radian.
fn turned_downhill<S>(
    start: Tried<S>,
    first_step_rad: f64,
    tried: impl Fn(UnitVector3) -> Option<Tried<S>>,
) -> Tried<S> {
    const LAST_STEP_RAD: f64 = 1e-4;
    const MOST_TURNS: usize = 40;
    let (mut best, mut step) = (start, first_step_rad);
    for _ in 0..MOST_TURNS {
        let around =
            [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)].map(|(u, v)| tried(turned(&best.axis, u, v)));
        match around.into_iter().flatten().min_by(|a, b| a.sum.total_cmp(&b.sum)) {
            Some(better) if better.sum < best.sum => best = better,
            _ if step < LAST_STEP_RAD => break,
            _ => step *= 0.5,
        }
    }
    best
}

/// At most `most` points, spread evenly over the list and in step with nothing in it, such as the rings of a turned part: enough to find
/// a start.
fn thinned(points: &[Point3], most: usize) -> Vec<Point3> {
    if points.len() <= most {
        return points.to_vec();
    }
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let mut chosen: Vec<usize> =
        (0..most).map(|k| ((k as f64 * golden).fract() * points.len() as f64) as usize).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|k| points[k]).collect()
}
