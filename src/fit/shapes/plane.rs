//! The plane: its normal is the last principal axis.

use super::FitError;
use super::line::principal_axes;
use crate::geometry::{Point3, UnitVector3};

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
