//! The best fit as the alignment: its pose is as uncertain as it says, and the stated U of surface points covers their errors.
//!
//! `SHAPELINE_ACCURACY_SCANS=N` looks at N scans instead of a few and prints the figures.

use crate::support::{identity, inspect_scan, prepared};
use shapeline::geometry::{CadFromScan, Point3, Vector3};
use shapeline::inspect::Outcome;
use shapeline::plan::{AlignmentMethod, Side};
use shapeline::run::RunContext;
use shapeline::simulate::{
    BracketParameters, PoseChoice, RigModel, Subject, SyntheticPart, bracket, rail, simulate_scan,
};

/// What came out over some scans of a perfect part: ratios of error to standard uncertainty.
struct Figures {
    /// Of three far corners of the part along three axes.
    pose: Vec<f64>,
    /// Largest standard uncertainty of those, mm.
    largest_u_mm: f64,
    /// Of the surface points.
    points: Vec<f64>,
}

fn figures(nominal: &SyntheticPart, usual: u64) -> Figures {
    let count = std::env::var("SHAPELINE_ACCURACY_SCANS").ok().and_then(|n| n.parse().ok()).unwrap_or(usual);
    let part = prepared(nominal);
    let mut subject = Subject::perfect(nominal);
    subject.plan.alignment = AlignmentMethod::BestFit;
    let rig = RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default().with_density(6.5) };
    let mut plan = subject.plan.clone();
    plan.scans.view_direction = Some(rig.view_direction);
    let bounds = nominal.mesh.bounds().expect("a part");
    let mut figures = Figures { pose: Vec::new(), largest_u_mm: 0.0, points: Vec::new() };
    for seed in 7100..7100 + count {
        let side = if seed % 2 == 0 { Side::Top } else { Side::Bottom };
        let pose = PoseChoice::side(&subject, side);
        let simulated = simulate_scan(&subject, &rig, &pose, seed, &RunContext::silent()).expect("not cancelled");
        let truth = CadFromScan::try_from_row_major(&simulated.truth.cad_from_scan).expect("a pose");
        let inspected = inspect_scan(&plan, &part, simulated.cloud, identity());
        let Outcome::Measured(inspection) = &inspected.result.outcome else { panic!("seed {seed} refused") };
        let fit = &inspection.best_fit;
        let off = fit.cad_from_scan.isometry() * truth.isometry().inverse();
        for corner in [bounds.min, bounds.max, Point3::new(bounds.min.x, bounds.max.y, bounds.min.z)] {
            for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                let u = fit.uncertainty.at(&corner, &axis);
                figures.largest_u_mm = figures.largest_u_mm.max(u);
                figures.pose.push((off * corner - corner).dot(&axis) / u);
            }
        }
        for (point, exact) in inspection.points.iter().zip(&simulated.truth.points) {
            let exact = exact.in_true_pose.as_ref().map(|exact| exact.deviation_mm);
            if let (Some(found), Some(exact), "surface") = (&point.measurement, exact, point.kind) {
                figures.points.push(2.0 * (found.deviation_mm - exact) / found.uncertainty_mm);
            }
        }
    }
    println!(
        "{}: pose error/u {:.2}, u up to {:.4} mm; surface points error/u {:.2}, {:.0} % covered by 2 u",
        nominal.name,
        rms(&figures.pose),
        figures.largest_u_mm,
        rms(&figures.points),
        100.0 * covered(&figures.points)
    );
    figures
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn covered(ratios: &[f64]) -> f64 {
    ratios.iter().filter(|r| r.abs() <= 2.0).count() as f64 / ratios.len().max(1) as f64
}

#[test]
fn a_bracket_errs_as_the_best_fit_says() {
    let found = figures(&bracket(&BracketParameters::default()), 6);
    // Six motions a scan make the nine values, so that six scans are 36: their rms is known to 1/sqrt(72) = 12 %. Three times
    // that, and as much again since a few motions make most of the values.
    assert!((0.4..1.6).contains(&rms(&found.pose)), "pose error/u {}", rms(&found.pose));
    assert!(found.largest_u_mm > 0.002, "a pose from noisy points is not certain");
    // 95 % of them are meant to be: three standard deviations of 90 values below that.
    assert!(covered(&found.points) >= 0.88, "{} covered", covered(&found.points));
}

/// Its surface lets it slide: only its rims hold it. Being on the safe side is allowed there.
#[test]
fn a_rail_held_by_its_rims_errs_no_more_than_the_best_fit_says() {
    let found = figures(&rail(), 4);
    assert!(rms(&found.pose) < 1.6, "pose error/u {}", rms(&found.pose));
    assert!(found.largest_u_mm < 1.0, "rims hold it to a fraction of a mm, not to {}", found.largest_u_mm);
}

/// A stray 30 m away, and one point in fifty written as -9999 in every coordinate, are neither a wrong unit nor a part.
#[test]
fn points_far_outside_leave_the_scan_measured() {
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default().with_density(2.6) };
    let mut plan = subject.plan.clone();
    plan.scans.view_direction = Some(rig.view_direction);
    let pose = PoseChoice::side(&subject, Side::Top);
    let cloud = simulate_scan(&subject, &rig, &pose, 7300, &RunContext::silent()).expect("not cancelled").cloud;
    for case in ["one stray", "one in fifty"] {
        let mut cloud = cloud.clone();
        match case {
            "one stray" => cloud.positions[1000] = Point3::new(-30_000.0, 0.0, 0.0),
            _ => cloud.positions.iter_mut().step_by(50).for_each(|p| *p = Point3::new(-9999.0, -9999.0, -9999.0)),
        }
        let inspected = inspect_scan(&plan, &part, cloud, identity());
        match &inspected.result.outcome {
            Outcome::Measured(inspection) => {
                assert_eq!(inspection.alignment.degraded, None, "case {case}");
                assert!(inspection.points.iter().all(|p| p.measurement.is_some()), "case {case}");
            }
            Outcome::Refused(refusal) => panic!("case {case}: {refusal}"),
        }
    }
}
