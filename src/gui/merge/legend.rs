//! The colour scale beside a cloud: values of a metric, deviations, or wear.

use super::colours::{By, Colours, NO_VALUE, of_scale};
use super::figures;
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::scene::legend::colour;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use egui::{Align2, CornerRadius, Rect, Stroke, StrokeKind, Ui, pos2, vec2};

/// Width of the legend with its numbers.
pub const WIDTH: f32 = 104.0;

/// Words that are too wide become smaller, down to this.
const LEAST: f32 = 9.0;

/// What a legend is of.
pub struct Legend<'a> {
    /// What the colours tell.
    pub by: By,
    /// The scale.
    pub colours: &'a Colours,
    /// Unit of the views.
    pub unit: LengthUnit,
}

impl Legend<'_> {
    fn diverging(&self) -> bool {
        matches!(self.by, By::Deviation(_) | By::Wear)
    }

    fn title(&self, words: &Words) -> String {
        let (text, unit) = match self.by {
            By::View => (words.text("merge.view").to_owned(), ""),
            By::Metric(metric) => (metric.key().to_owned(), figures::metric_unit(metric, self.unit)),
            By::Deviation(_) => (words.text("merge.deviation").to_owned(), figures::unit(self.unit)),
            By::Wear => (words.text("merge.wear").to_owned(), figures::unit(self.unit)),
        };
        if unit.is_empty() { text } else { format!("{text}, {unit}") }
    }

    fn tick(&self, value: f64, words: &Words) -> String {
        if !self.diverging() {
            return figures::threshold(figures::rounded(value), words);
        }
        let text = words.number(value, figures::threshold_decimals(self.colours.range.map_or(1.0, |r| 0.25 * r[1])));
        if value > 0.0 { format!("+{text}") } else { text }
    }
}

/// Draws it into a place, from its top.
pub fn legend_ui(ui: &mut Ui, at: Rect, legend: &Legend<'_>, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let Some([low, high]) = legend.colours.range else { return };
    let title = at.with_max_y(at.top() + 18.0);
    let name = legend.title(words);
    let points = write::fitting_size(ui, &name, fonts::semibold, title.width(), size::NOTE, LEAST);
    write::line(ui, title, Align2::LEFT_CENTER, &name, fonts::semibold(points), theme.text);
    let mut notes: Vec<String> = Vec::new();
    let beyond = legend.colours.beyond;
    for (count, key) in [(beyond[0], "results.over"), (beyond[1], "results.under")] {
        if count > 0 && legend.diverging() {
            notes.push(words.fill(key, &[("n", &words.thousands(count))]));
        }
    }
    if legend.colours.none > 0 {
        notes.push(words.fill("merge.without", &[("n", &words.thousands(legend.colours.none))]));
    }
    let room = at.height() - 34.0;
    notes.truncate(((room - 80.0) / 18.0).max(0.0) as usize);
    let bar_height = (room - 18.0 * notes.len() as f32).clamp(20.0, 300.0);
    let bar = Rect::from_min_size(pos2(at.left(), at.top() + 26.0), vec2(18.0, bar_height));
    let slices = bar.height().round().max(1.0) as usize;
    for k in 0..slices {
        let share = 1.0 - (k as f64 + 0.5) / slices as f64;
        let top = bar.top() + bar.height() * k as f32 / slices as f32;
        let slice = Rect::from_min_max(pos2(bar.left(), top), pos2(bar.right(), (top + 1.5).min(bar.bottom())));
        ui.painter().rect_filled(slice, CornerRadius::ZERO, colour(of_scale(share, legend.diverging())));
    }
    let frame = Stroke::new(1.0, theme.strong_stroke);
    ui.painter().rect_stroke(bar, CornerRadius::ZERO, frame, StrokeKind::Outside);
    let ticks = if bar_height >= 80.0 { 5 } else { 2 };
    for k in 0..ticks {
        let share = f64::from(k) / f64::from(ticks - 1);
        let y = bar.bottom() - bar.height() * share as f32;
        ui.painter().hline(bar.right()..=bar.right() + 5.0, y, frame);
        let text = legend.tick(low + share * (high - low), words);
        ui.painter().text(pos2(bar.right() + 9.0, y), Align2::LEFT_CENTER, text, fonts::mono(size::NOTE), theme.text);
    }
    let last = notes.len().saturating_sub(1);
    for (k, note) in notes.iter().enumerate() {
        let line = Rect::from_min_size(pos2(at.left(), bar.bottom() + 8.0 + 18.0 * k as f32), vec2(at.width(), 18.0));
        let mut text = line;
        if k == last && legend.colours.none > 0 {
            let swatch = Rect::from_center_size(pos2(line.left() + 5.0, line.center().y), vec2(10.0, 10.0));
            ui.painter().rect_filled(swatch, 2, colour(NO_VALUE));
            text.min.x += 14.0;
        }
        let points = write::fitting_size(ui, note, fonts::regular, text.width(), size::NOTE, LEAST);
        write::line(ui, text, Align2::LEFT_CENTER, note, fonts::regular(points), theme.text);
    }
}
