//! Which face of a solid was seen, when nobody knows where the camera stood: the one that the points fit better.
//!
//! The two faces are the same but for a shift wherever the sheet is flat; only flanges, bends and beads tell them apart, by less
//! than the thickness. Points scatter by as much, but not together: the mean of a cell's heights hardly scatters, and a face that is
//! not the one seen leaves its cells standing off.

use super::evidence::RESIDUAL_LIMIT_MM;
use crate::geometry::{Isometry3, Point3};
use crate::part::Face;
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Points looked at: forty or so in each of the cells of a bent part, which leave of a scatter of 0.12 mm 0.02 mm.
pub(super) const FACE_POINTS: usize = 20_000;
/// Edge of a cell over the cloud's diagonal.
const CELL_SHARE: f64 = 0.05;
/// Points that a cell needs to have a mean.
const LEAST_POINTS: u32 = 8;
/// Mean heights below this tell nothing: what the scatter leaves of them, and the facets of the CAD's curves, mm.
const FLOOR_MM: f64 = 0.03;

/// Signed heights of points over a face, mm, positive outside; NaN beyond what can belong to it or past its edges.
pub(super) fn heights(face: &Face, points: &[Point3], pose: &Isometry3) -> Vec<f64> {
    let height = |p: &Point3| face.closest(&(pose * p), RESIDUAL_LIMIT_MM).filter(|hit| !hit.on_boundary);
    points.iter().map(|p| height(p).map_or(f64::NAN, |hit| hit.signed_mm)).collect()
}

/// Which of two faces explains the same points better (`Less`: the first): mean squares of the cells' mean heights over them that
/// differ by a factor of at least `margin`. `None` where neither does. Springback adds to both and brings the factor nearer to one.
pub(super) fn better(places: &[Point3], first: &[f64], second: &[f64], margin: f64) -> Option<Ordering> {
    let factor = mean_square(places, second, first) / mean_square(places, first, second);
    match factor {
        factor if factor >= margin => Some(Ordering::Less),
        factor if factor * margin <= 1.0 => Some(Ordering::Greater),
        _ => None,
    }
}

/// Mean square of the mean heights of cells, on points that have a height over both faces, each cell by its points; with the floor.
fn mean_square(places: &[Point3], heights: &[f64], others: &[f64]) -> f64 {
    let (low, high) = places
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (p.coords.min().min(low), p.coords.max().max(high)));
    let cell_mm = (CELL_SHARE * (high - low)).max(f64::MIN_POSITIVE);
    let mut cells: BTreeMap<[i64; 3], (f64, u32)> = BTreeMap::new();
    for ((place, height), other) in places.iter().zip(heights).zip(others) {
        if height.is_finite() && other.is_finite() {
            let cell = cells.entry([0, 1, 2].map(|k| (place[k] / cell_mm).floor() as i64)).or_default();
            *cell = (cell.0 + height, cell.1 + 1);
        }
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for (total, points) in cells.values().filter(|(_, points)| *points >= LEAST_POINTS) {
        sum += total * total / f64::from(*points);
        count += f64::from(*points);
    }
    FLOOR_MM * FLOOR_MM + sum / f64::max(count, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 100 mm, 20 points to a cell, with heights of its own and ones that scatter.
    fn square(height: impl Fn(&Point3) -> f64) -> (Vec<Point3>, Vec<f64>) {
        let places: Vec<Point3> =
            (0..8000).map(|k| Point3::new(f64::from(k % 90) * 1.11, f64::from(k / 90) * 1.12, 0.0)).collect();
        let scatter = |k: usize| 0.12 * [1.2, -0.7, 0.3, -1.1, 0.9, -0.6][k % 6];
        let heights = places.iter().enumerate().map(|(k, p)| height(p) + scatter(k)).collect();
        (places, heights)
    }

    /// A flank on a tenth of the part that stands 0.3 mm off decides, though the scatter's squares are twice that share's.
    #[test]
    fn scatter_does_not_hide_a_flank_that_stands_off() {
        let (places, seen) = square(|_| 0.0);
        let (_, other) = square(|p| if p.x < 10.0 { 0.3 } else { 0.0 });
        assert_eq!(better(&places, &seen, &other, 1.5), Some(Ordering::Less));
        assert_eq!(better(&places, &other, &seen, 1.5), Some(Ordering::Greater));
    }

    #[test]
    fn alike_faces_and_sprung_parts_decide_nothing() {
        let (places, seen) = square(|_| 0.0);
        let (_, alike) = square(|_| 1e-6);
        assert_eq!(better(&places, &seen, &alike, 1.5), None);
        let (_, sprung) = square(|p| 0.4 * (p.y / 25.0).sin());
        let (_, other) = square(|p| 0.4 * (p.y / 25.0).sin() + if p.x < 10.0 { 0.3 } else { 0.0 });
        assert_eq!(better(&places, &sprung, &other, 1.5), None);
        assert_eq!(better(&places, &[f64::NAN; 8000], &[f64::NAN; 8000], 1.5), None);
    }
}
