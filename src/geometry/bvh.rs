//! Closest point and nearest ray hit on a triangle mesh, by a tree of boxes eight wide.
//!
//! Boxes are f32, relative to the middle of the mesh and rounded outwards; triangles are f64 in their own frames (see
//! [`super::triangle`]), four to a leaf. A box is passed over only when even its rounded-out version is farther than the best
//! triangle so far, so the answer is the minimum of (distance, triangle index) over *all* triangles: it depends neither on the
//! order of the search nor on the seed, and equal distances go to the lowest triangle index.
//!
//! The tree is built by the surface area heuristic with binning (Wald 2007) straight into wide nodes: the child with the
//! largest cost is split until there are eight.

mod build;
mod pack;
mod ray;

pub use super::triangle::Feature;
pub use ray::RayHit;

use super::{Mesh, Point3};
use pack::{LANES, Pack};
use rayon::prelude::*;

/// Children of a node.
const WIDTH: usize = 8;
/// Marks a child as a leaf.
const LEAF: u32 = 1 << 31;
/// No child, no triangle.
const NONE: u32 = u32::MAX;
/// Places on the search stack: at most 7 wait on each of the levels that the builder allows, plus one.
const STACK: usize = 7 * build::MAX_LEVELS + 1;

/// Boxes of the children in f32, and what they are.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    /// Lowest corners by axis, relative to the mesh's middle.
    lo: [[f32; WIDTH]; 3],
    /// Highest corners by axis.
    hi: [[f32; WIDTH]; 3],
    /// Node index, or `LEAF` + leaf index, or `NONE`.
    child: [u32; WIDTH],
}

impl Node {
    const EMPTY: Node =
        Node { lo: [[f32::INFINITY; WIDTH]; 3], hi: [[f32::NEG_INFINITY; WIDTH]; 3], child: [NONE; WIDTH] };
}

/// The tree without its triangles.
#[derive(Debug, Clone, PartialEq)]
struct Tree {
    /// Middle of the mesh, to which the boxes are relative.
    centre: Point3,
    /// Nodes, the root first; children after their parents.
    nodes: Vec<Node>,
    /// Triangle indices of each leaf, filled up with `NONE`.
    leaves: Vec<[u32; LANES]>,
}

/// The tree without triangles and boxes: what a cache keeps. The boxes follow from the mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Children of each node.
    pub(crate) children: Vec<[u32; WIDTH]>,
    /// Triangles of each leaf.
    pub(crate) leaves: Vec<[u32; LANES]>,
}

/// A search tree over the triangles of a mesh.
#[derive(Debug, Clone)]
pub struct Bvh {
    tree: Tree,
    packs: Vec<Pack>,
    /// Leaf of each triangle.
    leaf_of: Vec<u32>,
}

/// Compares the trees; what hangs on them follows from the mesh, which is to be compared beside it.
impl PartialEq for Bvh {
    fn eq(&self, other: &Self) -> bool {
        self.tree == other.tree
    }
}

/// The closest place on a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The place.
    pub point: Point3,
    /// The triangle it lies on.
    pub triangle: u32,
    /// Squared distance to the query, mm².
    pub distance_sq: f64,
    /// Where on the triangle it lies.
    pub feature: Feature,
}

/// Best triangle so far.
#[derive(Clone, Copy)]
struct Best {
    distance_sq: f64,
    triangle: u32,
    leaf: u32,
    lane: u32,
}

impl Bvh {
    /// Builds the tree; degenerate triangles count as their longest edge. The result does not depend on the number of threads.
    pub fn build(mesh: &Mesh) -> Bvh {
        Self::with_tree(mesh, build::tree(mesh))
    }

    /// Puts a tree over the mesh it was built for.
    fn with_tree(mesh: &Mesh, tree: Tree) -> Bvh {
        let packs = tree.leaves.par_iter().with_min_len(1024).map(|leaf| Pack::new(mesh, leaf)).collect();
        let mut leaf_of = vec![NONE; mesh.triangles.len()];
        for (k, leaf) in tree.leaves.iter().enumerate() {
            for &triangle in leaf.iter().filter(|&&t| t != NONE) {
                leaf_of[triangle as usize] = k as u32;
            }
        }
        Bvh { tree, packs, leaf_of }
    }

    /// What a cache keeps of the tree.
    pub(crate) fn shape(&self) -> Shape {
        Shape { children: self.tree.nodes.iter().map(|n| n.child).collect(), leaves: self.tree.leaves.clone() }
    }

    /// Puts a tree over a mesh whose triangles lie much like those of the mesh it was built for: the other face of a sheet, or the same mesh
    /// read back from a cache, which gives the same tree. `None` unless every index fits, every triangle stands in one leaf, and no path
    /// is longer than the search allows. The mesh's own indices must be valid.
    pub(crate) fn try_from_shape(mesh: &Mesh, shape: &Shape) -> Option<Bvh> {
        build::is_sound(shape, mesh.triangles.len()).then(|| Self::with_tree(mesh, build::refit(mesh, shape)))
    }

    /// The closest place within `max_distance_mm` (which may be infinite); `None` when there is none or the query is not finite.
    /// Equal distances go to the lowest triangle index.
    pub fn closest(&self, p: &Point3, max_distance_mm: f64) -> Option<Closest> {
        self.search(p, max_distance_mm, NONE)
    }

    /// Like [`Bvh::closest`], with the same answer, faster when `seed_triangle` is near the query: for instance the answer of the
    /// neighbouring point. Any index may be given.
    pub fn closest_seeded(&self, p: &Point3, max_distance_mm: f64, seed_triangle: u32) -> Option<Closest> {
        let leaf = self.leaf_of.get(seed_triangle as usize).copied().unwrap_or(NONE);
        self.search(p, max_distance_mm, leaf)
    }

    fn search(&self, p: &Point3, max_distance_mm: f64, seed_leaf: u32) -> Option<Closest> {
        let usable = p.coords.iter().all(|c| c.is_finite()) && max_distance_mm >= 0.0;
        if !usable || self.tree.nodes.is_empty() {
            return None;
        }
        let start = max_distance_mm * max_distance_mm;
        let mut best = Best { distance_sq: start, triangle: NONE, leaf: NONE, lane: 0 };
        if seed_leaf != NONE {
            self.visit_leaf(p, seed_leaf, &mut best);
        }
        self.descend(p, seed_leaf, &mut best);
        if best.triangle == NONE {
            return None;
        }
        let (point, feature) = self.packs[best.leaf as usize].triangle(best.lane as usize).closest(p);
        Some(Closest { point, triangle: best.triangle, distance_sq: best.distance_sq, feature })
    }

    fn visit_leaf(&self, p: &Point3, leaf: u32, best: &mut Best) {
        let distances = self.packs[leaf as usize].distances_sq(p);
        let ids = &self.tree.leaves[leaf as usize];
        for lane in 0..LANES {
            let d = distances[lane];
            // Lanes without a triangle hold NaN and never win.
            if d < best.distance_sq || (d == best.distance_sq && ids[lane] < best.triangle) {
                *best = Best { distance_sq: d, triangle: ids[lane], leaf, lane: lane as u32 };
            }
        }
    }

    fn descend(&self, p: &Point3, visited_leaf: u32, best: &mut Best) {
        let probe = Probe::new(&(p - self.tree.centre));
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (distance_sq, item) = stack[waiting];
            if distance_sq > upper_f32(best.distance_sq) {
                continue;
            }
            if item & LEAF != 0 {
                if item ^ LEAF != visited_leaf {
                    self.visit_leaf(p, item ^ LEAF, best);
                }
                continue;
            }
            let node = &self.tree.nodes[item as usize];
            let distances = probe.distances_sq(node);
            let bound = upper_f32(best.distance_sq);
            let base = waiting;
            for (&d, &child) in distances.iter().zip(&node.child) {
                if d > bound || child == NONE {
                    continue;
                }
                // Nearest on top; insertion keeps equal ones in a fixed order.
                let mut at = waiting;
                while at > base && stack[at - 1].0 < d {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (d, child);
                waiting += 1;
            }
        }
    }
}

/// A query as f32 interval, so that distances to boxes are never too large by more than their own rounding.
struct Probe {
    low: [f32; 3],
    high: [f32; 3],
}

impl Probe {
    fn new(relative: &super::Vector3) -> Self {
        let low = std::array::from_fn(|k| (relative[k] as f32).next_down());
        let high = std::array::from_fn(|k| (relative[k] as f32).next_up());
        Self { low, high }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "one index into three arrays is what turns into vector instructions")]
    fn distances_sq(&self, node: &Node) -> [f32; WIDTH] {
        let mut sum = [0.0f32; WIDTH];
        for axis in 0..3 {
            let (low, high) = (self.low[axis], self.high[axis]);
            for k in 0..WIDTH {
                let below = node.lo[axis][k] - high;
                let above = low - node.hi[axis][k];
                let gap = if below > above { below } else { above };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                sum[k] += gap * gap;
            }
        }
        sum
    }
}

/// An f32 not below the number, with room for the rounding of box distances: three products, two sums and a difference each
/// round by at most 2^-24, together below 5e-7.
#[inline(always)]
fn upper_f32(distance_sq: f64) -> f32 {
    (distance_sq * (1.0 + 1e-6)) as f32 * (1.0 + 2.4e-7) + f32::MIN_POSITIVE
}

#[cfg(test)]
mod tests;
