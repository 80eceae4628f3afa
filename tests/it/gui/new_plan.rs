//! A new plan in five steps, from the demo's CAD and a scan of it to a verdict.

use super::engineer::{Forward, unlocked};
use super::*;
use shapeline::gui::NewPlanCommand;
use shapeline::gui::engineer::Edit;
use shapeline::plan::document::{Document, List, PointSpec};

/// A window, unlocked, and a folder with a CAD and a scan but no plan.
fn window(project: &Project) -> Window {
    project.write("new/part.stl", &demo_file("bracket.stl"));
    project.write("new/scans/1.ply", &demo_file("scans/01_good_top.ply"));
    unlocked(project, &Forward::default())
}

fn folders(project: &Project) {
    std::fs::create_dir_all(project.path("new/scans")).expect("folders");
}

/// Features and points of the demo's plan, as somebody would pick them.
fn demo_rows(project: &Project) -> [Vec<PointSpec>; 2] {
    let document = Document::from_bytes(&project.read("demo.toml"), &project.path("demo.toml")).unwrap();
    let draft = document.read().draft;
    [draft.features.iter().map(PointSpec::from).collect(), draft.comparison.iter().map(PointSpec::from).collect()]
}

impl Window {
    fn until_shown(&mut self, label: &str) {
        self.wait_to_show(label);
        self.harness.run_steps(2);
    }
}

#[test]
fn five_steps_lead_from_a_cad_and_a_scan_to_a_verdict() {
    let project = Project::new();
    folders(&project);
    let mut window = window(&project);
    window.ask(Action::Show(Screen::Operator));
    window.harness.run_steps(2);
    window.click("New plan…");
    names::assert_shown_named(&window, "step 1");
    assert!(window.says("A CAD file is missing") && window.shows("The CAD appears here"));
    window.retype("File of the CAD", &project.path("new/part.stl").display().to_string());
    window.click("Read");
    window.until_shown("one surface");
    assert!(!window.says("A CAD file is missing"));
    window.click("Next");
    assert!(window.says("A scan is missing"));
    window.retype("File of the scan", &project.path("new/scans/1.ply").display().to_string());
    window.click("Read");
    window.wait_until("the belt is told", |window| window.says("found, scatter"));
    names::assert_shown_named(&window, "step 2");
    window.click("Next");
    names::assert_shown_named(&window, "step 3");
    assert!(window.says("The thickness of the sheet is missing"));
    window.retype("Thickness of the sheet", "1,2");
    assert!(window.says("Choose where the CAD's surface lies"));
    window.click("Material behind the surface");
    // Back and forth, nothing is lost.
    window.click("Back");
    window.click("Back");
    assert!(window.shows("one surface"));
    window.click("Next");
    window.click("Next");
    window.click("Next");
    assert!(window.says("A comparison point is missing"));
    window.wait("the CAD is ready for clicks", |app| app.facts().editing.as_ref().is_some_and(|e| e.picker.is_some()));
    let [features, points] = demo_rows(&project);
    window.ask(Action::Edit(Edit::AddRows(List::Feature, features)));
    window.ask(Action::Edit(Edit::AddRows(List::Comparison, points)));
    window.harness.run_steps(3);
    window.click("Hold the part by H1, S1, A1");
    assert!(window.shows("The part is held by H1, S1, A1"));
    window.click("Next");
    window.wait("the plan is checked", |app| {
        app.facts().editing.as_ref().is_some_and(|e| e.checked == Some(e.version) && e.foretold().is_some())
    });
    window.harness.run_steps(2);
    let problems = &window.app().facts().editing.as_ref().unwrap().problems;
    assert!(problems.iter().all(|p| p.diagnostic.severity != shapeline::diagnostic::Severity::Error), "{problems:?}");
    assert!(window.says("Before anything is measured"));
    window.retype("Name of the part", "Bracket new");
    names::assert_shown_named(&window, "step 5");
    // A file of that name is replaced when somebody says so, and not before.
    project.write("new/Bracket new.toml", b"# of somebody else\n");
    window.click("Save and run");
    window.until_shown("Replace Bracket new.toml");
    assert_eq!(project.read("new/Bracket new.toml"), b"# of somebody else\n");
    window.click("Replace Bracket new.toml");
    window.wait("the verdict", |app| app.facts().last_end.is_some() && !app.facts().parts.is_empty());
    let plan = project.path("new/Bracket new.toml");
    assert_eq!(window.app().facts().plan_path, Some(plan.clone()));
    assert_eq!(window.verdicts(), [Some(Verdict::Pass)]);
    assert!(
        !project.path("new/part.toml.autosave").exists() && !project.path("new/Bracket new.toml.autosave").exists()
    );
    let told = project.run(["check", "new/Bracket new.toml"]);
    assert_eq!(told.code, Some(0), "{told:?}");
}

#[test]
fn cancel_asks_only_where_there_is_something_to_lose() {
    let project = Project::new();
    folders(&project);
    let mut window = window(&project);
    window.ask(Action::NewPlan(NewPlanCommand::Start { cad: None, scan: None }));
    window.harness.run_steps(2);
    window.click("Cancel");
    assert!(!window.shows("Leave the new plan?") && !window.says("A CAD file is missing"));
    let cad = Some(project.path("new/part.stl"));
    window.ask(Action::NewPlan(NewPlanCommand::Start { cad, scan: Some(project.path("new/scans/1.ply")) }));
    window.until_shown("one surface");
    window.click("Next");
    window.wait_until("the scan that came along is read", |window| window.says("found, scatter"));
    window.click("Cancel");
    assert!(window.shows("Leave the new plan?"));
    window.click("Go on with it");
    assert!(window.says("found, scatter"));
    window.click("Cancel");
    window.click("Leave it");
    window.wait("the plan at hand is edited again", |app| {
        app.facts().editing.as_ref().is_some_and(|e| e.document.path() == app.facts().plan_path.as_deref().unwrap())
    });
    assert!(!project.path("new/part.toml").exists());
}

#[test]
fn a_file_that_is_none_is_told_where_it_was_named() {
    let project = Project::new();
    folders(&project);
    let mut window = window(&project);
    window.ask(Action::NewPlan(NewPlanCommand::Start { cad: Some(project.path("new/none.stl")), scan: None }));
    window.wait_until("the fault is told", |window| window.says("the file cannot be read"));
    assert!(window.says("A CAD file is missing"));
    // A plan in the making is not thrown away by opening another one.
    window.ask(Action::Open(project.path("demo.toml")));
    window.harness.run_steps(2);
    assert!(window.says("A new plan is being made") || window.says("a new plan is being made"));
}

impl Window {
    #[track_caller]
    fn wait_until(&mut self, what: &str, so: impl Fn(&Window) -> bool) {
        let start = Instant::now();
        while !so(self) {
            assert!(start.elapsed() < PATIENCE, "{what}");
            std::thread::sleep(Duration::from_millis(5));
            self.harness.step();
        }
        self.harness.run_steps(2);
    }
}
