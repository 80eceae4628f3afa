//! What is looked at on the engineer's screen: gone with the window, never part of the plan.

use super::dialogs::Dialogs;
use super::view3d::View3d;
use crate::plan::document::{List, PointSpec};

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
    /// The 3D view.
    pub view3d: View3d,
    /// The dialogs that are open.
    pub dialogs: Dialogs,
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
    }
}
