//! A place in the window in which a scene is drawn.

use super::gl::GlRenderer;
use super::renderer::{CloudRequest, Placement, Progress, Request, SceneRenderer};
use eframe::egui_glow::{CallbackFn, Painter};
use egui::{PaintCallback, PaintCallbackInfo, Rect, Ui};
use std::sync::{Arc, Mutex};

/// The renderer, made when it is first asked to draw; all views of a window share it.
#[derive(Clone, Default)]
pub struct Canvas {
    shared: Arc<Mutex<Shared>>,
}

#[derive(Default)]
struct Shared {
    renderer: Option<Box<dyn SceneRenderer>>,
    fault: Option<String>,
    /// Of each view, whether its picture is whole.
    whole: Vec<bool>,
}

impl std::fmt::Debug for Canvas {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Canvas")
    }
}

impl Canvas {
    /// Why nothing can be drawn, if it cannot.
    pub fn fault(&self) -> Option<String> {
        self.shared.lock().ok().and_then(|shared| shared.fault.clone())
    }

    /// Whether all views that were drawn are whole.
    pub fn is_whole(&self) -> bool {
        self.shared.lock().is_ok_and(|shared| !shared.whole.is_empty() && shared.whole.iter().all(|w| *w))
    }

    /// Has a view drawn at a place. Until it is whole, the window is repainted.
    pub fn paint(&self, ui: &Ui, place: Rect, view: usize, request: Request) {
        self.paint_wanted(ui, place, view, Wanted::Part(Box::new(request)));
    }

    /// The same of a cloud without a CAD.
    pub fn paint_cloud(&self, ui: &Ui, place: Rect, view: usize, request: CloudRequest) {
        self.paint_wanted(ui, place, view, Wanted::Cloud(Box::new(request)));
    }

    fn paint_wanted(&self, ui: &Ui, place: Rect, view: usize, request: Wanted) {
        let shared = self.shared.clone();
        let ctx = ui.ctx().clone();
        let callback = CallbackFn::new(move |info: PaintCallbackInfo, painter: &Painter| {
            let Ok(mut shared) = shared.lock() else { return };
            match shared.paint(view, &request, &info, painter) {
                Ok(Progress::Done) => {}
                Ok(Progress::More) => ctx.request_repaint(),
                Err(fault) => shared.fault = Some(fault),
            }
        });
        ui.painter().add(PaintCallback { rect: place, callback: Arc::new(callback) });
    }
}

/// What a view is to show.
enum Wanted {
    Part(Box<Request>),
    Cloud(Box<CloudRequest>),
}

impl Wanted {
    fn draw(&self, renderer: &mut dyn SceneRenderer, view: usize) -> Result<Progress, String> {
        match self {
            Wanted::Part(request) => renderer.draw(view, request),
            Wanted::Cloud(request) => renderer.draw_cloud(view, request),
        }
    }

    fn is_moving(&self) -> bool {
        match self {
            Wanted::Part(request) => request.moving,
            Wanted::Cloud(request) => request.moving,
        }
    }
}

impl Shared {
    fn paint(
        &mut self,
        view: usize,
        request: &Wanted,
        info: &PaintCallbackInfo,
        painter: &Painter,
    ) -> Result<Progress, String> {
        if self.fault.is_some() {
            return Ok(Progress::Done);
        }
        let renderer = match &mut self.renderer {
            Some(renderer) => renderer,
            none => none.insert(Box::new(GlRenderer::new(painter.gl().clone())?)),
        };
        let progress = request.draw(renderer.as_mut(), view)?;
        if self.whole.len() <= view {
            self.whole.resize(view + 1, true);
        }
        self.whole[view] = progress == Progress::Done && !request.is_moving();
        let (all, clip) = (info.viewport_in_pixels(), info.clip_rect_in_pixels());
        let at = Placement {
            window: info.screen_size_px,
            view: [all.left_px, all.from_bottom_px, all.width_px, all.height_px],
            clip: [clip.left_px, clip.from_bottom_px, clip.width_px, clip.height_px],
        };
        renderer.show(view, at)?;
        Ok(progress)
    }
}
