//! The prepared part.

use super::{Face, RestingPose};
use crate::geometry::{Aabb, Mesh, Point3, Vector3};
use crate::plan::{CadSide, Side};

/// What of the plan changes the preparation.
#[derive(Debug, Clone, PartialEq)]
pub struct PartSettings {
    /// Where the CAD surface lies in the sheet.
    pub cad_side: CadSide,
    /// Sheet thickness; 0 = no compensation (a solid: found out from the CAD).
    pub thickness_mm: f64,
    /// Position and sheet normal of the plan's points, CAD frame. Only a solid needs them, to tell which face is the top.
    pub plan_directions: Vec<(Point3, Vector3)>,
}

/// A part's CAD, ready for scans. Plain data, never changed after it is made; share it by `Arc`.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// SHA-256 of the CAD file's bytes, lower-case hex.
    pub cad_sha256: String,
    /// Triangles as the file has them, before degenerate and duplicate ones were left out.
    pub triangles_in_file: usize,
    /// The CAD's own surface, welded, wound consistently.
    pub mesh: Mesh,
    /// Box of the mesh.
    pub bounds: Aabb,
    /// Where the CAD surface lies in the sheet.
    pub cad_side: CadSide,
    /// Sheet thickness; of a solid for which the plan says 0, the one found in the CAD (0 if none was found).
    pub thickness_mm: f64,
    /// Area-weighted centroid of the mesh.
    pub centroid: Point3,
    /// Ways in which the part may lie on the belt, the most stable first.
    pub resting_poses: Vec<RestingPose>,
    /// What somebody should know about this CAD.
    pub warnings: Vec<String>,
    /// Top and bottom.
    pub(super) faces: [Face; 2],
}

impl Part {
    /// The face that a camera on that side of the sheet sees.
    pub fn face(&self, side: Side) -> &Face {
        match side {
            Side::Top => &self.faces[0],
            Side::Bottom => &self.faces[1],
        }
    }

    /// Diagonal of the box of the CAD.
    pub fn diagonal_mm(&self) -> f64 {
        self.bounds.diagonal()
    }
}
