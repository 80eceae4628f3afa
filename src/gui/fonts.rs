//! The fonts of the window: Inter in three weights for words, egui's monospace for numbers and names of points.

use super::theme::{Theme, size};
use egui::{CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, epaint::Shadow, vec2};
use std::sync::Arc;

const SEMIBOLD: &str = "semibold";
const BOLD: &str = "bold";

/// Words.
pub fn regular(points: f32) -> FontId {
    FontId::new(points, FontFamily::Proportional)
}

/// Words that lead.
pub fn semibold(points: f32) -> FontId {
    FontId::new(points, FontFamily::Name(SEMIBOLD.into()))
}

/// The verdict.
pub fn bold(points: f32) -> FontId {
    FontId::new(points, FontFamily::Name(BOLD.into()))
}

/// Numbers, names of points, keys.
pub fn mono(points: f32) -> FontId {
    FontId::new(points, FontFamily::Monospace)
}

/// Gives fonts, sizes and both themes to egui; done once.
pub fn install(ctx: &egui::Context) {
    ctx.set_fonts(definitions());
    ctx.options_mut(|options| {
        // Where the system does not tell: shop floors are bright.
        options.fallback_theme = egui::Theme::Light;
        // The scale is a setting, kept and stepped by `keys`.
        options.zoom_with_keyboard = false;
    });
    ctx.set_visuals_of(egui::Theme::Light, visuals(&Theme::LIGHT));
    ctx.set_visuals_of(egui::Theme::Dark, visuals(&Theme::DARK));
    ctx.all_styles_mut(|style| {
        style.text_styles = [
            (TextStyle::Small, regular(size::NOTE)),
            (TextStyle::Body, regular(size::BODY)),
            (TextStyle::Button, regular(size::BODY)),
            (TextStyle::Heading, semibold(size::CARD)),
            (TextStyle::Monospace, mono(size::TABLE)),
        ]
        .into();
        style.spacing.item_spacing = vec2(8.0, 4.0);
        style.spacing.button_padding = vec2(10.0, 4.0);
        style.spacing.interact_size = vec2(40.0, 28.0);
        // Words that somebody drags over are no text fields.
        style.interaction.selectable_labels = false;
    });
}

fn definitions() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let weights: [(&str, &'static [u8]); 3] = [
        ("Inter", include_bytes!("../../assets/fonts/Inter-Regular.ttf")),
        ("Inter SemiBold", include_bytes!("../../assets/fonts/Inter-SemiBold.ttf")),
        ("Inter Bold", include_bytes!("../../assets/fonts/Inter-Bold.ttf")),
    ];
    let fallback = fonts.families.get(&FontFamily::Proportional).cloned().unwrap_or_default();
    let families = [FontFamily::Proportional, FontFamily::Name(SEMIBOLD.into()), FontFamily::Name(BOLD.into())];
    for ((name, bytes), family) in weights.into_iter().zip(families) {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
        let names = std::iter::once(name.to_owned()).chain(fallback.iter().cloned()).collect();
        fonts.families.insert(family, names);
    }
    fonts
}

fn visuals(theme: &Theme) -> egui::Visuals {
    let mut visuals = if theme.dark { egui::Visuals::dark() } else { egui::Visuals::light() };
    visuals.override_text_color = None;
    visuals.weak_text_color = Some(theme.quiet);
    visuals.hyperlink_color = theme.accent;
    visuals.faint_bg_color = theme.window;
    visuals.extreme_bg_color = theme.panel;
    visuals.text_edit_bg_color = Some(theme.window);
    visuals.code_bg_color = theme.raised;
    visuals.warn_fg_color = theme.undecided_text;
    visuals.error_fg_color = theme.fail;
    visuals.window_fill = theme.panel;
    visuals.panel_fill = theme.window;
    visuals.window_stroke = Stroke::new(1.0, theme.stroke);
    visuals.window_corner_radius = CornerRadius::same(6);
    visuals.menu_corner_radius = CornerRadius::same(6);
    visuals.window_shadow = Shadow::NONE;
    visuals.popup_shadow = Shadow::NONE;
    visuals.selection.bg_fill = theme.choice;
    visuals.selection.stroke = Stroke::new(2.0, theme.accent);
    let widgets = &mut visuals.widgets;
    let states = [
        (&mut widgets.noninteractive, theme.panel, theme.stroke, theme.text),
        (&mut widgets.inactive, theme.raised, theme.strong_stroke, theme.text),
        (&mut widgets.hovered, theme.raised, theme.accent, theme.text),
        (&mut widgets.active, theme.choice, theme.accent, theme.text),
        (&mut widgets.open, theme.choice, theme.accent, theme.text),
    ];
    for (state, fill, frame, text) in states {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, frame);
        state.fg_stroke = Stroke::new(1.0, text);
        state.corner_radius = CornerRadius::same(4);
        state.expansion = 0.0;
    }
    visuals.window_highlight_topmost = false;
    visuals
}
