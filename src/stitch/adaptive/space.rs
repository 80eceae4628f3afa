//! Tiles beside each other, and what lies around a place in them.

use super::binning::{Corner, Frame, pack};
use super::tile::{DROPPED, Tile};
use std::collections::HashMap;
use std::ops::{ControlFlow, Range};
use std::sync::atomic::Ordering;

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
        // Rounding may put a place on the far side of its cell: cells are a little wider than the radius.
        let [x, y, z] = at.map(|c| (c as u32).min(self.side - 1));
        for (dz, z) in self.next_to(z) {
            for (dy, y) in self.next_to(y) {
                for (dx, x) in self.rows(x) {
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

    /// The cells next to one along an axis, its own first: step to its tile (0, 1 or 2, 1 is the own) and number there.
    fn next_to(&self, cell: u32) -> [(u32, u32); 3] {
        let last = self.side - 1;
        let before = if cell == 0 { (0, last) } else { (1, cell - 1) };
        let after = if cell == last { (2, 0) } else { (1, cell + 1) };
        [(1, cell), before, after]
    }

    /// The three cells about one along a row, in their tiles.
    fn rows(&self, cell: u32) -> impl Iterator<Item = (u32, Range<u32>)> {
        let own = (1, cell.saturating_sub(1)..(cell + 2).min(self.side));
        let before = (cell == 0).then(|| (0, self.side - 1..self.side));
        let after = (cell == self.side - 1).then_some((2, 0..1));
        [Some(own), before, after].into_iter().flatten()
    }

    /// Of a range of points those that may be within the radius of a place and are not dropped, and whether they surely are within it. Which
    /// they are is as good as random, so that they are picked without a branch.
    fn near_ones<B>(
        &self,
        tile: &Tile,
        range: Range<usize>,
        at: [f32; 3],
        mut each: impl FnMut(usize, bool) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let [xs, ys, zs] = [0, 1, 2].map(|axis| &tile.places[axis][range.clone()]);
        let states = &tile.states[range.clone()];
        let mut squares = [0.0_f32; BLOCK];
        let mut picked = [0_u32; BLOCK];
        let blocks = xs.chunks(BLOCK).zip(ys.chunks(BLOCK)).zip(zs.chunks(BLOCK)).zip(states.chunks(BLOCK));
        for (block, (((xs, ys), zs), states)) in blocks.enumerate() {
            for (((square, x), y), z) in squares.iter_mut().zip(xs).zip(ys).zip(zs) {
                let (x, y, z) = (x - at[0], y - at[1], z - at[2]);
                *square = x * x + y * y + z * z;
            }
            let mut count = 0;
            for (k, (square, state)) in squares.iter().zip(states).enumerate() {
                picked[count % BLOCK] = k as u32;
                count += usize::from((*square <= self.far) & (state.load(Ordering::Relaxed) != DROPPED));
            }
            for k in &picked[..count] {
                each(range.start + block * BLOCK + *k as usize, squares[*k as usize] <= self.near)?;
            }
        }
        ControlFlow::Continue(())
    }
}
