//! A small plot: two curves over one threshold, the left axis for the one, the right for the other.

use super::page::{Font, Page, Paint, Type, set};
use super::theme::{QUIET, STROKE, STRONG, TEXT, WHITE};
use crate::report::mask_study::short;
use crate::report::palette::Rgb;

const SMALL: Type = set(Font::Regular, 7.0);
/// Ticks an axis has about.
const TICKS: f64 = 4.0;

/// A curve, its points in the order of x.
pub struct Line<'a> {
    /// x and y.
    pub points: &'a [[f64; 2]],
    /// Its colour, and that of its axis' numbers.
    pub colour: Rgb,
    /// Whether it is dashed.
    pub dashed: bool,
}

/// A line across the plot at some x.
pub struct Mark {
    /// Where.
    pub x: f64,
    /// What stands beside it.
    pub words: String,
    /// Colour.
    pub colour: Rgb,
}

/// The frame of a plot on the page, mm, and its axes.
pub struct Plot {
    /// Left, top, width, height of the field between the axes.
    pub field: [f64; 4],
    /// First and last x, which may fall.
    pub x: [f64; 2],
    /// Lower and upper end of the left axis.
    pub left: [f64; 2],
    /// Of the right axis.
    pub right: [f64; 2],
}

impl Plot {
    fn at_x(&self, x: f64) -> f64 {
        let [left, _, width, _] = self.field;
        left + width * (x - self.x[0]) / (self.x[1] - self.x[0])
    }

    fn at_y(&self, y: f64, [low, high]: [f64; 2]) -> f64 {
        let [_, top, _, height] = self.field;
        top + height * (1.0 - (y - low) / (high - low))
    }

    /// Draws axes, marks and curves; `right` counts in per cent.
    pub fn draw(&self, page: &mut Page<'_>, left: &Line<'_>, right: &Line<'_>, marks: &[Mark]) {
        let [x, y, width, height] = self.field;
        page.rect(x, y, width, height, &Paint::both(WHITE, STRONG, 0.2));
        for value in ticks(self.left) {
            let at = self.at_y(value, self.left);
            page.rule(x, x + width, at, STROKE, 0.12);
            page.text_right(x - 1.2, at + 0.9, SMALL, left.colour, &trimmed(value));
        }
        for value in ticks(self.right) {
            page.text(x + width + 1.2, self.at_y(value, self.right) + 0.9, SMALL, right.colour, &format!("{value:.0}"));
        }
        for value in ticks(self.x) {
            let at = self.at_x(value);
            page.line(&[[at, y + height], [at, y + height + 0.9]], STRONG, 0.2, false);
            page.text_centre(at, y + height + 3.7, SMALL, QUIET, &trimmed(value));
        }
        for mark in marks {
            self.mark(page, mark);
        }
        self.curve(page, right, self.right);
        self.curve(page, left, self.left);
    }

    fn mark(&self, page: &mut Page<'_>, mark: &Mark) {
        let [x, y, width, height] = self.field;
        let at = self.at_x(mark.x);
        if !(x..=x + width).contains(&at) {
            return;
        }
        page.line(&[[at, y], [at, y + height]], mark.colour, 0.35, false);
        let room = page.fonts.width_mm(SMALL, &mark.words);
        let words_x = if at + room + 1.5 < x + width { at + 1.0 } else { at - 1.0 - room };
        page.text(words_x, y - 0.8, SMALL, TEXT, &mark.words);
    }

    fn curve(&self, page: &mut Page<'_>, line: &Line<'_>, axis: [f64; 2]) {
        let inside = |p: &&[f64; 2]| (self.x[0].min(self.x[1])..=self.x[0].max(self.x[1])).contains(&p[0]);
        let places: Vec<[f64; 2]> = line
            .points
            .iter()
            .filter(inside)
            .map(|p| [self.at_x(p[0]), self.at_y(p[1].clamp(axis[0], axis[1]), axis)])
            .collect();
        if places.len() > 1 {
            if line.dashed {
                dashed(page, &places, line.colour);
            } else {
                page.line(&places, line.colour, 0.45, true);
            }
        }
        for [x, y] in places {
            page.circle(x, y, 0.45, &Paint::fill(line.colour));
        }
    }
}

/// A path in dashes of 1.6 mm.
fn dashed(page: &mut Page<'_>, places: &[[f64; 2]], colour: Rgb) {
    const DASH: f64 = 1.6;
    let mut along = 0.0;
    for pair in places.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let at = |s: f64| [from[0] + (to[0] - from[0]) * s / length, from[1] + (to[1] - from[1]) * s / length];
        let mut s = 0.0;
        while s < length {
            let within = f64::rem_euclid(along + s, 2.0 * DASH);
            let next = if within < DASH { DASH - within } else { 2.0 * DASH - within }.max(1e-3);
            let end = (s + next).min(length);
            if within < DASH {
                page.line(&[at(s), at(end)], colour, 0.35, false);
            }
            s = end;
        }
        along += length;
    }
}

/// Round numbers within a range, about four of them.
pub fn ticks([a, b]: [f64; 2]) -> Vec<f64> {
    let (low, high) = (a.min(b), a.max(b));
    let rough = (high - low) / TICKS;
    if rough.is_nan() || rough <= 0.0 || rough.is_infinite() {
        return vec![low];
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|s| s * power).find(|s| *s >= rough).unwrap_or(10.0 * power);
    let first = (low / step).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|v| *v <= high + 1e-9 * step).collect()
}

/// A round number without needless zeros.
pub(super) fn trimmed(value: f64) -> String {
    let text = short(value);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks([0.0, 100.0]), [0.0, 25.0, 50.0, 75.0, 100.0]);
        assert_eq!(ticks([9.3, 4.1]), [6.0, 8.0]);
        assert_eq!(ticks([5.0, 5.0]), [5.0]);
        assert!(ticks([0.0, f64::INFINITY]).len() == 1);
        assert_eq!(trimmed(0.002_50), "0.0025");
        assert_eq!(trimmed(100.0), "100");
    }
}
