//! Computes what a scene shows on threads of its own, so that the window never waits; keeps the last few parts and results.

use super::content::{MapContent, PartContent};
use crate::inspect::{InspectionResult, Outcome};
use crate::part::Part;
use crate::plan::Side;
use crate::run::{CancelToken, RunContext};
use crate::scan::ConditionedScan;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Results that are kept ready: the one looked at and those that somebody compares it with.
const KEPT_MAPS: usize = 4;
/// Parts that are kept ready: both sides of one.
const KEPT_PARTS: usize = 2;

/// A computation under way. Dropping it gives it up.
pub(in crate::gui) struct Pending<K, V> {
    /// What is computed.
    pub key: K,
    stop: CancelToken,
    answer: Receiver<V>,
}

impl<K, V> Pending<K, V> {
    /// What came of it, or that it is still under way, or that it was given up.
    pub fn answer(&self) -> Result<V, TryRecvError> {
        self.answer.try_recv()
    }
}

impl<K, V> Drop for Pending<K, V> {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

type PartKey = (Arc<Part>, Side);

/// Makes scenes. One for a window.
#[derive(Default)]
pub struct Builder {
    parts: Vec<(PartKey, Arc<PartContent>)>,
    maps: Vec<(Arc<InspectionResult>, Arc<MapContent>)>,
    part_pending: Option<Pending<PartKey, Arc<PartContent>>>,
    map_pending: Option<Pending<Arc<InspectionResult>, Option<Arc<MapContent>>>>,
}

impl std::fmt::Debug for Builder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Builder with {} parts and {} maps", self.parts.len(), self.maps.len())
    }
}

impl Builder {
    /// The part as it is drawn when seen from a side; `None` while it is being made. `wake` is called when it is there.
    pub fn part(&mut self, part: &Arc<Part>, side: Side, wake: &egui::Context) -> Option<Arc<PartContent>> {
        if let Some(pending) = &self.part_pending {
            match pending.answer() {
                Ok(content) => {
                    keep(&mut self.parts, (pending.key.clone(), content), KEPT_PARTS);
                    self.part_pending = None;
                }
                Err(TryRecvError::Disconnected) => self.part_pending = None,
                Err(TryRecvError::Empty) => {}
            }
        }
        let is_mine = |key: &PartKey| Arc::ptr_eq(&key.0, part) && key.1 == side;
        if let Some((_, content)) = self.parts.iter().find(|(key, _)| is_mine(key)) {
            return Some(content.clone());
        }
        if !self.part_pending.as_ref().is_some_and(|p| is_mine(&p.key)) {
            let of = part.clone();
            self.part_pending =
                pending((part.clone(), side), wake, move |_| Some(Arc::new(PartContent::of(&of, side))));
        }
        None
    }

    /// A result over its part; `None` while it is being made, and for a result whose points were let go.
    pub fn map(
        &mut self,
        part: &Arc<PartContent>,
        result: &Arc<InspectionResult>,
        scan: &Arc<ConditionedScan>,
        wake: &egui::Context,
    ) -> Option<Arc<MapContent>> {
        if let Some(pending) = &self.map_pending {
            match pending.answer() {
                Ok(Some(content)) => {
                    keep(&mut self.maps, (pending.key.clone(), content), KEPT_MAPS);
                    self.map_pending = None;
                }
                Ok(None) | Err(TryRecvError::Disconnected) => self.map_pending = None,
                Err(TryRecvError::Empty) => {}
            }
        }
        let is_mine = |content: &MapContent, key: &Arc<InspectionResult>| {
            Arc::ptr_eq(key, result) && Arc::ptr_eq(&content.part, part)
        };
        if let Some((_, content)) = self.maps.iter().find(|(key, content)| is_mine(content, key)) {
            return Some(content.clone());
        }
        if !self.map_pending.as_ref().is_some_and(|p| Arc::ptr_eq(&p.key, result)) {
            let (part, of, scan) = (part.clone(), result.clone(), scan.clone());
            self.map_pending = pending(result.clone(), wake, move |run| {
                let Outcome::Measured(inspection) = &of.outcome else { return Some(None) };
                let content = MapContent::of(&part, inspection, &scan, of.map_range_mm, run);
                Some(content.ok().map(Arc::new))
            });
        }
        None
    }
}

fn keep<T>(kept: &mut Vec<T>, new: T, most: usize) {
    kept.push(new);
    if kept.len() > most {
        kept.remove(0);
    }
}

/// Starts a computation; `None` when the system gives no thread.
pub(in crate::gui) fn pending<K, V: Send + 'static>(
    key: K,
    wake: &egui::Context,
    compute: impl FnOnce(&RunContext) -> Option<V> + Send + 'static,
) -> Option<Pending<K, V>> {
    let (sender, answer) = channel();
    let stop = CancelToken::default();
    let (token, wake) = (stop.clone(), wake.clone());
    let thread = std::thread::Builder::new().name("scene".into()).spawn(move || {
        let run = RunContext::new(&token, &|_| {});
        if let Some(content) = compute(&run)
            && sender.send(content).is_ok()
        {
            wake.request_repaint();
        }
    });
    thread.ok().map(|_| Pending { key, stop, answer })
}
