//! The folder of a part whose views are stitched before it is inspected: what it holds, its hash, its cloud.

use super::{Place, merge_folder};
use crate::diagnostic::{Diagnostic, ReadError, os_words};
use crate::geometry::PointCloud;
use crate::io;
use crate::plan::merge::MergePlan;
use crate::run::RunContext;
use crate::stitch::{MergeResult, StitchError};
use crate::worker::watch::Listed;
use std::path::{Path, PathBuf};

/// A folder as one scan: the sizes of its files together, and when the last of them changed. `None` while there is nothing in it, or
/// something that is still being written.
pub fn listed(folder: &Path) -> Option<Listed> {
    let mut sum = Listed { path: folder.to_path_buf(), size: 0, modified: None };
    let files = files(folder).ok()?;
    if files.is_empty() || files.iter().any(|path| name_of(path).to_ascii_lowercase().ends_with(".part")) {
        return None;
    }
    for path in files {
        let about = std::fs::metadata(path).ok()?;
        sum.size += about.len();
        sum.modified = sum.modified.max(about.modified().ok());
    }
    Some(sum)
}

/// Its plain files that are not hidden, by name.
fn files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_file() && !name_of(&path).starts_with('.') {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn name_of(path: &Path) -> String {
    super::name_of(path)
}

/// SHA-256 over the lines `HASH  NAME` of its files by name, as `sha256sum *` prints them; also their bytes together.
///
/// # Errors
/// It is no folder, one of its files cannot be read, or the job was stopped.
pub fn hash(folder: &Path, run: &RunContext) -> Result<(String, u64), ReadError> {
    let fault = |words: String, help: &str| Diagnostic::error(words).in_file(folder).with_help(help);
    if folder.is_file() {
        let help = "the plan's [scans] views says that each part is a folder of views: name that, or remove views from the plan";
        return Err(fault("found a file, expected the folder of a part's views".to_owned(), help).into());
    }
    let files = files(folder).map_err(|e| {
        fault(format!("the folder cannot be read: {}", os_words(&e)), "check its name, and that you may read it")
    })?;
    let (mut lines, mut size) = (String::new(), 0);
    for path in files {
        let bytes = io::read_file_while(&path, run)?;
        size += bytes.len() as u64;
        lines.push_str(&format!("{}  {}\n", io::sha256_of(&bytes, run)?, name_of(&path)));
    }
    Ok((io::sha256_hex(lines.as_bytes()), size))
}

/// The views of a part as one cloud, mm, world frame; also what people should know: views left out, by name. With `wait_for_rest` a view that
/// ends in the middle is an error, since its rest may come.
///
/// # Errors
/// Those of [`merge_folder`]; and views that may have slid on each other, since what is measured across them would be as wrong as that and no
/// uncertainty would tell.
pub fn cloud(
    plan: &MergePlan,
    folder: &Path,
    wait_for_rest: bool,
    run: &RunContext,
) -> Result<(PointCloud, Vec<String>), StitchError> {
    let place = Place { folder: Some(folder.to_path_buf()), wait_for_rest };
    let result = merge_folder(plan, &place, run, &|_| {})?;
    if result.placed.registration.as_ref().is_some_and(|registration| !registration.weak.is_empty()) {
        let message = "the overlaps of the part's views do not hold every motion: views may have slid on each other";
        let help = "let views overlap where the part is curved or bent, or put [registration] enabled = false and see to it that the poses are true";
        return Err(Diagnostic::error(message).in_file(folder).with_help(help).into());
    }
    let left_out = result.left_out().map(|(name, why)| format!("{name} is left out: {why}"));
    let notes = result.placed.warnings.iter().chain(&result.merged.warnings).cloned();
    let warnings = not_whole(&result).into_iter().chain(left_out).chain(notes).collect();
    let mm = plan.unit.in_mm();
    let positions = result.merged.positions.iter().map(|p| p * mm).collect();
    let skipped_invalid = result.placed.counts.iter().map(|counts| counts.points_invalid).sum();
    Ok((PointCloud { positions, skipped_invalid, ..PointCloud::default() }, warnings))
}

/// That the part is stitched of some of its views only: first, so that nobody takes it for a whole one.
fn not_whole(result: &MergeResult) -> Option<String> {
    const NAMED: usize = 5;
    let missing: Vec<&str> = result.left_out().map(|(name, _)| name).collect();
    let (all, used) = (result.files.len(), result.files.len() - missing.len());
    let (first, more) = (missing.iter().take(NAMED).copied(), missing.len().saturating_sub(NAMED));
    let more = (more > 0).then(|| format!("{more} more"));
    let names: Vec<String> = first.map(str::to_owned).chain(more).collect();
    (!missing.is_empty()).then(|| {
        let names = names.join(", ");
        format!(
            "the part is stitched of {used} of its {all} views: what only {names} saw is missing; measure these again, or take them out of the part's folder"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_settled_when_all_its_files_have() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        assert_eq!(listed(folder.path()), None);
        write("v1.ply", "one");
        write(".v2.ply", "hidden");
        let first = listed(folder.path()).unwrap();
        assert_eq!((first.size, first.path.as_path()), (3, folder.path()));
        assert!(first.is_still_so());
        let (sha256, size) = hash(folder.path(), &RunContext::silent()).unwrap();
        assert_eq!((sha256, size), (io::sha256_hex(format!("{}  v1.ply\n", io::sha256_hex(b"one")).as_bytes()), 3));
        write("v2.ply.part", "half");
        assert!(listed(folder.path()).is_none() && !first.is_still_so());
        std::fs::rename(folder.path().join("v2.ply.part"), folder.path().join("v2.ply")).unwrap();
        assert_eq!(listed(folder.path()).unwrap().size, 7);
    }
}
