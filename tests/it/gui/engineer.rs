//! The engineer's screen: the lock, edits and their problems, saving, work that is not saved, trying on a scan.

use super::*;
use egui_kittest::kittest::Queryable;
use shapeline::gui::Clock;
use shapeline::gui::engineer::{Draft, Edit};
use shapeline::plan::document::{FieldValue, List, PointSpec};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const PASSWORD: &str = "blech & rand";

/// A clock that can be put forward.
#[derive(Clone, Default)]
pub struct Forward(Arc<AtomicU64>);

impl Forward {
    pub fn by(&self, seconds: u64) {
        self.0.fetch_add(seconds, Ordering::Relaxed);
    }

    pub fn clock(&self) -> Clock {
        let ahead = self.0.clone();
        Clock::new(move || Instant::now() + Duration::from_secs(ahead.load(Ordering::Relaxed)))
    }
}

fn engineer(project: &Project, forward: &Forward) -> Window {
    let setup = Setup { clock: forward.clock(), ..setup(project) };
    let mut window = Window::open(setup, [1920.0, 1080.0]);
    window.click("Engineer");
    window
}

/// The engineer's screen, unlocked and with its plan checked.
pub fn unlocked(project: &Project, forward: &Forward) -> Window {
    let mut window = engineer(project, forward);
    match window.shows("New password") {
        true => {
            window.type_into("New password", PASSWORD);
            window.type_into("The same again", PASSWORD);
            window.click("Set password");
        }
        false => {
            window.type_into("Password", PASSWORD);
            window.press(egui::Modifiers::NONE, egui::Key::Enter);
        }
    }
    window.wait("the plan is open", |app| app.facts().editing.is_some());
    window
}

pub fn checked(app: &App) -> bool {
    app.facts().editing.as_ref().is_some_and(|e| e.checked == Some(e.version) && !e.choices.is_empty())
}

impl Window {
    /// Types over what stands in a field.
    #[track_caller]
    pub(super) fn type_into(&mut self, label: &str, text: &str) {
        self.harness.get_by_label(label).focus();
        self.harness.run_steps(3);
        self.harness.event(egui::Event::Text(text.to_owned()));
        self.harness.run_steps(3);
    }

    fn editing(&self) -> &shapeline::gui::engineer::Editing {
        self.app().facts().editing.as_ref().expect("a plan is edited")
    }

    fn value(&self, row: usize, key: &str) -> Option<f64> {
        match self.editing().document.rows(List::Comparison)[row].value(key) {
            Some(FieldValue::Number(v)) => Some(*v),
            _ => None,
        }
    }

    fn press(&mut self, modifiers: egui::Modifiers, key: egui::Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(3);
    }
}

#[test]
fn the_first_password_is_set_a_wrong_one_waits_and_the_right_one_opens() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = engineer(&project, &forward);
    assert!(window.shows("Choose the engineer's password"));
    window.type_into("New password", "short");
    window.type_into("The same again", "short");
    window.click("Set password");
    assert!(window.says("at least 8 letters") && !window.says("Unlocked"));
    window.type_into("New password", PASSWORD);
    window.type_into("The same again", "blech & Rand");
    window.click("Set password");
    assert!(window.says("The two passwords differ"));
    window.type_into("New password", PASSWORD);
    window.type_into("The same again", PASSWORD);
    window.click("Set password");
    window.wait("the plan is open", |app| app.facts().editing.is_some());
    assert!(window.says("Unlocked, locks again in 19:") || window.says("Unlocked, locks again in 20:"));
    let kept = String::from_utf8(project.read("config/window.toml")).unwrap();
    assert!(kept.contains("engineer_password = \"$argon2id$") && !kept.contains(PASSWORD), "{kept}");
    window.click("Lock now");
    assert!(window.shows("The plan is locked") && window.says("delete the line that begins with engineer_password"));
    // Locked, no edit is taken, whoever asks for it.
    window.ask(Action::Edit(Edit::Remove(List::Comparison, vec![0])));
    assert!(!window.editing().document.is_modified());
    window.type_into("Password", "something else");
    window.click("Unlock");
    let start = Instant::now();
    while !window.says("This is not the password") {
        assert!(start.elapsed() < PATIENCE);
        window.harness.step();
    }
    // The next one must wait.
    window.type_into("Password", PASSWORD);
    window.click("Unlock");
    assert!(window.shows("The plan is locked"));
    forward.by(2);
    window.harness.run_steps(2);
    window.type_into("Password", "");
    window.press(egui::Modifiers::NONE, egui::Key::Enter);
    window.wait_to_show("Lock now");
    assert!(!window.shows("The plan is locked"));
}

#[test]
fn it_locks_by_itself_and_work_that_is_not_saved_stays() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.ask(Action::Edit(Edit::SetTolerances { indices: vec![0], lower_mm: Some(-0.4), upper_mm: None }));
    assert_eq!(window.value(0, "lower_mm"), Some(-0.4));
    forward.by(19 * 60);
    window.harness.hover_at(egui::pos2(900.0, 500.0));
    window.harness.run_steps(2);
    forward.by(19 * 60);
    window.harness.run_steps(2);
    assert!(window.shows("Lock now"), "who moves the pointer is there");
    forward.by(20 * 60);
    window.harness.run_steps(2);
    assert!(window.shows("The plan is locked"));
    window.ask(Action::Edit(Edit::Undo));
    assert_eq!(window.value(0, "lower_mm"), Some(-0.4));
    window.type_into("Password", PASSWORD);
    window.click("Unlock");
    window.wait_to_show("Changed since revision C");
    assert!(window.says("1 change not saved"));
}

#[test]
fn a_point_is_added_a_value_typed_and_both_are_taken_back() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    let points = window.editing().document.read().draft.comparison;
    let count = points.len();
    let like = points.iter().position(|p| p.geometry.kind() == "edge").unwrap();
    let spec = PointSpec { name: String::new(), ..PointSpec::from(&points[like]) };
    let draft = Draft { list: List::Comparison, spec, note: None };
    window.harness.state_mut().as_mut().unwrap().engineer_mut().draft = Some(draft);
    window.harness.run_steps(2);
    assert!(window.shows("New: Trimmed edge point"));
    let next = window.editing().document.next_name(List::Comparison, "edge");
    window.type_into("Upper limit", "0,25");
    window.click("Add point");
    assert_eq!(window.editing().document.rows(List::Comparison).len(), count + 1);
    assert_eq!(window.editing().document.rows(List::Comparison)[count].name, next);
    assert_eq!(window.value(count, "upper_mm"), Some(0.25));
    // Its form is shown; every letter of what is typed is one step.
    window.type_into("Lower limit", "-0");
    window.harness.event(egui::Event::Text(",125".into()));
    window.harness.run_steps(3);
    assert_eq!(window.value(count, "lower_mm"), Some(-0.125));
    window.press(egui::Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(window.value(count, "lower_mm"), Some(points[like].lower_mm));
    window.press(egui::Modifiers::COMMAND, egui::Key::Y);
    assert_eq!(window.value(count, "lower_mm"), Some(-0.125));
    window.click("Undo");
    window.click("Undo");
    assert_eq!(window.editing().document.rows(List::Comparison).len(), count);
    assert!(!window.editing().document.is_modified());
    window.click("Redo");
    assert_eq!(window.editing().document.rows(List::Comparison).len(), count + 1);
}

#[test]
fn rows_are_chosen_by_clicks_and_keys_and_changed_together() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.harness.run_steps(2);
    window.harness.get_by_role_and_label(egui::Role::Row, "P02").click();
    window.harness.run_steps(3);
    assert!(window.shows("Surface point P02"));
    window.press(egui::Modifiers::NONE, egui::Key::ArrowDown);
    assert!(window.shows("Surface point P03"));
    window.press(egui::Modifiers::SHIFT, egui::Key::ArrowDown);
    assert!(window.shows("2 rows chosen"));
    let before = [2, 3].map(|row| window.value(row, "upper_mm"));
    window.type_into("Upper limit", "0.31");
    assert_eq!([2, 3].map(|row| window.value(row, "upper_mm")), [Some(0.31); 2]);
    window.click("Undo");
    assert_eq!([2, 3].map(|row| window.value(row, "upper_mm")), before);
    window.type_into("Filter by name or kind", "hole");
    assert!(window.harness.query_by_role_and_label(egui::Role::Row, "P02").is_none());
    window.harness.get_by_role_and_label(egui::Role::Row, "C01").click();
    window.harness.run_steps(3);
    // Moved in its list by a key, with the row staying in the hand.
    window.press(egui::Modifiers::ALT, egui::Key::ArrowDown);
    let names: Vec<String> = window.editing().document.rows(List::Comparison).into_iter().map(|row| row.name).collect();
    let at = |name: &str| names.iter().position(|n| n == name).unwrap();
    assert_eq!(at("C01"), at("C02") + 1);
    assert!(window.shows("Hole point C01"));
    window.press(egui::Modifiers::NONE, egui::Key::Delete);
    assert_eq!(window.editing().document.rows(List::Comparison).len(), names.len() - 1);
}

#[test]
fn a_problem_stands_at_its_field_keeps_from_saving_and_is_taken_back_alone() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.wait("a whole check", checked);
    assert!(window.shows("No problems"));
    window.ask(Action::Edit(Edit::SetSetting("part".into(), "number".into(), FieldValue::Text("4711-03".into()))));
    window.type_into("Lower limit", "0.9");
    window.wait("the problem", |app| app.facts().editing.as_ref().is_some_and(|e| e.errors() == 1));
    assert!(window.says("1 problem to solve before saving"));
    window.click("Part");
    assert!(window.shows("Sheet thickness"));
    // The list below leads back to the field.
    window.click("Go to field");
    window.harness.run_steps(2);
    assert!(window.harness.get_by_label("Lower limit").is_focused());
    let undo: Vec<_> = window.harness.get_all_by_label("Undo this").collect();
    assert_eq!(undo.len(), 2);
    undo[1].click();
    window.harness.run_steps(3);
    window.wait("a whole check", |app| checked(app) && app.facts().editing.as_ref().unwrap().errors() == 0);
    assert_eq!(window.value(0, "lower_mm"), Some(-0.5));
    assert!(window.says("1 change not saved"));
}

#[test]
fn saving_asks_for_the_reason_keeps_comments_and_gives_the_operator_the_new_plan() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.ask(Action::Edit(Edit::SetTolerances { indices: vec![0], lower_mm: Some(-0.4), upper_mm: None }));
    window.wait("a whole check", checked);
    window.click("Save as revision D…");
    assert!(window.shows("Save as revision D") && window.says("Give a revision and a reason"));
    window.type_into("Reason for the change", "die repaired");
    window.press(egui::Modifiers::NONE, egui::Key::Enter);
    let revision = |app: &App| app.facts().plan.as_ref().map(|plan| plan.part.revision.clone());
    window.wait("the operator's plan", |app| revision(app).as_deref() == Some("D"));
    let text = String::from_utf8(project.read("demo.toml")).unwrap();
    assert!(text.contains("# Deviations refer to a hole") && text.contains("revision = \"D\""), "{text}");
    assert!(text.contains(": die repaired\n#   P01: lower tolerance -0.500 -> -0.400 mm\n"), "{text}");
    assert!(window.says("everything saved") && !project.has("demo.toml.autosave"));
    // What is saved is history: undo takes back the limit, not the revision.
    window.ask(Action::Edit(Edit::Undo));
    window.wait("a whole check", checked);
    assert_eq!(window.value(0, "lower_mm"), Some(-0.5));
    let text = window.editing().document.text();
    assert!(text.contains("revision = \"D\"") && text.contains(": die repaired\n"), "{text}");
    window.ask(Action::Show(Screen::Engineer));
    window.harness.run_steps(3);
    assert!(window.shows("Save as revision E…"));
}

#[test]
fn what_is_no_number_is_not_taken_and_told_at_its_field() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.wait("a whole check", checked);
    for typed in ["1e400", "NaN", "abc"] {
        window.harness.get_by_label("Lower limit").focus();
        window.harness.run_steps(3);
        for letter in typed.chars() {
            window.harness.event(egui::Event::Text(letter.to_string()));
            window.harness.run_steps(2);
        }
        window.press(egui::Modifiers::NONE, egui::Key::Tab);
        assert_eq!(window.value(0, "lower_mm"), Some(-0.5), "{typed}");
        assert!(window.says(&format!("“{typed}” is no number")), "{typed}");
    }
    assert!(!window.editing().document.is_modified());
}

#[test]
fn what_somebody_else_saved_meanwhile_is_not_overwritten_without_a_word() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    let text = String::from_utf8(project.read("demo.toml")).unwrap();
    window.ask(Action::Edit(Edit::SetTolerances { indices: vec![1], lower_mm: Some(-0.3), upper_mm: None }));
    window.wait("a whole check", checked);
    let theirs = text.replace("4711-02", "4711-09").replacen("thickness_mm = 1.2 ", "thickness_mm = 1e300 ", 1);
    project.write("demo.toml", theirs.as_bytes());
    window.press(egui::Modifiers::COMMAND, egui::Key::S);
    window.type_into("Reason for the change", "press set up anew");
    window.click("Save");
    window.wait_to_show("Overwrite their version");
    // The dialog has grown and comes to rest in the middle again.
    window.harness.run_steps(4);
    assert!(window.says("Somebody else changed this plan") || window.says("somebody else changed this plan"));
    // What they did, and not what was done here; no number of three hundred digits.
    assert!(window.says("They changed 2 things") && window.says("\"4711-02\" to \"4711-09\""));
    assert!(window.says("1.200 to 1e300 mm"));
    window.click("Open their version, drop mine");
    window.wait("their plan", |app| {
        app.facts().editing.as_ref().is_some_and(|e| !e.document.is_modified() && e.document.text().contains("4711-09"))
    });
}

#[test]
fn work_that_was_not_saved_is_kept_and_offered_again() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.ask(Action::Edit(Edit::SetTolerances { indices: vec![0], lower_mm: Some(-0.4), upper_mm: None }));
    window.harness.run_steps(2);
    assert!(!project.has("demo.toml.autosave"));
    forward.by(5);
    window.wait("it is kept", |app| app.facts().editing.as_ref().is_some_and(|e| e.autosave.at.is_some()));
    assert!(project.has("demo.toml.autosave") && window.says("autosaved"));
    // The program ends without a word.
    drop(window);
    let mut window = unlocked(&project, &forward);
    window.harness.run_steps(2);
    assert!(window.shows("Work that was not saved") && window.says("P01: Lower limit"));
    assert_eq!(window.value(0, "lower_mm"), Some(-0.5));
    window.click("Take them up again");
    assert_eq!(window.value(0, "lower_mm"), Some(-0.4));
    // Another plan is not opened over it without a word.
    project.write("other.toml", &project.read("demo.toml"));
    window.ask(Action::Open(project.path("other.toml")));
    window.harness.run_steps(2);
    assert!(window.shows("Leave the plan?"));
    window.click("Stay");
    assert_eq!(window.value(0, "lower_mm"), Some(-0.4));
    window.ask(Action::Open(project.path("demo.toml")));
    window.harness.run_steps(2);
    window.click("Drop the changes");
    window.wait("the plan is open again", |app| app.facts().editing.is_some());
    assert!(!project.has("demo.toml.autosave") && !window.editing().document.is_modified());
}

#[test]
fn the_plan_is_tried_on_a_scan_before_it_is_saved() {
    let (project, forward) = (Project::new(), Forward::default());
    project.add_real_scan("0017.ply");
    let mut window = unlocked(&project, &forward);
    // Half of what the sheet spring leaves there would have to be measured away.
    window.ask(Action::Edit(Edit::SetTolerances { indices: vec![0], lower_mm: Some(0.3), upper_mm: Some(0.5) }));
    window.wait("a whole check", checked);
    assert!(window.shows("Try on 0017"));
    window.press(egui::Modifiers::NONE, egui::Key::F6);
    window.wait("the trial", |app| app.facts().editing.as_ref().is_some_and(|e| e.trial.is_some()));
    let trial = window.editing().trial.clone().unwrap().1.unwrap();
    let changed: Vec<&str> = trial.points.iter().filter(|p| p.is_change()).map(|p| p.name.as_str()).collect();
    assert_eq!(changed, ["P01"]);
    assert!(window.shows("Pass, now Fail") && window.says("25 points are as before"));
    // Nothing was written, and the operator's plan is as it was.
    assert!(!project.has("results") && window.app().facts().plan.as_ref().unwrap().part.revision == "C");
}

#[test]
fn the_engineers_screen_speaks_the_chosen_language() {
    let (project, forward) = (Project::new(), Forward::default());
    let mut window = unlocked(&project, &forward);
    window.ask(Action::Language(Language::German));
    window.harness.run_steps(2);
    assert!(
        window.shows("Vergleichspunkte") && window.shows("Jetzt sperren") && window.says("Geändert seit Revision C")
    );
    window.ask(Action::Language(Language::Swedish));
    window.harness.run_steps(2);
    assert!(window.shows("Jämförelsepunkter") && window.shows("Lås nu"));
}
