//! `shapeline merge` and `mask-study`: which files are read and which are written, and that none is lost.

use super::merge::Views;
use super::project::{Ran, run_in};
use serde_json::{Value, json};
use shapeline::geometry::{LengthUnit, Point3};
use shapeline::io::{Numbers, write_ply_points};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Every file of a folder and those below, with its bytes.
fn all_files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() && !path.is_symlink() {
            files.extend(all_files(&path));
        } else if path.is_file() {
            files.insert(path.clone(), std::fs::read(&path).expect("a file"));
        }
    }
    files
}

/// A cloud as a merge writes it, of the points of a grid of 20 by 20.
fn merged_cloud(pitch: f64, unit: LengthUnit) -> Vec<u8> {
    let points: Vec<Point3> =
        (0..400).map(|k| Point3::new(pitch * f64::from(k % 20), pitch * f64::from(k / 20), 0.0)).collect();
    let mut bytes = Vec::new();
    let view = vec![0; points.len()];
    write_ply_points(&mut bytes, &points, unit, &[("view", Numbers::Int(&view))]).expect("memory takes it");
    bytes
}

const FEATURE: &str = "[[feature]]\nkind = \"plane\"\n";

fn study(views: &Views, arguments: &[&str]) -> Ran {
    run_in(&views.path(""), ["mask-study", "merge.toml"].iter().chain(arguments))
}

#[test]
fn nothing_that_is_read_is_overwritten() {
    let views = Views::new();
    views.write("camera.csv", "x,y,z,reprojection_px\n-400,0,500,0.1\n400,0,500,0.2\n0,400,500,0.2\n");
    std::fs::copy(views.path("views/view_00.ply"), views.path("old.ply")).unwrap();
    let cases: [(&str, &[&str], &[&str]); 13] = [
        // The report lies beside the cloud and has its name.
        ("", &["--out", "views.ply"], &["views.json: the report would overwrite the poses"]),
        ("", &["--out", "merge.toml"], &["merge.toml: the cloud is written as PLY", "end the name with .ply"]),
        (
            "",
            &["--out", "views/view_01.ply"],
            &["view_01.ply: the cloud would overwrite a view", "nothing was written"],
        ),
        ("[output]\nfile = \"views/view_02.ply\"\n", &[], &["the cloud would overwrite a view"]),
        ("[output]\nfile = \"views/../views/view_02.ply\"\n", &[], &["the cloud would overwrite a view"]),
        ("[output]\nreport = \"views.json\"\n", &[], &["views.json: the report would overwrite the poses"]),
        ("[output]\nreport_pdf = \"merge.toml\"\n", &[], &["the report as PDF would overwrite the settings"]),
        ("[output]\ncompare_with = \"old.ply\"\nreport = \"old.ply\"\n", &[], &["overwrite the earlier cloud"]),
        ("[output]\ncompare_with = \"old.ply\"\n", &["--out", "old.ply"], &["the cloud would overwrite the earlier"]),
        (
            "[calibration]\ncamera = \"camera.csv\"\n[output]\nreport = \"camera.csv\"\n",
            &[],
            &["the report would overwrite the camera's calibration"],
        ),
        ("[output]\nreport = \"./merged.ply\"\n", &[], &["the cloud and the report would be one file, expected two"]),
        (
            "[output]\nreport = \"m.txt\"\nreport_pdf = \"views/../m.txt\"\n",
            &[],
            &["the report and the report as PDF would be one file"],
        ),
        ("[output]\nfile = \"merged.stl\"\n", &[], &["[output] file: found \"merged.stl\"", "ends with .ply"]),
    ];
    for (more, arguments, words) in cases {
        views.settings(more);
        let before = all_files(&views.path(""));
        let ran = views.run(arguments);
        ran.assert_ended(2, words);
        assert!(ran.stdout.is_empty() && all_files(&views.path("")) == before, "{more} {arguments:?}");
    }
    #[cfg(unix)]
    {
        views.settings("");
        let view = std::fs::read(views.path("views/view_00.ply")).unwrap();
        std::os::unix::fs::symlink(views.path("views"), views.path("link")).unwrap();
        views.run(&["--out", "link/view_00.ply"]).assert_ended(2, &["the cloud would overwrite a view"]);
        assert_eq!(std::fs::read(views.path("views/view_00.ply")).unwrap(), view);
    }
    // A study's table and plots.
    let calibrated =
        format!("[calibration]\ncamera = \"camera.csv\"\n{FEATURE}[output]\nreport_pdf = \"mask-study.pdf\"\n");
    views.settings(&calibrated);
    let before = all_files(&views.path(""));
    study(&views, &["--out", "camera"]).assert_ended(2, &["the table would overwrite the camera's calibration"]);
    study(&views, &[]).assert_ended(2, &["the plots would overwrite the report as PDF"]);
    study(&views, &["--out", "none/da"]).assert_ended(2, &["none/da.csv: cannot write, the folder does not exist"]);
    assert_eq!(all_files(&views.path("")), before);
    study(&views, &["--out", "masks-2026.03"]);
    assert!(views.path("masks-2026.03.csv").is_file() && views.path("masks-2026.03.pdf").is_file());
}

/// Clouds of the merges before lie among the views: the one that is written anew is passed over, others are told, and none shifts the poses.
#[test]
fn a_merged_cloud_is_never_taken_for_a_view() {
    let views = Views::new();
    let settings = std::fs::read_to_string(views.path("merge.toml")).unwrap().replace("view_??.ply", "*.ply");
    views.write("merge.toml", &settings);
    views.run(&["--out", "views/tool.ply"]).assert_ended(0, &[]);
    let first = std::fs::read(views.path("views/tool.ply")).unwrap();
    let again = views.run(&["--out", "views/tool.ply"]);
    again.assert_ended(0, &[]);
    assert!(!again.stderr.contains("warning") && std::fs::read(views.path("views/tool.ply")).unwrap() == first);
    let other = views.run(&["--out", "other.ply"]);
    other.assert_ended(0, &["warning: tool.ply is a cloud that a merge has written, no view: left out"]);
    assert_eq!(std::fs::read(views.path("other.ply")).unwrap(), first);
    let report: Value = serde_json::from_slice(&std::fs::read(views.path("other.json")).unwrap()).unwrap();
    assert_eq!(report["views"].as_array().unwrap().len(), 3);
    assert_eq!(report["warnings"], json!(["tool.ply is a cloud that a merge has written, no view: left out"]));
    // With it alone there is nothing to merge, and it says why.
    (0..3).for_each(|k| std::fs::remove_file(views.path(&format!("views/view_{k:02}.ply"))).unwrap());
    views.run(&[]).assert_ended(2, &["found no file", "clouds that a merge has written lie there"]);
}

#[test]
fn the_same_view_twice_counts_once() {
    let views = Views::new();
    std::fs::copy(views.path("views/view_00.ply"), views.path("views/view_01.ply")).unwrap();
    let ran = views.run(&[]);
    ran.assert_ended(1, &["view_01.ply: the same bytes as view_00.ply", "remove one of the two"]);
    assert!(ran.lines()[1].starts_with("view_01.ply\tleft out\tview_01.ply: the same bytes as view_00.ply"), "{ran:?}");
    views.settings(FEATURE);
    study(&views, &[]).assert_ended(1, &["view_01.ply: the same bytes as view_00.ply"]);
}

/// An earlier cloud that is none, or in another unit, ends the merge before a view is read; one that lies elsewhere costs the wear alone.
#[test]
fn a_bad_earlier_cloud_is_told_first_and_never_costs_the_merge() {
    let views = Views::new();
    views.settings("[output]\ncompare_with = \"old.ply\"\nreport_pdf = \"m.pdf\"\n");
    let write = |bytes: &[u8]| std::fs::write(views.path("old.ply"), bytes).unwrap();
    // Views that would be told were they read.
    let view = std::fs::read(views.path("views/view_01.ply")).unwrap();
    views.write("views/view_01.ply", "<html>");
    for (bytes, words) in [
        (merged_cloud(0.01, LengthUnit::Mm), "[output] compare_with: lengths of old.ply are in mm, expected um"),
        (b"<html>".to_vec(), "old.ply"),
        (view[..view.len() / 2].to_vec(), "old.ply"),
    ] {
        write(&bytes);
        let ran = views.run(&[]);
        ran.assert_ended(2, &[words, "help: "]);
        assert!(!ran.stderr.contains("view_01.ply") && !views.path("merged.ply").exists(), "{ran:?}");
    }
    std::fs::write(views.path("views/view_01.ply"), view).unwrap();
    write(&merged_cloud(10_000.0, LengthUnit::Um));
    let ran = views.run(&[]);
    ran.assert_ended(1, &["warning: no wear is told: [output] compare_with: old.ply: ", "of the same tool"]);
    assert!(ran.lines().iter().any(|line| line.starts_with("wear\tnot told\t[output] compare_with: ")), "{ran:?}");
    assert!(ran.lines()[2].starts_with("view_02.ply\tmerged\t"), "{ran:?}");
    assert!(views.path("merged.ply").is_file() && views.path("m.pdf").is_file());
    let report: Value = serde_json::from_slice(&std::fs::read(views.path("merged.json")).unwrap()).unwrap();
    let wear = &report["wear"];
    assert!(wear["compare_with"] == "old.ply" && wear["reason"].as_str().unwrap().contains("old.ply: "), "{wear}");
    assert!(wear.get("regions").is_none(), "{wear}");
}

/// A disk that takes the reports and not the cloud: nothing new is there, and what was there belongs together.
#[test]
#[cfg(unix)]
fn where_the_disk_is_full_the_files_of_before_stay_together() {
    let views = Views::new();
    let settings =
        |radius: &str| views.settings(&format!("[output]\nreport_pdf = \"m.pdf\"\n[merge]\nradius = {radius}\n"));
    // Every point stays, 36 bytes each: 389 kB. A file may have 300 blocks of 512 or of 1024 bytes.
    settings("0.1");
    let full = |what: &str| {
        let limited = format!("ulimit -f 300; exec {} merge merge.toml", env!("CARGO_BIN_EXE_shapeline"));
        let output =
            std::process::Command::new("sh").args(["-c", &limited]).current_dir(views.path("")).output().unwrap();
        let words = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && words.contains("merged.ply: cannot write"), "{what}: {words}");
    };
    let before = all_files(&views.path(""));
    full("nothing before");
    assert_eq!(all_files(&views.path("")), before);
    settings("40.0");
    views.run(&[]).assert_ended(0, &[]);
    settings("0.1");
    let before = all_files(&views.path(""));
    assert!(before.contains_key(&views.path("m.pdf")) && before.contains_key(&views.path("merged.ply")));
    full("files of before");
    assert_eq!(all_files(&views.path("")), before);
    views.run(&[]).assert_ended(0, &[]);
    assert!(std::fs::metadata(views.path("merged.ply")).unwrap().len() > 307_200);
}

/// Read is the sum of what became of the points; a judge that is no number, or infinite, is told by count.
#[test]
fn the_points_of_a_view_add_up_and_those_without_a_judge_are_counted() {
    let views = Views::new();
    let mut lines: Vec<String> =
        std::fs::read_to_string(views.path("views/view_00.ply")).unwrap().lines().map(str::to_owned).collect();
    let first = lines.iter().position(|line| line == "end_header").unwrap() + 1;
    for (k, value) in ["nan", "inf", "-inf"].iter().enumerate() {
        let mut words: Vec<String> = lines[first + k].split(' ').map(str::to_owned).collect();
        // x y z sigma_i d_cal row col
        words[4] = (*value).to_owned();
        lines[first + k] = words.join(" ");
    }
    for k in 3..8 {
        lines[first + k] = "nan nan nan 0 0 0 0".to_owned();
    }
    views.write("views/view_00.ply", &format!("{}\n", lines.join("\n")));
    views.settings("[mask]\nsigma_i = { min = 0.006 }\n[noise]\nsigmas = 1.0\n[density]\ncell = 15.0\n");
    let ran = views.run(&[]);
    ran.assert_ended(0, &[]);
    for line in &ran.lines()[..3] {
        let count = |word: &str| -> Option<usize> {
            line.split('\t').find_map(|part| part.strip_suffix(word)?.strip_suffix(' ')?.parse().ok())
        };
        let lost: usize = ["invalid", "masked", "noise", "averaged"].iter().filter_map(|word| count(word)).sum();
        assert_eq!(count("read").unwrap(), lost + count("kept").unwrap(), "{line}");
        assert!(count("noise") > Some(0) && count("averaged") > Some(0), "{line}");
    }
    assert!(ran.lines()[0].contains("\t5 invalid\t") && !ran.lines()[1].contains("invalid"), "{ran:?}");
    views.settings("");
    let ran = views.run(&[]);
    ran.assert_ended(0, &["warning: 3 of 10795 points have no d_cal: each stays only where no point that has is near"]);
    let report: Value = serde_json::from_slice(&std::fs::read(views.path("merged.json")).unwrap()).unwrap();
    assert_eq!([0, 1].map(|k| report["views"][k]["points_unjudged"].as_u64()), [Some(3), Some(0)]);
}

/// A feature of another kind than the views show: the fit is told with a warning.
#[test]
fn a_feature_of_another_kind_is_warned_of() {
    let views = Views::new();
    // The sheet's waves are 40 high and have no noise.
    views.settings(FEATURE);
    let ran = views.run(&[]);
    ran.assert_ended(0, &["warning: plane 1 does not fit: its points lie off it by ", "check its kind in [[feature]]"]);
    let report: Value = serde_json::from_slice(&std::fs::read(views.path("merged.json")).unwrap()).unwrap();
    assert!(report["warnings"][0].as_str().unwrap().starts_with("plane 1 does not fit: "), "{report}");
    let studied = study(&views, &[]);
    studied.assert_ended(1, &[]);
    assert!(!studied.stdout.contains(" leaves "), "{studied:?}");
}
