//! A tile of space with its points, cell by cell.

use super::binning::{Binned, Corner, Frame, Run, unpack};
use super::marks::Marks;
use super::points::{Numbered, Points};
use super::radix::{by_rank, sort_by_bits};
use std::ops::Range;
use std::sync::atomic::AtomicU8;

/// Which cells of a tile hold points, and which: masks of layers, rows and cells, a bit for each of 64, and only what is not empty is stored.
pub(super) struct Grid {
    layers: u64,
    /// Of each layer that is not empty its rows, and how many rows there are before it.
    rows: Vec<(u64, u32)>,
    /// Of each row that is not empty its cells, and how many cells there are before it.
    cells: Vec<(u64, u32)>,
    /// First point of each cell that is not empty, and one past the last.
    starts: Vec<u32>,
}

/// Bits below one.
#[inline]
fn below(bit: u32) -> u64 {
    1_u64.checked_shl(bit).map_or(u64::MAX, |one| one - 1)
}

impl Grid {
    /// Of cells as `z y x`, rising, one for each point.
    fn new(sorted: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut grid = Self { layers: 0, rows: Vec::new(), cells: Vec::new(), starts: Vec::new() };
        let mut last = None;
        let mut count = 0;
        for cell in sorted {
            if last != Some(cell) {
                grid.begin(cell, last, count);
                last = Some(cell);
            }
            count += 1;
        }
        grid.starts.push(count);
        grid
    }

    fn begin(&mut self, [z, y, x]: [u32; 3], last: Option<[u32; 3]>, first: u32) {
        if last.is_none_or(|last| last[0] != z) {
            self.layers |= 1 << z;
            self.rows.push((0, self.cells.len() as u32));
        }
        if last.is_none_or(|last| last[..2] != [z, y]) {
            if let Some((rows, _)) = self.rows.last_mut() {
                *rows |= 1 << y;
            }
            self.cells.push((0, self.starts.len() as u32));
        }
        if let Some((cells, _)) = self.cells.last_mut() {
            *cells |= 1 << x;
        }
        self.starts.push(first);
    }

    /// Points of the cells `x` of a row, three at most.
    #[inline]
    pub fn points(&self, z: u32, y: u32, x: Range<u32>) -> Range<usize> {
        /// How many bits of three are set.
        const SET: [u8; 8] = [0, 1, 1, 2, 1, 2, 2, 3];
        let Some((rows, first)) = of_bit(self.layers, z).map(|k| self.rows[k as usize]) else { return 0..0 };
        let Some((cells, cell)) = of_bit(rows, y).map(|k| self.cells[(first + k) as usize]) else { return 0..0 };
        let from = (cell + (cells & below(x.start)).count_ones()) as usize;
        let count = SET[(cells >> x.start & below(x.end - x.start) & 7) as usize];
        self.starts[from] as usize..self.starts[from + usize::from(count)] as usize
    }
}

/// How many bits are set before one, if it is set itself.
#[inline]
fn of_bit(mask: u64, bit: u32) -> Option<u32> {
    (mask >> bit & 1 == 1).then(|| (mask & below(bit)).count_ones())
}

/// The points of a tile by cell.
pub(super) struct Tile {
    pub corner: Corner,
    /// Places in cells from the tile's corner, each axis by itself.
    pub places: [Vec<f32>; 3],
    /// Numbers of the points.
    pub numbers: Vec<u32>,
    /// What is known of each.
    pub states: Vec<AtomicU8>,
    /// Those that a better one has dropped: nobody looks at them any more.
    pub dropped: Marks,
    /// From the best to the worst.
    pub order: Vec<u32>,
    pub grid: Grid,
}

/// Memory that is used again for the next tile.
#[derive(Default)]
pub(super) struct Scratch {
    cells: Vec<u32>,
    places: Vec<[f32; 3]>,
    numbers: Vec<u32>,
    scores: Vec<f64>,
    by_cell: Vec<u64>,
    by_rank: Vec<u64>,
    spare: Vec<u64>,
    slot: Vec<u32>,
}

const INDEX: u32 = 32;

impl Tile {
    pub fn new<P: Points>(
        all: &Numbered<P>,
        frame: &Frame,
        binned: &Binned,
        runs: &[Run],
        scratch: &mut Scratch,
    ) -> Self {
        let corner = unpack(runs[0].tile);
        scratch.gather(all, frame, binned, runs, corner);
        let Scratch { cells, places, numbers, scores, by_cell, by_rank: ranked, spare, slot } = scratch;
        by_cell.clear();
        by_cell.extend(cells.iter().enumerate().map(|(k, cell)| (u64::from(*cell) << INDEX) | k as u64));
        // Of a surface only a few layers have points.
        let top = cells.iter().max().map_or(0, |cell| u32::BITS - cell.leading_zeros());
        sort_by_bits(by_cell, spare, INDEX, INDEX + top);
        let bits = frame.bits;
        let part = |cell: u64, axis: u32| (cell >> (INDEX + axis * bits)) as u32 & ((1 << bits) - 1);
        let grid = Grid::new(by_cell.iter().map(|cell| [part(*cell, 2), part(*cell, 1), part(*cell, 0)]));
        let index = |sorted: &u64| *sorted as u32 as usize;
        let mut sorted = [(); 3].map(|()| Vec::with_capacity(cells.len()));
        slot.clear();
        slot.resize(cells.len(), 0);
        for (k, cell) in by_cell.iter().enumerate() {
            let place = places[index(cell)];
            sorted.iter_mut().zip(place).for_each(|(axis, place)| axis.push(place));
            slot[index(cell)] = k as u32;
        }
        by_rank(scores, ranked, spare);
        Self {
            corner,
            places: sorted,
            numbers: by_cell.iter().map(|c| numbers[index(c)]).collect(),
            states: cells.iter().map(|_| AtomicU8::new(0)).collect(),
            dropped: Marks::none(cells.len()),
            order: ranked.iter().map(|r| slot[index(r)]).collect(),
            grid,
        }
    }
}

impl Scratch {
    /// The points of a tile, numbers rising.
    fn gather<P: Points>(&mut self, all: &Numbered<P>, frame: &Frame, binned: &Binned, runs: &[Run], corner: Corner) {
        self.cells.clear();
        self.places.clear();
        self.numbers.clear();
        self.scores.clear();
        for run in runs {
            let (part, indices) = binned.points(run);
            for index in indices {
                let at = frame.in_tile(frame.cells(&all.points.position(part, *index as usize)), corner);
                let [x, y, z] = at.map(|c| c as u32);
                self.cells.push((((z << frame.bits) | y) << frame.bits) | x);
                self.places.push(at.map(|c| c as f32));
                self.numbers.push(all.starts[part] + index);
                self.scores.push(all.points.score(part, *index as usize));
            }
        }
    }
}
