//! A sequence of scans: read, inspect, report, one after the other.

use super::check::outlook;
use super::clock::{StageClock, timings_line};
use super::delivered::Delivered;
use super::examine::{Examined, Examiner, Loaded, load, prepare_part};
use super::plan_on_disk::{PlanNow, PlanOnDisk};
use super::request::{SequenceRequest, SequenceSummary, StopSwitch};
use super::results::ResultsFolder;
use super::scans::{Links, list_scans};
use super::watch::{Listed, NotYet};
use super::{Event, Listener};
use crate::diagnostic::{Diagnostic, ReadError, Severity};
use crate::inspect::check_against_part;
use crate::inspect::{Inspected, InspectionResult};
use crate::plan;
use crate::run::{Cancelled, RunContext, Stage};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Runs the whole sequence on this thread. Everything worth knowing goes to the listener as it happens.
pub fn run_sequence(request: &SequenceRequest, stop: &StopSwitch, listener: Listener) -> SequenceSummary {
    let mut summary = SequenceSummary::default();
    let mut begun = false;
    loop {
        let end = match Sequence::prepare(request, stop, listener) {
            Ok(Some(mut sequence)) => match request.watch {
                Some(watch) => sequence.watch(watch, &mut summary),
                None => sequence.run_all(&mut summary).map(|()| WatchEnd::Stopped),
            },
            Ok(None) => Ok(WatchEnd::Stopped),
            // Its problems were told; parts of the plan before must not stand for those of this one.
            Err(None) if begun => Err(Diagnostic::error("the plan cannot be used").in_file(&request.plan_path)),
            Err(None) => Ok(WatchEnd::Stopped),
            Err(Some(diagnostic)) => Err(*diagnostic),
        };
        begun = true;
        match end {
            Ok(WatchEnd::AnotherPlan) => continue,
            Ok(WatchEnd::Stopped) => break,
            Err(diagnostic) => {
                summary.error = Some(diagnostic);
                break;
            }
        }
    }
    summary.stopped = stop.is_on();
    summary
}

/// How a watch ended that nothing was wrong with.
pub(super) enum WatchEnd {
    /// Somebody stopped it.
    Stopped,
    /// Another plan lies on the disk: it begins anew by that.
    AnotherPlan,
}

/// The part and plan of a sequence, and where its results go.
pub(super) struct Sequence<'a> {
    pub(super) request: &'a SequenceRequest,
    pub(super) stop: &'a StopSwitch,
    pub(super) listener: Listener<'a>,
    pub(super) examiner: Examiner,
    pub(super) results: ResultsFolder,
    pub(super) plan_on_disk: PlanOnDisk,
    prepare_ms: Option<f64>,
    /// The results of the part before could not be written.
    lost_one: bool,
}

/// How one scan of the sequence ended.
pub(super) enum ScanEnd {
    /// Its reports are written.
    Done(Arc<InspectionResult>),
    /// Watching: the same content was inspected before, and it is no other part's.
    Known,
    /// Watching: the content with this hash was delivered again. Nothing was measured, which was told.
    Repeated(String),
    /// Watching: there is nothing to inspect yet; in words, if it needs any.
    NotYet(NotYet, Option<Box<Diagnostic>>),
    /// It is not there any more, or somebody stopped the job at once.
    Dropped,
}

/// A result, or the reason why there is none.
enum Look {
    Result(Box<Inspected>),
    /// A content that was inspected before, its hash, and the name of the scan that it came with.
    Repeated(String, String),
    End(ScanEnd),
}

/// A file of a watched folder that has settled.
#[derive(Clone, Copy)]
pub(super) struct Arrival<'a> {
    /// As it was listed when it was ready.
    pub file: &'a Listed,
    /// What the watch saw before.
    pub delivered: &'a Delivered,
    /// Its results could not be written: whatever is known of its content, it is inspected again.
    pub unwritten: bool,
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
        if let Some(path) = &request.timings {
            timings_file(path).map_err(|e| Some(Box::new(no_timings(path, &e))))?;
        }
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
        let (plan, part) = (Arc::new(plan), Arc::new(part));
        listener(Event::Prepared { plan: plan.clone(), part: part.clone(), cache });
        let against_cad = check_against_part(&plan, &part);
        let unfit = against_cad.iter().any(|p| p.severity == Severity::Error);
        listener(Event::Problems(against_cad.into_iter().chain(outlook(&loaded.draft, Some(&part))).collect()));
        if unfit {
            return Err(None);
        }
        let folder = request.out.clone().unwrap_or_else(|| plan.output.path.clone());
        let opened = ResultsFolder::open(&folder, &plan.output.formats);
        let (results, warnings) = opened.map_err(|d| Some(Box::new(d)))?;
        listener(Event::Problems(warnings));
        let plan_on_disk = PlanOnDisk::of(&plan, request.plan_path.clone());
        let examiner = Examiner { plan, part };
        Ok(Some(Self {
            request,
            stop,
            listener,
            examiner,
            results,
            plan_on_disk,
            prepare_ms: Some(prepare_ms),
            lost_one: false,
        }))
    }

    /// The plan's scans as they lie in the folder now, without this program's own files.
    pub(super) fn list(&mut self, links: Links) -> Result<Vec<Listed>, Diagnostic> {
        let settings = &self.examiner.plan.scans;
        let mut listing = list_scans(settings, links)?;
        self.results.sift(&settings.path, &mut listing);
        Ok(listing)
    }

    /// The scans named, or else all that the plan finds, in order.
    fn run_all(&mut self, summary: &mut SequenceSummary) -> Result<(), Diagnostic> {
        let scans: Vec<PathBuf> = if self.request.scans.is_empty() {
            self.list(Links::Follow)?.into_iter().map(|l| l.path).collect()
        } else {
            self.results.keep_scans(&self.request.scans);
            self.request.scans.clone()
        };
        if scans.is_empty() {
            let settings = &self.examiner.plan.scans;
            let message = format!("no scan matches \"{}\"", settings.pattern);
            return Err(Diagnostic::error(message)
                .in_file(&settings.path)
                .with_help("put scans there, change [scans] in the plan, or name scans on the command line"));
        }
        let of = scans.len();
        (self.listener)(Event::Listed(scans.clone()));
        for (index, scan) in scans.iter().enumerate() {
            if self.stop.is_on() {
                return Ok(());
            }
            self.still_by_this_plan()?;
            let waiting = of - index - 1;
            (self.listener)(Event::Started { index: index + 1, of: Some(of), waiting, scan: scan.clone() });
            match self.one_scan(scan, None) {
                Ok(ScanEnd::Done(result)) => {
                    self.lost_one = false;
                    summary.count(&result.outcome);
                }
                Ok(_) => {}
                Err(diagnostic) => self.unwritten(scan, diagnostic, summary)?,
            }
        }
        self.still_by_this_plan()
    }

    /// A sequence does not go on by a plan that somebody replaced: the next part may be judged by other limits.
    fn still_by_this_plan(&mut self) -> Result<(), Diagnostic> {
        let told = match self.plan_on_disk.look(Instant::now(), Duration::ZERO) {
            PlanNow::Same | PlanNow::Settling => return Ok(()),
            PlanNow::Another(told) => *told,
            PlanNow::Unusable(why) => *why,
        };
        let help = "the sequence has stopped, its parts were judged by the plan as it was; run it again";
        Err(Diagnostic { severity: Severity::Error, ..told.with_help(help) })
    }

    /// The results of a part could not be written: told and counted. The next part is tried where only this one did not fit; the error:
    /// nothing can be written at all, or those of two parts one after the other could not.
    fn unwritten(
        &mut self,
        scan: &Path,
        mut diagnostic: Diagnostic,
        summary: &mut SequenceSummary,
    ) -> Result<(), Diagnostic> {
        summary.unwritten += 1;
        let name = scan.file_name().unwrap_or(scan.as_os_str()).to_string_lossy();
        diagnostic.message = format!("the results of {name} are lost: {}", diagnostic.message);
        self.lost(scan, &diagnostic);
        (self.listener)(Event::Problems(vec![diagnostic.clone()]));
        if std::mem::replace(&mut self.lost_one, true) {
            return Err(diagnostic);
        }
        let Ok(warnings) = self.results.reopen() else { return Err(diagnostic) };
        (self.listener)(Event::Problems(warnings));
        Ok(())
    }

    /// Says that a part has no verdict, whatever was measured of it: nothing of it is on the disk.
    pub(super) fn lost(&self, scan: &Path, why: &Diagnostic) {
        let result = Arc::new(self.examiner.refused(scan, None, why).result);
        (self.listener)(Event::Lost { result, scan: scan.to_path_buf() });
    }

    /// One scan, from its bytes to its reports. One that arrived in a watched folder is left for later while it is not whole, and
    /// left alone where it was inspected before. The error: results cannot be written.
    pub(super) fn one_scan(&mut self, scan: &Path, watched: Option<Arrival>) -> Result<ScanEnd, Diagnostic> {
        let clock = StageClock::default();
        let (listener, stop) = (self.listener, self.stop);
        let observe = |stage| {
            clock.enter(stage);
            listener(Event::Stage(stage));
        };
        let run = RunContext::new(&stop.now, &observe);
        match self.look_into(scan, watched, &run) {
            Ok(Look::Result(inspected)) => {
                let sha256 = inspected.result.identity.scan_sha256.as_deref();
                let again = watched.is_some() && sha256.is_some() && self.results.knows(scan, sha256);
                self.hand_in(scan, *inspected, again, &clock, &run)
            }
            Ok(Look::Repeated(sha256, before)) => self.repeated(scan, sha256, &before, &clock, &run),
            Ok(Look::End(end)) => Ok(end),
            Err(Cancelled) => Ok(ScanEnd::Dropped),
        }
    }

    /// A scan with the content of one before it: the part was not measured. A result that stands under its own name stays.
    fn repeated(
        &mut self,
        scan: &Path,
        sha256: String,
        before: &str,
        clock: &StageClock,
        run: &RunContext,
    ) -> Result<ScanEnd, Diagnostic> {
        let message = format!("not measured: the scan has the same content as {before}, which was inspected before");
        let help = "see whether the scanner delivered its last scan once more, and measure this part again";
        let told = Diagnostic::warning(message).with_help(help);
        if scan.file_name().is_some_and(|name| name.to_string_lossy() == before) {
            self.lost(scan, &told);
            (self.listener)(Event::Problems(vec![told.in_file(scan)]));
            return Ok(ScanEnd::Repeated(sha256));
        }
        let refused = self.examiner.refused(scan, None, &told);
        Ok(match self.hand_in(scan, refused, false, clock, run)? {
            ScanEnd::Done(_) => ScanEnd::Repeated(sha256),
            end => end,
        })
    }

    fn look_into(&self, scan: &Path, watched: Option<Arrival>, run: &RunContext) -> Result<Look, Cancelled> {
        let loaded = load(&self.examiner.plan, scan, run)?;
        let loaded = match (loaded, watched) {
            (Ok(loaded), _) => loaded,
            (Err(fault), None) => return Ok(Look::Result(Box::new(self.examiner.refused(scan, None, &fault)))),
            (Err(fault), Some(_)) => {
                // A scan that somebody took away again needs no word.
                let gone = std::fs::symlink_metadata(scan).is_err();
                return Ok(Look::End(if gone { ScanEnd::Dropped } else { not_yet(NotYet::Unreadable, *fault) }));
            }
        };
        let sha256 = loaded.sha256.clone();
        if let Some(arrival) = watched
            && let Some(end) = self.known(scan, &loaded, arrival, run)
        {
            return Ok(end);
        }
        Ok(match self.examiner.examine(scan, loaded, watched.is_some(), run)? {
            Examined::Done(inspected) => Look::Result(inspected),
            Examined::CutOff(fault) if watched.is_some() => Look::End(not_yet(NotYet::CutOff, *fault)),
            Examined::CutOff(fault) => Look::Result(Box::new(self.examiner.refused(scan, Some(sha256), &fault))),
        })
    }

    /// What is to be said of a scan that arrived without inspecting it: it changed meanwhile, or its content was inspected before.
    fn known(&self, scan: &Path, loaded: &Loaded, arrival: Arrival, run: &RunContext) -> Option<Look> {
        let Arrival { file, delivered, unwritten } = arrival;
        if !file.is_still_so() || loaded.size != file.size {
            return Some(Look::End(ScanEnd::NotYet(NotYet::Changed, None)));
        }
        let (plan, part) = (&self.examiner.plan, &self.examiner.part);
        let row = self.results.inspected_as(&loaded.sha256, &plan.sha256, &part.cad_sha256).filter(|_| !unwritten)?;
        // A file that an earlier run refused because it was cut off still waits for its rest.
        let cut_off = if row.refused { self.examiner.cut_off(scan, loaded, run) } else { None };
        if let Some(fault) = cut_off {
            return Some(Look::End(not_yet(NotYet::CutOff, *fault)));
        }
        let inspected_as = row.scan.clone();
        let has_result = self.results.knows(scan, None);
        if delivered.is_repeated(file, &loaded.sha256, &inspected_as, has_result) {
            return Some(Look::Repeated(loaded.sha256.clone(), inspected_as));
        }
        (self.listener)(Event::Known { scan: scan.to_path_buf(), inspected_as });
        Some(Look::End(ScanEnd::Known))
    }

    /// Prints and writes the reports.
    fn hand_in(
        &mut self,
        scan: &Path,
        mut inspected: Inspected,
        again: bool,
        clock: &StageClock,
        run: &RunContext,
    ) -> Result<ScanEnd, Diagnostic> {
        if run.enter(Stage::Report).is_err() {
            return Ok(ScanEnd::Dropped);
        }
        let (results, part) = (&mut self.results, &self.examiner.part);
        let printed = catch_unwind(AssertUnwindSafe(|| results.print(scan, &inspected, part, run)));
        let printed = printed.unwrap_or_else(|panic| {
            let sha256 = inspected.result.identity.scan_sha256.take();
            inspected = self.examiner.broken(scan, sha256, &*panic);
            self.results.print(scan, &inspected, &self.examiner.part, run)
        });
        let Ok((name, printed)) = printed else { return Ok(ScanEnd::Dropped) };
        let aside = self.results.sets_aside(&name, &inspected);
        let files = self.results.store(&name, printed, &inspected)?;
        if let Some(aside) = aside {
            let message = format!(
                "the scan has another content than the one inspected before under its name; that result is kept as \"{aside}\""
            );
            let help = "give each part's scan a name of its own";
            (self.listener)(Event::Problems(vec![Diagnostic::warning(message).in_file(scan).with_help(help)]));
        }
        self.append_timings(scan, clock);
        let (result, points) = (Arc::new(inspected.result), inspected.scan.map(Arc::new));
        let took = clock.elapsed();
        (self.listener)(Event::Finished { result: result.clone(), scan: points, files, again, took });
        Ok(ScanEnd::Done(result))
    }

    /// Times are for engineers: a line that is lost does not stop production.
    fn append_timings(&mut self, scan: &Path, clock: &StageClock) {
        let Some(path) = &self.request.timings else { return };
        let name = scan.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let line = timings_line(&name, clock, self.prepare_ms.take());
        if let Err(e) = timings_file(path).and_then(|mut file| writeln!(file, "{line}")) {
            let warning = Diagnostic { severity: Severity::Warning, ..no_timings(path, &e) };
            (self.listener)(Event::Problems(vec![warning]));
        }
    }
}

/// A scan to wait for, with the words for it.
fn not_yet(why: NotYet, fault: Diagnostic) -> ScanEnd {
    let help = match why {
        NotYet::CutOff => "waiting for the rest; the scan is inspected as soon as it is whole",
        NotYet::Unreadable | NotYet::Changed => "waiting; it is tried again until it can be read",
    };
    ScanEnd::NotYet(why, Some(Box::new(Diagnostic { severity: Severity::Warning, ..fault.with_help(help) })))
}

/// Opened for appending; a file that holds something else than timings is left alone.
fn timings_file(path: &Path) -> std::io::Result<File> {
    let mut first = [0u8; 1];
    if path.is_file() && File::open(path)?.read(&mut first)? > 0 && first != *b"{" {
        return Err(std::io::Error::other("the file is there already and holds no timings"));
    }
    OpenOptions::new().create(true).append(true).open(path)
}

fn no_timings(path: &Path, error: &std::io::Error) -> Diagnostic {
    Diagnostic::error(format!("the timings cannot be written: {error}"))
        .in_file(path)
        .with_help("give another file with --timings")
}
