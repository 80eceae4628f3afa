//! Stray points: what is left after the filters but lies far from anything that can be the part.
//!
//! A raster of cells; cells with as many points as a surface would put there form components; components with a fair share
//! of the points are the body (dropout may split a part into several). What lies farther from the body than a tenth of the
//! part's diagonal is stray, whatever it is. Single noise points near the part stay: the alignment is robust.

use super::neighbourhood::{CHUNK, stratified};
use crate::fit::robust::quantile;
use crate::geometry::{Point3, Vector3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Cells in all, at most.
const MOST_CELLS: f64 = 5e5;
/// Share of the points in surface cells that makes a component a part of the body.
const BODY_SHARE: f64 = 0.01;

/// Which points are far from the body, and how large the body is.
pub(super) struct Components {
    /// Indices of the stray points, ascending.
    pub stray: Vec<u32>,
    /// Points in the surface cells of the body.
    pub body_points: usize,
}

/// Finds the body of the points named by `kept` and the points farther from it than `reach_mm`.
///
/// `part_mm` is the part's diagonal: the raster goes that far beyond the bulk of the points, the rest is stray unseen.
pub(super) fn components(
    positions: &[Point3],
    kept: &[u32],
    spacing_mm: f64,
    reach_mm: f64,
    part_mm: f64,
) -> Components {
    let Some(raster) = Raster::around(positions, kept, spacing_mm, reach_mm, part_mm) else {
        return Components { stray: Vec::new(), body_points: 0 };
    };
    let counts = raster.count(positions, kept);
    // A cell that a surface crosses fully holds (cell / spacing)² points; a quarter of it is enough.
    let expected = (raster.cell_mm / spacing_mm).powi(2);
    let least = (0.25 * expected).max(3.0) as u32;
    let (mut near_body, body_points) = raster.body(&counts, least);
    raster.widen(&mut near_body, (reach_mm / raster.cell_mm).ceil() as usize);
    let stray: Vec<Vec<u32>> = kept
        .par_chunks(CHUNK)
        .map(|chunk| {
            let is_stray = |&&k: &&u32| raster.cell(&positions[k as usize]).is_none_or(|cell| near_body[cell] == 0);
            chunk.iter().filter(is_stray).copied().collect()
        })
        .collect();
    Components { stray: stray.concat(), body_points }
}

struct Raster {
    low: Point3,
    cell_mm: f64,
    cells_per_mm: f64,
    size: [usize; 3],
}

impl Raster {
    fn around(positions: &[Point3], kept: &[u32], spacing_mm: f64, reach_mm: f64, part_mm: f64) -> Option<Self> {
        let sample = stratified(kept.len(), 20_000, 7);
        if sample.is_empty() {
            return None;
        }
        let margin_mm = reach_mm.max(0.5 * part_mm);
        let (mut low, mut high) = (Point3::origin(), Point3::origin());
        for axis in 0..3 {
            let mut values: Vec<f64> = sample.iter().map(|&k| positions[kept[k as usize] as usize][axis]).collect();
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            low[axis] = least.max(quantile(&mut values, 0.002)? - margin_mm) - reach_mm;
            high[axis] = most.min(quantile(&mut values, 0.998)? + margin_mm) + reach_mm;
        }
        let extent: Vector3 = high - low;
        let mut cell_mm = (4.0 * spacing_mm).max(2.0);
        let cells = |cell_mm: f64| -> f64 { extent.iter().map(|e| (e / cell_mm).floor() + 1.0).product() };
        while cells(cell_mm) > MOST_CELLS {
            cell_mm *= 1.2;
        }
        let size = [0, 1, 2].map(|axis| (extent[axis] / cell_mm).floor() as usize + 1);
        Some(Self { low, cell_mm, cells_per_mm: 1.0 / cell_mm, size })
    }

    fn cell(&self, point: &Point3) -> Option<usize> {
        let mut index = 0;
        for axis in (0..3).rev() {
            let place = (point[axis] - self.low[axis]) * self.cells_per_mm;
            if !(place >= 0.0 && place < self.size[axis] as f64) {
                return None;
            }
            index = index * self.size[axis] + place as usize;
        }
        Some(index)
    }

    fn cells(&self) -> usize {
        self.size.iter().product()
    }

    fn count(&self, positions: &[Point3], kept: &[u32]) -> Vec<u32> {
        let counts: Vec<AtomicU32> = (0..self.cells()).map(|_| AtomicU32::new(0)).collect();
        kept.par_chunks(CHUNK).for_each(|chunk| {
            for &k in chunk {
                if let Some(cell) = self.cell(&positions[k as usize]) {
                    counts[cell].fetch_add(1, Ordering::Relaxed);
                }
            }
        });
        counts.into_iter().map(AtomicU32::into_inner).collect()
    }

    /// Marks the cells of the body with 1 and counts its points. Cells that touch, corners included, belong together.
    fn body(&self, counts: &[u32], least: u32) -> (Vec<u8>, usize) {
        let mut component = vec![u32::MAX; counts.len()];
        let mut sizes: Vec<usize> = Vec::new();
        let mut waiting = Vec::new();
        for start in 0..counts.len() {
            if counts[start] < least || component[start] != u32::MAX {
                continue;
            }
            let label = sizes.len() as u32;
            let mut points = 0;
            component[start] = label;
            waiting.push(start);
            while let Some(cell) = waiting.pop() {
                points += counts[cell] as usize;
                self.for_each_neighbour(cell, |other| {
                    if counts[other] >= least && component[other] == u32::MAX {
                        component[other] = label;
                        waiting.push(other);
                    }
                });
            }
            sizes.push(points);
        }
        let all: usize = sizes.iter().sum();
        let is_body: Vec<bool> = sizes.iter().map(|&points| points as f64 >= BODY_SHARE * all as f64).collect();
        let marks = component.iter().map(|&label| u8::from(label != u32::MAX && is_body[label as usize])).collect();
        let body_points = sizes.iter().zip(&is_body).filter(|(_, body)| **body).map(|(points, _)| points).sum();
        (marks, body_points)
    }

    fn for_each_neighbour(&self, cell: usize, mut visit: impl FnMut(usize)) {
        let [nx, ny, nz] = self.size;
        let (x, y, z) = (cell % nx, cell / nx % ny, cell / (nx * ny));
        for k in z.saturating_sub(1)..(z + 2).min(nz) {
            for j in y.saturating_sub(1)..(y + 2).min(ny) {
                for i in x.saturating_sub(1)..(x + 2).min(nx) {
                    visit((k * ny + j) * nx + i);
                }
            }
        }
    }

    /// Widens the marked cells by `reach` cells along each axis.
    fn widen(&self, marks: &mut [u8], reach: usize) {
        let mut stride = 1;
        for axis in 0..3 {
            let length = self.size[axis];
            let mut line = vec![0u8; length];
            for start in 0..marks.len() {
                if start / stride % length != 0 {
                    continue;
                }
                // Distance to the last mark on either side.
                let mut since = usize::MAX;
                for (place, wide) in line.iter_mut().enumerate() {
                    since = if marks[start + place * stride] == 1 { 0 } else { since.saturating_add(1) };
                    *wide = u8::from(since <= reach);
                }
                since = usize::MAX;
                for place in (0..length).rev() {
                    since = if marks[start + place * stride] == 1 { 0 } else { since.saturating_add(1) };
                    line[place] |= u8::from(since <= reach);
                }
                for (place, wide) in line.iter().enumerate() {
                    marks[start + place * stride] = *wide;
                }
            }
            stride *= length;
        }
    }
}
