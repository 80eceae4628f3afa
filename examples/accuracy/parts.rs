//! The parts and the rig: a bracket, every other one bent, with openings and trimmed edges off their places, seen from both sides.

use crate::record::{PointRecord, ScanRecord};
use crate::simple;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use shapeline::geometry::{Aabb, CadFromScan, Point3, UnitVector3, Vector3};
use shapeline::inspect::{Identity, Inspected, Inspection, Outcome, PointResult, inspect};
use shapeline::measure::{self, Local};
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{CadSide, Geometry, Plan, Side};
use shapeline::run::RunContext;
use shapeline::scan::PointGrid;
use shapeline::simulate::{
    BracketParameters, Deviation, PoseChoice, RigModel, ScanTruth, Subject, SyntheticPart, bracket, draw_springback,
    simulate_scan,
};

/// Bent parts give way by about so much at their ends, mm.
const SPRINGBACK_MM: f64 = 0.4;
/// Standard deviation of where a bent part's openings and edges are, along each axis, mm.
const OFF_PLACE_MM: f64 = 0.3;
/// The search distance that the plan's comparison uses for all kinds, mm.
const SEARCH_MM: f64 = 3.0;

/// Who measures, and what the plan knows of it.
#[derive(Clone)]
pub struct Case {
    rig: RigModel,
    seed: u64,
    edge_offset_mm: f64,
    edge_offset_u_mm: f64,
}

impl Case {
    /// The demands' own: 26 points/mm², sharp rims.
    pub fn dense() -> Self {
        Self { rig: rig(26.0), seed: 100_000, edge_offset_mm: 0.0, edge_offset_u_mm: 0.0 }
    }

    /// Rims rounded by 0.3 mm, three times the clutter.
    pub fn rounded() -> Self {
        Self {
            rig: RigModel { rim_rounding_mm: 0.3, clutter_per_hole: 30, ..rig(26.0) },
            seed: 200_000,
            ..Self::dense()
        }
    }

    /// 1.3 points/mm².
    pub fn sparse() -> Self {
        Self { rig: rig(1.3), seed: 300_000, ..Self::dense() }
    }

    /// The same with other parts and other noise, to calibrate on.
    pub fn another_series(&self) -> Self {
        Self { seed: self.seed + 50_000, ..self.clone() }
    }

    /// The plan's `[uncertainty]` states this.
    pub fn calibrated(&self, offset: &EdgeOffset) -> Self {
        Self { edge_offset_mm: offset.mm, edge_offset_u_mm: offset.u_mm, ..self.clone() }
    }
}

/// Where the optical edge lies, as a calibration tells it.
pub struct EdgeOffset {
    /// So far inwards of the material's end.
    pub mm: f64,
    /// Standard uncertainty: what it differs from edge to edge.
    pub u_mm: f64,
}

fn rig(density_per_mm2: f64) -> RigModel {
    RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default().with_density(density_per_mm2) }
}

/// The CAD and its plan.
pub struct Scene {
    nominal: SyntheticPart,
    pub plan: Plan,
    part: Part,
    pub bounds: Aabb,
}

impl Scene {
    pub fn new() -> Self {
        let nominal = bracket(&BracketParameters::default());
        let settings =
            PartSettings { cad_side: CadSide::Top, thickness_mm: nominal.thickness_mm, plan_directions: Vec::new() };
        let part = Part::prepare(nominal.mesh.clone(), "0".repeat(64), &settings, &RunContext::silent());
        let bounds = nominal.mesh.bounds().expect("the bracket has vertices");
        Self { plan: nominal.plan(), part: part.expect("the bracket is sound"), bounds, nominal }
    }

    /// Scans of a case, in order: two of each part, from the top and from the bottom; every other part is perfect.
    pub fn records(&self, case: &Case, count: usize) -> Vec<ScanRecord> {
        (0..count).into_par_iter().map(|k| self.record(case, k as u64)).collect()
    }

    fn record(&self, case: &Case, k: u64) -> ScanRecord {
        let (number, side) = (k / 2, if k.is_multiple_of(2) { Side::Top } else { Side::Bottom });
        let is_perfect = number.is_multiple_of(2);
        let subject = self.subject(case.seed + number, is_perfect);
        let pose = PoseChoice::side(&subject, side);
        let scan =
            simulate_scan(&subject, &case.rig, &pose, case.seed + k, &RunContext::silent()).expect("nobody cancels");
        let mut plan = self.plan.clone();
        plan.scans.view_direction = Some(case.rig.view_direction);
        plan.uncertainty.edge_offset_mm = case.edge_offset_mm;
        plan.uncertainty.edge_offset_u_mm = case.edge_offset_u_mm;
        let inspected =
            inspect(&plan, &self.part, scan.cloud, identity(), &RunContext::silent()).expect("nobody cancels");
        let mut record = ScanRecord {
            side,
            is_perfect,
            refused: None,
            best_fit_corner_mm: None,
            corner_mm: None,
            points: Vec::new(),
        };
        match &inspected.result.outcome {
            Outcome::Refused(refusal) => record.refused = Some(refusal.to_string()),
            Outcome::Measured(inspection) => {
                assert_eq!(inspection.best_fit.side, Some(side), "scan {k} was taken for the other side");
                let made = scan.truth.pose().expect("a motion");
                record.best_fit_corner_mm = Some(corner_mm(&self.bounds, inspection.best_fit.cad_from_scan, made));
                let exact = scan.truth.aligned_cad_from_scan.and_then(|m| CadFromScan::try_from_row_major(&m));
                record.corner_mm =
                    exact.map(|exact| corner_mm(&self.bounds, inspection.alignment.cad_from_scan, exact));
                record.points = self.points(&plan, inspection, &inspected, &scan.truth, side);
            }
        }
        record
    }

    fn subject(&self, seed: u64, is_perfect: bool) -> Subject {
        if is_perfect {
            return Subject::perfect(&self.nominal);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut drawn =
            || -> f64 { OFF_PLACE_MM * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng) };
        let actual = bracket(&BracketParameters {
            shifts: ["H1", "S1", "C01", "C02", "C03", "C04", "C05"].map(|name| (name, drawn(), drawn())).to_vec(),
            trims: ["E01", "E02", "E03", "E04", "E05", "E06"].map(|name| (name, drawn())).to_vec(),
            ..BracketParameters::default()
        });
        Subject::synthetic(&self.nominal, &actual, draw_springback(seed, SPRINGBACK_MM, &self.bounds))
    }

    fn points(
        &self,
        plan: &Plan,
        inspection: &Inspection,
        inspected: &Inspected,
        truth: &ScanTruth,
        side: Side,
    ) -> Vec<PointRecord> {
        let scan = inspected.scan.as_ref().expect("a measured scan");
        let grid = PointGrid::build(scan, (4.0 * scan.spacing_mm).max(1.0));
        let cad_from_scan = truth.pose().expect("a motion");
        let local = Local {
            part: &self.part,
            face: self.part.face(side),
            scan,
            grid: &grid,
            cad_from_scan,
            uncertainty: &plan.uncertainty,
        };
        let exact = inspection.points.iter().zip(&plan.comparison).zip(&truth.points);
        exact
            .map(|((result, point), truth)| {
                let aligned = truth.aligned.as_ref().expect("the simulated part has every feature");
                let made = truth.in_true_pose.as_ref().expect("the simulated part has every feature");
                PointRecord {
                    name: point.name.clone(),
                    kind: point.geometry.kind(),
                    diameter_mm: diameter_mm(&point.geometry),
                    seen_deg: seen_deg(&local, &point.geometry, side),
                    truth_mm: aligned.deviation_mm,
                    aligned: result
                        .measurement
                        .as_ref()
                        .map(|m| (m.deviation_mm - aligned.deviation_mm, m.uncertainty_mm)),
                    reason: result.reason.clone().filter(|_| result.measurement.is_none()),
                    centre: in_sheet(result, aligned, &point.geometry),
                    diameter_error_mm: diameter_error(result, aligned),
                    in_true_pose: in_true_pose(&local, &point.geometry, made),
                    simple: simple::errors(&local, &point.geometry, made),
                }
            })
            .collect()
    }
}

fn diameter_mm(geometry: &Geometry) -> Option<f64> {
    match geometry {
        Geometry::Hole { diameter_mm, .. } => Some(*diameter_mm),
        _ => None,
    }
}

/// Angle between the way to the camera and the normal of the sheet's seen face.
fn seen_deg(local: &Local, geometry: &Geometry, side: Side) -> f64 {
    let normal = local.cad_from_scan.scan_from_cad().rotation * (geometry.sheet_normal() * side.sign());
    let to_camera = local.scan.to_camera.expect("the plan tells the view");
    normal.dot(&to_camera).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Two directions in the sheet around a hole.
pub fn axes(axis: &UnitVector3) -> [Vector3; 2] {
    let x = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    [x, axis.cross(&x)]
}

fn in_sheet(result: &PointResult, truth: &Deviation, geometry: &Geometry) -> Option<[f64; 2]> {
    let Geometry::Hole { axis, .. } = geometry else { return None };
    let off = result.measurement.as_ref()?.hole.as_ref()?.delta_mm - Vector3::from(truth.delta_mm?);
    Some(axes(axis).map(|a| a.dot(&off)))
}

fn diameter_error(result: &PointResult, truth: &Deviation) -> Option<f64> {
    Some(result.measurement.as_ref()?.hole.as_ref()?.diameter_mm - truth.diameter_mm?)
}

/// Errors of our estimators where the simulator made the part, no alignment between: one, or two for a hole.
fn in_true_pose(local: &Local, geometry: &Geometry, truth: &Deviation) -> Vec<f64> {
    match geometry {
        Geometry::Surface { position, direction } => {
            let found = measure::surface(local, position, direction, SEARCH_MM);
            found.map(|f| vec![f.deviation_mm - truth.deviation_mm]).unwrap_or_default()
        }
        Geometry::Edge { position, direction, normal } => {
            let found = measure::edge(local, position, direction, normal, SEARCH_MM);
            found.map(|f| vec![f.deviation_mm - truth.deviation_mm]).unwrap_or_default()
        }
        Geometry::Hole { centre, axis, diameter_mm, .. } => {
            let Ok(found) = measure::hole(local, centre, axis, *diameter_mm, SEARCH_MM) else { return Vec::new() };
            let off = found.centre - centre - Vector3::from(truth.delta_mm.expect("a hole"));
            axes(axis).map(|a| a.dot(&off)).to_vec()
        }
        Geometry::Slot { .. } => Vec::new(),
    }
}

/// Largest distance, over the corners of the part's box, between where a pose and where the exact one puts them.
fn corner_mm(bounds: &Aabb, found: CadFromScan, exact: CadFromScan) -> f64 {
    let off = |corner: Point3| (found.isometry() * (exact.scan_from_cad() * corner) - corner).norm();
    let pick = |k: u32, bit: u32, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
    let (low, high) = (bounds.min, bounds.max);
    let corner = |k| Point3::new(pick(k, 0, low.x, high.x), pick(k, 1, low.y, high.y), pick(k, 2, low.z, high.z));
    (0..8).map(|k| off(corner(k))).fold(0.0, f64::max)
}

fn identity() -> Identity {
    Identity {
        part_name: "bracket".into(),
        part_number: String::new(),
        part_revision: String::new(),
        plan_file: "plan.toml".into(),
        plan_sha256: "0".repeat(64),
        cad_file: "bracket.stl".into(),
        cad_sha256: "0".repeat(64),
        cad_triangles: 0,
        scan_file: "scan.ply".into(),
        scan_sha256: None,
        scan_taken: None,
    }
}
