//! What is told of a plan that is edited: problems at their fields, what changed, revisions.

use super::tests::{FULL, POINTS, errors, open, surface, words};
use super::*;
use crate::geometry::Point3;
use crate::plan::{RegionShape, parse};
use std::path::Path;

#[test]
fn plans_with_faults_can_be_edited_as_far_as_they_are_toml() {
    let broken = FULL.replacen("thickness_mm = 1.2", "thickness_mm = \"1,2\"", 1).replacen(
        "kind = \"edge\"",
        "kind = \"egde\"",
        1,
    );
    let mut document = open(&broken);
    document.rename(POINTS, 1, "E09").unwrap();
    document.set_setting("part", "thickness_mm", &FieldValue::Number(1.2)).unwrap();
    document.set_value(POINTS, 1, "kind", &FieldValue::Text("edge".into())).unwrap();
    assert_eq!(
        (errors(&document), document.undo_step().unwrap().to_string()),
        (Vec::new(), "Change kind of E09".into())
    );
    let mut document = open(&FULL.replacen("unit = \"mm\"", "unit = mm\"", 1));
    let refused = document.rename(POINTS, 0, "P7").unwrap_err();
    assert!(refused.to_string().starts_with("line 14 cannot be read"), "{refused}");
    assert!(document.rows(POINTS).is_empty() && document.problems().iter().any(|p| p.diagnostic.line == Some(14)));
    document.set_text(FULL, Step::new(Verb::Edit, "text"));
    assert_eq!((document.structure(), document.undo().unwrap().to_string()), (Ok(()), "Edit text".into()));
    let latin = Document::from_bytes(b"name = \"\xe5\"", Path::new("p.toml")).unwrap_err();
    assert!(latin.message.contains("UTF-8"), "{latin}");
}

#[test]
fn problems_stand_at_their_fields() {
    let cases: &[(&str, &str, At, Option<&str>)] = &[
        ("thickness_mm = 1.2", "thickness_mm = -1.2", At::Settings("part"), Some("thickness_mm")),
        ("thickness_mm = 1.2", "", At::Settings("part"), Some("thickness_mm")),
        ("revision = \"C\"", "revison = \"C\"", At::Settings("part"), Some("revison")),
        ("hole = \"H1\"", "hole = \"H9\"", At::Settings("alignment"), Some("hole")),
        ("position = [134.0, 0.0, 2.0]", "position = [134.0, 0.0]", At::Comparison(1), Some("position")),
        ("diameter_mm = 16.0", "", At::Feature(0), Some("diameter_mm")),
        ("length_mm = 30.0", "length_mm = 3.0", At::Feature(1), Some("length_mm")),
        ("name = \"E01\"", "name = \"P01\"", At::Comparison(1), Some("name")),
        ("schema = 1", "schema = 2", At::Plan, Some("schema")),
        ("lower_mm = -0.3", "lower_mm = 0.3", At::Comparison(2), Some("lower_mm")),
        ("[rig] ", "[rigg] ", At::Plan, Some("rigg")),
        ("[part]", "[prt]", At::Plan, Some("prt")),
        ("[[comparison]]\nname = \"P01\"", "[[comparison]]\nnam = \"P01\"", At::Comparison(0), Some("nam")),
    ];
    for (from, to, at, key) in cases {
        assert!(FULL.contains(from), "{from}");
        let document = open(&FULL.replacen(from, to, 1));
        let problems = document.locate(parse(&document.bytes(), document.path()).problems);
        let found = problems.iter().any(|p| p.place == Place { at: *at, key: key.map(str::to_owned) });
        assert!(found, "{to}: {problems:#?}");
    }
    let document = open("[cad]\nfile = \"a.stl\"\n");
    let part = Place { at: At::Settings("part"), key: None };
    assert!(document.problems().iter().any(|p| p.place == part), "{:#?}", document.problems());
    let document = open(FULL);
    let missing = document.problems();
    let cad = Place { at: At::Settings("cad"), key: Some("file".into()) };
    assert!(missing.iter().any(|p| p.place == cad && p.diagnostic.message.contains("found no file")), "{missing:?}");
    assert_eq!(document.line_of(At::Comparison(0)), FULL.lines().position(|l| l == "[[comparison]]").map(|k| k + 1));
}

#[test]
fn what_changed_reads_like_a_note_to_a_colleague() {
    let mut document = open(FULL);
    assert!(document.changes().is_empty());
    document.set_setting("part", "thickness_mm", &FieldValue::Number(1.5)).unwrap();
    document.set_setting("cad", "file", &FieldValue::Text("new.stl".into())).unwrap();
    document.remove_setting("background", "luminance_min").unwrap();
    document.set_tolerances(&[1], None, Some(0.9)).unwrap();
    document.rename(POINTS, 0, "P07").unwrap();
    document.set_value(POINTS, 2, "diameter_mm", &FieldValue::Number(20.0001)).unwrap();
    document.add(POINTS, &[PointSpec::point("", surface(1.0), -1.0, 1.0)]).unwrap();
    document.remove(List::Feature, &[2]).unwrap();
    document.set_value(POINTS, 1, "position", &FieldValue::Numbers(vec![134.0, 3.0, 6.0])).unwrap();
    document.reorder(POINTS, 1, 2).unwrap();
    let expected = [
        "sheet thickness: 1.200 -> 1.500 mm",
        "CAD file: \"bracket.stl\" -> \"new.stl\"",
        "least luminance: 25 -> left out",
        "A1: feature removed",
        "P07: was P01",
        "C01: diameter 20 -> 20.0001 mm",
        "E01: moved by 5.000 mm, position [134.000, 0.000, 2.000] -> [134.000, 3.000, 6.000] mm",
        "E01: upper tolerance 0.700 -> 0.900 mm",
        "P08: comparison point added (surface)",
        "comparison points: in another order",
    ];
    assert_eq!(words(&document), expected);
    let there: Vec<String> =
        open(FULL).changes_to(&document.text().replace('\n', "\r\n")).iter().map(ToString::to_string).collect();
    assert_eq!((there, document.changes_to(document.text())), (words(&document), Vec::new()));
    let mut document = open(FULL);
    document.set_text(&format!("# hello\n{FULL}"), Step::new(Verb::Edit, "text"));
    assert_eq!(words(&document), ["plan: comments or layout"]);
    document
        .hold_by_regions(&[Region {
            name: "a".into(),
            centre: Point3::origin(),
            shape: RegionShape::Ball { radius_mm: 2.0 },
            weight: 2.0,
        }])
        .unwrap();
    let told = words(&document);
    assert!(told.contains(&"alignment method: \"features\" -> \"best_fit\"".to_owned()), "{told:?}");
    assert!(
        told.iter().any(|w| w.starts_with("region 1: added (name \"a\", centre [0, 0, 0], radius 2, weight 2)")),
        "{told:?}"
    );
}

#[test]
fn revisions_are_noted_in_the_plan_and_read_back() {
    let mut document = open(FULL);
    document.set_tolerances(&[1], None, Some(0.9)).unwrap();
    let told = document.revise("D", "2026-11-22", "press set up anew:\nall good").unwrap();
    assert_eq!(told.len(), 1);
    assert_eq!(
        (errors(&document), document.setting("part", "revision")),
        (Vec::new(), Some(FieldValue::Text("D".into())))
    );
    document.mark_saved(&document.bytes());
    assert!(!document.is_modified() && document.changes().is_empty());
    document.set_setting("part", "name", &FieldValue::Text("Bracket LH".into())).unwrap();
    document.revise("E, second", "", "other hand").unwrap();
    let first = Revision {
        revision: "D".into(),
        date: "2026-11-22".into(),
        reason: "press set up anew: all good".into(),
        changes: vec!["E01: upper tolerance 0.700 -> 0.900 mm".into()],
    };
    let revisions = document.revisions();
    assert_eq!((revisions.len(), &revisions[0]), (2, &first));
    assert_eq!(revisions[1].changes, ["part name: \"Bracket RH\" -> \"Bracket LH\""]);
    assert_eq!(document.text().matches("# Revisions of this plan").count(), 1);
    // What is added later comes before the notes.
    document.set_setting("output", "map_range_mm", &FieldValue::Number(2.0)).unwrap();
    assert_eq!((document.revisions().len(), errors(&document)), (2, Vec::new()));
}
