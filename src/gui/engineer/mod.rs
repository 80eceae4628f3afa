//! The engineer's screen: what of the plan is to change, and what it costs.
//!
//! `Facts::editing` is the plan as it is edited; `EngineerView` is what is looked at. Everything that changes the plan is an
//! `Action::Edit`, and only while the screen is unlocked.

mod act;
mod alignment_form;
mod choose_file;
pub mod desk;
pub mod dialogs;
pub mod editing;
mod fields;
mod form;
mod header;
mod labels;
mod layout;
pub mod lock;
mod lower;
mod row_form;
mod save;
mod section_form;
pub mod state;
mod table;
mod told;
mod tree;
mod trial;
mod uncertainty;
mod unlock;
mod upkeep;
pub mod view3d;

pub use act::Command;
pub use editing::{Edit, Editing};
pub use layout::HEADER;
pub use state::{Chosen, Draft, EngineerView, Pane, Section, Tool};
pub(in crate::gui) use {
    act::command, act::edit, act::reload, save::leave_ui, trial::fault, trial::short_name, upkeep::tick,
};

use super::action::Action;
use super::fonts;
use super::scope::Scope;
use super::theme::size;
use super::widgets::words as write;
use egui::{Align2, Key, Modifiers, Rect, Ui};
pub(super) use header::panes_ui;
use layout::Breadth;

/// Draws the screen.
pub(super) fn engineer_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView) {
    if !scope.lock.is_open(scope.now) {
        return unlock::unlock_ui(ui, scope, view);
    }
    let facts = scope.facts;
    let Some(editing) = &facts.editing else { return nothing_ui(ui, scope, view) };
    let all = ui.max_rect();
    let places = layout::places(all, view.pane);
    header::header_ui(ui, places.header, places.breadth, scope, view, editing);
    body_ui(ui, all, scope, view, editing);
    save::save_ui(ui, scope, view, editing);
    save::recovery_ui(ui, scope, editing);
    keys(ui, scope, view, editing);
}

/// The screen below its header, whose place stays free.
pub(super) fn body_ui(ui: &mut Ui, all: Rect, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let wants_form = std::mem::take(&mut view.wants_form);
    // A field that is to be typed into must be in sight.
    if (wants_form || view.focus.is_some()) && layout::places(all, view.pane).breadth == Breadth::Single {
        view.pane = Pane::Form;
    }
    let places = layout::places(all, view.pane);
    if let Some(tree) = places.tree {
        tree::tree_ui(ui, tree, places.breadth, scope, view, editing);
    }
    if let Some(at) = places.view {
        // Where the form is not in sight, what is proposed can be taken all the same.
        let foot = if places.form.is_none() && view.draft.is_some() { form::TAKE + 8.0 } else { 0.0 };
        view3d::view_ui(ui, at.with_max_y(at.bottom() - foot), scope, view);
        if foot > 0.0 {
            form::take_below_ui(ui, at.with_min_y(at.bottom() - foot), scope, view, editing);
        }
    }
    lower::lower_ui(ui, &places, scope, view, editing);
    if let Some(form) = places.form {
        form::form_ui(ui, form, scope, view, editing);
    }
    fields::end_typing(ui, scope, view);
    dialogs::dialogs_ui(ui, scope, view);
}

/// How much of the screen stands beside each other in a place.
pub(super) fn breadth(all: Rect, view: &EngineerView) -> Breadth {
    layout::places(all, view.pane).breadth
}

/// While the plan is opened, or where there is none.
fn nothing_ui(ui: &mut Ui, scope: &Scope, view: &EngineerView) {
    let text = match &view.unreadable {
        Some(told) => {
            let help = told.help.as_deref().map(|help| scope.words.told(help)).unwrap_or_default();
            format!("{}. {help}", scope.words.told(&told.message))
        }
        None if scope.facts.plan_path.is_none() => scope.words.text("engineer.no_plan").to_owned(),
        None => scope.words.text("engineer.opening").to_owned(),
    };
    let at = ui.max_rect().shrink(32.0);
    write::block(ui, at, Align2::CENTER_CENTER, &text, fonts::regular(size::CARD), scope.theme.quiet, 5);
}

/// Keys of the screen; all but Delete hold in fields, too.
fn keys(ui: &Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    if scope.view.help || view.saving.is_some() || view.dialogs.is_open() || scope.view.leaving.is_some() {
        return;
    }
    let pressed = |modifiers: Modifiers, key: Key| ui.input_mut(|i| i.consume_key(modifiers, key));
    if pressed(Modifiers::NONE, Key::F6) {
        scope.ask(Action::Engineer(Command::Try));
    }
    if let Some(list) = view.chosen.list
        && scope.letters_are_free(ui)
        && pressed(Modifiers::NONE, Key::Delete)
    {
        scope.ask(Action::Edit(Edit::Remove(list, view.chosen.rows.clone())));
    }
    if pressed(Modifiers::COMMAND, Key::S) && save::may_save(editing).is_ok() {
        view.ask_to_save(Some(editing));
    }
}
