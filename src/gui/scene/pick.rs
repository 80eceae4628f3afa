//! What stands under the pointer: the nearest marker, else a place on the CAD.

use super::camera::{Camera, ViewSize};
use crate::geometry::{Bvh, Mesh, Point3, UnitVector3, Vector3};

/// A place on a surface that was pointed at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pick {
    /// CAD frame.
    pub place: Point3,
    /// The triangle.
    pub triangle: u32,
    /// Its normal.
    pub normal: UnitVector3,
}

/// The place that is seen in a pixel of the view; `None` beside the part.
pub fn surface(mesh: &Mesh, bvh: &Bvh, camera: &Camera, pixel: [f64; 2], size: ViewSize) -> Option<Pick> {
    let ray = camera.ray(pixel, size, REACH_MM);
    let hit = bvh.ray(&ray.origin, &ray.direction, f64::INFINITY)?;
    let normal = mesh.normal(hit.triangle as usize)?;
    Some(Pick { place: ray.origin + ray.direction * hit.t, triangle: hit.triangle, normal })
}

/// Further towards the eye from the target than this there is no part, mm: 100 m. A ray that begins there is still exact to 1e-11 mm.
const REACH_MM: f64 = 1e5;

/// Something may stand before a place by this much without hiding it, mm: the place may lie a little below the CAD.
const BEFORE_MM: f64 = 2.0;

/// Whether the part stands between the eye and a place.
pub fn is_hidden(bvh: &Bvh, camera: &Camera, place: &Point3, size: ViewSize) -> bool {
    let Some(seen) = camera.project(place, size) else { return true };
    let ray = camera.ray([seen.x, seen.y], size, REACH_MM);
    let distance = (place - ray.origin).dot(&ray.direction);
    bvh.ray(&ray.origin, &ray.direction, distance - BEFORE_MM).is_some()
}

/// The marker nearest to a pixel within a reach in pixels; of equal ones the first. Places are in pixels, `None` = not shown.
pub fn marker(places: &[Option<[f64; 2]>], pixel: [f64; 2], reach_px: f64) -> Option<usize> {
    let distance = |p: &[f64; 2]| (p[0] - pixel[0]).hypot(p[1] - pixel[1]);
    let near = places.iter().enumerate().filter_map(|(k, p)| Some((k, distance(p.as_ref()?))));
    near.filter(|(_, d)| *d <= reach_px).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// A distance between two picks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Straight, mm.
    pub straight_mm: f64,
    /// Along x, y and z of the CAD, from the first to the second, mm.
    pub along_mm: Vector3,
    /// Between the normals, degrees.
    pub angle_deg: f64,
}

/// From the first pick to the second.
pub fn distance(from: &Pick, to: &Pick) -> Distance {
    let along_mm = to.place - from.place;
    Distance { straight_mm: along_mm.norm(), along_mm, angle_deg: from.normal.angle(&to.normal).to_degrees() }
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Projection, StandardView};
    use super::*;
    use crate::report::example;

    const SIZE: ViewSize = ViewSize { width: 800.0, height: 600.0 };

    fn from_above(projection: Projection) -> Camera {
        let cad_from_eye = StandardView::Top.cad_from_eye(&Vector3::z());
        Camera { target: Point3::new(5.0, 5.0, 10.0), cad_from_eye, height_mm: 200.0, projection }
    }

    #[test]
    fn what_is_picked_is_what_is_seen_there() {
        let mesh = example::dome(40);
        let bvh = Bvh::build(&mesh);
        for projection in [Projection::Perspective, Projection::Parallel] {
            let camera = from_above(projection);
            for vertex in [[60.0, 35.0], [-36.0, 28.0], [48.0, -42.0]] {
                let place = example::dome_point(vertex[0], vertex[1]);
                let seen = camera.project(&place, SIZE).unwrap();
                let pick = surface(&mesh, &bvh, &camera, [seen.x, seen.y], SIZE).unwrap();
                // A vertex of the mesh: rounding, and triangles grown by a 1e-9th.
                assert!((pick.place - place).norm() < 1e-5, "{projection:?} {} {place}", pick.place);
                assert!(pick.normal.z > 0.5);
                assert!(!is_hidden(&bvh, &camera, &place, SIZE));
                let below = place - Vector3::z() * 20.0;
                assert!(is_hidden(&bvh, &camera, &below, SIZE), "{projection:?}");
            }
            // Through the hole in the middle, and beside the part.
            let hole = camera.project(&Point3::new(0.0, 0.0, 18.0), SIZE).unwrap();
            assert_eq!(surface(&mesh, &bvh, &camera, [hole.x, hole.y], SIZE), None);
            assert_eq!(surface(&mesh, &bvh, &camera, [1.0, 1.0], SIZE), None);
        }
    }

    #[test]
    fn the_nearest_marker_within_reach() {
        let places = [Some([10.0, 10.0]), None, Some([14.0, 10.0]), Some([14.0, 10.0])];
        assert_eq!(marker(&places, [12.5, 10.0], 8.0), Some(2));
        assert_eq!(marker(&places, [11.0, 10.0], 8.0), Some(0));
        assert_eq!(marker(&places, [40.0, 10.0], 8.0), None);
        assert_eq!(marker(&[], [0.0, 0.0], 8.0), None);
    }

    #[test]
    fn a_distance_has_a_direction_and_an_angle() {
        let pick = |x: f64, z: f64, normal: Vector3| Pick {
            place: Point3::new(x, 0.0, z),
            triangle: 0,
            normal: UnitVector3::new_normalize(normal),
        };
        let d = distance(&pick(1.0, 0.0, Vector3::z()), &pick(4.0, 4.0, Vector3::x()));
        assert_eq!((d.straight_mm, d.along_mm), (5.0, Vector3::new(3.0, 0.0, 4.0)));
        assert!((d.angle_deg - 90.0).abs() < 1e-9);
    }
}
