//! The smooth part of the error: how far the camera model is off, as a function of the place in the measuring volume.

use super::{Stream, stream};
use crate::geometry::{Point3, Vector3};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

/// Waves that are added; their sum is nearly normal.
const WAVES: usize = 48;

/// A random field of mean 0, variance 1 and correlation exp(-r² / 2 l²) over places, by random waves.
#[derive(Debug, Clone)]
pub(super) struct SmoothVolume {
    waves: Vec<(Vector3, f64)>,
}

impl SmoothVolume {
    pub(super) fn new(seed: u64, length: f64) -> Self {
        let mut rng = stream(seed, Stream::Bias);
        let waves = (0..WAVES)
            .map(|_| {
                let number = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng)) / length;
                (number, std::f64::consts::TAU * rng.random::<f64>())
            })
            .collect();
        Self { waves }
    }

    pub(super) fn at(&self, place: &Point3) -> f64 {
        let sum: f64 = self.waves.iter().map(|(number, phase)| (number.dot(&place.coords) + phase).cos()).sum();
        sum * (2.0 / WAVES as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variance_and_correlation_are_as_asked() {
        let length = 3.0;
        for lag in [0.0, 1.5, 3.0, 6.0] {
            let mut sum = 0.0;
            let seeds = 4000;
            for seed in 0..seeds {
                let field = SmoothVolume::new(seed, length);
                let at = Point3::new(1.0, 2.0, 3.0);
                sum += field.at(&at) * field.at(&(at + Vector3::new(0.6, 0.0, 0.8) * lag));
            }
            let expected: f64 = (-0.5 * (lag / length).powi(2)).exp();
            // The product of two normals scatters by 1.5 at most: 0.023 over 4000 seeds, four times that.
            assert!((sum / seeds as f64 - expected).abs() < 0.1, "lag {lag}: {}", sum / seeds as f64);
        }
    }
}
