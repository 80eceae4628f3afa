//! More than one part in view: the press makes left and right at once, the next part comes along, a tool lies on the belt.

use crate::support::{identity, inspect_scan, prepared};
use shapeline::geometry::{Mesh, Point3, Vector3};
use shapeline::inspect::{Inspected, Inspection, Outcome};
use shapeline::plan::{Plan, Side};
use shapeline::run::RunContext;
use shapeline::scan::PointClass;
use shapeline::simulate::{
    BracketParameters, InView, Label, Neighbour, PoseChoice, RigModel, SimulatedScan, Subject, SyntheticPart, bracket,
    simulate_scene,
};

/// Coarse enough to be quick, fine enough for a gap of 5 mm (7 spacings).
const DENSITY_PER_MM2: f64 = 2.0;

fn rig() -> RigModel {
    RigModel { belt_margin_mm: 25.0, ..RigModel::default().with_density(DENSITY_PER_MM2) }
}

fn nominal() -> SyntheticPart {
    bracket(&BracketParameters::default())
}

fn plan_of(part: &SyntheticPart) -> Plan {
    let mut plan = part.plan();
    plan.scans.view_direction = Some(rig().view_direction);
    plan
}

fn lying(subject: &Subject, side: Side) -> PoseChoice {
    PoseChoice { yaw_rad: Some(0.0), ..PoseChoice::side(subject, side) }
}

/// The bracket with something beside it.
fn scene(beside: &SyntheticPart, side: Side, gap_mm: f64, in_view: InView, rig: &RigModel, seed: u64) -> SimulatedScan {
    let (own, other) = (Subject::perfect(&nominal()), Subject::perfect(beside));
    let pose = lying(&own, side);
    let neighbour = Neighbour { subject: &other, pose: lying(&other, side), gap_mm };
    simulate_scene((&own, &pose), &[neighbour], in_view, rig, seed, &RunContext::silent()).unwrap()
}

fn inspected(part: &SyntheticPart, scan: &SimulatedScan) -> Inspected {
    inspect_scan(&plan_of(part), &prepared(part), scan.cloud.clone(), identity())
}

fn measured<'a>(inspected: &'a Inspected, case: &str) -> &'a Inspection {
    match &inspected.result.outcome {
        Outcome::Measured(inspection) => inspection,
        Outcome::Refused(refusal) => panic!("{case} refused: {refusal} / {}", refusal.help),
    }
}

fn refused(inspected: &Inspected, case: &str) -> String {
    match &inspected.result.outcome {
        Outcome::Measured(inspection) => panic!("{case} measured: {:?}", inspection.warnings),
        Outcome::Refused(refusal) => format!("{refusal} / {}", refusal.help),
    }
}

/// Pose and values are those of the bracket, and nothing of what lies beside it is kept.
fn check_is_the_bracket(scan: &SimulatedScan, inspected: &Inspected, case: &str) {
    let inspection = measured(inspected, case);
    let truth = scan.truth.pose().unwrap();
    let (angle, distance) = inspection.best_fit.cad_from_scan.difference(&truth, &Point3::origin());
    // A perfect part: the pose is a matter of hundredths, a wrong one of degrees.
    assert!(angle.to_degrees() < 0.2 && distance < 0.2, "{case}: {angle} {distance}");
    assert_eq!(inspection.alignment.degraded, None, "{case}");
    let mut covered = 0;
    for (point, exact) in inspection.points.iter().zip(&scan.truth.points) {
        let Some(found) = &point.measurement else { continue };
        let error = (found.deviation_mm - exact.aligned.unwrap().deviation_mm).abs();
        covered += usize::from(error <= found.uncertainty_mm);
        // Twice U: seven standard deviations with room for what a U at k = 2 leaves out.
        assert!(error < 2.0 * found.uncertainty_mm, "{case} {}: {error} of {}", point.name, found.uncertainty_mm);
    }
    // Of 26 points 95 % within U are 24.7 with a standard deviation of 1.1.
    assert!(covered >= 21, "{case}: {covered} within U");
    let scan_after = inspected.scan.as_ref().unwrap();
    let others = scan_after.kept.iter().filter(|&&k| scan.labels[k as usize] == Label::Other).count();
    assert_eq!(others, 0, "{case}: points of the other part were kept");
    assert!(inspection.best_fit.inlier_ratio > 0.98, "{case}: {}", inspection.best_fit.inlier_ratio);
    let other = scan_after.classes.iter().filter(|c| **c == PointClass::Other).count();
    assert_eq!(inspection.removed.other, other, "{case}");
    let part_lost = (0..scan.labels.len())
        .filter(|&k| scan.labels[k] == Label::Part && scan_after.classes[k] == PointClass::Other)
        .count();
    assert_eq!(part_lost, 0, "{case}: points of the part were taken for another's");
    assert_eq!(
        inspection.points_kept
            + inspection.removed.belt
            + inspection.removed.colour
            + inspection.removed.dark
            + inspection.removed.stray
            + other,
        scan.cloud.len(),
        "{case}: every point once"
    );
}

#[test]
fn the_plans_part_is_found_beside_its_twin_whichever_side_is_up() {
    let (part, twin) = (nominal(), nominal().mirrored());
    for (k, (side, gap_mm)) in
        [(Side::Top, 5.0), (Side::Bottom, 5.0), (Side::Top, 20.0), (Side::Bottom, 60.0)].into_iter().enumerate()
    {
        let case = format!("{side:?} {gap_mm} mm");
        let scan = scene(&twin, side, gap_mm, InView::Everything, &rig(), 70 + k as u64);
        let own = inspected(&part, &scan);
        check_is_the_bracket(&scan, &own, &case);
        let warnings = &measured(&own, &case).warnings;
        println!("{case}: {warnings:?}");
        assert!(warnings.iter().any(|w| w.contains("mirrored twin") && w.contains("cm² around")), "{warnings:?}");
        // The same scan by the twin's plan: the other one of the two.
        let other = inspected(&twin, &scan);
        let kept = &other.scan.as_ref().unwrap().kept;
        assert!(measured(&other, &case).alignment.degraded.is_none());
        assert!(kept.iter().all(|&k| scan.labels[k as usize] != Label::Part), "{case}");
    }
}

#[test]
fn the_plans_part_is_found_beside_its_twin_without_a_belt() {
    let twin = nominal().mirrored();
    let mut scan = scene(&twin, Side::Top, 8.0, InView::Everything, &rig(), 80);
    let keep: Vec<usize> = (0..scan.labels.len()).filter(|&k| scan.labels[k] != Label::Belt).collect();
    scan.cloud.positions = keep.iter().map(|&k| scan.cloud.positions[k]).collect();
    let colours = scan.cloud.colours.take().unwrap();
    scan.cloud.colours = Some(keep.iter().map(|&k| colours[k]).collect());
    scan.labels = keep.iter().map(|&k| scan.labels[k]).collect();
    let own = inspected(&nominal(), &scan);
    println!("{:?}", measured(&own, "no belt").warnings);
    check_is_the_bracket(&scan, &own, "no belt");
}

#[test]
fn two_equal_parts_are_refused_since_one_verdict_cannot_be_that_of_both() {
    let part = nominal();
    for (side, gap_mm) in [(Side::Top, 5.0), (Side::Bottom, 40.0)] {
        let scan = scene(&part, side, gap_mm, InView::Everything, &rig(), 90);
        let words = refused(&inspected(&part, &scan), "two equal");
        println!("{words}");
        assert!(words.contains("two parts of the plan's kind"), "{words}");
    }
}

/// A fifth of the next part is too little for a pose, two thirds of it have one: the whole part is inspected either way.
#[test]
fn the_next_part_cut_off_by_the_border_of_the_view_is_named_and_left_out() {
    let part = nominal();
    for (margin_mm, words) in [(60.0, "too little to be the part"), (140.0, "cut off by the border")] {
        let rig = RigModel { belt_margin_mm: margin_mm, ..rig() };
        let scan = scene(&part, Side::Top, 8.0, InView::ThePart, &rig, 95);
        let own = inspected(&part, &scan);
        let warnings = &measured(&own, words).warnings;
        println!("{warnings:?}");
        assert!(warnings.iter().any(|w| w.contains(words)), "{warnings:?}");
        check_is_the_bracket(&scan, &own, words);
    }
}

/// A block of 60 x 45 x 25 mm.
fn block() -> SyntheticPart {
    let corners = [(-30.0, -22.5), (30.0, -22.5), (30.0, 22.5), (-30.0, 22.5)];
    let level = |z: f64| corners.map(|(x, y)| Point3::new(x, y, z)).to_vec();
    SyntheticPart {
        name: "block".into(),
        mesh: Mesh { vertices: level(0.0), triangles: vec![[0, 1, 2], [0, 2, 3]] },
        lower: Mesh { vertices: level(-25.0), triangles: vec![[2, 1, 0], [3, 2, 0]] },
        thickness_mm: 25.0,
        features: Vec::new(),
        comparison: Vec::new(),
    }
}

#[test]
fn a_tool_in_view_is_named_and_left_out() {
    for (gap_mm, seed) in [(6.0, 100), (30.0, 101)] {
        let scan = scene(&block(), Side::Top, gap_mm, InView::Everything, &rig(), seed);
        let own = inspected(&nominal(), &scan);
        let warnings = &measured(&own, "tool").warnings;
        println!("{warnings:?}");
        assert!(warnings.iter().any(|w| w.contains("something else is in view")), "{warnings:?}");
        check_is_the_bracket(&scan, &own, "tool");
    }
}

#[test]
fn parts_that_touch_are_refused_with_what_to_do() {
    let twin = nominal().mirrored();
    let scan = scene(&twin, Side::Top, 0.2, InView::Everything, &rig(), 110);
    let words = refused(&inspected(&nominal(), &scan), "touching");
    println!("{words}");
    assert!(words.contains("touch or overlap") && words.contains("mm or more between parts"), "{words}");
}

/// Blots of 12 mm take a fifth of everything and cut tongues off both parts.
#[test]
fn blots_across_both_parts_do_not_mix_them_up() {
    let twin = nominal().mirrored();
    let rig = RigModel { missing_share: 0.2, missing_radius_mm: 12.0, ..rig() };
    let scan = scene(&twin, Side::Bottom, 10.0, InView::Everything, &rig, 120);
    let own = inspected(&nominal(), &scan);
    let inspection = measured(&own, "blots");
    let (angle, distance) =
        inspection.best_fit.cad_from_scan.difference(&scan.truth.pose().unwrap(), &Point3::origin());
    assert!(angle.to_degrees() < 0.3 && distance < 0.3, "{angle} {distance}");
    let kept = &own.scan.as_ref().unwrap().kept;
    assert!(kept.iter().all(|&k| scan.labels[k as usize] != Label::Other));
}

/// One part alone: everything is as if nobody had looked for another one.
#[test]
fn the_twin_alone_is_refused_and_a_moved_scan_gives_the_same_things() {
    let twin = nominal().mirrored();
    let subject = Subject::perfect(&twin);
    let pose = PoseChoice::side(&subject, Side::Top);
    let alone = simulate_scene((&subject, &pose), &[], InView::ThePart, &rig(), 130, &RunContext::silent()).unwrap();
    let words = refused(&inspected(&nominal(), &alone), "twin");
    assert!(words.contains("does not look like"), "{words}");
    // Left and right, shifted as a whole by what binary numbers hold exactly.
    let scan = scene(&twin, Side::Top, 10.0, InView::Everything, &rig(), 131);
    let mut moved = scan.clone();
    for p in &mut moved.cloud.positions {
        *p += Vector3::new(64.0, -128.0, 32.0);
    }
    let (a, b) = (inspected(&nominal(), &scan), inspected(&nominal(), &moved));
    let (a, b) = (measured(&a, "here"), measured(&b, "there"));
    assert_eq!(a.removed, b.removed);
    for (p, q) in a.points.iter().zip(&b.points) {
        let of = |r: &shapeline::inspect::PointResult| r.measurement.as_ref().map(|m| m.deviation_mm);
        match (of(p), of(q)) {
            // What is demanded of noisy scans under a rigid motion.
            (Some(x), Some(y)) => assert!((x - y).abs() < 0.001, "{}: {x} {y}", p.name),
            (x, y) => assert_eq!(x, y, "{}", p.name),
        }
    }
}
