//! The curves of a study: the share of the points that stay, and how much they scatter, over the thresholds of a metric.

use super::facts::{Merging, bound};
use super::figures;
use super::masks::share_at;
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::results::still_plot::still_plot;
use crate::gui::results::trend::marks;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::plan::merge::Metric;
use crate::report::mask_study::{shown_thresholds, sigma_scale};
use crate::stitch::mask_study::{Curve, Step};
use egui::{Color32, Pos2, Rect, Role, Stroke, Ui, WidgetInfo, pos2, vec2};
use egui_plot::{
    AxisHints, HPlacement, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotTransform, PlotUi, Points, VLine,
};
use std::ops::RangeInclusive;

/// The scale of sigma_dev, laid over percents.
#[derive(Clone, Copy)]
struct Right {
    low: f64,
    high: f64,
}

impl Right {
    /// Of the steps whose thresholds are shown.
    fn of(curve: &Curve, shown: &RangeInclusive<f64>) -> Option<Self> {
        let steps = curve.steps.iter().filter(|step| shown.contains(&step.threshold));
        let [low, high] = sigma_scale(steps.filter_map(|step| step.sigma_dev))?;
        Some(Self { low, high })
    }

    fn percent(self, sigma: f64) -> f64 {
        100.0 * (sigma - self.low) / (self.high - self.low)
    }

    fn sigma(self, percent: f64) -> f64 {
        self.low + 0.01 * percent * (self.high - self.low)
    }

    /// Decimals that tell a tenth of a quarter of the scale, and no fewer than lengths have.
    fn decimals(self, unit: LengthUnit) -> usize {
        let step = 0.25 * (self.high - self.low);
        let needed = 1 - step.log10().floor() as i32;
        figures::decimals(unit).max(needed.clamp(0, 9) as usize)
    }
}

/// The colour of the scattering: that of deviations above.
fn sigma_colour(theme: &Theme) -> Color32 {
    if theme.dark { Color32::from_rgb(0xFB, 0x9E, 0x5D) } else { Color32::from_rgb(0xBC, 0x51, 0x0D) }
}

/// What a plot shows.
struct Lines<'a> {
    /// Thresholds that are shown with the share that each keeps, and all of them.
    shares: &'a [[f64; 2]],
    all: &'a [[f64; 2]],
    /// Thresholds with sigma_dev, on the right scale.
    sigmas: Vec<[f64; 2]>,
    right: Option<Right>,
    /// The threshold at hand, and the one that is suggested.
    now: Option<f64>,
    suggested: Option<f64>,
    unit: LengthUnit,
}

/// Draws the curves of a metric.
pub fn plot_ui(ui: &mut Ui, at: Rect, metric: Metric, study: Option<&Curve>, merging: &Merging, scope: &Scope) {
    let Some(preview) = merging.preview() else { return };
    let all = preview.keeps.get(&metric).map_or(&[][..], Vec::as_slice);
    let now = merging.mask(metric).and_then(bound);
    let suggested = merging.suggested(metric);
    let Some(shown) = shown(all, [now, suggested]) else { return };
    let shares: Vec<[f64; 2]> = all.iter().filter(|[x, _]| shown.contains(x)).copied().collect();
    let right = study.and_then(|curve| Right::of(curve, &shown));
    let sigmas = right.zip(study).map(|(right, curve)| {
        let of = |step: &Step| Some([step.threshold, right.percent(step.sigma_dev?)]);
        curve.steps.iter().filter_map(of).filter(|[x, _]| shown.contains(x)).collect()
    });
    let (low, high) = (*shown.start(), *shown.end());
    let lines = Lines {
        shares: &shares,
        all,
        sigmas: sigmas.unwrap_or_default(),
        right,
        now,
        suggested,
        unit: merging.plan.as_ref().map_or(LengthUnit::Mm, |plan| plan.unit),
    };
    let name = scope.words.fill("merge.curves_of", &[("metric", metric.key())]);
    ui.scope_builder(egui::UiBuilder::new().max_rect(at), |ui| {
        let shown = axes(metric, [low, high], &lines, scope).show(ui, |plot| draw(plot, metric, &lines, scope.theme));
        shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
        names_ui(ui, at, &shown.transform, &lines, scope);
    });
}

/// The thresholds that are shown: the usual ones, the one at hand and the suggested one.
fn shown(shares: &[[f64; 2]], marked: [Option<f64>; 2]) -> Option<RangeInclusive<f64>> {
    let thresholds: Vec<f64> = shares.iter().map(|[threshold, _]| *threshold).collect();
    let [a, b] = shown_thresholds(&thresholds)?;
    let (low, high) = (a.min(b), a.max(b));
    let wider = |(low, high): (f64, f64), x: f64| (low.min(x), high.max(x));
    let (low, high) = marked.into_iter().flatten().fold((low, high), wider);
    Some(low..=high)
}

/// The plot with its scales: percent at the left, sigma_dev at the right.
fn axes<'a>(metric: Metric, [low, high]: [f64; 2], lines: &Lines<'_>, scope: &Scope) -> Plot<'a> {
    let (theme, language, unit) = (scope.theme, scope.words.language(), lines.unit);
    let percents =
        |percent: f64| if (0.0..=100.0).contains(&percent) { format!("{percent:.0} %") } else { String::new() };
    let mut axes = vec![AxisHints::new_y().formatter(move |mark, _| percents(mark.value)).min_thickness(40.0)];
    if let Some(right) = lines.right {
        let told = move |percent: f64| {
            if !(0.0..=100.0).contains(&percent) {
                return String::new();
            }
            Words::of(language).number(right.sigma(percent), right.decimals(unit))
        };
        let placed = AxisHints::new_y().placement(HPlacement::Right);
        axes.push(placed.formatter(move |mark, _| told(mark.value)).min_thickness(44.0));
    }
    let quarters = || (0..=4).map(|k| egui_plot::GridMark { value: 25.0 * f64::from(k), step_size: 100.0 });
    still_plot(("study", metric.key()))
        .include_x(low)
        .include_x(high)
        .include_y(-2.0)
        .include_y(108.0)
        .set_margin_fraction(vec2(0.02, 0.0))
        .show_background(false)
        .grid_color(theme.stroke)
        .show_grid([false, true])
        .x_grid_spacer(|input| marks(input.bounds, 6.0))
        .y_grid_spacer(move |_| quarters().collect())
        .x_axis_formatter(move |mark, _| figures::threshold(mark.value, Words::of(language)))
        .custom_y_axes(axes)
        .label_formatter(|_| None)
}

fn draw(plot: &mut PlotUi<'_>, metric: Metric, lines: &Lines<'_>, theme: &Theme) {
    let share: PlotPoints<'_> = lines.shares.iter().map(|[x, share]| [*x, 100.0 * share]).collect();
    plot.line(Line::new("", share).stroke(Stroke::new(2.0, theme.accent)).allow_hover(false));
    let sigma: PlotPoints<'_> = lines.sigmas.iter().copied().collect();
    let stroke = Stroke::new(2.0, sigma_colour(theme));
    plot.line(Line::new("", sigma).stroke(stroke).style(LineStyle::Dashed { length: 7.0 }).allow_hover(false));
    if let Some(suggested) = lines.suggested {
        let line = VLine::new("", suggested).stroke(Stroke::new(1.5, theme.quiet));
        plot.vline(line.style(LineStyle::Dashed { length: 4.0 }).allow_hover(false));
    }
    if let Some(now) = lines.now {
        plot.vline(VLine::new("", now).stroke(Stroke::new(2.0, theme.text)).allow_hover(false));
        let at: PlotPoints<'_> = vec![[now, 100.0 * share_at(lines.all, metric, now)]].into();
        plot.points(Points::new("", at).radius(5.0).color(theme.accent).allow_hover(false));
    }
}

/// The names of the lines, clear of lines and thresholds.
fn names_ui(ui: &Ui, at: Rect, transform: &PlotTransform, lines: &Lines<'_>, scope: &Scope) {
    let place = |[x, y]: [f64; 2]| transform.position_from_point(&PlotPoint::new(x, y));
    let painter = ui.painter_at(at);
    let mut taken: Vec<Rect> = Vec::new();
    for x in [lines.suggested, lines.now].into_iter().flatten() {
        let x = place([x, 0.0]).x;
        taken.push(Rect::from_x_y_ranges(x - 1.0..=x + 1.0, at.y_range()));
    }
    let shares: Vec<Pos2> = lines.shares.iter().map(|[x, s]| place([*x, 100.0 * s])).collect();
    let sigmas: Vec<Pos2> = lines.sigmas.iter().map(|p| place(*p)).collect();
    for (line, against, key, colour) in [
        (&shares, &sigmas, "merge.line_points", scope.theme.accent),
        (&sigmas, &shares, "merge.line_sigma", sigma_colour(scope.theme)),
    ] {
        let text = scope.words.fill(key, &[("unit", figures::unit(lines.unit))]);
        name_line(&painter, *transform.frame(), (line, against), &text, colour, &mut taken);
    }
}

/// Writes a line's name where it covers neither line nor another name: above or below the line, as far from the other one as there is room.
fn name_line(
    painter: &egui::Painter,
    frame: Rect,
    (line, against): (&[Pos2], &[Pos2]),
    text: &str,
    colour: Color32,
    taken: &mut Vec<Rect>,
) {
    let galley = painter.layout_no_wrap(text.to_owned(), fonts::semibold(size::NOTE), colour);
    let size = galley.size();
    let free = |place: &Rect| {
        let clear = place.expand(3.0);
        let crossed = |line: &[Pos2]| {
            line.windows(2)
                .any(|ends| (0..=8).any(|k| clear.contains(ends[0] + (ends[1] - ends[0]) * (k as f32 / 8.0))))
        };
        frame.contains_rect(*place)
            && !crossed(line)
            && !crossed(against)
            && taken.iter().all(|other| !other.intersects(clear))
    };
    let near = line.iter().flat_map(|p| {
        [-1.0, 1.0].into_iter().flat_map(move |side| {
            [12.0, 20.0, 30.0].map(|off| Rect::from_center_size(pos2(p.x, p.y + side * (off + 0.5 * size.y)), size))
        })
    });
    let middle = frame.center().x;
    let best = near.filter(free).min_by(|a, b| (a.center().x - middle).abs().total_cmp(&(b.center().x - middle).abs()));
    if let Some(place) = best {
        painter.galley(place.min, galley, colour);
        taken.push(place);
    }
}
