//! The words and the order that every report shares, so that paper, files and screen say the same.

use crate::inspect::{Measurement, PointResult, Verdict};

/// The program and its version, as every report states it.
pub const PROGRAM: &str = concat!("shapeline ", env!("CARGO_PKG_VERSION"));

/// The name and version of the result's layout.
pub const SCHEMA: &str = "shapeline-result/1";

/// A text for one line of a report: control characters, line separators and marks that change the direction of
/// writing become spaces or go, so that a name can neither break a row nor pose as another one.
pub fn clean(text: &str) -> String {
    text.chars()
        .filter(
            |c| !matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}'),
        )
        .map(|c| if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') { ' ' } else { c })
        .collect()
}

/// How many comparison points got each verdict.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// In tolerance.
    pub pass: usize,
    /// Out of tolerance.
    pub fail: usize,
    /// Too close to a limit.
    pub undecided: usize,
    /// Without a value.
    pub not_measured: usize,
}

impl Counts {
    /// Counts the points of one scan.
    pub fn of(points: &[PointResult]) -> Self {
        let count = |verdict| points.iter().filter(|p| p.verdict == verdict).count();
        Self {
            pass: count(Verdict::Pass),
            fail: count(Verdict::Fail),
            undecided: count(Verdict::Undecided),
            not_measured: count(Verdict::NotMeasured),
        }
    }

    /// All points.
    pub fn total(&self) -> usize {
        self.pass + self.fail + self.undecided + self.not_measured
    }
}

/// Indices of the points, worst first: fail, not measured, undecided, pass; inside by deviation over tolerance, then
/// in the plan's order.
pub fn worst_first(points: &[PointResult]) -> Vec<usize> {
    let rank = |verdict| match verdict {
        Verdict::Fail => 0,
        Verdict::NotMeasured => 1,
        Verdict::Undecided => 2,
        Verdict::Pass => 3,
    };
    let ratio = |p: &PointResult| p.tolerance_ratio().filter(|r| r.is_finite()).unwrap_or(0.0);
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        let (a, b) = (&points[a], &points[b]);
        rank(a.verdict).cmp(&rank(b.verdict)).then(ratio(b).total_cmp(&ratio(a)))
    });
    order
}

/// What people read for a point's verdict.
pub fn point_verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "Pass",
        Verdict::Undecided => "Undecided",
        Verdict::NotMeasured => "Not measured",
        Verdict::Fail => "Fail",
    }
}

/// What people read for a part's verdict.
pub fn part_verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NotMeasured => "Incomplete",
        other => point_verdict(other),
    }
}

/// What people read for a kind of point or feature.
pub fn kind(kind: &str) -> &'static str {
    match kind {
        "surface" => "Surface",
        "edge" => "Trimmed edge",
        "hole" => "Hole",
        "slot" => "Slot",
        "region" => "Region",
        _ => "Point",
    }
}

/// A length with its sign, three decimals, ASCII; zero has no sign.
pub fn signed_mm(value_mm: f64) -> String {
    let text = format!("{value_mm:+.3}");
    if matches!(text.as_str(), "+0.000" | "-0.000") { "0.000".to_owned() } else { text }
}

/// Whether the deviation is a distance, which has no sign: that of a hole without a direction in the plan.
pub fn is_distance(point: &PointResult) -> bool {
    point.kind == "hole" && point.direction.norm_squared() == 0.0
}

/// The deviation of a point: with its sign, or without one where it is a distance.
pub fn deviation(point: &PointResult, measurement: &Measurement) -> String {
    if is_distance(point) {
        format!("{:.3}", measurement.deviation_mm.abs())
    } else {
        signed_mm(measurement.deviation_mm)
    }
}

/// The lower and the upper limit of a point; those of a distance without a plus.
pub fn limits(point: &PointResult) -> [String; 2] {
    let limit = |value: f64| signed_mm(value);
    let bare = |value: f64| limit(value).trim_start_matches('+').to_owned();
    if is_distance(point) {
        [bare(point.lower_mm), bare(point.upper_mm)]
    } else {
        [limit(point.lower_mm), limit(point.upper_mm)]
    }
}

/// Deviation over tolerance in percent; far beyond, the exact figure tells nobody more.
pub fn percent_of_tolerance(ratio: f64) -> String {
    if ratio < 9.995 { format!("{:.0} %", 100.0 * ratio) } else { ">999 %".to_owned() }
}

/// A count with a comma between thousands.
pub fn thousands(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// The text with a capital first letter: messages start in lower case, paragraphs on paper do not. A name or key at its front - a file, a
/// word before a colon, anything with signs or digits in it - stays as it is.
pub fn capital(text: &str) -> String {
    let first = text.split_whitespace().next().unwrap_or_default();
    let is_plain = |c: char| c.is_alphabetic() || matches!(c, '\'' | '’' | '-');
    if text.starts_with(char::is_alphabetic) && !first.trim_end_matches([',', ';', '.']).chars().all(is_plain) {
        return text.to_owned();
    }
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_uppercase().chain(chars).collect())
}

/// The verdict of a point in plain words: which way it is off and by how much, or why it has no verdict.
///
/// Lengths are told without a sign; "high" is along the plan's direction, "long" is outwards along a trimmed edge's
/// direction.
pub fn in_words(point: &PointResult) -> String {
    let verdict = point_verdict(point.verdict);
    let Some(measurement) = &point.measurement else {
        return match &point.reason {
            Some(reason) => format!("{verdict}: {}", clean(reason)),
            None => verdict.to_owned(),
        };
    };
    let deviation = measurement.deviation_mm;
    let (above, below) = (deviation - point.upper_mm, point.lower_mm - deviation);
    let past = above.max(below);
    let off_by = if is_distance(point) { format!("hole off by {:.3} mm, ", deviation.abs()) } else { String::new() };
    match point.verdict {
        Verdict::Pass => verdict.to_owned(),
        Verdict::Undecided if past.abs() <= measurement.uncertainty_mm => format!(
            "{verdict}: {off_by}{:.3} mm {} the limit, U is {:.3} mm",
            past.abs(),
            if past > 0.0 { "past" } else { "inside" },
            measurement.uncertainty_mm
        ),
        Verdict::Fail if past > 0.0 => match point.kind {
            "surface" => format!("{verdict}: surface {past:.3} mm too {}", if above > below { "high" } else { "low" }),
            "edge" => format!("{verdict}: edge {past:.3} mm too {}", if above > below { "long" } else { "short" }),
            _ => format!("{verdict}: hole off by {:.3} mm, {past:.3} mm past the limit", deviation.abs()),
        },
        _ => match &point.reason {
            Some(reason) => format!("{verdict}: {}", clean(reason)),
            None => verdict.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_order_is_fail_not_measured_undecided_pass_and_then_by_ratio() {
        let result = example::bracket();
        let inspection = example::inspection(&result);
        let names: Vec<&str> =
            worst_first(&inspection.points).iter().map(|&i| inspection.points[i].name.as_str()).collect();
        assert_eq!(&names[..5], ["E03", "P08", "E05", "C04", "P03"]);
        let verdicts: Vec<Verdict> =
            worst_first(&inspection.points).iter().map(|&i| inspection.points[i].verdict).collect();
        assert!(verdicts[5..].iter().all(|&v| v == Verdict::Pass));
    }

    #[test]
    fn plain_words_tell_direction_and_amount() {
        let result = example::bracket();
        let points = &example::inspection(&result).points;
        let words = |name: &str| in_words(points.iter().find(|p| p.name == name).unwrap());
        assert_eq!(words("E03"), "Fail: edge 0.258 mm too short");
        assert_eq!(words("P08"), "Fail: surface 0.079 mm too low");
        assert_eq!(words("C04"), "Undecided: 0.020 mm past the limit, U is 0.029 mm");
        assert_eq!(words("P03"), "Undecided: 0.010 mm inside the limit, U is 0.017 mm");
        assert!(words("E05").starts_with("Not measured: "));
        assert_eq!(words("P01"), "Pass");
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(signed_mm(0.3364), "+0.336");
        assert_eq!(signed_mm(-0.0004), "0.000");
        assert_eq!(signed_mm(-0.9584), "-0.958");
        assert_eq!([0, 999, 1000, 1313042].map(thousands), ["0", "999", "1,000", "1,313,042"]);
        assert_eq!(
            [0.494, 1.37, 1368.0, f64::INFINITY].map(percent_of_tolerance),
            ["49 %", "137 %", ">999 %", ">999 %"]
        );
        assert_eq!(clean("a\tb\u{202e}c\r\nd"), "a bc  d");
    }

    #[test]
    fn sentences_begin_with_a_capital_letter_and_names_stay() {
        for (text, told) in [
            ("no points found", "No points found"),
            ("not measured: the scan", "Not measured: the scan"),
            ("größer als, x", "Größer als, x"),
            ("p6.txt", "p6.txt"),
            ("a4.ply: no points found", "a4.ply: no points found"),
            ("merge.toml:1: found", "merge.toml:1: found"),
            ("c_neg.ply:4: found", "c_neg.ply:4: found"),
            ("part: found", "part: found"),
            ("", ""),
        ] {
            assert_eq!(capital(text), told);
        }
    }
}
