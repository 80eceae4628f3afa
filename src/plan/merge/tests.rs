//! `MERGE.toml` read as a whole: where values land, and the exact words for everything that can be wrong.

use super::*;
use crate::geometry::{LengthUnit, Point3};
use rand::{Rng, RngExt, SeedableRng};
use std::fmt::Write as _;
use std::path::Path;

const FULL: &str = include_str!("full_example.toml");

fn read_words(text: &str) -> Loaded {
    parse(text.as_bytes(), Path::new("merge.toml"))
}

fn words(problems: &[Diagnostic]) -> String {
    problems.iter().map(|p| format!("{p}\n")).collect()
}

/// The full example with one place changed.
fn changed(from: &str, to: &str) -> String {
    assert!(FULL.contains(from), "the example has no {from}");
    FULL.replacen(from, to, 1)
}

fn file(name: &str, line: usize) -> NamedFile {
    NamedFile { file: name.to_owned(), path: Path::new("job").join(name), line }
}

#[test]
fn every_value_of_the_full_example_lands_where_it_belongs() {
    let loaded = parse(FULL.as_bytes(), Path::new("job/merge.toml"));
    assert_eq!(words(&loaded.problems), "");
    let plan = loaded.plan.unwrap();
    assert_eq!((plan.path.as_path(), plan.unit, plan.sha256.len()), (Path::new("job/merge.toml"), LengthUnit::Um, 64));
    let views = ViewSettings {
        folder: file("views", 5),
        pattern: "view_??.ply".to_owned(),
        prealign: Prealign::Poses(file("views.json", 8)),
        sensor: Point3::new(0.0, 0.0, 500.0),
    };
    assert_eq!(plan.views, views);
    let sigma = Mask { metric: Metric::PhaseShiftVariation, min: 0.002, max: f64::INFINITY };
    let d_cal = Mask { metric: Metric::CalibrationDistance, min: f64::NEG_INFINITY, max: 150.0 };
    assert_eq!(plan.masks, [Placed { value: sigma, line: 12 }, Placed { value: d_cal, line: 13 }]);
    assert_eq!(plan.calibration.camera, Some(file("camera_features.csv", 16)));
    assert_eq!(plan.calibration.projector, Some(file("projector_features.csv", 17)));
    assert_eq!(plan.non_uniformity, NonUniformitySettings { normal_radius: Some(20.0), mean_radius: Some(50.0) });
    assert_eq!(plan.noise, Some(NoiseSettings { neighbours: 16, sigmas: 2.5 }));
    assert_eq!(plan.density, Some(DensitySettings { cell: Placed { value: 5.0, line: 28 } }));
    let registration =
        RegistrationSettings { enabled: true, translation_sigma: Some(500.0), rotation_sigma: Some(1f64.to_radians()) };
    assert_eq!(plan.registration, registration);
    assert_eq!(plan.merge.judge.value, Judge::Metrics(vec![Metric::CalibrationDistance]));
    assert_eq!(plan.merge.radius, Placed { value: MergeRadius::Grid(2.0), line: 37 });
    let feature = MergeFeature {
        name: "cylinder 1".to_owned(),
        kind: FeatureKind::Cylinder,
        radius: Some(1001.5),
        radius_u: 0.7,
        line: 39,
    };
    assert_eq!(plan.features, [feature]);
    assert_eq!(
        plan.output,
        MergeOutput {
            file: file("merged.ply", 45),
            compare_with: Some(file("merged_old.ply", 46)),
            report: Some(file("merge.json", 47)),
            report_pdf: Some(file("merge.pdf", 48)),
        }
    );
}

#[test]
fn a_short_file_gets_the_documented_defaults() {
    let loaded = parse(b"schema = 1\nunit = \"mm\"\n", Path::new("job/merge.toml"));
    assert_eq!(words(&loaded.problems), "");
    let plan = loaded.plan.unwrap();
    assert_eq!((plan.views.folder, plan.views.pattern.as_str()), (file("views", 1), "*.ply"));
    assert_eq!((plan.views.prealign, plan.views.sensor), (Prealign::None, Point3::origin()));
    assert_eq!((plan.masks, plan.noise, plan.density, plan.features), (vec![], None, None, vec![]));
    assert_eq!(plan.registration, RegistrationSettings::default());
    assert_eq!(plan.merge.judge.value, Judge::Metrics(vec![Metric::CalibrationDistance]));
    assert_eq!(plan.merge.radius.value, MergeRadius::Grid(2.0));
    assert_eq!(plan.output.file, file("merged.ply", 1));
    assert_eq!((plan.output.report, plan.output.report_pdf, plan.output.compare_with), (None, None, None));
    let named =
        parse(b"schema = 1\nunit = \"mm\"\n[views]\nposes = \"p.json\"\n[noise]\n", Path::new("job/merge.toml"));
    let plan = named.plan.unwrap();
    assert_eq!(plan.views.prealign, Prealign::Poses(file("p.json", 4)));
    assert_eq!(plan.noise, Some(NoiseSettings { neighbours: 12, sigmas: 3.0 }));
}

#[test]
fn judges_and_radii_are_read_in_all_their_forms() {
    let judge = |text: &str| {
        read_words(&changed("metric = \"d_cal\"", &format!("metric = {text}"))).plan.map(|p| p.merge.judge.value)
    };
    assert_eq!(judge("\"mean\""), Some(Judge::Mean));
    assert_eq!(judge("[\"mean\"]"), Some(Judge::Mean));
    let both = Judge::Metrics(vec![Metric::NonUniformity, Metric::Strength]);
    assert_eq!(judge("[\"delta_n\", \"b\"]"), Some(both));
    for metric in Metric::ALL {
        assert_eq!(judge(&format!("\"{}\"", metric.key())), Some(Judge::Metrics(vec![metric])));
    }
    let radius = read_words(&changed("radius_grid = 2.0", "radius = 40")).plan.unwrap().merge.radius.value;
    assert_eq!(radius, MergeRadius::Length(40.0));
    let cad = read_words(&changed(
        "prealign = \"poses\"\nposes = \"views.json\"",
        "prealign = \"cad\"\n[cad]\nfile = \"a.stl\"\n[views.x]",
    ));
    assert!(words(&cad.problems).contains("unknown key \"x\""), "{}", words(&cad.problems));
    let cad = read_words("schema = 1\nunit = \"um\"\nviews = { prealign = \"cad\" }\n[cad]\nfile = \"a.stl\"\n");
    let Prealign::Cad(cad) = cad.plan.unwrap().views.prealign else { panic!("by the CAD") };
    assert_eq!((cad.file.as_str(), cad.unit), ("a.stl", LengthUnit::Mm));
}

/// (what is tried, what the example holds, what is put there).
const CASES: &[(&str, &str, &str)] = &[
    ("no unit", "unit = \"um\" ", "#"),
    ("misspelt unit", "unit = \"um\" ", "unit = \"micron\" #"),
    ("no schema", "schema = 1", ""),
    ("other schema", "schema = 1", "schema = 2"),
    ("unknown table", "[calibration]", "[calibrate]"),
    ("table of a plan", "[calibration]", "[alignment]"),
    ("views twice", "[views]", "[[views]]"),
    ("folder as a number", "folder = \"views\"", "folder = 7"),
    ("folder in the network", "folder = \"views\"", "folder = \"//server/views\""),
    ("pattern with folder", "pattern = \"view_??.ply\"", "pattern = \"views/*.ply\""),
    ("misspelt prealign", "prealign = \"poses\"", "prealign = \"pose\""),
    ("no poses", "poses = \"views.json\"", ""),
    ("poses and none", "prealign = \"poses\"", "prealign = \"none\""),
    ("cad without a CAD", "prealign = \"poses\"\nposes = \"views.json\"", "prealign = \"cad\""),
    ("a CAD for nothing", "[calibration]", "[cad]\nfile = \"a.stl\"\n[calibration]"),
    ("a CAD without a file", "[calibration]", "[cad]\n[calibration]"),
    ("sensor of two numbers", "sensor = [0.0, 0.0, 500.0]", "sensor = [0.0, 500.0]"),
    ("key of another table", "sensor = [0.0, 0.0, 500.0]", "metric = \"b\""),
    ("misspelt metric in a mask", "sigma_i = { min = 0.002 }", "sigma = { min = 0.002 }"),
    ("background as a mask", "sigma_i = { min = 0.002 }", "a = { min = 0.002 }"),
    ("a mask of one number", "d_cal = { max = 150.0 }", "d_cal = 150.0"),
    ("a mask without bounds", "d_cal = { max = 150.0 }", "d_cal = {}"),
    ("a misspelt bound", "d_cal = { max = 150.0 }", "d_cal = { maximum = 150.0 }"),
    ("a bound as text", "d_cal = { max = 150.0 }", "d_cal = { max = \"150 um\" }"),
    ("bounds swapped", "d_cal = { max = 150.0 }", "d_cal = { min = 150.0, max = 10.0 }"),
    ("a bound that is no number", "d_cal = { max = 150.0 }", "d_cal = { max = nan }"),
    ("misspelt calibration", "camera = \"camera_features.csv\"", "kamera = \"camera_features.csv\""),
    ("mean radius too small", "mean_radius = 50.0", "mean_radius = 10.0"),
    ("a radius of nothing", "mean_radius = 50.0", "mean_radius = 0"),
    ("two neighbours", "neighbours = 16", "neighbours = 2"),
    ("half a neighbour", "neighbours = 16", "neighbours = 16.5"),
    ("sigmas below 0", "sigmas = 2.5", "sigmas = -1"),
    ("no cell", "cell = 5.0", ""),
    ("a cell of nothing", "cell = 5.0", "cell = 0"),
    ("truth as text", "enabled = true", "enabled = \"yes\""),
    ("a turn of a whole circle", "rotation_sigma_deg = 1.0", "rotation_sigma_deg = 360"),
    ("misspelt sigma", "translation_sigma = 500.0", "translation = 500.0"),
    ("misspelt judge", "metric = \"d_cal\"", "metric = \"dcal\""),
    ("unknown judge", "metric = \"d_cal\"", "metric = \"colour\""),
    ("the mean among others", "metric = \"d_cal\"", "metric = [\"d_cal\", \"mean\"]"),
    ("a judge twice", "metric = \"d_cal\"", "metric = [\"d_cal\", \"b\", \"d_cal\"]"),
    ("no judge", "metric = \"d_cal\"", "metric = []"),
    ("a number as judge", "metric = \"d_cal\"", "metric = 3"),
    ("a number in the list of judges", "metric = \"d_cal\"", "metric = [\"b\", 3]"),
    ("both radii", "radius_grid = 2.0", "radius_grid = 2.0\nradius = 40.0"),
    ("a multiple of nothing", "radius_grid = 2.0", "radius_grid = 0"),
    ("misspelt radius", "radius_grid = 2.0", "grid_radius = 2.0"),
    ("unit in a key", "radius_grid = 2.0", "radius_um = 40.0"),
    ("a feature of another kind", "kind = \"cylinder\"", "kind = \"cone\""),
    ("a plane with a radius", "kind = \"cylinder\"", "kind = \"plane\""),
    ("a feature without kind", "kind = \"cylinder\"", ""),
    ("a feature in single brackets", "[[feature]]", "[feature]"),
    ("diameter for radius", "radius = 1001.5", "diameter = 2003.0"),
    ("uncertainty below 0", "radius_u = 0.7", "radius_u = -0.7"),
    ("comparison with itself", "compare_with = \"merged_old.ply\"", "compare_with = \"merged.ply\""),
    ("misspelt output", "report = \"merge.json\"", "reports = \"merge.json\""),
    ("decimal comma", "radius_u = 0.7", "radius_u = 0,7"),
    ("open quote", "file = \"merged.ply\"", "file = \"merged.ply"),
];

#[test]
fn each_problem_has_its_words_its_line_and_its_help() {
    let mut found = String::new();
    for (what, from, to) in CASES {
        let loaded = read_words(&changed(from, to));
        assert_eq!(loaded.plan.is_none(), loaded.problems.iter().any(|p| p.severity == Severity::Error), "{what}");
        assert!(!loaded.problems.is_empty(), "{what}");
        let _ = writeln!(found, "# {what}\n{}", words(&loaded.problems));
    }
    if std::env::var_os("UPDATE_GOLDENS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/plan/goldens/merge.txt");
        std::fs::write(path, &found).unwrap();
        return;
    }
    let golden = include_str!("../goldens/merge.txt");
    for (k, (a, b)) in golden.lines().zip(found.lines()).enumerate() {
        assert_eq!(a, b, "line {} of merge.txt", k + 1);
    }
    assert_eq!(golden.lines().count(), found.lines().count());
}

#[test]
fn eight_problems_are_told_at_once() {
    let mut text = FULL.to_owned();
    for (from, to) in [
        ("unit = \"um\" ", "unit = \"my\" #"),
        ("pattern = \"view_??.ply\"", "patern = \"view_??.ply\""),
        ("min = 0.002", "min = \"0,002\""),
        ("sigmas = 2.5", "sigmas = 0"),
        ("metric = \"d_cal\"", "metric = \"d_call\""),
        ("kind = \"cylinder\"", "kind = \"zylinder\""),
        ("radius_u = 0.7", "radius_u = -0.7"),
        ("report = \"merge.json\"", "report = 3"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let loaded = read_words(&text);
    assert_eq!(loaded.problems.len(), 8, "{}", words(&loaded.problems));
    assert!(loaded.problems.is_sorted_by_key(|p| p.line));
    assert!(loaded.problems.iter().all(|p| p.severity == Severity::Error && p.help.is_some() && p.line.is_some()));
}

#[test]
fn load_looks_for_the_files_that_are_needed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("merge.toml");
    assert!(load(&path, ViewsOf::OwnFolder).problems[0].message.contains("there is no such file"));
    std::fs::write(&path, FULL).unwrap();
    let lines = |views| load(&path, views).problems.iter().map(|p| p.line.unwrap()).collect::<Vec<_>>();
    assert_eq!(lines(ViewsOf::OwnFolder), [5, 8, 16, 17, 46]);
    // The poses of a part may lie in its own folder, which is named elsewhere.
    assert_eq!(lines(ViewsOf::Parts), [16, 17, 46]);
    std::fs::create_dir(folder.path().join("views")).unwrap();
    for name in ["views.json", "camera_features.csv", "projector_features.csv", "merged_old.ply"] {
        std::fs::write(folder.path().join(name), "").unwrap();
    }
    assert!(load(&path, ViewsOf::OwnFolder).plan.is_some());
    std::fs::write(&path, vec![b'#'; (1 << 20) + 1]).unwrap();
    assert!(load(&path, ViewsOf::OwnFolder).problems[0].message.contains("at most 1048576 bytes"));
}

#[test]
fn a_micrometre_is_taken_in_either_letter_and_a_cloud_ends_with_ply() {
    for unit in ["um", "\u{b5}m", "\u{3bc}m"] {
        let text = format!("schema = 1\nunit = \"{unit}\"\n[output]\nfile = \"Tool.PLY\"\n");
        let plan = parse(text.as_bytes(), Path::new("merge.toml")).plan.unwrap();
        assert_eq!((plan.unit, plan.unit.key()), (LengthUnit::Um, "um"));
    }
    let told = parse(b"schema = 1\nunit = \"nm\"\n[output]\nfile = \"merged.stl\"\n", Path::new("merge.toml"));
    assert!(words(&told.problems).contains("found \"merged.stl\", expected a name that ends with .ply"));
    assert!(told.plan.is_none() && words(&told.problems).contains("merge.toml:4"), "{}", words(&told.problems));
    let open = parse(b"schema = 1\nunit = \"um\"\n[merge\nradius = 3.0\n", Path::new("merge.toml"));
    assert!(words(&open.problems).contains("close the bracket that the line opens"), "{}", words(&open.problems));
}

/// Cuts, flips and swaps: whatever comes, there is an answer, and no settings with an error.
#[test]
fn a_thousand_broken_files_get_an_answer() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(20);
    for _ in 0..1000 {
        let mut bytes = FULL.as_bytes().to_vec();
        if rng.random_range(0..4) == 0 {
            bytes.truncate(rng.random_range(1..bytes.len()));
        }
        for _ in 0..rng.random_range(0..6) {
            let (a, b) = (rng.random_range(0..bytes.len()), rng.random_range(0..bytes.len()));
            match rng.random_range(0..3) {
                0 => bytes.swap(a, b),
                1 => bytes[a] = b"[]{}=\"'#,.-0\n\\eE\xff"[rng.random_range(0..17)],
                _ => bytes[a] = rng.next_u32() as u8,
            }
        }
        let loaded = parse(&bytes, Path::new("merge.toml"));
        assert_eq!(loaded.plan.is_some(), !loaded.problems.iter().any(|p| p.severity == Severity::Error));
        assert!(loaded.problems.iter().all(|p| p.help.is_some() && p.line.is_some()), "{}", words(&loaded.problems));
    }
}
