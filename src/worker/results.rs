//! The results folder: every file whole, its manifest and its table of scans up to date after each part.

use crate::diagnostic::Diagnostic;
use crate::inspect::{Inspected, Outcome};
use crate::part::Part;
use crate::plan::OutputFormat;
use crate::report::manifest::{self, Manifest};
use crate::report::sequence::{self, SequenceTable};
use crate::report::{self, MapScene, atomic};
use std::path::{Path, PathBuf};

/// A folder that takes results. What stood in it from earlier runs stays and stays listed.
#[derive(Debug)]
pub struct ResultsFolder {
    path: PathBuf,
    formats: Vec<OutputFormat>,
    manifest: Manifest,
    table: SequenceTable,
}

impl ResultsFolder {
    /// Opens the folder, making it where it is not there yet.
    pub fn open(path: &Path, formats: &[OutputFormat]) -> Result<Self, Diagnostic> {
        std::fs::create_dir_all(path).map_err(|e| {
            Diagnostic::error(format!("the results folder cannot be made: {e}"))
                .in_file(path)
                .with_help("check [output] folder in the plan, or give another with --out")
        })?;
        // The JSON file is the result that all others can be checked against; it is always there.
        let mut formats = formats.to_vec();
        if !formats.contains(&OutputFormat::Json) {
            formats.push(OutputFormat::Json);
        }
        Ok(Self {
            path: path.to_path_buf(),
            formats,
            manifest: Manifest::load(path)?,
            table: SequenceTable::load(path)?,
        })
    }

    /// Writes the reports of one scan, then the table and the manifest.
    pub fn write(&mut self, name: &str, inspected: &Inspected, part: &Part) -> Result<Vec<PathBuf>, Diagnostic> {
        let mut files = Vec::new();
        for format in self.formats.clone() {
            let file_name = format!("{name}.{}", ending_of(format));
            match print(format, inspected, part) {
                Some(bytes) => files.push(self.put(&file_name, &bytes)?),
                None => self.take_away(&file_name)?,
            }
        }
        self.table.put(&inspected.result);
        let table = self.table.to_csv();
        self.put(sequence::FILE, table.as_bytes())?;
        self.manifest.write(&self.path)?;
        Ok(files)
    }

    /// Under which name the same bytes were inspected before, by the same plan and CAD.
    pub fn inspected_as(&self, scan_sha256: &str, plan_sha256: &str, cad_sha256: &str) -> Option<String> {
        self.table.inspected_as(scan_sha256, plan_sha256, cad_sha256)
    }

    /// Path of the manifest.
    pub fn manifest_path(&self) -> PathBuf {
        self.path.join(manifest::FILE)
    }

    /// Removes what an earlier run said of this scan in a format that has nothing to say now.
    fn take_away(&mut self, file_name: &str) -> Result<(), Diagnostic> {
        let path = self.path.join(file_name);
        if self.manifest.forget(file_name) && path.exists() {
            std::fs::remove_file(&path)
                .map_err(|e| Diagnostic::error(format!("an outdated result cannot be removed: {e}")).in_file(&path))?;
        }
        Ok(())
    }

    fn put(&mut self, file_name: &str, bytes: &[u8]) -> Result<PathBuf, Diagnostic> {
        let path = self.path.join(file_name);
        atomic::write(&path, bytes)?;
        self.manifest.record(file_name, bytes);
        Ok(path)
    }
}

/// The file's ending in each format.
fn ending_of(format: OutputFormat) -> &'static str {
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
