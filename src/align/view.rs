//! Who knows where the camera stood, and from which directions a face may have been seen.

use super::refuse;
use super::sampling::WorkCloud;
use crate::diagnostic::Stop;
use crate::geometry::{UnitVector3, Vector3, decompose};
use crate::part::Part;
use crate::plan::{CadSide, Side};
use crate::scan::ConditionedScan;
use nalgebra::Matrix3;

/// Resting poses tried.
const MOST_RESTING: usize = 10;
/// Directions nearer than this are one.
const SAME_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;

/// What is known about the camera.
pub(super) struct View {
    /// Towards the camera, scan frame.
    pub to_camera_scan: Option<UnitVector3>,
    /// The side of the sheet follows from the pose.
    pub tells_side: bool,
    /// Both ends of the view axis must be tried, since the two faces of a solid lie in different places.
    pub both_ends: bool,
}

impl View {
    /// Reads the camera's direction off the scan.
    pub fn of(part: &Part, scan: &ConditionedScan) -> Result<Self, Stop> {
        let to_camera_scan = scan.to_camera;
        let tells_side = to_camera_scan.is_some();
        if !tells_side && part.cad_side != CadSide::Solid && part.thickness_mm > 0.0 {
            return Err(refuse::without_side(part.thickness_mm).into());
        }
        Ok(Self { to_camera_scan, tells_side, both_ends: !tells_side && part.cad_side == CadSide::Solid })
    }
}

/// CAD directions that may point along z of the work frame, each not within a few degrees of another.
///
/// On a belt these are the resting poses, the most stable first, and each of them turned over. Without a belt z is the thin
/// axis of the data, so the thin axis of what is seen of each of them stands in for it.
pub(super) fn directions(part: &Part, cloud: &WorkCloud) -> Vec<Vector3> {
    let mut ups: Vec<Vector3> = part.resting_poses.iter().take(MOST_RESTING).map(|p| p.up_cad.into_inner()).collect();
    let flat = thin_axis(part, None);
    ups.push(flat);
    let both: Vec<Vector3> = ups.iter().flat_map(|u| [*u, -u]).collect();
    let mut kept: Vec<Vector3> = Vec::new();
    for up in both {
        let up = if cloud.on_belt { up } else { thin_axis(part, Some(&up)) };
        if kept.iter().all(|k| k.dot(&up) < SAME_RAD.cos()) {
            kept.push(up);
        }
    }
    kept
}

/// Direction of least variance of the samples of both faces that look towards `up` (all of them for `None`), on that side.
fn thin_axis(part: &Part, up: Option<&Vector3>) -> Vector3 {
    let side = up.map_or(Side::Top, |u| super::candidates::seen_side(part, u));
    let seen: Vec<Vector3> = part
        .face(side)
        .samples
        .iter()
        .filter(|s| up.is_none_or(|u| s.normal.dot(u) > 0.1))
        .map(|s| s.point.coords)
        .collect();
    let middle = seen.iter().sum::<Vector3>() / seen.len().max(1) as f64;
    let spread = seen.iter().fold(Matrix3::zeros(), |s, p| s + (p - middle) * (p - middle).transpose());
    let Some(eigen) = decompose::symmetric_eigen(spread) else { return up.copied().unwrap_or_else(Vector3::z) };
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    match up {
        Some(u) if axis.dot(u) < 0.0 => -axis,
        _ => axis,
    }
}
