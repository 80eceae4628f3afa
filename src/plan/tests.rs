//! Plans read as a whole: where values land, and the exact words for everything that can be wrong.

use super::*;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{Point3, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use std::fmt::Write as _;
use std::path::Path;

const FULL: &str = include_str!("full_example.toml");

fn read(text: &str) -> Loaded {
    parse(text.as_bytes(), Path::new("p.toml"))
}

fn words(problems: &[Diagnostic]) -> String {
    problems.iter().map(|p| format!("{p}\n")).collect()
}

/// The full example with one place changed.
fn changed(from: &str, to: &str) -> String {
    assert!(FULL.contains(from), "the example has no {from}");
    FULL.replacen(from, to, 1)
}

/// Compares with a golden text; `UPDATE_GOLDENS=1` writes it anew, to be read before it is committed.
fn assert_golden(name: &str, golden: &str, found: &str) {
    if std::env::var_os("UPDATE_GOLDENS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/plan/goldens").join(name);
        std::fs::write(path, found).unwrap();
        return;
    }
    for (k, (a, b)) in golden.lines().zip(found.lines()).enumerate() {
        assert_eq!(a, b, "line {} of {name}", k + 1);
    }
    assert_eq!(golden.lines().count(), found.lines().count());
}

#[test]
fn every_value_of_the_full_example_lands_where_it_belongs() {
    let loaded = parse(FULL.as_bytes(), Path::new("plans/p.toml"));
    assert_eq!(words(&loaded.problems), "");
    let plan = loaded.plan.unwrap();
    assert_eq!(
        (plan.part.name.as_str(), plan.part.number.as_str(), plan.part.revision.as_str()),
        ("Bracket RH", "4711-02", "C")
    );
    assert_eq!(
        (plan.part.thickness_mm, plan.part.decision, plan.part.cad_side),
        (1.2, Decision::Iso14253, CadSide::Top)
    );
    assert_eq!(
        (plan.cad.file.as_str(), plan.cad.path.as_path(), plan.cad.unit),
        ("bracket.stl", Path::new("plans/bracket.stl"), LengthUnit::Mm)
    );
    assert_eq!((plan.scans.path.as_path(), plan.scans.pattern.as_str()), (Path::new("plans/scans"), "*.ply"));
    assert_eq!((plan.scans.order, plan.scans.taken.clone()), (ScanOrder::Name, Taken::None));
    assert_eq!(plan.scans.view_direction.unwrap().into_inner(), Vector3::z());
    let background = BackgroundSettings {
        belt_plane: true,
        belt_clearance_mm: Some(0.5),
        belt_colours: vec![[96, 98, 101]],
        colour_tolerance: 18.0,
        luminance_min: Some(25.0),
    };
    assert_eq!(plan.background, background);
    let alignment = AlignmentMethod::Features { hole: 0, slot: 1, slot_reading: SlotReading::CentreLine, point: 2 };
    assert_eq!(plan.alignment, alignment);
    let Geometry::Slot { centre, direction, length_mm, width_mm, .. } = &plan.features[1].geometry else { panic!() };
    assert_eq!((*centre, *length_mm, *width_mm), (Point3::new(72.0, -54.0, 3.0), 30.0, 9.0));
    assert!((direction.norm() - 1.0).abs() < 1e-15 && (direction.y / direction.x - 0.24 / 0.97).abs() < 1e-15);
    let Geometry::Edge { position, direction, normal } = &plan.comparison[1].geometry else { panic!() };
    assert_eq!(
        (*position, direction.into_inner(), normal.into_inner()),
        (Point3::new(134.0, 0.0, 2.0), Vector3::x(), Vector3::z())
    );
    let Geometry::Hole { centre, diameter_mm, direction, .. } = &plan.comparison[2].geometry else { panic!() };
    assert_eq!(
        (*centre, *diameter_mm, direction.unwrap().into_inner()),
        (Point3::new(14.0, 70.0, 6.0), 20.0, Vector3::x())
    );
    assert_eq!(
        (plan.comparison[1].lower_mm, plan.comparison[1].upper_mm, plan.comparison[1].name.as_str()),
        (-0.7, 0.7, "E01")
    );
    let line_of = |line: usize| FULL.lines().nth(line - 1).unwrap();
    assert!(plan.features.iter().all(|f| line_of(f.line).starts_with("[[feature]]")));
    assert!(plan.comparison.iter().all(|c| line_of(c.line).starts_with("[[comparison]]")));
    let rig = plan.rig.unwrap();
    assert_eq!((rig.distance_mm, rig.base_mm, rig.focal_mm, rig.pixel_um), (600.0, 200.0, 35.0, 4.88));
    assert_eq!((rig.image_accuracy_px, rig.resolution_level), (0.3, 2));
    assert_eq!(plan.uncertainty, UncertaintySettings::default());
    assert_eq!(plan.output.path, Path::new("plans/results"));
    assert_eq!(plan.output.formats, [OutputFormat::Ascii, OutputFormat::Json, OutputFormat::Pdf]);
    assert_eq!(plan.sha256.len(), 64);
    assert_ne!(plan.sha256, read(&format!("{FULL}\n")).plan.unwrap().sha256);
}

/// What may be left out, and what it is then.
#[test]
fn a_short_plan_gets_the_documented_defaults() {
    let text = "schema = 1\npart = { name = \"a\", thickness_mm = 1 }\ncad.file = \"a.stl\"\nalignment.method = \"best_fit\"\n\
        [[comparison]]\nname = \"P\"\nkind = \"surface\"\nposition = [0, 1, 2]\ndirection = [0, 0, -1]\nlower_mm = -1\nupper_mm = 1\n";
    let loaded = read(text);
    assert_eq!(words(&loaded.problems), "");
    let plan = loaded.plan.unwrap();
    assert_eq!(
        (plan.part.decision, plan.part.cad_side, plan.cad.unit),
        (Decision::Iso14253, CadSide::Top, LengthUnit::Mm)
    );
    assert_eq!(
        (plan.scans.folder.as_str(), plan.scans.pattern.as_str(), plan.scans.view_direction),
        ("scans", "*.ply", None)
    );
    assert_eq!((plan.background, plan.rig), (BackgroundSettings::default(), None));
    assert_eq!((plan.output.folder.as_str(), plan.output.map_range_mm), ("results", 1.0));
}

/// (what is tried, what the example holds, what is put there).
const CASES: &[(&str, &str, &str)] = &[
    ("text for a number", "thickness_mm = 1.2 ", "thickness_mm = \"1.2\" "),
    ("text with a unit", "thickness_mm = 1.2 ", "thickness_mm = \"1.2 mm\" "),
    ("decimal comma in quotes", "thickness_mm = 1.2 ", "thickness_mm = \"1,2\" "),
    ("decimal comma", "thickness_mm = 1.2 ", "thickness_mm = 1,2 "),
    ("two points", "thickness_mm = 1.2 ", "thickness_mm = 1.2.3 "),
    ("too large for f64", "thickness_mm = 1.2 ", "thickness_mm = 1e999 "),
    ("not a number", "thickness_mm = 1.2 ", "thickness_mm = nan "),
    ("negative thickness", "thickness_mm = 1.2 ", "thickness_mm = -1.2 "),
    ("no value", "thickness_mm = 1.2 ", "thickness_mm = "),
    ("bare word", "decision = \"iso14253\"", "decision = plain"),
    ("key without equals sign", "name = \"Bracket RH\"", "name \"Bracket RH\""),
    ("open quote", "name = \"Bracket RH\"", "name = \"Bracket RH"),
    ("key twice", "number = \"4711-02\"", "name = \"other\""),
    ("number for a name", "name = \"Bracket RH\"", "name = 4711"),
    ("tab in a name", "name = \"Bracket RH\"", "name = \"Bracket\\tRH\""),
    ("empty name", "name = \"Bracket RH\"", "name = \"\""),
    ("misspelt key", "thickness_mm = 1.2 ", "thicknes = 1.2 "),
    ("key of another table", "number = \"4711-02\"", "file = \"a.stl\""),
    ("unknown key", "number = \"4711-02\"", "colour_of_roof = 3"),
    ("misspelt choice", "decision = \"iso14253\"", "decision = \"iso14252\""),
    ("wrong choice", "cad_side = \"top\"", "cad_side = \"left\""),
    ("missing key", "file = \"bracket.stl\"", ""),
    ("URL", "file = \"bracket.stl\"", "file = \"https://example.org/bracket.stl\""),
    ("UNC", "file = \"bracket.stl\"", "file = '\\\\server\\bracket.stl'"),
    ("unknown unit", "unit = \"mm\"                 # mm", "unit = \"mil\" #"),
    ("no schema", "schema = 1", ""),
    ("other schema", "schema = 1", "schema = 2"),
    ("header misspelt", "[part]", "[parts]"),
    ("header not closed", "[part]", "[part"),
    ("header in double brackets", "[part]", "[[part]]"),
    ("header twice", "[cad]", "[part]"),
    ("list in single brackets", "[[feature]]", "[feature]"),
    ("views", "order = \"name\"", "views = \"merge.toml\""),
    ("date without day", "taken = \"none\"", "taken = \"name:%Y\""),
    ("date directive unknown", "taken = \"none\"", "taken = \"name:%Q\""),
    ("pattern with folder", "pattern = \"*.ply\"", "pattern = \"a/*.ply\""),
    ("view direction of length 0", "view_direction = [0.0, 0.0, 1.0]", "view_direction = [0.0, 0.0, 0.0]"),
    ("truth as text", "belt_plane = true", "belt_plane = \"yes\""),
    ("flat colour", "belt_colours = [[96, 98, 101]]", "belt_colours = [96, 98, 101]"),
    ("colour out of range", "belt_colours = [[96, 98, 101]]", "belt_colours = [[96, 98, 256]]"),
    ("luminance out of range", "luminance_min = 25.0", "luminance_min = 300"),
    ("no alignment", "[alignment]", "[background2]"),
    ("wrong method", "method = \"features\"", "method = \"feature\""),
    ("reference misspelt", "hole = \"H1\"", "hole = \"h1\""),
    ("reference of another kind", "hole = \"H1\"", "hole = \"S1\""),
    ("reference missing", "hole = \"H1\"", ""),
    ("method without references", "method = \"features\"", "method = \"best_fit\""),
    ("kind changed", "kind = \"slot\"", "kind = \"hole\""),
    ("kind unknown", "kind = \"slot\"", "kind = \"slit\""),
    ("slot on the hole", "centre = [72.0, -54.0, 3.0]", "centre = [-76.0, 56.0, 4.1]"),
    ("slot near the hole", "centre = [72.0, -54.0, 3.0]", "centre = [-66.0, 46.0, 4.1]"),
    ("point on the line", "position = [10.0, 40.0, 8.0]", "position = [-2.0, 1.0, 3.5]"),
    ("point near the line", "position = [10.0, 40.0, 8.0]", "position = [-2.0, 6.0, 3.5]"),
    ("feature named twice", "name = \"S1\"", "name = \"H1\""),
    ("list not closed", "position = [10.0, 40.0, 8.0]", "position = [10.0, 40.0, 8.0"),
    ("two coordinates", "position = [10.0, 40.0, 8.0]", "position = [10.0, 40.0]"),
    ("decimal commas in a list", "position = [10.0, 40.0, 8.0]", "position = [10,0, 40,0, 8,0]"),
    ("no commas in a list", "position = [10.0, 40.0, 8.0]", "position = [10.0 40.0 8.0]"),
    ("text in a list", "position = [10.0, 40.0, 8.0]", "position = [10.0, \"40\", 8.0]"),
    ("a kilometre away", "position = [10.0, 40.0, 8.0]", "position = [1e7, 40.0, 8.0]"),
    ("direction of length 0", "direction = [0.0, 0.0, 1.0]\nlower_mm", "direction = [0, 0, 0]\nlower_mm"),
    ("direction of length 2", "direction = [0.0, 0.0, 1.0]\nlower_mm", "direction = [0, 0, 2]\nlower_mm"),
    ("slot direction slanted", "direction = [0.97, 0.24, 0.0]", "direction = [0.97, 0.24, 0.12]"),
    ("slot direction along axis", "direction = [0.97, 0.24, 0.0]", "direction = [0.0, 0.1, 0.995]"),
    ("slot wider than long", "width_mm = 9.0", "width_mm = 31.0"),
    ("hole without size", "diameter_mm = 16.0", "diameter_mm = 0"),
    ("centre misspelt", "centre = [-76.0, 56.0, 4.1]", "center = [-76.0, 56.0, 4.1]"),
    ("point named twice", "name = \"E01\"", "name = \"P01\""),
    ("point named twice and of no kind", "name = \"E01\"\nkind = \"edge\"", "name = \"P01\"\nkind = \"rim\""),
    ("slot compared", "kind = \"edge\"", "kind = \"slot\""),
    ("limits swapped", "lower_mm = -0.7", "lower_mm = 0.7"),
    ("limits of a nanometre", "lower_mm = -0.7\nupper_mm = 0.7", "lower_mm = -1e-9\nupper_mm = 1e-9"),
    ("limit missing", "upper_mm = 0.7", ""),
    ("edge direction slanted", "direction = [1.0, 0.0, 0.0]\nnormal", "direction = [0.985, 0.0, 0.174]\nnormal"),
    ("no comparison file", "[rig] ", "[comparison_file]\nfile = \"nowhere.csv\"\n[rig] "),
    ("rig incomplete", "focal_mm = 35.0", ""),
    ("resolution level", "resolution_level = 2", "resolution_level = 1.5"),
    ("negative uncertainty", "system_mm = 0.0", "system_mm = -0.01"),
    ("a scale of 100 %", "scale_ppm = 0.0", "scale_ppm = 1000000"),
    ("a scale of 1 %", "scale_ppm = 0.0", "scale_ppm = 10000"),
    ("a sheet of a metre", "thickness_mm = 1.2 ", "thickness_mm = 1000 "),
    ("an edge 30 mm off", "edge_offset_mm = 0.0", "edge_offset_mm = -30"),
    ("a spacing of nothing", "resolution_level = 2", "resolution_level = 2\npoint_spacing_mm = 0"),
    ("format to come", "\"pdf\"]", "\"dfq\"]"),
    ("format misspelt", "\"pdf\"]", "\"jsn\"]"),
    ("no format", "[\"ascii\", \"json\", \"pdf\"]", "[]"),
    ("range of the map", "map_range_mm = 1.0", "map_range_mm = 0"),
];

#[test]
fn each_problem_has_its_words_its_line_and_its_help() {
    let mut found = String::new();
    for (what, from, to) in CASES {
        let loaded = read(&changed(from, to));
        assert_eq!(loaded.plan.is_none(), loaded.any_error(), "{what}");
        let _ = writeln!(found, "# {what}\n{}", words(&loaded.problems));
    }
    assert_golden("problems.txt", include_str!("goldens/problems.txt"), &found);
}

/// Of a hole without direction the value is a distance: only its upper limit is judged, and a lower one above 0 is odd.
#[test]
fn a_distance_has_no_lower_limit() {
    const HEAD: &str = "schema = 1\n[part]\nname = \"a\"\nthickness_mm = 0\n[cad]\nfile = \"a.stl\"\n[alignment]\nmethod = \"best_fit\"\n\
        [[comparison]]\nname = \"C\"\nkind = \"hole\"\nposition = [0, 0, 0]\naxis = [0, 0, 1]\ndiameter_mm = 8\nupper_mm = 0.3\n";
    for (more, judged_mm, is_odd) in [
        ("lower_mm = 0.0", f64::NEG_INFINITY, false),
        ("lower_mm = -0.3", f64::NEG_INFINITY, false),
        ("lower_mm = 0.1", 0.1, true),
        ("lower_mm = 0.1\ndirection = [1, 0, 0]", 0.1, false),
        ("lower_mm = 0.0\ndirection = [1, 0, 0]", 0.0, false),
    ] {
        let loaded = read(&format!("{HEAD}{more}\n"));
        let told = words(&loaded.problems);
        assert_eq!(told.contains("the value is a distance"), is_odd, "{more}: {told}");
        assert!(!loaded.any_error(), "{told}");
        assert_eq!(loaded.plan.expect(more).comparison[0].judged_lower_mm(), judged_mm, "{more}");
    }
}

#[test]
fn ten_problems_are_told_at_once() {
    let mut text = FULL.to_owned();
    for (from, to) in [
        ("number = \"4711-02\"", "nummer = \"4711-02\""),
        ("thickness_mm = 1.2 ", "thickness_mm = 1,2 "),
        ("unit = \"mm\"                 # mm", "unit = \"mn\" #"),
        ("luminance_min = 25.0", "luminance_min = \"dark\""),
        ("slot = \"S1\"", "slot = \"S9\""),
        ("diameter_mm = 16.0", "diameter_mm = -16.0"),
        ("width_mm = 9.0", "widht_mm = 9.0"),
        ("position = [0.0, 0.0, 5.0]", "position = [0.0, 0.0]"),
        ("normal = [0.0, 0.0, 1.0]", "normal = [0, 0, 0]"),
        ("map_range_mm = 1.0", "map_range_mm = 1.0\nmap_range_mm = 2.0"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let loaded = read(&text);
    assert_eq!(loaded.problems.len(), 10, "{}", words(&loaded.problems));
    assert!(loaded.problems.is_sorted_by_key(|p| p.line));
    assert!(loaded.problems.iter().all(|p| p.severity == Severity::Error && p.help.is_some() && p.line.is_some()));
    assert!(loaded.plan.is_none());
}

const RPS: &str = r#"
[[feature]]
name = "A"
kind = "surface"
position = [0, 0, 0]
direction = [0, 0, 1]
[[feature]]
name = "B"
kind = "hole"
centre = [100, 0, 0]
axis = [0, 0, 1]
diameter_mm = 8
[[feature]]
name = "C"
kind = "hole"
centre = [0, 80, 0]
axis = [0, 0, 1]
diameter_mm = 8
"#;

/// A plan with the locks (feature, direction).
fn rps_plan(locks: &[(&str, [i32; 3])]) -> String {
    let mut text =
        "schema = 1\n[part]\nname = \"a\"\nthickness_mm = 0\n[cad]\nfile = \"a.stl\"\n[alignment]\nmethod = \"rps\"\n"
            .to_owned();
    for (feature, lock) in locks {
        let _ = writeln!(text, "[[alignment.rps]]\nfeature = \"{feature}\"\nlock = {lock:?}");
    }
    text + RPS
}

#[test]
fn locks_must_hold_all_six_motions() {
    let (x, y, z) = ([1, 0, 0], [0, 1, 0], [0, 0, 1]);
    let held = [("A", z), ("B", z), ("C", z), ("B", x), ("B", y), ("C", x)];
    let loaded = read(&rps_plan(&held));
    let Some(Plan { alignment: AlignmentMethod::Rps(locks), .. }) = &loaded.plan else {
        panic!("{}", words(&loaded.problems));
    };
    assert_eq!(locks.iter().map(|l| l.feature).collect::<Vec<_>>(), [0, 1, 2, 1, 1, 2]);
    let mut found = String::new();
    for (what, locks) in [
        ("five locks", &held[..5]),
        ("a turn stays free", &[("A", z), ("B", z), ("C", z), ("B", x), ("B", y), ("B", x)]),
        ("a lock given twice", &[("A", z), ("B", z), ("C", z), ("B", x), ("B", y), ("C", x), ("B", [-1, 0, 0])]),
        ("two motions stay free", &[("A", z), ("B", z), ("C", z), ("B", x), ("B", x), ("B", x)]),
        ("unknown feature", &[("A", z), ("B", z), ("C", z), ("B", x), ("B", y), ("c", x)]),
        ("a surface point across its direction", &[("A", x), ("B", z), ("C", z), ("B", x), ("B", y), ("C", x)]),
        ("direction of length 0", &[("A", [0, 0, 0]), ("B", z), ("C", z), ("B", x), ("B", y), ("C", x)]),
    ] {
        let _ = writeln!(found, "# {what}\n{}", words(&read(&rps_plan(locks)).problems));
    }
    let misspelt = rps_plan(&held).replacen("lock =", "locked =", 1).replacen("feature =", "feat =", 1);
    let _ = writeln!(found, "# misspelt keys\n{}", words(&read(&misspelt).problems));
    assert_golden("rps.txt", include_str!("goldens/rps.txt"), &found);
}

/// A plan of a best fit with these lines in and after `[alignment]`.
fn region_plan(lines: &str) -> String {
    format!(
        "schema = 1\n[part]\nname = \"a\"\nthickness_mm = 0\n[cad]\nfile = \"a.stl\"\n[alignment]\nmethod = \"best_fit\"\n{lines}\n"
    )
}

#[test]
fn regions_are_read_and_nonsense_is_told() {
    let ball = "[[alignment.region]]\ncentre = [1, 2, 3]\nradius_mm = 10\n";
    let text = format!(
        "freeze = [\"rz\", \"x\"]\n{ball}[[alignment.region]]\nname = \"flange\"\ncentre = [9, 2, 3]\nsize_mm = [4, 6, 2]\nweight = 2.5\n"
    );
    let loaded = read(&region_plan(&text));
    let Some(Plan { alignment: AlignmentMethod::Regions(fit), .. }) = &loaded.plan else {
        panic!("{}", words(&loaded.problems));
    };
    assert_eq!(fit.freeze, [Freedom::X, Freedom::Rz]);
    let [first, second] = fit.regions.as_slice() else { panic!("two regions") };
    assert_eq!((first.name.as_str(), first.weight, first.line), ("region 1", 1.0, 10));
    assert_eq!((second.name.as_str(), second.weight), ("flange", 2.5));
    assert_eq!(fit.middle(), Point3::new(5.0, 2.0, 3.0));
    let inside = |p: [f64; 3]| fit.regions.iter().map(|r| r.contains(&Point3::from(p))).collect::<Vec<_>>();
    assert_eq!(inside([8.0, 5.0, 2.0]), [true, true]);
    assert_eq!(inside([9.0, 5.0, 4.01]), [true, false]);
    assert_eq!(inside([1.0, 2.0, 13.01]), [false, false]);
    assert_eq!(read(&region_plan("")).plan.unwrap().alignment, AlignmentMethod::BestFit);
    let mut found = String::new();
    for (what, lines) in [
        ("all frozen", format!("freeze = [\"x\", \"y\", \"z\", \"rx\", \"ry\", \"rz\"]\n{ball}")),
        ("unknown freedom", format!("freeze = [\"x\", \"rq\"]\n{ball}")),
        ("freedom twice", format!("freeze = [\"x\", \"x\"]\n{ball}")),
        ("freedoms as text", format!("freeze = \"x\"\n{ball}")),
        ("a number for a freedom", format!("freeze = [1]\n{ball}")),
        ("frozen without regions", "freeze = [\"x\"]".to_owned()),
        ("weight 0", format!("{ball}weight = 0\n")),
        ("no extent", ball.replace("radius_mm = 10", "")),
        ("two extents", format!("{ball}size_mm = [1, 1, 1]\n")),
        ("flat box", ball.replace("radius_mm = 10", "size_mm = [1, 1, 0]")),
        ("misspelt key", ball.replace("radius_mm", "radius")),
        ("no regions", "region = []".to_owned()),
        ("misspelt centre", ball.replace("centre", "center")),
    ] {
        let loaded = read(&region_plan(&lines));
        assert_eq!(loaded.plan.is_none(), loaded.any_error(), "{what}");
        let _ = writeln!(found, "# {what}\n{}", words(&loaded.problems));
    }
    let _ = writeln!(
        found,
        "# regions beside features\n{}",
        words(&read(&changed("point = \"A1\" ", &format!("point = \"A1\"\n{ball}#"))).problems)
    );
    assert_golden("regions.txt", include_str!("goldens/regions.txt"), &found);
}

/// The example with its points taken out into a file with this text.
fn with_comparison_file(folder: &Path, bytes: &[u8]) -> Loaded {
    std::fs::write(folder.join("points.csv"), bytes).unwrap();
    let (head, rest) = FULL.split_once("[[comparison]]").unwrap();
    let (_, tail) = rest.split_once("[rig] ").unwrap();
    let text = format!("{head}[comparison_file]\nfile = \"points.csv\"\n\n[rig] {tail}");
    parse(text.as_bytes(), &folder.join("p.toml"))
}

#[test]
fn comparison_files_give_the_same_points_in_all_their_forms() {
    let folder = tempfile::tempdir().unwrap();
    let rows = [
        "name kind x y z i j k normal_x normal_y normal_z axis_x axis_y axis_z diameter_mm lower_mm upper_mm",
        "P01 surface 0 0 5 0 0 1 - - - - - - - -0.5 0.5",
        "E01 edge 134 0 2 1 0 0 0 0 1 - - - - -0.7 0.7",
        "C01 hole 14 70 6 1 0 0 - - - 0 0 1 20 -0.3 0.3",
    ];
    let expected = read(FULL).plan.unwrap().comparison;
    for separator in [",", ";", "\t", ", "] {
        let text = format!("# made by hand\n\n{}\r\n", rows.join("\r\n").replace(' ', separator));
        let text = text.replace(&format!("-{separator}"), separator);
        let loaded = with_comparison_file(folder.path(), text.as_bytes());
        assert_eq!(words(&loaded.problems), "", "{separator:?}");
        let found = loaded.plan.unwrap().comparison;
        assert_eq!(found.len(), 3);
        for ((found, expected), line) in found.iter().zip(&expected).zip(4..) {
            assert_eq!((&found.name, &found.geometry), (&expected.name, &expected.geometry));
            assert_eq!((found.lower_mm, found.upper_mm, found.line), (expected.lower_mm, expected.upper_mm, line));
            assert_eq!(found.file, folder.path().join("points.csv"));
        }
    }
    let blanks = "\u{feff}name kind position_x position_y position_z direction lower_mm upper_mm\n\"P 01\"  surface 0 0 5 \"[0, 0, 1]\" -0.5 0.5\n";
    let loaded = with_comparison_file(folder.path(), blanks.as_bytes());
    assert_eq!(words(&loaded.problems), "");
    let plan = loaded.plan.unwrap();
    assert_eq!((plan.comparison[0].name.as_str(), &plan.comparison[0].geometry), ("P 01", &expected[0].geometry));
    assert_ne!(
        plan.sha256,
        with_comparison_file(folder.path(), &[blanks.as_bytes(), b"\n"].concat()).plan.unwrap().sha256
    );
}

#[test]
fn faults_of_comparison_files_have_their_line_and_help() {
    const HEAD: &str = "name,kind,x,y,z,i,j,k,lower_mm,upper_mm\n";
    let folder = tempfile::tempdir().unwrap();
    let mut found = String::new();
    for (what, text) in [
        ("empty file", String::new()),
        ("no points", HEAD.to_owned()),
        ("missing columns", "name,kind,x,y,i,j,k\nP,surface,0,0,0,0,1\n".to_owned()),
        ("misspelt column", HEAD.replace("lower_mm", "lower")),
        ("column twice", HEAD.replace("upper_mm", "lower_mm")),
        ("decimal commas", format!("{HEAD}P,surface,0,5,1,5,2,5,0,0,1,-0,5,0,5\n")),
        ("decimal commas between semicolons", format!("{}P;surface;0,5;1;2;0;0;1;-0,5;0,5\n", HEAD.replace(',', ";"))),
        ("a cell too few", format!("{HEAD}P,surface,0,0,0,0,0,1,-0.5\n")),
        ("two coordinates", format!("{HEAD}P,surface,0,0,,0,0,1,-0.5,0.5\n")),
        ("no direction", format!("{HEAD}P,surface,0,0,0,,,,-0.5,0.5\n")),
        ("open quote", format!("{HEAD}\"P,surface,0,0,0,0,0,1,-0.5,0.5\n")),
        ("name twice", format!("{HEAD}P,surface,0,0,0,0,0,1,-0.5,0.5\nP,surface,9,0,0,0,0,1,-0.5,0.5\n")),
        ("no number", format!("{HEAD}P,surface,0,0,0,0,0,1,-0.5,n/a\nQ,surface,inf,0,0,0,0,1,-0.5,1\n")),
    ] {
        let loaded = with_comparison_file(folder.path(), text.as_bytes());
        let told = words(&loaded.problems).replace(&format!("{}/", folder.path().display()), "");
        let _ = writeln!(found, "# {what}\n{told}");
    }
    assert_golden("comparison_file.txt", include_str!("goldens/comparison_file.txt"), &found);
}

#[test]
fn load_looks_for_the_files_and_refuses_what_is_no_plan() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.toml");
    let missing = load(&path);
    assert!(missing.plan.is_none() && missing.problems[0].message.contains("there is no such file"));
    assert!(load(folder.path()).problems[0].message.contains("no plain file"));
    std::fs::write(&path, FULL).unwrap();
    let loaded = load(&path);
    assert!(loaded.plan.is_none());
    let told: Vec<(Severity, Option<usize>)> = loaded.problems.iter().map(|p| (p.severity, p.line)).collect();
    assert_eq!(told, [(Severity::Error, Some(13)), (Severity::Warning, Some(17))], "{}", words(&loaded.problems));
    std::fs::write(folder.path().join("bracket.stl"), "").unwrap();
    assert!(load(&path).plan.is_some());
    std::fs::write(&path, vec![b'#'; (1 << 20) + 1]).unwrap();
    assert!(load(&path).problems[0].message.contains("expected a plan of at most 1048576 bytes"));
}

#[test]
fn bytes_that_are_no_text_are_told_with_their_line() {
    let mut bytes = FULL.as_bytes().to_vec();
    let at = FULL.find("4711").unwrap();
    bytes[at] = 0xe4;
    let loaded = parse(&bytes, Path::new("p.toml"));
    assert_eq!(
        words(&loaded.problems),
        "error: p.toml:5: found the byte 0xe4, expected text in UTF-8\nhelp: save the file as UTF-8 text\n"
    );
    let loaded = parse(&[0xff, 0xfe, b's', 0], Path::new("p.toml"));
    assert!(loaded.problems[0].message.contains("UTF-16"));
    assert!(parse(format!("\u{feff}{FULL}").as_bytes(), Path::new("p.toml")).plan.is_some());
}

/// Nesting, in each of the ways TOML has, ends in a message and not in a stack overflow.
#[test]
fn nesting_without_end_is_refused() {
    let deep = 30_000;
    for bomb in [
        format!("a = {}", "[".repeat(deep)),
        format!("a = {}{}", "[".repeat(deep), "]".repeat(deep)),
        format!("a = {}", "{a=".repeat(deep)),
        format!("{}a = 1", "a.".repeat(deep)),
        format!("[{}a]\nb = 1", "a.".repeat(deep)),
        format!("[[{}a]]", "a.".repeat(deep)),
        "[[a]]\n".repeat(deep),
        "a = 1\n".repeat(deep),
        "a\n".repeat(deep),
    ] {
        let loaded = read(&bomb);
        assert!(loaded.plan.is_none() && !loaded.problems.is_empty());
    }
}

/// Cuts, flips, swaps and doubles parts of a good plan: whatever comes, there is an answer, and no plan with an error.
#[test]
fn two_thousand_broken_plans_get_an_answer() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(20);
    let lines: Vec<&str> = FULL.lines().collect();
    for _ in 0..2000 {
        let mut bytes = match rng.random_range(0..4) {
            0 => FULL.as_bytes()[..rng.random_range(0..FULL.len())].to_vec(),
            1 => {
                let mut lines = lines.clone();
                let (from, to) = (rng.random_range(0..lines.len()), rng.random_range(0..lines.len()));
                lines.insert(to, lines[from]);
                lines.remove(rng.random_range(0..lines.len()));
                lines.join("\n").into_bytes()
            }
            _ => FULL.as_bytes().to_vec(),
        };
        for _ in 0..rng.random_range(0..6) {
            if bytes.is_empty() {
                break;
            }
            let (a, b) = (rng.random_range(0..bytes.len()), rng.random_range(0..bytes.len()));
            match rng.random_range(0..3) {
                0 => bytes.swap(a, b),
                1 => bytes[a] = b"[]{}=\"'#,.-0\n\\eE\xff"[rng.random_range(0..17)],
                _ => bytes[a] = rng.next_u32() as u8,
            }
        }
        let loaded = parse(&bytes, Path::new("p.toml"));
        assert_eq!(loaded.plan.is_some(), !loaded.any_error());
        assert!(loaded.problems.iter().all(|p| p.help.is_some() && p.line.is_some()), "{}", words(&loaded.problems));
    }
}

#[test]
fn a_surface_point_may_choose_its_method_and_window() {
    let point = |more: &str| {
        format!(
            "schema = 1\npart = {{ name = \"a\", thickness_mm = 1 }}\ncad.file = \"a.stl\"\nalignment.method = \"best_fit\"\n[[comparison]]\nname = \"P\"\nkind = \"surface\"\nposition = [0, 0, 0]\ndirection = [0, 0, 1]\nlower_mm = -1\nupper_mm = 1\n{more}"
        )
    };
    let fit = |more: &str| {
        let loaded = parse(point(more).as_bytes(), Path::new("p.toml"));
        loaded.plan.map(|plan| plan.comparison[0].surface_fit)
    };
    assert_eq!(fit(""), Some(SurfaceFit::default()));
    let plane = SurfaceFit { method: SurfaceMethod::Plane, radius_mm: Some(2.0) };
    assert_eq!(fit("method = \"plane\"\nradius_mm = 2.0\n"), Some(plane));
    for wrong in ["method = \"mean\"\n", "radius_mm = 0\n", "radius_mm = 51\n", "radius_mm = \"2\"\n"] {
        assert_eq!(fit(wrong), None, "{wrong}");
    }
}
