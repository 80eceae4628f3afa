//! Watching a folder: each scan as it arrives, once, and only when it is whole.

use super::Event;
use super::request::{SequenceSummary, WatchSettings};
use super::scans::Links;
use super::sequence::{ScanEnd, Sequence};
use super::watch::{FolderWatch, Listed, NotYet};
use crate::diagnostic::Diagnostic;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two attempts to write results again.
const RETRY: Duration = Duration::from_secs(1);

/// What a watcher remembers between two looks at the folder.
struct Watcher {
    folder: FolderWatch,
    /// Scans inspected so far.
    done: usize,
    /// Scans whose results could not be written, with the reason.
    unwritten: BTreeMap<PathBuf, String>,
}

impl Sequence<'_> {
    /// Takes each scan as it arrives, until somebody stops it.
    pub(super) fn watch(&mut self, watch: WatchSettings, summary: &mut SequenceSummary) -> Result<(), Diagnostic> {
        let folder = FolderWatch::new(watch.settle);
        let mut watcher = Watcher { folder, done: 0, unwritten: BTreeMap::new() };
        let end = self.watch_on(watch, &mut watcher, summary);
        // Who stops now must not take the part before for the verdict of these.
        for (scan, why) in std::mem::take(&mut watcher.unwritten) {
            summary.unwritten += 1;
            let why = Diagnostic::error(why).in_file(&scan);
            self.lost(
                &scan,
                &why.with_help("watch the folder again, or run the sequence, once results can be written"),
            );
        }
        end
    }

    fn watch_on(
        &mut self,
        watch: WatchSettings,
        watcher: &mut Watcher,
        summary: &mut SequenceSummary,
    ) -> Result<(), Diagnostic> {
        let mut lost = false;
        (self.listener)(Event::Watching { folder: self.examiner.plan.scans.path.clone() });
        while !self.stop.is_on() {
            match self.list(Links::Ignore) {
                Ok(listing) => {
                    if std::mem::take(&mut lost) {
                        (self.listener)(Event::FolderBack);
                    }
                    self.give_up_what_is_gone(&listing, watcher);
                    let ready = watcher.folder.look(Instant::now(), &listing);
                    for (k, file) in ready.iter().enumerate() {
                        if self.stop.is_on() {
                            return Ok(());
                        }
                        let waiting = ready.len() - k - 1;
                        if let Err(diagnostic) = self.take(file, waiting, watcher, summary) {
                            self.wait_for_results(diagnostic, &file.path, watcher, watch.poll);
                        }
                    }
                }
                Err(diagnostic) if !lost => {
                    lost = true;
                    (self.listener)(Event::FolderLost(diagnostic));
                }
                Err(_) => {}
            }
            std::thread::sleep(watch.poll);
        }
        Ok(())
    }

    /// A scan whose results could not be written and that was taken away meanwhile is never judged.
    fn give_up_what_is_gone(&self, listing: &[Listed], watcher: &mut Watcher) {
        let is_there = |path: &PathBuf| listing.iter().any(|file| file.path == *path);
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
        (self.listener)(Event::Started { index: watcher.done + 1, of: None, waiting, scan: scan.clone() });
        match self.one_scan(scan, Some(file))? {
            ScanEnd::Done(result) => {
                summary.count(&result.outcome);
                watcher.done += 1;
                if watcher.unwritten.remove(scan).is_some() && watcher.unwritten.is_empty() {
                    (self.listener)(Event::ResultsBack);
                }
            }
            ScanEnd::NotYet(why, words) => {
                if watcher.folder.not_yet(Instant::now(), scan, why)
                    && let Some(words) = words
                {
                    (self.listener)(Event::Waiting { scan: scan.clone(), why: *words });
                }
            }
            ScanEnd::Known | ScanEnd::Dropped => {}
        }
        Ok(())
    }

    /// Results cannot be written (disk full, share away): says so once, and goes on when the folder can be opened again. The
    /// scan stays in sight until its results are on the disk.
    fn wait_for_results(&mut self, diagnostic: Diagnostic, scan: &Path, watcher: &mut Watcher, poll: Duration) {
        watcher.folder.not_yet(Instant::now(), scan, NotYet::Changed);
        let news = !watcher.unwritten.values().any(|told| *told == diagnostic.message);
        watcher.unwritten.insert(scan.to_path_buf(), diagnostic.message.clone());
        if news {
            (self.listener)(Event::ResultsLost(diagnostic));
        }
        let mut last_try = Instant::now();
        while !self.stop.is_on() {
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
}
