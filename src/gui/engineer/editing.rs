//! The plan that is edited, and every way in which it can be: an edit is a value, made in one place.

use super::desk::{Cad, Choice};
use super::state::Draft;
use crate::diagnostic::{Diagnostic, Severity};
use crate::gui::facts::Facts;
use crate::inspect::Foretold;
use crate::part::Part;
use crate::part::propose::Picker;
use crate::plan::Geometry;
use crate::plan::document::{
    At, Change, Document, EditError, FieldValue, Import, List, Lock, MirrorNames, MirrorPlane, PlanProblem, PointSpec,
    Region, Rest, RowInfo,
};
use crate::worker::plan_file::Recovery;
use crate::worker::{CadAsked, Trial};
use std::sync::Arc;
use std::time::Instant;

/// What is kept beside the plan's file.
#[derive(Debug, Clone, Default)]
pub struct Autosave {
    /// The version that is kept; 0 = the plan as it was opened.
    pub version: u64,
    /// Since when.
    pub at: Option<Instant>,
    /// Since when there is something else.
    pub since: Option<Instant>,
    /// It is being written.
    pub under_way: bool,
    /// Why the last one could not be written.
    pub fault: Option<Diagnostic>,
}

/// What is to be checked.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    /// The version of the plan.
    pub version: u64,
    /// The row that is proposed.
    pub draft: Option<(List, PointSpec)>,
    /// Since when it is so.
    pub since: Instant,
}

/// A plan that is being edited, and what is known of it as it stands. Kept with the facts, as long as the plan is open.
#[derive(Debug, Clone)]
pub struct Editing {
    /// The plan.
    pub document: Document,
    /// Goes up with every change of the text.
    pub version: u64,
    /// What `check` tells of it, each with its field; of the text of version `checked`, a row that is proposed being the last of its list.
    pub problems: Vec<PlanProblem>,
    /// The version that was checked last, with its CAD; `None` = none yet.
    pub checked: Option<u64>,
    /// The uncertainty to expect by choice of datums, the plan's own first; foretold for version `checked` or one before it.
    pub choices: Vec<Choice>,
    /// The CAD as the edited plan names it.
    pub part: Option<Arc<Part>>,
    /// What clicks on that CAD mean.
    pub picker: Option<Arc<Picker>>,
    /// Text that was not saved when the program last ended, to be offered.
    pub recovery: Option<Recovery>,
    /// What the plan makes of a scan, and the version that was tried.
    pub trial: Option<(u64, Result<Arc<Trial>, Diagnostic>)>,
    /// What is kept beside the file.
    pub autosave: Autosave,
    /// It is being saved.
    pub saving: bool,
    /// What of the plan `part` was made for.
    pub(super) cad_asked: Option<CadAsked>,
    /// What is to be checked.
    pub(super) seen: Option<Seen>,
    /// Goes up with everything that is to be checked.
    pub(super) serial: u64,
    /// The check of it was asked for.
    pub(super) asked: bool,
    /// What the views ask for in every frame.
    shown: Arc<Shown>,
}

/// What the text of a version says.
#[derive(Debug, Clone, Default)]
struct Shown {
    version: Option<u64>,
    features: Vec<RowInfo>,
    points: Vec<RowInfo>,
    changes: Vec<Change>,
}

impl Editing {
    /// A plan that was just opened.
    pub fn new(document: Document, recovery: Option<Recovery>) -> Self {
        Self {
            document,
            version: 0,
            problems: Vec::new(),
            checked: None,
            choices: Vec::new(),
            part: None,
            picker: None,
            recovery,
            trial: None,
            autosave: Autosave::default(),
            saving: false,
            cad_asked: None,
            seen: None,
            serial: 0,
            asked: false,
            shown: Arc::default(),
        }
    }

    /// Takes the CAD that the operator's plan was opened with, if it is the one.
    pub(super) fn know_cad(&mut self, facts: &Facts) {
        if let (Some(plan), Some(part)) = (&facts.plan, &facts.part)
            && Some(plan.sha256.as_str()) == self.sha256()
        {
            self.cad_asked = CadAsked::of(&self.document);
            self.part = Some(part.clone());
        }
    }

    fn sha256(&self) -> Option<&str> {
        self.document.saved_sha256()
    }

    /// The CAD with what it was made for.
    pub(super) fn cad(&self) -> Option<Cad> {
        let (asked, part) = self.cad_asked.clone().zip(self.part.clone())?;
        Some(Cad { asked, part, picker: self.picker.clone() })
    }

    /// Errors of the plan; those of a row that is proposed are none of it yet.
    pub fn errors(&self) -> usize {
        let proposed = self.proposed();
        let counts = |p: &&PlanProblem| p.diagnostic.severity == Severity::Error && Some(p.place.at) != proposed;
        self.problems.iter().filter(counts).count()
    }

    /// Whether a row that is proposed can be added: its name is free, and nothing is told against it.
    pub fn would_take(&self, draft: &Draft) -> bool {
        let proposed = self.proposed();
        let against = |p: &PlanProblem| Some(p.place.at) == proposed && p.diagnostic.severity == Severity::Error;
        let taken = self.rows(draft.list).iter().any(|row| row.name == draft.spec.name);
        !taken && !self.problems.iter().any(against)
    }

    /// Where the row that is proposed stands among the problems.
    pub fn proposed(&self) -> Option<At> {
        let (list, _) = self.seen.as_ref()?.draft.as_ref()?;
        let rows = self.rows(*list).len();
        Some(match list {
            List::Feature => At::Feature(rows),
            List::Comparison => At::Comparison(rows),
        })
    }

    /// What changed since the plan was saved.
    pub fn changes(&self) -> &[Change] {
        &self.shown.changes
    }

    /// The rows of a list.
    pub fn rows(&self, list: List) -> &[RowInfo] {
        match list {
            List::Feature => &self.shown.features,
            List::Comparison => &self.shown.points,
        }
    }

    /// Finds once what views ask for in every frame.
    pub(super) fn refresh(&mut self) {
        if self.shown.version != Some(self.version) {
            self.shown = Arc::new(Shown {
                version: Some(self.version),
                features: self.document.rows(List::Feature),
                points: self.document.rows(List::Comparison),
                changes: self.document.changes(),
            });
        }
    }

    /// The plan lies on the disk, as this document has it.
    pub(super) fn was_saved(&mut self, saved: Document) {
        let bytes = saved.bytes();
        if saved.path() == self.document.path() {
            self.document.take_revision(&saved);
            self.document.mark_saved(&bytes);
        } else {
            self.document = saved;
        }
        self.version += 1;
        self.autosave = Autosave { version: self.version, ..Autosave::default() };
    }

    /// Puts a document in the place of this one, which it was made of.
    pub(in crate::gui) fn replace(&mut self, document: Document) {
        if document.text() != self.document.text() {
            self.version += 1;
        }
        self.document = document;
        self.refresh();
    }

    /// What to expect with the plan's own datums; `None` until it is told.
    pub fn foretold(&self) -> Option<&Foretold> {
        self.choices.first().and_then(|choice| choice.foretold.as_deref())
    }

    /// Makes an edit; tells the index of the first row that it added.
    ///
    /// # Errors
    /// Of the document: nothing was changed then.
    pub fn apply(&mut self, edit: &Edit) -> Result<Option<usize>, EditError> {
        let before = self.document.text().to_owned();
        let made = edit.make(&mut self.document);
        if self.document.text() != before {
            self.version += 1;
        }
        made
    }
}

/// An edit.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Rows at the end of a list.
    AddRows(List, Vec<PointSpec>),
    /// One key of a row; of `name` as [`Edit::Rename`].
    SetValue {
        /// Its list.
        list: List,
        /// Its index.
        index: usize,
        /// The key.
        key: String,
        /// What it shall hold.
        value: FieldValue,
    },
    /// A key of a row is left out.
    RemoveValue {
        /// Its list.
        list: List,
        /// Its index.
        index: usize,
        /// The key.
        key: String,
    },
    /// Another place and shape of a row.
    Reshape {
        /// Its list.
        list: List,
        /// Its index.
        index: usize,
        /// The shape.
        geometry: Geometry,
    },
    /// Another name of a row.
    Rename {
        /// Its list.
        list: List,
        /// Its index.
        index: usize,
        /// The name.
        name: String,
    },
    /// Rows go.
    Remove(List, Vec<usize>),
    /// A row moves to another place in its list.
    Reorder {
        /// Its list.
        list: List,
        /// From which index.
        from: usize,
        /// To which.
        to: usize,
    },
    /// A setting: table, key, value.
    SetSetting(String, String, FieldValue),
    /// A setting is left out: table, key.
    RemoveSetting(String, String),
    /// A whole table is left out.
    RemoveTable(String),
    /// The part is held by hole, slot and surface point.
    HoldByFeatures([String; 3]),
    /// The part is held by locked directions.
    HoldByLocks(Vec<Lock>),
    /// The part is held by a best fit to regions, or without any to all of it.
    HoldByRegions(Vec<Region>),
    /// Limits of many points, mm; `None` leaves one as it is.
    SetTolerances {
        /// Which points.
        indices: Vec<usize>,
        /// The lower limit.
        lower_mm: Option<f64>,
        /// The upper limit.
        upper_mm: Option<f64>,
    },
    /// The plan of the other hand.
    Mirror(MirrorPlane, MirrorNames),
    /// Points of a table.
    Import(Box<Import>, Rest),
    /// The points of the comparison file come into the plan.
    TakePointsIntoPlan,
    /// One change since the plan was saved is taken back.
    TakeBack(Change),
    /// All edits up to `EndGesture` become one step.
    BeginGesture,
    /// The end of that step.
    EndGesture,
    /// The step under way is ended and taken back.
    DropGesture,
    /// The last step back.
    Undo,
    /// The step taken back again.
    Redo,
}

impl Edit {
    fn make(&self, document: &mut Document) -> Result<Option<usize>, EditError> {
        match self {
            Edit::AddRows(list, points) => return document.add(*list, points).map(Some),
            Edit::SetValue { list, index, key, value } => document.set_value(*list, *index, key, value)?,
            Edit::RemoveValue { list, index, key } => document.remove_value(*list, *index, key)?,
            Edit::Reshape { list, index, geometry } => document.reshape(*list, *index, geometry)?,
            Edit::Rename { list, index, name } => document.rename(*list, *index, name)?,
            Edit::Remove(list, indices) => document.remove(*list, indices)?,
            Edit::Reorder { list, from, to } => document.reorder(*list, *from, *to)?,
            Edit::SetSetting(table, key, value) => document.set_setting(table, key, value)?,
            Edit::RemoveSetting(table, key) => document.remove_setting(table, key)?,
            Edit::RemoveTable(table) => document.remove_table(table)?,
            Edit::HoldByFeatures([hole, slot, point]) => document.hold_by_features(hole, slot, point)?,
            Edit::HoldByLocks(locks) => document.hold_by_locks(locks)?,
            Edit::HoldByRegions(regions) => document.hold_by_regions(regions)?,
            Edit::SetTolerances { indices, lower_mm, upper_mm } => {
                document.set_tolerances(indices, *lower_mm, *upper_mm)?;
            }
            Edit::Mirror(plane, names) => document.mirror(*plane, names)?,
            Edit::Import(import, rest) => document.import(import, *rest)?,
            Edit::TakePointsIntoPlan => document.take_points_into_plan()?,
            Edit::TakeBack(change) => document.take_back(change)?,
            Edit::BeginGesture => document.begin_gesture(),
            Edit::EndGesture => document.end_gesture(),
            Edit::DropGesture => document.drop_gesture(),
            Edit::Undo => drop(document.undo()),
            Edit::Redo => drop(document.redo()),
        }
        Ok(None)
    }
}
