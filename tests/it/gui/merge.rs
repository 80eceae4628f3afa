//! The merge screen over the real worker: views listed, masks set, merged, stopped, and what is said of faults.

use super::super::merge::Views;
use super::super::project::run_in;
use super::super::wear::{add, dataset};
use super::names::assert_shown_named;
use super::*;
use shapeline::gui::merge::{Cloud, Command, ViewsState};
use shapeline::plan::merge::Metric;

fn named(views: &Views) -> Setup {
    Setup { plan: Some(views.path("merge.toml")), ..Setup::default() }
}

/// A window over the views, which are read.
fn over(views: &Views, size: [f32; 2]) -> Window {
    let mut window = Window::open(named(views), size);
    window.wait("the views are read and counted", |app| {
        let merging = app.facts().merging.as_ref().expect("a merge is open");
        matches!(merging.views, ViewsState::Ready(_)) && merging.worth.is_some()
    });
    window
}

/// Until the figures are of the masks at hand.
#[track_caller]
fn settle(window: &mut Window) {
    window.wait("the masks are counted", |app| {
        let merging = app.facts().merging.as_ref().expect("a merge is open");
        merging.worth.as_ref().is_some_and(|(version, _)| *version == merging.version)
    });
}

#[track_caller]
fn merge(window: &mut Window) {
    window.ask(Action::Merge(Command::Merge));
    window.wait("the merge has ended", |app| matches!(app.facts().job, Job::Idle));
}

/// Three views of 60 x 60 points (the test data of the command).
const ALL: usize = 3 * 3600;

#[test]
fn a_file_of_a_merge_opens_its_screen_and_lists_the_views() {
    let views = Views::new();
    let mut window = over(&views, [1920.0, 1080.0]);
    assert_eq!(window.app().view().screen, Screen::Merge);
    for k in 0..3 {
        assert!(window.shows(&format!("view_{k:02}: 3,600 read, 3,600 kept, – in the cloud")), "{k}");
    }
    assert!(window.says("of 10,800 points kept by the masks") && window.says("Figures are of all points"));
    assert!(window.shows("Nothing is written until Merge is pressed."));
    assert!(!views.path("merged.ply").exists());
    // Another screen and back with the keyboard.
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Num1);
    window.harness.run_steps(2);
    assert_eq!(window.app().view().screen, Screen::Operator);
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Num4);
    window.harness.run_steps(2);
    assert_eq!(window.app().view().screen, Screen::Merge);
    // A row stands out in the clouds, and once more in none.
    let row = "view_01: 3,600 read, 3,600 kept, – in the cloud";
    window.click(row);
    assert_eq!(window.app().merge_view().chosen, Some(1));
    assert!(window.shows("view_01: of 3,600 points read 3,600 are kept, 0.0 % are dropped."));
    window.click(row);
    assert_eq!(window.app().merge_view().chosen, None);
    assert_shown_named(&window, "a merge that is open");
}

#[test]
fn a_slider_changes_what_stays_and_the_merge_is_that_of_the_command_line() {
    let views = Views::new();
    views.settings("[mask]\nd_cal = { max = 150.0 } # of the paper\n");
    let mut window = over(&views, [1920.0, 1080.0]);
    let kept = |window: &Window| {
        let merging = window.app().facts().merging.as_ref().expect("a merge is open");
        merging.worth.as_ref().map(|(_, worth)| worth.kept.iter().sum::<usize>()).expect("counted")
    };
    let before = kept(&window);
    // d_cal is half the distance from the middle of a square of 600: a disc of radius 300 in it.
    let disc = std::f64::consts::PI / 4.0 * ALL as f64;
    assert!((before as f64 / disc - 1.0).abs() < 0.01, "{before} {disc}");
    window.harness.get_by_label("d_cal at most").focus();
    window.harness.run_steps(2);
    for _ in 0..12 {
        window.harness.key_press(egui::Key::ArrowLeft);
        window.harness.step();
    }
    window.harness.run_steps(2);
    settle(&mut window);
    let after = kept(&window);
    assert!(after < before && after > 0, "{before} {after}");
    let thousands = format!("{},{:03}", after / 1000, after % 1000);
    assert!(window.shows(&thousands), "{thousands}");
    assert!(window.says("Masks changed, not kept in the file"));
    merge(&mut window);
    assert!(window.shows("Merge again") && window.says("in the cloud"));
    let merging = window.app().facts().merging.clone().expect("a merge is open");
    let done = merging.done.clone().expect("merged");
    assert_eq!(done.job.result.merged.points_in, after);
    assert!(!merging.is_stale() && window.app().merge_view().cloud == Cloud::Merged);
    assert!(window.says(&format!("Written: {}", views.path("merged.ply").display())));
    // What it was made by is the file as it is once the masks are kept.
    window.click("Keep masks in file");
    assert!(!window.app().facts().merging.as_ref().expect("open").is_changed());
    let text = std::fs::read_to_string(views.path("merge.toml")).expect("the settings");
    assert!(text.contains(" } # of the paper\n") && !text.contains("150"), "{text}");
    views.run(&["--out", "by_command.ply"]).assert_ended(0, &[]);
    for ending in ["ply", "json"] {
        let of = |name: &str| std::fs::read(views.path(&format!("{name}.{ending}"))).expect(name);
        assert!(of("merged") == of("by_command"), "the {ending} of window and command line differ");
    }
    // Another threshold makes the result old.
    window.ask(Action::Merge(Command::Mask(Metric::CalibrationDistance, Some(80.0))));
    window.harness.run_steps(2);
    assert!(window.says("This result is older than the masks shown"));
    window.click("Masks of the file");
    assert!(!window.says("This result is older than the masks shown"));
}

#[test]
fn a_merge_that_is_stopped_leaves_nothing_and_what_was_merged_before_stays() {
    let views = Views::new();
    let mut window = over(&views, [1280.0, 800.0]);
    // In one frame: no machine is so fast that it has ended before.
    for command in [Command::Merge, Command::Stop] {
        window.harness.state_mut().as_mut().expect("open").ask(Action::Merge(command));
    }
    window.harness.step();
    assert!(window.shows("Stopping…"));
    window.wait("the merge has ended", |app| matches!(app.facts().job, Job::Idle));
    let merging = window.app().facts().merging.clone().expect("a merge is open");
    assert!(merging.done.is_none() && merging.fault.is_none());
    assert!(window.shows("The merge was stopped before its end: nothing of it was written."));
    assert!(!views.path("merged.ply").exists() && !views.path("merged.json").exists());
    merge(&mut window);
    assert!(!window.says("stopped before its end"), "this one was not");
    let bytes = std::fs::read(views.path("merged.ply")).expect("merged");
    window.ask(Action::Merge(Command::Merge));
    assert!(window.shows("Stop merging"));
    window.harness.key_press(egui::Key::Escape);
    window.wait("the merge has ended", |app| matches!(app.facts().job, Job::Idle));
    assert!(window.app().facts().merging.as_ref().expect("open").done.is_some());
    assert!(window.says("The last merge was stopped before its end and wrote nothing"));
    assert_eq!(std::fs::read(views.path("merged.ply")).expect("merged"), bytes);
}

#[test]
fn a_view_that_cannot_be_used_is_named_and_the_others_are_merged() {
    let views = Views::new();
    views.write("views/view_01.ply", "no ply at all");
    let mut window = over(&views, [1920.0, 1080.0]);
    assert!(window.shows("view_01: left out") && window.says("view_01 is left out."));
    merge(&mut window);
    assert!(window.shows("view_01: left out") && window.shows("2 of 3 views used"));
    let done = window.app().facts().merging.as_ref().and_then(|m| m.done.clone()).expect("merged");
    assert_eq!(done.job.result.left_out().count(), 1);
    // The command line says the same of it.
    let ran = views.run(&[]);
    ran.assert_ended(1, &[]);
}

#[test]
fn settings_with_errors_say_what_is_wrong_and_are_read_again_when_mended() {
    let views = Views::new();
    views.settings("[mask]\nd_cal = { max = \"far\" }\nwild = 3\n");
    let mut window = Window::open(named(&views), [1280.0, 800.0]);
    assert_eq!(window.app().view().screen, Screen::Merge);
    let merging = window.app().facts().merging.clone().expect("a merge is open");
    let errors = merging.problems.len();
    assert!(errors >= 2 && merging.plan.is_none(), "{:?}", merging.problems);
    // In the words of the command line, which tells them all.
    let ran = views.run(&[]);
    ran.assert_ended(2, &[]);
    for problem in &merging.problems {
        assert!(window.says(&problem.message), "{}", problem.message);
        // Its place stands before it, once.
        let line = problem.line.expect("it stands in a line");
        assert!(window.says(&format!("Line {line}: {}", problem.message)), "{}", problem.message);
    }
    let file = views.path("merge.toml").display().to_string();
    assert!(!window.says(&format!("{file}:")), "the name of the file stands over the list");
    assert!(window.says("The settings have errors"));
    assert_shown_named(&window, "settings with errors");
    window.ask(Action::Merge(Command::Merge));
    assert!(matches!(window.app().facts().job, Job::Idle), "what has errors is not merged");
    views.settings("[mask]\nd_cal = { max = 150.0 }\n");
    if window.shows("More…") {
        window.click("More…");
    }
    window.click("Read again");
    window.wait("the views are read", |app| app.facts().merging.as_ref().is_some_and(|m| m.preview().is_some()));
    assert!(window.shows("d_cal at most"));
}

#[test]
fn masks_are_not_kept_over_what_another_program_wrote() {
    let views = Views::new();
    let mut window = over(&views, [1920.0, 1080.0]);
    window.ask(Action::Merge(Command::Mask(Metric::PhaseShiftVariation, Some(0.006))));
    views.settings("# by hand\n");
    let theirs = std::fs::read(views.path("merge.toml")).expect("the settings");
    window.ask(Action::Merge(Command::Keep));
    assert!(window.says("changed by another program"));
    assert_eq!(std::fs::read(views.path("merge.toml")).expect("the settings"), theirs);
}

#[test]
fn a_feature_is_studied_and_its_suggestion_taken() {
    let views = Views::new();
    views.settings("[[feature]]\nkind = \"plane\"\nname = \"sheet\"\n");
    let mut window = over(&views, [1920.0, 1080.0]);
    assert!(window.says("sigma_dev about sheet"));
    window.wait("the study is done", |app| {
        let merging = app.facts().merging.as_ref().expect("open");
        matches!(merging.study, shapeline::gui::merge::StudyState::Done(..))
    });
    let merging = window.app().facts().merging.clone().expect("open");
    let shapeline::gui::merge::StudyState::Done(study, every) = &merging.study else { panic!("it is done") };
    assert_eq!((*every, study.points), (1, ALL));
    // It is the study of the command line, in whose table every threshold stands.
    let ran = run_in(views.path("").as_path(), ["mask-study", "merge.toml"]);
    assert!([Some(0), Some(1)].contains(&ran.code), "{ran:?}");
    let csv = std::fs::read_to_string(views.path("mask-study.csv")).expect("the table");
    for step in study.curves.iter().flat_map(|curve| &curve.steps) {
        assert!(csv.contains(&format!(",{},", step.remaining)), "{step:?}");
    }
    for curve in &study.curves {
        window.click(&format!("Study of {}", curve.metric.key()));
        match merging.suggested(curve.metric) {
            None => assert!(window.says("No knee") || window.says("No view"), "{:?}", curve.knee),
            Some(threshold) => {
                let label = window.harness.query_all_by_label_contains("Take ").next().is_some();
                assert!(label, "{threshold}");
                window.harness.get_by_label_contains("Take ").click();
                window.harness.run_steps(3);
                let merging = window.app().facts().merging.as_ref().expect("open");
                assert!(merging.mask(curve.metric).is_some());
            }
        }
    }
}

#[test]
fn a_merge_and_a_plan_are_open_beside_each_other() {
    let (project, views) = (Project::new(), Views::new());
    let mut window = Window::on(&project);
    assert!(window.app().facts().plan.is_some() && window.app().facts().merging.is_none());
    window.ask(Action::Open(views.path("merge.toml")));
    window.wait("the views are read", |app| app.facts().merging.as_ref().is_some_and(|m| m.preview().is_some()));
    assert!(window.app().facts().plan.is_some() && window.app().view().screen == Screen::Merge);
    assert!(window.app().settings().recent.iter().any(|recent| recent.path.ends_with("merge.toml")));
    // A job of one kind waits for that of the other, and says so.
    window.ask(Action::Merge(Command::Merge));
    window.ask(Action::Open(project.path("demo.toml")));
    if matches!(window.app().facts().job, Job::Merging(_)) {
        assert!(window.says("A merge is running"));
    }
    window.wait("the merge has ended", |app| matches!(app.facts().job, Job::Idle));
    // A plan that is opened is shown; the merge stays open behind its tab.
    window.ask(Action::Open(project.path("demo.toml")));
    window.wait("the plan is open", |app| matches!(app.facts().job, Job::Idle));
    assert!(window.app().facts().merging.is_some() && window.app().view().screen == Screen::Operator);
}

/// The engineer's password is set, which opens the lock.
fn set_password(window: &mut Window) {
    window.ask(Action::Show(Screen::Engineer));
    window.harness.run_steps(2);
    window.type_into("New password", "blech und rand");
    window.type_into("The same again", "blech und rand");
    window.click("Set password");
    window.wait("the password is kept", |app| app.settings().password.is_some());
    window.ask(Action::Show(Screen::Merge));
    window.harness.run_steps(2);
}

#[test]
fn masks_are_kept_in_the_file_only_while_the_engineers_lock_is_open() {
    let views = Views::new();
    let kept = || std::fs::read_to_string(views.path("merge.toml")).expect("the settings");
    let mut window = over(&views, [1920.0, 1080.0]);
    let masked = |window: &mut Window, bound: f64| {
        window.ask(Action::Merge(Command::Mask(Metric::PhaseShiftVariation, Some(bound))));
        window.harness.run_steps(2);
    };
    // Nobody set a password: there is no lock.
    masked(&mut window, 0.006);
    window.click("Keep masks in file");
    assert!(kept().contains("sigma_i = { min = 0.006 }"), "{}", kept());
    set_password(&mut window);
    masked(&mut window, 0.007);
    window.click("Keep masks in file");
    assert!(kept().contains("0.007"), "the lock is open: {}", kept());
    window.ask(Action::Engineer(shapeline::gui::engineer::Command::LockNow));
    masked(&mut window, 0.008);
    window.click("Keep masks in file (locked)");
    assert!(window.says("A settings file is changed only while the engineer's lock is open"));
    assert!(!kept().contains("0.008"), "{}", kept());
    // What is set in the window stays, and is merged.
    assert!(window.app().facts().merging.as_ref().expect("open").is_changed());
    merge(&mut window);
    assert!(window.app().facts().merging.as_ref().expect("open").done.is_some());
}

#[test]
fn a_slider_whose_mask_is_not_set_says_so() {
    let views = Views::new();
    views.settings("[mask]\nd_cal = { max = 150.0 }\n");
    let mut window = over(&views, [1280.0, 800.0]);
    for [set, not_set] in
        [["d_cal at most", "sigma_i at least, off"], ["Threshold of d_cal", "Threshold of sigma_i, off"]]
    {
        assert!(window.shows(set) && window.shows(not_set), "{set}, {not_set}");
    }
    assert!(window.shows("off") && window.says("keeps "));
    window.ask(Action::Merge(Command::Mask(Metric::PhaseShiftVariation, Some(0.006))));
    window.harness.run_steps(2);
    assert!(window.shows("sigma_i at least") && !window.shows("sigma_i at least, off"));
}

#[test]
fn d_r_is_told_to_a_tenth_of_its_uncertainty_and_the_move_of_wear_as_the_report_has_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (old, new) = (folder.path().join("old"), folder.path().join("new"));
    dataset(&old, 1, false);
    dataset(&new, 1, true);
    assert_eq!(run_in(folder.path(), ["merge", "old/merge.toml", "--quiet"]).code, Some(0));
    let settings = new.join("merge.toml");
    add(&settings, "report = \"merge.json\"\n", "compare_with = \"../old/merged.ply\"\n");
    let mut window = Window::open(Setup { plan: Some(settings), ..Setup::default() }, [1920.0, 1080.0]);
    merge(&mut window);
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(new.join("merge.json")).expect("a report")).expect("JSON");
    let moved = report["wear"]["moved"].as_f64().expect("it was compared");
    assert!(window.says(&format!("The best fit moved the cloud by up to {moved:.1} µm: wear that is even")));
    let after = &report["features"][0]["after"];
    let [d_r, radius_u] = ["d_r", "radius_u"].map(|key| after[key].as_f64().expect("it fits"));
    // The certificate's standard uncertainty is 0.7 µm, the fit's less: two digits of both together are hundredths.
    let u = radius_u.hypot(0.7);
    assert!(u < 1.0, "{u}");
    let sign = if d_r < 0.0 { "\u{2212}" } else { "+" };
    let told = format!("{sign}{:.2} ± {u:.2}", d_r.abs());
    assert!(window.shows(&told), "{told}");
    assert!(window.says("radius fitted less certified, 1001.5 ± 0.7 µm"));
}
