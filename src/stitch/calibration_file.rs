//! Files of calibrated features: text columns x y z reprojection_px, in the view's frame and unit.

use super::StitchError;
use super::calibration::{CalibratedFeature, Calibration};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::LengthUnit;
use crate::io::read_cloud_in_its_unit;
use crate::run::RunContext;
use std::path::Path;

/// The name of the column.
const REPROJECTION: &str = "reprojection_px";

/// Reads features; also how many they are.
///
/// # Errors
/// A file that holds no points or has no column `reprojection_px`; or the job was stopped.
pub fn calibration(
    bytes: &[u8],
    file: &Path,
    unit: LengthUnit,
    run: &RunContext,
) -> Result<(Calibration, usize), StitchError> {
    // Nobody waits for the rest of a calibration.
    let cloud = read_cloud_in_its_unit(bytes, file, unit, run).map_err(|error| match error {
        ReadError::CutOff(fault) => StitchError::Fault(fault),
        other => other.into(),
    })?;
    let errors = cloud.scalars.iter().find(|(name, _)| name.eq_ignore_ascii_case(REPROJECTION));
    let fault = |message: String, help: &str| Diagnostic::error(message).in_file(file).with_help(help);
    let Some((_, errors)) = errors else {
        let found: Vec<&str> = cloud.scalars.iter().map(|(name, _)| name.as_str()).take(8).collect();
        let found = if found.is_empty() { "no further column".to_owned() } else { found.join(", ") };
        let message = format!("found {found} beside x, y and z, expected reprojection_px");
        return Err(fault(message, "write a first line x,y,z,reprojection_px and then a line for each feature").into());
    };
    let feature = |(position, error): (&_, &f32)| CalibratedFeature { position: *position, reprojection_px: *error };
    let features: Vec<CalibratedFeature> = cloud.positions.iter().zip(errors).map(feature).collect();
    let count = features.len();
    let built = Calibration::new(features).map_err(|e| fault(e.to_string(), "export the calibration again"))?;
    Ok((built, count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;

    fn read(text: &str) -> Result<(Calibration, usize), StitchError> {
        calibration(text.as_bytes(), Path::new("c.csv"), LengthUnit::Um, &RunContext::silent())
    }

    #[test]
    fn features_are_read_with_their_errors() {
        let (found, count) = read("x,y,z,reprojection_px\n0,0,9000,0.25\n100,0,9000,0.5\n").unwrap();
        let near = found.near(&Point3::new(90.0, 0.0, 9000.0));
        assert_eq!((count, near.distance, near.reprojection_px), (2, 10.0, 0.5));
    }

    #[test]
    fn files_without_errors_and_pages_are_told() {
        for (text, words) in [
            ("x,y,z\n0,0,9000\n1,2,3\n", "no further column"),
            ("x,y,z,error\n0,0,9000,1\n1,2,3,1\n", "found error beside"),
            ("<html><body>404</body></html>\n", ""),
            ("", ""),
        ] {
            let Err(StitchError::Fault(told)) = read(text) else { panic!("{text:?} is no calibration") };
            assert!(told.message.contains(words) && told.help.is_some() && told.file.is_some(), "{told}");
        }
    }
}
