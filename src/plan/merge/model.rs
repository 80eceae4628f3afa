//! The settings of a merge as checked values. Lengths are in the unit of the views, angles rad.

use super::metric::Metric;
use crate::geometry::{LengthUnit, Point3};
use crate::plan::CadSettings;
use std::path::PathBuf;

/// Bounds of one metric; points outside are left out, and so are those of which it is no number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mask {
    /// Of what.
    pub metric: Metric,
    /// Least value that is kept; minus infinity where there is none.
    pub min: f64,
    /// Largest value that is kept.
    pub max: f64,
}

impl Mask {
    /// Whether a value is within bounds, which are held against it as the float that a column would hold: 0.1 keeps 0.1.
    pub fn keeps(&self, value: f32) -> bool {
        value.is_finite() && (self.min as f32..=self.max as f32).contains(&value)
    }
}

/// A value with the line on which the file names it, from 1: for messages that come later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// Its line.
    pub line: usize,
}

/// A file as written, and resolved against the folder of `MERGE.toml`, with the line that names it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFile {
    /// As written.
    pub file: String,
    /// Resolved.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: usize,
}

/// Where the views stand before they are registered.
#[derive(Debug, Clone, PartialEq)]
pub enum Prealign {
    /// As a stage or robot says: `x_world = R x_view + t` for every view.
    Poses(NamedFile),
    /// Where each fits the CAD.
    Cad(CadSettings),
    /// All in one frame already.
    None,
}

/// `[views]`.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSettings {
    /// Their folder, with its line.
    pub folder: NamedFile,
    /// Names of their files, with `*` and `?`.
    pub pattern: String,
    /// Where they stand at first.
    pub prealign: Prealign,
    /// Where the sensor stands, view frame: normals point to it.
    pub sensor: Point3,
}

/// `[calibration]`: files of calibrated features, text columns x y z reprojection_px, view frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CalibrationSettings {
    /// Of the camera.
    pub camera: Option<NamedFile>,
    /// Of the projector.
    pub projector: Option<NamedFile>,
}

/// `[delta_n]`: radii by which a normal is held against those around.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NonUniformitySettings {
    /// Of the points through which a normal is laid; left out, a multiple of d_grid.
    pub normal_radius: Option<f64>,
    /// Of the points whose normals are averaged; left out, a multiple of d_grid.
    pub mean_radius: Option<f64>,
}

/// `[noise]`: removal of points that stand off from their neighbours in their own view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseSettings {
    /// How many neighbours are asked.
    pub neighbours: usize,
    /// A point goes whose mean distance to them is more standard deviations than this above the mean of all.
    pub sigmas: f64,
}

/// `[density]`: the points of a view that share a cell become their mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DensitySettings {
    /// Side of a cell.
    pub cell: Placed<f64>,
}

/// `[registration]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegistrationSettings {
    /// Whether poses are refined.
    pub enabled: bool,
    /// Standard uncertainty of a pre-aligned position; left out, what the data tell.
    pub translation_sigma: Option<f64>,
    /// Standard uncertainty of a pre-aligned turn, rad.
    pub rotation_sigma: Option<f64>,
}

impl Default for RegistrationSettings {
    fn default() -> Self {
        Self { enabled: true, translation_sigma: None, rotation_sigma: None }
    }
}

/// By what it is decided which of several points stays.
#[derive(Debug, Clone, PartialEq)]
pub enum Judge {
    /// None stays: the plain average of a cubic cell, for comparison.
    Mean,
    /// The metric, or the sum of ranks by several.
    Metrics(Vec<Metric>),
}

/// The distance d_s within which points are merged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MergeRadius {
    /// A multiple of d_grid.
    Grid(f64),
    /// A length.
    Length(f64),
}

/// `[merge]`.
#[derive(Debug, Clone, PartialEq)]
pub struct MergeSettings {
    /// The judge.
    pub judge: Placed<Judge>,
    /// d_s; the side of a cell for the plain average.
    pub radius: Placed<MergeRadius>,
}

/// What a feature is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeatureKind {
    /// A plane.
    Plane,
    /// A sphere.
    Sphere,
    /// A cylinder.
    Cylinder,
}

impl FeatureKind {
    /// The word in files.
    pub fn key(self) -> &'static str {
        match self {
            FeatureKind::Plane => "plane",
            FeatureKind::Sphere => "sphere",
            FeatureKind::Cylinder => "cylinder",
        }
    }
}

/// `[[feature]]`: fitted before and after, for the report.
#[derive(Debug, Clone, PartialEq)]
pub struct MergeFeature {
    /// What people call it; `cylinder 1` where the file does not.
    pub name: String,
    /// What it is.
    pub kind: FeatureKind,
    /// Its certified radius; none for a plane.
    pub radius: Option<f64>,
    /// The certificate's standard uncertainty of it.
    pub radius_u: f64,
    /// Line, from 1.
    pub line: usize,
}

/// `[output]`.
#[derive(Debug, Clone, PartialEq)]
pub struct MergeOutput {
    /// The merged cloud, PLY.
    pub file: NamedFile,
    /// The report as JSON; left out, beside the cloud and with its name.
    pub report: Option<NamedFile>,
    /// The report as PDF, where it is wanted.
    pub report_pdf: Option<NamedFile>,
    /// An earlier merged cloud of the same tool, to be compared with.
    pub compare_with: Option<NamedFile>,
}

/// The settings of a merge that can be run.
#[derive(Debug, Clone, PartialEq)]
pub struct MergePlan {
    /// The file.
    pub path: PathBuf,
    /// SHA-256 of its bytes, lower-case hex.
    pub sha256: String,
    /// Unit of the views and of every length here.
    pub unit: LengthUnit,
    /// `[views]`.
    pub views: ViewSettings,
    /// `[mask]`, each metric at most once.
    pub masks: Vec<Placed<Mask>>,
    /// `[calibration]`.
    pub calibration: CalibrationSettings,
    /// `[delta_n]`.
    pub non_uniformity: NonUniformitySettings,
    /// `[noise]`, if it is wanted.
    pub noise: Option<NoiseSettings>,
    /// `[density]`, if it is wanted.
    pub density: Option<DensitySettings>,
    /// `[registration]`.
    pub registration: RegistrationSettings,
    /// `[merge]`.
    pub merge: MergeSettings,
    /// `[[feature]]`.
    pub features: Vec<MergeFeature>,
    /// `[output]`.
    pub output: MergeOutput,
}
