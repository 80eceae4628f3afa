//! Words at a place: cut with an ellipsis where they do not fit, known to screen readers and tests by what they say.

use egui::text::{LayoutJob, TextFormat, TextWrapping};
use egui::{Align2, Color32, FontId, Galley, Rect, Role, Sense, Ui, WidgetInfo};
use std::sync::Arc;

/// A galley of one row at most as wide as asked.
fn row(ui: &Ui, text: &str, font: FontId, colour: Color32, width: f32, rows: usize) -> Arc<Galley> {
    // No number is parted at its thousands: of all spaces a line is broken at, only this one is not.
    let text = if rows > 1 { text.replace('\u{2009}', "\u{a0}") } else { text.to_owned() };
    let mut job = LayoutJob::single_section(text, TextFormat::simple(font, colour));
    job.wrap = TextWrapping { max_width: width, max_rows: rows, break_anywhere: rows == 1, ..TextWrapping::default() };
    ui.painter().layout_job(job)
}

/// Whether a text stands whole in so many rows of a width.
pub fn fits(ui: &Ui, text: &str, font: FontId, width: f32, rows: usize) -> bool {
    !row(ui, text, font, Color32::PLACEHOLDER, width, rows).elided
}

/// As many of a text's sentences and clauses as stand whole in so many rows, with a sign that there are more. Where not even the first one does, the
/// text as it is.
pub fn whole_clauses(ui: &Ui, text: &str, font: &FontId, width: f32, rows: usize) -> String {
    if fits(ui, text, font.clone(), width, rows) {
        return text.to_owned();
    }
    let mut ends: Vec<usize> = [". ", "; "].iter().flat_map(|end| text.match_indices(end)).map(|(at, _)| at).collect();
    ends.sort_unstable_by(|a, b| b.cmp(a));
    let shorter = ends.into_iter().map(|at| format!("{} …", &text[..at]));
    let mut fitting = shorter.filter(|text| fits(ui, text, font.clone(), width, rows));
    fitting.next().unwrap_or_else(|| text.to_owned())
}

/// A name in at most so many letters: its front and, longer, its end, which tells scans apart.
pub fn cut_in_the_middle(name: &str, most: usize) -> String {
    let count = name.chars().count();
    if count <= most {
        return name.to_owned();
    }
    let kept = most.saturating_sub(1);
    let front = kept / 3;
    let end = name.chars().skip(count - (kept - front));
    name.chars().take(front).chain(std::iter::once('…')).chain(end).collect()
}

/// A text with the name in it cut in the middle, as far as is needed for all up to the name's end to stand in a width.
pub fn with_name_in(ui: &Ui, text: &str, name: &str, font: &FontId, room: f32) -> String {
    let Some(at) = text.rfind(name).filter(|_| !name.is_empty()) else { return text.to_owned() };
    let (before, after) = (&text[..at], &text[at + name.len()..]);
    // What follows the name may be cut, and a sign of that stands there.
    let rest = if after.is_empty() { "" } else { " …" };
    let fits = |name: &str| width(ui, &format!("{before}{name}{rest}"), font.clone()) <= room;
    let whole = width(ui, text, font.clone()) <= room || fits(name);
    let count = name.chars().count();
    let shorter = || (LEAST_NAME..count).rev().map(|most| cut_in_the_middle(name, most)).find(|name| fits(name));
    let name = if whole { name.to_owned() } else { shorter().unwrap_or_else(|| cut_in_the_middle(name, LEAST_NAME)) };
    format!("{before}{name}{after}")
}

/// Letters of which a name consists at least.
const LEAST_NAME: usize = 6;

/// How wide a text is when nothing limits it.
pub fn width(ui: &Ui, text: &str, font: FontId) -> f32 {
    ui.painter().layout_no_wrap(text.to_owned(), font, Color32::PLACEHOLDER).size().x
}

/// The largest size between two at which a text is no wider than asked; at the smallest it may still be cut.
pub fn fitting_size(
    ui: &Ui,
    text: &str,
    font: impl Fn(f32) -> FontId,
    width_limit: f32,
    largest: f32,
    least: f32,
) -> f32 {
    let wide = width(ui, text, font(largest));
    if wide <= width_limit { largest } else { (largest * width_limit / wide).floor().max(least) }
}

/// Writes one line inside a place; returns where it stands.
pub fn line(ui: &mut Ui, place: Rect, align: Align2, text: &str, font: FontId, colour: Color32) -> Rect {
    block(ui, place, align, text, font, colour, 1)
}

/// Writes up to so many lines inside a place; returns where they stand.
pub fn block(ui: &mut Ui, place: Rect, align: Align2, text: &str, font: FontId, colour: Color32, rows: usize) -> Rect {
    if text.is_empty() || place.width() < 1.0 {
        return Rect::from_min_size(place.min, egui::Vec2::ZERO);
    }
    let galley = row(ui, text, font, colour, place.width(), rows);
    let rect = align.align_size_within_rect(galley.size(), place);
    ui.painter().galley(rect.min, galley, colour);
    named(ui, rect, text);
    rect
}

/// Makes a painted place known by its words.
pub fn named(ui: &mut Ui, place: Rect, text: &str) {
    let id = ui.scope_id().with((text, place.min.x as i32, place.min.y as i32));
    let response = ui.interact(place, id, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, text));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_their_end() {
        for (name, short) in [
            ("0017.ply", "0017.ply"),
            ("Bracket_RH_2026-11-23_0003.ply", "Brac…3_0003.ply"),
            ("03_out_of_tolerance", "03_o…_tolerance"),
            ("åäö_åäö_åäö_åäö_1", "åäö_…äö_åäö_1"),
        ] {
            let told = cut_in_the_middle(name, short.chars().count());
            assert_eq!(told, short);
        }
        assert_eq!((cut_in_the_middle("abc", 1), cut_in_the_middle("abc", 0)), ("…".into(), "…".into()));
    }
}
