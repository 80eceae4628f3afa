//! Which points stand in the table, and in which order.

use crate::gui::text::Words;
use crate::inspect::{PointResult, Verdict};
use crate::report::words::worst_first;

/// A column that the table may be sorted by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SortBy {
    /// Fail, not measured, undecided, pass; inside by deviation over tolerance.
    #[default]
    Worst,
    /// Its name.
    Name,
    /// Its kind.
    Kind,
    /// Its deviation with its sign; points without one last.
    Deviation,
    /// Its uncertainty, the largest first; points without one last.
    Uncertainty,
}

/// The points of the table.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Order {
    /// Sorted by.
    pub by: SortBy,
    /// The other way round.
    pub reversed: bool,
    /// Only points whose name, kind or verdict holds this, in the window's language.
    pub filter: String,
}

impl Order {
    /// A click on a column's head: sorted by it, and by it again the other way round.
    pub fn click(&mut self, by: SortBy) {
        (self.by, self.reversed) = if self.by == by { (by, !self.reversed) } else { (by, false) };
    }

    /// Places of the points in the plan, in the table's order.
    pub fn of(&self, points: &[PointResult], words: &Words) -> Vec<usize> {
        let mut order = worst_first(points);
        let deviation = |k: &usize| points[*k].measurement.as_ref().map(|m| m.deviation_mm);
        let uncertainty = |k: &usize| points[*k].measurement.as_ref().map(|m| m.uncertainty_mm);
        match self.by {
            SortBy::Worst => {}
            SortBy::Name => order.sort_by(|a, b| natural(&points[*a].name).cmp(&natural(&points[*b].name))),
            SortBy::Kind => order.sort_by_key(|k| points[*k].kind),
            SortBy::Deviation => order.sort_by(|a, b| last_if_none(deviation(a), deviation(b))),
            SortBy::Uncertainty => {
                order.sort_by(|a, b| last_if_none(uncertainty(a).map(|u| -u), uncertainty(b).map(|u| -u)));
            }
        }
        if self.reversed {
            order.reverse();
        }
        let wanted = self.filter.trim().to_lowercase();
        let holds = |text: &str| text.to_lowercase().contains(&wanted);
        order.retain(|k| {
            let p = &points[*k];
            wanted.is_empty()
                || holds(&p.name)
                || holds(words.text(kind_key(p.kind)))
                || holds(verdict_word(p.verdict, words))
        });
        order
    }
}

fn last_if_none(a: Option<f64>, b: Option<f64>) -> std::cmp::Ordering {
    a.is_none().cmp(&b.is_none()).then(a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)))
}

/// A name cut into words and numbers, so that P2 stands before P10.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts = vec![(String::new(), 0u64)];
    let mut in_number = false;
    for c in name.chars() {
        match c.to_digit(10) {
            Some(digit) => {
                in_number = true;
                if let Some(last) = parts.last_mut() {
                    last.1 = last.1.saturating_mul(10).saturating_add(u64::from(digit));
                }
            }
            None => {
                if std::mem::take(&mut in_number) {
                    parts.push((String::new(), 0));
                }
                if let Some(last) = parts.last_mut() {
                    last.0.push(c);
                }
            }
        }
    }
    parts
}

/// The next point out of tolerance after the chosen one, in the order worst first; backwards before it. Round and round.
pub fn next_out(points: &[PointResult], chosen: Option<usize>, backwards: bool) -> Option<usize> {
    let out: Vec<usize> = worst_first(points).into_iter().filter(|k| points[*k].verdict == Verdict::Fail).collect();
    let n = out.len();
    if n == 0 {
        return None;
    }
    let at = chosen.and_then(|c| out.iter().position(|k| *k == c));
    let next = match (at, backwards) {
        (None, false) => 0,
        (None, true) => n - 1,
        (Some(k), false) => (k + 1) % n,
        (Some(k), true) => (k + n - 1) % n,
    };
    Some(out[next])
}

/// The key of a kind's name among the texts.
pub fn kind_key(kind: &str) -> &'static str {
    match kind {
        "surface" => "results.surface",
        "edge" => "results.edge",
        "hole" => "results.hole",
        _ => "results.point",
    }
}

/// The word of a point's verdict.
pub fn verdict_word(verdict: Verdict, words: &Words) -> &str {
    words.text(match verdict {
        Verdict::Pass => "results.pass",
        Verdict::Fail => "results.fail",
        Verdict::Undecided => "results.undecided",
        Verdict::NotMeasured => "results.not_measured",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::report::example;

    fn names(order: &Order) -> Vec<String> {
        let result = example::bracket();
        let points = &example::inspection(&result).points;
        order.of(points, Words::of(Language::English)).iter().map(|&k| points[k].name.clone()).collect()
    }

    #[test]
    fn the_worst_stand_first_and_a_second_click_turns_the_order_round() {
        let mut order = Order::default();
        assert_eq!(names(&order)[..5], ["E03", "P08", "E05", "C04", "P03"]);
        order.click(SortBy::Worst);
        assert_eq!(names(&order).last().map(String::as_str), Some("E03"));
        order.click(SortBy::Deviation);
        assert_eq!(names(&order)[0], "E03");
        assert_eq!(names(&order).last().map(String::as_str), Some("E05"), "without a value last");
        order.click(SortBy::Name);
        assert_eq!(names(&order)[..2], ["C01", "C04"]);
        order.click(SortBy::Uncertainty);
        assert_eq!(names(&order)[0], "E03");
    }

    #[test]
    fn a_filter_looks_at_name_kind_and_verdict() {
        let with = |filter: &str| names(&Order { filter: filter.into(), ..Order::default() });
        assert_eq!(with(" e0 "), ["E03", "E05", "E02"]);
        assert_eq!(with("hole"), ["C04", "C01"]);
        assert_eq!(with("undecided"), ["C04", "P03"]);
        assert!(with("nothing of the kind").is_empty());
    }

    #[test]
    fn numbers_in_names_count_as_numbers() {
        assert!(natural("P2") < natural("P10") && natural("P10") < natural("Q1") && natural("P") < natural("P1"));
    }

    #[test]
    fn next_goes_round_the_points_out_of_tolerance() {
        let result = example::bracket();
        let points = &example::inspection(&result).points;
        let at = |name: &str| points.iter().position(|p| p.name == name);
        assert_eq!(next_out(points, None, false), at("E03"));
        assert_eq!(next_out(points, at("E03"), false), at("P08"));
        assert_eq!(next_out(points, at("P08"), false), at("E03"));
        assert_eq!(next_out(points, at("E03"), true), at("P08"));
        assert_eq!(next_out(points, at("P01"), true), at("P08"));
        let pass = example::pass();
        assert_eq!(next_out(&example::inspection(&pass).points, None, false), None);
    }
}
