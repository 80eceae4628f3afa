//! `shapeline merge`: the built program on small views, what it writes and what it says of faults.

use super::project::{Ran, run_in};
use serde_json::{Value, json};
use shapeline::geometry::{Isometry3, LengthUnit, Point3, Vector3};
use shapeline::io::read_cloud_in_its_unit;
use shapeline::run::RunContext;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Points of a view along one side, and their distance in µm.
const SIDE: i32 = 60;
const PITCH: f64 = 10.0;

/// Three overlapping views of a wavy sheet, µm, with poses and quality columns.
pub struct Views {
    folder: TempDir,
}

/// Height of the sheet.
fn height(x: f64, y: f64) -> f64 {
    40.0 * (x / 90.0).sin() * (y / 70.0).cos() + 15.0 * ((x + 2.0 * y) / 40.0).sin()
}

/// Where view `k` stands.
fn pose(k: usize) -> Isometry3 {
    let turn = Vector3::new(0.02 * k as f64, -0.03, 0.4 * k as f64);
    Isometry3::new(Vector3::new(250.0 * k as f64, 20.0 * k as f64, -500.0), turn)
}

/// World places of a view's points, with the numbers of its columns.
fn seen(k: usize) -> Vec<(Point3, [f64; 4])> {
    let middle = pose(k).translation.vector;
    let all = (0..SIDE).flat_map(|row| (0..SIDE).map(move |col| (row, col)));
    let point = |(row, col): (i32, i32)| {
        // Shifted by a part of the pitch, so that no point of one view falls on one of another.
        let along = |n: i32| PITCH * (f64::from(n) - 0.5 * f64::from(SIDE)) + 1.37 * (k as f64 + 1.0);
        let (x, y) = (middle.x + along(col), middle.y + along(row));
        let d_cal = (x - middle.x).hypot(y - middle.y) * 0.5;
        let place = Point3::new(x, y, height(x, y));
        (place, [0.01 - d_cal * 2e-5, d_cal, f64::from(row), f64::from(col)])
    };
    all.map(point).collect()
}

const COLUMNS: [&str; 4] = ["sigma_i", "d_cal", "row", "col"];

impl Views {
    pub fn new() -> Self {
        let views = Self { folder: tempfile::tempdir().expect("a folder") };
        std::fs::create_dir(views.path("views")).expect("a folder");
        for k in 0..3 {
            views.write_view(k, &COLUMNS, 1.0);
        }
        views.write("views.json", &poses_of(0..3).to_string());
        views.settings("");
        views
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a file of the test");
    }

    /// A view as text PLY with some of its columns, lengths times `scale`.
    pub fn write_view(&self, k: usize, columns: &[&str], scale: f64) {
        self.write(&format!("views/view_{k:02}.ply"), &view_text(k, columns, scale));
    }

    /// Settings of which some lines are others: `key = value` replaces the line of that key, anything else is added.
    pub fn settings(&self, more: &str) {
        let text = "schema = 1\nunit = \"um\"\n[views]\npattern = \"view_??.ply\"\nposes = \"views.json\"\n[registration]\nenabled = false\n";
        self.write("merge.toml", &format!("{text}{more}"));
    }

    pub fn run(&self, arguments: &[&str]) -> Ran {
        run_in(self.folder.path(), ["merge", "merge.toml"].iter().chain(arguments))
    }

    fn report(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.path(name)).expect(name)).expect("JSON")
    }

    /// Places, and the column of that name.
    fn cloud(&self, name: &str, column: &str) -> (Vec<Point3>, Vec<f32>) {
        let path = self.path(name);
        let bytes = std::fs::read(&path).expect(name);
        let cloud = read_cloud_in_its_unit(&bytes, &path, LengthUnit::Um, &RunContext::silent()).expect("a cloud");
        let column = cloud.scalar(column).unwrap_or_else(|| panic!("no column {column}")).to_vec();
        (cloud.positions, column)
    }
}

fn view_text(k: usize, columns: &[&str], scale: f64) -> String {
    let points = seen(k);
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len());
    for name in ["x", "y", "z"].iter().chain(columns) {
        let _ = writeln!(text, "property double {name}");
    }
    text.push_str("end_header\n");
    for (world, values) in points {
        let p = pose(k).inverse() * world * scale;
        let _ = write!(text, "{:?} {:?} {:?}", p.x, p.y, p.z);
        for name in columns {
            let at = COLUMNS.iter().position(|known| known == name).expect("a column");
            let _ = write!(text, " {:?}", values[at]);
        }
        text.push('\n');
    }
    text
}

fn pose_json(k: usize) -> Value {
    pose_json_of(k, &pose(k))
}

fn poses_of(indices: impl Iterator<Item = usize>) -> Value {
    json!({ "views": indices.map(pose_json).collect::<Vec<Value>>() })
}

#[test]
fn three_views_become_one_cloud_that_keeps_the_better_points() {
    let views = Views::new();
    views.settings("[mask]\nd_cal = { max = 150.0 }\n[merge]\nmetric = \"d_cal\"\nradius = 20.0\n");
    let ran = views.run(&[]);
    ran.assert_ended(0, &["written: ", "merged.json"]);
    let lines = ran.lines();
    assert!(lines.len() == 4 && lines[0].starts_with("view_00.ply\tmerged\t3600 read\t"), "{ran:?}");
    let report = views.report("merged.json");
    assert_eq!(
        (&report["schema"], &report["unit"], &report["metric"]),
        (&json!("shapeline-merge/1"), &json!("um"), &json!("d_cal"))
    );
    assert_eq!(report["d_s"], 20.0);
    // The sheet rises by up to 50 degrees: a grid of 10 µm stands for somewhat more on it.
    assert!((9.0..14.0).contains(&report["d_grid"].as_f64().unwrap()), "{report}");
    let (points, which) = views.cloud("merged.ply", "view");
    let (_, d_cal) = views.cloud("merged.ply", "d_cal");
    assert_eq!(report["points_out"], points.len());
    // By definition: better is a smaller d_cal, ties by view and index; the reader keeps d_cal as float.
    let mut all: Vec<(f32, usize, usize, Point3)> = Vec::new();
    for k in 0..3 {
        let kept: Vec<_> =
            seen(k).into_iter().enumerate().filter(|(_, (_, values))| values[1] as f32 <= 150.0).collect();
        assert_eq!(report["views"][k]["points_kept"], kept.len());
        assert_eq!(report["views"][k]["points_masked"], 3600 - kept.len());
        assert_eq!(report["views"][k]["masked_by"]["d_cal"], 3600 - kept.len());
        all.extend(kept.into_iter().map(|(index, (place, values))| (values[1] as f32, k, index, place)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut survivors: Vec<(f32, usize, usize, Point3)> = Vec::new();
    for point in all {
        if survivors.iter().all(|kept| (kept.3 - point.3).norm() > 20.0) {
            survivors.push(point);
        }
    }
    survivors.sort_by_key(|point| (point.1, point.2));
    assert_eq!(points.len(), survivors.len());
    for (k, expected) in survivors.iter().enumerate() {
        // There and back through a pose costs a few digits of 1e-16 x 1000 µm.
        assert!((points[k] - expected.3).norm() < 1e-10 && which[k] == expected.1 as f32 && d_cal[k] == expected.0);
    }
    for k in 0..3 {
        let out = survivors.iter().filter(|point| point.1 == k).count();
        assert!(out > 0 && report["views"][k]["points_out"] == out);
        assert_eq!(report["views"][k]["pose"]["t"], pose_json(k)["approx"]["t"]);
    }
}

#[test]
fn the_same_views_give_the_same_bytes_with_any_threads() {
    let views = Views::new();
    views.settings("[noise]\n[merge]\nmetric = [\"delta_n\", \"sigma_i\"]\n");
    let mut first: Option<(String, Vec<u8>, Vec<u8>)> = None;
    for (threads, name) in [("1", "a"), ("2", "b"), ("5", "c")] {
        let ran = views.run(&["--threads", threads, "--out", &format!("{name}.ply")]);
        ran.assert_ended(0, &[]);
        let told = ran.stdout.replace(&format!("{name}.ply"), "out.ply");
        let files =
            [format!("{name}.ply"), format!("{name}.json")].map(|file| std::fs::read(views.path(&file)).unwrap());
        let [cloud, report] = files;
        let this = (told, cloud, report);
        assert!(first.get_or_insert_with(|| this.clone()) == &this, "{threads} threads");
    }
    assert!(!views.path("merged.ply").exists());
    let (_, delta_n) = views.cloud("a.ply", "delta_n");
    // A wavy sheet is no plane: within 60 µm its normal turns by some tenths of a radian at most.
    assert!(delta_n.iter().all(|d| d.is_nan() || (0.0..0.8).contains(d)) && delta_n.iter().any(|d| *d > 0.02));
}

#[test]
fn distances_to_calibrated_features_are_those_of_the_file_or_computed() {
    let views = Views::new();
    let mut features = String::from("x,y,z,reprojection_px\n");
    // A line of features through the middle of every view's frame.
    for k in -40..=40 {
        let _ = writeln!(features, "{},0,500,0.{:02}", 10 * k, 40 + k);
    }
    views.write("camera.csv", &features);
    (0..3).for_each(|k| views.write_view(k, &["sigma_i"], 1.0));
    views.settings(
        "[calibration]\ncamera = \"camera.csv\"\n[mask]\nreprojection = { max = 0.6 }\n[merge]\nmetric = \"d_cal\"\n",
    );
    views.run(&[]).assert_ended(0, &[]);
    let (points, d_cal) = views.cloud("merged.ply", "d_cal");
    let (_, which) = views.cloud("merged.ply", "view");
    for ((place, d_cal), view) in points.iter().zip(&d_cal).zip(&which) {
        let in_view = pose(*view as usize).inverse() * place;
        let distance = |k: i32| (in_view - Point3::new(10.0 * f64::from(k), 0.0, 500.0)).norm();
        let nearest = (-40..=40).map(distance).fold(f64::INFINITY, f64::min);
        // The column is a float: 24 binary digits.
        assert!((f64::from(*d_cal) - nearest).abs() < 1e-6 * nearest + 1e-9, "{d_cal} {nearest}");
    }
    assert_eq!(views.report("merged.json")["calibration"]["camera"]["features"], 81);
}

#[test]
fn the_plain_mean_averages_places_and_columns() {
    let views = Views::new();
    views.settings("[merge]\nmetric = \"mean\"\nradius = 40.0\n");
    views.run(&[]).assert_ended(0, &[]);
    let (points, which) = views.cloud("merged.ply", "view");
    let (_, sigma) = views.cloud("merged.ply", "sigma_i");
    let area = |points: usize| points as f64 * 40.0 * 40.0;
    // Three patches of 600 µm side overlap: they cover more than one and less than all.
    assert!((360e3..1.6 * 1080e3).contains(&area(points.len())), "{}", points.len());
    assert!(which.contains(&-1.0) && [0.0, 1.0, 2.0].iter().all(|view| which.contains(view)));
    assert!(sigma.iter().all(|s| (0.0..=0.01).contains(s)));
}

/// A view that cannot be used is left out by name, and the rest is merged.
#[test]
fn views_that_are_broken_are_left_out_by_name() {
    let whole = view_text(1, &COLUMNS, 1.0);
    let html = "<!DOCTYPE html>\n<html><head><title>404</title></head></html>\n";
    let cut = &whole[..whole.len() / 2];
    let lies = whole.replacen("element vertex 3600", "element vertex 999999999999", 1);
    let without = view_text(1, &["d_cal", "row", "col"], 1.0);
    let masked = whole.replace("property double sigma_i", "property double sigma").replacen(
        "property double d_cal",
        "property double sigma_i",
        1,
    );
    let empty = String::new();
    for (what, text, words) in [
        ("a page", html, "view_01.ply"),
        ("cut off", cut, "view_01.ply"),
        ("a header that lies", &lies, "view_01.ply"),
        ("nothing", &empty, "view_01.ply"),
        ("no column", &without, "has no column sigma_i"),
        ("all masked", &masked, "the masks leave none of the 3600 points"),
    ] {
        let views = Views::new();
        views.settings("[mask]\nsigma_i = { max = 0.5 }\n[merge]\nmetric = \"sigma_i\"\n");
        views.write("views/view_01.ply", text);
        let ran = views.run(&[]);
        ran.assert_ended(1, &["warning: ", words]);
        assert!(ran.lines()[1].starts_with("view_01.ply\tleft out\t"), "{what}: {ran:?}");
        let report = views.report("merged.json");
        assert_eq!(
            (&report["views"][1]["status"], &report["views"][1]["pose"]),
            (&json!("left_out"), &Value::Null),
            "{what}"
        );
        assert!(report["views"][1]["reason"].as_str().unwrap().len() > 10, "{what}");
        // The other views keep their numbers.
        let (_, which) = views.cloud("merged.ply", "view");
        assert!(which.contains(&0.0) && which.contains(&2.0) && !which.contains(&1.0), "{what}");
    }
}

type Break = fn(&Views);

fn plain(views: &Views) {
    (0..3).for_each(|k| views.write_view(k, &[], 1.0));
}

#[test]
fn what_cannot_be_merged_is_told_with_place_and_help_and_leaves_no_file() {
    let faults: [(&str, Break, &[&str]); 18] = [
        (
            "a mask without its column",
            |v| {
                plain(v);
                v.settings("[mask]\nsigma_i = { min = 0.002 }\n[merge]\nmetric = \"delta_n\"\n")
            },
            &[
                "merge.toml:9: [mask] sigma_i: view_00.ply has no column sigma_i",
                "3 of 3 views",
                "delta_n needs nothing but",
            ],
        ),
        (
            "no quality columns",
            plain,
            &[
                "[merge] metric: view_00.ply has no column d_cal, and [calibration] names no camera features",
                "name the file of features",
            ],
        ),
        (
            "attenuation of nothing",
            |v| v.settings("[merge]\nmetric = \"attenuation\"\n"),
            &["has no column attenuation, and not both a and b"],
        ),
        (
            "one view",
            |v| (1..3).for_each(|k| std::fs::remove_file(v.path(&format!("views/view_{k:02}.ply"))).unwrap()),
            &["merge.toml:", "found one view only", "expected two or more", "a single cloud needs no merging"],
        ),
        (
            "no view",
            |v| v.write("merge.toml", "schema = 1\nunit = \"um\"\n[views]\npattern = \"scan*.ply\"\n"),
            &["merge.toml:3: [views] pattern: found no file", "check folder and pattern"],
        ),
        (
            "poses missing",
            |v| v.write("views.json", &poses_of(0..2).to_string()),
            &["views.json: found no pose of view_02.ply, expected one of each of the 3 views"],
        ),
        (
            "poses too many",
            |v| v.write("views.json", &poses_of(0..4).to_string()),
            &["views.json: views[3]: found a pose of index 3 for 3 views, expected 0 to 2"],
        ),
        (
            "a pose twice",
            |v| v.write("views.json", &poses_of([0, 1, 1, 2].into_iter()).to_string()),
            &["found two poses of index 1 (view_01.ply)"],
        ),
        ("poses that are a page", |v| v.write("views.json", "<html>"), &["views.json:1: found no JSON"]),
        (
            "a radius in another unit",
            |v| v.settings("[merge]\nradius = 20000.0\n"),
            &["merge.toml:9: [merge] radius: found 20000 um, more than the views' size of", "check `unit` (um)"],
        ),
        (
            "a radius of nothing",
            |v| v.settings("[merge]\nradius = 0.01\n"),
            &["[merge] radius: found 0.01 um, which merges nothing", "(about a thousandth"],
        ),
        (
            "poses in another unit",
            |v| {
                let mut poses = poses_of(0..3);
                for (k, view) in poses["views"].as_array_mut().unwrap().iter_mut().enumerate() {
                    view["approx"]["t"] = json!([250e6 * k as f64, 0.0, 0.0]);
                }
                v.write("views.json", &poses.to_string());
            },
            &["views.json: the poses put the 3 views", "check `unit` (um)"],
        ),
        (
            "a view in another unit",
            |v| v.write_view(1, &["d_cal"], 1e-3),
            &["view_01.ply measures", "(about a thousandth", "export this one again"],
        ),
        (
            "features in another unit",
            |v| {
                v.write("camera.csv", "x,y,z,reprojection_px\n-0.4,0,0.5,0.1\n0.4,0,0.5,0.2\n0,0.4,0.5,0.2\n");
                v.settings("[calibration]\ncamera = \"camera.csv\"\n");
            },
            &["[calibration]: the features of camera.csv measure", "(about a thousandth"],
        ),
        (
            "every view broken",
            |v| (0..3).for_each(|k| v.write(&format!("views/view_{k:02}.ply"), "<html>")),
            &["view_00.ply", "3 of 3 views cannot be used"],
        ),
        (
            "two of three broken",
            |v| (1..3).for_each(|k| v.write(&format!("views/view_{k:02}.ply"), "<html>")),
            &["view_01.ply", "2 of 3 views cannot be used", "expected two or more"],
        ),
        (
            "settings with errors",
            |v| v.settings("[merge]\nmetric = \"dcal\"\nradius_um = 3\n"),
            &[
                "merge.toml:9: [merge] metric: found \"dcal\"",
                "did you mean \"d_cal\"?",
                "merge.toml:10: [merge]: unknown key",
            ],
        ),
        ("too little memory", |_| {}, &["more than the limit of"]),
    ];
    for (what, fault, words) in faults {
        let views = Views::new();
        fault(&views);
        let limit = if what == "too little memory" { "100KiB" } else { "1GiB" };
        let ran = views.run(&["--memory-limit", limit]);
        ran.assert_ended(2, &["error: ", "help: "]);
        for word in words {
            assert!(ran.stderr.contains(word), "{what}: no \"{word}\" in {}", ran.stderr);
        }
        assert!(
            ran.stdout.is_empty() && !views.path("merged.ply").exists() && !views.path("merged.json").exists(),
            "{what}"
        );
    }
}

#[test]
fn a_feature_of_another_size_than_the_views_is_warned_of() {
    let views = Views::new();
    views.settings("[[feature]]\nkind = \"cylinder\"\nradius = 1001500.0\n");
    let ran = views.run(&[]);
    ran.assert_ended(0, &["warning: the radius of cylinder 1 is 1001500 um and the views measure"]);
    // A wavy sheet is no cylinder either.
    assert_eq!(views.report("merged.json")["warnings"].as_array().unwrap().len(), 2);
    let quiet = views.run(&["--quiet"]);
    assert!(quiet.stderr.is_empty(), "{quiet:?}");
}

#[test]
fn files_that_cannot_be_written_are_told_before_anything_is_read() {
    let views = Views::new();
    std::fs::create_dir(views.path("taken.ply")).unwrap();
    for (out, words) in [("none/merged.ply", "the folder does not exist"), ("taken.ply", "a folder has this name")] {
        views.run(&["--out", out]).assert_ended(2, &[words, "--out"]);
    }
    views.settings("[output]\nfile = \"m.ply\"\nreport = \"m.ply\"\n");
    views.run(&[]).assert_ended(2, &["would be one file"]);
    assert!(Path::new(&views.path("views.json")).exists());
}

#[test]
fn empty_pixels_are_skipped_and_counted() {
    let views = Views::new();
    let mut text = view_text(0, &COLUMNS, 1.0).replacen("element vertex 3600", "element vertex 3603", 1);
    text.push_str("nan nan nan 0 0 0 0\n0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n");
    views.write("views/view_00.ply", &text);
    views.run(&[]).assert_ended(0, &[]);
    let view = &views.report("merged.json")["views"][0];
    assert_eq!(
        (&view["points_read"], &view["points_invalid"], &view["points_kept"]),
        (&json!(3603), &json!(3), &json!(3600))
    );
}

/// Poses off by up to 9.4 µm and a degree, as a stage's may be; the settings tell so.
#[test]
fn views_are_registered_on_their_overlaps() {
    let views = Views::new();
    let mut poses = poses_of(0..3);
    for (k, view) in poses["views"].as_array_mut().unwrap().iter_mut().enumerate() {
        let off = Isometry3::new(
            Vector3::new(0.0, 8.0, -5.0) * k as f64 * 0.5,
            Vector3::new(0.004, -0.004, 0.006) * k as f64,
        );
        *view = pose_json_of(k, &(pose(k) * off));
    }
    views.write("views.json", &poses.to_string());
    let text = std::fs::read_to_string(views.path("merge.toml"))
        .unwrap()
        .replace("enabled = false", "enabled = true\ntranslation_sigma = 10.0\nrotation_sigma_deg = 1.0");
    views.write("merge.toml", &text);
    let ran = views.run(&[]);
    ran.assert_ended(0, &[]);
    let report = views.report("merged.json");
    let found: Vec<Isometry3> = (0..3).map(|k| read_pose(&report["views"][k]["pose"])).collect();
    for k in 1..3 {
        let (true_way, way) = (pose(0).inverse() * pose(k), found[0].inverse() * found[k]);
        let middle = Point3::new(0.0, 0.0, 500.0);
        let off = (way * middle - true_way * middle).norm();
        // Views without noise, of a sheet whose bends (wavelength 250 µm and more) patches of some pitches smooth: a fifth of the pitch.
        assert!(off < 0.2 * PITCH, "view {k} is off by {off} µm");
    }
    let pairs = report["pairs"].as_array().unwrap();
    assert!(pairs.iter().filter(|pair| pair["used"] == true).count() >= 2, "{pairs:?}");
    assert!(pairs.iter().all(|pair| pair["rms"].as_f64().is_none_or(|rms| rms < 0.5 * PITCH)), "{pairs:?}");
}

fn pose_json_of(index: usize, pose: &Isometry3) -> Value {
    let r = pose.rotation.to_rotation_matrix();
    let rows: Vec<[f64; 3]> = (0..3).map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]]).collect();
    let t: [f64; 3] = pose.translation.vector.into();
    json!({"index": index, "approx": {"R": rows, "t": t}})
}

pub fn read_pose(value: &Value) -> Isometry3 {
    let numbers = |v: &Value| -> Vec<f64> { v.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect() };
    let rows: Vec<Vec<f64>> = value["R"].as_array().unwrap().iter().map(numbers).collect();
    let m = |i: usize| Vector3::new(rows[0][i], rows[1][i], rows[2][i]);
    let basis = nalgebra::UnitQuaternion::from_basis_unchecked(&[m(0), m(1), m(2)]);
    Isometry3::from_parts(Vector3::from_vec(numbers(&value["t"])).into(), basis)
}

/// A view 5 mm away fits nowhere: left out by name, or nothing is left to merge.
#[test]
fn views_without_overlap_are_left_out_by_name() {
    let views = Views::new();
    let mut poses = poses_of(0..3);
    poses["views"][2]["approx"]["t"] = json!([5000.0, 0.0, -500.0]);
    views.write("views.json", &poses.to_string());
    let on = std::fs::read_to_string(views.path("merge.toml")).unwrap().replace("enabled = false", "enabled = true");
    views.write("merge.toml", &on);
    let ran = views.run(&[]);
    ran.assert_ended(1, &[]);
    assert!(ran.lines()[2].starts_with("view_02.ply\tleft out\t"), "{ran:?}");
    std::fs::remove_file(views.path("views/view_01.ply")).unwrap();
    std::fs::rename(views.path("views/view_02.ply"), views.path("views/view_01.ply")).unwrap();
    let two = json!({"views": [poses["views"][0], {"index": 1, "approx": poses["views"][2]["approx"]}]});
    views.write("views.json", &two.to_string());
    std::fs::remove_file(views.path("merged.ply")).unwrap();
    views.run(&[]).assert_ended(2, &["expected two or more to merge", "views must overlap"]);
    assert!(!views.path("merged.ply").exists());
}
