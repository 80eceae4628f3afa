//! Which places of the CAD lie in a region, and how well they hold the part.

use super::common::Common;
use super::pose::PoseUncertainty;
use super::region_sums::{Frame, Normal};
use crate::fit::hold::Twist;
use crate::geometry::{Isometry3, Point3, Vector3};
use crate::part::{Face, Part};
use crate::plan::{FitRegion, RegionFit, RegionShape, Side};
use nalgebra::Vector6;

/// Steps of the lattice from a region's middle to its end.
const STEPS: f64 = 8.0;

/// Places of a face in a region, evenly spread.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RegionPlaces {
    /// On the face, with its outward normals.
    pub places: Vec<(Point3, Vector3)>,
    /// Area of the face in the region.
    pub area_mm2: f64,
}

/// The place of the CAD's own surface below a place of a face with that outward normal.
pub(super) fn on_cad(part: &Part, face: &Face, place: &Point3, outward: &Vector3) -> Point3 {
    let cad_normal = outward * face.side.sign();
    place - cad_normal * part.cad_side.face_offset_mm(face.side, part.thickness_mm)
}

/// Looks for the places of a face whose nominal places on the CAD lie in a region, on a lattice: those of its points that are within
/// half a step of the surface stand for a square of it each.
pub fn region_places(part: &Part, side: Side, region: &FitRegion) -> RegionPlaces {
    let half = match region.shape {
        RegionShape::Ball { radius_mm } => Vector3::repeat(radius_mm),
        RegionShape::Box { size_mm } => size_mm * 0.5,
    };
    let step_mm = half.max() / STEPS;
    let face = part.face(side);
    let reach_mm = step_mm + part.thickness_mm;
    let ends = half.map(|h| (h / step_mm).floor() as i32);
    let mut places = Vec::new();
    for k in -ends.x..=ends.x {
        for l in -ends.y..=ends.y {
            for m in -ends.z..=ends.z {
                let at = region.centre + Vector3::new(f64::from(k), f64::from(l), f64::from(m)) * step_mm;
                let Some(hit) = face.closest(&at, reach_mm).filter(|hit| !hit.on_boundary) else { continue };
                let nominal = on_cad(part, face, &hit.point, &hit.normal);
                if (at - nominal).norm() <= 0.5 * step_mm && region.contains(&nominal) {
                    places.push((hit.point, hit.normal.into_inner()));
                }
            }
        }
    }
    let area_mm2 = places.len() as f64 * step_mm * step_mm;
    RegionPlaces { places, area_mm2 }
}

/// What regions hold, as the CAD has them: the condition and the weakest motion of those that are not frozen.
///
/// # Errors
/// The motions that stay free.
pub fn region_hold(part: &Part, side: Side, fit: &RegionFit) -> Result<(f64, Twist), Vec<Twist>> {
    let frame = Frame::of(fit, part.diagonal_mm());
    frame.judged(&nominal_equations(part, side, fit, &frame, |_| 0.0).h)
}

/// The uncertainty of the pose to expect of a fit to regions, before anything is measured. `height_variance_mm4`: of a region of that area
/// (mm²), the variance of a height told by a piece of it, times the area of that piece. `whole`: what to expect of the best fit to
/// the whole part, from which frozen freedoms come; not looked at without any. `None` where the regions leave a motion free.
pub fn expected_region_fit(
    part: &Part,
    side: Side,
    fit: &RegionFit,
    whole: Option<&PoseUncertainty>,
    height_variance_mm4: impl Fn(f64) -> f64,
) -> Option<PoseUncertainty> {
    let frame = Frame::of(fit, part.diagonal_mm());
    let normal = nominal_equations(part, side, fit, &frame, height_variance_mm4);
    frame.judged(&normal.h).ok()?;
    let whole = if fit.freeze.is_empty() { Vec::new() } else { whole?.motions() };
    let mut known = PoseUncertainty::none(part.bounds.centre());
    frame.uncertain_motions(&normal, &whole)?.into_iter().for_each(|motion| known.add(motion));
    Some(known)
}

/// What thickness and scale do to a part that is held by regions: the motion that fits their displaced surface best, frozen freedoms as the
/// best fit to the whole displaced face has them. Reckoned with all of each region, whatever of it the camera saw.
pub fn move_region_fit(common: &Common, fit: &RegionFit, known: &mut PoseUncertainty) {
    common.move_best_fit(known);
    let [of_thickness, of_scale] = known.common_motions();
    let Common { part, face, settings } = *common;
    let about = part.bounds.centre();
    let thicker_mm = part.cad_side.face_offset_mm(face.side, settings.thickness_mm) * face.side.sign();
    let share = settings.scale_ppm * 1e-6;
    if thicker_mm == 0.0 && share == 0.0 {
        return;
    }
    let frame = Frame::of(fit, part.diagonal_mm());
    let places: Vec<(f64, RegionPlaces)> =
        fit.regions.iter().map(|region| (region.weight, region_places(part, face.side, region))).collect();
    if let Some(motion) = displaced(&frame, &places, &of_thickness, |_, outward| outward * thicker_mm) {
        known.set_thickness(motion);
    }
    if let Some(motion) = displaced(&frame, &places, &of_scale, |place, _| (place - about) * share) {
        known.set_scale(motion);
    }
}

/// The motion that brings displaced regions (weight and places) back as well as a motion can; `None` where they leave one free.
fn displaced(
    frame: &Frame,
    regions: &[(f64, RegionPlaces)],
    whole: &Isometry3,
    by: impl Fn(&Point3, &Vector3) -> Vector3,
) -> Option<Isometry3> {
    let mut normal = Normal::zero();
    for (weight, RegionPlaces { places, .. }) in regions {
        let weight = weight / places.len().max(1) as f64;
        for (place, outward) in places {
            let slope = frame.slope(place, outward);
            normal.h += slope * slope.transpose() * weight;
            normal.g += slope * (by(place, outward).dot(outward) * weight);
        }
    }
    let numbers = frame.numbers(whole);
    let kept = Vector6::from_fn(|k, _| if frame.frozen[k] { numbers[k] } else { 0.0 });
    let step = frame.step(&normal.h, &(normal.g + normal.h * kept))?;
    Some(frame.motion(&(kept + step)))
}

fn nominal_equations(
    part: &Part,
    side: Side,
    fit: &RegionFit,
    frame: &Frame,
    height_variance_mm4: impl Fn(f64) -> f64,
) -> Normal {
    let mut normal = Normal::zero();
    for region in &fit.regions {
        let RegionPlaces { places, area_mm2 } = region_places(part, side, region);
        let count = places.len().max(1) as f64;
        let weight = region.weight / count;
        let variance_mm2 = height_variance_mm4(area_mm2) * count / area_mm2.max(1e-9);
        for (place, outward) in &places {
            let slope = frame.slope(place, outward);
            let square = slope * slope.transpose();
            normal.h += square * weight;
            normal.variance += square * (weight * weight * variance_mm2);
        }
    }
    normal
}
