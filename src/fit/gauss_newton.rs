//! Least squares of orthogonal distances by damped Gauss-Newton steps (after Forbes, NPL report DITC 140/89, and
//! Levenberg and Marquardt for the damping), solved by QR so that no digits go in normal equations.
//!
//! Shapes come centred and scaled to size one, so that steps, limits and condition numbers have a meaning.

use super::shapes::FitError;
use crate::geometry::{Point3, decompose};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// A shape with `N` local parameters, each point giving `R` residuals.
pub trait Shape<const N: usize, const R: usize>: Clone {
    /// Residuals of one point and their derivatives by the local parameters.
    fn residuals(&self, point: &Point3) -> ([f64; R], [[f64; N]; R]);

    /// The shape after a small step of its local parameters.
    fn moved(&self, step: &SVector<f64, N>) -> Self;

    /// Whether the parameters still describe a shape (a positive radius and the like).
    fn is_sound(&self) -> bool;
}

/// A shape with how well it was found.
#[derive(Debug, Clone)]
pub struct Solved<S> {
    /// The shape.
    pub shape: S,
    /// Weighted sum of squared residuals.
    pub sum_of_squares: f64,
    /// Ratio of the largest to the smallest singular value of the Jacobian with columns of equal length.
    pub condition: f64,
    /// Steps made.
    pub iterations: usize,
}

const MOST_STEPS: usize = 200;

/// Minimises the weighted sum of squared residuals from a start. `weights` is empty for equal weights.
pub fn minimise<S, const N: usize, const R: usize>(
    start: S,
    points: &[Point3],
    weights: &[f64],
) -> Result<Solved<S>, FitError>
where
    S: Shape<N, R>,
{
    let mut shape = start;
    let mut damping = 1e-6;
    let (mut jacobian, mut residuals) = linearise::<S, N, R>(&shape, points, weights);
    let mut sum = residuals.norm_squared();
    for iteration in 1..=MOST_STEPS {
        let (step, condition) = damped_step::<N>(&jacobian, &residuals, damping)?;
        let moved = shape.moved(&step);
        let candidate = moved.is_sound().then(|| linearise::<S, N, R>(&moved, points, weights));
        let better = candidate.as_ref().is_some_and(|(_, r)| r.norm_squared() <= sum);
        let small = step.amax() < 1e-14;
        if let (Some((new_jacobian, new_residuals)), true) = (candidate, better) {
            let gain = sum - new_residuals.norm_squared();
            (shape, jacobian, residuals) = (moved, new_jacobian, new_residuals);
            sum = residuals.norm_squared();
            damping = if damping < 1e-12 { 0.0 } else { damping * 0.1 };
            // Converged when a nearly undamped step moves nothing any more: at rounding, or without any gain.
            let settled = small || (step.amax() < 1e-10 && gain <= 1e-16 * sum.max(f64::MIN_POSITIVE));
            if settled && damping < 1e-9 {
                return Ok(Solved { shape, sum_of_squares: sum, condition, iterations: iteration });
            }
        } else {
            // Near the minimum rounding can make a good step look a hair worse: that is the end, not a failure.
            if step.amax() < 1e-11 {
                return Ok(Solved { shape, sum_of_squares: sum, condition, iterations: iteration });
            }
            damping = (damping * 10.0).max(1e-9);
            if damping > 1e12 {
                break;
            }
        }
    }
    Err(FitError::NotConverged { iterations: MOST_STEPS })
}

/// Jacobian and residuals at a shape, each row times the root of its point's weight.
pub(super) fn linearise<S, const N: usize, const R: usize>(
    shape: &S,
    points: &[Point3],
    weights: &[f64],
) -> (DMatrix<f64>, DVector<f64>)
where
    S: Shape<N, R>,
{
    let mut jacobian = DMatrix::zeros(points.len() * R, N);
    let mut residuals = DVector::zeros(points.len() * R);
    for (k, point) in points.iter().enumerate() {
        let root = weights.get(k).map_or(1.0, |w| w.sqrt());
        let (values, rows) = shape.residuals(point);
        for (j, (value, row)) in values.iter().zip(&rows).enumerate() {
            residuals[k * R + j] = root * value;
            for (c, derivative) in row.iter().enumerate() {
                jacobian[(k * R + j, c)] = root * derivative;
            }
        }
    }
    (jacobian, residuals)
}

/// Solves `(JᵀJ + damping·diag) step = -Jᵀr` by QR of the stacked system; also the condition of `J` with columns of
/// equal length.
fn damped_step<const N: usize>(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    damping: f64,
) -> Result<(SVector<f64, N>, f64), FitError> {
    let scale = SVector::<f64, N>::from_fn(|c, _| jacobian.column(c).norm().max(f64::MIN_POSITIVE));
    let mut scaled = jacobian.clone();
    for c in 0..N {
        scaled.column_mut(c).unscale_mut(scale[c]);
    }
    let qr = scaled.qr();
    let mut projected = residuals.clone();
    qr.q_tr_mul(&mut projected);
    let upper = qr.r();
    let r = SMatrix::<f64, N, N>::from_fn(|i, j| if i < upper.nrows() { upper[(i, j)] } else { 0.0 });
    let right = SVector::<f64, N>::from_fn(|i, _| -projected.get(i).copied().unwrap_or(0.0));
    let dynamic = DMatrix::from_fn(N, N, |i, j| r[(i, j)]);
    let values = decompose::singular_values(dynamic.clone()).ok_or(FitError::Degenerate)?;
    let condition = values.max() / values.min();
    if !condition.is_finite() || condition > 1e13 {
        return Err(FitError::Degenerate);
    }
    let mut stacked = DMatrix::zeros(2 * N, N);
    stacked.view_mut((0, 0), (N, N)).copy_from(&dynamic);
    for c in 0..N {
        stacked[(N + c, c)] = damping.sqrt();
    }
    let mut rhs = DVector::zeros(2 * N);
    for c in 0..N {
        rhs[c] = right[c];
    }
    let qr = stacked.qr();
    qr.q_tr_mul(&mut rhs);
    let solution = qr.r().solve_upper_triangular(&rhs.rows(0, N).into_owned()).ok_or(FitError::Degenerate)?;
    Ok((SVector::from_fn(|c, _| solution[c] / scale[c]), condition))
}
