//! The likelihood of points when there is no outline at all.

use super::outline::Moments;
use nalgebra::{Matrix2, Vector2};
use std::cmp::Ordering;

/// Log-likelihood of a window that is material throughout, its density and its density gradient profiled out: what a fit's
/// `log_likelihood` in the same window, with the same prior on the gradient, is to be compared with.
///
/// Newton's iteration for the gradient `g` (told over the window's reach) of
/// `sum log(1 + g.x) - N log(A + g.M) - |g|² / 2 sigma²`.
///
/// `moments` are the window's area and first moments, without its voids.
pub fn closed_log_likelihood(points: &[[f64; 2]], moments: &Moments, reach_mm: f64, gradient_sigma: f64) -> f64 {
    const STEPS: usize = 30;
    let count = points.len() as f64;
    let scale = 1.0 / reach_mm;
    let places: Vec<Vector2<f64>> = points.iter().map(|p| Vector2::new(p[0], p[1]) * scale).collect();
    let [area, mu, mv] = *moments;
    let middle = Vector2::new(mu, mv) * scale;
    let weight = 1.0 / (gradient_sigma * gradient_sigma);
    let value = |g: &Vector2<f64>| {
        let sum: f64 = places.iter().map(|x| (1.0 + g.dot(x)).ln()).sum();
        // NaN, from a density below zero, is no better than anything.
        sum - count * (area + g.dot(&middle)).ln() - 0.5 * weight * g.norm_squared()
    };
    let mut g = Vector2::zeros();
    let mut best = value(&g);
    for _ in 0..STEPS {
        let weighted_area = area + g.dot(&middle);
        let mut slope = -middle * (count / weighted_area) - g * weight;
        let mut curvature = Matrix2::identity() * weight;
        for x in &places {
            let x = x / (1.0 + g.dot(x));
            slope += x;
            curvature += x * x.transpose();
        }
        // The area's own term bends the other way; left out, the step is a little short and still leads up.
        let Some(cholesky) = curvature.cholesky() else { break };
        let mut step = cholesky.solve(&slope);
        while step.norm() > 1e-9 && value(&(g + step)).partial_cmp(&best) != Some(Ordering::Greater) {
            step *= 0.5;
        }
        if step.norm() <= 1e-9 {
            break;
        }
        g += step;
        best = value(&g);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a regular lattice of N points over the area A the likelihood is -N ln A; a lattice thinned out along u prefers a
    /// gradient, and no gradient near the one found is better.
    #[test]
    fn gradient_found_is_the_best() {
        let lattice: Vec<[f64; 2]> =
            (0..400).map(|k| [(k % 20) as f64 * 0.1 - 0.95, (k / 20) as f64 * 0.1 - 0.95]).collect();
        let square = [4.0, 0.0, 0.0];
        let even = closed_log_likelihood(&lattice, &square, 1.0, 0.3);
        // By symmetry the best gradient is none.
        assert!((even + 400.0 * 4.0_f64.ln()).abs() < 1e-9, "{even}");
        let thinned: Vec<[f64; 2]> =
            lattice.iter().enumerate().filter(|(k, p)| p[0] > -0.3 || k % 2 == 0).map(|(_, p)| *p).collect();
        let found = closed_log_likelihood(&thinned, &square, 1.0, 0.3);
        let with = |g: f64| {
            let sum: f64 = thinned.iter().map(|p| (1.0 + g * p[0]).ln()).sum();
            sum - thinned.len() as f64 * 4.0_f64.ln() - 0.5 * (g / 0.3).powi(2)
        };
        // A grid of steps of 0.01 misses the maximum by half a step, at a curvature of about N / 3: 400 / 6 * 0.005² = 0.002.
        let best = (-90..90).map(|k| with(f64::from(k) * 0.01)).fold(f64::NEG_INFINITY, f64::max);
        assert!((found - best).abs() < 0.01 && found > with(0.0) + 1.0, "{found} {best} {}", with(0.0));
    }
}
