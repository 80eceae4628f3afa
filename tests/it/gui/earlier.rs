//! Results from before a restart: looked at as what they are, never a verdict of now.

use super::*;
use shapeline::gui::Looked;
use shapeline::report::stored::StoredOutcome;

/// A part with three points out of tolerance and a scan that was refused, inspected before the window opens.
fn inspected_before() -> Project {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    project.write("scans/2.ply", &tiny_scan(2));
    project.run(["run", "demo.toml"]).assert_ended(1, &[]);
    project
}

fn opened(project: &Project, size: [f32; 2]) -> Window {
    let mut window = Window::open(setup(project), size);
    window.wait("the results of before are read", |app| app.facts().earlier.is_some());
    window
}

#[test]
fn results_from_before_a_restart_can_be_looked_at_and_are_no_verdict() {
    let project = inspected_before();
    let mut window = opened(&project, [1280.0, 800.0]);
    assert!(window.shows("Ready") && !window.says("last part") && window.shows("2 scans waiting"));
    assert!(window.shows("Earlier: Fail, 1") && window.shows("Earlier: Refused, 2"));
    window.click("Earlier: Fail, 1");
    assert_eq!((window.app().view().screen, window.app().view().earlier), (Screen::Results, Some(0)));
    assert!(window.shows("Earlier result") && window.says("no verdict of now") && window.shows("3 out"));
    let StoredOutcome::Measured(inspection) = &window.app().facts().earlier_results()[0].stored.outcome else {
        panic!("it was measured")
    };
    let words = shapeline::gui::Words::of(Language::English);
    let point = inspection.points.iter().find(|p| p.verdict == Verdict::Fail).expect("three of them").clone();
    let mm = point.measurement.as_ref().expect("a value").deviation_mm;
    window.click(&format!("{}, Fail, {}", point.name, words.signed_mm(mm)));
    assert!(window.says("out of tolerance beyond doubt") && window.says("inspect the scan again to see them"));
    names::assert_shown_named(&window, "an earlier result");
    window.click("Next");
    assert_eq!(window.app().view().earlier, Some(1));
    let StoredOutcome::Refused(refusal) = window.app().facts().earlier_results()[1].stored.outcome.clone() else {
        panic!("it was refused")
    };
    assert!(window.says(&words.told(&refusal.reason)) && window.says(&words.told(&refusal.help)));
    window.harness.key_press(egui::Key::PageUp);
    window.harness.run_steps(3);
    let before = (project.files("results"), window.app().settings().shift.total());
    window.click("Inspect this scan again");
    window.wait("it is inspected again", |app| app.facts().again.is_some());
    assert!(window.says("Inspected again by the plan as it is now: Fail"));
    assert_eq!((project.files("results"), window.app().settings().shift.total()), before);
    window.ask(Action::Show(Screen::Operator));
    window.harness.run_steps(2);
    assert!(window.shows("Ready") && !window.says("last part"), "it has no say in any verdict");
    // Parts of now stand after those of before, and lead back to them.
    window.ask(Action::Run);
    window.wait("the end", |app| app.facts().last_end.is_some());
    assert!(window.shows("Refused, last part 2 of 2") && window.shows("Earlier: Fail, 1"));
    window.click("Fail, part 1 of 2");
    window.click("Previous");
    assert_eq!(window.app().view().earlier, Some(1));
    assert_eq!(Looked::Earlier(1).step(window.app().facts(), true), Some(Looked::Part(0)));
}

#[test]
fn what_is_not_as_it_was_then_is_told() {
    let project = inspected_before();
    project.change_plan(&[("revision = \"C\"", "revision = \"D\"")]);
    let json = String::from_utf8(project.read("results/1.json")).expect("text");
    project.write("results/1.json", json.replacen("\"points_read\": ", "\"points_read\": 1", 1).as_bytes());
    std::fs::remove_file(project.path("scans/2.ply")).expect("the scan");
    project.write("results/3.json", b"{\"schema\": \"shapeline-result/1\", \"part\":");
    let mut window = opened(&project, [1280.0, 800.0]);
    // Written last, since somebody changed it.
    window.ask(Action::ChooseEarlier(1));
    window.harness.run_steps(3);
    assert!(window.says("revision C then, revision D now") && window.says("changed after it was written"));
    assert!(window.says("1 file of the folder cannot be read as a result"));
    project.add_real_scan("1.ply");
    window.click("Inspect this scan again");
    window.wait("it is looked at", |app| app.facts().message.is_some());
    window.harness.run_steps(2);
    assert!(window.says("The scan has changed since it was inspected") && window.app().facts().again.is_none());
    window.ask(Action::ChooseEarlier(0));
    window.harness.run_steps(3);
    assert!(window.says("Its scan is not in the scan folder any more"));
    window.ask(Action::InspectEarlier(0));
    window.harness.run_steps(3);
    assert!(matches!(window.app().facts().job, Job::Idle), "there is nothing to inspect");
}

#[test]
fn an_empty_results_screen_leads_to_what_was_before() {
    let project = inspected_before();
    let mut window = opened(&project, [480.0, 360.0]);
    window.ask(Action::Show(Screen::Results));
    window.harness.run_steps(2);
    window.click("Show 2 earlier results");
    assert!(window.app().view().earlier == Some(1) && window.says("no verdict of now"));
}

/// What nothing vouches for has no verdict anywhere, a plain lamp is of the plan at hand, and a scan that is inspected again has the verdict of now.
#[test]
fn results_that_nothing_vouches_for_show_no_verdict_and_those_of_another_plan_say_so() {
    let project = inspected_before();
    let json = String::from_utf8(project.read("results/1.json")).expect("text");
    project.write("results/1.json", json.replacen("\"points_read\": ", "\"points_read\": 1", 1).as_bytes());
    let cut = project.read("results/2.json");
    project.write("results/2.json", &cut[..cut.len() / 2]);
    let mut window = opened(&project, [1280.0, 800.0]);
    assert!(window.shows("Earlier: Not trusted, 1") && !window.says("Earlier: Fail"));
    assert!(window.shows("1 results file cannot be read"));
    window.ask(Action::ChooseEarlier(0));
    window.harness.run_steps(3);
    assert!(window.shows("Not trusted") && !window.shows("Fail") && !window.says("in tolerance"), "the header");
    for verdict in [", Fail,", ", Pass,", ", Undecided,", "3 out"] {
        assert!(!window.says(verdict), "{verdict}");
    }
    window.ask(Action::ChoosePoint(Some(0)));
    window.harness.run_steps(3);
    assert!(window.says("Nothing vouches for what the file says"));
    window.click("Inspect this scan again");
    window.wait("it is inspected again", |app| app.facts().again.is_some());
    window.harness.run_steps(2);
    assert!(window.shows("Fail") && window.shows("Inspected again, as of now") && window.shows("3 out"));

    let project = inspected_before();
    project.change_plan(&[("revision = \"C\"", "revision = \"D\"")]);
    let mut window = opened(&project, [1280.0, 800.0]);
    assert!(window.shows("Earlier, by another state of the plan: Fail, 1"));
    window.ask(Action::ChooseEarlier(0));
    window.harness.run_steps(3);
    assert!(window.shows("Earlier, by another plan") && window.says("revision C then, revision D now"));
}
