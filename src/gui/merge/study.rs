//! What a mask of one metric is worth: the points that stay and how much they scatter, over the thresholds.

use super::act::Command;
use super::facts::{Merging, StudyState, bound};
use super::figures;
use super::masks::{meaning, side};
use super::plot::plot_ui;
use super::state::{MergeView, Pane};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::plan::merge::Metric;
use crate::stitch::mask_study::{Curve, Knee};
use egui::{Align2, Button, Rect, RichText, Role, Ui, WidgetInfo, pos2, vec2};

const TITLE: f32 = 38.0;
/// Height of a line of what is told below the plot, and how many there may be.
const LINE: f32 = 15.0;
const MOST_LINES: usize = 5;

/// The tabs of study and result where they share a place, or the title; returns where it ends.
pub fn title_ui(ui: &mut Ui, at: Rect, shared: bool, own: Pane, view: &mut MergeView, scope: &Scope) -> f32 {
    let words = scope.words;
    let bar = at.with_max_y(at.top() + TITLE);
    if !shared {
        let line = bar.with_min_x(bar.left() + 14.0);
        let text = words.text(own.key());
        write::line(ui, line, Align2::LEFT_CENTER, text, fonts::semibold(size::BAR), scope.theme.text);
        return line.left() + write::width(ui, text, fonts::semibold(size::BAR)) + 14.0;
    }
    let mut x = bar.left() + 10.0;
    for pane in [Pane::Study, Pane::Result] {
        let text = words.text(pane.key());
        let wide = write::width(ui, text, fonts::semibold(size::TABLE)) + 24.0;
        let place = Rect::from_min_size(pos2(x, bar.top() + 6.0), vec2(wide, 26.0));
        let words = RichText::new(text).font(fonts::semibold(size::TABLE));
        let response = ui.put(place, Button::selectable(view.lower == pane, words));
        response.widget_info(|| WidgetInfo::selected(Role::Tab, true, view.lower == pane, text));
        if response.clicked() {
            view.lower = pane;
        }
        x += wide + 6.0;
    }
    x + 8.0
}

/// Draws the card.
pub fn study_ui(ui: &mut Ui, at: Rect, shared: bool, merging: &Merging, view: &mut MergeView, scope: &mut Scope) {
    cards::card(ui, at, scope.theme);
    let from = title_ui(ui, at, shared, Pane::Study, view, scope);
    let Some(preview) = merging.preview() else { return };
    let metrics = preview.metrics();
    let first = metrics.iter().find(|metric| merging.mask(**metric).is_some()).or(metrics.first());
    let Some(metric) = view.metric.filter(|metric| metrics.contains(metric)).or(first.copied()) else { return };
    let chips = Rect::from_min_max(pos2(from, at.top() + 6.0), pos2(at.right() - 12.0, at.top() + TITLE - 6.0));
    metric_chips(ui, chips, &metrics, metric, view, scope);
    let curve = match &merging.study {
        StudyState::Done(study, _) => study.curves.iter().find(|curve| curve.metric == metric),
        _ => None,
    };
    let text = told(metric, curve, merging, scope.words);
    let take = take(metric, merging, scope.words);
    let button = take.as_ref().map_or(0.0, |(_, text)| write::width(ui, text, fonts::semibold(size::TABLE)) + 34.0);
    // What is told is told whole.
    let wide = at.width() - 26.0 - button;
    let fits = |rows: &usize| write::fits(ui, &text, fonts::regular(size::NOTE), wide, *rows);
    let rows = (2..MOST_LINES).find(fits).unwrap_or(MOST_LINES);
    let high = LINE * rows as f32;
    let foot = Rect::from_min_max(pos2(at.left() + 14.0, at.bottom() - high - 4.0), at.max - vec2(12.0, 4.0));
    let plot = Rect::from_min_max(pos2(at.left() + 8.0, at.top() + TITLE), pos2(at.right() - 10.0, foot.top() - 2.0));
    if plot.height() > 70.0 {
        plot_ui(ui, plot, metric, curve, merging, scope);
    }
    if let Some((suggested, text)) = take {
        let place = Rect::from_min_max(
            pos2(foot.right() - button + 10.0, foot.center().y - 13.0),
            pos2(foot.right(), foot.center().y + 13.0),
        );
        let button = ui.put(place, Button::new(RichText::new(&text).font(fonts::semibold(size::TABLE))));
        if button.clicked() {
            scope.ask(Action::Merge(Command::Mask(metric, Some(suggested))));
        }
    }
    let place = foot.with_max_x(foot.left() + wide);
    write::block(ui, place, Align2::LEFT_CENTER, &text, fonts::regular(size::NOTE), scope.theme.text, rows);
}

/// The threshold that is suggested and not set, and the words of the press that takes it.
fn take(metric: Metric, merging: &Merging, words: &Words) -> Option<(f64, String)> {
    let suggested = merging.suggested(metric)?;
    let is_set = merging.mask(metric).and_then(bound) == Some(suggested);
    (!is_set).then(|| (suggested, words.fill("merge.take", &[("value", &figures::threshold(suggested, words))])))
}

/// Which metric; the ones that have no room stand in a menu.
fn metric_chips(ui: &mut Ui, at: Rect, metrics: &[Metric], chosen: Metric, view: &mut MergeView, scope: &Scope) {
    let words = scope.words;
    let wide = |ui: &Ui, metric: &Metric| write::width(ui, metric.key(), fonts::semibold(size::NOTE)) + 20.0;
    let all: f32 = metrics.iter().map(|metric| wide(ui, metric) + 4.0).sum();
    if all > at.width() {
        let builder = egui::UiBuilder::new().max_rect(at).layout(egui::Layout::right_to_left(egui::Align::Center));
        ui.scope_builder(builder, |ui| {
            let shown = RichText::new(chosen.key()).size(size::TABLE);
            let mut now = chosen;
            let combo = egui::ComboBox::from_id_salt("study of").selected_text(shown).width(110.0).height(360.0);
            let combo = combo.show_ui(ui, |ui| {
                for metric in metrics {
                    ui.selectable_value(&mut now, *metric, metric.key());
                }
            });
            let name = words.fill("merge.study_of", &[("metric", chosen.key())]);
            combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, &name));
            if now != chosen {
                view.metric = Some(now);
            }
        });
        return;
    }
    let mut x = at.right() - all;
    for metric in metrics {
        let place = Rect::from_min_size(pos2(x, at.top()), vec2(wide(ui, metric), at.height()));
        let text = RichText::new(metric.key()).font(fonts::semibold(size::NOTE));
        let response = ui.put(place, Button::selectable(*metric == chosen, text).frame_when_inactive(true));
        let name = words.fill("merge.study_of", &[("metric", metric.key())]);
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, *metric == chosen, &name));
        if response.on_hover_text(meaning(*metric, words)).clicked() {
            view.metric = Some(*metric);
        }
        x = place.right() + 4.0;
    }
}

/// What the study says of a metric: what is suggested, or why nothing is.
fn told(metric: Metric, curve: Option<&Curve>, merging: &Merging, words: &Words) -> String {
    let unit = merging.plan.as_ref().map_or(crate::geometry::LengthUnit::Mm, |plan| plan.unit);
    let length =
        |value: Option<f64>| value.map_or_else(|| figures::NONE.to_owned(), |v| figures::with_unit(v, unit, words));
    let curve = match (&merging.study, curve) {
        (StudyState::None, _) => return words.text("merge.study_needs_feature").to_owned(),
        (StudyState::Running(done, of), _) if *of > 0 => {
            let (n, of) = (words.thousands(*done), words.thousands(*of));
            return words.fill("merge.studying", &[("n", &n), ("of", &of)]);
        }
        (StudyState::Running(..), _) => return words.text("merge.study_begins").to_owned(),
        (StudyState::Failed(fault), _) => return words.with_help(&sentence(fault, words), fault.help.as_deref()),
        (StudyState::Done(..), None) => return words.text("merge.no_curve").to_owned(),
        (StudyState::Done(..), Some(curve)) => curve,
    };
    let whole = curve.steps.first().map_or(1, |step| step.remaining.max(1)) as f64;
    let all = length(curve.steps.first().and_then(|step| step.sigma_dev));
    let mut text = match &curve.knee {
        Knee::At { step, plateau } => {
            let cut = &curve.steps[*step];
            let share = figures::percent(cut.remaining as f64 / whole, words);
            let (value, sigma) = (figures::threshold(cut.threshold, words), length(cut.sigma_dev));
            let best = length(Some(*plateau));
            let side = side(metric, words);
            let values = [
                ("side", side),
                ("value", &value),
                ("share", &share),
                ("sigma", &sigma),
                ("all", &all),
                ("best", &best),
            ];
            words.fill("merge.knee", &values)
        }
        Knee::NoGain { plateau } => words.fill("merge.no_gain", &[("all", &all), ("best", &length(Some(*plateau)))]),
        Knee::TooDear { share, plateau } => {
            let share = figures::percent(*share, words);
            words.fill("merge.too_dear", &[("share", &share), ("all", &all), ("best", &length(Some(*plateau)))])
        }
        Knee::Misfit { sigma_dev, noise } => {
            let values = [("sigma", length(Some(*sigma_dev))), ("noise", length(Some(*noise)))];
            words.fill("merge.misfit", &values.each_ref().map(|(name, value)| (*name, value.as_str())))
        }
        Knee::NotTold => words.text("merge.no_fit").to_owned(),
    };
    if let StudyState::Done(_, every) = &merging.study
        && *every > 1
    {
        text.push_str(&format!(" {}", words.fill("merge.study_of_some", &[("n", &every.to_string())])));
    }
    text
}
