//! What is done between two frames: the desk is heard, the lock locks itself, edits are checked and kept from getting lost.

use super::act;
use super::desk::{CheckOrder, Told};
use super::editing::{Autosave, Editing, Seen};
use super::lock::Fault;
use crate::gui::action::Screen;
use crate::gui::app::App;
use crate::gui::facts::Job;
use std::time::{Duration, Instant};

/// Who types on is not checked at every letter.
const SETTLED: Duration = Duration::from_millis(300);
/// How long an edit may be the only copy.
const KEPT_AFTER: Duration = Duration::from_secs(4);

/// One look at everything.
pub(in crate::gui) fn tick(app: &mut App, ctx: &egui::Context) {
    let now = app.setup.clock.now();
    for told in app.desk.told() {
        hear(app, told, now);
    }
    guard(app, ctx, now);
    open_for_editing(app, now);
    if let Some(editing) = &mut app.facts.editing {
        editing.refresh();
    }
    check(app, ctx, now);
    keep(app, ctx, now);
}

/// The lock: it stays open as long as somebody is there.
fn guard(app: &mut App, ctx: &egui::Context, now: Instant) {
    if ctx.input(|i| !i.events.is_empty()) {
        app.lock.touch(now);
    }
    if app.view.screen == Screen::Engineer
        && let Some(left) = app.lock.left(now).into_iter().chain(app.lock.wait(now)).min()
    {
        // The time that is left is told by the second.
        ctx.request_repaint_after(left.min(Duration::from_secs(1)));
    }
}

/// The plan at hand, once somebody unlocked who wants to edit it.
fn open_for_editing(app: &mut App, now: Instant) {
    let wanted = app.view.screen == Screen::Engineer && app.lock.is_open(now) && app.new_plan.is_none();
    let idle = !matches!(app.facts.job, Job::Opening { .. });
    if let (true, true, None, None, Some(path)) =
        (wanted, idle, &app.facts.editing, &app.engineer.opening, &app.facts.plan_path)
    {
        app.engineer.opening = Some(path.clone());
        app.desk.open(path.clone());
    }
}

/// Asks for a check when nobody has typed for a moment.
fn check(app: &mut App, ctx: &egui::Context, now: Instant) {
    let Some(editing) = &mut app.facts.editing else { return };
    if editing.recovery.is_some() {
        return;
    }
    let draft = app.engineer.draft.as_ref().map(|draft| (draft.list, draft.spec.clone()));
    let changed = editing.seen.as_ref().is_none_or(|seen| seen.version != editing.version || seen.draft != draft);
    if changed {
        // The first look is at once.
        let since = if editing.seen.is_some() { now } else { now.checked_sub(SETTLED).unwrap_or(now) };
        editing.seen = Some(Seen { version: editing.version, draft: draft.clone(), since });
        editing.serial += 1;
        editing.asked = false;
    }
    let Some(seen) = editing.seen.as_ref().filter(|_| !editing.asked) else { return };
    let waited = now.saturating_duration_since(seen.since);
    if waited < SETTLED {
        ctx.request_repaint_after(SETTLED - waited);
        return;
    }
    editing.asked = true;
    let (serial, document) = (editing.serial, editing.document.snapshot());
    app.desk.check(CheckOrder { serial, document, draft, known: editing.cad() });
}

/// Keeps what is not saved beside the plan.
fn keep(app: &mut App, ctx: &egui::Context, now: Instant) {
    let Some(editing) = app.facts.editing.as_mut().filter(|e| e.recovery.is_none()) else { return };
    let kept = editing.autosave.version == editing.version;
    if kept || editing.autosave.under_way {
        return;
    }
    let since = *editing.autosave.since.get_or_insert(now);
    let waited = now.saturating_duration_since(since);
    if waited < KEPT_AFTER {
        ctx.request_repaint_after(KEPT_AFTER - waited);
        return;
    }
    editing.autosave.under_way = true;
    app.desk.autosave(editing.version, editing.document.snapshot());
}

fn hear(app: &mut App, told: Told, now: Instant) {
    match told {
        Told::Hashed(Ok(hash)) => {
            app.settings.password = Some(hash);
            app.keep_settings();
            app.lock.open(now);
        }
        Told::Hashed(Err(fault)) => {
            app.lock.busy = false;
            app.lock.fault = Some(Fault::Failed(fault));
        }
        Told::Verified(true) => app.lock.open(now),
        Told::Verified(false) => app.lock.refuse(now),
        Told::Saved(document, saved) => act::saved(app, *document, saved),
        Told::Failed(fault) => app.facts.message = Some(fault),
        Told::Opened(path, opened) => {
            if app.engineer.opening.take().as_ref() != Some(&path) || app.facts.plan_path.as_ref() != Some(&path) {
                return;
            }
            match opened {
                Ok(opened) => {
                    let mut editing = Editing::new(opened.document, opened.recovery);
                    editing.know_cad(&app.facts);
                    app.engineer.begin(&editing);
                    app.facts.editing = Some(editing);
                }
                Err(fault) => app.engineer.unreadable = Some(*fault),
            }
        }
        about_the_plan => {
            if let Some(editing) = &mut app.facts.editing {
                hear_of_plan(editing, about_the_plan, now);
            }
        }
    }
}

/// What is told of the plan at hand; answers to what was asked before the last change are dropped here.
fn hear_of_plan(editing: &mut Editing, told: Told, now: Instant) {
    match told {
        Told::Autosaved(version, result) => {
            editing.autosave = match result {
                Ok(()) => Autosave { version, at: Some(now), ..Autosave::default() },
                // Tried again with the next edit.
                Err(fault) => Autosave { version, fault: Some(*fault), ..editing.autosave.clone() },
            };
            editing.autosave.under_way = false;
            editing.autosave.since = None;
        }
        Told::Prepared(cad) => {
            editing.cad_asked = Some(cad.asked);
            (editing.part, editing.picker) = (Some(cad.part), cad.picker);
        }
        // What the CAD told stays in sight until it is looked at again.
        Told::Checked { serial, whole, problems }
            if serial == editing.serial && (whole || editing.checked.is_none()) =>
        {
            editing.problems = problems;
            let version = editing.seen.as_ref().map(|seen| seen.version);
            editing.checked = version.filter(|_| whole).or(editing.checked);
        }
        Told::Foretold(serial, choices) if serial == editing.serial => editing.choices = choices,
        _ => {}
    }
}
