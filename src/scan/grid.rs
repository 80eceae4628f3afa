//! Points near a place: the kept points of a scan sorted into cubic cells.
//!
//! A counting sort over a dense block of cells: one pass to number the cells, one to count, one to place. Within a cell the
//! points stay in the scan's order, so answers do not depend on the number of threads.

use super::ConditionedScan;
use crate::geometry::{Aabb, Point3};
use rayon::prelude::*;

/// Most cells a grid has; a larger box gets larger cells.
const MAX_CELLS: f64 = 4_000_000.0;
/// Points numbered by one task.
const CHUNK: usize = 1 << 15;

/// The kept points of a scan in cells, scan frame.
#[derive(Debug, Clone)]
pub struct PointGrid {
    low: Point3,
    cell_mm: f64,
    cells: [usize; 3],
    /// First entry of each cell, and one past the last.
    starts: Vec<u32>,
    /// Index into the cloud and position, cell by cell.
    entries: Vec<(u32, Point3)>,
}

impl PointGrid {
    /// Sorts the kept points into cells of about that size (larger where the block would have too many cells; 1 mm when
    /// the size is not positive).
    pub fn build(scan: &ConditionedScan, cell_mm: f64) -> Self {
        let positions = &scan.cloud.positions;
        let bounds =
            scan.kept.par_chunks(CHUNK).filter_map(|c| Aabb::of_points(c.iter().map(|&i| &positions[i as usize])));
        let bounds = bounds.reduce_with(|a, b| Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) });
        let Some(bounds) = bounds else {
            return Self { low: Point3::origin(), cell_mm: 1.0, cells: [0; 3], starts: vec![0], entries: Vec::new() };
        };
        let extents = bounds.extents();
        let mut cell_mm = if cell_mm > 0.0 { cell_mm } else { 1.0 };
        while extents.iter().map(|e| (e / cell_mm).floor() + 1.0).product::<f64>() > MAX_CELLS {
            cell_mm *= 1.25;
        }
        let cells: [usize; 3] = std::array::from_fn(|k| (extents[k] / cell_mm) as usize + 1);
        let mut grid = Self { low: bounds.min, cell_mm, cells, starts: Vec::new(), entries: Vec::new() };
        grid.sort(&scan.kept, positions);
        grid
    }

    fn sort(&mut self, kept: &[u32], positions: &[Point3]) {
        let mut cell_of = vec![0_u32; kept.len()];
        cell_of.par_chunks_mut(CHUNK).zip(kept.par_chunks(CHUNK)).for_each(|(cells, kept)| {
            for (cell, &i) in cells.iter_mut().zip(kept) {
                *cell = self.flat(self.cell_at(&positions[i as usize])) as u32;
            }
        });
        let mut starts = vec![0_u32; self.cells.iter().product::<usize>() + 1];
        for &cell in &cell_of {
            starts[cell as usize + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, Point3::origin()); kept.len()];
        for (&cell, &i) in cell_of.iter().zip(kept) {
            let place = &mut next[cell as usize];
            entries[*place as usize] = (i, positions[i as usize]);
            *place += 1;
        }
        self.starts = starts;
        self.entries = entries;
    }

    /// Cell of a place, clamped to the block.
    fn cell_at(&self, p: &Point3) -> [usize; 3] {
        // A negative or NaN quotient casts to 0.
        std::array::from_fn(|k| (((p[k] - self.low[k]) / self.cell_mm) as usize).min(self.cells[k] - 1))
    }

    fn flat(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.cells[1] + cell[1]) * self.cells[0] + cell[0]
    }

    /// How many points the grid holds.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Calls `visit` with index and position (scan frame) of each point within `radius_mm` of a place, cell by cell: the
    /// same order every time, but not ascending.
    pub fn for_each_in_sphere(&self, centre_scan: &Point3, radius_mm: f64, mut visit: impl FnMut(u32, &Point3)) {
        if self.is_empty() || radius_mm.is_nan() || radius_mm < 0.0 {
            return;
        }
        let reach = nalgebra::Vector3::repeat(radius_mm);
        let (first, last) = (self.cell_at(&(centre_scan - reach)), self.cell_at(&(centre_scan + reach)));
        let radius_sq = radius_mm * radius_mm;
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                // Cells of a row follow each other, so a row is one run of entries.
                let run = self.starts[self.flat([first[0], y, z])]..self.starts[self.flat([last[0], y, z]) + 1];
                for (index, p) in &self.entries[run.start as usize..run.end as usize] {
                    if nalgebra::distance_squared(p, centre_scan) <= radius_sq {
                        visit(*index, p);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PointCloud;
    use crate::scan::{PointClass, Removed};
    use rand::{RngExt, SeedableRng};

    fn scan_of(positions: Vec<Point3>, kept: Vec<u32>) -> ConditionedScan {
        ConditionedScan {
            classes: vec![PointClass::Kept; positions.len()],
            cloud: PointCloud { positions, ..PointCloud::default() },
            kept,
            removed: Removed::default(),
            belt: None,
            belt_clearance_mm: None,
            to_camera: None,
            spacing_mm: 1.0,
            warnings: Vec::new(),
        }
    }

    /// Indices of the points within `radius_mm` of a place, ascending.
    fn in_sphere(grid: &PointGrid, centre: &Point3, radius_mm: f64) -> Vec<u32> {
        let mut found = Vec::new();
        grid.for_each_in_sphere(centre, radius_mm, |index, _| found.push(index));
        found.sort_unstable();
        found
    }

    #[test]
    fn finds_what_a_full_search_finds() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let positions: Vec<Point3> = (0..3000)
            .map(|_| {
                Point3::new(rng.random_range(-40.0..60.0), rng.random_range(5.0..35.0), rng.random_range(-3.0..3.0))
            })
            .collect();
        let kept: Vec<u32> = (0..3000).filter(|i| i % 3 != 0).collect();
        let scan = scan_of(positions, kept);
        let grid = PointGrid::build(&scan, 2.5);
        assert_eq!(grid.len(), scan.kept.len());
        for k in 0..200 {
            let centre = Point3::new(-60.0 + k as f64, 20.0, 0.5 * k as f64 - 50.0);
            let radius = 0.3 * f64::from(k % 60);
            let expected: Vec<u32> = (scan.kept.iter().copied())
                .filter(|&i| nalgebra::distance_squared(&scan.cloud.positions[i as usize], &centre) <= radius * radius)
                .collect();
            assert_eq!(in_sphere(&grid, &centre, radius), expected);
        }
    }

    #[test]
    fn no_points_and_a_stray_far_away() {
        let empty = PointGrid::build(&scan_of(Vec::new(), Vec::new()), 1.0);
        assert!(in_sphere(&empty, &Point3::origin(), 1e9).is_empty() && empty.is_empty());
        let far = PointGrid::build(&scan_of(vec![Point3::origin(), Point3::new(1e6, 1e6, 1e6)], vec![0, 1]), 0.1);
        assert_eq!(in_sphere(&far, &Point3::new(1e6, 1e6, 1e6 - 0.5), 1.0), [1]);
        assert!(in_sphere(&far, &Point3::new(f64::NAN, 0.0, 0.0), 1.0).is_empty());
    }
}
