//! The layer of points that is the measured face: where it stands above the CAD and how it is tilted.

use super::thin::is_taken;
use crate::fit::robust::{SIGMA_OF_MAD, TUKEY_WIDTH_SIGMAS, mad_scale_about_zero, median, tukey_weight};
use nalgebra::{Matrix3, Vector3};

/// A plane `e0 + eu u + ev v` through heights above the CAD, by Tukey's weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// e0 in mm, eu and ev without unit.
    pub plane: [f64; 3],
    /// Standard deviation of the heights about it, mm.
    pub sigma_mm: f64,
    /// Rms of the points with weight, mm.
    pub rms_mm: f64,
    /// Points with weight.
    pub points: usize,
    /// Residuals from here on have no weight, mm.
    pub width_mm: f64,
    /// Covariance of `plane`, as if every point's error were its own.
    pub covariance: Matrix3<f64>,
    /// Standard uncertainty of e0: neighbouring points' errors have something in common, and averaging helps less.
    pub u_height_mm: f64,
}

impl Layer {
    /// Standard uncertainty of the height at a place: the plane's covariance there, more than its points' own errors leave by
    /// what neighbours have in common.
    pub fn u_height_at(&self, u: f64, v: f64) -> f64 {
        let row = Vector3::new(1.0, u, v);
        ((self.covariance * row).dot(&row).max(0.0) * self.inflation()).sqrt()
    }

    /// By what a variance is larger than if every point's error were its own.
    pub fn inflation(&self) -> f64 {
        (self.u_height_mm.powi(2) / self.covariance[(0, 0)]).max(1.0)
    }
}

/// Height of a plane at a place.
pub fn height(plane: &[f64; 3], u: f64, v: f64) -> f64 {
    plane[0] + plane[1] * u + plane[2] * v
}

/// Smallest scale assumed, mm: keeps exact data (tests, simulated scans without noise) from losing all its points.
const LEAST_SIGMA_MM: f64 = 2e-4;

/// Where most points stand: the middle of the fullest interval of 0.6 mm. Of two that are about equally full the one
/// further out (towards the camera) is taken, since sheet hides what lies behind it.
pub fn most_frequent_height(heights: &[f64], outward: f64) -> Option<f64> {
    const BIN: f64 = 0.2;
    let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(*e), h.max(*e)));
    if !(high - low).is_finite() {
        return None;
    }
    let bins = ((high - low) / BIN) as usize + 3;
    let mut counts = vec![0_usize; bins];
    for e in heights {
        counts[((e - low) / BIN) as usize + 1] += 1;
    }
    let triple = |k: usize| counts[k - 1] + counts[k] + counts[k + 1];
    let most = (1..bins - 1).map(triple).max()?;
    let full = (1..bins - 1).filter(|&k| 5 * triple(k) >= 4 * most);
    let chosen = if outward >= 0.0 { full.max()? } else { full.min()? };
    let middle = low + (chosen as f64 - 0.5) * BIN;
    let mut near: Vec<f64> = heights.iter().copied().filter(|e| (e - middle).abs() <= 1.5 * BIN).collect();
    median(&mut near)
}

/// Fits the layer to (u, v, height) from a start height. `None` with fewer than `needed` points in it.
pub fn fit_layer(points: &[[f64; 3]], start: f64, needed: usize) -> Option<Layer> {
    let mut plane = [start, 0.0, 0.0];
    let mut width = 1.5;
    let scale = points.iter().map(|p| p[0].hypot(p[1])).fold(1e-3, f64::max);
    let mut residuals = Vec::with_capacity(points.len());
    for _ in 0..25 {
        let next = weighted_plane(points, &plane, width, scale)?.0;
        residuals.clear();
        residuals.extend(points.iter().map(|p| p[2] - height(&next, p[0], p[1])).filter(|r| r.abs() < width));
        if residuals.len() < needed {
            return None;
        }
        let sigma = mad_scale_about_zero(&residuals)?.max(LEAST_SIGMA_MM);
        let next_width = (TUKEY_WIDTH_SIGMAS * sigma).max(0.5 * width).min(width);
        let change = (0..3).map(|k| (next[k] - plane[k]).abs() * if k == 0 { 1.0 } else { scale }).fold(0.0, f64::max);
        plane = next;
        let settled = change < 1e-4 * sigma && (next_width - width).abs() < 1e-3 * width;
        width = next_width;
        if settled {
            break;
        }
    }
    let (plane, inverse, kept) = weighted_plane(points, &plane, width, scale)?;
    if kept < needed {
        return None;
    }
    let inside = || points.iter().map(|p| p[2] - height(&plane, p[0], p[1])).filter(|r| r.abs() < width);
    let rms_mm = (inside().map(|r| r * r).sum::<f64>() / kept as f64).sqrt();
    let mut sizes: Vec<f64> = inside().map(f64::abs).collect();
    let sigma_mm = (SIGMA_OF_MAD * median(&mut sizes)?).max(LEAST_SIGMA_MM);
    let covariance = inverse * (sigma_mm * sigma_mm);
    let residuals = points.iter().map(|p| [p[0], p[1], p[2] - height(&plane, p[0], p[1])]);
    let residuals: Vec<[f64; 3]> = residuals.filter(|p| p[2].abs() < width).collect();
    if sigma_mm > MOST_OF_BOTH * two_layers_rms_mm(points, start, scale).unwrap_or(f64::INFINITY) {
        return None;
    }
    let u_height_mm = (covariance[(0, 0)] * correlation_inflation(&residuals, width)).sqrt();
    Some(Layer { plane, sigma_mm, rms_mm, points: kept, width_mm: width, covariance, u_height_mm })
}

/// A layer is one of two when its scatter is less than this share of that of both together.
const MOST_OF_BOTH: f64 = 0.4;

/// Rms of the points about their common plane, where hardly any of them lies on it: they are two layers, and the mean of the
/// two is nobody's surface. `None` where they are one.
///
/// Of a normal distribution 21 % of the values are smaller than 0.4 of the median size, of an even one 20 %, of two layers next to
/// none. A share below 12 % that is three standard deviations of chance below 21 % tells two layers (at most one window in 700 by
/// chance). Layers nearer than 0.1 mm do no harm.
fn two_layers_rms_mm(points: &[[f64; 3]], start: f64, scale: f64) -> Option<f64> {
    const REACH_MM: f64 = 1.5;
    const OF_MEDIAN: f64 = 0.4;
    const USUAL_SHARE: f64 = 0.213;
    const MOST_SHARE: f64 = 0.12;
    const LEAST_MEDIAN_MM: f64 = 0.05;
    let near: Vec<[f64; 3]> = points.iter().filter(|p| (p[2] - start).abs() < REACH_MM).copied().collect();
    let (plane, ..) = weighted_plane(&near, &[start, 0.0, 0.0], f64::INFINITY, scale)?;
    let mut sizes: Vec<f64> = near.iter().map(|p| (p[2] - height(&plane, p[0], p[1])).abs()).collect();
    let middle = median(&mut sizes).filter(|m| *m > LEAST_MEDIAN_MM)?;
    let count = sizes.len() as f64;
    let share = sizes.iter().filter(|r| **r < OF_MEDIAN * middle).count() as f64 / count;
    let chance = (USUAL_SHARE * (1.0 - USUAL_SHARE) / count).sqrt();
    let two = share < MOST_SHARE && share < USUAL_SHARE - 3.0 * chance;
    two.then(|| (sizes.iter().map(|r| r * r).sum::<f64>() / count).sqrt())
}

/// By what the variance of a fitted plane is larger than if every point's error were its own: told at the middle of the
/// points, where the plane's height is their mean. `residuals` are (u, v, residual) of the points with weight.
fn correlation_inflation(residuals: &[[f64; 3]], width: f64) -> f64 {
    let weights: Vec<f64> = residuals.iter().map(|p| tukey_weight(p[2], width)).collect();
    let total = weights.iter().sum::<f64>().max(1e-12);
    let middle = |k: usize| residuals.iter().zip(&weights).map(|(p, w)| p[k] * w).sum::<f64>() / total;
    let centre = [middle(0), middle(1)];
    let told = residuals.iter().zip(&weights).map(|(p, w)| [p[0] - centre[0], p[1] - centre[1], p[2], w / total]);
    let told: Vec<[f64; 4]> = told.collect();
    let own = told.iter().map(|p| (p[2] * p[3]).powi(2)).sum::<f64>();
    if own > 0.0 { (correlated_height_variance(&told, 3.0) / own).max(1.0) } else { 1.0 }
}

/// Variance of e0 when errors are correlated: e0 is the sum of `a_i r_i`, so its variance is the sum of `a_i a_j C(d_ij)`,
/// with the covariance C at a distance taken from the residuals themselves, in bins of distance, up to the first bin that
/// is not above zero by its own standard error.
///
/// The fit hides a part of what neighbours have in common: residuals near each other have covariance `C - P`, P the mean
/// variance of the fitted surface over the window: `hidden` times the variance that is looked for (of a plane about the
/// middle of its points three times, one for each of its parameters). Both are solved for together.
///
/// `told` are (u, v, residual, a_i) of the points with weight.
pub fn correlated_height_variance(told: &[[f64; 4]], hidden: f64) -> f64 {
    const THINNED: f64 = 350.0;
    let stride = (told.len() as f64 / THINNED).round().max(1.0) as usize;
    let sampled: Vec<[f64; 4]> = told.iter().filter(|p| is_taken(p[0], p[1], stride)).copied().collect();
    // The shares of the sampled points stand for all: their sum is 1, as that of all points is.
    let total: f64 = sampled.iter().map(|p| p[3]).sum();
    let count = sampled.len().max(1) as f64;
    let square = sampled.iter().map(|p| p[2] * p[2]).sum::<f64>() / count;
    // Thinning makes fewer points' own errors of many; those average out as the full number does.
    let own = square * sampled.iter().map(|p| (p[3] / total).powi(2)).sum::<f64>() * count / told.len().max(1) as f64;
    let bins = pairs_by_distance(&sampled, total);
    let mut variance = own;
    for _ in 0..8 {
        let covariance = |[pairs, products, _]: &[f64; 3]| products / pairs + hidden * variance;
        let common = bins.iter().skip_while(|b| b[0] < 8.0).take_while(|b| covariance(b) > square / b[0].sqrt());
        variance = own + 2.0 * common.map(|b| covariance(b) * b[2]).sum::<f64>();
    }
    variance
}

/// Pairs of (u, v, residual, share) by their distance, up to half of the window's radius: their number, the sum of the
/// products of residuals and that of the products of shares over the square of all shares. Further apart the plane has taken
/// out what points have in common.
fn pairs_by_distance(sampled: &[[f64; 4]], total: f64) -> [[f64; 3]; 4] {
    let reach = sampled.iter().map(|p| p[0].hypot(p[1])).fold(1e-9, f64::max);
    let mut bins = [[0.0; 3]; 4];
    let per_bin = bins.len() as f64 / (0.5 * reach);
    for (i, p) in sampled.iter().enumerate() {
        for q in &sampled[..i] {
            if let Some(bin) = bins.get_mut(((p[0] - q[0]).hypot(p[1] - q[1]) * per_bin) as usize) {
                bin[0] += 1.0;
                bin[1] += p[2] * q[2];
                bin[2] += p[3] * q[3] / (total * total);
            }
        }
    }
    bins
}

/// One weighted least-squares step: plane, inverse normal matrix, points with weight.
fn weighted_plane(
    points: &[[f64; 3]],
    plane: &[f64; 3],
    width: f64,
    scale: f64,
) -> Option<([f64; 3], Matrix3<f64>, usize)> {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    let mut kept = 0;
    for p in points {
        let residual = p[2] - height(plane, p[0], p[1]);
        let weight = tukey_weight(residual, width);
        if weight > 0.0 {
            kept += 1;
            let row = Vector3::new(1.0, p[0] / scale, p[1] / scale);
            normal += row * row.transpose() * weight;
            right += row * (weight * residual);
        }
    }
    let unit = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0 / scale, 1.0 / scale));
    let inverse = normal.cholesky()?.inverse();
    let step = unit * (inverse * right);
    let moved = [plane[0] + step[0], plane[1] + step[1], plane[2] + step[2]];
    moved.iter().all(|c| c.is_finite()).then_some((moved, unit * inverse * unit, kept))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(height: impl Fn(f64, f64, usize) -> f64) -> Vec<[f64; 3]> {
        (0..400)
            .map(|i| {
                let (u, v) = ((i % 20) as f64 * 0.2 - 1.9, (i / 20) as f64 * 0.2 - 1.9);
                [u, v, height(u, v, i)]
            })
            .collect()
    }

    #[test]
    fn plane_is_exact_on_exact_heights() {
        let points = lattice(|u, v, _| 0.7 + 0.03 * u - 0.05 * v);
        let layer = fit_layer(&points, 0.9, 12).unwrap();
        for (got, expected) in layer.plane.iter().zip([0.7, 0.03, -0.05]) {
            assert!((got - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn a_second_sheet_below_does_not_capture_it() {
        // A third of the points lies 1.2 mm deeper; small alternating heights stand for noise.
        let points =
            lattice(|u, _, i| 0.01 * u + if i % 3 == 0 { -1.2 } else { 0.0 } + if i % 2 == 0 { 0.02 } else { -0.02 });
        let heights: Vec<f64> = points.iter().map(|p| p[2]).collect();
        let start = most_frequent_height(&heights, 1.0).unwrap();
        let layer = fit_layer(&points, start, 12).unwrap();
        assert!(layer.plane[0].abs() < 0.004, "{:?}", layer.plane);
    }

    #[test]
    fn of_two_equal_layers_the_outer_one_counts() {
        let heights: Vec<f64> = (0..200).map(|i| if i % 2 == 0 { 0.0 } else { -2.0 }).collect();
        assert!(most_frequent_height(&heights, 1.0).unwrap().abs() < 1e-9);
        assert!((most_frequent_height(&heights, -1.0).unwrap() + 2.0).abs() < 1e-9);
        assert_eq!(most_frequent_height(&[], 1.0), None);
    }

    /// Heights with 80 % of their variance each point's own and 20 % in common, covariance exp(-d²/2l²), l = 0.5 mm: the model
    /// of the measuring rig. Over 60 layers the errors of e0 must agree with what is stated, to three standard errors of an
    /// rms of 60 values (28 %) and the share of correlation further than half the window that is not looked for.
    #[test]
    fn stated_uncertainty_knows_of_correlated_noise() {
        use rand::{RngExt, SeedableRng};
        let mut sum = 0.0;
        for seed in 0..60 {
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            // Sums of four uniforms: near enough to Gaussian.
            let mut draw = || (0..4).map(|_| rng.random_range(-1.0..1.0)).sum::<f64>() * 0.75_f64.sqrt();
            let knots: Vec<[f64; 3]> =
                (0..900).map(|k| [(k % 30) as f64 * 0.25 - 3.75, (k / 30) as f64 * 0.25 - 3.75, draw()]).collect();
            // White noise of density 1 per 0.25² mm² smoothed with exp(-d²/l²) has variance 2 pi (l/2)² / 0.25².
            let unit = (0.25 * 0.25 / (0.5 * std::f64::consts::PI * 0.25_f64)).sqrt();
            let mut points = Vec::new();
            for i in 0..20 * 20 {
                let (u, v) = ((i % 20) as f64 * 0.2 - 1.9, (i / 20) as f64 * 0.2 - 1.9);
                if u.hypot(v) < 2.0 {
                    let weight = |k: &[f64; 3]| k[2] * (-((u - k[0]).powi(2) + (v - k[1]).powi(2)) / 0.25).exp();
                    let common = unit * knots.iter().map(weight).sum::<f64>();
                    points.push([u, v, 0.12 * (0.2_f64.sqrt() * common + 0.8_f64.sqrt() * draw())]);
                }
            }
            let layer = fit_layer(&points, 0.0, 12).unwrap();
            sum += (layer.plane[0] / layer.u_height_mm).powi(2) / 60.0;
        }
        assert!((0.7..1.5).contains(&sum.sqrt()), "{}", sum.sqrt());
    }

    /// Two layers of sheet, equally dense: neither is the surface, and their mean least of all.
    #[test]
    fn two_equal_layers_are_no_layer() {
        use rand::{RngExt, SeedableRng};
        for (count, seed) in [100, 150, 300, 2000].into_iter().flat_map(|n| (0..50).map(move |s| (n, s))) {
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut draw = || (0..4).map(|_| rng.random_range(-1.0..1.0)).sum::<f64>() * 0.75_f64.sqrt();
            let points: Vec<[f64; 3]> = (0..count).map(|_| [2.0 * draw(), 2.0 * draw(), 0.12 * draw()]).collect();
            // By the binomial of a share of 21.3 %, chance alone would speak up in 9e-4 of windows with 100 points, 5e-4 of those with 150
            // and 1e-5 with 300: in 0.07 of these 200. The seeds are fixed, and there it does not.
            assert!(fit_layer(&points, 0.0, 12).is_some(), "{count} points, seed {seed}");
            // A hundred points that scatter by 0.12 mm do not always tell layers 0.8 mm apart.
            for apart_mm in if count < 300 { vec![1.4] } else { vec![0.8, 1.4] } {
                let shifted = |(k, p): (usize, &[f64; 3])| [p[0], p[1], p[2] + if k % 2 == 0 { apart_mm } else { 0.0 }];
                let both: Vec<[f64; 3]> = points.iter().enumerate().map(shifted).collect();
                // Either no layer, or one of the two.
                if let Some(layer) = fit_layer(&both, 0.5 * apart_mm, 12) {
                    let off_mm = layer.plane[0].min(apart_mm - layer.plane[0]).abs();
                    assert!(off_mm < 0.15, "{count} points, seed {seed}: {:?}", layer.plane);
                }
            }
        }
    }

    #[test]
    fn too_few_points_are_no_layer() {
        let points = lattice(|_, _, _| 0.0);
        assert!(fit_layer(&points[..8], 0.0, 12).is_none());
    }
}
