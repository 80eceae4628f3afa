//! A cloud as a picture, every point in its own colour: which view it came from, how far it is from before.

use crate::geometry::{Point3, Vector3, decompose};
use crate::report::palette::Rgb;
use nalgebra::Matrix3;

/// A picture of points that just holds them.
pub struct CloudPicture {
    /// Pixels a row.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// RGB, row by row from the top.
    pub pixels: Vec<u8>,
    axes: [Vector3; 3],
    corner: [f64; 2],
    px_per_unit: f64,
}

/// Paper where there is no point.
const NOTHING: Rgb = [0xFF, 0xFF, 0xFF];
/// A point covers so many distances of neighbouring points, so that a surface has no holes.
const COVERS: f64 = 1.5;
/// Largest dot, pixels: a few points are dots and no blots.
const LARGEST_DOT: i64 = 9;

impl CloudPicture {
    /// Points seen along the direction in which they reach least, from the side of `eye`; the longest extent lies across. `spacing` is the
    /// distance of neighbouring points. `None` for points in one place or in line.
    pub fn of(
        points: &[Point3],
        colour: impl Fn(usize) -> Rgb,
        eye: &Point3,
        spacing: f64,
        largest_px: [usize; 2],
    ) -> Option<Self> {
        let axes = axes(points, eye)?;
        let places: Vec<[f64; 3]> = points.iter().map(|p| axes.map(|a| a.dot(&p.coords))).collect();
        let end = |axis: usize, pick: fn(f64, f64) -> f64, from: f64| places.iter().map(|p| p[axis]).fold(from, pick);
        let low = [0, 1].map(|axis| end(axis, f64::min, f64::INFINITY));
        let high = [0, 1].map(|axis| end(axis, f64::max, f64::NEG_INFINITY));
        let room = |k: usize| (largest_px[k].saturating_sub(6)) as f64 / (high[k] - low[k]);
        let px_per_unit = room(0).min(room(1));
        if !px_per_unit.is_finite() || px_per_unit <= 0.0 {
            return None;
        }
        let size = |k: usize| ((high[k] - low[k]) * px_per_unit).ceil() as usize + 6;
        let [width_px, height_px] = [size(0), size(1)];
        let corner = [low[0] - 3.0 / px_per_unit, high[1] + 3.0 / px_per_unit];
        let mut picture =
            Self { width_px, height_px, pixels: NOTHING.repeat(width_px * height_px), axes, corner, px_per_unit };
        picture.dots(&places, colour, spacing);
        Some(picture)
    }

    fn dots(&mut self, places: &[[f64; 3]], colour: impl Fn(usize) -> Rgb, spacing: f64) {
        let mut depth = vec![f64::NEG_INFINITY; self.width_px * self.height_px];
        let dot = ((COVERS * spacing * self.px_per_unit).round() as i64).clamp(1, LARGEST_DOT);
        for (k, [right, up, near]) in places.iter().enumerate() {
            let (x, y) = ((right - self.corner[0]) * self.px_per_unit, (self.corner[1] - up) * self.px_per_unit);
            let rgb = colour(k);
            for row in (y as i64 - dot / 2)..(y as i64 - dot / 2 + dot) {
                for column in (x as i64 - dot / 2)..(x as i64 - dot / 2 + dot) {
                    let inside =
                        (0..self.width_px as i64).contains(&column) && (0..self.height_px as i64).contains(&row);
                    let at = row * self.width_px as i64 + column;
                    // Of points in one place the last one in the list is seen, whatever drew first.
                    if inside && depth[at as usize] <= *near {
                        depth[at as usize] = *near;
                        self.pixels[3 * at as usize..3 * at as usize + 3].copy_from_slice(&rgb);
                    }
                }
            }
        }
    }

    /// Pixels that a length of one takes, across the line of sight.
    pub fn px_per_unit(&self) -> f64 {
        self.px_per_unit
    }

    /// Pixels from the left and from the top of a point.
    pub fn place_px(&self, point: &Point3) -> [f64; 2] {
        let [right, up] = [0, 1].map(|k| self.axes[k].dot(&point.coords));
        [(right - self.corner[0]) * self.px_per_unit, (self.corner[1] - up) * self.px_per_unit]
    }
}

/// Right, up, towards the eye.
fn axes(points: &[Point3], eye: &Point3) -> Option<[Vector3; 3]> {
    let count = points.len() as f64;
    let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / count;
    let spread: Matrix3<f64> = points.iter().map(|p| (p.coords - middle) * (p.coords - middle).transpose()).sum();
    if points.len() < 3 || spread.trace() <= 0.0 {
        return None;
    }
    let eigen = decompose::symmetric_eigen(spread / spread.trace())?;
    let column = |k: usize| -> Vector3 { eigen.eigenvectors.column(k).into_owned() };
    let towards = column(eigen.eigenvalues.imin());
    let towards = if towards.dot(&(eye.coords - middle)) < 0.0 { -towards } else { towards };
    let along = column(eigen.eigenvalues.imax());
    let right = if along[along.iamax()] < 0.0 { -along } else { along };
    Some([right, towards.cross(&right), towards])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_where_they_are_drawn_and_near_ones_hide_far_ones() {
        let mut points: Vec<Point3> =
            (0..40).flat_map(|x| (0..20).map(move |y| Point3::new(f64::from(x), f64::from(y), 0.0))).collect();
        let back = points.len();
        points.push(Point3::new(10.0, 10.0, -1.0));
        let colour = |k: usize| if k == back { [255, 0, 0] } else { [0, 0, (k % 200) as u8] };
        let picture = CloudPicture::of(&points, colour, &Point3::new(20.0, 10.0, 90.0), 1.0, [400, 300]).unwrap();
        assert!(picture.width_px <= 400 && picture.width_px > 390 && picture.height_px > 190, "long side across");
        for k in [0, 57, 333, 799] {
            let [x, y] = picture.place_px(&points[k]);
            let at = 3 * (y as usize * picture.width_px + x as usize);
            assert_eq!(picture.pixels[at..at + 3], [0, 0, (k % 200) as u8], "point {k}");
        }
        assert!(picture.pixels.chunks(3).all(|rgb| rgb != [255, 0, 0]), "hidden");
        assert!(CloudPicture::of(&[Point3::origin(); 9], |_| NOTHING, &Point3::origin(), 1.0, [9, 9]).is_none());
    }
}
