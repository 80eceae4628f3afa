//! The verdict is about the newest part of the run, held to the plan as it is now, with its results on the disk; else there is none.

use super::engineer::{Forward, unlocked};
use super::*;
use shapeline::gui::engineer::{Command, Edit};
use shapeline::plan::document::FieldValue;
use shapeline::worker::plan_file::Overwrite;

impl Window {
    fn run_to_the_end(&mut self) {
        let has_begun = |app: &App| app.facts().running().is_some() || app.facts().last_end.is_some();
        self.ask(Action::Run);
        self.wait("the run begins, fails, or a plan that is broken is read again", move |app| {
            has_begun(app) || matches!(app.facts().job, Job::Idle)
        });
        if !has_begun(self.app()) {
            return;
        }
        self.wait("the end", |app| app.facts().running().is_none() && app.facts().last_end.is_some());
        self.harness.run_steps(2);
    }

    /// Another range of the map, saved as a revision.
    fn save_as(&mut self, revision: &str, range_mm: f64) {
        let edit = Edit::SetSetting("output".into(), "map_range_mm".into(), FieldValue::Number(range_mm));
        self.ask(Action::Edit(edit));
        self.ask(Action::Engineer(Command::Save {
            revision: revision.to_owned(),
            reason: "a test".to_owned(),
            path: None,
            overwrite: Overwrite::Own,
        }));
        let saved = revision.to_owned();
        self.wait("the new revision is the operator's", move |app| {
            let facts = app.facts();
            facts.plan.as_ref().is_some_and(|plan| plan.part.revision == saved)
                && !matches!(facts.job, Job::Opening { .. })
        });
    }
}

#[test]
fn a_part_whose_results_cannot_be_written_has_no_verdict_and_a_lamp_of_its_own() {
    let project = Project::new();
    project.change_plan(&[("folder = \"results\"", "folder = \"share/results\"")]);
    for k in 1..=2 {
        project.add_real_scan(&format!("{k}.ply"));
    }
    let mut window = Window::on(&project);
    window.ask(Action::Run);
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    std::fs::rename(project.path("share"), project.path("away")).unwrap();
    window.wait("the end", |app| app.facts().last_end.is_some());
    window.harness.run_steps(2);
    assert_eq!(window.verdicts(), [Some(Verdict::Pass), None]);
    assert!(window.shows("Refused, last part 2 of 2") && window.shows("Refused, part 2 of 2"));
    assert!(window.says("The results of 2.ply are lost") && !window.shows("Pass, last part 1 of 2"));
    let shift = window.app().settings().shift.clone();
    assert_eq!((shift.pass, shift.refused, shift.total()), (1, 1, 2));
}

#[test]
fn a_run_that_cannot_begin_takes_the_green_away_and_the_next_one_brings_it_back() {
    let project = Project::new();
    project.add_real_scan("1.ply");
    let mut window = Window::on(&project);
    window.run_to_the_end();
    assert!(window.shows("Pass, last part 1 of 1"));
    let plan = project.read("demo.toml");
    project.change_plan(&[("thickness_mm", "thicknes_mm")]);
    window.run_to_the_end();
    assert!(window.shows("No verdict") && !window.says("Pass, last part"), "the plan is broken");
    assert!(window.shows("The sequence could not go on") && window.says("thicknes_mm"));
    project.write("demo.toml", &plan);
    std::fs::rename(project.path("scans"), project.path("away")).unwrap();
    window.run_to_the_end();
    assert!(window.shows("No verdict") && !window.says("Pass, last part"), "the folder is away");
    std::fs::rename(project.path("away"), project.path("scans")).unwrap();
    window.run_to_the_end();
    assert!(window.shows("Pass, last part 1 of 1"));
    // One part was made, however often it was looked at.
    assert_eq!((window.app().settings().shift.pass, window.app().settings().shift.total()), (1, 1));
}

#[test]
fn what_an_earlier_revision_said_is_no_verdict_by_the_next_one() {
    let project = Project::new();
    project.add_real_scan("1.ply");
    let mut window = unlocked(&project, &Forward::default());
    window.run_to_the_end();
    window.ask(Action::Show(Screen::Operator));
    window.harness.run_steps(2);
    assert!(window.shows("Pass, last part 1 of 1"));
    window.save_as("Z", 0.75);
    window.ask(Action::Show(Screen::Operator));
    window.harness.run_steps(2);
    assert!(!window.says("Pass, last part") && window.shows("Ready"));
    // Its lamp stays, with its part.
    assert!(window.shows("Pass, part 1 of 1"));
}

#[test]
fn a_watch_goes_on_by_the_plan_that_was_saved() {
    let project = Project::new();
    let mut window = unlocked(&project, &Forward::default());
    window.ask(Action::Watch(true));
    window.ask(Action::Run);
    let watches = |app: &App| app.facts().running().is_some_and(|r| r.watch && !r.stopping && r.stage.is_none());
    window.wait("watching", watches);
    project.write("scans/1.ply", &tiny_scan(1));
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    window.save_as("Z", 0.75);
    window.wait("watching again", watches);
    project.write("scans/2.ply", &tiny_scan(2));
    // The first scan by the new plan, and perhaps this one in the same frame.
    window.wait("the second part", |app| app.facts().parts.len() >= 2);
    let revision = |k: usize| window.app().facts().parts[k].result.identity.part_revision.clone();
    assert!(revision(0) != "Z" && revision(1) == "Z");
}

#[test]
fn a_path_that_leads_nowhere_leaves_the_plan_and_its_parts() {
    let project = Project::new();
    project.add_real_scan("1.ply");
    let mut window = Window::on(&project);
    window.run_to_the_end();
    window.ask(Action::Open(project.path("no such plan.toml")));
    window.harness.run_steps(2);
    assert!(window.says("There is no such file") && window.shows("Pass, last part 1 of 1"));
    assert_eq!(window.app().facts().plan_path, Some(project.path("demo.toml")));
}

#[test]
fn a_plan_that_was_mended_is_read_again() {
    let project = Project::new();
    let plan = project.read("demo.toml");
    project.change_plan(&[("thickness_mm", "thicknes_mm")]);
    let mut window = Window::on(&project);
    assert!(window.shows("Check again") && window.app().facts().plan.is_none());
    project.write("demo.toml", &plan);
    window.click("Check again");
    window.wait("the plan is open", |app| app.facts().plan.is_some());
    window.harness.run_steps(2);
    assert!(window.shows("Ready") && window.shows("Run sequence"));
}

fn watching(project: &Project, forward: &Forward) -> Window {
    let mut window = Window::open(Setup { clock: forward.clock(), ..setup(project) }, [1280.0, 800.0]);
    window.ask(Action::Watch(true));
    window.ask(Action::Run);
    window.wait("watching", |app| app.facts().running().is_some_and(|r| r.watch && r.stage.is_none()));
    window
}

#[test]
fn a_scan_delivered_again_takes_the_green_away() {
    let project = Project::new();
    let mut window = watching(&project, &Forward::default());
    project.add_real_scan("1.ply");
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    assert!(window.shows("Pass, last part 1"));
    project.write("scans/2.ply", &project.read("scans/1.ply"));
    window.wait("the second part", |app| app.facts().parts.len() == 2);
    assert!(window.shows("Refused, last part 2") && window.shows("Refused, part 2") && !window.says("Pass, last part"));
    assert!(window.says("Not measured: the scan has the same content as 1.ply"));
}

#[test]
fn a_scan_that_is_not_whole_waits_in_sight_and_takes_the_green_away() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = watching(&project, &forward);
    project.add_real_scan("1.ply");
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    let scan = real_scan();
    project.write("scans/2.ply", &scan[..scan.len() / 2]);
    project.write("scans/3.ply", b"");
    window.wait("both are told", |app| app.facts().troubles.unfinished.len() == 2);
    assert!(window.shows("Pass, last part 1") && window.shows("Incomplete, 2") && window.shows("Incomplete, 3"));
    forward.by(6);
    window.harness.run_steps(3);
    assert!(window.shows("No verdict") && window.shows("Scan 3.ply is not whole") && !window.says("Pass, last part"));
    // The next part that is measured has a verdict of its own; what waits stays in sight.
    project.write("scans/4.ply", &demo_file("scans/01_good_top.ply"));
    window.wait("the next part", |app| app.facts().parts.len() == 2);
    forward.by(60);
    window.harness.run_steps(3);
    assert!(window.shows("Pass, last part 2") && window.shows("Incomplete, 2"));
    window.click("Stop");
    window.wait("the end", |app| app.facts().last_end.is_some());
    assert_eq!(window.verdicts(), [Some(Verdict::Pass), Some(Verdict::Pass), None, None]);
    assert!(window.shows("Refused, last part 4"));
}

#[test]
fn a_plan_that_changes_on_the_disk_leaves_no_green_of_the_old_one() {
    let project = Project::new();
    let mut window = watching(&project, &Forward::default());
    project.add_real_scan("1.ply");
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    let plan = project.read("demo.toml");
    std::fs::remove_file(project.path("demo.toml")).unwrap();
    window.wait("it is missed", |app| app.facts().troubles.plan.is_some());
    assert!(window.shows("No verdict") && !window.says("Pass, last part"));
    project.write("demo.toml", &plan);
    window.wait("it is back", |app| app.facts().troubles.plan.is_none());
    assert!(window.shows("Pass, last part 1"));
    project.change_plan(&[("revision = \"C\"", "revision = \"E\"")]);
    window.wait("it is told", |app| app.facts().message.is_some());
    assert!(window.says("it is revision E now"));
    window.wait("the part by the new plan", |app| app.facts().parts.len() == 2);
    assert_eq!(window.app().facts().parts[1].result.identity.part_revision, "E");
    // It is the part of before, and no verdict of one that came now.
    window.harness.run_steps(2);
    assert!(window.app().facts().parts[1].again && !window.says("Pass, last part"));
    assert!(window.shows("1 earlier part inspected again by this plan"));
    // A sequence does not end green by a plan that was replaced.
    window.click("Stop");
    window.wait("the end", |app| app.facts().last_end.is_some());
    window.ask(Action::Watch(false));
    project.add_real_scan("2.ply");
    window.ask(Action::Run);
    window.wait("a part", |app| app.facts().parts.len() == 3);
    project.change_plan(&[("revision = \"E\"", "revision = \"F\"")]);
    window.wait("the end", |app| app.facts().last_end.is_some());
    window.harness.run_steps(2);
    assert!(window.shows("No verdict") && window.says("it is revision F now") && !window.says("Pass, last part"));
}
