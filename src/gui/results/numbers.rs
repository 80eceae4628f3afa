//! Numbers of points as the window writes them.

use crate::gui::text::Words;
use crate::inspect::PointResult;
use crate::report::words::{is_distance, percent_of_tolerance};

/// What stands where there is no value.
pub const NONE: &str = "–";

/// The deviation: with its sign, or without one where it is a distance.
pub fn deviation(point: &PointResult, words: &Words) -> String {
    let Some(m) = &point.measurement else { return NONE.to_owned() };
    if is_distance(point) { words.number(m.deviation_mm.abs(), 3) } else { words.signed_mm(m.deviation_mm) }
}

/// A limit; that of a distance has no plus.
pub fn limit(point: &PointResult, limit_mm: f64, words: &Words) -> String {
    if !limit_mm.is_finite() {
        NONE.to_owned()
    } else if is_distance(point) {
        words.number(limit_mm, 3)
    } else {
        words.signed_mm(limit_mm)
    }
}

/// U, k = 2.
pub fn uncertainty(point: &PointResult, words: &Words) -> String {
    point.measurement.as_ref().map_or_else(|| NONE.to_owned(), |m| words.number(m.uncertainty_mm, 3))
}

/// Deviation over tolerance.
pub fn percent(point: &PointResult) -> String {
    point.tolerance_ratio().map_or_else(|| NONE.to_owned(), percent_of_tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::report::example;

    #[test]
    fn signs_decimals_and_what_is_missing() {
        let result = example::bracket();
        let points = &example::inspection(&result).points;
        let of = |name: &str| points.iter().find(|p| p.name == name).unwrap();
        let (english, german) = (Words::of(Language::English), Words::of(Language::German));
        assert_eq!(deviation(of("E03"), english), "\u{2212}0.958");
        assert_eq!(deviation(of("P09"), english), "+0.336");
        assert_eq!(deviation(of("P09"), german), "+0,336");
        assert_eq!(deviation(of("E05"), english), "–");
        assert_eq!((uncertainty(of("E05"), english), percent(of("E05"))), ("–".into(), "–".into()));
        assert_eq!((uncertainty(of("E03"), english), percent(of("E03"))), ("0.054".into(), "137 %".into()));
        assert_eq!(limit(of("E03"), 0.7, english), "+0.700");
        assert_eq!(limit(of("E03"), f64::NEG_INFINITY, english), "–");
    }
}
