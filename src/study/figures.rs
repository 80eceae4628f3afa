//! What a study says of one comparison point.

use super::series::PointSeries;
use super::statistics::{LIMIT, cg, cgk, least_tolerance_mm, mean, median, standard_deviation};
use crate::plan::ComparisonPoint;

/// Values below which nothing is said: the standard deviation of ten is known to 24 % only.
const FEWEST: usize = 10;
/// Share of the scans that must have given a value: a point that is often not measured cannot be relied on.
const LEAST_SHARE: f64 = 0.9;

/// Whether the tolerance of a point can be judged. Ordered from bad to good.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Word {
    /// Cg or Cgk is below the limit.
    NotCapable,
    /// Measured too rarely.
    CannotSay,
    /// Cg reaches the limit; nothing is known of the bias.
    Repeats,
    /// Cg and Cgk reach the limit.
    Capable,
}

impl Word {
    /// What people and files read.
    pub fn words(self) -> &'static str {
        match self {
            Word::NotCapable => "not capable",
            Word::CannotSay => "cannot say",
            Word::Repeats => "repeats",
            Word::Capable => "capable",
        }
    }
}

/// Figures of one comparison point. Lengths in mm; `None` where there are too few values, or no truth.
#[derive(Debug, Clone, PartialEq)]
pub struct PointFigures {
    /// Its name.
    pub name: String,
    /// `surface`, `edge` or `hole`.
    pub kind: &'static str,
    /// Limits of its tolerance.
    pub lower_mm: f64,
    /// Limits of its tolerance.
    pub upper_mm: f64,
    /// Scans that gave a value.
    pub measured: usize,
    /// Mean of measured minus true.
    pub bias_mm: Option<f64>,
    /// Standard deviation of measured minus true, or of measured.
    pub standard_deviation_mm: Option<f64>,
    /// Median of the stated uncertainties, k = 2.
    pub uncertainty_mm: Option<f64>,
    /// Share of errors that the stated uncertainty covers.
    pub coverage: Option<f64>,
    /// Capability by the spread alone, see [`super::cg`].
    pub cg: Option<f64>,
    /// Capability by spread and bias, see [`super::cgk`].
    pub cgk: Option<f64>,
    /// The least tolerance that would be capable (without a bias: that would repeat).
    pub least_tolerance_mm: Option<f64>,
    /// Whether its tolerance can be judged.
    pub word: Word,
    /// Why it was not measured, most often.
    pub reason: Option<String>,
}

impl PointFigures {
    /// Of the values of `scans` scans; `truth_known`: whether they are errors.
    pub(super) fn of(point: &ComparisonPoint, series: &PointSeries, scans: usize, truth_known: bool) -> Self {
        let values = &series.values_mm;
        let tolerance_mm = point.upper_mm - point.lower_mm;
        let bias_mm = mean(values).filter(|_| truth_known);
        let standard_deviation_mm = standard_deviation(values);
        let covered = values.iter().zip(&series.uncertainties_mm).filter(|(error, u)| error.abs() <= **u).count();
        let cg = standard_deviation_mm.map(|s| cg(tolerance_mm, s));
        let cgk = bias_mm.zip(standard_deviation_mm).map(|(bias, s)| cgk(tolerance_mm, bias, s));
        Self {
            name: point.name.clone(),
            kind: point.geometry.kind(),
            lower_mm: point.lower_mm,
            upper_mm: point.upper_mm,
            measured: values.len(),
            bias_mm,
            standard_deviation_mm,
            uncertainty_mm: median(&series.uncertainties_mm),
            coverage: (truth_known && !values.is_empty()).then(|| covered as f64 / values.len() as f64),
            cg,
            cgk,
            least_tolerance_mm: standard_deviation_mm.map(|s| least_tolerance_mm(bias_mm.unwrap_or(0.0), s)),
            word: word(values.len(), scans, cg, cgk, truth_known),
            reason: series.reason().map(str::to_owned),
        }
    }

    /// What decides: the smaller of Cg and Cgk.
    pub fn deciding(&self) -> Option<f64> {
        self.cgk.or(self.cg)
    }
}

/// A word that nobody can mistake: what is not proved is not said.
fn word(measured: usize, scans: usize, cg: Option<f64>, cgk: Option<f64>, truth_known: bool) -> Word {
    let reaches = |value: Option<f64>| value.is_some_and(|v| v >= LIMIT);
    if measured < FEWEST {
        Word::CannotSay
    } else if !reaches(cg) || (truth_known && !reaches(cgk)) {
        Word::NotCapable
    } else if (measured as f64) < LEAST_SHARE * scans as f64 {
        Word::CannotSay
    } else if truth_known {
        Word::Capable
    } else {
        Word::Repeats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::symmetric_plate;

    fn point() -> ComparisonPoint {
        ComparisonPoint { lower_mm: -0.5, upper_mm: 0.5, ..symmetric_plate().plan().comparison[0].clone() }
    }

    /// Ten errors of +-0.03 around 0.01: s = 0.03 sqrt(10/9) = 0.03162; Cg = 0.2 / (6 s) = 1.054, Cgk = 0.09 / (3 s) = 0.949.
    #[test]
    fn figures_of_a_known_series() {
        let values_mm: Vec<f64> = (0..10).map(|k| 0.01 + if k % 2 == 0 { 0.03 } else { -0.03 }).collect();
        let mut series = PointSeries { values_mm, uncertainties_mm: vec![0.03; 10], ..PointSeries::default() };
        let found = PointFigures::of(&point(), &series, 10, true);
        let near = |value: Option<f64>, expected: f64| (value.unwrap() - expected).abs() < 1e-3;
        assert!(near(found.bias_mm, 0.01) && near(found.standard_deviation_mm, 0.03162));
        assert!(near(found.cg, 1.054) && near(found.cgk, 0.949) && near(found.uncertainty_mm, 0.03));
        // -0.02 lies within 0.03, 0.04 does not.
        assert_eq!((found.coverage, found.word), (Some(0.5), Word::NotCapable));
        // 10 x (0.01 + 3.99 x 0.03162).
        assert!(near(found.least_tolerance_mm, 1.3617));
        // The same values of one part whose truth nobody knows: they repeat no better.
        let unknown = PointFigures::of(&point(), &series, 10, false);
        assert_eq!((unknown.bias_mm, unknown.coverage, unknown.cgk), (None, None, None));
        assert_eq!(unknown.word, Word::NotCapable);
        series.values_mm.iter_mut().for_each(|v| *v *= 0.1);
        assert_eq!(PointFigures::of(&point(), &series, 10, true).word, Word::Capable);
        assert_eq!(PointFigures::of(&point(), &series, 10, false).word, Word::Repeats);
        assert_eq!(PointFigures::of(&point(), &PointSeries::default(), 10, true).word, Word::CannotSay);
    }

    #[test]
    fn what_is_measured_too_rarely_is_not_called_capable() {
        let word_of = |measured, scans, cg| word(measured, scans, Some(cg), Some(cg), true);
        assert_eq!(word_of(18, 20, 2.0), Word::Capable);
        assert_eq!(word_of(17, 20, 2.0), Word::CannotSay);
        assert_eq!(word_of(9, 9, 2.0), Word::CannotSay);
        // Bad is bad, however often.
        assert_eq!(word_of(12, 20, 1.0), Word::NotCapable);
        assert_eq!(word(20, 20, Some(f64::NAN), Some(2.0), true), Word::NotCapable);
        assert_eq!(word(20, 20, Some(2.0), None, true), Word::NotCapable);
    }
}
