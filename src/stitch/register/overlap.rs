//! Which views may overlap, by the cells of a hash grid that they occupy.

use super::surface::Surface;
use crate::geometry::{Isometry3, Point3};
use std::collections::{BTreeMap, BTreeSet};

/// Side of a cell in distances of patches: about 8 d_grid.
const CELL_SPACINGS: f64 = 4.5;

/// A view in a pose that is known to a distance.
pub(super) struct Guess<'a> {
    pub view: usize,
    pub surface: &'a Surface,
    pub world_from_view: Isometry3,
    /// How far its places may be off.
    pub off: f64,
}

/// Pairs of views of which at least a share of the smaller one may lie on the other, each view with its best `most` neighbours at least;
/// by number of the views, the lower one first.
pub(super) fn candidates(guesses: &[Guess], least_share: f64, most: usize) -> Vec<(usize, usize)> {
    let Some(side) = cell_side(guesses) else { return Vec::new() };
    let cell = |p: Point3| [p.x, p.y, p.z].map(|c| (c / side).floor() as i64);
    // Of each cell the views with a patch in it or in a cell beside it.
    let mut reached: BTreeMap<[i64; 3], BTreeSet<usize>> = BTreeMap::new();
    let mut own: Vec<BTreeMap<[i64; 3], usize>> = Vec::with_capacity(guesses.len());
    for (k, guess) in guesses.iter().enumerate() {
        let mut cells: BTreeMap<[i64; 3], usize> = BTreeMap::new();
        guess
            .surface
            .patches
            .iter()
            .for_each(|p| *cells.entry(cell(guess.world_from_view * p.centre)).or_default() += 1);
        for at in cells.keys() {
            for step in 0..27 {
                let beside = [at[0] + step % 3 - 1, at[1] + step / 3 % 3 - 1, at[2] + step / 9 - 1];
                reached.entry(beside).or_default().insert(k);
            }
        }
        own.push(cells);
    }
    let mut shared: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for (k, cells) in own.iter().enumerate() {
        for (at, count) in cells {
            for other in reached.get(at).into_iter().flatten().filter(|other| **other != k) {
                *shared.entry((k, *other)).or_default() += count;
            }
        }
    }
    let size = |k: usize| guesses[k].surface.patches.len();
    let share = |a: usize, b: usize| {
        let of = |k: usize, other: usize| shared.get(&(k, other)).map_or(0.0, |n| *n as f64 / size(k) as f64);
        if size(a) <= size(b) { of(a, b) } else { of(b, a) }
    };
    best(guesses, share, least_share, most)
}

/// The best neighbours of each view.
fn best(guesses: &[Guess], share: impl Fn(usize, usize) -> f64, least: f64, most: usize) -> Vec<(usize, usize)> {
    let mut chosen = BTreeSet::new();
    for a in 0..guesses.len() {
        let others = (0..guesses.len()).filter(|b| *b != a).map(|b| (share(a, b), b));
        let mut near: Vec<(f64, usize)> = others.filter(|(share, _)| *share >= least).collect();
        near.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        for (_, b) in near.into_iter().take(most) {
            let (a, b) = (guesses[a].view, guesses[b].view);
            chosen.insert((a.min(b), a.max(b)));
        }
    }
    chosen.into_iter().collect()
}

/// Cells are as wide as the views may be off: what may overlap then lies in cells beside each other.
fn cell_side(guesses: &[Guess]) -> Option<f64> {
    let widest = |of: fn(&Guess) -> f64| guesses.iter().map(of).fold(0.0, f64::max);
    let side = widest(|g| CELL_SPACINGS * g.surface.spacing).max(2.0 * widest(|g| g.off));
    (side > 0.0 && side.is_finite()).then_some(side)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::RunContext;
    use crate::stitch::register::synthetic_tests::{Part, look};

    #[test]
    fn views_beside_each_other_are_candidates_and_far_ones_are_not() {
        let part = Part::formed();
        let views = [0.0, 14.0, 60.0].map(|x| look(&part, "v", [x, 0.0], 20.0, 0.5, 0.01, x as u64));
        let surfaces = views.each_ref().map(|v| Surface::new(&v.view, None, &RunContext::silent()).ok().unwrap());
        let guess = |k: usize| Guess { view: k, surface: &surfaces[k], world_from_view: views[k].truth, off: 0.5 };
        let guesses: Vec<Guess> = (0..3).map(guess).collect();
        assert_eq!(candidates(&guesses, 0.15, 8), [(0, 1)]);
        assert!(candidates(&[], 0.15, 8).is_empty());
    }
}
