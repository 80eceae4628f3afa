//! The results folder: every file whole, its manifest and its table of scans up to date after each part.

use super::inherited::{load_table, lock, remove_leftovers, set_aside};
use super::names::{self, ResultNames};
use super::watch::Listed;
use crate::diagnostic::{Diagnostic, os_words};
use crate::inspect::{Inspected, Outcome};
use crate::io::read_plain;
use crate::part::Part;
use crate::plan::OutputFormat;
use crate::report::atomic::Staged;
use crate::report::manifest::{self, Manifest};
use crate::report::sequence::{self, Row, SequenceTable};
use crate::report::{self, MapScene};
use crate::run::{Cancelled, RunContext};
use std::collections::BTreeSet;
use std::fs::{self, File};
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
            Diagnostic::error(format!("the results folder cannot be made: {}", os_words(&e)))
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

    /// Opens the folder again after it could not be written; one that was removed is made again. The folder around it is
    /// not: where that is gone too, the disk is away.
    pub fn reopen(&mut self) -> Result<Vec<Diagnostic>, Diagnostic> {
        if !self.is_there() && !parent_of(&self.path).is_dir() {
            return Err(Diagnostic::error("the results folder is not there").in_file(&self.path));
        }
        // The old lock goes first: this very run holds it.
        self._lock = None;
        let (mut folder, warnings) = Self::open(&self.path, &self.formats)?;
        folder.scans_here = std::mem::take(&mut self.scans_here);
        *self = folder;
        Ok(warnings)
    }

    /// Whether the folder still stands where it was opened.
    pub fn is_there(&self) -> bool {
        self.path.is_dir()
    }

    /// Leaves this program's own files out of a listing of scans and keeps the others from being written over, should
    /// scans and results share a folder.
    pub fn sift(&mut self, folder: &Path, listing: &mut Vec<Listed>) {
        // Of a plan whose parts are folders.
        listing.retain(|file| !file.path.is_dir() || fs::canonicalize(&file.path).is_ok_and(|p| p != self.real_path));
        if !fs::canonicalize(folder).is_ok_and(|folder| folder == self.real_path) {
            return;
        }
        listing.retain(|file| file_name(&file.path).is_none_or(|name| !self.is_own(&name)));
        self.scans_here = listing.iter().filter_map(|file| file_name(&file.path)).collect();
    }

    /// Keeps scans that were named by hand from being written over.
    pub fn keep_scans(&mut self, scans: &[PathBuf]) {
        for scan in scans {
            if fs::canonicalize(parent_of(scan)).is_ok_and(|folder| folder == self.real_path) {
                self.scans_here.extend(file_name(scan));
            }
        }
    }

    fn is_own(&self, name: &str) -> bool {
        name == manifest::FILE || name == sequence::FILE || self.manifest.lists(name)
    }

    /// The reports of one scan as bytes. Takes the time, writes nothing.
    pub fn print(
        &mut self,
        scan: &Path,
        inspected: &Inspected,
        part: &Part,
        run: &RunContext,
    ) -> Result<(String, Printed), Cancelled> {
        let endings: Vec<&str> = self.formats.iter().map(|format| ending_of(*format)).collect();
        let (folder, scans, manifest) = (&self.path, &self.scans_here, &self.manifest);
        let taken = |file: &str| scans.contains(file) || (!manifest.lists(file) && folder.join(file).exists());
        let free = |name: &str| {
            was_written_by_us(folder, name) || !endings.iter().any(|ending| taken(&format!("{name}.{ending}")))
        };
        let name = self.names.name_for(scan, inspected.result.identity.scan_sha256.as_deref(), free);
        let print = |format: &OutputFormat| {
            run.check()?;
            Ok((format!("{name}.{}", ending_of(*format)), print(*format, inspected, part, run)?))
        };
        let printed = self.formats.iter().map(print).collect::<Result<_, Cancelled>>()?;
        Ok((name, printed))
    }

    /// The name under which the reports of an earlier scan will be kept, where those of this one take their place though its
    /// content is another (or could not be read). A refusal holds no measurement and is not kept.
    pub fn sets_aside(&self, name: &str, inspected: &Inspected) -> Option<String> {
        let row = self.table.row_of(name).filter(|row| !row.refused)?;
        let before = row.scan_sha256()?;
        if inspected.result.identity.scan_sha256.as_deref() == Some(before) {
            return None;
        }
        let is_free = |aside: &str| {
            let taken = |kind: &str| self.path.join(format!("{aside}.{kind}")).exists();
            self.table.row_of(aside).is_none() && !manifest::RESULT_KINDS.into_iter().any(taken)
        };
        let is_same = |aside: &str| self.table.row_of(aside).is_some_and(|kept| kept.has_content_of(row));
        (1..).map(|n| names::set_aside(name, n)).find(|aside| is_same(aside) || is_free(aside))
    }

    /// What of an earlier scan's reports is written before those that take their place: copies under the other name; what
    /// the new scan has no report in goes.
    fn keep_aside(&mut self, name: &str, aside: &str, printed: &Printed) -> Result<Printed, Diagnostic> {
        let mut batch = Vec::new();
        for kind in manifest::RESULT_KINDS {
            let (file, copy) = (format!("{name}.{kind}"), format!("{aside}.{kind}"));
            let path = self.path.join(&file);
            if !self.manifest.lists(&file) || !path.exists() {
                continue;
            }
            let bytes = read_plain(&path).map_err(|e| {
                Diagnostic::error(format!("an earlier result cannot be kept: {}", os_words(&e)))
                    .in_file(&path)
                    .with_help("make the file readable, or give another folder with --out")
            })?;
            self.manifest.announce_copy(&file, &copy);
            batch.push((copy, Some(bytes)));
            if !printed.iter().any(|(new, _)| *new == file) {
                self.manifest.announce(&file, None);
                batch.push((file, None));
            }
        }
        self.table.rename(name, aside);
        Ok(batch)
    }

    /// Writes the reports of one scan and the table, and confirms them in the manifest. Ended at any moment, the folder is
    /// consistent: the manifest knows of every file what it was and what it was to become. Returns the files written. Where one cannot
    /// be written, those before it stay and are listed; the table, the last of them, has no row of the scan then.
    pub fn store(&mut self, name: &str, printed: Printed, inspected: &Inspected) -> Result<Vec<PathBuf>, Diagnostic> {
        let table = self.table.clone();
        let written = self.write_part(name, printed, inspected);
        if written.is_err() {
            // No row without its files; what was written before the fault is listed as it lies there, as far as the
            // disk still takes the list.
            self.table = table;
            self.manifest.settle(&self.path);
        }
        let listed = self.manifest.write(&self.path);
        let files = written?;
        listed?;
        Ok(files)
    }

    fn write_part(
        &mut self,
        name: &str,
        mut printed: Printed,
        inspected: &Inspected,
    ) -> Result<Vec<PathBuf>, Diagnostic> {
        let mut batch = match self.sets_aside(name, inspected) {
            Some(aside) => self.keep_aside(name, &aside, &printed)?,
            None => Vec::new(),
        };
        let kept = batch.iter().filter(|(_, content)| content.is_some()).count();
        self.table.put(name, &inspected.result);
        // A report that is to go and never was there needs no word.
        printed.retain(|(file, content)| content.is_some() || self.manifest.lists(file));
        printed.push((sequence::FILE.to_owned(), Some(self.table.to_csv().into_bytes())));
        for (file, content) in &printed {
            self.manifest.announce(file, content.as_deref());
        }
        batch.append(&mut printed);
        let mut files = self.write_batch(&batch)?;
        // Neither the copies nor the table are the scan's own reports.
        files.drain(..kept);
        files.pop();
        Ok(files)
    }

    /// Writes all files beside their places first, so that a full disk leaves nothing of the part; then puts or removes file
    /// after file, in order, between the announcement and the confirmation.
    fn write_batch(&mut self, batch: &Printed) -> Result<Vec<PathBuf>, Diagnostic> {
        let paths: Vec<PathBuf> = batch.iter().map(|(file, _)| self.path.join(file)).collect();
        let stage = |(path, (_, content)): (_, &(String, Option<Vec<u8>>))| {
            content.as_ref().map(|bytes| Staged::try_new(path, bytes)).transpose()
        };
        let staged = paths.iter().map(PathBuf::as_path).zip(batch).map(stage).collect::<Result<Vec<_>, _>>()?;
        self.manifest.write(&self.path)?;
        let mut files = Vec::new();
        for (path, staged) in paths.iter().zip(staged) {
            match staged {
                Some(staged) => {
                    staged.put()?;
                    files.push(path.clone());
                }
                None => remove(path)?,
            }
        }
        self.manifest.confirm();
        Ok(files)
    }

    /// Where the same bytes were inspected before, by the same plan and CAD.
    pub fn inspected_as(&self, scan_sha256: &str, plan_sha256: &str, cad_sha256: &str) -> Option<&Row> {
        self.table.inspected_as(scan_sha256, plan_sha256, cad_sha256)
    }

    /// Whether a scan of this name has a result here; with a content, whether that content has one under this name, by whatever plan and CAD.
    pub fn knows(&self, scan: &Path, scan_sha256: Option<&str>) -> bool {
        let Some(name) = file_name(scan) else { return false };
        scan_sha256.map_or_else(|| self.table.has_scan(&name), |sha256| self.table.has_inspected(&name, sha256))
    }
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

fn parent_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn file_name(path: &Path) -> Option<String> {
    path.file_name().map(|name| name.to_string_lossy().into_owned())
}

/// Removes what an earlier run said of a scan in a format that has nothing to say now.
fn remove(path: &Path) -> Result<(), Diagnostic> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(Diagnostic::error(format!("an outdated result cannot be removed: {}", os_words(&e))).in_file(path))
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
fn print(
    format: OutputFormat,
    inspected: &Inspected,
    part: &Part,
    run: &RunContext,
) -> Result<Option<Vec<u8>>, Cancelled> {
    let result = &inspected.result;
    Ok(match format {
        OutputFormat::Json => Some(report::json(result).into_bytes()),
        OutputFormat::Ascii => Some(report::ascii(result).into_bytes()),
        OutputFormat::Csv => Some(report::csv(result).into_bytes()),
        OutputFormat::Ply => match &result.outcome {
            Outcome::Measured(_) => inspected.scan.as_ref().map(|scan| report::ply(result, scan, run)).transpose()?,
            Outcome::Refused(_) => None,
        },
        OutputFormat::Pdf => {
            let scene = inspected.scan.as_ref().map(|scan| MapScene { part, scan });
            Some(report::pdf(result, scene.as_ref(), run)?)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(path: &Path) -> (ResultsFolder, Vec<String>) {
        let (folder, warnings) = ResultsFolder::open(path, &[OutputFormat::Ply]).unwrap();
        (folder, warnings.iter().map(ToString::to_string).collect())
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
    fn a_part_that_cannot_be_written_leaves_the_folder_as_it_was() {
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
        assert_eq!(fs::read(dir.path().join("1.json")).unwrap(), b"first");
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
    fn a_result_of_another_content_finds_its_own_name_again() {
        let dir = tempfile::tempdir().unwrap();
        let (mut folder, _) = open(dir.path());
        let scan = |sha256: &str| {
            let mut result = crate::report::example::bracket();
            result.identity.scan_file = "1.ply".into();
            result.identity.scan_sha256 = Some(sha256.repeat(64));
            Inspected { result, scan: None }
        };
        let file = || vec![("1.json".to_owned(), Some(b"x".to_vec()))];
        assert_eq!(folder.sets_aside("1", &scan("a")), None);
        folder.store("1", file(), &scan("a")).unwrap();
        assert_eq!(folder.sets_aside("1", &scan("a")), None, "the same content once more");
        assert_eq!(folder.sets_aside("1", &scan("b")).as_deref(), Some("1 (earlier 1)"));
        let mut unreadable = scan("b");
        unreadable.result.identity.scan_sha256 = None;
        assert!(folder.sets_aside("1", &unreadable).is_some(), "whatever it was, it was not inspected");
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
