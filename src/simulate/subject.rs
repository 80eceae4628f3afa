//! What lies under the rig: the actual part, beside the plan with its nominal geometry.

use super::displacement::DisplacementField;
use super::part::SyntheticPart;
use crate::geometry::{Mesh, Point3, Vector3};
use crate::part::Part;
use crate::plan::{CadSide, Geometry, Plan, Side};
use std::collections::HashMap;

/// An actual part and the plan it is to be measured by. CAD frame.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The plan with the nominal geometry.
    pub plan: Plan,
    /// The actual part as a closed solid: upper face, lower face, and the sheet's rim where it is known.
    pub solid: Mesh,
    /// Triangles of `solid` that belong to the upper face; those of the lower face follow.
    pub upper_triangles: usize,
    /// Triangles of the lower face (0 for the CAD of a solid: `upper_triangles` are all of it).
    pub lower_triangles: usize,
    /// The actual geometry of the plan's features, before `field`.
    pub(super) actual_features: Vec<Geometry>,
    /// The actual geometry of the plan's comparison points, before `field`.
    pub(super) actual_comparison: Vec<Geometry>,
    /// The displacement that `solid` contains already.
    pub field: DisplacementField,
}

impl Subject {
    /// A synthetic part made with its own parameters, measured by the plan of the nominal one, and displaced.
    pub fn synthetic(nominal: &SyntheticPart, actual: &SyntheticPart, field: DisplacementField) -> Self {
        let geometry = |of: &SyntheticPart| {
            let features = of.features.iter().map(|f| f.geometry.clone()).collect();
            (features, of.comparison.iter().map(|c| c.geometry.clone()).collect())
        };
        Self::assemble(nominal.plan(), &actual.mesh, &actual.lower, geometry(actual), field)
    }

    /// The part as it should be.
    pub fn perfect(nominal: &SyntheticPart) -> Self {
        Self::synthetic(nominal, nominal, DisplacementField::none())
    }

    /// Any plan's CAD, displaced.
    pub fn from_plan(plan: &Plan, part: &Part, field: DisplacementField) -> Self {
        let (upper, lower) = (&part.face(Side::Top).mesh, &part.face(Side::Bottom).mesh);
        let features = plan.features.iter().map(|f| f.geometry.clone()).collect();
        let comparison = plan.comparison.iter().map(|c| c.geometry.clone()).collect();
        let none = Mesh::default();
        let lower = if plan.part.cad_side == CadSide::Solid { &none } else { lower };
        Self::assemble(plan.clone(), upper, lower, (features, comparison), field)
    }

    fn assemble(
        plan: Plan,
        upper: &Mesh,
        lower: &Mesh,
        (actual_features, actual_comparison): (Vec<Geometry>, Vec<Geometry>),
        field: DisplacementField,
    ) -> Self {
        let mut solid = upper.clone();
        let shift = solid.vertices.len() as u32;
        solid.vertices.extend_from_slice(&lower.vertices);
        solid.triangles.extend(lower.triangles.iter().map(|t| t.map(|v| v + shift)));
        if upper.vertices.len() == lower.vertices.len() {
            for [a, b] in boundary_edges(upper) {
                solid.triangles.extend([[b, a, a + shift], [b, a + shift, b + shift]]);
            }
        }
        Self {
            plan,
            solid: field.moved_mesh(&solid),
            upper_triangles: upper.triangles.len(),
            lower_triangles: lower.triangles.len(),
            actual_features,
            actual_comparison,
            field,
        }
    }

    /// The triangles of `solid` that a camera on that side is to measure.
    pub fn face_triangles(&self, side: Side) -> std::ops::Range<usize> {
        match side {
            Side::Bottom if self.lower_triangles > 0 => {
                self.upper_triangles..self.upper_triangles + self.lower_triangles
            }
            _ => 0..self.upper_triangles,
        }
    }

    /// The face of that side alone.
    pub fn face(&self, side: Side) -> Mesh {
        Mesh {
            vertices: self.solid.vertices.clone(),
            triangles: self.solid.triangles[self.face_triangles(side)].to_vec(),
        }
    }

    /// Which way the upper face looks on average; for the CAD of a solid, which way the plan's directions point. Not
    /// normalised.
    pub fn upper_direction(&self) -> Vector3 {
        if self.plan.part.cad_side == CadSide::Solid {
            let features = self.plan.features.iter().map(|f| f.geometry.sheet_normal());
            return features.chain(self.plan.comparison.iter().map(|c| c.geometry.sheet_normal())).sum();
        }
        (0..self.upper_triangles).map(|t| self.solid.area_vector_twice(t)).sum()
    }

    /// Offset from a nominal place on the CAD surface, along the sheet's normal, to the face that `side` sees.
    pub fn face_offset_mm(&self, side: Side) -> f64 {
        self.plan.part.cad_side.face_offset_mm(side, self.plan.part.thickness_mm)
    }

    /// The actual place of the material that `actual` (before displacement) tells.
    pub(super) fn displaced(&self, p: &Point3) -> Point3 {
        self.field.moved(p)
    }
}

/// Edges with a triangle on one side only, in the winding of that triangle, in the order of the triangles.
pub(super) fn boundary_edges(mesh: &Mesh) -> Vec<[u32; 2]> {
    let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let mut count: HashMap<[u32; 2], u32> = HashMap::new();
    for [a, b] in mesh.triangles.iter().flat_map(sides) {
        *count.entry([a.min(b), a.max(b)]).or_default() += 1;
    }
    mesh.triangles.iter().flat_map(sides).filter(|[a, b]| count[&[*a.min(b), *a.max(b)]] == 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::symmetric_plate;

    #[test]
    fn a_perfect_sheet_is_a_closed_solid() {
        let subject = Subject::perfect(&symmetric_plate());
        assert!(boundary_edges(&subject.solid).is_empty());
        // Closed and oriented outwards: the area vectors cancel and the enclosed volume is area times thickness.
        let volume: f64 = (0..subject.solid.triangles.len())
            .map(|t| subject.solid.area_vector_twice(t).dot(&subject.solid.corners(t)[0].coords) / 6.0)
            .sum();
        let face = subject.face(Side::Top).area();
        assert!((volume - 1.2 * face).abs() < 1e-6 * volume, "{volume} {face}");
    }
}
