//! Smooth errors of both measurements, by how good the points are: what places differ in beyond their noise.
//!
//! The quality by which points were merged tells where such errors are large, not how large. Places are put into classes of about as many
//! each, by the worse quality of the two clouds there, and each class tells its own spread, which a worn place or two do not pull.

use crate::fit::robust::mad_scale_about_zero;

/// Places of a class, at least.
const CLASS: usize = 60;
/// Classes at most: few and sure ones.
const MOST: usize = 8;
/// Neighbouring places share points: about pi of them for each that is by itself; and a median deviation makes of these what 0.37 of them
/// would tell as a standard deviation.
const FREEDOM_OF_A_PLACE: f64 = 0.37 / std::f64::consts::PI;

/// Scales by badness, rising.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothErrors {
    /// Of each class its mean badness, the robust standard deviation of its differences, and what of it the noise leaves.
    classes: Vec<[f64; 3]>,
    /// Degrees of freedom that a class's scale is told by.
    freedom: f64,
}

impl SmoothErrors {
    /// Of places: badness (the same for all, or no number, makes one class), difference from the fit, noise.
    pub(super) fn new(places: &[[f64; 3]]) -> Self {
        let mut sorted: Vec<[f64; 3]> = places.iter().copied().filter(|[badness, ..]| badness.is_finite()).collect();
        if sorted.len() < places.len() {
            sorted = places.iter().map(|[_, left, noise]| [0.0, *left, *noise]).collect();
        }
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let even = sorted.first().map(|p| p[0]) == sorted.last().map(|p| p[0]);
        let count = if even { 1 } else { (sorted.len() / CLASS).clamp(1, MOST) };
        let mut classes: Vec<[f64; 3]> = Vec::new();
        for k in 0..count {
            let class = &sorted[k * sorted.len() / count..(k + 1) * sorted.len() / count];
            let mean = |axis: usize, power: i32| {
                class.iter().map(|p| p[axis].powi(power)).sum::<f64>() / class.len().max(1) as f64
            };
            let left: Vec<f64> = class.iter().map(|p| p[1]).collect();
            let sigma = mad_scale_about_zero(&left).unwrap_or(0.0);
            let excess = (sigma * sigma - mean(2, 2)).max(0.0).sqrt();
            classes.push([mean(0, 1), sigma, excess]);
        }
        // Errors grow with badness, wear does not: what a class differs in beyond a worse one is no error, but wear on many of its places.
        for k in (1..classes.len()).rev() {
            let [_, sigma, excess] = classes[k];
            classes[k - 1][1] = classes[k - 1][1].min(sigma);
            classes[k - 1][2] = classes[k - 1][2].min(excess);
        }
        let freedom = (sorted.len() as f64 / count as f64 * FREEDOM_OF_A_PLACE).max(1.0);
        Self { classes, freedom }
    }

    /// Robust standard deviation of differences at a place of that badness.
    pub(super) fn sigma(&self, badness: f64) -> f64 {
        self.at(badness, 1)
    }

    /// What of it the noise leaves.
    pub fn beyond_noise(&self, badness: f64) -> f64 {
        self.at(badness, 2)
    }

    /// With scales made so much larger that `z` of them are as rare as `z` of a scale that is known: a class tells its own by few places.
    pub(super) fn widened(mut self, z: f64) -> Self {
        let by = self.student(z) / z;
        self.classes.iter_mut().for_each(|class| class[2] *= by);
        self
    }

    /// What so many standard deviations of a normal number are of one whose standard deviation is told by a class only: Student's quantile,
    /// by Wallace's approximation.
    fn student(&self, z: f64) -> f64 {
        let v = self.freedom;
        let wide = z * (8.0 * v + 3.0) / (8.0 * v + 1.0);
        (v * (wide * wide / v).min(100.0).exp_m1()).sqrt()
    }

    /// Between the means of classes evenly; worse than the last one as from the one before to it.
    fn at(&self, badness: f64, of: usize) -> f64 {
        let Some(last) = self.classes.last() else { return 0.0 };
        if self.classes.len() == 1 || badness.is_nan() {
            return last[of];
        }
        let next = self.classes.partition_point(|c| c[0] < badness).clamp(1, self.classes.len() - 1);
        let (low, high) = (self.classes[next - 1], self.classes[next]);
        let share = ((badness - low[0]) / (high[0] - low[0]).max(f64::MIN_POSITIVE)).max(0.0);
        low[of] + (high[of] - low[of]) * share
    }

    /// In the middle class.
    pub fn typical(&self) -> f64 {
        self.classes.get(self.classes.len() / 2).map_or(0.0, |c| c[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Two-sided 1 % of Student's distribution: 2.704 of 40 degrees of freedom, 3.169 of 10, 4.032 of 5.
    #[test]
    fn scales_that_few_places_tell_ask_for_more() {
        for (freedom, expected) in [(40.0, 2.704), (10.0, 3.169), (5.0, 4.032)] {
            let found = SmoothErrors { classes: Vec::new(), freedom }.student(2.576);
            assert!((found / expected - 1.0).abs() < 0.02, "{freedom}: {found}");
        }
    }

    #[test]
    fn errors_that_grow_with_badness_are_told_as_such() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut places: Vec<[f64; 3]> = (0..2000)
            .map(|k| {
                let badness = f64::from(k) / 2000.0;
                [badness, normal() + 5.0 * badness * normal(), 1.0]
            })
            .collect();
        // A worn twentieth, everywhere.
        places.iter_mut().step_by(20).for_each(|p| p[1] -= 40.0);
        let smooth = SmoothErrors::new(&places);
        // 250 places of a class tell a robust scale to 7 %, of a square less 1; worn ones add 7 % to a scale; classes are wide. Three times that.
        for badness in [0.5, 0.75, 0.9] {
            let found = smooth.beyond_noise(badness);
            assert!((found / (5.0 * badness) - 1.0).abs() < 0.35, "{badness}: {found}");
        }
        assert!(smooth.beyond_noise(0.05) < 1.0);
        let flat: Vec<[f64; 3]> = places.iter().map(|p| [f64::NAN, p[1], p[2]]).collect();
        assert_eq!(SmoothErrors::new(&flat).classes.len(), 1);
    }
}
