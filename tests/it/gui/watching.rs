//! The scan folder while nothing runs, and from one watch to the next.

use super::*;

impl Window {
    /// Watches until the next part is there, then stops.
    fn watch_one_part(&mut self, project: &Project, scan: &str, number: u32) {
        let before = self.app().facts().parts.len();
        self.ask(Action::Run);
        self.wait("watching", |app| app.facts().running().is_some_and(|r| r.watch && r.stage.is_none()));
        project.write(scan, &tiny_scan(number));
        self.wait("the part", |app| app.facts().parts.len() == before + 1);
        self.click("Stop");
        self.wait("the end", |app| app.facts().last_end.is_some());
        self.harness.run_steps(2);
    }
}

#[test]
fn scans_that_come_while_nothing_runs_are_counted_before_a_run_and_after_it() {
    let project = Project::new();
    let mut window = Window::on(&project);
    assert!(window.shows("No scans in this folder yet"));
    window.click("Inspect new scans");
    project.write("scans/1.ply", &tiny_scan(1));
    window.wait("it is seen", |app| matches!(&app.facts().scans, Some(Ok(scans)) if scans.len() == 1));
    assert!(window.shows("1 scan waiting") && window.says("scans, 1 scan"));
    window.ask(Action::Watch(false));
    window.ask(Action::Run);
    window.wait("the end", |app| app.facts().last_end.is_some());
    assert!(window.shows("Refused, last part 1 of 1"));
    // A number that sorts before the one that was inspected.
    project.write("scans/0.ply", &tiny_scan(2));
    window.wait("it is seen", |app| app.facts().arrived.len() == 1);
    assert!(window.says("scans, 2 scans") && window.shows("None yet, 0") && !window.shows("None yet, 1"));
    assert!(window.shows("No verdict") && window.says("A scan has come since, and was not inspected"));
    window.ask(Action::Run);
    assert!(window.app().facts().arrived.is_empty());
}

#[test]
fn parts_of_a_watched_folder_are_numbered_on_from_one_watch_to_the_next() {
    let project = Project::new();
    let mut window = Window::on(&project);
    window.ask(Action::Watch(true));
    window.watch_one_part(&project, "scans/1.ply", 1);
    assert!(window.shows("Refused, last part 1"));
    window.watch_one_part(&project, "scans/2.ply", 2);
    assert!(window.shows("Refused, last part 2") && window.shows("Stopped after part 2"));
    assert!(window.shows("Refused, part 1") && window.shows("Refused, part 2"));
    // A sequence counts its own parts; the next watch goes on where the last one ended.
    window.ask(Action::Watch(false));
    window.ask(Action::Run);
    window.wait("the end", |app| app.facts().running().is_none() && app.facts().last_end.is_some());
    assert!(window.shows("Refused, last part 2 of 2"));
    window.ask(Action::Watch(true));
    window.watch_one_part(&project, "scans/3.ply", 3);
    assert!(window.shows("Refused, last part 3"));
}
