//! What lies on the disk while nothing runs: the plan's scans, and what the last verdict rests on. Looked at again and again on a thread of its
//! own, told only when it is something else.

use super::app::App;
use super::bridge::Scans;
use super::engineer;
use super::facts::{Facts, FinishedPart, Job};
use super::hear::paths;
use crate::diagnostic::{Diagnostic, Severity};
use crate::part::Part;
use crate::plan::{Plan, ScanSettings};
use crate::worker::scans::{Links, list_scans};
use crate::worker::watch::Listed;
use crate::worker::{Ground, SequenceSummary, Shaken};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// Time between two looks. A folder on a share is not asked more often than a person would.
const EVERY: Duration = Duration::from_secs(2);

/// What to look at from now on.
struct Order {
    number: u64,
    settings: Option<ScanSettings>,
    ground: Option<Ground>,
}

/// What a look showed.
enum Told {
    Scans(Scans),
    Shaken(Shaken),
}

/// What is looked at: other ones of these are another order.
#[derive(Default)]
struct Of {
    plan: Option<Arc<Plan>>,
    part: Option<Arc<Part>>,
    judged: Option<Arc<FinishedPart>>,
}

impl Of {
    fn is(&self, other: &Of) -> bool {
        fn same<T>(a: Option<&Arc<T>>, b: Option<&Arc<T>>) -> bool {
            a.map(Arc::as_ptr) == b.map(Arc::as_ptr)
        }
        same(self.plan.as_ref(), other.plan.as_ref())
            && same(self.part.as_ref(), other.part.as_ref())
            && same(self.judged.as_ref(), other.judged.as_ref())
    }
}

/// Size and time of each file.
type Stamps = BTreeMap<PathBuf, Listed>;

/// The window's end of the thread, which ends when this is dropped.
pub(super) struct Lookout {
    orders: Sender<Order>,
    told: Receiver<(u64, Told)>,
    number: u64,
    of: Of,
    /// The last list, whatever came between.
    seen: Stamps,
}

impl Lookout {
    /// Starts the thread. `wake` is called when there is something to tell.
    pub fn start(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (orders, ordered) = channel();
        let (sender, told) = channel();
        std::thread::Builder::new().name("lookout".into()).spawn(move || look_on(&ordered, &sender, &wake))?;
        Ok(Self { orders, told, number: 0, of: Of::default(), seen: Stamps::new() })
    }

    /// Looks at once, whenever the last look was.
    pub fn look_now(&mut self) {
        self.of = Of::default();
    }

    /// What was in the folder when a plan had been opened or a run had ended: nothing of that comes later.
    pub fn lies_there(&mut self, scans: Option<&Scans>) {
        if let Some(Ok(files)) = scans {
            self.seen = stamps(files);
        }
    }

    /// Looks at these from now on.
    fn turn_to(&mut self, of: Of) {
        if self.of.is(&of) {
            return;
        }
        self.number += 1;
        let files = of.judged.as_ref().map(|judged| judged.files.clone()).unwrap_or_default();
        let ground = of.plan.as_ref().zip(of.part.as_ref()).map(|(plan, part)| Ground::of(plan, part, files));
        let settings = of.plan.as_ref().map(|plan| plan.scans.clone());
        self.of = of;
        // The thread ends only when this sender is gone.
        let _ = self.orders.send(Order { number: self.number, settings, ground });
    }

    /// The news about what is looked at.
    fn news(&self) -> Vec<Told> {
        self.told.try_iter().filter(|(number, _)| *number == self.number).map(|(_, told)| told).collect()
    }
}

fn stamps(files: &[Listed]) -> Stamps {
    files.iter().map(|file| (file.path.clone(), file.clone())).collect()
}

fn look_on(orders: &Receiver<Order>, sender: &Sender<(u64, Told)>, wake: &dyn Fn()) {
    let mut at: Option<Order> = None;
    let mut told: Option<Scans> = None;
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
            at = Some(order).filter(|order| order.settings.is_some());
            told = None;
        }
        let Some(Order { number, settings: Some(settings), ground }) = &mut at else { continue };
        let mut news = Vec::new();
        let scans = list_scans(settings, Links::Follow);
        if told.as_ref() != Some(&scans) {
            told = Some(scans.clone());
            news.push(Told::Scans(scans));
        }
        if let Some(shaken) = ground.as_mut().and_then(|ground| ground.look(Instant::now())) {
            // Told once; whoever builds on something else orders anew.
            *ground = None;
            news.push(Told::Shaken(shaken));
        }
        let is_news = !news.is_empty();
        if news.into_iter().any(|told| sender.send((*number, told)).is_err()) {
            return;
        }
        if is_news {
            wake();
        }
    }
}

/// Hears of the disk, and looks at the right places.
pub(super) fn tick(app: &mut App) {
    for told in app.lookout.news() {
        match told {
            _ if !is_wanted(&app.facts) => {}
            Told::Scans(scans) => heard(&mut app.facts, &mut app.lookout.seen, scans),
            Told::Shaken(shaken) => self::shaken(app, shaken),
        }
    }
    let facts = &app.facts;
    let of = match is_wanted(facts) {
        true => Of {
            plan: facts.plan.clone(),
            part: facts.part.clone(),
            judged: facts.judged().filter(|_| matches!(facts.job, Job::Idle)).cloned(),
        },
        false => Of::default(),
    };
    app.lookout.turn_to(of);
}

/// A run tells of its scans itself, and so does a plan that is opened.
fn is_wanted(facts: &Facts) -> bool {
    !matches!(facts.job, Job::Opening { .. } | Job::Running(_))
}

/// Another list: what came since the last run ended waits, too, and so does what was written anew.
fn heard(facts: &mut Facts, seen: &mut Stamps, scans: Scans) {
    if let Ok(now) = &scans {
        if facts.last_end.is_some() {
            let there: BTreeSet<&PathBuf> = now.iter().map(|file| &file.path).collect();
            facts.arrived.retain(|scan| there.contains(scan));
            let is_new = |file: &&Listed| seen.get(&file.path) != Some(file) && !facts.arrived.contains(&file.path);
            let came: Vec<PathBuf> = now.iter().filter(is_new).map(|file| file.path.clone()).collect();
            facts.arrived.extend(came);
        }
        *seen = stamps(now);
    }
    facts.scans = Some(paths(&scans));
}

/// What the last verdict rests on is not what it was: there is none any more. Plan and CAD are read again, unless somebody is changing them here.
fn shaken(app: &mut App, shaken: Shaken) {
    let (Shaken::Ground(told) | Shaken::Results(told)) = &shaken;
    let told = told.clone();
    let facts = &mut app.facts;
    if facts.judged().is_some() {
        facts.run_from = facts.parts.len();
        let error = Diagnostic { severity: Severity::Error, ..told.clone() };
        facts.last_end = Some(SequenceSummary { error: Some(error), ..SequenceSummary::default() });
    }
    facts.message = Some(told);
    let is_edited = facts.editing.as_ref().is_some_and(|editing| editing.document.is_modified());
    let path = facts.plan_path.clone().filter(|_| matches!(facts.job, Job::Idle) && !is_edited);
    if let (Shaken::Ground(_), Some(path)) = (shaken, path) {
        engineer::reload(app, path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Diagnostic;
    use crate::worker::SequenceSummary;

    #[test]
    fn what_comes_after_a_run_is_counted_once_also_past_a_folder_that_was_away() {
        let file = |name: &str, size| Listed { path: name.into(), size, modified: None };
        let list = |names: &[&str]| -> Scans { Ok(names.iter().map(|name| file(name, 1)).collect()) };
        let mut facts = Facts::default();
        let mut seen = Stamps::new();
        heard(&mut facts, &mut seen, list(&["1", "2"]));
        heard(&mut facts, &mut seen, list(&["1", "2", "3"]));
        assert!(facts.arrived.is_empty(), "all of them wait before the first run");
        facts.last_end = Some(SequenceSummary::default());
        heard(&mut facts, &mut seen, list(&["0", "1", "2", "3"]));
        heard(&mut facts, &mut seen, Err(Diagnostic::error("away")));
        heard(&mut facts, &mut seen, list(&["0", "1", "2", "3", "4"]));
        assert_eq!(facts.arrived, [PathBuf::from("0"), "4".into()]);
        heard(&mut facts, &mut seen, list(&["1", "2", "3", "4"]));
        assert_eq!(facts.arrived, [PathBuf::from("4")], "what is gone does not wait");
        heard(&mut facts, &mut seen, Ok(vec![file("1", 1), file("2", 9), file("3", 1), file("4", 1)]));
        assert_eq!(facts.arrived, [PathBuf::from("4"), "2".into()], "what was written anew waits");
    }
}
