//! A table that goes on over pages, its head repeated.

use super::flow::Flow;
use super::page::{Font, Type, set};
use super::signs::sign;
use super::theme::{DENSE_ROW, LEFT, QUIET, RIGHT, STROKE, STRONG, Sign, TEXT};
use crate::report::pdf::page::Paint;

/// Where a column's text stands.
#[derive(Debug, Clone, Copy)]
pub enum Align {
    /// Begins here, mm from the left.
    Left(f64),
    /// Ends here.
    Right(f64),
}

/// One column.
#[derive(Debug, Clone)]
pub struct Column {
    /// Its head.
    pub head: &'static str,
    /// Where it stands.
    pub align: Align,
    /// Its type.
    pub set: Type,
    /// What is wider is shortened in its middle, mm.
    pub room: f64,
}

/// One row.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// The sign before it.
    pub sign: Option<Sign>,
    /// Whether the row has its verdict's colour.
    pub fill: bool,
    /// One text a column.
    pub cells: Vec<String>,
    /// Words below them, from the second column on; empty for none.
    pub words: String,
}

const HEADING: Type = set(Font::SemiBold, 10.3);
const WORDS: Type = set(Font::Regular, 7.8);
/// Height of a line of words, mm.
const LINE: f64 = 3.4;
/// So many lines of one reason are enough; the result files hold all of it.
const MOST_LINES: usize = 20;
const HEAD: Type = set(Font::SemiBold, 7.4);

/// Puts a table with its title into the flow.
pub fn put(flow: &mut Flow<'_>, title: &str, columns: &[Column], rows: &[Row]) {
    // A title with its head and two rows never stands alone at the foot of a page.
    flow.need(14.0 + 2.0 * DENSE_ROW);
    head(flow, title, columns);
    let words_x = columns.get(1).map_or(LEFT, |column| match column.align {
        Align::Left(x) | Align::Right(x) => x,
    });
    for row in rows {
        let fonts = flow.page().fonts;
        let mut words = fonts.wrapped(WORDS, &fonts.printable(WORDS.font, &row.words), RIGHT - words_x);
        words.truncate(if row.words.is_empty() { 0 } else { MOST_LINES });
        if !flow.has(DENSE_ROW + LINE * words.len() as f64) {
            flow.turn();
            head(flow, &format!("{title}, continued"), columns);
        }
        put_row(flow, columns, row, words_x, &words);
    }
    flow.y += 3.4;
}

fn head(flow: &mut Flow<'_>, title: &str, columns: &[Column]) {
    let y = flow.y;
    let page = flow.page();
    page.text(LEFT, y + 4.4, HEADING, TEXT, title);
    for column in columns {
        match column.align {
            Align::Left(x) => page.text(x, y + 9.7, HEAD, QUIET, column.head),
            Align::Right(x) => page.text_right(x, y + 9.7, HEAD, QUIET, column.head),
        }
    }
    page.rule(LEFT, RIGHT, y + 11.4, STRONG, 0.3);
    flow.y = y + 11.4;
}

fn put_row(flow: &mut Flow<'_>, columns: &[Column], row: &Row, words_x: f64, words: &[String]) {
    let y = flow.y;
    let height = DENSE_ROW + LINE * words.len() as f64;
    let page = flow.page();
    if let (Some(sign), true) = (row.sign, row.fill) {
        page.rect(LEFT, y + 0.1, RIGHT - LEFT, height - 0.1, &Paint::fill(sign.fill()));
    }
    if let Some(of) = row.sign {
        sign(page, of, LEFT + 2.8, y + 0.5 * DENSE_ROW, 1.4);
    }
    for (column, cell) in columns.iter().zip(&row.cells) {
        let text = page.fonts.printable(column.set.font, cell);
        let text = page.fonts.fitted(column.set, &text, column.room);
        match column.align {
            Align::Left(x) => page.text(x, y + 3.1, column.set, TEXT, &text),
            Align::Right(x) => page.text_right(x, y + 3.1, column.set, TEXT, &text),
        }
    }
    for (k, line) in words.iter().enumerate() {
        page.text(words_x, y + 3.1 + LINE * (k + 1) as f64, WORDS, TEXT, line);
    }
    page.rule(LEFT, RIGHT, y + height, STROKE, 0.15);
    flow.y = y + height;
}
