//! The shapes of verdicts and the markers of points, as paths.

use super::page::{Font, Page, Paint, set};
use super::theme::{ON_UNDECIDED, QUIET, Sign, TEXT, WHITE};
use crate::inspect::Verdict;
use crate::report::palette::Rgb;
use std::f64::consts::PI;

/// Draws a verdict's shape in a circle of radius `r` around a place.
pub fn sign(page: &mut Page<'_>, sign: Sign, x: f64, y: f64, r: f64) {
    let colour = sign.colour();
    match sign {
        Sign::Verdict(Verdict::Pass) => {
            page.circle(x, y, r, &Paint::fill(colour));
            let check = [[x - 0.46 * r, y + 0.04 * r], [x - 0.12 * r, y + 0.38 * r], [x + 0.5 * r, y - 0.34 * r]];
            page.line(&check, WHITE, 0.26 * r, true);
        }
        Sign::Verdict(Verdict::Fail) => {
            page.polygon(&ring(x, y, r * 1.04, 8, PI / 8.0), &Paint::fill(colour));
            let d = 0.36 * r;
            page.line(&[[x - d, y - d], [x + d, y + d]], WHITE, 0.3 * r, false);
            page.line(&[[x - d, y + d], [x + d, y - d]], WHITE, 0.3 * r, false);
        }
        Sign::Verdict(Verdict::Undecided) => {
            page.polygon(&ring(x, y, r * 1.1, 4, 0.0), &Paint::fill(colour));
            mark(page, "?", x, y, 1.15 * r, ON_UNDECIDED);
        }
        Sign::Verdict(Verdict::NotMeasured) => {
            let side = 0.86 * r;
            // Each side is 4 dashes and 4 gaps long, so that all corners are closed.
            let unit = 2.0 * side / 7.0;
            let paint = Paint { dash: Some((unit, unit)), ..Paint::both(WHITE, colour, 0.22 * r) };
            page.rect(x - side, y - side, 2.0 * side, 2.0 * side, &paint);
            page.line(&[[x - 0.4 * r, y], [x + 0.4 * r, y]], colour, 0.26 * r, false);
        }
        Sign::Refused => {
            let triangle = [[x, y - 0.98 * r], [x + 1.08 * r, y + 0.88 * r], [x - 1.08 * r, y + 0.88 * r]];
            page.polygon(&triangle, &Paint { stroke: Some((colour, 0.12 * r)), ..Paint::fill(colour) });
            mark(page, "!", x, y + 0.22 * r, 1.1 * r, WHITE);
        }
    }
}

/// A bold character whose capital height is `height` mm, its middle at a place.
fn mark(page: &mut Page<'_>, text: &str, x: f64, y: f64, height: f64, colour: Rgb) {
    // Inter's capitals are 0.727 em high.
    let size_pt = height / 0.727 * 72.0 / 25.4;
    page.text_centre(x, y + 0.5 * height, set(Font::Bold, size_pt), colour, text);
}

/// Corners of a regular polygon; the first one is `turn` rad from the right.
fn ring(x: f64, y: f64, r: f64, corners: usize, turn: f64) -> Vec<[f64; 2]> {
    let corner = |k: usize| turn + 2.0 * PI * k as f64 / corners as f64;
    (0..corners).map(|k| [x + r * corner(k).cos(), y + r * corner(k).sin()]).collect()
}

/// Draws a point's marker on the map: its kind by form, its verdict by colour, not measured dashed and empty, with a white
/// rim.
pub fn marker(page: &mut Page<'_>, kind: &str, verdict: Verdict, x: f64, y: f64, r: f64) {
    let colour = Sign::Verdict(verdict).colour();
    let rim = 0.28 * r;
    let empty = verdict == Verdict::NotMeasured;
    let dash = empty.then_some((0.5 * r, 0.35 * r));
    match (kind, empty) {
        ("edge", _) => {
            let triangle = |r: f64| [[x, y - r], [x + 1.05 * r, y + 0.78 * r], [x - 1.05 * r, y + 0.78 * r]];
            page.polygon(&triangle(r), &Paint::both(WHITE, WHITE, 2.0 * rim));
            let paint = if empty { Paint::stroke(colour, 0.3 * r) } else { Paint::fill(colour) };
            page.polygon(&triangle(r), &Paint { dash, ..paint });
        }
        ("hole", _) => {
            page.circle(x, y, r + rim, &Paint::fill(WHITE));
            page.circle(x, y, 0.78 * r, &Paint { dash, ..Paint::stroke(colour, 0.44 * r) });
        }
        (_, true) => {
            page.circle(x, y, r + rim, &Paint::fill(WHITE));
            page.circle(x, y, 0.85 * r, &Paint { dash, ..Paint::stroke(colour, 0.3 * r) });
        }
        (_, false) => {
            page.circle(x, y, r + rim, &Paint::fill(WHITE));
            page.circle(x, y, r, &Paint::fill(colour));
        }
    }
}

/// The line that explains the forms of markers; returns where it ends.
pub fn kinds(page: &mut Page<'_>, x: f64, baseline: f64) -> f64 {
    let words = set(Font::Regular, 7.8);
    let mut at = x;
    for (kind, word) in [("surface", "Surface"), ("edge", "Trimmed edge"), ("hole", "Hole")] {
        let (cx, cy) = (at + 1.5, baseline - 1.0);
        match kind {
            "edge" => {
                page.polygon(&[[cx, cy - 1.3], [cx + 1.35, cy + 1.0], [cx - 1.35, cy + 1.0]], &Paint::fill(QUIET))
            }
            "hole" => page.circle(cx, cy, 1.0, &Paint::stroke(QUIET, 0.6)),
            _ => page.circle(cx, cy, 1.25, &Paint::fill(QUIET)),
        }
        page.text(at + 4.2, baseline, words, TEXT, word);
        at += 4.2 + page.fonts.width_mm(words, word) + 4.0;
    }
    at
}
