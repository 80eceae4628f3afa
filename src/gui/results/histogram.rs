//! How many points of the map have which deviation.

use super::still_plot::still_plot;
use crate::gui::fonts;
use crate::gui::scene::content::Histogram;
use crate::gui::scene::legend::colour;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use crate::inspect::MapStatistics;
use crate::report::palette::Scale;
use egui::{Align2, Rect, Role, Stroke, Ui, WidgetInfo, pos2, vec2};
use egui_plot::{Bar, BarChart, LineStyle, VLine};

/// Draws the histogram with mean and quantiles, its statistics below.
pub fn histogram_ui(
    ui: &mut Ui,
    at: Rect,
    histogram: Option<&Histogram>,
    statistics: &MapStatistics,
    scale: &Scale,
    scope: &Scope,
) {
    let (theme, words) = (scope.theme, scope.words);
    let Some(histogram) = histogram else {
        write::line(
            ui,
            at,
            Align2::CENTER_CENTER,
            words.text("results.no_map"),
            fonts::regular(size::BODY),
            theme.quiet,
        );
        return;
    };
    let foot = at.with_min_y(at.bottom() - 22.0);
    let bars: Vec<Bar> = histogram
        .counts
        .iter()
        .enumerate()
        .map(|(k, &count)| {
            let middle = histogram.start_mm + (k as f64 + 0.5) * histogram.width_mm;
            let fill = colour(scale.colour(middle));
            Bar::new(middle, count as f64)
                .width(0.94 * histogram.width_mm)
                .fill(fill)
                .stroke(Stroke::new(0.5, theme.strong_stroke))
        })
        .collect();
    let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let end = histogram.start_mm.abs();
    let plot = still_plot("histogram")
        .include_x(-end)
        .include_x(end)
        .include_y(0.0)
        .include_y(1.12 * most)
        .set_margin_fraction(vec2(0.01, 0.0))
        .show_background(false)
        .grid_color(theme.stroke)
        .show_grid([false, true])
        .x_grid_spacer(move |_| quarters(end))
        .y_grid_spacer(|input| super::trend::marks(input.bounds, 4.0))
        .x_axis_formatter(move |mark, _| {
            words.signed_mm(mark.value).trim_end_matches('0').trim_end_matches(['.', ',']).to_owned()
        })
        .y_axis_formatter(move |mark, _| short_count(mark.value))
        .label_formatter(|_| None);
    let place = at.with_max_y(foot.top() - 4.0);
    let builder = egui::UiBuilder::new().max_rect(place);
    ui.scope_builder(builder, |ui| {
        let shown = plot.show(ui, |plot| {
            plot.bar_chart(BarChart::new("", bars).allow_hover(false));
            let dashed = LineStyle::Dashed { length: 4.0 };
            for (value, style) in
                [(statistics.p05_mm, dashed), (statistics.mean_mm, LineStyle::Solid), (statistics.p95_mm, dashed)]
            {
                plot.vline(VLine::new("", value).stroke(Stroke::new(1.2, theme.text)).style(style).allow_hover(false));
            }
        });
        shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words.text("results.map_points")));
    });
    let figures = [
        ("results.mean", words.signed_mm(statistics.mean_mm)),
        ("rms", words.number(statistics.rms_mm, 3)),
        ("results.p05", words.signed_mm(statistics.p05_mm)),
        ("results.p95", words.signed_mm(statistics.p95_mm)),
    ];
    figures_ui(ui, foot, &figures.map(|(key, value)| format!("{} {value}", words.text(key))), scope);
}

/// Figures in a row, the room between them shared; smaller where they would not fit.
fn figures_ui(ui: &mut Ui, place: Rect, figures: &[String], scope: &Scope) {
    const GAP: f32 = 10.0;
    let gaps = figures.len() as f32;
    let all = write::width(ui, &figures.concat(), fonts::mono(size::NOTE));
    let font = fonts::mono(size::NOTE * ((place.width() - GAP * gaps) / all).min(1.0));
    let widths: Vec<f32> = figures.iter().map(|text| write::width(ui, text, font.clone())).collect();
    let gap = (place.width() - widths.iter().sum::<f32>()) / gaps;
    let mut left = place.left();
    for (text, wide) in figures.iter().zip(widths) {
        let at = Rect::from_min_size(pos2(left, place.top()), vec2(wide + gap, place.height()));
        write::line(ui, at, Align2::CENTER_CENTER, text, font.clone(), scope.theme.text);
        left = at.right();
    }
}

/// Marks at the ends, the middle and half-way of the range.
fn quarters(end: f64) -> Vec<egui_plot::GridMark> {
    (-2..=2).map(|k| egui_plot::GridMark { value: 0.5 * end * f64::from(k), step_size: 2.0 * end }).collect()
}

/// A count as an axis says it: thousands as k, millions as M.
fn short_count(count: f64) -> String {
    match count {
        c if c >= 1e6 => format!("{:.1} M", c / 1e6),
        c if c >= 1e3 => format!("{:.0} k", c / 1e3),
        c => format!("{c:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_short_on_an_axis() {
        assert_eq!([0.0, 950.0, 20_000.0, 1_500_000.0].map(short_count), ["0", "950", "20 k", "1.5 M"]);
    }
}
