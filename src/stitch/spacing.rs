//! The distance of a cloud's points: d_grid, by which merging radii are told.

use super::cells::{Cells, TooManyCells};
use crate::fit::robust::median;
use crate::geometry::Point3;
use rayon::prelude::*;

/// Looks, each at the surroundings of about so many points: the first ones only find the scale, as it may be far off at first.
const LOOKS: [usize; 5] = [500, 500, 500, 20_000, 20_000];
/// Radius of the surroundings in distances of points: on a grid the weights' sum is then that of the area to a thousandth, and of points
/// that lie by chance the one in the middle, which is always there, makes no more than a fortieth.
const RADIUS_GRID: f64 = 6.0;
/// Integral of the weights over a disc of radius 1.
const AREA_OF_WEIGHTS: f64 = std::f64::consts::PI / 3.0;

/// The distance d_grid of points on a surface, `1 / sqrt(median local density)`, in their unit: the side of the square that a point stands
/// for. Of a square grid that is its pitch, of a hexagonal one 0.93 of the distance of neighbours. `None` for fewer than ten points, or
/// points in one place.
///
/// The density about a point is the sum of weights `(1 - r² / R²)²` of the points within R of it, itself too, over the weights' integral.
/// Weights that end softly do not jump as rows of a grid come in, as a count in a disc would. Rims do not matter where fewer than
/// half of the points lie within R of one.
///
/// # Errors
/// Points that reach over more than two million distances.
pub fn grid_distance(positions: &[Point3]) -> Result<Option<f64>, TooManyCells> {
    let Some(mut distance) = rough_distance(positions) else { return Ok(None) };
    for looked_at in LOOKS {
        let radius = RADIUS_GRID * distance;
        let Some(middle) = median(&mut sums_of_weights(positions, radius, looked_at)?) else { return Ok(None) };
        distance = radius * (AREA_OF_WEIGHTS / middle).sqrt();
    }
    Ok(Some(distance))
}

/// Of about as many points as `looked_at` the weights of all within a radius.
fn sums_of_weights(positions: &[Point3], radius: f64, looked_at: usize) -> Result<Vec<f64>, TooManyCells> {
    let cells = Cells::new(positions, radius)?;
    let step = positions.len().div_ceil(looked_at).max(1);
    let of_cell = |(cell, around): (usize, super::cells::Around)| -> Vec<f64> {
        let weight = |from: usize, to: usize| {
            let inside = 1.0 - (cells.positions[to] - cells.positions[from]).norm_squared() / (radius * radius);
            if inside > 0.0 { inside * inside } else { 0.0 }
        };
        let chosen = cells.points(cell).filter(|k| k % step == 0);
        chosen.map(|k| around.points().map(|j| weight(k, j)).sum()).collect()
    };
    Ok(cells.walk(0).collect::<Vec<_>>().into_par_iter().flat_map_iter(of_cell).collect())
}

/// By the area of the three sides of the box: of a sheet the right order of size.
fn rough_distance(positions: &[Point3]) -> Option<f64> {
    const LEAST: usize = 10;
    let bounds = crate::geometry::Aabb::of_points(positions.iter()).filter(|_| positions.len() >= LEAST)?;
    let mut sides: [f64; 3] = bounds.extents().into();
    sides.sort_by(f64::total_cmp);
    let area = sides[2] * sides[1].max(sides[2] / positions.len() as f64);
    Some((area / positions.len() as f64).sqrt()).filter(|d| *d > 0.0 && d.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;
    use nalgebra::Rotation3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Flat, and on a cylinder of a hundred pitches; turned, so that rows lie along no axis.
    fn sheets(pitch: f64, places: &[[f64; 2]]) -> [Vec<Point3>; 2] {
        let turn = Rotation3::new(Vector3::new(0.3, -0.8, 0.4));
        let radius = 100.0 * pitch;
        let round = |[u, v]: [f64; 2]| Point3::new(radius * (u / radius).sin(), v, radius * (u / radius).cos());
        let flat = places.iter().map(|[u, v]| turn * Point3::new(*u, *v, 0.0)).collect();
        [flat, places.iter().map(|place| turn * round(*place)).collect()]
    }

    /// Places of 120 x 100 points, `down` each row and `shift` every second one.
    fn grid(pitch: f64, down: f64, shift: f64) -> Vec<[f64; 2]> {
        let place = |k: usize, l: usize| [pitch * (l as f64 + shift * (k % 2) as f64), pitch * down * k as f64];
        (0..120).flat_map(|k| (0..100).map(move |l| place(k, l))).collect()
    }

    /// By Poisson's formula the sum of the weights over a grid of pitch 1 is their integral times 1 + sum of 48 J3(kR) / (kR)³ over all
    /// k of the reciprocal grid. With |J3(x)| at most sqrt(2 / (pi x)) and R = 6 each of the four nearest, |k| = 2 pi, gives 1.2e-4, and all of
    /// them, as |k|^-3.5, 6.9 times that: 8e-4, half of which in the distance. The cylinder's chords are shorter than its arcs by
    /// 36 / 240 000.
    const OF_A_GRID: f64 = 4.5e-4;

    #[test]
    fn the_pitch_of_a_grid_is_found_on_flat_and_round_sheets() {
        for pitch in [0.01, 0.5, 40.0] {
            for points in sheets(pitch, &grid(pitch, 1.0, 0.0)) {
                let found = grid_distance(&points).unwrap().unwrap();
                assert!((found / pitch - 1.0).abs() < OF_A_GRID, "{found} of {pitch}");
            }
        }
    }

    /// Each stands for a rhombus of sqrt(3) / 2 of the square of the neighbours' distance. The reciprocal grid's nearest are at 2 pi / 0.866, six.
    #[test]
    fn a_hexagonal_grid_has_the_side_of_the_square_of_its_area() {
        let down = 0.75_f64.sqrt();
        for points in sheets(0.2, &grid(0.2, down, 0.5)) {
            let found = grid_distance(&points).unwrap().unwrap();
            assert!((found / (0.2 * down.sqrt()) - 1.0).abs() < OF_A_GRID, "{found}");
        }
    }

    /// The point in the middle is always there: 1 of 36 pi / 3 = 37.7, which is 1.3 % of the distance. The sum of weights is of about 23
    /// points with a skew of some tenths: its median lies below the mean by a sixth of that, in standard deviations of 12 %, at most 1 %.
    #[test]
    fn points_that_lie_by_chance_have_theirs_to_two_per_cent() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut draw = |side: f64| random.random_range(0.0..side);
        let places: Vec<[f64; 2]> = (0..12_000).map(|_| [draw(120.0), draw(100.0)]).collect();
        for points in sheets(1.0, &places) {
            let found = grid_distance(&points).unwrap().unwrap();
            assert!((found - 1.0).abs() < 0.02, "{found}");
        }
    }

    /// A point a hundred sizes away makes the first look a hundred times too wide.
    #[test]
    fn a_point_far_away_changes_nothing() {
        let [mut points, _] = sheets(0.5, &grid(0.5, 1.0, 0.0));
        points.push(Point3::new(6000.0, 6000.0, 6000.0));
        let found = grid_distance(&points).unwrap().unwrap();
        assert!((found / 0.5 - 1.0).abs() < OF_A_GRID, "{found}");
    }

    #[test]
    fn too_few_points_and_points_in_one_place_have_none() {
        assert_eq!(grid_distance(&[Point3::origin(); 5]).unwrap(), None);
        assert_eq!(grid_distance(&[Point3::origin(); 50]).unwrap(), None);
    }
}
