//! The best fit to chosen regions on simulated scans: a deformed part is held by what is not deformed, frozen freedoms stay, weights
//! count, and a region without points judges nothing.
//!
//! `SHAPELINE_ACCURACY_SCANS=N` looks at N scans instead of a few and prints the figures.

use crate::support::{conditioned, identity, inspect_scan, prepared};
use shapeline::align::{AlignmentInput, BestFit, FeatureAlignment, PoseUncertainty, align_on_plan, best_fit};
use shapeline::geometry::{CadFromScan, Isometry3, Point3, Vector3};
use shapeline::inspect::Outcome;
use shapeline::part::Part;
use shapeline::plan::{AlignmentMethod, FitRegion, Freedom, Plan, RegionFit, RegionShape, Side};
use shapeline::run::RunContext;
use shapeline::scan::{ConditionedScan, PointGrid};
use shapeline::simulate::{
    BracketParameters, Displacement, DisplacementField, PoseChoice, RigModel, SimulatedScan, Subject, bracket,
    simulate_scan,
};

/// Places on the right half of the bracket: crown, base, and the right and front flanges, which hold it in its plane.
const REGIONS: [(&str, [f64; 3], f64); 6] = [
    ("crown", [45.0, 52.0, 2.3], 12.0),
    ("middle", [40.0, 5.0, 3.7], 15.0),
    ("corner", [75.0, -40.0, 1.1], 12.0),
    ("far corner", [65.0, 45.0, 1.5], 12.0),
    ("right flange", [93.4, 40.3, -7.4], 8.0),
    ("front flange", [10.0, -89.3, 7.9], 8.0),
];

/// A fit to them, all alike.
pub fn regions() -> RegionFit {
    let region = |(name, centre, radius_mm): (&str, [f64; 3], f64)| FitRegion {
        name: name.to_owned(),
        centre: Point3::from(centre),
        shape: RegionShape::Ball { radius_mm },
        weight: 1.0,
        line: 1,
    };
    RegionFit { regions: REGIONS.map(region).into(), freeze: Vec::new() }
}

fn rig() -> RigModel {
    RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default().with_density(6.5) }
}

/// A part, its plan, and scans of it.
struct Bench {
    part: Part,
    subject: Subject,
}

/// A scan in its best fit.
struct Fitted {
    scan: ConditionedScan,
    grid: PointGrid,
    best_fit: BestFit,
    truth: CadFromScan,
}

impl Bench {
    fn new(displacements: Vec<Displacement>) -> Self {
        let nominal = bracket(&BracketParameters::default());
        let subject = Subject::synthetic(&nominal, &nominal, DisplacementField(displacements));
        Self { part: prepared(&nominal), subject }
    }

    fn simulated(&self, seed: u64) -> SimulatedScan {
        let side = if seed.is_multiple_of(2) { Side::Top } else { Side::Bottom };
        let pose = PoseChoice::side(&self.subject, side);
        simulate_scan(&self.subject, &rig(), &pose, seed, &RunContext::silent()).expect("not cancelled")
    }

    fn fitted(&self, seed: u64) -> Fitted {
        let simulated = self.simulated(seed);
        let truth = simulated.truth.pose().expect("a pose");
        let scan = conditioned(simulated, &rig());
        let best_fit = best_fit(&self.part, &scan, &RunContext::silent()).expect("a pose");
        Fitted { grid: PointGrid::build(&scan, 2.0), scan, best_fit, truth }
    }

    fn plan(&self, fit: RegionFit) -> Plan {
        let mut plan = self.subject.plan.clone();
        plan.scans.view_direction = Some(rig().view_direction);
        plan.alignment = AlignmentMethod::Regions(fit);
        plan
    }

    fn align(&self, fitted: &Fitted, fit: RegionFit) -> (FeatureAlignment, PoseUncertainty) {
        let plan = self.plan(fit);
        let input = AlignmentInput { plan: &plan, part: &self.part, scan: &fitted.scan, grid: &fitted.grid };
        align_on_plan(&input, &fitted.best_fit, &RunContext::silent()).expect("nobody cancels")
    }
}

/// From the true pose to another, CAD frame.
fn off(pose: &CadFromScan, truth: &CadFromScan) -> Isometry3 {
    pose.isometry() * truth.isometry().inverse()
}

/// Places near the regions and far from them.
const PLACES: [[f64; 3]; 4] = [[90.0, 80.0, 0.0], [90.0, -70.0, 0.0], [-100.0, 60.0, 0.0], [10.0, -90.0, 8.0]];

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The left half lifts, 2 mm at 100 mm left of the middle: the whole best fit gives way to it, the regions do not. One motion, the turn in
/// the plane, makes most of the errors of a scan: four values with standard deviation 1 have an rms below 0.15 or above 2.15 once in a
/// thousand (chi squared); of twenty and more it is known to a sixth, of which twice are allowed.
#[test]
fn a_deformed_part_is_held_by_its_regions_as_well_as_they_say() {
    let count = std::env::var("SHAPELINE_ACCURACY_SCANS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let bench = Bench::new(vec![Displacement::Springback {
        line: Point3::origin(),
        towards: -Vector3::x_axis(),
        up: Vector3::z_axis(),
        at_100_mm: 2.0,
    }]);
    let (mut ratios, mut errors, mut whole) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 9100..9100 + count {
        let fitted = bench.fitted(seed);
        let (alignment, known) = bench.align(&fitted, regions());
        assert_eq!(alignment.degraded, None);
        let points: Vec<usize> = alignment.features.iter().map(|feature| feature.points_used).collect();
        assert!(points.iter().all(|count| *count > 200), "{points:?}");
        let motion = off(&alignment.cad_from_scan, &fitted.truth);
        let by_fit = off(&fitted.best_fit.cad_from_scan, &fitted.truth);
        for place in PLACES.map(Point3::from) {
            for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                let error = (motion * place - place).dot(&axis);
                errors.push(error);
                ratios.push(error / known.at(&place, &axis));
            }
            whole.push((by_fit * place - place).norm());
        }
    }
    let (error, ratio, whole) = (rms(&errors), rms(&ratios), rms(&whole));
    println!(
        "{count} scans: errors {error:.4} mm an axis, error/u {ratio:.2}; the whole best fit is {whole:.3} mm off"
    );
    let allowed = if count < 20 { 0.15..2.15 } else { 2.0 / 3.0..4.0 / 3.0 };
    assert!(allowed.contains(&ratio), "error/u {ratio}");
    assert!(whole > 0.1 && error < 0.25 * whole, "{error} of {whole}");
}

/// What is frozen stays as the whole best fit has it, to the rounding of a motion at 150 mm; the rest is free.
#[test]
fn frozen_freedoms_stay_as_the_best_fit_has_them() {
    let bench = Bench::new(vec![Displacement::Dent {
        centre: Point3::new(75.0, -40.0, 1.0),
        displacement: Vector3::new(0.0, 0.0, 0.5),
        sigma_mm: 25.0,
    }]);
    let fitted = bench.fitted(9202);
    let fit = RegionFit { freeze: vec![Freedom::X, Freedom::Z, Freedom::Rx], ..regions() };
    let middle = fit.middle();
    let (frozen, with_frozen) = bench.align(&fitted, fit);
    let (free, with_free) = bench.align(&fitted, regions());
    assert_eq!((frozen.degraded, free.degraded), (None, None));
    let numbers = |pose: &CadFromScan| {
        let motion = off(pose, &fitted.best_fit.cad_from_scan);
        let (shift, turn) = (motion * middle - middle, motion.rotation.scaled_axis());
        [shift.x, shift.y, shift.z, 100.0 * turn.x, 100.0 * turn.y, 100.0 * turn.z]
    };
    let (kept, moved) = (numbers(&frozen.cad_from_scan), numbers(&free.cad_from_scan));
    for k in 0..6 {
        let is_frozen = [0, 2, 3].contains(&k);
        assert_eq!(kept[k].abs() < 1e-9, is_frozen, "{k}: {kept:?}");
        assert!(moved[k].abs() > 1e-6, "{k}: {moved:?}");
    }
    // Frozen, the pose owes its heights to the whole best fit.
    let at = |known: &PoseUncertainty| known.at(&middle, &Vector3::z());
    let whole = fitted.best_fit.uncertainty.at(&middle, &Vector3::z());
    assert!((at(&with_frozen) / whole - 1.0).abs() < 0.05, "{} {whole}", at(&with_frozen));
    assert!(at(&with_free) > 0.0);
}

/// A corner that is dented by 0.6 mm as a whole: alone among equals it gives way, with a thousand times their weight it is met, to what
/// the dent's own form in it (0.05 mm) leaves between middle and mean.
#[test]
fn regions_count_by_their_weights() {
    let bench = Bench::new(vec![Displacement::Dent {
        centre: Point3::new(75.0, -40.0, 1.0),
        displacement: Vector3::new(0.0, 0.0, 0.6),
        sigma_mm: 30.0,
    }]);
    let fitted = bench.fitted(9302);
    let left = |weight: f64| {
        let mut fit = regions();
        fit.regions[2].weight = weight;
        let (alignment, _) = bench.align(&fitted, fit);
        assert_eq!(alignment.degraded, None);
        let feature = &alignment.features[2];
        assert_eq!((feature.name.as_str(), feature.kind), ("corner", "region"));
        (feature.centre - Point3::from(REGIONS[2].1)).norm()
    };
    let (equal, heavy) = (left(1.0), left(1000.0));
    assert!(equal > 0.03 && heavy < 0.3 * equal, "{equal} {heavy}");
}

/// Nobody saw the right flange: it is named, and nothing is judged in the best fit that remains.
#[test]
fn a_region_without_points_is_named_and_judges_nothing() {
    let bench = Bench::new(Vec::new());
    let simulated = bench.simulated(9402);
    let (truth, mut cloud) = (simulated.truth.pose().expect("a pose"), simulated.cloud);
    let seen = |p: &Point3| (truth.isometry() * p - Point3::from(REGIONS[4].1)).norm() > 12.0;
    let kept: Vec<usize> = (0..cloud.len()).filter(|&k| seen(&cloud.positions[k])).collect();
    cloud.positions = kept.iter().map(|&k| cloud.positions[k]).collect();
    cloud.colours = cloud.colours.map(|colours| kept.iter().map(|&k| colours[k]).collect());
    cloud.normals = cloud.normals.map(|normals| kept.iter().map(|&k| normals[k]).collect());
    cloud.scalars.clear();
    let plan = bench.plan(regions());
    let Outcome::Measured(inspection) = inspect_scan(&plan, &bench.part, cloud, identity()).result.outcome else {
        panic!("refused")
    };
    let alignment = &inspection.alignment;
    assert_eq!(alignment.missing, ["right flange"]);
    let reason = alignment.degraded.as_ref().expect("degraded");
    assert!(reason.starts_with("datum right flange not measured: 0 points"), "{reason}");
    assert_eq!(alignment.cad_from_scan, inspection.best_fit.cad_from_scan);
    let told = |p: &shapeline::inspect::PointResult| p.reason.as_deref() == Some("datum right flange not measured");
    assert!(inspection.points.iter().all(|p| p.measurement.is_none() && told(p)));
}
