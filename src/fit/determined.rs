//! Whether points fix a shape, or only one of the simpler sets on which the shape may slide.
//!
//! **Problem.** A sphere through a circle of points may slide along the circle's axis; with a little scatter a least-squares fit still
//! stops somewhere, with a good residual, an innocent condition number and a meaningless centre. The same holds for a plane or a circle of
//! points in line, and for a cylinder or a cone of points in one plane or of a single ring.
//!
//! **Answer.** Each shape must explain the points better than the simpler set does: the sum of squares about the best line or plane must
//! exceed the sum about the shape by more than chance. The ratio of two sums of `n` squared Gaussian residuals scatters by `2 / sqrt(n)`;
//! six times that is asked for. Points without scatter are held to rounding.

use super::outcome::{CoordinatePlane, Fitted, Known};
use super::shapes::cone::Cone;
use super::shapes::cylinder::{Cylinder, fit_cylinder_near};
use super::shapes::line::principal_axes;
use super::shapes::{FitError, Normaliser};
use crate::geometry::{Point3, UnitVector3};

/// Standard deviations of the ratio that are asked for, times the 2 of its scatter.
const BEYOND_CHANCE: f64 = 6.0 * 2.0;
/// Residuals below this share of the points' size are rounding.
const ROUNDING: f64 = 1e-9;
/// A radius below this many times the rms residual is scatter: points that fill a round thread lie 2.8 times as far from its axis as
/// they scatter about their mean distance from it.
const LEAST_RADIUS: f64 = 3.0;
const LEAST_SPHERE: f64 = 4.5;
/// Points whose sum of squares along is so many times that across lie in line, thick as the line may be.
const IN_LINE: f64 = 25.0;
/// Points scattered off a circle's given plane by more than this share of the radius are no circle in that plane.
const MOST_OFF_PLANE: f64 = 0.25;

/// Refuses a shape that the points do not fix. `points` are those that were used, `distances` their distances as the fit sees them.
pub(super) fn check(shape: &Fitted, points: &[Point3], distances: &[f64], known: Known) -> Result<(), FitError> {
    check_freely(shape, points, distances, known.plane).map_err(|e| match e {
        // The points may well fix a shape of another radius.
        FitError::NotFixed { .. } if known.radius.is_some() => FitError::NotOfRadius,
        other => other,
    })
}

fn check_freely(
    shape: &Fitted,
    points: &[Point3],
    distances: &[f64],
    plane: Option<CoordinatePlane>,
) -> Result<(), FitError> {
    let sums = Sums::of(points, distances)?;
    let not = |why: &'static str| Err(FitError::NotFixed { why });
    let [first, second, third] = spreads(points)?;
    match shape {
        Fitted::Line(_) if !sums.is_beyond_chance(first, second) => not("they spread alike in two directions"),
        Fitted::Plane(_) if !sums.is_beyond_chance(second, third) => {
            let in_line = sums.is_beyond_chance(first, second) && first > IN_LINE * second;
            not(if in_line {
                "they lie in line"
            } else {
                "they spread alike in two directions or three, and lie in no plane"
            })
        }
        Fitted::Circle(circle) => {
            if let Some(plane) = plane {
                check_in_plane(points, plane, circle.radius, sums.rms)?;
            }
            let flat: Vec<Point3> = points.iter().map(|p| flattened(p, &circle.centre, &circle.axis)).collect();
            let [_, across, _] = spreads(&flat)?;
            let across = across * (Normaliser::of(&flat, 2)?.scale / sums.scale).powi(2);
            if !sums.is_beyond_chance(across, sums.fit) {
                not("a line explains them as well")
            } else if circle.radius < LEAST_RADIUS * sums.rms {
                not("they scatter by more than its radius")
            } else {
                Ok(())
            }
        }
        Fitted::Sphere(_) if !sums.is_beyond_chance(third, sums.fit) => not("a plane explains them as well"),
        // Points that fill a ball lie 3.9 times as far from its middle as they scatter about their mean distance from it.
        Fitted::Sphere(sphere) if sphere.radius < LEAST_SPHERE * sums.rms => {
            not("they scatter by more than its radius")
        }
        Fitted::Cylinder(Cylinder { radius, .. }) | Fitted::Cone(Cone { distance_at_point: radius, .. })
            if *radius < LEAST_RADIUS * sums.rms =>
        {
            not("they scatter by more than its radius")
        }
        Fitted::Cylinder(cylinder) => check_around(points, &cylinder.point, &cylinder.axis, third, &sums),
        Fitted::Cone(cone) => {
            check_around(points, &cone.point, &cone.axis, third, &sums)?;
            if sums.is_cone(points, cone) { Ok(()) } else { not("a cylinder explains them as well") }
        }
        _ => Ok(()),
    }
}

/// Sums of squares in units of the points' size.
struct Sums {
    count: f64,
    scale: f64,
    /// About the shape.
    fit: f64,
    /// Of the distances, in the points' unit.
    rms: f64,
}

impl Sums {
    fn of(points: &[Point3], distances: &[f64]) -> Result<Self, FitError> {
        let (count, scale) = (points.len() as f64, Normaliser::of(points, 2)?.scale);
        let sum: f64 = distances.iter().map(|d| d * d).sum();
        Ok(Self { count, scale, fit: sum / (scale * scale), rms: (sum / count).sqrt() })
    }

    /// Whether a cone explains the points better than the cylinder that fits them best: one parameter more must take more off the sum of
    /// squares than three times its standard uncertainty does by chance, `9 sigma²`, and more than rounding.
    fn is_cone(&self, points: &[Point3], cone: &Cone) -> bool {
        let near = Cylinder { point: cone.point, axis: cone.axis, radius: 0.5 * cone.diameter() };
        let Ok((cylinder, _)) = fit_cylinder_near(&near, points, &[]) else { return true };
        let about_it: f64 = points.iter().map(|p| (cylinder.distance(p) / self.scale).powi(2)).sum();
        let variance = self.fit / (self.count - 6.0).max(1.0);
        about_it - self.fit > 9.0 * variance + self.count * ROUNDING * ROUNDING
    }

    /// Whether a sum of squares about the simpler set is larger than that about the shape by more than chance. False for NaN.
    fn is_beyond_chance(&self, simpler: f64, shape: f64) -> bool {
        simpler > shape * (1.0 + BEYOND_CHANCE / self.count.sqrt()) + self.count * ROUNDING * ROUNDING
    }
}

/// Sums of squares along the principal axes, the largest first, in units of the points' size.
fn spreads(points: &[Point3]) -> Result<[f64; 3], FitError> {
    let (_, values, _) = principal_axes(points, &[])?;
    Ok(values.map(|v| v * v))
}

fn flattened(p: &Point3, centre: &Point3, axis: &UnitVector3) -> Point3 {
    p - axis.into_inner() * (p - centre).dot(axis)
}

/// A cylinder or cone: not of points in one plane, and not of a single ring, about which its axis may tilt.
fn check_around(
    points: &[Point3],
    on_axis: &Point3,
    axis: &UnitVector3,
    off_plane: f64,
    sums: &Sums,
) -> Result<(), FitError> {
    if !sums.is_beyond_chance(off_plane, sums.fit) {
        return Err(FitError::NotFixed { why: "a plane or a line explains them as well" });
    }
    let heights: Vec<f64> = points.iter().map(|p| (p - on_axis).dot(axis) / sums.scale).collect();
    let mean = heights.iter().sum::<f64>() / sums.count;
    let along: f64 = heights.iter().map(|h| (h - mean).powi(2)).sum();
    if sums.is_beyond_chance(along, sums.fit) {
        Ok(())
    } else {
        Err(FitError::NotFixed { why: "they are a single ring" })
    }
}

/// The points of a circle in a given plane must lie there.
fn check_in_plane(points: &[Point3], plane: CoordinatePlane, radius: f64, rms: f64) -> Result<(), FitError> {
    let n = points.len() as f64;
    let off: Vec<f64> = points.iter().map(|p| p[plane.axis] - plane.value).collect();
    let mean = off.iter().sum::<f64>() / n;
    let spread = (off.iter().map(|o| (o - mean).powi(2)).sum::<f64>() / n).sqrt();
    if spread > MOST_OFF_PLANE * radius {
        return Err(FitError::OffPlane { off: spread, mean_value: plane.value + mean });
    }
    if mean.abs() > 3.0 * spread.max(rms) + ROUNDING * (radius + plane.value.abs()) {
        return Err(FitError::OffPlane { off: mean.abs(), mean_value: plane.value + mean });
    }
    Ok(())
}
