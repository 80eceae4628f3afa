//! What a displacement of the measured sheet does to the place that is told of a feature.

use super::frame::sheet_normal_of;
use crate::geometry::{UnitVector3, Vector3};
use crate::part::{Face, Part};
use crate::plan::Geometry;

/// The directions may lean so far from the sheet's normal (cosine) that a surface is still measured along them.
const LEAST_COSINE: f64 = 0.5;
/// Beyond the rim of an opening, where there is sheet, mm.
const BESIDE_MM: f64 = 0.5;

/// How a feature is read off the sheet around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Of the sheet, on the side of the CAD's own normals.
    normal: UnitVector3,
    /// Along the CAD's normals, from the CAD to the face that was seen, for a sheet that is 1 mm thick.
    face_offset: f64,
    /// Of a surface point: the line on which it is looked for.
    line: Option<UnitVector3>,
}

impl Reading {
    /// Of a feature of the plan, on the face that was seen.
    pub fn of(part: &Part, face: &Face, geometry: &Geometry) -> Self {
        let across = |axis: &UnitVector3| axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
        let around = |axis: &UnitVector3, long: Vector3, [length_mm, width_mm]: [f64; 2]| {
            let (u, v) = (long * (0.5 * length_mm + BESIDE_MM), axis.cross(&long) * (0.5 * width_mm + BESIDE_MM));
            [u, v, -u, -v]
        };
        let at = |w: &UnitVector3, places: &[Vector3]| sheet_normal_of(part, face, &geometry.position(), w, places);
        let (normal, line) = match geometry {
            Geometry::Surface { direction, .. } => (at(direction, &[Vector3::zeros()]), Some(*direction)),
            Geometry::Edge { normal, .. } => (at(normal, &[Vector3::zeros()]), None),
            Geometry::Hole { axis, diameter_mm, .. } => {
                (at(axis, &around(axis, across(axis), [*diameter_mm; 2])), None)
            }
            Geometry::Slot { axis, direction, length_mm, width_mm, .. } => {
                (at(axis, &around(axis, direction.into_inner(), [*length_mm, *width_mm])), None)
            }
        };
        Self { normal, face_offset: part.cad_side.face_offset_mm(face.side, 1.0), line }
    }

    /// Of a place of which no CAD is known: it goes wherever the sheet goes.
    pub fn free() -> Self {
        Self { normal: Vector3::z_axis(), face_offset: 0.0, line: None }
    }

    /// How far a sheet that is thicker than the plan says displaces the sheet that was seen, its thickness taken out as the
    /// plan has it: along its normal. Of a solid, both of whose faces are in the CAD, nothing.
    pub fn of_thickness(&self, thicker_mm: f64) -> Vector3 {
        self.normal.into_inner() * (self.face_offset * thicker_mm)
    }

    /// How far the place told is displaced where the sheet is: an edge and an opening go along, a surface point stays on its
    /// line and is where that meets the sheet.
    pub fn of_displacement(&self, by: &Vector3) -> Vector3 {
        let Some(line) = self.line else { return *by };
        let cosine = self.normal.dot(&line);
        let cosine = if cosine.abs() < LEAST_COSINE { LEAST_COSINE.copysign(cosine) } else { cosine };
        line.into_inner() * (self.normal.dot(by) / cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet that is 0.1 mm higher is met 0.1 mm / cos 30 degrees later along a line that leans so; sliding along itself it is met where
    /// it was.
    #[test]
    fn a_leaning_line_meets_a_higher_sheet_further_up() {
        let line = UnitVector3::new_normalize(Vector3::new(0.5, 0.0, 0.75_f64.sqrt()));
        let seen_from_below = Reading { normal: Vector3::z_axis(), face_offset: -1.0, line: Some(line) };
        let told = seen_from_below.of_displacement(&seen_from_below.of_thickness(0.1));
        assert!((told + line.into_inner() * (0.1 / 0.75_f64.sqrt())).norm() < 1e-12, "{told}");
        assert!(seen_from_below.of_displacement(&Vector3::new(0.3, -0.2, 0.0)).norm() < 1e-12);
        let edge = Reading { line: None, ..seen_from_below };
        assert_eq!(edge.of_displacement(&Vector3::new(0.3, -0.2, 0.1)), Vector3::new(0.3, -0.2, 0.1));
    }
}
