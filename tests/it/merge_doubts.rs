//! `shapeline merge` and `mask-study`: what is told of views and metrics that are not what they seem.

use super::merge::Views;
use super::project::run_in;
use shapeline::geometry::{Isometry3, Point3, Vector3};
use shapeline::run::RunContext;
use shapeline::simulate::endoscope::{PriorError, Scene, Shape, Station, Surface, facing, write_dataset};
use std::path::Path;

/// Six views of the pin, r = 1001.5 µm, and one of a cylinder of another radius whose crest lies where the pin's does.
fn pin(folder: &Path, radius: f64, seed: u64) {
    let mut scene = Scene::pin(PriorError { shift: 5.0, turn_rad: 0.0005 }, seed);
    let stands = |radius: f64| {
        let normal = Vector3::new(0.03, 0.02, 1.0).normalize();
        let crest = Point3::new(150.0, 0.0, radius - 200.0);
        facing(&crest, &normal, scene.sensor.working_distance, &Vector3::x(), 0.1)
    };
    let (world_from_view, claimed): (Isometry3, Isometry3) = (stands(radius), stands(1001.5));
    scene.other = Some(Surface::unworn(Shape::Cylinder { radius }));
    *scene.stations.last_mut().expect("seven stations") = Station { world_from_view, prior: claimed, is_wrong: true };
    write_dataset(folder, &scene, &RunContext::silent()).expect("the dataset is written");
}

/// It fits within every overlap, and stays; seven radii of one pin scatter by some µm.
#[test]
fn a_view_of_a_cylinder_of_another_radius_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    for (radius, is_named) in [(1060.0, true), (1001.5, false)] {
        pin(folder.path(), radius, 1);
        let ran = run_in(folder.path(), ["merge", "merge.toml"]);
        assert!(ran.code < Some(2), "{}", ran.stderr);
        let warned = ran.stderr.lines().filter(|line| line.contains("the radius of cylinder 1 is"));
        let warned: Vec<&str> = warned.collect();
        assert_eq!(warned.len(), usize::from(is_named), "{radius}: {}\n{}", ran.stdout, ran.stderr);
        assert!(warned.iter().all(|line| line.contains("view_06.ply") && line.contains("6 other views")), "{warned:?}");
    }
}

const FEATURE: &str = "[[feature]]\nkind = \"plane\"\n";

#[test]
fn a_study_of_delta_n_says_what_it_goes_by() {
    let views = Views::new();
    let study = |arguments: &[&str]| run_in(&views.path(""), ["mask-study", "merge.toml"].iter().chain(arguments));
    // This metric only, with the radii of the settings.
    let table = |radii: &str| {
        views.settings(&format!("{radii}{FEATURE}"));
        let ran = study(&["--metric", "delta_n", "--quiet"]);
        assert!(ran.code < Some(2) && ran.stderr.is_empty(), "{}", ran.stderr);
        assert!(ran.lines().len() == 1 && ran.lines()[0].starts_with("plane 1\tdelta_n\t"), "{}", ran.stdout);
        std::fs::read_to_string(views.path("mask-study.csv")).expect("a table")
    };
    let usual = table("");
    assert!(table("[delta_n]\nnormal_radius = 40.0\nmean_radius = 90.0\n") != usual);
    // A word that is none, and a metric that nobody can know.
    study(&["--metric", "deltan"]).assert_ended(2, &["expected one of b, attenuation"]);
    study(&["--metric", "b"]).assert_ended(2, &["view_00.ply has no column b", "delta_n needs nothing but the points"]);
    // Radii too small for the points: the metric is asked for, and its curve is neither left out in silence nor one of nothing.
    for radii in ["normal_radius = 4.0", "mean_radius = 4.0"] {
        views.settings(&format!("[delta_n]\n{radii}\n{FEATURE}"));
        let ran = study(&[]);
        assert!(ran.code < Some(2), "{}", ran.stderr);
        let told =
            "delta_n is not studied, 3 of 3 views do not know it: view_00.ply: delta_n cannot be told: too few points";
        assert!(ran.stderr.contains(told), "{}", ran.stderr);
        assert!(!ran.stdout.contains("\tdelta_n\t") && ran.stdout.contains("\td_cal\t"), "{}", ran.stdout);
        study(&["--metric", "delta_n"]).assert_ended(2, &["which stand 1", "make the radii of [delta_n] larger"]);
    }
    // A mask of a metric that only some views know.
    views.write_view(1, &["d_cal", "row", "col"], 1.0);
    views.settings(&format!("[mask]\nsigma_i = {{ min = 0.001 }}\n{FEATURE}"));
    let ran = study(&[]);
    assert!(
        ran.stderr.contains("sigma_i is not studied, 1 of 3 views do not know it: view_01.ply has no column"),
        "{}",
        ran.stderr
    );
    assert!(!ran.stdout.contains("\tsigma_i\t"), "{}", ran.stdout);
}

/// The column of a file goes before radii, and that is said.
#[test]
fn radii_that_are_not_used_are_told() {
    let views = Views::new();
    let text = std::fs::read_to_string(views.path("views/view_02.ply")).expect("a view");
    views.write("views/view_02.ply", &text.replace("property double sigma_i", "property double delta_n"));
    let study = |more: &str| {
        views.settings(&format!("{more}{FEATURE}"));
        run_in(&views.path(""), ["mask-study", "merge.toml", "--metric", "delta_n"])
    };
    let told =
        "[delta_n]: its radii are not used for 1 of 3 views, whose files have delta_n already (view_02.ply first)";
    assert!(study("[delta_n]\nmean_radius = 80.0\n").stderr.contains(told));
    assert!(!study("").stderr.contains("not used"));
}
