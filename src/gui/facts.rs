//! What is so: the plan, the part, what was inspected, what the worker does. Only the worker's events change it.

use super::engineer::Editing;
use super::merge::{MergeRun, Merging};
use crate::diagnostic::{Diagnostic, Refusal};
use crate::inspect::{DeviationMap, InspectionResult, Outcome};
use crate::part::Part;
use crate::plan::Plan;
use crate::run::Stage;
use crate::scan::ConditionedScan;
use crate::worker::SequenceSummary;
use crate::worker::earlier::EarlierResults;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Bytes of points and maps that are kept for looking at; older parts keep their tables and can be fetched again.
const KEEP_BYTES: usize = 1 << 30;

/// Parts that are remembered at all; the reports of older ones stand in the results folder.
const MOST_PARTS: usize = 1000;

/// One inspected part.
#[derive(Debug, Clone)]
pub struct FinishedPart {
    /// Its place in its sequence, from 1.
    pub index: usize,
    /// How many its sequence had, unless more may arrive.
    pub of: Option<usize>,
    /// Its file.
    pub scan_path: PathBuf,
    /// The result. Of an older part without the values of its map; its statistics stay.
    pub result: Arc<InspectionResult>,
    /// Its points with their classes, as long as they are kept.
    pub scan: Option<Arc<ConditionedScan>>,
    /// The plan it was held to.
    pub plan: Arc<Plan>,
    /// The CAD it was held to.
    pub part: Arc<Part>,
    /// The files written.
    pub files: Vec<PathBuf>,
    /// It came before and was inspected again, by another plan: no part that came now.
    pub again: bool,
    /// How long it took.
    pub took: Duration,
}

impl FinishedPart {
    /// The scan's name without folder, as in its result.
    pub fn scan_name(&self) -> &str {
        &self.result.identity.scan_file
    }

    /// The scan's name without its ending.
    pub fn short_name(&self) -> String {
        self.scan_path.file_stem().map_or_else(|| self.scan_name().to_owned(), |s| s.to_string_lossy().into_owned())
    }

    /// Why its scan was refused, without the scan's name, which stands beside it.
    pub fn reason<'r>(&self, refusal: &'r Refusal) -> &'r str {
        let after_name = refusal.reason.strip_prefix(self.scan_name()).and_then(|rest| rest.strip_prefix(':'));
        let Some(rest) = after_name else { return &refusal.reason };
        let is_line = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        rest.split_once(": ").filter(|(line, _)| is_line(line)).map_or(rest.trim_start(), |(_, rest)| rest)
    }

    /// Whether its points and its map were let go.
    pub fn is_thin(&self) -> bool {
        match &self.result.outcome {
            Outcome::Measured(inspection) => {
                self.scan.is_none() || inspection.map.indices.len() != inspection.map.statistics.points
            }
            Outcome::Refused(_) => false,
        }
    }

    /// Roughly what its points and map take in memory.
    fn bytes(&self) -> usize {
        const POSITION_NORMAL_COLOUR_CLASS: usize = 24 + 24 + 3 + 1 + 4;
        let scan = self.scan.as_ref().map_or(0, |scan| scan.cloud.positions.len() * POSITION_NORMAL_COLOUR_CLASS);
        let map = match &self.result.outcome {
            Outcome::Measured(inspection) => inspection.map.indices.len() * 8 + inspection.map.flagged.len() * 4,
            Outcome::Refused(_) => 0,
        };
        scan + map
    }

    /// The same without points and map.
    fn thinned(&self) -> Self {
        let mut result = (*self.result).clone();
        if let Outcome::Measured(inspection) = &mut result.outcome {
            inspection.map = DeviationMap { statistics: inspection.map.statistics, ..DeviationMap::default() };
        }
        Self { result: Arc::new(result), scan: None, ..self.clone() }
    }
}

/// What a sequence does now.
#[derive(Debug, Clone)]
pub struct Running {
    /// It goes on with each scan that arrives.
    pub watch: bool,
    /// When it was begun.
    pub since: Instant,
    /// The scan at hand; `None` between two of a watched folder, and while plan and CAD are read.
    pub scan: Option<RunningScan>,
    /// Stage of the CAD while no scan is at hand.
    pub stage: Option<Stage>,
    /// The scans of this run, where somebody named them; empty = the plan's.
    pub named: Vec<PathBuf>,
    /// Parts done in this sequence.
    pub done: usize,
    /// How many it has, unless more may arrive.
    pub of: Option<usize>,
    /// How many wait behind the scan at hand.
    pub waiting: usize,
    /// Somebody pressed Stop.
    pub stopping: bool,
}

/// The scan at hand.
#[derive(Debug, Clone)]
pub struct RunningScan {
    /// From 1.
    pub index: usize,
    /// Its file.
    pub path: PathBuf,
    /// What is done with it.
    pub stage: Option<Stage>,
    /// When it was begun.
    pub since: Instant,
}

/// What the worker does.
#[derive(Debug, Clone, Default)]
pub enum Job {
    /// Nothing.
    #[default]
    Idle,
    /// A plan is read and its CAD prepared.
    Opening {
        /// The plan.
        path: PathBuf,
        /// The stage of its CAD.
        stage: Option<Stage>,
    },
    /// A sequence, or a watched folder.
    Running(Running),
    /// The plan that is edited is tried on a scan.
    Trying {
        /// Which one.
        scan: PathBuf,
        /// What is done with it.
        stage: Option<Stage>,
    },
    /// Views are merged.
    Merging(MergeRun),
    /// A scan is inspected again for its points.
    Fetching {
        /// Which one.
        wanted: Wanted,
    },
}

/// A scan that is inspected again so that it can be looked at; nothing of that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// That of a part, by its place in `Facts::parts`.
    Part(usize),
    /// That of a result from before this start, by its place among those.
    Earlier(usize),
}

/// What is wrong with the surroundings of a watched folder, as long as it lasts.
#[derive(Debug, Clone, Default)]
pub struct Troubles {
    /// The scan folder cannot be reached.
    pub folder: Option<Diagnostic>,
    /// Results cannot be written: the first scan that waits for it, and why.
    pub results: Option<(PathBuf, Diagnostic)>,
    /// The plan is gone from the disk, or cannot be used any more.
    pub plan: Option<Diagnostic>,
    /// Scans that are in sight but not whole, the latest last.
    pub unfinished: Vec<Unfinished>,
}

/// A scan that is in sight but not whole.
#[derive(Debug, Clone)]
pub struct Unfinished {
    /// Its file.
    pub scan: PathBuf,
    /// What is missing.
    pub why: Diagnostic,
    /// When it was told.
    pub since: Instant,
    /// A later part was inspected meanwhile: the verdict is that one's.
    pub passed: bool,
    /// It has been so for long enough to be no everyday thing: the part before has no say any more.
    pub overdue: bool,
}

/// How long a scan may be unfinished before the verdict of the part before it goes.
const UNFINISHED: Duration = Duration::from_secs(5);

impl Troubles {
    /// The scan whose missing rest leaves no verdict.
    pub fn no_verdict_for(&self) -> Option<&Unfinished> {
        self.unfinished.iter().rev().find(|scan| scan.overdue && !scan.passed)
    }

    /// Time passes; tells when to look again, if something will be different then.
    pub fn tick(&mut self, now: Instant) -> Option<Duration> {
        let mut next = None;
        for scan in self.unfinished.iter_mut().filter(|scan| !scan.passed && !scan.overdue) {
            let waited = now.saturating_duration_since(scan.since);
            scan.overdue = waited >= UNFINISHED;
            if !scan.overdue {
                let left = UNFINISHED - waited;
                next = Some(next.map_or(left, |next: Duration| next.min(left)));
            }
        }
        next
    }
}

/// All that is so.
#[derive(Debug, Clone, Default)]
pub struct Facts {
    /// The plan's file, sound or not.
    pub plan_path: Option<PathBuf>,
    /// The plan, if it can be run.
    pub plan: Option<Arc<Plan>>,
    /// Its CAD, prepared.
    pub part: Option<Arc<Part>>,
    /// Problems of plan, CAD and folders, in the words of the command line.
    pub problems: Vec<Diagnostic>,
    /// The scans in the folder when it was last looked at; the error says why it could not be.
    pub scans: Option<Result<Vec<PathBuf>, Diagnostic>>,
    /// The parts inspected since the plan was opened, oldest first, the last thousand of them.
    pub parts: Vec<Arc<FinishedPart>>,
    /// What the worker does.
    pub job: Job,
    /// What is wrong around a watched folder.
    pub troubles: Troubles,
    /// How the last sequence ended.
    pub last_end: Option<SequenceSummary>,
    /// Place in `parts` of the first part of the run at hand, or of the last one.
    pub run_from: usize,
    /// What that run told of plan, CAD and folders.
    pub run_problems: Vec<Diagnostic>,
    /// Scans that it left when it was stopped.
    pub left_over: usize,
    /// Scans that came since it ended, or lie there with another content.
    pub arrived: Vec<PathBuf>,
    /// The plan as it is edited, once the engineer has opened it.
    pub editing: Option<Editing>,
    /// The merge that is looked at.
    pub merging: Option<Merging>,
    /// Results from before this start; `None` until they were read.
    pub earlier: Option<Arc<EarlierResults>>,
    /// The one of them that was inspected again last, by its place; it is no part of a run and has no say in any verdict.
    pub again: Option<(usize, Arc<FinishedPart>)>,
    /// A message that nobody put away yet.
    pub message: Option<Diagnostic>,
}

impl Facts {
    /// The sequence under way.
    pub fn running(&self) -> Option<&Running> {
        match &self.job {
            Job::Running(running) => Some(running),
            _ => None,
        }
    }

    /// The part that the verdict is about: the newest of the run at hand or of the last one, as long as plan and CAD are those that it was held to
    /// and no scan came since. What an earlier run or another plan said is no verdict of now.
    pub fn judged(&self) -> Option<&Arc<FinishedPart>> {
        let (plan, part) = (self.plan.as_ref()?, self.part.as_ref()?);
        let newest = self.parts.get(self.run_from..)?.last()?;
        let is_by_these = newest.plan.sha256 == plan.sha256 && newest.part.cad_sha256 == part.cad_sha256;
        let is_newest = self.arrived.is_empty() && !newest.again;
        let troubles = &self.troubles;
        let in_trouble = troubles.results.is_some() || troubles.plan.is_some() || troubles.no_verdict_for().is_some();
        (is_by_these && is_newest && !in_trouble).then_some(newest)
    }

    /// Why the last run ended without a part.
    pub fn failure(&self) -> Option<&Diagnostic> {
        let end = self.last_end.as_ref().filter(|_| self.running().is_none() && self.run_from >= self.parts.len())?;
        end.error.as_ref()
    }

    /// Adds a part, and lets go of the points of the oldest ones when there are too many. The newest always keeps its own.
    /// Returns whether the very oldest part was forgotten, so that all places moved by one.
    pub fn push_part(&mut self, part: FinishedPart) -> bool {
        let forgotten = self.parts.len() >= MOST_PARTS;
        if forgotten {
            self.parts.remove(0);
            self.run_from = self.run_from.saturating_sub(1);
        }
        self.parts.push(Arc::new(part));
        self.let_go(self.parts.len() - 1);
        forgotten
    }

    /// Puts a part that was fetched again in its place.
    pub fn replace_part(&mut self, at: usize, part: FinishedPart) {
        if let Some(place) = self.parts.get_mut(at) {
            *place = Arc::new(part);
            self.let_go(at);
        }
    }

    /// Thins the oldest parts until the rest is within bounds; `keep` and the newest stay.
    fn let_go(&mut self, keep: usize) {
        let bytes: Vec<usize> = self.parts.iter().map(|part| part.bytes()).collect();
        for k in to_thin(&bytes, keep, KEEP_BYTES) {
            self.parts[k] = Arc::new(self.parts[k].thinned());
        }
    }
}

/// Which parts must be thinned, the oldest first, so that the rest takes no more than `most`; `keep` and the last never.
fn to_thin(bytes: &[usize], keep: usize, most: usize) -> Vec<usize> {
    let mut sum: usize = bytes.iter().sum();
    let mut thin = Vec::new();
    for (k, mine) in bytes.iter().enumerate() {
        if sum > most && k != keep && k + 1 != bytes.len() && *mine > 0 {
            thin.push(k);
            sum -= mine;
        }
    }
    thin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_points_go_first_and_the_newest_never() {
        assert!(to_thin(&[4, 4, 4], 2, 12).is_empty());
        assert_eq!(to_thin(&[4, 0, 4, 4], 3, 5), [0, 2]);
        // A part that was fetched again is looked at.
        assert_eq!(to_thin(&[4, 4, 4, 4], 0, 8), [1, 2]);
        assert_eq!(to_thin(&[50], 0, 8), [0; 0]);
    }
}
