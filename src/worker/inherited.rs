//! What a results folder holds before a run: another run's lock, leftovers of a killed one, its table and manifest. A damaged
//! one is kept under another name and never stops the work.

use crate::diagnostic::Diagnostic;
use crate::io::{read_plain, sha256_hex};
use crate::report::atomic;
use crate::report::manifest::Manifest;
use crate::report::sequence::{self, SequenceTable};
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Keeps two runs from writing into one folder, where the system can. The lock leaves no file and ends with the process.
pub(super) fn lock(path: &Path) -> Result<Option<File>, Diagnostic> {
    match try_lock(path) {
        Ok(lock) => Ok(Some(lock)),
        Err(TryLockError::WouldBlock) => Err(Diagnostic::error("another run is writing into this results folder")
            .in_file(path)
            .with_help("wait for it or stop it, or give another folder with --out")),
        // Some file systems have no locks.
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// The lock is on the folder itself.
#[cfg(not(windows))]
fn try_lock(path: &Path) -> Result<File, TryLockError> {
    let folder = File::open(path).map_err(TryLockError::Error)?;
    folder.try_lock()?;
    Ok(folder)
}

/// Windows opens no folder as a file: there it is a file in it that nobody else may open and that goes with its handle.
#[cfg(windows)]
fn try_lock(path: &Path) -> Result<File, TryLockError> {
    use std::os::windows::fs::OpenOptionsExt;
    const FILE_FLAG_DELETE_ON_CLOSE: u32 = 0x0400_0000;
    const ERROR_SHARING_VIOLATION: i32 = 32;
    let mut options = fs::OpenOptions::new();
    options.read(true).write(true).create(true).share_mode(0).custom_flags(FILE_FLAG_DELETE_ON_CLOSE);
    options.open(path.join(".shapeline-lock")).map_err(|error| match error.raw_os_error() {
        Some(ERROR_SHARING_VIOLATION) => TryLockError::WouldBlock,
        _ => TryLockError::Error(error),
    })
}

/// Removes half-written files of a run that was killed. The lock says that nobody is writing here.
pub(super) fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if atomic::is_leftover(&name.to_string_lossy()) {
            // One that cannot be removed harms nobody.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The table to go on with. One that cannot be read is set aside; of one that was changed by somebody a copy is kept.
pub(super) fn load_table(
    folder: &Path,
    manifest: &Manifest,
    warnings: &mut Vec<Diagnostic>,
) -> Result<SequenceTable, Diagnostic> {
    let table = match SequenceTable::load(folder) {
        Ok(table) => table,
        Err(damage) => {
            warnings.push(set_aside(folder, sequence::FILE, &damage)?);
            return Ok(SequenceTable::default());
        }
    };
    let path = folder.join(sequence::FILE);
    let Some(listed) = manifest.hash_of(sequence::FILE) else { return Ok(table) };
    match read_plain(&path) {
        Ok(bytes) if sha256_hex(&bytes) == listed => {}
        Ok(_) => {
            let copy = free_name(folder, sequence::FILE, "changed");
            let kept = fs::copy(&path, &copy).is_ok();
            let words = if kept { format!(", a copy is kept as {}", copy.display()) } else { String::new() };
            let warning =
                Diagnostic::warning(format!("was changed after it was written{words}; its rows are taken over"));
            warnings.push(warning.in_file(&path).with_help("compare it with the JSON results, which verify checks"));
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let warning = Diagnostic::warning("is gone, a new one is begun").in_file(&path);
            warnings.push(warning.with_help("scans of earlier runs may be inspected once more"));
        }
        Err(_) => {}
    }
    Ok(table)
}

/// Renames a file that cannot be used, so that production goes on and nothing is lost.
pub(super) fn set_aside(folder: &Path, name: &str, damage: &Diagnostic) -> Result<Diagnostic, Diagnostic> {
    let (path, aside) = (folder.join(name), free_name(folder, name, "damaged"));
    fs::rename(&path, &aside).map_err(|e| {
        Diagnostic::error(format!("cannot be used ({}) and cannot be moved away: {e}", damage.message))
            .in_file(&path)
            .with_help("move it away, or give another folder with --out")
    })?;
    let words = damage.message.as_str();
    let damage = damage.line.map_or_else(|| words.to_owned(), |line| format!("line {line}: {words}"));
    let message = format!("cannot be used: {damage}; kept as {}, a new one is begun", aside.display());
    Ok(Diagnostic::warning(message).in_file(&path).with_help("look what changed it; the scans are not concerned"))
}

/// `NAME.WORD`, or `NAME.WORD-2` and on where that is taken.
fn free_name(folder: &Path, name: &str, word: &str) -> PathBuf {
    let first = folder.join(format!("{name}.{word}"));
    let mut others = (2..).map(|n| folder.join(format!("{name}.{word}-{n}")));
    if first.exists() { others.find(|path| !path.exists()).unwrap_or(first) } else { first }
}

#[cfg(test)]
mod tests {
    use super::super::results::ResultsFolder;
    use super::*;
    use crate::plan::OutputFormat;
    use crate::report::manifest;

    /// Opens the folder; the warnings.
    fn open(path: &Path) -> Vec<String> {
        let (_, warnings) = ResultsFolder::open(path, &[OutputFormat::Ply]).unwrap();
        warnings.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn damaged_tables_are_kept_aside_and_do_not_stop_the_work() {
        let dir = tempfile::tempdir().unwrap();
        for round in ["damaged", "damaged-2"] {
            fs::write(dir.path().join(manifest::FILE), "no manifest").unwrap();
            fs::write(dir.path().join(sequence::FILE), b"\xff\xfe").unwrap();
            let warnings = open(dir.path());
            assert_eq!(warnings.len(), 2, "{warnings:?}");
            for file in [manifest::FILE, sequence::FILE] {
                let aside = format!("{file}.{round}");
                assert!(dir.path().join(&aside).is_file(), "{aside}");
                assert!(warnings.iter().any(|w| w.contains(&aside)), "{warnings:?}");
            }
        }
        assert!(open(dir.path()).is_empty());
    }

    #[test]
    fn a_changed_table_is_told_and_a_copy_kept() {
        let dir = tempfile::tempdir().unwrap();
        let table = format!("{}\n", sequence::HEADER);
        fs::write(dir.path().join(sequence::FILE), &table).unwrap();
        manifest::write(dir.path(), &[sequence::FILE.to_owned()]).unwrap();
        assert!(open(dir.path()).is_empty());
        fs::write(dir.path().join(sequence::FILE), table.replace('\n', "\r\n")).unwrap();
        let warnings = open(dir.path());
        assert!(warnings.len() == 1 && warnings[0].contains("sequence.csv.changed"), "{warnings:?}");
        fs::remove_file(dir.path().join(sequence::FILE)).unwrap();
        let warnings = open(dir.path());
        assert!(warnings.len() == 1 && warnings[0].contains("is gone"), "{warnings:?}");
    }
}
