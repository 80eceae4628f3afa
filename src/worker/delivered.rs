//! Which content came under which name while a folder is watched: a scanner that delivers its old buffer again has measured nothing.

use super::watch::Listed;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What lay in the folder when the watch began, and what was made of since.
#[derive(Debug, Default)]
pub(super) struct Delivered {
    at_start: Option<BTreeMap<PathBuf, Option<SystemTime>>>,
    done: BTreeMap<PathBuf, (String, Option<SystemTime>)>,
}

impl Delivered {
    /// A look at the folder; the first one tells what lay there when the watch began.
    pub fn see(&mut self, listing: &[Listed]) {
        self.at_start.get_or_insert_with(|| listing.iter().map(|f| (f.path.clone(), f.modified)).collect());
    }

    /// A file with a content that has a result, of this watch or an earlier run, under the scan's name given: whether that content was
    /// delivered as another part's. What lay there when the watch began and `has_result` under its own name was told then; so was a scan that has
    /// another name now, but not a copy that lies beside it. A folder that comes back brings nothing new either.
    pub fn is_repeated(&self, file: &Listed, sha256: &str, inspected_as: &str, has_result: bool) -> bool {
        let newer = |then: Option<SystemTime>| then.zip(file.modified).is_some_and(|(then, now)| now > then);
        if let Some((_, then)) = self.done.get(&file.path).filter(|(content, _)| content == sha256) {
            return newer(*then);
        }
        if self.is_old(file) && is_named(&file.path, inspected_as) {
            return false;
        }
        if self.done.values().any(|(content, _)| content == sha256) {
            return true;
        }
        match self.at_start.as_ref().and_then(|files| files.get(&file.path)) {
            Some(then) => newer(*then) || (!has_result && self.lay_there(inspected_as)),
            None => !is_named(&file.path, inspected_as),
        }
    }

    fn lay_there(&self, scan: &str) -> bool {
        self.at_start.as_ref().is_some_and(|files| files.keys().any(|path| is_named(path, scan)))
    }

    /// Whether the file lay there as it is when the watch began.
    pub fn is_old(&self, file: &Listed) -> bool {
        self.at_start.as_ref().and_then(|files| files.get(&file.path)).is_some_and(|then| *then == file.modified)
    }

    /// The file was dealt with.
    pub fn note(&mut self, file: &Listed, sha256: &str) {
        self.done.insert(file.path.clone(), (sha256.to_owned(), file.modified));
    }
}

fn is_named(path: &Path, name: &str) -> bool {
    path.file_name().is_some_and(|own| own.to_string_lossy() == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn file(name: &str, s: u64) -> Listed {
        let modified = Some(SystemTime::UNIX_EPOCH + Duration::from_secs(s));
        Listed { path: format!("scans/{name}").into(), size: 1, modified }
    }

    #[test]
    fn what_lay_there_before_is_no_news_and_what_comes_again_is() {
        let mut delivered = Delivered::default();
        delivered.see(&[file("1.ply", 1), file("copy.ply", 2)]);
        delivered.see(&[file("1.ply", 1), file("copy.ply", 2), file("2.ply", 3)]);
        // Of an earlier run, whatever it was called then; but a copy that came while nobody watched was never told.
        assert!(!delivered.is_repeated(&file("1.ply", 1), "a", "1.ply", true));
        assert!(!delivered.is_repeated(&file("copy.ply", 2), "a", "1.ply", true));
        assert!(!delivered.is_repeated(&file("copy.ply", 2), "a", "another name.ply", false));
        assert!(delivered.is_repeated(&file("copy.ply", 2), "a", "1.ply", false));
        assert!(delivered.is_old(&file("1.ply", 1)) && !delivered.is_old(&file("1.ply", 2)));
        // Written again since; come since.
        assert!(delivered.is_repeated(&file("1.ply", 9), "a", "1.ply", true));
        assert!(delivered.is_repeated(&file("2.ply", 3), "a", "1.ply", true));
        // A share that was empty at first, and then shows what it holds.
        assert!(!delivered.is_repeated(&file("0.ply", 3), "b", "0.ply", true));
        delivered.note(&file("3.ply", 5), "c");
        assert!(!delivered.is_repeated(&file("3.ply", 5), "c", "3.ply", true), "the folder was away");
        assert!(delivered.is_repeated(&file("3.ply", 6), "c", "3.ply", true));
        assert!(delivered.is_repeated(&file("copy.ply", 2), "c", "3.ply", true), "inspected by this very watch");
        // A copy was told before the scan that it was made of was looked at.
        delivered.note(&file("copy.ply", 2), "a");
        assert!(!delivered.is_repeated(&file("1.ply", 1), "a", "1.ply", true));
    }
}
