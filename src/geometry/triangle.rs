//! The closest place on one triangle, by cases: vertex, edge, face.
//!
//! Every triangle carries an orthonormal frame (u along its longest edge, v in its plane, n = u x v) in which it is the flat
//! triangle (0, 0), (length, 0), (apex). A query then splits into its height along n and a closest-point problem in the
//! plane. The usual barycentric formula divides by the squared area and loses all digits on the slivers that CAD tessellators
//! put on fillets; here the longest edge fixes u, and v is made orthogonal to it twice, so that the triangle actually
//! represented differs from the given one by a few rounding errors of its longest edge, whatever its height. A triangle
//! without area is its longest edge, one without length its point.

use super::{Point3, Vector3};

/// Which part of a triangle a place lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feature {
    /// Its inside.
    Face,
    /// Edge k runs from corner k to corner k + 1 (modulo 3).
    Edge(u8),
    /// Corner k.
    Vertex(u8),
}

/// A triangle in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FramedTriangle {
    /// First end of the longest edge.
    pub origin: Point3,
    /// Unit vector along the longest edge; zero when the triangle is a point.
    pub u: Vector3,
    /// Unit vector in the plane, perpendicular to `u`, towards the third corner; zero when the triangle has no area.
    pub v: Vector3,
    /// Unit normal, counter-clockwise; zero when the triangle has no area.
    pub n: Vector3,
    /// Length of the longest edge, mm.
    pub length: f64,
    /// The third corner along `u` and `v`, mm.
    pub apex: [f64; 2],
    /// Which corner of the mesh triangle the origin is.
    pub first_corner: u8,
}

/// Heights below this share of the longest edge count as none: the direction of such a triangle is rounding noise.
const FLAT: f64 = 1e-14;

impl FramedTriangle {
    /// Frames a triangle.
    pub fn new(corners: &[Point3; 3]) -> Self {
        let length_sq = |k: usize| (corners[(k + 1) % 3] - corners[k]).norm_squared();
        let first = (1..3).fold(0, |best, k| if length_sq(k) > length_sq(best) { k } else { best });
        let [a, b, c] = [first, (first + 1) % 3, (first + 2) % 3].map(|k| corners[k]);
        let (along, across) = (b - a, c - a);
        let length = along.norm();
        let u = if length > 0.0 { along / length } else { Vector3::zeros() };
        let once = across - u * across.dot(&u);
        let rest = once - u * once.dot(&u);
        let height = rest.norm();
        let mut triangle = Self {
            origin: a,
            u,
            v: Vector3::zeros(),
            n: Vector3::zeros(),
            length,
            apex: [across.dot(&u), 0.0],
            first_corner: first as u8,
        };
        if height > FLAT * length && height > f64::MIN_POSITIVE {
            triangle.v = rest / height;
            triangle.n = u.cross(&triangle.v);
            triangle.apex[1] = height;
        }
        triangle
    }

    /// The closest place on the triangle, and the feature it lies on. Ties between features go to the lower dimension.
    pub fn closest(&self, p: &Point3) -> (Point3, Feature) {
        let from_origin = p - self.origin;
        let (x, y) = (from_origin.dot(&self.u), from_origin.dot(&self.v));
        let [cx, cy] = self.apex;
        let (bx, ex) = (x - self.length, cx - self.length);
        if cy > 0.0 && y > 0.0 && ex * y - cy * bx > 0.0 && cy * x - cx * y > 0.0 {
            return (self.at(x, y), Feature::Face);
        }
        // Corner numbers here are those of the frame: 0 the origin, 1 the end of the longest edge, 2 the apex.
        let along_edge = |start: [f64; 2], edge: [f64; 2], from: u8, to: u8, name: u8| {
            let length_sq = edge[0] * edge[0] + edge[1] * edge[1];
            let (dx, dy) = (x - start[0], y - start[1]);
            let t = if length_sq > 0.0 { ((dx * edge[0] + dy * edge[1]) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
            let foot = [start[0] + t * edge[0], start[1] + t * edge[1]];
            let distance_sq = (x - foot[0]).powi(2) + (y - foot[1]).powi(2);
            let feature = if t <= 0.0 {
                Feature::Vertex(from)
            } else if t >= 1.0 {
                Feature::Vertex(to)
            } else {
                Feature::Edge(name)
            };
            (distance_sq, foot, feature)
        };
        let candidates = [
            along_edge([0.0, 0.0], [self.length, 0.0], 0, 1, 0),
            along_edge([self.length, 0.0], [ex, cy], 1, 2, 1),
            along_edge([0.0, 0.0], [cx, cy], 0, 2, 2),
        ];
        let (_, foot, feature) = candidates.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a }).unwrap_or((
            0.0,
            [0.0, 0.0],
            Feature::Vertex(0),
        ));
        let in_mesh = |k: u8| (k + self.first_corner) % 3;
        let feature = match feature {
            Feature::Vertex(k) => Feature::Vertex(in_mesh(k)),
            Feature::Edge(k) => Feature::Edge(in_mesh(k)),
            Feature::Face => Feature::Face,
        };
        (self.at(foot[0], foot[1]), feature)
    }

    fn at(&self, x: f64, y: f64) -> Point3 {
        self.origin + self.u * x + self.v * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_of_a_plain_triangle() {
        // Shorter edges first, so that the frame starts at corner 1 and names have to be mapped back.
        let corners = [Point3::new(0.0, 0.0, 0.0), Point3::new(3.0, 0.0, 0.0), Point3::new(0.0, 4.0, 0.0)];
        let framed = FramedTriangle::new(&corners);
        assert_eq!(framed.first_corner, 1);
        assert!((framed.n - Vector3::z()).norm() < 1e-15);
        let cases = [
            ([0.5, 0.5, 2.0], [0.5, 0.5, 0.0], Feature::Face),
            ([-1.0, -1.0, 1.0], [0.0, 0.0, 0.0], Feature::Vertex(0)),
            ([5.0, -0.5, 1.0], [3.0, 0.0, 0.0], Feature::Vertex(1)),
            ([0.0, 6.0, 1.0], [0.0, 4.0, 0.0], Feature::Vertex(2)),
            ([1.0, -2.0, 0.5], [1.0, 0.0, 0.0], Feature::Edge(0)),
            ([-2.0, 1.0, 0.5], [0.0, 1.0, 0.0], Feature::Edge(2)),
            ([1.5 + 4.0, 2.0 + 3.0, 0.0], [1.5, 2.0, 0.0], Feature::Edge(1)),
        ];
        for (p, q, feature) in cases {
            let (point, found) = framed.closest(&Point3::from(p));
            assert_eq!(found, feature, "{p:?}");
            assert!((point - Point3::from(q)).norm() < 1e-14, "{p:?} {point}");
        }
    }

    #[test]
    fn degenerate_triangles_are_segments_and_points() {
        let (a, b) = (Point3::new(1.0, 1.0, 1.0), Point3::new(4.0, 1.0, 1.0));
        let mid = Point3::new(2.0, 1.0, 1.0);
        for corners in [[a, b, b], [a, b, mid], [mid, a, b], [b, mid, a]] {
            let (point, _) = FramedTriangle::new(&corners).closest(&Point3::new(3.0, 5.0, 1.0));
            assert!((point - Point3::new(3.0, 1.0, 1.0)).norm() < 1e-14);
        }
        let (point, feature) = FramedTriangle::new(&[a, a, a]).closest(&Point3::origin());
        assert_eq!((point, feature), (a, Feature::Vertex(0)));
    }
}
