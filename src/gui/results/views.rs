//! The two views of a part: the CAD with its points, and the map.

use super::ResultsView;
use super::controls::scale_ui;
use super::numbers;
use super::view_bar::{BAR, cad_bar_ui, map_bar_ui};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scene::camera::Camera;
use crate::gui::scene::content::{MapContent, PartContent};
use crate::gui::scene::distance::distance_ui;
use crate::gui::scene::legend::{self, Notes, legend_ui};
use crate::gui::scene::linked::{FLAG_MARGIN, size_of};
use crate::gui::scene::overlay::{self, Mark};
use crate::gui::scene::pick;
use crate::gui::scene::renderer::{Layer, Request};
use crate::gui::scene::tones::tones;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::inspect::{Inspection, PointResult};
use crate::plan::Plan;
use crate::report::palette::{Palette, Scale};
use crate::report::words::worst_first;
use egui::{Align2, Pos2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use std::sync::Arc;

/// Height of the line with range, bands and palette below a map; a card that is lower than `LINE_FROM` has none.
const LINE: f32 = 36.0;
const LINE_FROM: f32 = 210.0;

/// Which points have a flag.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Labels {
    /// The worst six.
    #[default]
    Worst,
    /// All, as far as there is room.
    All,
    /// None.
    None,
}

/// What one view shows beside the shared camera.
pub struct Content<'a> {
    /// The part.
    pub part: &'a Arc<PartContent>,
    /// The result, when it is ready.
    pub map: Option<&'a Arc<MapContent>>,
    /// The result.
    pub inspection: &'a Inspection,
    /// The plan.
    pub plan: &'a Plan,
    /// Spacing of the scan's points.
    pub spacing_mm: f64,
}

/// Marks of all comparison points.
pub fn marks(points: &[PointResult], words: &Words) -> Vec<Mark> {
    let value = |p: &PointResult| match p.measurement {
        Some(_) => numbers::deviation(p, words),
        None => words.text("results.no_value").to_owned(),
    };
    points
        .iter()
        .map(|p| Mark { kind: p.kind, verdict: p.verdict, place: p.nominal, name: p.name.clone(), value: value(p) })
        .collect()
}

/// The CAD with its points.
pub fn cad_ui(ui: &mut Ui, at: Rect, content: &Content<'_>, view: &mut ResultsView, scope: &mut Scope) {
    let theme = scope.theme;
    cards::card(ui, at, theme);
    cad_bar_ui(ui, at.with_max_y(at.top() + BAR), view, scope);
    let scene = inside(at);
    let camera = scene_ui(ui, scene, 0, Layer::Cad, content, view, scope);
    overlay::features(&ui.painter_at(scene), &content.plan.features, &camera, scene, content.part, theme);
    let marks = marks(&content.inspection.points, scope.words);
    let places = overlay::placed(&marks, &camera, scene, content.part);
    overlay::markers(&ui.painter_at(scene), &marks, &places, scope.view.point, theme);
    overlay::axes(&ui.painter_at(scene), &camera, scene, theme);
    kinds_ui(ui, scene, scope);
}

/// The map, or the CAD where only one view has room.
pub fn map_ui(ui: &mut Ui, at: Rect, content: &Content<'_>, alone: bool, view: &mut ResultsView, scope: &mut Scope) {
    let theme = scope.theme;
    cards::card(ui, at, theme);
    let layer = view.layer(alone);
    let (picture, line) = parts(at, layer);
    let bar = at.with_max_y(at.top() + BAR);
    let has_map = layer != Layer::Cad;
    map_bar_ui(ui, bar, content, picture, [alone, has_map && line.is_none()], view, scope);
    let scene = map_scene(at, layer);
    let camera = scene_ui(ui, scene, 1, layer, content, view, scope);
    if layer == Layer::Cad {
        overlay::features(&ui.painter_at(scene), &content.plan.features, &camera, scene, content.part, theme);
    }
    let marks = marks(&content.inspection.points, scope.words);
    let places = overlay::placed(&marks, &camera, scene, content.part);
    let flagged = flagged(view.labels, &content.inspection.points, scope.view.point);
    let mut kept = rims(content, &camera, scene);
    kept.push(overlay::axes_corner(scene));
    let banners = overlay::banners(ui, scene, &marks, &places, &flagged, &kept);
    overlay::leaders(&ui.painter_at(scene), &banners, scope.view.point, theme);
    overlay::markers(&ui.painter_at(scene), &marks, &places, scope.view.point, theme);
    let clicked = overlay::flags(ui, &banners, &marks, scope.view.point, theme);
    overlay::axes(&ui.painter_at(scene), &camera, scene, theme);
    if view.measuring {
        distance_ui(ui, scene, &camera, &view.picks, scope);
    }
    if let Some(k) = clicked {
        scope.ask(Action::ChoosePoint(Some(k)));
    }
    if has_map {
        let beyond = content.map.map_or([0, 0], |m| view.beyond(m));
        let notes = Notes { beyond, lines: layer == Layer::Surface };
        let beside = picture.with_min_x(scene.right());
        ui.painter().rect_filled(beside, 0, theme.scene);
        let legend_at = Rect::from_min_max(beside.min + vec2(0.0, 8.0), beside.max - vec2(6.0, 4.0));
        legend_ui(ui, legend_at, &view.scale, &notes, scope.words, theme);
    }
    if let Some(line) = line {
        scale_ui(ui, line, view, scope);
    }
    if content.map.is_none() && has_map {
        let text = scope.words.text("results.map_is_made");
        write::line(
            ui,
            scene.with_min_y(scene.bottom() - 60.0).with_max_y(scene.bottom() - 36.0),
            Align2::CENTER_CENTER,
            text,
            fonts::regular(size::BODY),
            theme.quiet,
        );
    }
}

/// The scene of a view in a card.
pub fn inside(card: Rect) -> Rect {
    Rect::from_min_max(pos2(card.left() + 1.0, card.top() + BAR), card.max - vec2(1.0, 1.0))
}

/// What of the map's card is its picture, and the line below it where that has room.
pub fn parts(card: Rect, layer: Layer) -> (Rect, Option<Rect>) {
    let all = inside(card);
    if layer == Layer::Cad || card.height() < LINE_FROM {
        return (all, None);
    }
    let (picture, line) = all.split_top_bottom_at_y(all.bottom() - LINE);
    (picture, Some(line))
}

/// The scene of the map's card: beside its legend, if it has one.
pub fn map_scene(card: Rect, layer: Layer) -> Rect {
    let (all, _) = parts(card, layer);
    if layer == Layer::Cad { all } else { all.with_max_x(all.right() - legend::WIDTH - 12.0) }
}

/// The rims of holes in a view, which flags leave free as they do markers; a hole that fills the view is no obstacle.
fn rims(content: &Content<'_>, camera: &Camera, at: Rect) -> Vec<Rect> {
    let holes = content.plan.comparison.iter().filter(|point| point.geometry.kind() == "hole");
    let bounds = holes.filter_map(|point| {
        let rim = overlay::outline(&point.geometry);
        let line: Vec<Pos2> = rim.iter().filter_map(|p| overlay::project(camera, p, at, size_of(at))).collect();
        (line.len() == rim.len() && !line.is_empty()).then(|| Rect::from_points(&line))
    });
    bounds.filter(|rim| rim.height() < 0.4 * at.height() && at.intersects(*rim)).collect()
}

/// The points that get a flag: the worst, and always the chosen one.
fn flagged(labels: Labels, points: &[PointResult], chosen: Option<usize>) -> Vec<usize> {
    const WORST: usize = 6;
    let order = worst_first(points);
    let mut flagged: Vec<usize> = match labels {
        Labels::Worst => order.into_iter().take(WORST).collect(),
        Labels::All => order,
        Labels::None => Vec::new(),
    };
    if let Some(chosen) = chosen.filter(|k| *k < points.len() && !flagged.contains(k)) {
        flagged.insert(0, chosen);
    }
    flagged
}

/// Draws a scene, listens to the pointer; returns the camera.
fn scene_ui(
    ui: &mut Ui,
    at: Rect,
    number: usize,
    layer: Layer,
    content: &Content<'_>,
    view: &mut ResultsView,
    scope: &mut Scope,
) -> Camera {
    let theme = scope.theme;
    let response = ui.interact(at, ui.scope_id().with(("scene", number)), Sense::click_and_drag());
    let name = scope.words.text(if number == 0 { "results.cad_and_points" } else { "results.map" });
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    view.linked.pointer(ui, &response, at, content.part);
    let camera = view.linked.camera(content.part, (view.fit_size, view.margin), ui);
    ui.painter().rect_filled(at, 0, theme.scene);
    let px = f64::from(ui.ctx().pixels_per_point());
    let moving = view.linked.is_moving(ui.input(|i| i.time));
    let request = Request {
        part: content.part.clone(),
        map: content.map.cloned(),
        layer: if content.map.is_some() { layer } else { Layer::Cad },
        camera,
        size_px: [at.width(), at.height()].map(|v| (f64::from(v) * px).round().max(1.0) as u32),
        px_per_point: px,
        scale: view.scale,
        tones: tones(theme),
        classes: view.classes,
        spacing_mm: content.spacing_mm,
        moving,
    };
    view.canvas.paint(ui, at, number, request);
    if let Some(fault) = view.canvas.fault() {
        let text = scope.words.fill("results.no_opengl", &[("fault", &fault)]);
        write::block(ui, at.shrink(24.0), Align2::CENTER_CENTER, &text, fonts::regular(size::BODY), theme.text, 6);
    }
    if response.clicked()
        && let Some(pos) = response.interact_pointer_pos()
    {
        click(at, pos, &camera, content, view, scope);
    }
    camera
}

/// A click chooses the nearest marker, or sets an end of a distance.
fn click(at: Rect, pos: Pos2, camera: &Camera, content: &Content<'_>, view: &mut ResultsView, scope: &mut Scope) {
    let pixel = [f64::from(pos.x - at.left()), f64::from(pos.y - at.top())];
    let size = size_of(at);
    if view.measuring {
        let face = content.part.part.face(content.part.face);
        if let Some(pick) = pick::surface(&face.mesh, &face.bvh, camera, pixel, size) {
            if view.picks.len() >= 2 {
                view.picks.clear();
            }
            view.picks.push(pick);
        }
        return;
    }
    let points = &content.inspection.points;
    let places: Vec<Option<[f64; 2]>> =
        points.iter().map(|p| camera.project(&p.nominal, size).map(|s| [s.x, s.y])).collect();
    if let Some(k) = pick::marker(&places, pixel, 12.0) {
        scope.ask(Action::ChoosePoint(Some(k)));
    }
}

/// The forms of markers, below a scene.
fn kinds_ui(ui: &mut Ui, at: Rect, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let kinds = [("surface", "results.surface"), ("edge", "results.edge"), ("hole", "results.hole")];
    let width = |ui: &Ui, key: &str| write::width(ui, words.text(key), fonts::regular(size::NOTE)) + 38.0;
    let all: f32 = kinds.iter().map(|(_, key)| width(ui, key)).sum::<f32>() + width(ui, "results.feature");
    let mut x = (at.center().x - 0.5 * all).max(at.left() + 90.0);
    let y = at.bottom() - 16.0;
    let behind = Rect::from_min_max(pos2(x - 14.0, y - 12.0), pos2(x + all - 10.0, y + 12.0));
    legend::plate(ui.painter(), behind, theme);
    let word = |ui: &mut Ui, x: &mut f32, key: &str| {
        let place = Rect::from_min_size(pos2(*x + 14.0, y - 9.0), vec2(width(ui, key) - 20.0, 18.0));
        write::line(ui, place, Align2::LEFT_CENTER, words.text(key), fonts::regular(size::NOTE), theme.text);
        *x += width(ui, key);
    };
    for (kind, key) in kinds {
        overlay::marker(ui.painter(), kind, crate::inspect::Verdict::Pass, pos2(x, y), theme);
        word(ui, &mut x, key);
    }
    let bar = Rect::from_center_size(pos2(x, y), vec2(14.0, 5.0));
    ui.painter().rect_filled(bar, 2, theme.feature);
    word(ui, &mut x, "results.feature");
}

/// The scale of a new part: as the plan says.
pub fn scale_of(range_mm: f64) -> Scale {
    let range_mm = if range_mm.is_finite() && range_mm > 0.0 { range_mm } else { 1.0 };
    Scale { range_mm, palette: Palette::default(), bands: 0 }
}

/// Room that a fit leaves in a view: for its flags, but never more than a share of it.
pub fn margin(labels: Labels, at: Rect) -> [f64; 2] {
    let [across, up] = [at.width(), at.height()].map(f64::from);
    let beside = if labels == Labels::None { 24.0 } else { FLAG_MARGIN[0].min(0.24 * across) };
    [beside, FLAG_MARGIN[1].min(0.1 * up)]
}
