//! Adaptive spherical merging: of points that lie within a distance of each other the better one stays.
//!
//! **Problem.** Overlapping views have points of different quality in one place. A mean of them is worse than the best one.
//!
//! **Definition.** Points are ranked: better score first, then lower view, then lower index. A point survives if and only if no
//! surviving point of higher rank lies within `radius` of it (distance <= radius): the greedy maximal independent set, which is unique. It does
//! not depend on the order of views, on threads or on how space is cut into pieces. After the endoscope paper, section 6, whose own
//! description leaves the order in which points are looked at open.
//!
//! **Way.** Space is cut into cells as wide as the radius, and these into tiles of up to 64 along a side (`binning`, `tile`). Each tile goes through
//! its points from the best to the worst (`radix`). One without a better point in reach that is still undecided survives, and drops all
//! worse points in reach; else it waits for another tile (`rounds`). Decisions are final and each is right whenever it is made, so that
//! tiles may run at the same time; rounds go on until nothing waits. The best undecided point of all never waits, so that every round
//! decides something. A tile keeps places in single precision, and computes again from the points themselves what that does not tell.

mod binning;
mod marks;
mod points;
mod radix;
mod reach;
mod rounds;
mod space;
mod tile;

pub use points::Points;
pub(super) use points::score_key;
pub(super) use reach::{Field, Last, Reach};

use super::cells::TooManyCells;
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use binning::{Binned, Frame};
use points::Numbered;
use rayon::prelude::*;
use rounds::Tiles;

/// A point's place in the ranking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// Larger is better; what is no number is worse than any.
    pub score: f64,
    /// Number of its view: of equal scores the lower one is better.
    pub view: u32,
    /// Its index in the view: of equal scores and views the lower one is better.
    pub index: u32,
}

impl Rank {
    /// As numbers of which the smaller is better.
    #[cfg(test)]
    fn key(&self) -> (u64, u64) {
        (points::score_key(self.score), self.place())
    }

    /// View and index as one number.
    fn place(&self) -> u64 {
        (u64::from(self.view) << 32) | u64::from(self.index)
    }
}

/// Why nothing was merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// The radius is too small for the points' extent.
    #[error(transparent)]
    TooManyCells(#[from] TooManyCells),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Shares of the time after which points are told by tiles, and sorted in them.
const BINNED: f64 = 0.2;
const IN_TILES: f64 = 0.6;

/// Indices of the points that survive, by view and index. `radius` is in the unit of the positions and above 0.
///
/// # Errors
/// Points that reach over more than two million radii, or the job was stopped.
///
/// # Panics
/// When there are not as many ranks as positions, or more than 4 294 967 295.
pub fn survivors(positions: &[Point3], ranks: &[Rank], radius: f64, run: &RunContext) -> Result<Vec<u32>, MergeError> {
    assert_eq!(positions.len(), ranks.len(), "a rank for every point");
    let order = (!ranks.is_sorted_by_key(Rank::place)).then(|| {
        let mut order: Vec<u32> = (0..ranks.len() as u32).collect();
        order.par_sort_by_key(|k| ranks[*k as usize].place());
        order
    });
    let listed = Listed { positions, ranks, order };
    let kept = survivors_of(&listed, radius, run)?;
    Ok(kept.into_iter().map(|k| listed.index(k as usize) as u32).collect())
}

/// Numbers of the points that survive, rising; points are numbered through all parts. `radius` is in the unit of the positions and above 0.
///
/// # Errors
/// Those of [`survivors`].
///
/// # Panics
/// When there are more than 4 294 967 295 points.
pub fn survivors_of<P: Points>(points: &P, radius: f64, run: &RunContext) -> Result<Vec<u32>, MergeError> {
    in_tiles(points, radius, None, run)
}

/// With tiles of two to `bits` cells along a side.
fn in_tiles<P: Points>(points: &P, radius: f64, bits: Option<u32>, run: &RunContext) -> Result<Vec<u32>, MergeError> {
    let all = Numbered::new(points);
    let frame = Frame::new(&all, radius, bits)?;
    run.check()?;
    let binned = Binned::new(&all, &frame, run)?;
    run.done(BINNED);
    let tiles = Tiles::new(&all, &frame, binned, radius, run)?;
    run.done(IN_TILES);
    tiles.decide(run)?;
    Ok(tiles.survivors())
}

/// Points in one list, in the order of their views and indices or with that order beside them.
struct Listed<'a> {
    positions: &'a [Point3],
    ranks: &'a [Rank],
    order: Option<Vec<u32>>,
}

impl Listed<'_> {
    fn index(&self, k: usize) -> usize {
        self.order.as_ref().map_or(k, |order| order[k] as usize)
    }
}

impl Points for Listed<'_> {
    fn parts(&self) -> usize {
        1
    }

    fn count(&self, _: usize) -> usize {
        self.positions.len()
    }

    fn position(&self, _: usize, index: usize) -> Point3 {
        self.positions[self.index(index)]
    }

    fn score(&self, _: usize, index: usize) -> f64 {
        self.ranks[self.index(index)].score
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::cells::Cells;
    use crate::stitch::test_points::scattered;
    use rand::seq::SliceRandom;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::cmp::Ordering;

    /// As it is defined.
    fn by_definition(positions: &[Point3], ranks: &[Rank], radius: f64) -> Vec<u32> {
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_by(|a, b| {
            let (a, b) = (&ranks[*a as usize], &ranks[*b as usize]);
            let by_score = b.score.partial_cmp(&a.score).unwrap_or(Ordering::Equal);
            let no_score = a.score.is_nan().cmp(&b.score.is_nan());
            no_score.then(by_score).then((a.view, a.index).cmp(&(b.view, b.index)))
        });
        let mut kept: Vec<u32> = Vec::new();
        for k in order {
            let near = |j: &u32| (positions[*j as usize] - positions[k as usize]).norm() <= radius;
            if !kept.iter().any(near) {
                kept.push(k);
            }
        }
        kept.sort_by_key(|k| (ranks[*k as usize].view, ranks[*k as usize].index));
        kept
    }

    fn ranks(positions: &[Point3], score: impl Fn(usize, &Point3) -> f64) -> Vec<Rank> {
        let rank = |(k, p)| Rank { score: score(k, p), view: k as u32 % 3, index: k as u32 / 3 };
        positions.iter().enumerate().map(rank).collect()
    }

    /// Scores of noise, of a slope that makes chains through the whole cloud, of few steps with many ties, and with holes in them.
    fn judged(positions: &[Point3]) -> Vec<Vec<Rank>> {
        let noise = |k: usize| ((k * 7919) % 1009) as f64;
        vec![
            ranks(positions, |k, _| noise(k)),
            ranks(positions, |_, p| p.x - 2.0 * p.y),
            ranks(positions, |_, p| -p.z),
            ranks(positions, |k, _| (noise(k) / 300.0).floor()),
            ranks(positions, |k, p| if k % 7 == 0 { f64::NAN } else { -p.coords.norm() }),
        ]
    }

    #[test]
    fn survivors_are_those_of_the_definition_whatever_the_judge() {
        for (seed, size) in [(1, [12.0, 9.0, 7.0]), (2, [60.0, 40.0, 0.1]), (3, [400.0, 0.0, 0.0])] {
            let points = scattered(1500, seed, size);
            for ranks in judged(&points) {
                for radius in [0.2, 1.0, 4.0] {
                    let found = survivors(&points, &ranks, radius, &RunContext::silent()).unwrap();
                    assert_eq!(found, by_definition(&points, &ranks, radius), "seed {seed}, radius {radius}");
                }
            }
        }
    }

    /// 200,000 points are six pieces, and a slope makes every piece wait for the next.
    #[test]
    fn every_survivor_stands_apart_and_everything_dropped_has_a_better_one_in_reach() {
        let points = scattered(200_000, 5, [100.0, 100.0, 1.0]);
        for ranks in [ranks(&points, |k, _| ((k * 7919) % 100_003) as f64), ranks(&points, |_, p| p.z + p.y)] {
            let kept = survivors(&points, &ranks, 0.8, &RunContext::silent()).unwrap();
            let cells = Cells::new(&points, 0.8).unwrap();
            let mut survives = vec![false; points.len()];
            kept.iter().for_each(|k| survives[*k as usize] = true);
            for (cell, around) in cells.walk(0) {
                for k in cells.points(cell) {
                    let better = |j: &usize| {
                        let (j, k) = (cells.order[*j] as usize, cells.order[k] as usize);
                        survives[j] && ranks[j].key() < ranks[k].key() && (points[j] - points[k]).norm() <= 0.8
                    };
                    let has_better = around.points().any(|j| better(&j));
                    assert_eq!(has_better, !survives[cells.order[k] as usize]);
                }
            }
        }
    }

    #[test]
    fn neither_the_order_of_points_nor_the_threads_change_what_survives() {
        let points = scattered(60_000, 6, [50.0, 50.0, 2.0]);
        let ranks = ranks(&points, |k, p| (p.x * 3.0).sin() + ((k * 31) % 97) as f64 * 0.01);
        let names = |kept: &[u32], ranks: &[Rank]| -> Vec<(u32, u32)> {
            kept.iter().map(|k| (ranks[*k as usize].view, ranks[*k as usize].index)).collect()
        };
        let first = names(&survivors(&points, &ranks, 0.9, &RunContext::silent()).unwrap(), &ranks);
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(9));
        let shuffled: Vec<Point3> = order.iter().map(|k| points[*k]).collect();
        let shuffled_ranks: Vec<Rank> = order.iter().map(|k| ranks[*k]).collect();
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let again = pool.install(|| survivors(&shuffled, &shuffled_ranks, 0.9, &RunContext::silent()).unwrap());
            assert_eq!(names(&again, &shuffled_ranks), first, "{threads} threads");
        }
    }

    /// From tiles of one cell to one tile of all.
    #[test]
    fn the_size_of_tiles_changes_nothing() {
        for (seed, size) in [(7, [30.0, 20.0, 6.0]), (8, [90.0, 60.0, 0.2])] {
            let points = scattered(6000, seed, size);
            for ranks in judged(&points) {
                let listed = Listed { positions: &points, ranks: &ranks, order: None };
                let kept = |bits| in_tiles(&listed, 1.7, bits, &RunContext::silent()).unwrap();
                let one = kept(None);
                (0..=6).for_each(|bits| assert_eq!(kept(Some(bits)), one, "{bits} bits"));
            }
        }
    }

    /// A grid of the radius itself, turned and far out: whether neighbours are in reach hangs on the last digits, and what is computed from the
    /// points decides.
    #[test]
    fn points_at_the_very_radius_are_told_by_their_own_digits() {
        let turn = nalgebra::Rotation3::new(crate::geometry::Vector3::new(0.4, -0.3, 0.9));
        let grid = (0..40).flat_map(|x| (0..30).map(move |y| Point3::new(0.1 * f64::from(x), 0.1 * f64::from(y), 0.0)));
        let points: Vec<Point3> = grid.map(|p| turn * p + crate::geometry::Vector3::new(7e3, -2e3, 30.0)).collect();
        for ranks in judged(&points) {
            let found = survivors(&points, &ranks, 0.1, &RunContext::silent()).unwrap();
            assert_eq!(found, by_definition(&points, &ranks, 0.1));
        }
    }

    #[test]
    fn ranks_are_ordered_by_score_then_view_then_index() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut scores: Vec<f64> =
            (0..200).map(|_| rng.random_range(-1.0..1.0) * 10f64.powi(rng.random_range(-9..9))).collect();
        scores.extend([0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY]);
        let key = |score: f64, view, index| Rank { score, view, index }.key();
        for a in &scores {
            for b in &scores {
                assert_eq!(key(*a, 1, 1) < key(*b, 1, 1), a > b, "{a} {b}");
            }
            assert!(key(*a, 9, 9) < key(f64::NAN, 0, 0));
            assert!(key(*a, 1, 9) < key(*a, 2, 0) && key(*a, 1, 3) < key(*a, 1, 4));
        }
        assert_eq!(key(0.0, 1, 1), key(-0.0, 1, 1));
    }
}
