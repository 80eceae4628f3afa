//! What the worker tells becomes fact here and nowhere else.

use super::action::Action;
use super::app::App;
use super::bridge::{Event, Opened, Scans};
use super::engineer;
use super::facts::{FinishedPart, Job, RunningScan, Troubles};
use super::settings::ShiftCounts;
use crate::diagnostic::{Diagnostic, Severity};
use crate::inspect::{Inspected, InspectionResult, Outcome, Verdict};
use crate::run::Stage;
use crate::worker::{self, SequenceSummary};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Takes one event.
pub(super) fn event(app: &mut App, event: Event) {
    match event {
        Event::Stage(stage) => enter(app, stage),
        Event::Opened(opened) => self::opened(app, *opened),
        Event::Sequence(event) => sequence(app, event),
        Event::Ended(summary, scans) => ended(app, summary, scans),
        Event::Fetched { at, inspected, took } => fetched(app, at, *inspected, took),
        Event::Tried { version, trial } => tried(app, version, trial),
        Event::Failed(fault) => {
            app.facts.job = Job::Idle;
            app.facts.message = Some(fault);
        }
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
        Job::Fetching { .. } | Job::Idle => {}
    }
}

fn opened(app: &mut App, opened: Opened) {
    if opened.found {
        app.settings.remember(&opened.path);
        app.keep_settings();
    }
    let facts = &mut app.facts;
    facts.job = Job::Idle;
    facts.plan_path = Some(opened.path);
    facts.plan = opened.plan;
    facts.part = opened.part;
    facts.problems = opened.problems;
    facts.scans = opened.scans;
    run_first_scan(app);
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
            app.facts.plan = Some(plan);
            app.facts.part = Some(part);
        }
        Told::Started { index, of, waiting, scan } => {
            app.facts.troubles.waiting.take_if(|(waiting, _)| *waiting == scan);
            if let Job::Running(running) = &mut app.facts.job {
                running.of = of;
                running.waiting = waiting;
                running.scan = Some(RunningScan { index, path: scan, stage: None, since: Instant::now() });
            }
        }
        Told::Stage(stage) => enter(app, stage),
        Told::Finished { result, scan, files, took } => finished(app, result, scan, files, took),
        Told::Watching { .. } => idle(app),
        Told::Waiting { scan, why } => {
            app.facts.troubles.waiting = Some((scan, why));
            idle(app);
        }
        Told::Known { .. } => idle(app),
        Told::FolderLost(why) => app.facts.troubles.folder = Some(why),
        Told::FolderBack => app.facts.troubles.folder = None,
        Told::ResultsLost(why) => {
            app.facts.troubles.results = Some(why);
            idle(app);
        }
        Told::ResultsBack => app.facts.troubles.results = None,
    }
}

/// Problems of plan and CAD stand in the list already, from when the plan was opened; others are news.
fn problems_told(app: &mut App, problems: Vec<Diagnostic>) {
    for problem in problems {
        if app.facts.problems.contains(&problem) {
            continue;
        }
        if problem.severity == Severity::Error || app.facts.message.is_none() {
            app.facts.message = Some(problem.clone());
        }
        app.facts.problems.push(problem);
    }
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
    files: Vec<PathBuf>,
    took: Duration,
) {
    count(&mut app.settings.shift, &result.outcome);
    app.facts.troubles.results = None;
    let (Some(plan), Some(part)) = (app.facts.plan.clone(), app.facts.part.clone()) else { return };
    let Job::Running(running) = &mut app.facts.job else { return };
    running.done += 1;
    let at_hand = running.scan.take();
    let index = at_hand.as_ref().map_or(running.done, |s| s.index);
    let scan_path = at_hand.map_or_else(|| PathBuf::from(&result.identity.scan_file), |s| s.path);
    let finished = FinishedPart { index, of: running.of, scan_path, result, scan, plan, part, files, took };
    if app.facts.push_part(finished) {
        app.view.part = app.view.part.map(|at| at.saturating_sub(1));
    }
}

fn count(shift: &mut ShiftCounts, outcome: &Outcome) {
    match outcome {
        Outcome::Refused(_) => shift.refused += 1,
        Outcome::Measured(inspection) => match inspection.verdict {
            Verdict::Pass => shift.pass += 1,
            Verdict::Undecided => shift.undecided += 1,
            Verdict::NotMeasured => shift.incomplete += 1,
            Verdict::Fail => shift.fail += 1,
        },
    }
}

fn ended(app: &mut App, summary: SequenceSummary, scans: Option<Scans>) {
    app.facts.job = Job::Idle;
    app.facts.scans = scans;
    app.facts.troubles = Troubles::default();
    if let Some(error) = &summary.error {
        app.facts.message = Some(error.clone());
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
}

fn fetched(app: &mut App, at: usize, inspected: Inspected, took: Duration) {
    app.facts.job = Job::Idle;
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
