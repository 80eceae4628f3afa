//! A place on a trimmed edge, snapped to the boundary of the CAD that is nearest to the click as the eye sees it.

use super::picker::{Hit, Surface};
use super::{NoProposal, Picker, Proposal, Ray};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::Geometry;

/// The edge's course is told from this far to either side, mm.
const REACH_MM: f64 = 1.0;
/// A turn of the outline in one vertex that is a corner and no step of a tessellated round, rad.
const CORNER: f64 = 35.0 * std::f64::consts::PI / 180.0;

/// The place of a boundary loop that is nearest to a ray.
#[derive(Clone, Copy)]
pub(super) struct OnLoop<'p> {
    pub surface: Surface<'p>,
    pub points: &'p [Point3],
    /// Index of the segment's first point.
    segment: usize,
    pub place: Point3,
    /// How far the ray passes it, mm.
    pub distance_mm: f64,
}

impl Picker {
    /// An edge point: its place on the nearest trimmed edge or rim, its direction out of the sheet in the sheet's plane, the sheet's
    /// normal. `reach_mm`: how far from the click the edge may be, as the eye sees it.
    ///
    /// # Errors
    /// No edge within reach, or a corner.
    pub fn edge_point(&self, ray: &Ray, reach_mm: f64) -> Result<Proposal, NoProposal> {
        let on = self.nearest_boundary(ray, reach_mm, |_, _| true).ok_or(NoProposal::NoEdge)?;
        if on.distance_mm > reach_mm {
            return Err(NoProposal::EdgeTooFar { nearest_mm: on.distance_mm });
        }
        let along = course(on.points, on.segment, &on.place)?;
        let hit = on.surface.face.closest(&on.place, f64::INFINITY).ok_or(NoProposal::NoEdge)?;
        let (normal, _) = on.surface.normal(hit.triangle as usize, &on.place).ok_or(NoProposal::NoEdge)?;
        // The surface lies on the left of its boundary where the face's own normal looks at the viewer.
        let outwards = along.cross(&normal) * on.surface.sign;
        let direction = UnitVector3::try_new(outwards, 1e-9).ok_or(NoProposal::NoEdge)?;
        Ok(Proposal::new(Geometry::Edge { position: on.place, direction, normal }))
    }

    /// The piece of the trimmed edge or rim around a place: up to `half_mm` along it to either side, in its order; empty where the CAD has
    /// no boundary. For showing what an edge point is on.
    pub fn edge_piece(&self, place: &Point3, half_mm: f64) -> Vec<Point3> {
        let segments = self.surfaces().into_iter().flat_map(|surface| {
            let loops = surface.face.boundary_loops.iter();
            loops.flat_map(|points| (0..points.len().saturating_sub(1)).map(move |k| (points, k)))
        });
        let nearest = segments.map(|(points, k)| {
            let foot = foot_on(&points[k], &points[k + 1], place);
            (points, k, foot, (foot - place).norm())
        });
        let Some((points, segment, foot, _)) = nearest.min_by(|a, b| a.3.total_cmp(&b.3)) else { return Vec::new() };
        // A short rim is gone around once, not from both sides.
        let around: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        let half_mm = if points.first() == points.last() { half_mm.min(0.5 * around) } else { half_mm };
        let mut piece = walk(points, segment, foot, half_mm, false);
        piece.reverse();
        piece.push(foot);
        piece.extend(walk(points, segment, foot, half_mm, true));
        piece
    }

    /// The place of the boundary that a ray passes nearest, of loops that `wanted` takes. What the surface hides counts only where nothing else
    /// is within reach.
    pub(super) fn nearest_boundary(
        &self,
        ray: &Ray,
        reach_mm: f64,
        wanted: impl Fn(&Surface<'_>, &[Point3]) -> bool,
    ) -> Option<OnLoop<'_>> {
        let hit = self.hit(ray).ok();
        let mut best: Option<(bool, OnLoop<'_>)> = None;
        for surface in self.surfaces() {
            for points in surface.face.boundary_loops.iter().filter(|points| wanted(&surface, points)) {
                let Some(on) = nearest_of_loop(surface, points, ray) else { continue };
                let key = (!is_in_sight(hit.as_ref(), ray, &on, reach_mm), on.distance_mm);
                if best.as_ref().is_none_or(|(hidden, other)| key < (*hidden, other.distance_mm)) {
                    best = Some((key.0, on));
                }
            }
        }
        best.map(|(_, on)| on)
    }
}

/// Whether a place is within reach and not behind the surface that the ray meets.
fn is_in_sight(hit: Option<&Hit>, ray: &Ray, on: &OnLoop<'_>, reach_mm: f64) -> bool {
    on.distance_mm <= reach_mm && hit.is_none_or(|hit| ray.along(&on.place) <= hit.along_mm + 2.0 * reach_mm)
}

fn nearest_of_loop<'p>(surface: Surface<'p>, points: &'p [Point3], ray: &Ray) -> Option<OnLoop<'p>> {
    let mut best: Option<OnLoop<'p>> = None;
    for (segment, pair) in points.windows(2).enumerate() {
        let place = nearest_to_ray(&pair[0], &pair[1], ray);
        let distance_mm = (place - ray.origin - ray.direction.into_inner() * ray.along(&place)).norm();
        if best.as_ref().is_none_or(|b| distance_mm < b.distance_mm) && ray.along(&place) > 0.0 {
            best = Some(OnLoop { surface, points, segment, place, distance_mm });
        }
    }
    best
}

/// The place of a segment that a line passes nearest.
fn nearest_to_ray(a: &Point3, b: &Point3, ray: &Ray) -> Point3 {
    let across = |v: Vector3| v - ray.direction.into_inner() * v.dot(&ray.direction);
    let (segment, from) = (across(b - a), across(ray.origin - a));
    let length_sq = segment.norm_squared();
    let share = if length_sq > 0.0 { (from.dot(&segment) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    a + (b - a) * share
}

/// The place of a segment that is nearest to a point.
fn foot_on(a: &Point3, b: &Point3, point: &Point3) -> Point3 {
    let along = b - a;
    let length_sq = along.norm_squared();
    let share = if length_sq > 0.0 { ((point - a).dot(&along) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    a + along * share
}

/// The points of a loop after a place of one of its segments, as far as a length reaches.
fn walk(points: &[Point3], segment: usize, from: Point3, length_mm: f64, forward: bool) -> Vec<Point3> {
    let (closed, segments) = (points.first() == points.last(), points.len() - 1);
    let mut passed = Vec::new();
    let (mut at, mut left) = (from, length_mm);
    for step in 0..segments {
        let k = match (forward, closed) {
            (true, true) => (segment + step) % segments,
            (false, true) => (segment + segments - step) % segments,
            (true, false) => segment + step,
            (false, false) if step > segment => break,
            (false, false) => segment - step,
        };
        let next = if forward { points.get(k + 1) } else { points.get(k) };
        let Some(next) = next else { break };
        let piece = next - at;
        let length = piece.norm();
        if length >= left {
            if length > 0.0 {
                passed.push(at + piece * (left / length));
            }
            break;
        }
        left -= length;
        at = *next;
        passed.push(at);
    }
    passed
}

/// The course of a loop at a place of one of its segments; a corner within reach is refused.
fn course(points: &[Point3], segment: usize, place: &Point3) -> Result<UnitVector3, NoProposal> {
    let closed = points.first() == points.last();
    let segments = points.len() - 1;
    let vector = |k: isize| -> Option<Vector3> {
        let k = if closed { k.rem_euclid(segments as isize) } else { k };
        let k = usize::try_from(k).ok().filter(|k| *k < segments)?;
        Some(points[k + 1] - points[k])
    };
    let (mut behind, mut ahead) = (Vector3::zeros(), Vector3::zeros());
    for (sign, sum) in [(-1, &mut behind), (1, &mut ahead)] {
        let own = if sign > 0 { points[segment + 1] - place } else { place - points[segment] };
        let mut left = REACH_MM;
        let mut k = segment as isize;
        let mut piece = own;
        loop {
            let length = piece.norm();
            if length >= left {
                *sum += piece * (left / length);
                break;
            }
            *sum += piece;
            left -= length;
            let (Some(here), Some(next)) = (vector(k), vector(k + sign)) else { break };
            let turn = here.angle(&next);
            if turn > CORNER {
                return Err(NoProposal::Corner { degrees: turn.to_degrees() });
            }
            (piece, k) = (next, k + sign);
        }
    }
    UnitVector3::try_new(behind + ahead, 1e-12).ok_or(NoProposal::NoEdge)
}
