//! A hole or a slot from a click near its rim or into it: a circle, or a slot with round ends, fitted to the rim of the CAD.

use super::super::rims::{Rim, rim};
use super::edge::OnLoop;
use super::picker::Surface;
use super::stadium::{Stadium, fit_stadium};
use super::{NoProposal, Picker, Proposal, Ray};
use crate::fit::shapes::circle::fit_circle;
use crate::geometry::{Point3, UnitVector3};
use crate::plan::Geometry;

/// A rim may stand off its shape by this much, mm, or by this share of the width, whichever is more: a coarse tessellation stays below.
const OFF: (f64, f64) = (0.05, 0.01);

/// A piece of a rim longer than this share of the width is a straight side, not a step of a tessellated round of nine steps or more.
const STRAIGHT: f64 = 0.39;

/// An opening near a click.
struct Opening<'p> {
    surface: Surface<'p>,
    /// A closed loop: the first point is the last one, too.
    points: &'p [Point3],
    rim: Rim,
}

impl Opening<'_> {
    /// The points of the rim, each once, and points along its straight sides: four corners alone would lie on a circle.
    fn outline(&self) -> Vec<Point3> {
        let mut outline = Vec::new();
        for pair in self.points.windows(2) {
            outline.push(pair[0]);
            let side = pair[1] - pair[0];
            if side.norm() > STRAIGHT * self.rim.width_mm {
                outline.extend([0.25, 0.5, 0.75].map(|share| pair[0] + side * share));
            }
        }
        outline
    }

    fn limit_mm(&self) -> f64 {
        OFF.0.max(OFF.1 * self.rim.width_mm)
    }

    /// The axis on the side of the CAD's normals.
    fn axis(&self, either: &UnitVector3) -> UnitVector3 {
        let outward = if either.dot(&self.rim.axis) < 0.0 { -*either } else { *either };
        UnitVector3::new_unchecked(outward.into_inner() * self.surface.sign)
    }
}

impl Picker {
    /// A hole: centre in the middle of its rim, axis on the side of the CAD's normals, diameter. No direction of the deviation is chosen.
    /// `reach_mm`: how far from the click the rim may be, as the eye sees it; a click into the opening is near enough.
    ///
    /// # Errors
    /// No opening within reach, or one that is not round.
    pub fn hole(&self, ray: &Ray, reach_mm: f64) -> Result<Proposal, NoProposal> {
        let opening = self.opening_at(ray, reach_mm)?;
        let outline = opening.outline();
        let (circle, _) = fit_circle(&outline, &[])?;
        let off_mm = outline.iter().map(|p| circle.distance(p)).fold(0.0, f64::max);
        let Rim { length_mm, width_mm, .. } = opening.rim;
        if off_mm > opening.limit_mm() {
            return Err(NoProposal::NotRound { length_mm, width_mm, off_mm });
        }
        let axis = opening.axis(&circle.axis);
        let diameter_mm = 2.0 * circle.radius;
        let geometry = Geometry::Hole { centre: circle.centre, axis, diameter_mm, direction: None };
        Ok(Proposal { off_mm, ..Proposal::new(geometry) })
    }

    /// A slot with round ends: centre, axis, direction of the long axis, overall length, width.
    ///
    /// # Errors
    /// No opening within reach, or one of another shape.
    pub fn slot(&self, ray: &Ray, reach_mm: f64) -> Result<Proposal, NoProposal> {
        let opening = self.opening_at(ray, reach_mm)?;
        let Rim { length_mm, width_mm, .. } = opening.rim;
        if length_mm - width_mm < 2.0 * opening.limit_mm() {
            return Err(NoProposal::Round { length_mm, width_mm });
        }
        let Stadium { centre, axis, along, half_straight_mm, radius_mm, off_mm } =
            fit_stadium(&opening.outline(), &opening.rim)?;
        if off_mm > opening.limit_mm() {
            return Err(NoProposal::NoSlot { length_mm, width_mm, off_mm });
        }
        let geometry = Geometry::Slot {
            centre,
            axis: opening.axis(&axis),
            direction: along,
            length_mm: 2.0 * (half_straight_mm + radius_mm),
            width_mm: 2.0 * radius_mm,
        };
        Ok(Proposal { off_mm, ..Proposal::new(geometry) })
    }

    /// A hole where the opening is round, else a slot.
    ///
    /// # Errors
    /// No opening within reach, or one of another shape.
    pub fn hole_or_slot(&self, ray: &Ray, reach_mm: f64) -> Result<Proposal, NoProposal> {
        match self.hole(ray, reach_mm) {
            Err(NoProposal::NotRound { .. }) => self.slot(ray, reach_mm),
            other => other,
        }
    }

    fn opening_at(&self, ray: &Ray, reach_mm: f64) -> Result<Opening<'_>, NoProposal> {
        let near = self.nearest_boundary(ray, reach_mm, |surface, points| rim(surface.face, points).is_some());
        let on = near.ok_or(NoProposal::NoOpening)?;
        let inside = self.opening_around(ray).filter(|_| on.distance_mm > reach_mm);
        let OnLoop { surface, points, .. } = match inside {
            Some(inside) => inside,
            None if on.distance_mm > reach_mm => {
                return Err(NoProposal::OpeningTooFar { nearest_mm: on.distance_mm });
            }
            None => on,
        };
        let rim = rim(surface.face, points).ok_or(NoProposal::NoOpening)?;
        Ok(Opening { surface, points, rim })
    }

    /// The opening that a ray passes through before it meets the part: its rim is nearest within half of its own width.
    fn opening_around(&self, ray: &Ray) -> Option<OnLoop<'_>> {
        let hit_mm = self.hit(ray).map_or(f64::INFINITY, |hit| hit.along_mm);
        let passes = |surface: &Surface<'_>, points: &[Point3]| {
            let Some(rim) = rim(surface.face, points) else { return false };
            let slant = ray.direction.dot(&rim.axis);
            let along = (rim.centre - ray.origin).dot(&rim.axis) / slant;
            let at = ray.origin + ray.direction.into_inner() * along;
            let off = at - rim.centre;
            let long = off.dot(&rim.long_axis).abs() - 0.5 * (rim.length_mm - rim.width_mm);
            let across = (off - rim.long_axis.into_inner() * off.dot(&rim.long_axis)).norm();
            slant.abs() > 1e-6 && along < hit_mm && long.max(0.0).hypot(across) < 0.5 * rim.width_mm
        };
        self.nearest_boundary(ray, f64::INFINITY, passes)
    }
}
