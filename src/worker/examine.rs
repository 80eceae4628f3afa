//! One scan from its file to its result. Whatever is wrong with it becomes a refused result: the sequence lives on.

use super::merge::part_folder;
use super::scans::taken;
use crate::diagnostic::{Diagnostic, ReadError, Refusal};
use crate::geometry::PointCloud;
use crate::inspect::{self, Identity, Inspected, InspectionResult, Outcome};
use crate::io;
use crate::part::{self, CacheUse, Part, PartSettings};
use crate::plan::{CadSettings, CadSide, ComparisonPoint, Feature, Plan};
use crate::run::{Cancelled, RunContext, Stage};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// Plan and part, to which every scan of a sequence is held.
#[derive(Debug)]
pub struct Examiner {
    /// The plan.
    pub plan: Arc<Plan>,
    /// Its CAD.
    pub part: Arc<Part>,
}

/// A scan that is there.
pub(super) struct Loaded {
    content: Content,
    pub(super) sha256: String,
    /// Bytes of its file, or of all files of its folder.
    pub(super) size: u64,
}

enum Content {
    /// The bytes of a cloud, read once.
    Cloud(Vec<u8>),
    /// A folder of views.
    Views,
}

/// What a scan's bytes gave.
pub(super) enum Examined {
    /// A result, measured or refused.
    Done(Box<Inspected>),
    /// The file ends in the middle.
    CutOff(Box<Diagnostic>),
}

/// Reads and hashes a scan. The inner error: the system does not give the file.
pub(super) fn load(plan: &Plan, scan: &Path, run: &RunContext) -> Result<Result<Loaded, Box<Diagnostic>>, Cancelled> {
    run.enter(Stage::Read)?;
    if plan.scans.views.is_some() {
        run.enter(Stage::Hash)?;
        return match part_folder::hash(scan, run) {
            Ok((sha256, size)) => Ok(Ok(Loaded { content: Content::Views, sha256, size })),
            Err(ReadError::Cancelled(cancelled)) => Err(cancelled),
            Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => Ok(Err(diagnostic)),
        };
    }
    let bytes = match io::read_file_while(scan, run) {
        Ok(bytes) => bytes,
        Err(ReadError::Cancelled(cancelled)) => return Err(cancelled),
        Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => return Ok(Err(diagnostic)),
    };
    run.enter(Stage::Hash)?;
    let sha256 = io::sha256_of(&bytes, run)?;
    let size = bytes.len() as u64;
    Ok(Ok(Loaded { content: Content::Cloud(bytes), sha256, size }))
}

impl Examiner {
    /// The result of a scan's file; a file that cannot be read, or ends in the middle, is refused.
    pub fn inspect_file(&self, scan: &Path, run: &RunContext) -> Result<InspectionResult, Cancelled> {
        Ok(self.look_again(scan, run)?.result)
    }

    /// The same with its points, for who wants to show them.
    pub fn look_again(&self, scan: &Path, run: &RunContext) -> Result<Inspected, Cancelled> {
        let loaded = match load(&self.plan, scan, run)? {
            Ok(loaded) => loaded,
            Err(fault) => return Ok(self.refused(scan, None, &fault)),
        };
        let sha256 = loaded.sha256.clone();
        Ok(match self.examine(scan, loaded, false, run)? {
            Examined::Done(inspected) => *inspected,
            Examined::CutOff(fault) => self.refused(scan, Some(sha256), &fault),
        })
    }

    /// The result of points that come from no file, mm, under a name.
    pub fn inspect_cloud(
        &self,
        name: &Path,
        cloud: PointCloud,
        run: &RunContext,
    ) -> Result<InspectionResult, Cancelled> {
        let identity = self.identity(name, None);
        let inspected =
            catch_unwind(AssertUnwindSafe(|| inspect::inspect(&self.plan, &self.part, cloud, identity, run)));
        match inspected {
            Ok(end) => end.map(|inspected| inspected.result),
            Err(panic) => Ok(self.broken(name, None, &*panic).result),
        }
    }

    /// Inspects the scan. A panic becomes a refused scan. With `wait_for_rest` a part with a view that ends in the middle is cut off, else
    /// it is inspected without that view.
    pub(super) fn examine(
        &self,
        scan: &Path,
        loaded: Loaded,
        wait_for_rest: bool,
        run: &RunContext,
    ) -> Result<Examined, Cancelled> {
        let sha256 = loaded.sha256.clone();
        match catch_unwind(AssertUnwindSafe(|| self.read_and_inspect(scan, loaded, wait_for_rest, run))) {
            Ok(end) => end,
            Err(panic) => Ok(Examined::Done(Box::new(self.broken(scan, Some(sha256), &*panic)))),
        }
    }

    fn read_and_inspect(
        &self,
        scan: &Path,
        loaded: Loaded,
        wait_for_rest: bool,
        run: &RunContext,
    ) -> Result<Examined, Cancelled> {
        let Loaded { content, sha256, .. } = loaded;
        run.enter(Stage::Read)?;
        if sha256 == self.part.cad_sha256 {
            return Ok(Examined::Done(Box::new(self.refuse(scan, Some(sha256), cad_as_scan()))));
        }
        let (cloud, of_views) = match self.read(scan, content, wait_for_rest, run) {
            Ok(read) => read,
            Err(ReadError::Cancelled(cancelled)) => return Err(cancelled),
            Err(ReadError::CutOff(diagnostic)) => return Ok(Examined::CutOff(diagnostic)),
            Err(ReadError::Bad(diagnostic)) => {
                return Ok(Examined::Done(Box::new(self.refused(scan, Some(sha256), &diagnostic))));
            }
        };
        let identity = self.identity(scan, Some(sha256));
        let mut inspected = inspect::inspect(&self.plan, &self.part, cloud, identity, run)?;
        if let Outcome::Measured(inspection) = &mut inspected.result.outcome {
            inspection.warnings.extend(of_views);
        }
        if let (Err(words), Outcome::Measured(inspection)) =
            (taken(&self.plan.scans.taken, scan), &mut inspected.result.outcome)
        {
            inspection.warnings.push(words);
        }
        Ok(Examined::Done(Box::new(inspected)))
    }

    /// The points, mm, and what people should know of their views.
    fn read(
        &self,
        scan: &Path,
        content: Content,
        wait_for_rest: bool,
        run: &RunContext,
    ) -> Result<(PointCloud, Vec<String>), ReadError> {
        match (content, &self.plan.scans.views) {
            (Content::Cloud(bytes), _) => Ok((io::read_cloud(&bytes, scan, self.plan.scans.unit, run)?, Vec::new())),
            (Content::Views, Some(merge)) => Ok(part_folder::cloud(merge, scan, wait_for_rest, run)?),
            (Content::Views, None) => Err(Diagnostic::error("found a folder, expected a scan").into()),
        }
    }

    /// Why the file is cut off, if it is; nothing else is looked at. A folder to which the rest of a view came is another folder.
    pub(super) fn cut_off(&self, scan: &Path, loaded: &Loaded, run: &RunContext) -> Option<Box<Diagnostic>> {
        let Content::Cloud(bytes) = &loaded.content else { return None };
        let read = catch_unwind(AssertUnwindSafe(|| io::read_cloud(bytes, scan, self.plan.scans.unit, run)));
        match read {
            Ok(Err(ReadError::CutOff(diagnostic))) => Some(diagnostic),
            _ => None,
        }
    }

    /// The result of a scan whose file is at fault.
    pub(super) fn refused(&self, scan: &Path, sha256: Option<String>, fault: &Diagnostic) -> Inspected {
        self.refuse(scan, sha256, refusal_of(fault))
    }

    /// The result of a scan at which the program itself failed.
    pub(super) fn broken(&self, scan: &Path, sha256: Option<String>, panic: &(dyn std::any::Any + Send)) -> Inspected {
        let refusal = Refusal::new(
            format!("an internal fault stopped the inspection: {}", words_of(panic)),
            "keep this scan and send it to the maintainers; the sequence goes on",
        );
        self.refuse(scan, sha256, refusal)
    }

    fn refuse(&self, scan: &Path, sha256: Option<String>, refusal: Refusal) -> Inspected {
        Inspected { result: inspect::refused(&self.plan, self.identity(scan, sha256), refusal), scan: None }
    }

    fn identity(&self, scan: &Path, scan_sha256: Option<String>) -> Identity {
        identity_of(&self.plan, &self.part, scan, scan_sha256)
    }
}

/// Who and what a scan is inspected by.
pub(super) fn identity_of(plan: &Plan, part: &Part, scan: &Path, scan_sha256: Option<String>) -> Identity {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Identity {
        part_name: plan.part.name.clone(),
        part_number: plan.part.number.clone(),
        part_revision: plan.part.revision.clone(),
        plan_file: name(&plan.path),
        plan_sha256: plan.sha256.clone(),
        cad_file: plan.cad.file.clone(),
        cad_sha256: part.cad_sha256.clone(),
        cad_triangles: part.triangles_in_file,
        scan_file: name(scan),
        scan_sha256,
        scan_taken: taken(&plan.scans.taken, scan).ok().flatten(),
    }
}

/// The CAD lies perfectly on itself: it would pass, and no part was seen.
pub(super) fn cad_as_scan() -> Refusal {
    Refusal::new(
        "the file has the content of the CAD file, expected points that were measured",
        "take the CAD out of the scans, or name the CAD's own file in [cad] if a scan stands there",
    )
}

/// A file's fault as the reason of a refused scan. Its folder is left out: the same scan gives the same report
/// wherever it lies.
fn refusal_of(diagnostic: &Diagnostic) -> Refusal {
    let place = match (&diagnostic.file, diagnostic.line) {
        (Some(file), line) => {
            let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            line.map_or_else(|| format!("{name}: "), |line| format!("{name}:{line}: "))
        }
        (None, _) => String::new(),
    };
    let help = diagnostic.help.clone().unwrap_or_else(|| "copy the scan again; the sequence goes on".into());
    Refusal::new(format!("{place}{}", diagnostic.message), help)
}

/// What a panic said.
fn words_of(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no further words")
}

/// Prepares the plan's CAD, from its cache where that is good.
pub fn prepare_part(plan: &Plan, run: &RunContext) -> Result<(Part, CacheUse), ReadError> {
    prepare_cad(&plan.cad, &part_settings(plan), Some(&part::cache_path(&plan.cad.path)), run)
}

/// The same from what a plan tells of its CAD. A panic becomes an error that names the CAD.
pub(super) fn prepare_cad(
    cad: &CadSettings,
    settings: &PartSettings,
    cache_file: Option<&Path>,
    run: &RunContext,
) -> Result<(Part, CacheUse), ReadError> {
    let prepared = catch_unwind(AssertUnwindSafe(|| part::load_or_prepare(cad, settings, cache_file, run)));
    prepared.unwrap_or_else(|panic| {
        let message = format!("an internal fault stopped the preparation of the CAD: {}", words_of(&*panic));
        Err(Diagnostic::error(message)
            .in_file(&cad.path)
            .with_help("export the CAD again, or otherwise; keep this file and send it to the maintainers")
            .into())
    })
}

/// What of a plan the prepared CAD depends on.
pub fn part_settings(plan: &Plan) -> PartSettings {
    settings_for(plan.part.cad_side, plan.part.thickness_mm, &plan.features, &plan.comparison)
}

/// The same from the plan's parts.
pub(super) fn settings_for(
    cad_side: CadSide,
    thickness_mm: f64,
    features: &[Feature],
    comparison: &[ComparisonPoint],
) -> PartSettings {
    let features = features.iter().map(|f| &f.geometry);
    let points = comparison.iter().map(|p| &p.geometry);
    PartSettings {
        cad_side,
        thickness_mm,
        plan_directions: features.chain(points).map(|g| (g.position(), g.sheet_normal())).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::LengthUnit;
    use crate::run::CancelToken;

    /// A listener that fails stands for any fault on the way.
    #[test]
    fn a_panic_while_the_cad_is_prepared_is_an_error_that_names_it() {
        let cad = CadSettings { file: "odd.stl".into(), path: "odd.stl".into(), unit: LengthUnit::Mm };
        let settings = settings_for(CadSide::Top, 1.0, &[], &[]);
        let stop = CancelToken::default();
        let run = RunContext::new(&stop, &|_| panic!("odd triangle"));
        let Err(ReadError::Bad(diagnostic)) = prepare_cad(&cad, &settings, None, &run) else {
            panic!("must be an error")
        };
        let told = diagnostic.to_string();
        assert!(told.starts_with("error: odd.stl: an internal fault") && told.contains("odd triangle"), "{told}");
        assert!(diagnostic.help.is_some());
    }
}
