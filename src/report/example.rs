//! Results made up for the tests of this module: the bracket of the design pictures and its odd relatives.

use crate::align::{BestFit, DatumHold, FeatureAlignment, MeasuredFeature, PoseUncertainty};
use crate::diagnostic::Refusal;
use crate::geometry::{CadFromScan, Isometry3, Mesh, Point3, PointCloud, Vector3};
use crate::inspect::*;
use crate::measure::Card;
use crate::part::{Part, PartSettings};
use crate::plan::{AlignmentMethod, CadSide, Side, SlotReading};
use crate::run::RunContext;
use crate::scan::{ConditionedScan, PointClass, Removed};

/// The measured part of a result that is known to be one.
pub fn inspection(result: &InspectionResult) -> &Inspection {
    match &result.outcome {
        Outcome::Measured(inspection) => inspection,
        Outcome::Refused(refusal) => panic!("refused: {refusal}"),
    }
}

/// The same, to be changed.
pub fn inspection_mut(result: &mut InspectionResult) -> &mut Inspection {
    match &mut result.outcome {
        Outcome::Measured(inspection) => inspection,
        Outcome::Refused(refusal) => panic!("refused: {refusal}"),
    }
}

/// A pose that is neither the identity nor its own inverse.
pub fn pose() -> CadFromScan {
    CadFromScan::new(Isometry3::new(Vector3::new(12.5, -3.25, 500.0), Vector3::new(0.3, -0.2, 1.1)))
}

type Row = (&'static str, &'static str, [f64; 3], Option<f64>, f64, f64, Verdict, usize);

const ROWS: &[Row] = &[
    ("P01", "surface", [-60.0, 30.0, 5.416], Some(-0.120), 0.5, 0.019, Verdict::Pass, 387),
    ("P02", "surface", [-60.0, -34.0, 1.664], Some(-0.438), 0.5, 0.024, Verdict::Pass, 419),
    ("P03", "surface", [-2.0, -40.0, 2.59], Some(-0.490), 0.5, 0.017, Verdict::Undecided, 431),
    ("P05", "surface", [40.0, 14.0, 2.517], Some(-0.404), 0.5, 0.023, Verdict::Pass, 442),
    ("P08", "surface", [-40.0, -66.0, 1.004], Some(-0.579), 0.5, 0.023, Verdict::Fail, 444),
    ("P09", "surface", [84.0, 30.0, 0.314], Some(0.336), 0.5, 0.018, Verdict::Pass, 418),
    ("E02", "edge", [109.0, -6.0, -1.7], Some(-0.523), 0.7, 0.049, Verdict::Pass, 167),
    ("E03", "edge", [-34.0, -92.0, 7.7], Some(-0.958), 0.7, 0.054, Verdict::Fail, 150),
    ("E05", "edge", [-107.8, 10.0, -0.2], None, 0.7, 0.0, Verdict::NotMeasured, 11),
    ("C01", "hole", [14.0, 70.0, 7.421], Some(-0.041), 0.3, 0.031, Verdict::Pass, 228),
    ("C04", "hole", [97.3, 18.0, -1.9], Some(-0.320), 0.3, 0.029, Verdict::Undecided, 248),
];

fn point(row: &Row) -> PointResult {
    let &(name, kind, at, deviation, limit, uncertainty, verdict, points_used) = row;
    let nominal = Point3::from(at);
    let direction = if kind == "surface" { Vector3::z() } else { Vector3::new(0.6, 0.8, 0.0) };
    PointResult {
        name: name.to_owned(),
        kind,
        nominal,
        direction,
        lower_mm: -limit,
        upper_mm: limit,
        verdict,
        reason: deviation.is_none().then(|| "too few points: sheet cannot be told from the belt".to_owned()),
        points_used,
        card: Card::default(),
        measurement: deviation.map(|deviation_mm| Measurement {
            measured: nominal + direction * deviation_mm,
            deviation_mm,
            uncertainty_mm: uncertainty,
            budget: Budget { fit_mm: 0.3 * uncertainty, pose_mm: 0.4 * uncertainty, ..Budget::default() },
            rms_mm: 0.05,
            hole: (kind == "hole").then(|| HoleMeasurement {
                position_mm: 2.0 * deviation_mm.abs(),
                delta_mm: direction * deviation_mm,
                diameter_mm: 20.031,
                diameter_deviation_mm: 0.031,
            }),
        }),
    }
}

/// A feature of the bracket; sizes are measured and nominal.
fn feature(
    name: &str,
    kind: &'static str,
    fixes: &str,
    centre: [f64; 3],
    size: Option<(f64, f64)>,
    length: Option<(f64, f64)>,
) -> MeasuredFeature {
    MeasuredFeature {
        name: name.to_owned(),
        kind,
        fixes: fixes.to_owned(),
        centre: Point3::from(centre),
        axis: Vector3::z(),
        direction: (kind == "slot").then(Vector3::x),
        diameter_mm: size.map(|s| s.0),
        nominal_diameter_mm: size.map(|s| s.1),
        length_mm: length.map(|l| l.0),
        nominal_length_mm: length.map(|l| l.1),
        points_used: 212,
        rms_mm: 0.061,
        warning: None,
    }
}

fn identity() -> Identity {
    Identity {
        part_name: "Bracket RH".into(),
        part_number: "4711-02".into(),
        part_revision: "C".into(),
        plan_file: "bracket_rh.toml".into(),
        plan_sha256: "64879f7d6b960a01909762d911a32d4582c20010c5641ee90278b644a9e3b525".into(),
        cad_file: "bracket.stl".into(),
        cad_sha256: "2afe5e26e9c8cbec2eab056f3b79013cbef3b4b38f5cc51a84a64103ecb720ad".into(),
        cad_triangles: 184_212,
        scan_file: "0017.ply".into(),
        scan_sha256: Some("59ad1b2fc74287ded1bba7af67765d23ad4a49f1ae51902cc2ed3f8ebee96cfa".into()),
        scan_taken: None,
    }
}

fn best_fit() -> BestFit {
    BestFit {
        cad_from_scan: pose(),
        side: Some(Side::Top),
        face: Side::Top,
        rms_mm: 0.112,
        inlier_ratio: 0.97,
        margin: 4.2,
        margin_limit: 1.5,
        poses_tried: 48,
        uncertainty: PoseUncertainty::none(Point3::origin()),
        converged: true,
        unfinished_mm: 0.0,
        open_face: None,
    }
}

fn alignment() -> FeatureAlignment {
    let features = vec![
        feature("H1", "hole", "three translations", [-76.0, 56.0, 5.23], Some((16.031, 16.0)), None),
        feature("S1", "slot", "two rotations", [72.0, -54.0, 0.257], Some((9.027, 9.0)), Some((30.044, 30.0))),
        feature("A1", "surface", "one rotation", [10.0, 44.0, 4.269], None, None),
    ];
    let (method, cad_from_scan) = ("features", pose());
    FeatureAlignment {
        method,
        cad_from_scan,
        degraded: None,
        missing: Vec::new(),
        hold: Some(DatumHold { condition: 12.5, weak: None, residuals: Vec::new() }),
        features,
    }
}

/// A failed bracket with every verdict and every kind in it.
pub fn bracket() -> InspectionResult {
    let (points_read, points_kept) = (2_000_000, 1_313_042);
    let removed = Removed { invalid: 0, duplicate: 0, belt: 600_000, colour: 0, dark: 86_958, stray: 0, other: 0 };
    let statistics = MapStatistics {
        points: points_kept,
        mean_mm: -0.061,
        rms_mm: 0.309,
        p05_mm: -0.571,
        p95_mm: 0.417,
        within_range_ratio: 0.9996,
        past_edge: 1204,
        far: 17,
    };
    InspectionResult {
        identity: identity(),
        counts: CloudCounts { points_read: Some(points_read), points_kept: Some(points_kept), removed: Some(removed) },
        outcome: Outcome::Measured(Box::new(Inspection {
            points_read,
            points_kept,
            removed,
            verdict: Verdict::Fail,
            best_fit: best_fit(),
            alignment: alignment(),
            points: ROWS.iter().map(point).collect(),
            map: DeviationMap { statistics, ..DeviationMap::default() },
            warnings: Vec::new(),
        })),
        map_range_mm: 1.0,
        method: AlignmentMethod::Features { hole: 0, slot: 1, slot_reading: SlotReading::CentreLine, point: 2 },
    }
}

/// The same part with every point in tolerance.
pub fn pass() -> InspectionResult {
    let mut result = bracket();
    let inspection = inspection_mut(&mut result);
    inspection.verdict = Verdict::Pass;
    for p in &mut inspection.points {
        p.verdict = Verdict::Pass;
        p.reason = None;
        let template = point(&ROWS[0]).measurement;
        p.measurement = p.measurement.take().or(template);
        if let Some(m) = &mut p.measurement {
            m.deviation_mm *= 0.3;
        }
    }
    result
}

/// The same part with a datum that could not be measured.
pub fn degraded() -> InspectionResult {
    let mut result = bracket();
    let inspection = inspection_mut(&mut result);
    inspection.verdict = Verdict::NotMeasured;
    inspection.alignment.method = "best_fit";
    inspection.alignment.degraded = Some("datum S1 not measured: 9 points on the rim, 40 are needed".into());
    inspection.alignment.missing = vec!["S1".into()];
    inspection.alignment.features.remove(1);
    inspection.warnings.push("the belt is in view in less than a tenth of the picture".into());
    for p in &mut inspection.points {
        p.verdict = Verdict::NotMeasured;
        p.reason = Some("datum S1 not measured".into());
        p.measurement = None;
    }
    result
}

/// A scan that could not be measured.
pub fn refused() -> InspectionResult {
    let mut result = bracket();
    result.identity.scan_sha256 = None;
    result.counts = CloudCounts::default();
    result.outcome = Outcome::Refused(Refusal::new(
        "the scan is cut off after 1,204,331 of 2,000,000 points",
        "copy it again; the sequence goes on",
    ));
    result
}

/// Half extents of the test sheet, mm.
const DOME: [f64; 2] = [120.0, 70.0];

/// A point of the test sheet: a shallow dome with a flange bent down at its right end and a round hole in its middle.
pub fn dome_point(x: f64, y: f64) -> Point3 {
    let dome = 18.0 * (1.0 - (x / DOME[0]).powi(2)) * (1.0 - (y / DOME[1]).powi(2));
    let bead = 3.0 * (-((y - 30.0) / 8.0).powi(2)).exp();
    Point3::new(x, y, dome + bead - 1.2 * (x - 100.0).max(0.0))
}

/// The test sheet as a mesh of `n` by `n` cells, normals up.
pub fn dome(n: usize) -> Mesh {
    let coordinate = |k: usize, half: f64| half * (2.0 * k as f64 / n as f64 - 1.0);
    let vertices = (0..=n)
        .flat_map(|j| (0..=n).map(move |i| dome_point(coordinate(i, DOME[0]), coordinate(j, DOME[1]))))
        .collect();
    let mut mesh = Mesh { vertices, triangles: Vec::new() };
    for j in 0..n {
        for i in 0..n {
            let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            let middle = mesh.vertices[a as usize] + 0.5 * (mesh.vertices[c as usize] - mesh.vertices[a as usize]);
            if middle.x.hypot(middle.y) > 14.0 {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

/// About `n` points on the test sheet in an irregular but fixed pattern, with their deviations.
pub fn dome_cloud(n: usize, deviation_mm: impl Fn(&Point3) -> f64) -> (Vec<Point3>, Vec<f32>) {
    // An additive recurrence with the plastic number fills the square evenly.
    let place = |k: usize, step: f64, half: f64| half * (2.0 * (0.5 + step * k as f64).fract() - 1.0);
    (0..n)
        .map(|k| dome_point(place(k, 0.754_877_666, DOME[0]), place(k, 0.569_840_291, DOME[1])))
        .filter(|p| p.x.hypot(p.y) > 14.0)
        .map(|p| (p, deviation_mm(&p) as f32))
        .unzip()
}

/// Distance between neighbouring points of `n` on the test sheet, mm.
pub fn dome_spacing(n: usize) -> f64 {
    (4.0 * DOME[0] * DOME[1] / n as f64).sqrt()
}

/// The result with a map of these points (CAD frame), and the scan in which they were measured.
pub fn with_map(
    mut result: InspectionResult,
    points_cad: &[Point3],
    deviations_mm: Vec<f32>,
    spacing_mm: f64,
) -> (InspectionResult, ConditionedScan) {
    let inspection = inspection_mut(&mut result);
    let scan_from_cad = inspection.alignment.cad_from_scan.scan_from_cad();
    inspection.map.indices = (0..points_cad.len() as u32).collect();
    inspection.map.deviations_mm = deviations_mm;
    inspection.map.statistics.points = points_cad.len();
    let positions: Vec<Point3> = points_cad.iter().map(|p| scan_from_cad * p).collect();
    let scan = ConditionedScan {
        classes: vec![PointClass::Kept; positions.len()],
        kept: (0..positions.len() as u32).collect(),
        cloud: PointCloud { positions, ..PointCloud::default() },
        removed: Removed::default(),
        belt: None,
        belt_clearance_mm: None,
        to_camera: None,
        spacing_mm,
        warnings: Vec::new(),
    };
    (result, scan)
}

/// The test sheet as a prepared part.
pub fn dome_part(n: usize) -> Part {
    let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
    Part::prepare(dome(n), "0".repeat(64), &settings, &RunContext::silent()).unwrap()
}
