//! The worker's thread as the window sees it: jobs go in, events come out, nobody waits.
//!
//! Jobs call the same functions as the command line, so that results are the same to the byte. Every event carries the
//! generation of its job; `Bridge::events` drops those of jobs that are given up, and nothing else looks at generations.

use super::facts::Wanted;
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::LengthUnit;
use crate::inspect::{Inspected, InspectionResult};
use crate::io;
use crate::part::Part;
use crate::plan::document::Document;
use crate::plan::{self, Draft, Plan};
use crate::report::manifest::Manifest;
use crate::run::{CancelToken, RunContext, Stage};
use crate::stitch::StitchError;
use crate::worker::merge::{MergeEvent, MergeJob, MergeRequest, merge_files};
use crate::worker::scans::{Links, list_scans};
use crate::worker::watch::Listed;
use crate::worker::{
    self, Examiner, NoTrial, SequenceRequest, SequenceSummary, StopSwitch, Trial, check_plan, prepare_part,
    run_sequence,
};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Events that may wait for the window before the worker does. Few: each may hold the points of a scan.
const EVENT_QUEUE: usize = 16;

/// What the worker is asked to do.
#[derive(Debug)]
pub enum Job {
    /// Read a plan, prepare its CAD, tell all problems.
    Open(PathBuf),
    /// Inspect scans.
    Run(SequenceRequest),
    /// Inspect one scan again, writing nothing.
    Fetch {
        /// What it is wanted for.
        wanted: Wanted,
        /// Its file.
        scan: PathBuf,
        /// What it is held to.
        plan: Arc<Plan>,
        /// What it is held to.
        part: Arc<Part>,
    },
    /// Try the plan that is edited on a scan.
    Try(Box<TryOrder>),
    /// Merge views and write what comes out.
    Merge(MergeRequest),
    /// A fault on purpose.
    #[cfg(test)]
    Panic,
}

/// A plan that is edited, and a scan to try it on.
#[derive(Debug)]
pub struct TryOrder {
    /// The plan.
    pub document: Document,
    /// Its version, which is given back.
    pub version: u64,
    /// The plan on the disk with its CAD.
    pub known: Option<(Arc<Plan>, Arc<Part>)>,
    /// What that one made of the scan, if it was inspected.
    pub before: Option<Arc<InspectionResult>>,
    /// The scan.
    pub scan: PathBuf,
}

/// What the worker tells.
#[derive(Debug)]
pub enum Event {
    /// The CAD of a plan that is opened enters a stage.
    Stage(Stage),
    /// A plan is open, or its problems say why not.
    Opened(Box<Opened>),
    /// From a sequence.
    Sequence(worker::Event),
    /// A sequence has ended.
    Ended {
        /// How.
        summary: SequenceSummary,
        /// The scans that lie in its folder now.
        scans: Option<Scans>,
        /// Those of them that came, or were written again, while it ran.
        came: Vec<PathBuf>,
    },
    /// A scan was inspected again.
    Fetched {
        /// What it was wanted for.
        wanted: Wanted,
        /// What came out.
        inspected: Box<Inspected>,
        /// How long it took.
        took: Duration,
    },
    /// A plan that is edited was tried, or why not.
    Tried {
        /// Its version.
        version: u64,
        /// What came out.
        trial: Result<Box<Trial>, NoTrial>,
    },
    /// From a merge.
    Merge(MergeEvent),
    /// A merge has ended.
    Merged(Box<MergedEnd>),
    /// The job was given up because of a fault.
    Failed(Diagnostic),
}

/// How a merge ended.
#[derive(Debug)]
pub struct MergedEnd {
    /// What came out; the points of its views are let go.
    pub outcome: Result<MergeJob, Option<StitchError>>,
    /// Problems of its settings.
    pub problems: Vec<Diagnostic>,
    /// How long it took.
    pub took: Duration,
}

/// What opening a plan gave.
#[derive(Debug)]
pub struct Opened {
    /// Its file.
    pub path: PathBuf,
    /// Whether there is such a file at all.
    pub found: bool,
    /// The plan, if it can be run.
    pub plan: Option<Arc<Plan>>,
    /// Its CAD.
    pub part: Option<Arc<Part>>,
    /// All problems.
    pub problems: Vec<Diagnostic>,
    /// The scans in its folder.
    pub scans: Option<Scans>,
}

/// The scans in a folder, or why they cannot be listed.
pub type Scans = Result<Vec<Listed>, Diagnostic>;

struct Order {
    generation: u64,
    job: Job,
    stop: StopSwitch,
}

/// The window's end of the worker. Dropping it cancels the job at hand and waits for the thread.
pub struct Bridge {
    orders: Option<Sender<Order>>,
    events: Receiver<(u64, Event)>,
    generation: u64,
    stop: StopSwitch,
    thread: Option<JoinHandle<()>>,
}

impl Bridge {
    /// Starts the thread. `wake` is called on it after every event.
    pub fn start(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let (orders, jobs) = channel::<Order>();
        let (sender, events) = sync_channel(EVENT_QUEUE);
        let work = move || {
            for order in jobs {
                let teller = Teller { generation: order.generation, sender: &sender, wake: &wake };
                carry_out(order.job, &order.stop, &teller);
            }
        };
        let thread = std::thread::Builder::new().name("worker".into()).spawn(work)?;
        let stop = StopSwitch::default();
        Ok(Self { orders: Some(orders), events, generation: 0, stop, thread: Some(thread) })
    }

    /// Gives up the job at hand and begins another.
    pub fn begin(&mut self, job: Job) {
        self.stop.now.cancel();
        self.stop = StopSwitch::default();
        self.generation += 1;
        let order = Order { generation: self.generation, job, stop: self.stop.clone() };
        if let Some(orders) = &self.orders {
            // The thread ends only when this sender is gone.
            let _ = orders.send(order);
        }
    }

    /// Stops after the running part.
    pub fn stop_after_part(&self) {
        self.stop.after_part.cancel();
    }

    /// Drops the running part. Its job still tells that it has ended.
    pub fn stop_now(&self) {
        self.stop.now.cancel();
    }

    /// What was told since the last call. Events of jobs that were given up are dropped here.
    pub fn events(&self) -> Vec<Event> {
        self.events
            .try_iter()
            .filter(|(generation, _)| *generation == self.generation)
            .map(|(_, event)| event)
            .collect()
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        self.stop.now.cancel();
        self.orders = None;
        // Nobody reads any more; a closed channel lets the job run to its end.
        let (_, closed) = sync_channel(0);
        self.events = closed;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Tells what one job has to say.
struct Teller<'a> {
    generation: u64,
    sender: &'a SyncSender<(u64, Event)>,
    wake: &'a (dyn Fn() + Send + Sync),
}

impl Teller<'_> {
    fn tell(&self, event: Event) {
        // A window that is gone has cancelled the job.
        if self.sender.send((self.generation, event)).is_ok() {
            (self.wake)();
        }
    }
}

/// A panic is told like any other fault; the thread lives on.
fn carry_out(job: Job, stop: &StopSwitch, teller: &Teller) {
    let done = catch_unwind(AssertUnwindSafe(|| match job {
        Job::Open(path) => open(path, stop, teller),
        Job::Run(request) => {
            let before = scans_of(&plan::load(&request.plan_path).draft);
            let summary = run_sequence(&request, stop, &|event| teller.tell(Event::Sequence(event)));
            let loaded = plan::load(&request.plan_path);
            let scans = scans_of(&loaded.draft);
            // What a watch left is told by itself.
            let asked = request.watch.is_none() && request.scans.is_empty();
            let came = match (before, &scans, &loaded.plan) {
                (Some(Ok(before)), Some(Ok(now)), Some(plan)) if asked => came_meanwhile(&before, now, plan),
                _ => Vec::new(),
            };
            teller.tell(Event::Ended { summary, scans, came });
        }
        Job::Fetch { wanted, scan, plan, part } => fetch(wanted, scan, Examiner { plan, part }, &stop.now, teller),
        Job::Try(order) => try_on(*order, &stop.now, teller),
        Job::Merge(request) => merge(&request, &stop.now, teller),
        #[cfg(test)]
        Job::Panic => panic!("a fault on purpose"),
    }));
    if let Err(panic) = done {
        let words = panic.downcast_ref::<String>().map(String::as_str);
        let words = words.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no further words");
        let fault = Diagnostic::error(format!("an internal fault: {words}")).with_help(
            "this is a fault of the program, not of your files; please send this message to the maintainers",
        );
        teller.tell(Event::Failed(fault));
    }
}

/// Reads plan and CAD and looks at the folders. A job that is cancelled tells nothing.
fn open(path: PathBuf, stop: &StopSwitch, teller: &Teller) {
    let observe = |stage| teller.tell(Event::Stage(stage));
    let run = RunContext::new(&stop.now, &observe);
    let Ok(problems) = check_plan(&path, &run) else { return };
    let loaded = plan::load(&path);
    let scans = scans_of(&loaded.draft);
    let plan = loaded.plan;
    let part = match plan.as_ref().map(|plan| prepare_part(plan, &run)) {
        Some(Err(ReadError::Cancelled(_))) => return,
        Some(Ok((part, _))) => Some(Arc::new(part)),
        // What is wrong with it stands among the problems.
        Some(Err(_)) | None => None,
    };
    let found = path.is_file();
    teller.tell(Event::Opened(Box::new(Opened { path, found, plan: plan.map(Arc::new), part, problems, scans })));
}

/// The scans that a plan finds now.
fn scans_of(draft: &Draft) -> Option<Scans> {
    let settings = draft.scans.as_ref()?;
    Some(list_scans(settings, Links::Follow))
}

/// Scans that came or were written again while a sequence ran; its own results are none.
fn came_meanwhile(before: &[Listed], now: &[Listed], plan: &Plan) -> Vec<PathBuf> {
    let results = Manifest::load(&plan.output.path).unwrap_or_default();
    let is_ours = |file: &Listed| {
        let name = file.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        file.path.parent() == Some(&plan.output.path) && results.hash_of(&name).is_some()
    };
    let before: BTreeMap<&PathBuf, &Listed> = before.iter().map(|file| (&file.path, file)).collect();
    let came = now.iter().filter(|file| before.get(&file.path) != Some(file) && !is_ours(file));
    came.map(|file| file.path.clone()).collect()
}

/// Merges as the command line does. Of the views nobody looks at the points again.
fn merge(request: &MergeRequest, cancel: &CancelToken, teller: &Teller) {
    let begin = Instant::now();
    let observe = |stage| teller.tell(Event::Merge(MergeEvent::Stage(stage)));
    let mut problems = Vec::new();
    let run = RunContext::new(cancel, &observe);
    let mut outcome = merge_files(request, &run, &mut problems, &|event| teller.tell(Event::Merge(event)));
    if let Ok(job) = &mut outcome {
        for view in &mut job.result.placed.views {
            (view.positions, view.pixels) = (Vec::new(), None);
            view.columns.clear();
        }
    }
    teller.tell(Event::Merged(Box::new(MergedEnd { outcome, problems, took: begin.elapsed() })));
}

fn fetch(wanted: Wanted, scan: PathBuf, examiner: Examiner, cancel: &CancelToken, teller: &Teller) {
    let begin = Instant::now();
    let observe = |stage| teller.tell(Event::Stage(stage));
    if let Ok(inspected) = examiner.look_again(&scan, &RunContext::new(cancel, &observe)) {
        teller.tell(Event::Fetched { wanted, inspected: Box::new(inspected), took: begin.elapsed() });
    }
}

/// What was made of the scan before is asked of the plan on the disk where nobody inspected it yet.
fn try_on(order: TryOrder, cancel: &CancelToken, teller: &Teller) {
    let TryOrder { document, version, known, before, scan } = order;
    let observe = |stage| teller.tell(Event::Stage(stage));
    let run = RunContext::new(cancel, &observe);
    let trial = tried(&document, known, before, &scan, &run).map(Box::new);
    teller.tell(Event::Tried { version, trial });
}

fn tried(
    document: &Document,
    known: Option<(Arc<Plan>, Arc<Part>)>,
    before: Option<Arc<InspectionResult>>,
    scan: &Path,
    run: &RunContext,
) -> Result<Trial, NoTrial> {
    let fault = |fault: ReadError| match fault {
        ReadError::Cancelled(cancelled) => NoTrial::from(cancelled),
        ReadError::Bad(told) | ReadError::CutOff(told) => NoTrial::Cad(told),
    };
    run.enter(Stage::Read)?;
    let bytes = io::read_file_while(scan, run).map_err(fault)?;
    let sha256 = io::sha256_of(&bytes, run)?;
    let unit = document.read().draft.scans.map_or(LengthUnit::Mm, |scans| scans.unit);
    let cloud = io::read_cloud(&bytes, scan, unit, run).map_err(fault)?;
    drop(bytes);
    let before = match before.filter(|b| b.identity.scan_sha256.as_ref() == Some(&sha256)) {
        Some(before) => Some(before),
        None => match known.clone() {
            Some((plan, part)) => Some(Arc::new(Examiner { plan, part }.inspect_file(scan, run)?)),
            None => None,
        },
    };
    let known = known.as_ref().map(|(plan, part)| (&**plan, part));
    worker::try_plan(document, known, &cloud, scan, before, run)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    /// A bridge that says when there is something to read.
    fn bridge() -> (Bridge, mpsc::Receiver<()>) {
        let (bell, ring) = channel();
        (Bridge::start(move || bell.send(()).unwrap_or_default()).unwrap(), ring)
    }

    fn next(bridge: &Bridge, ring: &mpsc::Receiver<()>) -> Vec<Event> {
        loop {
            ring.recv_timeout(Duration::from_secs(60)).expect("the worker tells something");
            let events = bridge.events();
            if !events.is_empty() {
                return events;
            }
        }
    }

    #[test]
    fn a_panic_is_told_and_the_worker_lives_on() {
        let (mut bridge, ring) = bridge();
        bridge.begin(Job::Panic);
        let events = next(&bridge, &ring);
        assert!(matches!(&events[..], [Event::Failed(fault)] if fault.message.contains("on purpose")), "{events:?}");
        bridge.begin(Job::Open("no such plan.toml".into()));
        let events = next(&bridge, &ring);
        assert!(
            matches!(&events[..], [Event::Opened(opened)] if opened.plan.is_none() && opened.problems.len() == 1),
            "{events:?}"
        );
    }

    #[test]
    fn events_of_a_job_that_was_given_up_are_dropped() {
        let (mut bridge, ring) = bridge();
        bridge.begin(Job::Panic);
        ring.recv_timeout(Duration::from_secs(60)).expect("told");
        // The fault lies in the queue now; the next job makes it stale.
        bridge.begin(Job::Open("no such plan.toml".into()));
        let events = next(&bridge, &ring);
        assert!(matches!(&events[..], [Event::Opened(_)]), "{events:?}");
    }
}
