//! The same points somewhere else, or in another order, tell the same: values are of the part, not of where the cameras stand nor of
//! how a file is sorted.
//!
//! Demanded are 0.001 mm of noisy scans, and 1e-6 mm of exact points in f64; nine in ten values of a noisy scan meet that.

use crate::support::{identity, inspect_scan, prepared};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use shapeline::geometry::{Isometry3, PointCloud, UnitVector3, Vector3};
use shapeline::inspect::{Inspection, Outcome, PointResult};
use shapeline::plan::{Plan, Side};
use shapeline::run::RunContext;
use shapeline::simulate::{
    BracketParameters, PoseChoice, RigModel, Subject, SyntheticPart, bracket, draw_springback, simulate_scan,
};

/// Far from any axis, and away by metres.
fn motion() -> Isometry3 {
    Isometry3::new(Vector3::new(812.0, -455.0, 1270.0), Vector3::new(0.7, -1.1, 0.4))
}

fn moved(cloud: &PointCloud) -> PointCloud {
    let mut moved = cloud.clone();
    moved.positions.iter_mut().for_each(|p| *p = motion() * *p);
    moved
}

/// Every other attribute goes with its point.
fn shuffled(cloud: &PointCloud) -> PointCloud {
    let mut order: Vec<usize> = (0..cloud.positions.len()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(77));
    let colours = cloud.colours.as_ref().map(|colours| order.iter().map(|&k| colours[k]).collect());
    PointCloud { positions: order.iter().map(|&k| cloud.positions[k]).collect(), colours, ..PointCloud::default() }
}

fn inspected(nominal: &SyntheticPart, cloud: PointCloud, view: UnitVector3) -> Inspection {
    let mut plan: Plan = nominal.plan();
    plan.scans.view_direction = Some(view);
    match inspect_scan(&plan, &prepared(nominal), cloud, identity()).result.outcome {
        Outcome::Measured(inspection) => *inspection,
        Outcome::Refused(refusal) => panic!("{refusal}"),
    }
}

/// How much each value differs, mm, the largest first; both must have the same values.
fn differences(a: &Inspection, b: &Inspection) -> Vec<f64> {
    let of = |(p, q): (&PointResult, &PointResult)| {
        assert_eq!(p.measurement.is_some(), q.measurement.is_some(), "{}: {:?} {:?}", p.name, p.reason, q.reason);
        let [x, y] = [p, q].map(|r| r.measurement.as_ref().map_or(0.0, |m| m.deviation_mm));
        (x - y).abs()
    };
    let mut all: Vec<f64> = a.points.iter().zip(&b.points).map(of).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}

#[test]
fn a_noisy_scan_tells_the_same_wherever_it_lies_and_however_it_is_sorted() {
    let nominal = bracket(&BracketParameters::default());
    let bounds = nominal.mesh.bounds().expect("a bracket");
    let rig = RigModel { belt_margin_mm: 20.0, ..RigModel::default() };
    for (side, seed) in [(Side::Top, 51), (Side::Bottom, 52)] {
        let subject = Subject::synthetic(&nominal, &nominal, draw_springback(seed, 0.4, &bounds));
        let pose = PoseChoice::side(&subject, side);
        let cloud = simulate_scan(&subject, &rig, &pose, seed, &RunContext::silent()).expect("not cancelled").cloud;
        let view = rig.view_direction;
        let here = inspected(&nominal, cloud.clone(), view);
        let there = inspected(&nominal, moved(&cloud), UnitVector3::new_normalize(motion() * view.into_inner()));
        let sorted = inspected(&nominal, shuffled(&cloud), view);
        for (what, other) in [("moved", &there), ("shuffled", &sorted)] {
            let all = differences(&here, other);
            println!("{side:?} {what}: {all:.5?}");
            // What is stray, and the points that tell the spacing, depend on raster and order. The windows follow the spacing: where a gate
            // of one is just met its value steps, by a tenth of U at most.
            assert!(all[all.len() / 10 + 1] < 1e-3 && all[0] < 0.01, "{side:?} {what}: {all:?}");
        }
    }
}

/// Points that lie exactly on the sheet, no belt: what is left is arithmetic.
#[test]
fn exact_points_tell_the_same_to_a_nanometre_wherever_they_lie() {
    let nominal = bracket(&BracketParameters::default());
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { belt_margin_mm: 20.0, ..RigModel::perfect(2.6) };
    let pose = PoseChoice::side(&subject, Side::Top);
    let cloud = simulate_scan(&subject, &rig, &pose, 53, &RunContext::silent()).expect("not cancelled").cloud;
    let view = rig.view_direction;
    let here = inspected(&nominal, cloud.clone(), view);
    let there = inspected(&nominal, moved(&cloud), UnitVector3::new_normalize(motion() * view.into_inner()));
    let all = differences(&here, &there);
    assert!(all[0] < 1e-6, "{all:?}");
}
