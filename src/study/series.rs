//! What the scans of a study said of each comparison point, as numbers.

use crate::inspect::{Inspection, PointResult};
use crate::plan::{ComparisonPoint, Side};
use std::collections::BTreeMap;

/// All values of one comparison point.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PointSeries {
    /// Measured minus true; measured as it is where nothing is known of the truth.
    pub values_mm: Vec<f64>,
    /// Stated with each of them, k = 2.
    pub uncertainties_mm: Vec<f64>,
    /// Why it was not measured: how often, and in the words of the first time. By those words without their digits.
    pub reasons: BTreeMap<String, (usize, String)>,
}

impl PointSeries {
    /// Adds what a scan says of the point; `truth_mm`: what it should say, 0 where that is not known.
    fn add(&mut self, point: &PointResult, truth_mm: f64) {
        match &point.measurement {
            Some(found) => {
                self.values_mm.push(found.deviation_mm - truth_mm);
                self.uncertainties_mm.push(found.uncertainty_mm);
            }
            None => self.miss(point.reason.as_deref().unwrap_or("no reason is known")),
        }
    }

    fn miss(&mut self, reason: &str) {
        let key: String = reason.chars().filter(|c| !c.is_ascii_digit()).collect();
        self.reasons.entry(key).or_insert_with(|| (0, reason.to_owned())).0 += 1;
    }

    /// The most frequent reason why it was not measured.
    pub fn reason(&self) -> Option<&str> {
        let most = self.reasons.values().map(|(count, _)| *count).max()?;
        self.reasons.values().find(|(count, _)| *count == most).map(|(_, words)| words.as_str())
    }
}

/// All scans of a study.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Tally {
    /// In the plan's order.
    pub points: Vec<PointSeries>,
    /// Scans looked at, refused ones too.
    pub scans: usize,
    /// Measured scans by the side that was seen.
    pub from_top: usize,
    /// Measured scans by the side that was seen.
    pub from_bottom: usize,
    /// Names and reasons of the scans that were refused.
    pub refused: Vec<(String, String)>,
}

impl Tally {
    /// No scan yet.
    pub fn new(comparison: &[ComparisonPoint]) -> Self {
        Self { points: vec![PointSeries::default(); comparison.len()], ..Self::default() }
    }

    /// Adds a measured scan; `truth_mm` tells the true deviation of a comparison point by its place in the plan: 0 where nothing is
    /// known of any scan, `None` where this scan has none, which leaves the point out.
    pub fn add(&mut self, inspection: &Inspection, truth_mm: impl Fn(usize) -> Option<f64>) {
        self.scans += 1;
        match inspection.best_fit.side {
            Some(Side::Top) => self.from_top += 1,
            Some(Side::Bottom) => self.from_bottom += 1,
            None => {}
        }
        for (k, (series, point)) in self.points.iter_mut().zip(&inspection.points).enumerate() {
            match truth_mm(k) {
                Some(truth_mm) => series.add(point, truth_mm),
                None => series.miss("the part has no such feature: there is no truth to compare with"),
            }
        }
    }

    /// Adds a scan that was refused.
    pub fn refuse(&mut self, name: String, reason: String) {
        self.scans += 1;
        self.refused.push((name, reason));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_that_differ_in_their_figures_are_one() {
        let mut series = PointSeries::default();
        for words in ["12 points, 40 are needed", "hidden", "9 points, 40 are needed"] {
            series.miss(words);
        }
        assert_eq!(series.reason(), Some("12 points, 40 are needed"));
        assert_eq!(PointSeries::default().reason(), None);
    }
}
