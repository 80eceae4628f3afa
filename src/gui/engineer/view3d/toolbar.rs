//! The bar above the part: what a click does on the left, from where it is looked at on the right.

use super::View3d;
use crate::gui::engineer::{EngineerView, Tool};
use crate::gui::scene::camera::Projection;
use crate::gui::scene::standard::standard_ui;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::words as write;
use egui::{
    Align, Align2, Button, CornerRadius, Key, Layout, Popup, Rect, Response, RichText, Role, Stroke, StrokeKind, Ui,
    WidgetInfo, pos2, vec2,
};

/// The tools of the bar with their keys; those for the alignment share a menu.
const TOOLS: [(Tool, &str, &str); 5] = [
    (Tool::Choose, "pick.choose", "V"),
    (Tool::Surface, "pick.surface", "S"),
    (Tool::Edge, "pick.edge", "E"),
    (Tool::Hole, "pick.hole", "H"),
    (Tool::Measure, "pick.measure", "M"),
];
const FEATURES: [(Tool, &str); 3] = [
    (Tool::FeatureHole, "pick.feature_hole"),
    (Tool::Slot, "pick.feature_slot"),
    (Tool::Feature, "pick.feature_surface"),
];

/// Height of one row of buttons.
pub const ROW: f32 = 44.0;
/// What the buttons on the right take.
const VIEWS: f32 = 360.0;
const BUTTON: f32 = 28.0;

/// How the tools fit into a bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fit {
    /// With their keys beside their words.
    pub keys: bool,
    /// The views stand beside them; else over the part.
    pub views: bool,
}

/// What has room in a bar.
pub fn fit(ui: &Ui, width: f32, words: &Words) -> Fit {
    let of = |key: &str| write::width(ui, words.text(key), crate::gui::fonts::regular(size::TABLE)) + 26.0;
    let tools: f32 = TOOLS.iter().map(|(_, key, _)| of(key)).sum::<f32>() + of("pick.feature") + 12.0;
    let keys = 6.0 * 24.0;
    let both = tools + keys + VIEWS + 24.0 <= width;
    Fit { keys: both || tools + keys + 16.0 <= width, views: both || tools + VIEWS + 24.0 <= width }
}

/// Draws the tools, and the views where they have room.
pub fn bar_ui(ui: &mut Ui, bar: Rect, fit: Fit, scope: &Scope, view: &mut EngineerView) {
    let builder =
        egui::UiBuilder::new().max_rect(bar.shrink2(vec2(10.0, 8.0))).layout(Layout::left_to_right(Align::Center));
    ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.spacing_mut().button_padding.x = 8.0;
        for (tool, key, letter) in TOOLS {
            if tool == Tool::Measure {
                features_ui(ui, fit, scope, view);
            }
            let chosen = view.tool == tool;
            if tool_ui(ui, chosen, scope.words.text(key), letter, fit.keys, scope.theme).clicked() {
                take(view, tool);
            }
        }
        if fit.views {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| views_ui(ui, &mut view.view3d, scope.words));
        }
    });
}

/// Where the views stand when the bar has no room for them: over the part's upper right corner.
pub fn views_place(scene: Rect) -> Rect {
    let min = pos2((scene.right() - VIEWS).max(scene.left()), scene.top() + 6.0);
    Rect::from_min_max(min, pos2(scene.right() - 8.0, scene.top() + 40.0))
}

/// Draws them there.
pub fn views_over_ui(ui: &mut Ui, scene: Rect, scope: &Scope, view: &mut View3d) {
    let at = views_place(scene);
    let builder = egui::UiBuilder::new().max_rect(at).layout(Layout::right_to_left(Align::Center));
    ui.scope_builder(builder, |ui| views_ui(ui, view, scope.words));
}

fn views_ui(ui: &mut Ui, view: &mut View3d, words: &Words) {
    ui.spacing_mut().item_spacing.x = 4.0;
    ui.spacing_mut().button_padding.x = 7.0;
    let parallel = view.linked.projection() == Projection::Parallel;
    let name = words.text("pick.parallel");
    let text = RichText::new(name).size(size::TABLE);
    let button = ui.add(Button::selectable(parallel, text).frame_when_inactive(true).min_size(vec2(0.0, 26.0)));
    button.widget_info(|| WidgetInfo::selected(Role::Button, true, parallel, name));
    if button.on_hover_text(words.text("pick.parallel_hint")).clicked() {
        view.linked.toggle_projection(ui);
    }
    standard_ui(ui, &mut view.linked, words);
    let fit = ui.add(Button::new(RichText::new(format!("{} F", words.text("results.fit_view"))).size(size::TABLE)));
    fit.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text("results.fit_view")));
    if fit.clicked() {
        view.fit = true;
    }
}

fn tool_ui(ui: &mut Ui, chosen: bool, text: &str, letter: &str, with_key: bool, theme: &Theme) -> Response {
    let room = if with_key { "       " } else { "" };
    let label = RichText::new(format!("{text}{room}")).size(size::TABLE);
    let button = ui.add(Button::selectable(chosen, label).frame_when_inactive(true).min_size(vec2(0.0, BUTTON)));
    button.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, text));
    if chosen {
        ui.painter().rect_stroke(
            button.rect,
            CornerRadius::same(4),
            Stroke::new(1.5, theme.accent),
            StrokeKind::Inside,
        );
    }
    if with_key {
        let cap = Rect::from_center_size(pos2(button.rect.right() - 15.0, button.rect.center().y), vec2(17.0, 18.0));
        super::hint::key_cap(ui, cap, letter, theme);
    }
    button
}

/// The features for the alignment, in a menu.
fn features_ui(ui: &mut Ui, fit: Fit, scope: &Scope, view: &mut EngineerView) {
    let chosen = FEATURES.iter().any(|(tool, _)| view.tool == *tool);
    let button = tool_ui(ui, chosen, scope.words.text("pick.feature"), "A", fit.keys, scope.theme);
    let by_key = std::mem::take(&mut view.view3d.open_features);
    if by_key {
        Popup::open_id(ui.ctx(), Popup::default_response_id(&button));
    }
    Popup::menu(&button).show(|ui| {
        for (k, (tool, key)) in FEATURES.into_iter().enumerate() {
            let item = ui.add(Button::selectable(view.tool == tool, scope.words.text(key)).min_size(vec2(200.0, 30.0)));
            if by_key && k == 0 {
                item.request_focus();
            }
            if item.clicked() {
                take(view, tool);
            }
        }
    });
}

/// Takes a tool in hand. What was proposed with another one is left out.
pub fn take(view: &mut EngineerView, tool: Tool) {
    if view.tool != tool {
        view.draft = None;
        view.view3d.picks.clear();
        view.view3d.refused = None;
    }
    view.tool = tool;
}

/// Keys of the tools.
pub fn keys(ui: &Ui, view: &mut EngineerView) {
    let pressed = |key: Key| ui.input_mut(|i| i.consume_key(egui::Modifiers::NONE, key));
    let tools = [
        (Key::V, Tool::Choose),
        (Key::S, Tool::Surface),
        (Key::E, Tool::Edge),
        (Key::H, Tool::Hole),
        (Key::M, Tool::Measure),
    ];
    for (key, tool) in tools {
        if pressed(key) {
            take(view, tool);
        }
    }
    if pressed(Key::A) {
        view.view3d.open_features = true;
    }
}

/// Words in the middle of a scene that has nothing to show.
pub fn empty_ui(ui: &mut Ui, scene: Rect, text: &str, theme: &Theme) {
    write::block(
        ui,
        scene.shrink(24.0),
        Align2::CENTER_CENTER,
        text,
        crate::gui::fonts::regular(size::BODY),
        theme.quiet,
        4,
    );
}
