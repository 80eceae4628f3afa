//! How well a fitted shape is known, from the scatter of its points.
//!
//! The covariance of the local parameters is `sigma² (J^T J)^-1` for least squares. For a robust fit with weights w and residuals r
//! `sigma²` is Huber's `n / (n - p) sum (w r)² / n / (mean psi')²` over the points that have a weight; psi' is the slope of the
//! residual's influence `w(r) r`.

use super::gauss_newton::{Shape, linearise};
use super::outcome::{Fitted, Known};
use super::shapes::circle::FlatCircle;
use super::shapes::fixed::FixedRadius;
use super::shapes::{FitError, frame};
use crate::geometry::{Point3, UnitVector3};
use nalgebra::{DMatrix, Matrix3};

/// Standard uncertainties (k = 1) of what is told of a shape; errors of the points are taken to be independent. Lengths in the unit of the
/// points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeUncertainty {
    /// Covariance of the centre or the point. A line's or an axis's point is uncertain across it only, a plane's along its normal.
    pub place: Matrix3<f64>,
    /// Of the direction, axis or normal: the larger of the angles by which it may lean, rad.
    pub direction_rad: Option<f64>,
    /// Of the diameter; none where the radius was given.
    pub diameter: Option<f64>,
    /// Of a cone's full apex angle, rad.
    pub apex_angle_rad: Option<f64>,
}

/// Of a shape at its fitted place; `weights` is empty for least squares, `sigma` the standard deviation of the residuals there.
pub(super) fn uncertainty_of(
    shape: &Fitted,
    points: &[Point3],
    weights: &[f64],
    sigma: f64,
    known: Known,
) -> Result<ShapeUncertainty, FitError> {
    let given = known.radius.is_some();
    match shape {
        Fitted::Line(s) => {
            let c = covariance::<_, 4, 2>(s, points, weights, sigma)?;
            Ok(Told { at: &[0, 1], across: Some(&s.direction), lean: Some(2), ..Told::NOTHING }.of(&c))
        }
        Fitted::Plane(s) => {
            let c = covariance::<_, 3, 1>(s, points, weights, sigma)?;
            let along = s.normal.into_inner() * c[(0, 0)] * s.normal.transpose();
            Ok(ShapeUncertainty { place: along, ..Told { lean: Some(1), ..Told::NOTHING }.of(&c) })
        }
        Fitted::Circle(s) => match (known.plane.is_some(), given) {
            (false, false) => {
                let c = covariance::<_, 6, 2>(s, points, weights, sigma)?;
                Ok(Told { at: &[0, 1, 2], lean: Some(3), radius: Some(5), ..Told::NOTHING }.of(&c))
            }
            (false, true) => {
                let c = covariance::<_, 5, 2>(&FixedRadius(*s), points, weights, sigma)?;
                Ok(Told { at: &[0, 1, 2], lean: Some(3), ..Told::NOTHING }.of(&c))
            }
            (true, false) => {
                let c = covariance::<_, 3, 1>(&FlatCircle(*s), points, weights, sigma)?;
                Ok(Told { at: &[0, 1], across: Some(&s.axis), radius: Some(2), ..Told::NOTHING }.of(&c))
            }
            (true, true) => {
                let c = covariance::<_, 2, 1>(&FixedRadius(FlatCircle(*s)), points, weights, sigma)?;
                Ok(Told { at: &[0, 1], across: Some(&s.axis), ..Told::NOTHING }.of(&c))
            }
        },
        Fitted::Sphere(s) if given => {
            let c = covariance::<_, 3, 1>(&FixedRadius(*s), points, weights, sigma)?;
            Ok(Told { at: &[0, 1, 2], ..Told::NOTHING }.of(&c))
        }
        Fitted::Sphere(s) => {
            let c = covariance::<_, 4, 1>(s, points, weights, sigma)?;
            Ok(Told { at: &[0, 1, 2], radius: Some(3), ..Told::NOTHING }.of(&c))
        }
        Fitted::Cylinder(s) if given => {
            let c = covariance::<_, 4, 1>(&FixedRadius(*s), points, weights, sigma)?;
            Ok(Told { at: &[0, 1], across: Some(&s.axis), lean: Some(2), ..Told::NOTHING }.of(&c))
        }
        Fitted::Cylinder(s) => {
            let c = covariance::<_, 5, 1>(s, points, weights, sigma)?;
            Ok(Told { at: &[0, 1], across: Some(&s.axis), lean: Some(2), radius: Some(4) }.of(&c))
        }
        Fitted::Cone(s) => {
            let c = covariance::<_, 6, 1>(s, points, weights, sigma)?;
            let told = Told { at: &[0, 1], across: Some(&s.axis), lean: Some(2), ..Told::NOTHING }.of(&c);
            // diameter = 2 distance / cos(half angle)
            let (sin, cos) = s.half_angle_rad.sin_cos();
            let [by_distance, by_angle] = [2.0 / cos, 2.0 * s.distance_at_point * sin / (cos * cos)];
            let variance = by_distance * by_distance * c[(4, 4)]
                + 2.0 * by_distance * by_angle * c[(4, 5)]
                + by_angle * by_angle * c[(5, 5)];
            let apex_angle_rad = Some(2.0 * c[(5, 5)].sqrt());
            Ok(ShapeUncertainty { diameter: Some(variance.max(0.0).sqrt()), apex_angle_rad, ..told })
        }
    }
}

/// Which local parameters are what.
struct Told<'a> {
    /// The place: along x, y, z, or along the frame of the direction `across`.
    at: &'a [usize],
    across: Option<&'a UnitVector3>,
    /// The first of two angles.
    lean: Option<usize>,
    radius: Option<usize>,
}

impl Told<'_> {
    const NOTHING: Self = Self { at: &[], across: None, lean: None, radius: None };

    fn of(&self, c: &DMatrix<f64>) -> ShapeUncertainty {
        let axes = match self.across {
            Some(direction) => {
                let (u, v) = frame(direction);
                vec![u, v]
            }
            None => Matrix3::identity().column_iter().map(|column| column.into_owned()).collect(),
        };
        let mut place = Matrix3::zeros();
        for (a, axis_a) in self.at.iter().zip(&axes) {
            for (b, axis_b) in self.at.iter().zip(&axes) {
                place += axis_a * axis_b.transpose() * c[(*a, *b)];
            }
        }
        let direction_rad = self.lean.map(|k| {
            let (middle, half) = (0.5 * (c[(k, k)] + c[(k + 1, k + 1)]), 0.5 * (c[(k, k)] - c[(k + 1, k + 1)]));
            (middle + half.hypot(c[(k, k + 1)])).max(0.0).sqrt()
        });
        let diameter = self.radius.map(|k| 2.0 * c[(k, k)].max(0.0).sqrt());
        ShapeUncertainty { place, direction_rad, diameter, apex_angle_rad: None }
    }
}

/// Covariance of the local parameters of a shape.
fn covariance<S, const N: usize, const R: usize>(
    shape: &S,
    points: &[Point3],
    weights: &[f64],
    sigma: f64,
) -> Result<DMatrix<f64>, FitError>
where
    S: Shape<N, R>,
{
    let (mut jacobian, residuals) = linearise::<S, N, R>(shape, points, &[]);
    let variance =
        if weights.is_empty() { sigma * sigma } else { robust_variance(residuals.as_slice(), weights, R, N) };
    // Columns of equal length, or lengths and angles would cost each other's digits.
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    for (k, length) in lengths.iter().enumerate() {
        jacobian.column_mut(k).unscale_mut(*length);
    }
    let upper = jacobian.qr().r();
    let inverse = upper.try_inverse().ok_or(FitError::Degenerate)?;
    let product = &inverse * inverse.transpose();
    Ok(DMatrix::from_fn(N, N, |a, b| variance * product[(a, b)] / (lengths[a] * lengths[b])))
}

/// Huber's variance for Tukey's weights `w = (1 - q)²`, q = (r / width)²: the influence `w r` has the slope `(1 - q) (1 - 5 q)`. Each
/// weight belongs to as many residuals as a point has.
fn robust_variance(residuals: &[f64], weights: &[f64], per_point: usize, parameters: usize) -> f64 {
    let count = residuals.len() as f64;
    let weight = |k: usize| weights[k / per_point];
    let squares: f64 = residuals.iter().enumerate().map(|(k, r)| (weight(k) * r).powi(2)).sum();
    let slope = |k: usize| {
        let left = weight(k).sqrt();
        left * (1.0 - 5.0 * (1.0 - left))
    };
    let mean_slope = (0..residuals.len()).map(slope).sum::<f64>() / count;
    squares / (count - parameters as f64).max(1.0) / (mean_slope * mean_slope)
}
