//! From the bytes of a plan to a `Plan` that can be run, or to everything that is wrong with it.

use super::alignment::alignment;
use super::model::{BackgroundSettings, Draft, OutputSettings, Plan, ResultsPlace, ScanSettings, UncertaintySettings};
use super::nominal::{ComparisonPoint, Feature};
use super::problems::Problems;
use super::reader::{NumberRule, Places, TableReader};
use super::sections::CadRead;
use super::shapes::{comparison_point, features, warn_of_shared_names};
use super::syntax::{Readable, read_document, read_text};
use super::values::location;
use super::{comparison_file, merge, sections};
use crate::diagnostic::{Diagnostic, Severity};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Largest plan, bytes.
pub(super) const LARGEST_PLAN: u64 = 1 << 20;

/// What became of a plan.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The plan, if and only if no problem is an error.
    pub plan: Option<Plan>,
    /// What of it is sound, for checks that look further than the plan itself.
    pub draft: Draft,
    /// Every problem, the plan's before its comparison file's and those of the views' settings, by line.
    pub problems: Vec<Diagnostic>,
}

impl Loaded {
    /// Whether a problem is an error.
    pub fn any_error(&self) -> bool {
        self.problems.iter().any(|p| p.severity == Severity::Error)
    }

    fn refused(problems: Vec<Diagnostic>) -> Self {
        Self { plan: None, draft: Draft::default(), problems }
    }
}

/// Reads a plan file and checks it, also that its CAD file exists (an error) and its folder of scans (a warning).
/// A file that cannot be read is one of the problems.
pub fn load(path: &Path) -> Loaded {
    match read_capped(path, LARGEST_PLAN, "a plan") {
        Ok(bytes) => read(&bytes, path, true),
        Err(problem) => Loaded::refused(vec![*problem]),
    }
}

/// Checks the bytes of a plan; `path` gives messages their file and relative paths their folder. Only the comparison
/// file is opened, if the plan names one.
pub fn parse(bytes: &[u8], path: &Path) -> Loaded {
    read(bytes, path, false)
}

/// The same as [`load`] for bytes that may not lie on the disk.
pub fn load_text(bytes: &[u8], path: &Path) -> Loaded {
    read(bytes, path, true)
}

fn read(bytes: &[u8], path: &Path, look_for_files: bool) -> Loaded {
    let problems = Problems::new(path);
    if bytes.len() as u64 > LARGEST_PLAN {
        let size = bytes.len();
        problems.add(too_large(size as u64, LARGEST_PLAN, "a plan"));
        return Loaded::refused(problems.into_sorted());
    }
    let readable = read_text(bytes, &problems).and_then(|text| read_document(text, &problems));
    let Some(Readable { document, lines, lost }) = readable else { return Loaded::refused(problems.into_sorted()) };
    let root = TableReader::new(document.as_table(), "", 1, Places::Document(&lines, &lost), &problems);
    let (plan, draft, more) = read_root(root, bytes, path, look_for_files);
    let mut list = problems.into_sorted();
    list.extend(more);
    let usable = !list.iter().any(|p| p.severity == Severity::Error);
    Loaded { plan: plan.filter(|_| usable), draft, problems: list }
}

/// Reads all tables; the third value are the problems of the comparison file.
fn read_root(
    root: TableReader<'_>,
    bytes: &[u8],
    path: &Path,
    look_for_files: bool,
) -> (Option<Plan>, Draft, Vec<Diagnostic>) {
    let folder = path.parent().unwrap_or(Path::new(""));
    schema(&root);
    let part = root.required_section("part", "the part's name and sheet thickness").and_then(sections::part);
    let cad = root.required_section("cad", "the CAD file").map(|table| sections::cad(table, folder));
    let scans_given = root.optional("scans").is_some();
    let scans = match root.section("scans") {
        Some(table) => sections::scans(table, folder),
        None => Some((sections::scans_left_out(folder), 1)),
    };
    let (scans, of_views) = with_views(&root, scans, folder, look_for_files);
    let background = root.section("background").map_or(Some(BackgroundSettings::default()), sections::background);
    let features = features(&root);
    let alignment =
        root.required_section("alignment", "how the part is aligned").and_then(|table| alignment(table, &features));
    let (comparison, comparison_bytes, mut more) = comparison(&root, folder);
    more.extend(of_views.problems);
    let rig = root.section("rig").map_or(Some(None), |table| sections::rig(table).map(Some));
    let uncertainty = root.section("uncertainty").map_or(Some(UncertaintySettings::default()), sections::uncertainty);
    let (output, results) = output(&root, folder);
    if look_for_files {
        tell_missing_files(cad.as_ref(), scans.as_ref().filter(|_| scans_given), root.problems());
    }
    let alignment_line = alignment_line(&root);
    sections::finish(root);
    let cad = cad.and_then(CadRead::settings);
    let named = features.len();
    let features: Vec<Feature> = features.into_iter().filter_map(|f| f.feature).collect();
    let rig_is_sound = rig.is_some();
    let draft = Draft {
        path: path.to_path_buf(),
        sha256: sha256_hex(&[bytes, &comparison_bytes, &of_views.bytes]),
        part,
        scans: scans.map(|(scans, _)| ScanSettings { cad: cad.as_ref().map(|cad| cad.path.clone()), ..scans }),
        cad,
        // A missing feature would shift the places that the alignment refers to.
        alignment: alignment.filter(|_| features.len() == named),
        alignment_line,
        features,
        comparison,
        rig: rig.flatten(),
        uncertainty,
        output,
        results,
    };
    // A table that is there and is not sound leaves no plan; a rig that is left out does.
    let plan = background.filter(|_| rig_is_sound).and_then(|background| whole_plan(&draft, background));
    (plan, draft, more)
}

/// The plan, if all of it is sound.
fn whole_plan(draft: &Draft, background: BackgroundSettings) -> Option<Plan> {
    Some(Plan {
        path: draft.path.clone(),
        sha256: draft.sha256.clone(),
        part: draft.part.clone()?,
        cad: draft.cad.clone()?,
        scans: draft.scans.clone()?,
        background,
        alignment: draft.alignment.clone()?,
        alignment_line: draft.alignment_line,
        features: draft.features.clone(),
        comparison: draft.comparison.clone(),
        rig: draft.rig,
        uncertainty: draft.uncertainty?,
        output: draft.output.clone()?,
    })
}

/// `[output]`, or what holds without it.
fn output(root: &TableReader<'_>, folder: &Path) -> (Option<OutputSettings>, Option<ResultsPlace>) {
    match root.section("output") {
        Some(table) => sections::output(table, folder),
        None => {
            let output = sections::output_left_out(folder);
            let results = ResultsPlace { path: output.path.clone(), line: 1 };
            (Some(output), Some(results))
        }
    }
}

/// Tells that the CAD file or the scan folder, with its line, is not there.
fn tell_missing_files(cad: Option<&CadRead>, scans: Option<&(ScanSettings, usize)>, problems: &Problems) {
    if let Some((cad, path)) = cad.and_then(|cad| Some((cad, cad.path()?))).filter(|(_, path)| !path.is_file()) {
        let message = format!("[cad] file: found no file {}, expected an STL, OBJ or PLY file", path.display());
        problems.error(cad.line, message, "paths start at the plan's own folder; check name and folder");
    }
    if let Some((scans, line)) = scans.filter(|(scans, _)| !scans.path.is_dir()) {
        let message = format!("[scans] folder: found no folder {}", scans.path.display());
        problems.warning(*line, message, "make the folder, or name the scans on the command line");
    }
    if let Some((scans, line)) = scans
        && let Some(path) = cad.and_then(CadRead::path)
        && takes(scans, path)
    {
        let file = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        let message =
            format!("[scans] pattern \"{}\" takes {file}, too, which is the plan's CAD; it is left out", scans.pattern);
        problems.warning(*line, message, "keep the CAD in another folder, or give a pattern that scans alone have");
    }
}

/// Whether a file lies in the folder of scans under such a name.
fn takes(scans: &ScanSettings, file: &Path) -> bool {
    let name = file.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    let same_folder = || match (file.parent().map(canonical), canonical(&scans.path)) {
        (Some(Some(folder)), Some(scans)) => folder == scans,
        _ => false,
    };
    scans.views.is_none() && glob::Pattern::new(&scans.pattern).is_ok_and(|p| p.matches(&name)) && same_folder()
}

fn canonical(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    std::fs::canonicalize(folder).ok()
}

/// What `[scans] views` names, beside the settings in it.
#[derive(Default)]
struct OfViews {
    bytes: Vec<u8>,
    problems: Vec<Diagnostic>,
}

/// Reads the settings of the merge that `[scans] views` names, if it names any, into those of the scans.
fn with_views(
    root: &TableReader<'_>,
    scans: Option<(ScanSettings, usize)>,
    folder: &Path,
    look_for_files: bool,
) -> (Option<(ScanSettings, usize)>, OfViews) {
    let Some(table) = root.section("scans") else { return (scans, OfViews::default()) };
    let Some(entry) = table.optional("views") else { return (scans, OfViews::default()) };
    let Some((_, path)) = location(entry, folder) else { return (None, OfViews::default()) };
    let bytes = match read_capped(&path, LARGEST_PLAN, "the settings of a merge") {
        Ok(bytes) => bytes,
        Err(problem) => {
            let words = format!("{} ({})", problem.message, path.display());
            entry.wrong(words, problem.help.unwrap_or_default());
            return (None, OfViews::default());
        }
    };
    let read = merge::read(&bytes, &path, look_for_files.then_some(merge::ViewsOf::Parts));
    if let (Some(merge), Some((scans, _)), Some(unit)) = (&read.plan, &scans, table.optional("unit"))
        && merge.unit != scans.unit
    {
        let words = format!("found {}, and the views are in \"{}\"", unit.found(), merge.unit.key());
        unit.wrong(words, "remove it: the unit of views is that of their own settings");
    }
    let scans = scans.map(|(scans, line)| (ScanSettings { views: read.plan.map(Box::new), ..scans }, line));
    (scans, OfViews { bytes, problems: read.problems })
}

pub(super) fn schema(root: &TableReader<'_>) {
    const ANY: NumberRule = NumberRule { expected: "1", accepts: |_| true };
    let entry = root.required("schema", "schema = 1", "write schema = 1 above the first table");
    if let Some(entry) = entry
        && let Some(number) = entry.number(ANY)
        && number != 1.0
    {
        let help = "this program reads plans of schema 1; a plan of another schema needs the program that wrote it";
        entry.wrong(format!("found {number}, expected 1"), help);
    }
}

/// Where the reading of the slot is told, else where the alignment begins.
fn alignment_line(root: &TableReader<'_>) -> usize {
    root.section("alignment").map_or(1, |table| table.optional("slot_reading").map_or(table.line(), |entry| entry.line))
}

/// The points of the plan or of its comparison file; with the bytes of that file and its problems.
fn comparison(root: &TableReader<'_>, folder: &Path) -> (Vec<ComparisonPoint>, Vec<u8>, Vec<Diagnostic>) {
    let problems = root.problems();
    let tables = root.sections("comparison", "[[comparison]]");
    let in_plan = root.optional("comparison").is_some();
    let read: Vec<_> = tables.into_iter().map(comparison_point).collect();
    warn_of_shared_names(&read, problems);
    let points: Vec<ComparisonPoint> = read.into_iter().filter_map(|read| read.point).collect();
    let Some(table) = root.section("comparison_file") else {
        if !in_plan && root.optional("comparison_file").is_none() {
            let help = "add [[comparison]] tables, or [comparison_file] with file = \"points.csv\"";
            problems.warning(1, "comparison: found no comparison point, expected at least one", help);
        }
        return (points, Vec::new(), Vec::new());
    };
    let line = table.line();
    if in_plan {
        let message = "[comparison_file]: found beside [[comparison]], expected comparison points in one place";
        problems.error(line, message, "move the points of the plan into the file, or remove [comparison_file]");
    }
    let entry = table.required("file", "the file with comparison points", "write file = \"points.csv\"");
    let file_line = entry.map_or(line, |entry| entry.line);
    let place = entry.and_then(|entry| location(entry, folder));
    sections::finish(table);
    let Some((_, path)) = place else { return (points, Vec::new(), Vec::new()) };
    let bytes = match read_capped(&path, comparison_file::LARGEST, "a comparison file") {
        Ok(bytes) => bytes,
        Err(problem) => {
            let message = format!("[comparison_file] file: {} ({})", problem.message, path.display());
            problems.error(file_line, message, problem.help.unwrap_or_default());
            return (points, Vec::new(), Vec::new());
        }
    };
    let file_problems = Problems::new(&path);
    let from_file = comparison_file::read(&bytes, &file_problems, comparison_file::Decimals::Point);
    if from_file.is_empty() && !file_problems.any_error() {
        file_problems.warning(1, "found no comparison point, expected at least one", "add a line for each point");
    }
    warn_of_shared_names(&from_file, &file_problems);
    let points = points.into_iter().chain(from_file.into_iter().filter_map(|read| read.point)).collect();
    (points, bytes, file_problems.into_sorted())
}

/// The bytes of a file, or the problem; never more than the cap is read.
pub(super) fn read_capped(path: &Path, cap: u64, what: &str) -> Result<Vec<u8>, Box<Diagnostic>> {
    let unreadable = |fault: std::io::Error| {
        let help = match fault.kind() {
            std::io::ErrorKind::NotFound => "check name and folder",
            _ => "check that it is a file and that you may read it",
        };
        let fault = match fault.kind() {
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            std::io::ErrorKind::PermissionDenied => "it may not be read".to_owned(),
            std::io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
            _ => fault.to_string(),
        };
        Box::new(Diagnostic::error(format!("could not read {what}: {fault}")).in_file(path).with_help(help))
    };
    // A pipe or device could wait for ever; only plain files are opened.
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        let problem = Diagnostic::error(format!("could not read {what}: it is no plain file")).in_file(path);
        return Err(Box::new(problem.with_help("name the file itself, not a folder or device")));
    }
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(cap + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > cap {
        return Err(Box::new(too_large(about.len(), cap, what).in_file(path)));
    }
    Ok(bytes)
}

pub(super) fn too_large(size: u64, cap: u64, what: &str) -> Diagnostic {
    let message = format!("found {size} bytes, expected {what} of at most {cap} bytes");
    Diagnostic::error(message).with_help("check that this is the right file")
}

/// SHA-256 over all parts one after the other, lower-case hex.
pub(super) fn sha256_hex(parts: &[&[u8]]) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update(part);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
