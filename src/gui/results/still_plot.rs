//! A plot that stands still: nobody drags or zooms it by accident, and what it shows is told beside it.

use egui::AsIdSalt;
use egui_plot::Plot;

/// The plot, to be told its extent and its axes.
pub fn still_plot<'a>(id: impl AsIdSalt) -> Plot<'a> {
    Plot::new(id)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show_crosshair(false)
        .show_x(false)
        .show_y(false)
}
