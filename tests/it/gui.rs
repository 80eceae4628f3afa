//! The window, used as people use it: by the words on its controls, over the real worker.

mod earlier;
mod engineer;
mod ground;
mod merge;
mod names;
mod new_plan;
mod picking;
mod places;
mod ranges;
mod results;
mod told;
mod verdict;
mod watching;
mod words;

use super::project::{Project, demo_file, files_of, real_scan, tiny_scan};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use shapeline::gui::{Action, App, Job, Language, Screen, Setup, install};
use shapeline::inspect::{Outcome, Verdict};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// For what must happen on a busy machine sooner or later.
const PATIENCE: Duration = Duration::from_secs(120);

/// A window over a project.
struct Window {
    harness: Harness<'static, Option<App>>,
}

impl Window {
    fn open(setup: Setup, size: [f32; 2]) -> Self {
        let draw = move |ui: &mut egui::Ui, app: &mut Option<App>| {
            let app = app.get_or_insert_with(|| App::new(ui.ctx(), setup.clone()).expect("a window"));
            app.logic(ui.ctx());
            app.ui(ui);
        };
        let builder = Harness::builder().with_size(size).with_context_setup(install);
        let mut window = Self { harness: builder.build_ui_state(draw, None) };
        window.wait("the plan is open or refused", |app| matches!(app.facts().job, Job::Idle));
        window
    }

    fn on(project: &Project) -> Self {
        Self::open(setup(project), [1280.0, 800.0])
    }

    fn app(&self) -> &App {
        self.harness.state().as_ref().expect("made in the first frame")
    }

    fn ask(&mut self, action: Action) {
        self.harness.state_mut().as_mut().expect("made in the first frame").ask(action);
        self.harness.step();
    }

    /// Draws frame after frame until something is so; returns how many.
    #[track_caller]
    fn wait(&mut self, what: &str, so: impl Fn(&App) -> bool) -> usize {
        let start = Instant::now();
        for frame in 0.. {
            self.harness.step();
            if so(self.app()) {
                self.harness.step();
                return frame;
            }
            assert!(start.elapsed() < PATIENCE, "{what}: {:?}", self.app().facts());
            // Leaves the processor to the worker; how long the pause is decides nothing.
            std::thread::sleep(Duration::from_millis(5));
        }
        unreachable!("frames do not end")
    }

    #[track_caller]
    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        // Press, release, and what comes of it.
        self.harness.run_steps(3);
    }

    fn shows(&self, label: &str) -> bool {
        self.harness.query_all_by_label(label).next().is_some()
    }

    /// Draws frame after frame until something is shown.
    #[track_caller]
    fn wait_to_show(&mut self, label: &str) {
        let start = Instant::now();
        while !self.shows(label) {
            assert!(start.elapsed() < PATIENCE, "{label}");
            std::thread::sleep(Duration::from_millis(5));
            self.harness.step();
        }
    }

    /// Whether something that is shown holds these words.
    fn says(&self, words: &str) -> bool {
        self.harness.query_all_by_label_contains(words).next().is_some()
    }

    fn verdicts(&self) -> Vec<Option<Verdict>> {
        let verdict = |outcome: &Outcome| match outcome {
            Outcome::Measured(inspection) => Some(inspection.verdict),
            Outcome::Refused(_) => None,
        };
        self.app().facts().parts.iter().map(|part| verdict(&part.result.outcome)).collect()
    }
}

fn setup(project: &Project) -> Setup {
    Setup {
        plan: Some(project.path("demo.toml")),
        settings_file: Some(project.path("config/window.toml")),
        ..Setup::default()
    }
}

/// A good part, a file that is cut off, the good part again.
fn with_a_bad_one_in_the_middle() -> Project {
    let project = Project::new();
    project.add_real_scan("1.ply");
    let scan = real_scan();
    project.write("scans/2.ply", &scan[..scan.len() / 2]);
    project.add_real_scan("3.ply");
    project
}

#[test]
fn a_sequence_runs_to_its_end_past_a_bad_scan_and_writes_the_command_lines_bytes() {
    let project = with_a_bad_one_in_the_middle();
    let mut window = Window::on(&project);
    assert!(window.shows("Ready") && window.shows("3 scans waiting"));
    window.click("Run sequence");
    assert!(window.shows("Stop"));
    window.wait("the end of the sequence", |app| app.facts().last_end.is_some());
    assert_eq!(window.verdicts(), [Some(Verdict::Pass), None, Some(Verdict::Pass)]);
    assert!(window.shows("Pass, last part 3 of 3"));
    for lamp in ["Pass, part 1 of 3", "Refused, part 2 of 3", "Pass, part 3 of 3"] {
        assert!(window.shows(lamp), "{lamp}");
    }
    assert_eq!(window.app().settings().shift.total(), 3);
    drop(window);
    project.run(["run", "demo.toml", "--out", "by_command"]).assert_ended(1, &[]);
    assert_eq!(project.files("results"), project.files("by_command"));
    project.assert_verified("results");
}

#[test]
fn bad_and_incomplete_parts_say_what_to_do_and_a_lamp_leads_to_its_part() {
    let project = Project::new();
    project.write("scans/1.ply", &demo_file("scans/03_out_of_tolerance.ply"));
    project.write("scans/2.ply", &demo_file("scans/04_flange_on_belt.ply"));
    let mut window = Window::open(setup(&project), [1920.0, 1080.0]);
    window.click("Run sequence");
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    // The demo's third scan has three points out of tolerance (its truth).
    assert!(window.shows("Fail, last part 1 of 2") && window.shows("3 of 26 points out of tolerance"));
    assert!(window.says("Set this part aside") && window.shows("Worst points of part 1"));
    window.wait("the end", |app| app.facts().last_end.is_some());
    assert_eq!(window.verdicts(), [Some(Verdict::Fail), Some(Verdict::NotMeasured)]);
    assert!(window.shows("Incomplete, last part 2 of 2") && window.says("Scan this part again"));
    window.wait_to_show("Deviations of part 2");
    // No press makes a part in a microsecond.
    window.ask(Action::Takt(Some(1e-6)));
    window.harness.step();
    assert!(window.says("Slower than the press by"));
    window.click("Fail, part 1 of 2");
    assert_eq!((window.app().view().screen, window.app().view().part), (Screen::Results, Some(0)));
}

#[test]
fn frames_go_on_while_the_worker_is_busy_and_the_verdict_stays() {
    let project = Project::new();
    project.add_real_scan("1.ply");
    project.add_real_scan("2.ply");
    let mut window = Window::on(&project);
    window.click("Run sequence");
    window.wait("the first part", |app| app.facts().parts.len() == 1);
    let frames = window.wait("the second part", |app| app.facts().parts.len() == 2);
    // A part takes a second and a half of work; a window that waits for it draws one frame.
    assert!(frames > 10, "{frames} frames");
    window.wait("the end", |app| app.facts().last_end.is_some());
}

#[test]
fn stop_ends_after_the_part_and_stop_again_at_once() {
    let project = Project::new();
    for k in 1..=4 {
        project.add_real_scan(&format!("{k}.ply"));
    }
    let mut window = Window::on(&project);
    window.click("Run sequence");
    window.wait("a scan at hand", |app| app.facts().running().is_some_and(|r| r.scan.is_some()));
    window.harness.key_press(egui::Key::Escape);
    window.wait("the end after the part", |app| app.facts().last_end.is_some());
    assert_eq!(window.verdicts(), [Some(Verdict::Pass)], "the part at hand is finished");
    assert!(window.shows("Stopped after part 1"));
    window.harness.key_press(egui::Key::F5);
    window.wait("a scan at hand", |app| app.facts().running().is_some_and(|r| r.scan.is_some()));
    window.click("Stop");
    window.click("Stop at once");
    window.wait("the end at once", |app| app.facts().last_end.is_some());
    assert_eq!(window.verdicts().len(), 1, "the part at hand is dropped");
    assert!(window.shows("Run sequence"));
}

#[test]
fn a_watched_folder_is_inspected_as_scans_arrive() {
    let project = Project::new();
    let mut window = Window::on(&project);
    assert!(window.shows("No scans in this folder yet"));
    window.click("Inspect new scans");
    window.harness.run_steps(2);
    assert!(window.shows("Watch folder"));
    window.ask(Action::Run);
    window.wait("watching", |app| app.facts().running().is_some_and(|r| r.watch && r.stage.is_none()));
    assert!(window.shows("Waiting for scans"));
    project.write("scans/1.ply", &tiny_scan(1));
    window.wait("the part", |app| app.facts().parts.len() == 1);
    assert!(window.shows("Refused, last part 1"));
    window.click("Stop");
    window.wait("the end", |app| app.facts().last_end.is_some());
}

#[test]
fn the_language_changes_at_once_and_is_kept() {
    let project = Project::new();
    let mut window = Window::on(&project);
    for (menu, language, run) in
        [("View…", Language::Swedish, "Kör sekvensen"), ("Visa…", Language::German, "Folge starten")]
    {
        window.click(menu);
        window.click(language.name());
        assert!(window.shows(run), "{}", language.name());
        window.click(match language {
            Language::German => "Ansicht…",
            _ => "Visa…",
        });
    }
    let keep = |app: &mut Option<App>| app.as_mut().expect("a window").keep_settings();
    keep(window.harness.state_mut());
    drop(window);
    assert!(Window::on(&project).shows("Folge starten"));
}

#[test]
fn a_plan_with_errors_says_so_in_the_words_of_the_command_line_and_does_not_run() {
    let project = Project::new();
    project.change_plan(&[("thickness_mm", "thicknes_mm")]);
    let mut window = Window::on(&project);
    assert!(window.shows("Not ready") && window.shows("The plan has errors"));
    let told = project.run(["check", "demo.toml"]).stderr;
    for problem in &window.app().facts().problems {
        assert!(told.contains(&problem.message), "{problem} is not in {told}");
    }
    assert!(!window.app().facts().problems.is_empty());
    window.harness.key_press(egui::Key::F5);
    window.harness.run_steps(2);
    assert!(window.app().facts().running().is_none());
}

#[test]
fn the_first_start_opens_the_demo_and_the_next_one_the_last_plan() {
    let folder = tempfile::tempdir().unwrap();
    let setup = Setup {
        plan: None,
        settings_file: Some(folder.path().join("config/window.toml")),
        data_folder: Some(folder.path().join("data")),
        ..Setup::default()
    };
    let window = Window::open(setup.clone(), [1280.0, 800.0]);
    assert_eq!(window.app().facts().plan_path, Some(folder.path().join("data/demo/demo.toml")));
    assert!(window.shows("Ready") && window.shows("5 scans waiting"));
    assert!(files_of(&folder.path().join("data/demo/scans")).len() == 5);
    drop(window);
    let project = Project::new();
    drop(Window::open(Setup { plan: Some(project.path("demo.toml")), ..setup.clone() }, [1280.0, 800.0]));
    let again = Window::open(setup, [1280.0, 800.0]);
    assert_eq!(again.app().facts().plan_path, Some(project.path("demo.toml")));
}

#[test]
fn a_typed_path_opens_a_plan_and_one_that_is_not_there_is_told() {
    let project = Project::new();
    let mut window = Window::on(&project);
    let missing: PathBuf = project.path("no such plan.toml");
    window.ask(Action::TypePath(true));
    window.harness.run_steps(2);
    window.harness.get_by_label("Path").type_text(&missing.display().to_string());
    window.harness.run_steps(2);
    window.click("Open");
    window.harness.run_steps(2);
    // A slip in a path costs nothing that is at hand.
    assert!(window.says("There is no such file") && window.app().facts().plan.is_some());
    assert_eq!(window.app().facts().plan_path, Some(project.path("demo.toml")));
    // At the start there is nothing to keep.
    drop(window);
    let mut window = Window::open(Setup { plan: Some(missing.clone()), ..setup(&project) }, [1280.0, 800.0]);
    window.wait("it is looked at", |app| matches!(app.facts().job, Job::Idle));
    assert!(window.shows("Not ready") && window.app().facts().plan.is_none());
    assert_eq!(window.app().facts().plan_path.as_ref(), Some(&missing));
}

#[test]
fn verdict_and_button_never_leave() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    for size in [[1920.0, 1080.0], [1280.0, 800.0], [800.0, 600.0], [480.0, 360.0]] {
        let mut window = Window::open(setup(&project), size);
        window.click("Run sequence");
        window.wait("the end", |app| app.facts().last_end.is_some());
        assert!(window.shows("Refused, last part 1 of 1") && window.shows("Run sequence"), "{size:?}");
        names::assert_all_named(&mut window, &format!("{size:?}"));
    }
}

#[test]
fn rows_of_menus_are_large_enough_for_gloves() {
    let project = Project::new();
    let mut window = Window::on(&project);
    for (menu, row) in [("View…", "Dark"), ("View…", "Svenska"), ("View…", "Full screen"), ("Open…", "Type a path…")]
    {
        window.click(menu);
        let height = window.harness.get_by_label(row).rect().height();
        assert!(height >= 48.0, "{row}: {height}");
        window.harness.key_press(egui::Key::Escape);
        window.harness.run_steps(2);
    }
}

#[test]
fn help_lists_the_keys_and_escape_puts_it_away() {
    let project = Project::new();
    let mut window = Window::on(&project);
    window.harness.key_press(egui::Key::F1);
    window.harness.run_steps(2);
    assert!(window.shows("Keys") && window.shows("Ctrl+O"));
    window.harness.key_press(egui::Key::Escape);
    window.harness.run_steps(2);
    assert!(!window.shows("Keys"));
}

#[test]
fn a_run_without_scans_says_what_to_do_and_the_message_can_be_put_away() {
    let project = Project::new();
    let mut window = Window::on(&project);
    let button = window.harness.get_by_label("Run sequence").rect();
    window.click("Run sequence");
    window.wait("the end", |app| app.facts().last_end.is_some());
    assert_eq!(window.harness.get_by_label("Run sequence").rect(), button, "the button never moves");
    assert!(window.says("No scan matches \"*.ply\"") && window.says("Put scans there"));
    assert!(window.shows("The sequence could not go on"));
    // The verdict's card says it; on other screens a message does.
    assert!(!window.shows("Got it") && window.shows("No verdict"));
    window.ask(Action::Show(Screen::Results));
    window.harness.run_steps(2);
    window.click("Got it");
    assert!(!window.shows("Got it"));
}

#[test]
fn scans_that_are_named_are_inspected_and_no_others() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    project.write("elsewhere.ply", &tiny_scan(2));
    let mut window = Window::on(&project);
    window.ask(Action::Inspect(vec![project.path("elsewhere.ply")]));
    window.wait("the end", |app| app.facts().last_end.is_some());
    let names: Vec<&str> = window.app().facts().parts.iter().map(|part| part.scan_name()).collect();
    assert_eq!(names, ["elsewhere.ply"]);
    assert_eq!(project.results(), 1);
}
