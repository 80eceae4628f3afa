//! Neighbours in the camera's picture: of an organised cloud the points around a point are those of the pixels around its pixel, so that no
//! search is needed.

use super::non_uniformity::{NonUniformity, off_the_mean, plane_normal};
use crate::geometry::{Point3, Vector3};
use rayon::prelude::*;

/// Pixels looked at in each direction, in what a radius holds of d_grid: the surface may be nearer to the camera than its middle.
const MARGIN: f64 = 1.5;
/// A picture may have this many pixels without a point for each one with a point.
const MOST_EMPTY: usize = 64;
/// No point.
const EMPTY: u32 = u32::MAX;

/// Points by their pixels.
#[derive(Debug)]
pub struct Picture {
    first: [u32; 2],
    size: [usize; 2],
    points: Vec<u32>,
    pixels: Vec<[u32; 2]>,
}

impl Picture {
    /// Of the pixels of points. `None` when two points share a pixel, or the picture is far larger than its points explain: no organised
    /// cloud.
    pub fn new(pixels: &[[u32; 2]]) -> Option<Self> {
        let ends = |k: usize| Some((pixels.iter().map(|p| p[k]).min()?, pixels.iter().map(|p| p[k]).max()?));
        let ((top, bottom), (left, right)) = (ends(0)?, ends(1)?);
        let size = [(bottom - top) as usize + 1, (right - left) as usize + 1];
        if size[0].checked_mul(size[1])? > MOST_EMPTY * (pixels.len() + 1024) {
            return None;
        }
        let mut points = vec![EMPTY; size[0] * size[1]];
        for (k, [row, col]) in pixels.iter().enumerate() {
            let place = &mut points[(row - top) as usize * size[1] + (col - left) as usize];
            if std::mem::replace(place, k as u32) != EMPTY {
                return None;
            }
        }
        Some(Self { first: [top, left], size, points, pixels: pixels.to_vec() })
    }

    /// The points of the pixels at most `reach` rows and columns from that of a point, itself among them.
    fn around(&self, k: usize, reach: usize) -> impl Iterator<Item = usize> {
        let [row, col] = [0, 1].map(|axis| (self.pixels[k][axis] - self.first[axis]) as usize);
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(self.size[0]);
        let cols = col.saturating_sub(reach)..(col + reach + 1).min(self.size[1]);
        rows.flat_map(move |row| self.points[row * self.size[1]..][cols.clone()].iter())
            .filter(|k| **k != EMPTY)
            .map(|k| *k as usize)
    }

    /// The same figure as [`super::non_uniformity::non_uniformity`] by pixel neighbours; `d_grid` is the distance of the points.
    pub fn non_uniformity(
        &self,
        positions: &[Point3],
        sensor: &Point3,
        [normal_radius, mean_radius]: [f64; 2],
        d_grid: f64,
    ) -> NonUniformity {
        let reach = |radius: f64| (MARGIN * radius / d_grid).ceil().clamp(1.0, 1e4) as usize;
        let within = |k: usize, radius: f64| {
            let near = self.around(k, reach(radius));
            near.filter(move |j| (positions[*j] - positions[k]).norm_squared() <= radius * radius)
        };
        let normal = |k: usize| {
            let near: Vec<Vector3> = within(k, normal_radius).map(|j| positions[j] - positions[k]).collect();
            plane_normal(&near, normal_radius, &(sensor - positions[k])).unwrap_or_else(Vector3::zeros)
        };
        let normals: Vec<Vector3> = (0..positions.len()).into_par_iter().map(normal).collect();
        let off = |k: usize| off_the_mean(&normals[k], within(k, mean_radius).map(|j| normals[j]));
        let off: Vec<[f32; 2]> = (0..positions.len()).into_par_iter().map(off).collect();
        let (delta_n, angle_rad) = off.into_iter().map(|[delta, angle]| (delta, angle)).unzip();
        NonUniformity { delta_n, angle_rad, normals }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::non_uniformity::non_uniformity;

    /// A wavy sheet of pitch 1 with holes in it.
    fn sheet() -> (Vec<Point3>, Vec<[u32; 2]>) {
        let place = |row: u32, col: u32| {
            let (x, y) = (f64::from(col), f64::from(row));
            (Point3::new(x, y, (0.3 * x).sin() + 0.05 * ((7.0 * x + 3.0 * y).sin())), [row + 100, col + 7])
        };
        let all = (0..40).flat_map(|row| (0..50).map(move |col| (row, col)));
        all.filter(|(row, col)| (row * 31 + col * 17) % 11 != 0).map(|(row, col)| place(row, col)).unzip()
    }

    /// Every neighbour within the radius is within the reach, so that both ways see the same points; their sums differ by rounding.
    #[test]
    fn pixels_and_places_give_the_same_figure() {
        let (points, pixels) = sheet();
        let sensor = Point3::new(0.0, 0.0, 500.0);
        let by_place = non_uniformity(&points, &sensor, 2.5, 6.0).unwrap();
        let by_pixel = Picture::new(&pixels).unwrap().non_uniformity(&points, &sensor, [2.5, 6.0], 1.0);
        for (a, b) in by_place.delta_n.iter().zip(&by_pixel.delta_n) {
            assert!((a - b).abs() < 1e-5 || (a.is_nan() && b.is_nan()), "{a} {b}");
        }
        assert!(by_place.normals.iter().zip(&by_pixel.normals).all(|(a, b)| (a - b).norm() < 1e-6));
        assert!(by_pixel.delta_n.iter().any(|d| *d > 0.05));
    }

    #[test]
    fn shared_pixels_and_scattered_ones_are_no_picture() {
        assert!(Picture::new(&[[3, 4], [3, 5], [3, 4]]).is_none());
        assert!(Picture::new(&[[0, 0], [100_000, 100_000]]).is_none());
        assert!(Picture::new(&[]).is_none());
    }
}
