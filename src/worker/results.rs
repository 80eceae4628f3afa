//! The results folder: every file whole, its manifest and its table of scans up to date after each part.

use super::names::ResultNames;
use super::watch::Listed;
use crate::diagnostic::Diagnostic;
use crate::inspect::{Inspected, Outcome};
use crate::io::{read_plain, sha256_hex};
use crate::part::Part;
use crate::plan::OutputFormat;
use crate::report::manifest::{self, Manifest};
use crate::report::sequence::{self, Row, SequenceTable};
use crate::report::{self, MapScene, atomic};
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// A folder that takes results. What stood in it from earlier runs stays and stays listed.
#[derive(Debug)]
pub struct ResultsFolder {
    path: PathBuf,
    /// The same, absolute and without links.
    real_path: PathBuf,
    formats: Vec<OutputFormat>,
    manifest: Manifest,
    table: SequenceTable,
    names: ResultNames,
    /// Names of files in this folder that are scans, and therefore never written over.
    scans_here: BTreeSet<String>,
    /// Keeps other runs out as long as this one lives.
    _lock: Option<File>,
}

/// The reports of one scan, not written yet: file names with their bytes, `None` for a report that is to go.
pub type Printed = Vec<(String, Option<Vec<u8>>)>;

impl ResultsFolder {
    /// Opens the folder, making it where it is not there yet, and finds out whether it can be written. The second value
    /// are warnings: a damaged table or manifest is kept under another name and never stops the work.
    pub fn open(path: &Path, formats: &[OutputFormat]) -> Result<(Self, Vec<Diagnostic>), Diagnostic> {
        fs::create_dir_all(path).map_err(|e| {
            Diagnostic::error(format!("the results folder cannot be made: {e}"))
                .in_file(path)
                .with_help("check [output] folder in the plan, or give another with --out")
        })?;
        let lock = lock(path)?;
        remove_leftovers(path);
        let mut formats = formats.to_vec();
        if !formats.contains(&OutputFormat::Json) {
            // The JSON file is the result that all others can be checked against; it is always there.
            formats.push(OutputFormat::Json);
        }
        let mut warnings = Vec::new();
        let mut manifest = match Manifest::load(path) {
            Ok(manifest) => manifest,
            Err(damage) => {
                warnings.push(set_aside(path, manifest::FILE, &damage)?);
                Manifest::default()
            }
        };
        manifest.settle(path);
        let table = load_table(path, &manifest, &mut warnings)?;
        manifest.write(path)?;
        let names = ResultNames::of_earlier_runs(table.rows().iter().map(|r| (&*r.result, &*r.scan, r.scan_sha256())));
        let real_path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let scans_here = BTreeSet::new();
        let folder =
            Self { path: path.to_path_buf(), real_path, formats, manifest, table, names, scans_here, _lock: lock };
        Ok((folder, warnings))
    }

    /// Opens the folder again after it could not be written; it is not made anew, for it may lie on a disk that is away.
    pub fn reopen(&mut self) -> Result<Vec<Diagnostic>, Diagnostic> {
        if !self.path.is_dir() {
            return Err(Diagnostic::error("the results folder is not there").in_file(&self.path));
        }
        // The old lock goes first: this very run holds it.
        self._lock = None;
        let (mut folder, warnings) = Self::open(&self.path, &self.formats)?;
        folder.scans_here = std::mem::take(&mut self.scans_here);
        *self = folder;
        Ok(warnings)
    }

    /// Leaves this program's own files out of a listing of scans and keeps the others from being written over, should
    /// scans and results share a folder.
    pub fn sift(&mut self, folder: &Path, listing: &mut Vec<Listed>) {
        if !fs::canonicalize(folder).is_ok_and(|folder| folder == self.real_path) {
            return;
        }
        listing.retain(|file| file_name(&file.path).is_none_or(|name| !self.is_own(&name)));
        self.scans_here = listing.iter().filter_map(|file| file_name(&file.path)).collect();
    }

    /// Keeps scans that were named by hand from being written over.
    pub fn keep_scans(&mut self, scans: &[PathBuf]) {
        for scan in scans {
            let folder = scan.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            if fs::canonicalize(folder).is_ok_and(|folder| folder == self.real_path) {
                self.scans_here.extend(file_name(scan));
            }
        }
    }

    fn is_own(&self, name: &str) -> bool {
        name == manifest::FILE || name == sequence::FILE || self.manifest.lists(name)
    }

    /// The reports of one scan as bytes. Takes the time, writes nothing.
    pub fn print(&mut self, scan: &Path, inspected: &Inspected, part: &Part) -> (String, Printed) {
        let endings: Vec<&str> = self.formats.iter().map(|format| ending_of(*format)).collect();
        let (folder, scans, manifest) = (&self.path, &self.scans_here, &self.manifest);
        let taken = |file: &str| scans.contains(file) || (!manifest.lists(file) && folder.join(file).exists());
        let free = |name: &str| {
            was_written_by_us(folder, name) || !endings.iter().any(|ending| taken(&format!("{name}.{ending}")))
        };
        let name = self.names.name_for(scan, inspected.result.identity.scan_sha256.as_deref(), free);
        let print = |format: &OutputFormat| (format!("{name}.{}", ending_of(*format)), print(*format, inspected, part));
        let printed = self.formats.iter().map(print).collect();
        (name, printed)
    }

    /// A word of warning where the reports will replace those of a scan with another content, of an earlier run or of this one.
    pub fn replaces(&self, name: &str, inspected: &Inspected) -> Option<Diagnostic> {
        let row = self.table.row_of(name)?;
        let (before, now) = (row.scan_sha256()?, inspected.result.identity.scan_sha256.as_deref()?);
        let message = format!("\"{name}\": the result of a scan {} with another content is replaced", row.scan);
        let help = "to keep both, give the scans names of their own or run into another folder with --out";
        (before != now).then(|| Diagnostic::warning(message).in_file(&self.path).with_help(help))
    }

    /// Writes the reports of one scan and the table, and confirms them in the manifest. Ended at any moment, the folder is
    /// consistent: the manifest knows of every file what it was and what it was to become. Returns the files written. Where one cannot
    /// be written, those before it stay and are listed; the table, the last of them, has no row of the scan then.
    pub fn store(&mut self, name: &str, printed: Printed, inspected: &Inspected) -> Result<Vec<PathBuf>, Diagnostic> {
        self.table.put(name, &inspected.result);
        let mut batch = printed;
        // A report that is to go and never was there needs no word.
        batch.retain(|(file, content)| content.is_some() || self.manifest.lists(file));
        batch.push((sequence::FILE.to_owned(), Some(self.table.to_csv().into_bytes())));
        for (file, content) in &batch {
            self.manifest.announce(file, content.as_deref());
        }
        let written = self.manifest.write(&self.path).and_then(|()| write_batch(&self.path, &batch));
        match &written {
            Ok(_) => self.manifest.confirm(),
            // What was written before the fault is listed as it lies there, as far as the disk still takes the list.
            Err(_) => self.manifest.settle(&self.path),
        }
        let listed = self.manifest.write(&self.path);
        let mut files = written?;
        listed?;
        // The table is not one of the scan's own reports.
        files.pop();
        Ok(files)
    }

    /// Where the same bytes were inspected before, by the same plan and CAD.
    pub fn inspected_as(&self, scan_sha256: &str, plan_sha256: &str, cad_sha256: &str) -> Option<&Row> {
        self.table.inspected_as(scan_sha256, plan_sha256, cad_sha256)
    }
}

/// Writes or removes file after file, in order, until one fails.
fn write_batch(folder: &Path, batch: &Printed) -> Result<Vec<PathBuf>, Diagnostic> {
    let mut files = Vec::new();
    for (file, content) in batch {
        let path = folder.join(file);
        match content {
            Some(bytes) => {
                atomic::write(&path, bytes)?;
                files.push(path);
            }
            None => remove(&path)?,
        }
    }
    Ok(files)
}

/// Whether a result of that name stands in the folder though no manifest lists it (any more).
fn was_written_by_us(folder: &Path, name: &str) -> bool {
    let path = folder.join(format!("{name}.json"));
    if !path.is_file() {
        return false;
    }
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(64).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains("\"schema\": \"shapeline-result/")
}

fn file_name(path: &Path) -> Option<String> {
    path.file_name().map(|name| name.to_string_lossy().into_owned())
}

/// Keeps two runs from writing into one folder, where the system can. The lock is on the folder itself, leaves no file and
/// ends with the process.
fn lock(path: &Path) -> Result<Option<File>, Diagnostic> {
    let Ok(folder) = File::open(path) else { return Ok(None) };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::WouldBlock) => Err(Diagnostic::error("another run is writing into this results folder")
            .in_file(path)
            .with_help("wait for it or stop it, or give another folder with --out")),
        // Some file systems have no locks.
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Removes half-written files of a run that was killed. The lock says that nobody is writing here.
fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if atomic::is_leftover(&name.to_string_lossy()) {
            // One that cannot be removed harms nobody.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The table to go on with. One that cannot be read is set aside; of one that was changed by somebody a copy is kept.
fn load_table(folder: &Path, manifest: &Manifest, warnings: &mut Vec<Diagnostic>) -> Result<SequenceTable, Diagnostic> {
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
fn set_aside(folder: &Path, name: &str, damage: &Diagnostic) -> Result<Diagnostic, Diagnostic> {
    let (path, aside) = (folder.join(name), free_name(folder, name, "damaged"));
    fs::rename(&path, &aside).map_err(|e| {
        Diagnostic::error(format!("cannot be used ({}) and cannot be moved away: {e}", damage.message))
            .in_file(&path)
            .with_help("move it away, or give another folder with --out")
    })?;
    let place = damage.line.map(|line| format!(" line {line}:")).unwrap_or_default();
    let message = format!("cannot be used:{place} {}; kept as {}, a new one is begun", damage.message, aside.display());
    Ok(Diagnostic::warning(message).in_file(&path).with_help("look what changed it; the scans are not concerned"))
}

/// `NAME.WORD`, or `NAME.WORD-2` and on where that is taken.
fn free_name(folder: &Path, name: &str, word: &str) -> PathBuf {
    let first = folder.join(format!("{name}.{word}"));
    let mut others = (2..).map(|n| folder.join(format!("{name}.{word}-{n}")));
    if first.exists() { others.find(|path| !path.exists()).unwrap_or(first) } else { first }
}

/// Removes what an earlier run said of a scan in a format that has nothing to say now.
fn remove(path: &Path) -> Result<(), Diagnostic> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(Diagnostic::error(format!("an outdated result cannot be removed: {e}")).in_file(path))
        }
        _ => Ok(()),
    }
}

/// The file's ending in each format.
pub(super) fn ending_of(format: OutputFormat) -> &'static str {
    match format {
        OutputFormat::Ascii => "txt",
        OutputFormat::Json => "json",
        OutputFormat::Pdf => "pdf",
        OutputFormat::Csv => "csv",
        OutputFormat::Ply => "ply",
    }
}

/// The bytes of one format; `None` where a refused scan has nothing to show in it.
fn print(format: OutputFormat, inspected: &Inspected, part: &Part) -> Option<Vec<u8>> {
    let result = &inspected.result;
    match format {
        OutputFormat::Json => Some(report::json(result).into_bytes()),
        OutputFormat::Ascii => Some(report::ascii(result).into_bytes()),
        OutputFormat::Csv => Some(report::csv(result).into_bytes()),
        OutputFormat::Ply => match &result.outcome {
            Outcome::Measured(_) => Some(report::ply(result, inspected.scan.as_ref()?)),
            Outcome::Refused(_) => None,
        },
        OutputFormat::Pdf => {
            let scene = inspected.scan.as_ref().map(|scan| MapScene { part, scan });
            Some(report::pdf(result, scene.as_ref()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(path: &Path) -> (ResultsFolder, Vec<String>) {
        let (folder, warnings) = ResultsFolder::open(path, &[OutputFormat::Ply]).unwrap();
        (folder, warnings.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn damaged_tables_are_kept_aside_and_do_not_stop_the_work() {
        let dir = tempfile::tempdir().unwrap();
        for round in ["damaged", "damaged-2"] {
            fs::write(dir.path().join(manifest::FILE), "no manifest").unwrap();
            fs::write(dir.path().join(sequence::FILE), b"\xff\xfe").unwrap();
            let (_, warnings) = open(dir.path());
            assert_eq!(warnings.len(), 2, "{warnings:?}");
            for file in [manifest::FILE, sequence::FILE] {
                let aside = format!("{file}.{round}");
                assert!(dir.path().join(&aside).is_file(), "{aside}");
                assert!(warnings.iter().any(|w| w.contains(&aside)), "{warnings:?}");
            }
        }
        assert!(open(dir.path()).1.is_empty());
    }

    #[test]
    fn a_changed_table_is_told_and_a_copy_kept() {
        let dir = tempfile::tempdir().unwrap();
        let table = format!("{}\n", sequence::HEADER);
        fs::write(dir.path().join(sequence::FILE), &table).unwrap();
        manifest::write(dir.path(), &[sequence::FILE.to_owned()]).unwrap();
        assert!(open(dir.path()).1.is_empty());
        fs::write(dir.path().join(sequence::FILE), table.replace('\n', "\r\n")).unwrap();
        let (_, warnings) = open(dir.path());
        assert!(warnings.len() == 1 && warnings[0].contains("sequence.csv.changed"), "{warnings:?}");
        fs::remove_file(dir.path().join(sequence::FILE)).unwrap();
        let (_, warnings) = open(dir.path());
        assert!(warnings.len() == 1 && warnings[0].contains("is gone"), "{warnings:?}");
    }

    #[test]
    fn one_run_at_a_time_writes_into_a_folder() {
        let dir = tempfile::tempdir().unwrap();
        let (mut first, _) = open(dir.path());
        let second = ResultsFolder::open(dir.path(), &[]).unwrap_err();
        assert!(second.message.contains("another run"), "{second}");
        first.reopen().unwrap();
        assert!(ResultsFolder::open(dir.path(), &[]).is_err());
        drop(first);
        assert!(ResultsFolder::open(dir.path(), &[]).is_ok());
    }

    #[test]
    fn what_was_written_before_a_fault_is_listed() {
        let dir = tempfile::tempdir().unwrap();
        let (mut folder, _) = open(dir.path());
        let inspected = Inspected { result: crate::report::example::bracket(), scan: None };
        let printed = |text: &str| -> Printed {
            ["1.json", "1.txt", "1.csv"].map(|file| (file.to_owned(), Some(text.as_bytes().to_vec()))).into()
        };
        folder.store("1", printed("first"), &inspected).unwrap();
        let table = fs::read(dir.path().join(sequence::FILE)).unwrap();
        // A folder in the place of the second file: as good as a full disk, and root cannot write it either.
        fs::remove_file(dir.path().join("1.txt")).unwrap();
        fs::create_dir(dir.path().join("1.txt")).unwrap();
        let fault = folder.store("1", printed("second"), &inspected).unwrap_err();
        assert!(fault.message.contains("a folder has this name"), "{fault}");
        assert_eq!(fs::read(dir.path().join("1.json")).unwrap(), b"second");
        assert_eq!(fs::read(dir.path().join("1.csv")).unwrap(), b"first");
        assert_eq!(fs::read(dir.path().join(sequence::FILE)).unwrap(), table);
        let verified = manifest::verify(dir.path()).unwrap();
        let problems: Vec<String> = verified.problems.iter().map(ToString::to_string).collect();
        assert!(problems.len() == 1 && problems[0].contains("1.txt"), "{problems:?}");
        assert!(verified.interrupted.is_empty());
        // The way is free again: the scan's reports are all there, and all are listed.
        fs::remove_dir(dir.path().join("1.txt")).unwrap();
        folder.reopen().unwrap();
        folder.store("1", printed("third"), &inspected).unwrap();
        let verified = manifest::verify(dir.path()).unwrap();
        assert_eq!((verified.intact, verified.problems.len()), (4, 0));
    }

    #[test]
    fn a_result_that_replaces_another_scans_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let (mut folder, _) = open(dir.path());
        let scan = |sha256: &str| {
            let mut result = crate::report::example::bracket();
            result.identity.scan_file = "1.ply".into();
            result.identity.scan_sha256 = Some(sha256.repeat(64));
            Inspected { result, scan: None }
        };
        let file = || vec![("1.json".to_owned(), Some(b"x".to_vec()))];
        assert!(folder.replaces("1", &scan("a")).is_none());
        folder.store("1", file(), &scan("a")).unwrap();
        assert!(folder.replaces("1", &scan("a")).is_none(), "the same content once more");
        let warning = folder.replaces("1", &scan("b")).unwrap();
        assert!(warning.message.contains("1.ply") && warning.help.is_some(), "{warning}");
        // A later run: by its content the scan finds its own name, whatever folder it lies in now.
        folder.store("1.ply", vec![("1.ply.json".to_owned(), Some(b"y".to_vec()))], &scan("b")).unwrap();
        folder.reopen().unwrap();
        let any = |_: &str| true;
        assert_eq!(folder.names.name_for(Path::new("b/1.ply"), Some(&"b".repeat(64)), any), "1.ply");
        assert_eq!(folder.names.name_for(Path::new("a/1.ply"), Some(&"a".repeat(64)), any), "1");
    }

    #[test]
    fn own_files_are_no_scans_and_scans_are_not_written_over() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("2.ply"), "a result").unwrap();
        manifest::write(dir.path(), &["2.ply".to_owned()]).unwrap();
        let (mut folder, _) = open(dir.path());
        let file = |name: &str| Listed { path: dir.path().join(name), size: 1, modified: None };
        let mut listing = ["1.ply", "2.ply", sequence::FILE, manifest::FILE].map(file).to_vec();
        folder.sift(dir.path(), &mut listing);
        assert_eq!(listing, [file("1.ply")]);
        let name_for = |folder: &mut ResultsFolder, scan: &Path| {
            let scans = folder.scans_here.clone();
            folder.names.name_for(scan, None, |name| !scans.contains(&format!("{name}.ply")))
        };
        assert_eq!(name_for(&mut folder, &dir.path().join("1.ply")), "1.ply");
        folder.keep_scans(&[dir.path().join("3.ply"), "elsewhere/4.ply".into()]);
        assert_eq!(name_for(&mut folder, Path::new("elsewhere/3.xyz")), "3.xyz");
        assert_eq!(name_for(&mut folder, Path::new("elsewhere/4.ply")), "4");
    }
}
