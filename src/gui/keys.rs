//! The keyboard: one table, which the keys and the list of shortcuts (F1) share.

use super::action::{Action, Screen};
use super::earlier::Looked;
use super::engineer::{Command, Edit};
use super::facts::{Facts, Job};
use super::merge;
use super::scope::ViewState;
use super::settings::SCALES;
use egui::{Key, Modifiers};

/// Shortcuts that hold on every screen: keys as people read them, and the key of what they do among the texts.
pub(super) const EVERYWHERE: &[(&str, &str)] = &[
    ("F5", "help.run"),
    ("Esc", "help.stop"),
    ("F7", "help.watch"),
    ("F1", "help.help"),
    ("F11", "help.full_screen"),
    ("Ctrl+O", "help.open"),
    ("Ctrl+1 … 4", "help.screens"),
    ("Page up, Page down", "help.parts"),
    ("Ctrl +, Ctrl −", "help.scale"),
    ("Tab, Enter", "help.controls"),
];

/// Shortcuts of the results screen, which act while no field has the focus.
pub(super) const RESULTS: &[(&str, &str)] = &[
    ("N, Shift+N", "help.next_out"),
    ("1 … 6, 0", "help.views"),
    ("F, P", "help.fit"),
    ("←↑↓→, Shift", "help.orbit"),
    ("+, −", "help.zoom"),
    ("M", "help.measure"),
    ("Ctrl+C", "help.copy_picture"),
    ("Ctrl+Shift+S", "help.save_picture"),
];

/// Shortcuts of the engineer's screen; single letters act while no field has the focus.
pub(super) const ENGINEER: &[(&str, &str)] = &[
    ("Ctrl+Z, Ctrl+Y", "help.undo_redo"),
    ("Ctrl+S", "help.save_plan"),
    ("F6", "help.try_plan"),
    ("S, E, H, A, V, M", "help.tools"),
    ("Enter, Esc", "help.take_point"),
    ("Delete", "help.remove_rows"),
    ("Shift, Ctrl, Ctrl+A", "help.choose_rows"),
    ("Alt+↑↓, F2", "help.move_row"),
];

/// Shortcuts of the merge screen; its clouds take those of the results' views, too.
pub(super) const MERGE: &[(&str, &str)] = &[("F5, Esc", "help.merge")];

/// Turns keys into actions.
///
/// `typing`: a field has the focus, or had it when the last frame ended.
pub(super) fn collect(
    ctx: &egui::Context,
    facts: &Facts,
    view: &ViewState,
    typing: bool,
    scale: f32,
    watch: bool,
    actions: &mut Vec<Action>,
) {
    let pressed = |modifiers: Modifiers, key| ctx.input_mut(|i| i.consume_key(modifiers, key));
    if pressed(Modifiers::NONE, Key::F1) {
        actions.push(Action::Help(!view.help));
    }
    if pressed(Modifiers::NONE, Key::F5) {
        actions.push(if view.screen == Screen::Merge { Action::Merge(merge::Command::Merge) } else { Action::Run });
    }
    if pressed(Modifiers::NONE, Key::F7) {
        actions.push(Action::Watch(!watch));
    }
    if pressed(Modifiers::NONE, Key::F11) {
        actions.push(Action::FullScreen);
    }
    if pressed(Modifiers::COMMAND, Key::O) {
        actions.push(Action::AskForPlan);
    }
    for (key, screen) in [Key::Num1, Key::Num2, Key::Num3, Key::Num4].into_iter().zip(Screen::ALL) {
        if pressed(Modifiers::COMMAND, key) {
            actions.push(Action::Show(screen));
        }
    }
    let larger = pressed(Modifiers::COMMAND, Key::Plus) || pressed(Modifiers::COMMAND, Key::Equals);
    if larger && let Some(next) = SCALES.iter().find(|s| **s > scale + 0.01) {
        actions.push(Action::Scale(*next));
    }
    if pressed(Modifiers::COMMAND, Key::Minus)
        && let Some(next) = SCALES.iter().rev().find(|s| **s < scale - 0.01)
    {
        actions.push(Action::Scale(*next));
    }
    if view.screen == Screen::Engineer && facts.editing.is_some() && view.leaving.is_none() {
        let again = pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y);
        if again {
            actions.push(Action::Edit(Edit::Redo));
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            actions.push(Action::Edit(Edit::Undo));
        }
    }
    // Esc takes away what lies on top before it stops anything.
    let on_top = view.help || view.typed_path.is_some();
    let trying = matches!(facts.job, Job::Trying { .. });
    let merging = matches!(facts.job, Job::Merging(_));
    let modal = ctx.memory(|m| m.top_modal_layer().is_some());
    let owned = typing || modal || egui::Popup::is_any_open(ctx);
    if (on_top || ((trying || merging || facts.running().is_some()) && !owned)) && pressed_anew(ctx, Key::Escape) {
        actions.push(match () {
            () if view.help => Action::Help(false),
            () if view.typed_path.is_some() => Action::TypePath(false),
            () if merging => Action::Merge(merge::Command::Stop),
            () if trying => Action::Engineer(Command::StopTrying),
            () => Action::Stop,
        });
    }
    let looked = match view.earlier {
        Some(k) => Some(Looked::Earlier(k)),
        None => facts.parts.len().checked_sub(1).map(|last| Looked::Part(view.part.unwrap_or(last).min(last))),
    };
    if let Some(at) = looked.filter(|_| view.screen == Screen::Results) {
        for (key, forward) in [(Key::PageUp, false), (Key::PageDown, true)] {
            if pressed(Modifiers::NONE, key) {
                actions.push(at.step(facts, forward).unwrap_or(at).action());
            }
        }
    }
}

/// Whether a key went down, and was not only held: who holds Esc wants to stop after the part, not at once.
fn pressed_anew(ctx: &egui::Context, wanted: Key) -> bool {
    ctx.input_mut(|input| {
        let anew = input.events.iter().any(|event| {
            matches!(event, egui::Event::Key { key, pressed: true, repeat: false, modifiers, .. }
                if *key == wanted && modifiers.is_none())
        });
        input.consume_key(Modifiers::NONE, wanted);
        anew
    })
}
