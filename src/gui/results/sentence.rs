//! Why a point has its verdict, in one or two sentences.

use crate::gui::text::Words;
use crate::inspect::{PointResult, Verdict};
use crate::report::words::is_distance;

/// The sentences of a point, in the language of the words. A reason that the inspection gave comes from the library.
pub fn of_point(point: &PointResult, words: &Words) -> String {
    let Some(m) = &point.measurement else {
        let reason = point.reason.as_deref().map(|reason| words.told(reason));
        return reason.unwrap_or_else(|| words.text("results.no_reason").to_owned());
    };
    let d = m.deviation_mm;
    let number = |v: f64| words.number(v.abs(), 3);
    let (above, below) = (d - point.upper_mm, point.lower_mm - d);
    let past = above.max(below);
    let where_key = if is_distance(point) {
        "results.why_distance"
    } else {
        match (point.kind, d >= 0.0) {
            ("edge", true) => "results.why_edge_long",
            ("edge", false) => "results.why_edge_short",
            ("surface", true) => "results.why_surface_high",
            ("surface", false) => "results.why_surface_low",
            (_, true) => "results.why_hole_along",
            (_, false) => "results.why_hole_against",
        }
    };
    let limit_key = match (past > 0.0, above > below) {
        (true, true) => "results.why_above_upper",
        (true, false) => "results.why_below_lower",
        (false, true) => "results.why_inside_upper",
        (false, false) => "results.why_inside_lower",
    };
    let verdict_key = match point.verdict {
        // A plan may judge by the value alone.
        Verdict::Fail | Verdict::Pass if past.abs() < m.uncertainty_mm => "results.why_plain",
        Verdict::Fail => "results.why_fail",
        Verdict::Undecided => "results.why_undecided",
        Verdict::Pass => "results.why_pass",
        Verdict::NotMeasured => "results.no_reason",
    };
    let place = words.fill(where_key, &[("mm", &number(d))]);
    let limit = words.fill(limit_key, &[("mm", &number(past))]);
    let verdict = words.fill(verdict_key, &[("u", &number(m.uncertainty_mm))]);
    // An undecided point may have a reason of its own, beside the nearness of a limit.
    match (&point.reason, point.verdict) {
        (Some(reason), Verdict::Undecided) if past.abs() > m.uncertainty_mm => {
            format!("{place}, {limit}. {}", words.told(reason))
        }
        _ => format!("{place}, {limit}. {verdict}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::report::example;

    #[test]
    fn sentences_tell_direction_limit_and_doubt() {
        let result = example::bracket();
        let points = &example::inspection(&result).points;
        let of = |name: &str| of_point(points.iter().find(|p| p.name == name).unwrap(), Words::of(Language::English));
        assert_eq!(
            of("E03"),
            "The edge ends 0.958 mm short of its nominal place, 0.258 mm below the lower limit. That is more than the \
             uncertainty of 0.054 mm, so it is out of tolerance beyond doubt."
        );
        assert!(of("P03").contains("0.010 mm inside the lower limit"), "{}", of("P03"));
        assert!(of("P03").contains("0.017 mm"), "{}", of("P03"));
        assert!(of("P09").starts_with("The surface stands 0.336 mm above"), "{}", of("P09"));
        assert_eq!(of("E05"), "Too few points: sheet cannot be told from the belt");
        for language in Language::ALL {
            for p in points {
                let said = of_point(p, Words::of(language));
                assert!(!said.contains("results.") && !said.contains('{'), "{said}");
            }
        }
    }
}
