//! Results from before this start: read once a plan is open, looked at, and inspected again on demand. None of them is a verdict of now.

use super::action::{Action, Screen};
use super::app::App;
use super::bridge;
use super::facts::{Facts, FinishedPart, Job, Wanted};
use crate::diagnostic::Diagnostic;
use crate::inspect::Inspected;
use crate::worker::earlier::{Earlier, EarlierResults, earlier_results};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// How many are read at most.
const MOST: usize = 200;

/// One result that can be looked at, by its place among those from before or among the parts of now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Looked {
    /// From before this start.
    Earlier(usize),
    /// Inspected since.
    Part(usize),
}

impl Looked {
    /// The step after or before, over all that there are, the oldest first.
    pub fn step(self, facts: &Facts, forward: bool) -> Option<Looked> {
        let at = self.place(facts);
        let to = if forward { at + 1 } else { at.checked_sub(1)? };
        Self::at(facts, to)
    }

    /// Its place among all.
    pub fn place(self, facts: &Facts) -> usize {
        match self {
            Looked::Earlier(k) => k,
            Looked::Part(k) => facts.earlier_results().len() + k,
        }
    }

    /// What stands at a place among all.
    pub fn at(facts: &Facts, place: usize) -> Option<Looked> {
        let earlier = facts.earlier_results().len();
        match place.checked_sub(earlier) {
            None => Some(Looked::Earlier(place)),
            Some(k) => (k < facts.parts.len()).then_some(Looked::Part(k)),
        }
    }

    /// Asks to see it.
    pub fn action(self) -> Action {
        match self {
            Looked::Earlier(k) => Action::ChooseEarlier(k),
            Looked::Part(k) => Action::ChoosePart(Some(k)),
        }
    }
}

/// Reads the results folder of a plan that was opened, once, on a thread.
pub(super) fn tick(app: &mut App, ctx: &egui::Context) {
    if let Some(read) = app.earlier.poll() {
        let (of, mut found) = read.unwrap_or_default();
        if app.facts.plan_path.as_ref() == Some(&of) {
            let facts = &mut app.facts;
            found.results.retain(|earlier| !is_of_now(facts, earlier));
            facts.earlier = Some(Arc::new(found));
        }
    }
    let opening = matches!(app.facts.job, Job::Opening { .. });
    if app.facts.earlier.is_some() || app.earlier.is_busy() || opening {
        return;
    }
    if let (Some(plan), Some(path)) = (app.facts.plan.clone(), app.facts.plan_path.clone()) {
        app.earlier.start(ctx, move || (path, earlier_results(&plan, MOST)));
    }
}

/// A part of this start whose file was already written when the folder was read.
fn is_of_now(facts: &Facts, earlier: &Earlier) -> bool {
    let id = &earlier.stored.identity;
    facts.parts.iter().map(|part| &part.result.identity).any(|of_now| {
        (&of_now.scan_file, &of_now.scan_sha256, &of_now.plan_sha256)
            == (&id.scan_file, &id.scan_sha256, &id.plan_sha256)
    })
}

/// Shows one of them.
pub(super) fn choose(app: &mut App, at: usize) {
    if at < app.facts.earlier_results().len() {
        app.view.screen = Screen::Results;
        app.view.part = None;
        app.view.earlier = Some(at);
    }
}

/// Why a scan cannot be inspected again now, as a key among the texts.
pub(super) fn may_inspect(facts: &Facts, earlier: &Earlier) -> Result<(), &'static str> {
    if !earlier.scan_is_there {
        return Err("results.earlier_no_scan");
    }
    match (&facts.plan, &facts.part, &facts.job) {
        (Some(_), Some(_), Job::Idle) => Ok(()),
        (Some(_), Some(_), _) => Err("results.earlier_not_now"),
        _ => Err("operator.plan_has_errors"),
    }
}

/// Inspects the scan of one of them by the plan at hand, writing and counting nothing.
pub(super) fn inspect_again(app: &mut App, at: usize) {
    let facts = &mut app.facts;
    let Some(earlier) = facts.earlier_results().get(at).filter(|earlier| may_inspect(facts, earlier).is_ok()) else {
        return;
    };
    let scan = earlier.scan.clone();
    let (Some(plan), Some(part)) = (facts.plan.clone(), facts.part.clone()) else { return };
    let wanted = Wanted::Earlier(at);
    facts.job = Job::Fetching { wanted };
    app.begin(bridge::Job::Fetch { wanted, scan, plan, part });
}

/// What came of that. Another scan under the same name is not the part of then.
pub(super) fn inspected_again(app: &mut App, at: usize, inspected: Inspected, took: Duration) {
    let facts = &mut app.facts;
    let Some(earlier) = facts.earlier_results().get(at) else { return };
    let scan_path: PathBuf = earlier.scan.clone();
    if inspected.result.identity.scan_sha256 != earlier.stored.identity.scan_sha256 {
        let message = "the scan has changed since it was inspected; its points cannot be shown";
        facts.message = Some(Diagnostic::warning(message).in_file(&scan_path));
        return;
    }
    let (Some(plan), Some(part)) = (facts.plan.clone(), facts.part.clone()) else { return };
    let result = Arc::new(inspected.result);
    let scan = inspected.scan.map(Arc::new);
    let again =
        FinishedPart { index: 0, of: None, scan_path, result, scan, plan, part, files: Vec::new(), again: false, took };
    // The points of one are kept, not of all that were looked at.
    facts.again = Some((at, Arc::new(again)));
}

impl Facts {
    /// Results from before this start, the oldest first.
    pub fn earlier_results(&self) -> &[Earlier] {
        self.earlier.as_deref().map_or(&[], |earlier: &EarlierResults| &earlier.results)
    }

    /// Whether one of them was held to another plan or another CAD than those at hand.
    pub fn is_of_another_plan(&self, earlier: &Earlier) -> bool {
        let id = &earlier.stored.identity;
        self.plan.as_ref().is_some_and(|plan| plan.sha256 != id.plan_sha256)
            || self.part.as_ref().is_some_and(|part| part.cad_sha256 != id.cad_sha256)
    }

    /// One of them inspected again, by the plan as it is now.
    pub fn again(&self, at: usize) -> Option<&Arc<FinishedPart>> {
        let plan = self.plan.as_ref()?;
        self.again.as_ref().filter(|(of, part)| *of == at && part.plan.sha256 == plan.sha256).map(|(_, part)| part)
    }
}
