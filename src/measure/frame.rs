//! The frame of one feature: u and v in the sheet, w along the plan's normal, origin at the nominal place.

use super::card::Card;
use super::{Local, NotFound};
use crate::geometry::{Isometry3, Point3, UnitVector3, Vector3};
use crate::part::{Face, Part};
use crate::plan::{CadSide, Side};
use nalgebra::Matrix3;

/// A place in a feature's frame: u, v, w in mm.
pub type Uvw = [f64; 3];

/// The frame of one feature. The same axes serve the CAD's own face (origin `nominal`) and the face that the camera saw
/// (origin `seen`), which is how the thickness is put in and taken out again.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureFrame {
    /// Nominal place on the CAD's own face, CAD frame.
    pub nominal: Point3,
    /// The same place on the face that the camera saw, CAD frame.
    pub seen: Point3,
    /// Unit vectors u, v, w (right-handed) in the CAD frame; w is the plan's normal or direction.
    pub axes: [Vector3; 3],
    /// +1 when w points out of the sheet towards the camera, -1 when it points away.
    pub outward: f64,
}

impl FeatureFrame {
    /// A frame with w along `w` and, where given, v along `v` (perpendicular to w; its rest is taken off). The place is
    /// moved to the seen face along the CAD's `normal`, since w may lean away from it or even point the other way.
    pub fn new(local: &Local, nominal: Point3, normal: &UnitVector3, w: &UnitVector3, v: Option<&Vector3>) -> Self {
        Self::on_cad(local.part, local.face, nominal, normal, w, v)
    }

    /// The same without a scan.
    pub fn on_cad(
        part: &Part,
        face: &Face,
        nominal: Point3,
        normal: &UnitVector3,
        w: &UnitVector3,
        v: Option<&Vector3>,
    ) -> Self {
        let seen = seen_place(part, face, &nominal, normal);
        let outward = face.side.sign() * if normal.dot(w) < 0.0 { -1.0 } else { 1.0 };
        let across = |a: &Vector3| UnitVector3::try_new(a - w.into_inner() * a.dot(w), 1e-6);
        let smallest = Vector3::ith(w.iamin(), 1.0);
        let v = v.and_then(across).or_else(|| across(&smallest)).map_or(Vector3::y(), |v| v.into_inner());
        Self { nominal, seen, axes: [v.cross(w), v, w.into_inner()], outward }
    }

    /// A place of this frame on the CAD's own face, CAD frame.
    pub fn on_own_face(&self, [u, v, w]: Uvw) -> Point3 {
        self.nominal + self.vector([u, v, w])
    }

    /// A place of this frame on the face that the camera saw, CAD frame.
    pub fn on_seen_face(&self, [u, v, w]: Uvw) -> Point3 {
        self.seen + self.vector([u, v, w])
    }

    /// A vector of this frame in the CAD frame.
    pub fn vector(&self, [u, v, w]: Uvw) -> Vector3 {
        self.axes[0] * u + self.axes[1] * v + self.axes[2] * w
    }

    /// A covariance about this frame in the CAD frame.
    pub fn covariance(&self, own: &Matrix3<f64>) -> Matrix3<f64> {
        let axes = Matrix3::from_columns(&self.axes);
        axes * own * axes.transpose()
    }

    /// A place of the seen face (CAD frame) in this frame.
    pub fn of_cad(&self, p: &Point3) -> Uvw {
        let d = p - self.seen;
        [d.dot(&self.axes[0]), d.dot(&self.axes[1]), d.dot(&self.axes[2])]
    }

    /// Points of the scan within `radius_mm` of the line through (u, v) along w, and within `depth_mm` of the seen place.
    pub fn gather(&self, local: &Local, [u, v]: [f64; 2], radius_mm: f64, depth_mm: f64) -> Vec<Uvw> {
        let scan_from_cad: Isometry3 = local.cad_from_scan.scan_from_cad();
        let centre = scan_from_cad * self.on_seen_face([u, v, 0.0]);
        let axes = self.axes.map(|a| scan_from_cad.rotation * a);
        let radius_sq = radius_mm * radius_mm;
        let mut out = Vec::new();
        local.grid.for_each_in_sphere(&centre, radius_mm.hypot(depth_mm), |_, p| {
            let d = p - centre;
            let place = [d.dot(&axes[0]), d.dot(&axes[1]), d.dot(&axes[2])];
            if place[2].abs() <= depth_mm && place[0] * place[0] + place[1] * place[1] <= radius_sq {
                out.push([place[0] + u, place[1] + v, place[2]]);
            }
        });
        out
    }
}

/// Heights about the sheet's layer, along the outward side of the sheet, within which a point is taken for the sheet: from
/// minus the first to plus the second, mm. `cut_face_tangent` is the tangent of the angle by which the cut face of the
/// rim turns towards the camera; 0 or less where the sheet hides it.
///
/// Where a sheet leans, the cut face of its rim comes into view. Its points hang from the rim into
/// the sheet's thickness and would be taken for up to `depth * tangent` of additional sheet, so the gate's depth is
/// held to 0.02 mm of that, or a tenth of the spacing, but not below half of the scatter: narrower, it would cost more by
/// the points it leaves out than it saves.
pub fn sheet_gate_mm(local: &Local, cut_face_tangent: f64, sigma_mm: f64) -> [f64; 2] {
    let added_mm = (0.1 * local.scan.spacing_mm).max(0.02);
    let wide = (3.5 * sigma_mm).max(0.15);
    [(added_mm / cut_face_tangent.max(1e-6)).clamp(0.5 * sigma_mm, wide), wide]
}

/// Tangent of the angle by which the cut face of a rim that ends along v turns towards the camera: negative where the sheet
/// hides it; 0.2 where nobody knows where the camera is.
pub fn cut_face_tangent(local: &Local, frame: &FeatureFrame) -> f64 {
    local.scan.to_camera.map_or(UNKNOWN_LEAN, |to_camera| {
        let c = local.cad_from_scan.vector(&to_camera);
        c.dot(&frame.axes[1]) / c.dot(&frame.axes[2]).abs().max(0.1)
    })
}

/// What is assumed of the lean where nobody knows where the camera is.
const UNKNOWN_LEAN: f64 = 0.2;

/// Tangent of the angle by which the sheet leans away from the camera; 0.2 where nobody knows where the camera is.
pub fn lean_tangent(local: &Local, frame: &FeatureFrame) -> f64 {
    local.scan.to_camera.map_or(UNKNOWN_LEAN, |to_camera| {
        let cosine = local.cad_from_scan.vector(&to_camera).dot(&frame.axes[2]).abs().clamp(0.1, 1.0);
        (1.0 - cosine * cosine).sqrt() / cosine
    })
}

/// Normal of the CAD around a nominal place, on the side of the CAD's own normals (of a solid: the plan's): the mean over
/// places of the plane across the plan's axis `w`, whichever way that points.
///
/// Where the face is further away than the sheet is thick and a little more, or leans over from `w` by more than 60° (another
/// wall), a place does not count; where none does, `w` is all there is to go by.
pub fn sheet_normal(local: &Local, nominal: &Point3, w: &UnitVector3, around: &[Vector3]) -> UnitVector3 {
    sheet_normal_of(local.part, local.face, nominal, w, around)
}

/// The same without a scan.
pub fn sheet_normal_of(part: &Part, face: &Face, nominal: &Point3, w: &UnitVector3, around: &[Vector3]) -> UnitVector3 {
    const LEAST_COSINE: f64 = 0.5;
    let cad_side = face.side.sign();
    let normals = around.iter().filter_map(|away| {
        let reach_mm = part.thickness_mm + 2.0 + 0.3 * away.norm();
        let hit = face.closest(&(nominal + away), reach_mm)?;
        let normal = hit.normal.into_inner() * cad_side;
        (normal.dot(w).abs() >= LEAST_COSINE).then_some(normal)
    });
    let sum = normals.fold(Vector3::zeros(), |sum, n| sum + n);
    UnitVector3::try_new(sum, 1e-3).unwrap_or(*w)
}

/// Sees to it that a place found on the seen face stands clear of the belt: lower, the filter that removes the belt has cut
/// the sheet off or has taken a part of its points, and what was fitted is the filter's work.
///
/// # Errors
/// The place is lower than what can be told from the belt there.
pub fn clear_of_belt(local: &Local, seen_places: &[Point3], points: usize, card: &mut Card) -> Result<(), NotFound> {
    let (Some(belt), Some(face_mm)) = (local.scan.belt, nearest_face_mm(local, seen_places)) else { return Ok(()) };
    let scan_from_cad: Isometry3 = local.cad_from_scan.scan_from_cad();
    let heights = seen_places.iter().map(|p| belt.height_mm(&(scan_from_cad * p)));
    let lowest_mm = heights.fold(f64::INFINITY, f64::min);
    is_told_from_belt(local, lowest_mm, face_mm, points, card)
}

/// What was not found, or that its nominal place, which is that near to the belt, is the reason for it.
pub fn or_too_near_the_belt<T>(
    local: &Local,
    nominal: &Point3,
    found: Result<T, NotFound>,
    card: &mut Card,
) -> Result<T, NotFound> {
    found.map_err(|not| match nearest_face_mm(local, &[*nominal]) {
        // Asked only where it fails: the card ends with the question that was.
        Some(face_mm) if face_mm < local.scan.told_from_belt_mm(face_mm) => {
            is_told_from_belt(local, face_mm, face_mm, not.points, card).err().unwrap_or(not)
        }
        _ => not,
    })
}

/// Whether a height above the belt can be told from it where the part's face lies `face_mm` above it.
fn is_told_from_belt(
    local: &Local,
    height_mm: f64,
    face_mm: f64,
    points: usize,
    card: &mut Card,
) -> Result<(), NotFound> {
    if !card.at_least("height above the belt", "mm", height_mm, local.scan.told_from_belt_mm(face_mm)) {
        let reason = format!("lies {height_mm:.1} mm above the belt, too near to be told from it");
        return Err(NotFound::new(reason, points));
    }
    Ok(())
}

/// How high above the belt the seen face lies where it is nearest to some places (CAD frame); the lowest, in mm. `None` without a belt.
fn nearest_face_mm(local: &Local, places: &[Point3]) -> Option<f64> {
    let belt = local.scan.belt_clearance_mm.and(local.scan.belt)?;
    let scan_from_cad: Isometry3 = local.cad_from_scan.scan_from_cad();
    let height = |p: &Point3| {
        let hit = local.face.closest(p, f64::INFINITY)?;
        Some(belt.height_mm(&(scan_from_cad * hit.point)))
    };
    places.iter().filter_map(height).reduce(f64::min)
}

/// Where the nominal place lies on the face that the camera saw. `normal` is the sheet's on the plan's side.
///
/// A surface is moved by the thickness as the plan says; a solid seen from below by that between its skins along the normal, so that
/// what the nominal place is off the one it is off the other, and where one of them is missing (over a hole) by the CAD's thickness.
fn seen_place(part: &Part, face: &Face, nominal: &Point3, normal: &UnitVector3) -> Point3 {
    let thickness = part.thickness_mm;
    if part.cad_side != CadSide::Solid {
        return nominal + normal.into_inner() * part.cad_side.face_offset_mm(face.side, thickness);
    }
    if face.side == Side::Top {
        return *nominal;
    }
    // From a little off, so that a skin right at the start is found as well.
    let back = 0.05;
    let reach = if thickness > 0.0 { 3.0 * thickness } else { 10.0 };
    let n = normal.into_inner();
    let skin = |side: Side, from_mm: f64, sense: f64| {
        let start = nominal + n * (from_mm - sense * back);
        let hit = part.face(side).bvh.ray(&start, &(n * sense), reach)?;
        Some(from_mm + sense * (hit.t - back))
    };
    let above = [1.0, -1.0].into_iter().filter_map(|sense| skin(Side::Top, 0.0, sense));
    let own_mm = above.min_by(|a, b| a.abs().total_cmp(&b.abs()));
    let between = own_mm.and_then(|own| Some(own - skin(Side::Bottom, own, -1.0)?));
    nominal - n * between.unwrap_or(thickness)
}
