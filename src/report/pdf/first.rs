//! The first page: the verdict, what was inspected, the map, the worst points.

use super::map::{MapRoom, MapScene, PreparedMap, caption, kind_words, paper, prepare};
use super::page::{Font, Page, Paint, Type, set};
use super::signs::sign;
use super::theme::{BOTTOM, LEFT, QUIET, RIGHT, ROW, STROKE, STRONG, Sign, TEXT};
use crate::inspect::{Inspection, InspectionResult, Outcome, Verdict};
use crate::report::raster::MapPicture;
use crate::report::words::{
    Counts, capital, in_words, part_verdict, percent_of_tolerance, signed_mm, thousands, worst_first,
};

const HEADING: Type = set(Font::SemiBold, 10.3);
const HEAD: Type = set(Font::SemiBold, 7.4);
const CELL: Type = set(Font::Regular, 7.8);
const NUMBER: Type = set(Font::Mono, 7.6);
const STRONG_NUMBER: Type = set(Font::MonoBold, 7.6);

/// The sign of the whole part.
pub fn part_sign(result: &InspectionResult) -> Sign {
    match &result.outcome {
        Outcome::Measured(inspection) => Sign::Verdict(inspection.verdict),
        Outcome::Refused(_) => Sign::Refused,
    }
}

/// The word of the whole part.
pub fn part_word(result: &InspectionResult) -> &'static str {
    match &result.outcome {
        Outcome::Measured(inspection) => part_verdict(inspection.verdict),
        Outcome::Refused(_) => "Refused",
    }
}

/// Draws the first page; gives back the picture that it refers to.
pub fn draw(page: &mut Page<'_>, result: &InspectionResult, scene: Option<&MapScene<'_>>) -> Option<MapPicture> {
    card(page, result);
    match &result.outcome {
        Outcome::Refused(refusal) => {
            let y = identity(page, result, 46.0);
            let y = paragraph(page, y + 8.0, "Reason", &refusal.reason);
            paragraph(page, y + 3.0, "What to do", &refusal.help);
            None
        }
        Outcome::Measured(inspection) => measured(page, result, inspection, scene),
    }
}

fn measured(
    page: &mut Page<'_>,
    result: &InspectionResult,
    inspection: &Inspection,
    scene: Option<&MapScene<'_>>,
) -> Option<MapPicture> {
    counts(page, inspection);
    let y = identity(page, result, 50.6);
    let title = page.fonts.cut(HEADING, &map_title(inspection), RIGHT - LEFT);
    page.text(LEFT, y + 6.2, HEADING, TEXT, &title);
    let top = y + 10.0;
    // Eight rows of the table, their head and the caption stay below the map.
    let rows = inspection.points.len().min(8) as f64;
    let height = BOTTOM - top - (rows + 1.0) * ROW - 21.0;
    let map = scene.and_then(|scene| prepare(page, result, inspection, scene, MapRoom { top, height }));
    let bottom = match &map {
        Some(map) => map.put(page, result, inspection),
        None => no_map(page, top),
    };
    caption(page, bottom + 6.0, map.as_ref());
    worst(page, inspection, bottom + 14.2);
    map.map(|map: PreparedMap<'_>| map.picture)
}

fn no_map(page: &mut Page<'_>, top: f64) -> f64 {
    let words = "No map: the points of this scan are not at hand.";
    page.text(LEFT, top + 3.0, CELL, QUIET, words);
    top + 6.0
}

/// The card with the verdict on its left and the part on its right.
fn card(page: &mut Page<'_>, result: &InspectionResult) {
    let (top, height) = (11.7, 29.4);
    let sign_of = part_sign(result);
    let paint = Paint::both(sign_of.fill(), sign_of.colour(), 0.5);
    page.round_rect(LEFT, top, RIGHT - LEFT, height, 1.5, &paint);
    sign(page, sign_of, 30.2, 26.4, 10.2);
    let word = set(Font::Bold, 35.0);
    page.text(46.2, 28.4, word, sign_of.text_colour(), part_word(result));
    let (sentence, detail) = (sentence(result), set(Font::SemiBold, 10.3));
    page.text(46.2, 35.3, detail, TEXT, &sentence);

    let right = RIGHT - 5.3;
    let id = &result.identity;
    // The part may take what the longer of the words on the left leaves.
    let room = |left: f64| right - 46.2 - left - 6.0;
    let word_room = room(page.fonts.width_mm(word, part_word(result)));
    let sentence_room = room(page.fonts.width_mm(detail, &sentence));
    let line = set(Font::Regular, 9.6);
    let put = |page: &mut Page<'_>, y: f64, set: Type, text: &str, room: f64| {
        let text = page.fonts.fitted(set, &page.fonts.printable(set.font, text), room);
        page.text_right(right, y, set, TEXT, &text);
    };
    put(page, 23.2, set(Font::SemiBold, 15.5), &id.part_name, word_room);
    put(page, 28.6, line, &format!("Number {}, revision {}", id.part_number, id.part_revision), word_room);
    let side = match &result.outcome {
        Outcome::Measured(inspection) => inspection.best_fit.side.map(|side| format!(", seen from the {}", side.key())),
        Outcome::Refused(_) => None,
    };
    let side = side.unwrap_or_default();
    let side_width = page.fonts.width_mm(line, &side);
    let prefix = page.fonts.width_mm(line, "Scan ");
    let scan = page.fonts.printable(line.font, &id.scan_file);
    let scan = page.fonts.fitted(line, &scan, sentence_room.max(30.0) - side_width - prefix);
    put(page, 33.6, line, &format!("Scan {scan}{side}"), sentence_room.max(30.0) + 1.0);
    if let Some(taken) = &id.scan_taken {
        put(page, 38.0, set(Font::Regular, 8.4), &format!("Taken {taken}"), 70.0);
    }
}

/// The verdict as one sentence with a count.
fn sentence(result: &InspectionResult) -> String {
    let Outcome::Measured(inspection) = &result.outcome else { return "The scan was not measured".to_owned() };
    let counts = Counts::of(&inspection.points);
    let of = match counts.total() {
        0 => return "The plan has no comparison points".to_owned(),
        1 => "1 point".to_owned(),
        n => format!("{} points", thousands(n)),
    };
    match inspection.verdict {
        Verdict::Pass if counts.total() == 1 => "The only point is in tolerance".to_owned(),
        Verdict::Pass => format!("All {of} in tolerance"),
        Verdict::Fail => format!("{} of {of} out of tolerance", thousands(counts.fail)),
        Verdict::Undecided => format!("{} of {of} undecided", thousands(counts.undecided)),
        Verdict::NotMeasured => format!("{} of {of} not measured", thousands(counts.not_measured)),
    }
}

fn counts(page: &mut Page<'_>, inspection: &Inspection) {
    let counts = Counts::of(&inspection.points);
    let set = set(Font::SemiBold, 9.6);
    let mut x = LEFT + 0.5;
    for (verdict, count, words) in [
        (Verdict::Fail, counts.fail, "out of tolerance"),
        (Verdict::NotMeasured, counts.not_measured, "not measured"),
        (Verdict::Undecided, counts.undecided, "undecided"),
        (Verdict::Pass, counts.pass, "in tolerance"),
    ] {
        sign(page, Sign::Verdict(verdict), x + 2.0, 46.0, 1.9);
        let text = format!("{} {words}", thousands(count));
        page.text(x + 5.6, 47.2, set, TEXT, &text);
        x += 5.6 + page.fonts.width_mm(set, &text) + 6.5;
    }
}

/// Plan, CAD and scan with their hashes, between two rules; returns the lower one.
fn identity(page: &mut Page<'_>, result: &InspectionResult, top: f64) -> f64 {
    let id = &result.identity;
    page.rule(LEFT, RIGHT, top, STROKE, 0.25);
    let cad = match id.cad_triangles {
        0 => String::new(),
        n => format!(", {} triangles", thousands(n)),
    };
    let points = match &result.outcome {
        Outcome::Measured(inspection) => format!(", {} points", thousands(inspection.points_read)),
        Outcome::Refused(_) => String::new(),
    };
    let rows = [
        ("Plan", &id.plan_file, String::new(), Some(id.plan_sha256.as_str())),
        ("CAD", &id.cad_file, cad, Some(id.cad_sha256.as_str())),
        ("Scan", &id.scan_file, points, id.scan_sha256.as_deref()),
    ];
    let (label, value, hash) = (set(Font::Regular, 8.6), set(Font::SemiBold, 8.6), set(Font::Mono, 7.0));
    for (k, (name, file, detail, sha256)) in rows.iter().enumerate() {
        let y = top + 4.6 + 4.5 * k as f64;
        page.text(LEFT + 0.5, y, label, QUIET, name);
        let room = 77.0 - (LEFT + 12.2) - page.fonts.width_mm(value, detail);
        let file = page.fonts.fitted(value, &page.fonts.printable(value.font, file), room);
        page.text(LEFT + 12.2, y, value, TEXT, &format!("{file}{detail}"));
        page.text(80.0, y, label, QUIET, "SHA-256");
        match sha256 {
            Some(sha256) => page.text(RIGHT - page.fonts.width_mm(hash, sha256), y, hash, TEXT, sha256),
            None => page.text_right(RIGHT, y, label, QUIET, "the file could not be read"),
        }
    }
    page.rule(LEFT, RIGHT, top + 16.8, STROKE, 0.25);
    top + 16.8
}

/// "Deviation map, N points, after alignment on H1, S1 and A1".
fn map_title(inspection: &Inspection) -> String {
    let alignment = &inspection.alignment;
    let points = thousands(inspection.map.statistics.points);
    let names: Vec<&str> = alignment.features.iter().map(|f| f.name.as_str()).collect();
    let how = match (alignment.degraded, &alignment.reason, names.as_slice()) {
        (true, Some(reason), _) => format!("in the best fit only: {reason}"),
        (true, None, _) => "in the best fit only".to_owned(),
        (false, _, []) => "in the best fit".to_owned(),
        (false, _, [one]) => format!("after alignment on {one}"),
        (false, _, [first @ .., last]) => format!("after alignment on {} and {last}", first.join(", ")),
    };
    format!("Deviation map, {points} points, {how}")
}

/// The table of the worst points, as many as there is room for.
fn worst(page: &mut Page<'_>, inspection: &Inspection, top: f64) {
    if inspection.points.is_empty() {
        return;
    }
    page.text(LEFT, top, HEADING, TEXT, "Worst points first");
    let y = top + 5.4;
    let name_width = inspection.points.iter().map(|p| page.fonts.width_mm(STRONG_NUMBER, &p.name)).fold(0.0, f64::max);
    let kind_x = 20.9 + name_width.clamp(7.5, 22.0) + 2.0;
    let number_x = |k: f64| (kind_x + 32.5) + 12.0 * k;
    let words_x = number_x(4.0) + 3.4;
    for (x, head) in [(20.9, "Point"), (kind_x, "Kind"), (words_x, "In words")] {
        page.text(x, y, HEAD, QUIET, head);
    }
    for (k, head) in ["Deviation", "Lower", "Upper", "U", "Of tol."].iter().enumerate() {
        page.text_right(number_x(k as f64), y, HEAD, QUIET, head);
    }
    page.rule(LEFT, RIGHT, y + 1.9, STRONG, 0.3);
    let first = y + 1.9;
    let fitting = ((BOTTOM - first) / ROW).max(0.0) as usize;
    for (k, &i) in worst_first(&inspection.points).iter().take(fitting.min(14)).enumerate() {
        let p = &inspection.points[i];
        let bottom = first + ROW * (k + 1) as f64;
        let base = bottom - 1.7;
        sign(page, Sign::Verdict(p.verdict), LEFT + 2.8, bottom - 0.5 * ROW, 1.5);
        page.text(20.9, base, STRONG_NUMBER, TEXT, &page.fonts.fitted(STRONG_NUMBER, &p.name, kind_x - 22.4));
        page.text(kind_x, base, CELL, TEXT, kind_words(p));
        let m = p.measurement.as_ref();
        let dash = || "–".to_owned();
        let signed = |v: f64| paper(&signed_mm(v));
        let cells = [
            m.map_or_else(dash, |m| signed(m.deviation_mm)),
            signed(p.lower_mm),
            signed(p.upper_mm),
            m.map_or_else(dash, |m| format!("{:.3}", m.uncertainty_mm)),
            p.tolerance_ratio().map_or_else(dash, percent_of_tolerance),
        ];
        for (k, cell) in cells.iter().enumerate() {
            let set = if k == 0 { STRONG_NUMBER } else { NUMBER };
            page.text_right(number_x(k as f64), base, set, TEXT, cell);
        }
        let words = page.fonts.printable(CELL.font, &in_words(p));
        page.text(words_x, base, CELL, TEXT, &page.fonts.cut(CELL, &words, RIGHT - words_x));
        page.rule(LEFT, RIGHT, bottom, STROKE, 0.15);
    }
}

/// A heading with a wrapped text below; returns where it ends.
fn paragraph(page: &mut Page<'_>, top: f64, heading: &str, text: &str) -> f64 {
    let body = set(Font::Regular, 12.0);
    page.text(LEFT, top + 4.0, HEADING, QUIET, heading);
    let mut y = top + 5.0;
    for line in page.fonts.wrapped(body, &page.fonts.printable(body.font, &capital(text)), RIGHT - LEFT) {
        if y > BOTTOM - 8.0 {
            break;
        }
        y += 6.2;
        page.text(LEFT, y, body, TEXT, &line);
    }
    y + 4.0
}
