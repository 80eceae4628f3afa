//! A coarse height map of the kept points, seen along z of the work frame, that tells the distance to the nearest data.

use crate::geometry::Point3;

/// Where a raster lies in the xy plane of the work frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Raster {
    /// Corner with the lowest coordinates.
    pub x0: f64,
    /// Corner with the lowest coordinates.
    pub y0: f64,
    /// Edge of a cell, mm.
    pub cell_mm: f64,
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
}

/// Cells of a raster, about, at the most.
const MOST_CELLS: f64 = 2e6;

impl Raster {
    /// A raster over the bulk of the points: half a percent at each end may lie outside, and a margin is added.
    pub fn over(points: &[Point3], cell_mm: f64, margin_mm: f64, longest_mm: f64) -> Self {
        let range = |axis: usize| {
            let picks = super::sampling::spread(points.len(), 10_001);
            let mut values: Vec<f64> = picks.iter().map(|&k| points[k as usize][axis]).collect();
            values.sort_unstable_by(f64::total_cmp);
            let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
            let (low, middle, high) = (at(0.005), at(0.5), at(0.995));
            (low.max(middle - longest_mm) - margin_mm, high.min(middle + longest_mm) + margin_mm)
        };
        let ((x0, x1), (y0, y1)) = (range(0), range(1));
        // A part of many metres, or one in the wrong unit, gets coarser cells, not more memory.
        let cell_mm = cell_mm.max(((x1 - x0) * (y1 - y0) / MOST_CELLS).sqrt()).max((x1 - x0).max(y1 - y0) / MOST_CELLS);
        let cells = |low: f64, high: f64| (((high - low) / cell_mm).ceil() as usize).max(1);
        Self { x0, y0, cell_mm, nx: cells(x0, x1), ny: cells(y0, y1) }
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.nx * self.ny
    }

    /// The cell under a place; `None` outside.
    pub fn index(&self, x: f64, y: f64) -> Option<usize> {
        let (i, j) = ((x - self.x0) / self.cell_mm, (y - self.y0) / self.cell_mm);
        if i < 0.0 || j < 0.0 || i >= self.nx as f64 || j >= self.ny as f64 {
            return None;
        }
        Some(j as usize * self.nx + i as usize)
    }

    /// Middle of a cell.
    pub fn middle(&self, index: usize) -> (f64, f64) {
        let (i, j) = (index % self.nx, index / self.nx);
        (self.x0 + (i as f64 + 0.5) * self.cell_mm, self.y0 + (j as f64 + 0.5) * self.cell_mm)
    }
}

/// The count in the cell where the median point lies: the usual number of points in a filled cell, whatever the number of
/// sparse cells that outliers make.
pub(super) fn usual_count(counts: &[u32]) -> f64 {
    let mut sorted: Vec<u32> = counts.iter().copied().filter(|&c| c > 0).collect();
    sorted.sort_unstable();
    let total: u64 = sorted.iter().map(|&c| u64::from(c)).sum();
    let mut seen = 0;
    for &c in &sorted {
        seen += u64::from(c);
        if 2 * seen >= total {
            return f64::from(c);
        }
    }
    0.0
}

/// The map.
pub(super) struct HeightMap {
    raster: Raster,
    /// Median height of the cell's points; meaningful where filled.
    height: Vec<f32>,
    /// Nearest filled cell of each cell.
    nearest: Vec<u32>,
    /// Filled cells, ascending.
    pub filled: Vec<u32>,
}

impl HeightMap {
    /// Builds the map; `None` when no cell is filled.
    pub fn build(points: &[Point3], raster: Raster) -> Option<Self> {
        let cells: Vec<Option<u32>> = points.iter().map(|p| raster.index(p.x, p.y).map(|c| c as u32)).collect();
        let mut starts = vec![0u32; raster.len() + 1];
        for c in cells.iter().flatten() {
            starts[*c as usize + 1] += 1;
        }
        let counts: Vec<u32> = starts[1..].to_vec();
        for k in 0..raster.len() {
            starts[k + 1] += starts[k];
        }
        let mut heights = vec![0f32; starts[raster.len()] as usize];
        let mut next = starts.clone();
        for (p, c) in points.iter().zip(&cells) {
            if let Some(c) = c {
                heights[next[*c as usize] as usize] = p.z as f32;
                next[*c as usize] += 1;
            }
        }
        let enough = (0.35 * usual_count(&counts)).max(1.0);
        let mut height = vec![0f32; raster.len()];
        let mut filled = Vec::new();
        for k in 0..raster.len() {
            if f64::from(counts[k]) >= enough {
                let cell = &mut heights[starts[k] as usize..starts[k + 1] as usize];
                let half = cell.len() / 2;
                height[k] = *cell.select_nth_unstable_by(half, f32::total_cmp).1;
                filled.push(k as u32);
            }
        }
        if filled.is_empty() {
            return None;
        }
        let nearest = nearest_filled(&raster, &filled);
        Some(Self { raster, height, nearest, filled })
    }

    /// Area of the filled cells, mm².
    pub fn area_mm2(&self) -> f64 {
        self.filled.len() as f64 * self.raster.cell_mm * self.raster.cell_mm
    }

    /// Middle of a filled cell at its height.
    pub fn place(&self, cell: u32) -> Point3 {
        let (x, y) = self.raster.middle(cell as usize);
        Point3::new(x, y, f64::from(self.height[cell as usize]))
    }

    /// Height of the data at a place; `None` where the nearest data is more than a cell away.
    pub fn height_above(&self, x: f64, y: f64) -> Option<f64> {
        let here = self.raster.index(x, y)?;
        let there = self.nearest[here] as usize;
        let nx = self.raster.nx;
        let near = (here % nx).abs_diff(there % nx) <= 1 && (here / nx).abs_diff(there / nx) <= 1;
        near.then(|| f64::from(self.height[there]))
    }

    /// Squared distance, mm², from a place to the nearest filled cell at its height; to half a cell, since within the cell
    /// nothing finer is known.
    pub fn distance_sq(&self, x: f64, y: f64, z: f64) -> f64 {
        let r = &self.raster;
        let (fi, fj) = ((x - r.x0) / r.cell_mm, (y - r.y0) / r.cell_mm);
        let (i, j) = (fi.max(0.0).min(r.nx as f64 - 1.0) as usize, fj.max(0.0).min(r.ny as f64 - 1.0) as usize);
        let here = j * r.nx + i;
        let there = self.nearest[here] as usize;
        let dz = z - f64::from(self.height[there]);
        if there == here && fi >= 0.0 && fj >= 0.0 && fi < r.nx as f64 && fj < r.ny as f64 {
            return dz * dz;
        }
        let (dx, dy) = (fi - 0.5 - (there % r.nx) as f64, fj - 0.5 - (there / r.nx) as f64);
        (dx * dx + dy * dy) * r.cell_mm * r.cell_mm + dz * dz
    }
}

/// Nearest filled cell for every cell: two sweeps that hand on the neighbours' answers (Danielsson 1980), exact up to a
/// fraction of a cell.
fn nearest_filled(raster: &Raster, filled: &[u32]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let (nx, ny) = (raster.nx as i64, raster.ny as i64);
    let mut nearest = vec![NONE; raster.len()];
    for &k in filled {
        nearest[k as usize] = k;
    }
    let distance = |i: i64, j: i64, k: u32| {
        let (dx, dy) = (i - i64::from(k) % nx, j - i64::from(k) / nx);
        dx * dx + dy * dy
    };
    let pull = |nearest: &mut [u32], i: i64, j: i64, di: i64, dj: i64| {
        let (p, q) = (i + di, j + dj);
        if p < 0 || q < 0 || p >= nx || q >= ny {
            return;
        }
        let offered = nearest[(q * nx + p) as usize];
        let own = &mut nearest[(j * nx + i) as usize];
        if offered != NONE && (*own == NONE || distance(i, j, offered) < distance(i, j, *own)) {
            *own = offered;
        }
    };
    for j in 0..ny {
        for i in 0..nx {
            for (di, dj) in [(-1, 0), (0, -1), (-1, -1), (1, -1)] {
                pull(&mut nearest, i, j, di, dj);
            }
        }
        for i in (0..nx).rev() {
            pull(&mut nearest, i, j, 1, 0);
        }
    }
    for j in (0..ny).rev() {
        for i in (0..nx).rev() {
            for (di, dj) in [(1, 0), (0, 1), (1, 1), (-1, 1)] {
                pull(&mut nearest, i, j, di, dj);
            }
        }
        for i in 0..nx {
            pull(&mut nearest, i, j, -1, 0);
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_is_measured_to_the_nearest_filled_cell() {
        // A 20 mm square at height 3, one point in each 1 mm cell; the raster goes 30 mm beyond.
        let points: Vec<Point3> =
            (0..400).map(|k| Point3::new(f64::from(k % 20) + 0.5, f64::from(k / 20) + 0.5, 3.0)).collect();
        let raster = Raster { x0: -30.0, y0: -30.0, cell_mm: 1.0, nx: 80, ny: 80 };
        let map = HeightMap::build(&points, raster).unwrap();
        assert_eq!(map.filled.len(), 400);
        assert_eq!(map.distance_sq(10.2, 10.7, 5.0), 4.0);
        // 10 mm beyond the edge: the nearest cell's middle is half a cell inside.
        let d = map.distance_sq(30.0, 10.5, 3.0).sqrt();
        assert!((d - 10.5).abs() < 0.51, "{d}");
        let brute = |x: f64, y: f64| points.iter().map(|p| (p.x - x).hypot(p.y - y)).fold(f64::INFINITY, f64::min);
        for (x, y) in [(-12.0, -7.0), (33.3, 41.0), (-20.0, 12.0), (5.0, 45.5)] {
            let d = map.distance_sq(x, y, 3.0).sqrt();
            assert!((d - brute(x, y)).abs() < 0.75, "{d} {}", brute(x, y));
        }
    }

    #[test]
    fn the_usual_count_ignores_sparse_cells() {
        let mut counts = vec![1; 500];
        counts.extend(vec![9; 400]);
        counts.extend(vec![0; 1000]);
        assert_eq!(usual_count(&counts), 9.0);
        assert_eq!(usual_count(&[0, 0]), 0.0);
    }
}
