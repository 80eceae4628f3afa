//! What lies under the rig: the actual part, beside the plan with its nominal geometry.

use super::displacement::DisplacementField;
use super::part::SyntheticPart;
use crate::geometry::{Mesh, Point3, Vector3};
use crate::part::Part;
use crate::plan::{CadSide, Geometry, Plan, Side};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};

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
    /// Thickness of the actual sheet; the plan's is what a measurement compensates.
    pub thickness_mm: f64,
}

impl Subject {
    /// A synthetic part made with its own parameters, measured by the plan of the nominal one, and displaced.
    pub fn synthetic(nominal: &SyntheticPart, actual: &SyntheticPart, field: DisplacementField) -> Self {
        let geometry = |of: &SyntheticPart| {
            let features = of.features.iter().map(|f| f.geometry.clone()).collect();
            (features, of.comparison.iter().map(|c| c.geometry.clone()).collect())
        };
        let thickness_mm = actual.thickness_mm;
        Self::assemble(nominal.plan(), &actual.mesh, &actual.lower, geometry(actual), field, thickness_mm)
    }

    /// The part as it should be.
    pub fn perfect(nominal: &SyntheticPart) -> Self {
        Self::synthetic(nominal, nominal, DisplacementField::none())
    }

    /// Any plan's CAD, displaced.
    pub fn from_plan(plan: &Plan, part: &Part, field: DisplacementField) -> Self {
        Self::of_thickness(plan, part, field, plan.part.thickness_mm)
    }

    /// The same of a sheet that is as thick as said, mm, instead of as the plan says. The CAD's own surface stays; of a solid,
    /// both of whose faces are in the CAD, nothing changes.
    pub fn of_thickness(plan: &Plan, part: &Part, field: DisplacementField, thickness_mm: f64) -> Self {
        let features = plan.features.iter().map(|f| f.geometry.clone()).collect();
        let comparison = plan.comparison.iter().map(|c| c.geometry.clone()).collect();
        let (top, bottom) = (&part.face(Side::Top).mesh, &part.face(Side::Bottom).mesh);
        if plan.part.cad_side == CadSide::Solid {
            let none = Mesh::default();
            return Self::assemble(plan.clone(), top, &none, (features, comparison), field, plan.part.thickness_mm);
        }
        let nominal_mm = plan.part.thickness_mm;
        let ratio = if nominal_mm > 0.0 { thickness_mm / nominal_mm } else { 1.0 };
        // The vertices of a face are those of the CAD, moved by a multiple of the thickness.
        let made = |face: &Mesh| {
            if ratio == 1.0 {
                return face.clone();
            }
            let moved = part.mesh.vertices.iter().zip(&face.vertices).map(|(own, seen)| own + (seen - own) * ratio);
            Mesh { vertices: moved.collect(), triangles: face.triangles.clone() }
        };
        Self::assemble(plan.clone(), &made(top), &made(bottom), (features, comparison), field, nominal_mm * ratio)
    }

    fn assemble(
        plan: Plan,
        upper: &Mesh,
        lower: &Mesh,
        (actual_features, actual_comparison): (Vec<Geometry>, Vec<Geometry>),
        field: DisplacementField,
        thickness_mm: f64,
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
            thickness_mm,
        }
    }

    /// The part as it is seen where edges and rims appear outwards of their place, mm in the sheet (negative: inwards). Its truth
    /// stays that of `self`. Of the CAD of a solid, whose rims cannot be told from its bends, nothing changes.
    #[must_use]
    pub(super) fn with_rims_shifted(&self, outwards_mm: f64) -> Cow<'_, Self> {
        if outwards_mm == 0.0 || self.lower_triangles == 0 {
            return Cow::Borrowed(self);
        }
        let mut seen = self.clone();
        for side in [Side::Top, Side::Bottom] {
            for (vertex, outwards) in rim_directions(&self.face(side)) {
                seen.solid.vertices[vertex as usize] += outwards * outwards_mm;
            }
        }
        Cow::Owned(seen)
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

    /// Offset from a place on the CAD's own surface of the actual part, along the sheet's normal, to the face that `side` sees.
    pub fn face_offset_mm(&self, side: Side) -> f64 {
        self.plan.part.cad_side.face_offset_mm(side, self.thickness_mm)
    }

    /// The actual place of the material that `actual` (before displacement) tells.
    pub(super) fn displaced(&self, p: &Point3) -> Point3 {
        self.field.moved(p)
    }
}

/// For each vertex on the rim of a face: by what it moves when every edge of the rim moves outwards by one, in the plane of its own
/// triangle. At a sharp corner it stays within two.
fn rim_directions(face: &Mesh) -> BTreeMap<u32, Vector3> {
    let rim: HashSet<[u32; 2]> = boundary_edges(face).into_iter().collect();
    let mut sums: BTreeMap<u32, (Vector3, f64)> = BTreeMap::new();
    for (t, [a, b, c]) in face.triangles.iter().enumerate() {
        for edge in [[*a, *b], [*b, *c], [*c, *a]].into_iter().filter(|edge| rim.contains(edge)) {
            let [from, to] = edge.map(|v| face.vertices[v as usize]);
            // The triangle lies on the left of its edges.
            let outwards = (to - from).cross(&face.area_vector_twice(t));
            let Some(outwards) = outwards.try_normalize(0.0) else { continue };
            for v in edge {
                let (sum, count) = sums.entry(v).or_insert((Vector3::zeros(), 0.0));
                *sum += outwards;
                *count += 1.0;
            }
        }
    }
    // Two unit vectors with the sum s: s / (1 + cos) meets both edges, and |s|² = 2 + 2 cos.
    let mitre = |(sum, count): (Vector3, f64)| sum / (sum.norm_squared() / count).max(0.5);
    sums.into_iter().map(|(v, s)| (v, mitre(s))).collect()
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
    use crate::geometry::CadFromScan;
    use crate::part::PartSettings;
    use crate::run::RunContext;
    use crate::simulate::{ScanTruth, symmetric_plate};

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

    fn plate() -> (Plan, Part) {
        let plate = symmetric_plate();
        let plan = plate.plan();
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
        let part = Part::prepare(plate.mesh.clone(), String::new(), &settings, &RunContext::silent()).unwrap();
        (plan, part)
    }

    #[test]
    fn rims_move_outwards_all_round_and_the_truth_does_not() {
        let (plan, part) = plate();
        let subject = Subject::from_plan(&plan, &part, DisplacementField::none());
        for shift in [0.1, -0.1] {
            let seen = subject.with_rims_shifted(shift);
            for side in [Side::Top, Side::Bottom] {
                let (before, after) = (subject.face(side), seen.face(side));
                let edges = boundary_edges(&before);
                let length: f64 = edges
                    .iter()
                    .map(|e| (before.vertices[e[0] as usize] - before.vertices[e[1] as usize]).norm())
                    .sum();
                // Area grows by length times shift, to second order by the turns of the rim: the plate's four corners and its holes
                // (a hole of radius r loses pi r² - pi (r - d)² = 2 pi r d - pi d²).
                let grown = after.area() - before.area();
                assert!((grown / (length * shift) - 1.0).abs() < 0.01, "{side:?} {grown} {length}");
                // Only rims moved, each by its shift: the plate is flat.
                let moved = before.vertices.iter().zip(&after.vertices).filter(|(a, b)| a != b);
                let distances: Vec<f64> = moved.map(|(a, b)| (b - a).norm()).collect();
                assert!(distances.iter().all(|d| (0.099..0.15).contains(d)), "{side:?} {distances:?}");
                assert!(distances.len() < before.vertices.len());
            }
            let truth = |s: &Subject| ScanTruth::new(s, CadFromScan::identity(), Side::Top, 0);
            assert_eq!(truth(&subject), truth(&Subject::from_plan(&plan, &part, DisplacementField::none())));
            assert_ne!(truth(&seen), truth(&subject));
        }
    }

    /// The CAD's own surface of a thicker sheet is where it was: nothing deviates on either side.
    #[test]
    fn a_thicker_sheet_grows_away_from_the_cad_surface_and_deviates_nowhere() {
        let (mut plan, mut part) = plate();
        for cad_side in [CadSide::Top, CadSide::Bottom, CadSide::Middle] {
            let settings = PartSettings { cad_side, thickness_mm: 1.2, plan_directions: Vec::new() };
            part = Part::prepare(part.mesh.clone(), String::new(), &settings, &RunContext::silent()).unwrap();
            plan.part.cad_side = cad_side;
            let made = Subject::of_thickness(&plan, &part, DisplacementField::none(), 1.5);
            let nominal = Subject::from_plan(&plan, &part, DisplacementField::none());
            for side in [Side::Top, Side::Bottom] {
                let wanted = cad_side.face_offset_mm(side, 0.3);
                let faces = [nominal.face(side), made.face(side)];
                let used: Vec<usize> = faces[0].triangles.iter().flatten().map(|v| *v as usize).collect();
                for v in used {
                    let moved = faces[1].vertices[v] - faces[0].vertices[v];
                    assert!(
                        (moved.z - wanted).abs() < 1e-9 && moved.xy().norm() < 1e-9,
                        "{cad_side:?} {side:?} {moved}"
                    );
                }
                let truth = ScanTruth::new(&made, CadFromScan::identity(), side, 0);
                for point in truth.points {
                    let found = point.in_true_pose.unwrap().deviation_mm;
                    assert!(found.abs() < 1e-6, "{cad_side:?} {side:?} {} {found}", point.name);
                }
            }
        }
    }
}
