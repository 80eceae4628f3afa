//! The pages after the first: all comparison points, features, holes, map and fit; `notes` has the warnings.

use super::flow::Flow;
use super::map::{kind_words, paper, row_fill};
use super::notes;
use super::page::{Font, Fonts, Page, Paint, Type, set};
use super::table::{Align, Column, Row, put};
use super::theme::{DENSE_ROW, LEFT, QUIET, RIGHT, STROKE, STRONG, Sign, TEXT};
use crate::inspect::{Inspection, InspectionResult, Verdict};
use crate::report::palette::Palette;
use crate::report::words::{
    capital, deviation, in_words, kind, limits, percent_of_tolerance, point_verdict, signed_mm, thousands,
};

const HEADING: Type = set(Font::SemiBold, 10.3);
const CELL: Type = set(Font::Regular, 7.8);
const NUMBER: Type = set(Font::Mono, 7.6);
const NAME: Type = set(Font::MonoBold, 7.6);

/// All pages after the first.
pub fn draw<'a>(fonts: &'a Fonts, result: &InspectionResult, inspection: &Inspection) -> Vec<Page<'a>> {
    let mut flow = Flow::new(fonts, result);
    if !inspection.points.is_empty() {
        comparison_points(&mut flow, inspection);
    }
    features(&mut flow, inspection);
    holes(&mut flow, inspection);
    figures(&mut flow, result, inspection);
    notes::put(&mut flow, inspection);
    flow.into_pages()
}

fn signed(value: f64) -> String {
    paper(&signed_mm(value))
}

/// A coordinate; beyond ten metres, one decimal has to do.
fn coordinate_text(value: f64) -> String {
    if value.abs() < 9999.9995 { signed(value) } else { paper(&format!("{value:+.1}")) }
}

fn dash() -> String {
    "–".to_owned()
}

fn left(head: &'static str, x: f64, set: Type, room: f64) -> Column {
    Column { head, align: Align::Left(x), set, room }
}

fn right(head: &'static str, x: f64, set: Type, room: f64) -> Column {
    Column { head, align: Align::Right(x), set, room }
}

/// Width of the widest name, within limits.
fn name_width<'n>(fonts: &Fonts, names: impl Iterator<Item = &'n str>, least: f64, most: f64) -> f64 {
    names.map(|n| fonts.width_mm(NAME, n)).fold(least, f64::max).min(most)
}

fn comparison_points(flow: &mut Flow<'_>, inspection: &Inspection) {
    let fonts = flow.page().fonts;
    // Numbers have their width: eight characters are 13 mm. Names take what is left, and are shortened beyond nine
    // characters or so; they never get smaller.
    let positions = || inspection.points.iter().flat_map(|p| p.nominal.iter().copied());
    let number = positions().map(|v| fonts.width_mm(NUMBER, &signed(v))).fold(12.0, f64::max).min(14.7) + 1.4;
    let kind_room = 19.6;
    let room = 100.6 - 3.0 * number - kind_room - 20.9 - 1.6;
    let width = name_width(fonts, inspection.points.iter().map(|p| p.name.as_str()), 8.0, room);
    let kind_x = 20.9 + width + 1.6;
    // What is left between kind and deviation is shared evenly.
    let coordinate = |k: f64| kind_x + kind_room + (100.6 - kind_x - kind_room) * k / 3.0;
    let columns = [
        left("Point", 20.9, NAME, width + 0.1),
        left("Kind", kind_x, CELL, kind_room),
        right("x", coordinate(1.0), NUMBER, number - 1.2),
        right("y", coordinate(2.0), NUMBER, number - 1.2),
        right("z", coordinate(3.0), NUMBER, number - 1.2),
        right("Deviation", 114.8, NAME, 13.4),
        right("Lower", 127.4, NUMBER, 12.0),
        right("Upper", 140.0, NUMBER, 12.0),
        right("U", 150.4, NUMBER, 9.9),
        right("Of tol.", 162.9, NUMBER, 12.0),
        right("Points", 173.8, NUMBER, 10.3),
        left("Verdict", 176.2, CELL, RIGHT - 176.2),
    ];
    let row = |p: &crate::inspect::PointResult| {
        let m = p.measurement.as_ref();
        let [lower, upper] = limits(p);
        Row {
            sign: Some(Sign::Verdict(p.verdict)),
            fill: row_fill(p.verdict).is_some(),
            cells: vec![
                p.name.clone(),
                kind_words(p).to_owned(),
                coordinate_text(p.nominal.x),
                coordinate_text(p.nominal.y),
                coordinate_text(p.nominal.z),
                m.map_or_else(dash, |m| paper(&deviation(p, m))),
                paper(&lower),
                paper(&upper),
                m.map_or_else(dash, |m| format!("{:.3}", m.uncertainty_mm)),
                p.tolerance_ratio().map_or_else(dash, percent_of_tolerance),
                thousands(p.points_used),
                point_verdict(p.verdict).to_owned(),
            ],
            words: why_open(p),
        }
    };
    let rows: Vec<Row> = inspection.points.iter().map(row).collect();
    put(flow, "All comparison points", &columns, &rows);
}

/// Why a point has no verdict, in words; empty where it has one.
fn why_open(point: &crate::inspect::PointResult) -> String {
    let is_open = matches!(point.verdict, Verdict::NotMeasured | Verdict::Undecided) && point.reason.is_some();
    if is_open { in_words(point) } else { String::new() }
}

fn features(flow: &mut Flow<'_>, inspection: &Inspection) {
    let features = &inspection.alignment.features;
    if features.is_empty() {
        return;
    }
    let fonts = flow.page().fonts;
    let width = name_width(fonts, features.iter().map(|f| f.name.as_str()), 10.0, 16.0);
    let kind_x = LEFT + 1.2 + width + 3.0;
    let columns = [
        left("Feature", LEFT + 1.2, NAME, width + 0.1),
        left("Kind", kind_x, CELL, 13.0),
        left("Fixes", kind_x + 14.0, CELL, 73.0 - kind_x - 14.0),
        right("x", 89.5, NUMBER, 16.0),
        right("y", 104.0, NUMBER, 14.0),
        right("z", 118.0, NUMBER, 14.0),
        right("Size, measured", 144.5, NUMBER, 26.0),
        right("Size, nominal", 171.0, NUMBER, 26.0),
        right("Points", 183.0, NUMBER, 11.5),
        right("rms", RIGHT - 1.2, NUMBER, 11.0),
    ];
    let size = |diameter: Option<f64>, length: Option<f64>| match (diameter, length) {
        (Some(width), Some(length)) => format!("{length:.3} × {width:.3}"),
        (Some(diameter), None) => format!("Ø {diameter:.3}"),
        _ => dash(),
    };
    let row = |f: &crate::align::MeasuredFeature| Row {
        sign: None,
        fill: false,
        cells: vec![
            f.name.clone(),
            kind(f.kind).to_owned(),
            capital(&f.fixes),
            signed(f.centre.x),
            signed(f.centre.y),
            signed(f.centre.z),
            size(f.diameter_mm, f.length_mm),
            size(f.nominal_diameter_mm, f.nominal_length_mm),
            thousands(f.points_used),
            format!("{:.3}", f.rms_mm),
        ],
        words: String::new(),
    };
    let rows: Vec<Row> = features.iter().map(row).collect();
    put(flow, "Features of the alignment", &columns, &rows);
}

/// What the table of all points has no room for: position and size of holes.
fn holes(flow: &mut Flow<'_>, inspection: &Inspection) {
    let measured: Vec<_> = inspection
        .points
        .iter()
        .filter_map(|p| p.measurement.as_ref().and_then(|m| m.hole.as_ref()).map(|h| (p, h)))
        .collect();
    if measured.is_empty() {
        return;
    }
    let fonts = flow.page().fonts;
    let width = name_width(fonts, measured.iter().map(|(p, _)| p.name.as_str()), 8.0, 30.0);
    let columns = [
        left("Point", 20.9, NAME, width + 0.1),
        right("Centre off in x", 82.0, NUMBER, 25.0),
        right("in y", 98.0, NUMBER, 16.0),
        right("in z", 114.0, NUMBER, 16.0),
        right("Position", 134.0, NUMBER, 18.0),
        right("Diameter", 160.0, NUMBER, 22.0),
        right("Measured − nominal", RIGHT - 1.2, NUMBER, 30.0),
    ];
    let rows: Vec<Row> = measured
        .iter()
        .map(|(p, h)| Row {
            sign: Some(Sign::Verdict(p.verdict)),
            fill: false,
            cells: vec![
                p.name.clone(),
                signed(h.delta_mm.x),
                signed(h.delta_mm.y),
                signed(h.delta_mm.z),
                format!("{:.3}", h.position_mm),
                format!("Ø {:.3}", h.diameter_mm),
                signed(h.diameter_deviation_mm),
            ],
            words: String::new(),
        })
        .collect();
    put(flow, "Holes", &columns, &rows);
}

/// Height of the three blocks, mm: a title and eight rows.
const FIGURES: f64 = 6.2 + 8.0 * DENSE_ROW;

/// Histogram, map and fit, background: three blocks side by side.
fn figures(flow: &mut Flow<'_>, result: &InspectionResult, inspection: &Inspection) {
    flow.need(FIGURES);
    let y = flow.y;
    let page = flow.page();
    histogram(page, result, inspection, y);
    map_and_fit(page, result, inspection, y);
    background(page, inspection, y);
    flow.y = y + FIGURES + 2.0;
}

/// Bars on either side of zero.
const BARS: usize = 20;

fn histogram(page: &mut Page<'_>, result: &InspectionResult, inspection: &Inspection, y: f64) {
    let range = result.map_range_mm;
    let (x, width, base, height) = (LEFT + 5.0, 67.0, y + 35.6, 27.0);
    page.text(LEFT, y + 4.0, HEADING, TEXT, &format!("Map, points per {} mm", trimmed(range / BARS as f64)));
    let mut bars = [0usize; 2 * BARS];
    for &d in &inspection.map.deviations_mm {
        let place = ((f64::from(d) / range + 1.0) * BARS as f64).floor();
        if place >= 0.0 && place < (2 * BARS) as f64 {
            bars[place as usize] += 1;
        }
    }
    let most = bars.iter().copied().max().unwrap_or(0);
    if most == 0 {
        page.text(x, base - 10.0, CELL, QUIET, "No points");
    }
    let step = width / (2 * BARS) as f64;
    for (k, &count) in bars.iter().enumerate().filter(|(_, count)| **count > 0) {
        let tall = height * count as f64 / most as f64;
        let value = (k as f64 + 0.5) / BARS as f64 - 1.0;
        let paint = Paint::both(Palette::default().colour(value), STRONG, 0.12);
        page.rect(x + step * k as f64, base - tall, step, tall, &paint);
    }
    page.rule(x, x + width, base, STRONG, 0.3);
    for k in 0..=4 {
        let (at, value) = (x + width * f64::from(k) / 4.0, range * (f64::from(k) / 2.0 - 1.0));
        page.rule(at, at + 0.2, base + 0.6, STRONG, 1.0);
        page.text_centre(at, base + 4.4, set(Font::Mono, 7.2), TEXT, &signed(value));
    }
}

/// A number without zeros at its end.
fn trimmed(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn map_and_fit(page: &mut Page<'_>, result: &InspectionResult, inspection: &Inspection, y: f64) {
    let s = &inspection.map.statistics;
    let fit = &inspection.best_fit;
    let some = |text: String| if s.points > 0 { text } else { dash() };
    let margin = if fit.margin.is_finite() { format!("{:.1}", fit.margin) } else { "no second pose".to_owned() };
    let rows = [
        ("Mean".to_owned(), some(signed(s.mean_mm))),
        ("rms".to_owned(), some(format!("{:.3}", s.rms_mm))),
        ("5 % and 95 %".to_owned(), some(format!("{} and {}", signed(s.p05_mm), signed(s.p95_mm)))),
        (format!("Within ±{:.3}", result.map_range_mm), some(format!("{:.1} %", 100.0 * s.within_range_ratio))),
        ("Past an edge, too far".to_owned(), format!("{}, {}", thousands(s.past_edge), thousands(s.far))),
        ("Best fit rms".to_owned(), format!("{:.3}", fit.rms_mm)),
        ("Inliers of scan points".to_owned(), format!("{:.1} %", 100.0 * fit.inlier_ratio)),
        ("Margin to 2nd pose".to_owned(), format!("{margin}, limit {:.1}", fit.margin_limit)),
    ];
    pairs(page, "Map and fit", 95.2, 158.2, y, &rows);
}

fn background(page: &mut Page<'_>, inspection: &Inspection, y: f64) {
    let r = &inspection.removed;
    let (away, others) = match r.other {
        0 => ("Stray", String::new()),
        count => ("Stray, other", format!(", {}", thousands(count))),
    };
    let rows = [
        ("Points read", thousands(inspection.points_read)),
        ("Invalid", thousands(r.invalid)),
        ("Duplicate", thousands(r.duplicate)),
        ("Belt", thousands(r.belt)),
        ("Colour", thousands(r.colour)),
        ("Dark", thousands(r.dark)),
        (away, thousands(r.stray) + &others),
        ("Points kept", thousands(inspection.points_kept)),
    ]
    .map(|(name, count)| (name.to_owned(), count));
    pairs(page, "Background", 162.8, RIGHT, y, &rows);
}

/// A small table of names and values.
fn pairs(page: &mut Page<'_>, title: &str, x0: f64, x1: f64, y: f64, rows: &[(String, String)]) {
    page.text(x0, y + 4.0, HEADING, TEXT, title);
    for (k, (name, value)) in rows.iter().enumerate() {
        let bottom = y + 6.2 + DENSE_ROW * (k + 1) as f64;
        page.text(x0 + 1.2, bottom - 1.3, CELL, TEXT, name);
        page.text_right(x1 - 1.2, bottom - 1.3, NUMBER, TEXT, value);
        page.rule(x0, x1, bottom, STROKE, 0.15);
    }
}
