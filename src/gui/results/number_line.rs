//! A value between its limits on a line: uncertain zones around the limits, the value with its uncertainty.

use crate::gui::fonts;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign::Sign;
use crate::inspect::PointResult;
use egui::{CornerRadius, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

/// Where values stand on the line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    low_mm: f64,
    high_mm: f64,
}

impl Span {
    /// Holds limits and value with some room; a limit that is none is left out.
    fn of(point: &PointResult) -> Option<Span> {
        let m = point.measurement.as_ref();
        let ends = m.map(|m| [m.deviation_mm - m.uncertainty_mm, m.deviation_mm + m.uncertainty_mm]);
        let all: Vec<f64> = [point.lower_mm, point.upper_mm].into_iter().chain(ends.into_iter().flatten()).collect();
        let finite = || all.iter().copied().filter(|v| v.is_finite());
        let low = finite().fold(f64::INFINITY, f64::min);
        let high = finite().fold(f64::NEG_INFINITY, f64::max);
        let low = if point.lower_mm.is_finite() { low } else { low.min(0.0) };
        (high > low).then_some(Span { low_mm: low - 0.12 * (high - low), high_mm: high + 0.12 * (high - low) })
    }

    fn x(&self, value_mm: f64, line: Rect) -> f32 {
        let share = (value_mm - self.low_mm) / (self.high_mm - self.low_mm);
        line.left() + line.width() * share.clamp(0.0, 1.0) as f32
    }
}

/// Draws the line of a point; a point without value has its limits only.
pub fn number_line_ui(ui: &mut Ui, point: &PointResult, words: &Words, theme: &Theme) {
    let (all, response) = ui.allocate_exact_size(vec2(ui.available_width().min(560.0), 62.0), Sense::hover());
    let said = super::numbers::deviation(point, words);
    response
        .widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{}: {said}", words.text("results.deviation"))));
    let Some(span) = Span::of(point) else { return };
    let line = Rect::from_min_max(pos2(all.left(), all.top() + 22.0), pos2(all.right(), all.top() + 38.0));
    let painter = ui.painter();
    painter.hline(line.x_range(), line.center().y, Stroke::new(1.0, theme.stroke));
    let zone = |low: f64, high: f64| Rect::from_x_y_ranges(span.x(low, line)..=span.x(high, line), line.y_range());
    let low_mm = if point.lower_mm.is_finite() { point.lower_mm } else { 0.0 };
    let frame = Stroke::new(1.0, theme.pass);
    painter.rect(zone(low_mm, point.upper_mm), CornerRadius::ZERO, theme.pass_fill, frame, StrokeKind::Inside);
    let limits: Vec<f64> = [point.lower_mm, point.upper_mm].into_iter().filter(|v| v.is_finite()).collect();
    if let Some(m) = &point.measurement {
        for limit in &limits {
            let zone = zone(limit - m.uncertainty_mm, limit + m.uncertainty_mm);
            painter.rect_filled(zone, CornerRadius::ZERO, theme.undecided);
        }
    }
    let font = fonts::mono(size::NOTE);
    let zero = (!limits.contains(&0.0)).then_some(0.0);
    for tick in limits.iter().copied().chain(zero) {
        let x = span.x(tick, line);
        let is_limit = limits.contains(&tick);
        let (width, colour) = if is_limit { (2.0, theme.text) } else { (1.0, theme.quiet) };
        painter.vline(x, line.top() - 4.0..=line.bottom() + 4.0, Stroke::new(width, colour));
        let text = painter.layout_no_wrap(super::numbers::limit(point, tick, words), font.clone(), theme.text);
        let left = (x - 0.5 * text.size().x).clamp(all.left(), all.right() - text.size().x);
        painter.galley(pos2(left, line.bottom() + 6.0), text, theme.text);
    }
    let Some(m) = &point.measurement else { return };
    let x = span.x(m.deviation_mm, line);
    let (from, to) = (span.x(m.deviation_mm - m.uncertainty_mm, line), span.x(m.deviation_mm + m.uncertainty_mm, line));
    let stroke = Stroke::new(2.0, theme.text);
    painter.hline(from..=to, line.center().y, stroke);
    for end in [from, to] {
        painter.vline(end, line.center().y - 5.0..=line.center().y + 5.0, stroke);
    }
    let sign = Rect::from_center_size(pos2(x, line.center().y), vec2(15.0, 15.0));
    Sign::from(point.verdict).paint(painter, sign, theme);
    let value = format!("{said} ± {}", super::numbers::uncertainty(point, words));
    let text = painter.layout_no_wrap(value, fonts::mono(size::TABLE), theme.text);
    let left = (x - 0.5 * text.size().x).clamp(all.left(), all.right() - text.size().x);
    painter.galley(pos2(left, all.top()), text, theme.text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_line_holds_limits_and_value() {
        let result = example::bracket();
        let line = Rect::from_min_max(pos2(10.0, 0.0), pos2(110.0, 10.0));
        for point in &example::inspection(&result).points {
            let span = Span::of(point).unwrap();
            assert!(span.low_mm < point.lower_mm && span.high_mm > point.upper_mm);
            assert!(span.x(point.lower_mm, line) > 10.0 && span.x(point.upper_mm, line) < 110.0);
        }
        let mut distance = example::inspection(&result).points[0].clone();
        distance.lower_mm = f64::NEG_INFINITY;
        let span = Span::of(&distance).unwrap();
        assert!(span.low_mm.is_finite() && span.low_mm < 0.0 && span.high_mm > distance.upper_mm);
    }
}
