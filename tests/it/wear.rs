//! `shapeline merge` with an earlier cloud and features, and `shapeline mask-study`, on simulated views of the endoscope.

use super::project::run_in;
use serde_json::Value;
use shapeline::geometry::{LengthUnit, Point3};
use shapeline::io::read_cloud_in_its_unit;
use shapeline::run::RunContext;
use shapeline::simulate::endoscope::{Pocket, PriorError, Scene, write_dataset};
use std::path::Path;

/// A stage of some µm.
const STAGE: PriorError = PriorError { shift: 5.0, turn_rad: 0.0005 };

/// Writes the cylinder's views, with a worn pocket or without, into a folder.
pub fn dataset(folder: &Path, seed: u64, worn: bool) {
    let mut scene = Scene::cylinder(STAGE, seed);
    if worn {
        let centre = Point3::new(-450.0, 0.0, 1001.5);
        scene.surface.pockets.push(Pocket { centre, radius: 220.0, flat: 0.7, depth: 40.0 });
    }
    write_dataset(folder, &scene, &RunContext::silent()).expect("the dataset is written");
}

pub fn add(file: &Path, after: &str, line: &str) {
    let text = std::fs::read_to_string(file).expect("settings");
    assert!(text.contains(after));
    std::fs::write(file, text.replace(after, &format!("{after}{line}"))).expect("settings");
}

#[test]
fn a_worn_tool_is_told_from_what_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let (old, new) = (folder.path().join("old"), folder.path().join("new"));
    dataset(&old, 1, false);
    dataset(&new, 1, true);
    let first = run_in(folder.path(), ["merge", "old/merge.toml", "--quiet"]);
    assert_eq!(first.code, Some(0), "{}", first.stderr);
    assert!(first.stdout.contains("cylinder 1\tbefore: d_r "), "{}", first.stdout);
    let output = "report = \"merge.json\"\n";
    add(&new.join("merge.toml"), output, "compare_with = \"../old/merged.ply\"\nreport_pdf = \"merge.pdf\"\n");
    let second = run_in(folder.path(), ["merge", "new/merge.toml", "--quiet"]);
    assert_eq!(second.code, Some(0), "{}", second.stderr);
    assert!(second.stdout.contains("wear\t1 regions differ"), "{}", second.stdout);
    let report: Value =
        serde_json::from_slice(&std::fs::read(new.join("merge.json")).expect("a report")).expect("JSON");
    let region = &report["wear"]["regions"][0];
    let number = |of: &Value| of.as_f64().expect("a number");
    // One calibration: smooth errors cancel but for where the stage put the views. Four standard uncertainties.
    assert!((number(&region["extreme"]) + 40.0).abs() < 4.0 * number(&region["extreme_u"]), "{region}");
    assert!((number(&region["centre"][0]) + 450.0).abs() < 60.0, "{region}");
    let bytes = std::fs::read(new.join("merged.ply")).expect("a cloud");
    let cloud = read_cloud_in_its_unit(&bytes, Path::new("merged.ply"), LengthUnit::Um, &RunContext::silent());
    let cloud = cloud.expect("it can be read");
    let difference = cloud.scalar("difference").expect("a column");
    let missing = difference.iter().filter(|d| d.is_nan()).count() as u64;
    assert_eq!(report["wear"]["not_measured"], missing);
    assert!(cloud.scalar("difference_u").is_some());
    assert!(std::fs::read(new.join("merge.pdf")).expect("a PDF").starts_with(b"%PDF-"));
    let fitted = &report["features"][0]["after"];
    assert!(number(&fitted["d_r"]).abs() < 15.0 && number(&fitted["sigma_dev"]) < 10.0, "{fitted}");
}

#[test]
fn an_earlier_cloud_of_nothing_leaves_the_merge_and_tells_no_wear() {
    let folder = tempfile::tempdir().expect("a folder");
    dataset(folder.path(), 2, false);
    std::fs::write(folder.path().join("old.txt"), "x y z\n1 2 3\n4 5 6\n").expect("a file");
    let settings = folder.path().join("merge.toml");
    add(&settings, "report = \"merge.json\"\n", "compare_with = \"old.txt\"\n");
    let ran = run_in(folder.path(), ["merge", "merge.toml"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    let line = ran.stdout.lines().find(|line| line.starts_with("wear\t")).unwrap_or_default();
    assert!(line.starts_with("wear\tnot told\t") && line.contains("compare_with: old.txt"), "{}", ran.stdout);
    assert!(line.contains("2 points"), "{line}");
    assert!(folder.path().join("merged.ply").exists() && folder.path().join("merge.json").exists());
}

#[test]
fn a_study_of_masks_writes_its_table_and_plots() {
    let folder = tempfile::tempdir().expect("a folder");
    dataset(folder.path(), 3, false);
    let ran = run_in(folder.path(), ["mask-study", "merge.toml", "--quiet"]);
    assert!(ran.code < Some(2), "{}", ran.stderr);
    let lines: Vec<&str> = ran.stdout.lines().collect();
    // All nine: b, sigma_i, d_cal, d_cal_projector and reprojection are in the files, the others are computed.
    assert_eq!(lines.len(), 9, "{}", ran.stdout);
    assert!(lines.iter().any(|l| l.starts_with("cylinder 1\td_cal\t")), "{}", ran.stdout);
    let table = std::fs::read_to_string(folder.path().join("mask-study.csv")).expect("a table");
    assert!(table.lines().count() > 100 && table.contains(",mask\n"), "{}", &table[..400]);
    let plots = std::fs::read(folder.path().join("mask-study.pdf")).expect("plots");
    assert!(plots.starts_with(b"%PDF-"));
    // Twice the same.
    run_in(folder.path(), ["mask-study", "merge.toml", "--quiet", "--out", "again", "--threads", "1"]);
    assert_eq!(std::fs::read(folder.path().join("again.pdf")).expect("plots"), plots);
    let settings = folder.path().join("merge.toml");
    let text = std::fs::read_to_string(&settings).expect("settings");
    let (before, _) = text.split_once("[[feature]]").expect("a feature");
    std::fs::write(&settings, before).expect("settings");
    let none = run_in(folder.path(), ["mask-study", "merge.toml"]);
    assert!(none.code == Some(2) && none.stderr.contains("no [[feature]]"), "{}", none.stderr);
}
