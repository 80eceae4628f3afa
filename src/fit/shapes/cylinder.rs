//! The cylinder.

use super::circle::algebraic_start;
use super::{FitError, Normaliser, best_start, frame, turned};
use crate::fit::gauss_newton::{Shape, minimise};
use crate::geometry::{Point3, UnitVector3};
use nalgebra::SVector;

/// A cylinder without ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// A point of the axis: the one nearest to the centroid of the points.
    pub point: Point3,
    /// Direction of the axis, either way.
    pub axis: UnitVector3,
    /// Its radius.
    pub radius: f64,
}

impl Cylinder {
    /// Signed distance of a point, outside positive.
    pub fn distance(&self, p: &Point3) -> f64 {
        (p - self.point).cross(&self.axis).norm() - self.radius
    }
}

impl Shape<5, 1> for Cylinder {
    fn residuals(&self, point: &Point3) -> ([f64; 1], [[f64; 5]; 1]) {
        let (u, v) = frame(&self.axis);
        let d = point - self.point;
        let height = d.dot(&self.axis);
        let (du, dv) = (d.dot(&u), d.dot(&v));
        let rho = du.hypot(dv);
        let (cos, sin) = if rho > 0.0 { (du / rho, dv / rho) } else { (1.0, 0.0) };
        ([rho - self.radius], [[-cos, -sin, -height * cos, -height * sin, -1.0]])
    }

    fn moved(&self, step: &SVector<f64, 5>) -> Self {
        let (u, v) = frame(&self.axis);
        Self {
            point: self.point + u * step[0] + v * step[1],
            axis: turned(&self.axis, step[2], step[3]),
            radius: self.radius + step[4],
        }
    }

    fn is_sound(&self) -> bool {
        self.radius > 0.0 && self.radius < 1e8
    }
}

/// Axis directions that are tried, and how many of them are carried to their minimum.
const DIRECTIONS: usize = 300;
const CARRIED: usize = 8;

/// Fits a cylinder; `weights` is empty for equal weights. Also the condition of the fit.
pub fn fit_cylinder(points: &[Point3], weights: &[f64]) -> Result<(Cylinder, f64), FitError> {
    let normaliser = Normaliser::of(points, 5)?;
    let scaled = normaliser.apply(points);
    let start = best_start(&scaled, DIRECTIONS, CARRIED, |few, axis| {
        let circle = algebraic_start(few, &Point3::origin(), &axis).ok()?;
        Some(Cylinder { point: circle.centre, axis, radius: circle.radius })
    })?;
    carried(start, &normaliser, &scaled, weights)
}

/// Fits a cylinder from one that is near.
pub(in crate::fit) fn fit_cylinder_near(
    near: &Cylinder,
    points: &[Point3],
    weights: &[f64],
) -> Result<(Cylinder, f64), FitError> {
    let normaliser = Normaliser::of(points, 5)?;
    let start = Cylinder { point: normaliser.to(&near.point), axis: near.axis, radius: near.radius / normaliser.scale };
    carried(start, &normaliser, &normaliser.apply(points), weights)
}

fn carried(
    start: Cylinder,
    normaliser: &Normaliser,
    scaled: &[Point3],
    weights: &[f64],
) -> Result<(Cylinder, f64), FitError> {
    let solved = minimise::<_, 5, 1>(start, scaled, weights)?;
    let cylinder = solved.shape;
    // The scaled centroid is the origin.
    let foot = cylinder.point - cylinder.axis.into_inner() * cylinder.point.coords.dot(&cylinder.axis);
    let back =
        Cylinder { point: normaliser.back(&foot), axis: cylinder.axis, radius: cylinder.radius * normaliser.scale };
    Ok((back, solved.condition))
}
