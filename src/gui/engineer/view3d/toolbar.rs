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
/// Between two buttons.
const SPACING: f32 = 6.0;
const BUTTON: f32 = 28.0;

/// How the buttons fit into a bar; what has no room gives way in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// Tools with their keys, and the views.
    All,
    /// Tools without their keys, and the views.
    Words,
    /// The views are a menu.
    ViewsFolded,
    /// So are the tools.
    Folded,
}

/// What has room in a bar.
pub fn fit(ui: &Ui, width: f32, words: &Words) -> Fit {
    let of = |key: &str| write::width(ui, words.text(key), crate::gui::fonts::regular(size::TABLE)) + 18.0 + SPACING;
    let tools: f32 = TOOLS.iter().map(|(_, key, _)| of(key)).sum::<f32>() + of("pick.feature") + 20.0;
    let keys = 6.0 * 28.0;
    // Six numbers, the isometric view, and the gaps between them.
    let views = of("pick.parallel") + of("results.fit_view") + 18.0 + 6.0 * 30.0 + 38.0 + 8.0;
    let menu = of("bar.more") + 8.0;
    match width {
        w if tools + keys + views <= w => Fit::All,
        w if tools + views <= w => Fit::Words,
        w if tools + menu <= w => Fit::ViewsFolded,
        _ => Fit::Folded,
    }
}

/// Draws tools and views.
pub fn bar_ui(ui: &mut Ui, bar: Rect, scope: &Scope, view: &mut EngineerView) {
    let fit = fit(ui, bar.width(), scope.words);
    let builder =
        egui::UiBuilder::new().max_rect(bar.shrink2(vec2(10.0, 8.0))).layout(Layout::left_to_right(Align::Center));
    ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = SPACING;
        ui.spacing_mut().button_padding.x = 8.0;
        let with_keys = fit == Fit::All;
        let beside = |letter: &'static str| if with_keys { Beside::Key(letter) } else { Beside::Nothing };
        if fit == Fit::Folded {
            tools_menu_ui(ui, scope, view);
        } else {
            for (tool, key, letter) in TOOLS {
                if tool == Tool::Measure {
                    features_ui(ui, beside("A"), scope, view);
                }
                let chosen = view.tool == tool;
                if tool_ui(ui, chosen, scope.words.text(key), beside(letter), scope.theme).clicked() {
                    take(view, tool);
                }
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| match fit {
            Fit::All | Fit::Words => views_ui(ui, &mut view.view3d, scope.words),
            Fit::ViewsFolded | Fit::Folded => {
                let more = RichText::new(scope.words.text("bar.more")).size(size::TABLE);
                let button = ui.add(Button::new(more).min_size(vec2(0.0, BUTTON)));
                Popup::menu(&button).show(|ui| ui.horizontal(|ui| views_ui(ui, &mut view.view3d, scope.words)));
            }
        });
    });
}

/// All tools in a menu, known by the one that is in hand.
fn tools_menu_ui(ui: &mut Ui, scope: &Scope, view: &mut EngineerView) {
    let words = scope.words;
    let features = FEATURES.into_iter().map(|(tool, key)| (tool, key, ""));
    let all: Vec<(Tool, &str, &str)> = TOOLS.into_iter().chain(features).collect();
    let now = all.iter().find(|(tool, ..)| *tool == view.tool).map_or("", |(_, key, _)| *key);
    let button = tool_ui(ui, true, words.text(now), Beside::Triangle, scope.theme);
    if std::mem::take(&mut view.view3d.open_features) {
        Popup::open_id(ui.ctx(), Popup::default_response_id(&button));
    }
    Popup::menu(&button).show(|ui| {
        for (tool, key, letter) in all {
            let text = words.text(key);
            let item = Button::selectable(view.tool == tool, text).shortcut_text(letter).min_size(vec2(220.0, 30.0));
            let item = ui.add(item);
            item.widget_info(|| WidgetInfo::selected(Role::Button, true, view.tool == tool, text));
            if item.clicked() {
                take(view, tool);
            }
        }
    });
}

fn views_ui(ui: &mut Ui, view: &mut View3d, words: &Words) {
    ui.spacing_mut().item_spacing.x = 4.0;
    ui.spacing_mut().button_padding.x = 7.0;
    // In the bar they are added from the right.
    if ui.layout().prefer_right_to_left() {
        parallel_ui(ui, view, words);
        standard_ui(ui, &mut view.linked, words);
        fit_ui(ui, view, words);
    } else {
        fit_ui(ui, view, words);
        standard_ui(ui, &mut view.linked, words);
        parallel_ui(ui, view, words);
    }
}

fn parallel_ui(ui: &mut Ui, view: &mut View3d, words: &Words) {
    let parallel = view.linked.projection() == Projection::Parallel;
    let name = words.text("pick.parallel");
    let text = RichText::new(name).size(size::TABLE);
    let button = ui.add(Button::selectable(parallel, text).frame_when_inactive(true).min_size(vec2(0.0, 26.0)));
    button.widget_info(|| WidgetInfo::selected(Role::Button, true, parallel, name));
    if button.on_hover_text(words.text("pick.parallel_hint")).clicked() {
        view.linked.toggle_projection(ui);
    }
}

fn fit_ui(ui: &mut Ui, view: &mut View3d, words: &Words) {
    let fit = ui.add(Button::new(RichText::new(format!("{} F", words.text("results.fit_view"))).size(size::TABLE)));
    fit.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text("results.fit_view")));
    if fit.clicked() {
        view.fit = true;
    }
}

/// What stands behind the words of a tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beside<'a> {
    Nothing,
    /// Its key.
    Key(&'a str),
    /// The sign of a menu.
    Triangle,
}

fn tool_ui(ui: &mut Ui, chosen: bool, text: &str, beside: Beside<'_>, theme: &Theme) -> Response {
    let room = if beside == Beside::Nothing { "" } else { "       " };
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
    let at = pos2(button.rect.right() - 15.0, button.rect.center().y);
    match beside {
        Beside::Nothing => {}
        Beside::Key(letter) => super::hint::key_cap(ui, Rect::from_center_size(at, vec2(17.0, 18.0)), letter, theme),
        Beside::Triangle => {
            let corners = [vec2(-4.0, -2.0), vec2(4.0, -2.0), vec2(0.0, 3.5)].map(|v| at + v);
            ui.painter().add(egui::Shape::convex_polygon(corners.to_vec(), theme.text, Stroke::NONE));
        }
    }
    button
}

/// The features for the alignment, in a menu.
fn features_ui(ui: &mut Ui, beside: Beside<'_>, scope: &Scope, view: &mut EngineerView) {
    let chosen = FEATURES.iter().any(|(tool, _)| view.tool == *tool);
    let button = tool_ui(ui, chosen, scope.words.text("pick.feature"), beside, scope.theme);
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
