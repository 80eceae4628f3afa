//! Plans edited: what is asked for changes, everything else stays as it was written.

use super::*;
use crate::diagnostic::Severity;
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::{AlignmentMethod, CadSide, Geometry, LengthUnit, RegionShape, parse};
use rand::{RngExt, SeedableRng};
use std::path::Path;

pub(super) const FULL: &str = include_str!("../full_example.toml");
pub(super) const DEMO: &str = include_str!("../../../settings/demo.toml");
pub(super) const POINTS: List = List::Comparison;

pub(super) fn open(text: &str) -> Document {
    Document::from_bytes(text.as_bytes(), Path::new("p.toml")).unwrap()
}

pub(super) fn surface(x: f64) -> Geometry {
    Geometry::Surface { position: Point3::new(x, 2.5, 0.1), direction: Vector3::z_axis() }
}

pub(super) fn names(document: &Document, list: List) -> Vec<String> {
    document.rows(list).into_iter().map(|row| row.name).collect()
}

pub(super) fn words(document: &Document) -> Vec<String> {
    document.changes().iter().map(ToString::to_string).collect()
}

/// Errors that the text itself has; files that are not there are none of its faults.
pub(super) fn errors(document: &Document) -> Vec<String> {
    let loaded = parse(&document.bytes(), document.path());
    loaded.problems.iter().filter(|p| p.severity == Severity::Error).map(ToString::to_string).collect()
}

#[test]
fn a_setting_changes_and_every_other_byte_stays() {
    let mut document = open(FULL);
    document.set_setting("part", "thickness_mm", &FieldValue::Number(1.5)).unwrap();
    assert_eq!(document.text(), FULL.replacen("thickness_mm = 1.2", "thickness_mm = 1.5", 1));
    document.undo().unwrap();
    // The comment beside a longer or shorter value keeps its column.
    document.set_setting("part", "decision", &FieldValue::Text("plain".into())).unwrap();
    let line = "decision = \"iso14253\"       #";
    assert_eq!(document.text(), FULL.replacen(line, "decision = \"plain\"          #", 1));
    document.undo().unwrap();
    document.set_setting("rig", "resolution_level", &FieldValue::Number(1.0)).unwrap();
    assert_eq!(document.text(), FULL.replacen("resolution_level = 2", "resolution_level = 1", 1));
    document.undo().unwrap();
    document.remove_setting("background", "belt_clearance_mm").unwrap();
    assert_eq!(document.text(), FULL.replacen("belt_clearance_mm = 0.5\n", "", 1));
    // The commented line above belongs to what follows, not to what is taken out.
    document.undo().unwrap();
    document.remove_setting("scans", "view_direction").unwrap();
    let line = FULL.lines().find(|line| line.starts_with("view_direction")).unwrap();
    assert_eq!(document.text(), FULL.replacen(&format!("{line}\n"), "", 1));
}

#[test]
fn every_setting_can_be_written_read_left_out_and_taken_back() {
    let sample = |key: &str| match key {
        "belt_plane" => FieldValue::Truth(false),
        "belt_colours" => FieldValue::Colours(vec![[1, 2, 3], [4, 5, 6]]),
        "view_direction" => FieldValue::Numbers(vec![0.0, 0.6, 0.8]),
        "formats" | "freeze" => FieldValue::Texts(vec!["json".into(), "csv".into()]),
        "resolution_level" => FieldValue::Number(3.0),
        key if key.ends_with("_mm") || ["scale_ppm", "pixel_um", "colour_tolerance"].contains(&key) => {
            FieldValue::Number(0.125)
        }
        _ => FieldValue::Text("C:\\a \"b\" #c".into()),
    };
    for text in [FULL, "schema = 1\npart.name = \"a\"\ncad = { file = \"a.stl\" }\n"] {
        let mut document = open(text);
        let mut steps = 0;
        for (table, keys) in SETTINGS {
            for key in keys.iter().filter(|key| !["rps", "region"].contains(key)) {
                document.set_setting(table, key, &sample(key)).unwrap();
                assert_eq!(document.setting(table, key), Some(sample(key)), "[{table}] {key}\n{}", document.text());
                steps += 1;
            }
        }
        let written = document.text().to_owned();
        for _ in 0..steps {
            document.undo().unwrap();
        }
        assert_eq!((document.text(), document.is_modified(), document.undo_step()), (text, false, None));
        while document.redo().is_some() {}
        assert_eq!(document.text(), written);
        for (table, keys) in SETTINGS {
            for key in keys.iter().filter(|key| !["rps", "region"].contains(key)) {
                document.remove_setting(table, key).unwrap();
                assert_eq!(document.setting(table, key), None);
            }
        }
    }
    let slips = FULL.replacen("revision", "revison", 1).replacen("[rig]", "[rigg]", 1);
    let mut document = open(&slips);
    assert_eq!(errors(&document).len(), 2);
    document.remove_setting("part", "revison").unwrap();
    document.remove_table("rigg").unwrap();
    assert_eq!((errors(&document), document.undo_step().unwrap().to_string()), (Vec::new(), "Remove [rigg]".into()));
    let unknown = open(FULL).set_setting("part", "thicknes", &FieldValue::Number(1.0)).unwrap_err();
    assert_eq!(unknown.to_string(), "found no setting [part] thicknes in plans");
    let nan = open(FULL).set_setting("part", "thickness_mm", &FieldValue::Number(f64::NAN)).unwrap_err();
    assert!(matches!(nan, EditError::NotFinite(_)) && !nan.help().is_empty());
}

#[test]
fn new_tables_come_where_plans_have_them() {
    let mut document = open(DEMO);
    document.remove_table("rig").unwrap();
    document.set_setting("rig", "distance_mm", &FieldValue::Number(600.0)).unwrap();
    document.set_setting("uncertainty", "scale_ppm", &FieldValue::Number(20.0)).unwrap();
    let at = |what: &str| document.text().find(what).unwrap_or_else(|| panic!("no {what} in {}", document.text()));
    assert!(
        at("[[comparison]]") < at("[rig]") && at("[rig]") < at("[uncertainty]") && at("[uncertainty]") < at("[output]")
    );
    assert!(at("upper_mm = 0.3\n\n[rig]\ndistance_mm = 600.0\n\n[uncertainty]") > 0);
    let mut document = open(DEMO);
    document.remove_table("background").unwrap();
    document.set_setting("background", "belt_plane", &FieldValue::Truth(true)).unwrap();
    let order = |name: &str| document.text().find(name).unwrap();
    assert!(order("[scans]") < order("[background]") && order("[background]") < order("[alignment]"));
    assert_eq!(errors(&document), Vec::<String>::new());
}

#[test]
fn points_are_added_named_and_read_back() {
    let mut document = open(FULL);
    let edge = Geometry::Edge {
        position: Point3::new(1.0, 2.0, 3.0),
        direction: Vector3::y_axis(),
        normal: Vector3::z_axis(),
    };
    let hole = Geometry::Hole {
        centre: Point3::new(5.0, 6.0, 7.0),
        axis: Vector3::z_axis(),
        diameter_mm: 9.5,
        direction: None,
    };
    let specs =
        [surface(1.25), edge.clone(), hole.clone(), surface(0.1 + 0.2)].map(|g| PointSpec::point("", g, -0.25, 0.5));
    assert_eq!(document.add(POINTS, &specs).unwrap(), 3);
    assert_eq!(names(&document, POINTS), ["P01", "E01", "C01", "P02", "E02", "C02", "P03"]);
    assert_eq!(document.undo_step().unwrap().to_string(), "Add 4 points");
    let draft = document.read().draft;
    let geometries: Vec<&Geometry> = draft.comparison[3..].iter().map(|p| &p.geometry).collect();
    // Nine decimals are written: what computing adds behind them is cut.
    assert_eq!(geometries, [&surface(1.25), &edge, &hole, &surface(0.3)]);
    assert!(draft.comparison[3..].iter().all(|p| (p.lower_mm, p.upper_mm) == (-0.25, 0.5)));
    let (before, after) = FULL.split_once("[rig]").unwrap();
    assert!(document.text().starts_with(before.trim_end()) && document.text().ends_with(after));
    let feature = Geometry::Slot {
        centre: Point3::origin(),
        axis: Vector3::z_axis(),
        direction: Vector3::x_axis(),
        length_mm: 20.0,
        width_mm: 6.0,
    };
    assert_eq!(document.add(POINTS, &[PointSpec::feature("S9", feature.clone())]), Err(EditError::SlotCompared));
    document.add(List::Feature, &[PointSpec::feature("", feature.clone())]).unwrap();
    assert_eq!(names(&document, List::Feature), ["H1", "S1", "A1", "S2"]);
    assert_eq!(document.read().draft.features[3].geometry, feature);
    assert_eq!(
        document.add(POINTS, &[PointSpec::point("E01", hole.clone(), 0.0, 1.0)]),
        Err(EditError::NameTaken("E01".into()))
    );
    assert!(matches!(document.add(POINTS, &[PointSpec::point("a\nb", hole, 0.0, 1.0)]), Err(EditError::BadName(_))));
}

#[test]
fn a_point_goes_with_its_own_comment_and_headings_stay() {
    let text = DEMO.replacen(
        "\n[[comparison]]\nname = \"P02\"",
        "\n# Where the die is worn.\n[[comparison]]\nname = \"P02\"",
        1,
    );
    let mut document = open(&text);
    document.remove(POINTS, &[0, 1]).unwrap();
    assert_eq!(document.undo_step().unwrap().to_string(), "Remove 2 points");
    assert!(document.text().contains("# What is compared.") && !document.text().contains("die is worn"));
    assert!(document.text().contains("are the tolerance.\n\n[[comparison]]\nname = \"P03\""), "{}", document.text());
    document.undo().unwrap();
    document.reorder(POINTS, 1, 0).unwrap();
    assert_eq!(names(&document, POINTS)[..3], ["P02", "P01", "P03"]);
    let heading = "are the tolerance.\n\n# Where the die is worn.\n[[comparison]]\nname = \"P02\"";
    assert!(document.text().contains(heading), "{}", document.text());
    document.reorder(POINTS, 0, 1).unwrap();
    assert_eq!(document.text(), text);
    let all: Vec<usize> = (0..document.rows(POINTS).len()).collect();
    document.remove(POINTS, &all).unwrap();
    assert!(!document.text().contains("[[comparison]]") && document.text().contains("# What is compared."));
    document.add(POINTS, &[PointSpec::point("", surface(1.0), -1.0, 1.0)]).unwrap();
    assert_eq!((names(&document, POINTS), errors(&document)), (vec!["P01".to_owned()], Vec::new()));
    assert!(matches!(document.remove(POINTS, &[5]), Err(EditError::NoSuchRow { number: 6, .. })));
}

#[test]
fn a_moved_point_changes_only_what_differs() {
    let mut document = open(FULL);
    let Geometry::Edge { direction, normal, .. } = document.read().draft.comparison[1].geometry.clone() else {
        panic!()
    };
    document.begin_gesture();
    for y in [0.5, 1.0, 1.5] {
        document
            .reshape(POINTS, 1, &Geometry::Edge { position: Point3::new(134.0, y, 2.0), direction, normal })
            .unwrap();
    }
    document.end_gesture();
    assert_eq!(document.text(), FULL.replacen("[134.0, 0.0, 2.0]", "[134.0, 1.5, 2.0]", 1));
    assert_eq!(document.undo().unwrap().to_string(), "Move E01");
    assert_eq!((document.text(), document.redo_step().unwrap().to_string().as_str()), (FULL, "Move E01"));
    // A slot's direction is written to two decimals: the same direction stays as it is.
    let slot = document.read().draft.features[1].geometry.clone();
    document.reshape(List::Feature, 1, &slot).unwrap();
    assert_eq!((document.text(), document.undo_step()), (FULL, None));
    document.reshape(POINTS, 1, &surface(3.0)).unwrap();
    let row = &document.rows(POINTS)[1];
    assert_eq!((row.kind.as_str(), row.value("normal")), ("surface", None));
    assert_eq!(errors(&document), Vec::<String>::new());
}

#[test]
fn a_gesture_that_is_dropped_leaves_no_trace() {
    let mut document = open(FULL);
    let thickness = |document: &mut Document, mm: f64| {
        document.set_setting("part", "thickness_mm", &FieldValue::Number(mm)).unwrap();
    };
    thickness(&mut document, 1.4);
    let (text, step) = (document.text().to_owned(), document.undo_step().cloned());
    document.begin_gesture();
    thickness(&mut document, 1.5);
    thickness(&mut document, 1.6);
    document.drop_gesture();
    assert_eq!((document.text(), document.undo_step(), document.redo_step()), (text.as_str(), step.as_ref(), None));
    assert_eq!(document.setting("part", "thickness_mm"), Some(FieldValue::Number(1.4)));
    // One in which nothing was edited takes nothing back.
    document.begin_gesture();
    document.drop_gesture();
    assert_eq!((document.text(), document.undo_step()), (text.as_str(), step.as_ref()));
}

#[test]
fn names_and_what_refers_to_them_change_together() {
    let mut document = open(FULL);
    document.rename(List::Feature, 0, "H7").unwrap();
    assert_eq!(document.text(), FULL.replace("\"H1\"", "\"H7\""));
    assert_eq!(document.rename(List::Feature, 1, "A1"), Err(EditError::NameTaken("A1".into())));
    document.set_value(POINTS, 0, "name", &FieldValue::Text("Rib".into())).unwrap();
    assert_eq!(document.undo_step().unwrap().to_string(), "Rename P01");
    let locks =
        [("H7", Vector3::x_axis()), ("S1", Vector3::y_axis())].map(|(f, lock)| Lock { feature: f.into(), lock });
    document.hold_by_locks(&locks).unwrap();
    assert_eq!(document.locks(), locks);
    document.rename(List::Feature, 0, "H8").unwrap();
    assert!(
        document.text().contains("feature = \"H8\"\nlock = [1.0, 0.0, 0.0]")
            && !document.text().contains("slot_reading")
    );
    document.hold_by_locks(&locks[..1]).unwrap();
    assert_eq!(document.text().matches("[[alignment.rps]]").count(), 1);
    let region = Region {
        name: "rib".into(),
        centre: Point3::new(1.0, 2.0, 3.0),
        shape: RegionShape::Ball { radius_mm: 8.0 },
        weight: 1.0,
    };
    document
        .hold_by_regions(&[
            region.clone(),
            Region { shape: RegionShape::Box { size_mm: Vector3::new(1.0, 2.0, 3.0) }, ..region },
        ])
        .unwrap();
    assert_eq!(errors(&document), Vec::<String>::new());
    let Some(AlignmentMethod::Regions(fit)) = document.read().draft.alignment else { panic!("{}", document.text()) };
    assert_eq!(
        (fit.regions.len(), fit.regions[1].shape),
        (2, RegionShape::Box { size_mm: Vector3::new(1.0, 2.0, 3.0) })
    );
    let at = |what: &str| document.text().find(what).unwrap();
    assert!(at("[alignment]") < at("\n[[alignment.region]]") && at("\n[[alignment.region]]") < at("[[feature]]"));
    document.hold_by_features("H8", "S1", "A1").unwrap();
    assert_eq!((errors(&document), document.text().contains("\n[[alignment.region]]")), (Vec::new(), false));
}

#[test]
fn tolerances_of_many_points_are_one_step() {
    let mut document = open(DEMO);
    document.set_tolerances(&[0, 2, 25], None, Some(0.8)).unwrap();
    assert_eq!(document.undo_step().unwrap().to_string(), "Change tolerances of 3 points");
    let found: Vec<usize> = document
        .read()
        .draft
        .comparison
        .iter()
        .enumerate()
        .filter(|(_, p)| p.upper_mm == 0.8)
        .map(|(k, _)| k)
        .collect();
    assert_eq!(found, [0, 2, 25]);
    assert_eq!(
        words(&document),
        ["P01", "P03", "C05"].map(|n| {
            let old = if n == "C05" { "0.300" } else { "0.500" };
            format!("{n}: upper tolerance {old} -> 0.800 mm")
        })
    );
}

/// Rows written as lists of inline tables are edited where they stand.
#[test]
fn inline_rows_are_edited_in_place() {
    let text = "schema = 1\npart = { name = \"a\", thickness_mm = 1 } # p\ncad.file = \"a.stl\"\nalignment.method = \"best_fit\"\n\
        comparison = [{ name = \"P\", kind = \"surface\", position = [0, 1, 2], direction = [0, 0, -1], lower_mm = -1, upper_mm = 1 }] # c\n";
    let mut document = open(text);
    document.set_tolerances(&[0], Some(-2.0), None).unwrap();
    assert_eq!(document.text(), text.replace("lower_mm = -1", "lower_mm = -2"));
    document.add(POINTS, &[PointSpec::point("", surface(4.0), -1.0, 1.0)]).unwrap();
    document.set_setting("cad", "unit", &FieldValue::Text("cm".into())).unwrap();
    assert_eq!(
        (errors(&document), names(&document, POINTS)),
        (Vec::new(), vec!["P".to_owned(), "P01".to_owned()]),
        "{}",
        document.text()
    );
    document.reorder(POINTS, 1, 0).unwrap();
    document.remove(POINTS, &[1]).unwrap();
    assert_eq!(names(&document, POINTS), ["P01"]);
    assert_eq!(document.read().draft.cad.unwrap().unit, LengthUnit::Cm);
}

#[test]
fn a_new_plan_is_sound_once_its_points_are_there() {
    let plan = NewPlan {
        name: "Rail \"4\"".into(),
        cad_file: "C:\\cad\\rail.stl".into(),
        cad_unit: LengthUnit::Inch,
        scans_folder: "in".into(),
        scans_pattern: "*.xyz".into(),
        thickness_mm: 0.8,
        cad_side: CadSide::Bottom,
        point_spacing_mm: 0.7,
    };
    let mut document = Document::new_plan(Path::new("p.toml"), &plan).unwrap();
    assert!(document.is_modified() && document.undo_step().is_none() && document.saved_sha256().is_none());
    assert_eq!(words(&document), ["plan: new"]);
    document.add(POINTS, &[PointSpec::point("", surface(1.0), -1.0, 1.0)]).unwrap();
    let loaded = parse(&document.bytes(), document.path());
    assert_eq!(loaded.problems, []);
    let read = loaded.plan.unwrap();
    assert_eq!(
        (read.part.name.as_str(), read.part.thickness_mm, read.part.cad_side),
        ("Rail \"4\"", 0.8, CadSide::Bottom)
    );
    assert_eq!(
        (read.cad.file.as_str(), read.cad.unit, read.scans.pattern.as_str()),
        ("C:\\cad\\rail.stl", LengthUnit::Inch, "*.xyz")
    );
}

/// A plan may be saved on another thread while it is edited on.
#[test]
fn what_is_edited_while_the_plan_is_written_stays_unsaved() {
    fn goes_to_threads<T: Send + Sync>(_: &T) {}
    let mut document = open(FULL);
    goes_to_threads(&document);
    document.rename(POINTS, 0, "P07").unwrap();
    let written = document.bytes();
    document.rename(POINTS, 0, "P08").unwrap();
    document.mark_saved(&written);
    assert_eq!((document.is_modified(), words(&document)), (true, vec!["P08: was P07".to_owned()]));
    document.undo().unwrap();
    assert!(!document.is_modified());
}

/// What a revision was saved with stays history: steps from before it are taken back under it, never it.
#[test]
fn undo_never_crosses_a_saved_revision() {
    let mut document = open(FULL);
    document.set_tolerances(&[0], Some(-2.0), None).unwrap();
    document.rename(POINTS, 1, "N1").unwrap();
    for (revision, thickness) in [("D", 1.5), ("E", 1.6)] {
        let mut saved = document.snapshot();
        saved.revise(revision, "2026-11-22", "a reason").unwrap();
        document.take_revision(&saved);
        document.mark_saved(&saved.bytes());
        assert!(!document.is_modified() && document.text() == saved.text(), "{revision}");
        document.set_setting("part", "thickness_mm", &FieldValue::Number(thickness)).unwrap();
    }
    let revisions = document.revisions();
    assert_eq!(revisions.iter().map(|r| r.revision.as_str()).collect::<Vec<_>>(), ["D", "E"]);
    let mut steps = 0;
    while document.undo().is_some() {
        steps += 1;
        assert_eq!(document.revisions(), revisions);
        assert!(document.text().contains("revision = \"E\""), "{}", document.text());
    }
    assert_eq!(steps, 4);
    let limits = |text: &str| open(text).rows(POINTS)[0].value("lower_mm").cloned();
    assert_eq!(limits(document.text()), limits(FULL));
    while document.redo().is_some() {}
    assert_eq!(document.revisions(), revisions);
    assert_eq!(limits(document.text()), Some(FieldValue::Number(-2.0)));
}

#[test]
fn windows_line_ends_and_marks_stay() {
    let text = format!("\u{feff}{}", FULL.replace('\n', "\r\n"));
    let mut document = open(&text);
    assert_eq!(document.bytes(), text.as_bytes());
    document.set_setting("part", "thickness_mm", &FieldValue::Number(1.5)).unwrap();
    document.remove(POINTS, &[1]).unwrap();
    document.undo().unwrap();
    assert_eq!(document.bytes(), text.replacen("thickness_mm = 1.2", "thickness_mm = 1.5", 1).as_bytes());
}

/// Hundreds of edits in random order, good and bad: the text stays TOML and readable, and undoing them all gives the first one.
#[test]
fn any_edits_can_be_taken_back() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    for text in [FULL, DEMO] {
        let mut document = open(text);
        for _ in 0..200 {
            let list = if rng.random_bool(0.3) { List::Feature } else { POINTS };
            let count = document.rows(list).len();
            let (a, b) = (rng.random_range(0..count + 1), rng.random_range(0..count + 1));
            let _ = match rng.random_range(0..9) {
                0 => document.add(list, &[PointSpec::point("", surface(a as f64), -1.0, 1.0)]).map(drop),
                1 => document.remove(list, &[a]),
                2 => document.reorder(list, a, b),
                3 => document.rename(list, a, &format!("N{b}")),
                4 => document.reshape(list, a, &surface(b as f64)),
                5 => document.set_tolerances(&[a, b], Some(-2.0), None),
                6 => document.mirror(MirrorPlane { across: Axis::Z, at_mm: a as f64 }, &MirrorNames::Keep),
                7 => document.hold_by_locks(&[Lock {
                    feature: format!("N{a}"),
                    lock: UnitVector3::new_normalize(Vector3::new(1.0, a as f64, 2.0)),
                }]),
                _ => document.hold_by_features("H1", "S1", "A1"),
            };
            assert_eq!(document.structure(), Ok(()));
            assert_eq!(
                document.text().matches("# What is compared.").count(),
                text.matches("# What is compared.").count()
            );
        }
        let last = document.text().to_owned();
        while document.undo().is_some() {}
        assert_eq!(document.text(), text);
        while document.redo().is_some() {}
        assert_eq!(document.text(), last);
    }
}

#[test]
fn a_row_tells_its_shape_as_long_as_it_is_whole() {
    let document = open(FULL);
    let draft = document.read().draft;
    let features: Vec<Geometry> = draft.features.iter().map(|f| f.geometry.clone()).collect();
    let points: Vec<Geometry> = draft.comparison.iter().map(|p| p.geometry.clone()).collect();
    for (list, sound) in [(List::Feature, features), (List::Comparison, points)] {
        let told: Vec<Geometry> = document.rows(list).iter().filter_map(|row| row.geometry(list)).collect();
        // As they would be written: reading turns a slot square to its axis in the last digit.
        let written = |all: &[Geometry]| all.iter().map(|g| shape::values(g, list)).collect::<Vec<_>>();
        assert_eq!(written(&told), written(&sound));
    }
    let mut document = open(FULL);
    // A limit at fault hides nothing; a place that is none does.
    document.set_value(List::Comparison, 0, "lower_mm", &FieldValue::Text("odd".into())).unwrap();
    assert!(document.rows(List::Comparison)[0].geometry(List::Comparison).is_some());
    document.set_value(List::Comparison, 0, "position", &FieldValue::Numbers(vec![1.0, 2.0])).unwrap();
    assert!(document.rows(List::Comparison)[0].geometry(List::Comparison).is_none());
}

#[test]
fn a_point_not_in_the_plan_yet_is_typed_key_by_key() {
    let mut spec = PointSpec::point("P07", surface(1.0), -0.5, 0.5);
    let typed = [
        ("name", Some(FieldValue::Text("Rib".into()))),
        ("position", Some(FieldValue::Numbers(vec![1.0, 2.0, 3.0]))),
        ("direction", Some(FieldValue::Numbers(vec![0.0, 3.0, 4.0]))),
        ("radius_mm", Some(FieldValue::Number(2.5))),
        ("method", Some(FieldValue::Text("plane".into()))),
        ("upper_mm", Some(FieldValue::Number(0.2))),
    ];
    for (key, value) in &typed {
        spec = spec.with_value(key, value.as_ref()).unwrap();
    }
    let mut document = open(FULL);
    let row = document.add(POINTS, &[spec.clone()]).unwrap();
    // What a form shows of it is what its row holds.
    let info = &document.rows(POINTS)[row];
    for (key, value) in spec.values(POINTS) {
        assert_eq!(info.value(key), Some(&value), "{key}");
    }
    assert_eq!(info.value("direction"), Some(&FieldValue::Numbers(vec![0.0, 0.6, 0.8])));
    assert_eq!((info.name.as_str(), info.values.len()), ("Rib", spec.values(POINTS).len() + 2));
    assert_eq!(spec.with_value("direction", Some(&FieldValue::Numbers(vec![0.0; 3]))), None);
    assert_eq!(spec.with_value("diameter_mm", Some(&FieldValue::Number(1.0))), None);
    assert_eq!(spec.with_value("upper_mm", Some(&FieldValue::Text("wide".into()))), None);
    assert_eq!(spec.with_value("radius_mm", None).unwrap().values(POINTS).len(), spec.values(POINTS).len() - 1);
}
