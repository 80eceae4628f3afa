//! The other hand, and points as tables.

use super::tests::{FULL, POINTS, errors, names, open, surface};
use super::*;
use crate::plan::Geometry;
use crate::simulate::{BracketParameters, bracket};
use std::path::Path;

/// A plan of the simulated bracket, to nine decimals.
fn bracket_plan(points: &[crate::plan::ComparisonPoint], features: &[crate::plan::Feature]) -> Document {
    let mut document = open(
        "schema = 1\n[part]\nname = \"b\"\nthickness_mm = 1.2\n[cad]\nfile = \"b.stl\"\n[alignment]\nmethod = \"best_fit\"\n",
    );
    document.add(List::Feature, &features.iter().map(PointSpec::from).collect::<Vec<_>>()).unwrap();
    document.add(POINTS, &points.iter().map(PointSpec::from).collect::<Vec<_>>()).unwrap();
    document
}

fn assert_alike(found: &[Geometry], expected: &[Geometry]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert_eq!(a.kind(), b.kind());
        // Written to nine decimals, half a unit off at most in each of three components, and once more where a length is taken.
        let off = (a.position() - b.position()).norm().max((a.sheet_normal() - b.sheet_normal()).norm());
        assert!(off < 2e-9, "{a:?} {b:?}");
        for (key, value) in shape::values(a, List::Feature) {
            let other = shape::values(b, List::Feature).into_iter().find(|(k, _)| *k == key).unwrap().1;
            let numbers = |value: &FieldValue| match value {
                FieldValue::Numbers(v) => v.clone(),
                FieldValue::Number(v) => vec![*v],
                _ => panic!("{value:?}"),
            };
            assert!(
                numbers(&value).iter().zip(&numbers(&other)).all(|(p, q)| (p - q).abs() < 3e-9),
                "{key} {a:?} {b:?}"
            );
        }
    }
}

#[test]
fn the_other_hand_is_the_mirrored_part() {
    let right = bracket(&BracketParameters { spacing_mm: 8.0, ..BracketParameters::default() });
    let left = right.mirrored();
    let mut document = bracket_plan(&right.comparison, &right.features);
    document.hold_by_features("H1", "S1", "A1").unwrap();
    let before = document.text().to_owned();
    let plane = MirrorPlane { across: Axis::X, at_mm: 0.0 };
    document.mirror(plane, &MirrorNames::Keep).unwrap();
    let draft = document.read().draft;
    let of = |points: &[crate::plan::ComparisonPoint]| points.iter().map(|p| p.geometry.clone()).collect::<Vec<_>>();
    assert_alike(&of(&draft.comparison), &of(&left.comparison));
    let of = |features: &[crate::plan::Feature]| features.iter().map(|p| p.geometry.clone()).collect::<Vec<_>>();
    assert_alike(&of(&draft.features), &of(&left.features));
    document.mirror(plane, &MirrorNames::Keep).unwrap();
    assert_eq!(document.text(), before);
    assert_eq!(document.undo_step().unwrap().to_string(), "Mirror the plan in x = 0");
    let swap = MirrorNames::Swap { one: "1".into(), other: "1_L".into() };
    document.mirror(MirrorPlane { across: Axis::Y, at_mm: 12.5 }, &swap).unwrap();
    assert_eq!(
        (names(&document, List::Feature), errors(&document)),
        (vec!["H1_L".to_owned(), "S1_L".into(), "A1_L".into()], Vec::new())
    );
    let [a, b] = [&right.comparison[0].geometry, &document.read().draft.comparison[0].geometry].map(Geometry::position);
    assert!((a.y + b.y - 25.0).abs() < 2e-9 && (a.x - b.x).abs() < 2e-9);
    document.mirror(MirrorPlane { across: Axis::Y, at_mm: 12.5 }, &swap).unwrap();
    assert_eq!(names(&document, List::Feature), ["H1", "S1", "A1"]);
    for (index, name) in ["A__L", "AL"].into_iter().enumerate() {
        document.rename(List::Feature, index, name).unwrap();
    }
    let clash = MirrorNames::Swap { one: "_L".into(), other: "L".into() };
    assert_eq!(document.mirror(plane, &clash), Err(EditError::NameTaken("A_L".into())));
}

#[test]
fn tables_of_points_come_back_in_every_style() {
    let made = bracket(&BracketParameters { spacing_mm: 8.0, ..BracketParameters::default() });
    let document = bracket_plan(&made.comparison, &[]);
    let points = document.read().draft.comparison;
    for style in [CsvStyle::ComparisonFile, CsvStyle::Tabs, CsvStyle::DecimalComma] {
        let table = csv_of_points(&points, style);
        let import = document.read_import(table.as_bytes(), Path::new("t.csv")).unwrap();
        assert_eq!(
            (import.problems.len(), import.rows.len(), import.not_named.len()),
            (0, points.len(), 0),
            "{style:?}"
        );
        assert!(import.rows.iter().all(|row| row.change == RowChange::Same), "{style:?}: {:?}", import.rows);
        let mut empty = bracket_plan(&[], &[]);
        let import = empty.read_import(table.as_bytes(), Path::new("t.csv")).unwrap();
        empty.import(&import, Rest::Keep).unwrap();
        let read = empty.read().draft.comparison;
        let of =
            |points: &[crate::plan::ComparisonPoint]| points.iter().map(|p| p.geometry.clone()).collect::<Vec<_>>();
        assert_alike(&of(&read), &of(&points));
        assert!(read.iter().zip(&points).all(|(a, b)| (&a.name, a.lower_mm) == (&b.name, b.lower_mm)), "{style:?}");
    }
}

#[test]
fn an_import_tells_what_it_would_do_and_every_fault() {
    let mut document = open(FULL);
    let table = "Name\tKind\tx\ty\tz\ti\tj\tk\tLower_mm\tUpper_mm\r\nP01\tsurface\t0\t0\t5,0\t0\t0\t1\t-0,25\t0,5\r\n\
        P02\tSurface\t10,5\t0\t5\t0\t0\t1\t-0,5\t0,5\r\n";
    let import = document.read_import(table.as_bytes(), Path::new("pasted")).unwrap();
    assert_eq!(import.problems, []);
    let told: Vec<String> =
        import.rows.iter().map(|row| format!("{} {} {:?}", row.line, row.point.name, row.change)).collect();
    assert_eq!(told[1], "3 P02 Added");
    let RowChange::Changed(changes) = &import.rows[0].change else { panic!("{told:?}") };
    assert_eq!(
        changes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        ["P01: lower tolerance -0.500 -> -0.250 mm"]
    );
    assert_eq!(import.not_named, ["E01", "C01"]);
    document.import(&import, Rest::Remove).unwrap();
    assert_eq!(
        (names(&document, POINTS), document.undo_step().unwrap().to_string()),
        (vec!["P01".to_owned(), "P02".into()], "Import 2 points".into())
    );
    assert!(document.text().contains("# position, direction (unit surface normal)"), "the comment of P01 stays");
    document.undo().unwrap();
    document.import(&import, Rest::Keep).unwrap();
    assert_eq!(names(&document, POINTS), ["P01", "E01", "C01", "P02"]);
    let faulty = "name;kind;x;y;z;i;j;k;lower_mm;upper_mm\nA;surface;1;2;drei;0;0;1;-1;1\nB;surface;1;2;3;0;0;1;1;-1\n\
        B;surface;1;2;3;0;0;1;-1;1\nC;surface;1;2\n";
    let import = document.read_import(faulty.as_bytes(), Path::new("t.csv")).unwrap();
    let lines: Vec<Option<usize>> = import.problems.iter().map(|d| d.line).collect();
    assert_eq!(lines, [Some(2), Some(3), Some(4), Some(5)], "{:#?}", import.problems);
    assert_eq!(document.import(&import, Rest::Keep), Err(EditError::FaultyTable(4)));
    let nothing = document.read_import(b"hello\n", Path::new("t.csv")).unwrap();
    assert!(nothing.faults() > 0 && nothing.problems.iter().all(|d| d.help.is_some()));
}

#[test]
fn points_of_a_file_are_taken_into_the_plan_before_they_are_edited() {
    let folder = tempfile::tempdir().unwrap();
    let (head, _) = FULL.split_once("[[comparison]]").unwrap();
    let text = format!("{head}[comparison_file]\nfile = \"points.csv\"\n");
    let path = folder.path().join("p.toml");
    let mut document = Document::from_bytes(text.as_bytes(), &path).unwrap();
    let refused = document.add(POINTS, &[PointSpec::point("", surface(1.0), -1.0, 1.0)]).unwrap_err();
    assert_eq!(refused, EditError::PointsInFile { file: "points.csv".into() });
    assert!(matches!(document.take_points_into_plan(), Err(EditError::BadPointsFile { .. })), "no such file");
    std::fs::write(
        folder.path().join("points.csv"),
        csv_of_points(&open(FULL).read().draft.comparison, CsvStyle::ComparisonFile),
    )
    .unwrap();
    document.take_points_into_plan().unwrap();
    assert_eq!(
        (names(&document, POINTS), document.points_file()),
        (vec!["P01".to_owned(), "E01".into(), "C01".into()], None)
    );
    let elsewhere = document.copy_to(&folder.path().join("other/p.toml")).unwrap();
    let cad = elsewhere.read().draft.cad.unwrap();
    assert_eq!((cad.path, elsewhere.is_modified()), (folder.path().join("bracket.stl"), true));
}
