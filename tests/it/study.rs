//! `shapeline study`: the command, and whether what a plan's `[uncertainty]` states acts on the values as U counts it.

use super::project::{Project, Running, tiny_scan};
use crate::support::{identity, inspect_scan, prepared};
use shapeline::inspect::{Inspection, Outcome};
use shapeline::plan::Side;
use shapeline::run::RunContext;
use shapeline::simulate::{BracketParameters, PoseChoice, RigModel, Subject, bracket, simulate_scan};

/// A project whose rig gives a sixteenth of the points, and matches images better, so that it still measures.
fn coarse() -> Project {
    let project = Project::new();
    project.change_plan(&[
        ("resolution_level = 2\npoint_spacing_mm = 0.6", "resolution_level = 4"),
        ("image_accuracy_px = 0.3", "image_accuracy_px = 0.1"),
    ]);
    project
}

#[test]
fn the_same_study_says_the_same_with_one_thread_and_two() {
    let project = coarse();
    let study = |threads: &str, out: &str| {
        let ran =
            project.run(["study", "demo.toml", "--count", "3", "--seed", "5", "--threads", threads, "--out", out]);
        ran.assert_ended(1, &[]);
        (ran.stdout, project.files(out))
    };
    let (told, files) = study("1", "a");
    assert_eq!((&told, &files), (&study("2", "b").0, &project.files("b")));
    assert_eq!(files.keys().collect::<Vec<_>>(), ["study.csv", "study.txt"]);
    assert_eq!(String::from_utf8_lossy(&files["study.txt"]), told);
    for words in [
        "3 simulated scans, seed 5",
        "rig: ground pixel 0.669 mm, accuracy 0.067 mm in the plane and 0.201 mm in depth",
        "note: a type-1 study asks for 25 scans",
        "note: [uncertainty] states nothing",
        "note: a distance, which noise can only lengthen, so that it is biased: C03, C05",
        "Cgk = (0.1 T - |bias|) / (3 s), 1.33 at least",
        "of 26 points: 26 cannot say: ",
    ] {
        assert!(told.contains(words), "no \"{words}\" in {told}");
    }
    let csv = String::from_utf8(files["study.csv"].clone()).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 26);
    let measured: Vec<&Vec<&str>> = rows.iter().filter(|row| row[5] == "3").collect();
    assert!(measured.len() > 15, "{csv}");
    for row in measured {
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        // Surface points err by a tenth of a millimetre at this noise (one sigma, in the pose that the datums give); edges and holes may
        // err by more than a spacing of 0.7 mm.
        let (bias, s, u) = (number(6), number(7), number(8));
        assert!(row[1] != "surface" || (bias.abs() < 0.4 && s < 0.4 && (0.02..0.6).contains(&u)), "{row:?}");
        // Cgk is Cg less what the bias takes.
        assert!((number(10) - number(11) - bias.abs() / (3.0 * s)).abs() < 0.01 * number(10), "{row:?}");
    }
    assert!(!project.has("study") && !project.has("results"));
}

#[test]
fn scans_of_one_part_tell_how_well_they_agree_and_with_a_reference_how_right_they_are() {
    let project = Project::new();
    std::fs::create_dir(project.path("repeats")).unwrap();
    let known = ["study", "demo.toml", "--scans", "repeats", "--reference", "known.csv"];
    project
        .run(["study", "demo.toml", "--scans", "repeats"])
        .assert_ended(2, &["repeats", "no scan matches", "help: "]);
    project.write("known.csv", b"name,deviation_mm\nP01,0.1\nP99,0.1\n");
    project.run(known).assert_ended(2, &["known.csv:3:", "\"P99\"", "help: "]);
    project.add_real_scan("../repeats/1.ply");
    project.write("repeats/2.ply", &tiny_scan(1));
    project.write("known.csv", b"name,deviation_mm\nP01,9.5\n");
    let ran = project.run(known);
    ran.assert_ended(1, &[]);
    for words in [
        "2 scans of one part from repeats, reference values from known.csv",
        "0 seen from the top, 1 from the bottom",
        "no reference value, so that only repeatability is told: P02, P03",
        "refused: 2.ply: ",
        "of 26 points: 26 cannot say",
    ] {
        assert!(ran.stdout.contains(words), "no \"{words}\" in {ran:?}");
    }
    let csv = String::from_utf8(project.read("study/study.csv")).unwrap();
    let bias = |name: &str| csv.lines().find(|l| l.starts_with(name)).unwrap().split(',').nth(6).unwrap().to_owned();
    // A good part does not deviate by 9.5 mm.
    assert!((bias("P01").parse::<f64>().unwrap() + 9.5).abs() < 0.5 && bias("P02").is_empty(), "{csv}");
}

#[test]
fn a_study_that_cannot_be_made_says_why() {
    let project = Project::new();
    project.run(["study", "demo.toml"]).assert_ended(2, &["--count", "--scans"]);
    project.run(["study", "none.toml", "--count", "1"]).assert_ended(2, &["none.toml"]);
    let nowhere = ["study", "demo.toml", "--count", "1", "--out", "demo.toml/x"];
    project.run(nowhere).assert_ended(2, &["demo.toml/x", "--out"]);
    project.run(["study", "demo.toml", "--scans", "nowhere"]).assert_ended(2, &["nowhere", "--scans"]);
    project.change_plan(&[(
        "method = \"features\"\nhole = \"H1\"\nslot = \"S1\"\npoint = \"A1\"",
        "method = \"best_fit\"",
    )]);
    let bent = ["study", "demo.toml", "--count", "1", "--deform", "0.5"];
    project.run(bent).assert_ended(2, &["best fit", "--deform"]);
    assert!(!project.has("study"));
}

#[test]
fn ctrl_c_ends_a_study_with_whole_files_or_none() {
    let project = coarse();
    let mut running = Running::start(project.root(), ["study", "demo.toml", "--count", "1000"]);
    // The CAD's cache is written once Ctrl-C is caught.
    let cache = shapeline::part::cache_path(&project.path("bracket.stl"));
    running.wait_until("the CAD is ready", |_| cache.exists());
    running.interrupt();
    running.wait_for_words(&["stopping after this scan"]);
    let ran = running.end();
    ran.assert_ended(130, &[]);
    if project.has("study") {
        let files: Vec<String> = project.files("study").into_keys().collect();
        assert_eq!(files, ["study.csv", "study.txt"]);
        assert!(ran.stdout.contains("of 1000 simulated scans (stopped)"), "{ran:?}");
    } else {
        assert_eq!(ran.stdout, "");
    }
}

/// What a bracket gives when the measuring system has these errors.
fn measured(rig: &RigModel) -> Inspection {
    let nominal = bracket(&BracketParameters::default());
    let plan = nominal.plan();
    let subject = Subject::perfect(&nominal);
    let pose = PoseChoice::side(&subject, Side::Top);
    let scan = simulate_scan(&subject, rig, &pose, 31, &RunContext::silent()).unwrap();
    match inspect_scan(&plan, &prepared(&nominal), scan.cloud, identity()).result.outcome {
        Outcome::Measured(inspection) => *inspection,
        Outcome::Refused(refusal) => panic!("{refusal}"),
    }
}

/// The change of each value is what `inspect/comparison.rs` counts in its uncertainty. Noise and places of the points differ from scan to
/// scan: at a spacing of 0.4 mm and half of the usual noise that leaves 0.06 mm of an edge (one sigma of a difference), 0.03 mm of
/// a hole's centre, 0.06 mm of its diameter and 0.03 mm of a height.
#[test]
fn errors_of_scale_and_of_edges_reach_the_values_as_u_counts_them() {
    let exact = RigModel {
        rim_rounding_mm: 0.0,
        belt_margin_mm: 20.0,
        noise_plane_mm: 0.025,
        noise_depth_mm: 0.06,
        ..RigModel::default().with_density(6.0)
    };
    let plain = measured(&exact);
    let stretched = measured(&RigModel { scale_error: 0.004, ..exact.clone() });
    let shifted = measured(&RigModel { edge_shift_mm: 0.4, ..exact });
    let held = bracket(&BracketParameters::default()).features[0].geometry.position();
    let mut looked_at = [0; 3];
    for ((before, scaled), moved) in plain.points.iter().zip(&stretched.points).zip(&shifted.points) {
        let (Some(b), Some(s), Some(m)) = (&before.measurement, &scaled.measurement, &moved.measurement) else {
            continue;
        };
        let (name, change) = (&before.name, m.deviation_mm - b.deviation_mm);
        if before.kind != "surface" && before.direction.norm() > 0.0 {
            // 0.4 % of up to 200 mm; the part is held by its hole H1.
            let expected = 0.004 * (before.nominal - held).dot(&before.direction);
            let found = s.deviation_mm - b.deviation_mm;
            assert!((found - expected).abs() < 0.2, "{name}: {found} for {expected}");
            looked_at[0] += usize::from(expected.abs() > 0.3);
        }
        match (&b.hole, &m.hole) {
            (Some(before), Some(after)) => {
                let shrunk = after.diameter_mm - before.diameter_mm;
                assert!((shrunk + 0.8).abs() < 0.25 && change.abs() < 0.15, "{name}: {shrunk} {change}");
                looked_at[1] += 1;
            }
            _ if before.kind == "edge" => {
                assert!((change - 0.4).abs() < 0.2, "{name}: {change}");
                looked_at[2] += 1;
            }
            _ => assert!(change.abs() < 0.15, "{name}: {change}"),
        }
    }
    assert!(looked_at.iter().all(|n| *n >= 3), "{looked_at:?}");
}
