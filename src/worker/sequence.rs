//! A sequence of scans: read, inspect, report, one after the other; or, watching, each as it arrives.

use super::clock::{StageClock, timings_line};
use super::results::ResultsFolder;
use super::scans::{Links, ResultNames, list_scans, taken};
use super::watch::FolderWatch;
use super::{Event, Listener};
use crate::diagnostic::{Diagnostic, ReadError, Refusal, Severity};
use crate::inspect::{self, Identity, Inspected, InspectionResult, Outcome, Verdict};
use crate::io;
use crate::part::{self, CacheUse, Part, PartSettings};
use crate::plan::{self, Plan};
use crate::run::{CancelToken, Cancelled, RunContext, Stage};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
    fn is_on(&self) -> bool {
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

    fn count(&mut self, outcome: &Outcome) {
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

/// Runs the whole sequence on this thread. Everything worth knowing goes to the listener as it happens.
pub fn run_sequence(request: &SequenceRequest, stop: &StopSwitch, listener: Listener) -> SequenceSummary {
    let mut summary = SequenceSummary::default();
    match Sequence::prepare(request, stop, listener) {
        Ok(Some(mut sequence)) => {
            let end = match request.watch {
                Some(watch) => sequence.watch(watch, &mut summary),
                None => sequence.run_all(&mut summary),
            };
            if let Err(diagnostic) = end {
                summary.error = Some(diagnostic);
            }
        }
        Ok(None) => {}
        Err(Some(diagnostic)) => summary.error = Some(*diagnostic),
        Err(None) => {}
    }
    summary.stopped = stop.is_on();
    summary
}

/// The part and plan of a sequence, and where its results go.
struct Sequence<'a> {
    request: &'a SequenceRequest,
    stop: &'a StopSwitch,
    listener: Listener<'a>,
    plan: Plan,
    part: Part,
    prepare_ms: Option<f64>,
    results: ResultsFolder,
    names: ResultNames,
}

/// How one scan of the sequence ended.
enum ScanEnd {
    Done(Outcome),
    /// The file is cut off and a watcher should wait for the rest.
    CutOff(Box<Diagnostic>),
}

/// A cut-off file is refused in a sequence of files, and waited for in a watched folder.
#[derive(Clone, Copy, PartialEq, Eq)]
enum OnCutOff {
    Refuse,
    Wait,
}

impl<'a> Sequence<'a> {
    /// Reads plan and CAD. `Ok(None)`: stopped meanwhile; the error is `None` when its problems were told already.
    fn prepare(
        request: &'a SequenceRequest,
        stop: &'a StopSwitch,
        listener: Listener<'a>,
    ) -> Result<Option<Self>, Option<Box<Diagnostic>>> {
        let loaded = plan::load(&request.plan_path);
        let errors = loaded.problems.iter().filter(|p| p.severity == Severity::Error).count();
        listener(Event::Problems(loaded.problems));
        let Some(plan) = loaded.plan else {
            if errors > 0 {
                return Err(None);
            }
            return Err(Some(Box::new(Diagnostic::error("the plan cannot be used").in_file(&request.plan_path))));
        };
        let clock = StageClock::default();
        let observe = |stage| {
            clock.enter(stage);
            listener(Event::Stage(stage));
        };
        let (part, cache) = match prepare_part(&plan, &RunContext::new(&stop.now, &observe)) {
            Ok(prepared) => prepared,
            Err(ReadError::Cancelled(_)) => return Ok(None),
            Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => return Err(Some(diagnostic)),
        };
        let (_, prepare_ms) = clock.milliseconds();
        listener(Event::Prepared { part: part.warnings.clone(), cache });
        let folder = request.out.clone().unwrap_or_else(|| plan.output.path.clone());
        let results = ResultsFolder::open(&folder, &plan.output.formats).map_err(|d| Some(Box::new(d)))?;
        Ok(Some(Self {
            request,
            stop,
            listener,
            plan,
            part,
            prepare_ms: Some(prepare_ms),
            results,
            names: ResultNames::default(),
        }))
    }

    /// The scans named, or else all that the plan finds, in order.
    fn run_all(&mut self, summary: &mut SequenceSummary) -> Result<(), Diagnostic> {
        let scans = if self.request.scans.is_empty() {
            let found = list_scans(&self.plan.scans, Links::Follow)?;
            found.into_iter().map(|l| l.path).collect()
        } else {
            self.request.scans.clone()
        };
        if scans.is_empty() {
            let message = format!("no scan matches \"{}\"", self.plan.scans.pattern);
            return Err(Diagnostic::error(message)
                .in_file(&self.plan.scans.path)
                .with_help("put scans there, change [scans] in the plan, or name scans on the command line"));
        }
        let of = scans.len();
        for (index, scan) in scans.iter().enumerate() {
            if self.stop.is_on() {
                return Ok(());
            }
            (self.listener)(Event::Started { index: index + 1, of: Some(of), scan: scan.clone() });
            match self.one_scan(scan, OnCutOff::Refuse)? {
                Some(ScanEnd::Done(outcome)) => summary.count(&outcome),
                Some(ScanEnd::CutOff(_)) | None => {}
            }
        }
        Ok(())
    }

    /// Takes each scan as it arrives, until somebody stops it.
    fn watch(&mut self, watch: WatchSettings, summary: &mut SequenceSummary) -> Result<(), Diagnostic> {
        let mut folder = FolderWatch::new(watch.settle);
        let mut lost = false;
        let mut index = 0;
        (self.listener)(Event::Watching { folder: self.plan.scans.path.clone() });
        while !self.stop.is_on() {
            match list_scans(&self.plan.scans, Links::Ignore) {
                Ok(listing) => {
                    if std::mem::take(&mut lost) {
                        (self.listener)(Event::FolderBack);
                    }
                    for scan in folder.look(Instant::now(), &listing) {
                        if self.stop.is_on() {
                            return Ok(());
                        }
                        if self.is_known(&scan) {
                            continue;
                        }
                        index += 1;
                        (self.listener)(Event::Started { index, of: None, scan: scan.clone() });
                        match self.one_scan(&scan, OnCutOff::Wait)? {
                            Some(ScanEnd::Done(outcome)) => summary.count(&outcome),
                            Some(ScanEnd::CutOff(diagnostic)) => {
                                folder.wait_for(&scan);
                                (self.listener)(Event::Waiting { scan, why: *diagnostic });
                            }
                            None => {}
                        }
                    }
                }
                Err(diagnostic) if !lost => {
                    lost = true;
                    (self.listener)(Event::FolderLost(diagnostic));
                }
                Err(_) => {}
            }
            std::thread::sleep(watch.poll);
        }
        Ok(())
    }

    /// Whether a scan of the same content was inspected by the same plan and CAD before, under whatever name.
    fn is_known(&self, scan: &Path) -> bool {
        let Ok(bytes) = io::read_file(scan) else { return false };
        let sha256 = io::sha256_hex(&bytes);
        match self.results.inspected_as(&sha256, &self.plan.sha256, &self.part.cad_sha256) {
            Some(name) => {
                (self.listener)(Event::Known { scan: scan.to_path_buf(), inspected_as: name });
                true
            }
            None => false,
        }
    }

    /// One scan, from its bytes to its reports. `None`: dropped because somebody stopped it at once.
    fn one_scan(&mut self, scan: &Path, on_cut_off: OnCutOff) -> Result<Option<ScanEnd>, Diagnostic> {
        let clock = StageClock::default();
        let listener = self.listener;
        let observe = |stage| {
            clock.enter(stage);
            listener(Event::Stage(stage));
        };
        let run = RunContext::new(&self.stop.now, &observe);
        let inspected = match self.inspect_guarded(scan, &run) {
            Ok(Ok(inspected)) => inspected,
            Ok(Err(diagnostic)) if on_cut_off == OnCutOff::Wait => return Ok(Some(ScanEnd::CutOff(diagnostic))),
            Ok(Err(diagnostic)) => {
                let refusal = refusal_of(&diagnostic);
                Inspected { result: inspect::refused(&self.plan, self.identity(scan, None), refusal), scan: None }
            }
            Err(Cancelled) => return Ok(None),
        };
        if run.enter(Stage::Report).is_err() {
            return Ok(None);
        }
        let name = self.names.name_for(scan);
        let files = self.results.write(&name, &inspected, &self.part)?;
        self.append_timings(scan, &clock)?;
        let outcome = inspected.result.outcome.clone();
        (self.listener)(Event::Finished { result: Box::new(inspected.result), files });
        Ok(Some(ScanEnd::Done(outcome)))
    }

    /// A panic becomes a refused scan: the sequence lives on.
    fn inspect_guarded(&self, scan: &Path, run: &RunContext) -> Result<Result<Inspected, Box<Diagnostic>>, Cancelled> {
        match catch_unwind(AssertUnwindSafe(|| self.read_and_inspect(scan, run))) {
            Ok(end) => end,
            Err(panic) => {
                let words = panic
                    .downcast_ref::<String>()
                    .map(String::as_str)
                    .or_else(|| panic.downcast_ref::<&str>().copied())
                    .unwrap_or("no further words");
                let refusal = Refusal::new(
                    format!("an internal fault stopped the inspection: {words}"),
                    "keep this scan and send it to the maintainers; the sequence goes on",
                );
                Ok(Ok(Inspected {
                    result: inspect::refused(&self.plan, self.identity(scan, None), refusal),
                    scan: None,
                }))
            }
        }
    }

    fn read_and_inspect(&self, scan: &Path, run: &RunContext) -> Result<Result<Inspected, Box<Diagnostic>>, Cancelled> {
        run.enter(Stage::Read)?;
        let bytes = match io::read_file(scan) {
            Ok(bytes) => bytes,
            Err(error) => return self.unreadable(scan, None, error),
        };
        run.enter(Stage::Hash)?;
        let identity = self.identity(scan, Some(io::sha256_hex(&bytes)));
        run.enter(Stage::Read)?;
        let cloud = match io::read_cloud(&bytes, scan, self.plan.scans.unit, run) {
            Ok(cloud) => cloud,
            Err(error) => return self.unreadable(scan, identity.scan_sha256, error),
        };
        drop(bytes);
        let mut inspected = inspect::inspect(&self.plan, &self.part, cloud, identity, run)?;
        if let (Err(words), Outcome::Measured(inspection)) =
            (taken(&self.plan.scans.taken, scan), &mut inspected.result.outcome)
        {
            inspection.warnings.push(words);
        }
        Ok(Ok(inspected))
    }

    fn unreadable(
        &self,
        scan: &Path,
        sha256: Option<String>,
        error: ReadError,
    ) -> Result<Result<Inspected, Box<Diagnostic>>, Cancelled> {
        match error {
            ReadError::Cancelled(cancelled) => Err(cancelled),
            ReadError::CutOff(diagnostic) => Ok(Err(diagnostic)),
            ReadError::Bad(diagnostic) => {
                let result = inspect::refused(&self.plan, self.identity(scan, sha256), refusal_of(&diagnostic));
                Ok(Ok(Inspected { result, scan: None }))
            }
        }
    }

    fn identity(&self, scan: &Path, scan_sha256: Option<String>) -> Identity {
        let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Identity {
            part_name: self.plan.part.name.clone(),
            part_number: self.plan.part.number.clone(),
            part_revision: self.plan.part.revision.clone(),
            plan_file: name(&self.plan.path),
            plan_sha256: self.plan.sha256.clone(),
            cad_file: self.plan.cad.file.clone(),
            cad_sha256: self.part.cad_sha256.clone(),
            cad_triangles: self.part.triangles_in_file,
            scan_file: name(scan),
            scan_sha256,
            scan_taken: taken(&self.plan.scans.taken, scan).ok().flatten(),
        }
    }

    fn append_timings(&mut self, scan: &Path, clock: &StageClock) -> Result<(), Diagnostic> {
        let Some(path) = &self.request.timings else { return Ok(()) };
        let name = scan.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let line = timings_line(&name, clock, self.prepare_ms.take());
        std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .and_then(|mut file| writeln!(file, "{line}"))
            .map_err(|e| Diagnostic::error(format!("the timings cannot be written: {e}")).in_file(path))
    }
}

/// Prepares the plan's CAD, from its cache where that is good.
pub fn prepare_part(plan: &Plan, run: &RunContext) -> Result<(Part, CacheUse), ReadError> {
    run.enter(Stage::Prepare)?;
    let cache = part::cache_path(&plan.cad.path);
    part::load_or_prepare(&plan.cad, &part_settings(plan), Some(&cache), run)
}

/// What of a plan the prepared CAD depends on.
pub fn part_settings(plan: &Plan) -> PartSettings {
    let features = plan.features.iter().map(|f| &f.geometry);
    let points = plan.comparison.iter().map(|p| &p.geometry);
    PartSettings {
        cad_side: plan.part.cad_side,
        thickness_mm: plan.part.thickness_mm,
        plan_directions: features.chain(points).map(|g| (g.position(), g.sheet_normal())).collect(),
    }
}

/// A file's fault as the reason of a refused scan. Its folder is left out: the same scan gives the same report
/// wherever it lies.
fn refusal_of(diagnostic: &Diagnostic) -> Refusal {
    let place = match (&diagnostic.file, diagnostic.line) {
        (Some(file), line) => {
            let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            line.map_or_else(|| format!("{name}: "), |line| format!("{name}:{line}: "))
        }
        (None, _) => String::new(),
    };
    let help = diagnostic.help.clone().unwrap_or_else(|| "copy the scan again; the sequence goes on".into());
    Refusal::new(format!("{place}{}", diagnostic.message), help)
}

/// What a result says in one line, for lists and the command line.
pub fn one_line(result: &InspectionResult) -> String {
    let scan = &result.identity.scan_file;
    match &result.outcome {
        Outcome::Refused(refusal) => format!("{scan}\trefused\t{}", refusal.reason),
        Outcome::Measured(inspection) => {
            let side = inspection.best_fit.side.map_or("side unknown".into(), |s| format!("seen from the {}", s.key()));
            let count = |verdict| inspection.points.iter().filter(|p| p.verdict == verdict).count();
            let counts: Vec<String> = [
                (count(Verdict::Fail), "out of tolerance"),
                (count(Verdict::NotMeasured), "not measured"),
                (count(Verdict::Undecided), "undecided"),
                (count(Verdict::Pass), "in tolerance"),
            ]
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, words)| format!("{n} {words}"))
            .collect();
            format!("{scan}\t{}\t{side}\t{}", inspection.verdict.part_key(), counts.join(", "))
        }
    }
}
