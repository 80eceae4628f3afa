//! A plan that is being edited: its text, what became of it since it was saved, and edits that keep its comments, order and
//! layout.
//!
//! ```text
//! file --layout--> text --toml_edit--> tree --an edit--> text      every step back and forth is a whole text (history)
//!                   |--plan::parse--> what is sound of it, and every problem with its place (places)
//! ```
//!
//! The text is what counts: nothing is kept beside it that could differ from it. A text that is no TOML can be replaced and
//! saved, but not edited key by key. Nothing here writes files; `worker::plan_file` does.

mod alignment;
mod changes;
mod csv;
mod edit_error;
mod fields;
mod forms;
mod history;
#[cfg(test)]
mod hostile_tests;
mod import;
mod keys;
mod layout;
mod mirror;
mod names;
mod new_plan;
mod places;
mod revision;
mod rows;
mod settings;
mod shape;
#[cfg(test)]
mod table_tests;
mod take_back;
#[cfg(test)]
mod tests;
mod tree;
mod words;
#[cfg(test)]
mod words_tests;

pub use alignment::{Lock, Region};
pub use changes::{Change, ChangedAt};
pub use csv::{CsvStyle, csv_of_points};
pub use edit_error::EditError;
pub use fields::{List, PointSpec, RowInfo};
pub use forms::{FORM, Holds, LeftOut, RowKey, Setting, row_form};
pub use history::{Step, Verb};
pub use import::{Import, ImportedRow, Rest, RowChange};
pub use keys::{LISTED_KEYS, SETTINGS};
pub use layout::Layout;
pub use mirror::{Axis, MirrorNames, MirrorPlane};
pub use new_plan::{NewPlan, seen_from};
pub use places::{At, Place, PlanProblem};
pub use revision::Revision;
pub use settings::FieldValue;

use super::load::{self, Loaded};
use crate::diagnostic::Diagnostic;
use history::History;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use toml_edit::DocumentMut;

/// A plan that is being edited. Lines of the text end with `\n`, whatever the file has.
#[derive(Debug, Clone)]
pub struct Document {
    path: PathBuf,
    layout: Layout,
    text: String,
    saved: Option<Saved>,
    history: History,
    /// The tree of the text, made when it is first asked for.
    parsed: OnceLock<Result<DocumentMut, EditError>>,
}

/// What lies on the disk, as far as this document knows.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Saved {
    text: String,
    sha256: String,
}

impl Document {
    /// The document of a plan file's bytes. `path` gives messages their file and relative paths their folder.
    ///
    /// # Errors
    /// Bytes that are no UTF-8 text, or too many for a plan.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self, Box<Diagnostic>> {
        let (layout, text) = Layout::read(bytes, path)?;
        let saved = Some(Saved { text: text.clone(), sha256: crate::plan::load::sha256_hex(&[bytes]) });
        Ok(Self { path: path.to_path_buf(), layout, text, saved, history: History::default(), parsed: OnceLock::new() })
    }

    /// A document that lies on no disk yet.
    pub fn unsaved(text: impl Into<String>, path: &Path) -> Self {
        let (layout, saved, history, parsed) = Default::default();
        Self { path: path.to_path_buf(), layout, text: text.into(), saved, history, parsed }
    }

    /// The plan file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text, lines ending with `\n`.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The bytes to be saved: with the byte order mark and line ends that the file had.
    pub fn bytes(&self) -> Vec<u8> {
        self.layout.write(&self.text)
    }

    /// Whether there is something to save.
    pub fn is_modified(&self) -> bool {
        self.saved.as_ref().is_none_or(|saved| saved.text != self.text)
    }

    /// SHA-256 of the bytes that lay on the disk when they were read or saved; `None` for a plan that was never saved.
    pub fn saved_sha256(&self) -> Option<&str> {
        self.saved.as_ref().map(|saved| saved.sha256.as_str())
    }

    /// The text on the disk; empty for a plan that was never saved.
    pub fn saved_text(&self) -> &str {
        self.saved.as_ref().map_or("", |saved| saved.text.as_str())
    }

    /// Notes that these bytes of the plan now lie on the disk. What was edited while they were written stays unsaved.
    pub fn mark_saved(&mut self, bytes: &[u8]) {
        if let Ok((_, text)) = Layout::read(bytes, &self.path) {
            self.saved = Some(Saved { text, sha256: load::sha256_hex(&[bytes]) });
        }
        self.history.end_gesture();
    }

    /// The same plan under another name, not saved yet. In another folder, files that the plan names relative to its own are
    /// named by their whole path.
    ///
    /// # Errors
    /// As of every edit, where paths must be rewritten.
    pub fn copy_to(&self, path: &Path) -> Result<Self, EditError> {
        let mut copy = Self::unsaved(self.text.clone(), path);
        copy.layout = self.layout;
        if self.path.parent() != path.parent() {
            copy.name_whole_paths(self.path.parent().unwrap_or(Path::new("")))?;
            copy.history = History::default();
        }
        Ok(copy)
    }

    /// The same text without its steps: small enough to be handed to another thread at every change.
    pub fn snapshot(&self) -> Self {
        let (path, text) = (self.path.clone(), self.text.clone());
        let (layout, saved) = (self.layout, self.saved.clone());
        Self { path, layout, text, saved, history: History::default(), parsed: OnceLock::new() }
    }

    /// What the program makes of the text: the plan or what of it is sound, and the problems of the text alone, as
    /// `plan::load` tells them.
    pub fn read(&self) -> Loaded {
        load::load_text(&self.bytes(), &self.path)
    }

    /// Puts another text in the place of this one.
    pub fn set_text(&mut self, text: &str, step: Step) {
        let text = text.replace("\r\n", "\n");
        if text != self.text {
            let before = std::mem::replace(&mut self.text, text);
            self.history.note(step, before);
            self.parsed = OnceLock::new();
        }
    }

    /// An edit of the tree: all of it, or nothing. One that leaves the text as it is leaves no step either.
    fn edit<T>(
        &mut self,
        step: Step,
        change: impl FnOnce(&mut DocumentMut) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        let mut tree = self.tree()?.clone();
        let made = change(&mut tree)?;
        self.set_text(&tree.to_string(), step);
        Ok(made)
    }

    fn tree(&self) -> Result<&DocumentMut, EditError> {
        self.parsed.get_or_init(|| tree::parse(&self.text)).as_ref().map_err(Clone::clone)
    }

    /// Whether the text can be edited key by key; else what is wrong with its notation, with the line.
    ///
    /// # Errors
    /// The first fault.
    pub fn structure(&self) -> Result<(), EditError> {
        self.tree().map(drop)
    }

    /// Takes the last step back and tells it; `None` when there is none.
    pub fn undo(&mut self) -> Option<Step> {
        self.parsed = OnceLock::new();
        self.history.undo(&mut self.text)
    }

    /// Does the step taken back last again, and tells it.
    pub fn redo(&mut self) -> Option<Step> {
        self.parsed = OnceLock::new();
        self.history.redo(&mut self.text)
    }

    /// The step that [`Self::undo`] would take back.
    pub fn undo_step(&self) -> Option<&Step> {
        self.history.undo_step()
    }

    /// The step that [`Self::redo`] would do again.
    pub fn redo_step(&self) -> Option<&Step> {
        self.history.redo_step()
    }

    /// Makes all edits up to [`Self::end_gesture`] one step, named after the first: for dragging, and while a value is typed.
    pub fn begin_gesture(&mut self) {
        self.history.begin_gesture();
    }

    /// Ends it.
    pub fn end_gesture(&mut self) {
        self.history.end_gesture();
    }

    /// Ends it and takes its step back, whether anything was edited in it or not. It cannot be done again.
    pub fn drop_gesture(&mut self) {
        if self.history.drop_gesture(&mut self.text) {
            self.parsed = OnceLock::new();
        }
    }
}
