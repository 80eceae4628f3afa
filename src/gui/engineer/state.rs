//! What is looked at on the engineer's screen: gone with the window, never part of the plan.

use super::dialogs::Dialogs;
use super::editing::{Edit, Editing};
use super::view3d::View3d;
use crate::diagnostic::Diagnostic;
use crate::gui::later::PathDialog;
use crate::plan::document::{List, PointSpec};
use crate::worker::plan_file::SaveError;
use std::path::PathBuf;

/// A section of the plan, as the tree lists them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Section {
    /// `[part]`.
    Part,
    /// `[cad]`.
    Cad,
    /// `[scans]`.
    Scans,
    /// `[background]`.
    Background,
    /// `[alignment]` and its features.
    Alignment,
    /// The comparison points.
    #[default]
    Points,
    /// `[rig]`.
    Rig,
    /// `[uncertainty]`.
    Uncertainty,
    /// `[output]`.
    Output,
}

impl Section {
    /// In the order of the tree.
    pub const ALL: [Section; 9] = [
        Section::Part,
        Section::Cad,
        Section::Scans,
        Section::Background,
        Section::Alignment,
        Section::Points,
        Section::Rig,
        Section::Uncertainty,
        Section::Output,
    ];

    /// The list whose rows stand below the tree while this section is chosen.
    pub fn list(self) -> List {
        if self == Section::Alignment { List::Feature } else { List::Comparison }
    }
}

/// What a click into the 3D view does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Tool {
    /// Chooses rows, drags them.
    #[default]
    Choose,
    /// A new surface point.
    Surface,
    /// A new point on a trimmed edge.
    Edge,
    /// A new hole.
    Hole,
    /// A new hole for the alignment.
    FeatureHole,
    /// A new slot, for the alignment.
    Slot,
    /// A new surface point for the alignment.
    Feature,
    /// Measures between two clicks.
    Measure,
}

/// The rows that are chosen.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Chosen {
    /// Of which list; `None` = nothing is chosen.
    pub list: Option<List>,
    /// Their indices, ascending.
    pub rows: Vec<usize>,
}

impl Chosen {
    /// One row.
    pub fn one(list: List, row: usize) -> Self {
        Self { list: Some(list), rows: vec![row] }
    }

    /// Whether a row is chosen.
    pub fn has(&self, list: List, row: usize) -> bool {
        self.list == Some(list) && self.rows.contains(&row)
    }

    /// The only row that is chosen.
    pub fn only(&self) -> Option<(List, usize)> {
        match (self.list, self.rows.as_slice()) {
            (Some(list), [row]) => Some((list, *row)),
            _ => None,
        }
    }

    /// Takes a row in or out, as a click with Ctrl does.
    pub fn toggle(&mut self, list: List, row: usize) {
        if self.list != Some(list) {
            *self = Self::one(list, row);
        } else if let Some(at) = self.rows.iter().position(|r| *r == row) {
            self.rows.remove(at);
        } else {
            self.rows.push(row);
            self.rows.sort_unstable();
        }
        if self.rows.is_empty() {
            *self = Self::default();
        }
    }
}

/// A row that is proposed and not in the plan yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Where it would go.
    pub list: List,
    /// What it would be; an empty name stands for the next one by the naming rule.
    pub spec: PointSpec,
    /// What somebody should know of the proposal.
    pub note: Option<String>,
}

/// What is looked at where the window has no room for everything.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Pane {
    /// The part.
    #[default]
    View,
    /// Sections and rows.
    Plan,
    /// The form, which other windows show beside it.
    Form,
    /// Problems, changes and what the plan makes of a scan.
    Problems,
}

/// What shares the place below the 3D view.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Lower {
    /// The problems; in wide windows they have a place of their own.
    #[default]
    Problems,
    /// What changed.
    Changes,
    /// What the plan makes of a scan.
    Trial,
}

/// A field that is being typed into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Typing {
    /// Which field: `part.thickness_mm`, `comparison.3.position.0`.
    pub field: String,
    /// What stands in it.
    pub text: String,
    /// What egui calls it.
    pub id: egui::Id,
}

/// What is typed into the dialog for saving.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SaveForm {
    /// The new revision.
    pub revision: String,
    /// Why.
    pub reason: String,
    /// Another name for the file, once the choice is asked for.
    pub path: String,
}

/// All that is looked at.
#[derive(Default)]
pub struct EngineerView {
    /// The section whose form is shown while no row is.
    pub section: Section,
    /// The rows that are chosen.
    pub chosen: Chosen,
    /// What a click does.
    pub tool: Tool,
    /// The new row.
    pub draft: Option<Draft>,
    /// Only rows with this in their name or kind are listed.
    pub filter: String,
    /// What stands below the 3D view.
    pub lower: Lower,
    /// What is looked at in a small window.
    pub pane: Pane,
    /// The field that is typed into.
    pub typing: Option<Typing>,
    /// The field that was left with something in it that is no number, and what that was.
    pub refused: Option<(String, String)>,
    /// The field that gets the focus in the next frame.
    pub focus: Option<String>,
    /// The 3D view.
    pub view3d: View3d,
    /// The dialogs that are open.
    pub dialogs: Dialogs,
    /// The dialog for saving.
    pub saving: Option<SaveForm>,
    /// Why the plan was not saved.
    pub save_fault: Option<SaveError>,
    /// The form is to come into sight.
    pub(super) wants_form: bool,
    /// What is typed at the lock.
    pub(super) passwords: [String; 2],
    /// The plan that is being opened for editing.
    pub(super) opening: Option<PathBuf>,
    /// Why it could not be.
    pub(super) unreadable: Option<Diagnostic>,
    /// The row to which the table was scrolled.
    pub(super) scrolled_to: Option<(List, usize)>,
    /// Where the table is to be scrolled to in the next frame.
    pub(super) scroll: Option<f32>,
    /// The row from which Shift chooses.
    pub(super) anchor: Option<usize>,
    /// The system's dialog for a file or folder that the plan names.
    pub(super) dialog: PathDialog,
    /// The setting it is open for: table, key.
    pub(super) dialog_for: Option<(&'static str, &'static str)>,
}

impl std::fmt::Debug for EngineerView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("EngineerView")
    }
}

impl EngineerView {
    /// Shows a row in the form and in the view.
    pub fn choose(&mut self, list: List, row: usize) {
        self.section = if list == List::Feature { Section::Alignment } else { Section::Points };
        self.chosen = Chosen::one(list, row);
        self.draft = None;
        self.refused = None;
    }

    /// The form comes into sight where one thing is shown at a time.
    pub fn show_form(&mut self) {
        self.wants_form = true;
    }

    /// Begins with a plan that was opened.
    pub(super) fn begin(&mut self, editing: &Editing) {
        self.forget();
        self.chosen = match editing.document.rows(List::Comparison).is_empty() {
            true => Chosen::default(),
            false => Chosen::one(List::Comparison, 0),
        };
    }

    /// Forgets what belongs to the plan that was open.
    pub(in crate::gui) fn forget(&mut self) {
        *self = Self { view3d: std::mem::take(&mut self.view3d), ..Self::default() };
    }

    /// Rows that are gone are not chosen any more, and a field shows what was undone in it.
    pub(super) fn after(&mut self, edit: &Edit, editing: &Editing) {
        if let Some(list) = self.chosen.list {
            let count = editing.document.rows(list).len();
            match edit {
                Edit::Remove(of, removed) if *of == list => {
                    let next = removed.iter().min().copied().unwrap_or(0).min(count.saturating_sub(1));
                    self.chosen = if count == 0 { Chosen::default() } else { Chosen::one(list, next) };
                }
                Edit::Reorder { list: of, from, to } if *of == list && self.chosen.rows == [*from] => {
                    self.chosen = Chosen::one(list, *to);
                }
                _ => self.chosen.rows.retain(|row| *row < count),
            }
            if self.chosen.rows.is_empty() {
                self.chosen = Chosen::default();
            }
        }
        if matches!(edit, Edit::Undo | Edit::Redo) {
            self.typing = None;
        }
    }

    /// Opens the dialog for saving, or shuts it.
    pub(super) fn ask_to_save(&mut self, editing: Option<&Editing>) {
        self.save_fault = None;
        self.refused = None;
        self.saving = editing.filter(|e| e.errors() == 0).map(|editing| SaveForm {
            revision: super::save::next_revision(&super::save::revision(editing)),
            ..SaveForm::default()
        });
    }
}
