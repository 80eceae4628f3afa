//! What the assistant asked for is carried out here, after everything is drawn.

use super::Assistant;
use super::state::Step;
use crate::gui::action::{Action, Screen};
use crate::gui::app::App;
use crate::gui::engineer::Editing;
use crate::plan::document::EditError;
use crate::worker::plan_file::{Overwrite, SaveError, discard_autosave, save_plan};
use std::path::{Path, PathBuf};

/// What can be asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Command {
    /// Begin, with files that are known already.
    Start {
        /// The CAD.
        cad: Option<PathBuf>,
        /// A scan.
        scan: Option<PathBuf>,
    },
    /// Another step, forwards.
    Go(Step),
    /// Give up.
    Cancel,
    /// Save the plan and inspect the scan.
    Run,
    /// The same, in the place of another file of that name.
    Replace(PathBuf),
    /// The plan lies on the disk.
    Saved(PathBuf),
}

/// Carries out a command.
pub(in crate::gui) fn command(app: &mut App, ctx: &egui::Context, command: Command) {
    // Locked, nothing is made; what was begun waits.
    let open = app.lock.is_open(app.setup.clock.now());
    match command {
        Command::Go(_) | Command::Run | Command::Replace(_) if !open => {}
        Command::Start { cad, scan } => start(app, ctx, cad, scan),
        Command::Go(step) => go(app, step),
        Command::Cancel => cancel(app),
        Command::Run => run(app, ctx, None),
        Command::Replace(file) => run(app, ctx, Some(&file)),
        Command::Saved(path) => saved(app, path),
    }
}

fn start(app: &mut App, ctx: &egui::Context, cad: Option<PathBuf>, scan: Option<PathBuf>) {
    let unsaved = app.facts.editing.as_ref().is_some_and(|editing| editing.document.is_modified());
    if app.new_plan.is_none() && unsaved {
        app.view.leaving = Some(Action::NewPlan(Command::Start { cad, scan }));
        return;
    }
    app.view.screen = Screen::Engineer;
    match &mut app.new_plan {
        // One is being made already: the file goes into its step.
        Some(assistant) => assistant.give(ctx, cad.as_deref(), scan.as_deref()),
        None => {
            app.facts.editing = None;
            app.engineer.forget();
            app.new_plan = Some(Assistant::new(ctx, cad.as_deref(), scan.as_deref()));
        }
    }
}

/// The plan is made, or brought up to date, on the way from the first three steps to the others.
fn go(app: &mut App, step: Step) {
    let Some(assistant) = &mut app.new_plan else { return };
    if assistant.entries.step <= Step::Sheet && step > Step::Sheet {
        match make(assistant, &mut app.facts.editing) {
            Err(fault) => {
                assistant.fault = Some(format!("{fault}; {}", fault.help()));
                return;
            }
            Ok(()) if app.facts.editing.is_none() => return,
            Ok(()) => {}
        }
    }
    assistant.go(step);
}

/// Makes the plan of the first three steps, or brings it up to date.
fn make(assistant: &mut Assistant, editing: &mut Option<Editing>) -> Result<(), EditError> {
    match editing.as_mut().filter(|_| assistant.begun) {
        Some(editing) => {
            if let Some(document) = assistant.entries.document(Some(editing.document.snapshot()))? {
                editing.replace(document);
            }
        }
        None => {
            *editing = assistant.entries.document(None)?.map(|document| Editing::new(document, None));
            assistant.begun = editing.is_some();
        }
    }
    Ok(())
}

/// Gives up; the plan that was open before is edited again.
fn cancel(app: &mut App) {
    if let Some(assistant) = app.new_plan.take()
        && assistant.begun
        && let Some(editing) = app.facts.editing.take()
    {
        discard_autosave(editing.document.path());
    }
    app.engineer.forget();
}

/// Saves the plan under its name; no other file is written over but the one that a person said so of.
fn run(app: &mut App, ctx: &egui::Context, replaced: Option<&Path>) {
    let (Some(assistant), Some(editing)) = (&mut app.new_plan, &app.facts.editing) else { return };
    if assistant.writing.is_busy() {
        return;
    }
    match assistant.entries.to_save(&editing.document) {
        Err(fault) => assistant.fault = Some(format!("{fault}; {}", fault.help())),
        Ok(mut document) => {
            assistant.fault = None;
            assistant.taken = None;
            let draft = editing.document.path().to_path_buf();
            let overwrite = if replaced == Some(document.path()) { Overwrite::Anything } else { Overwrite::Own };
            assistant.writing.start(ctx, move || {
                let path = document.path().to_path_buf();
                match save_plan(&mut document, overwrite) {
                    Ok(()) => {
                        discard_autosave(&draft);
                        Ok(path)
                    }
                    Err(SaveError::ChangedByOthers(..)) => Err(None),
                    Err(SaveError::Failed(told)) => Err(Some(told.in_a_row())),
                }
            });
        }
    }
}

/// The plan is there: it becomes the operator's, and its first scan is inspected when it is open.
fn saved(app: &mut App, path: PathBuf) {
    let Some(assistant) = app.new_plan.take() else { return };
    app.facts.editing = None;
    app.engineer.forget();
    app.first_scan = Some((path.clone(), assistant.entries.scan.file()));
    app.view.screen = Screen::Operator;
    app.ask(Action::Open(path));
}
