//! Picking on the part: clicks at a camera that stands still propose, Enter adds, drags are one step; the dialogs for many points.

use super::engineer::{Forward, checked, unlocked};
use super::*;
use shapeline::gui::engineer::Tool;
use shapeline::gui::scene::camera::ViewSize;
use shapeline::plan::Geometry;
use shapeline::plan::document::{CsvStyle, List, RowInfo, csv_of_points};

const SCENE: &str = "CAD with features and comparison points";

/// The engineer's screen over the demo's plan, its part drawn.
fn window(project: &Project) -> Window {
    let mut window = unlocked(project, &Forward::default());
    window.wait("the plan is checked", checked);
    window.wait_to_show(SCENE);
    window.wait("the part is drawn", |app| app.engineer().view3d.camera().is_some());
    window.harness.run_steps(40);
    window
}

impl Window {
    fn rows(&self, list: List) -> Vec<RowInfo> {
        self.app().facts().editing.as_ref().expect("a plan is edited").document.rows(list)
    }

    fn geometry(&self, list: List, name: &str) -> Geometry {
        let rows = self.rows(list);
        let row = rows.iter().find(|row| row.name == name).unwrap_or_else(|| panic!("no {name}"));
        row.geometry(list).expect("a shape")
    }

    /// Where a place of the CAD stands in the window.
    fn seen(&self, geometry: &Geometry) -> egui::Pos2 {
        let scene = self.harness.get_by_label(SCENE).rect();
        let camera = self.app().engineer().view3d.camera().expect("drawn");
        let size = ViewSize { width: scene.width().into(), height: scene.height().into() };
        let p = camera.project(&geometry.position(), size).expect("before the eye");
        scene.min + egui::vec2(p.x as f32, p.y as f32)
    }

    fn click_at(&mut self, at: egui::Pos2) {
        self.harness.hover_at(at);
        self.harness.step();
        self.harness.drag_at(at);
        self.harness.step();
        self.harness.drop_at(at);
        self.harness.run_steps(3);
    }

    /// Presses at a place and moves in steps; the hand does not let go.
    fn drag(&mut self, from: egui::Pos2, by: egui::Vec2, steps: u32) {
        self.harness.hover_at(from);
        self.harness.step();
        self.harness.drag_at(from);
        self.harness.step();
        for k in 1..=steps {
            self.harness.hover_at(from + by * (k as f32 / steps as f32));
            self.harness.run_steps(2);
        }
    }

    fn drop(&mut self, at: egui::Pos2) {
        self.harness.drop_at(at);
        self.harness.run_steps(3);
    }

    /// Types over what stands in a field.
    #[track_caller]
    pub fn retype(&mut self, label: &str, text: &str) {
        self.harness.get_by_label(label).focus();
        self.harness.run_steps(2);
        self.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::A);
        self.harness.step();
        self.harness.event(egui::Event::Text(text.to_owned()));
        self.harness.run_steps(3);
    }

    fn key(&mut self, key: egui::Key) {
        self.harness.key_press(key);
        self.harness.run_steps(3);
    }
}

#[test]
fn an_edge_point_is_proposed_by_a_click_and_added_by_enter() {
    let project = Project::new();
    let mut window = window(&project);
    let before = window.rows(List::Comparison).len();
    let e01 = window.geometry(List::Comparison, "E01");
    let at = window.seen(&e01) + egui::vec2(5.0, 2.0);
    window.key(egui::Key::E);
    assert_eq!(window.app().engineer().tool, Tool::Edge);
    window.click_at(at);
    let draft = window.app().engineer().draft.clone().expect("a proposal");
    assert_eq!((draft.list, draft.spec.geometry.kind()), (List::Comparison, "edge"));
    assert!(window.shows("E07  new") && window.shows("Snapped to the trimmed edge"));
    assert!(window.shows("Direction, out of the sheet"));
    // Five pixels of half a millimetre from the point that is there.
    let off = (draft.spec.geometry.position() - e01.position()).norm();
    assert!(off > 0.1 && off < 12.0, "{off}");
    window.key(egui::Key::Enter);
    let rows = window.rows(List::Comparison);
    assert_eq!((rows.len(), rows[before].name.as_str()), (before + 1, "E07"));
    assert_eq!(rows[before].geometry(List::Comparison).unwrap().position(), draft.spec.geometry.position());
    assert!(window.app().engineer().draft.is_none() && window.app().engineer().tool == Tool::Edge);
    // The same place again, left out by Esc; a second Esc puts the tool away.
    window.click_at(at);
    assert!(window.shows("E08  new"));
    window.key(egui::Key::Escape);
    assert!(window.app().engineer().draft.is_none());
    window.key(egui::Key::Escape);
    assert_eq!((window.app().engineer().tool, window.rows(List::Comparison).len()), (Tool::Choose, before + 1));
}

#[test]
fn a_click_that_means_nothing_says_why() {
    let project = Project::new();
    let mut window = window(&project);
    let p04 = window.seen(&window.geometry(List::Comparison, "P04"));
    window.key(egui::Key::E);
    window.click_at(p04 + egui::vec2(-14.0, 14.0));
    assert!(window.says("The nearest trimmed edge is") && window.app().engineer().draft.is_none());
    window.key(egui::Key::H);
    let slot = window.seen(&window.geometry(List::Feature, "S1"));
    window.click_at(slot);
    assert!(window.says("is not round") && window.says("take it as a slot"));
    window.key(egui::Key::A);
    window.click("Slot for the alignment");
    window.click_at(slot);
    let draft = window.app().engineer().draft.clone().expect("a proposal");
    assert_eq!((draft.list, draft.spec.geometry.kind()), (List::Feature, "slot"));
    assert!(window.says("Fitted to the rim"));
}

#[test]
fn a_drag_is_one_step_and_escape_takes_it_back() {
    let project = Project::new();
    let mut window = window(&project);
    let before = window.geometry(List::Comparison, "P04");
    let from = window.seen(&before);
    let by = egui::vec2(40.0, 24.0);
    window.drag(from, by, 6);
    window.drop(from + by);
    let moved = window.geometry(List::Comparison, "P04");
    assert!((moved.position() - before.position()).norm() > 3.0);
    // It lies where it was let go: rounded to 0.0001 mm, a pixel is half a millimetre.
    assert!(window.seen(&moved).distance(from + by) < 1.0, "{:?} {:?}", window.seen(&moved), from + by);
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    window.harness.run_steps(3);
    assert_eq!(window.geometry(List::Comparison, "P04"), before, "one step takes the whole drag back");
    window.drag(from, by, 6);
    assert_ne!(window.geometry(List::Comparison, "P04"), before);
    window.key(egui::Key::Escape);
    window.drop(from + by);
    assert_eq!(window.geometry(List::Comparison, "P04"), before);
    assert!(!window.app().facts().editing.as_ref().unwrap().document.is_modified());
}

#[test]
fn clicks_choose_rows_and_shift_adds() {
    let project = Project::new();
    let mut window = window(&project);
    let [p04, p11] = ["P04", "P11"].map(|name| window.seen(&window.geometry(List::Comparison, name)));
    window.click_at(p04);
    let rows = window.rows(List::Comparison);
    let index = |name: &str| rows.iter().position(|row| row.name == name).unwrap();
    assert_eq!(window.app().engineer().chosen.only(), Some((List::Comparison, index("P04"))));
    let shift = egui::Modifiers::SHIFT;
    let press = |window: &mut Window, pressed| {
        let button =
            egui::Event::PointerButton { pos: p11, button: egui::PointerButton::Primary, pressed, modifiers: shift };
        window.harness.event_modifiers(button, shift);
        window.harness.step();
    };
    window.harness.event_modifiers(egui::Event::PointerMoved(p11), shift);
    window.harness.step();
    press(&mut window, true);
    press(&mut window, false);
    window.harness.run_steps(2);
    let mut expected = vec![index("P04"), index("P11")];
    expected.sort_unstable();
    assert_eq!(window.app().engineer().chosen.rows, expected);
}

#[test]
fn limits_of_all_edges_are_set_at_once() {
    let project = Project::new();
    let mut window = window(&project);
    window.click("Tolerances…");
    let edges = window.rows(List::Comparison).iter().filter(|row| row.kind == "edge").count();
    window.click(&format!("All trimmed edges ({edges})"));
    window.retype("New lower limit", "-0,25");
    window.retype("New upper limit", "0.75");
    assert!(window.says(&format!("{edges} change, 0 stay")));
    window.click(&format!("Set limits of {edges} points"));
    for row in window.rows(List::Comparison).iter().filter(|row| row.kind == "edge") {
        use shapeline::plan::document::FieldValue::Number;
        assert_eq!((row.value("lower_mm"), row.value("upper_mm")), (Some(&Number(-0.25)), Some(&Number(0.75))));
    }
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    window.harness.run_steps(3);
    assert!(!window.app().facts().editing.as_ref().unwrap().document.is_modified(), "one step");
}

#[test]
fn the_other_hand_is_shown_before_it_is_made() {
    let project = Project::new();
    let mut window = window(&project);
    let before = window.geometry(List::Comparison, "P04").position();
    window.click("Mirror…");
    window.retype("The plane stands at", "none");
    assert!(window.says("This is no number"));
    window.retype("The plane stands at", "10");
    assert!(window.says("rows are mirrored, 0 get another name"));
    window.click("Mirror");
    let after = window.geometry(List::Comparison, "P04").position();
    assert!((after.x, after.z) == (before.x, before.z) && (after.y + before.y - 20.0).abs() < 1e-9);
}

#[test]
fn points_are_pasted_from_a_spreadsheet_or_not_at_all() {
    let project = Project::new();
    let mut window = window(&project);
    let before = window.rows(List::Comparison);
    let points = window.app().facts().editing.as_ref().unwrap().document.read().draft.comparison;
    let table = csv_of_points(&points, CsvStyle::DecimalComma);
    let line = |name: &str| table.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
    // One new point, one with another limit, one as it is; the limit stands in the last cell.
    let new = line("P01").replacen("P01", "P99", 1);
    let changed = line("P02");
    let (cells, _) = changed.rsplit_once(';').unwrap();
    let pasted = format!("{}\n{new}\n{cells};0,875\n{}\n", table.lines().next().unwrap(), line("P03"));
    window.click("CSV…");
    let broken = pasted.replace("0,875", "wide");
    window.retype("Paste cells from a spreadsheet", &broken);
    window.wait_until_says("1 faults");
    assert!(window.says("Mend 1 fault first") && window.says("Line 3:"));
    window.key(egui::Key::Escape);
    assert_eq!(window.rows(List::Comparison), before, "nothing is taken");
    window.click("CSV…");
    window.retype("Paste cells from a spreadsheet", &pasted);
    window.wait_until_says("1 new, 1 changed, 1 as before, 0 faults");
    assert!(window.says("points of the plan are not in the table"));
    window.click("Import points");
    let after = window.rows(List::Comparison);
    assert_eq!((after.len(), after.last().unwrap().name.as_str()), (before.len() + 1, "P99"));
    use shapeline::plan::document::FieldValue::Number;
    assert_eq!(after[1].value("upper_mm"), Some(&Number(0.875)));
}

impl Window {
    #[track_caller]
    fn wait_until_says(&mut self, words: &str) {
        let start = Instant::now();
        while !self.says(words) {
            assert!(start.elapsed() < PATIENCE, "{words}");
            std::thread::sleep(Duration::from_millis(5));
            self.harness.step();
        }
        // A dialog that has grown comes to rest in the middle.
        self.harness.run_steps(5);
    }
}
