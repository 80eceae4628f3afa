//! Which part of the face each sample of the picture shows: a z-buffer with a shade.

use super::view::View;
use crate::geometry::{Mesh, Vector3};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;

/// Samples in x and y in each pixel.
pub const SUPERSAMPLING: usize = 2;

/// Steps of the shade; few, so that the picture compresses well, and fine enough not to be seen: each is 0.8 % of the light.
pub const SHADES: u8 = 15;

/// What one sample shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Towards the eye from the middle of the picture, mm; minus infinity where there is nothing.
    pub depth_mm: f32,
    /// 0 (turned from the light) to `SHADES`.
    pub shade: u8,
    /// The sheet's normal to the right and up in the picture, in 127ths.
    pub tilt: [i8; 2],
    /// The sheet is seen from behind.
    pub reverse: bool,
}

const NOTHING: Sample = Sample { depth_mm: f32::NEG_INFINITY, shade: 0, tilt: [0; 2], reverse: false };

impl Sample {
    /// Whether the part is seen here.
    pub fn is_part(&self) -> bool {
        self.depth_mm > f32::NEG_INFINITY
    }
}

/// The picture's samples, row by row from the top.
pub struct Surface {
    /// Samples a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// All samples.
    pub samples: Vec<Sample>,
}

/// A triangle in sample coordinates, x right and y down, with depth and light at its corners.
struct Projected {
    corners: [[f64; 2]; 3],
    depth: [f64; 3],
    light: [f64; 3],
    /// The normal to the right and up, at each corner.
    tilt: [[f64; 3]; 2],
    rows: [usize; 2],
    reverse: bool,
}

/// Rows that one task draws; fixed, so that the work is cut the same way for any number of threads.
const BAND: usize = 32;

/// Draws the mesh into `width` x `height` samples, `per_mm` samples a millimetre, the view's origin in the middle.
pub fn draw(
    mesh: &Mesh,
    view: &View,
    [width, height]: [usize; 2],
    per_mm: f64,
    run: &RunContext,
) -> Result<Surface, Cancelled> {
    let normals = vertex_normals(mesh);
    let light = (view.towards + (view.up - view.right) * 0.75).normalize();
    let triangles: Vec<Projected> = (0..mesh.triangles.len())
        .into_par_iter()
        .filter_map(|t| project(mesh, t, &normals, &light, view, [width, height], per_mm))
        .collect();
    run.check()?;
    let mut bands: Vec<Vec<u32>> = vec![Vec::new(); height.div_ceil(BAND)];
    for (k, triangle) in triangles.iter().enumerate() {
        for band in &mut bands[triangle.rows[0] / BAND..=triangle.rows[1] / BAND] {
            band.push(k as u32);
        }
    }
    let mut samples = vec![NOTHING; width * height];
    samples.par_chunks_mut(BAND * width.max(1)).zip(&bands).enumerate().try_for_each(|(band, (rows, mine))| {
        run.check()?;
        let first = band * BAND;
        let last = first + rows.len() / width;
        for &triangle in mine {
            fill(&triangles[triangle as usize], rows, width, first, last);
        }
        Ok(())
    })?;
    Ok(Surface { width, height, samples })
}

/// Area-weighted mean normal of each vertex (not unit length where triangles cancel).
fn vertex_normals(mesh: &Mesh) -> Vec<Vector3> {
    let mut normals = vec![Vector3::zeros(); mesh.vertices.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let area = mesh.area_vector_twice(t);
        for &v in corners {
            normals[v as usize] += area;
        }
    }
    normals.iter().map(|n| n.try_normalize(0.0).unwrap_or_default()).collect()
}

fn project(
    mesh: &Mesh,
    triangle: usize,
    normals: &[Vector3],
    light: &Vector3,
    view: &View,
    size: [usize; 2],
    per_mm: f64,
) -> Option<Projected> {
    let face = mesh.normal(triangle)?.into_inner();
    let reverse = face.dot(&view.towards) < 0.0;
    let places = mesh.corners(triangle).map(|p| view.project(&p));
    let corners = places.map(|p| [0.5 * size[0] as f64 + p[0] * per_mm, 0.5 * size[1] as f64 - p[1] * per_mm]);
    let low = corners.iter().map(|c| c[1]).fold(f64::INFINITY, f64::min);
    let high = corners.iter().map(|c| c[1]).fold(f64::NEG_INFINITY, f64::max);
    if high < 0.0 || low >= size[1] as f64 || !low.is_finite() || !high.is_finite() {
        return None;
    }
    // Across a sharp bend the mean normal belongs to neither side: there the triangle's own is taken.
    let normal_of = |v: u32| {
        let smooth = normals[v as usize];
        if smooth.dot(&face) > 0.8 { smooth } else { face }
    };
    let sign = if reverse { -1.0 } else { 1.0 };
    let corner_normals = mesh.triangles[triangle].map(|v| sign * normal_of(v));
    Some(Projected {
        corners,
        depth: places.map(|p| p[2]),
        light: corner_normals.map(|n| n.dot(light)),
        tilt: [&view.right, &view.up].map(|axis| corner_normals.map(|n| n.dot(axis))),
        rows: [low.max(0.0) as usize, high.min(size[1] as f64 - 1.0) as usize],
        reverse,
    })
}

/// Draws the samples of rows `first..last` whose centres lie in the triangle, if nothing nearer is there.
fn fill(triangle: &Projected, rows: &mut [Sample], width: usize, first: usize, last: usize) {
    let [a, b, c] = triangle.corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 {
        return;
    }
    let per_area = 1.0 / area;
    // Along a row each weight is linear in x: w = at_zero + slope x. The samples inside are those where all three are
    // not negative, an interval.
    let slope_b = (c[1] - a[1]) * per_area;
    let slope_c = -(b[1] - a[1]) * per_area;
    let left = a[0].min(b[0]).min(c[0]).max(0.0);
    let right = a[0].max(b[0]).max(c[0]).min(width as f64 - 1.0);
    if left > right {
        return;
    }
    for y in triangle.rows[0].max(first)..=triangle.rows[1].min(last - 1) {
        let down = y as f64 + 0.5 - a[1];
        let wb_at = (-a[0] * (c[1] - a[1]) - down * (c[0] - a[0])) * per_area;
        let wc_at = ((b[0] - a[0]) * down + a[0] * (b[1] - a[1])) * per_area;
        let (mut from, mut to) = (left, right + 1.0);
        for (at, slope) in [(wb_at, slope_b), (wc_at, slope_c), (1.0 - wb_at - wc_at, -slope_b - slope_c)] {
            if slope > 0.0 {
                from = from.max(-at / slope);
            } else if slope < 0.0 {
                to = to.min(-at / slope);
            } else if at < 0.0 {
                to = f64::NEG_INFINITY;
            }
        }
        // Samples x whose centre x + 0.5 lies between.
        let (start, end) = ((from - 0.5).ceil().max(0.0), (to - 0.5).floor().min(width as f64 - 1.0));
        if start > end {
            continue;
        }
        let row = &mut rows[(y - first) * width..][..width];
        for (x, sample) in row.iter_mut().enumerate().take(end as usize + 1).skip(start as usize) {
            let px = x as f64 + 0.5;
            let (wb, wc) = (wb_at + slope_b * px, wc_at + slope_c * px);
            let mix = |v: &[f64; 3]| v[0] + wb * (v[1] - v[0]) + wc * (v[2] - v[0]);
            let depth_mm = mix(&triangle.depth) as f32;
            if depth_mm > sample.depth_mm {
                let tilt = [0, 1].map(|k| (127.0 * mix(&triangle.tilt[k])).round().clamp(-127.0, 127.0) as i8);
                *sample = Sample { depth_mm, shade: shade(mix(&triangle.light)), tilt, reverse: triangle.reverse };
            }
        }
    }
}

/// The shade of a cosine to the light. A sheet square to the eye has 0.686 and lies in the middle of the scale; a slope of
/// ten degrees towards the light or away from it takes nearly half of the scale, so that even a crown shows.
fn shade(cosine: f64) -> u8 {
    let t = 0.55 + 3.5 * (cosine - 0.686);
    (t.clamp(0.0, 1.0) * f64::from(SHADES) + 0.5) as u8
}
