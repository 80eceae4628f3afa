//! The files of a merge that are written: none is one of those that are read, and they appear together.

use super::files::resolved;
use crate::diagnostic::Diagnostic;
use crate::plan::merge::{MergePlan, NamedFile, Prealign};
use crate::report::atomic::{self, Staged};
use crate::stitch::StitchError;
use std::path::{Path, PathBuf};

/// A file and what people call it.
pub(super) type Called<'a> = (&'static str, &'a Path);

/// What a merge writes.
#[derive(Debug, Clone)]
pub(super) struct Outputs {
    pub cloud: PathBuf,
    pub report: PathBuf,
    pub pdf: Option<PathBuf>,
}

impl Outputs {
    /// Those of the settings; `cloud` where it is to be another one.
    pub fn new(plan: &MergePlan, cloud: Option<&Path>) -> Self {
        let cloud = cloud.map_or_else(|| plan.output.file.path.clone(), Path::to_path_buf);
        let report = plan.output.report.as_ref().map_or_else(|| cloud.with_extension("json"), |file| file.path.clone());
        let pdf = plan.output.report_pdf.as_ref().map(|file| file.path.clone());
        Self { cloud, report, pdf }
    }

    /// All of them.
    pub fn called(&self) -> Vec<Called<'_>> {
        let pdf = self.pdf.as_deref().map(|path| ("the report as PDF", path));
        [("the cloud", self.cloud.as_path()), ("the report", self.report.as_path())].into_iter().chain(pdf).collect()
    }

    pub fn paths(&self) -> Vec<&Path> {
        self.called().into_iter().map(|(_, path)| path).collect()
    }

    /// Before anything is read: a merge that cannot be kept is no use.
    ///
    /// # Errors
    /// A name that is none of a cloud, a folder that is not there or cannot be written to.
    pub fn check(&self) -> Result<(), Diagnostic> {
        if !self.cloud.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply")) {
            let message = "the cloud is written as PLY, expected a name that ends with .ply";
            return Err(Diagnostic::error(message).in_file(&self.cloud).with_help("end the name with .ply"));
        }
        self.paths().into_iter().try_for_each(check_place)
    }
}

/// Whether a file can be written there.
pub(super) fn check_place(path: &Path) -> Result<(), Diagnostic> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (fault, help) = match atomic::try_folder(folder) {
        Ok(()) if path.is_dir() => {
            ("a folder has this name".to_owned(), "rename the folder, or give another file with --out")
        }
        Ok(()) => return Ok(()),
        Err(_) if !folder.is_dir() => {
            ("the folder does not exist".to_owned(), "make the folder, or give another file with --out")
        }
        Err(why) => (why, "see to it that the folder can be written to, or give another file with --out"),
    };
    Err(Diagnostic::error(format!("cannot write, {fault}")).in_file(path).with_help(help))
}

/// What a merge reads, beside the settings that the inputs of a study name too.
pub(super) fn inputs<'a>(plan: &'a MergePlan, views: &'a [PathBuf]) -> Vec<Called<'a>> {
    let mut read: Vec<Called<'a>> = vec![("the settings", &plan.path)];
    read.extend(views.iter().map(|path| ("a view", path.as_path())));
    match &plan.views.prealign {
        Prealign::Poses(poses) => read.push(("the poses", &poses.path)),
        Prealign::Cad(cad) => read.push(("the CAD", &cad.path)),
        Prealign::None => {}
    }
    let mut add = |called, file: &'a Option<NamedFile>| read.extend(file.as_ref().map(|file| (called, &*file.path)));
    add("the camera's calibration", &plan.calibration.camera);
    add("the projector's calibration", &plan.calibration.projector);
    add("the earlier cloud", &plan.output.compare_with);
    read
}

/// Sees to it that nothing that is read is lost, nor anything that is written, however the files are named.
///
/// # Errors
/// Two of them are one file.
pub(super) fn check_apart(written: &[Called], read: &[Called]) -> Result<(), Diagnostic> {
    let read: Vec<(&str, PathBuf)> = read.iter().map(|(called, path)| (*called, resolved(path))).collect();
    let mut before: Vec<(&str, PathBuf)> = Vec::new();
    for (called, path) in written {
        let place = resolved(path);
        if let Some((other, _)) = read.iter().find(|(_, other)| *other == place) {
            let message = format!("{called} would overwrite {other}, expected a file of its own");
            let help = "give it another name, in [output] or with --out; nothing was written";
            return Err(Diagnostic::error(message).in_file(path).with_help(help));
        }
        if let Some((other, _)) = before.iter().find(|(_, other)| *other == place) {
            let message = format!("{other} and {called} would be one file, expected two");
            let help = "give one of them another name, in [output] or with --out";
            return Err(Diagnostic::error(message).in_file(path).with_help(help));
        }
        before.push((called, place));
    }
    Ok(())
}

/// Puts files in their places that are all on the disk already, so that a disk that is full leaves those of before as they are.
///
/// # Errors
/// What the system says.
pub(super) fn put_all<'a>(files: impl IntoIterator<Item = Staged<'a>>) -> Result<(), StitchError> {
    files.into_iter().try_for_each(Staged::put)?;
    Ok(())
}
