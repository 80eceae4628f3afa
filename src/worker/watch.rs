//! Which files of a watched folder are ready: each once it has been quiet, never one that is still being written.
//!
//! The folder is polled: events of the operating system are not reliable on network shares.

use super::merge::part_folder;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// One file as the folder shows it now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Its path.
    pub path: PathBuf,
    /// Bytes.
    pub size: u64,
    /// Time of last change, where the file system tells.
    pub modified: Option<SystemTime>,
}

impl Listed {
    /// Whether the file's size and time are as they were listed.
    pub fn is_still_so(&self) -> bool {
        if self.path.is_dir() {
            return part_folder::listed(&self.path).as_ref() == Some(self);
        }
        std::fs::metadata(&self.path).is_ok_and(|m| m.len() == self.size && m.modified().ok() == self.modified)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Seen, not quiet for long enough yet.
    Settling,
    /// Handed out.
    Taken,
    /// Handed out, and found to be cut off: waits for a change.
    Waiting,
}

/// Why a file that was handed out could not be inspected yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotYet {
    /// It ends in the middle: the rest must come, and with it another size or time.
    CutOff,
    /// The system does not let us read it, perhaps because its writer has it open: tried again and again.
    Unreadable,
    /// It changed while it was read.
    Changed,
}

#[derive(Debug, Clone)]
struct Seen {
    size: u64,
    modified: Option<SystemTime>,
    quiet_since: Instant,
    state: State,
    /// What was told of it already.
    told: Option<NotYet>,
}

/// Remembers what the folder showed and what was taken of it.
#[derive(Debug)]
pub struct FolderWatch {
    settle: Duration,
    seen: BTreeMap<PathBuf, Seen>,
}

impl FolderWatch {
    /// A file is ready when its size and time have not changed for that long.
    pub fn new(settle: Duration) -> Self {
        Self { settle, seen: BTreeMap::new() }
    }

    /// Looks at the folder as it is now; returns the files that became ready, in the order of the listing. A file
    /// changed after it was taken becomes ready again; one that is gone is forgotten.
    pub fn look(&mut self, now: Instant, listing: &[Listed]) -> Vec<Listed> {
        let there: BTreeSet<&Path> = listing.iter().map(|file| file.path.as_path()).collect();
        self.seen.retain(|path, _| there.contains(path.as_path()));
        let mut ready = Vec::new();
        for file in listing {
            let seen = self.seen.entry(file.path.clone()).or_insert_with(|| Seen {
                size: file.size,
                modified: file.modified,
                quiet_since: now,
                state: State::Settling,
                told: None,
            });
            if (seen.size, seen.modified) != (file.size, file.modified) {
                let told = seen.told;
                *seen =
                    Seen { size: file.size, modified: file.modified, quiet_since: now, state: State::Settling, told };
            }
            if seen.state == State::Settling && now.duration_since(seen.quiet_since) >= self.settle {
                seen.state = State::Taken;
                ready.push(file.clone());
            }
        }
        ready
    }

    /// The file could not be inspected yet: it stays in sight. Returns whether that is news to tell.
    pub fn not_yet(&mut self, now: Instant, path: &Path, why: NotYet) -> bool {
        let Some(seen) = self.seen.get_mut(path) else { return false };
        seen.state = if why == NotYet::CutOff { State::Waiting } else { State::Settling };
        seen.quiet_since = now;
        // A file that is being written is an everyday thing.
        why != NotYet::Changed && seen.told.replace(why) != Some(why)
    }

    /// Whether a file in the folder will be handed out: one that was not yet, and was not told to be waited for.
    pub fn is_to_come(&self, path: &Path) -> bool {
        self.seen.get(path).is_none_or(|seen| seen.state == State::Settling && seen.told.is_none())
    }

    /// Whether a file was not there at the last look.
    pub fn is_new(&self, path: &Path) -> bool {
        !self.seen.contains_key(path)
    }

    /// Files that are in sight but not whole.
    pub fn waiting(&self) -> impl Iterator<Item = &Path> {
        self.seen.iter().filter(|(_, seen)| seen.state == State::Waiting).map(|(path, _)| path.as_path())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTLE: Duration = Duration::from_secs(2);

    fn file(name: &str, size: u64) -> Listed {
        Listed { path: name.into(), size, modified: None }
    }

    #[test]
    fn a_growing_file_waits_until_it_is_quiet_and_is_taken_once() {
        let start = Instant::now();
        let at = |s: f64| start + Duration::from_secs_f64(s);
        let mut watch = FolderWatch::new(SETTLE);
        assert!(watch.look(at(0.0), &[file("a.ply", 10)]).is_empty());
        assert!(watch.look(at(1.9), &[file("a.ply", 20)]).is_empty());
        assert!(watch.look(at(3.8), &[file("a.ply", 20)]).is_empty());
        assert_eq!(watch.look(at(3.9), &[file("a.ply", 20)]), [file("a.ply", 20)]);
        assert!(watch.look(at(60.0), &[file("a.ply", 20)]).is_empty());
    }

    #[test]
    fn a_cut_off_file_stays_in_sight_until_it_changes() {
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        let mut watch = FolderWatch::new(SETTLE);
        watch.look(at(0), &[file("a.ply", 10)]);
        assert_eq!(watch.look(at(2), &[file("a.ply", 10)]).len(), 1);
        let told = |watch: &mut FolderWatch, s| watch.not_yet(at(s), Path::new("a.ply"), NotYet::CutOff);
        assert!(told(&mut watch, 2));
        assert!(watch.look(at(100), &[file("a.ply", 10)]).is_empty());
        assert_eq!(watch.waiting().collect::<Vec<_>>(), [Path::new("a.ply")]);
        assert!(watch.look(at(101), &[file("a.ply", 30)]).is_empty());
        assert_eq!(watch.waiting().count(), 0);
        assert_eq!(watch.look(at(103), &[file("a.ply", 30)]).len(), 1);
        assert!(!told(&mut watch, 103), "told once");
    }

    #[test]
    fn a_file_that_cannot_be_read_is_tried_again_without_a_change() {
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        let mut watch = FolderWatch::new(SETTLE);
        let listing = [file("a.ply", 10)];
        watch.look(at(0), &listing);
        for round in 1..4 {
            assert_eq!(watch.look(at(2 * round), &listing).len(), 1);
            let news = watch.not_yet(at(2 * round), Path::new("a.ply"), NotYet::Unreadable);
            assert_eq!(news, round == 1);
            assert!(watch.look(at(2 * round + 1), &listing).is_empty());
        }
        assert!(watch.seen.values().all(|seen| seen.state == State::Settling));
    }

    #[test]
    fn a_folder_that_vanishes_and_comes_back_gives_its_files_again() {
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        let mut watch = FolderWatch::new(SETTLE);
        watch.look(at(0), &[file("a.ply", 10)]);
        watch.look(at(2), &[file("a.ply", 10)]);
        watch.look(at(3), &[]);
        watch.look(at(4), &[file("a.ply", 10)]);
        // Whether its content was inspected before is the hash's business.
        assert_eq!(watch.look(at(6), &[file("a.ply", 10)]).len(), 1);
    }
}
