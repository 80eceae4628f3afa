//! What the worker tells becomes fact here and nowhere else.

use super::action::Action;
use super::app::App;
use super::bridge::{Event, Opened, Scans};
use super::earlier;
use super::engineer;
use super::facts::{Facts, FinishedPart, Job, RunningScan, Troubles, Unfinished, Wanted};
use super::merge;
use crate::diagnostic::{Diagnostic, Severity};
use crate::inspect::{Inspected, InspectionResult, Outcome};
use crate::run::Stage;
use crate::worker::{self, SequenceSummary};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Takes one event.
pub(super) fn event(app: &mut App, event: Event) {
    match event {
        Event::Stage(stage) => enter(app, stage),
        Event::Opened(opened) => self::opened(app, *opened),
        Event::Sequence(event) => sequence(app, event),
        Event::Ended { summary, scans, came } => ended(app, summary, (scans, came)),
        Event::Fetched { wanted, inspected, took } => {
            app.facts.job = Job::Idle;
            match wanted {
                Wanted::Part(at) => fetched(app, at, *inspected, took),
                Wanted::Earlier(at) => earlier::inspected_again(app, at, *inspected, took),
            }
        }
        Event::Tried { version, trial } => tried(app, version, trial),
        Event::Merge(event) => merge::hear(app, event),
        Event::Merged(end) => merge::ended(app, *end),
        Event::Failed(fault) => failed(app, fault),
    }
}

/// A job was given up because of a fault; a run ends with it.
fn failed(app: &mut App, fault: Diagnostic) {
    let was_running = app.facts.running().is_some();
    if let (Job::Merging(_), Some(merging)) = (&app.facts.job, &mut app.facts.merging) {
        merging.fault = Some(fault.clone());
    }
    app.facts.job = Job::Idle;
    app.facts.troubles = Troubles::default();
    app.facts.message = Some(fault.clone());
    if was_running {
        // What was judged before the fault is no verdict of the part at hand.
        app.facts.run_from = app.facts.parts.len();
        app.facts.last_end = Some(SequenceSummary { error: Some(fault), ..SequenceSummary::default() });
    }
}

fn enter(app: &mut App, stage: Stage) {
    match &mut app.facts.job {
        Job::Opening { stage: now, .. } => *now = Some(stage),
        Job::Trying { stage: now, .. } => *now = Some(stage),
        Job::Running(running) => match &mut running.scan {
            Some(scan) => scan.stage = Some(stage),
            None => running.stage = Some(stage),
        },
        Job::Merging(run) => run.stage = Some(stage),
        Job::Fetching { .. } | Job::Idle => {}
    }
}

fn opened(app: &mut App, opened: Opened) {
    // What is no plan at all is not offered again.
    if opened.found && (opened.plan.is_some() || opened.path.extension().is_some_and(|e| e == "toml")) {
        app.settings.remember(&opened.path);
        app.keep_settings();
    }
    let facts = &mut app.facts;
    facts.job = Job::Idle;
    facts.plan_path = Some(opened.path);
    facts.plan = opened.plan;
    facts.part = opened.part;
    facts.problems = opened.problems;
    app.lookout.lies_there(opened.scans.as_ref());
    let facts = &mut app.facts;
    facts.scans = opened.scans.map(|scans| paths(&scans));
    facts.run_problems.clear();
    facts.left_over = 0;
    facts.arrived.clear();
    facts.last_end = facts.last_end.take().filter(|_| facts.judged().is_some());
    run_first_scan(app);
    if std::mem::take(&mut app.resume_watch) && app.settings.watch {
        app.ask(Action::Run);
    }
}

/// The files alone.
pub(super) fn paths(scans: &Scans) -> Result<Vec<PathBuf>, Diagnostic> {
    scans.as_ref().map(|files| files.iter().map(|file| file.path.clone()).collect()).map_err(Clone::clone)
}

/// A plan that was just made is open: its scan is inspected.
fn run_first_scan(app: &mut App) {
    let Some((plan, scan)) = app.first_scan.take() else { return };
    if app.facts.plan_path.as_ref().is_some_and(|open| *open == plan || plan.ends_with(open)) {
        app.ask(Action::Inspect(vec![scan]));
    }
}

fn sequence(app: &mut App, event: worker::Event) {
    use worker::Event as Told;
    match event {
        Told::Problems(problems) => problems_told(app, problems),
        Told::Prepared { plan, part, .. } => {
            // A watch that begins anew by another plan has none of the troubles of before.
            app.facts.troubles = Troubles::default();
            app.facts.plan = Some(plan);
            app.facts.part = Some(part);
        }
        Told::Listed(scans) => {
            if app.facts.running().is_some_and(|running| running.named.is_empty()) {
                app.facts.scans = Some(Ok(scans));
            }
        }
        Told::Lost { result, scan } => lost(app, result, scan),
        Told::Started { index, of, waiting, scan } => {
            in_sight(app, &scan);
            let index = number(&app.facts, index);
            if let Job::Running(running) = &mut app.facts.job {
                running.of = of;
                running.waiting = waiting;
                running.scan = Some(RunningScan { index, path: scan, stage: None, since: Instant::now() });
            }
        }
        Told::Stage(stage) => enter(app, stage),
        Told::Finished { result, scan, files, again, took } => finished(app, result, scan, (files, again), took),
        Told::Watching { .. } => idle(app),
        Told::Waiting { scan, why, .. } => unfinished(app, scan, why),
        Told::Known { scan, .. } | Told::LeftAlone { scan } => {
            let facts = &mut app.facts;
            if facts.troubles.no_verdict_for().is_some_and(|unfinished| unfinished.scan == scan) {
                // It had taken the verdict from the part before, which does not get it back.
                facts.run_from = facts.parts.len();
            }
            facts.troubles.unfinished.retain(|unfinished| unfinished.scan != scan);
            idle(app);
        }
        Told::Queued(scans) => {
            scans.iter().for_each(|scan| in_sight(app, scan));
            if let Job::Running(running) = &mut app.facts.job {
                running.waiting = scans.len();
            }
        }
        Told::PlanLost(why) => {
            app.facts.troubles.plan = Some(why);
            idle(app);
        }
        Told::PlanBack => app.facts.troubles.plan = None,
        Told::FolderLost(why) => app.facts.troubles.folder = Some(why),
        Told::FolderBack => app.facts.troubles.folder = None,
        Told::ResultsLost(why) => {
            if let Job::Running(running) = &mut app.facts.job {
                let scan = running.scan.as_ref().map(|scan| scan.path.clone()).unwrap_or_default();
                running.waiting += 1;
                app.facts.troubles.results = Some((scan, why));
            }
            idle(app);
        }
        Told::ResultsBack => app.facts.troubles.results = None,
    }
}

/// What a run tells of plan, CAD and folders; what stands in the list since the plan was opened is no news.
fn problems_told(app: &mut App, problems: Vec<Diagnostic>) {
    let facts = &mut app.facts;
    for problem in problems {
        let is_news = !facts.problems.contains(&problem) && !facts.run_problems.contains(&problem);
        if is_news && (problem.severity == Severity::Error || facts.message.is_none()) {
            facts.message = Some(problem.clone());
        }
        if !facts.run_problems.contains(&problem) {
            facts.run_problems.push(problem);
        }
    }
}

/// A scan of a watched folder is in sight.
fn in_sight(app: &mut App, scan: &Path) {
    if app.facts.running().is_some_and(|running| running.watch)
        && let Some(Ok(scans)) = &mut app.facts.scans
        && !scans.iter().any(|known| known == scan)
    {
        scans.push(scan.to_path_buf());
    }
}

/// The number of the part at hand, from the place that its run gives it. In a watched folder numbers go on from one watch to the next, as the
/// lamps do.
fn number(facts: &Facts, place: usize) -> usize {
    if !facts.running().is_some_and(|running| running.watch) {
        return place;
    }
    facts.parts.iter().filter(|part| part.of.is_none()).map(|part| part.index).max().map_or(1, |last| last + 1)
}

/// No scan is at hand.
fn idle(app: &mut App) {
    if let Job::Running(running) = &mut app.facts.job {
        running.scan = None;
        running.stage = None;
    }
}

fn finished(
    app: &mut App,
    result: Arc<InspectionResult>,
    scan: Option<Arc<crate::scan::ConditionedScan>>,
    (files, again): (Vec<PathBuf>, bool),
    took: Duration,
) {
    app.settings.shift.count(&result);
    app.keep_settings();
    let (Some(plan), Some(part)) = (app.facts.plan.clone(), app.facts.part.clone()) else { return };
    let Job::Running(running) = &mut app.facts.job else { return };
    running.done += 1;
    let at_hand = running.scan.take();
    let mut index = at_hand.as_ref().map_or(running.done, |s| s.index);
    let scan_path = at_hand.map_or_else(|| PathBuf::from(&result.identity.scan_file), |s| s.path);
    if let Some(before) = app.facts.parts.iter().rev().find(|part| again && part.scan_path == scan_path) {
        index = before.index;
    }
    let unfinished = &mut app.facts.troubles.unfinished;
    unfinished.retain(|unfinished| unfinished.scan != scan_path);
    unfinished.iter_mut().for_each(|unfinished| unfinished.passed = true);
    let finished = FinishedPart { index, of: running.of, scan_path, result, scan, plan, part, files, again, took };
    if app.facts.push_part(finished) {
        app.view.part = app.view.part.map(|at| at.saturating_sub(1));
    }
}

/// A scan that is in sight but not whole. One that was told before keeps its time.
fn unfinished(app: &mut App, scan: PathBuf, why: Diagnostic) {
    let since = app.setup.clock.now();
    let unfinished = &mut app.facts.troubles.unfinished;
    match unfinished.iter_mut().find(|unfinished| unfinished.scan == scan) {
        Some(known) => known.why = why,
        None => unfinished.push(Unfinished { scan, why, since, passed: false, overdue: false }),
    }
    idle(app);
}

/// A part that was looked at, but of which nothing is on the disk.
fn lost(app: &mut App, result: Arc<InspectionResult>, scan: PathBuf) {
    let index = number(&app.facts, app.facts.running().map_or(1, |running| running.done + 1));
    if let Job::Running(running) = &mut app.facts.job
        && running.scan.is_none()
    {
        // Only those whose results could not be written were counted as waiting.
        if app.facts.troubles.results.is_some() && !app.facts.troubles.unfinished.iter().any(|u| u.scan == scan) {
            running.waiting = running.waiting.saturating_sub(1);
        }
        running.scan = Some(RunningScan { index, path: scan, stage: None, since: Instant::now() });
    }
    finished(app, result, None, (Vec::new(), false), Duration::ZERO);
}

fn ended(app: &mut App, mut summary: SequenceSummary, (scans, came): (Option<Scans>, Vec<PathBuf>)) {
    let facts = &mut app.facts;
    facts.left_over = facts.running().map_or(0, |r| r.of.map_or(r.waiting, |of| of.saturating_sub(r.done)));
    let nothing = summary.measured() + summary.refused + summary.unwritten == 0 && !summary.stopped;
    if summary.error.is_none() && nothing {
        // Problems of plan and CAD were told one by one.
        summary.error = facts.run_problems.iter().find(|p| p.severity == Severity::Error).cloned();
    }
    app.facts.job = Job::Idle;
    app.lookout.lies_there(scans.as_ref());
    app.facts.scans = scans.map(|scans| paths(&scans));
    app.facts.arrived = came;
    app.facts.troubles = Troubles::default();
    if let Some(error) = &summary.error {
        app.facts.message = Some(error.clone());
        let newest = app.facts.parts.last().map(|part| &part.result.outcome);
        if matches!(newest, Some(Outcome::Measured(_))) {
            // What was judged before it is no verdict of the part at hand.
            app.facts.run_from = app.facts.parts.len();
        }
    }
    app.facts.last_end = Some(summary);
    app.keep_settings();
}

/// A trial that somebody stopped leaves the last one.
fn tried(app: &mut App, version: u64, trial: Result<Box<worker::Trial>, worker::NoTrial>) {
    app.facts.job = Job::Idle;
    let Some(editing) = &mut app.facts.editing else { return };
    let told = match trial {
        Ok(trial) => Ok(Arc::from(trial)),
        Err(why) => match engineer::fault(&why) {
            Some(fault) => Err(fault),
            None => return,
        },
    };
    editing.trial = Some((version, told));
    app.engineer.lower = engineer::state::Lower::Trial;
    app.engineer.pane = engineer::Pane::Problems;
}

fn fetched(app: &mut App, at: usize, inspected: Inspected, took: Duration) {
    let Some(old) = app.facts.parts.get(at).cloned() else { return };
    // A file that was replaced meanwhile is another part: what was said of the old one stays.
    if inspected.result.identity.scan_sha256 != old.result.identity.scan_sha256 {
        let message = "the scan has changed since it was inspected; its points cannot be shown";
        app.facts.message = Some(Diagnostic::warning(message).in_file(&old.scan_path));
        return;
    }
    let part = FinishedPart {
        result: Arc::new(inspected.result),
        scan: inspected.scan.map(Arc::new),
        took: if old.took.is_zero() { took } else { old.took },
        ..(*old).clone()
    };
    app.facts.replace_part(at, part);
}
