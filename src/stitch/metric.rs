//! Figures of quality (endoscope paper, section 4), and scores made of several of them.

pub use crate::plan::merge::{Better, Metric};

/// b / a: signal attenuation, by which sharp images are told from blurred ones. Where there is no background there is no number.
pub fn attenuation(a: f32, b: f32) -> f32 {
    let ratio = b / a;
    if a > 0.0 && ratio.is_finite() { ratio } else { f32::NAN }
}

/// Standard deviation of a pixel's intensities over a sequence (the whole sequence is known: divided by its length).
pub fn standard_deviation(samples: &[f64]) -> f64 {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / n;
    (samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Scores by several metrics at once: the sum over them of a point's place among all, 0 for the worst. Equal values share the mean of
/// their places; what is no number is worst of all. `columns`: values of each metric, all of one length.
pub fn rank_sum(columns: &[(Metric, &[f32])]) -> Vec<f64> {
    let count = columns.first().map_or(0, |(_, values)| values.len());
    let mut sum = vec![0.0; count];
    for (metric, values) in columns {
        let score = |k: u32| {
            let score = metric.score(f64::from(values[k as usize]));
            if score.is_nan() { f64::NEG_INFINITY } else { score + 0.0 }
        };
        let mut order: Vec<u32> = (0..values.len() as u32).collect();
        order.sort_unstable_by(|a, b| score(*a).total_cmp(&score(*b)));
        let mut first = 0;
        while first < order.len() {
            let same = order[first..].iter().take_while(|k| score(**k) == score(order[first])).count();
            let place = first as f64 + 0.5 * (same - 1) as f64;
            order[first..first + same].iter().for_each(|k| sum[*k as usize] += place);
            first += same;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_background_there_is_no_attenuation() {
        assert!(attenuation(0.0, 1.0).is_nan() && attenuation(4.0, 1.0) == 0.25);
        assert!(attenuation(1e-40, 1.0).is_nan());
    }

    /// By b the places are 2, 0.5, 0.5, 3, by d_cal (smaller is better) 1, 3, 2, 0: no number is worst.
    #[test]
    fn ranks_of_several_metrics_are_added_and_ties_shared() {
        let (b, d) = ([5.0, 1.0, 1.0, 9.0], [30.0, 10.0, 20.0, f32::NAN]);
        let sum = rank_sum(&[(Metric::Strength, &b), (Metric::CalibrationDistance, &d)]);
        assert_eq!(sum, [3.0, 3.5, 2.5, 3.0]);
        assert!(rank_sum(&[]).is_empty());
    }

    /// Of a clean sinusoid the standard deviation over evenly spaced phases is b / sqrt(2), so that sigma_i and b rank alike.
    #[test]
    fn phase_shift_variation_of_a_clean_sinusoid_is_b_over_root_two() {
        let b = 0.3;
        let samples: Vec<f64> =
            (0..8).map(|k| 0.5 + b * (std::f64::consts::TAU * f64::from(k) / 8.0 + 0.7).cos()).collect();
        assert!((standard_deviation(&samples) - b / 2f64.sqrt()).abs() < 1e-12);
    }
}
