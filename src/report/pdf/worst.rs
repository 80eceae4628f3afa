//! The worst points on the first page: a table with what there is to say of each in words, or, where nothing could be
//! judged, only their names.

use super::map::{kind_words, paper};
use super::page::{Font, Fonts, Page, Type, set};
use super::signs::sign;
use super::theme::{BOTTOM, LEFT, QUIET, RIGHT, ROW, STROKE, STRONG, Sign, TEXT};
use crate::inspect::{Inspection, PointResult, Verdict};
use crate::report::words::{deviation, in_words, limits, percent_of_tolerance, worst_first};

const HEADING: Type = set(Font::SemiBold, 10.3);
const HEAD: Type = set(Font::SemiBold, 7.4);
const CELL: Type = set(Font::Regular, 7.8);
const NUMBER: Type = set(Font::Mono, 7.6);
const STRONG_NUMBER: Type = set(Font::MonoBold, 7.6);

/// The table has at most so many rows, and the map leaves room for the first eight.
const MOST: usize = 14;
const LEAST: usize = 8;
/// From one line of words to the next, mm.
const LINE: f64 = 3.3;
/// From the baseline of the title to the first row, mm.
const HEAD_HEIGHT: f64 = 7.3;

/// What will stand below the map.
pub enum Worst {
    /// The plan has no points.
    Nothing,
    /// Lines of names: none of the points could be judged, for one reason that is told elsewhere.
    Names(Vec<String>),
    /// The table.
    Table(Columns, Vec<Entry>),
}

/// Where the columns stand, mm from the left.
pub struct Columns {
    kind: f64,
    words: f64,
    /// Right ends of deviation, lower, upper, U, percentage.
    numbers: [f64; 5],
}

/// One row.
pub struct Entry {
    point: usize,
    words: Vec<String>,
}

impl Entry {
    fn height(&self) -> f64 {
        ROW + LINE * self.words.len().saturating_sub(1) as f64
    }
}

impl Worst {
    /// Lays the worst points out.
    pub fn of(fonts: &Fonts, inspection: &Inspection) -> Worst {
        let points = &inspection.points;
        if points.is_empty() {
            return Worst::Nothing;
        }
        if inspection.alignment.degraded.is_some() && points.iter().all(|p| p.verdict == Verdict::NotMeasured) {
            return Worst::Names(names(fonts, points));
        }
        let order: Vec<usize> = worst_first(points).into_iter().take(MOST).collect();
        let width = order.iter().map(|&i| fonts.width_mm(STRONG_NUMBER, &points[i].name)).fold(7.5, f64::max);
        let kind = 20.9 + width.min(17.0) + 2.2;
        // A trimmed edge is 19 mm wide, a deviation of eight characters 13 mm, a limit of seven 11.4 mm.
        let numbers = [33.4, 45.4, 57.2, 68.6, 80.4].map(|x| kind + x);
        let columns = Columns { kind, words: numbers[4] + 3.0, numbers };
        let entries = order.iter().map(|&point| entry(fonts, &points[point], point, RIGHT - columns.words)).collect();
        Worst::Table(columns, entries)
    }

    /// Room below the map that it needs at least, mm.
    pub fn least_height(&self) -> f64 {
        match self {
            Worst::Nothing => 6.0,
            Worst::Names(lines) => 6.0 + 4.2 * lines.len() as f64,
            Worst::Table(_, entries) => HEAD_HEIGHT + entries.iter().take(LEAST).map(Entry::height).sum::<f64>(),
        }
    }

    /// Draws it.
    pub fn put(&self, page: &mut Page<'_>, inspection: &Inspection, top: f64) {
        match self {
            Worst::Nothing => {
                page.text(LEFT, top, CELL, QUIET, "There are no comparison points in the plan: nothing was judged.");
            }
            Worst::Names(lines) => {
                page.text(LEFT, top, HEADING, TEXT, "Not measured");
                for (k, line) in lines.iter().enumerate() {
                    page.text(LEFT, top + 5.6 + 4.2 * k as f64, CELL, TEXT, line);
                }
            }
            Worst::Table(columns, entries) => table(page, inspection, top, columns, entries),
        }
    }
}

/// The names of all points in lines; what goes beyond four lines is left to the other pages.
fn names(fonts: &Fonts, points: &[PointResult]) -> Vec<String> {
    const LINES: usize = 4;
    let all: Vec<&str> = points.iter().map(|p| p.name.as_str()).collect();
    let room = RIGHT - LEFT;
    let mut lines = fonts.wrapped(CELL, &fonts.printable(CELL.font, &all.join(", ")), room);
    if lines.len() > LINES {
        lines.truncate(LINES);
        const MORE: &str = " and more, see the next page";
        let last = fonts.cut(CELL, &format!("{} …", lines[LINES - 1]), room - fonts.width_mm(CELL, MORE));
        lines[LINES - 1] = format!("{last}{MORE}");
    }
    lines
}

fn entry(fonts: &Fonts, p: &PointResult, point: usize, room: f64) -> Entry {
    let mut words = fonts.wrapped(CELL, &fonts.printable(CELL.font, &in_words(p)), room);
    if words.len() > 2 {
        const MORE: &str = " (more in the table)";
        let last = fonts.cut(CELL, &format!("{} …", words[1]), room - fonts.width_mm(CELL, MORE));
        words.truncate(1);
        words.push(format!("{last}{MORE}"));
    }
    Entry { point, words }
}

fn table(page: &mut Page<'_>, inspection: &Inspection, top: f64, columns: &Columns, entries: &[Entry]) {
    page.text(LEFT, top, HEADING, TEXT, "Worst points first");
    let y = top + 5.4;
    for (x, head) in [(20.9, "Point"), (columns.kind, "Kind"), (columns.words, "In words")] {
        page.text(x, y, HEAD, QUIET, head);
    }
    for (x, head) in columns.numbers.iter().zip(["Deviation", "Lower", "Upper", "U", "Of tol."]) {
        page.text_right(*x, y, HEAD, QUIET, head);
    }
    page.rule(LEFT, RIGHT, y + 1.9, STRONG, 0.3);
    let mut row_top = top + HEAD_HEIGHT;
    for entry in entries {
        let bottom = row_top + entry.height();
        if bottom > BOTTOM {
            break;
        }
        row(page, &inspection.points[entry.point], columns, entry, row_top);
        page.rule(LEFT, RIGHT, bottom, STROKE, 0.15);
        row_top = bottom;
    }
}

fn row(page: &mut Page<'_>, p: &PointResult, columns: &Columns, entry: &Entry, top: f64) {
    let base = top + ROW - 1.7;
    sign(page, Sign::Verdict(p.verdict), LEFT + 2.8, top + 0.5 * ROW, 1.5);
    let name = page.fonts.printable(STRONG_NUMBER.font, &p.name);
    page.text(20.9, base, STRONG_NUMBER, TEXT, &page.fonts.fitted(STRONG_NUMBER, &name, columns.kind - 22.4));
    page.text(columns.kind, base, CELL, TEXT, kind_words(p));
    let m = p.measurement.as_ref();
    let dash = || "–".to_owned();
    let [lower, upper] = limits(p);
    let cells = [
        m.map_or_else(dash, |m| paper(&deviation(p, m))),
        paper(&lower),
        paper(&upper),
        m.map_or_else(dash, |m| format!("{:.3}", m.uncertainty_mm)),
        p.tolerance_ratio().map_or_else(dash, percent_of_tolerance),
    ];
    // What the neighbour on the left leaves, of the usual width of each number.
    let rooms = [13.6, 11.8, 11.6, 11.2, 11.6];
    for (k, cell) in cells.iter().enumerate() {
        let set = if k == 0 { STRONG_NUMBER } else { NUMBER };
        let cell = page.fonts.fitted(set, cell, rooms[k]);
        page.text_right(columns.numbers[k], base, set, TEXT, &cell);
    }
    for (k, line) in entry.words.iter().enumerate() {
        page.text(columns.words, base + LINE * k as f64, CELL, TEXT, line);
    }
}
