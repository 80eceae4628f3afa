//! Robust statistics: Tukey's biweight, median, MAD.
//!
//! Widths and scales are in the quantity of the residual itself (mm for distances), never squared.

/// Width of Tukey's weight in standard deviations for 95 % efficiency on Gaussian residuals.
pub const TUKEY_WIDTH_SIGMAS: f64 = 4.685;

/// Turns a median absolute deviation into a standard deviation for Gaussian residuals: 1 / (0.75 quantile of the normal).
pub const SIGMA_OF_MAD: f64 = 1.482_602_218_505_602;

/// Tukey's biweight for a residual and a width in the same unit: `(1 - (r/k)²)²` inside, 0 outside.
pub fn tukey_weight(residual: f64, width: f64) -> f64 {
    tukey_weight_of_square(residual * residual, width)
}

/// The same for a residual that is known by its square.
pub fn tukey_weight_of_square(residual_sq: f64, width: f64) -> f64 {
    let inside = 1.0 - residual_sq / (width * width);
    if inside > 0.0 { inside * inside } else { 0.0 }
}

/// The median; the mean of the two middle values for an even count. `None` without values. Reorders the slice; NaN sorts
/// by its sign to one of the ends.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let count = values.len();
    if count == 0 {
        return None;
    }
    let (below, middle, _) = values.select_nth_unstable_by(count / 2, f64::total_cmp);
    let upper = *middle;
    if count % 2 == 1 {
        return Some(upper);
    }
    let lower = below.iter().copied().max_by(f64::total_cmp).unwrap_or(upper);
    Some(0.5 * (lower + upper))
}

/// The middle one of the values, the upper one of two: one of them, where [`median`] may lie between two. `None` without values. Reorders
/// the slice.
pub fn middle_value(values: &mut [f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which the given share of the values lies (nearest rank, share clamped to 0..1). `None` without values.
/// Reorders the slice.
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let rank = ((values.len() - 1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
    Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Robust standard deviation of residuals whose centre is known to be zero: 1.4826 times the median of their sizes.
/// `None` without values.
pub fn mad_scale_about_zero(values: &[f64]) -> Option<f64> {
    let mut work: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    Some(SIGMA_OF_MAD * median(&mut work)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_even_and_zero_past_the_width() {
        for r in [0.0, 0.1, 0.7, 1.4, 1.99] {
            assert_eq!(tukey_weight(r, 2.0), tukey_weight(-r, 2.0));
            assert!(tukey_weight(r, 2.0) > 0.0);
        }
        assert_eq!(tukey_weight(0.0, 2.0), 1.0);
        assert_eq!(tukey_weight(2.0, 2.0), 0.0);
        assert_eq!(tukey_weight(-7.0, 2.0), 0.0);
    }

    /// Tukey's cost: `k²/6 (1 - (1 - (r/k)²)³)` inside, `k²/6` outside; `r²/2` for small residuals.
    fn tukey_rho(residual: f64, width: f64) -> f64 {
        let q = residual / width;
        let inside = (1.0 - q * q).max(0.0);
        width * width / 6.0 * (1.0 - inside * inside * inside)
    }

    #[test]
    fn weight_is_the_derivative_of_rho_over_the_residual() {
        let (k, d) = (1.7, 1e-6);
        for r in [0.05, 0.4, 1.0, 1.6, 1.9] {
            let slope = (tukey_rho(r + d, k) - tukey_rho(r - d, k)) / (2.0 * d);
            // Central differences of a cubic in r² with d = 1e-6: rounding 1e-10, truncation 1e-12.
            assert!((slope - r * tukey_weight(r, k)).abs() < 1e-8);
        }
        assert_eq!(tukey_rho(5.0, k), k * k / 6.0);
    }

    #[test]
    fn median_of_odd_even_and_none() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&mut []), None);
        assert_eq!(middle_value(&mut [4.0, 1.0, 2.0, 3.0]), Some(3.0));
        assert_eq!(middle_value(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(quantile(&mut [5.0, 1.0, 3.0], 1.0), Some(5.0));
    }

    #[test]
    fn scale_ignores_a_few_far_values() {
        // Quantiles of the standard normal at (i - 0.5)/999, by symmetry about 0: MAD must give 1 to the grid's resolution.
        let mut values: Vec<f64> =
            (1..=999).map(|i| crate::fit::soft_edge::normal::quantile((i as f64 - 0.5) / 999.0)).collect();
        assert!((mad_scale_about_zero(&values).unwrap() - 1.0).abs() < 3e-3);
        values.extend([1e6; 50]);
        // The median of the sizes moves up to their 52.5 % quantile, 0.714 instead of 0.674: 6 % more.
        assert!((mad_scale_about_zero(&values).unwrap() - 1.0).abs() < 0.1);
    }
}
