//! The results screen: rows, card, flags, filter, keys, layouts.

use super::*;
use shapeline::gui::Words;
use shapeline::inspect::{Inspection, PointResult};

/// A window of a size on the results of the demo's third scan, which has three points out of tolerance, and of its first.
pub(super) fn results(size: [f32; 2]) -> Window {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/01_good_top.ply"));
    project.write("scans/2.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    let mut window = Window::open(setup(&project), size);
    window.ask(Action::Run);
    window.wait("the end of the sequence", |app| app.facts().last_end.is_some());
    window.ask(Action::Show(Screen::Results));
    window
}

fn inspection(window: &Window) -> Inspection {
    match &window.app().facts().parts[1].result.outcome {
        Outcome::Measured(inspection) => (**inspection).clone(),
        Outcome::Refused(refusal) => panic!("{refusal}"),
    }
}

fn deviation(point: &PointResult) -> String {
    let mm = point.measurement.as_ref().expect("measured").deviation_mm;
    Words::of(Language::English).signed_mm(mm)
}

/// The name of a point's row.
fn row(point: &PointResult) -> String {
    let verdict = match point.verdict {
        Verdict::Pass => "Pass",
        Verdict::Fail => "Fail",
        Verdict::Undecided => "Undecided",
        Verdict::NotMeasured => "Not measured",
    };
    format!("{}, {verdict}, {}", point.name, deviation(point))
}

/// Draws until something is shown.
#[track_caller]
fn until_shown(window: &mut Window, label: &str) {
    let start = Instant::now();
    while !window.shows(label) {
        assert!(start.elapsed() < PATIENCE, "never shown: {label}");
        window.harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_worst_stand_first_and_a_row_tells_why() {
    let mut window = results([1920.0, 1080.0]);
    let inspection = inspection(&window);
    let mut out: Vec<&PointResult> = inspection.points.iter().filter(|p| p.verdict == Verdict::Fail).collect();
    out.sort_by(|a, b| b.tolerance_ratio().unwrap().total_cmp(&a.tolerance_ratio().unwrap()));
    assert_eq!(out.len(), 3);
    let top = |label: &str| window.harness.get_by_label(label).rect().top();
    let heights: Vec<f32> = out.iter().map(|p| top(&row(p))).collect();
    assert!(heights.windows(2).all(|w| w[0] < w[1]), "{heights:?}");
    assert!(window.shows("3 out") && window.shows("Bracket RH, 4711-02, revision C"));
    assert!(window.says("Choose a point"));

    window.click(&row(out[1]));
    assert_eq!(window.app().view().point, inspection.points.iter().position(|p| p.name == out[1].name));
    let kind = match out[1].kind {
        "surface" => "surface",
        "edge" => "trimmed edge",
        _ => "hole",
    };
    assert!(window.shows(&format!("{}, {kind}, fail", out[1].name)));
    assert!(window.says("out of tolerance beyond doubt") && window.shows(&format!("Trend of {}, mm", out[1].name)));
}

#[test]
fn keys_and_flags_choose_points_and_parts() {
    let mut window = results([1920.0, 1080.0]);
    let inspection = inspection(&window);
    until_shown(&mut window, "No data");
    window.harness.key_press(egui::Key::N);
    window.harness.run_steps(2);
    let first = window.app().view().point.expect("chosen");
    assert_eq!(inspection.points[first].verdict, Verdict::Fail);
    window.harness.key_press(egui::Key::N);
    window.harness.run_steps(2);
    let second = window.app().view().point.expect("chosen");
    assert!(second != first && inspection.points[second].verdict == Verdict::Fail);
    window.harness.key_press_modifiers(egui::Modifiers::SHIFT, egui::Key::N);
    window.harness.run_steps(2);
    assert_eq!(window.app().view().point, Some(first));

    // The whole part again, so that its worst points have their flags.
    window.harness.key_press(egui::Key::F);
    window.harness.run_steps(60);
    let chosen = &inspection.points[second];
    window.click(&format!("{} {}", chosen.name, deviation(chosen)));
    assert_eq!(window.app().view().point, Some(second));

    window.harness.key_press(egui::Key::PageUp);
    window.harness.run_steps(2);
    assert_eq!(window.app().view().part, Some(0));
    assert!(window.shows("Part 1 of 2"));
    window.click("Next");
    assert!(window.shows("Part 2 of 2"));
}

#[test]
fn a_filter_leaves_what_it_names_and_says_when_nothing_is_left() {
    let mut window = results([1400.0, 900.0]);
    let inspection = inspection(&window);
    let named = |name: &str| inspection.points.iter().find(|p| p.name == name).expect("a point of the demo");
    let type_in = |window: &mut Window, text: &str| {
        window.harness.get_by_label("Filter").click();
        window.harness.run_steps(2);
        window.harness.get_by_label("Filter").type_text(text);
        window.harness.run_steps(2);
    };
    type_in(&mut window, "edge");
    assert!(window.shows(&row(named("E03"))) && !window.shows(&row(named("P08"))));
    // Letters typed into a field are no shortcuts.
    type_in(&mut window, " nonsense");
    assert!(window.shows("No point matches") && window.app().view().point.is_none());
    window.click("Clear filter");
    assert!(window.shows(&row(named("P08"))));
}

#[test]
fn a_narrow_window_shows_one_thing_at_a_time_in_every_language() {
    let mut window = results([1000.0, 700.0]);
    assert!(!window.says("Choose a point"));
    window.click("Why");
    assert!(window.shows("Choose a point to see why it has its verdict"));
    window.click("Points");
    assert!(window.shows("Comparison points"));
    for (language, words) in [(Language::Swedish, "Jämförelsepunkter"), (Language::German, "Vergleichspunkte")] {
        window.ask(Action::Language(language));
        window.harness.run_steps(2);
        assert!(window.shows(words), "{words}");
    }
}

#[test]
fn the_part_looked_at_stays_when_another_one_arrives() {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/01_good_top.ply"));
    project.write("scans/2.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    let mut window = Window::open(setup(&project), [1280.0, 800.0]);
    window.ask(Action::Show(Screen::Results));
    assert!(window.says("No part inspected yet"));
    window.ask(Action::Run);
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    window.wait("the end of the sequence", |app| app.facts().last_end.is_some());
    assert!(window.shows("Part 1 of 2"));
    // Who comes back from another screen finds the newest.
    window.ask(Action::Show(Screen::Operator));
    window.harness.run_steps(3);
    window.ask(Action::Show(Screen::Results));
    window.harness.run_steps(4);
    assert!(window.shows("Part 2 of 2"));
}
