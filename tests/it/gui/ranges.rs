//! Numbers out of their range are told where they are typed, and not taken.

use super::engineer::{Forward, checked, unlocked};
use super::*;
use egui::accesskit::Role;
use egui_kittest::kittest::By;
use shapeline::diagnostic::Severity;
use shapeline::plan::document::{FieldValue, List};

/// The text of the window in English.
fn text(key: &'static str) -> &'static str {
    shapeline::gui::Words::of(Language::English).text(key)
}

impl Window {
    /// Types over what stands in the field of that name.
    #[track_caller]
    fn over(&mut self, label: &str, text: &str) {
        self.harness.get(By::new().role(Role::TextInput).label(label)).focus();
        self.harness.run_steps(3);
        self.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::A);
        self.harness.run_steps(2);
        self.harness.event(egui::Event::Text(text.to_owned()));
        self.harness.run_steps(3);
    }
}

#[test]
fn a_limit_of_many_points_that_no_plan_may_have_is_told_at_its_field() {
    let project = Project::new();
    let mut window = unlocked(&project, &Forward::default());
    window.wait("the plan is checked", checked);
    let view = window.harness.state_mut().as_mut().expect("open").engineer_mut();
    view.choose(List::Comparison, 0);
    view.chosen.rows = vec![0, 1, 2];
    window.harness.run_steps(3);
    window.over(text("setting.upper"), "2000000");
    let told_of = |app: &App, severity: Severity| {
        let problems = &app.facts().editing.as_ref().expect("a plan").problems;
        problems.iter().filter(|p| p.diagnostic.severity == severity).count()
    };
    window.wait("the plan is checked", |app| told_of(app, Severity::Error) == 3);
    let told = window.harness.query_all_by_label_contains("expected a number in mm between").count();
    // Once at the field, and once a point in the list of problems.
    assert_eq!(told, 4);
    window.over(text("setting.upper"), "5000");
    window
        .wait("the plan is checked", |app| told_of(app, Severity::Error) == 0 && told_of(app, Severity::Warning) >= 3);
    assert_eq!(window.harness.query_all_by_label_contains("farther off than sheet metal can be").count(), 4);
}

#[test]
fn the_dialog_for_limits_takes_none_that_no_plan_may_have() {
    let project = Project::new();
    let mut window = unlocked(&project, &Forward::default());
    window.wait("the plan is checked", checked);
    window.click("Tolerances…");
    window.over(text("tables.upper"), "1e300");
    assert!(window.says(text("tables.limit_too_large")));
    window.harness.key_press(egui::Key::Enter);
    window.harness.run_steps(3);
    let rows = window.app().facts().editing.as_ref().expect("a plan").rows(List::Comparison);
    assert!(rows.iter().all(|row| row.value("upper_mm") != Some(&FieldValue::Number(1e300))));
}

#[test]
fn the_range_of_the_map_and_the_takt_take_no_slip_of_the_pen() {
    let mut window = super::results::results([1280.0, 800.0]);
    window.wait_to_show(text("results.range"));
    window.over(text("results.range"), "5000");
    assert!(window.says(text("results.no_range")) && !window.shows(text("results.as_in_plan")));
    window.over(text("results.range"), "2");
    assert!(!window.says(text("results.no_range")) && window.shows(text("results.as_in_plan")));
    window.click("View…");
    window.over(text("view.takt"), "1e6");
    assert!(window.says(text("view.no_takt")));
    let takt = |window: &Window| {
        let app = window.app();
        app.facts().plan_path.as_ref().and_then(|path| app.settings().takt_s(path))
    };
    assert_eq!(takt(&window), None);
    window.over(text("view.takt"), "12");
    assert_eq!(takt(&window), Some(12.0));
}
