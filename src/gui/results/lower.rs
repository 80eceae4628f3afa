//! Histogram and trend, below the views.

use super::trend::{self, Span};
use super::{ResultsView, histogram};
use crate::gui::action::Action;
use crate::gui::facts::FinishedPart;
use crate::gui::fonts;
use crate::gui::scene::content::MapContent;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::inspect::{Inspection, PointResult};
use egui::{Align2, Button, Rect, RichText, Ui, pos2, vec2};
use std::sync::Arc;

/// What shares the place of histogram and trend.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Lower {
    #[default]
    /// The chosen point over the parts.
    Trend,
    /// The deviations of all points.
    Histogram,
}

/// Histogram and trend, apart or in one place.
pub struct Lowers<'a> {
    /// The part.
    pub part: &'a Arc<FinishedPart>,
    /// Its place among the parts.
    pub place: usize,
    /// Its result.
    pub inspection: &'a Inspection,
    /// The chosen point.
    pub chosen: Option<&'a PointResult>,
    /// Its map, when it is ready.
    pub map: Option<&'a MapContent>,
}

const TITLE: f32 = 36.0;

impl Lowers<'_> {
    /// The histogram in a card.
    pub fn histogram(&self, ui: &mut Ui, at: Rect, view: &ResultsView, scope: &Scope) {
        cards::card(ui, at, scope.theme);
        let width = scope.words.number(2.0 * self.part.result.map_range_mm / 40.0, 3);
        let text = scope.words.fill("results.histogram", &[("mm", &width)]);
        title(ui, at, &text, scope);
        self.histogram_in(ui, body(at), view, scope);
    }

    fn histogram_in(&self, ui: &mut Ui, at: Rect, view: &ResultsView, scope: &Scope) {
        let statistics = &self.inspection.map.statistics;
        histogram::histogram_ui(ui, at, self.map.map(|m| &m.histogram), statistics, &view.scale, scope);
    }

    /// The trend in a card.
    pub fn trend(&self, ui: &mut Ui, at: Rect, span: &mut Span, scope: &mut Scope) {
        cards::card(ui, at, scope.theme);
        let left = span_ui(ui, at, span, scope);
        title(ui, at.with_max_x(left), &self.trend_title(scope), scope);
        self.trend_in(ui, body(at), *span, scope);
    }

    fn trend_title(&self, scope: &Scope) -> String {
        match self.chosen {
            Some(point) => scope.words.fill("results.trend_of", &[("point", &point.name)]),
            None => scope.words.text("results.tab_trend").to_owned(),
        }
    }

    fn trend_in(&self, ui: &mut Ui, at: Rect, span: Span, scope: &mut Scope) {
        if let Some(part) = trend::trend_ui(ui, at, self.chosen, self.place, span, scope) {
            scope.ask(Action::ChoosePart(Some(part)));
        }
    }

    /// Both in one card, one at a time.
    pub fn either(&self, ui: &mut Ui, at: Rect, view: &mut ResultsView, scope: &mut Scope) {
        cards::card(ui, at, scope.theme);
        let bar = at.with_max_y(at.top() + TITLE);
        let wide = |text: &str| write::width(ui, text, fonts::semibold(size::TABLE)) + 24.0;
        let map = scope.words.text("results.map_points");
        let room = bar.width() - wide(map) - span_width(ui, scope) - 40.0;
        // Which point it is stands in the other tabs, too.
        let trend = Some(self.trend_title(scope)).filter(|title| wide(title) <= room);
        let trend = trend.unwrap_or_else(|| scope.words.text("results.tab_trend").to_owned());
        let choices = [(Lower::Trend, trend), (Lower::Histogram, map.to_owned())];
        let mut x = bar.left() + 10.0;
        for (lower, text) in choices {
            let wide = write::width(ui, &text, fonts::semibold(size::TABLE)) + 24.0;
            let place = Rect::from_min_size(pos2(x, bar.top() + 5.0), vec2(wide, 26.0));
            let text = RichText::new(text).font(fonts::semibold(size::TABLE));
            if ui.put(place, Button::selectable(view.lower == lower, text)).clicked() {
                view.lower = lower;
            }
            x += wide + 6.0;
        }
        match view.lower {
            Lower::Trend => {
                span_ui(ui, at, &mut view.trend_span, scope);
                self.trend_in(ui, body(at), view.trend_span, scope);
            }
            Lower::Histogram => self.histogram_in(ui, body(at), view, scope),
        }
    }
}

const SPANS: [(Span, &str); 2] = [(Span::Last, "results.last_200"), (Span::Sequence, "results.this_sequence")];

/// What that switch takes.
fn span_width(ui: &Ui, scope: &Scope) -> f32 {
    let of = |key: &str| write::width(ui, scope.words.text(key), fonts::semibold(size::TABLE)) + 26.0;
    SPANS.iter().map(|(_, key)| of(key)).sum()
}

/// The switch between this sequence and the last parts, at the right of a card's title; returns where it begins.
fn span_ui(ui: &mut Ui, card: Rect, span: &mut Span, scope: &Scope) -> f32 {
    let mut right = card.right() - 10.0;
    for (which, key) in SPANS {
        let text = scope.words.text(key);
        let wide = write::width(ui, text, fonts::semibold(size::TABLE)) + 20.0;
        let place = Rect::from_min_size(pos2(right - wide, card.top() + 5.0), vec2(wide, 26.0));
        let text = RichText::new(text).font(fonts::semibold(size::TABLE));
        if ui.put(place, Button::selectable(*span == which, text)).clicked() {
            *span = which;
        }
        right = place.left() - 6.0;
    }
    right
}

fn title(ui: &mut Ui, card: Rect, text: &str, scope: &Scope) {
    let line = Rect::from_min_max(card.min + vec2(14.0, 0.0), pos2(card.right() - 14.0, card.top() + TITLE));
    write::line(ui, line, Align2::LEFT_CENTER, text, fonts::semibold(size::BODY), scope.theme.text);
}

fn body(card: Rect) -> Rect {
    Rect::from_min_max(pos2(card.left() + 8.0, card.top() + TITLE), card.max - vec2(10.0, 6.0))
}
