//! Jobs on a thread of their own: what goes in, what comes out, how they are stopped.
//!
//! Below this layer nothing prints, looks at a clock or starts a thread; above it nobody computes.

mod arrivals;
mod check;
pub mod clock;
mod delivered;
pub mod earlier;
#[cfg(test)]
mod editing_tests;
mod examine;
pub mod first_look;
mod ground;
mod inherited;
pub mod merge;
pub mod names;
pub mod plan_file;
mod plan_on_disk;
pub mod request;
pub mod results;
pub mod scans;
pub mod sequence;
mod trial;
pub mod watch;
mod words;

pub use check::{CadAsked, check_document, check_plan, foretell_document, foretell_plan, prepare_document};
pub use examine::{Examiner, part_settings, prepare_part};
pub use ground::{Ground, Shaken};
pub use request::{SequenceRequest, SequenceSummary, StopSwitch, WatchSettings};
pub use sequence::run_sequence;
pub use trial::{NoTrial, Trial, try_plan};
pub use words::one_line;

use crate::diagnostic::Diagnostic;
use crate::inspect::InspectionResult;
use crate::part::{CacheUse, Part};
use crate::plan::Plan;
use crate::run::Stage;
use crate::scan::ConditionedScan;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// What a job tells while it runs.
#[derive(Debug, Clone)]
pub enum Event {
    /// Problems of the plan or of the results folder, errors and warnings; may be empty.
    Problems(Vec<Diagnostic>),
    /// The CAD is ready.
    Prepared {
        /// The plan that every scan is held to from now on.
        plan: Arc<Plan>,
        /// Its CAD, with what somebody should know of it.
        part: Arc<Part>,
        /// From the cache, or built.
        cache: CacheUse,
    },
    /// The scans of a sequence that does not watch, in order, none of them begun; or those that lie in a watched folder, whenever they are others.
    Listed(Vec<PathBuf>),
    /// A part was looked at, but nothing of it could be written: it has no verdict.
    Lost {
        /// A refusal that says why.
        result: Arc<InspectionResult>,
        /// Its file.
        scan: PathBuf,
    },
    /// A scan is begun. `Finished` or `Lost` follows, or else `Waiting`, `Known` or `LeftAlone`.
    Started {
        /// From 1.
        index: usize,
        /// How many there are, unless more may arrive.
        of: Option<usize>,
        /// How many wait behind it; in a watched folder those that were ready at the last look.
        waiting: usize,
        /// Its file.
        scan: PathBuf,
    },
    /// The running scan (or the CAD) enters a stage.
    Stage(Stage),
    /// A scan is done and its reports are written.
    Finished {
        /// Its result.
        result: Arc<InspectionResult>,
        /// Its points with their classes, for who wants to show them; `None` when it was refused before that.
        scan: Option<Arc<ConditionedScan>>,
        /// The files written.
        files: Vec<PathBuf>,
        /// Watching: a scan of this name and content has a result by another plan or CAD; it is no part that came now.
        again: bool,
        /// How long it took, reading to writing.
        took: Duration,
    },
    /// The folder is being watched.
    Watching {
        /// Which one.
        folder: PathBuf,
    },
    /// A scan is in sight but not whole.
    Waiting {
        /// Its file.
        scan: PathBuf,
        /// What is missing.
        why: Diagnostic,
        /// Whether it is told for the first time.
        is_news: bool,
    },
    /// Nothing came of the scan at hand, or it waits no longer: it is gone, or it is being written again.
    LeftAlone {
        /// Its file.
        scan: PathBuf,
    },
    /// No scan is begun for now; these are ready or will be.
    Queued(Vec<PathBuf>),
    /// A scan has the content of one that was inspected before.
    Known {
        /// Its file.
        scan: PathBuf,
        /// The scan under whose name its result stands.
        inspected_as: String,
    },
    /// The watched folder cannot be reached; it is tried again and again.
    FolderLost(Diagnostic),
    /// The watched folder is there again.
    FolderBack,
    /// The results of a watched folder's scan cannot be written; that is tried again and again, no scan is begun meanwhile.
    ResultsLost(Diagnostic),
    /// Results can be written again.
    ResultsBack,
    /// The plan of a watched folder is gone from the disk, or cannot be used any more; no scan is begun until it can.
    PlanLost(Diagnostic),
    /// It is what it was.
    PlanBack,
}

/// Takes a job's events; called on the job's thread.
pub type Listener<'a> = &'a (dyn Fn(Event) + Sync);

/// A sequence running on a thread of its own. Dropping it stops the sequence at once and waits for it.
#[derive(Debug)]
pub struct SequenceJob {
    /// Its events; the channel closes when the job has ended.
    pub events: Receiver<Event>,
    stop: StopSwitch,
    thread: Option<JoinHandle<SequenceSummary>>,
}

/// Events that may wait for their reader before the job does.
const EVENT_QUEUE: usize = 256;

impl SequenceJob {
    /// Starts the sequence. `wake` is called after every event, for a reader that sleeps.
    pub fn start(
        request: SequenceRequest,
        stop: StopSwitch,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (sender, events) = sync_channel(EVENT_QUEUE);
        let switch = stop.clone();
        let thread = std::thread::Builder::new().name("sequence".into()).spawn(move || {
            run_sequence(&request, &switch, &|event| {
                // A reader that is gone has dropped the job, and with it stopped it.
                if sender.send(event).is_ok() {
                    wake();
                }
            })
        })?;
        Ok(Self { events, stop, thread: Some(thread) })
    }

    /// Waits for the end. Read all events first: a full queue holds the job up.
    pub fn join(mut self) -> SequenceSummary {
        let joined = self.thread.take().map(JoinHandle::join);
        match joined {
            Some(Ok(summary)) => summary,
            _ => SequenceSummary {
                error: Some(Diagnostic::error("an internal fault ended the sequence")),
                ..SequenceSummary::default()
            },
        }
    }
}

impl Drop for SequenceJob {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            self.stop.now.cancel();
            // Nobody reads any more; an empty channel lets the job run to its end.
            let (_, closed) = sync_channel(0);
            self.events = closed;
            let _ = thread.join();
        }
    }
}
