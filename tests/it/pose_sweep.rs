//! Random poses of four parts, planted by the simulator: no wrong pose and no wrong side, and few refusals.
//!
//! `SHAPELINE_FULL_SWEEP=1` runs 200 poses a part and prints the table; the usual run takes a few of each.
//! `SHAPELINE_SWEEP_POSES` (how many), `SHAPELINE_SWEEP_SEED` (which one) and `SHAPELINE_SWEEP_DENSITY` (points a mm²) are for
//! looking closer.

#![allow(clippy::print_stdout, reason = "the table of the sweep is what it is run for")]

use crate::support::prepared;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Uniform};
use shapeline::align::{BestFit, best_fit};
use shapeline::diagnostic::Stop;
use shapeline::geometry::{CadFromScan, Isometry3, Point3, PointCloud, Vector3};
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{BackgroundSettings, CadSide, Side};
use shapeline::run::RunContext;
use shapeline::scan::{ConditionedScan, ScanHints, condition};
use shapeline::simulate::{
    BracketParameters, Displacement, Label, PoseChoice, RigModel, ScanTruth, Subject, SyntheticPart, bracket, cover,
    draw_springback, rail, simulate_scan, symmetric_plate,
};

/// A pose is wrong from here on; what lies between this and exact is fit noise and springback.
const WRONG_DEG: f64 = 2.0;
const WRONG_MM: f64 = 2.0;

fn poses() -> u64 {
    let asked = std::env::var("SHAPELINE_SWEEP_POSES").ok().and_then(|n| n.parse().ok());
    if std::env::var_os("SHAPELINE_FULL_SWEEP").is_some() { 200 } else { asked.unwrap_or(8) }
}

/// The conditions of one scan, drawn from its seed: either side, 0 to 30 % outliers, up to 20 % lost in blots of 3 to 18 mm.
fn scan(nominal: &SyntheticPart, part: &Part, seed: u64) -> (ConditionedScan, ScanTruth) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |low: f64, high: f64| Uniform::new(low, high).unwrap().sample(&mut rng);
    let dense = std::env::var("SHAPELINE_SWEEP_DENSITY").ok().and_then(|n| n.parse().ok());
    let bounds = nominal.mesh.bounds().unwrap();
    let field = draw_springback(seed, draw(0.0, 0.6), &bounds);
    let subject = Subject::synthetic(nominal, nominal, field);
    let rig = RigModel {
        outlier_share: draw(0.0, 0.3),
        missing_share: draw(0.0, 0.2),
        missing_radius_mm: draw(3.0, 18.0),
        belt_margin_mm: 25.0,
        ..RigModel::default().with_density(dense.unwrap_or(draw(1.5, 3.0)))
    };
    let side = if seed.is_multiple_of(2) { Side::Top } else { Side::Bottom };
    seen(&subject, &rig, side, part, seed)
}

/// A subject as the rig sees it, conditioned.
fn seen(subject: &Subject, rig: &RigModel, side: Side, part: &Part, seed: u64) -> (ConditionedScan, ScanTruth) {
    let pose = PoseChoice::side(subject, side);
    let simulated = simulate_scan(subject, rig, &pose, seed, &RunContext::silent()).unwrap();
    let extents = part.bounds.extents();
    let hints = ScanHints {
        view_direction: Some(rig.view_direction),
        part_extents_mm: [extents.x, extents.y, extents.z],
        part_area_mm2: part.mesh.area(),
        thickness_mm: part.thickness_mm,
    };
    let scan = condition(simulated.cloud, &BackgroundSettings::default(), &hints, &RunContext::silent()).unwrap();
    (scan, simulated.truth)
}

/// Angle in degrees and distance in mm from the truth, and whether the side is right.
fn error(part: &Part, found: &BestFit, truth: &ScanTruth) -> (f64, f64, bool) {
    let exact = CadFromScan::try_from_row_major(&truth.cad_from_scan).unwrap();
    let (angle, distance) = found.cad_from_scan.difference(&exact, &part.centroid);
    (angle.to_degrees(), distance, found.side.map(Side::key) == Some(truth.side.as_str()))
}

#[derive(Default)]
struct Tally {
    poses: usize,
    refused: usize,
    wrong_pose: usize,
    wrong_side: usize,
    least_margin: f64,
    largest_mm: f64,
}

fn sweep(name: &str, nominal: &SyntheticPart, allowed_refused: f64) -> Tally {
    let part = prepared(nominal);
    let mut tally = Tally { least_margin: f64::INFINITY, ..Tally::default() };
    let one = std::env::var("SHAPELINE_SWEEP_SEED").ok().and_then(|n| n.parse::<u64>().ok());
    let seeds = one.map_or(0..poses(), |s| s..s + 1);
    for seed in seeds {
        let (scan, truth) = scan(nominal, &part, seed);
        let found = best_fit(&part, &scan, &RunContext::silent());
        tally.poses += 1;
        match found {
            Ok(found) => {
                let (angle, distance, side_is_right) = error(&part, &found, &truth);
                let wrong = angle > WRONG_DEG || distance > WRONG_MM;
                tally.wrong_pose += usize::from(wrong);
                tally.wrong_side += usize::from(!side_is_right);
                tally.least_margin = tally.least_margin.min(found.margin);
                tally.largest_mm = tally.largest_mm.max(distance);
                if one.is_some() || wrong || !side_is_right || distance > 0.7 {
                    println!(
                        "{name} seed {seed}: {angle:.2} deg {distance:.2} mm side {side_is_right} margin {:.2} of {} poses",
                        found.margin, found.poses_tried
                    );
                }
            }
            Err(Stop::Refused(refusal)) => {
                println!("{name} seed {seed} ({}): refused: {}", truth.side, refusal.reason);
                tally.refused += 1;
            }
            Err(stop) => panic!("{stop}"),
        }
    }
    println!(
        "{name}: {} poses, refused {}, wrong poses {}, wrong sides {}, least margin {:.2}, largest distance {:.2} mm",
        tally.poses, tally.refused, tally.wrong_pose, tally.wrong_side, tally.least_margin, tally.largest_mm
    );
    assert_eq!((tally.wrong_pose, tally.wrong_side), (0, 0), "{name}");
    // One refusal is no rate when few poses are tried.
    assert!(tally.refused as f64 <= (allowed_refused * tally.poses as f64).max(1.0), "{name}: {}", tally.refused);
    tally
}

#[test]
fn poses_of_the_bracket() {
    sweep("bracket", &bracket(&BracketParameters::default()), 0.01);
}

#[test]
fn poses_of_the_brackets_twin() {
    sweep("twin", &bracket(&BracketParameters::default()).mirrored(), 0.01);
}

#[test]
fn poses_of_the_rail() {
    sweep("rail", &rail(), 0.05);
}

#[test]
fn poses_of_the_cover() {
    sweep("cover", &cover(), 0.05);
}

fn refusal(part: &Part, scan: &ConditionedScan) -> String {
    match best_fit(part, scan, &RunContext::silent()) {
        Err(Stop::Refused(refusal)) => format!("{refusal} / {}", refusal.help),
        Ok(found) => format!("found with margin {}", found.margin),
        Err(stop) => panic!("{stop}"),
    }
}

#[test]
fn the_mirrored_twin_is_refused() {
    let nominal = bracket(&BracketParameters::default());
    let (own, twin) = (prepared(&nominal), nominal.mirrored());
    for seed in 0..poses() / 2 {
        let (scan, _) = scan(&twin, &own, 500 + seed);
        let words = refusal(&own, &scan);
        println!("{words}");
        assert!(words.contains("does not look like") || words.contains("alike"), "seed {seed}: {words}");
    }
}

#[test]
fn a_symmetric_plate_is_refused() {
    let nominal = symmetric_plate();
    let part = prepared(&nominal);
    for seed in 0..4 {
        let (scan, _) = scan(&nominal, &part, 600 + seed);
        let Err(Stop::Refused(refusal)) = best_fit(&part, &scan, &RunContext::silent()) else { panic!("seed {seed}") };
        assert!(refusal.reason.contains("alike") && refusal.reason.contains("margin"), "seed {seed}: {refusal}");
        let rivals = refusal.rivals.expect("two poses are the reason");
        assert!(rivals.margin < rivals.margin_limit, "seed {seed}: {rivals:?}");
        // Distinct poses are over 5 degrees or 5 mm apart.
        let (angle, distance_mm) = rivals.apart.expect("both poses are known");
        assert!(angle > 5.0_f64.to_radians() || distance_mm > 5.0, "seed {seed}: {rivals:?}");
    }
}

#[test]
fn a_piece_of_a_part_is_refused() {
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let (mut scan, _) = scan(&nominal, &part, 700);
    // 3 % of the points, all in one place.
    let at = scan.cloud.positions[scan.kept[scan.kept.len() / 2] as usize];
    let distance = |k: &u32| (scan.cloud.positions[*k as usize] - at).norm();
    scan.kept.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    scan.kept.truncate(scan.kept.len() * 3 / 100);
    scan.kept.sort_unstable();
    let words = refusal(&part, &scan);
    assert!(words.contains("too small") || words.contains("too little"), "{words}");
}

/// Parts far out of tolerance, at all densities, are measured and not refused: that is what the program is for.
#[test]
fn a_part_out_of_tolerance_is_not_refused() {
    let nominal = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
    let part = prepared(&nominal);
    let bounds = nominal.mesh.bounds().unwrap();
    for (k, density) in [1.3, 2.6, 6.0, 26.0].into_iter().enumerate() {
        let s = if k % 2 == 0 { 1.0 } else { -1.0 };
        let actual = bracket(&BracketParameters {
            spacing_mm: 4.0,
            shifts: vec![("H1", 1.4 * s, 1.4), ("C01", -2.0, 0.0), ("C03", 0.0, 2.0 * s)],
            diameter_changes: vec![("C02", 1.0 * s)],
            trims: vec![("E01", -1.5), ("E02", 1.5 * s), ("E04", 1.0)],
            flange_angles_rad: [0.02, -0.03 * s, 0.02],
        });
        let mut field = draw_springback(40 + k as u64, 1.5, &bounds);
        let dent = Displacement::Dent {
            centre: Point3::new(20.0, 10.0, 5.0),
            displacement: Vector3::new(0.0, 0.0, -s),
            sigma_mm: 8.0,
        };
        field.0.push(dent);
        let subject = Subject::synthetic(&nominal, &actual, field);
        let side = if k < 2 { Side::Top } else { Side::Bottom };
        let rig = RigModel { outlier_share: 0.02, missing_share: 0.05, ..RigModel::default().with_density(density) };
        let (scan, truth) = seen(&subject, &rig, side, &part, 800 + k as u64);
        let found = best_fit(&part, &scan, &RunContext::silent()).unwrap_or_else(|stop| panic!("{density}: {stop}"));
        let (angle, distance, side_is_right) = error(&part, &found, &truth);
        // The best fit of a bent part lies anywhere within its springback.
        assert!(angle < 2.0 && distance < 2.0 && side_is_right, "{density}: {angle} {distance}");
    }
}

/// The part's points alone, in any orientation: nobody saw a belt.
fn without_belt(
    nominal: &SyntheticPart,
    part: &Part,
    seed: u64,
    knows_view: bool,
) -> (ConditionedScan, CadFromScan, Side) {
    let subject = Subject::perfect(nominal);
    let rig = RigModel { outlier_share: 0.05, ..RigModel::default().with_density(2.0) };
    let side = if seed.is_multiple_of(2) { Side::Top } else { Side::Bottom };
    let simulated =
        simulate_scan(&subject, &rig, &PoseChoice::side(&subject, side), seed, &RunContext::silent()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || Uniform::new(-3.0, 3.0).unwrap().sample(&mut rng);
    let turn = Isometry3::new(Vector3::new(100.0 * draw(), 50.0, 900.0), Vector3::new(draw(), draw(), draw()));
    let positions = simulated.cloud.positions.iter().zip(&simulated.labels);
    let positions = positions.filter(|(_, label)| **label != Label::Belt).map(|(p, _)| turn * p).collect();
    let extents = part.bounds.extents();
    let hints = ScanHints {
        view_direction: knows_view.then(|| turn * rig.view_direction),
        part_extents_mm: [extents.x, extents.y, extents.z],
        part_area_mm2: part.mesh.area(),
        thickness_mm: part.thickness_mm,
    };
    let settings = BackgroundSettings { belt_plane: false, luminance_min: Some(0.0), ..BackgroundSettings::default() };
    let cloud = PointCloud { positions, ..PointCloud::default() };
    let scan = condition(cloud, &settings, &hints, &RunContext::silent()).unwrap();
    let truth = CadFromScan::try_from_row_major(&simulated.truth.cad_from_scan).unwrap();
    (scan, CadFromScan::new(truth.isometry() * turn.inverse()), side)
}

#[test]
fn any_orientation_without_a_belt() {
    for nominal in [bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() }), cover()] {
        let part = prepared(&nominal);
        for seed in 0..4 {
            let (scan, truth, side) = without_belt(&nominal, &part, 900 + seed, true);
            let found = best_fit(&part, &scan, &RunContext::silent()).unwrap_or_else(|stop| panic!("{seed}: {stop}"));
            let (angle, distance) = found.cad_from_scan.difference(&truth, &part.centroid);
            assert!(angle.to_degrees() < 1.0 && distance < 0.5, "{} {seed}: {angle} {distance}", nominal.name);
            assert_eq!(found.side, Some(side), "{} {seed}", nominal.name);
        }
    }
}

#[test]
fn without_belt_and_view_the_side_is_unknown() {
    let nominal = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
    let part = prepared(&nominal);
    let (scan, ..) = without_belt(&nominal, &part, 910, false);
    assert!(scan.to_camera.is_none());
    let words = refusal(&part, &scan);
    assert!(words.contains("side of the sheet cannot be told") && words.contains("view_direction"), "{words}");
    // The same with the CAD taken as it is: the pose is found, the side is not.
    let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 0.0, plan_directions: Vec::new() };
    let thin = Part::prepare(nominal.mesh.clone(), "0".repeat(64), &settings, &RunContext::silent()).unwrap();
    let (scan, truth, _) = without_belt(&nominal, &thin, 910, false);
    let found = best_fit(&thin, &scan, &RunContext::silent()).unwrap();
    let (angle, distance) = found.cad_from_scan.difference(&truth, &thin.centroid);
    assert!(found.side.is_none() && found.face == Side::Top);
    assert!(angle.to_degrees() < 1.0 && distance < 0.5, "{angle} {distance}");
}

/// A solid has a pose without anybody knowing the side, and a bracket's bends tell which of its faces was seen. A nearly flat rail's
/// hardly do: what is told of it must be right, too.
#[test]
fn a_solid_tells_its_face_without_a_known_camera() {
    let bent = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
    for (nominal, may_be_open) in [(bent, false), (rail(), true)] {
        let settings = PartSettings { cad_side: CadSide::Solid, thickness_mm: 0.0, plan_directions: Vec::new() };
        let mesh = Subject::perfect(&nominal).solid;
        let solid = Part::prepare(mesh, "0".repeat(64), &settings, &RunContext::silent()).unwrap();
        for seed in 910..914 {
            let (scan, truth, side) = without_belt(&nominal, &solid, seed, false);
            let found = best_fit(&solid, &scan, &RunContext::silent()).unwrap_or_else(|stop| panic!("{stop}"));
            let case = format!("{} {seed}", nominal.name);
            let is_open = found.open_face.is_some();
            assert!(found.side.is_none() && (may_be_open || !is_open), "{case}: {:?}", found.open_face);
            let shift_mm = if is_open { nominal.thickness_mm } else { 0.0 };
            assert!(is_open || found.face == side, "{case}");
            let (angle, distance) = found.cad_from_scan.difference(&truth, &solid.centroid);
            assert!(angle.to_degrees() < 1.0 && distance < shift_mm + 0.5, "{case}: {angle} {distance}");
        }
    }
}

/// Points exactly on the face, moved rigidly: the pose moves along.
#[test]
fn a_moved_cloud_gives_the_moved_pose_with_any_number_of_threads() {
    let nominal = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
    let part = prepared(&nominal);
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { camera_tilt_deg: 0.0, ..RigModel::perfect(1.5) };
    let (scan, _) = seen(&subject, &rig, Side::Top, &part, 920);
    let found = best_fit(&part, &scan, &RunContext::silent()).unwrap();
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| best_fit(&part, &scan, &RunContext::silent())).unwrap(), found);
    }
    let motion = Isometry3::new(Vector3::new(300.0, -70.0, 20.0), Vector3::new(0.4, -0.7, 1.9));
    let mut moved = scan.clone();
    moved.cloud.positions.iter_mut().for_each(|p| *p = motion * *p);
    let belt = moved.belt.as_mut().unwrap();
    belt.point = motion * belt.point;
    belt.normal = motion * belt.normal;
    moved.to_camera = moved.to_camera.map(|d| motion * d);
    let again = best_fit(&part, &moved, &RunContext::silent()).unwrap();
    let expected = CadFromScan::new(found.cad_from_scan.isometry() * motion.inverse());
    let (angle, distance) = again.cad_from_scan.difference(&expected, &part.centroid);
    // The last registration has the same points in both and ends when a step is below 1e-7 mm; steps shrink at least
    // tenfold, and positions of 1000 mm carry rounding of 1e-13 mm.
    assert!(distance < 1e-6 && angle * 150.0 < 1e-6, "{angle} {distance}");
}
