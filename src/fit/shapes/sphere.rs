//! The sphere.

use super::{FitError, Normaliser};
use crate::fit::gauss_newton::{Shape, minimise};
use crate::geometry::{Point3, Vector3, decompose};
use nalgebra::{DMatrix, DVector, SVector};

/// A sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub centre: Point3,
    /// Its radius.
    pub radius: f64,
}

impl Sphere {
    /// Signed distance of a point, outside positive.
    pub fn distance(&self, p: &Point3) -> f64 {
        (p - self.centre).norm() - self.radius
    }
}

impl Shape<4, 1> for Sphere {
    fn residuals(&self, point: &Point3) -> ([f64; 1], [[f64; 4]; 1]) {
        let from_centre = point - self.centre;
        let distance = from_centre.norm();
        let out = if distance > 0.0 { from_centre / distance } else { Vector3::z() };
        ([distance - self.radius], [[-out.x, -out.y, -out.z, -1.0]])
    }

    fn moved(&self, step: &SVector<f64, 4>) -> Self {
        Self { centre: self.centre + Vector3::new(step[0], step[1], step[2]), radius: self.radius + step[3] }
    }

    fn is_sound(&self) -> bool {
        self.radius > 0.0 && self.radius < 1e8
    }
}

/// Fits a sphere; `weights` is empty for equal weights. Also the condition of the fit.
pub fn fit_sphere(points: &[Point3], weights: &[f64]) -> Result<(Sphere, f64), FitError> {
    let normaliser = Normaliser::of(points, 4)?;
    let scaled = normaliser.apply(points);
    let solved = minimise::<_, 4, 1>(algebraic_start(&scaled)?, &scaled, weights)?;
    let sphere = solved.shape;
    let back = Sphere { centre: normaliser.back(&sphere.centre), radius: sphere.radius * normaliser.scale };
    Ok((back, solved.condition))
}

/// `|p|² = 2 c·p + (r² - |c|²)` is linear in the centre and the bracket.
fn algebraic_start(points: &[Point3]) -> Result<Sphere, FitError> {
    let matrix = DMatrix::from_fn(points.len(), 4, |k, c| if c < 3 { 2.0 * points[k][c] } else { 1.0 });
    let right = DVector::from_fn(points.len(), |k, _| points[k].coords.norm_squared());
    let svd = decompose::svd(matrix, true, true).ok_or(FitError::Degenerate)?;
    let solution = svd.solve(&right, 1e-13).map_err(|_| FitError::Degenerate)?;
    let centre = Point3::new(solution[0], solution[1], solution[2]);
    let squared = solution[3] + centre.coords.norm_squared();
    if !(squared > 0.0 && squared.is_finite()) {
        return Err(FitError::Degenerate);
    }
    Ok(Sphere { centre, radius: squared.sqrt() })
}
