//! `manifest.sha256`: the hashes of all result files, in the format of `sha256sum`, and the check of them.
//!
//! Files are announced before they are written and confirmed afterwards. Announcements stand in the manifest as comment
//! lines, which `sha256sum` skips:
//!
//! ```text
//! # writing HASH  NAME
//! # removing NAME
//! ```
//!
//! Whenever the program is ended, even by a power cut, each file therefore is the old one or the new one, and the manifest
//! knows both.

use super::atomic;
use crate::diagnostic::Diagnostic;
use crate::io::read_plain;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The manifest's file name.
pub const FILE: &str = "manifest.sha256";

/// Kinds of files that the program writes; a file of another kind in the folder is none of our business.
pub const RESULT_KINDS: [&str; 5] = ["json", "txt", "pdf", "csv", "ply"];

/// Hash by file name, sorted by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Manifest {
    entries: BTreeMap<String, String>,
    /// What is being written: the hash to come, or `None` for a file about to be removed.
    announced: BTreeMap<String, Option<String>>,
}

const WRITING: &str = "# writing ";
const REMOVING: &str = "# removing ";

/// What a check of a results folder found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verified {
    /// Files that are as the manifest says.
    pub intact: usize,
    /// One error a file that is missing, changed or not listed.
    pub problems: Vec<Diagnostic>,
    /// Files whose writing was announced and never confirmed: a run was ended in the middle of a part.
    pub interrupted: Vec<String>,
}

impl Manifest {
    /// Reads the manifest of a folder; an empty one when there is none yet.
    pub fn load(folder: &Path) -> Result<Self, Diagnostic> {
        let path = folder.join(FILE);
        match read_plain(&path) {
            Ok(bytes) => Self::parse(&bytes).map_err(|d| d.in_file(&path)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(Diagnostic::error(format!("cannot read: {error}")).in_file(&path)),
        }
    }

    /// Takes note of a file that was just written. The name is relative to the results folder.
    pub fn record(&mut self, name: &str, bytes: &[u8]) {
        self.entries.insert(name.to_owned(), hex(&Sha256::digest(bytes)));
    }

    /// Whether the file is listed, or about to be.
    pub fn lists(&self, name: &str) -> bool {
        self.entries.contains_key(name) || self.announced.contains_key(name)
    }

    /// The listed hash of a file.
    pub fn hash_of(&self, name: &str) -> Option<&str> {
        self.entries.get(name).map(String::as_str)
    }

    /// A file is going to be written with this content, or (`None`) removed.
    pub fn announce(&mut self, name: &str, content: Option<&[u8]>) {
        self.announced.insert(name.to_owned(), content.map(|bytes| hex(&Sha256::digest(bytes))));
    }

    /// A listed file is going to be copied. The copy is listed with the hash that the file had when it was written: a change
    /// since then does not become right by it.
    pub fn announce_copy(&mut self, name: &str, copy: &str) {
        if let Some(hash) = self.entries.get(name) {
            self.announced.insert(copy.to_owned(), Some(hash.clone()));
        }
    }

    /// All that was announced has been done.
    pub fn confirm(&mut self) {
        for (name, hash) in std::mem::take(&mut self.announced) {
            match hash {
                Some(hash) => self.entries.insert(name, hash),
                None => self.entries.remove(&name),
            };
        }
    }

    /// After an interrupted run: looks which of the announced files were written, lists those, and forgets the
    /// announcements.
    pub fn settle(&mut self, folder: &Path) {
        for (name, hash) in std::mem::take(&mut self.announced) {
            let found = read_plain(&folder.join(&name)).map(|bytes| hex(&Sha256::digest(&bytes)));
            match (hash, found) {
                (Some(hash), Ok(found)) if found == hash => {
                    self.entries.insert(name, hash);
                }
                (None, Err(error)) if error.kind() == std::io::ErrorKind::NotFound => {
                    self.entries.remove(&name);
                }
                _ => {}
            }
        }
    }

    /// The listed files with their hashes, sorted by name.
    pub fn entries(&self) -> impl Iterator<Item = (&str, &str)> {
        self.entries.iter().map(|(name, hash)| (name.as_str(), hash.as_str()))
    }

    /// Writes `manifest.sha256` into the folder, whole or not at all.
    pub fn write(&self, folder: &Path) -> Result<(), Diagnostic> {
        atomic::write(&folder.join(FILE), self.to_text().as_bytes())
    }

    /// The text, one line `hash  name` a file. Like `sha256sum`, a name with a backslash or a line break is escaped and
    /// its line opens with a backslash.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for (name, hash) in &self.entries {
            let escaped = escape(name);
            if escaped != *name {
                text.push('\\');
            }
            text.push_str(&format!("{hash}  {escaped}\n"));
        }
        for (name, hash) in &self.announced {
            let escaped = escape(name);
            text.push_str(&match hash {
                Some(hash) => format!("{WRITING}{hash}  {escaped}\n"),
                None => format!("{REMOVING}{escaped}\n"),
            });
        }
        text
    }

    fn parse(bytes: &[u8]) -> Result<Self, Diagnostic> {
        let text = std::str::from_utf8(bytes).map_err(|_| Diagnostic::error("is not UTF-8 text"))?;
        let mut manifest = Self::default();
        for (k, line) in text.lines().enumerate() {
            manifest.take_line(line).ok_or_else(|| {
                Diagnostic::error("expected 64 hexadecimal digits, two blanks and a file name of this folder")
                    .at_line(k + 1)
                    .with_help("the manifest was changed; run the inspection again into a new folder")
            })?;
        }
        Ok(manifest)
    }

    fn take_line(&mut self, line: &str) -> Option<()> {
        if let Some(line) = line.strip_prefix(WRITING) {
            let (hash, name) = parse_line(&format!("\\{line}"))?;
            self.announced.insert(name, Some(hash));
        } else if let Some(name) = line.strip_prefix(REMOVING) {
            self.announced.insert(unescape(name).filter(|name| is_inside(name))?, None);
        } else if !line.starts_with('#') {
            let (hash, name) = parse_line(line)?;
            self.entries.insert(name, hash);
        }
        Some(())
    }
}

/// One line; `None` when it is not in the format or its name leads out of the folder.
fn parse_line(line: &str) -> Option<(String, String)> {
    let (line, escaped) = match line.strip_prefix('\\') {
        Some(line) => (line, true),
        None => (line, false),
    };
    let (hash, name) = line.split_at_checked(64)?;
    let name = name.strip_prefix("  ").or_else(|| name.strip_prefix(" *"))?;
    let name = if escaped { unescape(name)? } else { name.to_owned() };
    (is_inside(&name) && hash.bytes().all(|b| b.is_ascii_hexdigit())).then(|| (hash.to_ascii_lowercase(), name))
}

/// Whether a name stays in its folder.
fn is_inside(name: &str) -> bool {
    let plain = !name.is_empty() && name != "." && name != ".." && !name.contains(['/', '\0']);
    plain && Path::new(name).components().count() == 1
}

fn escape(name: &str) -> String {
    name.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r")
}

fn unescape(name: &str) -> Option<String> {
    let mut text = String::with_capacity(name.len());
    let mut chars = name.chars();
    while let Some(c) = chars.next() {
        text.push(match c {
            '\\' => match chars.next()? {
                '\\' => '\\',
                'n' => '\n',
                'r' => '\r',
                _ => return None,
            },
            c => c,
        });
    }
    Some(text)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Takes the named files of the folder into its manifest, hashed as they lie there, and writes it. Entries of earlier
/// runs stay, with the hash that they had when they were written.
pub fn write(folder: &Path, names: &[String]) -> Result<(), Diagnostic> {
    let mut manifest = Manifest::load(folder)?;
    for name in names {
        let path = folder.join(name);
        let bytes = read_plain(&path).map_err(|e| Diagnostic::error(format!("cannot read: {e}")).in_file(&path))?;
        manifest.record(name, &bytes);
    }
    manifest.write(folder)
}

/// Checks a results folder against its manifest. An error when there is no manifest to check against.
pub fn verify(folder: &Path) -> Result<Verified, Diagnostic> {
    let path = folder.join(FILE);
    if !folder.is_dir() {
        return Err(Diagnostic::error("there is no such folder").in_file(folder).with_help("give a results folder"));
    }
    if !path.is_file() {
        return Err(Diagnostic::error("the folder has no manifest.sha256, nothing can be checked")
            .in_file(folder)
            .with_help("give a folder into which `shapeline run` wrote its results"));
    }
    let manifest = Manifest::load(folder)?;
    let interrupted = manifest.announced.keys().cloned().collect();
    let mut verified = Verified { intact: 0, problems: Vec::new(), interrupted };
    for (name, hash) in &manifest.entries {
        let announced = manifest.announced.get(name);
        let path = folder.join(name);
        match check(&path, hash) {
            Ok(()) => verified.intact += 1,
            Err(_) if announced.is_some_and(|new| is_done(&path, new.as_deref())) => verified.intact += 1,
            Err(problem) => verified.problems.push(problem),
        }
    }
    let new_files = manifest.announced.iter().filter(|(name, _)| !manifest.entries.contains_key(*name));
    for (name, hash) in new_files {
        let path = folder.join(name);
        match hash {
            Some(hash) if path.exists() => match check(&path, hash) {
                Ok(()) => verified.intact += 1,
                Err(problem) => verified.problems.push(problem),
            },
            _ => {}
        }
    }
    verified.problems.extend(unlisted(folder, &manifest)?);
    Ok(verified)
}

/// Whether a file already is as it was announced: of this content, or gone.
fn is_done(path: &Path, announced: Option<&str>) -> bool {
    match announced {
        Some(hash) => check(path, hash).is_ok(),
        None => !path.exists(),
    }
}

fn check(path: &Path, hash: &str) -> Result<(), Diagnostic> {
    // A link could show us another file's content under this name.
    let is_file = fs::symlink_metadata(path).is_ok_and(|m| m.is_file());
    let bytes = match read_plain(path) {
        Ok(bytes) if is_file => bytes,
        Ok(_) => return Err(Diagnostic::error("is a link, expected a file").in_file(path)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Diagnostic::error("is in the manifest but not in the folder").in_file(path));
        }
        Err(error) => return Err(Diagnostic::error(format!("cannot read: {error}")).in_file(path)),
    };
    if hex(&Sha256::digest(&bytes)) == hash {
        Ok(())
    } else {
        Err(Diagnostic::error("was changed after it was written").in_file(path))
    }
}

/// Result files that nobody recorded.
fn unlisted(folder: &Path, manifest: &Manifest) -> Result<Vec<Diagnostic>, Diagnostic> {
    let failed = |e: std::io::Error| Diagnostic::error(format!("cannot read the folder: {e}")).in_file(folder);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let kind = Path::new(&name).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let ours = kind.is_some_and(|kind| RESULT_KINDS.contains(&kind.as_str())) && !name.starts_with('.');
        let is_folder = entry.file_type().is_ok_and(|t| t.is_dir());
        if ours && !is_folder && !manifest.lists(&name) {
            names.push(name);
        }
    }
    names.sort();
    let problem = |name: String| Diagnostic::error("is not in the manifest").in_file(&folder.join(name));
    Ok(names.into_iter().map(problem).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let names = ["0001.json", "0001.txt", "sequence.csv", "odd \\ na\nme å.pdf"];
        for name in names {
            fs::write(folder.path().join(name), name.as_bytes()).unwrap();
        }
        write(folder.path(), &names.map(str::to_owned)).unwrap();
        folder
    }

    fn messages(folder: &Path) -> Vec<String> {
        verify(folder).unwrap().problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn an_untouched_folder_has_no_problem() {
        let folder = folder();
        fs::write(folder.path().join("notes.md"), "mine").unwrap();
        let verified = verify(folder.path()).unwrap();
        assert_eq!(verified, Verified { intact: 4, problems: Vec::new(), interrupted: Vec::new() });
    }

    #[test]
    fn changed_missing_and_extra_files_are_told() {
        let folder = folder();
        fs::write(folder.path().join("0001.txt"), "0001.tyt").unwrap();
        fs::remove_file(folder.path().join("0001.json")).unwrap();
        fs::write(folder.path().join("0002.pdf"), "planted").unwrap();
        let problems = messages(folder.path());
        assert_eq!(problems.len(), 3, "{problems:?}");
        assert!(problems[0].contains("0001.json") && problems[0].contains("not in the folder"));
        assert!(problems[1].contains("0001.txt") && problems[1].contains("changed"));
        assert!(problems[2].contains("0002.pdf") && problems[2].contains("not in the manifest"));
    }

    #[test]
    fn recording_again_keeps_the_others() {
        let folder = folder();
        fs::write(folder.path().join("sequence.csv"), "longer now").unwrap();
        assert_eq!(messages(folder.path()).len(), 1);
        write(folder.path(), &["sequence.csv".to_owned()]).unwrap();
        assert!(messages(folder.path()).is_empty());
        assert_eq!(verify(folder.path()).unwrap().intact, 4);
    }

    #[test]
    fn the_text_is_what_sha256sum_writes() {
        let mut manifest = Manifest::default();
        manifest.record("b.txt", b"abc");
        manifest.record("a\\\nb", b"");
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let nothing = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(manifest.to_text(), format!("\\{nothing}  a\\\\\\nb\n{abc}  b.txt\n"));
        assert_eq!(Manifest::parse(manifest.to_text().as_bytes()).unwrap(), manifest);
    }

    #[test]
    fn names_out_of_the_folder_and_broken_lines_are_refused() {
        let hash = "0".repeat(64);
        for line in [format!("{hash}  ../x"), format!("{hash}  /etc/passwd"), format!("{hash}  "), "x".to_owned()] {
            let problem = Manifest::parse(line.as_bytes()).unwrap_err();
            assert_eq!(problem.line, Some(1));
        }
        let mut wide = "ä".repeat(40);
        wide.push_str("  x");
        assert!(Manifest::parse(wide.as_bytes()).is_err());
        assert!(verify(tempfile::tempdir().unwrap().path()).is_err());
    }

    #[test]
    fn wherever_a_run_is_ended_the_folder_is_consistent() {
        let folder = folder();
        let path = folder.path();
        let news: [(&str, Option<&[u8]>); 4] = [
            ("0001.json", Some(b"new")),
            ("0001.txt", None),
            ("0002\nodd.json", Some(b"first")),
            ("sequence.csv", Some(b"longer")),
        ];
        let mut manifest = Manifest::load(path).unwrap();
        for (name, content) in news {
            manifest.announce(name, content);
        }
        manifest.write(path).unwrap();
        for done in 0..=news.len() {
            let verified = verify(path).unwrap();
            assert_eq!((verified.problems.len(), verified.interrupted.len()), (0, 4), "{done}: {verified:?}");
            let mut settled = Manifest::load(path).unwrap();
            settled.settle(path);
            settled.write(path).unwrap();
            let verified = verify(path).unwrap();
            assert_eq!((verified.problems.len(), verified.interrupted.len()), (0, 0), "{done}: {verified:?}");
            manifest.write(path).unwrap();
            match news.get(done) {
                Some((name, Some(content))) => fs::write(path.join(name), content).unwrap(),
                Some((name, None)) => fs::remove_file(path.join(name)).unwrap(),
                None => {}
            }
        }
        manifest.confirm();
        manifest.write(path).unwrap();
        let verified = verify(path).unwrap();
        assert_eq!((verified.problems.len(), verified.interrupted.len(), verified.intact), (0, 0, 4));
    }

    #[test]
    fn an_announced_file_with_another_content_is_still_a_problem() {
        let folder = folder();
        let mut manifest = Manifest::load(folder.path()).unwrap();
        manifest.announce("0001.json", Some(b"new"));
        manifest.announce("0002.json", Some(b"new"));
        manifest.write(folder.path()).unwrap();
        fs::write(folder.path().join("0001.json"), "planted").unwrap();
        fs::write(folder.path().join("0002.json"), "planted").unwrap();
        assert_eq!(messages(folder.path()).len(), 2);
    }
}
