//! Numbers of a merge as the window writes them, lengths in the unit of the views.

use crate::geometry::LengthUnit;
use crate::gui::text::Words;
use crate::plan::merge::Metric;

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
    let text = length(value, of, words);
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
        let thresholds = [0.002, 150.0, 0.0, 12.5, 0.012345, 98765.4].map(|v| threshold(v, en));
        assert_eq!(thresholds, ["0.002", "150", "0", "12.5", "0.01235", "98765"]);
        assert_eq!([0.0020049, 149.7, 0.0, 98765.4].map(rounded), [0.002, 150.0, 0.0, 98800.0]);
        assert_eq!(percent(0.8041, de), "80,4 %");
        // A key moves a slider by a place: 0.42 of 212 must not be lost, and a span far from zero neither.
        assert_eq!([on_rail(149.58, 212.0), on_rail(1000.5012, 1.0), on_rail(5.0, 0.0)], [149.6, 1000.501, 5.0]);
        assert_eq!(on_rail(123_456.0, 1e6), 123_000.0);
    }
}
