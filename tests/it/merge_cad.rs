//! Views that are pre-aligned by the CAD.

use crate::project::{Ran, run_in};
use serde_json::Value;
use shapeline::geometry::{CadFromScan, Isometry3, Point3, Vector3};
use shapeline::io::write_stl;
use shapeline::plan::Side;
use shapeline::run::RunContext;
use shapeline::simulate::{BracketParameters, Label, PoseChoice, RigModel, Subject, bracket, simulate_scan};
use std::fmt::Write as _;
use tempfile::TempDir;

const NOISE_MM: f64 = 0.05;

/// A bracket as some views saw it from above, each in a frame of its own: part `share` of its length, told from one end.
fn folder_of(seeds: &[u64], share: f64) -> (TempDir, Vec<Isometry3>) {
    let nominal = bracket(&BracketParameters::default());
    let bounds = nominal.mesh.bounds().expect("a part");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("views")).expect("a folder");
    let mut stl = Vec::new();
    write_stl(&mut stl, &nominal.mesh).expect("bytes");
    std::fs::write(folder.path().join("part.stl"), stl).expect("a file");
    let subject = Subject::perfect(&nominal);
    let rig = RigModel { noise_depth_mm: NOISE_MM, ..RigModel::default().with_density(4.0) };
    let mut truths = Vec::new();
    for (k, seed) in seeds.iter().enumerate() {
        let pose = PoseChoice::side(&subject, Side::Top);
        let scan = simulate_scan(&subject, &rig, &pose, *seed, &RunContext::silent()).expect("not cancelled");
        let cad_from_scan = *CadFromScan::try_from_row_major(&scan.truth.cad_from_scan).expect("a pose").isometry();
        let is_seen = |p: &Point3| {
            let along = (cad_from_scan * p).x - bounds.min.x;
            let length = bounds.max.x - bounds.min.x;
            if k % 2 == 0 { along <= share * length } else { along >= (1.0 - share) * length }
        };
        let points: Vec<Point3> = (scan.cloud.positions.iter().zip(&scan.labels))
            .filter(|(p, label)| **label == Label::Part && is_seen(p))
            .map(|(p, _)| *p)
            .collect();
        // The sensor stands in the origin of a view.
        let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len() as f64;
        let shift = rig.view_direction.into_inner() * rig.distance_mm - middle;
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
            points.len()
        );
        points.iter().map(|p| p + shift).for_each(|p| {
            let _ = writeln!(text, "{} {} {}", p.x, p.y, p.z);
        });
        std::fs::write(folder.path().join(format!("views/v_{k}.ply")), text).expect("a file");
        truths.push(cad_from_scan * Isometry3::translation(-shift.x, -shift.y, -shift.z));
    }
    let settings = "schema = 1\nunit = \"mm\"\n[views]\nprealign = \"cad\"\n[cad]\nfile = \"part.stl\"\n[registration]\nenabled = false\n[merge]\nmetric = \"delta_n\"\n";
    std::fs::write(folder.path().join("merge.toml"), settings).expect("a file");
    (folder, truths)
}

fn merge(folder: &TempDir) -> Ran {
    run_in(folder.path(), ["merge", "merge.toml"].iter())
}

#[test]
fn views_that_show_most_of_the_part_are_placed_by_the_cad() {
    let (folder, truths) = folder_of(&[11, 12], 0.85);
    merge(&folder).assert_ended(0, &[]);
    let report: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("merged.json")).expect("a report")).unwrap();
    for (k, truth) in truths.iter().enumerate() {
        let found = crate::merge::read_pose(&report["views"][k]["pose"]);
        // The far corners of a part that some ten thousand points of 0.05 mm hold, a tenth of their variance in common over 10 mm: some hundredths.
        for corner in [[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [0.0, 100.0, 0.0]].map(Point3::from) {
            let off = (found * truth.inverse() * corner - corner).norm();
            assert!(off < 0.1, "view {k} is off by {off} mm");
        }
    }
}

/// Nothing is left to begin with, which must not look like a merge in the CAD's frame.
#[test]
fn views_that_show_too_little_of_it_are_told() {
    let (folder, _) = folder_of(&[11, 12], 0.3);
    let text =
        std::fs::read_to_string(folder.path().join("merge.toml")).unwrap().replace("enabled = false", "enabled = true");
    std::fs::write(folder.path().join("merge.toml"), text).unwrap();
    merge(&folder)
        .assert_ended(2, &["the CAD places none of the views; v_0.ply: by the CAD:", "give poses for smaller ones"]);
    assert!(!folder.path().join("merged.ply").exists());
}

#[test]
fn a_view_that_the_cad_does_not_place_is_told() {
    let (folder, _) = folder_of(&[11, 12, 13], 0.85);
    let (small, _) = folder_of(&[14], 0.3);
    std::fs::copy(small.path().join("views/v_0.ply"), folder.path().join("views/v_3.ply")).unwrap();
    merge(&folder).assert_ended(1, &["the CAD places 3 of 4 views", "v_3.ply: by the CAD:"]);
}
