//! The estimator on simulated holes of 8 mm: without bias, and as uncertain as it says. Beside it the simple circles, which are not.
//!
//! `cargo test --release --lib soft_edge::table -- --nocapture --test-threads 1` prints the table.

use super::simulated::{CLEAN, Pattern, scatter};
use super::*;
use crate::fit::boundary::{RimPoints, boundary_circle};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Mean and standard deviation.
fn moments(values: &[f64]) -> [f64; 2] {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    [mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()]
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Errors of one way to find the circle, in spacings.
#[derive(Default)]
struct Errors {
    diameter: Vec<f64>,
    centre: Vec<f64>,
}

impl Errors {
    fn add(&mut self, found: &Circle, truth: &Circle, spacing: f64) {
        self.diameter.push(2.0 * (found.radius - truth.radius) / spacing);
        self.centre.extend((0..2).map(|k| (found.centre[k] - truth.centre[k]) / spacing));
    }
}

/// The holes of a row whose rim is seen over 60 % or more.
#[derive(Default)]
struct Row {
    gap: Errors,
    sector: Errors,
    soft: Errors,
    /// Errors over what was stated for them.
    centre_ratio: Vec<f64>,
    diameter_ratio: Vec<f64>,
    /// Stated for the centre, and what the information alone says, in spacings.
    stated: Vec<f64>,
    information: Vec<f64>,
}

const LEAST_SEEN: f64 = 0.6;

fn row(name: &str, pattern: &Pattern, holes: u64) -> Row {
    let h = pattern.spacing;
    let mut row = Row::default();
    for seed in 0..holes {
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        let truth = Circle { centre: [rng.random_range(-h..h), rng.random_range(-h..h)], radius: 4.0 };
        let reach = truth.radius + (8.0 * h).max(1.5);
        let mut points = scatter(&truth, 7.0_f64.max(reach), pattern, &mut rng);
        points.retain(|p| p[0].hypot(p[1]) < reach);
        let start = Circle { centre: [0.0, 0.0], radius: truth.radius + rng.random_range(-h..h) };
        let fit = fit_soft_edge(&points, &Window::disc(reach), &start, &SoftEdgeSettings::new(h)).unwrap();
        assert!(fit.converged, "{name}: {} steps", fit.iterations);
        if fit.outline_seen < LEAST_SEEN {
            continue;
        }
        for (errors, which) in [(&mut row.gap, RimPoints::AngularGap), (&mut row.sector, RimPoints::SectorMinimum)] {
            errors.add(&boundary_circle(&points, &start, h, which).unwrap(), &truth, h);
        }
        row.soft.add(&fit.outline, &truth, h);
        row.diameter_ratio.push((fit.outline.radius - truth.radius) / fit.covariance[(2, 2)].sqrt());
        for k in 0..2 {
            row.stated.push(fit.covariance[(k, k)].sqrt() / h);
            row.information.push(fit.information[(k, k)].sqrt() / h);
            row.centre_ratio.push((fit.outline.centre[k] - truth.centre[k]) / fit.covariance[(k, k)].sqrt());
        }
    }
    print(name, &row);
    row
}

#[expect(clippy::print_stdout, reason = "the table, for people")]
fn print(name: &str, row: &Row) {
    let cell = |errors: &Errors| {
        let [bias, spread] = moments(&errors.diameter);
        format!("{bias:+.3} ± {spread:.3} / {:.3}", rms(&errors.centre))
    };
    println!(
        "{name:22} gap {}, sector {}, soft {}; stated {:.3} (information {:.3}), ratios {:.2} {:.2}, {} holes",
        cell(&row.gap),
        cell(&row.sector),
        cell(&row.soft),
        rms(&row.stated),
        rms(&row.information),
        rms(&row.centre_ratio),
        rms(&row.diameter_ratio),
        row.diameter_ratio.len()
    );
}

/// What a row must reach, in spacings.
struct Limits {
    /// Of the diameter: its bias and spread.
    bias: f64,
    spread: f64,
    /// rms of the centre's error along an axis.
    centre: f64,
    /// rms of errors over what was stated for them.
    ratio: [f64; 2],
}

/// Clean, regular points: 5 % of a spacing is the demand for the bias; a lattice is more regular than independent points, whose
/// information limit for the centre is `sqrt(2 tau / 0.9 / 2 pi r) = 0.05` spacings, and for the diameter twice that over the root of
/// two. Stated is a quarter more than true at most, and less by a quarter at most.
const USUAL: Limits = Limits { bias: 0.05, spread: 0.08, centre: 0.055, ratio: [0.75, 1.25] };

const HOLES: u64 = 30;

/// Compares with limits; each statistic may be worse by three of its own standard errors, `1 / sqrt(2 n)` for a spread of n values.
fn check(name: &str, pattern: &Pattern, limits: &Limits) -> Row {
    let row = row(name, pattern, HOLES);
    let count = row.soft.diameter.len() as f64;
    let worse = |values: f64| 1.0 + 3.0 / (2.0 * values).sqrt();
    let [bias, spread] = moments(&row.soft.diameter);
    assert!(bias.abs() < limits.bias + 3.0 * spread / count.sqrt(), "{name}: bias {bias:+.3}");
    assert!(spread < limits.spread * worse(count), "{name}: spread {spread:.3}");
    assert!(rms(&row.soft.centre) < limits.centre * worse(2.0 * count), "{name}: centre {:.3}", rms(&row.soft.centre));
    for (ratios, what) in [(&row.centre_ratio, "centre"), (&row.diameter_ratio, "diameter")] {
        let n = ratios.len() as f64;
        let [low, high] = [limits.ratio[0] / worse(n), limits.ratio[1] * worse(n)];
        assert!((low..high).contains(&rms(ratios)), "{name}: {what} over stated {:.2}", rms(ratios));
    }
    // The circle through the rim's points is half a spacing too wide or more, always.
    let [gap_bias, _] = moments(&row.gap.diameter);
    assert!(gap_bias > 0.5 + bias.abs(), "{name}: gap circle {gap_bias:+.3}");
    row
}

#[test]
fn regular_points() {
    check("lattice", &CLEAN, &USUAL);
    // The blur is 0.18 spacings, as if larger by 1.3; the spread in spacings is smaller than usual, but rims of twice as many
    // spacings are blurred by 0.36 of them.
    check("h = 0.084 mm", &Pattern { spacing: 0.084, ..CLEAN }, &USUAL);
    // A rim of 50 spacings only, whose blur cannot be told: the bias is an eighth of a spacing at most.
    check(
        "h = 0.5 mm",
        &Pattern { spacing: 0.5, ..CLEAN },
        &Limits { bias: 0.085, spread: 0.1, centre: 0.06, ..USUAL },
    );
}

#[test]
fn thinned_points() {
    // A fifth fewer points: a tenth more spread.
    let thinned = Limits { spread: 0.085, centre: 0.06, ..USUAL };
    check("dropout 20 %", &Pattern { dropout: 0.2, ..CLEAN }, &thinned);
    // From 1 to 0.74 of the density from end to end, as many points fewer as before.
    check("density gradient 30 %", &Pattern { gradient: 0.15, ..CLEAN }, &thinned);
    // 25 points where 1,400 would be: 1.8 % of clutter, some of it near the rim.
    check(
        "dropout and clutter",
        &Pattern { dropout: 0.2, clutter: 25, ..CLEAN },
        &Limits { spread: 0.1, centre: 0.065, ..USUAL },
    );
}

#[test]
fn irregular_points() {
    // Blurred by 0.6 spacings: sqrt(0.6 / 0.18) = 1.8 times the usual spread at most; a lattice's points are told more exactly than that.
    let blurred = Limits { spread: 0.121, centre: 0.09, ratio: [0.7, 1.25], ..USUAL };
    check("in-plane noise 0.1 mm", &Pattern { noise: 0.1, ..CLEAN }, &blurred);
    check("independent points", &Pattern { lattice: false, ..CLEAN }, &Limits { spread: 0.11, centre: 0.06, ..USUAL });
    // Neighbours shifted together by 0.3 spacings: the information knows nothing of that, the jackknife must.
    let common = Pattern { common_noise: 0.05, dropout: 0.2, ..CLEAN };
    let row = check("common noise 0.05 mm", &common, &Limits { spread: 0.2, centre: 0.14, ..USUAL });
    assert!(rms(&row.soft.centre) > 1.25 * rms(&row.information), "the information alone says too little");
}

#[test]
fn voids_and_what_is_out_of_sight() {
    check("45 degrees missing", &Pattern { sector_missing: true, ..CLEAN }, &Limits { centre: 0.06, ..USUAL });
    check("light voids", &Pattern { voids: (10, 0.6), ..CLEAN }, &Limits { centre: 0.06, ..USUAL });
    // A third of the points gone: of the holes of which 60 % of the rim is left the centre is good to 0.1 spacings, where the gap circle
    // errs by three times that, and the uncertainty is honest.
    let heavy = Pattern { voids: (40, 0.8), ..CLEAN };
    let row = check("heavy voids", &heavy, &Limits { bias: 0.09, spread: 0.2, centre: 0.1, ..USUAL });
    assert!((HOLES / 3..HOLES).contains(&(row.diameter_ratio.len() as u64)), "{}", row.diameter_ratio.len());
    assert!(rms(&row.gap.centre) > 2.0 * rms(&row.soft.centre));
}

/// Errors of the parameters in their units over 30 outlines, as mean and spread, and the rms of errors over what was stated.
fn trials<O: Outline>(
    truth: &O,
    pattern: &Pattern,
    window: &Window,
    inside: impl Fn(&[f64; 2]) -> bool,
) -> Vec<[f64; 3]> {
    let h = pattern.spacing;
    let mut errors = vec![(vec![], vec![]); O::SHAPE];
    for seed in 0..HOLES {
        let mut rng = ChaCha8Rng::seed_from_u64(2000 + seed);
        let mut points = scatter(truth, window.reach_mm.max(7.0), pattern, &mut rng);
        points.retain(&inside);
        let shift: Vec<f64> =
            (0..O::SHAPE).map(|k| rng.random_range(-h..h) * if O::IS_ANGLE[k] { 0.1 } else { 1.0 }).collect();
        let fit = fit_soft_edge(&points, window, &truth.moved(&shift), &SoftEdgeSettings::new(h)).unwrap();
        assert!(fit.converged && fit.outline_seen > 0.9, "{seed}: {}", fit.outline_seen);
        for (k, errors) in errors.iter_mut().enumerate() {
            let error = fit.outline.parameters()[k] - truth.parameters()[k];
            errors.0.push(error);
            errors.1.push(error / fit.covariance[(k, k)].sqrt());
        }
    }
    errors.iter().map(|(e, z)| [moments(e)[0], moments(e)[1], rms(z)]).collect()
}

/// Bias and spread within limits, in the parameters' units, and what was stated true within a quarter, each but for three standard errors.
#[expect(clippy::print_stdout, reason = "the table, for people")]
fn check_trials(name: &str, found: &[[f64; 3]], limits: &[[f64; 2]]) {
    let (root, worse) = ((HOLES as f64).sqrt(), 1.0 + 3.0 / (2.0 * HOLES as f64).sqrt());
    println!("{name:22} {found:.4?}");
    for (k, ([bias, spread, ratio], [bias_limit, spread_limit])) in found.iter().zip(limits).enumerate() {
        assert!(bias.abs() < bias_limit + 3.0 * spread / root, "{name} {k}: bias {bias:+.4}");
        assert!(*spread < spread_limit * worse, "{name} {k}: spread {spread:.4}");
        assert!((0.75 / worse..1.25 * worse).contains(ratio), "{name} {k}: over stated {ratio:.2}");
    }
}

#[test]
fn slots_and_edges() {
    let h = CLEAN.spacing;
    let thinned = Pattern { dropout: 0.2, ..CLEAN };
    // 20 x 8 mm: centre 0.047 and 0.025 spacings, direction 1.0 to 1.3 mrad, half the length 0.05 and half the width 0.03 spacings.
    let slot = Slot { centre: [0.0, 0.0], angle: 0.3, half_straight: 6.0, radius: 4.0 };
    let found = trials(&slot, &thinned, &Window::disc(11.5), |p| p[0].hypot(p[1]) < 11.5);
    let sizes =
        [[0.02 * h, 0.05 * h], [0.02 * h, 0.05 * h], [2e-4, 1.3e-3], [0.02 * h, 0.06 * h], [0.02 * h, 0.04 * h]];
    check_trials("slot 20 x 8 mm", &found, &sizes);
    // 5 mm of a trimmed edge: 0.1 spacings, over the root of what is longer than 3 mm.
    let edge = Edge { offset: 0.0, slope: 0.0, along: [-2.5, 2.5], outer_mm: 0.8 };
    let window = Window::rectangle([-2.5, -1.5], [2.5, 0.8]);
    let inside = |p: &[f64; 2]| p[0].abs() < 2.5 && (-1.5..0.8).contains(&p[1]);
    for (name, pattern) in
        [("edge", CLEAN), ("edge, 20 % dropout", thinned), ("edge, noise 0.05 mm", Pattern { noise: 0.05, ..thinned })]
    {
        let found = trials(&edge, &pattern, &window, inside);
        check_trials(name, &found, &[[0.06 * h, 0.1 * h], [0.02 * h, 0.08 * h]]);
    }
}

/// Where the material seems to end 0.1 mm inside its edge, the diameter must be wider by twice that, and nothing else may change.
#[test]
fn an_eroded_edge_is_found_where_it_seems_to_be() {
    let row = row("eroded by 0.1 mm", &Pattern { erosion: 0.1, ..CLEAN }, HOLES);
    let [bias, spread] = moments(&row.soft.diameter);
    let wider = 2.0 * 0.1 / CLEAN.spacing;
    assert!((bias - wider).abs() < USUAL.bias + 3.0 * spread / (HOLES as f64).sqrt(), "{bias:+.3}");
    assert!(rms(&row.soft.centre) < 1.4 * USUAL.centre);
}
