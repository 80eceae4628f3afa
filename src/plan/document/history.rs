//! Undo and redo: every step keeps the text on its other side.

use std::collections::VecDeque;
use std::fmt;

/// Steps that can be taken back.
const MOST_STEPS: usize = 500;
/// Texts kept for that, bytes.
const MOST_BYTES: usize = 64 << 20;

/// What an edit does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verb {
    /// Something is there that was not.
    Add,
    /// Something is no longer there.
    Remove,
    /// A point or feature has another place.
    Move,
    /// It has another name.
    Rename,
    /// A value is another.
    Change,
    /// The order is another.
    Reorder,
    /// The plan is that of the other hand.
    Mirror,
    /// Points came from a table.
    Import,
    /// The text was typed.
    Edit,
    /// An autosaved text was taken.
    Recover,
}

impl Verb {
    /// The word.
    pub fn word(self) -> &'static str {
        match self {
            Verb::Add => "Add",
            Verb::Remove => "Remove",
            Verb::Move => "Move",
            Verb::Rename => "Rename",
            Verb::Change => "Change",
            Verb::Reorder => "Reorder",
            Verb::Mirror => "Mirror",
            Verb::Import => "Import",
            Verb::Edit => "Edit",
            Verb::Recover => "Recover",
        }
    }
}

/// The name of an edit: `Move P03`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// What was done.
    pub verb: Verb,
    /// To what.
    pub what: String,
}

impl Step {
    /// A step.
    pub fn new(verb: Verb, what: impl Into<String>) -> Self {
        Self { verb, what: what.into() }
    }

    /// A step of several things: the only one by its name, more by their number.
    pub(super) fn of_many(verb: Verb, names: &[String], plural: &str) -> Self {
        match names {
            [only] => Self::new(verb, only.as_str()),
            _ => Self::new(verb, format!("{} {plural}", names.len())),
        }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.verb.word(), self.what)
    }
}

/// A step and the text on its other side.
#[derive(Debug, Clone)]
struct Entry {
    step: Step,
    text: String,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Gesture {
    #[default]
    None,
    /// Begun, nothing edited yet.
    Begun,
    /// Its step is the last one done.
    Open,
}

/// The steps of a document.
#[derive(Debug, Clone, Default)]
pub(super) struct History {
    done: VecDeque<Entry>,
    undone: Vec<Entry>,
    gesture: Gesture,
}

impl History {
    /// Notes a step that was done to a text.
    pub fn note(&mut self, step: Step, before: String) {
        self.undone.clear();
        match self.gesture {
            Gesture::Open => return,
            Gesture::Begun => self.gesture = Gesture::Open,
            Gesture::None => {}
        }
        self.done.push_back(Entry { step, text: before });
        let mut bytes: usize = self.done.iter().map(|entry| entry.text.len()).sum();
        while self.done.len() > MOST_STEPS || bytes > MOST_BYTES {
            let Some(oldest) = self.done.pop_front() else { break };
            bytes -= oldest.text.len();
        }
    }

    pub fn undo(&mut self, text: &mut String) -> Option<Step> {
        self.gesture = Gesture::None;
        let Entry { step, text: before } = self.done.pop_back()?;
        self.undone.push(Entry { step: step.clone(), text: std::mem::replace(text, before) });
        Some(step)
    }

    pub fn redo(&mut self, text: &mut String) -> Option<Step> {
        self.gesture = Gesture::None;
        let Entry { step, text: after } = self.undone.pop()?;
        self.done.push_back(Entry { step: step.clone(), text: std::mem::replace(text, after) });
        Some(step)
    }

    pub fn undo_step(&self) -> Option<&Step> {
        self.done.back().map(|entry| &entry.step)
    }

    pub fn redo_step(&self) -> Option<&Step> {
        self.undone.last().map(|entry| &entry.step)
    }

    pub fn begin_gesture(&mut self) {
        self.gesture = Gesture::Begun;
    }

    pub fn end_gesture(&mut self) {
        self.gesture = Gesture::None;
    }

    /// Every text becomes what a function makes of it, up to the first of which it makes nothing: what lies beyond is forgotten.
    pub fn rewrite(&mut self, with: impl Fn(&str) -> Option<String>) {
        // The nearest texts stand last in both.
        let kept = |entry: Entry| Some(Entry { text: with(&entry.text)?, step: entry.step });
        let mut done: VecDeque<Entry> = std::mem::take(&mut self.done).into_iter().rev().map_while(kept).collect();
        done.make_contiguous().reverse();
        self.done = done;
        let mut undone: Vec<Entry> = std::mem::take(&mut self.undone).into_iter().rev().map_while(kept).collect();
        undone.reverse();
        self.undone = undone;
    }

    /// Whether the text is another one again.
    pub fn drop_gesture(&mut self, text: &mut String) -> bool {
        let edited = std::mem::take(&mut self.gesture) == Gesture::Open;
        if let Some(Entry { text: before, .. }) = self.done.pop_back_if(|_| edited) {
            *text = before;
        }
        edited
    }
}
