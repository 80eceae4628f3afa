//! The files of a merge: which views, in which order, and what each holds.

use crate::diagnostic::{Diagnostic, ReadError};
use crate::io;
use crate::plan::merge::MergePlan;
use crate::run::RunContext;
use crate::stitch::{Measured, StitchError, measured};
use crate::worker::scans::MATCHING;
use std::path::{Path, PathBuf};

/// The views of a folder in the natural order of their names (`view_2` before `view_10`), without the files that the merge writes.
///
/// # Errors
/// The folder cannot be read, or fewer than `least` (one or two) of its files match the pattern.
pub(super) fn list_views(plan: &MergePlan, folder: &Path, least: usize) -> Result<Vec<PathBuf>, Diagnostic> {
    let line = plan.views.folder.line;
    let in_plan = |message: String| Diagnostic::error(message).in_file(&plan.path).at_line(line);
    let pattern = glob::Pattern::new(&plan.views.pattern).map_err(|e| in_plan(format!("[views] pattern: {e}")))?;
    let entries = std::fs::read_dir(folder).map_err(|e| {
        let message = format!("[views] folder: {} cannot be read: {e}", folder.display());
        in_plan(message).with_help("check the folder's name, and that you may read it")
    })?;
    let output = &plan.output;
    let own = [Some(&output.file), output.report.as_ref(), output.compare_with.as_ref()];
    let is_own = |path: &Path| {
        own.iter().flatten().any(|file| file.path.file_name() == path.file_name() && same(&file.path, path))
    };
    let is_view = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        pattern.matches_with(&name, MATCHING)
            && !name.to_ascii_lowercase().ends_with(".part")
            && path.is_file()
            && !is_own(path)
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_view).collect();
    paths.sort_by_cached_key(|path| {
        let name = name_of(path);
        (natural(&name), name)
    });
    let found = match paths.len() {
        0 => "no file",
        found if found >= least => return Ok(paths),
        _ => "one view only",
    };
    // Of a part's folder only the name: its report is the same wherever it lies.
    let own = &plan.views.folder;
    let shown = if folder == own.path { own.file.clone() } else { name_of(folder) };
    let message = format!(
        "[views] pattern: found {found} in {shown} that matches \"{}\", expected {} or more views",
        plan.views.pattern,
        if least == 1 { "one" } else { "two" }
    );
    let help = match paths.len() {
        0 => {
            "check folder and pattern: * stands for any letters, ? for one; letters have to be large or small as in the names"
        }
        _ => "check folder and pattern; a single cloud needs no merging and is inspected as it is",
    };
    Err(in_plan(message).with_help(help))
}

fn same(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// A file's name for people.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// A name in pieces of letters and numbers, so that 2 comes before 10.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut pieces: Vec<(String, u64)> = Vec::new();
    let mut digits = String::new();
    let mut letters = String::new();
    let mut end = |letters: &mut String, digits: &mut String| {
        let number = digits.parse().unwrap_or(u64::MAX);
        pieces.push((std::mem::take(letters), if digits.is_empty() { 0 } else { number }));
        digits.clear();
    };
    for letter in name.chars() {
        if letter.is_ascii_digit() {
            digits.push(letter);
            continue;
        }
        if !digits.is_empty() {
            end(&mut letters, &mut digits);
        }
        letters.push(letter);
    }
    end(&mut letters, &mut digits);
    pieces
}

/// A view's file: its hash, if the file could be read, and what it holds.
pub(super) fn read_view(
    plan: &MergePlan,
    path: &Path,
    run: &RunContext,
) -> (Option<String>, Result<Measured, StitchError>) {
    match read_bytes(path, run) {
        Ok((bytes, sha256)) => (Some(sha256), measure(plan, path, &bytes, run)),
        Err(fault) => (None, Err(fault)),
    }
}

/// A view's file with its hash.
pub(super) fn read_bytes(path: &Path, run: &RunContext) -> Result<(Vec<u8>, String), StitchError> {
    Ok(read_named(path, run)?)
}

/// What a view's file holds.
pub(super) fn measure(plan: &MergePlan, path: &Path, bytes: &[u8], run: &RunContext) -> Result<Measured, StitchError> {
    let cloud = io::read_cloud_in_its_unit(bytes, path, plan.unit, run)?;
    Ok(measured(cloud, &name_of(path), plan.views.sensor).map_err(|fault| fault.in_file(path))?)
}

/// A small file that the settings name, with its hash.
pub(super) fn read_named(path: &Path, run: &RunContext) -> Result<(Vec<u8>, String), ReadError> {
    let bytes = io::read_file_while(path, run)?;
    let sha256 = io::sha256_of(&bytes, run)?;
    Ok((bytes, sha256))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::merge;

    #[test]
    fn names_are_in_the_order_in_which_people_count() {
        let mut names = ["v10.ply", "v9.ply", "v2b.ply", "v2.ply", "w1.ply", "v02.ply", "V1.ply"];
        names.sort_by_key(|name| (natural(name), name.to_string()));
        assert_eq!(names, ["V1.ply", "v02.ply", "v2.ply", "v2b.ply", "v9.ply", "v10.ply", "w1.ply"]);
        assert!(natural("99999999999999999999999") > natural("5"));
    }

    #[test]
    fn views_are_listed_without_what_the_merge_writes() {
        let folder = tempfile::tempdir().unwrap();
        let text = b"schema = 1\nunit = \"um\"\n[views]\nfolder = \".\"\n[output]\ncompare_with = \"old.ply\"\n";
        let plan = merge::parse(text, &folder.path().join("merge.toml")).plan.unwrap();
        let told = list_views(&plan, folder.path(), 2).unwrap_err();
        assert!(told.message.contains("no file") && told.line == Some(4), "{told}");
        for name in ["v2.ply", "merged.ply", "old.ply", "v3.ply.part", "v.txt", ".v4.ply"] {
            std::fs::write(folder.path().join(name), "x").unwrap();
        }
        assert!(list_views(&plan, folder.path(), 2).unwrap_err().message.contains("one view only"));
        std::fs::write(folder.path().join("v10.ply"), "x").unwrap();
        let names: Vec<String> = list_views(&plan, folder.path(), 2).unwrap().iter().map(|p| name_of(p)).collect();
        assert_eq!(names, ["v2.ply", "v10.ply"]);
        assert!(list_views(&plan, &folder.path().join("none"), 2).unwrap_err().message.contains("cannot be read"));
    }
}
