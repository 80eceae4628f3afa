//! The camera that linked views share, and what pointer and keys do to it.

use super::camera::{Camera, Flight, Projection, StandardView, ViewSize};
use super::content::PartContent;
use super::pick;
use crate::geometry::{Point3, Vector3};
use egui::{Key, Modifiers, PointerButton, Pos2, Rect, Response, Ui};

/// The picture is still when nothing has moved for this long, seconds.
const STILL_AFTER_S: f64 = 0.12;
/// Room that a fit leaves for flags, points of the window.
pub const FLAG_MARGIN: [f64; 2] = [134.0, 30.0];

/// What a camera is pointed at.
pub trait Subject {
    /// About which it turns.
    fn centre(&self) -> Point3;
    /// Towards who looks at it from above.
    fn facing(&self) -> Vector3;
    /// Corners of its hull, for fitting.
    fn corners(&self) -> &[Point3];
    /// From one end to the other.
    fn diagonal(&self) -> f64;
    /// What is seen in a pixel of a view.
    fn under(&self, camera: &Camera, pixel: [f64; 2], size: ViewSize) -> Option<Point3>;
    /// Whether it hides a place of its own.
    fn hides(&self, camera: &Camera, place: &Point3, size: ViewSize) -> bool;
}

impl Subject for PartContent {
    fn centre(&self) -> Point3 {
        self.centre
    }

    fn facing(&self) -> Vector3 {
        self.facing
    }

    fn corners(&self) -> &[Point3] {
        &self.corners
    }

    fn diagonal(&self) -> f64 {
        self.part.diagonal_mm()
    }

    fn under(&self, camera: &Camera, pixel: [f64; 2], size: ViewSize) -> Option<Point3> {
        let face = self.part.face(self.face);
        pick::surface(&face.mesh, &face.bvh, camera, pixel, size).map(|p| p.place)
    }

    fn hides(&self, camera: &Camera, place: &Point3, size: ViewSize) -> bool {
        pick::is_hidden(&self.part.face(self.face).bvh, camera, place, size)
    }
}

impl<S: Subject> Subject for std::sync::Arc<S> {
    fn centre(&self) -> Point3 {
        (**self).centre()
    }

    fn facing(&self) -> Vector3 {
        (**self).facing()
    }

    fn corners(&self) -> &[Point3] {
        (**self).corners()
    }

    fn diagonal(&self) -> f64 {
        (**self).diagonal()
    }

    fn under(&self, camera: &Camera, pixel: [f64; 2], size: ViewSize) -> Option<Point3> {
        (**self).under(camera, pixel, size)
    }

    fn hides(&self, camera: &Camera, place: &Point3, size: ViewSize) -> bool {
        (**self).hides(camera, place, size)
    }
}

/// A camera of one or more views.
#[derive(Debug, Clone, Default)]
pub struct Linked {
    camera: Option<Camera>,
    flight: Option<Flight>,
    moved_s: Option<f64>,
    /// The place that was under the pointer when a drag began.
    grabbed: Option<Point3>,
    /// A view to be fitted as soon as the size of its place is known.
    wanted: Option<StandardView>,
    /// The size and margin to which the whole part was fitted, until somebody looks at something else.
    fitted: Option<(ViewSize, [f64; 2])>,
}

impl Linked {
    /// Turns about the middle of the part, as a pointer that moves so many points to the right would.
    pub fn turn(&mut self, right: f64, content: &impl Subject, size: ViewSize, ui: &Ui) {
        let Some(before) = self.camera else { return };
        let mut camera = before;
        camera.orbit(right, 0.25 * right, &content.centre(), size);
        self.moved(before, camera, ui);
    }

    /// Where the camera is; `None` before the first frame.
    pub fn now(&self) -> Option<Camera> {
        self.camera
    }

    /// How depth is shown.
    pub fn projection(&self) -> Projection {
        self.camera.map_or(Projection::default(), |c| c.projection)
    }

    /// Whether the picture changes by itself or has just been moved.
    pub fn is_moving(&self, now_s: f64) -> bool {
        self.flight.is_some() || self.moved_s.is_some_and(|at| now_s - at < STILL_AFTER_S)
    }

    /// The camera now; at first fitted to the part in a view of a size with a margin. Asks for the frames that a flight needs.
    pub fn camera(&mut self, content: &impl Subject, fit: (ViewSize, [f64; 2]), ui: &Ui) -> Camera {
        let (size, margin) = fit;
        let now_s = ui.input(|i| i.time);
        if let Some(view) = self.wanted.take() {
            let to = self.standard(view, content, size, margin);
            self.fly(to, ui);
            self.fitted = Some(fit);
        }
        let mut camera = match self.end() {
            // The part stays whole when its place becomes another one.
            Some(mut camera) if self.fitted.is_some_and(|before| before != fit) => {
                camera.fit(content.corners(), size, margin);
                (self.flight, self.fitted) = (None, Some(fit));
                camera
            }
            Some(_) => self.camera.unwrap_or_else(|| self.standard(StandardView::Isometric, content, size, margin)),
            None => {
                self.fitted = Some(fit);
                self.standard(StandardView::Isometric, content, size, margin)
            }
        };
        if let Some(flight) = self.flight {
            let arrived;
            (camera, arrived) = flight.at(now_s);
            self.moved_s = Some(now_s);
            if arrived {
                self.flight = None;
            }
            ui.ctx().request_repaint();
        }
        if self.is_moving(now_s) {
            ui.ctx().request_repaint_after_secs((STILL_AFTER_S + 0.01) as f32);
        }
        self.camera = Some(camera);
        camera
    }

    fn standard(&self, view: StandardView, content: &impl Subject, size: ViewSize, margin: [f64; 2]) -> Camera {
        let projection = self.camera.map_or(Projection::default(), |c| c.projection);
        let target = content.centre();
        let cad_from_eye = view.cad_from_eye(&content.facing());
        let mut camera = Camera { target, cad_from_eye, height_mm: content.diagonal().max(1.0), projection };
        camera.fit(content.corners(), size, margin);
        camera
    }

    /// Flies to a camera; at once where the system asks for less motion.
    pub fn fly(&mut self, to: Camera, ui: &Ui) {
        let now_s = ui.input(|i| i.time);
        self.moved_s = Some(now_s);
        match self.camera {
            Some(from) if ui.style().animation_time > 0.0 => self.flight = Some(Flight::new(from, to, now_s)),
            _ => self.camera = Some(to),
        }
        ui.ctx().request_repaint();
    }

    /// One of the standard views, fitted.
    pub fn show(&mut self, view: StandardView) {
        self.wanted = Some(view);
    }

    /// The whole part from where it is seen now.
    pub fn fit(&mut self, content: &impl Subject, size: ViewSize, margin: [f64; 2], ui: &Ui) {
        let Some(mut camera) = self.end() else { return };
        camera.fit(content.corners(), size, margin);
        self.fly(camera, ui);
        self.fitted = Some((size, margin));
    }

    /// Perspective becomes parallel and the other way round.
    pub fn toggle_projection(&mut self, ui: &Ui) {
        if let Some(camera) = &mut self.camera {
            camera.projection = match camera.projection {
                Projection::Perspective => Projection::Parallel,
                Projection::Parallel => Projection::Perspective,
            };
            self.flight = None;
            self.moved_s = Some(ui.input(|i| i.time));
        }
    }

    /// Where the camera is, or will be when it has arrived.
    fn end(&self) -> Option<Camera> {
        self.flight.map(|f| f.end()).or(self.camera)
    }

    /// Flies to a place of the part, near enough to look at it.
    pub fn visit(&mut self, place: &Point3, normal: &Vector3, content: &impl Subject, size: ViewSize, ui: &Ui) {
        let Some(camera) = self.end() else { return };
        let hidden = content.hides(&camera, place, size);
        let near = (0.45 * content.diagonal()).max(1.0);
        let to = camera.facing(place, normal, camera.height_mm.min(near), hidden);
        self.fly(to, ui);
        self.fitted = None;
    }

    /// Drags and the wheel over one view.
    pub fn pointer(&mut self, ui: &Ui, response: &Response, place: Rect, content: &impl Subject) {
        let size = size_of(place);
        let Some(mut camera) = self.camera else { return };
        let before = camera;
        let at = |pos: Pos2| [f64::from(pos.x - place.left()), f64::from(pos.y - place.top())];
        let under = |camera: &Camera, pos: Pos2| content.under(camera, at(pos), size);
        if response.drag_started() {
            self.grabbed = response.interact_pointer_pos().and_then(|pos| under(&camera, pos));
        }
        let moved = response.drag_delta();
        let (right, down) = (f64::from(moved.x), f64::from(moved.y));
        let shift = ui.input(|i| i.modifiers.shift);
        if response.dragged() && moved != egui::Vec2::ZERO {
            self.flight = None;
            if response.dragged_by(PointerButton::Primary) && !shift {
                let pivot = self.grabbed.unwrap_or(content.centre());
                camera.orbit(right, down, &pivot, size);
            } else {
                let grabbed = self.grabbed.unwrap_or(camera.target);
                camera.pan(right, down, &grabbed, size);
            }
        }
        if let Some(pos) = response.hover_pos() {
            let (wheel, pinch) = ui.input(|i| (f64::from(i.smooth_scroll_delta().y), f64::from(i.zoom_delta())));
            let factor = (-wheel * 0.0022).exp() / if pinch > 0.0 { pinch } else { 1.0 };
            if factor != 1.0 {
                self.flight = None;
                let anchor = under(&camera, pos).unwrap_or_else(|| camera.on_target_plane(at(pos), size));
                camera.zoom(factor, &anchor);
            }
        }
        self.moved(before, camera, ui);
    }

    fn moved(&mut self, before: Camera, after: Camera, ui: &Ui) {
        if before != after {
            self.fitted = None;
            self.camera = Some(after);
            self.moved_s = Some(ui.input(|i| i.time));
            ui.ctx().request_repaint();
        }
    }

    /// Keys of the views, while no field has the focus.
    pub fn keys(&mut self, ui: &Ui, place: Rect, content: &impl Subject, margin: [f64; 2]) {
        let size = size_of(place);
        let pressed = |modifiers: Modifiers, key: Key| ui.input_mut(|i| i.consume_key(modifiers, key));
        let numbers = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num0];
        for (key, view) in numbers.into_iter().zip(StandardView::ALL) {
            if pressed(Modifiers::NONE, key) {
                self.show(view);
            }
        }
        if pressed(Modifiers::NONE, Key::F) {
            self.fit(content, size, margin, ui);
        }
        if pressed(Modifiers::NONE, Key::P) {
            self.toggle_projection(ui);
        }
        let Some(mut camera) = self.camera else { return };
        let before = camera;
        let step = 0.06 * size.height;
        let arrows = [
            (Key::ArrowLeft, -1.0, 0.0),
            (Key::ArrowRight, 1.0, 0.0),
            (Key::ArrowUp, 0.0, -1.0),
            (Key::ArrowDown, 0.0, 1.0),
        ];
        for (key, right, down) in arrows {
            let target = camera.target;
            if pressed(Modifiers::SHIFT, key) {
                camera.pan(right * step, down * step, &target, size);
            } else if pressed(Modifiers::NONE, key) {
                camera.orbit(right * step, down * step, &content.centre(), size);
            }
        }
        let target = camera.target;
        if pressed(Modifiers::NONE, Key::Plus) || pressed(Modifiers::NONE, Key::Equals) {
            camera.zoom(0.8, &target);
        }
        if pressed(Modifiers::NONE, Key::Minus) {
            camera.zoom(1.25, &target);
        }
        if before != camera {
            self.flight = None;
        }
        self.moved(before, camera, ui);
    }
}

/// The size of a view's place in points of the window.
pub fn size_of(place: Rect) -> ViewSize {
    ViewSize { width: f64::from(place.width().max(1.0)), height: f64::from(place.height().max(1.0)) }
}
