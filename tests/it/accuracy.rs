//! The whole way from a cloud to the comparison points, against the exact truth of simulated scans.
//!
//! Demands (simulated rig: 0.05 mm noise in the plane, 0.12 mm in depth, a fifth of its variance correlated over 0.5 mm,
//! 20 % dropout, sharp rims, `slot_reading = "centre_line"`), 95 % quantiles of |error| after the plan's alignment:
//! 26 points/mm²: surface 0.05 mm, trimmed edge 0.12 mm, hole centre 0.06 mm. 1.3 points/mm²: 0.12, 0.35, 0.20 mm, at most
//! 15 % not measured.
//!
//! `SHAPELINE_ACCURACY_SCANS=N` looks at N scans a case instead of a few and prints the figures.

use crate::support::{identity, inspect_scan};
use shapeline::geometry::Vector3;
use shapeline::inspect::{Inspection, Outcome};
use shapeline::measure::{self, Local};
use shapeline::part::Part;
use shapeline::plan::{Geometry, Plan, Side};
use shapeline::run::RunContext;
use shapeline::scan::{ConditionedScan, PointGrid};
use shapeline::simulate::{
    BracketParameters, Displacement, DisplacementField, PoseChoice, RigModel, ScanTruth, Subject, bracket,
    draw_springback, simulate_scan,
};
use std::collections::BTreeMap;

/// Errors by kind, and how many points there were and were not measured.
#[derive(Default)]
struct Errors {
    by_kind: BTreeMap<String, Vec<f64>>,
    points: usize,
    not_measured: usize,
    /// Of each kind, those that U covers, and all that were measured.
    covered: BTreeMap<String, [usize; 2]>,
    worst: BTreeMap<String, (f64, String)>,
    /// Signed error and stated uncertainty (k = 2) of each point, in mm.
    by_point: BTreeMap<String, Vec<[f64; 2]>>,
}

impl Errors {
    fn add(&mut self, inspection: &Inspection, truth: &ScanTruth) {
        for (point, exact) in inspection.points.iter().zip(&truth.points) {
            let exact = exact.aligned.as_ref().expect("the simulated part has every feature");
            self.points += 1;
            let Some(measured) = &point.measurement else {
                self.not_measured += 1;
                continue;
            };
            let failed: Vec<_> = point.card.gates.iter().filter(|g| !g.passed()).collect();
            assert!(failed.is_empty() && point.card.window_mm.is_some(), "{}: {:?}", point.name, point.card);
            let signed = measured.deviation_mm - exact.deviation_mm;
            self.by_point
                .entry(format!("{} {}", point.name, truth.side))
                .or_default()
                .push([signed, measured.uncertainty_mm]);
            let error = signed.abs();
            self.count(point.kind, error <= measured.uncertainty_mm);
            // Of a hole the whole distance in the sheet counts, whether or not the plan names a direction.
            let strict = match (&measured.hole, exact.delta_mm) {
                (Some(hole), Some(delta)) => (hole.delta_mm - Vector3::from(delta)).norm(),
                _ => error,
            };
            self.by_kind.entry(point.kind.into()).or_default().push(strict);
            let worst = self.worst.entry(point.kind.into()).or_default();
            if strict > worst.0 {
                *worst = (strict, point.name.clone());
            }
        }
    }

    fn count(&mut self, kind: &str, is_covered: bool) {
        let [covered, all] = self.covered.entry(kind.to_owned()).or_default();
        *covered += usize::from(is_covered);
        *all += 1;
    }

    /// U (k = 2) covers 95 % of each kind: not fewer than one in a thousand tries would have it, of so many values.
    fn assert_covered(&self) {
        for (kind, &[covered, all]) in &self.covered {
            let least = least_covered(all);
            assert!(covered >= least, "{kind}: U covers {covered} of {all}, at least {least} were expected");
        }
    }

    fn p95(&self, kind: &str) -> f64 {
        let mut sorted = self.by_kind.get(kind).cloned().unwrap_or_default();
        sorted.sort_by(f64::total_cmp);
        // Nearest rank.
        let rank = (sorted.len() as f64 * 0.95).ceil() as usize;
        rank.checked_sub(1).and_then(|k| sorted.get(k)).copied().unwrap_or(f64::INFINITY)
    }

    /// Mean and standard deviation of the signed errors of the points whose names begin so, mm.
    fn of_points(&self, begin: &str) -> (f64, f64) {
        let of: Vec<f64> = self
            .by_point
            .iter()
            .filter(|(name, _)| name.starts_with(begin))
            .flat_map(|(_, v)| v)
            .map(|v| v[0])
            .collect();
        let mean = of.iter().sum::<f64>() / of.len() as f64;
        (mean, (of.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / of.len() as f64).sqrt())
    }

    fn tell(&self, case: &str) {
        println!(
            "{case}: p95 surface {:.4}, edge {:.4}, hole {:.4} mm; {} of {} not measured; U covers {:.1} %; worst {:?}",
            self.p95("surface"),
            self.p95("edge"),
            self.p95("hole"),
            self.not_measured,
            self.points,
            100.0 * self.covered.values().map(|c| c[0]).sum::<usize>() as f64
                / (self.points - self.not_measured).max(1) as f64,
            self.worst
        );
        println!("covered of each kind {:?}", self.covered);
        if std::env::var_os("SHAPELINE_ACCURACY_SCANS").is_some() {
            self.tell_points();
        }
    }

    fn tell_points(&self) {
        println!("point  values  bias      spread   largest  U (k = 2), root mean square");
        for (name, values) in &self.by_point {
            let n = values.len() as f64;
            let bias = values.iter().map(|v| v[0]).sum::<f64>() / n;
            let spread = (values.iter().map(|v| (v[0] - bias).powi(2)).sum::<f64>() / n).sqrt();
            let largest = values.iter().map(|v| v[0].abs()).fold(0.0, f64::max);
            let stated = (values.iter().map(|v| v[1] * v[1]).sum::<f64>() / n).sqrt();
            println!("{name:6} {:6}  {bias:+.4}  {spread:.4}  {largest:.4}  {stated:.4}", values.len());
        }
    }
}

/// The least number of `n` values that U covers, if it covers 95 % of all, but for one try in a thousand (binomial).
fn least_covered(n: usize) -> usize {
    const COVERED: f64 = 0.95;
    // From all of them downwards.
    let mut chance = COVERED.powi(n as i32);
    let mut sum = chance;
    let mut least = n;
    while sum <= 1.0 - 1e-3 && least > 0 {
        chance *= (1.0 - COVERED) / COVERED * least as f64 / (n - least + 1) as f64;
        sum += chance;
        least -= 1;
    }
    least
}

#[test]
fn the_least_number_covered_is_the_binomials() {
    // P(X <= 14) = 0.0003 and P(X <= 15) = 0.0026 of Bin(20, 0.95); P(X <= 88) = 0.0040, P(X <= 87) = 0.0015 and P(X <= 86) = 0.0005 of
    // Bin(100, 0.95).
    assert_eq!((least_covered(20), least_covered(100), least_covered(1)), (15, 87, 0));
}

fn scans(usual: u64) -> u64 {
    std::env::var("SHAPELINE_ACCURACY_SCANS").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

/// Errors of the comparison points in the pose that the simulator used, without any alignment.
fn in_true_pose(plan: &Plan, part: &Part, scan: &ConditionedScan, truth: &ScanTruth, errors: &mut Errors) {
    let side = if truth.side == "top" { Side::Top } else { Side::Bottom };
    let grid = PointGrid::build(scan, 1.0);
    let cad_from_scan = truth.pose().expect("a motion");
    let local = Local { part, face: part.face(side), scan, grid: &grid, cad_from_scan, uncertainty: &plan.uncertainty };
    for (point, exact) in plan.comparison.iter().zip(&truth.points) {
        let exact = exact.in_true_pose.as_ref().expect("the simulated part has every feature");
        let found = match &point.geometry {
            Geometry::Surface { position, direction } => measure::surface(&local, position, direction, 3.0)
                .map(|f| (f.deviation_mm - exact.deviation_mm, f.standard_uncertainty_mm)),
            Geometry::Edge { position, direction, normal } => measure::edge(&local, position, direction, normal, 3.0)
                .map(|f| (f.deviation_mm - exact.deviation_mm, f.standard_uncertainty_mm)),
            Geometry::Hole { centre, axis, diameter_mm, .. } => measure::hole(&local, centre, axis, *diameter_mm, 3.0)
                .map(|f| {
                    let shift = f.centre - centre;
                    let delta = shift - axis.into_inner() * shift.dot(axis);
                    ((delta - Vector3::from(exact.delta_mm.expect("a hole"))).norm(), f.u_centre_mm)
                }),
            Geometry::Slot { .. } => unreachable!("no comparison point is a slot"),
        };
        errors.points += 1;
        match found {
            Ok((error, u)) => {
                errors.count(point.geometry.kind(), error.abs() <= 2.0 * u);
                errors.by_kind.entry(point.geometry.kind().into()).or_default().push(error.abs());
                errors.by_point.entry(format!("{} {}", point.name, truth.side)).or_default().push([error, 2.0 * u]);
            }
            Err(not) => {
                println!("{} {} not measured: {not}", truth.seed, point.name);
                errors.not_measured += 1;
            }
        }
    }
}

/// Perfect and deformed parts in turn, top and bottom in turn.
fn errors_at(rig: &RigModel, count: u64, seed: u64) -> Errors {
    let nominal = bracket(&BracketParameters::default());
    let plan = nominal.plan();
    let part: Part = crate::support::prepared(&nominal);
    let bounds = nominal.mesh.bounds().expect("a bracket");
    let mut errors = Errors::default();
    let mut unaligned = Errors::default();
    for k in 0..count {
        let seed = seed + k;
        let field = if k % 4 < 2 { DisplacementField::none() } else { draw_springback(seed, 0.4, &bounds) };
        let subject = Subject::synthetic(&nominal, &nominal, field);
        let side = if k % 2 == 0 { Side::Top } else { Side::Bottom };
        let pose = PoseChoice::side(&subject, side);
        let simulated = simulate_scan(&subject, rig, &pose, seed, &RunContext::silent()).expect("not cancelled");
        let mut plan = plan.clone();
        plan.scans.view_direction = Some(rig.view_direction);
        let inspected = inspect_scan(&plan, &part, simulated.cloud, identity());
        match &inspected.result.outcome {
            Outcome::Measured(inspection) => {
                assert_eq!(inspection.best_fit.side, Some(side), "seed {seed}");
                assert_eq!(inspection.alignment.degraded, None, "seed {seed}");
                errors.add(inspection, &simulated.truth);
                let scan = inspected.scan.as_ref().expect("a measured scan");
                in_true_pose(&plan, &part, scan, &simulated.truth, &mut unaligned);
            }
            Outcome::Refused(refusal) => panic!("seed {seed} refused: {refusal}"),
        }
    }
    unaligned.tell("in the true pose");
    errors
}

fn rig(density_per_mm2: f64) -> RigModel {
    RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default().with_density(density_per_mm2) }
}

#[test]
fn at_the_papers_density_points_are_found_to_hundredths() {
    let errors = errors_at(&rig(26.0), scans(4), 4100);
    errors.tell("26 points/mm²");
    errors.assert_covered();
    assert!(errors.p95("surface") < 0.05);
    assert!(errors.p95("edge") < 0.12);
    assert!(errors.p95("hole") < 0.06);
    assert_eq!(errors.not_measured, 0);
}

/// Where the optical edge of a rounded rim lies is a matter of calibration (`edge_offset_mm`), so that edges and diameters are off by
/// much the same everywhere; what counts is that they repeat. Each kind's mean is taken out.
#[test]
fn rims_rounded_by_three_tenths_are_found_again() {
    let rounded = RigModel { rim_rounding_mm: 0.3, ..rig(26.0) };
    let errors = errors_at(&rounded, scans(4), 6100);
    errors.tell("26 points/mm², rims rounded by 0.3 mm");
    let (edge_bias, edge_sd) = errors.of_points("E");
    let (_, hole_sd) = errors.of_points("C");
    println!("edges {edge_bias:+.4} ± {edge_sd:.4} mm, hole centres ± {hole_sd:.4} mm along their directions");
    assert_eq!(errors.not_measured, 0);
    assert!(errors.p95("surface") < 0.05);
    // Asked for later: 0.08 and 0.05 mm.
    assert!(edge_sd < 0.08 && hole_sd < 0.05, "{edge_sd} {hole_sd}");
}

/// A dent of 0.8 mm and sigma 5 mm under every surface point: next to a quadratic over 5 mm its middle is told 0.017 mm too shallow
/// (`0.8 mm R⁴ / 48 sigma⁴`), and the spread of 0.015 mm comes on top: 95 % within 0.017 + 2 x 0.015 mm, and some chance of 30
/// values. U does not know of this: it covers about 60 % here instead of 95 %.
#[test]
fn narrow_dents_are_told_to_hundredths() {
    let nominal = bracket(&BracketParameters { spacing_mm: 1.0, ..BracketParameters::default() });
    let plan = nominal.plan();
    let part: Part = crate::support::prepared(&nominal);
    let dents = plan.comparison.iter().filter_map(|point| match &point.geometry {
        Geometry::Surface { position, direction } => {
            Some(Displacement::Dent { centre: *position, displacement: direction.into_inner() * -0.8, sigma_mm: 5.0 })
        }
        _ => None,
    });
    let field = DisplacementField(dents.collect());
    let subject = Subject::synthetic(&nominal, &nominal, field);
    let mut errors = Errors::default();
    for (seed, side) in [(7100, Side::Top), (7101, Side::Bottom)] {
        let pose = PoseChoice::side(&subject, side);
        let simulated = simulate_scan(&subject, &rig(26.0), &pose, seed, &RunContext::silent()).expect("not cancelled");
        let mut plan = plan.clone();
        plan.comparison.retain(|point| matches!(point.geometry, Geometry::Surface { .. }));
        let mut truth = simulated.truth.clone();
        truth.points.retain(|point| point.kind == "surface");
        let inspected = inspect_scan(&plan, &part, simulated.cloud, identity());
        in_true_pose(&plan, &part, inspected.scan.as_ref().expect("a measured scan"), &truth, &mut errors);
    }
    errors.tell("dents, in the true pose");
    let (mean_mm, _) = errors.of_points("P");
    // Three standard errors of 30 values with that spread: 0.008 mm.
    assert!((mean_mm - 0.017).abs() < 0.009, "{mean_mm}");
    assert!(errors.p95("surface") < 0.06);
    assert_eq!((errors.points, errors.not_measured), (30, 0));
}

#[test]
fn at_a_twentieth_of_the_density_it_still_measures() {
    let errors = errors_at(&rig(1.3), scans(8), 5100);
    errors.tell("1.3 points/mm²");
    errors.assert_covered();
    assert!(errors.p95("surface") < 0.12);
    assert!(errors.p95("edge") < 0.35);
    assert!(errors.p95("hole") < 0.20);
    assert!((errors.not_measured as f64) <= 0.15 * errors.points as f64);
}
