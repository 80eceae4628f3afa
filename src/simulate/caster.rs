//! Ray casting for the simulator: its own tree over its own triangles, so that a fault in the program's closest-point
//! search cannot hide itself in the test data.

use crate::geometry::{Aabb, Mesh, Point3, Vector3};

/// Triangles in a leaf at most.
const LEAF: usize = 4;
/// How far outside a triangle, in barycentric coordinates, a ray still hits: rays do not slip between neighbours.
const RIM: f64 = 1e-9;

/// Where a ray met a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction.
    pub t: f64,
    /// The triangle.
    pub triangle: u32,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    min: Point3,
    max: Point3,
    /// Leaf: first triangle in `order`. Inner node: index of the right child (the left one follows the node).
    start: u32,
    /// Leaf: number of triangles. Inner node: 0.
    count: u32,
}

/// A tree of boxes over the triangles of a mesh.
#[derive(Debug, Clone)]
pub struct Caster {
    nodes: Vec<Node>,
    order: Vec<u32>,
    /// First corner and the two edges from it, in the order of the leaves.
    triangles: Vec<(Point3, Vector3, Vector3)>,
}

impl Caster {
    /// Builds the tree.
    pub fn new(mesh: &Mesh) -> Self {
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let corners: Vec<[Point3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let middles: Vec<Point3> =
            corners.iter().map(|[a, b, c]| Point3::from((a.coords + b.coords + c.coords) / 3.0)).collect();
        let mut nodes = Vec::new();
        if !order.is_empty() {
            let count = order.len();
            split(&mut nodes, &mut order, 0, count, &corners, &middles);
        }
        let triangles = order.iter().map(|t| corners[*t as usize]).map(|[a, b, c]| (a, b - a, c - a)).collect();
        Self { nodes, order, triangles }
    }

    /// The first triangle that the ray meets at `t` in (`min_t`, `max_t`); of equals the one with the lower index.
    pub fn first(&self, origin: &Point3, direction: &Vector3, min_t: f64, max_t: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(origin, direction, min_t, max_t, |hit| {
            if best.is_none_or(|b| hit.t < b.t || (hit.t == b.t && hit.triangle < b.triangle)) {
                best = Some(hit);
            }
            best.map_or(max_t, |b| b.t)
        });
        best
    }

    /// Whether anything lies on the ray between `min_t` and `max_t`.
    pub fn is_blocked(&self, origin: &Point3, direction: &Vector3, min_t: f64, max_t: f64) -> bool {
        let mut blocked = false;
        self.visit(origin, direction, min_t, max_t, |_| {
            blocked = true;
            f64::NEG_INFINITY
        });
        blocked
    }

    /// Calls `take` for hits; it returns the new limit of `t`.
    fn visit(&self, origin: &Point3, direction: &Vector3, min_t: f64, max_t: f64, mut take: impl FnMut(Hit) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let inverse = direction.map(|d| 1.0 / d);
        let mut limit = max_t;
        // Nodes that the ray enters, and where.
        let mut stack = [(0_u32, 0.0); 64];
        stack[0].1 = entry(&self.nodes[0], origin, &inverse, limit);
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (at, enters) = stack[depth];
            if enters > limit || enters == f64::INFINITY {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for k in node.start..node.start + node.count {
                    if let Some(t) = meet(&self.triangles[k as usize], origin, direction)
                        && t > min_t
                        && t < limit
                    {
                        limit = take(Hit { t, triangle: self.order[k as usize] });
                    }
                }
                continue;
            }
            let [left, right] =
                [at + 1, node.start].map(|k| (k, entry(&self.nodes[k as usize], origin, &inverse, limit)));
            let (first, second) = if left.1 <= right.1 { (left, right) } else { (right, left) };
            for child in [second, first] {
                if child.1 < f64::INFINITY {
                    stack[depth] = child;
                    depth += 1;
                }
            }
        }
    }
}

/// Median split along the longest side of the middles' box: a depth of at most 32 for any count of u32.
fn split(
    nodes: &mut Vec<Node>,
    order: &mut [u32],
    first: usize,
    count: usize,
    corners: &[[Point3; 3]],
    middles: &[Point3],
) {
    let here = &mut order[first..first + count];
    let bounds = Aabb::of_points(here.iter().flat_map(|t| corners[*t as usize].iter())).expect("a node has triangles");
    let index = nodes.len();
    // A hair of room, so that flat boxes are met.
    let room = Vector3::repeat(1e-9);
    nodes.push(Node { min: bounds.min - room, max: bounds.max + room, start: first as u32, count: count as u32 });
    if count <= LEAF {
        return;
    }
    let extents = Aabb::of_points(here.iter().map(|t| &middles[*t as usize])).expect("a node has triangles").extents();
    let axis = extents.imax();
    let half = count / 2;
    here.select_nth_unstable_by(half, |a, b| {
        middles[*a as usize][axis].total_cmp(&middles[*b as usize][axis]).then(a.cmp(b))
    });
    split(nodes, order, first, half, corners, middles);
    nodes[index].start = nodes.len() as u32;
    nodes[index].count = 0;
    split(nodes, order, first + half, count - half, corners, middles);
}

/// Where the ray enters the box; infinite when it misses it. A direction along a face gives infinities or NaN, which the comparisons
/// pass over.
#[inline]
fn entry(node: &Node, origin: &Point3, inverse: &Vector3, limit: f64) -> f64 {
    let (mut from, mut to) = (f64::NEG_INFINITY, limit);
    for k in 0..3 {
        let (a, b) = ((node.min[k] - origin[k]) * inverse[k], (node.max[k] - origin[k]) * inverse[k]);
        let (low, high) = if inverse[k] >= 0.0 { (a, b) } else { (b, a) };
        from = if low > from { low } else { from };
        to = if high < to { high } else { to };
    }
    if to >= from && to >= 0.0 { from } else { f64::INFINITY }
}

/// Distance along the ray to the triangle, from the ratios of volumes.
fn meet((corner, edge1, edge2): &(Point3, Vector3, Vector3), origin: &Point3, direction: &Vector3) -> Option<f64> {
    let p = direction.cross(edge2);
    let det = edge1.dot(&p);
    if det == 0.0 {
        return None;
    }
    let s = origin - corner;
    let u = s.dot(&p) / det;
    if !(-RIM..=1.0 + RIM).contains(&u) {
        return None;
    }
    let q = s.cross(edge1);
    let v = direction.dot(&q) / det;
    if v < -RIM || u + v > 1.0 + RIM {
        return None;
    }
    Some(edge2.dot(&q) / det)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{BracketParameters, bracket};

    #[test]
    fn every_ray_onto_the_bracket_meets_what_brute_force_meets() {
        let mesh = bracket(&BracketParameters { spacing_mm: 6.0, ..Default::default() }).mesh;
        let caster = Caster::new(&mesh);
        for k in 0..400 {
            let angle = 2.399_963 * k as f64;
            let radius = 5.0 * (k as f64).sqrt();
            let origin = Point3::new(radius * angle.cos(), radius * angle.sin(), 50.0);
            let direction = Vector3::new(0.1 * angle.sin(), 0.05, -1.0);
            let brute = (0..mesh.triangles.len())
                .filter_map(|t| {
                    let [a, b, c] = mesh.corners(t);
                    meet(&(a, b - a, c - a), &origin, &direction)
                })
                .filter(|t| *t > 0.0)
                .fold(f64::INFINITY, f64::min);
            let found = caster.first(&origin, &direction, 0.0, 1e9).map_or(f64::INFINITY, |h| h.t);
            assert_eq!(found, brute, "ray {k}");
            assert_eq!(caster.is_blocked(&origin, &direction, 0.0, 1e9), brute.is_finite());
        }
    }
}
