//! The list of views: points, residuals, how far moved, or why left out; and what is known of the chosen one in words.

use super::facts::Merging;
use super::figures::{self, NONE};
use super::state::MergeView;
use super::told::{states_ui, told_ui};
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::scene::legend::colour;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::{cards, words as write};
use crate::stitch::register::Placed;
use crate::stitch::{MergeResult, PointCounts, ViewEnd};
use egui::{Align2, FontId, Rect, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

/// Height of a title, a head, a row, and what is told of the chosen view.
const TITLE: f32 = 38.0;
const HEAD: f32 = 36.0;
const ROW: f32 = 26.0;
const TOLD: f32 = 96.0;

/// How high the card would be to show so many views without scrolling.
pub fn wish(rows: usize) -> f32 {
    TITLE + HEAD + ROW * rows as f32 + TOLD + 22.0
}

/// What is known of one view.
pub struct Row {
    /// Its file.
    pub name: String,
    /// Points in it.
    pub read: Option<usize>,
    /// Points that masks keep; after a merge what went into it.
    pub kept: Option<usize>,
    /// Points in the cloud.
    pub cloud: Option<usize>,
    /// Share of what neighbours see in the same place that agrees.
    pub agreement: Option<f64>,
    /// Root mean square of the distances from its neighbours.
    pub rms: Option<f64>,
    /// How far it was moved, turned (rad), and the standard uncertainty of its place.
    pub moved: Option<f64>,
    /// Turned, rad.
    pub turned: Option<f64>,
    /// Standard uncertainty of its place.
    pub place_u: Option<f64>,
    /// Why it is not in the cloud.
    pub left_out: Option<String>,
    /// Motions that its overlaps do not hold.
    pub weak: Vec<String>,
}

/// All views: those of the folder, with what the last merge made of them.
pub fn rows(merging: &Merging, words: &Words) -> Vec<Row> {
    let result = merging.done.as_ref().map(|done| &done.job.result);
    let points_out = merging.done.as_ref().map(|done| done.points_out.as_slice());
    let Some(preview) = merging.preview() else {
        let files = result.into_iter().flat_map(|result| result.files.iter().map(|file| file.name.clone()));
        let empty = |name| row(name, result, points_out, words);
        return files.map(empty).collect();
    };
    let worth = merging.latest_worth();
    let of_file = |file: &crate::worker::merge::PreviewView| {
        let mut row = row(file.name.clone(), result, points_out, words);
        match &file.at {
            Err(fault) => row.left_out = Some(sentence(fault, words)),
            Ok(at) => {
                row.read = Some(file.read);
                let looked_at = preview.views[*at].positions.len();
                let kept = worth.and_then(|worth| worth.kept.get(*at)).map(|kept| {
                    if preview.every[*at] == 1 {
                        *kept
                    } else {
                        (*kept as f64 / looked_at as f64 * file.points as f64) as usize
                    }
                });
                row.kept = kept;
            }
        }
        row
    };
    preview.files.iter().map(of_file).collect()
}

/// A view as the last merge left it.
fn row(name: String, result: Option<&MergeResult>, points_out: Option<&[usize]>, words: &Words) -> Row {
    let mut row = Row {
        name,
        read: None,
        kept: None,
        cloud: None,
        agreement: None,
        rms: None,
        moved: None,
        turned: None,
        place_u: None,
        left_out: None,
        weak: Vec::new(),
    };
    let Some(result) = result else { return row };
    let Some(at) = result.files.iter().position(|file| file.name == row.name) else { return row };
    let file = &result.files[at];
    row.left_out = result.why_left_out(file).map(|why| words.told(why));
    row.cloud = points_out.map(|points| points[at]).filter(|_| row.left_out.is_none());
    let ViewEnd::Ready(ready) = file.end else { return row };
    let counts: &PointCounts = &result.placed.counts[ready];
    (row.read, row.kept) = (Some(counts.points_read), Some(counts.points_kept));
    let Some(found) = &result.placed.registration else { return row };
    let placed: Option<&Placed> = found.views[ready].placed();
    row.agreement = placed.map(|p| p.agreement).filter(|a| a.is_finite());
    (row.moved, row.turned) = (placed.and_then(|p| p.moved), placed.and_then(|p| p.turned_rad));
    row.place_u = placed.map(Placed::translation_u).filter(|u| u.is_finite());
    let mine = found.pairs.iter().filter(|pair| pair.is_used() && (pair.a == ready || pair.b == ready));
    let (squares, shared) = mine.filter(|pair| pair.rms.is_finite()).fold((0.0, 0.0), |(squares, shared), pair| {
        (squares + pair.rms * pair.rms * pair.shared as f64, shared + pair.shared as f64)
    });
    row.rms = (shared > 0.0).then(|| (squares / shared).sqrt());
    row.weak = found.weak.iter().filter(|weak| weak.view == ready).map(|weak| words.told(&weak.words)).collect();
    row
}

/// A column: the key of its head, how wide, what stands in it.
type Column = (&'static str, f32, fn(&Row, LengthUnit, &Words) -> String);

fn count(count: Option<usize>, words: &Words) -> String {
    count.map_or_else(|| NONE.to_owned(), |n| words.thousands(n))
}

fn of_length(value: Option<f64>, unit: LengthUnit, words: &Words) -> String {
    value.map_or_else(|| NONE.to_owned(), |value| figures::length(value, unit, words))
}

const COLUMNS: [Column; 7] = [
    ("merge.read", 66.0, |row, _, words| count(row.read, words)),
    ("merge.kept", 66.0, |row, _, words| count(row.kept, words)),
    ("merge.in_cloud", 66.0, |row, _, words| count(row.cloud, words)),
    ("merge.agreement", 78.0, |row, _, words| {
        row.agreement.map_or_else(|| NONE.to_owned(), |a| figures::percent(a, words))
    }),
    ("rms", 52.0, |row, unit, words| of_length(row.rms, unit, words)),
    ("merge.moved", 60.0, |row, unit, words| of_length(row.moved, unit, words)),
    ("u", 48.0, |row, unit, words| of_length(row.place_u, unit, words)),
];

/// The columns that count points: what of stands over them.
const COUNTS: [&str; 3] = ["merge.read", "merge.kept", "merge.in_cloud"];

/// The columns that have room: read, agreement, u and moved give way in that order.
fn columns(width: f32) -> Vec<&'static Column> {
    const NAME: f32 = 128.0;
    const AWAY: [&str; 4] = ["u", "merge.agreement", "merge.moved", "merge.read"];
    let mut columns: Vec<&Column> = COLUMNS.iter().collect();
    for key in AWAY {
        if columns.iter().map(|(_, wide, _)| wide).sum::<f32>() + NAME > width {
            columns.retain(|column| column.0 != key);
        }
    }
    columns
}

/// Draws the card.
pub fn views_ui(ui: &mut Ui, at: Rect, merging: &Merging, view: &mut MergeView, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let rows = rows(merging, words);
    let title = at.with_max_y(at.top() + TITLE).shrink2(vec2(14.0, 0.0));
    write::line(ui, title, Align2::LEFT_CENTER, words.text("merge.views"), fonts::semibold(size::BAR), theme.text);
    if let Some(text) = used(&rows, merging, words) {
        write::line(ui, title, Align2::RIGHT_CENTER, &text, fonts::regular(size::TABLE), theme.quiet);
    }
    let body = Rect::from_min_max(pos2(at.left() + 14.0, title.bottom()), at.max - vec2(12.0, 8.0));
    if rows.is_empty() {
        return states_ui(ui, body, merging, scope);
    }
    let told_height = TOLD.min(0.4 * body.height());
    let list = body.with_max_y(body.bottom() - told_height - 4.0);
    let unit = merging.plan.as_ref().map_or(LengthUnit::Mm, |plan| plan.unit);
    let columns = columns(list.width() - 24.0);
    head_ui(ui, list.with_max_y(list.top() + HEAD), &columns, unit, scope);
    let below = list.with_min_y(list.top() + HEAD);
    let mut chosen = view.chosen;
    ui.scope_builder(egui::UiBuilder::new().max_rect(below), |ui| {
        ScrollArea::vertical().id_salt("views").auto_shrink(false).min_scrolled_height(0.0).show_rows(
            ui,
            ROW - 3.0,
            rows.len(),
            |ui, range| {
                ui.spacing_mut().item_spacing.y = 3.0;
                for k in range {
                    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW - 3.0), Sense::hover());
                    if row_ui(ui, rect, k, &rows[k], &columns, (unit, view.chosen == Some(k)), scope) {
                        chosen = if view.chosen == Some(k) { None } else { Some(k) };
                    }
                }
            },
        );
    });
    view.chosen = chosen;
    let told = body.with_min_y(body.bottom() - told_height);
    ui.painter().hline(told.x_range(), told.top(), Stroke::new(1.0, theme.stroke));
    told_ui(ui, told.with_min_y(told.top() + 6.0), &rows, merging, view.chosen, unit, scope);
}

fn used(rows: &[Row], merging: &Merging, words: &Words) -> Option<String> {
    merging.done.as_ref()?;
    let used = rows.iter().filter(|row| row.left_out.is_none()).count();
    Some(words.fill("merge.used", &[("n", &words.thousands(used)), ("of", &words.thousands(rows.len()))]))
}

fn head_ui(ui: &mut Ui, at: Rect, columns: &[&Column], unit: LengthUnit, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let font = fonts::semibold(size::NOTE);
    let lower = at.with_min_y(at.bottom() - 20.0);
    let name = lower.with_min_x(at.left() + 24.0);
    write::line(ui, name, Align2::LEFT_CENTER, words.text("merge.view"), font.clone(), theme.quiet);
    let mut right = at.right() - 10.0;
    let mut counts: Option<Rect> = None;
    for (key, wide, _) in columns.iter().rev() {
        let text = match *key {
            "rms" | "u" | "merge.moved" => {
                let name = if key.contains('.') { words.text(key) } else { key };
                format!("{name} {}", figures::unit(unit))
            }
            key => words.text(key).to_owned(),
        };
        let place = Rect::from_min_max(pos2(right - wide + 4.0, lower.top()), pos2(right, lower.bottom()));
        let points = write::fitting_size(ui, &text, fonts::semibold, place.width(), size::NOTE, 10.0);
        write::line(ui, place, Align2::RIGHT_CENTER, &text, FontId::new(points, font.family.clone()), theme.quiet);
        if COUNTS.contains(key) {
            counts = Some(counts.map_or(place, |all| all.union(place)));
        }
        right -= wide;
    }
    if let Some(counts) = counts {
        let over = Rect::from_min_max(pos2(counts.left() + 10.0, at.top()), pos2(counts.right(), lower.top()));
        write::line(ui, over, Align2::CENTER_CENTER, words.text("merge.points"), font, theme.quiet);
        ui.painter().hline(over.x_range(), over.bottom(), Stroke::new(1.0, theme.stroke));
    }
    ui.painter().hline(at.x_range(), at.bottom() - 0.5, Stroke::new(1.0, theme.stroke));
}

/// A row; whether it was pressed.
fn row_ui(
    ui: &mut Ui,
    at: Rect,
    k: usize,
    row: &Row,
    columns: &[&Column],
    (unit, chosen): (LengthUnit, bool),
    scope: &Scope,
) -> bool {
    let (theme, words) = (scope.theme, scope.words);
    let response = ui.interact(at, ui.scope_id().with(("view", k)), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Row, true, chosen, said(row, words)));
    if chosen || response.hovered() {
        ui.painter().rect_filled(at, 2, if chosen { theme.choice } else { theme.raised });
    }
    if response.has_focus() {
        ui.painter().rect_stroke(at, 2, Stroke::new(2.0, theme.accent), StrokeKind::Inside);
    }
    let swatch = Rect::from_center_size(pos2(at.left() + 10.0, at.center().y), vec2(13.0, 13.0));
    match &row.left_out {
        Some(_) => Sign::Refused.paint(ui.painter(), swatch.expand(1.0), theme),
        None => {
            ui.painter().rect_filled(swatch, 2, colour(super::colours::of_view(k as i32)));
        }
    }
    let mono = fonts::mono(size::TABLE);
    let mut right = at.right() - 10.0;
    for (_, wide, of) in columns.iter().rev() {
        let at = pos2(right, at.center().y);
        ui.painter().text(at, Align2::RIGHT_CENTER, of(row, unit, words), mono.clone(), theme.text);
        right -= wide;
    }
    let name = Rect::from_min_max(pos2(at.left() + 24.0, at.top()), pos2(right - 4.0, at.bottom()));
    let painter = ui.painter().with_clip_rect(name.intersect(ui.clip_rect()));
    let number = format!("{k:02} {}", short(&row.name));
    painter.text(name.left_center(), Align2::LEFT_CENTER, number, fonts::semibold(size::TABLE), theme.text);
    response.clicked()
}

/// A file's name without its ending.
pub fn short(name: &str) -> String {
    let stem = std::path::Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    crate::report::words::clean(&stem.unwrap_or_else(|| name.to_owned()))
}

/// A row as a screen reader says it.
fn said(row: &Row, words: &Words) -> String {
    if row.left_out.is_some() {
        return words.fill("merge.row_left_out", &[("view", &short(&row.name))]);
    }
    let [read, kept, cloud] = [row.read, row.kept, row.cloud].map(|n| count(n, words));
    words.fill("merge.row", &[("view", &short(&row.name)), ("read", &read), ("kept", &kept), ("cloud", &cloud)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::merge::layout::places;

    #[test]
    fn a_window_of_1920_shows_how_far_views_agree() {
        let all = Rect::from_min_max(pos2(0.0, 72.0), pos2(1920.0, 1044.0));
        let card = places(all, false, wish(7)).views;
        // Less the margins of the card and of its rows.
        let keys: Vec<&str> = columns(card.width() - 26.0 - 24.0).iter().map(|column| column.0).collect();
        assert_eq!(keys, ["merge.read", "merge.kept", "merge.in_cloud", "merge.agreement", "rms", "merge.moved"]);
    }
}
