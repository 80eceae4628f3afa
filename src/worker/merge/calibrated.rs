//! The calibrated features that settings name.

use super::files::read_named;
use crate::plan::merge::{MergePlan, NamedFile};
use crate::run::RunContext;
use crate::stitch::calibration::Calibration;
use crate::stitch::units::check_calibration;
use crate::stitch::{FileIdentity, StitchError, Tools, View, calibration};

/// What is measured with, and the files that it came from with the number of their features.
#[derive(Default)]
pub(super) struct Calibrated {
    pub tools: Tools,
    pub camera: Option<(FileIdentity, usize)>,
    pub projector: Option<(FileIdentity, usize)>,
}

impl Calibrated {
    /// Reads what `[calibration]` names.
    ///
    /// # Errors
    /// A file that cannot be read or used, or the job was stopped.
    pub fn read(plan: &MergePlan, run: &RunContext) -> Result<Self, StitchError> {
        let (camera, camera_file) = read(plan, &plan.calibration.camera, run)?.unzip();
        let (projector, projector_file) = read(plan, &plan.calibration.projector, run)?.unzip();
        Ok(Self { tools: Tools { camera, projector }, camera: camera_file, projector: projector_file })
    }
}

type Read = Option<(Calibration, (FileIdentity, usize))>;

fn read(plan: &MergePlan, named: &Option<NamedFile>, run: &RunContext) -> Result<Read, StitchError> {
    let Some(named) = named else { return Ok(None) };
    let (bytes, sha256) = read_named(&named.path, run)?;
    let (features, count) = calibration(&bytes, &named.path, plan.unit, run)?;
    Ok(Some((features, (FileIdentity::new(&named.path, sha256), count))))
}

/// Calibration in another unit than the views is a mistake of the settings, not of a view.
pub(super) fn check_units(plan: &MergePlan, tools: &Tools, view: &View) -> Result<(), StitchError> {
    let pairs = [(&plan.calibration.camera, &tools.camera), (&plan.calibration.projector, &tools.projector)];
    pairs.into_iter().try_for_each(|(file, features)| match (file, features) {
        (Some(file), Some(features)) => check_calibration(plan, file, features, &view.positions),
        _ => Ok(()),
    })
}
