//! The deviation map of a part as a picture, drawn by the processor like the report's, on a thread of its own.
//!
//! Only the newest wish counts: a part that was overtaken is not drawn.

use super::facts::FinishedPart;
use crate::inspect::Outcome;
use crate::report::palette::Palette;
use crate::report::raster::{MapInput, MapPicture, MapStyle, draw};
use crate::run::RunContext;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// What is to be drawn: the part and the most pixels.
#[derive(Clone)]
struct Wish {
    part: Arc<FinishedPart>,
    size_px: [usize; 2],
}

impl Wish {
    fn is_for(&self, part: &Arc<FinishedPart>, size_px: [usize; 2]) -> bool {
        Arc::ptr_eq(&self.part, part) && self.size_px == size_px
    }
}

/// The thread that draws, and what it drew last.
pub struct Painter {
    wishes: Option<Sender<Wish>>,
    pictures: Receiver<(Wish, Option<MapPicture>)>,
    asked: Option<Wish>,
    shown: Option<Shown>,
}

/// A picture that can be shown.
pub struct Shown {
    wish: Wish,
    /// The pixels, and the way from CAD coordinates to them.
    pub picture: MapPicture,
    /// The same for egui.
    pub texture: egui::TextureHandle,
}

impl Painter {
    /// Starts the thread; it ends when this is dropped. The error: the system gives none, and there are no pictures.
    pub fn start(ctx: &egui::Context) -> Self {
        let (wishes, to_do) = channel::<Wish>();
        let (done, pictures) = channel();
        let ctx = ctx.clone();
        let work = move || {
            while let Ok(mut wish) = to_do.recv() {
                while let Ok(newer) = to_do.try_recv() {
                    wish = newer;
                }
                // A fault in a picture leaves its card empty.
                let picture = catch_unwind(AssertUnwindSafe(|| map(&wish.part, wish.size_px))).unwrap_or_default();
                if done.send((wish, picture)).is_err() {
                    return;
                }
                ctx.request_repaint();
            }
        };
        let started = std::thread::Builder::new().name("pictures".into()).spawn(work);
        Self { wishes: started.is_ok().then_some(wishes), pictures, asked: None, shown: None }
    }

    /// The picture of a part; `None` while it is being drawn, and where there is nothing to draw.
    pub fn of(&mut self, ctx: &egui::Context, part: &Arc<FinishedPart>, size_px: [usize; 2]) -> Option<&Shown> {
        for (wish, picture) in self.pictures.try_iter() {
            self.shown = picture.map(|picture| {
                let texture = ctx.load_texture("map", image_of(&picture), egui::TextureOptions::LINEAR);
                Shown { wish, picture, texture }
            });
        }
        if !self.asked.as_ref().is_some_and(|wish| wish.is_for(part, size_px)) {
            let wish = Wish { part: part.clone(), size_px };
            self.asked = Some(wish.clone());
            if let Some(wishes) = &self.wishes {
                // The thread ends only when this sender is gone.
                let _ = wishes.send(wish);
            }
        }
        // A picture of another size is of use until the new one comes; one of another part never.
        self.shown.as_ref().filter(|shown| Arc::ptr_eq(&shown.wish.part, part))
    }
}

/// White is what surrounds the part, and no colour of the map: it is let through, so that the picture suits both themes.
fn image_of(picture: &MapPicture) -> egui::ColorImage {
    let pixels = picture.pixels.chunks_exact(3).map(|rgb| match rgb {
        [255, 255, 255] => egui::Color32::TRANSPARENT,
        rgb => egui::Color32::from_rgb(rgb[0], rgb[1], rgb[2]),
    });
    egui::ColorImage::new([picture.width_px, picture.height_px], pixels.collect())
}

fn map(part: &FinishedPart, [width, height]: [usize; 2]) -> Option<MapPicture> {
    let (Outcome::Measured(inspection), Some(scan)) = (&part.result.outcome, &part.scan) else { return None };
    let (points, deviations) = inspection.map_in_cad(&scan.cloud.positions);
    let face = &part.part.face(inspection.best_fit.face).mesh;
    let input = MapInput { face, points: &points, deviations_mm: &deviations, spacing_mm: scan.spacing_mm };
    let style = MapStyle {
        range_mm: part.result.map_range_mm,
        palette: Palette::default(),
        max_width_px: width,
        max_height_px: height,
        line_px: 1,
    };
    draw(&input, &style, &RunContext::silent()).ok().flatten()
}
