//! The statistics of a type-1 study: plain functions of numbers.
//!
//! Capability of a gauge, for a tolerance `T` (upper less lower limit), the standard deviation `s` of repeated measurements and their
//! bias: `Cg = 0.2 T / (6 s)` and `Cgk = (0.1 T - |bias|) / (3 s)`, both to be 1.33 at least. This is the convention of Bosch's booklet 10
//! ("procedure 1") and the default of Minitab's "Type 1 gage study" (20 % of the tolerance, six standard deviations). Others take 15 % of
//! the tolerance, or four standard deviations: figures of two programs are comparable only where the convention is the same.

/// What Cg and Cgk must reach.
pub const LIMIT: f64 = 1.33;
/// Share of the tolerance that the measurements' spread is compared with.
const SHARE: f64 = 0.2;

/// Arithmetic mean; `None` of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation of a sample (sum of squares over n - 1); `None` of fewer than two values.
pub fn standard_deviation(values: &[f64]) -> Option<f64> {
    let middle = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - middle).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

/// Middle value, or the mean of the two middle ones; `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = sorted.get(sorted.len() / 2)?;
    let lower = sorted.get((sorted.len() - 1) / 2)?;
    Some(0.5 * (lower + upper))
}

/// `Cg = 0.2 T / (6 s)`; infinite where nothing scatters.
pub fn cg(tolerance_mm: f64, standard_deviation_mm: f64) -> f64 {
    SHARE * tolerance_mm / (6.0 * standard_deviation_mm)
}

/// `Cgk = (0.1 T - |bias|) / (3 s)`; at most `Cg`, negative where the bias alone is more than a tenth of the tolerance.
pub fn cgk(tolerance_mm: f64, bias_mm: f64, standard_deviation_mm: f64) -> f64 {
    (0.5 * SHARE * tolerance_mm - bias_mm.abs()) / (3.0 * standard_deviation_mm)
}

/// The least tolerance for which `Cgk` (with no bias `Cg`) reaches [`LIMIT`], mm.
pub fn least_tolerance_mm(bias_mm: f64, standard_deviation_mm: f64) -> f64 {
    (bias_mm.abs() + 3.0 * LIMIT * standard_deviation_mm) / (0.5 * SHARE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_numbers_come_back() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(&values), Some(5.0));
        // Squares 9 1 1 1 0 0 4 16 = 32, over 7.
        assert_eq!(standard_deviation(&values), Some((32.0_f64 / 7.0).sqrt()));
        assert_eq!(median(&values), Some(4.5));
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!((mean(&[]), median(&[]), standard_deviation(&[1.0])), (None, None, None));
    }

    /// By hand: T = 1, s = 0.02: Cg = 0.2 / 0.12 = 1.667; with a bias of 0.025 Cgk = 0.075 / 0.06 = 1.25.
    #[test]
    fn capability_by_hand() {
        assert!((cg(1.0, 0.02) - 5.0 / 3.0).abs() < 1e-12);
        assert!((cgk(1.0, 0.025, 0.02) - 1.25).abs() < 1e-12);
        assert_eq!(cgk(1.0, -0.025, 0.02), cgk(1.0, 0.025, 0.02));
        assert!((cgk(1.0, 0.0, 0.02) - cg(1.0, 0.02)).abs() < 1e-12);
        assert!(cgk(1.0, 0.2, 0.02) < 0.0);
        assert_eq!(cg(1.0, 0.0), f64::INFINITY);
    }

    #[test]
    fn the_least_tolerance_just_reaches_the_limit() {
        for (bias, s) in [(0.0, 0.02), (0.013, 0.011), (-0.05, 0.03)] {
            assert!((cgk(least_tolerance_mm(bias, s), bias, s) - LIMIT).abs() < 1e-12);
        }
    }
}
