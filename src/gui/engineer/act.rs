//! What the engineer asked for is carried out here. Locked, nothing changes the plan.

use super::dialogs::Dialogs;
use super::editing::Edit;
use super::lock::{Fault, Secret};
use crate::diagnostic::Diagnostic;
use crate::gui::app::App;
use crate::gui::bridge;
use crate::gui::facts::Job;
use crate::plan::document::Document;
use crate::worker::plan_file::{self, Overwrite, SaveError};
use std::path::PathBuf;
use std::time::Instant;

/// What the engineer can ask for beside edits.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// The first password, typed twice.
    SetPassword(Secret, Secret),
    /// The password.
    Unlock(Secret),
    /// Lock at once.
    LockNow,
    /// What was not saved when the program last ended: take it, or forget it.
    Recover(bool),
    /// The dialog for saving, open or shut.
    AskToSave(bool),
    /// Save as a revision.
    Save {
        /// The new revision.
        revision: String,
        /// Why.
        reason: String,
        /// Another name for the plan's file.
        path: Option<PathBuf>,
        /// What may be overwritten.
        overwrite: Overwrite,
    },
    /// Give up what was not saved, and read the file that lies there now.
    TakeTheirs,
    /// Inspect a scan with the plan as it stands.
    Try,
    /// Stop trying.
    StopTrying,
    /// Leave, whatever was not saved; it is offered when the plan is opened again.
    LeaveLater,
    /// Leave and forget what was not saved.
    LeaveForgetting,
    /// Stay.
    Stay,
}

/// Changes the plan that is edited. A new row is shown.
pub(in crate::gui) fn edit(app: &mut App, edit: &Edit) {
    if !app.lock.is_open(app.setup.clock.now()) {
        return;
    }
    // Ctrl+Z in the field of a dialog is not meant for the plan behind it.
    let in_dialog = app.engineer.saving.is_some() || app.engineer.dialogs.is_open();
    if in_dialog && matches!(edit, Edit::Undo | Edit::Redo) {
        return;
    }
    let Some(editing) = app.facts.editing.as_mut().filter(|e| e.recovery.is_none()) else { return };
    match (editing.apply(edit), edit) {
        (Ok(Some(row)), Edit::AddRows(list, _)) => app.engineer.choose(*list, row),
        (Ok(_), _) => {}
        (Err(fault), _) => {
            app.facts.message = Some(Diagnostic::warning(fault.to_string()).with_help(fault.help()));
        }
    }
    app.engineer.after(edit, editing);
}

/// Carries out a command.
pub(in crate::gui) fn command(app: &mut App, ctx: &egui::Context, command: Command) {
    let now = app.setup.clock.now();
    match command {
        Command::SetPassword(one, two) => set_password(app, one, two),
        Command::Unlock(secret) => unlock(app, secret, now),
        Command::LockNow => app.lock.lock(),
        Command::StopTrying => app.bridge.stop_now(),
        Command::Stay => app.view.leaving = None,
        Command::LeaveLater => leave(app, ctx, false),
        _ if !app.lock.is_open(now) => {}
        Command::LeaveForgetting => leave(app, ctx, true),
        Command::Recover(take) => recover(app, take),
        Command::AskToSave(open) => app.engineer.ask_to_save(app.facts.editing.as_ref().filter(|_| open)),
        Command::Save { revision, reason, path, overwrite } => save(app, &revision, &reason, path, overwrite),
        Command::TakeTheirs => take_theirs(app),
        Command::Try => super::trial::begin(app),
    }
}

fn set_password(app: &mut App, one: Secret, two: Secret) {
    if app.settings.password.is_some() || app.lock.busy {
        return;
    }
    app.lock.fault = match () {
        () if !one.is_long_enough() => Some(Fault::Short),
        () if one != two => Some(Fault::Different),
        () => None,
    };
    if app.lock.fault.is_none() {
        app.lock.busy = true;
        app.desk.hash_password(one);
    }
}

fn unlock(app: &mut App, secret: Secret, now: Instant) {
    if app.lock.busy || app.lock.wait(now).is_some() {
        return;
    }
    if let Some(hash) = app.settings.password.clone() {
        app.lock.fault = None;
        app.lock.busy = true;
        app.desk.verify(secret, hash);
    }
}

fn recover(app: &mut App, take: bool) {
    let Some(editing) = &mut app.facts.editing else { return };
    let Some(recovery) = editing.recovery.take() else { return };
    if take {
        plan_file::recover(&mut editing.document, &recovery);
        editing.version += 1;
    } else {
        // An autosave of a plan without unsaved text removes what was kept.
        app.desk.autosave(editing.version, editing.document.snapshot());
    }
}

/// The plan as it would be saved, with its new revision noted in it.
fn revised(document: &Document, revision: &str, reason: &str, path: Option<PathBuf>) -> Result<Document, String> {
    let mut copy = document.snapshot();
    let date = jiff::Zoned::now().date().to_string();
    let words = |fault: crate::plan::document::EditError| format!("{fault}; {}", fault.help());
    copy.revise(revision.trim(), &date, reason.trim()).map_err(words)?;
    match path {
        Some(path) => copy.copy_to(&path).map_err(words),
        None => Ok(copy),
    }
}

fn save(app: &mut App, revision: &str, reason: &str, path: Option<PathBuf>, overwrite: Overwrite) {
    let Some(editing) = &mut app.facts.editing else { return };
    if editing.saving || editing.errors() > 0 {
        return;
    }
    match revised(&editing.document, revision, reason, path) {
        Ok(document) => {
            editing.saving = true;
            app.engineer.save_fault = None;
            app.desk.save(document, overwrite);
        }
        Err(fault) => app.engineer.save_fault = Some(SaveError::Failed(Box::new(Diagnostic::error(fault)))),
    }
}

/// A plan was saved: the operator's is read again.
pub(super) fn saved(app: &mut App, document: Document, saved: Result<(), SaveError>) {
    let Some(editing) = &mut app.facts.editing else { return };
    editing.saving = false;
    match saved {
        Ok(()) => {
            let elsewhere = document.path() != editing.document.path();
            if elsewhere {
                app.desk.discard(editing.document.path().to_path_buf());
            }
            editing.was_saved(document);
            app.engineer.dialogs = Dialogs::default();
            app.engineer.saving = None;
            app.engineer.save_fault = None;
            let path = editing.document.path().to_path_buf();
            app.facts.plan_path = Some(path.clone());
            match app.view.leaving.take() {
                Some(leaving) => app.ask(leaving),
                None => reload(app, path),
            }
        }
        Err(fault) => app.engineer.save_fault = Some(fault),
    }
}

/// Reads the plan of the operator again; while a sequence runs, when that has ended.
pub(in crate::gui) fn reload(app: &mut App, path: PathBuf) {
    if let Job::Running(running) = &mut app.facts.job {
        app.reload = Some(path);
        let message = if running.watch {
            // Parts from now on are judged by what was saved: the watch begins anew.
            running.stopping = true;
            app.bridge.stop_after_part();
            app.resume_watch = true;
            "the plan was saved; the watch begins anew by it after the part at hand"
        } else {
            "the plan was saved; the sequence that runs was judged by the plan as it was, and stops"
        };
        app.facts.message = Some(Diagnostic::warning(message));
        return;
    }
    if let Job::Merging(_) = app.facts.job {
        app.reload = Some(path);
        return;
    }
    app.reload = None;
    app.view.point = None;
    app.facts.job = Job::Opening { path: path.clone(), stage: None };
    app.begin(bridge::Job::Open(path));
}

fn take_theirs(app: &mut App) {
    let Some(editing) = app.facts.editing.take() else { return };
    let path = editing.document.path().to_path_buf();
    app.desk.discard(path.clone());
    app.engineer.saving = None;
    app.engineer.save_fault = None;
    reload(app, path);
}

/// Goes where somebody wanted to go before the unsaved work was in the way.
fn leave(app: &mut App, ctx: &egui::Context, forget: bool) {
    let Some(leaving) = app.view.leaving.take() else { return };
    if let Some(editing) = app.facts.editing.take() {
        if forget {
            app.desk.discard(editing.document.path().to_path_buf());
        } else if let Err(fault) = plan_file::autosave(&editing.document) {
            // Nothing is left before it is kept.
            app.facts.message = Some(*fault);
            app.facts.editing = Some(editing);
            return;
        }
    }
    crate::gui::perform::action(app, ctx, leaving);
}
