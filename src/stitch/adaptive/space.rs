//! Tiles beside each other, and what lies around a place in them.

use super::binning::{Corner, Frame, pack};
use super::tile::Tile;
use std::collections::HashMap;
use std::ops::{ControlFlow, Range};

/// Distances squared are told in single precision to better than this part: the ones this near to the radius are computed again from the points
/// themselves. A place in a tile of 64 cells is rounded to 2^-19 of a cell, in the next tile's frame once more: 6e-6 for the two points
/// along each axis, and 2e-5 for the square of a distance of one cell.
const DOUBT: f32 = 1e-4;
/// Distances computed at once.
const BLOCK: usize = 16;
/// No tile.
const NONE: u32 = u32::MAX;

/// Tiles that touch one, by their numbers.
pub(super) type Neighbours = [u32; 27];

/// All tiles that hold points.
pub(super) struct Space {
    pub tiles: Vec<Tile>,
    known: HashMap<u64, u32>,
    side: u32,
    /// Squares of distances in cells that are surely within the radius, and that may be.
    near: f32,
    far: f32,
}

impl Space {
    pub fn new(tiles: Vec<Tile>, frame: &Frame) -> Self {
        let known = tiles.iter().enumerate().map(|(k, tile)| (pack(tile.corner), k as u32)).collect();
        let reach = (frame.reach * frame.reach) as f32;
        Self { tiles, known, side: 1 << frame.bits, near: reach * (1.0 - DOUBT), far: reach * (1.0 + DOUBT) }
    }

    /// The tiles that touch one, `NONE` where there are no points, itself in the middle.
    pub fn neighbours(&self, [x, y, z]: Corner) -> Neighbours {
        let step = |c: u32, d: usize| (c + d as u32).checked_sub(1);
        std::array::from_fn(|k| {
            let corner = step(x, k % 3).zip(step(y, k / 3 % 3)).zip(step(z, k / 9));
            corner.and_then(|((x, y), z)| self.known.get(&pack([x, y, z])).copied()).unwrap_or(NONE)
        })
    }

    /// Goes through the points that may be within the radius of a place and are not dropped: tile, place in it, and whether they surely are.
    /// `at`: in cells from the corner of its tile, whose neighbours are given.
    pub fn around<B>(
        &self,
        neighbours: &Neighbours,
        at: [f32; 3],
        mut each: impl FnMut(u32, usize, bool) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let around_z = self.next_to(at[2]);
        let around_y = self.next_to(at[1]);
        for (dz, z, off_z) in around_z {
            for (dy, y, off_y) in around_y {
                // Half as long as the piece of the row that is in reach.
                let half_squared = self.far - off_z * off_z - off_y * off_y;
                if half_squared < 0.0 {
                    continue;
                }
                for (dx, x) in self.row(at[0], half_squared.sqrt()) {
                    let which = neighbours[(9 * dz + 3 * dy + dx) as usize];
                    if which == NONE {
                        continue;
                    }
                    let other = &self.tiles[which as usize];
                    let from = |c: f32, d: u32| c - (d as f32 - 1.0) * self.side as f32;
                    let at = [from(at[0], dx), from(at[1], dy), from(at[2], dz)];
                    self.near_ones(other, other.grid.points(z, y, x), at, |k, is_sure| each(which, k, is_sure))?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// The cells next to a place along an axis, its own first: step to its tile (0, 1 or 2, 1 is the own), number there, and how far off it begins.
    #[inline]
    fn next_to(&self, at: f32) -> [(u32, u32, f32); 3] {
        let last = self.side - 1;
        // Rounding may put a place on the far side of its cell: cells are a little wider than the radius.
        let cell = (at as u32).min(last);
        let into = at - cell as f32;
        let before = if cell == 0 { (0, last, into) } else { (1, cell - 1, into) };
        let after = if cell == last { (2, 0, 1.0 - into) } else { (1, cell + 1, 1.0 - into) };
        [(1, cell, 0.0), before, after]
    }

    /// The cells of a row, three at most, that come within a distance of a place, in their tiles.
    #[inline]
    fn row(&self, at: f32, half: f32) -> impl Iterator<Item = (u32, Range<u32>)> {
        let (low, high) = (at - half, at + half);
        let own = (1, low.max(0.0) as u32..(high as u32 + 1).min(self.side));
        let before = (low < 0.0).then(|| (0, self.side - 1..self.side));
        let after = (high >= self.side as f32).then_some((2, 0..1));
        [Some(own), before, after].into_iter().flatten()
    }

    /// Of a range of points those that may be within the radius of a place and are not dropped, and whether they surely are within it. Which
    /// they are is as good as random, so that they are picked without a branch, and where all are dropped no distance is computed.
    #[inline]
    fn near_ones<B>(
        &self,
        tile: &Tile,
        range: Range<usize>,
        at: [f32; 3],
        mut each: impl FnMut(usize, bool) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut squares = [0.0_f32; BLOCK];
        for from in range.clone().step_by(BLOCK) {
            let some = from..(from + BLOCK).min(range.end);
            let left = tile.dropped.without(from, some.len());
            if left == 0 {
                continue;
            }
            let [xs, ys, zs] = [0, 1, 2].map(|axis| &tile.places[axis][some.clone()]);
            for (((square, x), y), z) in squares.iter_mut().zip(xs).zip(ys).zip(zs) {
                let (x, y, z) = (x - at[0], y - at[1], z - at[2]);
                *square = x * x + y * y + z * z;
            }
            let mut picked = left & at_most(&squares, self.far);
            while picked != 0 {
                let k = picked.trailing_zeros() as usize;
                picked &= picked - 1;
                each(from + k, squares[k] <= self.near)?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// A bit for each number that is not above a limit.
#[inline]
fn at_most(numbers: &[f32; BLOCK], limit: f32) -> u32 {
    numbers.iter().enumerate().fold(0, |bits, (k, number)| bits | (u32::from(*number <= limit) << k))
}
