//! The plan that is edited, and every way in which it can be: an edit is a value, made in one place.

use crate::inspect::Foretold;
use crate::part::Part;
use crate::part::propose::Picker;
use crate::plan::Geometry;
use crate::plan::document::{
    Document, EditError, FieldValue, Import, List, Lock, MirrorNames, MirrorPlane, PlanProblem, PointSpec, Region, Rest,
};
use crate::worker::Trial;
use crate::worker::plan_file::Recovery;
use std::sync::Arc;

/// A plan that is being edited, and what is known of it as it stands. Kept with the facts, as long as the plan is open.
#[derive(Debug, Clone)]
pub struct Editing {
    /// The plan.
    pub document: Document,
    /// Goes up with every change of the text.
    pub version: u64,
    /// What `check` tells of it, each with its field; of the text of version `checked`.
    pub problems: Vec<PlanProblem>,
    /// The version that was checked last; `None` = none yet.
    pub checked: Option<u64>,
    /// The uncertainty to expect, foretold for version `checked` or one before it.
    pub foretold: Option<Arc<Foretold>>,
    /// The CAD as the edited plan names it.
    pub part: Option<Arc<Part>>,
    /// What clicks on that CAD mean.
    pub picker: Option<Arc<Picker>>,
    /// Text that was not saved when the program last ended, to be offered.
    pub recovery: Option<Recovery>,
    /// What the plan makes of a scan, and the version that was tried.
    pub trial: Option<(u64, Arc<Trial>)>,
}

impl Editing {
    /// A plan that was just opened.
    pub fn new(document: Document, recovery: Option<Recovery>) -> Self {
        Self {
            document,
            version: 0,
            problems: Vec::new(),
            checked: None,
            foretold: None,
            part: None,
            picker: None,
            recovery,
            trial: None,
        }
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
            Edit::BeginGesture => document.begin_gesture(),
            Edit::EndGesture => document.end_gesture(),
            Edit::DropGesture => document.drop_gesture(),
            Edit::Undo => drop(document.undo()),
            Edit::Redo => drop(document.redo()),
        }
        Ok(None)
    }
}
