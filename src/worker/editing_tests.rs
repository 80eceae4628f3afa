//! From nothing to a plan that can be run, by clicks on the CAD alone.

use super::plan_file::{Overwrite, open_plan, save_plan};
use super::{check_document, check_plan, foretell_document, prepare_document};
use crate::geometry::{LengthUnit, Point3, UnitVector3, Vector3};
use crate::io::write_stl;
use crate::part::propose::{Picker, Proposal, Ray};
use crate::plan::document::{Document, List, NewPlan, PointSpec};
use crate::plan::{CadSide, Geometry};
use crate::run::RunContext;
use crate::simulate::{BracketParameters, bracket};
use std::fs;
use std::sync::Arc;

/// What is proposed for a click near a place whose shape is known.
fn click(picker: &Picker, truth: &Geometry) -> Proposal {
    let towards = UnitVector3::new_normalize(-truth.sheet_normal());
    let ray = |at: Point3| Ray { origin: at - towards.into_inner() * 15.0, direction: towards };
    let at = truth.position();
    let told = match truth {
        Geometry::Surface { .. } => picker.surface_point(&ray(at)),
        Geometry::Edge { direction, .. } => picker.edge_point(&ray(at - direction.into_inner()), 2.0),
        Geometry::Hole { .. } | Geometry::Slot { .. } => picker.hole_or_slot(&ray(at), 2.0),
    };
    told.unwrap_or_else(|fault| panic!("{truth:?}: {fault}"))
}

#[test]
fn a_plan_made_by_clicks_has_nothing_for_check_to_tell() {
    let run = RunContext::silent();
    let folder = tempfile::tempdir().unwrap();
    let made = bracket(&BracketParameters::default());
    let mut stl = Vec::new();
    write_stl(&mut stl, &made.mesh).unwrap();
    fs::write(folder.path().join("bracket.stl"), stl).unwrap();
    fs::create_dir(folder.path().join("in")).unwrap();
    let path = folder.path().join("bracket.toml");
    let first = NewPlan {
        name: "Bracket".into(),
        cad_file: "bracket.stl".into(),
        cad_unit: LengthUnit::Mm,
        scans_folder: "in".into(),
        scans_pattern: "*.ply".into(),
        thickness_mm: made.thickness_mm,
        cad_side: CadSide::Top,
        point_spacing_mm: 0.7,
    };
    let mut document = Document::new_plan(&path, &first).unwrap();
    let part = Arc::new(prepare_document(&document, &run).unwrap().unwrap());
    let picker = Picker::new(part.clone());
    let features: Vec<PointSpec> =
        made.features.iter().map(|f| PointSpec::feature("", click(&picker, &f.geometry).geometry)).collect();
    document.add(List::Feature, &features).unwrap();
    document.hold_by_features("H1", "S1", "A1").unwrap();
    for point in &made.comparison {
        let geometry = click(&picker, &point.geometry).geometry;
        document.add(List::Comparison, &[PointSpec::point("", geometry, point.lower_mm, point.upper_mm)]).unwrap();
    }
    let names: Vec<String> = document.rows(List::Comparison).into_iter().map(|row| row.name).collect();
    assert_eq!(names, made.comparison.iter().map(|p| p.name.clone()).collect::<Vec<_>>());
    assert_eq!(check_document(&document, Some(&part)), []);
    let foretold = foretell_document(&document, Some(&part)).unwrap();
    assert_eq!(foretold.points.len(), made.comparison.len());
    save_plan(&mut document, Overwrite::Own).unwrap();
    assert_eq!(check_plan(&path, &run).unwrap(), []);
    // An edge turned into the sheet is told at its field.
    let mut document = open_plan(&path).unwrap().document;
    let edge = made.comparison.iter().position(|p| p.geometry.kind() == "edge").unwrap();
    let Geometry::Edge { position, direction, normal } = document.read().draft.comparison[edge].geometry else {
        panic!()
    };
    document.reshape(List::Comparison, edge, &Geometry::Edge { position, direction: -direction, normal }).unwrap();
    let problems = check_document(&document, Some(&part));
    assert_eq!(problems.len(), 1, "{problems:#?}");
    let place = &problems[0].place;
    assert_eq!((place.at, place.key.as_deref()), (crate::plan::document::At::Comparison(edge), Some("direction")));
    document.set_value(List::Comparison, edge, "position", &numbers(position + Vector3::new(0.0, 0.0, 300.0))).unwrap();
    assert!(check_document(&document, Some(&part)).iter().any(|p| p.place.key.as_deref() == Some("position")));
}

fn numbers(p: Point3) -> crate::plan::document::FieldValue {
    crate::plan::document::FieldValue::Numbers(p.iter().copied().collect())
}
