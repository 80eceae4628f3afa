//! Tiles decided side by side, round after round.

use super::binning::{Binned, Frame, Run};
use super::points::{Numbered, Points};
use super::space::Space;
use super::tile::{Scratch, Tile};
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU8, Ordering};

/// A point was looked at and must wait. Of one whose state is 0 nothing is known: in its tile it is worse than all that were looked at.
const WAITS: u8 = 1;
const SURVIVES: u8 = 2;

/// A tile is left once so many of its points wait, and one more for so many that were decided: where chains of points run from tile to tile,
/// little is gained by looking at what must wait anyhow.
const PATIENCE: usize = 32;
const DECIDED_A_WAIT: usize = 16;
/// A point by its tile and its place there.
type At = (u32, u32);

/// What is left of a tile.
struct Piece {
    tile: u32,
    /// How many of the tile's order were looked at.
    seen: usize,
    /// Those of them that wait, the best first, each with the better one that it waits for.
    waiting: Vec<(u32, At)>,
}

/// All tiles, and which touch.
pub(super) struct Tiles<'a, P> {
    all: &'a Numbered<'a, P>,
    space: Space,
    around: Vec<[u32; 27]>,
    radius_squared: f64,
}

impl<'a, P: Points> Tiles<'a, P> {
    pub fn new(
        all: &'a Numbered<'a, P>,
        frame: &Frame,
        binned: Binned,
        radius: f64,
        run: &RunContext,
    ) -> Result<Self, Cancelled> {
        let tile = |scratch: &mut Scratch, runs: &[Run]| {
            run.check()?;
            Ok(Tile::new(all, frame, &binned, runs, scratch))
        };
        let runs = binned.tiles();
        let tiles: Vec<Tile> =
            runs.into_par_iter().map_init(Scratch::default, tile).collect::<Result<_, Cancelled>>()?;
        drop(binned);
        let space = Space::new(tiles, frame);
        let around = space.tiles.iter().map(|tile| space.neighbours(tile.corner)).collect();
        Ok(Self { all, space, around, radius_squared: radius * radius })
    }

    /// Decides all points.
    pub fn decide(&self, run: &RunContext) -> Result<(), Cancelled> {
        let piece = |tile: usize| Piece { tile: tile as u32, seen: 0, waiting: Vec::new() };
        let mut pieces: Vec<Piece> = (0..self.space.tiles.len()).map(piece).collect();
        let all = pieces.len() as f64;
        while !pieces.is_empty() {
            run.check()?;
            run.done(1.0 - (1.0 - super::IN_TILES) * pieces.len() as f64 / all);
            pieces = pieces.into_par_iter().with_max_len(1).filter_map(|piece| self.go_on(piece)).collect();
        }
        Ok(())
    }

    /// Numbers of the points that survive, rising.
    pub fn survivors(&self) -> Vec<u32> {
        let of_tile = |tile: &Tile| {
            let survives = |state: &AtomicU8| state.load(Ordering::Relaxed) == SURVIVES;
            let of = tile.numbers.iter().zip(&tile.states);
            of.filter(|(_, state)| survives(state)).map(|(number, _)| *number).collect::<Vec<u32>>()
        };
        let mut kept: Vec<u32> = self.space.tiles.par_iter().flat_map_iter(of_tile).collect();
        kept.par_sort_unstable();
        kept
    }

    fn state(&self, (tile, point): At) -> &AtomicU8 {
        &self.space.tiles[tile as usize].states[point as usize]
    }

    fn is_decided(&self, at: At) -> bool {
        self.space.tiles[at.0 as usize].dropped.has(at.1 as usize) || self.state(at).load(Ordering::Relaxed) == SURVIVES
    }

    fn drop_points(&self, points: &[At]) {
        for of_tile in points.chunk_by(|a, b| a.0 == b.0) {
            let dropped = &self.space.tiles[of_tile[0].0 as usize].dropped;
            dropped.set(of_tile.iter().map(|(_, point)| *point as usize));
        }
    }

    /// Decides what can be decided of a tile, if there is patience; what is left of it, if anything.
    fn go_on(&self, mut piece: Piece) -> Option<Piece> {
        let mut worse = Vec::new();
        let (mut decided, mut waits) = (0, 0);
        piece.waiting.retain_mut(|(point, on)| {
            let at = (piece.tile, *point);
            if waits > PATIENCE + decided / DECIDED_A_WAIT {
                return true;
            }
            if self.is_decided(at) {
                decided += 1;
                return false;
            }
            if self.is_decided(*on) {
                match self.look(at, &mut worse) {
                    None => {
                        decided += 1 + worse.len();
                        return false;
                    }
                    Some(better) => *on = better,
                }
            }
            waits += 1;
            true
        });
        let tile = &self.space.tiles[piece.tile as usize];
        while piece.seen < tile.order.len() && waits <= PATIENCE + decided / DECIDED_A_WAIT {
            let at = (piece.tile, tile.order[piece.seen]);
            piece.seen += 1;
            if self.is_decided(at) {
                continue;
            }
            match self.look(at, &mut worse) {
                None => decided += 1 + worse.len(),
                Some(better) => {
                    self.state(at).store(WAITS, Ordering::Relaxed);
                    piece.waiting.push((at.1, better));
                    waits += 1;
                }
            }
        }
        (piece.seen < tile.order.len() || !piece.waiting.is_empty()).then_some(piece)
    }

    /// Decides a point that is not decided; else a better one in reach that must be decided before. A point that survives drops all worse ones in
    /// reach, so that only few points ever look around. Decisions are final: whoever reads an old state waits for no reason, and that is all.
    fn look(&self, at: At, worse: &mut Vec<At>) -> Option<At> {
        worse.clear();
        let key = std::cell::OnceCell::new();
        let number = |(tile, point): At| self.space.tiles[tile as usize].numbers[point as usize];
        let found = self.around(at, |other| {
            let state = self.state(other).load(Ordering::Relaxed);
            if other == at {
                return ControlFlow::Continue(());
            }
            if state == SURVIVES {
                return ControlFlow::Break(None);
            }
            // What was not looked at yet in its own tile is worse than all that were.
            let is_better = || self.all.key(number(other)) < *key.get_or_init(|| self.all.key(number(at)));
            if (state == WAITS || other.0 != at.0) && is_better() {
                return ControlFlow::Break(Some(other));
            }
            worse.push(other);
            ControlFlow::Continue(())
        });
        match found {
            ControlFlow::Break(Some(better)) => return Some(better),
            ControlFlow::Break(None) => {
                worse.clear();
                self.drop_points(&[at]);
            }
            ControlFlow::Continue(()) => {
                self.state(at).store(SURVIVES, Ordering::Relaxed);
                self.drop_points(worse);
            }
        }
        None
    }

    /// Goes through the points within the radius that are not dropped, the point itself among them.
    fn around<B>(&self, (tile, point): At, mut each: impl FnMut(At) -> ControlFlow<B>) -> ControlFlow<B> {
        let own = &self.space.tiles[tile as usize];
        let at = [0, 1, 2].map(|axis| own.places[axis][point as usize]);
        let number = own.numbers[point as usize];
        let position = std::cell::OnceCell::new();
        self.space.around(&self.around[tile as usize], at, |which, k, is_sure| {
            let within = |position: &Point3| {
                let other = self.all.position(self.space.tiles[which as usize].numbers[k]);
                (other - position).norm_squared() <= self.radius_squared
            };
            if is_sure || within(position.get_or_init(|| self.all.position(number))) {
                return each((which, k as u32));
            }
            ControlFlow::Continue(())
        })
    }
}
