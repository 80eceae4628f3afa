//! Where a fit begins that wear must not pull: least trimmed squares over compact parts of the surface.
//!
//! **Problem.** A biweight that begins at the fit of everything has its scale from that fit: half of a surface that is a step lower tilts it, and
//! then nothing stands off. Nobody knows which part is not worn, but wear hangs together, and so does what is not worn.
//!
//! **Way.** The places are put into four by four blocks of about as many each; every rectangle of blocks is fitted by itself, and from its motion
//! the half of all places that lie best is fitted, again and again (concentration steps, Rousseeuw and Van Driessen 2006). The motion whose better
//! half lies best is where the biweight begins (Yohai's MM estimate). No random numbers: the same places give the same bits.

use crate::geometry::{Point3, Vector3, decompose};
use nalgebra::{Matrix3, Matrix6, Vector6};

/// Blocks each way.
const BLOCKS: usize = 4;
/// Fewer places of a rectangle fix no motion.
const LEAST: usize = 12;
/// Places that the starts look at.
const MOST: usize = 1200;
/// Concentration steps of every start, and of the best one.
const STEPS: [usize; 2] = [3, 20];

/// One place: how its difference goes with a motion, the difference, and what it may be off by without wear.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub at: Point3,
    pub row: Vector6<f64>,
    pub difference: f64,
    pub sigma: f64,
}

impl Place {
    /// What a motion leaves of the difference, in its sigmas.
    pub(super) fn left(&self, moves: &Vector6<f64>) -> f64 {
        (self.difference + self.row.dot(moves)) / self.sigma
    }
}

/// Sums of one block or rectangle.
#[derive(Clone, Copy)]
struct Sums {
    information: Matrix6<f64>,
    pull: Vector6<f64>,
    count: usize,
}

impl Sums {
    fn none() -> Self {
        Self { information: Matrix6::zeros(), pull: Vector6::zeros(), count: 0 }
    }

    fn add(&mut self, place: &Place) {
        let weight = 1.0 / (place.sigma * place.sigma);
        self.information += place.row * place.row.transpose() * weight;
        self.pull += place.row * (weight * place.difference);
        self.count += 1;
    }

    fn of<'a>(places: impl Iterator<Item = &'a Place>) -> Self {
        places.fold(Self::none(), |mut sums, place| {
            sums.add(place);
            sums
        })
    }

    /// The motion that takes the differences away, none along motions that the surface leaves free.
    fn solve(&self, held: &Matrix6<f64>) -> Option<Vector6<f64>> {
        let held_back = held * self.information * held;
        let ridge = Matrix6::identity() * (1e-9 * held_back.trace());
        let moves = -(held_back + ridge).cholesky()?.solve(&(held * self.pull));
        moves.iter().all(|v| v.is_finite()).then_some(moves)
    }
}

/// The motion whose better half of the places lies best; `held` projects onto the motions that the surface holds.
pub(super) fn least_trimmed(places: &[Place], held: &Matrix6<f64>) -> Option<Vector6<f64>> {
    let step = places.len().div_ceil(MOST).max(1);
    let some: Vec<Place> = places.iter().step_by(step).copied().collect();
    let mut best: Option<(f64, Vector6<f64>)> = None;
    for start in rectangles(&some) {
        let Some(moves) = start.solve(held).and_then(|moves| concentrated(&some, held, moves, STEPS[0])) else {
            continue;
        };
        if best.is_none_or(|b| moves.0 < b.0) {
            best = Some(moves);
        }
    }
    let (_, moves) = best?;
    concentrated(&some, held, moves, STEPS[1]).map(|(_, moves)| moves)
}

/// Another motion under which places lie that do not under the best one: the largest share of all `places` that one explains within three sigmas.
pub(super) fn second_share(places: &[Place], outlying: &[Place], held: &Matrix6<f64>) -> f64 {
    let step = outlying.len().div_ceil(MOST).max(1);
    let some: Vec<Place> = outlying.iter().step_by(step).copied().collect();
    let lies = |moves: &Vector6<f64>| some.iter().filter(|p| p.left(moves).abs() <= 3.0).count();
    let mut most = 0;
    for start in rectangles(&some) {
        let Some(mut moves) = start.solve(held) else { continue };
        for _ in 0..STEPS[0] {
            most = most.max(lies(&moves));
            let near = Sums::of(some.iter().filter(|p| p.left(&moves).abs() <= 3.0));
            match near.solve(held).filter(|_| near.count >= LEAST) {
                Some(again) => moves = again,
                None => break,
            }
        }
        most = most.max(lies(&moves));
    }
    (most * step) as f64 / places.len().max(1) as f64
}

/// The fit of the better half of the places under a motion, some times over; with the sum of their squares.
fn concentrated(
    places: &[Place],
    held: &Matrix6<f64>,
    mut moves: Vector6<f64>,
    steps: usize,
) -> Option<(f64, Vector6<f64>)> {
    let half = places.len().div_ceil(2).max(LEAST).min(places.len());
    let mut before = f64::INFINITY;
    for _ in 0..steps {
        let mut order: Vec<(f64, usize)> =
            places.iter().enumerate().map(|(k, p)| (p.left(&moves).powi(2), k)).collect();
        order.select_nth_unstable_by(half - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut better: Vec<usize> = order[..half].iter().map(|o| o.1).collect();
        better.sort_unstable();
        moves = Sums::of(better.iter().map(|k| &places[*k])).solve(held)?;
        let squares: f64 = better.iter().map(|k| places[*k].left(&moves).powi(2)).sum();
        if squares >= before * (1.0 - 1e-9) {
            break;
        }
        before = squares;
    }
    Some((before, moves))
}

/// Sums of every rectangle of blocks that holds enough places.
fn rectangles(places: &[Place]) -> Vec<Sums> {
    let Some(blocks) = blocks(places) else { return Vec::new() };
    let mut sums = [[Sums::none(); BLOCKS]; BLOCKS];
    for (place, [i, j]) in places.iter().zip(blocks) {
        sums[i][j].add(place);
    }
    let mut found = Vec::new();
    let spans = || (0..BLOCKS).flat_map(|from| (from..BLOCKS).map(move |to| from..=to));
    for rows in spans() {
        for columns in spans() {
            let mut all = Sums::none();
            for block in rows.clone().flat_map(|i| columns.clone().map(move |j| (i, j))) {
                let one = &sums[block.0][block.1];
                all.information += one.information;
                all.pull += one.pull;
                all.count += one.count;
            }
            if all.count >= LEAST {
                found.push(all);
            }
        }
    }
    found
}

/// Which block each place lies in: by rank along the two longest directions of the surface.
fn blocks(places: &[Place]) -> Option<Vec<[usize; 2]>> {
    let count = places.len();
    if count < LEAST {
        return None;
    }
    let centre = places.iter().map(|p| p.at.coords).sum::<Vector3>() / count as f64;
    let spread: Matrix3<f64> = places.iter().map(|p| (p.at.coords - centre) * (p.at.coords - centre).transpose()).sum();
    let eigen = decompose::symmetric_eigen(spread / spread.trace().max(f64::MIN_POSITIVE))?;
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let mut blocks = vec![[0, 0]; count];
    for (side, axis) in axes[..2].iter().enumerate() {
        let along = |k: usize| (places[k].at.coords - centre).dot(&eigen.eigenvectors.column(*axis));
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| along(*a).total_cmp(&along(*b)).then(a.cmp(b)));
        order.iter().enumerate().for_each(|(rank, k)| blocks[*k][side] = rank * BLOCKS / count);
    }
    Some(blocks)
}
