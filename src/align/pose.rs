//! What an alignment tells.

use crate::geometry::{CadFromScan, Isometry3, Point3, Vector3};
use crate::plan::Side;

/// The robust best fit.
#[derive(Debug, Clone, PartialEq)]
pub struct BestFit {
    /// The pose.
    pub cad_from_scan: CadFromScan,
    /// The side seen; `None` when it cannot be told and does not matter.
    pub side: Option<Side>,
    /// The face that the points were registered to (top when `side` is `None`).
    pub face: Side,
    /// Robust rms of the inliers' distances.
    pub rms_mm: f64,
    /// Inliers / kept points looked at.
    pub inlier_ratio: f64,
    /// Cost of the best distinct pose over the cost of the chosen one.
    pub margin: f64,
    /// The margin below which a scan is refused.
    pub margin_limit: f64,
    /// Start poses tried.
    pub poses_tried: usize,
    /// How well the pose is known, from the scatter of the points and from what its iteration left undone.
    pub uncertainty: PoseUncertainty,
    /// Whether the iteration ended at the best fit, to within what the scatter of the points leaves open. Where it did not the
    /// pose is good enough to look for features from, and to judge nothing by.
    pub converged: bool,
    /// What the iteration left undone: how far the part's furthest corner may still be from the best fit, mm.
    pub unfinished_mm: f64,
    /// Why it is not known which face of a solid was seen: nothing is judged then.
    pub open_face: Option<String>,
}

impl BestFit {
    /// Why nothing may be judged in it, where its iteration did not end.
    pub(super) fn left_undone(&self) -> Option<String> {
        let left_mm = self.unfinished_mm;
        (!self.converged).then(|| {
            format!("the best fit did not settle: it may still be {left_mm:.3} mm off at the part's furthest corner")
        })
    }
}

/// A datum feature as found, CAD frame, on the CAD's own face, in the final alignment.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredFeature {
    /// Its name.
    pub name: String,
    /// `hole`, `slot` or `surface`.
    pub kind: &'static str,
    /// Which motions it fixes, in words.
    pub fixes: String,
    /// Centre or position.
    pub centre: Point3,
    /// Sheet normal (hole, slot) or direction (surface).
    pub axis: Vector3,
    /// Long axis of a slot.
    pub direction: Option<Vector3>,
    /// Hole: diameter. Slot: width.
    pub diameter_mm: Option<f64>,
    /// Slot: overall length.
    pub length_mm: Option<f64>,
    /// Nominal diameter or width.
    pub nominal_diameter_mm: Option<f64>,
    /// Nominal length.
    pub nominal_length_mm: Option<f64>,
    /// Points used by the fit.
    pub points_used: usize,
    /// Residual scale of the fit.
    pub rms_mm: f64,
    /// What somebody should know of it.
    pub warning: Option<String>,
}

/// The alignment to which all deviations refer.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureAlignment {
    /// `features`, `rps` or `best_fit`.
    pub method: &'static str,
    /// The pose.
    pub cad_from_scan: CadFromScan,
    /// Why the plan's alignment was not possible, when it was not: the pose is then only the best fit and nothing is judged
    /// in it.
    pub degraded: Option<String>,
    /// Names of the datums that could not be measured, in the alignment's order.
    pub missing: Vec<String>,
    /// Datum features that were measured.
    pub features: Vec<MeasuredFeature>,
    /// How the datums hold the part, where they do.
    pub hold: Option<DatumHold>,
}

/// How the datums hold the part.
#[derive(Debug, Clone, PartialEq)]
pub struct DatumHold {
    /// How many times more strongly the best held motion is held than the weakest; turns count by what they move at the part's size.
    pub condition: f64,
    /// The weakest motion in words, where it is weak enough to be told.
    pub weak: Option<String>,
    /// What is left of each lock where there are more than six, in the plan's order.
    pub residuals: Vec<LockResidual>,
}

/// What is left of a lock that shares in holding the part with more than it needs.
#[derive(Debug, Clone, PartialEq)]
pub struct LockResidual {
    /// The datum's name.
    pub name: String,
    /// The locked direction, CAD frame.
    pub lock: Vector3,
    /// Measured minus nominal along it, in the alignment.
    pub residual_mm: f64,
    /// The same in standard deviations of such a residual, from the datums' uncertainties; `None` where no other lock checks this one.
    pub normalised: Option<f64>,
}

/// How well the pose is known: motions of the part, each as likely as one standard uncertainty. Independent of each other;
/// their squares add.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseUncertainty {
    motions: Vec<Source>,
    /// What the calibrated edge offset's uncertainty does to the part, by one edge datum and by all of them together.
    edge_offset: Vec<Source>,
    edge_offsets_together: Option<Isometry3>,
    /// By all datums together.
    thickness: Isometry3,
    scale: Isometry3,
    scale_about: Point3,
}

/// One error and what it does to the part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Source {
    /// The part's motion, CAD frame.
    pub motion: Isometry3,
    /// Whose error it is, where it shifts one datum: its index among the plan's features, and the shift in mm.
    pub of: Option<(usize, Vector3)>,
}

/// Shares in the standard uncertainty of a point that the part is held by, mm along a direction. A datum's error moves the part and
/// the point as one: where the datum is held exactly in that direction nothing is left of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DatumShares {
    /// What the lock leaves of its own measurement's errors: of the points and of the measuring system.
    pub own_mm: f64,
    /// Of everything else that moves the part.
    pub others_mm: f64,
    /// Of the calibrated edge offset.
    pub edge_offset_mm: f64,
}

impl PoseUncertainty {
    /// No motion yet. `scale_about`: where `set_scale` lets the part stay when it grows, CAD frame.
    pub fn none(scale_about: Point3) -> Self {
        Self {
            motions: Vec::new(),
            edge_offset: Vec::new(),
            edge_offsets_together: None,
            thickness: Isometry3::identity(),
            scale: Isometry3::identity(),
            scale_about,
        }
    }

    /// What single errors do to the part, without those of edge offsets.
    pub(super) fn motions(&self) -> Vec<Isometry3> {
        self.motions.iter().map(|source| source.motion).collect()
    }

    /// Adds what one independent error does to the part, CAD frame.
    pub(super) fn add(&mut self, motion: Isometry3) {
        self.motions.push(Source { motion, of: None });
    }

    /// Adds what one independent shift of a datum, given by its index among the plan's features, does to the part.
    pub(super) fn add_shift(&mut self, datum: usize, by: Vector3, motion: Isometry3) {
        self.motions.push(Source { motion, of: Some((datum, by)) });
    }

    /// Sets what a sheet that is thicker by one standard uncertainty does to the part, CAD frame.
    pub(super) fn set_thickness(&mut self, motion: Isometry3) {
        self.thickness = motion;
    }

    /// Sets what a scale that is too large by one standard uncertainty does to the part, CAD frame, once everything has grown away
    /// from `scale_about`.
    pub(super) fn set_scale(&mut self, motion: Isometry3) {
        self.scale = motion;
    }

    /// What a thicker sheet and a larger scale do to the part, as they were set.
    pub(super) fn common_motions(&self) -> [Isometry3; 2] {
        [self.thickness, self.scale]
    }

    /// Sets what an error of the calibrated edge offset does to the part, CAD frame: of one edge datum alone, each, and of all
    /// of them together.
    pub(super) fn set_edge_offset(&mut self, each: Vec<Source>, together: Isometry3) {
        self.edge_offset = each;
        self.edge_offsets_together = Some(together);
    }

    /// How far a sheet that is thicker by one standard uncertainty moves a point of the part by the datums, which it displaces
    /// too, mm.
    pub fn by_thickness(&self, point_cad: &Point3) -> Vector3 {
        self.thickness * point_cad - point_cad
    }

    /// How far a scale that is too large by `ppm`, one standard uncertainty, displaces a point of the part, mm: by growing, and by the datums
    /// that grow with it.
    pub fn by_scale(&self, point_cad: &Point3, ppm: f64) -> Vector3 {
        (point_cad - self.scale_about) * (ppm * 1e-6) + (self.scale * point_cad - point_cad)
    }

    /// Of a point that is the datum of that index among the plan's features; `None` where no shift of that datum moves the part.
    pub fn of_datum(&self, datum: usize, point_cad: &Point3, direction: &Vector3) -> Option<DatumShares> {
        let is_own = |source: &&Source| source.of.is_some_and(|(index, _)| index == datum);
        if !self.motions.iter().chain(&self.edge_offset).any(|source| is_own(&source)) {
            return None;
        }
        let moved = |motion: &Isometry3| (motion * point_cad - point_cad).dot(direction);
        let left = |source: &Source| {
            let own = source.of.filter(|(index, _)| *index == datum).map_or(0.0, |(_, by)| by.dot(direction));
            own + moved(&source.motion)
        };
        let (own, others): (Vec<&Source>, Vec<&Source>) = self.motions.iter().partition(is_own);
        let square_sum = |sources: &[&Source]| sources.iter().map(|source| left(source).powi(2)).sum::<f64>();
        let apart = self.edge_offset.iter().map(|source| left(source).powi(2)).sum::<f64>().sqrt();
        let own_edge = self.edge_offset.iter().find(is_own).and_then(|source| source.of);
        let together = self.edge_offsets_together.map_or(0.0, |motion| moved(&motion));
        let together = own_edge.map_or(0.0, |(_, by)| by.dot(direction)) + together;
        Some(DatumShares {
            own_mm: square_sum(&own).sqrt(),
            others_mm: square_sum(&others).sqrt(),
            edge_offset_mm: apart.max(together.abs()),
        })
    }

    /// Standard uncertainty in mm, along a direction, of where a point of the part lies.
    pub fn at(&self, point_cad: &Point3, direction: &Vector3) -> f64 {
        self.without_edge_offset(point_cad, direction).hypot(self.edge_offset_mm(point_cad, direction, 0.0))
    }

    /// Standard uncertainty in mm of where a point of the part lies, over all directions.
    pub(super) fn anywhere_at(&self, point_cad: &Point3) -> f64 {
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|d| self.at(point_cad, &d).powi(2)).iter().sum::<f64>().sqrt()
    }

    /// The same without the share of the calibrated edge offset.
    pub fn without_edge_offset(&self, point_cad: &Point3, direction: &Vector3) -> f64 {
        square_sum(&self.motions, point_cad, direction).sqrt()
    }

    /// Share of the calibrated edge offset in the standard uncertainty of a point of the part, mm along a direction; `own_mm` is
    /// what it does to the measurement of the point itself. One calibration serves all edges, and yet each edge differs from
    /// it: the larger is told of the sum of squares, as if edges had nothing in common, and the sum, as if they had all.
    pub fn edge_offset_mm(&self, point_cad: &Point3, direction: &Vector3, own_mm: f64) -> f64 {
        let apart = (square_sum(&self.edge_offset, point_cad, direction) + own_mm * own_mm).sqrt();
        let together = self.edge_offsets_together.map_or(0.0, |m| (m * point_cad - point_cad).dot(direction));
        apart.max(together.abs() + own_mm.abs())
    }
}

fn square_sum(sources: &[Source], point_cad: &Point3, direction: &Vector3) -> f64 {
    sources.iter().map(|s| (s.motion * point_cad - point_cad).dot(direction).powi(2)).sum()
}
