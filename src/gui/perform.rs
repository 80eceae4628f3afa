//! What was asked for is carried out here, after everything is drawn.

use super::action::{Action, Screen};
use super::app::App;
use super::bridge;
use super::dialog;
use super::earlier;
use super::engineer;
use super::facts::{Facts, Job, Running, Wanted};
use super::merge;
use super::new_plan;
use crate::diagnostic::{Diagnostic, Severity};
use crate::worker::{SequenceRequest, WatchSettings};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Carries out one action.
pub(super) fn action(app: &mut App, ctx: &egui::Context, action: Action) {
    match action {
        Action::Show(screen) => show(app, screen),
        Action::Open(path) => open(app, ctx, path),
        Action::AskForPlan => app.dialog.ask(ctx, app.facts.plan_path.as_deref()),
        Action::TypePath(open) => app.view.typed_path = open.then(String::new),
        Action::Run => run(app, Vec::new()),
        Action::Inspect(scans) => run(app, scans),
        Action::Say(diagnostic) => app.facts.message = Some(diagnostic),
        Action::Stop => stop(app),
        Action::Watch(on) => {
            app.settings.watch = on;
            // Who means to watch sees what lies there now.
            app.lookout.look_now();
        }
        Action::ChoosePart(part) => choose_part(app, part),
        Action::ChoosePoint(point) => app.view.point = point,
        Action::Fetch(at) => fetch(app, at),
        Action::ChooseEarlier(at) => earlier::choose(app, at),
        Action::InspectEarlier(at) => earlier::inspect_again(app, at),
        Action::Theme(choice) => {
            app.settings.theme = choice;
            app.keep_settings();
            ctx.set_theme(choice.preference());
        }
        Action::Scale(scale) => {
            app.settings.scale = scale;
            app.keep_settings();
        }
        Action::Language(language) => {
            app.settings.language = language;
            app.keep_settings();
        }
        Action::Help(open) => app.view.help = open,
        Action::Takt(takt) => set_takt(app, takt),
        Action::NewShift => {
            app.settings.shift = Default::default();
            app.keep_settings();
        }
        Action::Dismiss => app.facts.message = None,
        Action::Edit(edit) => engineer::edit(app, &edit),
        Action::Engineer(command) => engineer::command(app, ctx, command),
        Action::Close => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
        Action::Merge(command) => merge::command(app, ctx, command),
        Action::NewPlan(command) => new_plan::act::command(app, ctx, command),
        Action::FullScreen => {
            let full = ctx.input(|i| i.viewport().fullscreen.unwrap_or(false));
            ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
        }
    }
}

impl App {
    /// The plan of the first frame: the one that was named, else the last one, else the demo.
    /// Beside a merge that was named, the last plan is open, too.
    pub(super) fn open_first(&mut self, ctx: &egui::Context) {
        if let Some(path) = self.setup.plan.clone() {
            if !merge::is_merge(&path) {
                return open(self, ctx, path);
            }
            open(self, ctx, path);
        }
        let is_plan = |path: &PathBuf| path.is_file() && !merge::is_merge(path);
        let last = self.settings.recent.iter().map(|r| r.path.clone()).find(is_plan);
        let demo = || self.setup.data_folder.as_deref().map(|folder| crate::demo::unpack(&folder.join("demo")));
        match last.map(Ok).or_else(demo) {
            Some(Ok(path)) => {
                open(self, ctx, path);
                // What was asked for stands before what is open beside it.
                if self.facts.merging.is_some() {
                    self.view.screen = Screen::Merge;
                }
            }
            Some(Err(fault)) => self.facts.message = Some(fault),
            None => {}
        }
    }
}

fn open(app: &mut App, ctx: &egui::Context, path: PathBuf) {
    if merge::is_merge(&path) {
        let path = std::path::absolute(&path).unwrap_or(path);
        return merge::open(app, ctx, path);
    }
    if matches!(app.facts.job, Job::Merging(_)) {
        let help = "stop it first, then open the plan";
        app.facts.message = Some(Diagnostic::warning("a merge is running").with_help(help));
        return;
    }
    if app.facts.running().is_some() {
        let message = "a sequence is running";
        let help = "stop it first, then open the other plan";
        app.facts.message = Some(Diagnostic::warning(message).with_help(help));
        return;
    }
    if app.new_plan.is_some() {
        let message = "a new plan is being made";
        let help = "finish it or cancel it first, then open the other plan";
        app.facts.message = Some(Diagnostic::warning(message).with_help(help));
        return;
    }
    let path = std::path::absolute(&path).unwrap_or(path);
    // What is at hand is not given up for a name that leads nowhere.
    if app.facts.plan_path.is_some() && !path.is_file() {
        let message = Diagnostic::warning("there is no such file").in_file(&path);
        app.facts.message = Some(message.with_help("the plan at hand stays open; look for a slip in the path"));
        app.view.typed_path = None;
        return;
    }
    let other = dialog::for_files(vec![path.clone()], app.facts.plan_path.is_none());
    if matches!(other, Action::NewPlan(_) | Action::Inspect(_)) {
        app.view.typed_path = None;
        return app.ask(other);
    }
    if app.facts.editing.as_ref().is_some_and(|editing| editing.document.is_modified()) {
        app.view.typed_path = None;
        app.view.leaving = Some(Action::Open(path));
        return;
    }
    app.engineer.forget();
    app.reload = None;
    app.facts = Facts {
        plan_path: Some(path.clone()),
        job: Job::Opening { path: path.clone(), stage: None },
        merging: app.facts.merging.take(),
        ..Facts::default()
    };
    if app.view.screen == Screen::Merge {
        app.view.screen = Screen::Operator;
    }
    app.view.part = None;
    app.view.earlier = None;
    app.view.point = None;
    app.view.typed_path = None;
    app.begin(bridge::Job::Open(path));
}

/// Whether a sequence can be begun; else why not, as a key among the texts.
pub(super) fn may_run(facts: &Facts) -> Result<&Path, &'static str> {
    match &facts.job {
        Job::Opening { .. } => return Err("operator.not_while_opening"),
        Job::Running(_) => return Err("operator.running_already"),
        Job::Merging(_) => return Err("operator.not_while_merging"),
        Job::Idle | Job::Fetching { .. } | Job::Trying { .. } => {}
    }
    if facts.problems.iter().any(|p| p.severity == Severity::Error) {
        return Err("operator.plan_has_errors");
    }
    match (&facts.plan, &facts.plan_path) {
        (Some(_), Some(path)) => Ok(path),
        _ => Err("operator.no_plan"),
    }
}

/// Runs the scans named; none = all of the plan, or its folder watched.
fn run(app: &mut App, scans: Vec<PathBuf>) {
    let path = match may_run(&app.facts) {
        Ok(path) => path.to_path_buf(),
        Err("operator.running_already" | "operator.not_while_opening") => return,
        // It may have been mended meanwhile.
        Err("operator.plan_has_errors") if scans.is_empty() => {
            if let Some(path) = app.facts.plan_path.clone() {
                engineer::reload(app, path);
            }
            return;
        }
        Err(why) => {
            let why = super::text::Words::of(app.settings.language).text(why);
            app.facts.message = Some(Diagnostic::warning(why));
            return;
        }
    };
    let watch = app.settings.watch && scans.is_empty();
    let of = match &app.facts.scans {
        _ if !scans.is_empty() => Some(scans.len()),
        Some(Ok(scans)) if !watch => Some(scans.len()),
        _ => None,
    };
    let named = scans.clone();
    let watched = watch.then(WatchSettings::default);
    let request = SequenceRequest { plan_path: path, scans, watch: watched, ..SequenceRequest::default() };
    app.facts.message = None;
    app.facts.last_end = None;
    app.facts.run_from = app.facts.parts.len();
    app.facts.run_problems.clear();
    app.facts.left_over = 0;
    app.facts.arrived.clear();
    let waiting = of.unwrap_or(0);
    let since = Instant::now();
    app.facts.job =
        Job::Running(Running { watch, since, scan: None, stage: None, done: 0, named, of, waiting, stopping: false });
    app.view.part = None;
    app.view.earlier = None;
    app.begin(bridge::Job::Run(request));
}

fn stop(app: &mut App) {
    let Job::Running(running) = &mut app.facts.job else { return };
    if std::mem::replace(&mut running.stopping, true) || running.scan.is_none() {
        app.bridge.stop_now();
    } else {
        app.bridge.stop_after_part();
    }
}

/// Who comes back to the results finds the newest part, unless a lamp led there.
fn show(app: &mut App, screen: Screen) {
    if app.view.screen == Screen::Results && screen != Screen::Results {
        app.view.part = None;
        app.view.earlier = None;
    }
    app.view.screen = screen;
}

fn choose_part(app: &mut App, part: Option<usize>) {
    app.view.part = part.filter(|k| *k < app.facts.parts.len());
    app.view.earlier = None;
    if app.view.screen == Screen::Operator && part.is_some() {
        app.view.screen = Screen::Results;
    }
}

fn fetch(app: &mut App, at: usize) {
    let Some(part) = app.facts.parts.get(at).cloned() else { return };
    if !matches!(app.facts.job, Job::Idle) || !part.is_thin() {
        return;
    }
    app.facts.job = Job::Fetching { wanted: Wanted::Part(at) };
    app.begin(bridge::Job::Fetch {
        wanted: Wanted::Part(at),
        scan: part.scan_path.clone(),
        plan: part.plan.clone(),
        part: part.part.clone(),
    });
}

fn set_takt(app: &mut App, takt: Option<f64>) {
    let Some(path) = &app.facts.plan_path else { return };
    if let Some(recent) = app.settings.recent.iter_mut().find(|r| r.path == *path) {
        recent.takt_s = takt.filter(|t| t.is_finite() && *t > 0.0);
        app.keep_settings();
    }
}
