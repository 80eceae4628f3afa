//! Four triangles side by side, so that one pass of plain loops measures all of them with vector instructions.

use super::NONE;
use crate::geometry::triangle::FramedTriangle;
use crate::geometry::{Mesh, Point3, Vector3};

/// Triangles of a leaf.
pub(crate) const LANES: usize = 4;

type Lanes = [f64; LANES];

/// Framed triangles by component; lanes without a triangle hold NaN.
#[derive(Debug, Clone)]
pub(super) struct Pack {
    origin: [Lanes; 3],
    u: [Lanes; 3],
    v: [Lanes; 3],
    length: Lanes,
    apex: [Lanes; 2],
    /// Reciprocal squared lengths of the edges from the apex to the origin and to the end of the longest edge.
    inverse_sq: [Lanes; 2],
    first_corner: [u8; LANES],
}

impl Pack {
    pub(super) fn new(mesh: &Mesh, leaf: &[u32; LANES]) -> Self {
        let nothing = [f64::NAN; LANES];
        let mut pack = Self {
            origin: [nothing; 3],
            u: [nothing; 3],
            v: [nothing; 3],
            length: nothing,
            apex: [nothing; 2],
            inverse_sq: [nothing; 2],
            first_corner: [0; LANES],
        };
        for (lane, &triangle) in leaf.iter().enumerate().filter(|(_, t)| **t != NONE) {
            pack.set(lane, &FramedTriangle::new(&mesh.corners(triangle as usize)));
        }
        pack
    }

    fn set(&mut self, lane: usize, t: &FramedTriangle) {
        for axis in 0..3 {
            self.origin[axis][lane] = t.origin[axis];
            self.u[axis][lane] = t.u[axis];
            self.v[axis][lane] = t.v[axis];
        }
        self.length[lane] = t.length;
        let [cx, cy] = t.apex;
        let ex = cx - t.length;
        self.apex[0][lane] = cx;
        self.apex[1][lane] = cy;
        let inverse = |length_sq: f64| if length_sq > 0.0 { 1.0 / length_sq } else { 0.0 };
        self.inverse_sq[0][lane] = inverse(cx * cx + cy * cy);
        self.inverse_sq[1][lane] = inverse(ex * ex + cy * cy);
        self.first_corner[lane] = t.first_corner;
    }

    /// One lane as a triangle again.
    pub(super) fn triangle(&self, lane: usize) -> FramedTriangle {
        let vector = |c: &[Lanes; 3]| Vector3::new(c[0][lane], c[1][lane], c[2][lane]);
        let (u, v) = (vector(&self.u), vector(&self.v));
        FramedTriangle {
            origin: Point3::from(vector(&self.origin)),
            u,
            v,
            n: u.cross(&v),
            length: self.length[lane],
            apex: [self.apex[0][lane], self.apex[1][lane]],
            first_corner: self.first_corner[lane],
        }
    }

    /// Squared distance to each triangle; NaN where there is none.
    #[inline(always)]
    #[allow(
        clippy::needless_range_loop,
        reason = "one index into fourteen arrays is what turns into vector instructions"
    )]
    pub(super) fn distances_sq(&self, p: &Point3) -> Lanes {
        let mut out = [0.0; LANES];
        for k in 0..LANES {
            let (dx, dy, dz) = (p.x - self.origin[0][k], p.y - self.origin[1][k], p.z - self.origin[2][k]);
            let x = dx * self.u[0][k] + dy * self.u[1][k] + dz * self.u[2][k];
            let y = dx * self.v[0][k] + dy * self.v[1][k] + dz * self.v[2][k];
            // What lies neither along u nor along v; the vector form also serves triangles that have no v or no u.
            let hx = dx - x * self.u[0][k] - y * self.v[0][k];
            let hy = dy - x * self.u[1][k] - y * self.v[1][k];
            let hz = dz - x * self.u[2][k] - y * self.v[2][k];
            let height_sq = hx * hx + hy * hy + hz * hz;

            let (cx, cy) = (self.apex[0][k], self.apex[1][k]);
            let (bx, ex) = (x - self.length[k], cx - self.length[k]);
            let past = x - larger(0.0, smaller(x, self.length[k]));
            let longest = past * past + y * y;
            let t = unit_interval((x * cx + y * cy) * self.inverse_sq[0][k]);
            let (fx, fy) = (x - t * cx, y - t * cy);
            let first = fx * fx + fy * fy;
            let t = unit_interval((bx * ex + y * cy) * self.inverse_sq[1][k]);
            let (fx, fy) = (bx - t * ex, y - t * cy);
            let second = fx * fx + fy * fy;
            let around = smaller(smaller(longest, first), second);
            let inside = (y > 0.0) & (ex * y - cy * bx > 0.0) & (cy * x - cx * y > 0.0);
            out[k] = height_sq + if inside { 0.0 } else { around };
        }
        out
    }
}

// `f64::min` and `f64::max` also sort out NaN, which costs three instructions; these are one each.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn unit_interval(t: f64) -> f64 {
    larger(0.0, smaller(t, 1.0))
}
