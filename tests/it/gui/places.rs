//! Where controls stand: none over another, none outside of the window, no field too narrow for its number; in every language, from the
//! smallest window to two screens. A window at 250 % is one of a smaller size here.

use super::engineer::{Forward, checked, unlocked};
use super::*;
use egui::accesskit::Role;
use egui_kittest::kittest::{By, NodeT};
use shapeline::gui::Words;
use shapeline::plan::document::List;

/// Windows in points: the smallest, 1280 x 800 at 250, 200 and 150 %, 1920 x 1080 at 250 and 150 %, those at which layouts change, two screens.
const SIZES: [[f32; 2]; 17] = [
    [480.0, 360.0],
    [512.0, 360.0],
    [639.0, 420.0],
    [640.0, 400.0],
    [768.0, 432.0],
    [799.0, 600.0],
    [800.0, 600.0],
    [853.0, 533.0],
    [999.0, 700.0],
    [1000.0, 700.0],
    [1199.0, 700.0],
    [1200.0, 480.0],
    [1280.0, 800.0],
    [1599.0, 900.0],
    [1600.0, 900.0],
    [1920.0, 1080.0],
    [3840.0, 2160.0],
];

const PRESSED: [Role; 6] =
    [Role::Button, Role::Tab, Role::TextInput, Role::ComboBox, Role::CheckBox, Role::RadioButton];

/// All controls whose middle stands above a height: what they are called, and where they stand.
fn controls(window: &Window, above: f32) -> Vec<(String, egui::Rect)> {
    let pressed = By::new().predicate(|node| PRESSED.contains(&node.role()));
    let all = window.harness.query_all(pressed).map(|node| {
        let at = node.accesskit_node();
        (format!("{:?} {}", at.role(), at.label().unwrap_or_default()), node.rect())
    });
    all.filter(|(_, place)| place.center().y < above).collect()
}

/// Fails where a control lies over another or leaves the window.
#[track_caller]
fn assert_apart(window: &Window, above: f32, size: [f32; 2], what: &str) {
    let inside = egui::Rect::from_min_size(egui::Pos2::ZERO, size.into()).expand(0.5);
    let all = controls(window, above);
    assert!(all.len() >= 4, "{what}: {all:?}");
    for (k, (a, at)) in all.iter().enumerate() {
        assert!(inside.contains_rect(*at), "{what} {size:?}: {a} at {at:?} leaves the window");
        for (b, place) in &all[k + 1..] {
            let common = at.shrink(0.5).intersect(place.shrink(0.5));
            assert!(!common.is_positive(), "{what} {size:?}: {a} at {at:?} and {b} at {place:?}");
        }
    }
}

#[test]
fn no_control_lies_over_another_in_any_window_and_language() {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/01_good_top.ply"));
    project.write("scans/2.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    let mut window = unlocked(&project, &Forward::default());
    window.wait("the plan is checked", checked);
    window.ask(Action::Run);
    window.wait("the end of the sequence", |app| app.facts().last_end.is_some());
    window.ask(Action::ChoosePoint(Some(0)));
    for language in Language::ALL {
        window.ask(Action::Language(language));
        for size in SIZES {
            window.harness.set_size(size.into());
            for screen in [Screen::Operator, Screen::Results, Screen::Engineer] {
                window.ask(Action::Show(screen));
                window.harness.run_steps(3);
                let what = format!("{language:?} {screen:?}");
                // Below the bars stand lists that are scrolled: their rows go on where nobody sees them.
                let above = if screen == Screen::Operator { size[1] } else { 190.0_f32.min(0.55 * size[1]) };
                assert_apart(&window, above, size, &what);
            }
            panes_stand_apart(&mut window, size, language);
            places_are_whole(&mut window, size, language);
        }
    }
}

/// A result from before this start, measured and refused, and the way to it.
#[test]
fn what_is_told_of_an_earlier_result_stands_apart_in_any_window_and_language() {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    project.write("scans/2.ply", &tiny_scan(2));
    project.run(["run", "demo.toml"]).assert_ended(1, &[]);
    project.change_plan(&[("revision = \"C\"", "revision = \"D\"")]);
    let mut window = Window::on(&project);
    window.wait("the results of before are read", |app| app.facts().earlier.is_some());
    for language in Language::ALL {
        window.ask(Action::Language(language));
        for size in SIZES {
            window.harness.set_size(size.into());
            for earlier in [0, 1] {
                window.ask(Action::Show(Screen::Operator));
                window.harness.run_steps(2);
                assert_apart(&window, size[1], size, &format!("{language:?} operator"));
                window.ask(Action::ChooseEarlier(earlier));
                window.ask(Action::ChoosePoint(Some(0)));
                window.harness.run_steps(3);
                let above = 190.0_f32.min(0.55 * size[1]);
                assert_apart(&window, above, size, &format!("{language:?} earlier {earlier}"));
            }
        }
    }
}

/// Each thing that a small window shows alone.
#[track_caller]
fn panes_stand_apart(window: &mut Window, size: [f32; 2], language: Language) {
    let words = Words::of(language);
    for key in ["engineer.plan", "engineer.tab_form", "engineer.problems", "results.tab_scene"] {
        let tab = By::new().role(Role::Tab).label(words.text(key));
        let Some(node) = window.harness.query_all(tab).next() else { continue };
        node.click();
        window.harness.run_steps(3);
        let above = if key == "engineer.tab_form" { 110.0 } else { 0.55 * size[1] };
        assert_apart(window, above, size, &format!("{language:?}, {key}"));
    }
}

/// The form of a point is reached in every window, and the fields of its place hold a metre with its micrometres.
#[track_caller]
fn places_are_whole(window: &mut Window, size: [f32; 2], language: Language) {
    let words = Words::of(language);
    let form = By::new().role(Role::Tab).label(words.text("engineer.tab_form"));
    let alone = window.harness.query_all(form).next().inspect(|node| node.click()).is_some();
    window.harness.state_mut().as_mut().expect("open").engineer_mut().choose(List::Comparison, 0);
    window.harness.run_steps(3);
    let place = words.text("setting.position");
    for axis in ["x", "y", "z"] {
        let label = format!("{place} {axis}");
        let field = window.harness.query_all_by_label(&label).next();
        let field = field.unwrap_or_else(|| panic!("{language:?} {size:?}: no field {label}, form alone: {alone}"));
        let rect = field.rect();
        assert!(rect.width() >= 80.0 && rect.right() <= size[0] - 16.0, "{language:?} {size:?}: {label} {rect:?}");
    }
    if alone {
        let scene = By::new().role(Role::Tab).label(words.text("results.tab_scene"));
        window.harness.get(scene).click();
        window.harness.run_steps(2);
    }
}

#[test]
fn no_control_of_a_merge_lies_over_another_in_any_window_and_language() {
    let views = super::super::merge::Views::new();
    views.settings("[mask]\nd_cal = { max = 100.0 }\n[[feature]]\nkind = \"plane\"\n");
    let setup = Setup { plan: Some(views.path("merge.toml")), ..Setup::default() };
    let mut window = Window::open(setup, [1280.0, 800.0]);
    window.wait("the views are read", |app| {
        app.facts().merging.as_ref().is_some_and(|m| m.preview().is_some() && m.worth.is_some())
    });
    window.ask(Action::Merge(shapeline::gui::merge::Command::Merge));
    window.wait("the merge has ended", |app| matches!(app.facts().job, Job::Idle));
    window.ask(Action::Merge(shapeline::gui::merge::Command::Mask(
        shapeline::plan::merge::Metric::CalibrationDistance,
        Some(80.0),
    )));
    for language in Language::ALL {
        window.ask(Action::Language(language));
        let words = Words::of(language);
        for size in SIZES {
            window.harness.set_size(size.into());
            window.harness.run_steps(3);
            assert_apart(&window, 0.42 * size[1], size, &format!("{language:?}, a merge"));
            for key in ["merge.masks", "results.tab_scene", "merge.study", "merge.result", "merge.views"] {
                let tab = By::new().role(Role::Tab).label(words.text(key));
                let Some(node) = window.harness.query_all(tab).next() else { continue };
                node.click();
                window.harness.run_steps(3);
                assert_apart(&window, 0.6 * size[1], size, &format!("{language:?}, {key}"));
            }
        }
    }
}

#[test]
fn what_the_bar_holds_can_be_reached_where_it_is_folded() {
    let project = Project::new();
    let mut window = Window::open(setup(&project), [480.0, 360.0]);
    assert!(!window.shows("View…") && window.shows("Results"));
    window.click("Menu");
    window.click("View…");
    window.click("Dark");
    assert_eq!(window.app().settings().theme, shapeline::gui::ThemeChoice::Dark);
    window.click("Back");
    window.click("Open…");
    assert!(window.shows("New plan…"));
    window.click("Back");
    window.click("Help");
    assert!(window.app().view().help && !window.shows("Open…"));
}

#[test]
fn letters_that_belong_to_a_field_are_no_shortcuts() {
    let mut window = super::results::results([1920.0, 1080.0]);
    window.ask(Action::ChoosePoint(None));
    let letter = |key| egui::Event::Key {
        key,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: egui::Modifiers::NONE,
    };
    window.harness.get_by_label("Filter").focus();
    window.harness.run_steps(3);
    // All of it comes in one frame; after Enter the field has no focus any more.
    let events = [egui::Event::Text("p".into()), letter(egui::Key::Enter), letter(egui::Key::N)];
    window.harness.input_mut().events.extend(events);
    window.harness.run_steps(3);
    assert_eq!(window.app().view().point, None, "the letter was the field's");
    window.harness.key_press(egui::Key::N);
    window.harness.run_steps(2);
    assert!(window.app().view().point.is_some(), "now it is a shortcut");
    // A dialog owns Esc while a sequence runs.
    window.ask(Action::Run);
    window.ask(Action::TypePath(true));
    window.harness.run_steps(2);
    window.harness.key_press(egui::Key::Escape);
    window.harness.run_steps(2);
    assert!(window.app().view().typed_path.is_none());
    window.wait("the end of the sequence", |app| app.facts().last_end.is_some());
    assert_eq!(window.verdicts().len(), 2, "it was not stopped");
}
