//! The sliders: a threshold for each metric, what it keeps, and what all of them together leave.

use super::act::Command;
use super::facts::{Merging, bound};
use super::figures;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::plan::merge::{Better, Metric};
use crate::worker::merge::Preview;
use egui::{
    Align2, Checkbox, Color32, DragValue, Rect, Role, ScrollArea, Sense, Slider, Stroke, Ui, WidgetInfo, pos2, vec2,
};

const TITLE: f32 = 38.0;
/// Height of one metric, and of the sums below all.
const ROW: f32 = 58.0;
/// Width of a threshold's field.
const FIELD: f32 = 104.0;
const FOOT: f32 = 84.0;
const FOOT_LOW: f32 = 46.0;

/// Which side a metric's threshold keeps, in words.
pub fn side(metric: Metric, words: &Words) -> &str {
    match metric.better() {
        Better::Larger => words.text("merge.at_least"),
        Better::Smaller => words.text("merge.at_most"),
    }
}

/// What a metric is, in words.
pub fn meaning(metric: Metric, words: &Words) -> &str {
    words.text(match metric {
        Metric::Strength => "merge.metric_b",
        Metric::Attenuation => "merge.metric_attenuation",
        Metric::PhaseShiftVariation => "merge.metric_sigma_i",
        Metric::CalibrationDistance => "merge.metric_d_cal",
        Metric::CalibrationDistanceProjector => "merge.metric_d_cal_projector",
        Metric::Reprojection => "merge.metric_reprojection",
        Metric::Density => "merge.metric_density",
        Metric::NonUniformity => "merge.metric_delta_n",
        Metric::NonUniformityAngle => "merge.metric_delta_n_angle",
    })
}

/// Draws the card.
pub fn masks_ui(ui: &mut Ui, at: Rect, merging: &Merging, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let title = at.with_max_y(at.top() + TITLE).shrink2(vec2(14.0, 0.0));
    write::line(ui, title, Align2::LEFT_CENTER, words.text("merge.masks"), fonts::semibold(size::BAR), theme.text);
    let note = words.text("merge.outside_dropped");
    write::line(ui, title, Align2::RIGHT_CENTER, note, fonts::regular(size::NOTE), theme.quiet);
    let Some(preview) = merging.preview() else { return };
    let foot_height = if at.height() < 260.0 { FOOT_LOW } else { FOOT };
    let foot = Rect::from_min_max(pos2(at.left() + 14.0, at.bottom() - foot_height), at.max - vec2(14.0, 6.0));
    let body = Rect::from_min_max(pos2(at.left() + 14.0, title.bottom()), pos2(at.right() - 8.0, foot.top() - 2.0));
    let metrics = preview.metrics();
    if metrics.is_empty() {
        let text = words.text("merge.no_metrics");
        write::block(ui, body, Align2::LEFT_TOP, text, fonts::regular(size::BODY), theme.quiet, 4);
    }
    ui.scope_builder(egui::UiBuilder::new().max_rect(body), |ui| {
        ScrollArea::vertical().id_salt("masks").auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            for metric in ordered(metrics, merging) {
                let (at, _) = ui.allocate_exact_size(vec2(ui.available_width() - 10.0, ROW), Sense::hover());
                ui.push_id(metric.key(), |ui| metric_ui(ui, at, metric, merging, preview, scope));
            }
        });
    });
    ui.painter().hline(at.x_range(), foot.top() - 1.0, Stroke::new(1.0, theme.stroke));
    foot_ui(ui, foot, merging, preview, scope);
}

/// Those that the file masks by first; what is set in the window moves none.
fn ordered(mut metrics: Vec<Metric>, merging: &Merging) -> Vec<Metric> {
    let masks = merging.masks_of_file();
    metrics.sort_by_key(|metric| masks.iter().all(|mask| mask.metric != *metric));
    metrics
}

/// The share of all points that a threshold keeps, read off the curve.
pub fn share_at(curve: &[[f64; 2]], metric: Metric, threshold: f64) -> f64 {
    let score = |value: f64| metric.score(value);
    let Some(first) = curve.first() else { return f64::NAN };
    if score(threshold) <= score(first[0]) {
        return 1.0;
    }
    let after = curve.iter().position(|[value, _]| score(*value) >= score(threshold));
    let Some(after) = after else { return 0.0 };
    let ([a, from], [b, to]) = (curve[after - 1], curve[after]);
    from + (to - from) * (threshold - a) / (b - a)
}

fn metric_ui(ui: &mut Ui, at: Rect, metric: Metric, merging: &Merging, preview: &Preview, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let key = metric.key();
    let curve = preview.keeps.get(&metric).map_or(&[][..], Vec::as_slice);
    let Some(([first, _], [last, _])) = curve.first().copied().zip(curve.last().copied()) else { return };
    let mask = merging.mask(metric);
    let set = mask.and_then(bound);
    let value = set.unwrap_or_else(|| figures::rounded(first));
    let upper = at.with_max_y(at.top() + 28.0);
    let field = Rect::from_min_max(pos2(upper.right() - FIELD, upper.top() + 2.0), pos2(upper.right(), upper.bottom()));
    let name_width = 30.0 + write::width(ui, key, fonts::semibold(size::BODY));
    let check = upper.with_max_x((upper.left() + name_width).min(field.left() - 60.0));
    let mut on = mask.is_some();
    let label = egui::RichText::new(key).font(fonts::semibold(size::BODY));
    let checkbox = ui.put(check, Checkbox::new(&mut on, label));
    let name = words.fill("merge.mask_of", &[("metric", key)]);
    checkbox.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, mask.is_some(), &name));
    if checkbox.on_hover_text(meaning(metric, words)).changed() {
        let bound = if on { Some(merging.suggested(metric).unwrap_or(figures::rounded(first))) } else { None };
        scope.ask(Action::Merge(Command::Mask(metric, bound)));
    }
    let note = match mask {
        Some(_) => stays(metric, merging, preview, words),
        None => words.text("merge.mask_off").to_owned(),
    };
    let between = Rect::from_min_max(pos2(check.right() + 6.0, upper.top()), pos2(field.left() - 8.0, upper.bottom()));
    write::line(ui, between, Align2::LEFT_CENTER, &note, fonts::regular(size::TABLE), theme.quiet);
    let mut typed = value;
    let drag = field_ui(ui, field, (metric, mask.is_some()), &mut typed, [first, last], merging, scope);
    let lower = Rect::from_min_max(pos2(at.left() + 2.0, upper.bottom()), pos2(at.right(), at.bottom() - 6.0));
    let slider = slider_ui(ui, lower, (metric, mask.is_some()), [first, last], value, scope);
    let slid = slider.1;
    let slider = slider.0;
    let moved = if slider.changed() && slid != value {
        Some(figures::on_rail(slid, last - first))
    } else if drag.changed() && typed != value {
        Some(if drag.dragged() { figures::on_rail(typed, last - first) } else { typed })
    } else {
        None
    };
    if let Some(bound) = moved {
        scope.ask(Action::Merge(Command::Mask(metric, Some(bound))));
    }
    ui.painter().hline(at.x_range(), at.bottom() - 2.0, Stroke::new(1.0, theme.raised));
}

/// The threshold as a number with the side that it keeps and its unit; pale while no mask is set.
fn field_ui(
    ui: &mut Ui,
    at: Rect,
    (metric, on): (Metric, bool),
    typed: &mut f64,
    [first, last]: [f64; 2],
    merging: &Merging,
    scope: &Scope,
) -> egui::Response {
    let (theme, words) = (scope.theme, scope.words);
    let unit = merging.plan.as_ref().map_or("", |plan| figures::metric_unit(metric, plan.unit));
    let written = words.language();
    let drag = DragValue::new(typed)
        .speed(((last - first).abs() / 300.0).max(f64::MIN_POSITIVE))
        .prefix(match metric.better() {
            Better::Larger => "≥ ",
            Better::Smaller => "≤ ",
        })
        .suffix(if unit.is_empty() { String::new() } else { format!(" {unit}") })
        .custom_formatter(move |value, _| figures::threshold(value, Words::of(written)))
        .custom_parser(crate::gui::text::typed_number);
    let drag = ui.scope(|ui| {
        if !on {
            ui.visuals_mut().override_text_color = Some(theme.quiet);
        }
        ui.put(at, drag.update_while_editing(false))
    });
    let name = named(words.fill("merge.threshold_of", &[("metric", metric.key())]), on, words);
    drag.inner.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, &name));
    drag.inner
}

/// The name of a control, which says where its mask is not set.
fn named(name: String, on: bool, words: &Words) -> String {
    if on { name } else { format!("{name}, {}", words.text("merge.mask_off")) }
}

/// The slider, its kept side filled; what it is moved to. While no mask is set, its rail and a small mark are all that is seen.
fn slider_ui(
    ui: &mut Ui,
    at: Rect,
    (metric, on): (Metric, bool),
    [first, last]: [f64; 2],
    value: f64,
    scope: &Scope,
) -> (egui::Response, f64) {
    let (theme, words) = (scope.theme, scope.words);
    let (low, high) = (first.min(last).min(value), first.max(last).max(value));
    let mut slid = value;
    let builder = egui::UiBuilder::new().max_rect(at);
    let slider = ui.scope_builder(builder, |ui| {
        ui.spacing_mut().slider_width = at.width() - 4.0;
        if !on {
            // Its own rail and handle are drawn below.
            let widgets = &mut ui.visuals_mut().widgets;
            for look in [&mut widgets.inactive, &mut widgets.hovered, &mut widgets.active] {
                (look.bg_fill, look.fg_stroke) = (Color32::TRANSPARENT, Stroke::NONE);
            }
        }
        let slider = Slider::new(&mut slid, low..=high).show_value(false).trailing_fill(false);
        ui.add(slider.handle_shape(egui::style::HandleShape::Circle))
    });
    let slider = slider.inner;
    let name = named(format!("{} {}", metric.key(), side(metric, words)), on, words);
    slider.widget_info(|| WidgetInfo::slider(true, value, &name));
    // As egui places its handle.
    let radius = slider.rect.height() / 2.5;
    let (left, right) = (slider.rect.left() + radius, slider.rect.right() - radius);
    let share = if high > low { ((slid - low) / (high - low)) as f32 } else { 0.0 };
    let (x, y) = (left + share * (right - left), slider.rect.center().y);
    let kept = match metric.better() {
        Better::Larger => x..=slider.rect.right(),
        Better::Smaller => slider.rect.left()..=x,
    };
    let touched = slider.hovered() || slider.has_focus() || slider.dragged();
    if on {
        ui.painter().hline(kept, y, Stroke::new(5.0, theme.accent));
        ui.painter().circle(pos2(x, y), radius, theme.panel, Stroke::new(2.0, theme.accent));
    } else {
        ui.painter().hline(left..=right, y, Stroke::new(2.0, theme.stroke));
        let frame = Stroke::new(1.5, if touched { theme.accent } else { theme.strong_stroke });
        ui.painter().circle(pos2(x, y), 0.5 * radius, theme.panel, frame);
    }
    (slider, slid)
}

/// How many points a mask keeps by itself.
fn stays(metric: Metric, merging: &Merging, preview: &Preview, words: &Words) -> String {
    let at = merging.masks.iter().position(|mask| mask.metric == metric);
    let share = match (at, &merging.worth) {
        (None, _) => 1.0,
        (Some(at), Some((version, worth))) if *version == merging.version => {
            worth.kept_by.get(at).map_or(f64::NAN, |kept| *kept as f64 / preview.looked_at().max(1) as f64)
        }
        // Until it is counted, as the curve has it.
        (Some(at), _) => {
            let curve = preview.keeps.get(&metric).map_or(&[][..], Vec::as_slice);
            bound(&merging.masks[at]).map_or(1.0, |bound| share_at(curve, metric, bound))
        }
    };
    words.fill("merge.stay", &[("share", &figures::percent(share, words))])
}

/// What all masks together leave, and how much that scatters.
fn foot_ui(ui: &mut Ui, at: Rect, merging: &Merging, preview: &Preview, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let Some(worth) = merging.latest_worth() else {
        let text = words.text("merge.counting");
        write::line(ui, at, Align2::LEFT_CENTER, text, fonts::regular(size::BODY), theme.quiet);
        return;
    };
    let looked_at = preview.looked_at().max(1);
    let kept: usize = worth.kept.iter().sum();
    let all = preview.points();
    let share = kept as f64 / looked_at as f64;
    let whole = looked_at == all;
    let kept = if whole { kept } else { (share * all as f64).round() as usize };
    let number = words.thousands(kept);
    let rest =
        words.fill(if whole { "merge.of_points" } else { "merge.of_points_about" }, &[("n", &words.thousands(all))]);
    let rows = if at.height() > 60.0 { 3.0 } else { 2.0 };
    let high = at.height() / rows;
    let line = |k: f32| Rect::from_min_size(pos2(at.left(), at.top() + k * high), vec2(at.width(), high));
    figure_ui(ui, line(0.0), &number, &format!("{rest}   {}", figures::percent(share, words)), scope);
    let plan = merging.plan.as_ref();
    let sigma = worth.features.first().and_then(|f| f.sigma_dev).zip(plan);
    match sigma {
        Some((sigma, plan)) => {
            let was = merging.unmasked.as_ref().and_then(|w| w.features.first()?.sigma_dev);
            let was = was.map_or_else(|| figures::NONE.to_owned(), |was| figures::with_unit(was, plan.unit, words));
            let of = plan.features.first().map_or("", |feature| feature.name.as_str());
            let text = words.fill("merge.sigma_was", &[("feature", of), ("was", &was)]);
            figure_ui(ui, line(1.0), &figures::with_unit(sigma, plan.unit, words), &text, scope);
        }
        None => {
            let key =
                if plan.is_some_and(|plan| plan.features.is_empty()) { "merge.no_feature" } else { "merge.no_fit" };
            write::line(ui, line(1.0), Align2::LEFT_CENTER, words.text(key), fonts::regular(size::TABLE), theme.quiet);
        }
    }
    if rows > 2.5 {
        let note = sample_note(preview, worth.fitted_every, words);
        write::line(ui, line(2.0), Align2::LEFT_CENTER, &note, fonts::regular(size::NOTE), theme.quiet);
    }
}

/// Which points the figures are of.
fn sample_note(preview: &Preview, fitted_every: usize, words: &Words) -> String {
    let every = preview.every.iter().copied().max().unwrap_or(1);
    let of = |every: usize| {
        if every == 1 {
            words.text("merge.every_point").to_owned()
        } else {
            words.fill("merge.every_nth", &[("n", &every.to_string())])
        }
    };
    if every == 1 && fitted_every == 1 {
        return words.text("merge.of_all").to_owned();
    }
    words.fill("merge.of_some", &[("counted", &of(every)), ("fitted", &of(every * fitted_every))])
}

/// A figure in large letters and what it is.
fn figure_ui(ui: &mut Ui, at: Rect, figure: &str, text: &str, scope: &Scope) {
    let theme = scope.theme;
    let font = egui::FontId::new(size::CARD, fonts::mono(size::CARD).family);
    let wide = write::width(ui, figure, font.clone()) + 8.0;
    write::line(ui, at.with_max_x(at.left() + wide), Align2::LEFT_CENTER, figure, font, theme.text);
    let rest = at.with_min_x(at.left() + wide + 2.0);
    let points = write::fitting_size(ui, text, fonts::regular, rest.width(), size::TABLE, 10.0);
    write::line(ui, rest, Align2::LEFT_CENTER, text, fonts::regular(points), theme.quiet);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_read_between_the_steps_of_its_curve() {
        // Quarters, so that nothing is rounded.
        let rising = [[1.0, 1.0], [2.0, 0.5], [4.0, 0.25]];
        let at = |value| share_at(&rising, Metric::Strength, value);
        assert_eq!([at(0.0), at(1.5), at(3.0), at(4.0), at(5.0)], [1.0, 0.75, 0.375, 0.25, 0.0]);
        let falling = [[8.0, 1.0], [4.0, 0.5]];
        let at = |value| share_at(&falling, Metric::CalibrationDistance, value);
        assert_eq!([at(10.0), at(6.0), at(2.0)], [1.0, 0.75, 0.0]);
        assert!(share_at(&[], Metric::Strength, 1.0).is_nan());
    }
}
