//! What is told in words after the tables: why points have no verdict, as far as the first page has not said it, and
//! warnings.

use super::flow::Flow;
use super::page::{Font, Paint, Type, set};
use super::signs::sign;
use super::theme::{LEFT, QUIET, RIGHT, STROKE, STRONG, Sign, TEXT};
use crate::inspect::{Inspection, Verdict};
use crate::report::words::{capital, in_words, worst_first};

const HEADING: Type = set(Font::SemiBold, 10.3);
const NAME: Type = set(Font::MonoBold, 7.6);
const CELL: Type = set(Font::Regular, 7.8);
const LINE: f64 = 3.4;
const TITLE: &str = "Points without a verdict";

/// Puts the list of reasons and the warnings into the flow; the first page has said everything of the points in `told`.
pub fn put(flow: &mut Flow<'_>, inspection: &Inspection, told: &[usize]) {
    reasons(flow, inspection, told);
    // The first page says why the alignment was not possible.
    let known = inspection.alignment.degraded.as_deref().unwrap_or_default();
    for warning in inspection.warnings.iter().filter(|w| known.is_empty() || !w.contains(known)) {
        boxed(flow, "Warning.", warning);
    }
}

/// One list over as many pages as it takes, one line a point unless its reason is longer.
fn reasons(flow: &mut Flow<'_>, inspection: &Inspection, told: &[usize]) {
    let open = |i: &usize| {
        let p = &inspection.points[*i];
        matches!(p.verdict, Verdict::NotMeasured | Verdict::Undecided) && p.reason.is_some() && !told.contains(i)
    };
    let left: Vec<usize> = worst_first(&inspection.points).into_iter().filter(open).collect();
    if left.is_empty() {
        return;
    }
    let fonts = flow.page().fonts;
    let width = left.iter().map(|&i| fonts.width_mm(NAME, &inspection.points[i].name)).fold(8.0, f64::max).min(34.0);
    let x = 20.9 + width + 2.5;
    flow.need(18.0);
    title(flow, TITLE);
    for i in left {
        let p = &inspection.points[i];
        let mut lines = fonts.wrapped(CELL, &fonts.printable(CELL.font, &in_words(p)), RIGHT - x);
        // Twenty lines of one reason are enough; the result files hold all of it.
        lines.truncate(20);
        let height = LINE * lines.len() as f64 + 1.0;
        if !flow.has(height) {
            flow.turn();
            title(flow, "Points without a verdict, continued");
        }
        let y = flow.y;
        let page = flow.page();
        sign(page, Sign::Verdict(p.verdict), LEFT + 2.8, y + 0.5 * (LINE + 1.0), 1.4);
        page.text(20.9, y + 3.1, NAME, TEXT, &fonts.fitted(NAME, &fonts.printable(NAME.font, &p.name), width + 0.1));
        for (k, line) in lines.iter().enumerate() {
            page.text(x, y + 3.1 + LINE * k as f64, CELL, TEXT, line);
        }
        page.rule(LEFT, RIGHT, y + height, STROKE, 0.15);
        flow.y = y + height;
    }
    flow.y += 3.0;
}

fn title(flow: &mut Flow<'_>, words: &str) {
    let y = flow.y;
    let page = flow.page();
    page.text(LEFT, y + 4.4, HEADING, TEXT, words);
    let note = "A point that is not measured never counts as in tolerance.";
    page.text_right(RIGHT, y + 4.4, CELL, QUIET, note);
    page.rule(LEFT, RIGHT, y + 6.2, STRONG, 0.3);
    flow.y = y + 6.2;
}

/// A framed text: a bold opening, then the rest, wrapped.
fn boxed(flow: &mut Flow<'_>, opening: &str, text: &str) {
    let (bold, plain) = (set(Font::SemiBold, 8.4), set(Font::Regular, 8.4));
    let x = LEFT + 4.0;
    let fonts = flow.page().fonts;
    let room = RIGHT - x - 4.0;
    let mut lines = fonts.wrapped(plain, &fonts.printable(plain.font, &capital(text)), room);
    // Forty lines fill most of a page: more of one reason tells nobody more.
    lines.truncate(40);
    let height = 4.2 * (1 + lines.len()) as f64 + 3.0;
    flow.need(height);
    let y = flow.y;
    let page = flow.page();
    page.round_rect(LEFT, y, RIGHT - LEFT, height, 1.2, &Paint::stroke(STRONG, 0.25));
    page.text(x, y + 4.6, bold, TEXT, opening);
    for (k, line) in lines.iter().enumerate() {
        page.text(x, y + 8.8 + 4.2 * k as f64, plain, TEXT, line);
    }
    flow.y = y + height + 2.2;
}
