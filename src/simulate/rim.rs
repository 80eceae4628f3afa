//! Rounded rims: close to a trimmed edge the surface falls away.

use super::subject::{Subject, boundary_edges};
use crate::geometry::{Point3, Vector3};
use crate::plan::Side;
use std::collections::HashMap;

/// The boundary edges of both faces, found by place.
pub(super) struct Rims {
    radius: f64,
    cell: f64,
    segments: Vec<(Point3, Point3)>,
    /// Segments near each cell.
    cells: HashMap<[i32; 3], Vec<u32>>,
    /// Triangles that are cut faces, not sheet: they are left as they are.
    sheet_triangles: usize,
}

impl Rims {
    /// The rims of a part whose edges are rounded with this radius, mm.
    pub fn new(subject: &Subject, radius_mm: f64) -> Self {
        let mut rims = Self {
            radius: radius_mm,
            cell: (4.0 * radius_mm).max(1.0),
            segments: Vec::new(),
            cells: HashMap::new(),
            sheet_triangles: subject.upper_triangles + subject.lower_triangles,
        };
        if radius_mm <= 0.0 {
            return rims;
        }
        for side in [Side::Top, Side::Bottom] {
            let face = subject.face(side);
            for [a, b] in boundary_edges(&face) {
                let (a, b) = (face.vertices[a as usize], face.vertices[b as usize]);
                let (low, high) = (
                    rims.key(&(a.inf(&b) - Vector3::repeat(radius_mm))),
                    rims.key(&(a.sup(&b) + Vector3::repeat(radius_mm))),
                );
                for (x, y, z) in cells(low, high) {
                    rims.cells.entry([x, y, z]).or_default().push(rims.segments.len() as u32);
                }
                rims.segments.push((a, b));
            }
        }
        rims
    }

    /// How far below the sharp surface a place on a triangle lies, mm; `None` away from the rims.
    pub fn rounded(&self, triangle: usize, p: &Point3) -> Option<f64> {
        if triangle >= self.sheet_triangles {
            return None;
        }
        let near = self.cells.get(&self.key(p))?;
        let distance = near.iter().map(|s| self.distance(*s, p)).fold(f64::INFINITY, f64::min);
        // A quarter circle of the radius: level at the radius from the rim, the radius deep at the rim.
        (distance < self.radius).then(|| {
            let inward = self.radius - distance;
            self.radius - (self.radius * self.radius - inward * inward).sqrt()
        })
    }

    fn distance(&self, segment: u32, p: &Point3) -> f64 {
        let (a, b) = self.segments[segment as usize];
        let along = b - a;
        let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - (a + along * t)).norm()
    }

    fn key(&self, p: &Point3) -> [i32; 3] {
        std::array::from_fn(|k| (p[k] / self.cell).floor() as i32)
    }
}

fn cells(low: [i32; 3], high: [i32; 3]) -> impl Iterator<Item = (i32, i32, i32)> {
    (low[0]..=high[0])
        .flat_map(move |x| (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| (x, y, z))))
}
