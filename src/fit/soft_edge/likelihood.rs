//! The profiled log-likelihood with its gradient and curvature.

#![expect(clippy::needless_range_loop, reason = "rows and columns of one small matrix are addressed by number")]

use super::Window;
use super::normal::distribution_and_density;
use super::outline::{MAX_SHAPE, Moments, Outline};

/// Most parameters: shape, ln tau, gradient along u and v.
pub const MAX_ALL: usize = MAX_SHAPE + 3;

/// Everything that is estimated. The density gradient is told over the window's reach, so it has no unit.
#[derive(Debug, Clone)]
pub struct State<O> {
    pub outline: O,
    pub tau_mm: f64,
    pub gradient: [f64; 2],
}

impl<O: Outline> State<O> {
    /// Number of parameters in use.
    pub const fn count() -> usize {
        O::SHAPE + 3
    }

    /// The state after a step in (shape, ln tau, gradient).
    pub fn moved(&self, step: &[f64]) -> Self {
        let s = O::SHAPE;
        Self {
            outline: self.outline.moved(&step[..s]),
            tau_mm: self.tau_mm * step[s].exp(),
            gradient: [self.gradient[0] + step[s + 1], self.gradient[1] + step[s + 2]],
        }
    }
}

/// What stays fixed while the state is estimated.
pub struct Data<'a> {
    /// Points in the window, (u, v) in mm.
    pub points: &'a [[f64; 2]],
    pub window: Window,
    /// Share of clutter where there is no material.
    pub clutter: f64,
    /// Standard deviation of the prior on the density gradient; keeps it from imitating an edge.
    pub gradient_sigma: f64,
}

/// Value, gradient and (negative, approximate) curvature at a state.
#[derive(Clone)]
pub struct Evaluation {
    pub value: f64,
    pub slope: [f64; MAX_ALL],
    pub curvature: [[f64; MAX_ALL]; MAX_ALL],
}

/// Relative density below which the linear gradient has no meaning.
const LEAST_DENSITY: f64 = 0.02;

/// A sum of logarithms that takes one logarithm for many factors.
struct LogSum {
    sum: f64,
    product: f64,
}

impl Default for LogSum {
    fn default() -> Self {
        Self { sum: 0.0, product: 1.0 }
    }
}

impl LogSum {
    fn add(&mut self, factor: f64) {
        self.product *= factor;
        if !(1e-100..1e100).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }

    fn total(&self) -> f64 {
        self.sum + self.product.ln()
    }
}

/// Beyond this many tau a point counts as material or clutter for certain.
const FAR: f64 = 7.0;

fn prior<O>(data: &Data, state: &State<O>) -> f64 {
    let g = state.gradient;
    0.5 * (g[0] * g[0] + g[1] * g[1]) / (data.gradient_sigma * data.gradient_sigma)
}

/// Log-likelihood with gradient and curvature; `None` where the model has no meaning (negative density, no area). The curvature leaves out the bending of the distance function itself,
/// which is smaller than the rest by tau / radius; it is only used for steps and for the covariance.
pub fn evaluate<O: Outline>(data: &Data, state: &State<O>) -> Option<Evaluation> {
    let shape = O::SHAPE;
    let all = State::<O>::count();
    let scale = 1.0 / data.window.reach_mm;
    let (eps, g) = (data.clutter, state.gradient);
    let inverse_tau = 1.0 / state.tau_mm;
    if !state.outline.is_sound() {
        return None;
    }
    let mut logarithms = LogSum::default();
    let mut out = Evaluation { value: 0.0, slope: [0.0; MAX_ALL], curvature: [[0.0; MAX_ALL]; MAX_ALL] };
    let mut ds = [0.0; MAX_SHAPE];
    for p in data.points {
        let x = [p[0] * scale, p[1] * scale];
        let density = 1.0 + g[0] * x[0] + g[1] * x[1];
        if density <= LEAST_DENSITY {
            return None;
        }
        let inverse_density = 1.0 / density;
        for a in 0..2 {
            out.slope[shape + 1 + a] += x[a] * inverse_density;
            for b in 0..2 {
                out.curvature[shape + 1 + a][shape + 1 + b] += x[a] * x[b] * inverse_density * inverse_density;
            }
        }
        let z = state.outline.signed_mm(*p, &mut ds) * inverse_tau;
        if z.abs() > FAR {
            logarithms.add(if z > 0.0 { density } else { eps * density });
            continue;
        }
        let (phi, d) = distribution_and_density(z);
        let presence = eps + (1.0 - eps) * phi;
        logarithms.add(presence * density);
        let m = (1.0 - eps) * d / presence;
        let mut dz = [0.0; MAX_SHAPE + 1];
        for k in 0..shape {
            dz[k] = ds[k] * inverse_tau;
        }
        dz[shape] = -z; // by ln tau
        let bend = m * (z + m);
        for a in 0..=shape {
            out.slope[a] += m * dz[a];
            for b in 0..=shape {
                out.curvature[a][b] += bend * dz[a] * dz[b];
            }
            // Second derivatives of z by ln tau.
            out.curvature[a][shape] += m * dz[a];
            if a < shape {
                out.curvature[shape][a] += m * dz[a];
            }
        }
    }
    out.value = logarithms.total()
        - data.points.len() as f64 * add_area_terms(data, state, &mut out)?.ln()
        - prior(data, state);
    let weight = 1.0 / (data.gradient_sigma * data.gradient_sigma);
    for a in 0..2 {
        out.slope[shape + 1 + a] -= g[a] * weight;
        out.curvature[shape + 1 + a][shape + 1 + a] += weight;
    }
    debug_assert!(out.slope[..all].iter().all(|v| v.is_finite()));
    Some(out)
}

/// Subtracts the derivatives of `N log A_eff` and returns that area; the second ones by differences of the closed-form first ones.
fn add_area_terms<O: Outline>(data: &Data, state: &State<O>, out: &mut Evaluation) -> Option<f64> {
    const STEP: f64 = 1e-5;
    let all = State::<O>::count();
    let n = data.points.len() as f64;
    let (area, first) = effective_area(data, state);
    if area <= 0.0 {
        return None;
    }
    for a in 0..all {
        out.slope[a] -= n * first[a] / area;
    }
    for b in 0..all {
        let mut step = [0.0; MAX_ALL];
        step[b] = STEP;
        let up = effective_area(data, &state.moved(&step)).1;
        step[b] = -STEP;
        let down = effective_area(data, &state.moved(&step)).1;
        for a in 0..all {
            let second = (up[a] - down[a]) / (2.0 * STEP);
            out.curvature[a][b] += n * (second / area - first[a] * first[b] / (area * area));
        }
    }
    Some(area)
}

/// The effective area with its derivatives by shape, ln tau and gradient.
fn effective_area<O: Outline>(data: &Data, state: &State<O>) -> (f64, [f64; MAX_ALL]) {
    let scale = 1.0 / data.window.reach_mm;
    let g = [state.gradient[0] * scale, state.gradient[1] * scale];
    let weighted = |m: &Moments| m[0] + g[0] * m[1] + g[1] * m[2];
    let present = 1.0 - data.clutter;
    let (void, by) = state.outline.void(state.tau_mm);
    let mut first = [0.0; MAX_ALL];
    for k in 0..O::SHAPE {
        first[k] = -present * weighted(&by[k]);
    }
    first[O::SHAPE] = -present * weighted(&by[MAX_SHAPE]) * state.tau_mm;
    for a in 0..2 {
        first[O::SHAPE + 1 + a] = scale * (data.window.moments[1 + a] - present * void[1 + a]);
    }
    (weighted(&data.window.moments) - present * weighted(&void), first)
}

/// Points per mm² where there is material, at the window's origin.
pub fn density_per_mm2<O: Outline>(data: &Data, state: &State<O>) -> f64 {
    data.points.len() as f64 / effective_area(data, state).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::soft_edge::{Circle, Edge, Slot};
    use rand::{RngExt, SeedableRng};

    fn check<O: Outline>(outline: O, window: Window) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let points: Vec<[f64; 2]> =
            (0..400).map(|_| [rng.random_range(-6.0..6.0), rng.random_range(-6.0..6.0)]).collect();
        let data = Data { points: &points, window, clutter: 0.02, gradient_sigma: 0.5 };
        let state = State { outline, tau_mm: 0.4, gradient: [0.1, -0.2] };
        let at = evaluate(&data, &state).unwrap();
        let d = 1e-5;
        for k in 0..State::<O>::count() {
            let mut step = [0.0; MAX_ALL];
            step[k] = d;
            let up = evaluate(&data, &state.moved(&step)).unwrap();
            step[k] = -d;
            let down = evaluate(&data, &state.moved(&step)).unwrap();
            // Values of about 1e3 known to 1e-10 (table of Phi) over 2e-5: 1e-5 each, times some tens of points at the rim.
            assert!(((up.value - down.value) / (2.0 * d) - at.slope[k]).abs() < 2e-3, "parameter {k}");
            // The curvature leaves out only the bending of the distance (which the edge does not have).
            if O::SHAPE == 2 {
                for a in 0..State::<O>::count() {
                    let difference = -(up.slope[a] - down.slope[a]) / (2.0 * d);
                    assert!(
                        (difference - at.curvature[a][k]).abs() < 1e-2 * (1.0 + difference.abs()),
                        "curvature {a} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn gradient_matches_differences() {
        check(Circle { centre: [0.3, -0.2], radius: 3.0 }, Window::disc(6.5));
        check(Slot { centre: [0.3, -0.2], angle: 0.4, half_straight: 2.0, radius: 1.5 }, Window::disc(6.5));
        let edge = Edge { offset: 0.4, slope: 0.05, along: [-6.0, 6.0], outer_mm: 6.0 };
        check(edge, Window::rectangle([-6.0, -6.0], [6.0, 6.0]));
    }
}
