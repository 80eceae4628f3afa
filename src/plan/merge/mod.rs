//! `MERGE.toml`: many overlapping views made one cloud, as written, then checked, all problems told together.
//!
//! `docs/merge.md` lists every key. Lengths stay in the unit that the file names, which is that of the views.

mod edit;
mod metric;
mod model;
mod quality;
mod sections;
#[cfg(test)]
mod tests;

pub use edit::{looks_like_merge, mask_lines, with_masks};
pub use metric::{Better, Metric};
pub use model::*;

use super::load::{LARGEST_PLAN, read_capped, schema, sha256_hex, too_large};
use super::problems::Problems;
use super::reader::{Places, TableReader};
use super::syntax::{Readable, read_document, read_text};
use crate::diagnostic::{Diagnostic, Severity};
use std::path::Path;

/// What became of a `MERGE.toml`.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The settings, if and only if no problem is an error.
    pub plan: Option<MergePlan>,
    /// Every problem, by line.
    pub problems: Vec<Diagnostic>,
}

/// Whose views are merged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewsOf {
    /// Those of the folder that the file names; it must be there, as must every other file that is named.
    OwnFolder,
    /// Those of each part of an inspection, whose folders the inspection plan names. The poses may lie in them.
    Parts,
}

/// Reads a `MERGE.toml` and checks it, also that the files are there that it names. A file that cannot be read is one of the
/// problems.
pub fn load(path: &Path, views: ViewsOf) -> Loaded {
    match read_capped(path, LARGEST_PLAN, "the settings of a merge") {
        Ok(bytes) => read(&bytes, path, Some(views)),
        Err(problem) => Loaded { plan: None, problems: vec![*problem] },
    }
}

/// Checks bytes as [`load`] checks a file: settings that are edited and not written yet.
pub fn check(bytes: &[u8], path: &Path, views: ViewsOf) -> Loaded {
    read(bytes, path, Some(views))
}

/// Checks bytes; `path` gives messages their file and relative paths their folder. No file is opened or looked for.
pub fn parse(bytes: &[u8], path: &Path) -> Loaded {
    read(bytes, path, None)
}

pub(super) fn read(bytes: &[u8], path: &Path, look_for_files: Option<ViewsOf>) -> Loaded {
    let problems = Problems::new(path);
    if bytes.len() as u64 > LARGEST_PLAN {
        problems.add(too_large(bytes.len() as u64, LARGEST_PLAN, "the settings of a merge"));
        return Loaded { plan: None, problems: problems.into_sorted() };
    }
    let readable = read_text(bytes, &problems).and_then(|text| read_document(text, &problems));
    let plan = readable.and_then(|Readable { document, lines, lost }| {
        let root = TableReader::new(document.as_table(), "", 1, Places::Document(&lines, &lost), &problems);
        sections::root(root, path, &sha256_hex(&[bytes]), look_for_files)
    });
    let problems = problems.into_sorted();
    let usable = !problems.iter().any(|p| p.severity == Severity::Error);
    Loaded { plan: plan.filter(|_| usable), problems }
}
