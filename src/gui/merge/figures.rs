//! Numbers of a merge as the window writes them, lengths in the unit of the views.

use crate::geometry::LengthUnit;
use crate::gui::text::Words;
use crate::plan::merge::Metric;
use crate::report::uncertain::{Told, told};

/// What stands where there is no value.
pub const NONE: &str = "–";

/// Decimals of a length, so that its last digit is about a tenth of what a sensor of that unit can tell.
pub fn decimals(unit: LengthUnit) -> usize {
    match unit {
        LengthUnit::Um => 1,
        LengthUnit::Mm => 3,
        LengthUnit::Cm | LengthUnit::Inch => 4,
        LengthUnit::M => 6,
    }
}

/// How a unit is written on screen.
pub fn unit(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Um => "µm",
        other => other.key(),
    }
}

/// A length without sign.
pub fn length(value: f64, of: LengthUnit, words: &Words) -> String {
    if value.is_finite() { words.number(value, decimals(of)) } else { NONE.to_owned() }
}

/// A length with its unit.
pub fn with_unit(value: f64, of: LengthUnit, words: &Words) -> String {
    format!("{} {}", length(value, of, words), unit(of))
}

/// A length with its sign.
pub fn signed(value: f64, of: LengthUnit, words: &Words) -> String {
    if value.is_finite() { plus(value, decimals(of), words) } else { NONE.to_owned() }
}

/// A number in the decimals that somebody gave it.
pub fn as_given(value: f64, words: &Words) -> String {
    let decimals = value.to_string().split_once('.').map_or(0, |(_, decimals)| decimals.len());
    words.number(value, decimals.min(9))
}

/// A value with its standard uncertainty, both to a tenth of that; alone, with the decimals of a length, where it is not known.
pub fn with_u(value: f64, u: f64, of: LengthUnit, words: &Words) -> String {
    match told(value, u) {
        Some(Told { value, u, decimals }) => {
            format!("{} ± {}", plus(value, decimals, words), words.number(u, decimals))
        }
        None => signed(value, of, words),
    }
}

/// An area with its standard uncertainty, as [`with_u`].
pub fn area(value: f64, u: f64, of: LengthUnit, words: &Words) -> String {
    let text = match told(value, u) {
        Some(Told { value, u, decimals }) => {
            format!("{} ± {}", words.number(value, decimals), words.number(u, decimals))
        }
        None => words.number(value, if value >= 100.0 { 0 } else { 2 }),
    };
    format!("{text} {}²", unit(of))
}

fn plus(value: f64, decimals: usize, words: &Words) -> String {
    let text = words.number(value, decimals);
    if value > 0.0 && text.bytes().any(|b| (b'1'..=b'9').contains(&b)) { format!("+{text}") } else { text }
}

/// A share in percent.
pub fn percent(share: f64, words: &Words) -> String {
    if share.is_finite() { format!("{} %", words.number(100.0 * share, 1)) } else { NONE.to_owned() }
}

/// A threshold in as many digits as it has, up to four.
pub fn threshold(value: f64, words: &Words) -> String {
    words.number(value, threshold_decimals(value))
}

/// Decimals that tell a threshold to four digits, without zeros at their end.
pub fn threshold_decimals(value: f64) -> usize {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    let most = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let scaled = |decimals: usize| value * 10f64.powi(decimals as i32);
    (0..most).find(|d| (scaled(*d) - scaled(*d).round()).abs() < 1e-6 * scaled(*d).abs().max(1.0)).unwrap_or(most)
}

/// A value in three digits, as people write thresholds.
pub fn rounded(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    let power = 10f64.powi(digits.abs());
    // Divided or multiplied by a whole power, so that 0.002 is the number that people write.
    if digits >= 0 { (value * power).round() / power } else { (value / power).round() * power }
}

/// 1, 2, 3, 5 or 10 times a power of ten, at least a value.
pub fn rounded_up(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 3.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|v| *v >= value * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// A value that a slider of a span was moved to, in no more digits than its places on the rail can tell apart.
pub fn on_rail(value: f64, span: f64) -> f64 {
    /// No slider is longer, points.
    const PLACES: f64 = 600.0;
    let step = (span.abs() / PLACES).log10().floor();
    if !step.is_finite() {
        return value;
    }
    let power = 10f64.powi((step as i32).abs());
    if step < 0.0 { (value * power).round() / power } else { (value / power).round() * power }
}

/// The unit in which a metric is told, if it has one.
pub fn metric_unit(metric: Metric, of: LengthUnit) -> &'static str {
    match metric {
        Metric::CalibrationDistance | Metric::CalibrationDistanceProjector | Metric::NonUniformity => unit(of),
        Metric::Reprojection => "px",
        Metric::NonUniformityAngle => "rad",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;

    #[test]
    fn lengths_have_the_decimals_of_their_unit_and_thresholds_their_own() {
        let (en, de) = (Words::of(Language::English), Words::of(Language::German));
        assert_eq!([length(4.72, LengthUnit::Um, en), length(0.0047, LengthUnit::Mm, de)], ["4.7", "0,005"]);
        assert_eq!([signed(0.94, LengthUnit::Um, en), signed(-0.94, LengthUnit::Um, en)], ["+0.9", "\u{2212}0.9"]);
        assert_eq!([signed(0.01, LengthUnit::Um, en), length(f64::NAN, LengthUnit::Um, en)], ["0.0", "–"]);
        assert_eq!(with_u(4.604, 0.332, LengthUnit::Um, en), "+4.60 ± 0.33");
        assert_eq!(with_u(-0.004_604, 0.000_332, LengthUnit::Mm, de), "\u{2212}0,00460 ± 0,00033");
        assert_eq!(
            [with_u(4.6, f64::NAN, LengthUnit::Um, en), with_u(4.6, 0.0, LengthUnit::Mm, en)],
            ["+4.6", "+4.600"]
        );
        assert_eq!(area(105_989.9, 17_442.7, LengthUnit::Um, en), "106000 ± 17000 µm²");
        assert_eq!([as_given(1001.5, de), as_given(0.7, en), as_given(12.0, en)], ["1001,5", "0.7", "12"]);
        let thresholds = [0.002, 150.0, 0.0, 12.5, 0.012345, 98765.4].map(|v| threshold(v, en));
        assert_eq!(thresholds, ["0.002", "150", "0", "12.5", "0.01235", "98765"]);
        assert_eq!([0.0020049, 149.7, 0.0, 98765.4].map(rounded), [0.002, 150.0, 0.0, 98800.0]);
        assert_eq!(percent(0.8041, de), "80,4 %");
        // A key moves a slider by a place: 0.42 of 212 must not be lost, and a span far from zero neither.
        assert_eq!([on_rail(149.58, 212.0), on_rail(1000.5012, 1.0), on_rail(5.0, 0.0)], [149.6, 1000.501, 5.0]);
        assert_eq!(on_rail(123_456.0, 1e6), 123_000.0);
    }

    #[test]
    fn the_range_of_a_scale_is_round() {
        let round = [0.0, 0.7, 1.0, 4.2, 5.0, 51.0, 0.0031].map(rounded_up);
        for (found, wanted) in round.into_iter().zip([1.0, 1.0, 1.0, 5.0, 5.0, 100.0, 0.005]) {
            assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
        }
    }
}
