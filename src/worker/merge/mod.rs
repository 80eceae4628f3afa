//! `MERGE.toml` and a folder of views to one cloud: the files around `stitch`.

mod away;
mod by_cad;
mod calibrated;
mod compare;
mod files;
mod job;
mod outputs;
pub mod part_folder;
mod preview;
mod stored;
mod study;
#[cfg(test)]
mod tests;
mod views;

pub use job::{MergeJob, MergeRequest, merge_files};
pub use preview::{Preview, PreviewView, preview, study_preview};
pub use study::{MaskStudyJob, MaskStudyRequest, study_masks};

use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::Isometry3;
use crate::part::Part;
use crate::plan::merge::{MergePlan, NamedFile, Prealign};
use crate::run::{RunContext, Stage};
use crate::stitch::{
    Conditioned, FileIdentity, MergeIdentity, MergeResult, NoStart, StitchError, Tools, ViewEnd, ViewFile, poses,
    wanted,
};
use away::Away;
use calibrated::Calibrated;
use files::{Listed, list_views, name_of, read_named};
use outputs::Outputs;
use std::path::{Path, PathBuf};
use views::Views;

/// What a merge tells while it runs.
#[derive(Debug, Clone)]
pub enum MergeEvent {
    /// A view is begun.
    View {
        /// From 1.
        index: usize,
        /// How many there are.
        of: usize,
        /// Its file.
        name: String,
    },
    /// A view cannot be used; the others are gone on with.
    Unusable(Diagnostic),
    /// Another stage begins, of the view or of all of them.
    Stage(Stage),
    /// So much of registering or merging is done, 0 to 1; from any thread, and not always rising.
    Share(f64),
}

/// Where the views of a merge lie.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// The views' folder, where it is not the one that the settings name: a part's.
    pub folder: Option<PathBuf>,
    /// A view whose file ends in the middle is no reason to go on without it: its rest may come.
    pub wait_for_rest: bool,
}

/// Merges the views of a folder: each is read, masked and cleaned by itself, then all are registered and merged. A view that cannot be used is
/// left out by name.
///
/// # Errors
/// No two views can be merged, or something that the settings name cannot be used; or the job was stopped.
pub fn merge_folder(
    plan: &MergePlan,
    whose: &Place,
    run: &RunContext,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<MergeResult, StitchError> {
    let folder = whose.folder.as_deref().unwrap_or(&plan.views.folder.path);
    let listed = list_views(plan, folder, &Outputs::new(plan, None).paths(), 2)?;
    merge_beside(plan, whose, listed, None, run, tell)
}

/// The same of views that are listed, with a place for those that have no room in memory.
fn merge_beside(
    plan: &MergePlan,
    whose: &Place,
    listed: Listed,
    mut away: Option<&mut Away>,
    run: &RunContext,
    tell: &(dyn Fn(MergeEvent) + Sync),
) -> Result<MergeResult, StitchError> {
    let paths = &listed.views;
    let names: Vec<String> = paths.iter().map(|path| name_of(path)).collect();
    let around = Around::read(plan, whose, &names, run)?;
    if let Some(away) = &mut away {
        away.set_settings(plan, &around.identity);
    }
    let mut views = Views { plan, around: &around, away, ready: Vec::new(), facts: Vec::new(), hashes: Vec::new() };
    let wanted = wanted(plan);
    let (mut files, mut faults) = (Vec::new(), Vec::new());
    for (index, path) in paths.iter().enumerate() {
        tell(MergeEvent::View { index: index + 1, of: paths.len(), name: names[index].clone() });
        run.enter(Stage::Read)?;
        let (sha256, added) = views.add(index, path, &wanted, run)?;
        let end = match added {
            Ok(()) => ViewEnd::Ready(views.ready.len() - 1),
            Err(StitchError::CutOff(fault)) if whose.wait_for_rest => return Err(StitchError::CutOff(fault)),
            Err(StitchError::Fault(fault) | StitchError::CutOff(fault)) => {
                let why = ViewEnd::Unusable(in_one_line(&fault));
                faults.push(*fault);
                why
            }
            Err(cancelled) => return Err(cancelled),
        };
        files.push(ViewFile { name: names[index].clone(), sha256, end });
    }
    if let (true, Some(fault)) = (views.ready.len() < 2, faults.first()) {
        return Err(none_left(fault, faults.len(), paths.len()).into());
    }
    faults.into_iter().for_each(|fault| tell(MergeEvent::Unusable(fault)));
    let share = |share| {
        run.done(share);
        tell(MergeEvent::Share(share));
    };
    let (mut placed, merged) = views.merged(&run.with_share(&share))?;
    placed.warnings.extend(listed.warnings());
    Ok(MergeResult { identity: around.identity, files, placed, merged })
}

/// The fault of a view without its folder: the same views give the same report wherever they lie.
fn in_one_line(fault: &Diagnostic) -> String {
    let place = match (&fault.file, fault.line) {
        (Some(file), Some(line)) => format!("{}:{line}: ", name_of(file)),
        (Some(file), None) => format!("{}: ", name_of(file)),
        (None, _) => String::new(),
    };
    format!("{place}{}", fault.message)
}

/// The first fault, told for all views.
fn none_left(fault: &Diagnostic, unusable: usize, of: usize) -> Diagnostic {
    let why = &fault.message;
    let message = match unusable {
        0 | 1 => format!("{why}, expected two or more that can be merged"),
        _ => format!("{why}; {unusable} of {of} views cannot be used, expected two or more that can be merged"),
    };
    Diagnostic { message, ..fault.clone() }
}

/// What views are merged with: poses, calibration, CAD.
struct Around {
    tools: Tools,
    poses: Option<Vec<Isometry3>>,
    part: Option<Part>,
    identity: MergeIdentity,
}

impl Around {
    fn read(plan: &MergePlan, whose: &Place, views: &[String], run: &RunContext) -> Result<Self, StitchError> {
        let file_of = |path: &Path, sha256: String| FileIdentity::new(path, sha256);
        let mut identity =
            MergeIdentity { merge: Some(file_of(&plan.path, plan.sha256.clone())), ..MergeIdentity::default() };
        let (mut known_poses, mut part) = (None, None);
        match &plan.views.prealign {
            Prealign::Poses(named) => {
                let path = poses_path(named, whose);
                let (bytes, sha256) = read_named(&path, run)?;
                known_poses = Some(poses(&bytes, views).map_err(|fault| fault.in_file(&path))?);
                identity.poses = Some(file_of(&path, sha256));
            }
            Prealign::Cad(cad) => {
                let prepared = by_cad::prepare(cad, run)?;
                identity.cad = Some(file_of(&cad.path, prepared.cad_sha256.clone()));
                part = Some(prepared);
            }
            Prealign::None => {}
        }
        let calibrated = Calibrated::read(plan, run)?;
        (identity.camera, identity.projector) = (calibrated.camera, calibrated.projector);
        let tools = calibrated.tools;
        Ok(Self { tools, poses: known_poses, part, identity })
    }

    /// What is known of a view's pose.
    fn start(
        &self,
        plan: &MergePlan,
        index: usize,
        conditioned: &Conditioned,
        run: &RunContext,
    ) -> Result<Result<Isometry3, NoStart>, StitchError> {
        if let Some(poses) = &self.poses {
            return Ok(Ok(poses[index]));
        }
        let (Some(part), Prealign::Cad(cad)) = (&self.part, &plan.views.prealign) else {
            return Ok(Err(NoStart::Unknown));
        };
        by_cad::check_size(plan, cad, part, &conditioned.view)?;
        Ok(by_cad::start(part, &conditioned.view, plan.unit.in_mm(), run)?)
    }
}

/// The poses of a part may lie beside its views.
fn poses_path(named: &NamedFile, whose: &Place) -> PathBuf {
    let name = named.path.file_name().unwrap_or_default();
    let own = whose.folder.as_ref().map(|folder| folder.join(name)).filter(|path| path.is_file());
    own.unwrap_or_else(|| named.path.clone())
}

impl From<StitchError> for ReadError {
    fn from(error: StitchError) -> Self {
        match error {
            StitchError::Fault(fault) => ReadError::Bad(fault),
            StitchError::CutOff(fault) => ReadError::CutOff(fault),
            StitchError::Cancelled(cancelled) => ReadError::Cancelled(cancelled),
        }
    }
}
