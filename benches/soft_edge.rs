//! Time of one soft-edge fit of each kind on points as the demo part's scans have them: 35 points per mm², a fifth dropped out, each
//! off its place by 0.05 mm along either axis.
//!
//! `cargo bench --bench soft_edge` prints the median and the slowest of 200 fits, each of other points.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shapeline::fit::soft_edge::outline::MAX_SHAPE;
use shapeline::fit::soft_edge::{Circle, Edge, Outline, Slot, SoftEdgeSettings, Window, clutter_share, fit_soft_edge};
use std::time::Instant;

const SPACING_MM: f64 = 0.168;
const NOISE_MM: f64 = 0.05;
const FITS: u64 = 200;

/// A jittered lattice over a square, without the outline's void, every fifth point at random left out.
fn points<O: Outline>(outline: &O, half_mm: f64, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let steps = (2.0 * half_mm / SPACING_MM) as usize;
    let mut out = Vec::new();
    for k in 0..steps * steps {
        let mut at = |i: usize| i as f64 * SPACING_MM - half_mm + 0.5 * SPACING_MM * rng.random_range(-1.0..1.0);
        let place = [at(k / steps), at(k % steps)];
        let kept = outline.signed_mm(place, &mut [0.0; MAX_SHAPE]) > 0.0 && rng.random_range(0.0..1.0) > 0.2;
        // Three uniforms of variance 1/3: near enough to normal.
        let mut noise = || NOISE_MM * (0..3).map(|_| rng.random_range(-1.0..1.0)).sum::<f64>();
        let seen = [place[0] + noise(), place[1] + noise()];
        if kept {
            out.push(seen);
        }
    }
    out
}

/// Times fits of an outline, each from a start moved by up to a spacing.
fn time<O: Outline>(name: &str, truth: &O, window: &Window, half_mm: f64, inside: impl Fn(&[f64; 2]) -> bool) {
    let mut times = Vec::new();
    let (mut count, mut steps) = (0, 0);
    for seed in 0..FITS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut points = points(truth, half_mm, &mut rng);
        points.retain(&inside);
        let shift: [f64; MAX_SHAPE] = std::array::from_fn(|k| {
            let by = rng.random_range(-SPACING_MM..SPACING_MM);
            if k < O::SHAPE && O::IS_ANGLE[k] { 0.1 * by } else { by }
        });
        let start = truth.moved(&shift[..O::SHAPE]);
        let begun = Instant::now();
        let clutter = clutter_share(&points, &start, window, SPACING_MM);
        let settings = SoftEdgeSettings { clutter, ..SoftEdgeSettings::new(SPACING_MM) };
        let fit = fit_soft_edge(&points, window, &start, &settings);
        times.push(begun.elapsed().as_secs_f64() * 1e3);
        count += points.len();
        steps += fit.map_or(0, |fit| fit.iterations);
    }
    times.sort_by(f64::total_cmp);
    let (median, slowest) = (times[times.len() / 2], times[times.len() - 1]);
    let (count, steps) = (count / FITS as usize, steps as f64 / FITS as f64);
    #[expect(clippy::print_stdout, reason = "what a benchmark is for")]
    {
        println!(
            "{name:14} {count:5} points, median {median:.3} ms, slowest {slowest:.3} ms, {steps:.1} steps in the last round"
        );
    }
}

fn main() {
    let margin = 1.5;
    for diameter in [3.0, 8.0, 20.0] {
        let hole = Circle { centre: [0.0, 0.0], radius: 0.5 * diameter };
        let reach = hole.radius + margin;
        let disc = Window::disc(reach);
        time(&format!("hole {diameter} mm"), &hole, &disc, reach, |p| p[0].hypot(p[1]) < reach);
    }
    let slot = Slot { centre: [0.0, 0.0], angle: 0.0, half_straight: 6.0, radius: 4.0 };
    let (u, v) = (10.0 + margin, 4.0 + margin);
    time("slot 20x8 mm", &slot, &Window::rectangle([-u, -v], [u, v]), u, |p| p[0].abs() < u && p[1].abs() < v);
    let edge = Edge { offset: 0.0, slope: 0.0, along: [-2.5, 2.5], outer_mm: 0.8 };
    let inside = |p: &[f64; 2]| p[0].abs() < 2.5 && (-1.5..0.8).contains(&p[1]);
    time("edge 5 mm", &edge, &Window::rectangle([-2.5, -1.5], [2.5, 0.8]), 2.6, inside);
}
