//! What a person can ask of the window. Views collect these; `App` carries them out, after everything is drawn.

use super::engineer::{Command, Edit};
use super::merge;
use super::new_plan;
use super::settings::ThemeChoice;
use super::text::Language;
use crate::diagnostic::Diagnostic;
use std::path::PathBuf;

/// The screens behind the tabs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Screen {
    /// Is the last part good, and does the line keep up?
    #[default]
    Operator,
    /// Where is it not, and why?
    Results,
    /// What of the plan is to change?
    Engineer,
    /// Several views of a part made one cloud.
    Merge,
}

impl Screen {
    /// In the order of the tabs, of Ctrl+1 to Ctrl+4.
    pub const ALL: [Screen; 4] = [Screen::Operator, Screen::Results, Screen::Engineer, Screen::Merge];

    /// The key of its name among the texts.
    pub fn key(self) -> &'static str {
        match self {
            Screen::Operator => "bar.operator",
            Screen::Results => "bar.results",
            Screen::Engineer => "bar.engineer",
            Screen::Merge => "bar.merge",
        }
    }
}

/// One thing that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Another screen.
    Show(Screen),
    /// Open a plan.
    Open(PathBuf),
    /// Ask the system for a plan's file.
    AskForPlan,
    /// The field for a typed path, open or shut.
    TypePath(bool),
    /// Inspect the scans of the plan, or watch their folder.
    Run,
    /// Inspect these scans by the plan at hand.
    Inspect(Vec<PathBuf>),
    /// Stop after the running part; asked again, at once.
    Stop,
    /// Whether a run watches the folder.
    Watch(bool),
    /// Look at a finished part: its place in `Facts::parts`. `None` = always the newest.
    ChoosePart(Option<usize>),
    /// Look at a comparison point, by its place in the plan.
    ChoosePoint(Option<usize>),
    /// Inspect a part again whose points are not kept any more, so that they can be shown. Its place in `Facts::parts`.
    Fetch(usize),
    /// Look at a result from before this start, by its place among those.
    ChooseEarlier(usize),
    /// Inspect the scan of such a result again, by the plan at hand, writing nothing.
    InspectEarlier(usize),
    /// Light, dark or as the system.
    Theme(ThemeChoice),
    /// Magnify everything.
    Scale(f32),
    /// The language of the window.
    Language(Language),
    /// The list of shortcuts, open or shut.
    Help(bool),
    /// Seconds between two parts of the press, for the plan at hand; `None` = not known.
    Takt(Option<f64>),
    /// Begin the counts of a new shift.
    NewShift,
    /// Show a message.
    Say(Diagnostic),
    /// Put the message away.
    Dismiss,
    /// Change the plan that is edited.
    Edit(Edit),
    /// What else the engineer asks for.
    Engineer(Command),
    /// What is asked of a merge.
    Merge(merge::Command),
    /// Close the window, whatever was asked about it.
    Close,
    /// Make a plan for a new part.
    NewPlan(new_plan::Command),
    /// The whole screen, or a window.
    FullScreen,
}
