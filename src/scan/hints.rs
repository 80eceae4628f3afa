//! What the filters may know of the part before it is aligned.

use crate::geometry::UnitVector3;

/// What plan and CAD tell about the part in view; a size of zero means that it is not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanHints {
    /// Where the camera looks, scan frame.
    pub view_direction: Option<UnitVector3>,
    /// Sides of the CAD's box, in any order.
    pub part_extents_mm: [f64; 3],
    /// Surface of the CAD.
    pub part_area_mm2: f64,
    /// Thickness of the sheet; 0 when it is not known.
    pub thickness_mm: f64,
}

impl ScanHints {
    /// Whether the part's size is known.
    pub fn has_size(&self) -> bool {
        self.part_area_mm2 > 0.0 && self.diagonal_mm() > 0.0
    }

    /// Diagonal of the CAD's box.
    pub fn diagonal_mm(&self) -> f64 {
        self.part_extents_mm.iter().map(|side| side * side).sum::<f64>().sqrt()
    }

    /// The largest outline that the CAD's box can show in any direction.
    pub fn largest_shadow_mm2(&self) -> f64 {
        let [a, b, c] = self.part_extents_mm;
        ((a * b).powi(2) + (b * c).powi(2) + (c * a).powi(2)).sqrt()
    }
}
