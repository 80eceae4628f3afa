//! The plane: its normal is the last principal axis.

use super::line::principal_axes;
use super::{FitError, frame, turned};
use crate::fit::gauss_newton::Shape;
use crate::geometry::{Point3, UnitVector3};
use nalgebra::SVector;

/// A plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The centroid of the points.
    pub point: Point3,
    /// Its normal, either way.
    pub normal: UnitVector3,
}

impl Plane {
    /// Signed distance of a point, along the normal positive.
    pub fn distance(&self, p: &Point3) -> f64 {
        (p - self.point).dot(&self.normal)
    }
}

impl Shape<3, 1> for Plane {
    fn residuals(&self, point: &Point3) -> ([f64; 1], [[f64; 3]; 1]) {
        let (u, v) = frame(&self.normal);
        let d = point - self.point;
        ([d.dot(&self.normal)], [[-1.0, d.dot(&u), d.dot(&v)]])
    }

    fn moved(&self, step: &SVector<f64, 3>) -> Self {
        let along = self.normal.into_inner() * step[0];
        Self { point: self.point + along, normal: turned(&self.normal, step[1], step[2]) }
    }

    fn is_sound(&self) -> bool {
        true
    }
}

/// Fits a plane; `weights` is empty for equal weights. Also its condition: largest over second spread within the plane.
pub fn fit_plane(points: &[Point3], weights: &[f64]) -> Result<(Plane, f64), FitError> {
    if points.len() < 3 {
        return Err(FitError::TooFewPoints { found: points.len(), needed: 3 });
    }
    let (point, values, axes) = principal_axes(points, weights)?;
    if values[1] <= 1e-13 * values[0] || values[2] > values[1] * (1.0 - 1e-12) {
        return Err(FitError::Degenerate);
    }
    let normal = UnitVector3::try_new(axes[2], 0.0).ok_or(FitError::Degenerate)?;
    Ok((Plane { point, normal }, values[0] / values[1]))
}
