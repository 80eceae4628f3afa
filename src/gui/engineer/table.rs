//! The features or comparison points: chosen by click and keys, filtered by name and kind.

use super::editing::{Edit, Editing};
use super::fields::square_ui;
use super::labels;
use super::layout::Breadth;
use super::state::{Chosen, EngineerView, Section};
use super::tree::severity_of;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use crate::gui::widgets::words::fitting_size;
use crate::plan::document::{FieldValue, List, RowInfo};
use egui::{
    Align2, EventFilter, Id, Key, Modifiers, Rect, Response, RichText, Role, ScrollArea, Sense, Stroke, StrokeKind,
    TextEdit, Ui, WidgetInfo, pos2, vec2,
};

const ROW: f32 = 26.0;
/// Height of title and filter: below each other, and in one line where the place is low.
const HEAD: f32 = 68.0;
const LOW_HEAD: f32 = 40.0;
const LOW: f32 = 300.0;

/// Draws title, filter and rows.
pub fn table_ui(
    ui: &mut Ui,
    at: Rect,
    breadth: Breadth,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
) {
    let list = view.section.list();
    let rows = editing.rows(list);
    let foot = if list == List::Comparison { super::dialogs::foot(ui, at.width(), scope.words) } else { 0.0 };
    let wide = breadth == Breadth::Wide && list == List::Comparison;
    let low = at.height() < LOW;
    let head = at.with_max_y(at.top() + if low { LOW_HEAD } else { HEAD } + if wide { 24.0 } else { 0.0 });
    if wide {
        columns_ui(ui, head.with_min_y(head.bottom() - 24.0), scope);
    }
    head_ui(ui, head, low, list, rows.len(), scope, view);
    let shown: Vec<usize> = (0..rows.len()).filter(|k| is_wanted(&rows[*k], &view.filter, scope)).collect();
    let body = at.with_min_y(head.bottom()).with_max_y(at.bottom() - foot);
    let inner = egui::UiBuilder::new().max_rect(body);
    ui.scope_builder(inner, |ui| {
        ui.set_clip_rect(body.intersect(ui.clip_rect()));
        ui.spacing_mut().item_spacing.y = 0.0;
        if shown.is_empty() {
            empty_ui(ui, rows.is_empty(), list, scope, view);
            return;
        }
        let area =
            ScrollArea::vertical().id_salt(Id::unique("engineer rows").with(format!("{list:?}"))).auto_shrink(false);
        let area = match view.scroll.take() {
            Some(offset) => area.vertical_scroll_offset(offset),
            None => area,
        };
        let only = view.chosen.only().filter(|(of, _)| *of == list).filter(|only| view.scrolled_to != Some(*only));
        let offset = only.and_then(|(_, row)| shown.iter().position(|k| *k == row)).map(|k| k as f32 * ROW);
        let output = area.show_rows(ui, ROW, shown.len(), |ui, range| {
            for place in range {
                row_ui(ui, list, &shown, place, breadth, scope, view, editing);
            }
        });
        // A row that was chosen elsewhere comes into sight.
        if let Some(offset) = offset {
            view.scrolled_to = only;
            let (top, height) = (output.state.clamped_offset().y, output.inner_rect.height());
            if offset < top || offset + ROW > top + height {
                view.scroll = Some((offset - 0.5 * height).max(0.0));
                ui.ctx().request_repaint();
            }
        }
    });
    if foot > 0.0 {
        super::dialogs::buttons_ui(ui, at.with_min_y(body.bottom()), scope, view);
    }
}

fn head_ui(ui: &mut Ui, head: Rect, low: bool, list: List, count: usize, scope: &mut Scope, view: &mut EngineerView) {
    let (words, theme) = (scope.words, scope.theme);
    let title = Rect::from_min_max(head.min + vec2(13.0, 4.0), pos2(head.right() - 13.0, head.top() + 32.0));
    let text = words.text(if list == List::Feature { "engineer.features" } else { "engineer.points" });
    let note = match view.chosen.rows.len() {
        0 => String::new(),
        n => words.fill("engineer.chosen_of", &[("n", &words.thousands(n)), ("of", &words.thousands(count))]),
    };
    let wide = write::width(ui, text, fonts::semibold(size::TABLE)) + 8.0;
    let field = match low {
        // The filter keeps the better half.
        true => title.with_min_x((title.left() + wide).min(title.center().x)).translate(vec2(0.0, 2.0)),
        false => Rect::from_min_max(title.left_bottom(), pos2(title.right(), title.bottom() + 28.0)),
    };
    let words_to = if low { field.left() - 8.0 } else { title.right() };
    let font = fonts::semibold(size::TABLE);
    write::line(ui, title.with_max_x(words_to), Align2::LEFT_CENTER, text, font, theme.text);
    if !low && title.width() - wide > write::width(ui, &note, fonts::regular(size::NOTE)) {
        write::line(ui, title, Align2::RIGHT_CENTER, &note, fonts::regular(size::NOTE), theme.quiet);
    }
    let hint = words.text("engineer.filter");
    let edit = TextEdit::singleline(&mut view.filter)
        .align(Align2::LEFT_CENTER)
        .hint_text(RichText::new(hint).size(size::NOTE))
        .id(Id::unique("engineer filter"));
    let response = ui.put(field, edit);
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, hint));
}

/// What the columns of comparison points are called.
fn columns_ui(ui: &mut Ui, line: Rect, scope: &Scope) {
    let keys = ["setting.name", "setting.kind", "engineer.col_lower", "engineer.col_upper"];
    for (k, (at, key)) in columns(line, true).into_iter().zip(keys).enumerate() {
        let align = if k < 2 { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER };
        let (text, font) = (scope.words.text(key), fonts::semibold(size::NOTE));
        ui.painter_at(at).text(align.pos_in_rect(&at), align, text, font, scope.theme.quiet);
    }
    ui.painter().hline(line.x_range(), line.bottom() - 0.5, Stroke::new(1.0, scope.theme.stroke));
}

/// Where name, kind and both limits stand in a line; without limits where there is no room for them.
fn columns(line: Rect, with_limits: bool) -> Vec<Rect> {
    let (left, right) = (line.left() + 13.0, line.right() - 32.0);
    let name_to = if with_limits { left + 66.0 } else { left + 0.46 * (right - left) };
    let kind_to = if with_limits { name_to + 66.0 } else { right };
    let each = 0.5 * (right - kind_to);
    let ends = [left, name_to, kind_to, kind_to + each, right];
    let cell = |k: usize| Rect::from_min_max(pos2(ends[k], line.top()), pos2(ends[k + 1], line.bottom()));
    (0..if with_limits { 4 } else { 2 }).map(cell).collect()
}

fn is_wanted(row: &RowInfo, filter: &str, scope: &Scope) -> bool {
    let filter = filter.trim().to_lowercase();
    let kind = labels::choice(scope.words, &row.kind).to_lowercase();
    filter.is_empty() || row.name.to_lowercase().contains(&filter) || kind.contains(&filter)
}

fn empty_ui(ui: &mut Ui, none: bool, list: List, scope: &mut Scope, view: &mut EngineerView) {
    let words = scope.words;
    let at = ui.max_rect().shrink2(vec2(13.0, 8.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(at), |ui| {
        let key = match (none, list) {
            (true, List::Feature) => "engineer.no_features",
            (true, List::Comparison) => "engineer.no_points",
            (false, _) => "engineer.no_match",
        };
        let text = RichText::new(words.text(key)).size(size::TABLE).color(scope.theme.quiet);
        ui.add(egui::Label::new(text).wrap());
        ui.add_space(4.0);
        if !none && ui.button(RichText::new(words.text("engineer.clear_filter")).size(size::TABLE)).clicked() {
            view.filter.clear();
        }
    });
}

#[allow(clippy::too_many_arguments, reason = "a row needs to know its neighbours")]
fn row_ui(
    ui: &mut Ui,
    list: List,
    shown: &[usize],
    place: usize,
    breadth: Breadth,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
) {
    let row = shown[place];
    let info = &editing.rows(list)[row];
    let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let response = ui.interact(line, row_id(list, row), Sense::click());
    let chosen = view.chosen.has(list, row);
    response.widget_info(|| WidgetInfo::selected(Role::Row, true, chosen, &info.name));
    let theme = scope.theme;
    if chosen || response.hovered() {
        ui.painter().rect_filled(line, 0, if chosen { theme.choice } else { theme.raised });
    }
    ui.painter().hline(line.x_range(), line.bottom() - 0.5, Stroke::new(1.0, theme.raised));
    if response.has_focus() {
        ui.painter().rect_stroke(line, 2, Stroke::new(2.0, theme.accent), StrokeKind::Inside);
    }
    cells_ui(ui, line, info, list, breadth, scope);
    if let Some(severity) = severity_of(editing, list, row) {
        square_ui(ui, line.with_max_x(line.right() - 12.0), severity, scope);
    }
    act(ui, &response, list, shown, place, scope, view);
}

fn cells_ui(ui: &mut Ui, line: Rect, info: &RowInfo, list: List, breadth: Breadth, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let with_limits = breadth == Breadth::Wide && list == List::Comparison;
    let limit = |key: &str| match info.value(key) {
        Some(FieldValue::Number(v)) if v.abs() >= 1e6 => super::fields::plain_number(words, *v),
        Some(FieldValue::Number(v)) => words.signed_mm(*v),
        _ => "–".to_owned(),
    };
    let texts = [info.name.clone(), labels::choice(words, &info.kind).to_owned(), limit("lower_mm"), limit("upper_mm")];
    for (k, (at, text)) in columns(line, with_limits).into_iter().zip(texts).enumerate() {
        let align = if k < 2 { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER };
        let font = match k {
            0 => fonts::mono(size::TABLE),
            1 => fonts::regular(size::TABLE),
            // A number that is cut is another one.
            _ => fonts::mono(fitting_size(ui, &text, fonts::mono, at.width() - 4.0, size::TABLE, 6.0)),
        };
        let painter = ui.painter_at(at.intersect(ui.clip_rect()));
        painter.text(align.pos_in_rect(&at), align, text, font, theme.text);
    }
}

fn row_id(list: List, row: usize) -> Id {
    Id::unique("engineer row").with((list == List::Feature, row))
}

/// Clicks and keys of a row.
fn act(
    ui: &Ui,
    response: &Response,
    list: List,
    shown: &[usize],
    place: usize,
    scope: &mut Scope,
    view: &mut EngineerView,
) {
    let row = shown[place];
    if response.clicked() {
        response.request_focus();
        let modifiers = ui.input(|i| i.modifiers);
        match () {
            () if modifiers.command => view.chosen.toggle(list, row),
            () if modifiers.shift => choose_to(view, list, shown, place),
            () => choose(view, list, row),
        }
        if response.double_clicked() {
            view.show_form();
        }
        view.draft = None;
    }
    if !response.has_focus() {
        return;
    }
    let arrows = EventFilter { vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|m| m.set_focus_lock_filter(response.id, arrows));
    let pressed = |modifiers: Modifiers, key: Key| ui.input_mut(|i| i.consume_key(modifiers, key));
    let step = |down: bool| if down { (place + 1).min(shown.len() - 1) } else { place.saturating_sub(1) };
    for (key, down) in [(Key::ArrowDown, true), (Key::ArrowUp, false)] {
        let to = step(down);
        if pressed(Modifiers::ALT, key) && shown.len() > to && to != place {
            scope.ask(Action::Edit(Edit::Reorder { list, from: row, to: shown[to] }));
            ui.memory_mut(|m| m.request_focus(row_id(list, shown[to])));
        } else if pressed(Modifiers::SHIFT, key) {
            choose_to(view, list, shown, to);
            ui.memory_mut(|m| m.request_focus(row_id(list, shown[to])));
        } else if pressed(Modifiers::NONE, key) {
            choose(view, list, shown[to]);
            ui.memory_mut(|m| m.request_focus(row_id(list, shown[to])));
        }
    }
    if pressed(Modifiers::COMMAND, Key::A) {
        view.chosen = Chosen { list: Some(list), rows: shown.to_vec() };
    }
    if pressed(Modifiers::NONE, Key::F2) {
        view.focus = Some(super::row_form::row_key(list, row, "name"));
    }
}

fn choose(view: &mut EngineerView, list: List, row: usize) {
    view.choose(list, row);
    view.anchor = Some(row);
    // The hand is on it already: nothing scrolls.
    view.scrolled_to = Some((list, row));
}

/// All rows between the one that was chosen first and this one.
fn choose_to(view: &mut EngineerView, list: List, shown: &[usize], place: usize) {
    let anchor = view.anchor.filter(|_| view.chosen.list == Some(list));
    let from = anchor.and_then(|row| shown.iter().position(|k| *k == row)).unwrap_or(place);
    let rows = if from <= place { &shown[from..=place] } else { &shown[place..=from] };
    view.section = if list == List::Feature { Section::Alignment } else { Section::Points };
    view.chosen = Chosen { list: Some(list), rows: rows.to_vec() };
    view.anchor = Some(shown[from]);
}
