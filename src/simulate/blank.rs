//! The flat blank of a stamped part: outline and openings, triangulated so that every rim is met exactly.

use crate::geometry::Mesh;
use rayon::prelude::*;
use spade::{ConstrainedDelaunayTriangulation, Point2 as SpadePoint, Triangulation};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// A place on the blank, mm.
pub type Uv = nalgebra::Point2<f64>;
/// A displacement on the blank, mm.
pub type UvVector = nalgebra::Vector2<f64>;

/// A corner of an outline with its fillet radius, mm (0 = sharp).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where the two straight lines meet.
    pub at: Uv,
    /// Radius of the fillet.
    pub radius_mm: f64,
}

impl Corner {
    /// A corner from its numbers.
    pub fn new(u: f64, v: f64, radius_mm: f64) -> Self {
        Self { at: Uv::new(u, v), radius_mm }
    }
}

/// An opening in the blank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Opening {
    /// A round hole.
    Hole {
        /// Its centre.
        centre: Uv,
        /// Its diameter.
        diameter_mm: f64,
    },
    /// A slot with round ends.
    Slot {
        /// Its centre.
        centre: Uv,
        /// Its long axis, length one.
        direction: UvVector,
        /// Overall length.
        length_mm: f64,
        /// Width.
        width_mm: f64,
    },
}

impl Opening {
    /// The middle of the opening.
    pub fn centre(&self) -> Uv {
        match self {
            Opening::Hole { centre, .. } | Opening::Slot { centre, .. } => *centre,
        }
    }

    /// Distance in mm from the opening's rim, positive in the material.
    pub fn distance_mm(&self, q: &Uv) -> f64 {
        match self {
            Opening::Hole { centre, diameter_mm } => (q - centre).norm() - 0.5 * diameter_mm,
            Opening::Slot { centre, direction, length_mm, width_mm } => {
                let half = 0.5 * (length_mm - width_mm);
                let along = (q - centre).dot(direction).clamp(-half, half);
                (q - (centre + direction * along)).norm() - 0.5 * width_mm
            }
        }
    }

    /// The rim as a closed polygon, clockwise, its corners on the rim and its chords at most `sag_mm` inside the arcs.
    pub fn rim(&self, sag_mm: f64) -> Vec<Uv> {
        match self {
            Opening::Hole { centre, diameter_mm } => {
                let radius = 0.5 * diameter_mm;
                let n = segments(radius, TAU, sag_mm).max(24);
                (0..n).map(|k| centre + polar(radius, -TAU * k as f64 / n as f64)).collect()
            }
            Opening::Slot { centre, direction, length_mm, width_mm } => {
                let radius = 0.5 * width_mm;
                let half = 0.5 * (length_mm - width_mm);
                let start = direction.y.atan2(direction.x);
                let n = segments(radius, PI, sag_mm).max(12);
                let mut rim = Vec::new();
                for (end, from) in [(half, start + 0.5 * PI), (-half, start - 0.5 * PI)] {
                    let arc_centre = centre + direction * end;
                    rim.extend((0..=n).map(|k| arc_centre + polar(radius, from - PI * k as f64 / n as f64)));
                }
                rim
            }
        }
    }
}

fn polar(radius: f64, angle: f64) -> UvVector {
    UvVector::new(radius * angle.cos(), radius * angle.sin())
}

/// Chords needed over an arc so that none is further than `sag_mm` from it: sag = r (1 - cos(step / 2)).
pub fn segments(radius_mm: f64, angle: f64, sag_mm: f64) -> usize {
    let step = 2.0 * (1.0 - (sag_mm / radius_mm).min(0.5)).acos();
    (angle.abs() / step).ceil().max(1.0) as usize
}

/// The straight sides of a polygon moved outwards, each by its own amount, and cut with each other anew.
/// Side `k` runs from corner `k` to corner `k + 1`; the polygon is counter-clockwise. A side that is parallel to its
/// neighbour keeps the corner moved by the later side's amount.
pub fn with_sides_moved(corners: &[Corner], moves_mm: &[(usize, f64)]) -> Vec<Corner> {
    let n = corners.len();
    let side = |k: usize| {
        let (a, b) = (corners[k % n].at, corners[(k + 1) % n].at);
        let along = (b - a).normalize();
        let outwards = UvVector::new(along.y, -along.x);
        let amount: f64 = moves_mm.iter().filter(|(s, _)| *s == k % n).map(|(_, mm)| mm).sum();
        (a + outwards * amount, along)
    };
    (0..n)
        .map(|k| {
            let ((p, d), (q, e)) = (side(k + n - 1), side(k));
            let cross = d.perp(&e);
            let at = if cross.abs() < 1e-9 { q } else { p + d * ((q - p).perp(&e) / cross) };
            Corner { at, radius_mm: corners[k].radius_mm }
        })
        .collect()
}

/// A closed outline of straight lines and fillets as a polygon with chords at most `sag_mm` off the fillets.
pub fn filleted(corners: &[Corner], sag_mm: f64) -> Vec<Uv> {
    let n = corners.len();
    let mut outline = Vec::new();
    for k in 0..n {
        let here = corners[k];
        let to_previous = (corners[(k + n - 1) % n].at - here.at).normalize();
        let to_next = (corners[(k + 1) % n].at - here.at).normalize();
        let half_angle = 0.5 * to_previous.dot(&to_next).clamp(-1.0, 1.0).acos();
        if here.radius_mm <= 0.0 || half_angle > 0.499 * PI {
            outline.push(here.at);
            continue;
        }
        let centre = here.at + (to_previous + to_next).normalize() * (here.radius_mm / half_angle.sin());
        let tangent_length = here.radius_mm / half_angle.tan();
        let from = here.at + to_previous * tangent_length - centre;
        let to = here.at + to_next * tangent_length - centre;
        let turn = from.perp(&to).atan2(from.dot(&to));
        let chords = segments(here.radius_mm, turn, sag_mm);
        let start = from.y.atan2(from.x);
        outline.extend((0..=chords).map(|c| centre + polar(here.radius_mm, start + turn * c as f64 / chords as f64)));
    }
    outline
}

/// A closed polygon with every side cut into pieces no longer than `longest_mm` says at the side's middle.
pub fn subdivided(polygon: &[Uv], longest_mm: impl Fn(&Uv) -> f64) -> Vec<Uv> {
    let mut fine = Vec::new();
    for (k, a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        cut(a, &b, &longest_mm, &mut fine);
    }
    fine
}

fn cut(a: &Uv, b: &Uv, longest_mm: &impl Fn(&Uv) -> f64, out: &mut Vec<Uv>) {
    let middle = nalgebra::center(a, b);
    let length = (b - a).norm();
    let quarter = nalgebra::center(a, &middle);
    let allowed = longest_mm(&middle).min(longest_mm(a)).min(longest_mm(&quarter));
    if length > allowed && length > 1e-3 {
        cut(a, &middle, longest_mm, out);
        cut(&middle, b, longest_mm, out);
    } else {
        out.push(*a);
    }
}

/// A triangulated blank.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatMesh {
    /// Vertices on the blank.
    pub vertices: Vec<Uv>,
    /// Counter-clockwise triangles.
    pub triangles: Vec<[u32; 3]>,
}

impl FlatMesh {
    /// The mesh in space, every vertex mapped.
    pub fn mapped(&self, map: impl Fn(&Uv) -> crate::geometry::Point3) -> Mesh {
        Mesh { vertices: self.vertices.iter().map(map).collect(), triangles: self.triangles.clone() }
    }
}

/// Triangulates the area within the outer rim and outside the inner ones (all closed polygons that do not touch each
/// other), using the lattice points (each with the distance it must keep from the rims) as further vertices.
///
/// Returns `None` when the rims cross each other.
pub fn triangulate(rims: &[Vec<Uv>], lattice: &[(Uv, f64)]) -> Option<FlatMesh> {
    let mut vertices: Vec<Uv> = rims.iter().flatten().copied().collect();
    let mut edges = Vec::new();
    let mut first = 0;
    for rim in rims {
        edges.extend((0..rim.len()).map(|k| [first + k, first + (k + 1) % rim.len()]));
        first += rim.len();
    }
    let rim_vertices = vertices.len();
    let near = NearEdges::new(&vertices, &edges, lattice.iter().map(|(_, clear)| *clear).fold(0.0, f64::max));
    let kept: Vec<Uv> = lattice.par_iter().filter(|(q, clear)| near.is_clear(q, *clear)).map(|(q, _)| *q).collect();
    vertices.extend(kept);
    let points: Vec<_> = vertices.iter().map(|q| SpadePoint::new(q.x, q.y)).collect();
    let mut crossed = false;
    let cdt = ConstrainedDelaunayTriangulation::<SpadePoint<f64>>::try_bulk_load_cdt(points, edges, |_| crossed = true);
    let cdt = cdt.ok()?;
    if crossed || cdt.num_vertices() < rim_vertices {
        return None;
    }
    Some(inside(&cdt))
}

/// Edges by place, so that a lattice point looks at the few around it only.
struct NearEdges {
    cell: f64,
    cells: HashMap<[i32; 2], Vec<(Uv, Uv)>>,
}

impl NearEdges {
    /// Edges that may be nearer than `reach_mm` to a point are filed in its cell or in one of the eight around it.
    fn new(vertices: &[Uv], edges: &[[usize; 2]], reach_mm: f64) -> Self {
        let ends = |[a, b]: &[usize; 2]| (vertices[*a], vertices[*b]);
        let longest = edges.iter().map(ends).map(|(a, b)| (b - a).norm()).fold(0.0, f64::max);
        let mut near = Self { cell: (0.5 * longest + reach_mm).max(1e-3), cells: HashMap::new() };
        for (a, b) in edges.iter().map(ends) {
            near.cells.entry(near.key(&nalgebra::center(&a, &b))).or_default().push((a, b));
        }
        near
    }

    fn is_clear(&self, q: &Uv, clear_mm: f64) -> bool {
        let [i, j] = self.key(q);
        let around = (-1..=1).flat_map(|a| (-1..=1).map(move |b| [i + a, j + b]));
        around.filter_map(|key| self.cells.get(&key)).flatten().all(|(a, b)| segment_distance(q, a, b) > clear_mm)
    }

    fn key(&self, q: &Uv) -> [i32; 2] {
        [(q.x / self.cell).floor() as i32, (q.y / self.cell).floor() as i32]
    }
}

/// Keeps the triangles inside: from the outer face, each crossing of a rim changes between outside and inside.
fn inside(cdt: &ConstrainedDelaunayTriangulation<SpadePoint<f64>>) -> FlatMesh {
    let faces = cdt.num_all_faces();
    let mut state: Vec<Option<bool>> = vec![None; faces];
    let outer = cdt.outer_face();
    state[outer.fix().index()] = Some(false);
    let mut todo = std::collections::VecDeque::new();
    for edge in cdt.convex_hull() {
        // The hull's edges have the outer face on their left; the triangle lies on the other side.
        for edge in [edge, edge.rev()] {
            let face = edge.face().fix().index();
            if state[face].is_none() {
                state[face] = Some(edge.is_constraint_edge());
                todo.push_back(edge.face().fix());
            }
        }
    }
    while let Some(handle) = todo.pop_front() {
        let is_inside = state[handle.index()].unwrap_or(false);
        let Some(face) = cdt.face(handle).as_inner() else { continue };
        for edge in face.adjacent_edges() {
            let neighbour = edge.rev().face().fix();
            if state[neighbour.index()].is_none() {
                state[neighbour.index()] = Some(is_inside ^ edge.is_constraint_edge());
                todo.push_back(neighbour);
            }
        }
    }
    let mut index = vec![u32::MAX; cdt.num_vertices()];
    let mut mesh = FlatMesh { vertices: Vec::new(), triangles: Vec::new() };
    for face in cdt.inner_faces() {
        if state[face.fix().index()] != Some(true) {
            continue;
        }
        mesh.triangles.push(face.vertices().map(|vertex| {
            let slot = &mut index[vertex.fix().index()];
            if *slot == u32::MAX {
                *slot = mesh.vertices.len() as u32;
                mesh.vertices.push(Uv::new(vertex.position().x, vertex.position().y));
            }
            *slot
        }));
    }
    mesh
}

fn segment_distance(q: &Uv, a: &Uv, b: &Uv) -> f64 {
    let along = b - a;
    let t = ((q - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (q - (a + along * t)).norm()
}

/// A square lattice over a box, mm; each point keeps 0.4 spacings from the rims.
pub fn square_lattice(min: Uv, max: Uv, spacing_mm: f64) -> Vec<(Uv, f64)> {
    let (nu, nv) = (((max.x - min.x) / spacing_mm) as usize, ((max.y - min.y) / spacing_mm) as usize);
    (0..=nv)
        .flat_map(|j| (0..=nu).map(move |i| min + UvVector::new(i as f64, j as f64) * spacing_mm))
        .map(|q| (q, 0.4 * spacing_mm))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_is_outline_minus_openings() {
        let outline = filleted(
            &[
                Corner::new(-50.0, -30.0, 5.0),
                Corner::new(50.0, -30.0, 0.0),
                Corner::new(50.0, 30.0, 8.0),
                Corner::new(-50.0, 30.0, 3.0),
            ],
            1e-4,
        );
        let hole = Opening::Hole { centre: Uv::new(-20.0, 0.0), diameter_mm: 16.0 };
        let slot = Opening::Slot {
            centre: Uv::new(20.0, 0.0),
            direction: UvVector::new(0.6, 0.8),
            length_mm: 30.0,
            width_mm: 9.0,
        };
        let rims = [subdivided(&outline, |_| 2.0), hole.rim(1e-4), slot.rim(1e-4)];
        let flat = triangulate(&rims, &square_lattice(Uv::new(-60.0, -40.0), Uv::new(60.0, 40.0), 2.0)).unwrap();
        let mesh = flat.mapped(|q| crate::geometry::Point3::new(q.x, q.y, 0.0));
        let fillets = (1.0 - PI / 4.0) * (25.0 + 64.0 + 9.0);
        let expected = 6000.0 - fillets - PI * 64.0 - (PI * 4.5 * 4.5 + 21.0 * 9.0);
        // Chords are within 1e-4 mm of the arcs, over about 150 mm of arc.
        assert!((mesh.area() - expected).abs() < 0.02, "{} {expected}", mesh.area());
        assert!((0..mesh.triangles.len()).all(|t| mesh.area_vector_twice(t).z > 0.0));
    }

    #[test]
    fn moved_side_moves_its_line_only() {
        let square = [
            Corner::new(0.0, 0.0, 1.0),
            Corner::new(10.0, 0.0, 1.0),
            Corner::new(10.0, 10.0, 1.0),
            Corner::new(0.0, 10.0, 1.0),
        ];
        let moved = with_sides_moved(&square, &[(1, 0.5)]);
        assert!(
            (moved[1].at - Uv::new(10.5, 0.0)).norm() < 1e-12 && (moved[2].at - Uv::new(10.5, 10.0)).norm() < 1e-12
        );
        assert!((moved[0].at - square[0].at).norm() < 1e-12 && (moved[3].at - square[3].at).norm() < 1e-12);
    }
}
