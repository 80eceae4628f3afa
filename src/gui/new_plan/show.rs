//! The CAD or a scan in three dimensions, to be looked at only.

use crate::gui::fonts;
use crate::gui::scene::builder::Builder;
use crate::gui::scene::canvas::Canvas;
use crate::gui::scene::content::{MapContent, PartContent, Shown};
use crate::gui::scene::linked::{Linked, size_of};
use crate::gui::scene::overlay::{axes, project};
use crate::gui::scene::renderer::{Classes, Layer, Request};
use crate::gui::scene::standard::standard_ui;
use crate::gui::scene::tones::tones;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words as write};
use crate::part::Part;
use crate::plan::{CadSide, Side};
use crate::report::palette::{Palette, Scale};
use egui::{Align, Align2, Layout, Pos2, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use std::sync::Arc;

/// What is shown.
#[derive(Clone, Copy)]
pub enum What<'a> {
    /// A CAD; with arrows that say on which side of it the sheet lies, once that is chosen.
    Cad(&'a Arc<Part>, Option<CadSide>),
    /// A scan.
    Scan(&'a Arc<MapContent>, f64),
    /// Nothing yet, and why.
    Nothing(&'a str),
}

/// A view with its camera.
#[derive(Default)]
pub struct Show {
    builder: Builder,
    canvas: Canvas,
    cad: Linked,
    scan: Linked,
    /// The scan for which the camera was set.
    scan_of: Option<Arc<MapContent>>,
    cad_of: Option<Arc<Part>>,
}

impl std::fmt::Debug for Show {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Show")
    }
}

const MARGIN: [f64; 2] = [40.0, 40.0];
/// What the buttons for standard views take in the upper right corner.
const BUTTONS: f32 = 320.0;

/// Draws a view into a place.
pub fn show_ui(ui: &mut Ui, at: Rect, what: What<'_>, show: &mut Show, scope: &Scope) {
    let theme = scope.theme;
    cards::card(ui, at, theme);
    let scene = at.shrink(1.0);
    ui.painter().rect_filled(scene, 5, theme.scene);
    let found = match what {
        What::Nothing(why) => Err(why),
        What::Scan(map, spacing_mm) => Ok((map.part.clone(), Some((map.clone(), spacing_mm)))),
        What::Cad(part, _) => match show.builder.part(part, Side::Top, ui.ctx()) {
            Some(content) => Ok((content, None)),
            None => Err(scope.words.text("pick.part_is_made")),
        },
    };
    let (content, map) = match found {
        Ok(found) => found,
        Err(why) => {
            let font = fonts::regular(size::BODY);
            write::block(ui, scene.shrink(24.0), Align2::CENTER_CENTER, why, font, theme.quiet, 4);
            return;
        }
    };
    scene_ui(ui, scene, what, &content, map, show, scope);
}

fn scene_ui(
    ui: &mut Ui,
    at: Rect,
    what: What<'_>,
    content: &Arc<PartContent>,
    map: Option<(Arc<MapContent>, f64)>,
    show: &mut Show,
    scope: &Scope,
) {
    let name = scope.words.text(if map.is_some() { "new_plan.scan_view" } else { "new_plan.cad_view" });
    let response = ui.interact(at, ui.scope_id().with("new plan scene"), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    let same = match &map {
        Some((map, _)) => show.scan_of.replace(map.clone()).is_some_and(|of| Arc::ptr_eq(&of, map)),
        None => show.cad_of.replace(content.part.clone()).is_some_and(|of| Arc::ptr_eq(&of, &content.part)),
    };
    let number = usize::from(map.is_some());
    let linked = if map.is_some() { &mut show.scan } else { &mut show.cad };
    if !same {
        *linked = Linked::default();
    }
    let size = size_of(at);
    linked.pointer(ui, &response, at, content);
    if scope.letters_are_free(ui) && response.has_focus() {
        linked.keys(ui, at, content, MARGIN);
    }
    let camera = linked.camera(content, (size, MARGIN), ui);
    let px = f64::from(ui.ctx().pixels_per_point());
    let belt = Classes::VALUES.with(Shown::Flagged, true).with(Shown::Belt, true).with(Shown::Stray, true);
    let request = Request {
        part: content.clone(),
        map: map.as_ref().map(|(map, _)| map.clone()),
        layer: if map.is_some() { Layer::Cloud } else { Layer::Cad },
        camera,
        size_px: [at.width(), at.height()].map(|v| (f64::from(v) * px).round().max(1.0) as u32),
        px_per_point: px,
        scale: Scale { range_mm: 1.0, palette: Palette::default(), bands: 0 },
        tones: tones(scope.theme),
        classes: belt.with(Shown::Colour, true).with(Shown::Other, true),
        spacing_mm: map.as_ref().map_or(1.0, |(_, spacing)| *spacing),
        moving: linked.is_moving(ui.input(|i| i.time)),
    };
    show.canvas.paint(ui, at, number, request);
    if let Some(fault) = show.canvas.fault() {
        let text = scope.words.fill("results.no_opengl", &[("fault", &fault)]);
        let font = fonts::regular(size::BODY);
        write::block(ui, at.shrink(24.0), Align2::CENTER_CENTER, &text, font, scope.theme.text, 6);
    }
    if let What::Cad(_, Some(side)) = what {
        let to_window = |p: &crate::geometry::Point3| project(&camera, p, at, size);
        let towards = camera.towards();
        material(ui, at, content, side, &to_window, &towards, scope);
    }
    axes(&ui.painter_at(at), &camera, at, scope.theme);
    let bar = Rect::from_min_max(pos2(at.right() - BUTTONS, at.top() + 6.0), pos2(at.right() - 8.0, at.top() + 40.0));
    let builder = egui::UiBuilder::new().max_rect(bar).layout(Layout::right_to_left(Align::Center));
    ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        standard_ui(ui, linked, scope.words);
    });
}

/// Arrows from the CAD's surface into the sheet's material, at places that are seen.
fn material(
    ui: &Ui,
    at: Rect,
    content: &PartContent,
    side: CadSide,
    to_window: &dyn Fn(&crate::geometry::Point3) -> Option<Pos2>,
    towards: &crate::geometry::Vector3,
    scope: &Scope,
) {
    let mesh = &content.part.mesh;
    let length_mm = 0.06 * content.part.diagonal_mm();
    let (into, out) = match side {
        CadSide::Top => (-1.0, 0.0),
        CadSide::Bottom => (1.0, 0.0),
        CadSide::Middle => (0.5, -0.5),
        CadSide::Solid => return,
    };
    let painter = ui.painter_at(at);
    let step = (mesh.triangles.len() / 24).max(1);
    for t in (step / 2..mesh.triangles.len()).step_by(step) {
        let Some(normal) = mesh.normal(t) else { continue };
        // Faces on edge to the eye say nothing.
        if normal.dot(towards).abs() < 0.15 {
            continue;
        }
        let [a, b, c] = mesh.corners(t).map(|p| p.coords);
        let middle = crate::geometry::Point3::from((a + b + c) / 3.0);
        let end = |share: f64| to_window(&(middle + normal.into_inner() * (share * length_mm)));
        if let (Some(from), Some(to)) = (end(out), end(into)) {
            painter.line_segment([from, to], Stroke::new(4.0, scope.theme.panel));
            painter.arrow(from, to - from, Stroke::new(2.0, scope.theme.accent));
        }
    }
    let text = scope.words.text("new_plan.arrows");
    let wide = write::width(ui, text, fonts::regular(size::TABLE)) + 20.0;
    // Below the buttons where both have no room beside each other.
    let down = if wide + 20.0 + BUTTONS > at.width() { 46.0 } else { 10.0 };
    let plate = Rect::from_min_size(at.left_top() + vec2(10.0, down), vec2(wide.min(at.width() - 20.0), 26.0));
    painter.rect(plate, 4, scope.theme.panel, Stroke::new(1.0, scope.theme.stroke), egui::StrokeKind::Inside);
    painter.text(plate.center(), Align2::CENTER_CENTER, text, fonts::regular(size::TABLE), scope.theme.text);
}
