//! The nearest triangle along a ray.

use super::pack::LANES;
use super::{Bvh, LEAF, NONE, Node, STACK, WIDTH};
use crate::geometry::{Point3, Vector3};

/// Where a ray meets the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Parameter along the ray: the hit is `origin + t * direction`, t > 0.
    pub t: f64,
    /// The triangle hit; of several at the same t the lowest index.
    pub triangle: u32,
}

/// Triangles are grown by this share of their longest edge, so that no ray slips between two neighbours.
const GROWN: f64 = 1e-10;

impl Bvh {
    /// The nearest hit with `0 < t <= max_t`, from either side; triangles without area are never hit. The direction need not have
    /// length one. `None` as well when the ray is not finite or has no direction.
    pub fn ray(&self, origin: &Point3, direction: &Vector3, max_t: f64) -> Option<RayHit> {
        let finite = origin.coords.iter().chain(direction.iter()).all(|c| c.is_finite());
        if !finite || direction.norm_squared() == 0.0 || self.tree.nodes.is_empty() || max_t.is_nan() {
            return None;
        }
        let slab = Slabs::new(&(origin - self.tree.centre), direction);
        let mut best = RayHit { t: max_t, triangle: NONE };
        let mut stack = [(0.0f64, 0u32); STACK];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (enters, item) = stack[waiting];
            if enters > best.t {
                continue;
            }
            if item & LEAF != 0 {
                self.hit_leaf(item ^ LEAF, origin, direction, &mut best);
                continue;
            }
            let node = &self.tree.nodes[item as usize];
            let (enter, leave) = slab.spans(node);
            let base = waiting;
            for k in 0..WIDTH {
                if node.child[k] == NONE || enter[k] > leave[k] || enter[k] > best.t {
                    continue;
                }
                let mut at = waiting;
                while at > base && stack[at - 1].0 < enter[k] {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (enter[k], node.child[k]);
                waiting += 1;
            }
        }
        (best.triangle != NONE).then_some(best)
    }

    fn hit_leaf(&self, leaf: u32, origin: &Point3, direction: &Vector3, best: &mut RayHit) {
        let ids = &self.tree.leaves[leaf as usize];
        for (lane, &id) in ids.iter().enumerate().take(LANES) {
            if id == NONE {
                continue;
            }
            let triangle = self.packs[leaf as usize].triangle(lane);
            let slope = direction.dot(&triangle.n);
            if slope == 0.0 {
                continue;
            }
            let from_origin = origin - triangle.origin;
            let t = -from_origin.dot(&triangle.n) / slope;
            let nearer = t < best.t || (t == best.t && id < best.triangle);
            if !(t > 0.0 && nearer) {
                continue;
            }
            let foot = from_origin + direction * t;
            let (x, y) = (foot.dot(&triangle.u), foot.dot(&triangle.v));
            let [cx, cy] = triangle.apex;
            let (bx, ex) = (x - triangle.length, cx - triangle.length);
            let slack = GROWN * triangle.length;
            // Both products are distances to an edge times its length.
            let slack_area = slack * triangle.length;
            if y >= -slack && ex * y - cy * bx >= -slack_area && cy * x - cx * y >= -slack_area {
                *best = RayHit { t, triangle: id };
            }
        }
    }
}

/// The ray prepared for box tests.
struct Slabs {
    origin: [f64; 3],
    inverse: [f64; 3],
}

impl Slabs {
    fn new(origin: &Vector3, direction: &Vector3) -> Self {
        // A huge finite number in place of 1/0: products with zero stay zero instead of becoming NaN.
        let inverse = |d: f64| if d.abs() > 1e-150 { 1.0 / d } else { 1e150f64.copysign(d) };
        Self { origin: [origin.x, origin.y, origin.z], inverse: std::array::from_fn(|k| inverse(direction[k])) }
    }

    /// Where the ray enters and leaves each box. Boxes are rounded out by an f32 step or more, far beyond the rounding here.
    #[inline(always)]
    fn spans(&self, node: &Node) -> ([f64; WIDTH], [f64; WIDTH]) {
        let (mut enter, mut leave) = ([0.0f64; WIDTH], [f64::INFINITY; WIDTH]);
        for axis in 0..3 {
            let (o, inverse) = (self.origin[axis], self.inverse[axis]);
            for k in 0..WIDTH {
                let a = (f64::from(node.lo[axis][k]) - o) * inverse;
                let b = (f64::from(node.hi[axis][k]) - o) * inverse;
                let (near, far) = if a < b { (a, b) } else { (b, a) };
                enter[k] = if near > enter[k] { near } else { enter[k] };
                leave[k] = if far < leave[k] { far } else { leave[k] };
            }
        }
        (enter, leave)
    }
}
