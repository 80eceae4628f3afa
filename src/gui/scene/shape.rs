//! Triangles as the graphics card takes them: single precision about the part's centre, a normal for every corner.

use crate::geometry::{Mesh, Point3, Vector3};
use std::collections::HashMap;

/// A surface ready to be drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// Positions, mm, from the scene's centre.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals; more than one vertex stands where the surface has a crease.
    pub normals: Vec<[f32; 3]>,
    /// Corners of the triangles.
    pub triangles: Vec<u32>,
    /// The vertex of the mesh from which each one is made.
    pub source: Vec<u32>,
}

/// Normals of neighbouring triangles whose cosine is less make a crease: 37 degrees, as in the map on paper.
const CREASE: f64 = 0.8;

impl Shape {
    /// Of a mesh, about a centre.
    pub fn of(mesh: &Mesh, centre: &Point3) -> Shape {
        let mut shape = Shape { triangles: Vec::with_capacity(3 * mesh.triangles.len()), ..Shape::default() };
        let mut sums: Vec<Vector3> = Vec::new();
        // The clusters of normals around each vertex: first and further ones as a chain of (unit normal, vertex made, next).
        let mut chains: Vec<(Vector3, u32)> = Vec::new();
        let mut of_vertex: Vec<Vec<u32>> = vec![Vec::new(); mesh.vertices.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let area = mesh.area_vector_twice(t);
            let unit = area.try_normalize(0.0).unwrap_or_else(Vector3::z);
            for &v in corners {
                let known = of_vertex[v as usize].iter().copied().find(|&c| chains[c as usize].0.dot(&unit) > CREASE);
                let cluster = known.unwrap_or_else(|| {
                    let made = shape.positions.len() as u32;
                    chains.push((unit, made));
                    sums.push(Vector3::zeros());
                    of_vertex[v as usize].push(made);
                    shape.positions.push(single(&(mesh.vertices[v as usize] - centre)));
                    shape.source.push(v);
                    made
                });
                sums[cluster as usize] += area;
                shape.triangles.push(chains[cluster as usize].1);
            }
        }
        shape.normals = sums.iter().map(|n| single(&n.try_normalize(0.0).unwrap_or_else(Vector3::z))).collect();
        shape
    }
}

impl Shape {
    /// Triangles over the same vertices, but only one vertex in each cube of `cell_mm`: quick to draw, good enough while the picture moves.
    pub fn coarse(&self, cell_mm: f64) -> Vec<u32> {
        let mut first: HashMap<[i32; 3], u32> = HashMap::new();
        let cube = |p: &[f32; 3]| p.map(|c| (f64::from(c) / cell_mm).floor() as i32);
        let stands_for: Vec<u32> =
            self.positions.iter().zip(0..).map(|(p, k)| *first.entry(cube(p)).or_insert(k)).collect();
        let merged = self.triangles.chunks_exact(3).map(|t| [0, 1, 2].map(|k| stands_for[t[k] as usize]));
        merged.filter(|[a, b, c]| a != b && b != c && c != a).flatten().collect()
    }
}

/// In single precision.
pub fn single(v: &Vector3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// A mesh is never made finer than this many triangles.
const MOST_TRIANGLES: usize = 400_000;

/// The mesh with every edge that is longer than `longest_mm` halved until none is, so that a value for every vertex can show what lies
/// between the corners of large flat triangles. Neighbours share the new vertices: no gaps open.
pub fn refined(mesh: &Mesh, longest_mm: f64) -> Mesh {
    let mut fine = mesh.clone();
    loop {
        let long = |a: u32, b: u32, m: &Mesh| (m.vertices[a as usize] - m.vertices[b as usize]).norm() > longest_mm;
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut triangles = Vec::with_capacity(fine.triangles.len());
        let before = std::mem::take(&mut fine.triangles);
        let count = before.len();
        for corners in before {
            let split: [Option<u32>; 3] = std::array::from_fn(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                long(a, b, &fine).then(|| {
                    *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        let middle = nalgebra::center(&fine.vertices[a as usize], &fine.vertices[b as usize]);
                        fine.vertices.push(middle);
                        fine.vertices.len() as u32 - 1
                    })
                })
            });
            divide(corners, split, &fine.vertices, &mut triangles);
        }
        fine.triangles = triangles;
        if fine.triangles.len() == count || fine.triangles.len() > MOST_TRIANGLES {
            return fine;
        }
    }
}

/// The pieces of a triangle whose edges have been halved where `split` names the new vertex (edge k goes from corner k to the next).
fn divide(corners: [u32; 3], split: [Option<u32>; 3], vertices: &[Point3], pieces: &mut Vec<[u32; 3]>) {
    let first = match split.iter().flatten().count() {
        0 => return pieces.push(corners),
        1 => split.iter().position(Option::is_some),
        2 => split.iter().position(Option::is_none).map(|k| (k + 1) % 3),
        _ => Some(0),
    };
    // Turned so that edge 0 is split, and with two of them edge 2 is the whole one.
    let k = first.unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
    match [0, 1, 2].map(|i| split[(k + i) % 3]) {
        [Some(ab), None, _] => pieces.extend([[a, ab, c], [ab, b, c]]),
        [Some(ab), Some(bc), None] => {
            pieces.push([ab, b, bc]);
            // The shorter diagonal of what is left, so that no needles grow.
            let length = |p: u32, q: u32| (vertices[p as usize] - vertices[q as usize]).norm();
            if length(a, bc) <= length(ab, c) {
                pieces.extend([[a, ab, bc], [a, bc, c]]);
            } else {
                pieces.extend([[a, ab, c], [ab, bc, c]]);
            }
        }
        [Some(ab), Some(bc), Some(ca)] => pieces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
        [None, ..] => pieces.push([a, b, c]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::boundary::Adjacency;
    use crate::report::example;

    fn angle() -> Mesh {
        // Two squares of 10 mm that meet at a right angle along y.
        let v = [
            [0.0, 0.0, 0.0],
            [10.0, 0.0, 0.0],
            [10.0, 10.0, 0.0],
            [0.0, 10.0, 0.0],
            [0.0, 0.0, 10.0],
            [0.0, 10.0, 10.0],
        ];
        Mesh { vertices: v.map(Point3::from).to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4]] }
    }

    #[test]
    fn a_crease_has_two_normals_and_a_round_place_one() {
        let shape = Shape::of(&angle(), &Point3::new(1.0, 2.0, 3.0));
        // The two vertices of the fold stand twice, the other four once.
        assert_eq!(shape.positions.len(), 8);
        assert_eq!(shape.triangles.len(), 12);
        assert_eq!(shape.positions[0], [-1.0, -2.0, -3.0]);
        for (triangle, normal) in
            shape.triangles.chunks(3).zip([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        {
            assert!(triangle.iter().all(|&v| shape.normals[v as usize] == normal), "{triangle:?}");
        }
        let dome = example::dome(20);
        let round = Shape::of(&dome, &Point3::origin());
        let used = dome.triangles.iter().flatten().collect::<std::collections::BTreeSet<_>>().len();
        assert!(round.positions.len() >= used && round.positions.len() < used + used / 4);
    }

    #[test]
    fn a_finer_mesh_has_short_edges_the_same_area_and_no_gaps() {
        for (mesh, longest_mm) in [(angle(), 1.5), (example::dome(12), 2.0)] {
            let fine = refined(&mesh, longest_mm);
            let edges = fine.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
            let longest =
                edges.map(|(a, b)| (fine.vertices[a as usize] - fine.vertices[b as usize]).norm()).fold(0.0, f64::max);
            assert!(longest <= longest_mm, "{longest}");
            // The pieces lie in their triangle: areas of vectors add up to rounding.
            assert!((fine.area() - mesh.area()).abs() < 1e-9 * mesh.area());
            // Each border edge of 10 mm becomes 8 of 1.25 mm; a gap inside would count as border too.
            let border = |m: &Mesh| Adjacency::of(m).boundary_edges();
            if mesh.vertices.len() == 6 {
                assert_eq!((border(&mesh), border(&fine)), (6, 48));
            } else {
                let length = |m: &Mesh| {
                    let loops = crate::geometry::boundary::boundary_loops(m, &Adjacency::of(m));
                    let loops = crate::geometry::boundary::loop_points(m, &loops);
                    loops.iter().flat_map(|l| l.windows(2)).map(|w| (w[1] - w[0]).norm()).sum::<f64>()
                };
                assert!((length(&fine) - length(&mesh)).abs() < 1e-6, "{} {}", length(&fine), length(&mesh));
            }
        }
    }

    #[test]
    fn a_coarse_surface_has_fewer_triangles_and_about_the_same_area() {
        let fine = Shape::of(&refined(&example::dome(60), 2.0), &Point3::origin());
        let coarse = fine.coarse(6.0);
        let area = |triangles: &[u32]| {
            let at = |k: u32| Vector3::from(fine.positions[k as usize].map(f64::from));
            triangles
                .chunks_exact(3)
                .map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(&(at(t[2]) - at(t[0]))).norm())
                .sum::<f64>()
        };
        assert!(coarse.len() * 4 < fine.triangles.len(), "{} {}", coarse.len(), fine.triangles.len());
        // The border moves by up to a cell: 6 mm around 240 x 140 mm is an eighth of the area.
        assert!((area(&coarse) / area(&fine.triangles) - 1.0).abs() < 0.125);
    }

    #[test]
    fn a_fine_mesh_stays_as_it_is() {
        let mesh = example::dome(10);
        assert_eq!(refined(&mesh, 1e3), mesh);
    }
}
