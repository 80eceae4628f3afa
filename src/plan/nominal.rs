//! Nominal features, comparison points, and how the features hold the part.

use super::regions::RegionFit;
use crate::geometry::{Point3, UnitVector3, Vector3};
use std::path::PathBuf;

/// How the slot turns the part (`slot_reading` in docs/plan.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlotReading {
    /// The line from the hole's centre to the slot's centre.
    CentreLine,
    /// The direction of the slot's long axis.
    Axis,
}

/// One row of `[[alignment.rps]]`: a feature held at nominal along a direction.
#[derive(Debug, Clone, PartialEq)]
pub struct RpsLock {
    /// Index into `Plan::features`.
    pub feature: usize,
    /// Direction, CAD frame.
    pub lock: UnitVector3,
}

/// `[alignment]`; features as indices into `Plan::features`.
#[derive(Debug, Clone, PartialEq)]
pub enum AlignmentMethod {
    /// Hole: three translations; slot: two rotations; surface point: the last rotation.
    Features {
        /// Index of the hole.
        hole: usize,
        /// Index of the slot.
        slot: usize,
        /// What of the slot is used.
        slot_reading: SlotReading,
        /// Index of the surface point.
        point: usize,
    },
    /// Features with locked directions; at least three features and six locks.
    Rps(Vec<RpsLock>),
    /// The robust best fit is the alignment.
    BestFit,
    /// A best fit to chosen regions, from where the robust best fit is.
    Regions(RegionFit),
}

/// Nominal shape of a feature or of a comparison point, in the CAD frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// Circular hole.
    Hole {
        /// Centre on the CAD surface.
        centre: Point3,
        /// Normal of the sheet around it.
        axis: UnitVector3,
        /// Diameter.
        diameter_mm: f64,
        /// In which direction the centre's deviation is told; `None` = distance in the sheet plane.
        direction: Option<UnitVector3>,
    },
    /// Slot with round ends.
    Slot {
        /// Centre on the CAD surface.
        centre: Point3,
        /// Normal of the sheet around it.
        axis: UnitVector3,
        /// Long axis, perpendicular to `axis`.
        direction: UnitVector3,
        /// Overall length.
        length_mm: f64,
        /// Width.
        width_mm: f64,
    },
    /// Surface point.
    Surface {
        /// Position on the CAD surface.
        position: Point3,
        /// Direction of the deviation, normally the CAD normal.
        direction: UnitVector3,
    },
    /// Point on a trimmed edge.
    Edge {
        /// Position on the trimmed edge.
        position: Point3,
        /// In the sheet, outwards; perpendicular to `normal`.
        direction: UnitVector3,
        /// Normal of the sheet.
        normal: UnitVector3,
    },
}

impl Geometry {
    /// The word in plans and results.
    pub fn kind(&self) -> &'static str {
        match self {
            Geometry::Hole { .. } => "hole",
            Geometry::Slot { .. } => "slot",
            Geometry::Surface { .. } => "surface",
            Geometry::Edge { .. } => "edge",
        }
    }

    /// The nominal position in the CAD frame.
    pub fn position(&self) -> Point3 {
        match self {
            Geometry::Hole { centre, .. } | Geometry::Slot { centre, .. } => *centre,
            Geometry::Surface { position, .. } | Geometry::Edge { position, .. } => *position,
        }
    }

    /// Normal of the sheet at that place, on the side that the CAD normals point to.
    pub fn sheet_normal(&self) -> Vector3 {
        match self {
            Geometry::Hole { axis, .. } | Geometry::Slot { axis, .. } => axis.into_inner(),
            Geometry::Surface { direction, .. } => direction.into_inner(),
            Geometry::Edge { normal, .. } => normal.into_inner(),
        }
    }
}

/// `[[feature]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// Its name.
    pub name: String,
    /// Its nominal shape.
    pub geometry: Geometry,
    /// Line in the plan file, from 1.
    pub line: usize,
}

/// How a surface point is told from the points around it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SurfaceMethod {
    /// A quadratic through the heights above the CAD: bends of CAD and part leave no bias.
    #[default]
    Local,
    /// A plane through the points themselves and its intersection with the line of the direction, as the SIVPRO paper has it:
    /// on a surface of radius R it is `radius² / 4R` off.
    Plane,
}

/// How a surface point is measured; the default is what the scan's spacing asks for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SurfaceFit {
    /// What is fitted.
    pub method: SurfaceMethod,
    /// Radius of the window; `None`: told by the scan's spacing.
    pub radius_mm: Option<f64>,
}

/// `[[comparison]]`; never a slot.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparisonPoint {
    /// Its name.
    pub name: String,
    /// Its nominal shape.
    pub geometry: Geometry,
    /// Of a surface point: how it is measured.
    pub surface_fit: SurfaceFit,
    /// Lower limit of the deviation.
    pub lower_mm: f64,
    /// Upper limit of the deviation.
    pub upper_mm: f64,
    /// File in which it stands (the plan or its comparison file).
    pub file: PathBuf,
    /// Line in that file, from 1.
    pub line: usize,
}

impl ComparisonPoint {
    /// Whether its value is the distance from its nominal place: of a hole without a direction.
    pub fn is_distance(&self) -> bool {
        matches!(self.geometry, Geometry::Hole { direction: None, .. })
    }

    /// The limit below which it fails, mm: minus infinity where a distance may be 0, since none is less.
    pub fn judged_lower_mm(&self) -> f64 {
        if self.is_distance() && self.lower_mm <= 0.0 { f64::NEG_INFINITY } else { self.lower_mm }
    }
}
