//! One thing that stands on the belt: what a ray down on it meets, and what it hides; and where others stand beside it.

use super::blank::Uv;
use super::caster::Caster;
use super::placing::{PoseChoice, put_down};
use super::rig::{RigModel, Stream, stream};
use super::rim::Rims;
use super::subject::Subject;
use crate::geometry::{Aabb, Isometry3, Point3, Vector3};
use nalgebra::Translation3;

/// Something else on the belt: it stands in +x of the belt from what was put down before it.
#[derive(Debug, Clone, Copy)]
pub struct Neighbour<'a> {
    /// What it is.
    pub subject: &'a Subject,
    /// How it lies; its place follows from the gap.
    pub pose: PoseChoice,
    /// Between its box and the box before it, seen from above, mm.
    pub gap_mm: f64,
}

/// How much of the belt is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InView {
    /// The part with the rig's margin: neighbours are cut off where that ends.
    ThePart,
    /// The neighbours as well.
    Everything,
}

/// A part where it stands.
pub(super) struct Standing<'a> {
    subject: &'a Subject,
    caster: Caster,
    rims: Rims,
    /// CAD to belt.
    pub belt_from_cad: Isometry3,
    /// Belt to CAD.
    pub cad_from_belt: Isometry3,
    /// Its highest point above the belt.
    pub top_mm: f64,
    /// Its box seen from above.
    pub footprint: (Uv, Uv),
}

/// What a ray down on a part meets, belt frame.
pub(super) struct Met {
    /// Where.
    pub place: Point3,
    /// Normal there, and how far the rounded rim lies below the place, mm (it is as visible as the sharp one); `None` on a cut face
    /// that is not seen.
    pub seen: Option<(Vector3, f64)>,
}

impl<'a> Standing<'a> {
    pub fn new(subject: &'a Subject, rig: &RigModel, belt_from_cad: Isometry3) -> Self {
        let bounds = bounds(subject, &belt_from_cad);
        Self {
            caster: Caster::new(&subject.solid),
            rims: Rims::new(subject, rig.rim_rounding_mm),
            subject,
            belt_from_cad,
            cad_from_belt: belt_from_cad.inverse(),
            top_mm: bounds.max.z,
            footprint: (bounds.min.xy(), bounds.max.xy()),
        }
    }

    /// What the ray down on `q` meets of this part; `None` where it passes by.
    pub fn met(&self, q: &Uv, rig: &RigModel) -> Option<Met> {
        let (low, high) = self.footprint;
        if q.x < low.x || q.y < low.y || q.x > high.x || q.y > high.y {
            return None;
        }
        let height = self.top_mm + 1.0;
        let origin = self.cad_from_belt * Point3::new(q.x, q.y, height);
        let down = self.cad_from_belt * -Vector3::z();
        let hit = self.caster.first(&origin, &down, 0.0, height)?;
        let place = origin + down * hit.t;
        let triangle = hit.triangle as usize;
        if !rig.cut_faces_seen && triangle >= self.subject.upper_triangles + self.subject.lower_triangles {
            return Some(Met { place: self.belt_from_cad * place, seen: None });
        }
        let normal = self.subject.solid.normal(triangle)?;
        let rounded_off = self.rims.rounded(triangle, &place).unwrap_or(0.0);
        let seen = Some((self.belt_from_cad * normal.into_inner(), rounded_off));
        Some(Met { place: self.belt_from_cad * place, seen })
    }

    /// Whether this part stands between a place and a viewer, both in the belt frame.
    pub fn hides(&self, place: &Point3, viewer: &Point3) -> bool {
        let towards = viewer - place;
        // Above the part's top the way is free; most places of the belt see it over the footprint's rim only.
        let t = ((self.top_mm - place.z) / towards.z).clamp(0.0, 1.0);
        let leaves = place + towards * t;
        let (low, high) = self.footprint;
        if place.x.max(leaves.x) < low.x
            || place.y.max(leaves.y) < low.y
            || place.x.min(leaves.x) > high.x
            || place.y.min(leaves.y) > high.y
        {
            return false;
        }
        // 0.02 mm free of the own surface.
        let from = 0.02 / towards.norm();
        self.caster.is_blocked(&(self.cad_from_belt * place), &(self.cad_from_belt * towards), from, t)
    }
}

/// A neighbour put down in +x beside what stands there, in the middle of it along y.
pub(super) fn stand_beside<'a>(before: &Standing, neighbour: &Neighbour<'a>, rig: &RigModel) -> Standing<'a> {
    let yaw_rad = Some(neighbour.pose.yaw_rad.unwrap_or(0.0));
    let pose = PoseChoice { yaw_rad, at_mm: Some([0.0; 2]), ..neighbour.pose };
    let here = put_down(neighbour.subject, rig, &pose, &mut stream(0, Stream::Pose));
    let extents = bounds(neighbour.subject, &here);
    let (low, high) = before.footprint;
    let shift =
        Translation3::new(high.x + neighbour.gap_mm - extents.min.x, 0.5 * (low.y + high.y) - extents.centre().y, 0.0);
    Standing::new(neighbour.subject, rig, shift * here)
}

/// Box of a part in the belt frame.
fn bounds(subject: &Subject, belt_from_cad: &Isometry3) -> Aabb {
    let placed: Vec<Point3> = subject.solid.vertices.iter().map(|v| belt_from_cad * v).collect();
    Aabb::of_points(&placed).unwrap_or(Aabb { min: Point3::origin(), max: Point3::origin() })
}
