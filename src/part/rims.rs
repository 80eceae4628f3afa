//! The openings of a CAD: centre, size and long axis of every hole rim.

use super::Face;
use crate::geometry::{Point3, UnitVector3, Vector3};
use nalgebra::Matrix2;

/// Rim points at which the surface normal is asked for, to tell a hole from an outer contour.
const NORMAL_SAMPLES: usize = 16;

/// One opening of a face, CAD frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rim {
    /// Length-weighted middle of the rim.
    pub centre: Point3,
    /// Normal of the opening, on the side of the face's normals.
    pub axis: UnitVector3,
    /// Diameter of the circle of the same area.
    pub diameter_mm: f64,
    /// Direction of the largest extent, in the opening's plane.
    pub long_axis: UnitVector3,
    /// Extent along the long axis.
    pub length_mm: f64,
    /// Extent across it.
    pub width_mm: f64,
}

/// The openings of a face; outer contours are left out: with the normal towards the viewer the surface lies on the left
/// of its boundary, so a hole is run around clockwise.
pub(crate) fn rims(face: &Face) -> Vec<Rim> {
    face.boundary_loops.iter().filter_map(|points| rim(face, points)).collect()
}

/// The opening that a closed loop of a face runs around; `None` of an outer contour.
pub(crate) fn rim(face: &Face, points: &[Point3]) -> Option<Rim> {
    let (first, last) = (points.first()?, points.last()?);
    if points.len() < 4 || first != last {
        return None;
    }
    let mut weighted = Vector3::zeros();
    let mut perimeter = 0.0;
    let mut area_twice = Vector3::zeros();
    for pair in points.windows(2) {
        let (a, b) = (pair[0] - first, pair[1] - first);
        let length = (b - a).norm();
        weighted += (a + b) * (0.5 * length);
        perimeter += length;
        area_twice += a.cross(&b);
    }
    if perimeter <= 0.0 {
        return None;
    }
    let centre = first + weighted / perimeter;
    let step = (points.len() / NORMAL_SAMPLES).max(1);
    let normal: Vector3 = points
        .iter()
        .step_by(step)
        .filter_map(|p| face.closest(p, f64::INFINITY))
        .map(|hit| hit.normal.into_inner())
        .sum();
    if area_twice.dot(&normal) >= 0.0 {
        return None;
    }
    let axis = UnitVector3::try_new(-area_twice, 1e-12)?;
    let long_axis = long_axis(points, &centre, &axis)?;
    let across = axis.cross(&long_axis);
    let extent = |d: &Vector3| {
        let along = points.iter().map(|p| (p - centre).dot(d));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    Some(Rim {
        centre,
        axis,
        diameter_mm: (2.0 * area_twice.norm() / std::f64::consts::PI).sqrt(),
        long_axis,
        length_mm: extent(&long_axis),
        width_mm: extent(&across),
    })
}

/// Main axis of the rim taken as a wire: each piece weighs its length.
fn long_axis(points: &[Point3], centre: &Point3, axis: &UnitVector3) -> Option<UnitVector3> {
    let u = UnitVector3::try_new(axis.cross(&least_component(axis)), 1e-12)?;
    let v = axis.cross(&u);
    let mut moment = Matrix2::zeros();
    for pair in points.windows(2) {
        let middle = nalgebra::center(&pair[0], &pair[1]) - centre;
        let (x, y) = (middle.dot(&u), middle.dot(&v));
        moment += Matrix2::new(x * x, x * y, x * y, y * y) * (pair[1] - pair[0]).norm();
    }
    let angle = 0.5 * (2.0 * moment[(0, 1)]).atan2(moment[(0, 0)] - moment[(1, 1)]);
    UnitVector3::try_new(u.into_inner() * angle.cos() + v * angle.sin(), 1e-12)
}

/// The coordinate axis farthest from a direction.
fn least_component(d: &UnitVector3) -> Vector3 {
    Vector3::ith(d.iamin(), 1.0)
}
