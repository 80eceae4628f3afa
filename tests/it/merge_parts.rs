//! Plans whose parts are folders of views: stitched first, then inspected as one cloud.

use super::project::{Project, Running, real_scan};
use serde_json::{Value, json};
use shapeline::geometry::{Isometry3, LengthUnit, Point3, Vector3};
use shapeline::io::{read_cloud, sha256_hex, write_ply_cloud};
use shapeline::run::RunContext;
use std::path::Path;

/// How far the second view's frame stands off the first one's.
fn second() -> Isometry3 {
    Isometry3::new(Vector3::new(100.0, -40.0, 30.0), Vector3::new(0.1, 0.2, -0.3))
}

/// A good part of the demo as two overlapping views in their own frames, µm: the left and the right part of the picture.
fn views() -> [Vec<u8>; 2] {
    let scan = read_cloud(&real_scan(), Path::new("scan.ply"), LengthUnit::Mm, &RunContext::silent()).expect("a scan");
    let mut sorted: Vec<f64> = scan.positions.iter().map(|p| p.x).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let view = |keeps: &dyn Fn(f64) -> bool, pose: Isometry3| {
        let kept = scan.positions.iter().filter(|p| keeps(p.x));
        let points: Vec<Point3> = kept.map(|p| pose.inverse() * p * 1000.0).collect();
        let mut bytes = Vec::new();
        write_ply_cloud(&mut bytes, &points, LengthUnit::Um, None, None, &[]).expect("memory takes it");
        bytes
    };
    [view(&|x| x < middle + 20.0, Isometry3::identity()), view(&|x| x > middle - 20.0, second())]
}

fn poses() -> String {
    let pose = |index: usize, pose: Isometry3| {
        let r = pose.rotation.to_rotation_matrix();
        let rows: Vec<[f64; 3]> = (0..3).map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]]).collect();
        let t: [f64; 3] = (pose.translation.vector * 1000.0).into();
        json!({"index": index, "approx": {"R": rows, "t": t}})
    };
    json!({"views": [pose(0, Isometry3::identity()), pose(1, second())]}).to_string()
}

/// The demo's project with a plan of views.
fn project() -> Project {
    let project = Project::new();
    let plan = String::from_utf8(project.read("demo.toml")).unwrap();
    let (before, after) = plan.split_once("[scans]").expect("a table of scans");
    let (own, rest) = after.split_once("\n[").expect("another table");
    let kept: Vec<&str> = own.lines().filter(|l| l.trim_start().starts_with("view_direction")).collect();
    let scans = format!("[scans]\nfolder = \"scans\"\nviews = \"merge.toml\"\n{}\n", kept.join("\n"));
    project.write("demo.toml", format!("{before}{scans}\n[{rest}").as_bytes());
    let merge = "schema = 1\nunit = \"um\"\n[views]\npattern = \"v*.ply\"\nposes = \"poses.json\"\n[registration]\nenabled = false\n\
        [merge]\nmetric = \"delta_n\"\nradius = 100.0\n";
    project.write("merge.toml", merge.as_bytes());
    project.write("poses.json", poses().as_bytes());
    project
}

fn add_part(project: &Project, name: &str, views: &[Vec<u8>]) {
    std::fs::create_dir(project.path(&format!("scans/{name}"))).unwrap();
    for (k, view) in views.iter().enumerate() {
        project.write(&format!("scans/{name}/v{k}.ply"), view);
    }
}

fn deviations(result: &Value) -> Vec<(String, Option<f64>)> {
    let points = result["points"].as_array().unwrap_or_else(|| panic!("no points in {result}"));
    points.iter().map(|p| (p["name"].as_str().unwrap().to_owned(), p["deviation_mm"].as_f64())).collect()
}

#[test]
fn a_folder_of_views_is_inspected_as_one_cloud_under_its_name() {
    let single = Project::new();
    single.add_real_scan("0001.ply");
    single.run(["run", "demo.toml"]);
    let expected = single.json("results/0001.json");

    let project = project();
    let views = views();
    add_part(&project, "0001", &views);
    // A part whose stitching fails, and one of which a view is broken.
    add_part(&project, "0002", &views[..1]);
    add_part(&project, "0003", &[views[0].clone(), views[1].clone(), b"<html>".to_vec()]);
    project.run(["check", "demo.toml"]).assert_ended(project.run(["check", "demo.toml"]).code.unwrap(), &[]);
    let three = json!({"views": (0..3).map(|k| {
        let mut pose = serde_json::from_str::<Value>(&poses()).unwrap()["views"][k.min(1)].clone();
        pose["index"] = json!(k);
        pose
    }).collect::<Vec<Value>>()});
    project.write("scans/0003/poses.json", three.to_string().as_bytes());
    let ran = project.run(["run", "demo.toml"]);
    ran.assert_ended(1, &[]);
    assert!(ran.lines()[0].starts_with("0001\t") && ran.lines()[1].starts_with("0002\t"), "{ran:?}");

    let result = project.json("results/0001.json");
    let lines: Vec<String> = (0..2).map(|k| format!("{}  v{k}.ply\n", sha256_hex(&views[k]))).collect();
    assert_eq!(
        (&result["scan"]["file"], &result["scan"]["sha256"]),
        (&json!("0001"), &json!(sha256_hex(lines.concat().as_bytes())))
    );
    assert_eq!((&result["status"], &result["verdict"]), (&json!("measured"), &expected["verdict"]));
    for ((name, found), (_, expected)) in deviations(&result).iter().zip(deviations(&expected)) {
        // The same points but for the overlap's twins, moved there and back, in steps of 0.03 µm.
        let (Some(found), Some(expected)) = (found, expected) else { continue };
        assert!((found - expected).abs() < 0.05, "{name}: {found} {expected}");
    }
    assert!(deviations(&result).iter().filter(|(_, d)| d.is_some()).count() > 15);

    let refused = project.json("results/0002.json");
    assert_eq!(refused["status"], "refused");
    let reason = refused["reason"].as_str().unwrap();
    assert!(reason.contains("merge.toml:3: [views] pattern: found one view only in 0002"), "{reason}");

    let warned = project.json("results/0003.json");
    assert_eq!(warned["status"], "measured");
    let warnings = warned["warnings"].as_array().unwrap();
    let told = |words: &str| warnings.iter().any(|w| w.as_str().unwrap().starts_with(words));
    assert!(told("the part is stitched of 2 of its 3 views: what only v2.ply saw is missing"), "{warnings:?}");
    assert!(told("v2.ply is left out: "), "{warnings:?}");
    let text = String::from_utf8(project.read("results/0003.txt")).unwrap();
    assert!(text.contains("stitched of 2 of its 3 views"), "{text}");
    project.assert_verified("results");
    // Again, to the byte; and by name.
    let before = project.files("results");
    project
        .run(["run", "demo.toml", "scans/0001", "--threads", "1", "--out", "again"])
        .assert_ended(ran_code(&result), &[]);
    assert_eq!(project.read("again/0001.json"), before["0001.json"]);
}

/// The exit status that a part's verdict alone gives.
fn ran_code(result: &Value) -> i32 {
    i32::from(result["verdict"] != "pass")
}

#[test]
fn faults_of_the_views_settings_are_those_of_the_plan() {
    let project = project();
    project.write("merge.toml", b"schema = 1\nunit = \"um\"\n[merge]\nmetric = \"dcal\"\n");
    project
        .run(["check", "demo.toml"])
        .assert_ended(2, &["merge.toml:4: [merge] metric: found \"dcal\"", "did you mean"]);
    std::fs::remove_file(project.path("merge.toml")).unwrap();
    project.run(["run", "demo.toml"]).assert_ended(2, &["[scans] views: could not read the settings of a merge"]);
    let other = self::project();
    other.change_plan(&[("views = \"merge.toml\"", "views = \"merge.toml\"\nunit = \"mm\"")]);
    other
        .run(["check", "demo.toml"])
        .assert_ended(2, &["[scans] unit: found text \"mm\", and the views are in \"um\""]);
    // A file where a folder belongs.
    let third = self::project();
    third.write("scans/0001.ply", b"ply");
    third.run(["run", "demo.toml", "scans/0001.ply"]).assert_ended(2, &[]);
    assert!(
        third.json("results/0001.json")["reason"].as_str().unwrap().contains("expected the folder of a part's views")
    );
}

/// The folder grows view by view; a view that ends in the middle is waited for.
#[test]
fn a_watched_folder_of_views_counts_when_it_has_settled() {
    let project = project();
    let views = views();
    let mut running = Running::start(project.root(), ["run", "demo.toml", "--watch", "--settle", "0.5"]);
    running.wait_for_words(&["watching"]);
    std::fs::create_dir(project.path("scans/0007")).unwrap();
    project.write("scans/0007/v1.ply.part", b"half");
    project.write("scans/0007/v0.ply", &views[0]);
    project.write("scans/0007/v1.ply", &views[1][..views[1].len() / 2]);
    std::fs::remove_file(project.path("scans/0007/v1.ply.part")).unwrap();
    running.wait_for_words(&["waiting for the rest"]);
    assert!(running.out().is_empty() && !project.has("results/0007.json"));
    project.write("scans/0007/v1.ply", &views[1]);
    running.wait_for_lines(1);
    running.interrupt();
    let ran = running.end();
    ran.assert_ended(130, &[]);
    assert!(ran.stdout.starts_with("0007\t"), "{ran:?}");
    assert_eq!(project.json("results/0007.json")["status"], "measured");
}
