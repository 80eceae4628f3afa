//! What the filters must keep and take, on clouds with known labels.

use super::synthetic::{Label, Labelled, Scene, Shape};
use super::{ConditionedScan, PointClass, ScanHints, condition};
use crate::diagnostic::Stop;
use crate::geometry::{Isometry3, PointCloud, UnitVector3, Vector3};
use crate::plan::model::BackgroundSettings;
use crate::run::RunContext;

fn run(made: &Labelled, settings: &BackgroundSettings) -> ConditionedScan {
    run_with(made, settings, &made.hints)
}

fn run_with(made: &Labelled, settings: &BackgroundSettings, hints: &ScanHints) -> ConditionedScan {
    let scan = condition(made.cloud.clone(), settings, hints, &RunContext::silent()).unwrap();
    check_counts(&scan);
    scan
}

/// Each point is counted once, and the indices agree with the classes.
fn check_counts(scan: &ConditionedScan) {
    let removed = scan.removed;
    assert_eq!(
        scan.kept.len() + removed.duplicate + removed.belt + removed.colour + removed.dark + removed.stray,
        scan.cloud.len(),
        "every point once"
    );
    assert!(scan.kept.is_sorted());
    assert!(scan.kept.iter().all(|&k| scan.classes[k as usize] == PointClass::Kept));
}

fn refused(cloud: PointCloud, settings: &BackgroundSettings, hints: &ScanHints) -> String {
    match condition(cloud, settings, hints, &RunContext::silent()) {
        Err(Stop::Refused(refusal)) => {
            assert!(!refusal.help.is_empty());
            refusal.reason
        }
        Err(Stop::Cancelled(_)) => panic!("nobody cancelled"),
        Ok(scan) => panic!("not refused: {} kept, {:?}, {:?}", scan.kept.len(), scan.removed, scan.warnings),
    }
}

/// Share of the part's points above `least_mm` that are kept, and share of belt among the kept.
fn recall_and_contamination(made: &Labelled, scan: &ConditionedScan, least_mm: f64) -> (f64, f64) {
    let (mut part, mut part_kept, mut belt_kept) = (0.0, 0.0, 0.0);
    for (k, label) in made.labels.iter().enumerate() {
        let kept = scan.classes[k] == PointClass::Kept;
        if *label == Label::Part && made.heights_mm[k] > least_mm {
            part += 1.0;
            part_kept += f64::from(u8::from(kept));
        }
        belt_kept += f64::from(u8::from(kept && *label == Label::Belt));
    }
    (part_kept / part, belt_kept / scan.kept.len() as f64)
}

/// The demand: 99.5 % of the part more than 6 sigma above the belt is kept, at most 0.5 % of what is kept is belt.
fn check_separated(what: &str, made: &Labelled, scan: &ConditionedScan, noise_mm: f64) {
    // A sheet of 0.6 mm on noise of 0.12 mm lies 5 sigma above the belt: judged as well, 5 - 3 sigma leaves 97.7 %.
    let (recall, contamination) = recall_and_contamination(made, scan, 6.0 * noise_mm);
    assert!(recall.is_nan() || recall >= 0.995, "{what}: recall {recall}");
    assert!(contamination <= 0.005, "{what}: contamination {contamination}");
    let (recall, _) = recall_and_contamination(made, scan, 0.0);
    assert!(recall >= 0.95, "{what}: recall of everything {recall}");
}

fn plane_only() -> BackgroundSettings {
    BackgroundSettings::default()
}

fn with_colour(scene: &Scene) -> BackgroundSettings {
    BackgroundSettings {
        belt_colours: vec![scene.belt_colour],
        colour_tolerance: 30.0,
        ..BackgroundSettings::default()
    }
}

#[test]
fn separates_part_from_belt_for_any_wear_thickness_and_tilt() {
    let mut seed = 0;
    for shape in [Shape::Hat, Shape::Bracket, Shape::Dome, Shape::Plate] {
        for (thickness_mm, wear, tilt_deg) in [(0.6, 0.0, 5.0), (0.8, 0.5, 2.0), (1.5, 1.0, 0.0)] {
            seed += 1;
            let scene = Scene { shape, thickness_mm, wear, tilt_deg, seed, points: 60_000, ..Scene::default() };
            let made = scene.make();
            for settings in [plane_only(), with_colour(&scene)] {
                let scan = run(&made, &settings);
                let what = format!("{shape:?} {thickness_mm} {wear} {tilt_deg} {:?}", settings.belt_colours);
                check_separated(&what, &made, &scan, scene.noise_mm);
                check_belt(&what, &made, &scan);
            }
        }
    }
}

/// Plane and camera side against the truth: the plane's height is known to sigma / sqrt(inliers of the fit), far below
/// 0.03 mm; a sheet 5 sigma above may pull it by a few hundredths of a sigma. The slope: the same over a lever of 80 mm.
fn check_belt(what: &str, made: &Labelled, scan: &ConditionedScan) {
    let belt = scan.belt.unwrap_or_else(|| panic!("{what}: no belt, {:?}", scan.warnings));
    let in_belt = made.scan_from_belt.inverse();
    assert!((in_belt * belt.point).z.abs() < 0.03, "{what}: {}", (in_belt * belt.point).z);
    let normal = in_belt.rotation * belt.normal.into_inner();
    assert!(normal.z > 0.0 && normal.xy().norm() < 1e-3, "{what}: {normal}");
    assert!((belt.sigma_mm - 0.12).abs() < 0.03, "{what}: {}", belt.sigma_mm);
    assert!(scan.to_camera.unwrap().dot(&belt.normal) > 0.99);
}

#[test]
fn a_cloud_without_colours_is_separated_by_its_plane() {
    let scene = Scene { colours: false, ..Scene::default() };
    let made = scene.make();
    let scan = run(&made, &with_colour(&scene));
    check_separated("no colours", &made, &scan, scene.noise_mm);
    assert_eq!((scan.removed.colour, scan.removed.dark), (0, 0));
}

#[test]
fn colour_alone_takes_the_unworn_belt() {
    let scene = Scene { wear: 0.0, spikes: 0.0, ..Scene::default() };
    let made = scene.make();
    let settings = BackgroundSettings { belt_plane: false, ..with_colour(&scene) };
    let scan = run(&made, &settings);
    check_separated("colour alone", &made, &scan, scene.noise_mm);
    assert!(scan.belt.is_none() && scan.removed.belt == 0 && scan.removed.colour > 0);
    assert!(scan.to_camera.is_some(), "the plan's view direction tells it");
    let unknown = ScanHints { view_direction: None, ..made.hints };
    assert!(run_with(&made, &settings, &unknown).to_camera.is_none());
}

#[test]
fn the_camera_side_is_found_from_the_belt() {
    for shape in [Shape::Hat, Shape::Bracket, Shape::Dome, Shape::Plate] {
        for turned in [0.0, 2.0] {
            let scene = Scene { shape, points: 60_000, ..Scene::default() };
            let made = scene.make_moved(Isometry3::new(Vector3::new(5.0, 0.0, 100.0), Vector3::new(turned, 0.3, 1.0)));
            let hints = ScanHints { view_direction: None, ..made.hints };
            let scan = run_with(&made, &plane_only(), &hints);
            check_belt(&format!("{shape:?} {turned}"), &made, &scan);
            check_separated(&format!("{shape:?} {turned}"), &made, &scan, scene.noise_mm);
        }
    }
}

#[test]
fn normals_tell_the_camera_side_where_nothing_else_does() {
    let scene = Scene { shape: Shape::Bracket, belt: false, points: 40_000, spikes: 0.0, ..Scene::default() };
    let mut made = scene.make();
    let unknown = ScanHints { view_direction: None, ..made.hints };
    // Normals all around a direction that is not the view's, in pairs that lean to opposite sides of it by 45 degrees.
    let camera = UnitVector3::new_normalize(Vector3::new(1.0, 2.0, 2.0));
    let across = camera.cross(&Vector3::x()).normalize();
    let leaning = |k: usize| (camera.into_inner() + across * if k.is_multiple_of(2) { 1.0 } else { -1.0 }).normalize();
    let normals = |sign: &dyn Fn(usize) -> f64| {
        Some((0..made.cloud.len()).map(|k| (leaning(k) * sign(k)).map(|c| c as f32).into()).collect())
    };
    let (outwards, either_way) = (normals(&|_| 1.0), normals(&|k| if k % 4 < 2 { 1.0 } else { -1.0 }));
    made.cloud.normals = outwards;
    let told = run_with(&made, &plane_only(), &unknown).to_camera.expect("normals");
    // Pairs are incomplete where a point was dropped; of 40,000 a few dozen at most.
    assert!(told.dot(&camera) > 0.9999, "{told:?}");
    let viewed = run_with(&made, &plane_only(), &made.hints).to_camera;
    assert_eq!(viewed, made.hints.view_direction.map(|d| -d), "the plan knows better");
    // Normals that point to either side tell nothing.
    made.cloud.normals = either_way;
    assert_eq!(run_with(&made, &plane_only(), &unknown).to_camera, None);
}

/// A file that holds every point twice is the scan that it would be without: nothing looks more certain for it.
#[test]
fn points_held_twice_count_once() {
    let made = Scene { points: 40_000, ..Scene::default() }.make();
    let once = run(&made, &plane_only());
    assert_eq!(once.removed.duplicate, 0);
    let count = made.cloud.len();
    let mut twice = made.cloud.clone();
    twice.positions.extend_from_within(..);
    twice.colours.as_mut().unwrap().extend_from_within(..);
    let scan = condition(twice, &plane_only(), &made.hints, &RunContext::silent()).unwrap();
    check_counts(&scan);
    assert_eq!(scan.removed.duplicate, count);
    assert_eq!(scan.kept, once.kept);
    assert_eq!((scan.belt, scan.spacing_mm), (once.belt, once.spacing_mm));
    assert_eq!(scan.classes[..count], once.classes);
    let told = format!("{count} of {} points stand exactly where another one does", 2 * count);
    assert!(scan.warnings.iter().any(|w| w.starts_with(&told)), "{:?}", scan.warnings);
}

#[test]
fn a_part_without_a_belt_keeps_its_flat_faces() {
    for shape in [Shape::Plate, Shape::Hat, Shape::Bracket, Shape::Dome] {
        let scene = Scene { shape, belt: false, points: 40_000, spikes: 0.005, ..Scene::default() };
        let made = scene.make();
        for hints in [made.hints, ScanHints { view_direction: None, ..made.hints }] {
            let scan = run_with(&made, &plane_only(), &hints);
            let (recall, _) = recall_and_contamination(&made, &scan, 0.0);
            assert!(scan.belt.is_none(), "{shape:?}");
            assert!(recall > 0.999, "{shape:?}: {recall}");
            assert!(scan.warnings.iter().any(|w| w.starts_with("no belt plane in view")), "{:?}", scan.warnings);
            assert_eq!(scan.to_camera.is_some(), hints.view_direction.is_some());
        }
    }
}

#[test]
fn a_big_flat_part_does_not_win_over_the_belt() {
    // The panel covers the whole view but strips at its rim.
    let scene = Scene {
        shape: Shape::Panel,
        view_mm: [230.0, 170.0],
        part_at_mm: [25.0, 0.0],
        points: 100_000,
        wear: 1.0,
        ..Scene::default()
    };
    let made = scene.make();
    let belt_share = made.labels.iter().filter(|l| **l == Label::Belt).count() as f64 / made.labels.len() as f64;
    assert!(belt_share < 0.25, "{belt_share}");
    let scan = run(&made, &plane_only());
    check_belt("panel", &made, &scan);
    check_separated("panel", &made, &scan, scene.noise_mm);
}

#[test]
fn a_panel_that_fills_the_view_is_kept() {
    let scene = Scene { shape: Shape::Panel, view_mm: [130.0, 100.0], points: 60_000, ..Scene::default() };
    let made = scene.make();
    let scan = run(&made, &plane_only());
    assert!(scan.belt.is_none());
    assert!(recall_and_contamination(&made, &scan, 0.0).0 > 0.999);
}

#[test]
fn a_belt_colour_like_the_parts_does_not_take_the_part() {
    let grey = [150, 152, 155];
    for shape in [Shape::Hat, Shape::Plate, Shape::Bracket] {
        let scene = Scene { shape, belt_colour: grey, part_colour: grey, ..Scene::default() };
        let made = scene.make();
        let scan = run(&made, &with_colour(&scene));
        check_separated("grey on grey", &made, &scan, scene.noise_mm);
    }
    let scene = Scene { belt: false, belt_colour: grey, part_colour: grey, ..Scene::default() };
    let made = scene.make();
    let scan = run(&made, &BackgroundSettings { belt_plane: false, ..with_colour(&scene) });
    assert!(recall_and_contamination(&made, &scan, 0.0).0 > 0.999);
    assert!(scan.warnings.iter().any(|w| w.contains("belt's colour")), "{:?}", scan.warnings);
}

#[test]
fn an_empty_belt_is_refused() {
    for spikes in [0.0, 0.02] {
        let scene = Scene { shape: Shape::None, spikes, ..Scene::default() };
        let made = scene.make();
        for hints in [made.hints, ScanHints { view_direction: None, ..made.hints }] {
            let reason = refused(made.cloud.clone(), &plane_only(), &hints);
            assert!(reason.starts_with("no part on the belt"), "{reason}");
        }
        let colour_alone =
            BackgroundSettings { belt_plane: false, ..with_colour(&Scene { wear: 0.0, ..scene.clone() }) };
        let unworn = Scene { wear: 0.0, spikes: 0.0, ..scene }.make();
        let reason = refused(unworn.cloud.clone(), &colour_alone, &unworn.hints);
        assert!(reason.contains("belt's colour"), "{reason}");
    }
}

#[test]
fn hardly_any_points_or_all_dark_is_refused_with_the_reason() {
    let made = Scene { points: 150, ..Scene::default() }.make();
    assert!(refused(made.cloud, &plane_only(), &made.hints).contains("150 points"));
    let made = Scene { points: 20_000, ..Scene::default() }.make();
    let settings = BackgroundSettings { luminance_min: Some(240.0), ..plane_only() };
    assert!(refused(made.cloud.clone(), &settings, &made.hints).contains("darker than 240"));
    let one_spot = PointCloud { positions: vec![made.cloud.positions[0]; 1000], ..PointCloud::default() };
    assert!(refused(one_spot, &plane_only(), &made.hints).contains("place of their own"));
}

#[test]
fn a_corner_of_a_part_is_kept() {
    // About 3 % of the hat look into the view.
    let scene = Scene { part_at_mm: [180.0, 125.0], ..Scene::default() };
    let made = scene.make();
    let part = made.labels.iter().filter(|l| **l == Label::Part).count() as f64 / made.labels.len() as f64;
    let of_hat = part * 4.0 * 130.0 * 100.0 / (140.0 * 100.0);
    assert!((0.02..0.06).contains(&of_hat), "{of_hat}");
    let scan = run(&made, &plane_only());
    let (recall, _) = recall_and_contamination(&made, &scan, 0.0);
    assert!(recall > 0.95, "{recall}");
}

#[test]
fn shadow_is_taken_by_the_luminance_filter_and_a_dark_part_is_not() {
    let scene = Scene { shadow: 0.04, ..Scene::default() };
    let made = scene.make();
    for settings in [plane_only(), BackgroundSettings { luminance_min: Some(25.0), ..plane_only() }] {
        let scan = run(&made, &settings);
        let shadow = made.labels.iter().filter(|l| **l == Label::Shadow).count();
        // Shades of 4 levels about 8: none reaches 25.
        assert!(scan.removed.dark.abs_diff(shadow) <= shadow / 1000, "{} of {shadow}", scan.removed.dark);
        check_separated("shadow", &made, &scan, scene.noise_mm);
    }
    let black = Scene { part_colour: [18, 18, 18], wear: 0.0, ..Scene::default() };
    let made = black.make();
    let scan = run(&made, &plane_only());
    check_separated("black part", &made, &scan, black.noise_mm);
    assert!(scan.warnings.iter().any(|w| w.contains("dark")), "{:?}", scan.warnings);
}

#[test]
fn far_away_things_are_stray_and_gaps_in_the_part_are_not() {
    let scene = Scene { points: 60_000, ..Scene::default() };
    let mut made = scene.make();
    let up = made.scan_from_belt.rotation * Vector3::z();
    // A lamp 300 mm up, seen in a few hundred points.
    for k in 0..400 {
        let (a, b) = (f64::from(k % 20), f64::from(k / 20));
        let lamp = made.scan_from_belt * crate::geometry::Point3::new(a, b, 30.0) + up * 300.0;
        made.cloud.positions.push(lamp);
        if let Some(colours) = &mut made.cloud.colours {
            colours.push([200, 200, 200]);
        }
        made.labels.push(Label::Spike);
        made.heights_mm.push(330.0);
    }
    let scan = run(&made, &plane_only());
    assert!(scan.classes[60_000..].iter().all(|c| *c == PointClass::Stray));
    check_separated("lamp", &made, &scan, scene.noise_mm);
    // A band of 12 mm across the part is missing (glare): both halves stay.
    let keep: Vec<usize> =
        (0..60_000).filter(|&k| (made.scan_from_belt.inverse() * made.cloud.positions[k]).x.abs() > 6.0).collect();
    made.cloud.positions = keep.iter().map(|&k| made.cloud.positions[k]).collect();
    made.cloud.colours = made.cloud.colours.map(|c| keep.iter().map(|&k| c[k]).collect());
    made.labels = keep.iter().map(|&k| made.labels[k]).collect();
    made.heights_mm = keep.iter().map(|&k| made.heights_mm[k]).collect();
    let scan = run(&made, &plane_only());
    check_separated("gap", &made, &scan, scene.noise_mm);
}

#[test]
fn classes_do_not_depend_on_where_the_cloud_lies() {
    let scene = Scene { points: 60_000, ..Scene::default() };
    let here = run(&scene.make_moved(Isometry3::identity()), &with_colour(&scene));
    for (shift, turn) in [([1e4, -2e4, 3e3], [0.1, 2.9, -0.4]), ([-50.0, 0.0, 7.0], [1.5, 0.0, 0.9])] {
        let moved = scene.make_moved(Isometry3::new(Vector3::from(shift), Vector3::from(turn)));
        let there = run(&moved, &with_colour(&scene));
        let differ = here.classes.iter().zip(&there.classes).filter(|(a, b)| a != b).count();
        // The raster of the stray filter follows the axes: spikes at its border may change sides.
        assert!(differ < 60, "{differ} of {}", here.classes.len());
        assert!((here.spacing_mm / there.spacing_mm - 1.0).abs() < 0.02);
    }
}

#[test]
fn spacing_is_that_of_the_density_made() {
    // 26 points per mm² in a small view, 1.3 in the usual one.
    for (view_mm, part_at_mm, points) in [([20.0, 20.0], [0.0, 0.0], 41_600), ([130.0, 100.0], [0.0, 0.0], 67_600)] {
        let scene = Scene { shape: Shape::Plate, view_mm, part_at_mm, points, spikes: 0.0, ..Scene::default() };
        let density: f64 = points as f64 / (4.0 * view_mm[0] * view_mm[1]);
        let made = scene.make_moved(Isometry3::rotation(Vector3::new(0.7, -1.1, 0.2)));
        let scan = run(&made, &plane_only());
        // Counts of 50 points in 400 balls: 0.14 / 20 by chance; noise in height costs a few per cent more.
        assert!((scan.spacing_mm * density.sqrt() - 1.0).abs() < 0.05, "{} {}", scan.spacing_mm, density);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_scan() {
    let scene = Scene { points: 150_000, shadow: 0.02, ..Scene::default() };
    let made = scene.make();
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&made, &with_colour(&scene)))
    };
    assert!(with_threads(1) == with_threads(3));
}

/// One scene that was hard each: what was wrong is in the comment.
#[test]
fn scenes_that_were_hard_once() {
    let base = Scene { points: 60_000, ..Scene::default() };
    let panel = Scene { shape: Shape::Panel, view_mm: [230.0, 170.0], part_at_mm: [25.0, 0.0], ..base.clone() };
    let scenes = [
        // The panel five standard deviations above drew the belt's plane up.
        Scene { thickness_mm: 0.6, wear: 1.0, ..panel.clone() },
        Scene { thickness_mm: 1.5, noise_mm: 0.25, ..panel.clone() },
        // Waves larger than the noise left their crests.
        Scene { thickness_mm: 1.5, noise_mm: 0.05, wave_mm: 0.3, ..panel },
        // A steep plane widened until it held the whole belt, when the camera was not known.
        Scene { shape: Shape::Dome, view_mm: [400.0, 300.0], seed: 3, ..base.clone() },
        Scene { shape: Shape::Plate, thickness_mm: 0.6, wear: 1.0, ..base.clone() },
        // Without any noise every width is zero.
        Scene { shape: Shape::Bracket, noise_mm: 0.0, spikes: 0.0, ..base.clone() },
        // Few points: a coarse sensor.
        Scene { points: 4_000, spikes: 0.05, ..base },
    ];
    for scene in scenes {
        let made = scene.make();
        let slanted = UnitVector3::new_normalize(made.scan_from_belt.rotation * Vector3::new(0.5, 0.2, -1.0));
        for view_direction in [made.hints.view_direction, None, Some(slanted)] {
            let scan = run_with(&made, &plane_only(), &ScanHints { view_direction, ..made.hints });
            check_separated(&format!("{scene:?} {view_direction:?}"), &made, &scan, scene.noise_mm);
            assert!(scan.belt.is_some());
        }
    }
}
