//! What is told in words after the tables: warnings.

use super::flow::Flow;
use super::page::{Font, Paint, set};
use super::theme::{LEFT, RIGHT, STRONG, TEXT};
use crate::inspect::Inspection;
use crate::report::words::capital;

/// Puts the warnings into the flow.
pub fn put(flow: &mut Flow<'_>, inspection: &Inspection) {
    // The first page says why the alignment was not possible.
    let known = inspection.alignment.degraded.as_deref().unwrap_or_default();
    for warning in inspection.warnings.iter().filter(|w| known.is_empty() || !w.contains(known)) {
        boxed(flow, "Warning.", warning);
    }
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
