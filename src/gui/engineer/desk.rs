//! What must not hold a frame up while a plan is edited: files, password hashes, checks. Two threads, so that no check of a large
//! CAD keeps a plan from being saved.

use crate::diagnostic::{Diagnostic, ReadError};
use crate::inspect::Foretold;
use crate::part::Part;
use crate::part::propose::Picker;
use crate::plan::document::{Document, EditError, FieldValue, List, PlanProblem, PointSpec};
use crate::run::{CancelToken, RunContext};
use crate::worker::plan_file::{Opened, Overwrite, SaveError, autosave, discard_autosave, open_plan, save_plan};
use crate::worker::{CadAsked, check_document, foretell_document, prepare_document};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use super::lock::Secret;

/// A CAD that was prepared, with what was asked for.
#[derive(Debug, Clone)]
pub struct Cad {
    /// What of the plan it was made for.
    pub asked: CadAsked,
    /// It.
    pub part: Arc<Part>,
    /// What clicks on it mean; `None` = not made yet.
    pub picker: Option<Arc<Picker>>,
}

/// A choice of datums and what it would leave.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Which one.
    pub kind: ChoiceKind,
    /// What it leaves; `None` where it does not hold the part, or cannot be told.
    pub foretold: Option<Arc<Foretold>>,
}

/// Ways to hold the part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChoiceKind {
    /// As the plan says now.
    Now,
    /// Hole, slot and surface point, turned by the line between hole and slot.
    CentreLine([String; 3]),
    /// The same, turned by the slot's own axis.
    Axis([String; 3]),
    /// The whole surface.
    BestFit,
}

/// What a check is asked of.
#[derive(Debug)]
pub struct CheckOrder {
    /// Given back with every answer.
    pub serial: u64,
    /// The plan as it stands.
    pub document: Document,
    /// A row that is proposed; checked as the last one of its list.
    pub draft: Option<(List, PointSpec)>,
    /// The CAD that is there.
    pub known: Option<Cad>,
}

/// What the desk tells.
#[derive(Debug)]
pub enum Told {
    /// A new password's hash.
    Hashed(Result<String, String>),
    /// Whether a password was the right one.
    Verified(bool),
    /// A plan was opened for editing.
    Opened(PathBuf, Result<Box<Opened>, Box<Diagnostic>>),
    /// The plan of this version is kept beside its file, or why not.
    Autosaved(u64, Result<(), Box<Diagnostic>>),
    /// A plan was saved, or why not.
    Saved(Box<Document>, Result<(), SaveError>),
    /// The CAD that the plan asks for.
    Prepared(Box<Cad>),
    /// What `check` tells.
    Checked {
        /// Of the order.
        serial: u64,
        /// Whether the CAD was looked at, too.
        whole: bool,
        /// The problems, each with its field.
        problems: Vec<PlanProblem>,
    },
    /// The uncertainty to expect, with the plan's own datums first.
    Foretold(u64, Vec<Choice>),
    /// An internal fault.
    Failed(Diagnostic),
}

type Task = Box<dyn FnOnce(&dyn Fn(Told)) + Send>;

/// The threads. Dropping it gives the check up and waits for what is being written.
pub struct Desk {
    files: Option<Sender<Task>>,
    checks: Option<Sender<Task>>,
    told: Receiver<Told>,
    cancel: CancelToken,
    threads: Vec<JoinHandle<()>>,
}

impl Desk {
    /// Starts them. `wake` is called after everything that is told.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let (sender, told) = channel();
        let wake = Arc::new(wake);
        let mut threads = Vec::new();
        let mut start = |name: &str| -> std::io::Result<Sender<Task>> {
            let (tasks, queue) = channel::<Task>();
            let (sender, wake) = (sender.clone(), wake.clone());
            let work = move || {
                let tell = |told| {
                    // A window that is gone hears nothing.
                    if sender.send(told).is_ok() {
                        wake();
                    }
                };
                for task in queue {
                    if catch_unwind(AssertUnwindSafe(|| task(&tell))).is_err() {
                        tell(Told::Failed(Diagnostic::error("an internal fault while the plan was looked at").with_help(
                            "save the plan under another name; please send the plan and this message to the maintainers",
                        )));
                    }
                }
            };
            threads.push(std::thread::Builder::new().name(name.into()).spawn(work)?);
            Ok(tasks)
        };
        let (files, checks) = (Some(start("plan files")?), Some(start("plan checks")?));
        Ok(Self { files, checks, told, cancel: CancelToken::default(), threads })
    }

    /// What was told since the last call.
    pub fn told(&self) -> Vec<Told> {
        self.told.try_iter().collect()
    }

    fn file(&self, task: impl FnOnce(&dyn Fn(Told)) + Send + 'static) {
        if let Some(files) = &self.files {
            // The thread ends only when this sender is gone.
            let _ = files.send(Box::new(task));
        }
    }

    /// Makes the hash of a new password.
    pub fn hash_password(&self, secret: Secret) {
        self.file(move |tell| tell(Told::Hashed(secret.hash())));
    }

    /// Looks whether a password is the one of a hash.
    pub fn verify(&self, secret: Secret, hash: String) {
        self.file(move |tell| tell(Told::Verified(secret.is_of(&hash))));
    }

    /// Opens a plan for editing.
    pub fn open(&self, path: PathBuf) {
        self.file(move |tell| {
            let opened = open_plan(&path).map(Box::new);
            tell(Told::Opened(path, opened));
        });
    }

    /// Keeps the unsaved text beside the plan.
    pub fn autosave(&self, version: u64, document: Document) {
        self.file(move |tell| tell(Told::Autosaved(version, autosave(&document))));
    }

    /// Forgets the unsaved text beside a plan, after what is being written there.
    pub fn discard(&self, plan: PathBuf) {
        self.file(move |_| discard_autosave(&plan));
    }

    /// Saves a plan.
    pub fn save(&self, mut document: Document, overwrite: Overwrite) {
        self.file(move |tell| {
            let saved = save_plan(&mut document, overwrite);
            tell(Told::Saved(Box::new(document), saved));
        });
    }

    /// Checks a plan; a check under way is given up.
    pub fn check(&mut self, order: CheckOrder) {
        self.cancel.cancel();
        self.cancel = CancelToken::default();
        let cancel = self.cancel.clone();
        if let Some(checks) = &self.checks {
            let _ = checks.send(Box::new(move |tell| check(order, &cancel, tell)));
        }
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        self.cancel.cancel();
        (self.files, self.checks) = (None, None);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn check(order: CheckOrder, cancel: &CancelToken, tell: &dyn Fn(Told)) {
    if cancel.is_cancelled() {
        return;
    }
    let CheckOrder { serial, mut document, draft, known } = order;
    if let Some((list, spec)) = draft {
        // A name that is taken is told at its field; without the row the rest can be checked.
        let _ = document.add(list, &[spec]);
    }
    let asked = CadAsked::of(&document);
    let mut cad = known.filter(|cad| Some(&cad.asked) == asked.as_ref());
    let mut fault = None;
    if cad.is_none() {
        tell(Told::Checked { serial, whole: false, problems: check_document(&document, None) });
        match prepare_document(&document, &RunContext::new(cancel, &|_| {})) {
            Ok(part) => {
                let part = part.map(Arc::new);
                cad = part.zip(asked).map(|(part, asked)| Cad { asked, part, picker: None });
            }
            Err(ReadError::Cancelled(_)) => return,
            Err(ReadError::Bad(told) | ReadError::CutOff(told)) => fault = Some(*told),
        }
    }
    let mut problems = check_document(&document, cad.as_ref().map(|cad| &*cad.part));
    problems.extend(document.locate(fault.into_iter().collect()));
    tell(Told::Checked { serial, whole: true, problems });
    if let Some(cad) = &mut cad
        && cad.picker.is_none()
    {
        cad.picker = Some(Arc::new(Picker::new(cad.part.clone())));
        tell(Told::Prepared(Box::new(cad.clone())));
    }
    if cancel.is_cancelled() {
        return;
    }
    let part = cad.as_ref().map(|cad| &*cad.part);
    let mut choices = Vec::new();
    for (kind, copy) in choices_of(&document) {
        if cancel.is_cancelled() {
            return;
        }
        let foretold = foretell_document(&copy, part).map(Arc::new);
        choices.push(Choice { kind, foretold });
    }
    tell(Told::Foretold(serial, choices));
}

/// The plan, then copies of it that hold the part in other ways.
fn choices_of(document: &Document) -> Vec<(ChoiceKind, Document)> {
    let mut choices = vec![(ChoiceKind::Now, document.snapshot())];
    let text = |key: &str| match document.setting("alignment", key) {
        Some(FieldValue::Text(text)) => Some(text),
        _ => None,
    };
    let (method, reading) = (text("method"), text("slot_reading").unwrap_or_else(|| "centre_line".to_owned()));
    let by_features = method.as_deref() == Some("features");
    let first = |kind: &str| document.rows(List::Feature).into_iter().find(|row| row.kind == kind).map(|row| row.name);
    let datum = |key: &str, kind: &str| text(key).filter(|_| by_features).or_else(|| first(kind));
    if let (Some(hole), Some(slot), Some(point)) =
        (datum("hole", "hole"), datum("slot", "slot"), datum("point", "surface"))
    {
        let names = [hole, slot, point];
        for (word, kind) in
            [("centre_line", ChoiceKind::CentreLine(names.clone())), ("axis", ChoiceKind::Axis(names.clone()))]
        {
            if !(by_features && reading == word) {
                choices.extend(changed(document, |copy| hold(copy, &names, word)).map(|copy| (kind, copy)));
            }
        }
    }
    if method.as_deref() != Some("best_fit") || !document.regions().is_empty() {
        choices.extend(changed(document, |copy| copy.hold_by_regions(&[])).map(|copy| (ChoiceKind::BestFit, copy)));
    }
    choices
}

fn hold(document: &mut Document, names: &[String; 3], reading: &str) -> Result<(), EditError> {
    let [hole, slot, point] = names;
    document.hold_by_features(hole, slot, point)?;
    document.set_setting("alignment", "slot_reading", &FieldValue::Text(reading.to_owned()))
}

fn changed(document: &Document, change: impl Fn(&mut Document) -> Result<(), EditError>) -> Option<Document> {
    let mut copy = document.snapshot();
    change(&mut copy).ok().map(|()| copy)
}
