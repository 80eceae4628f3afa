//! Results of a plan that stand in its results folder from before, for people to look at. Nothing here judges anything.

use crate::diagnostic::Diagnostic;
use crate::io::{read_plain, sha256_hex};
use crate::plan::Plan;
use crate::report::manifest::Manifest;
use crate::report::stored::{Stored, read_stored};
use crate::report::words::{SCHEMA, clean};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Whether a file is what a run wrote. Nothing that is said in another file than a [`Seal::Whole`] one is a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seal {
    /// The manifest lists it as it is.
    Whole,
    /// It is another one than the manifest lists.
    Changed,
    /// No manifest lists it.
    Unlisted,
}

/// One of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Earlier {
    /// What it says.
    pub stored: Stored,
    /// Its file.
    pub file: PathBuf,
    /// When that was written: `2026-03-14 15:30 UTC`.
    pub written: String,
    /// Whether it is what was written.
    pub seal: Seal,
    /// Where its scan would lie now.
    pub scan: PathBuf,
    /// Whether something of that name lay there when the folder was read; whether it is the same scan tells its content.
    pub scan_is_there: bool,
}

impl Earlier {
    /// Whether the list of written results vouches for its file.
    pub fn is_vouched_for(&self) -> bool {
        self.seal == Seal::Whole
    }

    /// The scan's name without its ending.
    pub fn short_name(&self) -> String {
        let name = &self.stored.identity.scan_file;
        clean(&Path::new(name).file_stem().map_or_else(|| name.into(), |stem| stem.to_string_lossy()))
    }
}

/// The results of a plan in its folder.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EarlierResults {
    /// The newest ones, oldest of them first.
    pub results: Vec<Earlier>,
    /// Files that call themselves results and cannot be read as one, with the reason.
    pub unreadable: Vec<Diagnostic>,
}

/// Reads the newest results of plans of this file's name, at most so many. A folder that cannot be read has none.
pub fn earlier_results(plan: &Plan, most: usize) -> EarlierResults {
    let folder = &plan.output.path;
    let name = plan.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    // A damaged manifest vouches for nothing; what a run that was ended in the middle had put in place is as it was announced.
    let mut manifest = Manifest::load(folder).unwrap_or_default();
    manifest.settle(folder);
    let mut found = EarlierResults::default();
    for (modified, file) in newest_first(folder, &manifest) {
        if found.results.len() >= most {
            break;
        }
        let Ok(bytes) = read_plain(&file) else { continue };
        match read_stored(&bytes) {
            Ok(stored) if stored.identity.plan_file == name => {
                let scan = plan.scans.path.join(&stored.identity.scan_file);
                found.results.push(Earlier {
                    stored,
                    written: minute_utc(modified),
                    seal: seal(&manifest, &file, &bytes),
                    scan_is_there: scan.exists(),
                    scan,
                    file,
                });
            }
            Ok(_) => {}
            Err(why) => found.unreadable.push(why.in_file(&file)),
        }
    }
    found.results.reverse();
    found
}

/// Files that begin as our results do, or should by the manifest.
fn newest_first(folder: &Path, manifest: &Manifest) -> Vec<(SystemTime, PathBuf)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "json"));
    let mut files: Vec<(SystemTime, PathBuf)> = files
        .filter(|path| is_result(path) || is_spoilt(manifest, path))
        .map(|path| (path.metadata().and_then(|m| m.modified()).unwrap_or(SystemTime::UNIX_EPOCH), path))
        .collect();
    files.sort_by(|a, b| b.cmp(a));
    files
}

/// Told by its first bytes, so that nothing large is read in vain.
fn is_result(path: &Path) -> bool {
    let family = SCHEMA.split('/').next().unwrap_or(SCHEMA);
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(64).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains(&format!("\"schema\": \"{family}/"))
}

/// A listed file that does not even begin as it did.
fn is_spoilt(manifest: &Manifest, path: &Path) -> bool {
    let listed = || manifest.hash_of(&name_of(path)).is_some();
    listed() && read_plain(path).is_ok_and(|bytes| seal(manifest, path, &bytes) == Seal::Changed)
}

fn name_of(file: &Path) -> String {
    file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

fn seal(manifest: &Manifest, file: &Path, bytes: &[u8]) -> Seal {
    match manifest.hash_of(&name_of(file)) {
        None => Seal::Unlisted,
        Some(listed) if listed == sha256_hex(bytes) => Seal::Whole,
        Some(_) => Seal::Changed,
    }
}

fn minute_utc(time: SystemTime) -> String {
    let stamp = jiff::Timestamp::try_from(time).map(|t| t.strftime("%Y-%m-%d %H:%M UTC").to_string());
    stamp.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{example, json, manifest};
    use std::time::Duration;

    #[test]
    fn the_newest_of_this_plan_are_told_with_what_is_odd_about_them() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let mut result = example::bracket();
        result.identity.plan_file = "demo.toml".into();
        let write = |name: &str, text: &str, minute: u64| {
            let file = root.join("results").join(name);
            std::fs::write(&file, text).unwrap();
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(60 * minute);
            File::options().write(true).open(&file).unwrap().set_modified(time).unwrap();
        };
        std::fs::create_dir_all(root.join("results")).unwrap();
        std::fs::create_dir_all(root.join("scans")).unwrap();
        std::fs::write(root.join("scans").join(&result.identity.scan_file), "x").unwrap();
        let of_this = json(&result);
        result.identity.scan_file = "gone.ply".into();
        write("b.json", &of_this, 1);
        write("a.json", &json(&result), 2);
        write("c.json", &json(&example::refused()).replace("0017.ply", "0018.ply"), 3);
        write("cut.json", &of_this[..300], 4);
        write("other.json", "{\"schema\": \"another/1\"}", 5);
        write("empty.json", &json(&result), 6);
        let listed = ["a.json", "b.json", "empty.json", "other.json"].map(String::from);
        manifest::write(&root.join("results"), &listed).unwrap();
        write("empty.json", "", 6);
        write("a.json", &json(&result).replace("0.336", "0.337"), 2);
        let plan = plan_in(root);
        let found = earlier_results(&plan, 10);
        let told: Vec<_> = found
            .results
            .iter()
            .map(|e| (e.file.file_name().unwrap().to_str().unwrap(), e.written.as_str(), e.seal, e.scan_is_there))
            .collect();
        assert_eq!(
            told,
            [
                ("b.json", "1970-01-01 00:01 UTC", Seal::Whole, true),
                ("a.json", "1970-01-01 00:02 UTC", Seal::Changed, false)
            ],
            "the refused one is of another plan's file"
        );
        let unreadable: Vec<_> = found.unreadable.iter().map(|why| name_of(why.file.as_ref().unwrap())).collect();
        assert_eq!(unreadable, ["empty.json", "cut.json"], "a listed one that lost its first bytes is missed");
        assert_eq!(earlier_results(&plan, 1).results, found.results[1..]);
        std::fs::remove_dir_all(root.join("results")).unwrap();
        assert_eq!(earlier_results(&plan, 10), EarlierResults::default());
    }

    /// The demo's plan with its folders in a place.
    fn plan_in(root: &Path) -> Plan {
        let text = include_str!("../../settings/demo.toml");
        let text = text.replace("../assets/demo/scans", "scans").replace("../assets/demo/bracket.stl", "bracket.stl");
        std::fs::write(root.join("demo.toml"), text).unwrap();
        std::fs::write(root.join("bracket.stl"), "not read").unwrap();
        crate::plan::load(&root.join("demo.toml")).plan.expect("the demo's plan")
    }
}
