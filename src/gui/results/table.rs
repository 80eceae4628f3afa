//! The table of comparison points.

use super::numbers;
use super::order::{Order, SortBy, kind_key, next_out, verdict_word};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::cards;
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::words as write;
use crate::inspect::PointResult;
use egui::{
    Align, Align2, Color32, CornerRadius, Layout, Rect, RichText, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};
use egui_extras::{Column, TableBuilder, TableRow};

const ROW: f32 = 26.0;
const HEAD: f32 = 28.0;

/// Columns that give way in narrower windows: they stand in the why-card, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// All.
    Full,
    /// Without limits and U.
    Few,
}

impl Columns {
    /// Those that have room.
    pub fn in_width(width: f32) -> Self {
        if width < 620.0 { Columns::Few } else { Columns::Full }
    }
}

/// The table's own state.
#[derive(Debug, Default)]
pub struct TableView {
    /// Order and filter.
    pub order: Order,
    /// The point to which the rows were scrolled.
    scrolled_to: Option<usize>,
}

/// Draws title, filter and table into a card. Points of a file that nothing vouches for have no verdict. Returns the point that was clicked.
pub fn table_ui(
    ui: &mut Ui,
    at: Rect,
    (points, vouched_for): (&[PointResult], bool),
    view: &mut TableView,
    columns: Columns,
    scope: &mut Scope,
) -> Option<usize> {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let inner = at.shrink(1.0);
    let head = inner.with_max_y(inner.top() + 44.0);
    head_ui(ui, head, points, view, scope);
    let order = view.order.of(points, words);
    let body = inner.with_min_y(head.bottom());
    if order.is_empty() {
        nothing_ui(ui, body, view, points.is_empty(), scope);
        return None;
    }
    let chosen = scope.view.point;
    let mut clicked = None;
    let builder = egui::UiBuilder::new().max_rect(body).layout(Layout::top_down(Align::Min));
    ui.scope_builder(builder, |ui| {
        ui.set_clip_rect(body.intersect(ui.clip_rect()));
        let scroll =
            (view.scrolled_to != chosen).then(|| chosen.and_then(|c| order.iter().position(|k| *k == c))).flatten();
        view.scrolled_to = chosen;
        let name = |p: &PointResult| write::width(ui, &p.name, fonts::mono(size::TABLE));
        let name_width = points.iter().map(name).fold(44.0, f32::max).min(150.0) + 4.0;
        let table = builder_of(ui, columns, name_width, body.height(), scroll);
        table.header(HEAD, |mut row| header(&mut row, columns, &mut view.order, words, theme)).body(|body| {
            body.rows(ROW, order.len(), |mut row| {
                let k = order[row.index()];
                row.set_selected(chosen == Some(k));
                if point_row(&mut row, (&points[k], vouched_for), columns, words, theme) {
                    clicked = Some(k);
                }
            });
        });
    });
    clicked
}

fn head_ui(ui: &mut Ui, head: Rect, points: &[PointResult], view: &mut TableView, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let title = Rect::from_min_max(head.min + vec2(12.0, 0.0), head.max);
    let builder =
        egui::UiBuilder::new().max_rect(title.shrink2(vec2(12.0, 7.0))).layout(Layout::right_to_left(Align::Center));
    let shown = ui.scope_builder(builder, |ui| {
        let next = format!("{}  N", words.text("results.next_out"));
        let button = ui.add(egui::Button::new(RichText::new(next).size(size::TABLE)));
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text("results.next_out")));
        if button.clicked()
            && let Some(next) = next_out(points, scope.view.point, false)
        {
            scope.ask(Action::ChoosePoint(Some(next)));
        }
        let hint = RichText::new(words.text("results.filter")).color(theme.quiet);
        let field = egui::TextEdit::singleline(&mut view.order.filter).hint_text(hint).desired_width(120.0);
        let field = ui.add(field);
        field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, words.text("results.filter")));
        ui.min_rect().left()
    });
    let line = title.with_max_x(shown.inner - 10.0);
    let (text, font) = (words.text("results.points"), fonts::semibold(size::BODY));
    write::line(ui, line, Align2::LEFT_CENTER, text, font, theme.text);
}

/// What stands where no point does.
fn nothing_ui(ui: &mut Ui, body: Rect, view: &mut TableView, no_points: bool, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let key = if no_points { "results.no_points" } else { "results.no_match" };
    let line = Rect::from_center_size(body.center() - vec2(0.0, 20.0), vec2(body.width() - 24.0, 24.0));
    write::line(ui, line, Align2::CENTER_CENTER, words.text(key), fonts::regular(size::BODY), theme.quiet);
    if !no_points {
        let button = Rect::from_center_size(body.center() + vec2(0.0, 16.0), vec2(140.0, 30.0));
        if ui.put(button, egui::Button::new(words.text("results.clear_filter"))).clicked() {
            view.order.filter.clear();
        }
    }
}

fn builder_of(ui: &mut Ui, columns: Columns, name_width: f32, height: f32, scroll: Option<usize>) -> TableBuilder<'_> {
    ui.spacing_mut().item_spacing = vec2(8.0, 0.0);
    let mut table = TableBuilder::new(ui)
        .id_salt("comparison_points")
        // Cells take clicks; the keyboard goes from row to row, each with a name.
        .sense(Sense::CLICK)
        .cell_layout(Layout::left_to_right(Align::Center))
        .max_scroll_height(height)
        .auto_shrink(false)
        .column(Column::exact(34.0))
        .column(Column::exact(name_width).clip(true))
        .column(Column::exact(98.0).clip(true))
        .column(Column::exact(74.0));
    if columns == Columns::Full {
        table = table.column(Column::exact(62.0)).column(Column::exact(62.0)).column(Column::exact(62.0));
    }
    table = table.column(Column::remainder().at_least(110.0));
    match scroll {
        Some(row) => table.scroll_to_row(row, None),
        None => table,
    }
}

fn header(
    row: &mut TableRow<'_, '_>,
    columns: Columns,
    order: &mut Order,
    words: &crate::gui::text::Words,
    theme: &Theme,
) {
    let mut head = |row: &mut TableRow<'_, '_>, key: &str, right: bool, by: Option<SortBy>| {
        row.col(|ui| {
            let layout =
                if right { Layout::right_to_left(Align::Center) } else { Layout::left_to_right(Align::Center) };
            ui.with_layout(layout, |ui| {
                head_cell(ui, if key.is_empty() { "" } else { words.text(key) }, by, order, theme)
            });
        });
    };
    head(row, "", false, None);
    head(row, "results.point", false, Some(SortBy::Name));
    head(row, "results.kind", false, Some(SortBy::Kind));
    head(row, "results.deviation", true, Some(SortBy::Deviation));
    if columns == Columns::Full {
        head(row, "results.lower", true, None);
        head(row, "results.upper", true, None);
        head(row, "U (k = 2)", true, Some(SortBy::Uncertainty));
    }
    head(row, "results.over_tolerance", false, Some(SortBy::Worst));
}

fn head_cell(ui: &mut Ui, text: &str, by: Option<SortBy>, order: &mut Order, theme: &Theme) {
    let font = fonts::semibold(size::NOTE);
    let Some(by) = by else {
        ui.label(RichText::new(text).font(font).color(theme.quiet));
        return;
    };
    let sorted = order.by == by;
    let colour = if sorted { theme.text } else { theme.quiet };
    let button = ui.add(egui::Button::new(RichText::new(text).font(font).color(colour)).frame(false).truncate());
    if sorted {
        let at = pos2(button.rect.right() + 5.0, button.rect.center().y);
        let down = if order.reversed { -1.0 } else { 1.0 };
        let arrow = [vec2(-3.5, -2.0 * down), vec2(3.5, -2.0 * down), vec2(0.0, 3.0 * down)].map(|v| at + v);
        ui.painter().add(egui::Shape::convex_polygon(arrow.to_vec(), theme.text, Stroke::NONE));
    }
    if button.clicked() {
        order.click(by);
    }
}

fn point_row(
    row: &mut TableRow<'_, '_>,
    (point, vouched_for): (&PointResult, bool),
    columns: Columns,
    words: &crate::gui::text::Words,
    theme: &Theme,
) -> bool {
    let sign = if vouched_for { Sign::from(point.verdict) } else { Sign::Untrusted };
    let text = |ui: &mut Ui, text: &str, font: egui::FontId, colour: Color32| {
        ui.add(egui::Label::new(RichText::new(text).font(font).color(colour)).truncate().selectable(false));
    };
    let (mono, quiet) = (fonts::mono(size::TABLE), theme.quiet);
    row.col(|ui| {
        let place = Rect::from_center_size(ui.max_rect().center() + vec2(3.0, 0.0), vec2(16.0, 16.0));
        sign.paint(ui.painter(), place, theme);
    });
    let value = numbers::deviation(point, words);
    let verdict = if vouched_for { verdict_word(point.verdict, words) } else { sign.word(words) };
    let said = format!("{}, {verdict}, {value}", point.name);
    let mut chosen = false;
    row.col(|ui| {
        text(ui, &point.name, mono.clone(), theme.text);
        // Rows of a table are unknown to screen readers; this cell stands for the whole one.
        let named = ui.interact(ui.max_rect(), ui.scope_id().with("row"), Sense::click());
        named.widget_info(|| WidgetInfo::labeled(Role::Row, true, &said));
        chosen = named.clicked();
    });
    row.col(|ui| text(ui, words.text(kind_key(point.kind)), fonts::regular(size::TABLE), theme.text));
    let number = |row: &mut TableRow<'_, '_>, value: &str, colour: Color32| {
        row.col(|ui| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| text(ui, value, mono.clone(), colour));
        });
    };
    number(row, &numbers::deviation(point, words), theme.text);
    if columns == Columns::Full {
        number(row, &numbers::limit(point, point.lower_mm, words), quiet);
        number(row, &numbers::limit(point, point.upper_mm, words), quiet);
        number(row, &numbers::uncertainty(point, words), quiet);
    }
    let colour = if vouched_for { theme.verdict(point.verdict) } else { theme.strong_stroke };
    row.col(|ui| ratio_bar(ui, point, colour, theme));
    chosen || row.response().clicked()
}

/// The bar ends at 150 %; its tick is the limit.
const BAR_END: f64 = 1.5;

fn ratio_bar(ui: &mut Ui, point: &PointResult, colour: Color32, theme: &Theme) {
    let all = ui.max_rect();
    let bar =
        Rect::from_min_max(pos2(all.left(), all.center().y - 4.0), pos2(all.right() - 56.0, all.center().y + 4.0));
    let painter = ui.painter();
    let tick = bar.left() + bar.width() / BAR_END as f32;
    if let Some(ratio) = point.tolerance_ratio() {
        painter.rect_filled(bar, CornerRadius::same(1), theme.raised);
        let share = if ratio.is_finite() { (ratio / BAR_END).clamp(0.0, 1.0) } else { 1.0 };
        let filled = bar.with_max_x(bar.left() + bar.width() * share as f32);
        painter.rect_filled(filled, CornerRadius::same(1), colour);
    }
    painter.vline(tick, all.center().y - 7.0..=all.center().y + 7.0, Stroke::new(2.0, theme.text));
    let at = pos2(all.right() - 8.0, all.center().y);
    painter.text(at, Align2::RIGHT_CENTER, numbers::percent(point), fonts::mono(size::TABLE), theme.text);
}
