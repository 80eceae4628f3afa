//! Small meshes for the tests of this room.

use super::{Part, PartSettings, skin};
use crate::geometry::boundary::{Adjacency, BOUNDARY};
use crate::geometry::{Mesh, Point3};
use crate::plan::CadSide;
use crate::run::RunContext;

/// Cells of a grid, mapped into space; normals along du x dv. Cells that `keep` refuses are holes.
pub(super) fn grid(n: [u32; 2], keep: impl Fn(u32, u32) -> bool, place: impl Fn(f64, f64) -> Point3) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=n[1] {
        for i in 0..=n[0] {
            mesh.vertices.push(place(f64::from(i), f64::from(j)));
        }
    }
    for j in 0..n[1] {
        for i in (0..n[0]).filter(|i| keep(*i, j)) {
            let a = j * (n[0] + 1) + i;
            let b = a + n[0] + 1;
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    mesh
}

/// 100 x 60 mm in cells of 5 mm, with a square hole of 10 mm beside the middle.
pub(super) fn plate() -> Mesh {
    grid([20, 12], |i, j| !((6..8).contains(&i) && (5..7).contains(&j)), |u, v| Point3::new(5.0 * u, 5.0 * v, 0.0))
}

/// A plate bent sharply about the y axis by an angle; the part at x < 0 is level.
pub(super) fn folded(angle: f64) -> Mesh {
    let (sin, cos) = angle.sin_cos();
    grid(
        [12, 6],
        |_, _| true,
        |u, v| {
            let s = 5.0 * (u - 6.0);
            if s <= 0.0 { Point3::new(s, 5.0 * v, 0.0) } else { Point3::new(s * cos, 5.0 * v, s * sin) }
        },
    )
}

/// An open sheet closed by its copy one thickness below and walls around.
pub(super) fn thick(sheet: &Mesh, thickness: f64) -> Mesh {
    let below = skin::offset(sheet, -thickness).mesh;
    let first = sheet.vertices.len() as u32;
    let mut mesh = sheet.clone();
    mesh.vertices.extend(below.vertices);
    mesh.triangles.extend(sheet.triangles.iter().map(|[a, b, c]| [a + first, c + first, b + first]));
    for (t, across) in Adjacency::of(sheet).across.iter().enumerate() {
        for k in (0..3).filter(|k| across[*k] == BOUNDARY) {
            let (a, b) = (sheet.triangles[t][k], sheet.triangles[t][(k + 1) % 3]);
            mesh.triangles.extend([[b, a, a + first], [b, a + first, b + first]]);
        }
    }
    mesh
}

/// A closed box from the origin to the corner, normals outwards.
pub(super) fn cuboid(size: [f64; 3]) -> Mesh {
    let top = grid([1, 1], |_, _| true, |u, v| Point3::new(size[0] * u, size[1] * v, size[2]));
    thick(&top, size[2])
}

/// Corners of its own for each triangle, as an STL file has them.
pub(super) fn soup(mesh: &Mesh) -> Mesh {
    let vertices = (0..mesh.triangles.len()).flat_map(|t| mesh.corners(t)).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Mesh { vertices, triangles }
}

pub(super) fn settings(cad_side: CadSide, thickness_mm: f64) -> PartSettings {
    PartSettings { cad_side, thickness_mm, plan_directions: Vec::new() }
}

pub(super) fn prepared(mesh: &Mesh, settings: &PartSettings) -> Part {
    Part::prepare(mesh.clone(), "00".to_owned(), settings, &RunContext::silent()).unwrap()
}
