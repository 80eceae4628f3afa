//! Adaptive spherical merging: of points that lie within a distance of each other the better one stays.
//!
//! **Problem.** Overlapping views have points of different quality in one place. A mean of them is worse than the best one.
//!
//! **Definition.** Points are ranked: better score first, then lower view, then lower index. A point survives if and only if no
//! surviving point of higher rank lies within `radius` of it (distance <= radius): the greedy maximal independent set, which is unique. It does
//! not depend on the order of views, on threads or on how space is cut into pieces. After the endoscope paper, section 6, whose own
//! description leaves the order in which points are looked at open.
//!
//! **Way.** Cells as wide as the radius are cut into pieces of some ten thousand points. Each piece goes through its undecided points from the
//! best to the worst. One without a better point in reach that survives or is still undecided survives, and drops all worse points in
//! reach; else it waits for another piece. Decisions are final and each is right whenever it is made, so that pieces
//! may run at the same time; rounds go on until nothing waits. The best undecided point of all never waits, so that every round
//! decides something.

use super::cells::{Around, Cells, TooManyCells};
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;
use std::cmp::Ordering::{Equal, Greater, Less};
use std::sync::atomic::{AtomicU8, Ordering};

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
        (self.score_key(), self.place())
    }

    /// View and index as one number.
    fn place(&self) -> u64 {
        (u64::from(self.view) << 32) | u64::from(self.index)
    }

    /// The score as a number of which the smaller is better.
    fn score_key(&self) -> u64 {
        // The order of bits is that of numbers, once negative ones are turned round; both zeros are one.
        let bits = (self.score + 0.0).to_bits();
        let rising = if bits >> 63 == 1 { !bits } else { bits | (1 << 63) };
        if self.score.is_nan() { u64::MAX } else { !rising }
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

const UNDECIDED: u8 = 0;
const SURVIVES: u8 = 1;
const DROPPED: u8 = 2;

/// Points of one piece, roughly.
const PIECE_POINTS: usize = 1 << 15;

/// Indices of the points that survive, by view and index. `radius` is in the unit of the positions and above 0.
///
/// # Errors
/// Points that reach over more than two million radii, or the job was stopped.
///
/// # Panics
/// When there are not as many ranks as positions.
pub fn survivors(positions: &[Point3], ranks: &[Rank], radius: f64, run: &RunContext) -> Result<Vec<u32>, MergeError> {
    assert_eq!(positions.len(), ranks.len(), "a rank for every point");
    let cells = Cells::new(positions, radius)?;
    run.check()?;
    let scores: Vec<u64> = cells.order.par_iter().map(|k| ranks[*k as usize].score_key()).collect();
    let states = states(scores.len());
    let merge = Merge { cells: &cells, ranks, scores: &scores, states, radius_squared: radius * radius };
    let mut pieces = merge.pieces();
    while !pieces.is_empty() {
        run.check()?;
        pieces = pieces.into_par_iter().filter_map(|piece| merge.decide(piece)).collect();
    }
    let survives = |k: &usize| merge.states[*k].load(Ordering::Relaxed) == SURVIVES;
    let mut kept: Vec<u32> = (0..scores.len()).into_par_iter().filter(survives).map(|k| cells.order[k]).collect();
    let place = |k: &u32| (ranks[*k as usize].view, ranks[*k as usize].index);
    kept.par_sort_unstable_by_key(place);
    Ok(kept)
}

fn states(count: usize) -> Vec<AtomicU8> {
    (0..count).map(|_| AtomicU8::new(UNDECIDED)).collect()
}

/// Points of some neighbouring cells, with what lies around each cell.
struct Piece {
    /// The first of its points.
    first: usize,
    arounds: Vec<Around>,
    /// Which of the arounds is that of each point's cell.
    cell_of: Vec<u32>,
    /// Points that are not decided yet, from the first one, the best first.
    waiting: Vec<u32>,
}

struct Merge<'a> {
    cells: &'a Cells,
    ranks: &'a [Rank],
    /// Of each point, in the order of the cells; smaller is better.
    scores: &'a [u64],
    states: Vec<AtomicU8>,
    radius_squared: f64,
}

impl Merge<'_> {
    fn pieces(&self) -> Vec<Piece> {
        let mut firsts = Vec::new();
        let mut begun = 0;
        for cell in 0..self.cells.len() {
            if cell == 0 || self.cells.points(cell).start - begun >= PIECE_POINTS {
                begun = self.cells.points(cell).start;
                firsts.push(cell);
            }
        }
        let ends = firsts.iter().skip(1).copied().chain([self.cells.len()]);
        let ranges: Vec<(usize, usize)> = firsts.iter().copied().zip(ends).collect();
        ranges.into_par_iter().map(|(from, to)| self.piece(from, to)).collect()
    }

    fn piece(&self, from: usize, to: usize) -> Piece {
        let (first, end) = (self.cells.points(from).start, self.cells.points(to - 1).end);
        let mut arounds = Vec::with_capacity(to - from);
        let mut cell_of = Vec::with_capacity(end - first);
        for (cell, around) in self.cells.walk(from).take(to - from) {
            cell_of.resize(self.cells.points(cell).end - first, arounds.len() as u32);
            arounds.push(around);
        }
        Piece { first, arounds, cell_of, waiting: self.by_rank(first, end) }
    }

    /// Points of a range from its first one on, the best first. Most of the order is told by the upper bits of the scores, which are sorted with the
    /// points as one number; only scores that are equal in them (which of single precision means equal) are looked at whole.
    fn by_rank(&self, first: usize, end: usize) -> Vec<u32> {
        let bits = u64::BITS - ((end - first) as u64).leading_zeros();
        let (upper, lower) = (!0 << bits, !(!0 << bits));
        let tag = |k: usize| (self.scores[k] & upper) | (k - first) as u64;
        let mut tagged: Vec<u64> = (first..end).map(tag).collect();
        tagged.sort_unstable();
        let key = |tag: &u64| {
            let k = first + (tag & lower) as usize;
            (self.scores[k], self.place(k))
        };
        let alike = tagged.chunk_by_mut(|a, b| a & upper == b & upper);
        alike.filter(|run| run.len() > 1).for_each(|run| run.sort_unstable_by_key(key));
        tagged.into_iter().map(|tag| (tag & lower) as u32).collect()
    }

    /// Decides what can be decided of a piece; what is left of it, if anything.
    fn decide(&self, mut piece: Piece) -> Option<Piece> {
        let mut worse = Vec::new();
        let Piece { first, arounds, cell_of, waiting } = &mut piece;
        waiting.retain(|k| {
            let around = &arounds[cell_of[*k as usize] as usize];
            !self.is_decided(*first + *k as usize, around, &mut worse)
        });
        (!piece.waiting.is_empty()).then_some(piece)
    }

    /// View and index of a point: of equal scores the lower one is better.
    fn place(&self, k: usize) -> u64 {
        self.ranks[self.cells.order[k] as usize].place()
    }

    /// Whether a point is decided, now if it was not before. One that survives drops all worse ones in reach, so that only few points ever
    /// look around. States are written once and never back: whoever reads an old one waits for no reason, and that is all.
    fn is_decided(&self, k: usize, around: &Around, worse: &mut Vec<usize>) -> bool {
        if self.states[k].load(Ordering::Relaxed) != UNDECIDED {
            return true;
        }
        worse.clear();
        let (at, score) = (self.cells.positions[k], self.scores[k]);
        for j in around.points() {
            let state = self.states[j].load(Ordering::Relaxed);
            if state == DROPPED || (self.cells.positions[j] - at).norm_squared() > self.radius_squared || j == k {
                continue;
            }
            let order = self.scores[j].cmp(&score).then_with(|| self.place(j).cmp(&self.place(k)));
            match (order, state) {
                (Greater, _) => worse.push(j),
                (Equal, _) => {}
                (Less, SURVIVES) => {
                    self.states[k].store(DROPPED, Ordering::Relaxed);
                    return true;
                }
                (Less, _) => return false,
            }
        }
        self.states[k].store(SURVIVES, Ordering::Relaxed);
        worse.iter().for_each(|j| self.states[*j].store(DROPPED, Ordering::Relaxed));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
