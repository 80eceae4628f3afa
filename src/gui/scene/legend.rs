//! The colour scale beside a map.

use crate::gui::fonts;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::words;
use crate::report::palette::{Rgb, Scale};
use egui::{Align2, Color32, CornerRadius, Painter, Rect, Shape, Stroke, StrokeKind, Ui, pos2, vec2};

/// Width of the legend with its numbers, points.
pub const WIDTH: f32 = 112.0;

/// What a legend says beside its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Notes {
    /// Points over and under the scale's ends.
    pub beyond: [usize; 2],
    /// Lines of equal deviation are drawn (on a surface, not on points).
    pub lines: bool,
}

/// The two greys of "no data".
pub const HATCH: [Rgb; 2] = [[0xCC, 0xD1, 0xD9], [0x85, 0x8F, 0x9C]];

/// A colour of the palette for egui.
pub fn colour(rgb: Rgb) -> Color32 {
    Color32::from_rgb(rgb[0], rgb[1], rgb[2])
}

/// What keeps words readable where the part lies behind them.
pub fn plate(painter: &Painter, at: Rect, theme: &Theme) {
    painter.rect_filled(at, CornerRadius::same(4), theme.scene.gamma_multiply(0.86));
}

/// Draws it at the right side of a place, from its top.
pub fn legend_ui(ui: &mut Ui, at: Rect, scale: &Scale, notes: &Notes, text: &Words, theme: &Theme) {
    let x = at.right() - WIDTH;
    let wanted = usize::from(notes.beyond[0] > 0) + usize::from(notes.beyond[1] > 0) + 1 + usize::from(notes.lines);
    let (bar_height, shown) = heights(at.height(), wanted);
    let title = Rect::from_min_size(pos2(x, at.top()), vec2(WIDTH, 18.0));
    let font = fonts::semibold(size::NOTE);
    words::line(ui, title, Align2::LEFT_TOP, text.text("results.deviation_mm"), font, theme.text);
    let bar = Rect::from_min_size(pos2(x, at.top() + 22.0), vec2(18.0, bar_height));
    bar_of(ui.painter(), bar, scale, theme);
    for tick in ticks(&scale.ticks_mm(), bar_height) {
        let y = bar.top() + bar.height() * (0.5 - 0.5 * tick / scale.range_mm) as f32;
        ui.painter().hline(bar.right()..=bar.right() + 5.0, y, Stroke::new(1.0, theme.strong_stroke));
        let at = pos2(bar.right() + 9.0, y);
        ui.painter().text(at, Align2::LEFT_CENTER, text.signed_mm(tick), fonts::mono(size::NOTE), theme.text);
    }
    let mut y = bar.bottom() + 24.0;
    let mut left = shown;
    let mut note = |ui: &mut Ui, words_of: &str, swatch: &dyn Fn(&Painter, Rect)| {
        if left == 0 {
            return;
        }
        left -= 1;
        let place = Rect::from_min_size(pos2(x, y - 6.0), vec2(18.0, 12.0));
        swatch(ui.painter(), place);
        let line = Rect::from_min_size(pos2(x + 27.0, y - 8.0), vec2(WIDTH - 27.0, 16.0));
        words::line(ui, line, Align2::LEFT_CENTER, words_of, fonts::regular(size::NOTE), theme.text);
        y += 20.0;
    };
    for (count, key, end) in [(notes.beyond[0], "results.over", 1.0), (notes.beyond[1], "results.under", -1.0)] {
        if count > 0 {
            let words_of = text.fill(key, &[("n", &text.thousands(count))]);
            note(ui, &words_of, &|painter, place| arrow(painter, place, end, scale, theme));
        }
    }
    note(ui, text.text("results.no_data"), &|painter, place| hatch(painter, place, theme));
    if notes.lines {
        let words_of = text.fill("results.line_every", &[("mm", &text.number(0.25 * scale.range_mm, 3))]);
        note(ui, &words_of, &|painter, place| {
            let grey = scale.palette.colour(0.0);
            painter.rect(
                place,
                CornerRadius::ZERO,
                colour(grey),
                Stroke::new(1.0, theme.strong_stroke),
                StrokeKind::Inside,
            );
            painter.hline(
                place.x_range(),
                place.center().y,
                Stroke::new(1.0, colour(grey.map(|c| (0.74 * f64::from(c)) as u8))),
            );
        });
    }
}

/// Height of a line below the bar.
const NOTE: f32 = 20.0;
/// The lowest bar beside which all lines stand; below that the last lines give way.
const LEAST_BAR: f32 = 96.0;

/// The height of the bar and how many of the lines below it have room in a legend of a height.
fn heights(all: f32, notes: usize) -> (f32, usize) {
    let bar = |notes: usize| all - 30.0 - if notes > 0 { 6.0 + NOTE * notes as f32 } else { 0.0 };
    let shown = (0..=notes).rev().find(|n| bar(*n) >= LEAST_BAR).unwrap_or(0);
    (bar(shown).clamp(24.0, 310.0), shown)
}

/// The ticks that have room beside a bar: all nine, five or three of them.
fn ticks(all: &[f64], bar: f32) -> Vec<f64> {
    let every = [1, 2, 4].into_iter().find(|every| bar * *every as f32 >= 13.0 * (all.len() as f32 - 1.0));
    all.iter().copied().step_by(every.unwrap_or(all.len().saturating_sub(1)).max(1)).collect()
}

fn bar_of(painter: &Painter, bar: Rect, scale: &Scale, theme: &Theme) {
    let slices = bar.height().round().max(1.0) as usize;
    for k in 0..slices {
        let value = 1.0 - 2.0 * (k as f64 + 0.5) / slices as f64;
        let top = bar.top() + bar.height() * k as f32 / slices as f32;
        let slice = Rect::from_min_max(pos2(bar.left(), top), pos2(bar.right(), (top + 1.5).min(bar.bottom())));
        painter.rect_filled(slice, CornerRadius::ZERO, colour(scale.colour(value * scale.range_mm)));
    }
    painter.rect_stroke(bar, CornerRadius::ZERO, Stroke::new(1.0, theme.strong_stroke), StrokeKind::Outside);
}

/// The end's colour, with a rim that is seen on every ground: the darkest colours are those of the ends.
fn arrow(painter: &Painter, place: Rect, end: f64, scale: &Scale, theme: &Theme) {
    let up = if end > 0.0 { -1.0 } else { 1.0 };
    let corners = [vec2(0.0, 5.0 * up), vec2(6.0, -4.0 * up), vec2(-6.0, -4.0 * up)].map(|v| place.center() + v);
    painter.add(Shape::convex_polygon(
        corners.to_vec(),
        colour(scale.colour(end * scale.range_mm)),
        Stroke::new(1.2, theme.quiet),
    ));
}

fn hatch(painter: &Painter, place: Rect, theme: &Theme) {
    let painter = painter.with_clip_rect(place.intersect(painter.clip_rect()));
    painter.rect_filled(place, CornerRadius::ZERO, colour(HATCH[0]));
    for k in 0..8 {
        let x = place.left() - place.height() + 5.0 * k as f32;
        let ends = [pos2(x, place.bottom()), pos2(x + place.height(), place.top())];
        painter.line_segment(ends, Stroke::new(2.0, colour(HATCH[1])));
    }
    painter.rect_stroke(place, CornerRadius::ZERO, Stroke::new(1.0, theme.strong_stroke), StrokeKind::Inside);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_stays_in_its_place_and_its_numbers_apart() {
        let all: Vec<f64> = (0..9).map(f64::from).collect();
        for height in 70..900 {
            for notes in 0..=4 {
                let (bar, shown) = heights(height as f32, notes);
                let below = if shown > 0 { 6.0 + NOTE * shown as f32 } else { 0.0 };
                assert!(22.0 + bar + 8.0 + below <= height as f32 + 1e-3, "{height}, {notes}: {bar}, {shown}");
                assert!(height < 240 || shown == notes, "{height}, {notes}: {bar}, {shown}");
                let ticks = ticks(&all, bar);
                assert!([2, 3, 5, 9].contains(&ticks.len()) && ticks.last() == Some(&8.0), "{height}: {ticks:?}");
                let apart = bar / (ticks.len() as f32 - 1.0);
                assert!(apart >= 13.0, "{height}, {notes}: {apart}");
            }
        }
    }

    /// A dark red and a dark blue on a dark ground: WCAG 2 asks 3 of signs.
    #[test]
    fn the_rim_of_an_arrow_is_seen_in_both_themes() {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let luminance = |c: Color32| 0.2126 * linear(c.r()) + 0.7152 * linear(c.g()) + 0.0722 * linear(c.b());
        for theme in [&Theme::LIGHT, &Theme::DARK] {
            let (a, b) = (luminance(theme.quiet), luminance(theme.scene));
            assert!((a.max(b) + 0.05) / (a.min(b) + 0.05) >= 3.0);
        }
    }
}
