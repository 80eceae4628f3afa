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
use egui::{Align2, ComboBox, Rect, RichText, Role, Sense, Ui, WidgetInfo, pos2, vec2};

const ROW: f32 = 30.0;
/// The lowest a row of a section may be.
const LEAST_ROW: f32 = 24.0;
/// What the points need below the sections: head, four rows, buttons.
const TABLE: f32 = 250.0;
/// Width from which sections and rows stand beside each other where they have no room below each other.
const BESIDE_FROM: f32 = 400.0;
const SECTIONS: f32 = Section::ALL.len() as f32;

/// Where sections and rows stand in the card.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Inside {
    /// The sections with their title; a menu when they are `folded`.
    sections: Rect,
    folded: bool,
    /// Height of a section.
    row: f32,
    /// The rows.
    table: Rect,
}

/// Divides the card: sections above rows, beside them, or folded into a menu above them.
fn inside(card: Rect) -> Inside {
    let inner = card.shrink(1.0);
    let head = 6.0 + ROW;
    let below = |row: f32| head + SECTIONS * row + 7.0;
    let row = if below(ROW) + 310.0 <= card.height() { ROW } else { LEAST_ROW };
    if below(row) + TABLE <= card.height() {
        let (sections, table) = inner.split_top_bottom_at_y(card.top() + below(row));
        return Inside { sections, folded: false, row, table };
    }
    if card.width() >= BESIDE_FROM {
        let (sections, table) = inner.split_left_right_at_x(card.left() + (0.42 * card.width()).min(260.0));
        let row = ((sections.height() - 8.0) / SECTIONS).clamp(20.0, ROW);
        return Inside { sections, folded: false, row, table };
    }
    let (sections, table) = inner.split_top_bottom_at_y(card.top() + 44.0);
    Inside { sections, folded: true, row: 28.0, table }
}

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
    let inside = inside(at);
    let rule = egui::Stroke::new(1.0, scope.theme.stroke);
    let sections = inside.sections;
    if inside.folded {
        menu_ui(ui, sections.shrink2(vec2(10.0, 8.0)), scope, view);
    } else {
        let mut y = sections.top() + 4.0;
        if y + ROW + SECTIONS * inside.row <= sections.bottom() {
            let title = Rect::from_min_size(pos2(sections.left() + 13.0, y), vec2(sections.width() - 26.0, ROW));
            let text = scope.words.text("engineer.plan");
            write::line(ui, title, Align2::LEFT_CENTER, text, fonts::semibold(size::BODY), scope.theme.text);
            y = title.bottom();
        }
        for section in Section::ALL {
            let place = Rect::from_min_size(pos2(sections.left(), y), vec2(sections.width(), inside.row));
            section_ui(ui, place, section, scope, view, editing);
            y = place.bottom();
        }
    }
    if inside.table.left() > sections.left() {
        ui.painter().vline(inside.table.left(), at.y_range(), rule);
    } else {
        ui.painter().hline(at.x_range(), inside.table.top(), rule);
    }
    table::table_ui(ui, inside.table, breadth, scope, view, editing);
}

/// The sections as a menu.
fn menu_ui(ui: &mut Ui, at: Rect, scope: &Scope, view: &mut EngineerView) {
    ui.scope_builder(egui::UiBuilder::new().max_rect(at), |ui| {
        let name = RichText::new(scope.words.text(section_key(view.section))).font(fonts::semibold(size::BODY));
        let combo = ComboBox::from_id_salt("engineer sections").selected_text(name).width(at.width());
        let combo = combo.show_ui(ui, |ui| {
            for section in Section::ALL {
                if ui.selectable_label(view.section == section, scope.words.text(section_key(section))).clicked() {
                    choose(view, section);
                }
            }
        });
        combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, scope.words.text("engineer.plan")));
    });
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
    view.show_form();
}

/// The worst problem of a row.
pub fn severity_of(editing: &Editing, list: List, row: usize) -> Option<Severity> {
    let at = if list == List::Feature { At::Feature(row) } else { At::Comparison(row) };
    editing.problems.iter().filter(|p| p.place.at == at).map(|p| p.diagnostic.severity).max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::engineer::Pane;
    use crate::gui::engineer::layout::places;

    #[test]
    fn sections_and_rows_have_room_in_every_window() {
        for width in (480..=3840).step_by(20) {
            for height in (260..=2060).step_by(20) {
                let all = Rect::from_min_size(pos2(0.0, 64.0), vec2(width as f32, height as f32));
                let Some(card) = places(all, Pane::Plan).tree else { panic!("{width} x {height}") };
                let Inside { sections, folded, row, table } = inside(card);
                let at = format!("{width} x {height}: {:?}", inside(card));
                assert!(card.contains_rect(sections) && card.contains_rect(table), "{at}");
                assert!(!sections.shrink(0.01).intersects(table.shrink(0.01)), "{at}");
                assert!(folded || sections.height() >= SECTIONS * row + 4.0, "{at}");
                // Title, filter and buttons leave room for at least two rows, three where the window is not the lowest.
                assert!(table.width() >= 190.0 && table.height() >= 150.0, "{at}");
                assert!(height < 420 || table.height() >= 220.0, "{at}");
            }
        }
    }
}
