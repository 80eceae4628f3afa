//! The plain average of all points in each cell of a cubic grid, to compare adaptive merging with.

use super::cells::{Cells, TooManyCells};
use crate::geometry::{Point3, Vector3};
use rayon::prelude::*;

/// The mean of each cell's points, cell by cell, with how many there are. Each cell sums in the order of the points given, so that views
/// in their order give the same bytes with any number of threads.
///
/// # Errors
/// Points that reach over more than two million cells.
pub fn voxel_means(positions: &[Point3], side: f64) -> Result<Vec<(Point3, u32)>, TooManyCells> {
    Ok(means(&Cells::new(positions, side)?))
}

/// The same of points that are sorted already.
pub(super) fn means(cells: &Cells) -> Vec<(Point3, u32)> {
    let mean = |cell: usize| {
        let points = &cells.positions[cells.points(cell)];
        // From the first point on, so that no digits are lost far out.
        let sum: Vector3 = points.iter().map(|p| p - points[0]).sum();
        (points[0] + sum / points.len() as f64, points.len() as u32)
    };
    (0..cells.len()).into_par_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_counts_once_in_the_mean_of_its_cell() {
        let points = [[0.1, 0.2, 0.0], [0.3, 0.4, 0.0], [5.0, 0.0, 0.0], [0.2, 0.6, 0.3]].map(Point3::from);
        let means = voxel_means(&points, 1.0).unwrap();
        assert_eq!(means.iter().map(|(_, n)| *n).sum::<u32>(), 4);
        let (mean, count) = means[0];
        assert!(count == 3 && (mean - Point3::new(0.2, 0.4, 0.1)).norm() < 1e-15, "{means:?}");
        assert!(voxel_means(&[], 1.0).unwrap().is_empty());
    }
}
