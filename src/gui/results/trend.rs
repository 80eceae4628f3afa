//! The chosen point over the parts of the sequence.

use super::numbers;
use super::still_plot::still_plot;
use crate::gui::facts::FinishedPart;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign::Sign;
use crate::gui::widgets::words as write;
use crate::inspect::{Outcome, PointResult, Verdict};
use egui::{Align2, Rect, Role, Stroke, Ui, WidgetInfo, vec2};
use egui_plot::{HLine, Line, LineStyle, PlotPoint, PlotPoints, Polygon};
use std::ops::Range;
use std::sync::Arc;

/// One part in the trend.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Its place among the parts.
    pub part: usize,
    /// The deviation; `None` = a gap.
    pub deviation_mm: Option<f64>,
    /// What stands there: a verdict, or that the scan was refused.
    pub sign: Option<Verdict>,
}

/// The point of that name in every part, oldest first. A part of another plan that has no such point is left out.
pub fn steps(parts: &[Arc<FinishedPart>], name: &str) -> Vec<Step> {
    let one = |(part, finished): (usize, &Arc<FinishedPart>)| match &finished.result.outcome {
        Outcome::Refused(_) => Some(Step { part, deviation_mm: None, sign: None }),
        Outcome::Measured(inspection) => {
            let point = inspection.points.iter().find(|p| p.name == name)?;
            let deviation_mm = point.measurement.as_ref().map(|m| m.deviation_mm);
            Some(Step { part, deviation_mm, sign: Some(point.verdict) })
        }
    };
    parts.iter().enumerate().filter_map(one).collect()
}

/// Steps of a trend that is limited to the last ones.
pub const LAST: usize = 200;

/// Which parts a trend shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Span {
    /// The last ones, whatever sequence they were of.
    #[default]
    Last,
    /// Those of the sequence of the part looked at.
    Sequence,
}

/// The places of the parts that were inspected in one run with the part at `place`. Each sequence counts from 1; watched folders
/// count on, and are one run as long as no sequence comes between.
fn sequence_of(parts: &[Arc<FinishedPart>], place: usize) -> Range<usize> {
    let other_kind = |k: usize| k > 0 && parts[k - 1].of.is_none() != parts[k].of.is_none();
    let begins = |k: &usize| parts.get(*k).is_some_and(|part| part.index == 1 || other_kind(*k));
    let first = (0..=place.min(parts.len())).rev().find(begins).unwrap_or(0);
    let end = (place + 1..parts.len()).find(begins).unwrap_or(parts.len());
    first..end
}

/// Draws the trend; returns the part that was clicked.
pub fn trend_ui(
    ui: &mut Ui,
    at: Rect,
    point: Option<&PointResult>,
    looked_at: usize,
    span: Span,
    scope: &Scope,
) -> Option<usize> {
    let (theme, words) = (scope.theme, scope.words);
    let Some(point) = point else {
        let text = words.text("results.choose_a_point");
        write::line(ui, at, Align2::CENTER_CENTER, text, fonts::regular(size::BODY), theme.quiet);
        return None;
    };
    let mut steps = steps(&scope.facts.parts, &point.name);
    if span == Span::Sequence {
        let shown = sequence_of(&scope.facts.parts, looked_at);
        steps.retain(|step| shown.contains(&step.part));
    }
    steps.drain(..steps.len().saturating_sub(LAST));
    let first = steps.first().map_or(0, |s| s.part) as f64;
    let last = steps.last().map_or(0, |s| s.part) as f64;
    let [low, high] = extent(&steps, point);
    let u_mm = point.measurement.as_ref().map_or(0.0, |m| m.uncertainty_mm);
    let names: Vec<String> = scope.facts.parts.iter().map(|p| p.short_name()).collect();
    let names = briefs(&names);
    // The axis to the left takes about sixty points.
    let longest = names.iter().map(|name| write::width(ui, name, fonts::regular(AXIS))).fold(0.0, f32::max);
    let most = ((at.width() - 60.0) / (longest + 12.0)).clamp(1.0, 10.0);
    let plot = still_plot(("trend", &point.name))
        .include_x(first - 0.6)
        .include_x((last + 0.6).max(first + 7.4))
        .include_y(low)
        .include_y(high)
        .set_margin_fraction(vec2(0.0, 0.0))
        .show_background(false)
        .grid_color(theme.stroke)
        .show_grid([false, true])
        .x_grid_spacer(move |input| whole_steps(input.bounds, most))
        .y_grid_spacer(|input| marks(input.bounds, 6.0))
        .x_axis_formatter(move |mark, _| part_name(&names, mark.value))
        .y_axis_formatter(move |mark, _| {
            words.signed_mm(mark.value).trim_end_matches('0').trim_end_matches(['.', ',']).to_owned()
        })
        .label_formatter(|_| None);
    let mut clicked = None;
    ui.scope_builder(egui::UiBuilder::new().max_rect(at), |ui| {
        let shown = plot.show(ui, |plot| {
            let ends = [first - 1.0, last.max(first + 8.0) + 1.0];
            for limit in [point.lower_mm, point.upper_mm].into_iter().filter(|v| v.is_finite()) {
                let corners = vec![
                    [ends[0], limit - u_mm],
                    [ends[1], limit - u_mm],
                    [ends[1], limit + u_mm],
                    [ends[0], limit + u_mm],
                ];
                let zone =
                    Polygon::new("", corners).fill_color(theme.undecided_fill).stroke(Stroke::NONE).allow_hover(false);
                plot.polygon(zone);
                let line =
                    HLine::new("", limit).stroke(Stroke::new(1.5, theme.fail)).style(LineStyle::Dashed { length: 6.0 });
                plot.hline(line.allow_hover(false));
            }
            for run in runs(&steps) {
                let points: PlotPoints<'_> = run.iter().map(|&(x, y)| [x, y]).collect();
                plot.line(Line::new("", points).stroke(Stroke::new(1.2, theme.quiet)).allow_hover(false));
            }
        });
        shown.response.widget_info(|| {
            WidgetInfo::labeled(Role::Image, true, words.fill("results.trend_of", &[("point", &point.name)]))
        });
        let transform = shown.transform;
        let places: Vec<(usize, egui::Pos2, &Step)> = steps
            .iter()
            .filter(|s| s.deviation_mm.is_some() || s.sign.is_none())
            .map(|s| {
                (
                    s.part,
                    transform.position_from_point(&PlotPoint::new(s.part as f64, s.deviation_mm.unwrap_or(0.0))),
                    s,
                )
            })
            .collect();
        paint_steps(ui, &places, looked_at, theme);
        if shown.response.clicked()
            && let Some(pointer) = shown.response.interact_pointer_pos()
        {
            let near = places.iter().min_by(|a, b| (a.1.x - pointer.x).abs().total_cmp(&(b.1.x - pointer.x).abs()));
            clicked = near.map(|(part, ..)| *part);
        }
    });
    let upper = numbers::limit(point, point.upper_mm, words);
    let note = format!("{} {upper}", words.text("results.upper"));
    write::named(ui, at.with_max_y(at.top() + 1.0), &note);
    clicked
}

fn paint_steps(ui: &Ui, places: &[(usize, egui::Pos2, &Step)], looked_at: usize, theme: &Theme) {
    let crowded = places.len() > 60;
    let side = if crowded { 7.0 } else { 13.0 };
    for (part, pos, step) in places {
        let sign = step.sign.map_or(Sign::Refused, Sign::from);
        sign.paint(ui.painter(), Rect::from_center_size(*pos, vec2(side, side)), theme);
        if *part == looked_at {
            ui.painter().circle_stroke(*pos, side * 0.5 + 4.0, Stroke::new(2.0, theme.accent));
        }
    }
}

/// Values without a gap between them, as (part, deviation).
fn runs(steps: &[Step]) -> Vec<Vec<(f64, f64)>> {
    let mut runs: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for step in steps {
        match (step.deviation_mm, runs.last_mut()) {
            (Some(d), Some(run)) => run.push((step.part as f64, d)),
            _ => runs.push(Vec::new()),
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// Lowest and highest of what is drawn, with a little room.
fn extent(steps: &[Step], point: &PointResult) -> [f64; 2] {
    let limits = [point.lower_mm, point.upper_mm].into_iter().filter(|v| v.is_finite());
    let all = steps.iter().filter_map(|s| s.deviation_mm).chain(limits).chain([0.0]);
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let room = (0.12 * (high - low)).max(0.01);
    [low - room, high + room]
}

/// The largest size in which the axes are written.
const AXIS: f32 = 14.0;

/// Marks at whole parts only, at most about so many of them.
fn whole_steps((low, high): (f64, f64), most: f32) -> Vec<egui_plot::GridMark> {
    let step = ((high - low) / f64::from(most)).ceil().max(1.0);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).take(40).map(|k| egui_plot::GridMark { value: k as f64 * step, step_size: high - low }).collect()
}

fn part_name(names: &[String], value: f64) -> String {
    let at = value.round();
    let known = (at >= 0.0 && (value - at).abs() < 1e-6).then(|| names.get(at as usize)).flatten();
    known.cloned().unwrap_or_default()
}

/// What tells scans apart in little room: the number with which a name begins or ends, as on their lamps, else its end. A number in front that all
/// have, such as the day, tells nothing.
fn briefs(names: &[String]) -> Vec<String> {
    let digits = |name: &str| name.chars().take_while(char::is_ascii_digit).collect::<String>();
    let front: Vec<String> = names.iter().map(|name| digits(name)).collect();
    let all_alike = names.len() > 1 && front.iter().all(|number| *number == front[0]);
    let brief = |(name, front): (&String, &String)| {
        let end = name.len() - name.chars().rev().take_while(char::is_ascii_digit).count();
        match (front.is_empty() || all_alike, &name[end..]) {
            (false, _) => tail(front, 6),
            (true, "") => tail(name, 9),
            (true, number) => tail(number, 6),
        }
    };
    names.iter().zip(&front).map(brief).collect()
}

/// Evenly spaced marks at round numbers, about so many.
pub fn marks((low, high): (f64, f64), about: f64) -> Vec<egui_plot::GridMark> {
    let rough = (high - low) / about;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(rough);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    // The size tells egui_plot how strongly to draw: all marks alike.
    (first..=last).take(60).map(|k| egui_plot::GridMark { value: k as f64 * step, step_size: high - low }).collect()
}

/// The end of a name, which tells scans apart.
pub fn tail(name: &str, most: usize) -> String {
    let count = name.chars().count();
    if count <= most {
        name.to_owned()
    } else {
        format!("…{}", name.chars().skip(count + 1 - most).collect::<String>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(part: usize, deviation_mm: Option<f64>) -> Step {
        Step { part, deviation_mm, sign: deviation_mm.map(|_| Verdict::Pass) }
    }

    #[test]
    fn a_part_without_value_is_a_gap() {
        let steps = [
            step(0, Some(0.1)),
            step(1, Some(0.2)),
            step(2, None),
            step(3, Some(0.3)),
            step(4, Some(0.4)),
            step(5, None),
            step(6, Some(0.5)),
        ];
        assert_eq!(runs(&steps), [vec![(0.0, 0.1), (1.0, 0.2)], vec![(3.0, 0.3), (4.0, 0.4)]]);
    }

    #[test]
    fn marks_stand_at_whole_parts() {
        let whole: Vec<f64> = whole_steps((-0.6, 7.6), 10.0).iter().map(|m| m.value).collect();
        assert_eq!(whole, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        assert!(whole_steps((-0.6, 199.6), 10.0).len() <= 11 && whole_steps((-0.6, 7.6), 3.0).len() <= 3);
        let names = vec!["0001".to_owned(), "a_very_long_name_0002".to_owned()];
        assert_eq!(
            (part_name(&names, 0.0), part_name(&names, 0.5), part_name(&names, 9.0)),
            ("0001".into(), String::new(), String::new())
        );
        let brief = |names: &[&str]| briefs(&names.iter().map(|name| name.to_string()).collect::<Vec<_>>());
        assert_eq!(brief(&["01_good", "03_out_of_tolerance"]), ["01", "03"]);
        assert_eq!(brief(&["Bracket_2026-11-23_0001", "Bracket_2026-11-23_0002"]), ["0001", "0002"]);
        assert_eq!(brief(&["20261123_0003", "20261123_0004_left"]), ["0003", "…004_left"]);
        assert_eq!(brief(&["03_only"]), ["03"]);
        let at: Vec<f64> = marks((-1.07, 0.63), 6.0).iter().map(|m| m.value).collect();
        // A sixth of 1.7 is 0.28, so steps of 0.5.
        assert_eq!(at, [-1.0, -0.5, 0.0, 0.5]);
        assert!(marks((0.0, 0.0), 6.0).is_empty() && marks((f64::NAN, 1.0), 6.0).is_empty());
    }
}
