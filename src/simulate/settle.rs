//! How a part comes to rest on the belt: it tips over its contact points until its centre of gravity is carried.

use crate::geometry::{Mesh, Point3, UnitVector3, Vector3};
use nalgebra::UnitQuaternion;

/// Heights within this of the lowest one touch the belt.
const TOUCH_MM: f64 = 1e-6;
/// Tips over at most so often; a part needs about ten.
const MOST_TIPS: usize = 400;

/// The centre of a sheet's mass: the area-weighted middle of its face.
pub fn centre_of_mass(face: &Mesh) -> Point3 {
    let mut sum = Vector3::zeros();
    let mut area = 0.0;
    for t in 0..face.triangles.len() {
        let [a, b, c] = face.corners(t);
        let weight = face.area_vector_twice(t).norm();
        sum += (a.coords + b.coords + c.coords) * (weight / 3.0);
        area += weight;
    }
    Point3::from(sum / area)
}

/// The direction, in the frame of `vertices`, that points up when the part has been put down with `up` up and has tipped
/// until it lies still on a level belt.
///
/// The part pivots about the lowest point in the way the weight pulls, then about the line of two contacts, until three
/// contacts stand around the centre of gravity.
pub fn settle(vertices: &[Point3], centre_of_mass: &Point3, up: UnitVector3) -> UnitVector3 {
    let mut up = up;
    for _ in 0..MOST_TIPS {
        let contacts = contacts(vertices, &up);
        let Some(axis) = tipping_axis(&contacts, centre_of_mass, &up) else { return up };
        match tip(vertices, &contacts, &axis, &up) {
            Some(next) => up = next,
            None => return up,
        }
    }
    up
}

/// The lowest points.
fn contacts(vertices: &[Point3], up: &UnitVector3) -> Vec<Point3> {
    let lowest = vertices.iter().map(|v| v.coords.dot(up)).fold(f64::INFINITY, f64::min);
    vertices.iter().filter(|v| v.coords.dot(up) < lowest + TOUCH_MM).copied().collect()
}

/// A line through contacts about which the weight turns the part; `None` when the contacts carry it.
struct Axis {
    through: Point3,
    /// Turning about it by the right hand rule lets the centre of gravity down.
    direction: UnitVector3,
}

fn tipping_axis(contacts: &[Point3], centre: &Point3, up: &UnitVector3) -> Option<Axis> {
    let flat = |v: Vector3| v - up.into_inner() * v.dot(up);
    // The point of the contacts' hull nearest to the centre of gravity, seen from above.
    let (nearest, through) = nearest_in_hull(contacts, centre, &flat);
    let overhang = flat(centre - nearest);
    if overhang.norm() < 1e-7 {
        return None;
    }
    // The weight pulls towards the overhang: `up x overhang` turns the part that way.
    let direction = UnitVector3::new_normalize(up.cross(&overhang));
    Some(Axis { through, direction })
}

/// Nearest place of the convex hull of the contacts to the centre, seen from above, and a contact it hangs on. Contacts are
/// few, or lie in a line or a face: Frank-Wolfe steps between them find the place to well below a micrometre.
fn nearest_in_hull(contacts: &[Point3], centre: &Point3, flat: &impl Fn(Vector3) -> Vector3) -> (Point3, Point3) {
    let mut hull: Vec<Point3> = Vec::new();
    let by_distance = |p: &Point3, q: &Point3| flat(p - centre).norm().total_cmp(&flat(q - centre).norm());
    let Some(mut best) = contacts.iter().copied().min_by(by_distance) else { return (*centre, *centre) };
    hull.push(best);
    let mut through = best;
    for _ in 0..64 {
        // The contact furthest towards the centre, seen from the best place.
        let pull = flat(centre - best);
        let Some(next) = contacts.iter().max_by(|p, q| (*p - best).dot(&pull).total_cmp(&(*q - best).dot(&pull)))
        else {
            break;
        };
        if (next - best).dot(&pull) < 1e-9 * pull.norm() {
            break;
        }
        hull.push(*next);
        (best, hull) = nearest_of_triangle_fan(&hull, centre, flat);
        through = hull[0];
    }
    (best, through)
}

/// Nearest place within up to four points' simplex (seen from above), with the points that carry it.
fn nearest_of_triangle_fan(
    points: &[Point3],
    centre: &Point3,
    flat: &impl Fn(Vector3) -> Vector3,
) -> (Point3, Vec<Point3>) {
    let mut best = (f64::INFINITY, points[0], vec![points[0]]);
    let mut offer = |place: Point3, carried: Vec<Point3>| {
        let distance = flat(centre - place).norm();
        if distance < best.0 - 1e-12 {
            best = (distance, place, carried);
        }
    };
    for (i, a) in points.iter().enumerate() {
        offer(*a, vec![*a]);
        for (j, b) in points.iter().enumerate().skip(i + 1) {
            let along = flat(b - a);
            if along.norm_squared() > 0.0 {
                let t = (flat(centre - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                offer(a + (b - a) * t, vec![*a, *b]);
            }
            for c in points.iter().skip(j + 1) {
                if let Some(place) = inside_triangle(a, b, c, centre, flat) {
                    offer(place, vec![*a, *b, *c]);
                }
            }
        }
    }
    (best.1, best.2)
}

fn inside_triangle(
    a: &Point3,
    b: &Point3,
    c: &Point3,
    centre: &Point3,
    flat: &impl Fn(Vector3) -> Vector3,
) -> Option<Point3> {
    let (e, f, g) = (flat(b - a), flat(c - a), flat(centre - a));
    let (ee, ef, ff, eg, fg) = (e.dot(&e), e.dot(&f), f.dot(&f), e.dot(&g), f.dot(&g));
    let det = ee * ff - ef * ef;
    if det <= 1e-12 * ee * ff {
        return None;
    }
    let (s, t) = ((eg * ff - fg * ef) / det, (fg * ee - eg * ef) / det);
    (s >= 0.0 && t >= 0.0 && s + t <= 1.0).then(|| a + (b - a) * s + (c - a) * t)
}

/// Turns the part about the axis until the next vertex touches the belt; `None` when none ever does.
fn tip(vertices: &[Point3], contacts: &[Point3], axis: &Axis, up: &UnitVector3) -> Option<UnitVector3> {
    let lowest = contacts.iter().map(|c| c.coords.dot(up)).fold(f64::INFINITY, f64::min);
    // Across the axis, to the side that goes down.
    let ahead = axis.direction.cross(up);
    let angle = vertices
        .iter()
        .map(|v| ((v - axis.through).dot(&ahead), v.coords.dot(up) - lowest))
        .filter(|(out, height)| *height >= TOUCH_MM || *out > 1e-6)
        .map(|(out, height)| height.max(0.0).atan2(out))
        .filter(|angle| *angle > 1e-9)
        .fold(f64::INFINITY, f64::min);
    // Turning the part by +angle is turning `up` by -angle in the part's frame.
    angle.is_finite().then(|| UnitQuaternion::from_axis_angle(&axis.direction, -angle) * up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{BracketParameters, bracket, cover, rail};

    #[test]
    fn parts_rest_on_three_points_around_their_weight() {
        let parts = [bracket(&BracketParameters { spacing_mm: 5.0, ..Default::default() }), rail(), cover()];
        for part in &parts {
            let vertices: Vec<Point3> = part.mesh.vertices.iter().chain(&part.lower.vertices).copied().collect();
            let centre = centre_of_mass(&part.mesh);
            for up in [Vector3::z_axis(), -Vector3::z_axis(), Vector3::x_axis()] {
                let rest = settle(&vertices, &centre, up);
                let lowest = vertices.iter().map(|v| v.coords.dot(&rest)).fold(f64::INFINITY, f64::min);
                let touching: Vec<_> = vertices.iter().filter(|v| v.coords.dot(&rest) < lowest + 1e-4).collect();
                assert!(touching.len() >= 3, "{}: {} contacts", part.name, touching.len());
                // The weight is carried: it lies within the contacts' reach in every level direction.
                for k in 0..16 {
                    let turn = UnitQuaternion::from_axis_angle(&rest, std::f64::consts::FRAC_PI_8 * k as f64);
                    let level = turn * rest.cross(&Vector3::new(0.31, 0.72, 0.62)).normalize();
                    let reach = touching.iter().map(|v| v.coords.dot(&level)).fold(f64::NEG_INFINITY, f64::max);
                    assert!(reach > centre.coords.dot(&level) - 1e-3, "{} from {up:?}", part.name);
                }
            }
        }
    }
}
