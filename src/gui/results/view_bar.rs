//! The bars over the views: a title on the left, controls from the right. What has no room folds into a menu at the end.

use super::ResultsView;
use super::controls::{
    button_width, fit_ui, labels_ui, labels_words, layer_ui, layer_words, measure_button_ui, menu_button, menu_width,
    picture_rows_ui, picture_ui, scale_controls_ui,
};
use super::views::Content;
use crate::gui::fonts;
use crate::gui::scene::standard::standard_ui;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use egui::{Align, Align2, Layout, Popup, PopupCloseBehavior, Rect, Ui, vec2};

/// Height of a view's bar.
pub const BAR: f32 = 40.0;
/// Room at both ends.
const EDGE: f32 = 10.0;

/// What folds into the menu.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fold {
    /// Nothing.
    Nothing,
    /// The standard views.
    Views,
    /// Fitting, measuring and pictures, too.
    Tools,
    /// All but what is shown.
    Labels,
}

impl Fold {
    const ALL: [Fold; 4] = [Fold::Nothing, Fold::Views, Fold::Tools, Fold::Labels];
}

/// What the standard views take: seven buttons and their gaps.
fn standard_width(ui: &Ui) -> f32 {
    6.0 * 30.0 + button_width(ui, "Iso")
}

fn title_width(ui: &Ui, text: &str) -> f32 {
    write::width(ui, text, fonts::semibold(size::BODY)) + 14.0
}

fn fit_width(ui: &Ui, words: &Words) -> f32 {
    button_width(ui, &format!("{} F", words.text("results.fit_view")))
}

/// The bar over the CAD with its points.
pub fn cad_bar_ui(ui: &mut Ui, bar: Rect, view: &mut ResultsView, scope: &Scope) {
    let words = scope.words;
    let title = words.text("results.cad_and_points");
    let all = title_width(ui, title) + standard_width(ui) + fit_width(ui, words) + 2.0 * EDGE;
    let folded = all > bar.width();
    let from = bar_ui(ui, bar, |ui| {
        if folded {
            let button = menu_button(ui, words.text("bar.more"));
            Popup::menu(&button).show(|ui| ui.horizontal(|ui| standard_ui(ui, &mut view.linked, words)));
        } else {
            standard_ui(ui, &mut view.linked, words);
        }
        fit_ui(ui, view, words);
    });
    title_ui(ui, bar.with_max_x(from - 8.0), title, scope);
}

/// The bar over the map. `alone`: there is no other view; `scale`: range, bands and palette have no line of their own.
pub fn map_bar_ui(
    ui: &mut Ui,
    bar: Rect,
    content: &Content<'_>,
    picture: Rect,
    [alone, scale]: [bool; 2],
    view: &mut ResultsView,
    scope: &mut Scope,
) {
    let words = scope.words;
    let title = if alone { "" } else { words.text("results.map") };
    let least = if alone { 0.0 } else { title_width(ui, title) };
    let width = |fold: &Fold| least + controls_width(ui, *fold, alone, view, words) + 2.0 * EDGE;
    let fold = Fold::ALL.into_iter().find(|fold| width(fold) <= bar.width()).unwrap_or(Fold::Labels);
    let fold = if scale { fold.max(Fold::Views) } else { fold };
    let from = bar_ui(ui, bar, |ui| {
        if fold > Fold::Nothing {
            let button = menu_button(ui, words.text("bar.more"));
            let close = PopupCloseBehavior::CloseOnClickOutside;
            Popup::menu(&button)
                .close_behavior(close)
                .show(|ui| more_ui(ui, fold, picture, [alone, scale], view, scope));
        } else if alone {
            standard_ui(ui, &mut view.linked, words);
        }
        if fold < Fold::Tools {
            fit_ui(ui, view, words);
            picture_ui(ui, picture, view, words);
            measure_button_ui(ui, view, words);
        }
        if fold < Fold::Labels {
            labels_ui(ui, view, words);
        }
        layer_ui(ui, alone, content, view, words);
    });
    title_ui(ui, bar.with_max_x(from - 8.0), title, scope);
}

fn controls_width(ui: &Ui, fold: Fold, alone: bool, view: &ResultsView, words: &Words) -> f32 {
    let tools = fit_width(ui, words)
        + menu_width(ui, words.text("results.picture"))
        + button_width(ui, &format!("{} M", words.text("results.measure")));
    let labels = menu_width(ui, labels_words(view.labels, words));
    let layer = menu_width(ui, layer_words(view.layer(alone), words));
    let end = match fold {
        Fold::Nothing if alone => standard_width(ui),
        Fold::Nothing => 0.0,
        _ => menu_width(ui, words.text("bar.more")),
    };
    end + layer + if fold < Fold::Tools { tools } else { 0.0 } + if fold < Fold::Labels { labels } else { 0.0 }
}

/// What was folded away.
fn more_ui(
    ui: &mut Ui,
    fold: Fold,
    picture: Rect,
    [alone, scale]: [bool; 2],
    view: &mut ResultsView,
    scope: &mut Scope,
) {
    let words = scope.words;
    if alone {
        ui.horizontal(|ui| standard_ui(ui, &mut view.linked, words));
    }
    if fold >= Fold::Tools {
        ui.horizontal(|ui| {
            fit_ui(ui, view, words);
            measure_button_ui(ui, view, words);
        });
        picture_rows_ui(ui, picture, view, words);
    }
    if fold >= Fold::Labels {
        labels_ui(ui, view, words);
    }
    if scale {
        ui.separator();
        ui.horizontal(|ui| scale_controls_ui(ui, view, scope));
    }
}

fn title_ui(ui: &mut Ui, bar: Rect, text: &str, scope: &Scope) {
    let line = bar.with_min_x(bar.left() + 14.0);
    write::line(ui, line, Align2::LEFT_CENTER, text, fonts::semibold(size::BODY), scope.theme.text);
}

/// Controls at the right end of a bar, added from right to left; returns where they begin.
fn bar_ui(ui: &mut Ui, bar: Rect, add: impl FnOnce(&mut Ui)) -> f32 {
    let builder =
        egui::UiBuilder::new().max_rect(bar.shrink2(vec2(EDGE, 6.0))).layout(Layout::right_to_left(Align::Center));
    let shown = ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().button_padding.x = 8.0;
        ui.spacing_mut().interact_size.y = 26.0;
        add(ui);
        ui.min_rect().left()
    });
    shown.inner
}
