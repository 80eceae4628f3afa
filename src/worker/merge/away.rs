//! Views put away in files beside the cloud, where memory has no room for all: a folder of its own, gone when the cloud is written. A run that is
//! stopped leaves it, and the same command goes on with what is there.

use super::stored::{Origin, Stored, find, is_ours, store};
use crate::diagnostic::Diagnostic;
use crate::io;
use crate::plan::merge::{Judge, MergePlan};
use crate::run::RunContext;
use crate::stitch::{MergeIdentity, PlacedViews, Ready, Room, Shelf, StitchError, View, ViewFacts};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Bytes that a point takes while it is merged with all others in memory, beside what the view holds of it: first its place in a tile, where it
/// comes from and what is decided of it (26 measured), then what may stay of it, less its metrics.
const MERGED: u64 = 32;
/// Bytes that a point takes while it is decided in a band of points.
const IN_BAND: u64 = 75;

/// Where views are put away, and how many bytes points may take.
#[derive(Debug)]
pub(super) struct Away {
    folder: PathBuf,
    limit: u64,
    /// A hash over all that has a say in a view: other settings, other views.
    settings: String,
    /// The views that are put away, in the order of names.
    stored: Vec<Stored>,
    /// Bytes that the ranks of a point take, where several metrics judge.
    ranked: u64,
    /// Bytes of the points in memory.
    in_memory: u64,
    /// How many of them an earlier run has left.
    pub found: usize,
    begun: bool,
    complete: bool,
}

/// The views that were put away, one at a time.
pub(super) struct Put<'a> {
    stored: &'a [Stored],
    run: RunContext<'a>,
}

impl Shelf for Put<'_> {
    fn view(&self, k: usize) -> Result<Cow<'_, View>, StitchError> {
        self.stored[k].view(&self.run).map(Cow::Owned)
    }
}

impl Away {
    /// Beside a cloud: `merged.ply.unfinished`.
    pub fn new(cloud: &Path, limit: u64) -> Self {
        let mut name = cloud.file_name().unwrap_or_default().to_owned();
        name.push(".unfinished");
        let folder = cloud.with_file_name(name);
        let (settings, stored) = (String::new(), Vec::new());
        Self { folder, limit, settings, stored, ranked: 0, in_memory: 0, found: 0, begun: false, complete: false }
    }

    /// Whether views are put away.
    pub fn is_begun(&self) -> bool {
        self.begun
    }

    /// Whether every view that can be used is put away.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// Says that no view comes after those that are here.
    pub fn set_complete(&mut self) {
        self.complete = self.begun;
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// How many views lie there.
    pub fn len(&self) -> usize {
        self.stored.len()
    }

    /// Says what the views are made with.
    pub fn set_settings(&mut self, plan: &MergePlan, identity: &MergeIdentity) {
        self.ranked = match &plan.merge.judge.value {
            Judge::Metrics(several) if several.len() > 1 => 24 + 4 * several.len() as u64,
            _ => 0,
        };
        let words = format!("{} {identity:?}", env!("CARGO_PKG_VERSION"));
        self.settings = io::sha256_hex(words.as_bytes());
    }

    fn path(&self, index: usize) -> PathBuf {
        self.folder.join(format!("{index:06}.view"))
    }

    /// A view that an earlier run has left.
    ///
    /// # Errors
    /// It cannot be read, or the job was stopped.
    pub fn find(
        &self,
        index: usize,
        name: &str,
        sha256: &str,
        run: &RunContext,
    ) -> Result<Option<Stored>, StitchError> {
        let path = self.path(index);
        find(&path, Origin { settings: &self.settings, index, name, sha256 }, run)
    }

    /// Takes a view that was found.
    pub fn take(&mut self, stored: Stored) {
        self.begun = true;
        self.found += 1;
        self.stored.push(stored);
    }

    /// Whether one more view leaves room for merging; all those of before are in memory.
    pub fn has_room(&mut self, view: &View) -> bool {
        let columns = 4 * view.columns.len() as u64;
        let pixels = if view.pixels.is_some() { 8 } else { 0 };
        // A metric once in the view and once in the cloud.
        self.in_memory += view.positions.len() as u64 * (24 + 2 * columns + pixels + MERGED + self.ranked);
        self.in_memory <= self.limit
    }

    /// Puts a view away.
    ///
    /// # Errors
    /// What the disk says; the folder holds a file of somebody else's; or the job was stopped.
    pub fn put(
        &mut self,
        ready: &mut Ready,
        facts: &ViewFacts,
        sha256: &str,
        run: &RunContext,
    ) -> Result<(), StitchError> {
        self.begun = true;
        let path = self.path(ready.index);
        if !self.folder.is_dir() {
            std::fs::create_dir(&self.folder).map_err(|e| {
                let message = format!("views cannot be put away here: {e}");
                let help = "allow writing there, give another place with --out, or raise --memory-limit";
                Diagnostic::error(message).in_file(&self.folder).with_help(help)
            })?;
        }
        if path.exists() && !is_ours(&path) {
            let message = "views are to be put away here, but a file of this name is not one of these";
            let help = "move the file or its folder away, or give the cloud another name with --out";
            return Err(Diagnostic::error(message).in_file(&path).with_help(help).into());
        }
        let name = ready.conditioned.view.name.clone();
        let of = Origin { settings: &self.settings, index: ready.index, name: &name, sha256 };
        let stored = store(&path, of, ready, facts, run)?;
        *ready = stored.ready();
        self.stored.push(stored);
        Ok(())
    }

    /// The views that are put away.
    pub fn shelf<'a>(&'a self, run: &RunContext<'a>) -> Put<'a> {
        Put { stored: &self.stored, run: *run }
    }

    /// How many points there is room for.
    ///
    /// # Errors
    /// For too few.
    pub fn room(&self, plan: &MergePlan, placed: &PlacedViews) -> Result<Room, StitchError> {
        const LEAST: u64 = 1000;
        let points: u64 = placed.counts.iter().map(|counts| counts.points_kept as u64).sum();
        let columns = placed.views.iter().map(|view| view.columns.len() as u64).max().unwrap_or(0);
        let largest = self.stored.iter().map(Stored::size).max().unwrap_or(0);
        // Each thread reads a view, as bytes and as numbers.
        let views = 2 * largest * rayon::current_num_threads() as u64;
        let kept_bytes = 40 + 4 * columns;
        let least = views + points * self.ranked + points / 8 + LEAST * (IN_BAND + kept_bytes);
        let Some(rest) = self.limit.checked_sub(least) else {
            let message = format!(
                "{points} points of {} views take at least {} to merge, more than the limit of {}",
                placed.views.len(),
                told(least),
                told(self.limit)
            );
            let help = "raise --memory-limit, by more than that as each point that stays takes room too; or use fewer --threads, tighten [mask], ask for [density]";
            return Err(Diagnostic::error(message).in_file(&plan.path).with_help(help).into());
        };
        let half = |each: u64| usize::try_from(LEAST + rest / 2 / each).unwrap_or(usize::MAX);
        Ok(Room { band: half(IN_BAND), kept: half(kept_bytes) })
    }

    /// Whether so many points have room at once, with their places only.
    pub fn has_room_for(&self, points: usize) -> bool {
        points as u64 * 24 <= self.limit / 2
    }

    /// Removes what was put away, also by an earlier run; anything else stays, and its folder with it.
    pub fn remove(&self) {
        let Ok(entries) = std::fs::read_dir(&self.folder) else { return };
        for path in entries.flatten().map(|entry| entry.path()) {
            let is_view = path.extension().is_some_and(|ending| ending == "view") && is_ours(&path);
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if is_view || crate::report::atomic::is_leftover(&name) {
                let _ = std::fs::remove_file(path);
            }
        }
        let _ = std::fs::remove_dir(&self.folder);
    }
}

/// Bytes for people.
fn told(bytes: u64) -> String {
    let mib = bytes as f64 / (1_u64 << 20) as f64;
    let (value, unit) = if mib >= 100.0 { (mib / 1024.0, "GiB") } else { (mib, "MiB") };
    format!("{value:.2} {unit}")
}

/// Three quarters of the memory that the system has free, where it tells.
pub(super) fn usual_limit() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 4 * 3 * 1024)
}
