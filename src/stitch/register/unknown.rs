//! Views of which no pose is known before: which of them are searched with which.

use super::pairwise::Two;
use super::pipeline::Work;
use super::progress::{self, Step};
use super::search::{COARSE_PATCHES, Scales, search};
use super::surface::Surface;
use crate::run::Cancelled;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Searches without a prior for one view, with those placed already whose names are nearest.
const MOST_SEARCHES: usize = 12;

impl Work<'_> {
    /// Views of which no pose is known: first with the view before by name, then with those that are connected already.
    pub(super) fn search_unknown(&mut self) -> Result<(), Cancelled> {
        let mut usable: Vec<usize> = (0..self.views.len()).filter(|k| self.surfaces[*k].is_some()).collect();
        usable.sort_by_key(|k| self.by_name[*k]);
        let unknown = |work: &Self, k: usize| work.priors[k].is_none();
        if !usable.iter().any(|k| unknown(self, *k)) {
            return Ok(());
        }
        let coarse = |surface: &Option<Surface>| surface.as_ref()?.coarser(COARSE_PATCHES, &self.run).ok();
        let coarse: Vec<Option<Surface>> = self.surfaces.par_iter().map(coarse).collect();
        self.run.check()?;
        let step = Step::new(&self.told, progress::NEIGHBOURS, usable.len());
        for pair in usable.windows(2) {
            if unknown(self, pair[0]) || unknown(self, pair[1]) {
                self.search_pair(pair[0].min(pair[1]), pair[0].max(pair[1]), &coarse)?;
                step.one();
            }
        }
        let mut searches: BTreeMap<usize, usize> = BTreeMap::new();
        loop {
            let main = self.main_part();
            let tried = |a: usize, b: usize| self.tried.contains_key(&(a.min(b), a.max(b)));
            let unknown = |k: usize| self.priors[k].is_none();
            let next = usable.iter().filter(|k| !main.contains(k)).find_map(|k| {
                let free = searches.get(k).is_none_or(|n| *n < MOST_SEARCHES);
                let open = main.iter().filter(|m| unknown(*k) || unknown(**m)).filter(|m| !tried(*k, **m));
                let nearest = open.min_by_key(|m| (self.by_name[**m].abs_diff(self.by_name[*k]), self.by_name[**m]))?;
                free.then_some((*k, *nearest))
            });
            let Some((k, other)) = next else { return Ok(()) };
            *searches.entry(k).or_default() += 1;
            self.search_pair(k.min(other), k.max(other), &coarse)?;
            step.one();
        }
    }

    fn search_pair(&mut self, a: usize, b: usize, coarse: &[Option<Surface>]) -> Result<(), Cancelled> {
        let Some(fine) = self.two(a, b) else { return Ok(()) };
        let Some((ca, cb)) = coarse[a].as_ref().zip(coarse[b].as_ref()) else { return Ok(()) };
        let scales = Scales { fine, coarse: Two { a: ca, b: cb } };
        let tried = search(&scales, &self.options, &self.run)?;
        self.tried.insert((a, b), tried);
        Ok(())
    }
}
