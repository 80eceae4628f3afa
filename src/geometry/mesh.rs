//! Triangle meshes with shared vertices.

use super::{Point3, UnitVector3, Vector3};

/// An axis-aligned box, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: Point3,
    /// Highest corner.
    pub max: Point3,
}

impl Aabb {
    /// The box of some points; `None` when there are none.
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a Point3>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = *points.next()?;
        Some(points.fold(Self { min: first, max: first }, |b, p| Self { min: b.min.inf(p), max: b.max.sup(p) }))
    }

    /// Its middle.
    pub fn centre(&self) -> Point3 {
        nalgebra::center(&self.min, &self.max)
    }

    /// Its edge lengths.
    pub fn extents(&self) -> Vector3 {
        self.max - self.min
    }

    /// The length of its diagonal.
    pub fn diagonal(&self) -> f64 {
        self.extents().norm()
    }
}

/// Triangles over shared vertices, mm. Counter-clockwise seen from where the normal points to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub vertices: Vec<Point3>,
    /// Three vertex indices a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Point3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Twice the area times the unit normal of a triangle.
    pub fn area_vector_twice(&self, triangle: usize) -> Vector3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a))
    }

    /// Unit normal of a triangle; `None` when it has no area.
    pub fn normal(&self, triangle: usize) -> Option<UnitVector3> {
        UnitVector3::try_new(self.area_vector_twice(triangle), 0.0)
    }

    /// Surface area, mm².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| 0.5 * self.area_vector_twice(t).norm()).sum()
    }

    /// Box of the vertices; `None` when there are none.
    pub fn bounds(&self) -> Option<Aabb> {
        Aabb::of_points(&self.vertices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counter_clockwise_points_up() {
        let mesh = Mesh {
            vertices: vec![Point3::origin(), Point3::new(2.0, 0.0, 0.0), Point3::new(0.0, 3.0, 0.0)],
            triangles: vec![[0, 1, 2]],
        };
        assert_eq!(mesh.normal(0).unwrap().into_inner(), Vector3::z());
        assert_eq!(mesh.area(), 3.0);
        assert_eq!(mesh.bounds().unwrap().extents(), Vector3::new(2.0, 3.0, 0.0));
    }
}
