//! What a verdict rests on changes while nothing runs: the scan, the plan, the CAD, the results. There is no green any more then.

use super::engineer::Forward;
use super::*;
use shapeline::diagnostic::Severity;

/// A window on a project with one good part that was inspected, and passed.
fn passed() -> (Project, Window) {
    let project = Project::new();
    project.add_real_scan("1.ply");
    let mut window = Window::on(&project);
    window.ask(Action::Run);
    window.wait("the end", |app| app.facts().running().is_none() && app.facts().last_end.is_some());
    window.harness.run_steps(2);
    assert!(window.shows("Pass, last part 1 of 1"));
    (project, window)
}

fn no_green(window: &mut Window) {
    window.harness.run_steps(2);
    assert!(!window.says("Pass, last part"), "{:?}", window.app().facts().message);
}

#[test]
fn a_scan_that_is_written_anew_takes_the_green_away() {
    let (project, mut window) = passed();
    project.write("scans/1.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    window.wait("it waits", |app| app.facts().arrived.len() == 1);
    no_green(&mut window);
    assert!(window.shows("No verdict") && window.says("A scan has come since, and was not inspected"));
    window.ask(Action::Run);
    window.wait("the end", |app| app.facts().running().is_none() && app.facts().parts.len() == 2);
    window.harness.run_steps(2);
    assert!(window.shows("Fail, last part 1 of 1"));
}

#[test]
fn another_plan_or_cad_on_the_disk_is_read_and_leaves_no_green() {
    let (project, mut window) = passed();
    project.change_plan(&[("revision = \"C\"", "revision = \"E\"")]);
    let revision = |app: &App| app.facts().plan.as_ref().map(|plan| plan.part.revision.clone());
    window.wait("the new plan is read", move |app| revision(app).as_deref() == Some("E"));
    no_green(&mut window);
    assert!(window.says("it is revision E now"));
    // Its lamp stays.
    assert!(window.shows("Pass, part 1 of 1"));
    window.wait("it is open", |app| matches!(app.facts().job, Job::Idle));
    window.ask(Action::Run);
    window.wait("the end", |app| app.facts().running().is_none() && app.facts().last_end.is_some());
    window.harness.run_steps(2);
    assert!(window.shows("Pass, last part 1 of 1"));
    project.write("bracket.stl", b"solid nothing\nendsolid nothing\n");
    window.wait("it is told", |app| app.facts().message.is_some());
    no_green(&mut window);
    window.wait("it is read", |app| app.facts().problems.iter().any(|p| p.severity == Severity::Error));
    no_green(&mut window);
    assert!(!window.says("CAD is prepared"));
}

#[test]
fn a_result_that_is_gone_takes_the_green_away() {
    let (project, mut window) = passed();
    std::fs::remove_dir_all(project.path("results")).unwrap();
    window.wait("it is missed", |app| app.facts().failure().is_some());
    no_green(&mut window);
    assert!(window.shows("No verdict") && window.says("The result of the last part is not there any more"));
}

fn watch(window: &mut Window) {
    window.ask(Action::Watch(true));
    window.ask(Action::Run);
    window.wait("watching", |app| app.facts().running().is_some_and(|r| r.watch && r.stage.is_none()));
}

#[test]
fn a_scan_that_was_not_whole_and_goes_leaves_a_lamp_and_no_green() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = Window::open(Setup { clock: forward.clock(), ..setup(&project) }, [1280.0, 800.0]);
    watch(&mut window);
    project.add_real_scan("1.ply");
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    project.write("scans/2.ply", b"");
    window.wait("it is told", |app| app.facts().troubles.unfinished.len() == 1);
    forward.by(6);
    no_green(&mut window);
    std::fs::remove_file(project.path("scans/2.ply")).unwrap();
    window.wait("it is missed", |app| app.facts().parts.len() == 2);
    no_green(&mut window);
    assert!(window.shows("Refused, last part 2") && window.says("The scan was taken away before it was whole"));
    let listed = window.app().facts().scans.as_ref().and_then(|scans| scans.as_ref().ok()).map(Vec::len);
    assert_eq!(listed, Some(1), "what is gone is not counted");
}

#[test]
fn a_copy_that_came_while_nobody_watched_is_told() {
    let project = Project::new();
    project.add_real_scan("1.ply");
    let mut window = Window::on(&project);
    watch(&mut window);
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    window.click("Stop");
    window.wait("the end", |app| app.facts().last_end.is_some());
    std::fs::copy(project.path("scans/1.ply"), project.path("scans/2.ply")).unwrap();
    window.wait("it is seen", |app| app.facts().arrived.len() == 1);
    watch(&mut window);
    window.wait("it is told", |app| app.facts().parts.len() >= 2);
    window.harness.run_steps(20);
    assert!(window.shows("Refused, last part 2") && window.app().facts().parts.len() == 2);
    assert!(window.says("Not measured: the scan has the same content as 1.ply"));
}
