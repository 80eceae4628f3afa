//! Damped Newton on the soft-edge likelihood.

use super::Window;
use super::likelihood::{Data, Evaluation, MAX_ALL, State, density_per_mm2, evaluate};
use super::outline::{MAX_SHAPE, Outline};
use nalgebra::{Cholesky, DMatrix, DVector};

/// How a fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftEdgeSettings {
    /// Typical distance between neighbouring points, mm: bounds the blur.
    pub spacing_mm: f64,
    /// Share of clutter where there is no material, to start from.
    pub clutter: f64,
    /// Standard deviation of the prior on the density gradient over the window's reach.
    pub gradient_sigma: f64,
    /// Fix the blur at this value (to search from afar) instead of estimating it.
    pub fixed_tau_mm: Option<f64>,
    /// Blur to start from, mm.
    pub start_tau_mm: f64,
    /// Density gradient to start from, over the window's reach.
    pub start_gradient: [f64; 2],
    /// The iteration has arrived when a step moves the outline by less than this, in spacings.
    pub tolerance: f64,
    /// Shape parameters kept at their start value, one flag each.
    pub fixed_shape: [bool; MAX_SHAPE],
}

impl SoftEdgeSettings {
    /// Everything estimated, for points of that spacing.
    pub fn new(spacing_mm: f64) -> Self {
        Self {
            spacing_mm,
            clutter: 0.005,
            gradient_sigma: 0.3,
            fixed_tau_mm: None,
            start_tau_mm: 0.5 * spacing_mm,
            start_gradient: [0.0; 2],
            tolerance: 1e-3,
            fixed_shape: [false; MAX_SHAPE],
        }
    }

    /// Blur fixed at a value and a coarse end: a wide basin of attraction, for the search.
    pub fn with_tau(self, tau_mm: f64) -> Self {
        Self { fixed_tau_mm: Some(tau_mm), tolerance: 0.05, ..self }
    }
}

/// Blur in spacings: an edge sharper than the lower bound cannot be told from it, a softer one is no edge.
const TAU_BOUNDS: [f64; 2] = [0.1, 1.5];

/// First-order bias of the estimate (Cox and Snell) as a shift of the whole outline into the material, in units of
/// (shape parameters) / (points per mm² x length): `c3 / (2 c2²)` with `c2 = -∫ Phi (ln Phi)''` = 0.9032 and
/// `c3 = ∫ Phi (ln Phi)'''` = 0.5956. It does not depend on the blur.
const SKEWNESS_SHIFT: f64 = 0.365;

/// An outline as estimated.
#[derive(Debug, Clone)]
pub struct SoftEdgeFit<O> {
    /// The outline.
    pub outline: O,
    /// Covariance of its shape parameters (their units), inverse observed information; density gradient and blur are
    /// accounted for. Fixed parameters have zero rows.
    pub covariance: DMatrix<f64>,
    /// Blur of the edge, mm.
    pub tau_mm: f64,
    /// Density gradient over the window's reach.
    pub gradient: [f64; 2],
    /// Share of clutter where there is no material.
    pub clutter: f64,
    /// Points per mm² on material.
    pub density_per_mm2: f64,
    /// Log-likelihood with the density profiled out.
    pub log_likelihood: f64,
    /// Newton steps.
    pub iterations: usize,
    /// Whether the last step was below the tolerance.
    pub converged: bool,
    /// Points in the window.
    pub points: usize,
}

/// Why there is no outline.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SoftEdgeError {
    /// Fewer points than the model needs.
    #[error("{found} points stand within the window, {needed} are needed")]
    TooFewPoints {
        /// Points in the window.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// The points do not tell where the outline is, or the search left the window.
    #[error("the points show no edge of this shape")]
    NoEdge,
}

/// Fits an outline from a start that is good to a few spacings, the clutter included: fit, count the points deep in the
/// void, fit again.
pub fn fit_soft_edge<O: Outline>(
    points: &[[f64; 2]],
    window: Window,
    start: &O,
    settings: &SoftEdgeSettings,
) -> Result<SoftEdgeFit<O>, SoftEdgeError> {
    let mut settings = *settings;
    let mut fit = refine_soft_edge(points, window, start, &settings)?;
    for _ in 0..3 {
        let clutter = clutter_share(points, &fit.outline, &window, settings.spacing_mm);
        if (clutter - settings.clutter).abs() < 0.1 * settings.clutter {
            break;
        }
        settings.clutter = clutter;
        settings.start_tau_mm = fit.tau_mm;
        settings.start_gradient = fit.gradient;
        fit = refine_soft_edge(points, window, &fit.outline.clone(), &settings)?;
    }
    Ok(fit)
}

/// Share of clutter: points deep in the void over those expected there were it material, with a prior of 0.5 % on eight
/// expected points to steady it. The window's density is taken from the points outside the outline.
pub fn clutter_share<O: Outline>(points: &[[f64; 2]], outline: &O, window: &Window, spacing_mm: f64) -> f64 {
    const PRIOR: (f64, f64) = (0.005, 8.0);
    // The void at a depth follows from moving the outline by the parameter that moves it along its normal.
    let mut step = [0.0; MAX_SHAPE];
    step[O::DEPTH.0] = -1.5 * spacing_mm * O::DEPTH.1;
    let inner = outline.moved(&step[..O::SHAPE]);
    let material = window.moments[0] - outline.void(0.0).0[0];
    if !inner.is_sound() || material <= 0.0 {
        return PRIOR.0;
    }
    let mut unused = [0.0; MAX_SHAPE];
    let count = |o: &O, unused: &mut [f64; MAX_SHAPE]| points.iter().filter(|p| o.signed_mm(**p, unused) < 0.0).count();
    let (deep, inside) = (count(&inner, &mut unused), count(outline, &mut unused));
    let density = (points.len() - inside) as f64 / material;
    let expected = (inner.void(0.0).0[0] * density).max(0.0);
    ((deep as f64 + PRIOR.0 * PRIOR.1) / (expected + PRIOR.1)).clamp(0.001, 0.5)
}

/// Fits an outline with the clutter as given.
pub fn refine_soft_edge<O: Outline>(
    points: &[[f64; 2]],
    window: Window,
    start: &O,
    settings: &SoftEdgeSettings,
) -> Result<SoftEdgeFit<O>, SoftEdgeError> {
    const MAX_STEPS: usize = 60;
    let needed = 4 * State::<O>::count();
    if points.len() < needed {
        return Err(SoftEdgeError::TooFewPoints { found: points.len(), needed });
    }
    let h = settings.spacing_mm;
    let data = Data { points, window, clutter: settings.clutter, gradient_sigma: settings.gradient_sigma };
    let tau_range = settings.fixed_tau_mm.map_or(TAU_BOUNDS.map(|b| b * h), |tau| [tau, tau]);
    let mut state = State {
        outline: start.clone(),
        tau_mm: settings.fixed_tau_mm.unwrap_or(settings.start_tau_mm.clamp(tau_range[0], tau_range[1])),
        gradient: settings.start_gradient,
    };
    let mut at = evaluate(&data, &state).ok_or(SoftEdgeError::NoEdge)?;
    let (mut damping, mut converged, mut iterations) = (1e-3, false, 0);
    while iterations < MAX_STEPS && !converged {
        iterations += 1;
        let free = free_parameters(&state, &at, settings, tau_range);
        let mut moved = None;
        while damping < 1e9 && moved.is_none() {
            let step = damped_step(&state.outline, &at, &free, damping, h);
            let mut next = state.moved(&step);
            next.tau_mm = next.tau_mm.clamp(tau_range[0], tau_range[1]);
            match evaluate(&data, &next) {
                // Equal within rounding counts as arrived, or the last steps would go on for ever.
                Some(there) if there.value >= at.value - 1e-9 * (1.0 + at.value.abs() * 1e-3) => {
                    moved = Some((next, step, there));
                }
                _ => damping = (damping * 8.0).max(1e-4),
            }
        }
        let Some((next, step, there)) = moved else { break };
        damping *= 0.1;
        let shape_step = shape_step_mm::<O>(&step, &window);
        converged = shape_step < settings.tolerance * h && (next.tau_mm / state.tau_mm).ln().abs() < 0.05;
        state = next;
        at = there;
    }
    let free = free_parameters(&state, &at, settings, tau_range);
    // Near its lower bound the blur hangs on single points, and the curvature may bend the wrong way along it: it counts as known
    // then.
    let without_tau: Vec<usize> = free.iter().copied().filter(|k| *k != O::SHAPE).collect();
    let covariance = covariance::<O>(&at, &free).or_else(|| covariance::<O>(&at, &without_tau));
    let covariance = covariance.ok_or(SoftEdgeError::NoEdge)?;
    let density = density_per_mm2(&data, &state);
    let outline = if settings.fixed_tau_mm.is_some() { state.outline } else { without_bias(&state.outline, density) };
    Ok(SoftEdgeFit {
        outline,
        covariance,
        tau_mm: state.tau_mm,
        gradient: state.gradient,
        clutter: settings.clutter,
        density_per_mm2: density,
        log_likelihood: at.value,
        iterations,
        converged,
        points: points.len(),
    })
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
fn shape_step_mm<O: Outline>(step: &[f64; MAX_ALL], window: &Window) -> f64 {
    (0..O::SHAPE).map(|k| step[k].abs() * if O::IS_ANGLE[k] { window.reach_mm } else { 1.0 }).fold(0.0, f64::max)
}

/// Shape block of the inverse observed information over the free parameters.
fn covariance<O: Outline>(at: &Evaluation, free: &[usize]) -> Option<DMatrix<f64>> {
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

/// Share of the outline's length beside which points stand in a band of material: the length is cut into sectors, at most
/// 36, long enough that four points are expected in each.
pub fn covered_share<O: Outline>(points: &[[f64; 2]], outline: &O, spacing_mm: f64) -> f64 {
    let band_mm = 2.5 * spacing_mm;
    let sectors = ((outline.length_mm() / (1.6 * spacing_mm)) as usize).clamp(1, 36);
    let mut seen = vec![false; sectors];
    let mut unused = [0.0; MAX_SHAPE];
    for p in points {
        let along = outline.along(*p);
        if (-0.5 * spacing_mm..band_mm).contains(&outline.signed_mm(*p, &mut unused)) && (0.0..1.0).contains(&along) {
            seen[((along * sectors as f64) as usize).min(sectors - 1)] = true;
        }
    }
    seen.iter().filter(|s| **s).count() as f64 / sectors as f64
}
