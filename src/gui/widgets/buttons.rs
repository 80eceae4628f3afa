//! Buttons for gloves: at least 48 points high, painted in a place that never moves, named by their words.

use super::words;
use crate::gui::fonts;
use crate::gui::theme::Theme;
use egui::{
    Align2, Color32, CornerRadius, CursorIcon, FontId, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, Vec2,
    WidgetInfo, pos2,
};

/// How a button stands among the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// The one thing to do.
    Main,
    /// Ends what goes on.
    Stop,
    /// A daily one.
    Plain,
    /// A rare one, in a bar.
    Quiet,
}

/// The colours of one button in its state.
struct Look {
    fill: Color32,
    frame: Stroke,
    text: Color32,
}

fn look(theme: &Theme, weight: Weight, response: &Response, enabled: bool) -> Look {
    let hovered = response.hovered() || response.is_pointer_button_down_on();
    let frame = |width, colour| Stroke::new(width, colour);
    let look = match weight {
        Weight::Main if enabled => Look {
            fill: if hovered { theme.accent.lerp_to_gamma(theme.text, 0.12) } else { theme.accent },
            frame: Stroke::NONE,
            text: theme.on_accent,
        },
        Weight::Stop => Look {
            fill: if hovered { theme.raised } else { theme.panel },
            frame: frame(4.0, theme.text),
            text: theme.text,
        },
        Weight::Plain => Look {
            fill: if hovered && enabled { theme.raised } else { theme.panel },
            frame: frame(2.0, theme.strong_stroke),
            text: if enabled { theme.text } else { theme.quiet },
        },
        Weight::Main | Weight::Quiet => Look {
            fill: if hovered && enabled { theme.choice } else { theme.raised },
            frame: frame(1.0, theme.strong_stroke),
            text: if enabled { theme.text } else { theme.quiet },
        },
    };
    if response.has_focus() {
        Look { frame: frame(look.frame.width.max(3.0), focus_colour(theme, weight)), ..look }
    } else {
        look
    }
}

/// The frame of focus must be seen on the main button, too, which has the accent's colour itself.
fn focus_colour(theme: &Theme, weight: Weight) -> Color32 {
    if weight == Weight::Main { theme.text } else { theme.accent }
}

/// An empty button at a place: the caller paints what stands on it, in the colour returned. Its `key` tells it
/// from the others, whatever its words are in any language.
pub fn at(
    ui: &mut Ui,
    key: &str,
    place: Rect,
    weight: Weight,
    enabled: bool,
    name: &str,
    theme: &Theme,
) -> (Response, Color32) {
    let sense = if enabled { Sense::click() } else { Sense::hover() };
    let response = ui.interact(place, ui.scope_id().with(("button", key)), sense);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    let look = look(theme, weight, &response, enabled);
    let radius = CornerRadius::same(if weight == Weight::Quiet { 4 } else { 8 });
    ui.painter().rect(place, radius, look.fill, look.frame, StrokeKind::Inside);
    if enabled && response.hovered() {
        ui.set_cursor_icon(CursorIcon::PointingHand);
    }
    (response, look.text)
}

/// One click. The second of two quick ones does not count: Run turns into Stop under the finger.
pub fn clicked_once(response: &Response) -> bool {
    response.clicked() && !response.double_clicked() && !response.triple_clicked()
}

/// A button with words in its middle.
pub fn with_words(
    ui: &mut Ui,
    key: &str,
    place: Rect,
    weight: Weight,
    text: &str,
    font: FontId,
    theme: &Theme,
) -> Response {
    let (response, colour) = at(ui, key, place, weight, true, text, theme);
    let size = font.size;
    let family = font.family;
    let fit = words::fitting_size(ui, text, |s| FontId::new(s, family.clone()), place.width() - 16.0, size, 11.0);
    ui.painter().text(place.center(), Align2::CENTER_CENTER, text, FontId::new(fit, family), colour);
    response
}

/// A switch with its words beside it, the whole place being the target.
pub fn switch(ui: &mut Ui, place: Rect, on: bool, can: bool, words: [&str; 2], theme: &Theme) -> Response {
    let [title, note] = words;
    let response = ui.interact(place, ui.scope_id().with("switch"), if can { Sense::click() } else { Sense::hover() });
    response.widget_info(|| WidgetInfo::selected(Role::CheckBox, can, on, title));
    let look = look(theme, Weight::Plain, &response, can);
    ui.painter().rect(place, CornerRadius::same(8), look.fill, look.frame, StrokeKind::Inside);
    let track = Rect::from_min_size(pos2(place.left() + 20.0, place.center().y - 17.0), Vec2::new(62.0, 34.0));
    let (fill, knob_x) = if on { (theme.accent, track.right() - 17.0) } else { (theme.raised, track.left() + 17.0) };
    let knob = if on { theme.on_accent } else { theme.strong_stroke };
    ui.painter().rect(track, CornerRadius::same(17), fill, Stroke::new(2.0, theme.strong_stroke), StrokeKind::Inside);
    ui.painter().circle_filled(pos2(knob_x, track.center().y), 12.0, knob);
    let mut text = Rect::from_min_max(pos2(track.right() + 16.0, place.top()), place.max);
    text.max.x -= 8.0;
    let painter = ui.painter().with_clip_rect(text);
    let font = fonts::semibold(words::fitting_size(ui, title, fonts::semibold, text.width(), 20.0, 13.0));
    if note.is_empty() {
        painter.text(text.left_center(), Align2::LEFT_CENTER, title, font, theme.text);
    } else {
        // A note that is longer than its place takes a second line.
        let at = |points: f32| ui.painter().layout(note.to_owned(), fonts::regular(points), theme.quiet, text.width());
        let long = at(15.0).rows.len() > 1;
        let galley = if long { at(13.0) } else { at(15.0) };
        let middle = text.center().y - if long { 8.0 } else { 0.0 };
        painter.text(pos2(text.left(), middle), Align2::LEFT_BOTTOM, title, font, theme.text);
        painter.galley(pos2(text.left(), middle + 3.0), galley, theme.quiet);
    }
    response
}
