//! The faces of a sheet whose CAD is one surface: that surface moved by the thickness.
//!
//! Each vertex moves by the displacement d that fits n_i . d = offset best for the normals n_i of the triangles around it, so that
//! the planes on both sides of a crease move by exactly the offset (moving by offset along a mean normal would leave them short by
//! the cosine of half the bend). Directions about which the normals say nothing get no displacement.

use super::face::corner_angles;
use crate::geometry::{Mesh, Vector3, decompose};
use nalgebra::Matrix3;
use rayon::prelude::*;

/// Eigenvalues below this share of the largest are noise of the tessellation. A bend of angle w between two planes has the share
/// w^2/4; what is left out at w = 0.02 rad is w^2/8 = 5e-5 of the offset.
const NOISE: f64 = 1e-4;
/// No vertex moves farther than this many offsets, however sharp the crease.
const FARTHEST: f64 = 2.0;

/// A moved surface.
pub(super) struct Offset {
    pub(super) mesh: Mesh,
    /// Triangles that turned over, because the surface bends more tightly than the offset.
    pub(super) folded: usize,
}

/// Moves a surface along its normals (against them, when negative) by `offset_mm`; vertices and triangles keep their order.
pub(super) fn offset(mesh: &Mesh, offset_mm: f64) -> Offset {
    if offset_mm == 0.0 {
        return Offset { mesh: mesh.clone(), folded: 0 };
    }
    let moments = normal_moments(mesh);
    let vertices = mesh.vertices.par_iter().zip(&moments).with_min_len(4096);
    let vertices = vertices.map(|(v, m)| v + displacement(m) * offset_mm).collect();
    let moved = Mesh { vertices, triangles: mesh.triangles.clone() };
    let turned = |t: &usize| mesh.area_vector_twice(*t).dot(&moved.area_vector_twice(*t)) < 0.0;
    let folded = (0..mesh.triangles.len()).into_par_iter().with_min_len(4096).filter(turned).count();
    Offset { mesh: moved, folded }
}

/// Sum of w n n^T and of w n over the triangles around a vertex, w the angle there.
#[derive(Clone, Copy)]
struct Moments {
    outer: Matrix3<f64>,
    first: Vector3,
}

fn normal_moments(mesh: &Mesh) -> Vec<Moments> {
    let mut moments = vec![Moments { outer: Matrix3::zeros(), first: Vector3::zeros() }; mesh.vertices.len()];
    let shares: Vec<Option<(Vector3, [f64; 3])>> = (0..mesh.triangles.len())
        .into_par_iter()
        .with_min_len(4096)
        .map(|t| mesh.normal(t).map(|n| (n.into_inner(), corner_angles(&mesh.corners(t)))))
        .collect();
    for (triangle, share) in mesh.triangles.iter().zip(&shares) {
        let Some((n, angles)) = share else { continue };
        for (corner, angle) in angles.iter().enumerate() {
            let place = &mut moments[triangle[corner] as usize];
            place.outer += n * n.transpose() * *angle;
            place.first += n * *angle;
        }
    }
    moments
}

/// Displacement for an offset of one: least squares over the directions in which the normals differ by more than noise.
fn displacement(moments: &Moments) -> Vector3 {
    let weight = moments.outer.trace();
    let Some(mean) = moments.first.try_normalize(0.0) else { return Vector3::zeros() };
    // |sum w n| / sum w = 1 - spread / 2: below the noise the mean normal is the answer.
    if weight - moments.first.norm() < 0.25 * NOISE * weight {
        return mean;
    }
    let Some(eigen) = decompose::symmetric_eigen(moments.outer) else { return mean };
    let largest = eigen.eigenvalues.max();
    let mut d = Vector3::zeros();
    for k in 0..3 {
        if eigen.eigenvalues[k] > NOISE * largest {
            let axis = eigen.eigenvectors.column(k);
            d += axis * (axis.dot(&moments.first) / eigen.eigenvalues[k]);
        }
    }
    let length = d.norm();
    if length > FARTHEST { d * (FARTHEST / length) } else { d }
}
