//! What is computed for the screen away from the window's thread: the views read, what masks leave, the study. Nothing is written.

use super::facts::{Merging, StudyState, ViewsState};
use crate::diagnostic::Diagnostic;
use crate::gui::app::App;
use crate::gui::scene::builder::{Pending, pending};
use crate::plan::merge::{Mask, MergePlan};
use crate::run::{Cancelled, RunContext};
use crate::stitch::StitchError;
use crate::stitch::mask_study::MaskStudy;
use crate::stitch::mask_worth::{Worth, worth};
use crate::worker::merge::{MergeEvent, Preview, preview, study_preview};
use std::sync::mpsc::TryRecvError;
use std::sync::{Arc, Mutex};

type Told<T> = Arc<Mutex<Option<T>>>;
type Answer<T> = Result<T, Diagnostic>;

/// Computations under way. Dropping it gives them up.
#[derive(Default)]
pub(in crate::gui) struct Desk {
    reading: Option<Pending<(), Answer<Preview>>>,
    read: Told<(usize, usize, String)>,
    worth: Option<Pending<u64, Worth>>,
    unmasked: Option<Pending<(), Worth>>,
    study: Option<Pending<usize, Answer<MaskStudy>>>,
    studied: Told<(usize, usize)>,
}

/// What a computation says that ended without an answer.
fn lost() -> Diagnostic {
    Diagnostic::error("an internal fault: a computation ended without an answer")
        .with_help("this is a fault of the program, not of your files; please send this message to the maintainers")
}

fn told(error: StitchError) -> Option<Diagnostic> {
    match error {
        StitchError::Fault(fault) | StitchError::CutOff(fault) => Some(*fault),
        StitchError::Cancelled(_) => None,
    }
}

impl Desk {
    /// Begins to read the views.
    pub fn read(&mut self, ctx: &egui::Context, plan: &Arc<MergePlan>) {
        let (plan, read, wake) = (plan.clone(), Told::default(), ctx.clone());
        *self = Self { read: read.clone(), ..Self::default() };
        self.reading = pending((), ctx, move |run| {
            let tell = |event| {
                if let (MergeEvent::View { index, of, name }, Ok(mut read)) = (event, read.lock()) {
                    *read = Some((index, of, name));
                    wake.request_repaint();
                }
            };
            match preview(&plan, run, &tell) {
                Ok(preview) => Some(Ok(preview)),
                Err(error) => told(error).map(Err),
            }
        });
    }

    fn gauge(&mut self, ctx: &egui::Context, preview: &Arc<Preview>, masks: Vec<Mask>, version: u64) {
        let preview = preview.clone();
        self.worth = pending(version, ctx, move |run| gauged(&preview, &masks, run).ok());
    }

    fn gauge_unmasked(&mut self, ctx: &egui::Context, preview: &Arc<Preview>) {
        let preview = preview.clone();
        self.unmasked = pending((), ctx, move |run| gauged(&preview, &[], run).ok());
    }

    fn study(&mut self, ctx: &egui::Context, plan: &Arc<MergePlan>, preview: &Arc<Preview>) {
        let (plan, preview, wake) = (plan.clone(), preview.clone(), ctx.clone());
        let studied = Told::default();
        self.studied = studied.clone();
        let every = preview.study_every();
        self.study = pending(every, ctx, move |run| {
            let tell = |done, of| {
                if let Ok(mut studied) = studied.lock() {
                    *studied = Some((done, of));
                    wake.request_repaint();
                }
            };
            // A thread of its own, so that sliders answer meanwhile.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
            match pool.install(|| study_preview(&plan, &preview, run, &tell)) {
                Ok(study) => Some(Ok(study)),
                Err(error) => told(error).map(Err),
            }
        });
    }
}

fn gauged(preview: &Preview, masks: &[Mask], run: &RunContext) -> Result<Worth, Cancelled> {
    worth(&preview.views, &preview.shapes, masks, run)
}

/// Takes a computation's answer; `None` while there is none. One that ended without an answer gives the error.
fn taken<K: Clone, V>(slot: &mut Option<Pending<K, V>>) -> Option<(K, Option<V>)> {
    let pending = slot.as_ref()?;
    let answer = match pending.answer() {
        Ok(answer) => Some(answer),
        Err(TryRecvError::Disconnected) => None,
        Err(TryRecvError::Empty) => return None,
    };
    let key = pending.key.clone();
    *slot = None;
    Some((key, answer))
}

/// Hears what was computed and begins what is missing. Never waits.
pub(in crate::gui) fn tick(app: &mut App, ctx: &egui::Context) {
    let (Some(merging), desk) = (&mut app.facts.merging, &mut app.merge_desk) else { return };
    hear_views(merging, desk, ctx);
    if let Some(((), worth)) = taken(&mut desk.unmasked) {
        merging.unmasked = worth.map(Arc::new);
    }
    if let Some((version, Some(worth))) = taken(&mut desk.worth) {
        merging.worth = Some((version, Arc::new(worth)));
    }
    if let Some((every, study)) = taken(&mut desk.study) {
        merging.study = match study.unwrap_or_else(|| Err(lost())) {
            Ok(study) => StudyState::Done(Arc::new(study), every),
            Err(fault) => StudyState::Failed(fault),
        };
    } else if let (StudyState::Running(..), Ok(mut studied)) = (&merging.study, desk.studied.lock())
        && let Some((done, of)) = studied.take()
    {
        merging.study = StudyState::Running(done, of);
    }
    // What is computed is not given up for what came after it: figures follow a slider that goes on moving.
    let known = merging.worth.as_ref().map(|(version, _)| *version);
    if let (Some(preview), None, true) = (merging.preview().cloned(), &desk.worth, known != Some(merging.version)) {
        desk.gauge(ctx, &preview, merging.masks.clone(), merging.version);
    }
}

fn hear_views(merging: &mut Merging, desk: &mut Desk, ctx: &egui::Context) {
    if let Some(((), views)) = taken(&mut desk.reading) {
        merging.views = match views.unwrap_or_else(|| Err(lost())) {
            Ok(preview) => ViewsState::Ready(Arc::new(preview)),
            Err(fault) => ViewsState::Failed(fault),
        };
        if let (Some(plan), Some(preview)) = (merging.plan.clone(), merging.preview().cloned()) {
            desk.gauge_unmasked(ctx, &preview);
            if !plan.features.is_empty() && !preview.views.is_empty() {
                merging.study = StudyState::Running(0, 0);
                desk.study(ctx, &plan, &preview);
            }
        }
    } else if let (ViewsState::Reading(at), Ok(mut read)) = (&mut merging.views, desk.read.lock())
        && let Some(now) = read.take()
    {
        *at = Some(now);
    }
}
