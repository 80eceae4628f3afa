//! Errors that everything in a scan has in common: the same scan inspected with a thickness, and at a scale, that is off by one standard
//! uncertainty. Every comparison point must change by what its uncertainty counts of it, whatever holds the part.
//!
//! The change is compared with the share as told, to first order, of noisy points: both inspections see the same points, of which a few come
//! and go at the rims of the windows, so that single values move by a part of their own scatter. A third of that is allowed, besides
//! a tenth of the share for what is not linear, and 3 µm. A best fit sees the face but for what hides, which moves the part by
//! a tenth of the error more.

use crate::foretold::by_locks;
use crate::region_fit::regions;
use crate::support::{identity, inspect_scan, prepared};
use shapeline::geometry::PointCloud;
use shapeline::inspect::{Budget, Inspection, Outcome, Outlook};
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{AlignmentMethod, CadSide, Geometry, Plan, Side, UncertaintySettings};
use shapeline::run::RunContext;
use shapeline::simulate::{BracketParameters, PoseChoice, RigModel, Subject, bracket, simulate_scan};

/// Standard uncertainties stated, and the errors that are made.
const THICKNESS_MM: f64 = 0.1;
const SCALE_PPM: f64 = 1000.0;

fn inspected(plan: &Plan, part: &Part, cloud: PointCloud) -> Inspection {
    let Outcome::Measured(inspection) = inspect_scan(plan, part, cloud, identity()).result.outcome else {
        panic!("refused")
    };
    assert_eq!(inspection.alignment.degraded, None);
    *inspection
}

/// How the part is held, each with what the best fit's view of the face adds to the limits, as a share of the error.
fn ways(plan: &Plan) -> [(&'static str, Plan, f64); 4] {
    let fit = Plan { alignment: AlignmentMethod::BestFit, ..plan.clone() };
    let by_regions = Plan { alignment: AlignmentMethod::Regions(regions()), ..plan.clone() };
    [
        ("features", plan.clone(), 0.0),
        ("rps", by_locks(plan), 0.0),
        ("best_fit", fit, 0.1),
        ("regions", by_regions, 0.1),
    ]
}

/// Each point's change against what was told of it.
fn compare(what: &str, [before, after]: [&Inspection; 2], told: impl Fn(&Budget) -> f64, more_mm: f64) -> Vec<String> {
    let mut faults = Vec::new();
    for (before, after) in before.points.iter().zip(&after.points) {
        let (Some(a), Some(b)) = (&before.measurement, &after.measurement) else { continue };
        let (told_mm, change_mm) = (told(&a.budget), (b.deviation_mm - a.deviation_mm).abs());
        let limit_mm = 0.003 + 0.1 * told_mm + a.budget.fit_mm / 3.0 + more_mm;
        println!("{what} {}: told {told_mm:.4}, changed {change_mm:.4}, limit {limit_mm:.4}", before.name);
        // A distance in the sheet is told with its worst direction where it is short: then it changes by less.
        let too_little = change_mm > told_mm + limit_mm;
        let too_much = told_mm > change_mm + limit_mm && before.direction.norm() > 0.5;
        if too_little || too_much {
            faults.push(format!("{what} {}: told {told_mm:.4} mm, changed {change_mm:.4} mm", before.name));
        }
    }
    faults
}

#[test]
fn points_change_with_thickness_and_scale_as_their_uncertainty_says() {
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let thicker_mm = nominal.thickness_mm + THICKNESS_MM;
    let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: thicker_mm, plan_directions: Vec::new() };
    let thicker =
        Part::prepare(nominal.mesh.clone(), "0".repeat(64), &settings, &RunContext::silent()).expect("a sound part");
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { belt_margin_mm: 20.0, ..RigModel::default() };
    let mut plan = subject.plan.clone();
    plan.scans.view_direction = Some(rig.view_direction);
    plan.uncertainty =
        UncertaintySettings { thickness_mm: THICKNESS_MM, scale_ppm: SCALE_PPM, ..UncertaintySettings::default() };
    let reach_mm = 0.5 * part.diagonal_mm() * SCALE_PPM * 1e-6;
    let (mut faults, mut looked_at) = (Vec::new(), 0);
    let mut most_told: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; plan.comparison.len()]);
    // Scans in which no datum's own window switches: that would move every point.
    for (side, seed) in [(Side::Top, 31), (Side::Bottom, 34)] {
        let pose = PoseChoice::side(&subject, side);
        let cloud = simulate_scan(&subject, &rig, &pose, seed, &RunContext::silent()).expect("not cancelled").cloud;
        let mut grown = cloud.clone();
        grown.positions.iter_mut().for_each(|p| *p *= 1.0 + SCALE_PPM * 1e-6);
        for ((way, plan, view), most_told) in ways(&plan).into_iter().zip(&mut most_told) {
            let as_it_is = inspected(&plan, &part, cloud.clone());
            let at_scale = inspected(&plan, &part, grown.clone());
            looked_at += 2 * as_it_is.points.len();
            for (most, point) in most_told.iter_mut().zip(&as_it_is.points) {
                let told = point.measurement.as_ref().map_or(0.0, |m| m.budget.thickness_mm.hypot(m.budget.scale_mm));
                *most = f64::max(*most, 2.0 * told);
            }
            let what = format!("{way} {side:?} scale");
            faults.extend(compare(&what, [&as_it_is, &at_scale], |b| b.scale_mm, view * reach_mm));
            let mut told_thicker = plan.clone();
            told_thicker.part.thickness_mm = thicker_mm;
            let at_thickness = match side {
                Side::Top => as_it_is.clone(),
                Side::Bottom => inspected(&told_thicker, &thicker, cloud.clone()),
            };
            let what = format!("{way} {side:?} thickness");
            faults.extend(compare(&what, [&as_it_is, &at_thickness], |b| b.thickness_mm, view * THICKNESS_MM));
        }
    }
    for ((way, plan, view), told) in ways(&plan).into_iter().zip(&most_told) {
        let foretold = Outlook { part: Some(&part), ..Outlook::of(&plan) }.expected().expect("the part is held");
        for ((point, foretold), told) in plan.comparison.iter().zip(foretold).zip(told) {
            println!("{way} {}: foretold {:.4}, told {told:.4}", point.name, foretold.common_mm);
            // The same formulas, at nominal places instead of measured ones (0.1 mm of 100 mm), the whole face instead of what was seen; more
            // locks than are needed weigh by the scatter of the scan, not by that to expect. A distance is told with its worst direction
            // where it is short: that may be more, by the square root of two.
            let share = if way == "rps" { 0.1 } else { 2.0 * view };
            let limit_mm = 0.003 + 0.05 * told + share * reach_mm.hypot(THICKNESS_MM);
            let is_distance = matches!(point.geometry, Geometry::Hole { direction: None, .. });
            let most_mm = if is_distance { std::f64::consts::SQRT_2 * told } else { *told };
            assert!(foretold.common_mm < most_mm + limit_mm, "{way} {}", point.name);
            assert!(foretold.common_mm > told / if is_distance { 2.0 } else { 1.0 } - limit_mm, "{way} {}", point.name);
        }
    }
    // Where the size of a window switches its value moves by more than a standard deviation: one in 20 may.
    assert!(20 * faults.len() <= looked_at, "{}", faults.join("\n"));
}

/// A point that locks the part is where it is told to be, whatever was measured there: nothing of U is left in the locked direction but what
/// the rounds left open.
#[test]
fn a_point_that_locks_the_part_exactly_owes_nothing_along_its_lock() {
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { belt_margin_mm: 20.0, ..RigModel::default() };
    let mut plan = by_locks(&subject.plan);
    plan.scans.view_direction = Some(rig.view_direction);
    plan.uncertainty.system_mm = 0.05;
    let AlignmentMethod::Rps(locks) = &mut plan.alignment else { panic!("rps") };
    // Three of hole and slot, three surface points.
    locks.truncate(6);
    let locked: Vec<usize> = locks[3..].iter().map(|lock| lock.feature).collect();
    let pose = PoseChoice::side(&subject, Side::Top);
    let cloud = simulate_scan(&subject, &rig, &pose, 33, &RunContext::silent()).expect("not cancelled").cloud;
    let inspection = inspected(&plan, &part, cloud);
    let (mut exact, mut others) = (0, 0);
    for point in &inspection.points {
        let Some(found) = &point.measurement else { continue };
        let is_datum = locked.iter().any(|&k| match &plan.features[k].geometry {
            Geometry::Surface { position, .. } => (position - point.nominal).norm() < 1e-9,
            _ => false,
        });
        if is_datum {
            exact += 1;
            // Second order of a shift of 0.05 mm over 100 mm is 25 nm. What is left is what the rounds left open, which U tells: single
            // points that come and go, or windows that switch their size, a few hundredths.
            assert!(found.deviation_mm.abs() <= found.uncertainty_mm + 1e-3, "{}: {}", point.name, found.deviation_mm);
            assert!(found.uncertainty_mm < 0.09, "{}: U {}", point.name, found.uncertainty_mm);
        } else {
            others += 1;
            // The system's own share alone is 0.1 mm.
            assert!(found.uncertainty_mm > 0.1, "{}: U {}", point.name, found.uncertainty_mm);
        }
    }
    assert!(exact == 3 && others > 10, "{exact} {others}");
}
