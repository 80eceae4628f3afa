//! The signs of verdicts, each with a form of its own, so that colour is never the only difference. Painted as paths.

use crate::gui::fonts;
use crate::gui::text::Words;
use crate::gui::theme::Theme;
use crate::inspect::{InspectionResult, Outcome, Verdict};
use crate::report::stored::StoredOutcome;
use crate::worker::earlier::Earlier;
use egui::{Align2, Color32, CornerRadius, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Vec2, pos2, vec2};

/// What a sign stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Disc with a check mark.
    Pass,
    /// Octagon with a cross.
    Fail,
    /// Diamond with a question mark.
    Undecided,
    /// Dashed empty square with a dash: a point not measured, a part incomplete.
    NotMeasured,
    /// Triangle with an exclamation mark: a scan that was refused.
    Refused,
    /// Open ring: under way.
    Running,
    /// Thin ring: none yet.
    None,
    /// Ring with a play mark: no part yet.
    Ready,
    /// Ring struck through: what a file says that nothing vouches for.
    Untrusted,
}

impl From<Verdict> for Sign {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Pass => Sign::Pass,
            Verdict::Undecided => Sign::Undecided,
            Verdict::NotMeasured => Sign::NotMeasured,
            Verdict::Fail => Sign::Fail,
        }
    }
}

impl Sign {
    /// The sign of a part.
    pub fn of(result: &InspectionResult) -> Self {
        match &result.outcome {
            Outcome::Measured(inspection) => inspection.verdict.into(),
            Outcome::Refused(_) => Sign::Refused,
        }
    }

    /// The sign of a part by a result from before; no verdict of a file that is not as it was written.
    pub fn of_earlier(earlier: &Earlier) -> Self {
        match &earlier.stored.outcome {
            _ if !earlier.is_vouched_for() => Sign::Untrusted,
            StoredOutcome::Measured(inspection) => inspection.verdict.into(),
            StoredOutcome::Refused(_) => Sign::Refused,
        }
    }

    /// The word of a part's verdict, or of what else the sign stands for.
    pub fn word(self, words: &Words) -> &str {
        words.text(match self {
            Sign::Pass => "verdict.pass",
            Sign::Fail => "verdict.fail",
            Sign::Undecided => "verdict.undecided",
            Sign::NotMeasured => "verdict.incomplete",
            Sign::Refused => "verdict.refused",
            Sign::Running => "verdict.running",
            Sign::None => "verdict.none",
            Sign::Ready => "verdict.ready",
            Sign::Untrusted => "verdict.untrusted",
        })
    }

    /// The colour of its form.
    pub fn colour(self, theme: &Theme) -> Color32 {
        match self {
            Sign::Pass => theme.pass,
            Sign::Fail => theme.fail,
            Sign::Undecided => theme.undecided,
            Sign::NotMeasured | Sign::Refused => theme.unmeasured,
            Sign::Running => theme.accent,
            Sign::None => theme.stroke,
            Sign::Ready | Sign::Untrusted => theme.strong_stroke,
        }
    }

    /// The colour of its word.
    pub fn text_colour(self, theme: &Theme) -> Color32 {
        match self {
            Sign::Pass => theme.pass,
            Sign::Fail => theme.fail,
            Sign::Undecided => theme.undecided_text,
            _ => theme.text,
        }
    }

    /// The colour behind it.
    pub fn fill(self, theme: &Theme) -> Color32 {
        match self {
            Sign::Pass => theme.pass_fill,
            Sign::Fail => theme.fail_fill,
            Sign::Undecided => theme.undecided_fill,
            Sign::NotMeasured | Sign::Refused => theme.unmeasured_fill,
            Sign::Running | Sign::None | Sign::Ready | Sign::Untrusted => theme.panel,
        }
    }

    /// Paints it as large as the shorter side of the place allows.
    pub fn paint(self, painter: &Painter, place: Rect, theme: &Theme) {
        let r = 0.5 * place.width().min(place.height());
        let (centre, colour) = (place.center(), self.colour(theme));
        let none = Stroke::NONE;
        match self {
            Sign::Pass => {
                painter.circle_filled(centre, r, colour);
                check(painter, centre, r, theme.mark);
            }
            Sign::Fail => {
                painter.add(Shape::convex_polygon(octagon(centre, r), colour, none));
                let [a, b] = [0.33 * r * vec2(1.0, 1.0), 0.33 * r * vec2(1.0, -1.0)];
                let stroke = Stroke::new(0.24 * r, theme.mark);
                painter.line_segment([centre - a, centre + a], stroke);
                painter.line_segment([centre - b, centre + b], stroke);
            }
            Sign::Undecided => {
                let corners = [vec2(0.0, -r), vec2(r, 0.0), vec2(0.0, r), vec2(-r, 0.0)].map(|v| centre + v);
                painter.add(Shape::convex_polygon(corners.to_vec(), colour, none));
                painter.text(centre, Align2::CENTER_CENTER, "?", fonts::bold(1.15 * r), theme.mark_undecided);
            }
            Sign::NotMeasured => {
                dashed_square(painter, centre, 0.88 * r, colour);
                let half = vec2(0.3 * r, 0.0);
                painter.line_segment([centre - half, centre + half], Stroke::new(0.16 * r, colour));
            }
            Sign::Refused => {
                let corners = [vec2(0.0, -0.94 * r), vec2(r, 0.84 * r), vec2(-r, 0.84 * r)].map(|v| centre + v);
                painter.add(Shape::convex_polygon(corners.to_vec(), colour, none));
                exclamation(painter, centre + vec2(0.0, 0.2 * r), r, theme.mark);
            }
            Sign::Running => {
                let stroke = Stroke::new(0.24 * r, colour);
                painter.line(arc(centre, 0.84 * r, 0.75, 1.5), stroke);
            }
            Sign::None => {
                painter.circle_stroke(centre, 0.88 * r, Stroke::new(0.16 * r, colour));
            }
            Sign::Ready => {
                painter.circle_stroke(centre, 0.94 * r, Stroke::new(0.11 * r, colour));
                play(painter, centre, 0.42 * r, colour);
            }
            Sign::Untrusted => {
                let stroke = Stroke::new(0.16 * r, colour);
                painter.circle_stroke(centre, 0.88 * r, stroke);
                let half = 0.62 * r * vec2(1.0, -1.0);
                painter.line_segment([centre - half, centre + half], stroke);
            }
        }
    }

    /// Paints its outline alone, without a verdict's colour: a verdict that was given by another plan than the one at hand.
    pub fn paint_hollow(self, painter: &Painter, place: Rect, theme: &Theme) {
        let r = 0.5 * place.width().min(place.height());
        let (centre, colour) = (place.center(), theme.quiet);
        let thin = Stroke::new((0.12 * r).max(1.0), colour);
        match self {
            Sign::Pass => {
                painter.circle_stroke(centre, 0.92 * r, thin);
                check(painter, centre, 0.8 * r, colour);
            }
            Sign::Fail => {
                painter.add(Shape::closed_line(octagon(centre, 0.92 * r), thin));
                let [a, b] = [0.3 * r * vec2(1.0, 1.0), 0.3 * r * vec2(1.0, -1.0)];
                painter.line_segment([centre - a, centre + a], thin);
                painter.line_segment([centre - b, centre + b], thin);
            }
            Sign::Undecided => {
                let corners = [vec2(0.0, -r), vec2(r, 0.0), vec2(0.0, r), vec2(-r, 0.0)].map(|v| centre + 0.92 * v);
                painter.add(Shape::closed_line(corners.to_vec(), thin));
                painter.text(centre, Align2::CENTER_CENTER, "?", fonts::bold(r), colour);
            }
            Sign::Refused => {
                let corners = [vec2(0.0, -0.94), vec2(1.0, 0.84), vec2(-1.0, 0.84)].map(|v| centre + 0.92 * r * v);
                painter.add(Shape::closed_line(corners.to_vec(), thin));
                exclamation(painter, centre + vec2(0.0, 0.2 * r), 0.8 * r, colour);
            }
            // These have neither a filled form nor a verdict's colour.
            Sign::NotMeasured | Sign::Running | Sign::None | Sign::Ready | Sign::Untrusted => {
                self.paint(painter, place, theme);
            }
        }
    }
}

/// A check mark by itself, for lists that are no verdicts.
pub fn check(painter: &Painter, centre: Pos2, r: f32, colour: Color32) {
    let points = [vec2(-0.42, 0.04), vec2(-0.12, 0.34), vec2(0.44, -0.3)].map(|v| centre + r * v);
    painter.line(points.to_vec(), Stroke::new(0.2 * r, colour));
}

/// A triangle that points to the right.
pub fn play(painter: &Painter, centre: Pos2, r: f32, colour: Color32) {
    let corners = [vec2(-0.62, -1.0), vec2(1.0, 0.0), vec2(-0.62, 1.0)].map(|v| centre + r * v);
    painter.add(Shape::convex_polygon(corners.to_vec(), colour, Stroke::NONE));
}

/// A filled square: stop.
pub fn stop(painter: &Painter, centre: Pos2, r: f32, colour: Color32) {
    painter.rect_filled(Rect::from_center_size(centre, Vec2::splat(2.0 * r)), CornerRadius::same(3), colour);
}

/// A padlock, shut or open.
pub fn padlock(painter: &Painter, centre: Pos2, open: bool, colour: Color32) {
    let body = Rect::from_center_size(centre + vec2(0.0, 3.0), vec2(11.0, 8.0));
    painter.rect_filled(body, CornerRadius::same(2), colour);
    // An open one has its bow turned out of the body.
    let middle = centre + vec2(if open { 3.0 } else { 0.0 }, -1.5);
    let bow = (0..=12).map(|k| {
        let angle = std::f32::consts::PI * k as f32 / 12.0;
        middle + 3.4 * vec2(-angle.cos(), -angle.sin())
    });
    let ends = [middle + vec2(-3.4, if open { 1.0 } else { 2.0 }), middle + vec2(3.4, if open { -0.5 } else { 2.0 })];
    let points: Vec<Pos2> = std::iter::once(ends[0]).chain(bow).chain(std::iter::once(ends[1])).collect();
    painter.line(points, Stroke::new(1.8, colour));
}

/// A square with an exclamation mark: a problem of a plan. Filled: an error; outlined: a warning.
pub fn problem(painter: &Painter, place: Rect, filled: bool, theme: &Theme) {
    let r = 0.5 * place.width().min(place.height());
    let square = Rect::from_center_size(place.center(), Vec2::splat(1.8 * r));
    let colour = if filled {
        painter.rect_filled(square, CornerRadius::same(3), theme.fail);
        theme.mark
    } else {
        painter.rect_stroke(square, CornerRadius::same(3), Stroke::new(2.0, theme.undecided_text), StrokeKind::Inside);
        theme.undecided_text
    };
    exclamation(painter, place.center(), r, colour);
}

fn exclamation(painter: &Painter, centre: Pos2, r: f32, colour: Color32) {
    painter.line_segment([centre - vec2(0.0, 0.5 * r), centre + vec2(0.0, 0.14 * r)], Stroke::new(0.2 * r, colour));
    painter.circle_filled(centre + vec2(0.0, 0.42 * r), 0.12 * r, colour);
}

fn octagon(centre: Pos2, r: f32) -> Vec<Pos2> {
    // The flats stand at the radius, so that it is as wide as a disc.
    let out = r / (std::f32::consts::PI / 8.0).cos();
    let corner = |k: usize| (k as f32 + 0.5) * std::f32::consts::FRAC_PI_4;
    (0..8).map(|k| centre + out * Vec2::angled(corner(k))).collect()
}

/// Points along a circle, from a share of a turn through a share of a turn, clockwise from the right.
fn arc(centre: Pos2, r: f32, from: f32, to: f32) -> Vec<Pos2> {
    const STEPS: usize = 40;
    let at = |k: usize| std::f32::consts::TAU * (from + (to - from) * k as f32 / STEPS as f32);
    (0..=STEPS).map(|k| centre + r * Vec2::angled(at(k))).collect()
}

/// A square of twelve dashes, whole at its corners.
fn dashed_square(painter: &Painter, centre: Pos2, half: f32, colour: Color32) {
    let stroke = Stroke::new(0.17 * half, colour);
    let inner = half - 0.5 * stroke.width;
    let arm = 0.32 * half;
    for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let corner = centre + inner * vec2(sx, sy);
        let points = vec![corner - vec2(sx * arm, 0.0), corner, corner - vec2(0.0, sy * arm)];
        painter.line(points, stroke);
    }
    let short = 0.22 * half;
    for (x, y) in [(0.0, -1.0), (0.0, 1.0)] {
        let middle = centre + inner * vec2(x, y);
        painter.line_segment([pos2(middle.x - short, middle.y), pos2(middle.x + short, middle.y)], stroke);
    }
    for (x, y) in [(-1.0, 0.0), (1.0, 0.0)] {
        let middle = centre + inner * vec2(x, y);
        painter.line_segment([pos2(middle.x, middle.y - short), pos2(middle.x, middle.y + short)], stroke);
    }
}
