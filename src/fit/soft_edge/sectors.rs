//! Squares over a window: how much of each belongs to it, how many points stand there, and beside which part of an outline.

use super::Window;
use super::outline::{MAX_SHAPE, Outline};

/// Squares of one size that cover a window, row by row.
pub struct Raster {
    /// Side of a square, mm.
    pub cell_mm: f64,
    /// Squares in a row.
    pub columns: usize,
    low: [f64; 2],
    per_mm: f64,
    /// All squares.
    pub cells: Vec<Cell>,
}

/// One square of a raster.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Its middle.
    pub place: [f64; 2],
    /// Share of it that belongs to the window.
    pub part: f64,
    /// Signed distance of its middle from the outline, mm.
    pub signed_mm: f64,
    /// Points in it.
    pub points: u32,
}

impl Cell {
    /// Whether all of it belongs to the window.
    pub fn is_whole(&self) -> bool {
        self.part > 0.999
    }
}

/// Rows of a square that are looked at to tell how much of it belongs to a window.
const SUB_ROWS: usize = 4;

impl Raster {
    /// Squares of side `cell_mm` over a window, with the points in them.
    pub fn new<O: Outline>(points: &[[f64; 2]], window: &Window, outline: &O, cell_mm: f64) -> Self {
        let [[u0, u1], [v0, v1]] = window.bounds();
        let count = |from: f64, to: f64| ((to - from) / cell_mm).ceil().max(1.0) as usize;
        let (columns, rows) = (count(u0, u1), count(v0, v1));
        let sub = cell_mm / SUB_ROWS as f64;
        let stretches = window.rows(v0 + 0.5 * sub, sub, rows * SUB_ROWS);
        let mut cells = Vec::with_capacity(columns * rows);
        let (distance, mut unused) = (outline.distances(), [0.0; MAX_SHAPE]);
        for j in 0..rows {
            let own = &stretches[j * SUB_ROWS..(j + 1) * SUB_ROWS];
            let v = v0 + (j as f64 + 0.5) * cell_mm;
            let inner = own.iter().fold([f64::NEG_INFINITY, f64::INFINITY], |i, s| [i[0].max(s[0]), i[1].min(s[1])]);
            for i in 0..columns {
                let from = u0 + i as f64 * cell_mm;
                let overlap = |s: &[f64; 2]| (s[1].min(from + cell_mm) - s[0].max(from)).max(0.0);
                let is_inside = from >= inner[0] && from + cell_mm <= inner[1];
                let part =
                    if is_inside { 1.0 } else { own.iter().map(overlap).sum::<f64>() / (SUB_ROWS as f64 * cell_mm) };
                let place = [from + 0.5 * cell_mm, v];
                let signed_mm = if part > 0.0 { distance(place, &mut unused) } else { f64::INFINITY };
                cells.push(Cell { place, part, signed_mm, points: 0 });
            }
        }
        let mut raster = Self { cell_mm, columns, low: [u0, v0], per_mm: cell_mm.recip(), cells };
        for p in points {
            let k = raster.index(p);
            raster.cells[k].points += 1;
        }
        raster
    }

    /// The square in which a place of the window lies.
    pub fn index(&self, place: &[f64; 2]) -> usize {
        let rows = self.cells.len() / self.columns;
        let number = |axis: usize, count: usize| {
            let steps = (place[axis] - self.low[axis]) * self.per_mm;
            (steps.max(0.0) as usize).min(count - 1)
        };
        number(1, rows) * self.columns + number(0, self.columns)
    }

    /// The squares that share a side with one.
    pub fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, cells) = (self.columns, self.cells.len());
        let column = k % columns;
        let left = (column > 0).then(|| k - 1);
        let right = (column + 1 < columns).then_some(k + 1);
        let below = k.checked_sub(columns);
        let above = Some(k + columns).filter(|n| *n < cells);
        [left, right, below, above].into_iter().flatten()
    }
}

/// Equal sectors of an outline, by the share of its length: which of `count` a place lies beside.
pub fn sector(along: f64, count: usize) -> usize {
    ((along.max(0.0) * count as f64) as usize).min(count - 1)
}
