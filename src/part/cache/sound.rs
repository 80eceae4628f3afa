//! Whether a part read from a cache can be one that this program prepared: every number finite and where it must lie.

use crate::geometry::{Aabb, Mesh, Point3, Vector3};
use crate::part::prepare::check;
use crate::part::{Face, Part, RestingPose};

/// Unit vectors are unit to this.
const UNIT: f64 = 1e-6;
/// Nothing is further from where it must lie than this share of the part's diagonal.
const ROUNDING: f64 = 1e-6;
/// No vertex of a face is moved farther than this many thicknesses (`skin` allows two).
const FARTHEST: f64 = 2.5;

/// A mesh of which every coordinate is finite, every index fits, and that a part could be made of.
pub(super) fn mesh(vertices: Vec<Point3>, triangles: Vec<[u32; 3]>) -> Option<Mesh> {
    let mesh = Mesh { vertices, triangles };
    check(&mesh).is_ok().then_some(mesh)
}

/// Whether all of the part fits together. Its meshes are sound already, and its trees fit them.
pub(super) fn is_sound(part: &Part) -> bool {
    let diagonal = part.diagonal_mm();
    let reach_mm = FARTHEST * part.thickness_mm + ROUNDING * diagonal;
    // A sheet may be thicker than its drawing is wide, but then nobody needs a cache.
    (0.0..=diagonal).contains(&part.thickness_mm)
        && part.triangles_in_file >= part.mesh.triangles.len()
        && within(&part.bounds, ROUNDING * diagonal, &part.centroid)
        && part.resting_poses.iter().all(|pose| is_sound_pose(pose, diagonal + 2.0 * reach_mm))
        && part.faces.iter().all(|face| is_sound_face(face, &part.bounds, reach_mm))
}

fn is_sound_pose(pose: &RestingPose, tallest_mm: f64) -> bool {
    is_unit(&pose.up_cad) && (0.0..=1.0).contains(&pose.stability) && (0.0..=tallest_mm).contains(&pose.height_mm)
}

fn is_sound_face(face: &Face, bounds: &Aabb, reach_mm: f64) -> bool {
    // The sum of unit normals by the angles of the triangles around a vertex: none has more triangles than the mesh.
    let longest = std::f64::consts::PI * face.mesh.triangles.len() as f64;
    face.mesh.vertices.iter().all(|v| within(bounds, reach_mm, v))
        && face.vertex_normals.iter().all(|n| n.norm() <= longest)
        && !face.samples.is_empty()
        && face.samples.iter().all(|s| is_unit(&s.normal) && within(bounds, 2.0 * reach_mm, &s.point))
}

/// False for NaN as well.
fn is_unit(v: &Vector3) -> bool {
    (v.norm() - 1.0).abs() < UNIT
}

/// Whether a place lies in a box grown by a margin; false for NaN as well.
fn within(bounds: &Aabb, margin_mm: f64, p: &Point3) -> bool {
    (0..3).all(|k| (bounds.min[k] - margin_mm..=bounds.max[k] + margin_mm).contains(&p[k]))
}
