//! What can be asked of the screen, carried out.

use super::facts::{Done, MergeRun, Merging};
use crate::diagnostic::{Diagnostic, Severity};
use crate::gui::action::Screen;
use crate::gui::app::App;
use crate::gui::bridge::{self, MergedEnd};
use crate::gui::engineer::lock::Lock;
use crate::gui::facts::Job;
use crate::gui::settings::Settings;
use crate::plan::merge::{self, Metric, ViewsOf, looks_like_merge, mask_lines, with_masks};
use crate::report::atomic;
use crate::stitch::StitchError;
use crate::worker::merge::{MergeEvent, MergeRequest};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What can be asked of the screen.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Another threshold for a metric, by its better direction; `None` takes the mask away.
    Mask(Metric, Option<f64>),
    /// The masks of the file again.
    Revert,
    /// Write the masks into the file.
    Keep,
    /// Copy the lines of `[mask]`.
    CopyLines,
    /// Merge and write.
    Merge,
    /// Stop the merge.
    Stop,
    /// Read the file and its views again.
    Reload,
}

/// Whether a file holds the settings of a merge; also broken ones.
pub(in crate::gui) fn is_merge(path: &Path) -> bool {
    /// More than any header takes.
    const HEAD: u64 = 1 << 16;
    let mut bytes = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut bytes));
    read.is_ok() && looks_like_merge(&String::from_utf8_lossy(&bytes))
}

/// Opens the settings of a merge.
pub(in crate::gui) fn open(app: &mut App, ctx: &egui::Context, path: PathBuf) {
    app.view.typed_path = None;
    if matches!(app.facts.job, Job::Merging(_)) {
        let help = "stop it first, then open the other file";
        app.facts.message = Some(Diagnostic::warning("a merge is running").with_help(help));
        return;
    }
    app.merge.forget();
    load(app, ctx, path);
    app.view.screen = Screen::Merge;
    app.facts.message = None;
}

/// Reads settings; what was merged by them before stays in sight.
fn load(app: &mut App, ctx: &egui::Context, path: PathBuf) {
    let bytes = std::fs::read(&path).unwrap_or_default();
    let loaded = merge::load(&path, ViewsOf::OwnFolder);
    app.settings.remember(&path);
    app.keep_settings();
    let done = app.facts.merging.take().filter(|before| before.path == path).and_then(|before| before.done);
    let merging = Merging { done, ..Merging::new(path, bytes, loaded) };
    app.merge_desk = Default::default();
    if let Some(plan) = &merging.plan {
        app.merge_desk.read(ctx, plan);
    }
    app.facts.merging = Some(merging);
}

/// Carries out a command.
pub(in crate::gui) fn command(app: &mut App, ctx: &egui::Context, command: Command) {
    let Some(merging) = &mut app.facts.merging else { return };
    match command {
        Command::Mask(metric, bound) => merging.set(metric, bound),
        Command::Revert => {
            merging.masks = merging.masks_of_file();
            merging.version += 1;
        }
        Command::CopyLines => ctx.copy_text(mask_lines(&merging.masks)),
        Command::Keep if is_locked(&app.settings, &app.lock, app.setup.clock.now()) => {
            let help = "unlock it on the engineer's screen first; the masks in the window stay as they are";
            let fault = Diagnostic::warning("a settings file is changed only while the engineer's lock is open");
            app.facts.message = Some(fault.in_file(&merging.path).with_help(help));
        }
        Command::Keep => {
            if let Err(fault) = keep(merging) {
                app.facts.message = Some(fault);
            }
        }
        Command::Reload => {
            let path = merging.path.clone();
            if !matches!(app.facts.job, Job::Merging(_)) {
                load(app, ctx, path);
            }
        }
        Command::Merge => begin(app),
        Command::Stop => {
            if let Job::Merging(run) = &mut app.facts.job {
                run.stopping = true;
                app.bridge.stop_now();
            }
        }
    }
}

/// Whether the engineer's lock keeps the settings file as it is. Where nobody set a password there is none.
pub(in crate::gui) fn is_locked(settings: &Settings, lock: &Lock, now: Instant) -> bool {
    settings.password.is_some() && !lock.is_open(now)
}

/// Writes the masks into the file, unless somebody else changed it.
fn keep(merging: &mut Merging) -> Result<(), Diagnostic> {
    let path = merging.path.clone();
    let on_disk = std::fs::read(&path).map_err(|fault| {
        let help = "check that the file is there and may be read; the masks in the window stay as they are";
        Diagnostic::error(format!("the settings cannot be read: {fault}")).in_file(&path).with_help(help)
    })?;
    if on_disk != *merging.bytes {
        let help = "open it again; the masks can be copied as text before that";
        let message = "the settings were changed by another program since they were opened";
        return Err(Diagnostic::error(message).in_file(&path).with_help(help));
    }
    let bytes = with_masks(&merging.bytes, &path, &merging.masks).map_err(|fault| *fault)?;
    atomic::write(&path, &bytes)?;
    let loaded = merge::check(&bytes, &path, ViewsOf::OwnFolder);
    merging.bytes = Arc::new(bytes);
    merging.problems = loaded.problems;
    if let Some(plan) = loaded.plan {
        merging.plan = Some(Arc::new(plan));
    }
    Ok(())
}

/// Why nothing can be merged now: the key of its words.
pub(in crate::gui) fn may_merge(job: &Job, merging: &Merging) -> Result<(), &'static str> {
    match job {
        Job::Merging(_) => return Err("merge.merging_already"),
        Job::Running(_) => return Err("merge.not_while_running"),
        Job::Opening { .. } | Job::Trying { .. } | Job::Fetching { .. } => return Err("merge.not_while_busy"),
        Job::Idle => {}
    }
    if merging.is_sound() { Ok(()) } else { Err("merge.settings_have_errors") }
}

fn begin(app: &mut App) {
    let Some(merging) = &mut app.facts.merging else { return };
    if may_merge(&app.facts.job, merging).is_err() {
        return;
    }
    // What is not kept in the file is merged all the same; the report tells the hash of what it was made by.
    let settings = match merging.is_changed() {
        false => None,
        true => match with_masks(&merging.bytes, &merging.path, &merging.masks) {
            Ok(bytes) => Some(bytes),
            Err(fault) => {
                merging.fault = Some(*fault);
                return;
            }
        },
    };
    (merging.fault, merging.stopped) = (None, false);
    let masks = merging.masks.clone();
    let request = MergeRequest { plan_path: merging.path.clone(), settings, ..MergeRequest::default() };
    app.facts.message = None;
    app.facts.job = Job::Merging(MergeRun {
        since: Instant::now(),
        masks,
        view: None,
        stage: None,
        of_stage: 0.0,
        stopping: false,
    });
    app.begin(bridge::Job::Merge(request));
}

/// Hears what a merge tells while it runs.
pub(in crate::gui) fn hear(app: &mut App, event: MergeEvent) {
    let Job::Merging(run) = &mut app.facts.job else { return };
    match event {
        MergeEvent::View { index, of, name } => run.view = Some((index, of, name)),
        MergeEvent::Stage(stage) => (run.stage, run.of_stage) = (Some(stage), 0.0),
        MergeEvent::Share(share) => run.of_stage = run.of_stage.max(share as f32),
        // It stands in the list when all is done.
        MergeEvent::Unusable(_) => {}
    }
}

/// Hears how a merge ended.
pub(in crate::gui) fn ended(app: &mut App, end: MergedEnd) {
    let Job::Merging(run) = std::mem::take(&mut app.facts.job) else { return };
    let Some(merging) = &mut app.facts.merging else { return };
    // What it tells beside its settings: that a run before was gone on with, or that this one can be.
    let is_news = |told: &&Diagnostic| told.severity == Severity::Warning && !merging.problems.contains(told);
    if let Some(news) = end.problems.iter().rfind(is_news) {
        app.facts.message = Some(news.clone());
    }
    match end.outcome {
        Ok(job) => {
            merging.fault = None;
            let points_out = job.result.points_out();
            merging.done = Some(Arc::new(Done { job, points_out, masks: run.masks, took: end.took }));
            app.merge.show_merged();
        }
        Err(None) => {
            let error = end.problems.iter().find(|problem| problem.severity == Severity::Error);
            merging.fault = error.cloned();
            merging.problems = end.problems;
            app.merge.show_result();
        }
        // What was merged before stays in sight.
        Err(Some(StitchError::Cancelled(_))) => {
            merging.stopped = true;
            app.merge.show_result();
        }
        Err(Some(StitchError::Fault(fault) | StitchError::CutOff(fault))) => {
            merging.fault = Some(*fault);
            app.merge.show_result();
        }
    }
}
