//! The sections of the plan with what they hold, then the rows of the chosen one.

use super::editing::Editing;
use super::layout::Breadth;
use super::state::{Chosen, EngineerView, Section};
use super::table;
use crate::diagnostic::Severity;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::plan::document::{At, FieldValue, List};
use egui::{Align2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

const ROW: f32 = 30.0;
/// The rows fold away the sections where there is no room for both.
const LOW: f32 = 560.0;

/// The key of a section's name among the texts.
pub fn section_key(section: Section) -> &'static str {
    match section {
        Section::Part => "engineer.part",
        Section::Cad => "engineer.cad",
        Section::Scans => "engineer.scans",
        Section::Background => "engineer.background",
        Section::Alignment => "engineer.alignment",
        Section::Points => "engineer.points",
        Section::Rig => "engineer.rig",
        Section::Uncertainty => "engineer.uncertainty",
        Section::Output => "engineer.output",
    }
}

/// The section in which a problem stands.
pub fn section_of(at: At) -> Section {
    match at {
        At::Settings("cad") | At::OtherFile => Section::Cad,
        At::Settings("scans") => Section::Scans,
        At::Settings("background") => Section::Background,
        At::Settings("alignment") | At::Feature(_) | At::Lock(_) | At::Region(_) => Section::Alignment,
        At::Settings("rig") => Section::Rig,
        At::Settings("uncertainty") => Section::Uncertainty,
        At::Settings("output") => Section::Output,
        At::Comparison(_) | At::PointsFile => Section::Points,
        At::Settings(_) | At::Plan => Section::Part,
    }
}

/// What a section holds, in a word.
fn holds(editing: &Editing, section: Section, scope: &Scope) -> String {
    let text = |table: &str, key: &str| match editing.document.setting(table, key) {
        Some(FieldValue::Text(text)) => text,
        Some(FieldValue::Texts(texts)) => texts.join(", "),
        _ => String::new(),
    };
    let last = |path: String| path.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    match section {
        Section::Part => text("part", "name"),
        Section::Cad => last(text("cad", "file")),
        Section::Scans => text("scans", "pattern"),
        Section::Background => String::new(),
        Section::Alignment => {
            let names: Vec<&str> = editing.rows(List::Feature).iter().map(|row| row.name.as_str()).collect();
            names.join(", ")
        }
        Section::Points => scope.words.thousands(editing.rows(List::Comparison).len()),
        Section::Rig | Section::Uncertainty => String::new(),
        Section::Output => text("output", "formats"),
    }
}

/// Draws the card.
pub fn tree_ui(ui: &mut Ui, at: Rect, breadth: Breadth, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    cards::card(ui, at, scope.theme);
    let mut y = at.top() + 6.0;
    let title = Rect::from_min_size(pos2(at.left() + 14.0, y), vec2(at.width() - 28.0, ROW));
    let text = scope.words.text("engineer.plan");
    write::line(ui, title, Align2::LEFT_CENTER, text, fonts::semibold(size::BODY), scope.theme.text);
    y = title.bottom();
    let row = if at.height() < LOW { 24.0 } else { ROW };
    for section in Section::ALL {
        let place = Rect::from_min_size(pos2(at.left() + 1.0, y), vec2(at.width() - 2.0, row));
        section_ui(ui, place, section, scope, view, editing);
        y = place.bottom();
    }
    let rule = egui::Stroke::new(1.0, scope.theme.stroke);
    ui.painter().hline(at.x_range(), y + 6.0, rule);
    let rest = at.with_min_y(y + 7.0).shrink2(vec2(1.0, 1.0));
    table::table_ui(ui, rest, breadth, scope, view, editing);
}

fn section_ui(
    ui: &mut Ui,
    place: Rect,
    section: Section,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
) {
    let (theme, name) = (scope.theme, scope.words.text(section_key(section)));
    let response = ui.interact(place, ui.scope_id().with(("section", section)), Sense::click());
    let chosen = view.section == section;
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, name));
    if chosen || response.hovered() {
        ui.painter().rect_filled(place, 0, if chosen { theme.choice } else { theme.raised });
    }
    if chosen {
        ui.painter().rect_filled(place.with_max_x(place.left() + 3.0), 0, theme.accent);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(place, 2, egui::Stroke::new(2.0, theme.accent), egui::StrokeKind::Inside);
    }
    let inner = place.shrink2(vec2(13.0, 0.0));
    let of_section = editing.problems.iter().filter(|p| section_of(p.place.at) == section);
    let severity = of_section.map(|p| p.diagnostic.severity).max();
    let inner = match severity {
        Some(severity) => {
            super::fields::square_ui(ui, inner, severity, scope);
            inner.with_max_x(inner.right() - 22.0)
        }
        None => inner,
    };
    let font = if chosen { fonts::semibold(size::BODY) } else { fonts::regular(size::BODY) };
    let wide = write::width(ui, name, font.clone());
    ui.painter().text(inner.left_center(), Align2::LEFT_CENTER, name, font, theme.text);
    let note = inner.with_min_x(inner.left() + wide + 12.0);
    if note.width() > 24.0 {
        let text = holds(editing, section, scope);
        write::line(ui, note, Align2::RIGHT_CENTER, &text, fonts::regular(size::NOTE), theme.quiet);
    }
    if response.clicked() {
        choose(view, section);
    }
}

/// Shows the form of a section.
pub fn choose(view: &mut EngineerView, section: Section) {
    view.section = section;
    view.chosen = Chosen::default();
    view.draft = None;
}

/// The worst problem of a row.
pub fn severity_of(editing: &Editing, list: List, row: usize) -> Option<Severity> {
    let at = if list == List::Feature { At::Feature(row) } else { At::Comparison(row) };
    editing.problems.iter().filter(|p| p.place.at == at).map(|p| p.diagnostic.severity).max()
}
