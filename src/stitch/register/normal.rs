//! Normal equations of many views' motions: symmetric, in blocks of six, few of them other than zero.
//!
//! Views are put in an order in which neighbours stand close together (Cuthill and McKee 1969, reversed), so that the Cholesky factor has entries only
//! from each row's first neighbour on: the cost grows with the number of views times the square of how far neighbours stand apart, where that
//! of a full matrix grows with the third power of their number.

use crate::run::{Cancelled, RunContext};
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// The equations, blocks at or below the diagonal, by place in the order.
pub(super) struct Normal {
    /// Of each view its place.
    place: Vec<usize>,
    rows: Vec<Row>,
    right: Vec<Vector6<f64>>,
}

/// Blocks of a row from its first one other than zero to the diagonal.
struct Row {
    first: usize,
    blocks: Vec<Matrix6<f64>>,
}

/// What solves them; kept for covariances.
pub(super) struct Solved {
    /// One motion for each view.
    pub motions: Vec<Vector6<f64>>,
    /// Knows their covariances.
    pub factor: Factor,
}

/// The lower factor.
pub(super) struct Factor {
    place: Vec<usize>,
    rows: Vec<Row>,
}

impl Normal {
    /// Nothing asked yet, of so many views of which some are neighbours.
    pub(super) fn new(count: usize, neighbours: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut near = vec![BTreeSet::new(); count];
        for (a, b) in neighbours.filter(|(a, b)| a != b) {
            near[a].insert(b);
            near[b].insert(a);
        }
        let mut place = vec![0; count];
        order(&near).into_iter().enumerate().for_each(|(at, view)| place[view] = at);
        let mut first: Vec<usize> = (0..count).collect();
        for (view, near) in near.iter().enumerate() {
            let places = near.iter().map(|other| place[*other]);
            first[place[view]] = places.fold(place[view], usize::min);
        }
        let row = |(at, first): (usize, usize)| Row { first, blocks: vec![Matrix6::zeros(); at + 1 - first] };
        let rows = first.into_iter().enumerate().map(row).collect();
        Self { place, rows, right: vec![Vector6::zeros(); count] }
    }

    /// Adds to the block of two views; each pair of different ones once, in either order of the two.
    ///
    /// # Panics
    /// Where they are no neighbours.
    pub(super) fn add(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
        let (r, c) = (self.place[row], self.place[column]);
        let row = &mut self.rows[r.max(c)];
        let place = &mut row.blocks[r.min(c) - row.first];
        *place += if r < c { block.transpose() } else { *block };
    }

    /// Adds to the right side of a view.
    pub(super) fn ask(&mut self, view: usize, block: &Vector6<f64>) {
        self.right[self.place[view]] += block;
    }

    /// Solves them; `None` where views are not held.
    ///
    /// # Errors
    /// The job was stopped.
    pub(super) fn solve(self, run: &RunContext) -> Result<Option<Solved>, Cancelled> {
        let Self { place, mut rows, right } = self;
        for at in 0..rows.len() {
            run.check()?;
            let (above, from) = rows.split_at_mut(at);
            if factor_row(above, &mut from[0]).is_none() {
                return Ok(None);
            }
        }
        let factor = Factor { place, rows };
        let solution = factor.backward(factor.forward(0, right));
        let motions: Vec<Vector6<f64>> = factor.place.iter().map(|at| solution[*at]).collect();
        let finite = motions.iter().all(|m| m.iter().all(|v| v.is_finite()));
        Ok(finite.then_some(Solved { motions, factor }))
    }
}

/// Takes a row of the matrix to that of the factor; `None` where it is not positive definite.
fn factor_row(above: &[Row], row: &mut Row) -> Option<()> {
    for (column, other) in above.iter().enumerate().skip(row.first) {
        let from = row.first.max(other.first);
        let mut block = row.blocks[column - row.first];
        for k in from..column {
            block -= row.blocks[k - row.first] * other.blocks[k - other.first].transpose();
        }
        let diagonal = other.blocks.last()?;
        row.blocks[column - row.first] = diagonal.solve_lower_triangular(&block.transpose())?.transpose();
    }
    let (diagonal, rest) = row.blocks.split_last_mut()?;
    rest.iter().for_each(|block| *diagonal -= block * block.transpose());
    *diagonal = diagonal.cholesky()?.l();
    Some(())
}

impl Factor {
    /// The inverse of the factor times a right side that is zero before a place; told from that place on.
    fn forward<const C: usize>(
        &self,
        from: usize,
        mut right: Vec<nalgebra::SMatrix<f64, 6, C>>,
    ) -> Vec<nalgebra::SMatrix<f64, 6, C>> {
        for at in from..self.rows.len() {
            let Row { first, blocks } = &self.rows[at];
            let mut value = right[at - from];
            for column in (*first).max(from)..at {
                value -= blocks[column - first] * right[column - from];
            }
            // The factor's diagonal is positive.
            right[at - from] = blocks[at - first].solve_lower_triangular(&value).unwrap_or(value);
        }
        right
    }

    /// The inverse of the factor's transpose times that.
    fn backward(&self, mut right: Vec<Vector6<f64>>) -> Vec<Vector6<f64>> {
        for at in (0..self.rows.len()).rev() {
            let Row { first, blocks } = &self.rows[at];
            let value = blocks[at - first].tr_solve_lower_triangular(&right[at]).unwrap_or(right[at]);
            right[at] = value;
            for column in *first..at {
                right[column] -= blocks[column - first].transpose() * value;
            }
        }
        right
    }

    /// Covariance of each view's motion.
    ///
    /// # Errors
    /// The job was stopped.
    pub(super) fn covariances(&self, run: &RunContext) -> Result<Vec<Matrix6<f64>>, Cancelled> {
        let of = |at: &usize| {
            run.check()?;
            let mut right = vec![Matrix6::zeros(); self.rows.len() - at];
            right[0] = Matrix6::identity();
            Ok(self.forward(*at, right).iter().fold(Matrix6::zeros(), |sum, y| sum + y.transpose() * y))
        };
        self.place.par_iter().map(of).collect()
    }
}

/// Views in an order in which neighbours stand close together.
fn order(near: &[BTreeSet<usize>]) -> Vec<usize> {
    let mut seen = vec![false; near.len()];
    let mut found = Vec::with_capacity(near.len());
    let mut starts: Vec<usize> = (0..near.len()).collect();
    starts.sort_by_key(|view| (near[*view].len(), *view));
    for start in starts {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut at = found.len();
        found.push(start);
        while let Some(view) = found.get(at).copied() {
            at += 1;
            let mut next: Vec<usize> = near[view].iter().copied().filter(|other| !seen[*other]).collect();
            next.sort_by_key(|other| (near[*other].len(), *other));
            next.iter().for_each(|other| seen[*other] = true);
            found.extend(next);
        }
    }
    found.reverse();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::seq::SliceRandom;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A strip of views two wide, in a shuffled order, against the full matrix.
    #[test]
    fn it_solves_what_the_full_matrix_does_and_knows_its_inverse() {
        const COUNT: usize = 40;
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut names: Vec<usize> = (0..COUNT).collect();
        names.shuffle(&mut rng);
        let pairs: Vec<(usize, usize)> =
            (0..COUNT).flat_map(|k| [k + 1, k + 2].map(|j| (k, j))).filter(|(_, j)| *j < COUNT).collect();
        let pairs: Vec<(usize, usize)> = pairs.iter().map(|(a, b)| (names[*a], names[*b])).collect();
        let mut normal = Normal::new(COUNT, pairs.iter().copied());
        // As far as two neighbours of the strip, in whatever order.
        assert!(normal.rows.iter().all(|row| row.blocks.len() <= 4));
        let mut full = DMatrix::<f64>::zeros(6 * COUNT, 6 * COUNT);
        let mut right = DVector::<f64>::zeros(6 * COUNT);
        let mut random = || Matrix6::from_fn(|_, _| rng.random::<f64>() - 0.5);
        for (a, b) in &pairs {
            let block = random();
            normal.add(*a, *b, &block);
            let mut place = full.fixed_view_mut::<6, 6>(6 * a, 6 * b);
            place += block;
            let mut place = full.fixed_view_mut::<6, 6>(6 * b, 6 * a);
            place += block.transpose();
        }
        for view in 0..COUNT {
            let block = Matrix6::identity() * 20.0;
            normal.add(view, view, &block);
            let mut place = full.fixed_view_mut::<6, 6>(6 * view, 6 * view);
            place += block;
            let asked = random().column(0).into_owned();
            normal.ask(view, &asked);
            right.fixed_rows_mut::<6>(6 * view).copy_from(&asked);
        }
        let run = RunContext::silent();
        let Solved { motions, factor } = normal.solve(&run).unwrap().unwrap();
        let whole = full.clone().cholesky().unwrap();
        let (solution, inverse) = (whole.solve(&right), whole.inverse());
        let covariances = factor.covariances(&run).unwrap();
        for view in 0..COUNT {
            let off = (motions[view] - solution.fixed_rows::<6>(6 * view)).amax();
            let inverse = inverse.fixed_view::<6, 6>(6 * view, 6 * view);
            // Entries below one, a condition of some tens: a few digits of 1e-16.
            assert!(off < 1e-13 && (covariances[view] - inverse).amax() < 1e-13, "{view}: {off}");
        }
    }

    #[test]
    fn what_is_not_held_has_no_solution() {
        let normal = Normal::new(3, [(0, 1)].into_iter());
        assert!(normal.solve(&RunContext::silent()).unwrap().is_none());
    }
}
