//! What `check --expected` says of the alignment, against what simulated scans of perfect parts show: by hole, slot and surface point, by
//! more locked points than are needed, by the best fit and by regions of it.
//!
//! `SHAPELINE_ACCURACY_SCANS=N` looks at N scans instead of a few and prints the figures.

use crate::region_fit::regions;
use crate::support::{identity, inspect_scan, prepared};
use shapeline::geometry::{CadFromScan, UnitVector3, Vector3};
use shapeline::inspect::{Outcome, Outlook};
use shapeline::part::Part;
use shapeline::plan::{AlignmentMethod, Feature, Geometry, Plan, RpsLock, Side};
use shapeline::run::RunContext;
use shapeline::simulate::{BracketParameters, PoseChoice, RigModel, Subject, bracket, simulate_scan};

/// The plan held by its hole and slot and by five surface points, each locked along its normal: eight locks.
pub fn by_locks(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    let AlignmentMethod::Features { hole, slot, .. } = plan.alignment else { panic!("the bracket has datums") };
    let place = |k: usize| plan.features[k].geometry.position();
    let along = UnitVector3::new_normalize(place(slot) - place(hole));
    let across = UnitVector3::new_normalize(plan.features[hole].geometry.sheet_normal().cross(&along));
    let mut locks = vec![
        RpsLock { feature: hole, lock: along },
        RpsLock { feature: hole, lock: across },
        RpsLock { feature: slot, lock: across },
    ];
    let surfaces: Vec<Feature> = plan
        .comparison
        .iter()
        .filter(|point| matches!(point.geometry, Geometry::Surface { .. }))
        .take(5)
        .map(|point| Feature { name: format!("D{}", point.name), geometry: point.geometry.clone(), line: 1 })
        .collect();
    for feature in surfaces {
        let Geometry::Surface { direction, .. } = feature.geometry else { continue };
        locks.push(RpsLock { feature: plan.features.len(), lock: direction });
        plan.features.push(feature);
    }
    Plan { alignment: AlignmentMethod::Rps(locks), ..plan }
}

/// Direction in which a comparison point is told, if it has one.
fn direction(geometry: &Geometry) -> Option<Vector3> {
    match geometry {
        Geometry::Surface { direction, .. } | Geometry::Edge { direction, .. } => Some(direction.into_inner()),
        Geometry::Hole { direction, .. } => direction.map(UnitVector3::into_inner),
        Geometry::Slot { .. } => None,
    }
}

/// Errors of the pose at the comparison points of a scan, each over what was foretold (standard deviations).
fn ratios(
    what: &str,
    plan: &Plan,
    part: &Part,
    cloud: shapeline::geometry::PointCloud,
    truth: &CadFromScan,
) -> Vec<f64> {
    let outlook = Outlook { part: Some(part), ..Outlook::of(plan) };
    let foretold = outlook.pose_errors_mm().expect("the part is held");
    let inspected = inspect_scan(plan, part, cloud, identity());
    let Outcome::Measured(inspection) = &inspected.result.outcome else { panic!("refused") };
    assert_eq!(inspection.alignment.degraded, None, "{what}");
    let off = inspection.alignment.cad_from_scan.isometry() * truth.isometry().inverse();
    let at = |(point, foretold): (&shapeline::plan::ComparisonPoint, &f64)| {
        let place = point.geometry.position();
        Some((off * place - place).dot(&direction(&point.geometry)?) / foretold)
    };
    plan.comparison.iter().zip(&foretold).filter_map(at).collect()
}

/// A scan's ratios are made of six errors, a few of which make most of them, so that four scans are some twelve values: their rms is
/// known to 20 %. Three times that, and the quarter by which the formulas miss: a factor of two. Of 20 scans and more 1.5.
#[test]
fn the_alignment_errs_as_is_foretold_whatever_holds_the_part() {
    let count = std::env::var("SHAPELINE_ACCURACY_SCANS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default() };
    let mut by_features = subject.plan.clone();
    by_features.scans.view_direction = Some(rig.view_direction);
    let by_fit = Plan { alignment: AlignmentMethod::BestFit, ..by_features.clone() };
    let by_regions = Plan { alignment: AlignmentMethod::Regions(regions()), ..by_features.clone() };
    let plans = [
        ("features", by_features.clone()),
        ("rps", by_locks(&by_features)),
        ("best_fit", by_fit),
        ("regions", by_regions),
    ];
    let mut found = [const { Vec::new() }; 4];
    for seed in 8100..8100 + count {
        let side = if seed % 2 == 0 { Side::Top } else { Side::Bottom };
        let pose = PoseChoice::side(&subject, side);
        let simulated = simulate_scan(&subject, &rig, &pose, seed, &RunContext::silent()).expect("not cancelled");
        let truth = simulated.truth.pose().expect("a pose");
        for ((name, plan), found) in plans.iter().zip(&mut found) {
            found.extend(ratios(&format!("{name} {seed}"), plan, &part, simulated.cloud.clone(), &truth));
        }
    }
    let factor = if count < 20 { 2.0 } else { 1.5 };
    for ((name, _), ratios) in plans.iter().zip(&found) {
        let rms = (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt();
        println!("{name}: errors of the pose over those foretold {rms:.2}, {count} scans");
        assert!((1.0 / factor..factor).contains(&rms), "{name}: {rms}");
    }
}

/// U of every comparison point as foretold and as told by scans of a perfect part, from either side, flanges included. A scan's own
/// estimates scatter much: where the middle of a window stands off by chance U is twice as large, and a datum's carries to all points. So
/// the median over points is asked to be right within a quarter, that of each point over six scans within a factor of 2.5 (2.1 was met, at
/// an edge the shape of which changes within its window).
#[test]
fn what_a_scan_tells_of_its_uncertainty_was_foretold() {
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default() };
    let mut plan = subject.plan.clone();
    plan.scans.view_direction = Some(rig.view_direction);
    let foretold = Outlook { part: Some(&part), ..Outlook::of(&plan) }.expected().expect("the part is held");
    let mut told = vec![Vec::new(); plan.comparison.len()];
    for seed in 8201..8207 {
        let side = if seed % 2 == 0 { Side::Top } else { Side::Bottom };
        let pose = PoseChoice::side(&subject, side);
        let simulated = simulate_scan(&subject, &rig, &pose, seed, &RunContext::silent()).expect("not cancelled");
        let inspected = inspect_scan(&plan, &part, simulated.cloud, identity());
        let Outcome::Measured(inspection) = &inspected.result.outcome else { panic!("refused") };
        for (point, told) in inspection.points.iter().zip(&mut told) {
            told.extend(point.measurement.as_ref().map(|m| m.uncertainty_mm));
        }
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let mut ratios = Vec::new();
    for ((point, told), foretold) in plan.comparison.iter().zip(&mut told).zip(&foretold) {
        assert!(told.len() >= 4, "{} is measured in most scans", point.name);
        let (told, name) = (median(told), &point.name);
        println!("{name}: U told {told:.3} (median), foretold {:.3}", foretold.u_mm);
        assert!((0.4..2.5).contains(&(told / foretold.u_mm)), "{name}: {told} {foretold:?}");
        ratios.push(told / foretold.u_mm);
    }
    let of_all = median(&mut ratios);
    println!("median of told over foretold: {of_all:.2}");
    assert!((0.8..1.25).contains(&of_all), "{of_all}");
}
