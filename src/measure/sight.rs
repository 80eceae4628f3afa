//! Lines of sight: what of the part stands between a place and the camera, which points belong to another of its walls, and to
//! which place of the sheet a point belongs.
//!
//! A sheet may come near itself: the walls of a channel, the leaves of a hem. The points of the leaf in front must not be
//! taken for the one behind it.

use super::frame::{FeatureFrame, Uvw};
use super::patch::{CadPatch, face_height};
use super::{Local, NotFound};
use crate::geometry::Vector3;
use crate::plan::Side;

/// A camera (or the cameras of a rig) may stand this far off the viewing direction, as seen from the place, rad: 12 and 25 degrees.
const OFF_AXIS_RAD: [f64; 2] = [0.21, 0.44];
/// Directions on each of these cones.
const AROUND: usize = 8;
/// A line of sight must rise from the face by more than this (sine).
const LEAST_RISE: f64 = 0.05;
/// The line of sight starts this far off the face, so that the face's own facets do not block it, mm.
const CLEAR_MM: f64 = 0.1;
/// A nominal place is at most this far from the face that it belongs to, mm.
const NOMINAL_OFF_MM: f64 = 2.0;
/// What is nearer than this share of the height is nearer by far.
const FAR_NEARER: f64 = 0.3;
/// A point nearer than this to the face it is compared with is that face's, whatever else is near, mm.
const OWN_MM: f64 = 0.3;

/// Sees to it that a camera can look at the feature's place on the seen face, whose sheet lies at some `places` (u, v) of its plane.
/// Where nobody knows where the camera is, the points alone decide.
///
/// Lines of sight start from the face, not from the nominal place: that may lie under the face, by the chord of a hollow's facets
/// or because the plan has it a little too low.
///
/// # Errors
/// From every direction a camera may have, the face is turned away or another leaf of the part stands before it.
pub fn check_in_sight(local: &Local, frame: &FeatureFrame, places: &[[f64; 2]]) -> Result<(), NotFound> {
    let Some(to_camera) = local.scan.to_camera else { return Ok(()) };
    let axis = local.cad_from_scan.vector(&to_camera);
    let outward = frame.axes[2] * frame.outward;
    let across = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    let other = axis.cross(&across);
    let cone = |angle: f64| {
        (0..AROUND).map(move |k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / AROUND as f64).sin_cos();
            axis * angle.cos() + (across * cos + other * sin) * angle.sin()
        })
    };
    let mut directions = std::iter::once(axis).chain(OFF_AXIS_RAD.into_iter().flat_map(cone));
    let heights: Vec<f64> = places.iter().filter_map(|p| face_height(local, frame, *p, NOMINAL_OFF_MM)).collect();
    let face_mm = heights.iter().sum::<f64>() / heights.len().max(1) as f64;
    let start = frame.on_seen_face([0.0, 0.0, face_mm]) + outward * CLEAR_MM;
    let free = |d: &Vector3| {
        [Side::Top, Side::Bottom].iter().all(|side| local.part.face(*side).bvh.ray(&start, d, f64::INFINITY).is_none())
    };
    if directions.any(|d| d.dot(&outward) > LEAST_RISE && free(&d)) {
        return Ok(());
    }
    Err(NotFound::new("the part itself hides this place from the camera", 0))
}

/// Whether a point, `above_mm` off the face that it is compared with, is one of another wall: of one that faces the other way and is
/// nearer, or of one that is nearer by far. The face itself, which may lean by 60 degrees from w, is never half as near as it is
/// high. `rise_mm` is how much of `above_mm` may be due to the face's own rise. Only the seen face is asked: the other skin of the wall
/// in question lies just behind it.
pub fn is_of_another_wall(local: &Local, frame: &FeatureFrame, p: &Uvw, above_mm: f64, rise_mm: f64) -> bool {
    let reach_mm = above_mm.abs();
    if reach_mm <= OWN_MM {
        return false;
    }
    local.face.closest(&frame.on_seen_face(*p), reach_mm).is_some_and(|hit| {
        let faces_other_way = hit.normal.dot(&frame.axes[2]) * frame.outward < 0.0;
        faces_other_way || hit.signed_mm.abs() < FAR_NEARER * (reach_mm - rise_mm)
    })
}

/// (u, v, height above the CAD) of the points within a height of the CAD's face, without those of another wall.
pub fn own_heights(
    local: &Local,
    frame: &FeatureFrame,
    patch: &CadPatch,
    gathered: &[Uvw],
    within_mm: f64,
) -> Vec<[f64; 3]> {
    let above = gathered.iter().map(|p| (p, patch.residual(p)));
    // Not a number is no height.
    let near = above.filter(|(_, mm)| mm.is_finite() && mm.abs() <= within_mm);
    near.filter(|(p, mm)| !is_of_another_wall(local, frame, p, *mm, 0.0)).map(|(p, mm)| [p[0], p[1], mm]).collect()
}

/// Moves a point back along the line of sight to the height of the sheet's layer (heights and slopes about the frame, above
/// the CAD): the error of a point lies along that line, and on a sheet that leans it would pass for a shift within the sheet.
///
/// Where nobody knows where the camera is, the point is moved along w, that is: not at all.
pub struct Sight {
    /// Shift in (u, v) per mm of height above the layer.
    per_mm: [f64; 2],
}

impl Sight {
    /// For a layer of the slopes `[eu, ev]` on top of the CAD's own.
    pub fn new(local: &Local, frame: &FeatureFrame, [eu, ev]: [f64; 2]) -> Self {
        let along = local.scan.to_camera.and_then(|to_camera| {
            let c = local.cad_from_scan.vector(&to_camera);
            let [cu, cv, cw] = frame.axes.map(|a| a.dot(&c));
            let rise = cw - eu * cu - ev * cv;
            // Grazing sight tells nothing of where on the sheet a point belongs.
            (rise.abs() > 0.1).then(|| [cu / rise, cv / rise])
        });
        Self { per_mm: along.unwrap_or([0.0; 2]) }
    }

    /// Shift in (u, v) per mm of height above the layer: also that of the sheet's outline per mm by which the layer is too high.
    pub fn per_mm(&self) -> [f64; 2] {
        self.per_mm
    }

    /// (u, v) of the sheet's place that was seen as a point `above_mm` over the layer.
    pub fn on_sheet(&self, u: f64, v: f64, above_mm: f64) -> [f64; 2] {
        [u - self.per_mm[0] * above_mm, v - self.per_mm[1] * above_mm]
    }
}
