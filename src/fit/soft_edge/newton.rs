//! Damped Newton on the soft-edge likelihood.

use super::data::{Data, Region};
use super::fit::{SoftEdgeError, SoftEdgeFit, SoftEdgeSettings};
use super::likelihood::{Evaluation, MAX_ALL, State, effective_area, evaluate};
use super::outline::{MAX_SHAPE, Outline};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Blur in spacings: an edge sharper than the lower bound cannot be told from it, a softer one is no edge.
const TAU_BOUNDS: [f64; 2] = [0.1, 1.5];

/// First-order bias of the estimate (Cox and Snell) as a shift of the whole outline into the material, in units of
/// (shape parameters) / (points per mm² x length): `c3 / (2 c2²)` with `c2 = -∫ Phi (ln Phi)''` = 0.9032 and
/// `c3 = ∫ Phi (ln Phi)'''` = 0.5956. It does not depend on the blur.
const SKEWNESS_SHIFT: f64 = 0.365;

/// A fit and what the jackknife needs to know of it.
pub struct Refined<O> {
    pub fit: SoftEdgeFit<O>,
    /// Where the likelihood is largest.
    pub state: State<O>,
    /// The parameters that were estimated.
    pub free: Vec<usize>,
}

pub fn refine<O: Outline>(
    points: &[[f64; 2]],
    region: &Region,
    start: &O,
    settings: &SoftEdgeSettings,
) -> Result<Refined<O>, SoftEdgeError> {
    let needed = 4 * State::<O>::count();
    if points.len() < needed {
        return Err(SoftEdgeError::TooFewPoints { found: points.len(), needed });
    }
    let h = settings.spacing_mm;
    let tau_range = settings.fixed_tau_mm.map_or(TAU_BOUNDS.map(|b| b * h), |tau| [tau, tau]);
    let start = State {
        outline: start.clone(),
        tau_mm: settings.fixed_tau_mm.unwrap_or(settings.start_tau_mm.clamp(tau_range[0], tau_range[1])),
        gradient: settings.start_gradient,
    };
    let mut data = Data::new(points, region, settings.clutter, settings.gradient_sigma, &start);
    let Climbed { state, at, converged, iterations } = climb(&mut data, start, settings, tau_range)?;
    let mut free = free_parameters(&state, &at, settings, tau_range);
    let mut covariance = information_covariance::<O>(&at, &free);
    if covariance.is_none() {
        // Near its lower bound the blur hangs on single points, and the curvature may bend the wrong way along it: it counts as
        // known then.
        free.retain(|k| *k != O::SHAPE);
        covariance = information_covariance::<O>(&at, &free);
    }
    let covariance = covariance.ok_or(SoftEdgeError::NoEdge)?;
    let density = points.len() as f64 / effective_area(region, settings.clutter, &state).0;
    let outline =
        if settings.fixed_tau_mm.is_some() { state.outline.clone() } else { without_bias(&state.outline, density) };
    let fit = SoftEdgeFit {
        outline,
        information: covariance.clone(),
        covariance,
        jackknife: None,
        tau_mm: state.tau_mm,
        gradient: state.gradient,
        clutter: settings.clutter,
        density_per_mm2: density,
        log_likelihood: at.value,
        iterations,
        converged,
        points: points.len(),
        outline_seen: f64::NAN,
        kept: None,
    };
    Ok(Refined { fit, state, free })
}

/// Where Newton's iteration has led.
struct Climbed<O> {
    state: State<O>,
    at: Evaluation,
    converged: bool,
    iterations: usize,
}

fn climb<O: Outline>(
    data: &mut Data<O>,
    start: State<O>,
    settings: &SoftEdgeSettings,
    tau_range: [f64; 2],
) -> Result<Climbed<O>, SoftEdgeError> {
    const MAX_STEPS: usize = 60;
    let (h, reach_mm) = (settings.spacing_mm, data.region.reach_mm);
    let mut state = start;
    let mut at = evaluate(data, &state).ok_or(SoftEdgeError::NoEdge)?;
    let (mut damping, mut converged, mut iterations) = (1e-3, false, 0);
    while iterations < MAX_STEPS && !converged {
        iterations += 1;
        let free = free_parameters(&state, &at, settings, tau_range);
        let mut moved = None;
        while damping < 1e9 && moved.is_none() {
            let step = damped_step(&state.outline, &at, &free, damping, h);
            let mut next = state.moved(&step);
            next.tau_mm = next.tau_mm.clamp(tau_range[0], tau_range[1]);
            data.follow(&next);
            match evaluate(data, &next) {
                // Equal within rounding counts as arrived, or the last steps would go on for ever.
                Some(there) if there.value >= at.value - 1e-9 * (1.0 + at.value.abs() * 1e-3) => {
                    moved = Some((next, step, there));
                }
                _ => damping = (damping * 8.0).max(1e-4),
            }
        }
        let Some((next, step, there)) = moved else { break };
        damping *= 0.1;
        let shape_step = shape_step_mm::<O>(&step, reach_mm);
        converged = shape_step < settings.tolerance * h && (next.tau_mm / state.tau_mm).ln().abs() < 0.05;
        state = next;
        at = there;
    }
    if converged {
        // What is known of this place already tells the next one: a step that squares what is left, without another look at the points.
        let free = free_parameters(&state, &at, settings, tau_range);
        let step = damped_step(&state.outline, &at, &free, 0.0, h);
        let next = state.moved(&step);
        if shape_step_mm::<O>(&step, reach_mm) < settings.tolerance * h && next.outline.is_sound() {
            state = State { tau_mm: next.tau_mm.clamp(tau_range[0], tau_range[1]), ..next };
        }
    }
    Ok(Climbed { state, at, converged, iterations })
}

/// The outline moved back by its first-order bias; it matters for few points along a short outline only.
fn without_bias<O: Outline>(outline: &O, density_per_mm2: f64) -> O {
    let shift = SKEWNESS_SHIFT * O::SHAPE as f64 / (density_per_mm2 * outline.length_mm());
    let mut step = [0.0; MAX_SHAPE];
    step[O::DEPTH.0] = -O::DEPTH.1 * shift;
    let moved = outline.moved(&step[..O::SHAPE]);
    if moved.is_sound() { moved } else { outline.clone() }
}

/// Indices of the parameters that may move: not those fixed, nor a blur that presses against its bound.
fn free_parameters<O: Outline>(
    state: &State<O>,
    at: &Evaluation,
    settings: &SoftEdgeSettings,
    tau_range: [f64; 2],
) -> Vec<usize> {
    let pressed = (state.tau_mm <= tau_range[0] && at.slope[O::SHAPE] <= 0.0)
        || (state.tau_mm >= tau_range[1] && at.slope[O::SHAPE] >= 0.0);
    (0..State::<O>::count())
        .filter(|&k| if k < O::SHAPE { !settings.fixed_shape[k] } else { k != O::SHAPE || !pressed })
        .collect()
}

/// A Newton step with Marquardt's damping; no parameter moves the outline by more than two spacings or a blur.
fn damped_step<O: Outline>(
    outline: &O,
    at: &Evaluation,
    free: &[usize],
    damping: f64,
    spacing_mm: f64,
) -> [f64; MAX_ALL] {
    let n = free.len();
    let matrix = DMatrix::from_fn(n, n, |a, b| {
        let value = at.curvature[free[a]][free[b]];
        // Where the likelihood bends the wrong way its size still says how far a step may go.
        if a == b { value.abs() * (1.0 + damping) + damping * 1e-3 + (value.abs() - value) } else { value }
    });
    let right = DVector::from_fn(n, |a, _| at.slope[free[a]]);
    let mut step = [0.0; MAX_ALL];
    let mut boosted = matrix.clone();
    let solution = loop {
        match Cholesky::new(boosted.clone()) {
            Some(c) => break c.solve(&right),
            None => (0..n).for_each(|k| boosted[(k, k)] += 0.1 * matrix[(k, k)].abs() + 1e-9),
        }
        if boosted[(0, 0)] > 1e6 * matrix[(0, 0)].abs() + 1.0 {
            return step;
        }
    };
    for (k, value) in free.iter().zip(solution.iter()) {
        step[*k] = *value;
    }
    let limits = outline.step_limits(spacing_mm);
    let mut shrink: f64 = 1.0;
    for k in 0..MAX_ALL {
        let limit = if k < O::SHAPE { limits[k] } else { 0.7 };
        if step[k].abs() > limit {
            shrink = shrink.min(limit / step[k].abs());
        }
    }
    step.iter_mut().for_each(|v| *v *= shrink);
    step
}

/// The largest displacement of the outline that a step makes, roughly, mm.
fn shape_step_mm<O: Outline>(step: &[f64; MAX_ALL], reach_mm: f64) -> f64 {
    (0..O::SHAPE).map(|k| step[k].abs() * if O::IS_ANGLE[k] { reach_mm } else { 1.0 }).fold(0.0, f64::max)
}

/// Shape block of the inverse observed information over the free parameters.
fn information_covariance<O: Outline>(at: &Evaluation, free: &[usize]) -> Option<DMatrix<f64>> {
    let n = free.len();
    let information =
        DMatrix::from_fn(n, n, |a, b| 0.5 * (at.curvature[free[a]][free[b]] + at.curvature[free[b]][free[a]]));
    let inverse = Cholesky::new(information)?.inverse();
    let mut out = DMatrix::zeros(O::SHAPE, O::SHAPE);
    for (a, &ka) in free.iter().enumerate().filter(|(_, k)| **k < O::SHAPE) {
        for (b, &kb) in free.iter().enumerate().filter(|(_, k)| **k < O::SHAPE) {
            out[(ka, kb)] = inverse[(a, b)];
        }
    }
    Some(out)
}
