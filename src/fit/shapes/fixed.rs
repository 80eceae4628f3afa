//! Shapes whose radius is given and not fitted.

use super::circle::{Circle, FlatCircle};
use super::cylinder::Cylinder;
use super::sphere::Sphere;
use super::{FitError, Normaliser};
use crate::fit::gauss_newton::{Shape, minimise};
use crate::geometry::Point3;
use nalgebra::SVector;

/// A shape that keeps its radius: the last of its local parameters.
#[derive(Debug, Clone, Copy)]
pub(in crate::fit) struct FixedRadius<S>(pub(in crate::fit) S);

macro_rules! keeps_its_radius {
    ($shape:ty, $all:literal, $free:literal, $residuals:literal) => {
        impl Shape<$free, $residuals> for FixedRadius<$shape> {
            fn residuals(&self, point: &Point3) -> ([f64; $residuals], [[f64; $free]; $residuals]) {
                let (values, rows) = <$shape as Shape<$all, $residuals>>::residuals(&self.0, point);
                (values, rows.map(|row| std::array::from_fn(|k| row[k])))
            }

            fn moved(&self, step: &SVector<f64, $free>) -> Self {
                let step = SVector::from_fn(|k, _| if k < $free { step[k] } else { 0.0 });
                Self(<$shape as Shape<$all, $residuals>>::moved(&self.0, &step))
            }

            fn is_sound(&self) -> bool {
                self.0.is_sound()
            }
        }
    };
}

keeps_its_radius!(Sphere, 4, 3, 1);
keeps_its_radius!(Circle, 6, 5, 2);
keeps_its_radius!(FlatCircle, 3, 2, 1);
keeps_its_radius!(Cylinder, 5, 4, 1);

/// Goes on from a shape that was fitted with a radius of its own to one with the radius given. Also the condition of the fit.
pub(in crate::fit) fn fit_sphere_of(
    radius: f64,
    free: &Sphere,
    points: &[Point3],
    weights: &[f64],
) -> Result<(Sphere, f64), FitError> {
    let normaliser = Normaliser::of(points, 3)?;
    let start = Sphere { centre: normaliser.to(&free.centre), radius: radius / normaliser.scale };
    let solved = minimise::<_, 3, 1>(FixedRadius(start), &normaliser.apply(points), weights)?;
    Ok((Sphere { centre: normaliser.back(&solved.shape.0.centre), radius }, solved.condition))
}

/// The same for a circle in space.
pub(in crate::fit) fn fit_circle_of(
    radius: f64,
    free: &Circle,
    points: &[Point3],
    weights: &[f64],
) -> Result<(Circle, f64), FitError> {
    let normaliser = Normaliser::of(points, 3)?;
    let start = Circle { centre: normaliser.to(&free.centre), axis: free.axis, radius: radius / normaliser.scale };
    let solved = minimise::<_, 5, 2>(FixedRadius(start), &normaliser.apply(points), weights)?;
    let Circle { centre, axis, .. } = solved.shape.0;
    Ok((Circle { centre: normaliser.back(&centre), axis, radius }, solved.condition))
}

/// The same for a circle that stays in its plane.
pub(in crate::fit) fn fit_flat_circle_of(
    radius: f64,
    free: &Circle,
    points: &[Point3],
    weights: &[f64],
) -> Result<(Circle, f64), FitError> {
    let normaliser = Normaliser::of(points, 3)?;
    let start = Circle { centre: normaliser.to(&free.centre), axis: free.axis, radius: radius / normaliser.scale };
    let solved = minimise::<_, 2, 1>(FixedRadius(FlatCircle(start)), &normaliser.apply(points), weights)?;
    Ok((Circle { centre: normaliser.back(&solved.shape.0.0.centre), axis: free.axis, radius }, solved.condition))
}

/// The same for a cylinder.
pub(in crate::fit) fn fit_cylinder_of(
    radius: f64,
    free: &Cylinder,
    points: &[Point3],
    weights: &[f64],
) -> Result<(Cylinder, f64), FitError> {
    let normaliser = Normaliser::of(points, 4)?;
    let start = Cylinder { point: normaliser.to(&free.point), axis: free.axis, radius: radius / normaliser.scale };
    let solved = minimise::<_, 4, 1>(FixedRadius(start), &normaliser.apply(points), weights)?;
    let Cylinder { point, axis, .. } = solved.shape.0;
    // Told at the foot of the centroid, which is the origin of the scaled points.
    let foot = point - axis.into_inner() * point.coords.dot(&axis);
    Ok((Cylinder { point: normaliser.back(&foot), axis, radius }, solved.condition))
}
