//! What a sequence is asked to do, how it is stopped, and what came of it.

use crate::diagnostic::Diagnostic;
use crate::inspect::{Outcome, Verdict};
use crate::run::CancelToken;
use std::path::PathBuf;
use std::time::Duration;

/// How a folder is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WatchSettings {
    /// A file is taken when its size and time have been quiet for that long.
    pub settle: Duration,
    /// Time between two looks at the folder.
    pub poll: Duration,
}

impl Default for WatchSettings {
    fn default() -> Self {
        Self { settle: Duration::from_secs(2), poll: Duration::from_millis(250) }
    }
}

/// What to inspect.
#[derive(Debug, Clone, Default)]
pub struct SequenceRequest {
    /// The plan.
    pub plan_path: PathBuf,
    /// Scans by name; none = all that the plan finds.
    pub scans: Vec<PathBuf>,
    /// Results folder instead of the plan's.
    pub out: Option<PathBuf>,
    /// Go on with each scan that arrives.
    pub watch: Option<WatchSettings>,
    /// File that gets one line of timings a scan.
    pub timings: Option<PathBuf>,
}

/// The two ways of stopping: after the running part, or at once.
#[derive(Debug, Clone, Default)]
pub struct StopSwitch {
    /// No further part is begun.
    pub after_part: CancelToken,
    /// The running part is dropped.
    pub now: CancelToken,
}

impl StopSwitch {
    /// Whether either was raised.
    pub fn is_on(&self) -> bool {
        self.after_part.is_cancelled() || self.now.is_cancelled()
    }
}

/// What came of a sequence.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SequenceSummary {
    /// Parts by verdict, in the order pass, undecided, incomplete, fail.
    pub pass: usize,
    /// Parts that nothing can be said of.
    pub undecided: usize,
    /// Parts with a point that was not measured.
    pub incomplete: usize,
    /// Parts out of tolerance.
    pub fail: usize,
    /// Scans that were refused.
    pub refused: usize,
    /// Scans whose results could not be written.
    pub unwritten: usize,
    /// Somebody stopped it.
    pub stopped: bool,
    /// It could not go on.
    pub error: Option<Diagnostic>,
}

impl SequenceSummary {
    /// Scans that were measured.
    pub fn measured(&self) -> usize {
        self.pass + self.undecided + self.incomplete + self.fail
    }

    pub(super) fn count(&mut self, outcome: &Outcome) {
        match outcome {
            Outcome::Refused(_) => self.refused += 1,
            Outcome::Measured(inspection) => match inspection.verdict {
                Verdict::Pass => self.pass += 1,
                Verdict::Undecided => self.undecided += 1,
                Verdict::NotMeasured => self.incomplete += 1,
                Verdict::Fail => self.fail += 1,
            },
        }
    }
}
