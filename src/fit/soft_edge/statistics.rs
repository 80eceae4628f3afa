//! Statistical tests of the soft-edge estimator on simulated point patterns: what it is for is being unbiased.

use super::outline::MAX_SHAPE;
use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How the points of a trial lie.
#[derive(Clone, Copy)]
struct Pattern {
    spacing: f64,
    lattice: bool,
    dropout: f64,
    clutter_points: usize,
    gradient: f64,
    noise: f64,
}

const CLEAN: Pattern =
    Pattern { spacing: 0.168, lattice: true, dropout: 0.0, clutter_points: 0, gradient: 0.0, noise: 0.0 };

fn gauss(rng: &mut ChaCha8Rng) -> f64 {
    normal::quantile(rng.random_range(1e-9..1.0 - 1e-9))
}

/// Points of the material in the square |u|, |v| < reach: a turned, shifted, jittered lattice or a Poisson pattern, kept
/// with probability Phi(s / 0.03 mm).
fn scatter<O: Outline>(outline: &O, reach: f64, pattern: Pattern, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let h = pattern.spacing;
    let wide = 1.5 * reach;
    let steps = (2.0 * wide / h) as i64;
    let turn: f64 = rng.random_range(0.0..1.6);
    let shift = [rng.random_range(0.0..h), rng.random_range(0.0..h)];
    let mut points = Vec::new();
    let mut place = |p: [f64; 2], rng: &mut ChaCha8Rng| {
        let s = outline.signed_mm(p, &mut [0.0; MAX_SHAPE]);
        let thin = (1.0 - pattern.dropout) * (1.0 + pattern.gradient * p[0] / reach) / (1.0 + pattern.gradient);
        if normal::distribution_and_density(s / 0.03).0 > rng.random_range(0.0..1.0)
            && rng.random_range(0.0..1.0) < thin
        {
            let q = [p[0] + pattern.noise * gauss(rng), p[1] + pattern.noise * gauss(rng)];
            if q[0].abs() < reach && q[1].abs() < reach {
                points.push(q);
            }
        }
    };
    for i in 0..steps * steps {
        let p = if pattern.lattice {
            let (a, b) = ((i / steps) as f64 * h - wide + shift[0], (i % steps) as f64 * h - wide + shift[1]);
            let jitter = 0.15 * h;
            [
                a * turn.cos() - b * turn.sin() + jitter * gauss(rng),
                a * turn.sin() + b * turn.cos() + jitter * gauss(rng),
            ]
        } else {
            [rng.random_range(-wide..wide), rng.random_range(-wide..wide)]
        };
        place(p, rng);
    }
    points
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt())
}

struct Trials {
    diameter_bias: f64,
    diameter_sd: f64,
    centre_bias: f64,
    centre_sd: f64,
    /// rms of centre error over stated standard uncertainty.
    centre_ratio: f64,
    diameter_ratio: f64,
}

/// Holes fitted from a start that is off by some spacings; all numbers in spacings.
fn hole_trials(diameter: f64, pattern: Pattern, count: usize, seed: u64) -> Trials {
    let h = pattern.spacing;
    let (mut d, mut c, mut zc, mut zd) = (vec![], vec![], vec![], vec![]);
    for k in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(seed + k as u64);
        let truth = Circle { centre: [rng.random_range(-h..h), rng.random_range(-h..h)], radius: 0.5 * diameter };
        let reach = truth.radius + 8.0 * h.max(0.1875);
        let mut points = scatter(&truth, reach + h, pattern, &mut rng);
        for _ in 0..pattern.clutter_points {
            let (rho, phi) =
                (truth.radius * rng.random_range(0.0_f64..1.0).sqrt(), rng.random_range(0.0..std::f64::consts::TAU));
            points.push([truth.centre[0] + rho * f64::cos(phi), truth.centre[1] + rho * f64::sin(phi)]);
        }
        points.retain(|p| p[0].hypot(p[1]) < reach);
        let start = Circle { centre: [0.0, 0.0], radius: truth.radius + rng.random_range(-h..h) };
        let fit = fit_soft_edge(&points, Window::disc(reach), &start, &SoftEdgeSettings::new(h)).unwrap();
        assert!(fit.converged, "{} steps", fit.iterations);
        d.push(2.0 * (fit.outline.radius - truth.radius) / h);
        zd.push((fit.outline.radius - truth.radius) / fit.covariance[(2, 2)].sqrt());
        for a in 0..2 {
            c.push((fit.outline.centre[a] - truth.centre[a]) / h);
            zc.push((fit.outline.centre[a] - truth.centre[a]) / fit.covariance[(a, a)].sqrt());
        }
    }
    let (diameter_bias, diameter_sd) = moments(&d);
    let (centre_bias, centre_sd) = moments(&c);
    let rms = |z: &[f64]| (z.iter().map(|v| v * v).sum::<f64>() / z.len() as f64).sqrt();
    Trials { diameter_bias, diameter_sd, centre_bias, centre_sd, centre_ratio: rms(&zc), diameter_ratio: rms(&zd) }
}

/// Bias within 0.05 spacings (plus three standard errors of the trials), spread of the centre as the point spacing allows.
fn check_hole(pattern: Pattern, centre_sd_limit: f64, seed: u64) {
    const COUNT: usize = 20;
    let t = hole_trials(8.0, pattern, COUNT, seed);
    let root = (COUNT as f64).sqrt();
    assert!(
        t.diameter_bias.abs() < 0.05 + 3.0 * t.diameter_sd / root,
        "bias {:+.3} ± {:.3}",
        t.diameter_bias,
        t.diameter_sd
    );
    assert!(t.centre_bias.abs() < 3.0 * t.centre_sd / (2.0 * COUNT as f64).sqrt(), "centre bias {:+.3}", t.centre_bias);
    assert!(t.centre_sd < centre_sd_limit, "centre spread {:.3}", t.centre_sd);
    // Errors over stated uncertainties: 1 within the scatter of 20 or 40 values (three standard errors: 0.5) and the
    // model's error (a lattice is more regular than a Poisson pattern).
    assert!(t.centre_ratio < 1.4 && t.diameter_ratio < 1.8, "ratios {:.2} {:.2}", t.centre_ratio, t.diameter_ratio);
}

#[test]
fn hole_in_a_jittered_lattice() {
    check_hole(CLEAN, 0.07, 10);
}

#[test]
fn hole_with_dropout_clutter_and_density_gradient() {
    check_hole(Pattern { dropout: 0.2, clutter_points: 25, gradient: 0.3, ..CLEAN }, 0.08, 200);
}

#[test]
fn hole_in_poisson_points() {
    check_hole(Pattern { lattice: false, ..CLEAN }, 0.08, 300);
}
