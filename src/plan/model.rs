//! The inspection plan as checked values: every direction has length one, every length is mm, every angle rad.

use super::merge::MergePlan;
use super::nominal::{AlignmentMethod, ComparisonPoint, Feature};
pub use crate::geometry::LengthUnit;
use crate::geometry::UnitVector3;
use std::path::PathBuf;

/// Where the CAD surface lies in the sheet (`cad_side` in docs/plan.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CadSide {
    /// Material behind the surface, against its normals.
    Top,
    /// Material in front of the surface, along its normals.
    Bottom,
    /// The surface is the middle of the sheet.
    Middle,
    /// A closed solid with both faces.
    Solid,
}

impl CadSide {
    /// Offset in mm, along the CAD normals, from the CAD surface to the face that a camera on the given side sees.
    /// Zero for a solid, whose faces are both in the CAD.
    pub fn face_offset_mm(self, side: Side, thickness_mm: f64) -> f64 {
        match (self, side) {
            (CadSide::Top, Side::Bottom) => -thickness_mm,
            (CadSide::Bottom, Side::Top) => thickness_mm,
            (CadSide::Middle, Side::Top) => 0.5 * thickness_mm,
            (CadSide::Middle, Side::Bottom) => -0.5 * thickness_mm,
            _ => 0.0,
        }
    }
}

/// The side of the sheet on which the camera stands. `Top`: the side that the CAD normals (for a solid: the plan's
/// directions) point to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// The CAD normals point to the camera.
    Top,
    /// The CAD normals point away from the camera.
    Bottom,
}

impl Side {
    /// The word in results.
    pub fn key(self) -> &'static str {
        match self {
            Side::Top => "top",
            Side::Bottom => "bottom",
        }
    }

    /// The other side.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Side::Top => Side::Bottom,
            Side::Bottom => Side::Top,
        }
    }

    /// +1 for the top, -1 for the bottom: turns a direction of the plan into one that points to the camera.
    pub fn sign(self) -> f64 {
        match self {
            Side::Top => 1.0,
            Side::Bottom => -1.0,
        }
    }
}

/// How a verdict is made of a deviation and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// The uncertainty is taken off the tolerance on both sides; between lies "undecided".
    Iso14253,
    /// The deviation alone is compared with the limits.
    Plain,
}

/// `[part]`.
#[derive(Debug, Clone, PartialEq)]
pub struct PartInfo {
    /// What people call it.
    pub name: String,
    /// Drawing or part number.
    pub number: String,
    /// Drawing revision.
    pub revision: String,
    /// Sheet thickness; 0 = no compensation.
    pub thickness_mm: f64,
    /// Verdict rule.
    pub decision: Decision,
    /// Where the CAD surface lies in the sheet.
    pub cad_side: CadSide,
}

/// `[cad]`.
#[derive(Debug, Clone, PartialEq)]
pub struct CadSettings {
    /// The file as written in the plan.
    pub file: String,
    /// The same, resolved against the plan's folder.
    pub path: PathBuf,
    /// Its unit.
    pub unit: LengthUnit,
}

/// In which order the scans of a folder are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanOrder {
    /// By file name, bytewise.
    Name,
    /// By time of last change, then by name.
    Modified,
}

/// Where the date of a scan comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Taken {
    /// No date.
    None,
    /// From the file name's stem, by a strftime pattern.
    Name(String),
    /// From the file's time of last change.
    Modified,
}

/// `[scans]`.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanSettings {
    /// The folder as written.
    pub folder: String,
    /// The same, resolved.
    pub path: PathBuf,
    /// File name pattern with `*` and `?`.
    pub pattern: String,
    /// The plan's CAD file, resolved, which is never a scan.
    pub cad: Option<PathBuf>,
    /// Unit of the scans.
    pub unit: LengthUnit,
    /// Their order.
    pub order: ScanOrder,
    /// Their date.
    pub taken: Taken,
    /// Where the camera looks, in the scan frame.
    pub view_direction: Option<UnitVector3>,
    /// How a part's views are merged, where each sub-folder of the folder holds those of one part.
    pub views: Option<Box<MergePlan>>,
}

/// `[background]`; `None` = a default derived from the data.
#[derive(Debug, Clone, PartialEq)]
pub struct BackgroundSettings {
    /// Fit a plane to the belt and drop what lies on or below it.
    pub belt_plane: bool,
    /// Height above the belt that is still taken for belt.
    pub belt_clearance_mm: Option<f64>,
    /// Colours of the unworn belt, 8-bit RGB.
    pub belt_colours: Vec<[u8; 3]>,
    /// Distance in RGB (Euclidean, 0..441) within which a colour is the belt's.
    pub colour_tolerance: f64,
    /// Rec. 601 luminance 0..255 below which a point is dropped.
    pub luminance_min: Option<f64>,
}

impl Default for BackgroundSettings {
    fn default() -> Self {
        Self {
            belt_plane: true,
            belt_clearance_mm: None,
            belt_colours: Vec::new(),
            colour_tolerance: 18.0,
            luminance_min: None,
        }
    }
}

/// `[rig]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rig {
    /// Distance to the object.
    pub distance_mm: f64,
    /// Distance between the cameras.
    pub base_mm: f64,
    /// Focal length.
    pub focal_mm: f64,
    /// Size of a pixel.
    pub pixel_um: f64,
    /// Accuracy of matching.
    pub image_accuracy_px: f64,
    /// 1 full, 2 half of the pixels in each direction.
    pub resolution_level: u32,
    /// Spacing of the points where not every pixel gives one.
    pub point_spacing_mm: Option<f64>,
}

/// `[uncertainty]`, standard uncertainties (k = 1) that the scan itself cannot show.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UncertaintySettings {
    /// Of the scale, parts per million.
    pub scale_ppm: f64,
    /// Of the sheet's thickness.
    pub thickness_mm: f64,
    /// Of the measuring system.
    pub system_mm: f64,
    /// Calibrated shift of optical edges, outwards positive.
    pub edge_offset_mm: f64,
    /// Its standard uncertainty.
    pub edge_offset_u_mm: f64,
}

/// A report format that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum OutputFormat {
    /// `NAME.txt`.
    Ascii,
    /// `NAME.json`.
    Json,
    /// `NAME.pdf`.
    Pdf,
    /// `NAME.csv`.
    Csv,
    /// `NAME.ply`.
    Ply,
}

/// `[output]`.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputSettings {
    /// The folder as written.
    pub folder: String,
    /// The same, resolved.
    pub path: PathBuf,
    /// Formats, each once, in a fixed order.
    pub formats: Vec<OutputFormat>,
    /// Colour scale from minus to plus this value.
    pub map_range_mm: f64,
}

/// What of a plan is sound, whatever is wrong with the rest.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Draft {
    /// The plan file.
    pub path: PathBuf,
    /// Hash of all that the plan was read from, as in [`Plan`], sound or not; empty where its file cannot be read.
    pub sha256: String,
    /// `[part]`.
    pub part: Option<PartInfo>,
    /// `[cad]`.
    pub cad: Option<CadSettings>,
    /// `[scans]`.
    pub scans: Option<ScanSettings>,
    /// `[alignment]`, if every feature is sound: it refers to `features`.
    pub alignment: Option<AlignmentMethod>,
    /// Line of `slot_reading`, else of `[alignment]`, from 1.
    pub alignment_line: usize,
    /// `[[feature]]`.
    pub features: Vec<Feature>,
    /// `[[comparison]]` or the comparison file, in order.
    pub comparison: Vec<ComparisonPoint>,
    /// `[rig]`.
    pub rig: Option<Rig>,
    /// `[uncertainty]`, with what holds where it is left out.
    pub uncertainty: Option<UncertaintySettings>,
    /// `[output]`.
    pub output: Option<OutputSettings>,
    /// Where results are to go.
    pub results: Option<ResultsPlace>,
}

/// The folder for results and where the plan names it.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultsPlace {
    /// Resolved against the plan's folder.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: usize,
}

/// A plan that can be run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The plan file.
    pub path: PathBuf,
    /// SHA-256 of the plan's bytes (and of its comparison file's, when it has one), lower-case hex.
    pub sha256: String,
    /// `[part]`.
    pub part: PartInfo,
    /// `[cad]`.
    pub cad: CadSettings,
    /// `[scans]`.
    pub scans: ScanSettings,
    /// `[background]`.
    pub background: BackgroundSettings,
    /// `[alignment]`.
    pub alignment: AlignmentMethod,
    /// Line of `slot_reading`, else of `[alignment]`, from 1.
    pub alignment_line: usize,
    /// `[[feature]]`.
    pub features: Vec<Feature>,
    /// `[[comparison]]` or the comparison file, in order.
    pub comparison: Vec<ComparisonPoint>,
    /// `[rig]`.
    pub rig: Option<Rig>,
    /// `[uncertainty]`.
    pub uncertainty: UncertaintySettings,
    /// `[output]`.
    pub output: OutputSettings,
}
