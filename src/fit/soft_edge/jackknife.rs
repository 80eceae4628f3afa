//! How far an estimate moves when a twelfth of its outline is left out: a covariance that asks nothing of the model.
//!
//! The log-likelihood is a sum over sectors of the outline, `l_j = sum_j log lambda(x_i) - ∫_j lambda`, the density's own
//! logarithm among the parameters. Without sector j one Newton step from the estimate leads to
//! `theta_j = theta - (H - H_j)^-1 g_j` with the sector's score g_j and information H_j: no fit is done again.
//!
//! The sum of these moves' squares is too large a covariance: where points fall as the model says, g_j at the estimate has the covariance
//! `H_j - H_j H^-1 H_j`, and the sum is `H^-1` and another `sum H^-1 H_j H^-1 H_j H^-1`, a twelfth or more of it. Leaving out half of
//! the sector, `(H - H_j / 2)^-1 g_j`, removes that term: the covariance told is the sum of those squares. Where points fall as the
//! model says it agrees with the inverse information H^-1; where voids, clumps or a wavy rim make neighbours err together it is
//! larger.

#![expect(clippy::needless_range_loop, reason = "rows and columns of one small matrix are addressed by number")]

use super::data::{FAR, Region};
use super::likelihood::{Curvature, MAX_ALL, Slope, State, add_presence, effective_area};
use super::normal::distribution;
use super::outline::{MAX_SHAPE, Outline};
use super::sectors::{Cell, Raster, sector};
use super::voids::Cut;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Sectors.
pub const SECTORS: usize = 12;
/// A variance told by twelve sectors has eleven degrees of freedom: 95 % of the errors lie within 2.20 times such a standard
/// deviation (Student), where a reader counts on twice it.
const STUDENT: f64 = 1.10;
/// Stretches of equal length into which the outline is laid out.
const STATIONS: usize = 10 * SECTORS;

/// The outline laid out in stretches: which are left by a cut, and to which sector each belongs. Sectors hold equal lengths of what is
/// left.
struct Layout {
    left: [bool; STATIONS],
    sectors: [usize; STATIONS],
}

impl Layout {
    fn of<O: Outline>(estimate: &Estimate<O>) -> Self {
        let place = |k: usize| estimate.state.outline.place_at((k as f64 + 0.5) / STATIONS as f64);
        let is_left = |k: usize| estimate.cut.is_none_or(|c| !c.cells[estimate.raster.index(&place(k))]);
        let left: [bool; STATIONS] = std::array::from_fn(is_left);
        let total = left.iter().filter(|l| **l).count().max(1);
        let mut passed = 0;
        let sectors = left.map(|is_left| {
            let sector = (passed * SECTORS / total).min(SECTORS - 1);
            passed += usize::from(is_left);
            sector
        });
        Self { left, sectors }
    }

    fn sector(&self, along: f64) -> usize {
        self.sectors[sector(along, STATIONS)]
    }
}

/// What the likelihood of a fit was made of.
pub struct Estimate<'a, O> {
    pub points: &'a [[f64; 2]],
    pub region: &'a Region,
    /// Squares over the whole window.
    pub raster: &'a Raster,
    /// What was cut out of it.
    pub cut: Option<&'a Cut>,
    pub state: &'a State<O>,
    pub clutter: f64,
    pub gradient_sigma: f64,
    /// The parameters that were estimated.
    pub free: &'a [usize],
}

/// What one sector says: derivatives of its share of the log-likelihood.
#[derive(Clone)]
struct Share {
    score: Slope,
    information: Curvature,
    /// Points, and those expected.
    points: f64,
    expected: f64,
    /// Derivatives of the expected number.
    expected_by: Slope,
    /// Length of the outline, mm.
    length: f64,
}

/// The jackknife's covariance of the shape parameters; `None` where too little is left without a sector.
pub fn covariance<O: Outline>(estimate: &Estimate<O>) -> Option<DMatrix<f64>> {
    let moves = moves(estimate, 0.5)?;
    let sum = |a: usize, b: usize| moves.iter().map(|m| m[a] * m[b]).sum::<f64>();
    Some(DMatrix::from_fn(O::SHAPE, O::SHAPE, |a, b| STUDENT * STUDENT * sum(a, b)))
}

/// Moves of the shape parameters when that share of one sector after the other is left out.
pub fn moves<O: Outline>(estimate: &Estimate<O>, left_out: f64) -> Option<Vec<[f64; MAX_SHAPE]>> {
    let shares = shares(estimate);
    let n = estimate.free.len() + 1;
    let blocks: Vec<(DMatrix<f64>, DVector<f64>)> = shares.iter().map(|s| block(s, estimate.free)).collect();
    let mut total = blocks.iter().fold(DMatrix::zeros(n, n), |sum, (h, _)| sum + h);
    for (a, k) in estimate.free.iter().enumerate().filter(|(_, k)| **k > O::SHAPE) {
        debug_assert!(*k < State::<O>::count());
        total[(a, a)] += 1.0 / (estimate.gradient_sigma * estimate.gradient_sigma);
    }
    let mut moves = Vec::with_capacity(SECTORS);
    for ((information, score), _) in blocks.iter().zip(&shares).filter(|(_, s)| s.length > 0.0) {
        let step = Cholesky::new(&total - information * left_out)?.solve(score);
        let mut shape = [0.0; MAX_SHAPE];
        for (a, k) in estimate.free.iter().enumerate().filter(|(_, k)| **k < O::SHAPE) {
            shape[*k] = -step[a];
        }
        moves.push(shape);
    }
    (moves.len() > State::<O>::count()).then_some(moves)
}

/// Score and information of a sector over the free parameters and, last, the logarithm of the density.
fn block(share: &Share, free: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    let n = free.len() + 1;
    let matrix = DMatrix::from_fn(n, n, |a, b| match (free.get(a), free.get(b)) {
        (Some(a), Some(b)) => share.information[*a][*b],
        (Some(k), None) | (None, Some(k)) => share.expected_by[*k],
        (None, None) => share.expected,
    });
    let vector = DVector::from_fn(n, |a, _| match free.get(a) {
        Some(k) => share.score[*k] - share.expected_by[*k],
        None => share.points - share.expected,
    });
    (matrix, vector)
}

fn shares<O: Outline>(estimate: &Estimate<O>) -> Vec<Share> {
    let empty = Share {
        score: [0.0; MAX_ALL],
        information: [[0.0; MAX_ALL]; MAX_ALL],
        points: 0.0,
        expected: 0.0,
        expected_by: [0.0; MAX_ALL],
        length: 0.0,
    };
    let mut shares = vec![empty; SECTORS];
    let outline = &estimate.state.outline;
    let layout = Layout::of(estimate);
    let places = outline.places();
    // What lies deep in the void says nothing of the outline, and by far the most squares of a large hole do.
    let near_mm = FAR * estimate.state.tau_mm + estimate.raster.cell_mm;
    let of_cell = |c: &Cell| (c.part > 0.0 && c.signed_mm > -near_mm).then(|| layout.sector(places(c.place)));
    let sectors: Vec<Option<usize>> = estimate.raster.cells.iter().map(of_cell).collect();
    add_points(estimate, &layout, &sectors, near_mm, &mut shares);
    add_area(estimate, &sectors, &mut shares);
    let (mut area, mut by) = effective_area(estimate.region, estimate.clutter, estimate.state);
    let density = estimate.points.len() as f64 / area;
    take_void(estimate, &sectors, &mut area, &mut by);
    add_rim(estimate, &layout, density, &mut shares);
    balance(area, &by, density, &mut shares);
    for share in &mut shares {
        for a in 0..MAX_ALL {
            for b in 0..a {
                share.information[a][b] = share.information[b][a];
            }
        }
    }
    shares
}

fn add_points<O: Outline>(
    estimate: &Estimate<O>,
    layout: &Layout,
    sectors: &[Option<usize>],
    near_mm: f64,
    shares: &mut [Share],
) {
    let Estimate { raster, state, clutter, region, .. } = estimate;
    let scale = 1.0 / region.reach_mm;
    let first = O::SHAPE + 1;
    let (distance, places, mut ds) = (state.outline.distances(), state.outline.places(), [0.0; MAX_SHAPE]);
    for p in estimate.points {
        let k = raster.index(p);
        let Some(own) = sectors[k] else { continue };
        let near = raster.cells[k].signed_mm.abs() < near_mm;
        let share = &mut shares[if near { layout.sector(places(*p)) } else { own }];
        share.points += 1.0;
        let x = [p[0] * scale, p[1] * scale];
        let inverse = 1.0 / (1.0 + state.gradient[0] * x[0] + state.gradient[1] * x[1]);
        for a in 0..2 {
            share.score[first + a] += x[a] * inverse;
            for b in a..2 {
                share.information[first + a][first + b] += x[a] * x[b] * inverse * inverse;
            }
        }
        if near {
            let s = distance(*p, &mut ds);
            add_presence::<O>(s, &ds, state.tau_mm, *clutter, &mut share.score, &mut share.information);
        }
    }
}

/// Weighted area and first moments of each sector, summed over the squares. Density is left at one: [`balance`] brings it in.
fn add_area<O: Outline>(estimate: &Estimate<O>, sectors: &[Option<usize>], shares: &mut [Share]) {
    let Estimate { raster, state, clutter, region, cut, .. } = estimate;
    let scale = 1.0 / region.reach_mm;
    let side_sq = raster.cell_mm * raster.cell_mm;
    let inverse = (state.tau_mm * state.tau_mm + side_sq / 12.0).sqrt().recip();
    for (k, cell) in raster.cells.iter().enumerate() {
        let Some(sector) = sectors[k].filter(|_| cut.is_none_or(|c| !c.cells[k])) else { continue };
        let share = &mut shares[sector];
        let presence = clutter + (1.0 - clutter) * distribution(cell.signed_mm * inverse);
        let x = [cell.place[0] * scale, cell.place[1] * scale];
        let area = cell.part * side_sq * presence;
        share.expected += area * (1.0 + state.gradient[0] * x[0] + state.gradient[1] * x[1]);
        for a in 0..2 {
            share.expected_by[O::SHAPE + 1 + a] += area * x[a];
        }
    }
}

/// Takes the clutter's area deep in the void out of the whole, and out of its derivatives.
fn take_void<O: Outline>(estimate: &Estimate<O>, sectors: &[Option<usize>], area: &mut f64, by: &mut Slope) {
    let Estimate { raster, state, clutter, region, cut, .. } = estimate;
    let scale = 1.0 / region.reach_mm;
    let mut moments = [0.0; 3];
    for (k, cell) in raster.cells.iter().enumerate() {
        if cell.part > 0.0 && sectors[k].is_none() && cut.is_none_or(|c| !c.cells[k]) {
            moments[0] += cell.part;
            moments[1] += cell.part * cell.place[0] * scale;
            moments[2] += cell.part * cell.place[1] * scale;
        }
    }
    let [whole, u, v] = moments.map(|m| m * clutter * raster.cell_mm * raster.cell_mm);
    *area -= whole + state.gradient[0] * u + state.gradient[1] * v;
    by[O::SHAPE + 1] -= u;
    by[O::SHAPE + 2] -= v;
}

/// How the area changes with the outline, `density` points per mm² of material at the origin: integrals along each sector's part of it, the blur's width across it having mean zero.
fn add_rim<O: Outline>(estimate: &Estimate<O>, layout: &Layout, density: f64, shares: &mut [Share]) {
    let Estimate { state, clutter, region, .. } = estimate;
    let scale = 1.0 / region.reach_mm;
    let length = state.outline.length_mm() / STATIONS as f64;
    let mut ds = [0.0; MAX_SHAPE];
    for k in (0..STATIONS).filter(|k| layout.left[*k]) {
        let place = state.outline.place_at((k as f64 + 0.5) / STATIONS as f64);
        state.outline.signed_mm(place, &mut ds);
        let x = [place[0] * scale, place[1] * scale];
        let share = &mut shares[layout.sectors[k]];
        share.length += length;
        let bare = (1.0 - clutter) * length;
        for a in 0..O::SHAPE {
            share.expected_by[a] += bare * ds[a] * (1.0 + state.gradient[0] * x[0] + state.gradient[1] * x[1]);
            for b in 0..2 {
                share.information[a][O::SHAPE + 1 + b] += bare * ds[a] * x[b] * density;
            }
        }
    }
}

/// The sectors' areas and their derivatives, summed coarsely, made to add up to the exact ones and turned into numbers of points.
fn balance(area: f64, by: &Slope, density: f64, shares: &mut [Share]) {
    let length: f64 = shares.iter().map(|s| s.length).sum();
    let over = area / shares.iter().map(|s| s.expected).sum::<f64>();
    let missing: Vec<f64> =
        (0..MAX_ALL).map(|k| by[k] - shares.iter().map(|s| s.expected_by[k]).sum::<f64>()).collect();
    for share in shares {
        share.expected *= over * density;
        for k in 0..MAX_ALL {
            share.expected_by[k] = (share.expected_by[k] + missing[k] * share.length / length) * density;
        }
    }
}
