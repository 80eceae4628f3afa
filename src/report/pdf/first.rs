//! The first page: the verdict, why nothing could be judged, what was inspected, the map; `worst` has the worst points.

use super::map::{MapRoom, MapScene, PreparedMap, caption, prepare};
use super::page::{Font, Page, Paint, Type, set};
use super::signs::sign;
use super::theme::{BOTTOM, LEFT, QUIET, RIGHT, STROKE, STRONG, Sign, TEXT};
use super::worst::Worst;
use crate::inspect::{Inspection, InspectionResult, Outcome, Verdict};
use crate::report::raster::MapPicture;
use crate::report::words::{Counts, capital, part_verdict, thousands};
use crate::run::{Cancelled, RunContext};

const HEADING: Type = set(Font::SemiBold, 10.3);
const CELL: Type = set(Font::Regular, 7.8);

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

/// Draws the first page; returns the picture that it refers to.
pub fn draw(
    page: &mut Page<'_>,
    result: &InspectionResult,
    scene: Option<&MapScene<'_>>,
    run: &RunContext,
) -> Result<Option<MapPicture>, Cancelled> {
    card(page, result);
    match &result.outcome {
        Outcome::Refused(refusal) => {
            let y = identity(page, result, 46.0);
            let y = paragraph(page, y + 8.0, "Reason", &refusal.reason);
            paragraph(page, y + 3.0, "What to do", &refusal.help);
            Ok(None)
        }
        Outcome::Measured(inspection) => measured(page, result, inspection, scene, run),
    }
}

fn measured(
    page: &mut Page<'_>,
    result: &InspectionResult,
    inspection: &Inspection,
    scene: Option<&MapScene<'_>>,
    run: &RunContext,
) -> Result<Option<MapPicture>, Cancelled> {
    let down = no_alignment(page, inspection, 43.6);
    counts(page, inspection, 46.0 + down);
    let y = identity(page, result, 50.6 + down);
    let title = page.fonts.cut(HEADING, &map_title(inspection), RIGHT - LEFT);
    page.text(LEFT, y + 6.2, HEADING, TEXT, &title);
    let top = y + 10.0;
    let worst = Worst::of(page.fonts, inspection);
    // The worst points and the caption stay below the map.
    let height = BOTTOM - top - worst.least_height() - 16.0;
    let map = match scene {
        Some(scene) => prepare(page, result, inspection, scene, MapRoom { top, height }, run)?,
        None => None,
    };
    let bottom = match &map {
        Some(map) => map.put(page, result, inspection),
        None => no_map(page, top),
    };
    caption(page, bottom + 6.0, inspection, map.as_ref());
    worst.put(page, inspection, bottom + 14.2);
    Ok(map.map(|map: PreparedMap<'_>| map.picture))
}

/// Why the plan's alignment was not possible and what to do, in a box; returns how much room it took, mm.
fn no_alignment(page: &mut Page<'_>, inspection: &Inspection, top: f64) -> f64 {
    let Some(reason) = &inspection.alignment.degraded else { return 0.0 };
    let (bold, plain) = (set(Font::SemiBold, 8.8), set(Font::Regular, 8.8));
    let of = Sign::Verdict(Verdict::NotMeasured);
    let x = LEFT + 10.4;
    let room = RIGHT - x - 4.0;
    let reason = format!("{}.", capital(reason.trim_end_matches('.')));
    let mut lines = page.fonts.wrapped(plain, &page.fonts.printable(plain.font, &reason), room);
    // More than three lines of one reason tell nobody more; the result files hold all of it.
    if lines.len() > 3 {
        lines.truncate(3);
        lines[2] = page.fonts.cut(plain, &format!("{} …", lines[2]), room);
    }
    let help = "Nothing is judged without the alignment; the map shows the best fit, for orientation only. Look whether the datum \
                feature is in the scan, free and clean, and whether its place and size in the plan are right. Then scan again.";
    lines.extend(page.fonts.wrapped(plain, help, room));
    let height = 4.2 * (lines.len() + 1) as f64 + 3.4;
    page.round_rect(LEFT, top, RIGHT - LEFT, height, 1.2, &Paint::stroke(STRONG, 0.25));
    sign(page, of, LEFT + 5.4, top + 4.6, 2.1);
    page.text(x, top + 5.0, bold, TEXT, "The alignment of the plan was not possible");
    for (k, line) in lines.iter().enumerate() {
        page.text(x, top + 9.2 + 4.2 * k as f64, plain, TEXT, line);
    }
    height + 2.6
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
    let pieces = [("Number ", id.part_number.as_str()), (", revision ", id.part_revision.as_str())];
    let number = page.fonts.shared(line, &pieces, word_room);
    page.text_right(right, 28.6, line, TEXT, &number);
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

fn counts(page: &mut Page<'_>, inspection: &Inspection, middle: f64) {
    let counts = Counts::of(&inspection.points);
    let set = set(Font::SemiBold, 9.6);
    let mut x = LEFT + 0.5;
    for (verdict, count, words) in [
        (Verdict::Fail, counts.fail, "out of tolerance"),
        (Verdict::NotMeasured, counts.not_measured, "not measured"),
        (Verdict::Undecided, counts.undecided, "undecided"),
        (Verdict::Pass, counts.pass, "in tolerance"),
    ] {
        sign(page, Sign::Verdict(verdict), x + 2.0, middle, 1.9);
        let text = format!("{} {words}", thousands(count));
        page.text(x + 5.6, middle + 1.2, set, TEXT, &text);
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
    // Hashes have 64 characters: where they begin is known, and files may take the room up to their label.
    let value_x = LEFT + 9.8;
    let label_x = RIGHT - page.fonts.width_mm(hash, &"0".repeat(64)) - page.fonts.width_mm(label, "SHA-256") - 2.0;
    for (k, (name, file, detail, sha256)) in rows.iter().enumerate() {
        let y = top + 4.6 + 4.5 * k as f64;
        page.text(LEFT + 0.5, y, label, QUIET, name);
        let room = label_x - 2.0 - value_x - page.fonts.width_mm(label, detail);
        let file = page.fonts.fitted(value, &page.fonts.printable(value.font, file), room);
        page.text(value_x, y, value, TEXT, &file);
        page.text(value_x + page.fonts.width_mm(value, &file), y, label, TEXT, detail);
        page.text(label_x, y, label, QUIET, "SHA-256");
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
    let how = match (alignment.degraded.is_some(), names.as_slice()) {
        (true, _) => "in the best fit only".to_owned(),
        (false, []) => "in the best fit".to_owned(),
        (false, [one]) => format!("after alignment on {one}"),
        (false, [first @ .., last]) => format!("after alignment on {} and {last}", first.join(", ")),
    };
    format!("Deviation map, {points} points, {how}")
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
