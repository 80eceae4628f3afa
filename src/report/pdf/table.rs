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
}

const HEADING: Type = set(Font::SemiBold, 10.3);
const HEAD: Type = set(Font::SemiBold, 7.4);

/// Puts a table with its title into the flow.
pub fn put(flow: &mut Flow<'_>, title: &str, columns: &[Column], rows: &[Row]) {
    // A title with its head and two rows never stands alone at the foot of a page.
    flow.need(14.0 + 2.0 * DENSE_ROW);
    head(flow, title, columns);
    for row in rows {
        if !flow.has(DENSE_ROW) {
            flow.turn();
            head(flow, &format!("{title}, continued"), columns);
        }
        put_row(flow, columns, row);
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

fn put_row(flow: &mut Flow<'_>, columns: &[Column], row: &Row) {
    let y = flow.y;
    let page = flow.page();
    if let (Some(sign), true) = (row.sign, row.fill) {
        page.rect(LEFT, y + 0.1, RIGHT - LEFT, DENSE_ROW - 0.1, &Paint::fill(sign.fill()));
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
    page.rule(LEFT, RIGHT, y + DENSE_ROW, STROKE, 0.15);
    flow.y = y + DENSE_ROW;
}
