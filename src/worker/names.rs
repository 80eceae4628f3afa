//! Under which name a scan's results go.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Longest name of a result without its ending, bytes: file systems allow 255 for the whole.
const LONGEST: usize = 200;

/// Gives each scan the name of its result files: the stem, unless another scan has it already.
#[derive(Debug, Default)]
pub struct ResultNames {
    owner_of: BTreeMap<String, Owner>,
}

#[derive(Debug)]
struct Owner {
    file_name: String,
    /// What was in the scan, where that is known.
    sha256: Option<String>,
    /// `None`: an earlier run's, which knew where its scan lay.
    path: Option<PathBuf>,
}

impl ResultNames {
    /// Goes on with the names that earlier runs gave: result name, scan file name, the scan's hash. A name under which an
    /// earlier result was kept stays its own.
    pub fn of_earlier_runs<'a>(results: impl Iterator<Item = (&'a str, &'a str, Option<&'a str>)>) -> Self {
        let owned = |(result, scan, sha256): (&str, &str, Option<&str>)| {
            let (scan, sha256) = if is_set_aside(result) { ("", None) } else { (scan, sha256) };
            let owner = Owner { file_name: scan.to_owned(), sha256: sha256.map(str::to_owned), path: None };
            (result.to_owned(), owner)
        };
        Self { owner_of: results.map(owned).collect() }
    }

    /// The result name of a scan; the same file keeps its name, in this run by its place, from run to run by its file name and
    /// its content, or else by its file name alone. `free` tells whether a name nobody has yet may be given.
    pub fn name_for(&mut self, scan: &Path, sha256: Option<&str>, free: impl Fn(&str) -> bool) -> String {
        let text = |part: Option<&std::ffi::OsStr>| part.map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let file_name = text(scan.file_name());
        let (stem, full) = (shortened(text(scan.file_stem())), shortened(file_name.clone()));
        let path = real_path(scan);
        let owner =
            || Owner { file_name: file_name.clone(), sha256: sha256.map(str::to_owned), path: Some(path.clone()) };
        let is_own = |known: &Owner| known.file_name == file_name && known.path.as_ref() == Some(&path);
        let is_same = |known: &Owner| {
            known.path.is_none()
                && known.file_name == file_name
                && sha256.is_some()
                && known.sha256.as_deref() == sha256
        };
        let by_place = self.owner_of.iter().find(|(_, known)| is_own(known));
        let known = by_place.or_else(|| self.owner_of.iter().find(|(_, known)| is_same(known)));
        if let Some(name) = known.map(|(name, _)| name.clone()) {
            self.owner_of.insert(name.clone(), owner());
            return name;
        }
        let numbered = (2..).map(|n| format!("{full} ({n})"));
        for name in [stem, full.clone()].into_iter().chain(numbered) {
            // `sequence.csv` and `manifest.sha256` belong to the folder.
            if name.is_empty() || name == "sequence" || name == "manifest" {
                continue;
            }
            let own = match self.owner_of.get(&name) {
                Some(known) => known.file_name == file_name && known.path.is_none(),
                None => free(&name),
            };
            if own {
                self.owner_of.insert(name.clone(), owner());
                return name;
            }
        }
        full
    }
}

/// The name under which a result is kept when a scan of the same name and another content comes, `number` from 1.
pub fn set_aside(name: &str, number: usize) -> String {
    format!("{name} (earlier {number})")
}

fn is_set_aside(name: &str) -> bool {
    let number = name.strip_suffix(')').and_then(|name| name.rsplit_once(" (earlier "));
    number.is_some_and(|(_, number)| number.parse::<usize>().is_ok())
}

/// One path for one file, however it was written; the file itself may be missing.
fn real_path(scan: &Path) -> PathBuf {
    let folder = scan.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
    folder.join(scan.file_name().unwrap_or_default())
}

fn shortened(mut text: String) -> String {
    if text.len() > LONGEST {
        text.truncate(text.floor_char_boundary(LONGEST - 1));
        text.push('~');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: fn(&str) -> bool = |_| true;

    #[test]
    fn two_scans_never_share_a_result() {
        let mut names = ResultNames::default();
        assert_eq!(names.name_for(Path::new("a/1.ply"), None, ANY), "1");
        assert_eq!(names.name_for(Path::new("a/1.xyz"), None, ANY), "1.xyz");
        assert_eq!(names.name_for(Path::new("b/1.ply"), None, ANY), "1.ply");
        assert_eq!(names.name_for(Path::new("c/1.ply"), None, ANY), "1.ply (2)");
        assert_eq!(names.name_for(Path::new("a/1.ply"), None, ANY), "1");
        assert_eq!(names.name_for(Path::new("a/sequence.ply"), None, ANY), "sequence.ply");
        assert_eq!(names.name_for(Path::new("a/2.ply"), None, |name| name != "2"), "2.ply");
    }

    #[test]
    fn a_later_run_gives_the_same_names_again() {
        let earlier = [("1", "1.ply", Some("a")), ("1.ply", "1.ply", Some("b")), ("1.xyz", "1.xyz", None)];
        let mut names = ResultNames::of_earlier_runs(earlier.into_iter());
        assert_eq!(names.name_for(Path::new("a/1.xyz"), None, ANY), "1.xyz");
        assert_eq!(names.name_for(Path::new("a/1.ply"), None, ANY), "1");
        assert_eq!(names.name_for(Path::new("b/1.ply"), None, ANY), "1.ply");
        assert_eq!(names.name_for(Path::new("b/1.txt"), None, ANY), "1.txt");
        // In another order: the content tells which is which.
        let mut names = ResultNames::of_earlier_runs(earlier.into_iter());
        assert_eq!(names.name_for(Path::new("b/1.ply"), Some("b"), ANY), "1.ply");
        assert_eq!(names.name_for(Path::new("b/1.ply"), Some("changed meanwhile"), ANY), "1.ply");
        assert_eq!(names.name_for(Path::new("c/1.ply"), Some("new"), ANY), "1");
        assert_eq!(names.name_for(Path::new("d/1.ply"), Some("new"), ANY), "1.ply (2)");
    }

    #[test]
    fn an_earlier_result_that_was_kept_gives_its_name_to_nobody() {
        let kept = set_aside("1", 1);
        let rows = [("1", "1.ply", Some("b")), (&*kept, "1.ply", Some("a"))];
        let mut names = ResultNames::of_earlier_runs(rows.into_iter());
        // The scan that lies there now is read from `1.json`, whatever was there before.
        assert_eq!(names.name_for(Path::new("a/1.ply"), Some("a"), ANY), "1");
        assert_eq!(names.name_for(Path::new("b/1.ply"), Some("c"), ANY), "1.ply");
        assert_eq!(names.name_for(&Path::new("a").join(format!("{kept}.ply")), Some("d"), ANY), format!("{kept}.ply"));
    }

    #[test]
    fn one_file_has_one_name_however_its_path_is_written() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("a")).unwrap();
        let mut names = ResultNames::default();
        for way in ["a/1.ply", "a/../a/1.ply", "./a/1.ply"] {
            assert_eq!(names.name_for(&dir.path().join(way), None, ANY), "1", "{way}");
        }
    }

    #[test]
    fn names_that_no_file_system_takes_are_shortened() {
        let mut names = ResultNames::default();
        let (first, second) = ("å".repeat(120) + "1.ply", "å".repeat(120) + "2.ply");
        let first = names.name_for(Path::new(&first), None, ANY);
        let second = names.name_for(Path::new(&second), None, ANY);
        assert!(first.len() <= LONGEST && second.len() <= LONGEST + 6 && first != second, "{first} {second}");
    }
}
