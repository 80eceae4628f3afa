//! Revisions of a plan, noted at the end of its file as comments, so that every version of the program reads it.
//!
//! ```toml
//! # Revisions of this plan, the newest last.
//! # Revision D, 2026-11-22: press set up anew
//! #   E03: upper tolerance 0.200 -> 0.300 mm
//! ```

use super::changes::changes;
use super::tree::{put, section};
use super::{Change, Document, EditError, Step, Verb};
use std::sync::OnceLock;

const HEADING: &str = "# Revisions of this plan, the newest last.";
const REVISION: &str = "# Revision ";
const LISTED: &str = "#   ";

/// A revision as it is noted in the plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Revision {
    /// What `[part] revision` was then.
    pub revision: String,
    /// The day, as people write it; may be empty.
    pub date: String,
    /// Why.
    pub reason: String,
    /// What changed, a line each.
    pub changes: Vec<String>,
}

impl Document {
    /// The revisions that the plan's file tells, the oldest first.
    pub fn revisions(&self) -> Vec<Revision> {
        let mut found: Vec<Revision> = Vec::new();
        let block = self.text.rfind(HEADING).map_or("", |at| &self.text[at..]);
        for line in block.lines().skip(1) {
            if let Some((head, reason)) = line.strip_prefix(REVISION).and_then(|rest| rest.split_once(": ")) {
                let (revision, date) = head.rsplit_once(", ").unwrap_or((head, ""));
                let (changes, reason) = (Vec::new(), reason.to_owned());
                found.push(Revision { revision: revision.to_owned(), date: date.to_owned(), reason, changes });
            } else if let (Some(change), Some(last)) = (line.strip_prefix(LISTED), found.last_mut()) {
                last.changes.push(change.to_owned());
            }
        }
        found
    }

    /// Takes a revision of this plan that was saved: its text, its revision and its note, which no undo takes back. Steps from before are
    /// taken back as ever, under the new revision; those that cannot be are forgotten. What was edited since stays.
    pub fn take_revision(&mut self, saved: &Document) {
        let edited = carried(&self.text, saved).filter(|text| changes(saved.text(), text).iter().any(is_content));
        self.text = edited.unwrap_or_else(|| saved.text.clone());
        self.parsed = OnceLock::new();
        self.history.rewrite(|text| carried(text, saved));
    }

    /// Writes `[part] revision`, and notes at the end of the file why and what changed since the plan was saved. `date` is the day as
    /// people write it. Tells the changes.
    ///
    /// # Errors
    /// A text that is no TOML.
    pub fn revise(&mut self, revision: &str, date: &str, reason: &str) -> Result<Vec<Change>, EditError> {
        let changes: Vec<Change> = self.changes().into_iter().filter(|c| c.subject != "revision").collect();
        let mut note = String::new();
        if !self.text.contains(HEADING) {
            note.push_str(&format!("\n{HEADING}\n"));
        }
        let [revision_line, date_line, reason_line] = [revision, date, reason].map(one_line);
        let comma = if date_line.is_empty() { "" } else { ", " };
        note.push_str(&format!("{REVISION}{revision_line}{comma}{date_line}: {reason_line}\n"));
        changes.iter().for_each(|change| note.push_str(&format!("{LISTED}{}\n", one_line(&change.to_string()))));
        self.edit(Step::new(Verb::Change, format!("revision to {revision_line}")), |tree| {
            put(section(tree, "part")?, "revision", revision.into());
            let own = tree.trailing().as_str().unwrap_or("").to_owned();
            let gap = if own.is_empty() || own.ends_with('\n') { "" } else { "\n" };
            tree.set_trailing(format!("{own}{gap}{note}"));
            Ok(())
        })?;
        Ok(changes)
    }
}

/// A text with the revision of a saved one, and what that notes at its end; `None` where it cannot hold them.
fn carried(text: &str, saved: &Document) -> Option<String> {
    let mut tree = super::tree::parse(text).ok()?;
    let of = saved.tree().ok()?;
    let revision = of.get("part")?.as_table_like()?.get("revision")?.as_str()?;
    put(section(&mut tree, "part").ok()?, "revision", revision.into());
    tree.set_trailing(of.trailing().as_str().unwrap_or(""));
    let made = Document::unsaved(tree.to_string(), &saved.path);
    // Older notes may stand elsewhere.
    (made.revisions() == saved.revisions()).then_some(made.text)
}

/// Whether a change is one of what the plan says.
fn is_content(change: &Change) -> bool {
    change.what != "comments or layout"
}

/// What may stand in a comment: one line without control characters.
fn one_line(text: &str) -> String {
    text.split(|c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}'))
        .collect::<Vec<_>>()
        .join(" ")
        .trim()
        .to_owned()
}
