//! The bar over a cloud: what it is, by what its points are coloured, the camera's buttons as far as there is room.

use super::colours::By;
use super::facts::Merging;
use super::figures;
use super::scene::by_of;
use super::state::{Cloud, MergeView};
use crate::gui::fonts;
use crate::gui::scene::standard::standard_ui;
use crate::gui::scope::Scope;
use crate::gui::text::{Words, typed_number};
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use egui::{Align, Align2, Button, ComboBox, DragValue, Layout, Rect, RichText, Role, Ui, WidgetInfo, pos2, vec2};

/// The title, by what the points are coloured, and the camera's buttons as far as there is room.
pub fn bar_ui(
    ui: &mut Ui,
    bar: Rect,
    (cloud, alone): (Cloud, bool),
    merging: &Merging,
    view: &mut MergeView,
    scope: &mut Scope,
) {
    let words = scope.words;
    let builder =
        egui::UiBuilder::new().max_rect(bar.shrink2(vec2(10.0, 6.0))).layout(Layout::right_to_left(Align::Center));
    let left = ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().button_padding.x = 8.0;
        ui.spacing_mut().interact_size.y = 26.0;
        if bar.width() > 760.0 {
            standard_ui(ui, &mut view.linked, words);
        }
        if bar.width() > 430.0 {
            let fit = words.text("results.fit_view");
            let button = ui.add(Button::new(RichText::new(fit).size(size::TABLE)));
            if button.clicked() {
                view.fit = true;
            }
        }
        range_ui(ui, cloud, bar.width(), view, merging, words);
        by_ui(ui, cloud, merging, view, words);
        ui.min_rect().left()
    });
    let left = bar.with_max_x(left.inner - 8.0).with_min_x(bar.left() + 14.0);
    if alone {
        switch_ui(ui, left, merging, view, scope);
    } else {
        title_ui(ui, left, cloud, merging, scope);
    }
}

fn title_ui(ui: &mut Ui, at: Rect, cloud: Cloud, merging: &Merging, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let key = if cloud == Cloud::Measured { "merge.measured" } else { "merge.merged" };
    let title = words.text(key);
    let font = fonts::semibold(size::BODY);
    let wide = write::width(ui, title, font.clone()) + 10.0;
    write::line(ui, at, Align2::LEFT_CENTER, title, font, theme.text);
    let note = match cloud {
        Cloud::Measured => merging.preview().map(|preview| words.count("merge.count_points", preview.points())),
        Cloud::Merged => {
            merging.done.as_ref().map(|done| words.count("merge.count_points", done.job.result.merged.positions.len()))
        }
    };
    let rest = at.with_min_x(at.left() + wide);
    write::line(ui, rest, Align2::LEFT_CENTER, &note.unwrap_or_default(), fonts::regular(size::NOTE), theme.quiet);
}

/// Measured or merged, where one of them has room.
fn switch_ui(ui: &mut Ui, at: Rect, merging: &Merging, view: &mut MergeView, scope: &Scope) {
    let words = scope.words;
    let mut x = at.left() - 4.0;
    for (cloud, key) in [(Cloud::Measured, "merge.measured"), (Cloud::Merged, "merge.merged")] {
        let text = words.text(key);
        let most = (0.5 * at.width()).max(40.0);
        let points = write::fitting_size(ui, text, fonts::semibold, most - 6.0, size::TABLE, 9.0);
        let wide = (write::width(ui, text, fonts::semibold(points)) + 18.0).min(most);
        let place = Rect::from_min_size(pos2(x, at.center().y - 13.0), vec2(wide, 26.0));
        let can = cloud == Cloud::Measured || merging.done.is_some();
        let chosen = view.cloud == cloud;
        let text = RichText::new(text).font(fonts::semibold(points));
        let button = ui.scope(|ui| {
            ui.spacing_mut().button_padding.x = 2.0;
            let builder = egui::UiBuilder::new().max_rect(place);
            ui.scope_builder(builder, |ui| {
                if !can {
                    ui.disable();
                }
                ui.put(place, Button::selectable(chosen, text).truncate())
            })
        });
        if button.inner.inner.clicked() {
            view.cloud = cloud;
        }
        x = place.right() + 4.0;
    }
}

/// By what points can be coloured.
fn choices(cloud: Cloud, merging: &Merging) -> Vec<By> {
    let mut all = vec![By::View];
    let features = merging.plan.as_ref().map_or(0, |plan| plan.features.len());
    let metrics = match cloud {
        Cloud::Measured => merging.preview().map(|preview| preview.metrics()).unwrap_or_default(),
        Cloud::Merged => {
            let merged = merging.done.as_ref().map(|done| &done.job.result.merged);
            merged.map(|merged| merged.columns.keys().copied().collect()).unwrap_or_default()
        }
    };
    all.extend(metrics.into_iter().map(By::Metric));
    all.extend((0..features).map(By::Deviation));
    if cloud == Cloud::Merged && merging.done.as_ref().is_some_and(|done| done.job.extras.wear.is_some()) {
        all.push(By::Wear);
    }
    all
}

fn by_words(by: By, merging: &Merging, words: &Words) -> String {
    match by {
        By::View => words.text("merge.by_view").to_owned(),
        By::Metric(metric) => metric.key().to_owned(),
        By::Deviation(feature) => {
            let name = merging.plan.as_ref().and_then(|plan| plan.features.get(feature)).map(|f| f.name.as_str());
            words.fill("merge.by_deviation", &[("feature", name.unwrap_or_default())])
        }
        By::Wear => words.text("merge.wear").to_owned(),
    }
}

fn by_ui(ui: &mut Ui, cloud: Cloud, merging: &Merging, view: &mut MergeView, words: &Words) {
    let choices = choices(cloud, merging);
    let by = match cloud {
        Cloud::Measured => &mut view.measured_by,
        Cloud::Merged => &mut view.merged_by,
    };
    if !choices.contains(by) {
        *by = By::View;
    }
    let shown = by_words(*by, merging, words);
    let combo = ComboBox::from_id_salt("by")
        .selected_text(RichText::new(&shown).size(size::TABLE))
        .width(118.0)
        .height(440.0)
        .truncate();
    let combo = combo.show_ui(ui, |ui| {
        for choice in choices {
            ui.selectable_value(by, choice, by_words(choice, merging, words));
        }
    });
    let name = words.fill("merge.coloured_by", &[("by", &shown)]);
    combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, &name));
}

/// Half the range of a scale of deviations.
fn range_ui(ui: &mut Ui, cloud: Cloud, room: f32, view: &mut MergeView, merging: &Merging, words: &Words) {
    let k = usize::from(cloud == Cloud::Merged);
    let diverging = matches!(by_of(cloud, view), By::Deviation(_) | By::Wear);
    let Some([_, half]) = view.colours[k].as_ref().and_then(|(_, colours)| colours.range).filter(|_| diverging) else {
        return;
    };
    if room < 480.0 {
        return;
    }
    let mut value = half;
    let unit = merging.plan.as_ref().map_or("", |plan| figures::unit(plan.unit));
    let language = words.language();
    let drag = DragValue::new(&mut value)
        .speed(0.01 * half)
        .range(f64::MIN_POSITIVE..=f64::MAX)
        .prefix("± ")
        .suffix(format!(" {unit}"))
        .custom_formatter(move |value, _| figures::threshold(figures::rounded(value), Words::of(language)))
        .custom_parser(typed_number)
        .update_while_editing(false);
    let response = ui.add(drag);
    response.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, words.text("merge.range")));
    if response.changed() && value > 0.0 {
        view.range = Some(figures::rounded(value));
    }
}
