//! Which scans lie in the plan's folder while nothing runs: looked at again and again on a thread of its own, told only when it is another list.

use super::app::App;
use super::bridge::Scans;
use super::facts::{Facts, Job};
use crate::plan::{Plan, ScanSettings};
use crate::worker::scans::{Links, list_scans};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Time between two looks. A folder on a share is not asked more often than a person would.
const EVERY: Duration = Duration::from_secs(2);

/// What to look at from now on.
struct Order {
    number: u64,
    settings: Option<ScanSettings>,
}

/// The window's end of the thread, which ends when this is dropped.
pub(super) struct Lookout {
    orders: Sender<Order>,
    told: Receiver<(u64, Scans)>,
    number: u64,
    of: Option<Arc<Plan>>,
    /// The last list, whatever came between.
    seen: BTreeSet<PathBuf>,
}

impl Lookout {
    /// Starts the thread. `wake` is called when there is another list.
    pub fn start(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (orders, ordered) = channel();
        let (sender, told) = channel();
        std::thread::Builder::new().name("lookout".into()).spawn(move || look_on(&ordered, &sender, &wake))?;
        Ok(Self { orders, told, number: 0, of: None, seen: BTreeSet::new() })
    }

    /// Looks at once, whenever the last look was.
    pub fn look_now(&mut self) {
        self.of = None;
    }

    /// Looks at the folder of this plan from now on; of none, at nothing.
    fn turn_to(&mut self, plan: Option<&Arc<Plan>>) {
        let same = match (&self.of, plan) {
            (Some(of), Some(plan)) => Arc::ptr_eq(of, plan),
            (of, plan) => of.is_none() && plan.is_none(),
        };
        if !same {
            self.number += 1;
            self.of = plan.cloned();
            let order = Order { number: self.number, settings: plan.map(|plan| plan.scans.clone()) };
            // The thread ends only when this sender is gone.
            let _ = self.orders.send(order);
        }
    }

    /// The newest list of the folder that is looked at.
    fn news(&self) -> Option<Scans> {
        self.told.try_iter().filter(|(number, _)| *number == self.number).map(|(_, scans)| scans).last()
    }
}

fn look_on(orders: &Receiver<Order>, sender: &Sender<(u64, Scans)>, wake: &dyn Fn()) {
    let mut at: Option<(u64, ScanSettings)> = None;
    let mut told = None;
    loop {
        let order = match &at {
            None => orders.recv().map(Some).map_err(|_| RecvTimeoutError::Disconnected),
            Some(_) => orders.recv_timeout(EVERY).map(Some),
        };
        let order = match order {
            Ok(order) => order,
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return,
        };
        // Of several only the last one counts.
        if let Some(order) = orders.try_iter().last().or(order) {
            at = order.settings.map(|settings| (order.number, settings));
            told = None;
        }
        let Some((number, settings)) = &at else { continue };
        let scans: Scans =
            list_scans(settings, Links::Follow).map(|files| files.into_iter().map(|file| file.path).collect());
        if told.as_ref() == Some(&scans) {
            continue;
        }
        told = Some(scans.clone());
        if sender.send((*number, scans)).is_err() {
            return;
        }
        wake();
    }
}

/// Hears of the folder, and looks at the right one.
pub(super) fn tick(app: &mut App) {
    if let Some(scans) = app.lookout.news().filter(|_| is_wanted(&app.facts)) {
        heard(&mut app.facts, &mut app.lookout.seen, scans);
    }
    let plan = app.facts.plan.as_ref().filter(|_| is_wanted(&app.facts));
    app.lookout.turn_to(plan);
}

/// A run tells of its scans itself, and so does a plan that is opened.
fn is_wanted(facts: &Facts) -> bool {
    !matches!(facts.job, Job::Opening { .. } | Job::Running(_))
}

/// Another list: what came since the last run ended waits, too.
fn heard(facts: &mut Facts, seen: &mut BTreeSet<PathBuf>, scans: Scans) {
    if let Some(Ok(before)) = &facts.scans {
        *seen = before.iter().cloned().collect();
    }
    if let Ok(now) = &scans
        && facts.last_end.is_some()
    {
        let there: BTreeSet<&PathBuf> = now.iter().collect();
        facts.arrived.retain(|scan| there.contains(scan));
        let came = now.iter().filter(|scan| !seen.contains(*scan) && !facts.arrived.contains(scan));
        let came: Vec<PathBuf> = came.cloned().collect();
        facts.arrived.extend(came);
    }
    facts.scans = Some(scans);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Diagnostic;
    use crate::worker::SequenceSummary;

    #[test]
    fn what_comes_after_a_run_is_counted_once_also_past_a_folder_that_was_away() {
        let list = |names: &[&str]| -> Scans { Ok(names.iter().map(PathBuf::from).collect()) };
        let mut facts = Facts { scans: Some(list(&["1", "2"])), ..Facts::default() };
        let mut seen = BTreeSet::new();
        heard(&mut facts, &mut seen, list(&["1", "2", "3"]));
        assert!(facts.arrived.is_empty(), "all of them wait before the first run");
        facts.last_end = Some(SequenceSummary::default());
        heard(&mut facts, &mut seen, list(&["0", "1", "2", "3"]));
        heard(&mut facts, &mut seen, Err(Diagnostic::error("away")));
        heard(&mut facts, &mut seen, list(&["0", "1", "2", "3", "4"]));
        assert_eq!(facts.arrived, [PathBuf::from("0"), "4".into()]);
        heard(&mut facts, &mut seen, list(&["1", "2", "3", "4"]));
        assert_eq!(facts.arrived, [PathBuf::from("4")], "what is gone does not wait");
    }
}
