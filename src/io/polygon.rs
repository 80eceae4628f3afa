//! Polygons of CAD files as triangles.

use crate::geometry::Point3;

/// Cuts a polygon into triangles that keep its winding and appends them. A corner that repeats is taken once; a polygon
/// with fewer than three distinct corners gives nothing.
pub fn triangulate(corners: &[u32], _vertices: &[Point3], triangles: &mut Vec<[u32; 3]>) {
    for k in 1..corners.len().saturating_sub(1) {
        let [a, b, c] = [corners[0], corners[k], corners[k + 1]];
        if a != b && b != c && a != c {
            triangles.push([a, b, c]);
        }
    }
}
