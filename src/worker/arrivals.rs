//! Watching a folder: each scan as it arrives, once, and only when it is whole.

use super::Event;
use super::delivered::Delivered;
use super::plan_on_disk::PlanNow;
use super::request::{SequenceSummary, WatchSettings};
use super::scans::Links;
use super::sequence::{Arrival, ScanEnd, Sequence, WatchEnd};
use super::watch::{FolderWatch, Listed, NotYet};
use crate::diagnostic::Diagnostic;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two attempts to write results again.
const RETRY: Duration = Duration::from_secs(1);

/// What a watcher remembers between two looks at the folder.
struct Watcher {
    folder: FolderWatch,
    settings: WatchSettings,
    /// What came under which name.
    delivered: Delivered,
    /// Scans whose results could not be written, with the reason.
    unwritten: BTreeMap<PathBuf, String>,
    /// Scans that were told to be in sight but not whole, with what is missing.
    unfinished: BTreeMap<PathBuf, Diagnostic>,
    /// Scans of before that are ready: what comes now goes first.
    old: VecDeque<Listed>,
    /// The scans that were told to lie there.
    told: Vec<PathBuf>,
}

impl Sequence<'_> {
    /// Takes each scan as it arrives, until somebody stops it.
    pub(super) fn watch(
        &mut self,
        watch: WatchSettings,
        summary: &mut SequenceSummary,
    ) -> Result<WatchEnd, Diagnostic> {
        let mut watcher = Watcher {
            folder: FolderWatch::new(watch.settle),
            settings: watch,
            delivered: Delivered::default(),
            unwritten: BTreeMap::new(),
            unfinished: BTreeMap::new(),
            old: VecDeque::new(),
            told: Vec::new(),
        };
        let end = self.watch_on(&mut watcher, summary);
        if let WatchEnd::Stopped = end {
            self.leave(watcher, summary);
        }
        Ok(end)
    }

    /// Who stops now must not take the part before for the verdict of those that wait.
    fn leave(&self, watcher: Watcher, summary: &mut SequenceSummary) {
        for (scan, why) in watcher.unwritten {
            summary.unwritten += 1;
            let why = Diagnostic::error(why).in_file(&scan);
            self.lost(
                &scan,
                &why.with_help("watch the folder again, or run the sequence, once results can be written"),
            );
        }
        for (scan, why) in watcher.unfinished {
            summary.refused += 1;
            let help = "measure this part again, or watch the folder again once the scan is whole";
            self.lost(&scan, &why.in_file(&scan).with_help(help));
        }
    }

    fn watch_on(&mut self, watcher: &mut Watcher, summary: &mut SequenceSummary) -> WatchEnd {
        let mut lost = false;
        (self.listener)(Event::Watching { folder: self.examiner.plan.scans.path.clone() });
        while !self.stop.is_on() {
            match self.list(Links::Ignore) {
                Ok(listing) => {
                    if std::mem::take(&mut lost) {
                        (self.listener)(Event::FolderBack);
                    }
                    if self.take_arrivals(&listing, watcher, summary) {
                        return WatchEnd::AnotherPlan;
                    }
                    if !watcher.old.is_empty() {
                        continue;
                    }
                }
                Err(diagnostic) => {
                    if !std::mem::replace(&mut lost, true) {
                        (self.listener)(Event::FolderLost(diagnostic));
                    }
                }
            }
            if self.plan_on_disk.is_due(Instant::now()) && self.is_another_plan(watcher.settings) {
                return WatchEnd::AnotherPlan;
            }
            std::thread::sleep(watcher.settings.poll);
        }
        WatchEnd::Stopped
    }

    /// Takes what is ready: all that came now, or else one of those that lay there before and have a result. Returns whether another plan lies on
    /// the disk; nothing is taken by the old one any more then.
    fn take_arrivals(&mut self, listing: &[Listed], watcher: &mut Watcher, summary: &mut SequenceSummary) -> bool {
        watcher.delivered.see(listing);
        self.tell_listing(listing, watcher);
        self.give_up_what_is_gone(listing, watcher, summary);
        let ready = watcher.folder.look(Instant::now(), listing);
        let is_old = |file: &Listed| watcher.delivered.is_old(file) && self.results.knows(&file.path, None);
        let (old, mut ready): (Vec<Listed>, Vec<Listed>) = ready.into_iter().partition(is_old);
        watcher.old.extend(old);
        if ready.is_empty() {
            // One that changed since is ready anew once it is quiet.
            ready.extend(std::iter::from_fn(|| watcher.old.pop_front()).find(|file| listing.contains(file)));
        }
        for (k, file) in ready.iter().enumerate() {
            if self.stop.is_on() {
                return false;
            }
            if self.is_another_plan(watcher.settings) {
                return true;
            }
            if self.stop.is_on() {
                return false;
            }
            let rest = &ready[k + 1..];
            if let Err(diagnostic) = self.take(file, rest.len() + watcher.old.len(), watcher, summary) {
                self.wait_for_results(diagnostic, &file.path, rest, watcher);
            }
        }
        false
    }

    /// Which scans lie there, when they are others than before.
    fn tell_listing(&self, listing: &[Listed], watcher: &mut Watcher) {
        let paths: Vec<PathBuf> = listing.iter().map(|file| file.path.clone()).collect();
        if paths != watcher.told {
            watcher.told.clone_from(&paths);
            (self.listener)(Event::Listed(paths));
        }
    }

    /// Looks whether the plan on the disk is the one of this watch; waits while it is being changed, or cannot be used. Returns whether
    /// it is another one, which was told.
    fn is_another_plan(&mut self, settings: WatchSettings) -> bool {
        let mut lost = false;
        loop {
            match self.plan_on_disk.look(Instant::now(), settings.settle) {
                PlanNow::Same => {
                    if lost {
                        (self.listener)(Event::PlanBack);
                    }
                    return false;
                }
                PlanNow::Settling => {}
                PlanNow::Another(told) => {
                    let told = told.with_help("the watch begins anew by it");
                    (self.listener)(Event::Problems(vec![told]));
                    return true;
                }
                PlanNow::Unusable(why) => {
                    if !std::mem::replace(&mut lost, true) {
                        (self.listener)(Event::PlanLost(*why));
                    }
                }
            }
            if self.stop.is_on() {
                return false;
            }
            std::thread::sleep(settings.poll);
        }
    }

    /// A scan that was not whole, or whose results could not be written, and that was taken away meanwhile is never judged.
    fn give_up_what_is_gone(&self, listing: &[Listed], watcher: &mut Watcher, summary: &mut SequenceSummary) {
        let is_there = |path: &PathBuf| listing.iter().any(|file| file.path == *path);
        // Many a scanner writes under another name first: one that comes now is that part.
        let is_renamed = || listing.iter().any(|file| watcher.folder.is_new(&file.path));
        for (scan, why) in watcher.unfinished.extract_if(.., |path, _| !is_there(path)) {
            if is_renamed() {
                (self.listener)(Event::LeftAlone { scan });
                continue;
            }
            let why = why.message;
            let message = format!("the scan was taken away before it was whole: {why}");
            let why = Diagnostic::warning(message).in_file(&scan).with_help("measure this part again");
            summary.refused += 1;
            self.lost(&scan, &why);
            (self.listener)(Event::Problems(vec![why]));
        }
        let gone: Vec<PathBuf> = watcher.unwritten.keys().filter(|path| !is_there(path)).cloned().collect();
        for scan in gone {
            let why = watcher.unwritten.remove(&scan).unwrap_or_default();
            let message = format!("the scan was taken away before its results could be written: {why}");
            let help = "measure this part again";
            let why = Diagnostic::error(message).in_file(&scan).with_help(help);
            self.lost(&scan, &why);
            (self.listener)(Event::Problems(vec![why]));
            if watcher.unwritten.is_empty() {
                (self.listener)(Event::ResultsBack);
            }
        }
    }

    /// One file that has settled. The error: its results cannot be written.
    fn take(
        &mut self,
        file: &Listed,
        waiting: usize,
        watcher: &mut Watcher,
        summary: &mut SequenceSummary,
    ) -> Result<(), Diagnostic> {
        let scan = &file.path;
        let index = summary.measured() + summary.refused + 1;
        (self.listener)(Event::Started { index, of: None, waiting, scan: scan.clone() });
        let unwritten = watcher.unwritten.contains_key(scan);
        let end = self.one_scan(scan, Some(Arrival { file, delivered: &watcher.delivered, unwritten }))?;
        if !matches!(end, ScanEnd::NotYet(..)) {
            watcher.unfinished.remove(scan);
        }
        match end {
            ScanEnd::Done(result) => {
                summary.count(&result.outcome);
                if let Some(sha256) = &result.identity.scan_sha256 {
                    watcher.delivered.note(file, sha256);
                }
                if watcher.unwritten.remove(scan).is_some() && watcher.unwritten.is_empty() {
                    (self.listener)(Event::ResultsBack);
                }
            }
            ScanEnd::Repeated(sha256) => {
                summary.refused += 1;
                watcher.delivered.note(file, &sha256);
            }
            ScanEnd::NotYet(why, words) => {
                let is_news = watcher.folder.not_yet(Instant::now(), scan, why);
                (self.listener)(match words {
                    Some(words) => {
                        watcher.unfinished.insert(scan.clone(), (*words).clone());
                        Event::Waiting { scan: scan.clone(), why: *words, is_news }
                    }
                    None => Event::LeftAlone { scan: scan.clone() },
                });
            }
            ScanEnd::Dropped => (self.listener)(Event::LeftAlone { scan: scan.clone() }),
            ScanEnd::Known => {}
        }
        Ok(())
    }

    /// Results cannot be written (disk full, share away): says so once, and goes on when the folder can be opened again. The
    /// scan stays in sight until its results are on the disk.
    fn wait_for_results(&mut self, diagnostic: Diagnostic, scan: &Path, rest: &[Listed], watcher: &mut Watcher) {
        let poll = watcher.settings.poll;
        watcher.folder.not_yet(Instant::now(), scan, NotYet::Changed);
        let news = !watcher.unwritten.values().any(|told| *told == diagnostic.message);
        watcher.unwritten.insert(scan.to_path_buf(), diagnostic.message.clone());
        if news {
            (self.listener)(Event::ResultsLost(diagnostic));
        }
        let mut last_try = Instant::now();
        let mut queued = Vec::new();
        while !self.stop.is_on() {
            self.tell_queue(rest, watcher, &mut queued);
            std::thread::sleep(poll);
            if last_try.elapsed() < RETRY {
                continue;
            }
            if let Ok(warnings) = self.results.reopen() {
                (self.listener)(Event::Problems(warnings));
                return;
            }
            last_try = Instant::now();
        }
    }

    /// Scans go on arriving while none is begun: tells which wait, when they are others than before.
    fn tell_queue(&mut self, rest: &[Listed], watcher: &Watcher, told: &mut Vec<PathBuf>) {
        let Ok(listing) = self.list(Links::Ignore) else { return };
        let waits = |file: &&Listed| watcher.folder.is_to_come(&file.path) || rest.contains(*file);
        let queued: Vec<PathBuf> = listing.iter().filter(waits).map(|file| file.path.clone()).collect();
        if queued != *told {
            told.clone_from(&queued);
            (self.listener)(Event::Queued(queued));
        }
    }
}
