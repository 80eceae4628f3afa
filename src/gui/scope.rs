//! What a view may look at, and where it puts what was asked for.

use super::action::{Action, Screen};
use super::facts::{Facts, FinishedPart};
use super::text::Words;
use super::theme::Theme;
use std::sync::Arc;

/// What is looked at: never part of a result, gone with the window.
#[derive(Debug, Clone, Default)]
pub struct ViewState {
    /// The screen.
    pub screen: Screen,
    /// The part looked at, by its place in `Facts::parts`; `None` = always the newest.
    pub part: Option<usize>,
    /// The result from before this start that is looked at instead, by its place among those.
    pub earlier: Option<usize>,
    /// The comparison point looked at, by its place in the plan.
    pub point: Option<usize>,
    /// Whether the list of shortcuts is open.
    pub help: bool,
    /// The path being typed, while its field is open.
    pub typed_path: Option<String>,
    /// What was asked for and waits until somebody says what becomes of work that is not saved.
    pub leaving: Option<Action>,
}

/// All that a view gets: facts and view state to read, a list for what was asked.
pub struct Scope<'a> {
    /// What is so.
    pub facts: &'a Facts,
    /// What is looked at.
    pub view: &'a ViewState,
    /// All words.
    pub words: &'a Words,
    /// All colours.
    pub theme: &'static Theme,
    /// What the person chose to keep.
    pub settings: &'a super::settings::Settings,
    /// Where that is kept.
    pub settings_file: Option<&'a std::path::Path>,
    /// Whether the plan can be changed.
    pub lock: &'a super::engineer::lock::Lock,
    /// What time it is.
    pub now: std::time::Instant,
    /// A field had the focus when the frame began, so its letters are that one's even if it is left in the same frame.
    pub typing: bool,
    /// What was asked for in this frame.
    pub actions: &'a mut Vec<Action>,
}

impl Scope<'_> {
    /// Asks for something.
    pub fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Whether letters of this frame are shortcuts: no field or dialog had or got them. A press of the pointer may just have given the focus
    /// to a field that is drawn later.
    pub fn letters_are_free(&self, ui: &egui::Ui) -> bool {
        let ctx = ui.ctx();
        let moves_focus =
            ctx.input(|i| i.pointer.any_pressed() || i.pointer.any_released() || i.key_pressed(egui::Key::Tab));
        let modal = ctx.memory(|m| m.top_modal_layer().is_some());
        !(self.typing || moves_focus || modal || ctx.text_edit_focused() || egui::Popup::is_any_open(ctx))
    }

    /// The part looked at: the chosen one, else the newest.
    pub fn part(&self) -> Option<&Arc<FinishedPart>> {
        self.view.part.and_then(|k| self.facts.parts.get(k)).or_else(|| self.facts.parts.last())
    }
}
