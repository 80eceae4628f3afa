//! Files are looked at on a thread of their own; whoever chooses another one gives the look up.

use crate::diagnostic::ReadError;
use crate::geometry::LengthUnit;
use crate::gui::later::Later;
use crate::gui::scene::content::MapContent;
use crate::part::Part;
use crate::run::{CancelToken, RunContext, Stage};
use crate::worker::first_look::{CadLook, ScanLook, look_at_cad, look_at_scan};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// What came of a look; a fault in words.
#[derive(Debug)]
pub enum Looked {
    /// A CAD.
    Cad(Result<CadLook, String>),
    /// A scan, and how it is drawn.
    Scan(Result<(ScanLook, Option<Arc<MapContent>>), String>),
    /// It was given up.
    Cancelled,
    /// It ended in a fault of the program.
    Lost,
}

/// A look under way. Dropped, it is given up.
#[derive(Debug, Default)]
pub struct Looking {
    work: Later<Looked>,
    stop: CancelToken,
    stage: Arc<Mutex<Option<Stage>>>,
    since: Option<Instant>,
}

impl Drop for Looking {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

impl Looking {
    /// Looks at a CAD.
    pub fn at_cad(&mut self, ctx: &egui::Context, path: PathBuf, unit: Option<LengthUnit>) {
        self.start(ctx, move |run| match look_at_cad(&path, unit, run) {
            Ok(look) => Looked::Cad(Ok(look)),
            Err(ReadError::Cancelled(_)) => Looked::Cancelled,
            Err(fault) => Looked::Cad(Err(words(fault))),
        });
    }

    /// Looks at a scan of a part.
    pub fn at_scan(&mut self, ctx: &egui::Context, path: PathBuf, unit: Option<LengthUnit>, part: Arc<Part>) {
        self.start(ctx, move |run| match look_at_scan(&path, unit, &part, run) {
            Ok(look) => {
                let cloud = MapContent::of_scan(&look.scan, run).map(Arc::new);
                Looked::Scan(Ok((look, cloud)))
            }
            Err(ReadError::Cancelled(_)) => Looked::Cancelled,
            Err(fault) => Looked::Scan(Err(words(fault))),
        });
    }

    fn start(&mut self, ctx: &egui::Context, look: impl FnOnce(&RunContext) -> Looked + Send + 'static) {
        self.cancel();
        self.stop = CancelToken::default();
        self.stage = Arc::default();
        self.since = Some(Instant::now());
        let (stop, stage, waker) = (self.stop.clone(), self.stage.clone(), ctx.clone());
        self.work.start(ctx, move || {
            let observe = |now| {
                if let Ok(mut stage) = stage.lock() {
                    *stage = Some(now);
                }
                waker.request_repaint();
            };
            look(&RunContext::new(&stop, &observe))
        });
    }

    /// Gives up.
    pub fn cancel(&mut self) {
        self.stop.cancel();
        self.work = Later::default();
        self.since = None;
    }

    /// Whether something is looked at.
    pub fn is_busy(&self) -> bool {
        self.work.is_busy()
    }

    /// The stage, and how long it has been looked at.
    pub fn progress(&self) -> (Option<Stage>, Duration) {
        let stage = self.stage.lock().ok().and_then(|stage| *stage);
        (stage, self.since.map_or(Duration::ZERO, |since| since.elapsed()))
    }

    /// What came of it, once.
    pub fn poll(&mut self) -> Option<Looked> {
        match self.work.poll()? {
            Ok(looked) => Some(looked),
            Err(_) => Some(Looked::Lost),
        }
    }
}

fn words(fault: ReadError) -> String {
    match fault {
        ReadError::Bad(told) | ReadError::CutOff(told) => told.in_a_row(),
        ReadError::Cancelled(cancelled) => cancelled.to_string(),
    }
}
