//! The result of one scan: plain data that every printer and the window read, and that owns all they need.

use super::budget::Budget;
use super::crowd::Crowd;
use crate::align::{BestFit, FeatureAlignment};
use crate::diagnostic::Refusal;
use crate::geometry::{Point3, Vector3};
use crate::measure::Card;
use crate::plan::AlignmentMethod;
use crate::scan::Removed;
use serde::{Deserialize, Serialize};

/// What is said of a point or of a part. Ordered from good to bad: the worst point decides the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// In tolerance, the uncertainty taken off.
    Pass,
    /// Too close to a limit for the uncertainty.
    Undecided,
    /// No value. Of a part: incomplete. Never a pass.
    NotMeasured,
    /// Out of tolerance.
    Fail,
}

impl Verdict {
    /// The word for a point in files.
    pub fn point_key(self) -> &'static str {
        match self {
            Verdict::Pass => "pass",
            Verdict::Undecided => "undecided",
            Verdict::NotMeasured => "not_measured",
            Verdict::Fail => "fail",
        }
    }

    /// The word for a part in files.
    pub fn part_key(self) -> &'static str {
        match self {
            Verdict::NotMeasured => "incomplete",
            other => other.point_key(),
        }
    }
}

/// The numbers of one comparison point that was measured. CAD frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Where the point was found, on the CAD's own face (thickness taken out).
    pub measured: Point3,
    /// Positive along the plan's direction.
    pub deviation_mm: f64,
    /// Expanded, k = 2.
    pub uncertainty_mm: f64,
    /// What it is made of.
    pub budget: Budget,
    /// Residual scale of the fit (rms of its inliers).
    pub rms_mm: f64,
    /// Only for holes.
    pub hole: Option<HoleMeasurement>,
}

/// What a hole tells beyond its deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct HoleMeasurement {
    /// Twice the distance of the centre in the sheet plane.
    pub position_mm: f64,
    /// Measured minus nominal centre, in the sheet plane.
    pub delta_mm: Vector3,
    /// Measured diameter.
    pub diameter_mm: f64,
    /// Measured minus nominal diameter.
    pub diameter_deviation_mm: f64,
}

/// One comparison point of the plan in this scan; in the plan's order.
#[derive(Debug, Clone, PartialEq)]
pub struct PointResult {
    /// Its name.
    pub name: String,
    /// `surface`, `edge` or `hole`.
    pub kind: &'static str,
    /// Nominal position, CAD frame.
    pub nominal: Point3,
    /// The plan's direction; zero for a hole without one.
    pub direction: Vector3,
    /// Limits.
    pub lower_mm: f64,
    /// Limits.
    pub upper_mm: f64,
    /// Its verdict.
    pub verdict: Verdict,
    /// Why it could not be measured or decided.
    pub reason: Option<String>,
    /// Points used by the fit (or found in the window, when not measured).
    pub points_used: usize,
    /// What the value rests on, or what was asked until it was known that there is none.
    pub card: Card,
    /// The numbers, unless it was not measured.
    pub measurement: Option<Measurement>,
}

impl PointResult {
    /// Deviation over tolerance: 1 at the limit, counted from the middle of the tolerance zone. `None` without a value.
    pub fn tolerance_ratio(&self) -> Option<f64> {
        let middle = 0.5 * (self.lower_mm + self.upper_mm);
        let half = 0.5 * (self.upper_mm - self.lower_mm);
        self.measurement.as_ref().map(|m| (m.deviation_mm - middle).abs() / half)
    }
}

/// Deviation of every kept point, with its statistics. Positive along the CAD normals, whichever side was seen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DeviationMap {
    /// Indices into the scan's cloud of the points that carry a value.
    pub indices: Vec<u32>,
    /// Deviation in mm of each of them.
    pub deviations_mm: Vec<f32>,
    /// Kept points that project past a trimmed edge or lie too far from the CAD to belong to it: flagged, not counted.
    pub flagged: Vec<u32>,
    /// The densest crowd of points too far from the CAD, if there is one as dense as sheet.
    pub far_crowd: Option<Crowd>,
    /// Statistics over `deviations_mm`.
    pub statistics: MapStatistics,
}

/// Statistics of the map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct MapStatistics {
    /// Points counted.
    pub points: usize,
    /// Mean.
    pub mean_mm: f64,
    /// Root mean square.
    pub rms_mm: f64,
    /// 5 % quantile.
    pub p05_mm: f64,
    /// 95 % quantile.
    pub p95_mm: f64,
    /// Share within plus and minus the plan's map range.
    pub within_range_ratio: f64,
    /// Points past a trimmed edge.
    pub past_edge: usize,
    /// Points too far from the CAD.
    pub far: usize,
}

/// Who and what was inspected.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// Part name.
    pub part_name: String,
    /// Part number.
    pub part_number: String,
    /// Part revision.
    pub part_revision: String,
    /// Plan file name (without folder).
    pub plan_file: String,
    /// Its hash.
    pub plan_sha256: String,
    /// CAD file as written in the plan.
    pub cad_file: String,
    /// Its hash.
    pub cad_sha256: String,
    /// Triangles in the CAD.
    pub cad_triangles: usize,
    /// Scan file name (without folder).
    pub scan_file: String,
    /// Its hash; `None` when the file could not be read at all.
    pub scan_sha256: Option<String>,
    /// When it was taken, as the plan says; ISO 8601.
    pub scan_taken: Option<String>,
}

/// Everything measured in one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// Points in the file that were finite or not.
    pub points_read: usize,
    /// Points left after the filters.
    pub points_kept: usize,
    /// What the filters took.
    pub removed: Removed,
    /// Verdict of the part.
    pub verdict: Verdict,
    /// Best fit.
    pub best_fit: BestFit,
    /// Alignment of the plan.
    pub alignment: FeatureAlignment,
    /// Comparison points, plan order.
    pub points: Vec<PointResult>,
    /// Deviation map.
    pub map: DeviationMap,
    /// What somebody should know.
    pub warnings: Vec<String>,
}

impl Inspection {
    /// The map's points in the CAD frame with their deviations; `positions` are those of the scan's cloud, indices beyond them are passed
    /// over.
    pub fn map_in_cad(&self, positions: &[Point3]) -> (Vec<Point3>, Vec<f32>) {
        let pose = &self.alignment.cad_from_scan;
        let told = self.map.indices.iter().zip(&self.map.deviations_mm);
        told.filter_map(|(&i, &d)| positions.get(i as usize).map(|p| (pose.point(p), d))).unzip()
    }
}

/// Measured, or refused with a reason.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The scan was measured.
    Measured(Box<Inspection>),
    /// The scan could not be measured.
    Refused(Refusal),
}

/// What became of a scan's points; a scan that was refused may not have come to the later ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CloudCounts {
    /// Points in the file, finite or not.
    pub points_read: Option<usize>,
    /// Points left after the filters.
    pub points_kept: Option<usize>,
    /// What the filters took.
    pub removed: Option<Removed>,
}

/// One scan's result: the one source of every report.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectionResult {
    /// Who and what.
    pub identity: Identity,
    /// What came out.
    pub outcome: Outcome,
    /// What became of the points, as far as the scan came.
    pub counts: CloudCounts,
    /// The plan's colour scale.
    pub map_range_mm: f64,
    /// The plan's alignment, for the report's words.
    pub method: AlignmentMethod,
}
