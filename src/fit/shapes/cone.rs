//! The cone.

use super::{FitError, Normaliser, best_start, frame, turned};
use crate::fit::gauss_newton::{Shape, minimise};
use crate::geometry::{Point3, UnitVector3, decompose};
use nalgebra::{DMatrix, DVector, SVector};
use std::f64::consts::FRAC_PI_2;

/// A cone without ends, one nappe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// A point of the axis: the one nearest to the centroid of the points.
    pub point: Point3,
    /// Direction of the axis, towards the growing radius.
    pub axis: UnitVector3,
    /// Orthogonal distance from `point` to the surface.
    pub distance_at_point: f64,
    /// Half of the apex angle, rad.
    pub half_angle_rad: f64,
}

impl Cone {
    /// Signed distance of a point, outside positive.
    pub fn distance(&self, p: &Point3) -> f64 {
        let d = p - self.point;
        let (sin, cos) = self.half_angle_rad.sin_cos();
        d.cross(&self.axis).norm() * cos - d.dot(&self.axis) * sin - self.distance_at_point
    }

    /// Diameter across the axis at `point`.
    pub fn diameter(&self) -> f64 {
        2.0 * self.distance_at_point / self.half_angle_rad.cos()
    }
}

impl Shape<6, 1> for Cone {
    fn residuals(&self, point: &Point3) -> ([f64; 1], [[f64; 6]; 1]) {
        let (u, v) = frame(&self.axis);
        let d = point - self.point;
        let height = d.dot(&self.axis);
        let (du, dv) = (d.dot(&u), d.dot(&v));
        let rho = du.hypot(dv);
        let (cu, cv) = if rho > 0.0 { (du / rho, dv / rho) } else { (1.0, 0.0) };
        let (sin, cos) = self.half_angle_rad.sin_cos();
        let value = rho * cos - height * sin - self.distance_at_point;
        let turn_u = -height * cu * cos - du * sin;
        let turn_v = -height * cv * cos - dv * sin;
        ([value], [[-cu * cos, -cv * cos, turn_u, turn_v, -1.0, -rho * sin - height * cos]])
    }

    fn moved(&self, step: &SVector<f64, 6>) -> Self {
        let (u, v) = frame(&self.axis);
        Self {
            point: self.point + u * step[0] + v * step[1],
            axis: turned(&self.axis, step[2], step[3]),
            distance_at_point: self.distance_at_point + step[4],
            half_angle_rad: self.half_angle_rad + step[5],
        }
    }

    fn is_sound(&self) -> bool {
        self.half_angle_rad.abs() < FRAC_PI_2 && self.distance_at_point.abs() < 1e8
    }
}

/// Axis directions that are tried, and how many of them are carried to their minimum.
const DIRECTIONS: usize = 400;
const CARRIED: usize = 12;

/// Fits a cone; `weights` is empty for equal weights. Also the condition of the fit.
pub fn fit_cone(points: &[Point3], weights: &[f64]) -> Result<(Cone, f64), FitError> {
    let normaliser = Normaliser::of(points, 6)?;
    let scaled = normaliser.apply(points);
    let start = best_start(&scaled, DIRECTIONS, CARRIED, |few, axis| algebraic_start(few, &axis))?;
    let solved = minimise::<_, 6, 1>(start, &scaled, weights)?;
    Ok((told(&solved.shape, &normaliser), solved.condition))
}

/// Fits a cone from one that is near.
pub(in crate::fit) fn fit_cone_near(near: &Cone, points: &[Point3], weights: &[f64]) -> Result<(Cone, f64), FitError> {
    let normaliser = Normaliser::of(points, 6)?;
    let start = Cone {
        point: normaliser.to(&near.point),
        distance_at_point: near.distance_at_point / normaliser.scale,
        ..*near
    };
    let solved = minimise::<_, 6, 1>(start, &normaliser.apply(points), weights)?;
    Ok((told(&solved.shape, &normaliser), solved.condition))
}

/// The cone in the points' own frame, told at the foot of the centroid, its axis towards the growing radius.
fn told(cone: &Cone, normaliser: &Normaliser) -> Cone {
    let sense = if cone.half_angle_rad < 0.0 { -1.0 } else { 1.0 };
    let axis = UnitVector3::new_unchecked(cone.axis.into_inner() * sense);
    let half_angle_rad = cone.half_angle_rad * sense;
    // The scaled centroid is the origin; sliding by s along the axis adds s·sin to the distance.
    let slide = -cone.point.coords.dot(&axis);
    Cone {
        point: normaliser.back(&(cone.point + axis.into_inner() * slide)),
        axis,
        distance_at_point: (cone.distance_at_point + slide * half_angle_rad.sin()) * normaliser.scale,
        half_angle_rad,
    }
}

/// With `h` along the axis and radius `r0 + k h`, `u² + v² = 2 a u + 2 b v + A + B h + C h²` is linear; `C = k²`, `B = 2 r0 k`.
fn algebraic_start(points: &[Point3], axis: &UnitVector3) -> Option<Cone> {
    let (u, v) = frame(axis);
    let local: Vec<[f64; 3]> =
        points.iter().map(|p| [p.coords.dot(&u), p.coords.dot(&v), p.coords.dot(axis)]).collect();
    let matrix = DMatrix::from_fn(local.len(), 5, |k, c| {
        let [x, y, h] = local[k];
        [2.0 * x, 2.0 * y, 1.0, h, h * h][c]
    });
    let right = DVector::from_fn(local.len(), |k, _| local[k][0] * local[k][0] + local[k][1] * local[k][1]);
    let solution = decompose::svd(matrix, true, true)?.solve(&right, 1e-12).ok()?;
    let point = Point3::from(u * solution[0] + v * solution[1]);
    let slope = solution[4].max(1e-4).sqrt() * if solution[3] < 0.0 { -1.0 } else { 1.0 };
    let radius_squared = solution[2] + solution[0] * solution[0] + solution[1] * solution[1];
    let radius = if radius_squared > 0.0 { radius_squared.sqrt() } else { solution[3] / (2.0 * slope) };
    let half_angle_rad = slope.atan();
    Some(Cone { point, axis: *axis, distance_at_point: radius * half_angle_rad.cos(), half_angle_rad })
}
