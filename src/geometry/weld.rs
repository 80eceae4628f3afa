//! Joining the corners of a triangle soup into shared vertices.

use super::{Mesh, Point3};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A welded mesh and what was left out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Welded {
    /// The mesh; vertices in the order of their first use, triangles in the file's order.
    pub mesh: Mesh,
    /// Triangles of which two corners fell together.
    pub collapsed: usize,
    /// Triangles over the same three vertices as an earlier one, whichever way they wind.
    pub duplicate: usize,
}

/// Joins vertices that are at most `tolerance_mm` apart: each one goes to the earliest vertex that stands within reach, so the
/// result depends on the order in the file only. Every coordinate and every index must be valid.
pub fn weld(mesh: &Mesh, tolerance_mm: f64) -> Welded {
    let (equal, unique) = join_equal(&mesh.vertices);
    let near = join_near(&unique, tolerance_mm);
    let mut used = vec![u32::MAX; unique.len()];
    let mut welded = Welded { mesh: Mesh::default(), collapsed: 0, duplicate: 0 };
    let mut known: HashMap<[u32; 3], (), Mixing> =
        HashMap::with_capacity_and_hasher(mesh.triangles.len(), Mixing::default());
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| near[equal[v as usize] as usize]);
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            welded.collapsed += 1;
            continue;
        }
        let mut sorted = corners;
        sorted.sort_unstable();
        if known.insert(sorted, ()).is_some() {
            welded.duplicate += 1;
            continue;
        }
        welded.mesh.triangles.push(corners.map(|v| {
            let place = &mut used[v as usize];
            if *place == u32::MAX {
                *place = welded.mesh.vertices.len() as u32;
                welded.mesh.vertices.push(unique[v as usize]);
            }
            *place
        }));
    }
    welded
}

/// Index of each vertex among the distinct ones, and these.
fn join_equal(vertices: &[Point3]) -> (Vec<u32>, Vec<Point3>) {
    let mut known: HashMap<[u64; 3], u32, Mixing> =
        HashMap::with_capacity_and_hasher(vertices.len() / 4, Mixing::default());
    let mut unique = Vec::new();
    let index = vertices
        .iter()
        .map(|p| {
            // Adding zero turns -0 into +0.
            let key = [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
            *known.entry(key).or_insert_with(|| {
                unique.push(*p);
                (unique.len() - 1) as u32
            })
        })
        .collect();
    (index, unique)
}

/// For each vertex the earliest one kept within reach, itself if there is none.
fn join_near(vertices: &[Point3], tolerance: f64) -> Vec<u32> {
    let Some(bounds) = super::Aabb::of_points(vertices) else { return Vec::new() };
    // A few times the tolerance, so that most vertices look into one cell only; 2^20 cells a side fit the key.
    let cell = (4.0 * tolerance).max(bounds.diagonal() / f64::from(1 << 20));
    if cell <= 0.0 {
        return (0..vertices.len() as u32).collect();
    }
    let index = |c: f64, low: f64| ((c - low) / cell).floor().max(0.0) as u64;
    let mut first_in: HashMap<u64, u32, Mixing> = HashMap::with_capacity_and_hasher(vertices.len(), Mixing::default());
    let mut next_in = vec![u32::MAX; vertices.len()];
    let mut target = Vec::with_capacity(vertices.len());
    for (i, p) in vertices.iter().enumerate() {
        let span = |k: usize| index(p[k] - tolerance, bounds.min[k])..=index(p[k] + tolerance, bounds.min[k]);
        let mut found = u32::MAX;
        for x in span(0) {
            for y in span(1) {
                for z in span(2) {
                    let mut j = first_in.get(&(x | y << 21 | z << 42)).copied().unwrap_or(u32::MAX);
                    while j != u32::MAX {
                        if j < found && (vertices[j as usize] - p).norm() <= tolerance {
                            found = j;
                        }
                        j = next_in[j as usize];
                    }
                }
            }
        }
        if found == u32::MAX {
            found = i as u32;
            let [x, y, z] = [0, 1, 2].map(|k| index(p[k], bounds.min[k]));
            let head = first_in.entry(x | y << 21 | z << 42).or_insert(u32::MAX);
            next_in[i] = *head;
            *head = i as u32;
        }
        target.push(found);
    }
    target
}

/// Fast hashing for tables whose order nobody looks at.
pub(crate) type Mixing = BuildHasherDefault<Mixer>;

/// Multiply and fold: enough to spread coordinates and indices over a table, several times faster than the standard hasher.
#[derive(Default)]
pub(crate) struct Mixer(u64);

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 29)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        let mixed =
            u128::from(self.0 ^ word ^ 0x9e37_79b9_7f4a_7c15).wrapping_mul(0xd6e8_feb8_6659_fd93_2b7e_1516_28ae_d2a7);
        self.0 = (mixed as u64) ^ ((mixed >> 64) as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_corners_become_one_and_bad_triangles_go() {
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let e = 4e-4;
        let soup = Mesh {
            vertices: vec![
                p(0.0, 0.0),
                p(1.0, 0.0),
                p(1.0, 1.0), // a triangle
                p(e, -e),
                p(1.0, 1.0 + e),
                p(0.0, 1.0), // its neighbour, a little off
                p(0.0, -0.0),
                p(e, 0.0),
                p(1.0, 1.0), // collapses
                p(1.0, 1.0),
                p(1.0, 0.0),
                p(0.0, 0.0), // the first one the other way round
            ],
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]],
        };
        let welded = weld(&soup, 1e-3);
        assert_eq!(welded.mesh.triangles, vec![[0, 1, 2], [0, 2, 3]]);
        assert_eq!((welded.mesh.vertices.len(), welded.collapsed, welded.duplicate), (4, 1, 1));
        assert_eq!(weld(&soup, 1e-5).mesh.vertices.len(), 7, "apart by more than the tolerance");
    }

    #[test]
    fn no_two_vertices_stay_within_the_tolerance() {
        // Points on a line, closer together than the tolerance: a chain must not be drawn together as a whole.
        let vertices: Vec<Point3> = (0..100).map(|k| Point3::new(f64::from(k) * 0.04, 0.3, -7.0)).collect();
        let target = join_near(&vertices, 0.1);
        for (i, &t) in target.iter().enumerate() {
            assert!((vertices[i] - vertices[t as usize]).norm() <= 0.1);
        }
        let kept: Vec<&Point3> = (0..100).filter(|i| target[*i] == *i as u32).map(|i| &vertices[i]).collect();
        assert!(kept.windows(2).all(|w| (w[0] - w[1]).norm() > 0.1));
        assert!(kept.len() > 30);
    }
}
