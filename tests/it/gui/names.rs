//! Every control of every screen has a name that a screen reader can say.

use super::*;
use egui::accesskit::{Action as Act, Role};
use egui_kittest::kittest::{AccessKitNode, By, NodeT};

/// Whether the keyboard reaches it, or it looks like something to press or type into.
fn is_control(node: &AccessKitNode) -> bool {
    let acts = |action| node.data().supports_action(action);
    egui::accessibility::is_input(node.role()) || acts(Act::Focus) || acts(Act::SetValue) || acts(Act::SetTextSelection)
}

/// Whether it says what it is; the words of plain text are its value.
fn is_named(node: &AccessKitNode) -> bool {
    let says = |words: Option<String>| words.is_some_and(|w| !w.trim().is_empty());
    says(node.label()) || node.labelled_by().next().is_some() || (node.role() == Role::Label && says(node.value()))
}

/// Fails on a control without a name on any screen of the window.
#[track_caller]
pub(super) fn assert_all_named(window: &mut Window, what: &str) {
    for screen in [Screen::Operator, Screen::Results] {
        window.ask(Action::Show(screen));
        window.harness.run_steps(2);
        assert_shown_named(window, &format!("{what} {screen:?}"));
    }
}

/// The same of what is shown now.
#[track_caller]
pub(super) fn assert_shown_named(window: &Window, what: &str) {
    let controls: Vec<_> = window.harness.query_all(By::new().predicate(is_control)).collect();
    // A folded bar alone has four, and no screen is empty.
    assert!(controls.len() > 4, "{what}: {} controls", controls.len());
    let nameless = controls.iter().filter(|node| !is_named(&node.accesskit_node()));
    let nameless: Vec<String> =
        nameless.map(|node| format!("{:?} at {:?}", node.accesskit_node().role(), node.rect())).collect();
    assert!(nameless.is_empty(), "{what}: {nameless:#?}");
}

#[test]
fn every_control_has_a_name_beside_results_too() {
    for size in [[1920.0, 1080.0], [1000.0, 700.0]] {
        let mut window = super::results::results(size);
        assert_all_named(&mut window, &format!("{size:?}"));
        window.ask(Action::Show(Screen::Results));
        window.harness.key_press(egui::Key::N);
        window.harness.run_steps(2);
        assert_shown_named(&window, &format!("{size:?}, a point chosen"));
    }
}

#[test]
fn menus_dialogs_and_messages_have_names() {
    let project = Project::new();
    let mut window = Window::on(&project);
    for menu in ["Open…", "View…"] {
        if window.shows(menu) {
            window.click(menu);
            assert_shown_named(&window, menu);
            window.harness.key_press(egui::Key::Escape);
            window.harness.run_steps(2);
        }
    }
    window.harness.key_press(egui::Key::F1);
    window.harness.run_steps(2);
    assert_shown_named(&window, "help");
    window.harness.key_press(egui::Key::Escape);
    window.ask(Action::TypePath(true));
    window.harness.run_steps(2);
    assert_shown_named(&window, "a typed path");
    window.ask(Action::TypePath(false));
    window.click("Run sequence");
    window.wait("the end", |app| app.facts().last_end.is_some());
    window.ask(Action::Say(shapeline::diagnostic::Diagnostic::warning("there is no such file")));
    window.harness.run_steps(2);
    assert!(window.shows("Got it"));
    assert_shown_named(&window, "a message");
}

#[test]
fn every_control_of_the_engineers_screen_has_a_name() {
    let project = Project::new();
    let mut window = super::engineer::unlocked(&project, &super::engineer::Forward::default());
    window.wait("the plan is checked", super::engineer::checked);
    for section in [
        "Part",
        "CAD",
        "Scans",
        "Background",
        "Alignment",
        "Comparison points",
        "Measuring rig",
        "Uncertainty",
        "Output",
    ] {
        window.click(section);
        assert_shown_named(&window, section);
        // What names a file or folder can be chosen with the system's dialog.
        let files = match section {
            "CAD" => Some("CAD file: Choose…"),
            "Scans" => Some("Scan folder: Choose…"),
            "Output" => Some("Results folder: Choose…"),
            _ => None,
        };
        assert!(files.is_none_or(|button| window.shows(button)), "{section}");
    }
    for dialog in ["Tolerances…", "Mirror…", "CSV…"] {
        window.click(dialog);
        assert_shown_named(&window, dialog);
        window.harness.key_press(egui::Key::Escape);
        window.harness.run_steps(2);
    }
    window.click("Lock now");
    assert_shown_named(&window, "the lock");
}
