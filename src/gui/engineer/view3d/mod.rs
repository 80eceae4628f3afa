//! The part, as it is picked on: tools, markers, snapping, the proposal.
//!
//! ```text
//! pixel --snap: camera, Picker--> proposal --pointer--> Draft (shown by ghost and by the form) --Enter--> Edit::AddRows
//! marker --pointer: drag--> Edit::BeginGesture, Reshape ..., EndGesture (one step) or DropGesture (Esc)
//! ```

mod ghost;
mod hint;
mod labels;
mod marks;
mod pointer;
mod snap;
mod toolbar;

use super::state::{Chosen, Draft, EngineerView};
use crate::geometry::Point3;
use crate::gui::fonts;
use crate::gui::scene::builder::Builder;
use crate::gui::scene::camera::Camera;
use crate::gui::scene::canvas::Canvas;
use crate::gui::scene::content::PartContent;
use crate::gui::scene::distance::distance_ui;
use crate::gui::scene::linked::{Linked, size_of};
use crate::gui::scene::overlay;
use crate::gui::scene::pick::Pick;
use crate::gui::scene::renderer::{Classes, Layer, Request};
use crate::gui::scene::tones::tones;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::part::Part;
use crate::part::propose::{NoProposal, Picker, Proposal};
use crate::plan::document::Document;
use crate::plan::{Geometry, Side};
use crate::report::palette::{Palette, Scale};
use egui::{Align2, Pos2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use ghost::Ghost;
use labels::Taken;
use marks::{Mark, Sight};
use pointer::{Drag, Target};
use std::sync::Arc;

/// Why the last click proposed nothing, and where it was.
#[derive(Debug, Clone, PartialEq)]
struct Refused {
    pos: Pos2,
    why: NoProposal,
}

/// The view's own state.
#[derive(Default)]
pub struct View3d {
    builder: Builder,
    canvas: Canvas,
    linked: Linked,
    /// The part as it was drawn last; shown until another one is ready.
    content: Option<Arc<PartContent>>,
    drag: Drag,
    picks: Vec<Pick>,
    refused: Option<Refused>,
    hover: Option<Proposal>,
    cursor: Option<Point3>,
    /// The whole part is to be shown in the next frame.
    fit: bool,
    margin: [f64; 2],
    /// The rows to which the camera need not fly any more.
    shown: Chosen,
    open_features: bool,
    /// The piece of edge around a place, told for that place and length.
    piece: Option<((Point3, f64), Vec<Point3>)>,
}

impl std::fmt::Debug for View3d {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("View3d")
    }
}

/// Room that a fit leaves for flags, points of the window.
const MARGIN: [f64; 2] = [90.0, 60.0];
/// How much of an edge is shown on either side of a point, points of the window.
const PIECE: f64 = 56.0;

impl View3d {
    /// The place of the CAD under the pointer, in words; `None` where there is none.
    pub fn cursor_words(&self, words: &Words) -> Option<String> {
        let at = self.cursor?;
        let [x, y, z] = [at.x, at.y, at.z].map(|v| words.signed_mm(v));
        Some(words.fill("pick.cursor", &[("x", &x), ("y", &y), ("z", &z)]))
    }

    /// The camera, once the part is drawn; for tests.
    pub fn camera(&self) -> Option<Camera> {
        self.linked.now()
    }

    /// The part as it is drawn; that of another side or thickness replaces it when it is ready.
    fn content(&mut self, part: &Arc<Part>, ctx: &egui::Context) -> Option<Arc<PartContent>> {
        if let Some(content) = self.builder.part(part, Side::Top, ctx) {
            self.content = Some(content);
        }
        self.content.clone()
    }

    /// The piece of edge that an edge point stands on; nothing of other shapes.
    fn piece(&mut self, picker: &Picker, geometry: &Geometry, half_mm: f64) -> Vec<Point3> {
        if geometry.kind() != "edge" {
            return Vec::new();
        }
        let key = (geometry.position(), half_mm);
        match &self.piece {
            Some((of, piece)) if *of == key => piece.clone(),
            _ => {
                let piece = picker.edge_piece(&key.0, half_mm);
                self.piece = Some((key, piece.clone()));
                piece
            }
        }
    }
}

/// Draws the toolbar and the part into a place.
pub(in crate::gui) fn view_ui(ui: &mut Ui, at: Rect, scope: &mut Scope, view: &mut EngineerView) {
    cards::card(ui, at, scope.theme);
    let bar = at.with_max_y(at.top() + toolbar::ROW);
    let scene = Rect::from_min_max(pos2(at.left() + 1.0, bar.bottom()), at.max - vec2(1.0, 1.0));
    ui.painter().rect_filled(scene, 0, scope.theme.scene);
    let facts = scope.facts;
    let known = facts.editing.as_ref().and_then(|e| Some((&e.document, e.part.as_ref()?, e.picker.as_ref()?)));
    let Some((document, part, picker)) = known else {
        toolbar::bar_ui(ui, bar, scope, view);
        return toolbar::empty_ui(ui, scene, scope.words.text("pick.no_part"), scope.theme);
    };
    let Some(content) = view.view3d.content(part, ui.ctx()) else {
        toolbar::bar_ui(ui, bar, scope, view);
        return toolbar::empty_ui(ui, scene, scope.words.text("pick.part_is_made"), scope.theme);
    };
    scene_ui(ui, scene, document, picker, &content, scope, view);
    toolbar::bar_ui(ui, bar, scope, view);
}

fn scene_ui(
    ui: &mut Ui,
    at: Rect,
    document: &Document,
    picker: &Picker,
    content: &Arc<PartContent>,
    scope: &mut Scope,
    view: &mut EngineerView,
) {
    let response = ui.interact(at, ui.scope_id().with("engineer scene"), Sense::click_and_drag());
    let name = scope.words.text("pick.scene");
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    view.view3d.margin = margin(at);
    let marks = marks::marks(document);
    pointer::keys(ui, &response, content, view, scope);
    let camera = camera(ui, at, content, view);
    let sight = Sight { camera: &camera, at, theme: scope.theme };
    let places = marks::placed(&marks, &sight, content);
    fly_to_chosen(ui, at, &marks, &camera, content, view);
    let target = Target { picker, content, camera: &camera, at, marks: &marks, places: &places, document };
    pointer::listen(ui, &response, &target, view, scope);
    paint_part(ui, at, content, &camera, view, scope);
    paint_plan(ui, &target, view, scope);
    overlay::axes(&ui.painter_at(at), &camera, axes_place(at), scope.theme);
    if view.tool == super::Tool::Measure {
        distance_ui(ui, at, &camera, &view.view3d.picks, scope);
    }
    if let Some(Refused { pos, why }) = &view.view3d.refused {
        let text = hint::reason(why, scope.words);
        hint::beside_ui(ui, at, *pos, &text, scope.theme.snap, scope.theme);
    }
    if response.has_focus() {
        let stroke = egui::Stroke::new(2.0, scope.theme.accent);
        ui.painter().rect_stroke(at, 0, stroke, egui::StrokeKind::Inside);
    }
}

/// Room that a fit leaves in a place: never more than a share of it, or little of the part would be left.
fn margin(at: Rect) -> [f64; 2] {
    let [across, up] = [at.width(), at.height()].map(f64::from);
    [MARGIN[0].min(0.12 * across), MARGIN[1].min(0.13 * up)]
}

/// The axes stand above the plate with the hint.
fn axes_place(at: Rect) -> Rect {
    at.with_max_y(at.bottom() - 46.0)
}

fn camera(ui: &Ui, at: Rect, content: &Arc<PartContent>, view: &mut EngineerView) -> Camera {
    let (size, margin) = (size_of(at), view.view3d.margin);
    if std::mem::take(&mut view.view3d.fit) {
        view.view3d.linked.fit(content, size, margin, ui);
    }
    view.view3d.linked.camera(content, (size, margin), ui)
}

/// A row that was chosen elsewhere comes into sight.
fn fly_to_chosen(ui: &Ui, at: Rect, marks: &[Mark], camera: &Camera, content: &PartContent, view: &mut EngineerView) {
    if view.chosen == view.view3d.shown {
        return;
    }
    view.view3d.shown = view.chosen.clone();
    let Some((list, row)) = view.chosen.only() else { return };
    let Some(mark) = marks.iter().find(|m| (m.list, m.row) == (list, row)) else { return };
    if pointer::is_out_of_sight(&mark.geometry, camera, at, content) {
        let (place, normal) = (mark.geometry.position(), mark.geometry.sheet_normal());
        view.view3d.linked.visit(&place, &normal, content, size_of(at), ui);
    }
}

fn paint_part(ui: &mut Ui, at: Rect, content: &Arc<PartContent>, camera: &Camera, view: &EngineerView, scope: &Scope) {
    let px = f64::from(ui.ctx().pixels_per_point());
    let request = Request {
        part: content.clone(),
        map: None,
        layer: Layer::Cad,
        camera: *camera,
        size_px: [at.width(), at.height()].map(|v| (f64::from(v) * px).round().max(1.0) as u32),
        px_per_point: px,
        scale: Scale { range_mm: 1.0, palette: Palette::default(), bands: 0 },
        tones: tones(scope.theme),
        classes: Classes::VALUES,
        spacing_mm: 1.0,
        moving: view.view3d.linked.is_moving(ui.input(|i| i.time)),
    };
    view.view3d.canvas.paint(ui, at, 0, request);
    if let Some(fault) = view.view3d.canvas.fault() {
        let text = scope.words.fill("results.no_opengl", &[("fault", &fault)]);
        let font = fonts::regular(size::BODY);
        write::block(ui, at.shrink(24.0), Align2::CENTER_CENTER, &text, font, scope.theme.text, 6);
    }
}

/// Draws the plan over the part: what is proposed, markers, names.
fn paint_plan(ui: &mut Ui, target: &Target<'_>, view: &mut EngineerView, scope: &Scope) {
    let Target { camera, at, marks, places, .. } = *target;
    let sight = Sight { camera, at, theme: scope.theme };
    let painter = ui.painter_at(at);
    let mut taken = Taken::default();
    if let Some(hint) = hint::hint_ui(ui, at, view.tool, view.draft.as_ref(), scope.words, scope.theme) {
        taken.add(hint);
    }
    marks::paint(&painter, marks, places, &view.chosen, &sight);
    if let Some(hover) = view.view3d.hover.take() {
        let piece = view.view3d.piece(target.picker, &hover.geometry, piece_mm(&hover.geometry, &sight));
        ghost::paint_hover(&painter, &hover.geometry, &piece, &sight);
    }
    match view.draft.clone() {
        Some(draft) => paint_draft(ui, target, &draft, view, &sight, &mut taken, scope),
        None => paint_chosen(&painter, target, view, &sight, &mut taken),
    }
    marks::names(ui, marks, places, &view.chosen, &sight, &mut taken);
    for (mark, place) in marks.iter().zip(places) {
        let Some(place) = place else { continue };
        let around = Rect::from_center_size(place.pos, vec2(16.0, 16.0));
        write::named(ui, around, &format!("{}, {}", mark.name, scope.words.text(kind_key(mark))));
    }
}

/// How much of an edge is shown on either side of a point, mm.
fn piece_mm(geometry: &Geometry, sight: &Sight<'_>) -> f64 {
    let depth = sight.camera.eye_from_cad(&geometry.position()).z;
    PIECE / sight.camera.px_per_mm(depth, size_of(sight.at)).unwrap_or(1.0)
}

fn paint_draft(
    ui: &mut Ui,
    target: &Target<'_>,
    draft: &Draft,
    view: &mut EngineerView,
    sight: &Sight<'_>,
    taken: &mut Taken,
    scope: &Scope,
) {
    let geometry = &draft.spec.geometry;
    let piece = view.view3d.piece(target.picker, geometry, piece_mm(geometry, sight));
    let inwards = target.picker.points_inwards(geometry);
    let ghost = Ghost { geometry, list: draft.list, piece: &piece, inwards };
    let tips = ghost::paint(&ui.painter_at(sight.at), &ghost, sight, taken);
    let next = || target.document.next_name(draft.list, geometry.kind());
    let name = if draft.spec.name.is_empty() { next() } else { draft.spec.name.clone() };
    ghost::callouts(ui, &ghost, &name, &tips, sight, taken, scope.words);
}

/// The directions of the only row that is chosen; while it is dragged, the edge it is on.
fn paint_chosen(
    painter: &egui::Painter,
    target: &Target<'_>,
    view: &mut EngineerView,
    sight: &Sight<'_>,
    taken: &mut Taken,
) {
    let Some((list, row)) = view.chosen.only() else { return };
    let Some(k) = target.marks.iter().position(|m| (m.list, m.row) == (list, row)) else { return };
    let geometry = &target.marks[k].geometry;
    if matches!(view.view3d.drag, Drag::Row { .. }) {
        let piece = view.view3d.piece(target.picker, geometry, piece_mm(geometry, sight));
        ghost::paint_edge(painter, &piece, sight);
    }
    ghost::paint_chosen(painter, geometry, sight, taken);
    marks::paint(painter, &target.marks[k..=k], &target.places[k..=k], &view.chosen, sight);
}

fn kind_key(mark: &Mark) -> &'static str {
    match mark.geometry.kind() {
        "surface" => "results.surface",
        "edge" => "results.edge",
        "hole" => "results.hole",
        _ => "pick.slot",
    }
}
