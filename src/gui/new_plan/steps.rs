//! The forms of the first three steps: the CAD, a scan, thickness and side.

use super::Assistant;
use super::state::{Step, THICKEST_MM};
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::later::Asked;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::{sign, words as write};
use crate::plan::CadSide;
use crate::scan::PointClass;
use crate::worker::first_look::{CadLook, ScanLook, UNITS};
use egui::{Button, Key, Pos2, Rect, RichText, Sense, Stroke, TextEdit, Ui, pos2, vec2};
use std::path::Path;

/// The endings of CAD files and of scans.
pub const CADS: &[&str] = &["stl", "obj", "ply"];
const SCANS: &[&str] = &["ply", "xyz", "txt", "asc", "csv", "pts"];

/// A sentence that explains.
pub fn note(ui: &mut Ui, text: &str, theme: &Theme) {
    ui.add(egui::Label::new(RichText::new(text).color(theme.quiet)).wrap());
}

/// A fault with its square.
pub fn fault(ui: &mut Ui, text: &str, error: bool, theme: &Theme) {
    ui.horizontal_top(|ui| {
        let (at, _) = ui.allocate_exact_size(vec2(18.0, 18.0), Sense::hover());
        sign::problem(ui.painter(), Rect::from_center_size(at.center(), vec2(15.0, 15.0)), error, theme);
        ui.add(egui::Label::new(text).wrap());
    });
}

/// A line of what was found: words and value.
fn found(ui: &mut Ui, label: &str, value: &str, theme: &Theme) {
    ui.horizontal(|ui| {
        let column = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(vec2(176.0, 22.0), column, |ui| {
            ui.set_min_width(176.0);
            ui.label(RichText::new(label).color(theme.quiet));
        });
        ui.add(egui::Label::new(RichText::new(value).font(fonts::mono(size::BODY))).wrap());
    });
}

/// The field that a step begins with is typed into without a click, while it is empty and nothing else has the focus.
fn type_first(ui: &Ui, field: &egui::Response, empty: bool) {
    if empty && !field.lost_focus() && ui.memory(|m| m.focused().is_none() && m.top_modal_layer().is_none()) {
        field.request_focus();
    }
}

/// The field of a file with its button; returns whether it is to be read.
fn file_ui(ui: &mut Ui, step: Step, assistant: &mut Assistant, scope: &Scope) -> bool {
    let words = scope.words;
    let (key, endings) = match step {
        Step::Cad => ("new_plan.cad_file", CADS),
        _ => ("new_plan.scan_file", SCANS),
    };
    let entries = &mut assistant.entries;
    let label = ui.label(words.text(key));
    let mut read = false;
    ui.horizontal(|ui| {
        let path = if step == Step::Cad { &mut entries.cad.path } else { &mut entries.scan.path };
        let button = |key: &str| write::width(ui, words.text(key), fonts::regular(size::BODY)) + 30.0;
        let room = ui.available_width() - button("tables.read_file") - button("tables.choose_file");
        let field = ui.add(TextEdit::singleline(path).desired_width(room.max(100.0))).labelled_by(label.id);
        type_first(ui, &field, path.is_empty());
        read = field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        read |= ui.add(Button::new(words.text("tables.read_file")).min_size(vec2(0.0, 28.0))).clicked();
        if ui.add(Button::new(words.text("tables.choose_file")).min_size(vec2(0.0, 28.0))).clicked() {
            let file = if step == Step::Cad { entries.scan.file() } else { entries.cad.file() };
            let beside = file.parent().map(Path::to_path_buf).filter(|p| !p.as_os_str().is_empty());
            let plan = scope.facts.plan_path.as_ref().and_then(|p| p.parent()).map(Path::to_path_buf);
            assistant.dialog.ask(ui.ctx(), Asked::Open(endings), beside.or(plan).as_deref());
        }
    });
    if let Some(path) = assistant.dialog.answer() {
        match step {
            Step::Cad => assistant.entries.cad.choose(&path),
            _ => assistant.entries.scan.choose(&path),
        }
        read = true;
    }
    if assistant.dialog.failed {
        note(ui, words.text("tables.no_dialog"), scope.theme);
    }
    read
}

/// Says what is looked at, and lets it be given up.
fn progress_ui(ui: &mut Ui, assistant: &mut Assistant, scope: &Scope) {
    if !assistant.entries.looking.is_busy() {
        return;
    }
    let (stage, took) = assistant.entries.looking.progress();
    ui.horizontal(|ui| {
        let stage = stage.map_or_else(String::new, |stage| scope.words.text(stage_key(stage)).to_owned());
        let seconds = scope.words.number(took.as_secs_f64(), 0);
        ui.label(scope.words.fill("new_plan.looking", &[("stage", &stage), ("s", &seconds)]));
        if ui.button(scope.words.text("new_plan.stop_looking")).clicked() {
            assistant.entries.looking.cancel();
        }
    });
    ui.ctx().request_repaint_after(std::time::Duration::from_millis(250));
}

fn stage_key(stage: crate::run::Stage) -> &'static str {
    use crate::run::Stage;
    match stage {
        Stage::Read | Stage::Hash => "new_plan.stage_read",
        Stage::Background => "new_plan.stage_belt",
        _ => "new_plan.stage_cad",
    }
}

/// Units with the size that each would give.
fn units_ui(ui: &mut Ui, now: LengthUnit, size_in: impl Fn(LengthUnit) -> String, words: &Words) -> Option<LengthUnit> {
    let mut chosen = None;
    ui.label(words.text("new_plan.unit"));
    for unit in UNITS {
        let text = RichText::new(format!("{:<5}{}", unit.key(), size_in(unit))).font(fonts::mono(size::TABLE));
        if ui.radio(unit == now, text).clicked() && unit != now {
            chosen = Some(unit);
        }
    }
    chosen
}

fn size_words(size_mm: [f64; 3], words: &Words) -> String {
    let decimals = if size_mm.iter().all(|side| *side < 1.0) { 3 } else { 1 };
    size_mm.map(|side| words.number(side, decimals)).join(" x ") + " mm"
}

/// The CAD.
pub fn cad_ui(ui: &mut Ui, assistant: &mut Assistant, scope: &Scope) {
    let (words, theme) = (scope.words, scope.theme);
    note(ui, words.text("new_plan.cad_note"), theme);
    ui.add_space(10.0);
    if file_ui(ui, Step::Cad, assistant, scope) {
        assistant.look_at_cad(ui.ctx());
    }
    progress_ui(ui, assistant, scope);
    if let Some(told) = assistant.entries.cad.fault.clone() {
        fault(ui, &words.library(&told), true, theme);
    }
    let Some(look) = assistant.entries.cad.look.clone() else { return };
    ui.add_space(10.0);
    found(ui, words.text("new_plan.triangles"), &words.thousands(look.part.triangles_in_file), theme);
    found(ui, words.text("new_plan.size"), &size_words(look.size_mm(), words), theme);
    found(ui, words.text("new_plan.edges"), &words.thousands(look.edges()), theme);
    let kind = if look.thickness_mm.is_some() { "new_plan.is_solid" } else { "new_plan.is_face" };
    found(ui, words.text("new_plan.kind"), words.text(kind), theme);
    for warning in &look.part.warnings {
        fault(ui, &words.library(warning), false, theme);
    }
    ui.add_space(10.0);
    let size_in = |unit| size_words(CadLook::size_in(&look, unit), words);
    if let Some(unit) = units_ui(ui, look.unit, size_in, words) {
        assistant.entries.cad.unit = Some(unit);
        assistant.look_at_cad(ui.ctx());
    }
}

/// A scan.
pub fn scan_ui(ui: &mut Ui, assistant: &mut Assistant, scope: &Scope) {
    let (words, theme) = (scope.words, scope.theme);
    note(ui, words.text("new_plan.scan_note"), theme);
    ui.add_space(10.0);
    if file_ui(ui, Step::Scan, assistant, scope) {
        assistant.look_at_scan(ui.ctx());
    }
    progress_ui(ui, assistant, scope);
    if let Some(told) = assistant.entries.scan.fault.clone() {
        fault(ui, &words.library(&told), true, theme);
    }
    let Some(look) = assistant.entries.scan.look.clone() else { return };
    ui.add_space(10.0);
    counts_ui(ui, &look, words, theme);
    if let Some(doubt) = &look.doubt {
        fault(ui, &words.library(doubt), false, theme);
    }
    for warning in &look.scan.warnings {
        fault(ui, &words.library(warning), false, theme);
    }
    ui.add_space(10.0);
    let part_mm = look.part_mm.unwrap_or(0.0) / look.unit.in_mm();
    let size_in =
        |unit: LengthUnit| words.fill("new_plan.part_across", &[("mm", &words.number(part_mm * unit.in_mm(), 1))]);
    if let Some(unit) = units_ui(ui, look.unit, size_in, words) {
        assistant.entries.scan.unit = Some(unit);
        assistant.look_at_scan(ui.ctx());
    }
}

fn counts_ui(ui: &mut Ui, look: &ScanLook, words: &Words, theme: &Theme) {
    let count = |class: PointClass| look.scan.classes.iter().filter(|c| **c == class).count();
    found(ui, words.text("new_plan.points"), &words.thousands(look.points), theme);
    found(ui, words.text("new_plan.of_part"), &words.thousands(look.scan.kept.len()), theme);
    found(ui, words.text("new_plan.of_belt"), &words.thousands(count(PointClass::Belt)), theme);
    let rest = look.points - look.scan.kept.len() - count(PointClass::Belt);
    found(ui, words.text("new_plan.of_rest"), &words.thousands(rest), theme);
    let spacing = words.fill("new_plan.mm", &[("mm", &words.number(look.scan.spacing_mm, 2))]);
    found(ui, words.text("new_plan.spacing"), &spacing, theme);
    match &look.scan.belt {
        Some(belt) => {
            let sigma = words.number(belt.sigma_mm, 3);
            found(ui, words.text("new_plan.belt"), &words.fill("new_plan.belt_found", &[("mm", &sigma)]), theme);
        }
        None => fault(ui, words.text("new_plan.no_belt"), false, theme),
    }
}

/// Which thicknesses a sheet may have.
pub fn limits(words: &Words) -> String {
    words.fill("new_plan.thickness_limits", &[("mm", &words.number(THICKEST_MM, 0))])
}

/// Thickness and side of the sheet.
pub fn sheet_ui(ui: &mut Ui, assistant: &mut Assistant, scope: &Scope) {
    let (words, theme) = (scope.words, scope.theme);
    let of_cad = assistant.entries.cad.look.as_ref().and_then(|look| look.thickness_mm);
    let told = match of_cad {
        Some(mm) => words.fill("new_plan.thickness_of_cad", &[("mm", &words.number(mm, 3))]),
        None => words.text("new_plan.thickness_note").to_owned(),
    };
    note(ui, &told, theme);
    ui.add_space(10.0);
    let entries = &mut assistant.entries;
    let proposed = || of_cad.map(|mm| words.number(mm, 3)).unwrap_or_default();
    let mut text = entries.thickness.clone().unwrap_or_else(proposed);
    ui.horizontal(|ui| {
        let label = ui.label(words.text("new_plan.thickness"));
        let edit = TextEdit::singleline(&mut text).font(fonts::mono(size::BODY)).desired_width(90.0);
        let field = ui.add(edit).labelled_by(label.id);
        type_first(ui, &field, text.is_empty());
        if field.changed() {
            entries.thickness = Some(text.clone());
        }
        if entries.thickness_is_off() {
            ui.painter().rect_stroke(field.rect, 4, Stroke::new(2.0, theme.fail), egui::StrokeKind::Outside);
        }
        ui.label(RichText::new("mm").color(theme.quiet));
    });
    if entries.thickness_is_off() {
        fault(ui, &limits(words), true, theme);
    }
    if entries.thickness_mm() == Some(0.0) {
        fault(ui, words.text("new_plan.thickness_zero"), false, theme);
    }
    ui.add_space(14.0);
    ui.label(RichText::new(words.text("new_plan.side")).strong());
    let now = entries.cad_side();
    let solid = of_cad.is_some();
    for (side, key, hint) in SIDES {
        if (side == CadSide::Solid) == solid
            && side_ui(ui, side, now == Some(side), [words.text(key), words.text(hint)], theme)
        {
            entries.side = Some(side);
        }
    }
}

const SIDES: [(CadSide, &str, &str); 4] = [
    (CadSide::Top, "new_plan.side_top", "new_plan.side_top_hint"),
    (CadSide::Bottom, "new_plan.side_bottom", "new_plan.side_bottom_hint"),
    (CadSide::Middle, "new_plan.side_middle", "new_plan.side_middle_hint"),
    (CadSide::Solid, "new_plan.side_solid", "new_plan.side_solid_hint"),
];

/// One choice of a side: a cut through the sheet with the CAD in it, and words. Returns whether it was chosen.
fn side_ui(ui: &mut Ui, side: CadSide, chosen: bool, [name, hint]: [&str; 2], theme: &Theme) -> bool {
    let (place, response) = ui.allocate_exact_size(vec2(ui.available_width(), 66.0), Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::RadioButton, true, chosen, name));
    let (fill, frame) = match (chosen, response.hovered() || response.has_focus()) {
        (true, _) => (theme.choice, Stroke::new(2.0, theme.accent)),
        (false, true) => (theme.raised, Stroke::new(1.0, theme.accent)),
        (false, false) => (theme.panel, Stroke::new(1.0, theme.strong_stroke)),
    };
    let card = place.shrink2(vec2(0.0, 3.0));
    ui.painter().rect(card, 4, fill, frame, egui::StrokeKind::Inside);
    cut(ui, Rect::from_min_size(card.min + vec2(10.0, 8.0), vec2(88.0, 44.0)), side, theme);
    let text = Rect::from_min_max(pos2(card.left() + 112.0, card.top() + 6.0), card.max - vec2(8.0, 4.0));
    let painter = ui.painter();
    painter.text(text.left_top(), egui::Align2::LEFT_TOP, name, fonts::semibold(size::BODY), theme.text);
    let galley = painter.layout(hint.to_owned(), fonts::regular(size::NOTE), theme.quiet, text.width());
    painter.galley(text.left_top() + vec2(0.0, 20.0), galley, theme.quiet);
    response.clicked()
}

/// A bent sheet cut through, the CAD's surface drawn strong with its normals.
fn cut(ui: &Ui, at: Rect, side: CadSide, theme: &Theme) {
    let painter = ui.painter();
    let thick = 11.0;
    let line = |off: f32| -> Vec<Pos2> {
        let bend = [(0.0, 0.55), (0.34, 0.55), (0.58, 0.3), (1.0, 0.3)];
        bend.map(|(x, y)| pos2(at.left() + x * at.width(), at.top() + y * at.height() + off)).to_vec()
    };
    let (upper, lower) = (line(0.0), line(thick));
    for k in 0..3 {
        let corners = vec![upper[k], upper[k + 1], lower[k + 1], lower[k]];
        painter.add(egui::Shape::convex_polygon(corners, theme.strong_stroke.gamma_multiply(0.55), Stroke::NONE));
    }
    let strong = Stroke::new(3.0, theme.accent);
    let surface = |off: f32, up: f32| {
        painter.add(egui::Shape::line(line(off), strong));
        for x in [0.16, 0.8] {
            let y = if x < 0.5 { 0.55 } else { 0.3 };
            let foot = pos2(at.left() + x * at.width(), at.top() + y * at.height() + off);
            painter.arrow(foot, vec2(0.0, -13.0 * up), Stroke::new(1.5, theme.accent));
        }
    };
    match side {
        CadSide::Top => surface(0.0, 1.0),
        CadSide::Bottom => surface(thick, 1.0),
        CadSide::Middle => surface(0.5 * thick, 1.0),
        CadSide::Solid => {
            surface(0.0, 1.0);
            surface(thick, -1.0);
        }
    }
}
