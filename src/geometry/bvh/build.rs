//! Building the tree: binned surface area heuristic, straight into wide nodes.

use super::pack::LANES;
use super::{LEAF, NONE, Node, Shape, Tree, WIDTH};
use crate::geometry::{Mesh, Point3};
use rayon::prelude::*;

/// Levels split by cost; below them halves, so that odd input cannot make deep trees.
const COST_LEVELS: usize = 16;
/// Levels of nodes at most: halving eightfold uses up 2^32 triangles in eleven.
pub(super) const MAX_LEVELS: usize = COST_LEVELS + 11;
const BINS: usize = 16;
/// Ranges above this many triangles are built side by side.
const PARALLEL: usize = 8192;

/// A triangle while building.
#[derive(Clone, Copy)]
struct Item {
    lo: [f32; 3],
    hi: [f32; 3],
    triangle: u32,
}

impl Item {
    /// Twice the middle of the box.
    fn middle(&self, axis: usize) -> f32 {
        self.lo[axis] + self.hi[axis]
    }
}

#[derive(Clone, Copy)]
struct Extent {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Extent {
    const EMPTY: Extent = Extent { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    fn add(&mut self, lo: &[f32; 3], hi: &[f32; 3]) {
        for axis in 0..3 {
            // Not `f32::min`, which also sorts out NaN: there is none here, and this loop is most of the building.
            self.lo[axis] = if lo[axis] < self.lo[axis] { lo[axis] } else { self.lo[axis] };
            self.hi[axis] = if hi[axis] > self.hi[axis] { hi[axis] } else { self.hi[axis] };
        }
    }

    fn half_area(&self) -> f32 {
        let e: [f32; 3] = std::array::from_fn(|k| (self.hi[k] - self.lo[k]).max(0.0));
        e[0] * e[1] + e[1] * e[2] + e[2] * e[0]
    }

    fn of(items: &[Item]) -> Self {
        let mut extent = Self::EMPTY;
        for item in items {
            extent.add(&item.lo, &item.hi);
        }
        extent
    }
}

/// A finished part of the tree, indices counted from its own start.
#[derive(Default)]
struct Subtree {
    nodes: Vec<Node>,
    leaves: Vec<[u32; LANES]>,
}

/// Builds the tree of a mesh.
pub(super) fn tree(mesh: &Mesh) -> Tree {
    let centre = mesh.bounds().map_or(Point3::origin(), |b| b.centre());
    let mut items: Vec<Item> = (0..mesh.triangles.len())
        .into_par_iter()
        .with_min_len(4096)
        .map(|triangle| {
            let Extent { lo, hi } = triangle_box(mesh, triangle, &centre);
            Item { lo, hi, triangle: triangle as u32 }
        })
        .collect();
    let mut subtree = Subtree::default();
    if !items.is_empty() {
        build_node(&mut items, 0, &mut subtree);
    }
    Tree { centre, nodes: subtree.nodes, leaves: subtree.leaves }
}

/// The box of a triangle relative to the centre, rounded outwards.
fn triangle_box(mesh: &Mesh, triangle: usize, centre: &Point3) -> Extent {
    let corners = mesh.corners(triangle).map(|c| c - centre);
    let lowest = corners[0].inf(&corners[1]).inf(&corners[2]);
    let highest = corners[0].sup(&corners[1]).sup(&corners[2]);
    Extent {
        lo: std::array::from_fn(|k| (lowest[k] as f32).next_down()),
        hi: std::array::from_fn(|k| (highest[k] as f32).next_up()),
    }
}

/// Gives a tree new boxes, those of a mesh with the same triangles over other vertices. For the mesh the tree was built for, that gives
/// the same boxes again. The tree must be sound for the number of triangles.
pub(super) fn refit(mesh: &Mesh, shape: &Shape) -> Tree {
    let centre = mesh.bounds().map_or(Point3::origin(), |b| b.centre());
    let leaf_box = |leaf: &[u32; LANES]| {
        let mut extent = Extent::EMPTY;
        for &triangle in leaf.iter().filter(|t| **t != NONE) {
            let b = triangle_box(mesh, triangle as usize, &centre);
            extent.add(&b.lo, &b.hi);
        }
        extent
    };
    let leaf_boxes: Vec<Extent> = shape.leaves.par_iter().with_min_len(1024).map(leaf_box).collect();
    let mut node_boxes = vec![Extent::EMPTY; shape.children.len()];
    let mut nodes = vec![Node::EMPTY; shape.children.len()];
    // Children come after their parents.
    for (here, children) in shape.children.iter().enumerate().rev() {
        let node = &mut nodes[here];
        node.child = *children;
        let mut whole = Extent::EMPTY;
        for (k, &child) in children.iter().enumerate().filter(|(_, c)| **c != NONE) {
            let is_leaf = child & LEAF != 0;
            let b = if is_leaf { leaf_boxes[(child ^ LEAF) as usize] } else { node_boxes[child as usize] };
            for axis in 0..3 {
                node.lo[axis][k] = b.lo[axis];
                node.hi[axis][k] = b.hi[axis];
            }
            whole.add(&b.lo, &b.hi);
        }
        node_boxes[here] = whole;
    }
    Tree { centre, nodes, leaves: shape.leaves.clone() }
}

fn build_node(items: &mut [Item], level: usize, out: &mut Subtree) {
    let here = out.nodes.len();
    let mut node = Node::EMPTY;
    out.nodes.push(node);
    let parallel = items.len() > PARALLEL;
    let ranges = children(items, level);
    let mut slices: Vec<&mut [Item]> = Vec::with_capacity(ranges.len());
    let mut rest = items;
    for (count, extent) in &ranges {
        let (head, tail) = rest.split_at_mut(*count);
        let k = slices.len();
        for axis in 0..3 {
            node.lo[axis][k] = extent.lo[axis];
            node.hi[axis][k] = extent.hi[axis];
        }
        slices.push(head);
        rest = tail;
    }
    if parallel {
        let parts: Vec<Subtree> = slices
            .into_par_iter()
            .map(|slice| {
                let mut part = Subtree::default();
                build_child(slice, level + 1, &mut part);
                part
            })
            .collect();
        for (k, part) in parts.into_iter().enumerate() {
            node.child[k] = append(out, part);
        }
    } else {
        for (k, slice) in slices.into_iter().enumerate() {
            node.child[k] = build_child(slice, level + 1, out);
        }
    }
    out.nodes[here] = node;
}

/// Builds a leaf or a node and returns its reference.
fn build_child(items: &mut [Item], level: usize, out: &mut Subtree) -> u32 {
    if items.len() > LANES {
        let index = out.nodes.len() as u32;
        build_node(items, level, out);
        return index;
    }
    let mut leaf = [NONE; LANES];
    for (place, item) in leaf.iter_mut().zip(items.iter()) {
        *place = item.triangle;
    }
    leaf[..items.len()].sort_unstable();
    out.leaves.push(leaf);
    LEAF + (out.leaves.len() - 1) as u32
}

/// Appends a part built on its own and returns the reference to its top.
fn append(out: &mut Subtree, part: Subtree) -> u32 {
    let (nodes, leaves) = (out.nodes.len() as u32, out.leaves.len() as u32);
    let top = if part.nodes.is_empty() { LEAF + leaves } else { nodes };
    out.leaves.extend(part.leaves);
    out.nodes.extend(part.nodes.into_iter().map(|mut node| {
        for child in node.child.iter_mut().filter(|c| **c != NONE) {
            *child += if *child & LEAF != 0 { leaves } else { nodes };
        }
        node
    }));
    top
}

/// Sorts the items into up to eight ranges, splitting the most expensive one each time.
fn children(items: &mut [Item], level: usize) -> Vec<(usize, Extent)> {
    let mut ranges = vec![(0..items.len(), Extent::of(items))];
    while ranges.len() < WIDTH {
        let by_cost = level < COST_LEVELS;
        let cost = |r: &(std::ops::Range<usize>, Extent)| match r.0.len() {
            count if count <= LANES => -1.0,
            count if by_cost => r.1.half_area() * packs(count),
            count => count as f32,
        };
        let mut widest = 0;
        for k in 1..ranges.len() {
            if cost(&ranges[k]) > cost(&ranges[widest]) {
                widest = k;
            }
        }
        let range = ranges[widest].0.clone();
        if range.len() <= LANES {
            break;
        }
        let slice = &mut items[range.clone()];
        let middle = if by_cost { split_by_cost(slice) } else { None }.unwrap_or(range.len() / 2);
        let (left, right) = slice.split_at(middle);
        let halves = (Extent::of(left), Extent::of(right));
        let cut = range.start + middle;
        ranges[widest] = (range.start..cut, halves.0);
        ranges.insert(widest + 1, (cut..range.end, halves.1));
    }
    ranges.into_iter().map(|(range, extent)| (range.len(), extent)).collect()
}

/// Leaves that so many triangles fill: what a search pays for, so that leaves come out full.
fn packs(count: usize) -> f32 {
    count.div_ceil(LANES) as f32
}

/// Partitions at the cheapest of the bin borders; `None` when all middles fall together.
fn split_by_cost(items: &mut [Item]) -> Option<usize> {
    let mut middles = Extent::EMPTY;
    for item in items.iter() {
        let m = std::array::from_fn(|axis| item.middle(axis));
        middles.add(&m, &m);
    }
    let scale: [f32; 3] = std::array::from_fn(|axis| {
        let width = middles.hi[axis] - middles.lo[axis];
        if width > 0.0 && (BINS as f32 / width).is_finite() { BINS as f32 / width } else { 0.0 }
    });
    let bin =
        |item: &Item, axis: usize| (((item.middle(axis) - middles.lo[axis]) * scale[axis]) as usize).min(BINS - 1);
    let mut bins = [[(Extent::EMPTY, 0usize); BINS]; 3];
    for item in items.iter() {
        for (axis, row) in bins.iter_mut().enumerate() {
            let place = &mut row[bin(item, axis)];
            place.0.add(&item.lo, &item.hi);
            place.1 += 1;
        }
    }
    let mut cheapest: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|axis| scale[*axis] > 0.0) {
        let mut from_right = [0.0f32; BINS];
        let (mut extent, mut count) = (Extent::EMPTY, 0);
        for k in (1..BINS).rev() {
            extent.add(&bins[axis][k].0.lo, &bins[axis][k].0.hi);
            count += bins[axis][k].1;
            from_right[k] = if count > 0 { extent.half_area() * packs(count) } else { f32::INFINITY };
        }
        let (mut extent, mut count) = (Extent::EMPTY, 0);
        for k in 1..BINS {
            extent.add(&bins[axis][k - 1].0.lo, &bins[axis][k - 1].0.hi);
            count += bins[axis][k - 1].1;
            if count == 0 {
                continue;
            }
            let cost = extent.half_area() * packs(count) + from_right[k];
            if cost.is_finite() && cheapest.is_none_or(|(c, _, _)| cost < c) {
                cheapest = Some((cost, axis, k));
            }
        }
    }
    let (_, axis, border) = cheapest?;
    let mut next = 0;
    for k in 0..items.len() {
        if bin(&items[k], axis) < border {
            items.swap(k, next);
            next += 1;
        }
    }
    (next > 0 && next < items.len()).then_some(next)
}

/// Whether a stored tree can be searched without leaving it: see [`super::Bvh::try_from_shape`].
pub(super) fn is_sound(tree: &Shape, triangles: usize) -> bool {
    let mut seen = vec![false; triangles];
    let every_triangle_once = tree.leaves.iter().flatten().filter(|t| **t != NONE).all(|&t| {
        let fresh = seen.get(t as usize) == Some(&false);
        if fresh {
            seen[t as usize] = true;
        }
        fresh
    });
    let mut level = vec![0usize; tree.children.len()];
    for (k, children) in tree.children.iter().enumerate() {
        for &child in children.iter().filter(|c| **c != NONE) {
            if child & LEAF != 0 {
                if (child ^ LEAF) as usize >= tree.leaves.len() {
                    return false;
                }
            } else {
                let below = level[k] + 1;
                if child as usize <= k || child as usize >= tree.children.len() || below >= MAX_LEVELS {
                    return false;
                }
                level[child as usize] = level[child as usize].max(below);
            }
        }
    }
    every_triangle_once && seen.iter().all(|s| *s) && (tree.children.is_empty() == (triangles == 0))
}
