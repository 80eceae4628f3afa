//! The worst points of the last part, in words.

use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::{cards, words};
use crate::inspect::{Inspection, Outcome, PointResult, Verdict};
use crate::report::words::{clean, is_distance, worst_first};
use egui::{Align2, Rect, Stroke, Ui, Vec2, pos2, vec2};

/// Draws the card with so many rows at most.
pub(super) fn worst_ui(ui: &mut Ui, place: Rect, rows: usize, scope: &Scope) {
    let Some(part) = scope.facts.judged() else { return };
    cards::card(ui, place, scope.theme);
    let n = scope.words.thousands(part.index);
    match &part.result.outcome {
        Outcome::Measured(inspection) => {
            let (title, lines) = lines(inspection, rows, scope.words);
            rows_ui(ui, place, &scope.words.fill(title, &[("n", &n)]), rows, &lines, scope.theme);
        }
        Outcome::Refused(refusal) => {
            let title = scope.words.fill("operator.to_do_refused", &[("n", &n)]);
            refused_ui(ui, place, &title, part.reason(refusal), &refusal.help, scope);
        }
    }
}

/// Letters of a reason that the verdict's card shows whole at every size.
const SHORT: usize = 100;

/// What to do about a scan that was refused; below it a reason that is too long for the verdict's card.
fn refused_ui(ui: &mut Ui, place: Rect, title: &str, reason: &str, help: &str, scope: &Scope) {
    let theme = scope.theme;
    let inner = place.shrink2(vec2(20.0, 8.0));
    let head = inner.with_max_y(inner.top() + if place.height() > 150.0 { 34.0 } else { 22.0 });
    words::line(ui, head, Align2::LEFT_CENTER, title, fonts::semibold(size::BAR), theme.text);
    ui.painter().hline(inner.x_range(), head.bottom(), Stroke::new(1.0, theme.stroke));
    let rest = inner.with_min_y(head.bottom() + 8.0);
    let [large, small] = if place.height() > 150.0 { [20.0, size::BAR] } else { [size::BODY, size::BODY] };
    let rows = |height: f32, points: f32| ((height / (1.3 * points)) as usize).max(1);
    let reason = scope.words.told(reason);
    let long = reason.chars().count() > SHORT;
    let upper = rest.with_max_y(rest.top() + if long { 0.6 } else { 1.0 } * rest.height());
    let lines = rows(upper.height(), large);
    let help = scope.words.told(help);
    let told = words::block(ui, upper, Align2::LEFT_TOP, &help, fonts::semibold(large), theme.text, lines);
    let lower = rest.with_min_y(told.bottom() + 8.0);
    if long && lower.height() >= small {
        let lines = rows(lower.height(), small);
        words::block(ui, lower, Align2::LEFT_TOP, &reason, fonts::regular(small), theme.quiet, lines);
    }
}

/// One row: sign, sentence, note.
pub(super) struct Row {
    /// Its sign.
    pub sign: RowSign,
    /// What is so.
    pub sentence: String,
    /// What more there is to say.
    pub note: String,
}

/// What stands before a row.
#[derive(Debug, Clone, Copy)]
pub(super) enum RowSign {
    /// A point's verdict.
    Verdict(Sign),
    /// A check that is no verdict.
    Check,
    /// Not known yet.
    Open,
    /// Something that is needed and is not there.
    Wrong,
}

/// Title and rows of a card, spread over its height.
pub(super) fn rows_ui(ui: &mut Ui, place: Rect, title: &str, rows: usize, lines: &[Row], theme: &Theme) {
    let inner = place.shrink2(vec2(20.0, 8.0));
    let head = inner.with_max_y(inner.top() + if place.height() > 150.0 { 34.0 } else { 22.0 });
    words::line(ui, head, Align2::LEFT_CENTER, title, fonts::semibold(size::BAR), theme.text);
    let each = (inner.bottom() - head.bottom()) / rows.max(1) as f32;
    let large = each >= 64.0;
    let sentence_size = if large {
        size::HEADER
    } else if each >= 48.0 {
        22.0
    } else {
        size::BAR
    };
    for (k, row) in lines.iter().take(rows).enumerate() {
        let top = head.bottom() + k as f32 * each;
        ui.painter().hline(inner.x_range(), top, Stroke::new(1.0, theme.stroke));
        let place = Rect::from_min_max(pos2(inner.left(), top), pos2(inner.right(), top + each));
        let side = (each - 16.0).clamp(18.0, 40.0);
        let sign = Rect::from_center_size(pos2(inner.left() + 20.0, place.center().y), Vec2::splat(side));
        match row.sign {
            RowSign::Verdict(verdict) => verdict.paint(ui.painter(), sign, theme),
            RowSign::Check => crate::gui::widgets::sign::check(ui.painter(), sign.center(), 0.6 * side, theme.text),
            RowSign::Wrong => crate::gui::widgets::sign::problem(ui.painter(), sign.shrink(2.0), true, theme),
            RowSign::Open => Sign::None.paint(ui.painter(), sign.shrink(4.0), theme),
        }
        let text = place.with_min_x(inner.left() + 56.0);
        let with_note = each >= 48.0 && !row.note.is_empty();
        let upper = if with_note { text.with_max_y(text.center().y + 4.0) } else { text };
        let align = if with_note { Align2::LEFT_BOTTOM } else { Align2::LEFT_CENTER };
        words::line(ui, upper, align, &row.sentence, fonts::semibold(sentence_size), theme.text);
        if with_note {
            let lower = text.with_min_y(text.center().y + if large { 7.0 } else { 5.0 });
            words::line(ui, lower, Align2::LEFT_TOP, &row.note, fonts::regular(15.0_f32.min(0.28 * each)), theme.quiet);
        }
    }
}

/// The key of the title, and the rows.
fn lines(inspection: &Inspection, rows: usize, words: &Words) -> (&'static str, Vec<Row>) {
    let order = worst_first(&inspection.points);
    let any_bad = order.first().is_some_and(|k| inspection.points[*k].verdict != Verdict::Pass);
    let shown = order.iter().map(|k| &inspection.points[*k]).filter(|p| !any_bad || p.verdict != Verdict::Pass);
    let rows = shown.take(rows).map(|point| row(point, words)).collect();
    (if any_bad { "operator.worst" } else { "operator.closest" }, rows)
}

fn row(point: &PointResult, words: &Words) -> Row {
    let sign = RowSign::Verdict(point.verdict.into());
    let what = words.fill(kind_key(point.kind), &[("name", &clean(&point.name))]);
    let (sentence, note) = match &point.measurement {
        Some(measurement) => measured(point, measurement.deviation_mm, measurement.uncertainty_mm, &what, words),
        None => {
            let reason = point.reason.as_deref().map(|reason| words.told(reason)).unwrap_or_default();
            (words.fill("point.not_measured", &[("point", &what)]), reason)
        }
    };
    Row { sign, sentence, note }
}

fn kind_key(kind: &str) -> &'static str {
    match kind {
        "surface" => "point.surface",
        "edge" => "point.edge",
        _ => "point.hole",
    }
}

/// The direction in plain words, and the numbers: "high" is along the plan's direction, "long" outwards along an edge's.
fn measured(point: &PointResult, deviation_mm: f64, u_mm: f64, what: &str, words: &Words) -> (String, String) {
    let (above, below) = (deviation_mm - point.upper_mm, point.lower_mm - deviation_mm);
    let past = above.max(below);
    let length = |mm: f64| words.number(mm, 3);
    let fill = |key: &str, mm: f64| words.fill(key, &[("point", what), ("mm", &length(mm))]);
    let value = |mm: f64| if is_distance(point) { length(mm) } else { words.signed_mm(mm) };
    let (limit_key, limit) = match (is_distance(point), above > below) {
        (true, _) => ("point.limit", point.upper_mm),
        (false, true) => ("point.upper_limit", point.upper_mm),
        (false, false) => ("point.lower_limit", point.lower_mm),
    };
    let values = [("value", value(deviation_mm)), ("limit", value(limit)), ("u", length(u_mm))];
    let values = values.each_ref().map(|(k, v)| (*k, v.as_str()));
    let note = words.fill(limit_key, &values);
    match point.verdict {
        Verdict::Fail if past > 0.0 => {
            let key = match (point.kind, above > below) {
                ("surface", true) => "point.too_high",
                ("surface", false) => "point.too_low",
                ("edge", true) => "point.too_long",
                ("edge", false) => "point.too_short",
                _ => return (fill("point.off", deviation_mm.abs()), note),
            };
            (fill(key, past), note)
        }
        Verdict::Undecided => {
            (words.fill("point.undecided", &[("point", what)]), format!("{note}, {}", words.fill("point.u", &values)))
        }
        Verdict::Pass => {
            let percent = point.tolerance_ratio().map(|r| words.number(100.0 * r, 0)).unwrap_or_default();
            (words.fill("point.in", &[("point", what), ("percent", &percent)]), note)
        }
        _ => {
            let reason = point.reason.as_deref().map(|reason| words.told(reason)).unwrap_or(note);
            (words.fill("point.fail", &[("point", what)]), reason)
        }
    }
}
