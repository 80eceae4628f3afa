//! The files of a merge: which views, in which order, and what each holds.

use crate::diagnostic::{Diagnostic, ReadError};
use crate::io;
use crate::plan::merge::MergePlan;
use crate::report::{MERGE_SCHEMA, merged_unit};
use crate::run::RunContext;
use crate::stitch::{Measured, StitchError, measured};
use crate::worker::scans::MATCHING;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The files of a folder that the pattern of the settings names.
#[derive(Debug, Default)]
pub(super) struct Listed {
    /// The views, in the natural order of their names (`view_2` before `view_10`).
    pub views: Vec<PathBuf>,
    /// Names of clouds that a merge has written before, which are no views. Those that are written again now are not named.
    pub merged: Vec<String>,
}

impl Listed {
    /// What people should know of files that are not taken for views.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        self.merged.iter().map(|name| format!("{name} is a cloud that a merge has written, no view: left out"))
    }
}

/// The views of a folder, without the files that a merge has written; `outputs` are those of the merge that is to be.
///
/// # Errors
/// The folder cannot be read, or fewer than `least` (one or two) of its files match the pattern.
pub(super) fn list_views(
    plan: &MergePlan,
    folder: &Path,
    outputs: &[&Path],
    least: usize,
) -> Result<Listed, Diagnostic> {
    let line = plan.views.folder.line;
    let in_plan = |message: String| Diagnostic::error(message).in_file(&plan.path).at_line(line);
    let pattern = glob::Pattern::new(&plan.views.pattern).map_err(|e| in_plan(format!("[views] pattern: {e}")))?;
    let entries = std::fs::read_dir(folder).map_err(|e| {
        let message = format!("[views] folder: {} cannot be read: {e}", folder.display());
        in_plan(message).with_help("check the folder's name, and that you may read it")
    })?;
    let outputs: Vec<PathBuf> = outputs.iter().map(|path| resolved(path)).collect();
    let earlier = plan.output.compare_with.as_ref().map(|file| resolved(&file.path));
    let mut listed = Listed::default();
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = name_of(&path);
        let is_meant = pattern.matches_with(&name, MATCHING) && !name.to_ascii_lowercase().ends_with(".part");
        if !is_meant || !path.is_file() || earlier.as_ref().is_some_and(|file| *file == resolved(&path)) {
            continue;
        }
        match (written_by_merge(&path), outputs.contains(&resolved(&path))) {
            (None, _) | (Some(Kind::Report), false) => listed.views.push(path),
            (Some(Kind::Cloud), false) => listed.merged.push(name),
            (Some(_), true) => {}
        }
    }
    listed.views.sort_by_cached_key(|path| in_order(&name_of(path)));
    listed.merged.sort_by_cached_key(|name| in_order(name));
    if listed.views.len() >= least { Ok(listed) } else { Err(too_few(plan, folder, &listed, least)) }
}

fn too_few(plan: &MergePlan, folder: &Path, listed: &Listed, least: usize) -> Diagnostic {
    // Of a part's folder only the name: its report is the same wherever it lies.
    let own = &plan.views.folder;
    let shown = if folder == own.path { own.file.clone() } else { name_of(folder) };
    let found = if listed.views.is_empty() { "no file" } else { "one view only" };
    let message = format!(
        "[views] pattern: found {found} in {shown} that matches \"{}\", expected {} or more views",
        plan.views.pattern,
        if least == 1 { "one" } else { "two" }
    );
    let help = if !listed.merged.is_empty() {
        "check folder and pattern; clouds that a merge has written lie there and are no views"
    } else if listed.views.is_empty() {
        "check folder and pattern: * stands for any letters, ? for one; letters have to be large or small as in the names"
    } else {
        "check folder and pattern; a single cloud needs no merging and is inspected as it is"
    };
    Diagnostic::error(message).in_file(&plan.path).at_line(own.line).with_help(help)
}

/// What a merge writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Cloud,
    Report,
}

/// Whether a merge has written a file, by its first bytes.
fn written_by_merge(path: &Path) -> Option<Kind> {
    let mut start = Vec::new();
    std::fs::File::open(path).ok()?.take(4096).read_to_end(&mut start).ok()?;
    if merged_unit(&start).is_some() {
        return Some(Kind::Cloud);
    }
    let text = String::from_utf8_lossy(&start[..start.len().min(200)]);
    let is_report = text.starts_with("%PDF-") || (text.starts_with('{') && text.contains(MERGE_SCHEMA));
    is_report.then_some(Kind::Report)
}

/// The one path of a file however it is named; of a file that is not there, what it would be.
pub(super) fn resolved(path: &Path) -> PathBuf {
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder).unwrap_or_else(|| path.to_path_buf())
}

fn in_order(name: &str) -> (Vec<(String, u64)>, String) {
    (natural(name), name.to_owned())
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

    /// The header of a merged cloud without points.
    const MERGED: &str = "ply\nformat binary_little_endian 1.0\ncomment lengths in um\nelement vertex 0\n\
        property double x\nproperty double y\nproperty double z\nproperty float d_cal\nproperty int view\nend_header\n";

    #[test]
    fn views_are_listed_without_what_a_merge_has_written() {
        let folder = tempfile::tempdir().unwrap();
        let text = b"schema = 1\nunit = \"um\"\n[views]\nfolder = \".\"\n[output]\ncompare_with = \"old.ply\"\n";
        let plan = merge::parse(text, &folder.path().join("merge.toml")).plan.unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        let own = plan.output.file.path.clone();
        let list = || list_views(&plan, folder.path(), &[&own], 2);
        let told = list().unwrap_err();
        assert!(told.message.contains("no file") && told.line == Some(4), "{told}");
        ["v2.ply", "old.ply", "v3.ply.part", "v.txt", ".v4.ply"].iter().for_each(|name| write(name, "x"));
        write("merged.ply", MERGED);
        assert!(list().unwrap_err().message.contains("one view only"));
        ["v10.ply", "v9.ply"].iter().for_each(|name| write(name, "x"));
        write("march.ply", MERGED);
        let listed = list().unwrap();
        assert_eq!(listed.views.iter().map(|p| name_of(p)).collect::<Vec<_>>(), ["v2.ply", "v9.ply", "v10.ply"]);
        assert_eq!(listed.merged, ["march.ply"]);
        // What lies where the cloud is to be and is none that a merge has written is a view, which must not be overwritten.
        write("merged.ply", &MERGED.replace("int view", "int camera"));
        assert_eq!(name_of(&list().unwrap().views[0]), "merged.ply");
        assert!(list_views(&plan, &folder.path().join("none"), &[], 2).unwrap_err().message.contains("cannot be read"));
    }

    #[test]
    fn a_file_has_one_path_however_it_is_named() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a")).unwrap();
        let same = |one: &str, other: &str| resolved(&folder.path().join(one)) == resolved(&folder.path().join(other));
        assert!(same("./a/../new.ply", "new.ply") && same("a/./new.ply", "a/new.ply"));
        assert!(!same("a/new.ply", "new.ply") && !same("none/new.ply", "new.ply"));
    }
}
