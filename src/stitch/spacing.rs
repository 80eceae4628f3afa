//! The distance of a cloud's points: d_grid, by which merging radii are told.

use super::cells::{Cells, TooManyCells};
use crate::fit::robust::median;
use crate::geometry::Point3;
use rayon::prelude::*;

/// Points whose surroundings are counted.
const LOOKED_AT: usize = 20_000;
/// Points that a disc should hold so that its count tells a density to a fifth.
const WANTED: f64 = 25.0;

/// The distance d_grid of points on a surface, `1 / sqrt(median local density)`, in their unit: the side of the square that a point stands
/// for. `None` for fewer than ten points, or points in one place.
///
/// # Errors
/// Points that reach over more than two million distances.
pub fn grid_distance(positions: &[Point3]) -> Result<Option<f64>, TooManyCells> {
    let Some(mut distance) = rough_distance(positions) else { return Ok(None) };
    // The radius is that of the wanted count by the last distance; a second look settles it.
    for _ in 0..3 {
        let radius = distance * (WANTED / std::f64::consts::PI).sqrt();
        let cells = Cells::new(positions, radius)?;
        let step = positions.len().div_ceil(LOOKED_AT).max(1);
        let count = |(cell, around): (usize, super::cells::Around)| -> Vec<f64> {
            let looked_at = cells.points(cell).filter(|k| k % step == 0);
            let near = |k: usize| {
                let within = |j: &usize| (cells.positions[*j] - cells.positions[k]).norm_squared() <= radius * radius;
                around.points().filter(within).count() as f64
            };
            looked_at.map(near).collect()
        };
        let mut counts: Vec<f64> = cells.walk(0).collect::<Vec<_>>().into_par_iter().flat_map_iter(count).collect();
        let Some(middle) = median(&mut counts) else { return Ok(None) };
        distance = radius * (std::f64::consts::PI / middle).sqrt();
    }
    Ok(Some(distance))
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

    #[test]
    fn the_pitch_of_a_grid_is_found_on_flat_and_round_sheets() {
        for pitch in [0.01, 0.5, 40.0] {
            let turn = Rotation3::new(Vector3::new(0.3, -0.8, 0.4));
            let place = |k: usize, l: usize| {
                let (u, v) = (k as f64 * pitch, l as f64 * pitch);
                let radius = 100.0 * pitch;
                let flat = Point3::new(u, v, 0.0);
                let round = Point3::new(radius * (u / radius).sin(), v, radius * (u / radius).cos());
                [turn * flat, turn * round]
            };
            let grid: Vec<[Point3; 2]> = (0..120).flat_map(|k| (0..100).map(move |l| place(k, l))).collect();
            for which in 0..2 {
                let points: Vec<Point3> = grid.iter().map(|p| p[which]).collect();
                let found = grid_distance(&points).unwrap().unwrap();
                // A disc of 25 points holds 21 to 29 of a grid's, as its edge falls between rows.
                assert!((found / pitch - 1.0).abs() < 0.08, "{found} of {pitch}");
            }
        }
    }

    #[test]
    fn too_few_points_and_points_in_one_place_have_none() {
        assert_eq!(grid_distance(&[Point3::origin(); 5]).unwrap(), None);
        assert_eq!(grid_distance(&[Point3::origin(); 50]).unwrap(), None);
    }
}
