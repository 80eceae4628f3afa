//! The study of masks on paper: for every metric sigma_dev and the remaining points over the threshold.

use super::document;
use super::flow::Flow;
use super::footer;
use super::page::{Font, Fonts, Page, Paint, Type, set};
use super::plot::{Line, Mark, Plot};
use super::theme::{LEFT, QUIET, RIGHT, STRONG, TEXT};
use crate::plan::merge::{MergeFeature, MergePlan, Metric};
use crate::report::mask_study::{advice, bound, csv, short, shown_thresholds, sigma_scale};
use crate::report::palette::Rgb;
use crate::report::words::thousands;
use crate::stitch::mask_study::{Curve, Knee, MaskStudy};

/// sigma_dev.
const SIGMA: Rgb = [0x2A, 0x5F, 0x9E];
/// Remaining points.
const REMAINING: Rgb = [0xB0, 0x62, 0x0E];
const SUGGESTED: Rgb = [0x00, 0x80, 0x8A];
const TITLE: Type = set(Font::SemiBold, 9.0);
const WORDS: Type = set(Font::Regular, 7.8);
/// Height of a row of plots, mm.
const ROW: f64 = 60.0;
const FIELD: [f64; 2] = [66.0, 33.0];

/// The document. The same study gives the same bytes.
pub fn mask_study_pdf(plan: &MergePlan, study: &MaskStudy) -> Vec<u8> {
    let fonts = Fonts::new();
    let file = plan.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let about = format!("{} points of {} views", thousands(study.points), study.views);
    let mut flow = Flow::titled(&fonts, "Masks", &about, &file);
    for (index, feature) in plan.features.iter().enumerate() {
        if index > 0 {
            flow.turn();
        }
        put_feature(&mut flow, plan, study, index, feature);
    }
    let mut pages = flow.into_pages();
    let count = pages.len();
    let words = format!("Lengths in {}. Each view is fitted by itself (two steps, 3 sigma).", plan.unit.key());
    for (k, page) in pages.iter_mut().enumerate() {
        footer(page, "mask study", &words, k + 1, count);
    }
    document::bytes(pages, &fonts, Vec::new(), &format!("Masks: {file}"), csv(study, &plan.features).as_bytes())
}

fn put_feature(flow: &mut Flow<'_>, plan: &MergePlan, study: &MaskStudy, index: usize, feature: &MergeFeature) {
    let y = flow.y;
    let page = flow.page();
    let radius = feature.radius.map(|r| format!(", radius {r} {}", plan.unit.key())).unwrap_or_default();
    let title = format!("{} ({}{radius})", feature.name, feature.kind.key());
    page.text(LEFT, y + 5.0, set(Font::SemiBold, 11.5), TEXT, &title);
    legend(page, y + 5.0, plan.unit.key());
    flow.y = y + 10.0;
    let curves: Vec<&Curve> = study.curves.iter().filter(|c| c.feature == index).collect();
    for pair in curves.chunks(2) {
        flow.need(ROW);
        let top = flow.y;
        for (k, curve) in pair.iter().enumerate() {
            put_curve(flow.page(), curve, study, LEFT + 94.0 * k as f64, top);
        }
        flow.y = top + ROW;
    }
}

fn legend(page: &mut Page<'_>, y: f64, unit: &str) {
    let x = RIGHT - 78.0;
    page.line(&[[x, y - 1.1], [x + 6.0, y - 1.1]], SIGMA, 0.6, true);
    page.text(x + 7.5, y, WORDS, SIGMA, &format!("sigma_dev, {unit} (left)"));
    page.line(&[[x + 41.0, y - 1.1], [x + 43.4, y - 1.1]], REMAINING, 0.5, false);
    page.line(&[[x + 44.6, y - 1.1], [x + 47.0, y - 1.1]], REMAINING, 0.5, false);
    page.text(x + 48.5, y, WORDS, REMAINING, "points left, % (right)");
}

/// What a metric is, for people who did not write the paper.
fn words_of(metric: Metric) -> &'static str {
    match metric {
        Metric::Strength => "fringe amplitude",
        Metric::Attenuation => "amplitude over background",
        Metric::PhaseShiftVariation => "intensity over the phase shifts",
        Metric::CalibrationDistance => "distance to the camera's calibration",
        Metric::CalibrationDistanceProjector => "distance to the projector's calibration",
        Metric::Reprojection => "error of the nearest feature, px",
        Metric::Density => "density of calibrated features",
        Metric::NonUniformity => "unevenness",
        Metric::NonUniformityAngle => "unevenness as an angle, rad",
    }
}

fn put_curve(page: &mut Page<'_>, curve: &Curve, study: &MaskStudy, x: f64, y: f64) {
    page.text(x, y + 3.2, TITLE, TEXT, curve.metric.key());
    let name = page.fonts.width_mm(TITLE, curve.metric.key());
    let rest = page.fonts.cut(WORDS, words_of(curve.metric), 84.0 - name);
    page.text(x + name + 2.0, y + 3.2, WORDS, QUIET, &rest);
    let share = |n: usize| 100.0 * n as f64 / study.points.max(1) as f64;
    let sigma: Vec<[f64; 2]> = curve.steps.iter().filter_map(|s| Some([s.threshold, s.sigma_dev?])).collect();
    let left: Vec<[f64; 2]> = curve.steps.iter().map(|s| [s.threshold, share(s.remaining)]).collect();
    let field = [x + 9.0, y + 9.0, FIELD[0], FIELD[1]];
    let Some(plot) = plot(curve, &sigma, field) else {
        page.rect(field[0], field[1], field[2], field[3], &Paint::stroke(STRONG, 0.2));
        page.text_centre(x + 9.0 + 0.5 * FIELD[0], y + 26.0, WORDS, QUIET, "one value only: no threshold");
        return;
    };
    let mut marks = Vec::new();
    if let Some(own) = &curve.own {
        marks.push(Mark { x: own.threshold, words: format!("mask {}", own.threshold), colour: QUIET });
    }
    if let Knee::At { step, .. } = curve.knee {
        let threshold = curve.steps[step].threshold;
        let words = format!("suggested {} = {}", bound(curve.metric), short(threshold));
        marks.push(Mark { x: threshold, words, colour: SUGGESTED });
    }
    let clash = marks.len() == 2;
    if clash {
        // Both words do not fit over one plot: the mask's own are in the line below.
        marks[0].words.clear();
    }
    let sigma = Line { points: &sigma, colour: SIGMA, dashed: false };
    plot.draw(page, &sigma, &Line { points: &left, colour: REMAINING, dashed: true }, &marks);
    put_words(page, curve, clash, x, y + 9.0 + FIELD[1] + 7.2);
}

fn put_words(page: &mut Page<'_>, curve: &Curve, with_own: bool, x: f64, y: f64) {
    let mut words = advice(curve);
    if let (true, Some(own)) = (with_own, &curve.own) {
        let _ = std::fmt::Write::write_fmt(&mut words, format_args!("; grey: [mask], {}", own.threshold));
    }
    let lines = page.fonts.wrapped(WORDS, &words, 86.0);
    for (k, line) in lines.iter().take(2).enumerate() {
        page.text(x, y + 3.4 * k as f64, WORDS, TEXT, line);
    }
}

/// The thresholds that are shown, and a scale on which sigma_dev is seen to change.
fn plot(curve: &Curve, sigma: &[[f64; 2]], field: [f64; 4]) -> Option<Plot> {
    let thresholds: Vec<f64> = curve.steps.iter().map(|step| step.threshold).collect();
    let x = shown_thresholds(&thresholds)?;
    let inside = |p: &&[f64; 2]| (x[0].min(x[1])..=x[0].max(x[1])).contains(&p[0]);
    let left = sigma_scale(sigma.iter().filter(inside).map(|p| p[1]))?;
    Some(Plot { field, x, left, right: [0.0, 108.0] })
}
