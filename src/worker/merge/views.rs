//! The views of a merge as they become ready, in memory or put away.

use super::Around;
use super::away::Away;
use super::calibrated::check_units;
use super::files::{measure, name_of, read_bytes};
use crate::diagnostic::Diagnostic;
use crate::plan::merge::MergePlan;
use crate::run::RunContext;
use crate::stitch::columns::Asked;
use crate::stitch::{
    Merged, Metric, PlacedViews, Ready, StitchError, ViewFacts, condition, merge, merge_from, place_from,
};
use std::path::Path;

/// The views that are ready so far.
pub(super) struct Views<'a> {
    pub plan: &'a MergePlan,
    pub around: &'a Around,
    pub away: Option<&'a mut Away>,
    pub ready: Vec<Ready>,
    pub facts: Vec<ViewFacts>,
    /// Hashes of their files.
    pub hashes: Vec<String>,
}

/// The hash of a view's file, if it could be read, and why it cannot be used, if so.
type Added = (Option<String>, Result<(), StitchError>);

impl Views<'_> {
    /// Reads a view and makes it ready, or takes it from where an earlier run has put it.
    ///
    /// # Errors
    /// What ends the merge: mistakes of the settings, a disk that is full.
    pub fn add(
        &mut self,
        index: usize,
        path: &Path,
        wanted: &[(Metric, Asked)],
        run: &RunContext,
    ) -> Result<Added, StitchError> {
        let (bytes, sha256) = match read_bytes(path, run) {
            Ok(read) => read,
            Err(fault) => return Ok((None, Err(fault))),
        };
        if let Some(first) = self.hashes.iter().position(|known| *known == sha256) {
            let fault = same_file(path, &self.ready[first].conditioned.view.name);
            return Ok((Some(sha256), Err(fault.into())));
        }
        if let Some(away) = &mut self.away
            && let Some(stored) = away.find(index, &name_of(path), &sha256, run)?
        {
            self.put_away_the_first(run)?;
            self.ready.push(stored.ready());
            self.facts.push(stored.facts());
            self.hashes.push(sha256.clone());
            if let Some(away) = &mut self.away {
                away.take(stored);
            }
            return Ok((Some(sha256), Ok(())));
        }
        let measured = match measure(self.plan, path, &bytes, run) {
            Ok(measured) => measured,
            Err(fault) => return Ok((Some(sha256), Err(fault))),
        };
        drop(bytes);
        check_units(self.plan, &self.around.tools, &measured.view)?;
        let conditioned = match condition(self.plan, &self.around.tools, measured, wanted, run) {
            Ok(conditioned) => conditioned,
            Err(fault) => return Ok((Some(sha256), Err(fault))),
        };
        let start = self.around.start(self.plan, index, &conditioned, run)?;
        self.facts.push(ViewFacts::new(&conditioned.view, run)?);
        self.ready.push(Ready { index, conditioned, start });
        self.hashes.push(sha256.clone());
        self.make_room(run)?;
        Ok((Some(sha256), Ok(())))
    }

    /// Puts the newest view away where views are put away, or all of them where memory has no room for it.
    fn make_room(&mut self, run: &RunContext) -> Result<(), StitchError> {
        let Some(away) = &mut self.away else { return Ok(()) };
        let (Some(newest), Some(facts), Some(hash)) = (self.ready.last_mut(), self.facts.last(), self.hashes.last())
        else {
            return Ok(());
        };
        if away.is_begun() {
            return away.put(newest, facts, hash, run);
        }
        if !away.has_room(&newest.conditioned.view) {
            return self.put_away_the_first(run);
        }
        Ok(())
    }

    /// Puts all views away that are in memory, where none was put away so far.
    fn put_away_the_first(&mut self, run: &RunContext) -> Result<(), StitchError> {
        let Some(away) = self.away.as_mut().filter(|away| !away.is_begun()) else { return Ok(()) };
        for ((ready, facts), hash) in self.ready.iter_mut().zip(&self.facts).zip(&self.hashes) {
            away.put(ready, facts, hash, run)?;
        }
        Ok(())
    }

    /// Places them and merges them.
    pub fn merged(mut self, run: &RunContext) -> Result<(PlacedViews, Merged), StitchError> {
        if let Some(away) = &mut self.away {
            away.set_complete();
        }
        let Some(away) = self.away.filter(|away| away.is_begun()) else {
            let placed = place_from(self.plan, self.ready, &self.facts, None, run)?;
            let merged = merge(self.plan, &placed, run)?;
            return Ok((placed, merged));
        };
        let shelf = away.shelf(run);
        let placed = place_from(self.plan, self.ready, &self.facts, Some(&shelf), run)?;
        let merged = merge_from(self.plan, &placed, &shelf, away.room(self.plan, &placed)?, run)?;
        Ok((placed, merged))
    }
}

/// The fault of a view whose file has the same bytes as another one's: its points would count twice.
pub(super) fn same_file(path: &Path, first: &str) -> Diagnostic {
    let help = "remove one of the two; if both were to be there, look whether one was copied by mistake";
    Diagnostic::error(format!("the same bytes as {first}")).in_file(path).with_help(help)
}
