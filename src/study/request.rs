//! What a study is asked for, and what came of it.

use super::figures::{PointFigures, Word};
use super::statistics::mean;
use std::path::PathBuf;

/// Where the scans come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The plan's part, simulated.
    Simulated {
        /// How many.
        count: u64,
        /// The same seed gives the same scans.
        seed: u64,
        /// Parts are bent by about so much at their ends; `None`: as much as everyday springback does.
        springback_mm: Option<f64>,
    },
    /// Scans of one and the same part.
    Repeats {
        /// Where they lie; the plan's pattern, order and unit hold.
        folder: PathBuf,
        /// Delimited text with the columns `name` and `deviation_mm`: what is known of that part.
        reference: Option<PathBuf>,
    },
}

/// A study to run.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRequest {
    /// The plan.
    pub plan_path: PathBuf,
    /// The scans.
    pub source: Source,
}

/// What came of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// Name, number and revision of the part.
    pub part: String,
    /// The plan's file name and its hash.
    pub plan: (String, String),
    /// The CAD's file as the plan names it, and its hash.
    pub cad: (String, String),
    /// Where the scans come from, in words.
    pub source: String,
    /// What the rig can tell, in words.
    pub rig: Option<String>,
    /// What a reader must know of these figures.
    pub notes: Vec<String>,
    /// Scans looked at, refused ones too.
    pub scans: usize,
    /// Measured scans that were seen from the top, and from the bottom.
    pub seen: [usize; 2],
    /// Names and reasons of the scans that were refused.
    pub refused: Vec<(String, String)>,
    /// The comparison points, in the plan's order.
    pub points: Vec<PointFigures>,
}

impl Study {
    /// Scans that were measured.
    pub fn measured(&self) -> usize {
        self.scans - self.refused.len()
    }

    /// Points with that word.
    pub fn count(&self, word: Word) -> usize {
        self.points.iter().filter(|p| p.word == word).count()
    }

    /// Whether every point can be judged, as far as a study without reference values can tell.
    pub fn all_good(&self) -> bool {
        !self.points.is_empty() && self.points.iter().all(|p| p.word >= Word::Repeats)
    }

    /// Mean coverage of the stated uncertainties, over all points that have a truth.
    pub fn coverage(&self) -> Option<f64> {
        let all: Vec<f64> = self.points.iter().filter_map(|p| p.coverage).collect();
        mean(&all)
    }

    /// Points, worst first: by word, then by what decides; in the plan's order where these are the same.
    pub fn worst_first(&self) -> Vec<&PointFigures> {
        let mut order: Vec<&PointFigures> = self.points.iter().collect();
        let deciding = |p: &PointFigures| p.deciding().unwrap_or(f64::NEG_INFINITY);
        order.sort_by(|a, b| a.word.cmp(&b.word).then(deciding(a).total_cmp(&deciding(b))));
        order
    }
}
