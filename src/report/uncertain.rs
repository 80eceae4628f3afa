//! A value told to a tenth of its uncertainty: further digits say nothing, fewer hide what is known.

/// A value and its standard uncertainty, both rounded to the second digit of the uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty.
    pub u: f64,
    /// Decimals that both are written with.
    pub decimals: usize,
}

/// Rounds a value and its uncertainty. `None` where there is no uncertainty to go by: it is 0, negative or no number, or the value is none.
pub fn told(value: f64, u: f64) -> Option<Told> {
    /// No length that is measured has more.
    const MOST_DECIMALS: i32 = 12;
    if !(value.is_finite() && u.is_finite() && u > 0.0) {
        return None;
    }
    let digits = (1 - u.log10().floor() as i32).min(MOST_DECIMALS);
    let rounded = |v: f64| match digits {
        0.. => v,
        // What is larger than a hundred loses whole digits.
        _ => (v / 10f64.powi(-digits)).round() * 10f64.powi(-digits),
    };
    Some(Told { value: rounded(value), u: rounded(u), decimals: digits.max(0) as usize })
}

/// `+4.60 ± 0.33` as reports write it; the value alone in three digits where its uncertainty is not known. The sign is told where asked for.
pub fn with_u(value: f64, u: f64, signed: bool) -> String {
    let text = match told(value, u) {
        Some(Told { value, u, decimals }) if signed => format!("{value:+.decimals$} ± {u:.decimals$}"),
        Some(Told { value, u, decimals }) => format!("{value:.decimals$} ± {u:.decimals$}"),
        None if signed && value > 0.0 => format!("+{}", super::mask_study::short(value)),
        None => super::mask_study::short(value),
    };
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_the_digits_that_its_uncertainty_leaves() {
        for (value, u, wanted) in [
            (4.604, 0.332, "+4.60 ± 0.33"),
            (-35.695, 5.595, "\u{2212}35.7 ± 5.6"),
            (0.004_604, 0.000_332, "+0.00460 ± 0.00033"),
            (105_989.9, 17_442.7, "+106000 ± 17000"),
            (12.0, 0.0, "+12.0"),
            (-0.5, f64::NAN, "\u{2212}0.500"),
        ] {
            assert_eq!(with_u(value, u, true), wanted);
        }
        assert_eq!(with_u(105_989.9, 17_442.7, false), "106000 ± 17000");
        // The last digit stands for a tenth of the uncertainty or less, never for less than a hundredth.
        for k in 0..600 {
            let u = 10f64.powf(f64::from(k) / 100.0 - 4.0);
            let step = 10f64.powi(u.log10().floor() as i32 - 1);
            let (value, found) = (1_234.567_8, told(1_234.567_8, u).unwrap());
            if step < 0.5 {
                assert!((10f64.powi(-(found.decimals as i32)) / step - 1.0).abs() < 1e-9, "{u} {found:?}");
                assert_eq!((found.value, found.u), (value, u), "the digits are left to the decimals");
            } else {
                assert!(found.decimals == 0 && (found.value - value).abs() <= 0.5 * step, "{u} {found:?}");
            }
            assert!(step <= 0.1 * u * (1.0 + 1e-9) && step >= 0.01 * u * (1.0 - 1e-9));
        }
        assert_eq!((told(1.0, 0.0), told(f64::NAN, 1.0)), (None, None));
    }
}
