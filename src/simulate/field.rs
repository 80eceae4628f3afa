//! Smooth random fields over the image plane: white noise on a grid, blurred with a Gaussian, read by interpolation.

use super::blank::Uv;
use super::rig::{Stream, stream};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Grid steps a correlation length.
const STEPS_PER_LENGTH: f64 = 2.0;

/// A field of mean 0 and variance 1 with covariance exp(-r² / 2 l²).
#[derive(Debug, Clone)]
pub struct SmoothField {
    origin: Uv,
    step: f64,
    columns: usize,
    rows: usize,
    nodes: Vec<f32>,
    /// Correlation of two neighbouring nodes.
    neighbour: f64,
}

impl SmoothField {
    /// A field over the box `min`..`max` with correlation length `length_mm`; `use_of` names the random numbers of a row.
    pub(super) fn new(seed: u64, use_of: fn(usize) -> Stream, min: Uv, max: Uv, length_mm: f64) -> Self {
        let step = length_mm / STEPS_PER_LENGTH;
        let columns = ((max.x - min.x) / step) as usize + 2;
        let rows = ((max.y - min.y) / step) as usize + 2;
        // White noise blurred with a Gaussian of sigma has covariance exp(-r² / 4 sigma²): sigma = l / sqrt 2.
        let sigma = STEPS_PER_LENGTH * std::f64::consts::FRAC_1_SQRT_2;
        let reach = (4.0 * sigma).ceil() as usize;
        let mut kernel: Vec<f32> =
            (0..=2 * reach).map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp() as f32).collect();
        let norm = kernel.iter().map(|k| k * k).sum::<f32>().sqrt();
        kernel.iter_mut().for_each(|k| *k /= norm);
        let blurred_rows: Vec<Vec<f32>> = (0..rows + 2 * reach)
            .into_par_iter()
            .map(|row| {
                let mut rng = stream(seed, use_of(row));
                let white: Vec<f32> = (0..columns + 2 * reach).map(|_| StandardNormal.sample(&mut rng)).collect();
                white.windows(kernel.len()).map(|w| w.iter().zip(&kernel).map(|(a, b)| a * b).sum()).collect()
            })
            .collect();
        let nodes = (0..rows)
            .into_par_iter()
            .flat_map_iter(|row| {
                let (blurred_rows, kernel) = (&blurred_rows, &kernel);
                (0..columns).map(move |c| kernel.iter().enumerate().map(|(k, w)| w * blurred_rows[row + k][c]).sum())
            })
            .collect();
        let neighbour = (-0.5 / (STEPS_PER_LENGTH * STEPS_PER_LENGTH)).exp();
        Self { origin: min, step, columns, rows, nodes, neighbour }
    }

    /// The value at a place; the nearest one outside the box.
    pub fn at(&self, q: &Uv) -> f64 {
        let split = |x: f64, count: usize| {
            let x = (x / self.step).clamp(0.0, (count - 2) as f64 + 0.999_999);
            (x as usize, x - x.floor())
        };
        let (i, s) = split(q.x - self.origin.x, self.columns);
        let (j, t) = split(q.y - self.origin.y, self.rows);
        let node = |i: usize, j: usize| f64::from(self.nodes[j * self.columns + i]);
        let low = node(i, j) * (1.0 - s) + node(i + 1, j) * s;
        let high = node(i, j + 1) * (1.0 - s) + node(i + 1, j + 1) * s;
        // Between nodes an average loses variance; it is given back.
        let variance = |s: f64| 1.0 - 2.0 * s * (1.0 - s) * (1.0 - self.neighbour);
        (low * (1.0 - t) + high * t) / (variance(s) * variance(t)).sqrt()
    }

    /// The value below which this share of the field lies.
    pub fn quantile(&self, share: f64) -> f64 {
        let mut sorted = self.nodes.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let index = (share.clamp(0.0, 1.0) * (sorted.len() - 1) as f64).round() as usize;
        f64::from(sorted[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variance_and_correlation_are_as_asked() {
        let length = 0.5;
        let field = SmoothField::new(7, Stream::DepthRow, Uv::new(0.0, 0.0), Uv::new(120.0, 120.0), length);
        for (lag, limit) in [(0.0, 0.02), (0.25, 0.02), (0.5, 0.02), (1.0, 0.02), (3.0, 0.02)] {
            let mut sum = 0.0;
            let n = 160_000;
            for k in 0..n {
                let q = Uv::new(0.29 * (k % 400) as f64, 0.2913 * (k / 400) as f64);
                sum += field.at(&q) * field.at(&Uv::new(q.x + lag, q.y));
            }
            // 120² mm² hold about 120² / (2 pi l²) = 9 000 independent places: the mean of products scatters by 0.015
            // at lag 0 and 0.011 far away; linear interpolation bends the correlation by up to 0.01.
            let expected: f64 = (-0.5 * (lag / length).powi(2)).exp();
            assert!((sum / n as f64 - expected).abs() < limit + 0.015, "lag {lag}: {} for {expected}", sum / n as f64);
        }
    }
}
