//! A shape that is there already, taken along to another click.

use super::{NoProposal, Picker, Proposal, Ray};
use crate::geometry::UnitVector3;
use crate::plan::Geometry;

impl Picker {
    /// The same kind of shape at another click: a surface point on the surface, an edge point along the edges, a hole or slot from one
    /// opening to another. What was turned round stays so, as far as the new place allows it: the side of the sheet to which a surface
    /// point's direction, a hole's axis and an edge's normal point, the sense of a slot, a hole's direction of the deviation; an edge's own
    /// direction, told by whether it pointed out of the sheet. `reach_mm` as of the proposals.
    ///
    /// # Errors
    /// Nothing of that kind is there.
    pub fn again(&self, shape: &Geometry, ray: &Ray, reach_mm: f64) -> Result<Proposal, NoProposal> {
        let told = match shape {
            Geometry::Surface { .. } => self.surface_point(ray)?,
            Geometry::Edge { .. } => self.edge_point(ray, reach_mm)?,
            Geometry::Hole { .. } => self.hole(ray, reach_mm)?,
            Geometry::Slot { .. } => self.slot(ray, reach_mm)?,
        };
        Ok(Proposal { geometry: self.turned_as(shape, told.geometry), ..told })
    }

    /// A proposal turned as a shape was against the CAD at its own place.
    fn turned_as(&self, old: &Geometry, new: Geometry) -> Geometry {
        let flipped = self.is_against_the_cad(old);
        let side = |n: UnitVector3| if flipped { -n } else { n };
        match (old, new) {
            (Geometry::Surface { .. }, Geometry::Surface { position, direction }) => {
                Geometry::Surface { position, direction: side(direction) }
            }
            (Geometry::Edge { .. }, Geometry::Edge { position, direction, normal }) => {
                let inwards = self.points_inwards(old);
                let direction = if inwards { -direction } else { direction };
                Geometry::Edge { position, direction, normal: side(normal) }
            }
            (Geometry::Hole { direction: wanted, .. }, Geometry::Hole { centre, axis, diameter_mm, .. }) => {
                Geometry::Hole { centre, axis: side(axis), diameter_mm, direction: *wanted }
            }
            (
                Geometry::Slot { direction: before, .. },
                Geometry::Slot { centre, axis, direction, length_mm, width_mm },
            ) => {
                let direction = if before.dot(&direction) < 0.0 { -direction } else { direction };
                Geometry::Slot { centre, axis: side(axis), direction, length_mm, width_mm }
            }
            (_, new) => new,
        }
    }

    /// Whether a shape's sheet normal points to the other side than the CAD's normals do there.
    fn is_against_the_cad(&self, shape: &Geometry) -> bool {
        let (place, normal) = (shape.position(), shape.sheet_normal());
        let nearest = self.surfaces().into_iter().filter_map(|surface| {
            let hit = surface.face.closest(&place, f64::INFINITY)?;
            let (told, _) = surface.normal(hit.triangle as usize, &hit.point)?;
            Some((hit.signed_mm.abs(), told))
        });
        nearest.min_by(|a, b| a.0.total_cmp(&b.0)).is_some_and(|(_, told)| told.dot(&normal) < 0.0)
    }

    /// Whether an edge's direction points into the sheet; no other shape's does. Half a millimetre along it the sheet is nearer than half a millimetre against it.
    pub fn points_inwards(&self, shape: &Geometry) -> bool {
        let Geometry::Edge { position, direction, .. } = shape else { return false };
        let away = |step_mm: f64| {
            let at = position + direction.into_inner() * step_mm;
            let distances = self.surfaces().into_iter().filter_map(|s| s.face.closest(&at, f64::INFINITY));
            distances.map(|hit| hit.signed_mm.abs()).fold(f64::INFINITY, f64::min)
        };
        away(0.5) < away(-0.5)
    }
}
