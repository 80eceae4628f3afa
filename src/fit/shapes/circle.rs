//! The circle in space, and in a plane that is given.

use super::plane::fit_plane;
use super::{FitError, Normaliser, frame, turned};
use crate::fit::gauss_newton::{Shape, minimise};
use crate::geometry::{Point3, UnitVector3, Vector3, decompose};
use nalgebra::{DMatrix, DVector, SVector};

/// A circle in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its centre.
    pub centre: Point3,
    /// Normal of its plane, either way.
    pub axis: UnitVector3,
    /// Its radius.
    pub radius: f64,
}

impl Circle {
    /// Distance of a point from the curve.
    pub fn distance(&self, p: &Point3) -> f64 {
        let d = p - self.centre;
        let height = d.dot(&self.axis);
        let across = (d - self.axis.into_inner() * height).norm();
        height.hypot(across - self.radius)
    }
}

impl Shape<6, 2> for Circle {
    fn residuals(&self, point: &Point3) -> ([f64; 2], [[f64; 6]; 2]) {
        let (u, v) = frame(&self.axis);
        let d = point - self.centre;
        let height = d.dot(&self.axis);
        let across = d - self.axis.into_inner() * height;
        let rho = across.norm();
        let out = if rho > 0.0 { across / rho } else { u };
        let (du, dv) = (d.dot(&u), d.dot(&v));
        let radial = [-out.x, -out.y, -out.z, -height * out.dot(&u), -height * out.dot(&v), -1.0];
        let axial = [-self.axis.x, -self.axis.y, -self.axis.z, du, dv, 0.0];
        ([rho - self.radius, height], [radial, axial])
    }

    fn moved(&self, step: &SVector<f64, 6>) -> Self {
        Self {
            centre: self.centre + Vector3::new(step[0], step[1], step[2]),
            axis: turned(&self.axis, step[3], step[4]),
            radius: self.radius + step[5],
        }
    }

    fn is_sound(&self) -> bool {
        self.radius > 0.0 && self.radius < 1e8
    }
}

/// A circle whose axis does not turn and whose centre stays in its plane.
#[derive(Debug, Clone, Copy)]
pub(in crate::fit) struct FlatCircle(pub(in crate::fit) Circle);

impl Shape<3, 1> for FlatCircle {
    fn residuals(&self, point: &Point3) -> ([f64; 1], [[f64; 3]; 1]) {
        let (u, v) = frame(&self.0.axis);
        let d = point - self.0.centre;
        let (du, dv) = (d.dot(&u), d.dot(&v));
        let rho = du.hypot(dv);
        let (cos, sin) = if rho > 0.0 { (du / rho, dv / rho) } else { (1.0, 0.0) };
        ([rho - self.0.radius], [[-cos, -sin, -1.0]])
    }

    fn moved(&self, step: &SVector<f64, 3>) -> Self {
        let (u, v) = frame(&self.0.axis);
        let centre = self.0.centre + u * step[0] + v * step[1];
        Self(Circle { centre, axis: self.0.axis, radius: self.0.radius + step[2] })
    }

    fn is_sound(&self) -> bool {
        self.0.is_sound()
    }
}

/// Fits a circle in space; `weights` is empty for equal weights. Also the condition of the fit.
pub fn fit_circle(points: &[Point3], weights: &[f64]) -> Result<(Circle, f64), FitError> {
    let normaliser = Normaliser::of(points, 3)?;
    let scaled = normaliser.apply(points);
    let (plane, _) = fit_plane(&scaled, weights)?;
    let start = algebraic_start(&scaled, &plane.point, &plane.normal)?;
    let solved = minimise::<_, 6, 2>(start, &scaled, weights)?;
    let circle = solved.shape;
    let centre = normaliser.back(&circle.centre);
    Ok((Circle { centre, radius: circle.radius * normaliser.scale, ..circle }, solved.condition))
}

/// Fits a circle to the points as seen along `axis`; the centre lies at the height of `plane_point`.
pub fn fit_circle_in_plane(
    points: &[Point3],
    weights: &[f64],
    axis: &UnitVector3,
    plane_point: &Point3,
) -> Result<(Circle, f64), FitError> {
    let normaliser = Normaliser::of(points, 3)?;
    let scaled = normaliser.apply(points);
    let start = algebraic_start(&scaled, &Point3::origin(), axis)?;
    let solved = minimise::<_, 3, 1>(FlatCircle(start), &scaled, weights)?;
    let circle = solved.shape.0;
    let centre = normaliser.back(&circle.centre);
    let centre = centre + axis.into_inner() * (plane_point - centre).dot(axis);
    Ok((Circle { centre, radius: circle.radius * normaliser.scale, axis: *axis }, solved.condition))
}

/// In the plane, `u² + v² = 2 a u + 2 b v + (r² - a² - b²)` is linear.
pub(super) fn algebraic_start(points: &[Point3], origin: &Point3, axis: &UnitVector3) -> Result<Circle, FitError> {
    let (u, v) = frame(axis);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| [(p - origin).dot(&u), (p - origin).dot(&v)]).collect();
    let matrix = DMatrix::from_fn(flat.len(), 3, |k, c| if c < 2 { 2.0 * flat[k][c] } else { 1.0 });
    let right = DVector::from_fn(flat.len(), |k, _| flat[k][0] * flat[k][0] + flat[k][1] * flat[k][1]);
    let svd = decompose::svd(matrix, true, true).ok_or(FitError::Degenerate)?;
    let solution = svd.solve(&right, 1e-13).map_err(|_| FitError::Degenerate)?;
    let squared = solution[2] + solution[0] * solution[0] + solution[1] * solution[1];
    if !(squared > 0.0 && squared.is_finite()) {
        return Err(FitError::Degenerate);
    }
    Ok(Circle { centre: origin + u * solution[0] + v * solution[1], axis: *axis, radius: squared.sqrt() })
}
