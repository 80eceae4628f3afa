//! What the operator is told beside a verdict: in the window's language, whole, of the right folder, and for as long as it matters.

use super::engineer::Forward;
use super::words::{assert_no_english, english};
use super::*;
use shapeline::diagnostic::Diagnostic;
use shapeline::gui::Words;

const OTHERS: [Language; 2] = [Language::German, Language::Swedish];

impl Window {
    /// Runs the sequence to its end, however it ends.
    fn run_through(&mut self) {
        self.ask(Action::Run);
        self.wait("the run begins or fails", |app| app.facts().running().is_some() || app.facts().last_end.is_some());
        self.wait("the end", |app| app.facts().running().is_none() && app.facts().last_end.is_some());
        self.harness.run_steps(2);
    }
}

#[test]
fn the_card_without_a_verdict_speaks_the_windows_language() {
    let english = english();
    for language in OTHERS {
        let words = Words::of(language);
        let project = Project::new();
        project.write("scans/1.ply", &tiny_scan(1));
        let mut window = Window::on(&project);
        window.ask(Action::Language(language));
        for gone in ["scans", "demo.toml"] {
            std::fs::rename(project.path(gone), project.path("away")).unwrap();
            window.run_through();
            let error = window.app().facts().failure().expect("it cannot begin").clone();
            assert!(window.shows(words.text("verdict.no_verdict")), "{language:?} {gone}");
            assert!(window.says(&words.told(&error.message)), "{language:?} {gone}: {error}");
            assert_no_english(&window, &english);
            std::fs::rename(project.path("away"), project.path(gone)).unwrap();
        }
    }
}

#[test]
fn results_that_cannot_be_written_are_told_in_the_windows_language_and_nowhere_as_written() {
    let english = english();
    for language in OTHERS {
        let words = Words::of(language);
        let project = Project::new();
        project.change_plan(&[("folder = \"results\"", "folder = \"share/results\"")]);
        let mut window = Window::open(setup(&project), [1920.0, 1080.0]);
        window.ask(Action::Language(language));
        window.ask(Action::Watch(true));
        window.ask(Action::Run);
        window.wait("watching", |app| app.facts().running().is_some_and(|r| r.watch && r.stage.is_none()));
        project.write("scans/1.ply", &tiny_scan(1));
        window.wait("the first part", |app| app.facts().parts.len() == 1);
        std::fs::rename(project.path("share"), project.path("away")).unwrap();
        project.write("scans/2.ply", &tiny_scan(2));
        window.wait("it is told", |app| app.facts().troubles.results.is_some());
        window.harness.run_steps(2);
        assert!(window.shows(words.text("verdict.no_verdict")));
        assert!(window.shows(words.text("operator.results_are_lost")));
        assert!(!window.shows(words.text("operator.results_are_written")));
        // There was a part: nothing is said of what comes before the first.
        assert!(window.shows(words.text("operator.to_go_on")) && !window.shows(words.text("operator.before")));
        assert_no_english(&window, &english);
        std::fs::rename(project.path("away"), project.path("share")).unwrap();
        window.wait("the second part", |app| app.facts().parts.len() == 2);
    }
}

#[test]
fn a_scan_from_another_folder_is_told_with_its_folder() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    std::fs::create_dir(project.path("elsewhere")).unwrap();
    project.write("elsewhere/1.ply", &tiny_scan(2));
    let mut window = Window::on(&project);
    window.ask(Action::Open(project.path("elsewhere/1.ply")));
    window.wait("the end", |app| app.facts().last_end.is_some());
    let elsewhere = std::path::Path::new("elsewhere").join("1.ply").display().to_string();
    assert!(window.shows(&format!("Last part: 1 of 1, scan {elsewhere}")));
    window.run_through();
    assert!(window.shows("Last part: 1 of 1, scan 1.ply"));
}

#[test]
fn a_warning_goes_once_it_was_seen_and_a_later_part_came_and_an_error_stays() {
    let (project, forward) = (Project::new(), Forward::default());
    project.write("scans/1.ply", &tiny_scan(1));
    let mut window = Window::open(Setup { clock: forward.clock(), ..setup(&project) }, [1280.0, 800.0]);
    window.run_through();
    let told = |window: &Window| window.app().facts().message.as_ref().map(|told| told.message.clone());
    let odd = Some("something is odd".to_owned());
    window.ask(Action::Say(Diagnostic::warning("something is odd")));
    window.harness.run_steps(2);
    assert!(window.says("Something is odd") && window.shows("Got it"));
    forward.by(600);
    window.harness.run_steps(2);
    assert_eq!(told(&window), odd, "nothing came after it");
    window.ask(Action::Dismiss);
    // A watch does not clear what is in sight when it begins.
    window.ask(Action::Watch(true));
    window.ask(Action::Run);
    window.wait("watching", |app| app.facts().running().is_some_and(|r| r.watch && r.stage.is_none()));
    window.ask(Action::Say(Diagnostic::warning("something is odd")));
    window.harness.run_steps(2);
    project.write("scans/2.ply", &tiny_scan(2));
    window.wait("a part", |app| app.facts().parts.len() == 2);
    assert_eq!(told(&window), odd, "it was not in sight for long");
    forward.by(21);
    window.harness.run_steps(2);
    assert_eq!(told(&window), None);
    let bad = Some("something is bad".to_owned());
    window.ask(Action::Say(Diagnostic::error("something is bad")));
    project.write("scans/3.ply", &tiny_scan(3));
    window.wait("another part", |app| app.facts().parts.len() == 3);
    forward.by(600);
    window.harness.run_steps(3);
    assert_eq!(told(&window), bad, "somebody has to see it");
    window.click("Got it");
    assert_eq!(told(&window), None);
}

/// The smallest window: what its card cannot hold stands below it, as soon as nothing runs.
#[test]
fn what_to_do_about_a_refused_part_is_told_whole_in_the_smallest_window() {
    for language in Language::ALL {
        let words = Words::of(language);
        let project = Project::new();
        let scan = real_scan();
        project.write("scans/1.ply", &scan[..scan.len() / 2]);
        let mut window = Window::open(setup(&project), [480.0, 360.0]);
        window.ask(Action::Language(language));
        window.run_through();
        let part = window.app().facts().parts[0].clone();
        let Outcome::Refused(refusal) = &part.result.outcome else { panic!("it is cut off") };
        let help = words.told(&refusal.help);
        let reason = words.told(part.reason(refusal));
        let below = format!("{}. {}", help.trim_end_matches('.'), reason.trim_end_matches('.'));
        assert!(window.shows(&below), "{language:?}: {below}");
    }
}
