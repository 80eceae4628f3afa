//! The steps of noise and density of the endoscope paper's figure 1, on one view: points that stand off are removed, and points that crowd are
//! averaged.

use super::cells::{Cells, TooManyCells};
use super::metric::Metric;
use super::voxel;
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;

/// Values of metrics, one for each point.
type Columns = BTreeMap<Metric, Vec<f32>>;

/// Points between two looks at whether the job was stopped.
const CHUNK: usize = 1 << 14;

/// Which points stay: those whose mean distance to their nearest neighbours is at most `sigmas` standard deviations above the mean of all
/// (statistical outlier removal). All stay where there are not more points than neighbours.
///
/// # Errors
/// The job was stopped.
pub fn statistical_inliers(
    positions: &[Point3],
    neighbours: usize,
    sigmas: f64,
    run: &RunContext,
) -> Result<Vec<bool>, Cancelled> {
    run.check()?;
    let entries: Vec<[f64; 3]> = positions.iter().map(|p| p.coords.into()).collect();
    let tree = (positions.len() > neighbours).then(|| ImmutableKdTree::new_from_slice(&entries));
    // A tree that cannot be built tells nothing of noise.
    let (Some(Ok(tree)), Some(asked)) = (tree, NonZeroUsize::new(neighbours + 1)) else {
        return Ok(vec![true; positions.len()]);
    };
    let mean_distance = |place: &[f64; 3]| {
        let near = tree.query(place).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
        // The point itself is the nearest.
        near.iter().map(|n| n.distance.sqrt()).sum::<f64>() / neighbours as f64
    };
    let chunks: Vec<Vec<f64>> = entries
        .par_chunks(CHUNK)
        .map(|chunk| {
            run.check()?;
            Ok(chunk.iter().map(mean_distance).collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    let distances = chunks.concat();
    let count = distances.len() as f64;
    let mean = distances.iter().sum::<f64>() / count;
    let spread = (distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
    Ok(distances.iter().map(|d| *d <= mean + sigmas * spread).collect())
}

/// The mean of the points in each cell of a cubic grid, cell by cell, and of each of their columns (of the values that are numbers).
///
/// # Errors
/// Points that reach over more than two million cells.
pub fn grid_average(
    positions: &[Point3],
    columns: &Columns,
    side: f64,
) -> Result<(Vec<Point3>, Columns), TooManyCells> {
    let cells = Cells::new(positions, side)?;
    let places = voxel::means(&cells).into_iter().map(|(mean, _)| mean).collect();
    let averaged = |values: &Vec<f32>| {
        let mean = |cell: usize| mean_of_numbers(cells.order[cells.points(cell)].iter().map(|k| values[*k as usize]));
        (0..cells.len()).into_par_iter().map(mean).collect()
    };
    let columns = columns.iter().map(|(metric, values)| (*metric, averaged(values))).collect();
    Ok((places, columns))
}

/// The mean of what is a number; no number where nothing is.
pub(super) fn mean_of_numbers(values: impl Iterator<Item = f32>) -> f32 {
    let known = values.filter(|v| !v.is_nan());
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + f64::from(v), count + 1.0));
    (sum / count) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of pitch 1 and three points off it.
    fn sheet() -> Vec<Point3> {
        let grid = (0..30).flat_map(|x| (0..30).map(move |y| Point3::new(f64::from(x), f64::from(y), 0.0)));
        let off = [[5.0, 5.0, 9.0], [15.5, 15.5, -7.0], [40.0, 40.0, 0.0]].map(Point3::from);
        grid.chain(off).collect()
    }

    #[test]
    fn points_that_stand_off_go_and_the_sheet_stays() {
        let points = sheet();
        let kept = statistical_inliers(&points, 8, 3.0, &RunContext::silent()).unwrap();
        let gone: Vec<usize> = (0..points.len()).filter(|k| !kept[*k]).collect();
        assert_eq!(gone, [900, 901, 902]);
        assert_eq!(statistical_inliers(&points[..8], 8, 3.0, &RunContext::silent()).unwrap(), [true; 8]);
    }

    #[test]
    fn cells_become_the_means_of_their_points_and_columns() {
        let points = [[0.1, 0.1, 0.0], [0.3, 0.5, 0.0], [7.0, 0.0, 0.0]].map(Point3::from);
        let columns = BTreeMap::from([
            (Metric::Strength, vec![1.0, f32::NAN, f32::NAN]),
            (Metric::CalibrationDistance, vec![2.0, 4.0, 5.0]),
        ]);
        let (places, columns) = grid_average(&points, &columns, 1.0).unwrap();
        assert!((places[0] - Point3::new(0.2, 0.3, 0.0)).norm() < 1e-15 && places[1] == points[2]);
        assert_eq!(columns[&Metric::CalibrationDistance], [3.0, 5.0]);
        assert!(columns[&Metric::Strength][0] == 1.0 && columns[&Metric::Strength][1].is_nan());
    }
}
