//! The clouds in three dimensions: measured and merged, from one camera, coloured by view, metric, deviation or wear.

use super::colours::{By, CloudPoints, ColourKey, Colours, Scenes, ScenesKey, of_view};
use super::facts::{Merging, ViewsState};
use super::layout::Places;
use super::legend::{self, Legend, legend_ui};
use super::scene_bar;
use super::state::{Cloud, MergeView};
use crate::geometry::LengthUnit;
use crate::gui::breadth::Breadth;
use crate::gui::fonts;
use crate::gui::scene::builder::pending;
use crate::gui::scene::camera::Camera;
use crate::gui::scene::legend::{colour, plate};
use crate::gui::scene::linked::size_of;
use crate::gui::scene::overlay;
use crate::gui::scene::points::Points;
use crate::gui::scene::renderer::CloudRequest;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::report::palette::Rgb;
use egui::{Align2, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;

/// Height of a cloud's bar.
const BAR: f32 = 40.0;
/// Room that a fit leaves at the sides and above.
const MARGIN: [f64; 2] = [26.0, 26.0];

/// Takes what was computed and begins what is missing.
pub fn refresh(ui: &Ui, merging: &Merging, view: &mut MergeView, scope: &Scope) {
    let ctx = ui.ctx();
    if let Some(pending) = &view.scenes_pending {
        match pending.answer() {
            Ok(scenes) => {
                view.scenes = Some((pending.key.clone(), Arc::new(scenes)));
                view.scenes_pending = None;
                view.fit = true;
            }
            Err(TryRecvError::Disconnected) => view.scenes_pending = None,
            Err(TryRecvError::Empty) => {}
        }
    }
    let Some(wanted) = ScenesKey::of(merging) else { return };
    let known = |key: Option<&ScenesKey>| key.is_some_and(|key| *key == wanted);
    if !known(view.scenes.as_ref().map(|(key, _)| key)) {
        if !known(view.scenes_pending.as_ref().map(|p| &p.key)) {
            let of = wanted.clone();
            view.scenes_pending = pending(wanted, ctx, move |run| of.compute(run).ok());
        }
        // What is shown stays until the other one is there.
        if view.scenes.is_none() {
            return;
        }
    }
    let Some(scenes) = view.scenes.clone() else { return };
    let background = background(scope);
    for (k, cloud) in [Cloud::Measured, Cloud::Merged].into_iter().enumerate() {
        let by = by_of(cloud, view);
        let key = ColourKey::of(merging, &scenes, (cloud, by), (view.chosen, view.range), background);
        if key.points().is_some() {
            refresh_colours(ctx, view, k, key);
        }
    }
}

fn refresh_colours(ctx: &egui::Context, view: &mut MergeView, k: usize, wanted: ColourKey) {
    if let Some(pending) = &view.colours_pending[k] {
        match pending.answer() {
            Ok(colours) => {
                view.colours[k] = Some((pending.key.clone(), Arc::new(colours)));
                view.colours_pending[k] = None;
            }
            Err(TryRecvError::Disconnected) => view.colours_pending[k] = None,
            Err(TryRecvError::Empty) => {}
        }
    }
    // What is computed is not given up for what came after it: the picture follows a slider that goes on moving.
    if view.colours[k].as_ref().is_none_or(|(key, _)| *key != wanted) && view.colours_pending[k].is_none() {
        let of = wanted.clone();
        view.colours_pending[k] = pending(wanted, ctx, move |run| of.compute(run).ok());
    }
}

fn background(scope: &Scope) -> Rgb {
    let c = scope.theme.scene;
    [c.r(), c.g(), c.b()]
}

/// By what a cloud is coloured.
pub fn by_of(cloud: Cloud, view: &MergeView) -> By {
    match cloud {
        Cloud::Measured => view.measured_by,
        Cloud::Merged => view.merged_by,
    }
}

/// Draws the cards of the clouds.
pub fn scenes_ui(ui: &mut Ui, places: &Places, merging: &Merging, view: &mut MergeView, scope: &mut Scope) {
    match (places.breadth, places.merged) {
        (Breadth::Wide, Some(merged)) => {
            cloud_ui(ui, places.measured, (Cloud::Measured, false), merging, view, scope);
            cloud_ui(ui, merged, (Cloud::Merged, false), merging, view, scope);
        }
        _ => cloud_ui(ui, places.measured, (view.cloud, true), merging, view, scope),
    }
}

/// A cloud in its card. `alone`: the other one has no card, and a switch leads to it.
fn cloud_ui(
    ui: &mut Ui,
    at: Rect,
    (cloud, alone): (Cloud, bool),
    merging: &Merging,
    view: &mut MergeView,
    scope: &mut Scope,
) {
    let theme = scope.theme;
    cards::card(ui, at, theme);
    let bar = at.with_max_y(at.top() + BAR);
    ui.push_id(("cloud", cloud), |ui| scene_bar::bar_ui(ui, bar, (cloud, alone), merging, view, scope));
    let inside = Rect::from_min_max(pos2(at.left() + 1.0, bar.bottom()), at.max - vec2(1.0, 1.0));
    ui.painter().rect_filled(inside, 0, theme.scene);
    let scenes = view.scenes.as_ref().map(|(_, scenes)| scenes.clone());
    let points = scenes.as_ref().and_then(|scenes| of_cloud(scenes, cloud));
    let k = usize::from(cloud == Cloud::Merged);
    let colours = view.colours[k].clone();
    let ready = points.zip(colours).filter(|(points, (key, _))| {
        key.cloud == cloud && key.points().is_some_and(|of| Arc::ptr_eq(&of.points, &points.points))
    });
    let Some((points, (key, colours))) = ready else {
        let text = waiting(cloud, merging, scope);
        let font = fonts::regular(size::BODY);
        write::block(ui, inside.shrink(20.0), Align2::CENTER_CENTER, &text, font, theme.quiet, 4);
        return;
    };
    let has_legend = colours.range.is_some();
    let beside_legend = inside.with_max_x(inside.right() - legend::WIDTH - 8.0);
    let scene = if has_legend { beside_legend } else { inside };
    let camera = scene_ui(ui, (scene, beside_legend), cloud, points, &colours, view, scope);
    labels_ui(ui, scene, &camera, points, view.chosen, merging, scope);
    overlay::axes(&ui.painter_at(scene), &camera, scene, theme);
    if has_legend {
        let unit = merging.plan.as_ref().map_or(LengthUnit::Mm, |plan| plan.unit);
        let beside = Rect::from_min_max(pos2(scene.right() + 6.0, inside.top() + 8.0), inside.max - vec2(2.0, 6.0));
        legend_ui(ui, beside, &Legend { by: key.by, colours: &colours, unit }, scope);
    }
    if cloud == Cloud::Measured && scenes.as_ref().is_some_and(|scenes| scenes.unplaced) {
        note_ui(ui, scene, scope.words.text("merge.unplaced"), scope);
    }
}

fn of_cloud(scenes: &Scenes, cloud: Cloud) -> Option<&CloudPoints> {
    match cloud {
        Cloud::Measured => Some(&scenes.measured).filter(|cloud| !cloud.view.is_empty()),
        Cloud::Merged => scenes.merged.as_ref(),
    }
}

/// What stands where there are no points yet.
fn waiting(cloud: Cloud, merging: &Merging, scope: &Scope) -> String {
    let words = scope.words;
    words
        .text(match (&merging.views, cloud) {
            (ViewsState::None | ViewsState::Failed(_), _) => "merge.no_points",
            (_, Cloud::Merged) if merging.done.is_none() => "merge.not_merged_yet",
            _ => "merge.points_are_made",
        })
        .to_owned()
}

fn note_ui(ui: &mut Ui, scene: Rect, text: &str, scope: &Scope) {
    let font = fonts::regular(size::NOTE);
    let wide = write::width(ui, text, font.clone()).min(scene.width() - 100.0);
    let at = Rect::from_center_size(pos2(scene.center().x + 30.0, scene.bottom() - 16.0), vec2(wide + 12.0, 20.0));
    plate(ui.painter(), at, scope.theme);
    write::line(ui, at.shrink2(vec2(6.0, 0.0)), Align2::CENTER_CENTER, text, font, scope.theme.text);
}

/// Draws the points, listens to the pointer; returns the camera.
fn scene_ui(
    ui: &mut Ui,
    (at, fitted): (Rect, Rect),
    cloud: Cloud,
    points: &CloudPoints,
    colours: &Colours,
    view: &mut MergeView,
    scope: &Scope,
) -> Camera {
    let words = scope.words;
    let response = ui.interact(at, ui.scope_id().with(("cloud scene", cloud)), Sense::click_and_drag());
    let name = words.text(if cloud == Cloud::Measured { "merge.measured" } else { "merge.merged" });
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    let content: &Points = &points.points;
    // Both clouds are fitted alike, whether a legend stands beside them or not.
    let size = size_of(fitted);
    if std::mem::take(&mut view.fit) && view.linked.now().is_some() {
        view.linked.fit(content, size, MARGIN, ui);
    }
    view.linked.pointer(ui, &response, at, content);
    let camera = view.linked.camera(content, (size, MARGIN), ui);
    let px = f64::from(ui.ctx().pixels_per_point());
    let request = CloudRequest {
        points: points.points.clone(),
        colours: colours.colours.clone(),
        camera,
        size_px: [at.width(), at.height()].map(|v| (f64::from(v) * px).round().max(1.0) as u32),
        px_per_point: px,
        background: background(scope),
        moving: view.linked.is_moving(ui.input(|i| i.time)),
    };
    view.canvas.paint_cloud(ui, at, usize::from(cloud == Cloud::Merged), request);
    if let Some(fault) = view.canvas.fault() {
        let text = words.fill("results.no_opengl", &[("fault", &fault)]);
        write::block(
            ui,
            at.shrink(24.0),
            Align2::CENTER_CENTER,
            &text,
            fonts::regular(size::BODY),
            scope.theme.text,
            6,
        );
    }
    if response.clicked()
        && let Some(pos) = response.interact_pointer_pos()
    {
        let pixel = [f64::from(pos.x - at.left()), f64::from(pos.y - at.top())];
        let shown = |k: usize| colours.colours.get(k).is_some_and(|c| c[3] > 0);
        let hit = content.near(&camera, pixel, size, shown);
        let number = hit.map(|k| points.view[content.order[k] as usize]);
        // A click beside all points, or on the view that stands out, lets go of it.
        view.chosen = number.and_then(|n| usize::try_from(n).ok()).filter(|n| view.chosen != Some(*n));
    }
    camera
}

/// The number of each view on its points, framed in its colour; those that would lie over another give way, the chosen one never.
fn labels_ui(
    ui: &Ui,
    scene: Rect,
    camera: &Camera,
    points: &CloudPoints,
    chosen: Option<usize>,
    merging: &Merging,
    scope: &Scope,
) {
    let theme = scope.theme;
    let painter = ui.painter_at(scene);
    let mut taken: Vec<Rect> = vec![overlay::axes_corner(scene)];
    let first = points.labels.iter().filter(|(n, _)| chosen == Some(*n as usize));
    let rest = points.labels.iter().filter(|(n, _)| chosen != Some(*n as usize));
    let digits = if merging.preview().is_some_and(|p| p.files.len() > 99) { 3 } else { 2 };
    for (number, place) in first.chain(rest) {
        let Some(at) = overlay::project(camera, place, scene, size_of(scene)) else { continue };
        let wide = 8.0 * digits as f32 + 12.0;
        let plate = Rect::from_center_size(at, vec2(wide, 20.0));
        if !scene.contains_rect(plate) || taken.iter().any(|other| other.intersects(plate.expand(2.0))) {
            continue;
        }
        taken.push(plate);
        let is_chosen = chosen == Some(*number as usize);
        painter.rect_filled(plate, 3, theme.panel);
        let frame = Stroke::new(if is_chosen { 3.0 } else { 2.0 }, colour(of_view(*number)));
        painter.rect_stroke(plate, 3, frame, StrokeKind::Inside);
        let text = format!("{number:0digits$}");
        painter.text(plate.center(), Align2::CENTER_CENTER, text, fonts::mono(size::NOTE), theme.text);
    }
}

/// Keys of the clouds, while no field has the focus.
pub fn keys(ui: &Ui, view: &mut MergeView, scope: &Scope) {
    let Some((_, scenes)) = view.scenes.clone() else { return };
    if !scope.letters_are_free(ui) || ui.memory(|m| m.focused().is_some()) {
        return;
    }
    let place = ui.max_rect();
    view.linked.keys(ui, place, &scenes.measured.points, MARGIN);
}
