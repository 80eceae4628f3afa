//! Whole reports: what stands on the pages, that nothing is cut or printed over, and that the bytes are the same.

use super::page::Placed;
use super::*;
use crate::geometry::Point3;
use crate::inspect::{PointResult, Verdict};
use crate::report::example;

/// One case: a result, and whether it has a map.
struct Case {
    name: &'static str,
    result: InspectionResult,
}

/// The sheet, its scan and the results that are printed of it.
fn cases() -> (crate::part::Part, crate::scan::ConditionedScan, Vec<Case>) {
    let (points, deviations) = example::dome_cloud(20_000, |p: &Point3| 0.008 * p.x);
    let spacing = example::dome_spacing(points.len());
    let mapped = |result| example::with_map(result, &points, deviations.clone(), spacing);
    let (fail, scan) = mapped(example::bracket());
    let mut none = fail.clone();
    example::inspection_mut(&mut none).points.clear();
    let mut many = fail.clone();
    let points_of = |k: usize, p: &PointResult| PointResult { name: format!("P{k:03}"), ..p.clone() };
    let known = example::inspection(&fail).points.clone();
    example::inspection_mut(&mut many).points = (0..500).map(|k| points_of(k, &known[k % known.len()])).collect();
    let mut open = fail.clone();
    example::inspection_mut(&mut open).points =
        (0..60).map(|k| unmeasured(k, &points_of(k, &known[k % known.len()]))).collect();
    example::inspection_mut(&mut open).verdict = Verdict::NotMeasured;
    let cases = vec![
        Case { name: "pass", result: mapped(example::pass()).0 },
        Case { name: "degraded", result: mapped(example::degraded()).0 },
        Case { name: "no points", result: none },
        Case { name: "500 points", result: many },
        Case { name: "hardly measured", result: open },
        Case { name: "long names", result: long_names(&fail) },
        Case { name: "refused", result: example::refused() },
        Case { name: "fail", result: fail },
    ];
    (example::dome_part(40), scan, cases)
}

/// All but every tenth point without a measurement, each for a reason of its own.
fn unmeasured(k: usize, p: &PointResult) -> PointResult {
    if k.is_multiple_of(10) {
        return p.clone();
    }
    let words = [
        "too few points",
        "the sheet around it is hidden from the camera by the part itself, 12 points are needed there",
    ];
    let reason = Some(format!("reason {k}: {}", words[k % 2].repeat(1 + k % 4)));
    PointResult { verdict: Verdict::NotMeasured, measurement: None, reason, ..p.clone() }
}

fn long_names(fail: &InspectionResult) -> InspectionResult {
    let mut result = fail.clone();
    let id = &mut result.identity;
    id.part_name = "Längsträger (vorne\\rechts) für Øresund, 漢字 ".repeat(4);
    id.part_number = "4711-02/".repeat(20);
    id.scan_file = "scan_(copy)_of_a_very_long_name\\".repeat(5);
    id.plan_file = id.scan_file.clone();
    id.cad_file = "WWWW".repeat(40);
    id.scan_taken = Some("2026-11-22T02:33:44+01:00".into());
    let inspection = example::inspection_mut(&mut result);
    inspection.verdict = Verdict::NotMeasured;
    inspection.warnings = vec!["w".repeat(700), "a warning of plain words ".repeat(60)];
    for (k, point) in inspection.points.iter_mut().enumerate() {
        point.name = format!("Punkt_(links)_oben_\\{k}_Ärmel\t\u{202e}");
        point.nominal *= 100.0;
        if let Some(m) = &mut point.measurement {
            m.deviation_mm *= 1000.0;
        }
    }
    for feature in &mut inspection.alignment.features {
        feature.name = format!("Bezug_{}_(Hauptaufnahme)_links", feature.name);
        feature.fixes = "the three translations of the part and then something".into();
        feature.centre *= 100.0;
    }
    result
}

/// All texts of a report, page by page.
fn texts(case: &Case, part: &crate::part::Part, scan: &crate::scan::ConditionedScan) -> Vec<Vec<Placed>> {
    let fonts = Fonts::new();
    let (pages, _) = pages(&fonts, &case.result, Some(&MapScene { part, scan }), &RunContext::silent()).unwrap();
    pages.iter().map(Page::texts).collect()
}

/// Every text of the pages stands inside the margins and over no other one.
pub(super) fn assert_whole(name: &str, pages: &[Vec<Placed>]) {
    for (k, page) in pages.iter().enumerate() {
        for (i, a) in page.iter().enumerate() {
            let place = format!("{name}, page {}: {a:?}", k + 1);
            assert!(a.x >= LEFT - 0.1 && a.x + a.width <= RIGHT + 0.6, "{place}");
            assert!(a.y - a.height >= 8.0 && a.y <= 289.0, "{place}");
            for b in &page[i + 1..] {
                let across = (a.x + a.width).min(b.x + b.width) - a.x.max(b.x);
                let down = a.y.min(b.y) - (a.y - a.height).max(b.y - b.height);
                // A mark inside a sign stands alone; everything else keeps clear of its neighbours.
                assert!(across < 0.05 || down < 0.05, "{place} over {b:?}");
            }
        }
    }
}

#[test]
fn nothing_is_cut_off_or_printed_over() {
    let (part, scan, cases) = cases();
    for case in &cases {
        assert_whole(case.name, &texts(case, &part, &scan));
    }
}

#[test]
fn the_first_page_says_what_came_out_and_every_page_its_number() {
    let (part, scan, cases) = cases();
    for case in &cases {
        let pages = texts(case, &part, &scan);
        let has = |page: usize, text: &str| pages[page].iter().any(|t| t.text.contains(text));
        for k in 0..pages.len() {
            assert!(has(k, &format!("Page {} of {}", k + 1, pages.len())), "{}", case.name);
        }
        let expected: &[&str] = match case.name {
            "pass" => &["Pass", "All 11 points in tolerance", "11 in tolerance", "seen from the top"],
            "fail" => &[
                "Fail",
                "2 of 11 points out of tolerance",
                "Fail: edge 0.258 mm too short",
                "after alignment on H1, S1 and A1",
            ],
            "degraded" => &[
                "Incomplete",
                "11 of 11 points not measured",
                "in the best fit only",
                "Datum S1 not measured: 9 points",
            ],
            "refused" => &["Refused", "The scan was not measured", "cut off after 1,204,331", "Copy it again"],
            "no points" => &["The plan has no comparison points", "nothing was judged"],
            "hardly measured" => &["Incomplete"],
            "500 points" => &["of 500 points out of tolerance"],
            _ => &["Incomplete", "Längsträger", "…", "(copy)"],
        };
        for text in expected {
            assert!(has(0, text), "{}: no {text:?} in {:?}", case.name, pages[0]);
        }
        let id = &case.result.identity;
        assert!(has(0, &id.plan_sha256) && has(0, &id.cad_sha256));
        if case.name == "500 points" {
            let rows = pages.iter().flatten().filter(|t| t.text == "All comparison points, continued").count();
            assert!(rows >= 8, "{rows}");
            // Each point once in the table of all points, and no row lost at a turn of the page.
            for k in 0..500 {
                assert!(pages[1..].iter().flatten().any(|t| t.text == format!("P{k:03}")), "{k}");
            }
        }
        if case.name == "hardly measured" {
            for k in (0..60).filter(|k| k % 10 > 0) {
                let told = format!("reason {k}:");
                assert_eq!(pages[1..].iter().flatten().filter(|t| t.text.contains(&told)).count(), 1, "{told}");
            }
        }
        if case.name == "degraded" {
            let told = pages[1..].iter().flatten().filter(|t| t.text.contains("datum S1 not measured")).count();
            assert!(told >= 11, "every row has its reason: {told}");
        }
        if case.name == "refused" {
            assert_eq!(pages.len(), 1);
        }
    }
}

#[test]
fn the_same_bytes_twice_and_with_any_number_of_threads() {
    let (part, scan, cases) = cases();
    let scene = MapScene { part: &part, scan: &scan };
    for case in cases.iter().filter(|c| ["fail", "refused"].contains(&c.name)) {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| pdf(&case.result, Some(&scene), &RunContext::silent()).unwrap())
        };
        let bytes = with(1);
        assert!(bytes == with(2), "{}", case.name);
        assert!(bytes.starts_with(b"%PDF-"));
        let text = String::from_utf8_lossy(&bytes);
        assert!(!text.contains("CreationDate") && !text.contains("ModDate"));
    }
    let ids = |result: &InspectionResult| {
        let bytes = pdf(result, None, &RunContext::silent()).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        text[text.rfind("/ID").unwrap()..].to_owned()
    };
    let mut other = example::refused();
    other.identity.scan_file = "0018.ply".into();
    assert_ne!(ids(&example::refused()), ids(&other));
}

#[test]
fn text_can_be_selected_and_fonts_are_in_the_file() {
    let bytes = pdf(&example::bracket(), None, &RunContext::silent()).unwrap();
    let options = printpdf::PdfParseOptions::default();
    let document = printpdf::PdfDocument::parse(&bytes, &options, &mut Vec::new()).unwrap();
    let text = document.extract_text().concat().concat();
    for expected in ["Bracket RH", "−0.958", "Ø 16.031", "Trimmed edge", "Page 1 of"] {
        assert!(text.contains(expected), "{expected}");
    }
    let file = String::from_utf8_lossy(&bytes);
    assert_eq!(file.matches("/FontFile2").count(), 5);
}
