//! From where the map is seen: along the mean normal of the seen face, its longest extent across the picture.

use crate::geometry::{Mesh, Point3, Vector3};
use std::f64::consts::PI;

/// An orthographic view; its axes are unit vectors in the CAD frame, right-handed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Middle of the picture.
    pub origin: Point3,
    /// To the right of the picture.
    pub right: Vector3,
    /// To its top.
    pub up: Vector3,
    /// Towards the eye.
    pub towards: Vector3,
    /// Half of the part's width in the picture, mm.
    pub half_width_mm: f64,
    /// Half of its height in the picture, mm.
    pub half_height_mm: f64,
}

/// Steps of the search for the smallest frame, over half a turn: one degree.
const STEPS: usize = 180;

impl View {
    /// The best viewing direction of a face whose triangles point to the camera: the area-weighted mean of its normals, so
    /// that as much of it as possible is seen square on. Around it, the part lies in the smallest frame, long side across,
    /// turned so that the CAD axis most across the picture points to the right. `None` for a mesh without vertices.
    pub fn best(mesh: &Mesh) -> Option<View> {
        let sum: Vector3 = (0..mesh.triangles.len()).map(|t| mesh.area_vector_twice(t)).sum();
        let total: f64 = (0..mesh.triangles.len()).map(|t| mesh.area_vector_twice(t).norm()).sum();
        // The normals of a closed surface cancel; then any direction is as good, and z is what people expect.
        let towards = if sum.norm() > 1e-6 * total { sum.normalize() } else { Vector3::z() };
        let least = (0..3).min_by(|&a, &b| towards[a].abs().total_cmp(&towards[b].abs())).unwrap_or(0);
        let mut axis = Vector3::zeros();
        axis[least] = 1.0;
        let first = (axis - towards * towards.dot(&axis)).normalize();
        let second = towards.cross(&first);

        let span = spans(mesh, &first, &second)?;
        let extent = |k: usize| span[k % STEPS].1 - span[k % STEPS].0;
        let area = |k: usize| extent(k) * extent(k + STEPS / 2);
        let best = (0..STEPS / 2).min_by(|&a, &b| area(a).total_cmp(&area(b)))?;
        let across = if extent(best) >= extent(best + STEPS / 2) { best } else { best + STEPS / 2 };
        let angle = PI * across as f64 / STEPS as f64;
        let mut right = first * angle.cos() + second * angle.sin();
        let largest = (0..3).max_by(|&a, &b| right[a].abs().total_cmp(&right[b].abs())).unwrap_or(0);
        if right[largest] < 0.0 {
            right = -right;
        }
        Some(Self::framed(mesh, right, towards.cross(&right), towards))
    }

    fn framed(mesh: &Mesh, right: Vector3, up: Vector3, towards: Vector3) -> View {
        let mut view = View { origin: Point3::origin(), right, up, towards, half_width_mm: 0.0, half_height_mm: 0.0 };
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for vertex in &mesh.vertices {
            let place = view.project(vertex);
            for k in 0..3 {
                low[k] = low[k].min(place[k]);
                high[k] = high[k].max(place[k]);
            }
        }
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (low[k] + high[k]));
        view.origin = Point3::from(right * middle[0] + up * middle[1] + towards * middle[2]);
        view.half_width_mm = 0.5 * (high[0] - low[0]);
        view.half_height_mm = 0.5 * (high[1] - low[1]);
        view
    }

    /// Right, up and towards the eye from the middle of the picture, mm, of a point in the CAD frame.
    pub fn project(&self, point_cad: &Point3) -> [f64; 3] {
        let v = point_cad - self.origin;
        [v.dot(&self.right), v.dot(&self.up), v.dot(&self.towards)]
    }
}

/// Least and greatest reach of the vertices along each of the directions over half a turn.
fn spans(mesh: &Mesh, first: &Vector3, second: &Vector3) -> Option<Vec<(f64, f64)>> {
    let flat = mesh.vertices.iter().map(|v| [v.coords.dot(first), v.coords.dot(second)]).collect();
    let outline = convex_outline(flat);
    if outline.is_empty() {
        return None;
    }
    let reach = |k: usize| {
        let (sin, cos) = (PI * k as f64 / STEPS as f64).sin_cos();
        outline.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            let along = p[0] * cos + p[1] * sin;
            (low.min(along), high.max(along))
        })
    };
    Some((0..STEPS).map(reach).collect())
}

/// Corners of the convex hull of points in the plane (Andrew's monotone chain), in no special order.
fn convex_outline(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut outline = half_outline(points.iter());
    outline.extend(half_outline(points.iter().rev()));
    outline
}

/// The points at which a walk along sorted points turns left.
fn half_outline<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> Vec<[f64; 2]> {
    let mut chain: Vec<[f64; 2]> = Vec::new();
    for p in points {
        while let [.., a, b] = chain[..] {
            if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0 {
                break;
            }
            chain.pop();
        }
        chain.push(*p);
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// A sheet of 200 x 80 mm, turned by a rotation.
    fn sheet(turn: &Rotation3<f64>) -> Mesh {
        let corners = [[0.0, 0.0], [200.0, 0.0], [200.0, 80.0], [0.0, 80.0]];
        Mesh {
            vertices: corners.iter().map(|c| turn * Point3::new(c[0], c[1], 7.0)).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn looks_square_on_with_the_long_side_across() {
        for k in 0..40 {
            let turn = Rotation3::from_euler_angles(0.3 * f64::from(k), 0.17 * f64::from(k), -0.41 * f64::from(k));
            let view = View::best(&sheet(&turn)).unwrap();
            assert!((view.towards - turn * Vector3::z()).norm() < 1e-9);
            assert!((view.right.cross(&view.up) - view.towards).norm() < 1e-9, "mirrored");
            // Steps of a degree leave at most half a degree: 80 mm * sin(0.5 deg) = 0.7 mm on the long side.
            assert!((2.0 * view.half_width_mm - 200.0).abs() < 0.8, "{}", view.half_width_mm);
            assert!((2.0 * view.half_height_mm - 80.0).abs() < 1.9, "{}", view.half_height_mm);
        }
    }

    #[test]
    fn projection_keeps_distances_and_hands() {
        let view = View::best(&sheet(&Rotation3::identity())).unwrap();
        assert!(view.right.x > 0.999 && view.up.y > 0.999);
        let place = view.project(&Point3::new(200.0, 80.0, 9.0));
        assert!((place[0] - 100.0).abs() < 1e-9 && (place[1] - 40.0).abs() < 1e-9 && (place[2] - 2.0).abs() < 1e-9);
        assert!(View::best(&Mesh::default()).is_none());
    }
}
