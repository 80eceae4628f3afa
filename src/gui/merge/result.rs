//! What came out of the last merge: figures, features before and after, wear, files; or why nothing did.

use super::facts::{Done, Merging};
use super::figures::{self, NONE};
use super::state::{MergeView, Pane};
use super::study::title_ui;
use super::told::lines_ui;
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, sign, words as write};
use crate::report::words::clean;
use crate::stitch::wear::{Doubt, Verdict, Wear};
use egui::{Align2, Rect, RichText, ScrollArea, Sense, Stroke, Ui, pos2, vec2};

const TITLE: f32 = 38.0;

/// Draws the card.
pub fn result_ui(ui: &mut Ui, at: Rect, shared: bool, merging: &Merging, view: &mut MergeView, scope: &mut Scope) {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let from = title_ui(ui, at, shared, Pane::Result, view, scope);
    let body = Rect::from_min_max(at.min + vec2(14.0, TITLE), at.max - vec2(10.0, 8.0));
    if let Some(done) = &merging.done {
        let took = words.fill("merge.took", &[("s", &words.number(done.took.as_secs_f64(), 1))]);
        let note = Rect::from_min_max(pos2(from, at.top()), pos2(at.right() - 14.0, at.top() + TITLE));
        write::line(ui, note, Align2::RIGHT_CENTER, &took, fonts::regular(size::NOTE), theme.quiet);
    }
    let mut warnings: Vec<String> = Vec::new();
    if let Some(fault) = &merging.fault {
        warnings.push(words.with_help(&sentence(fault, words), fault.help.as_deref()));
    }
    if merging.stopped {
        let key = if merging.done.is_some() { "merge.stopped_again" } else { "merge.stopped" };
        warnings.push(words.text(key).to_owned());
    }
    if merging.is_stale() {
        warnings.push(words.text("merge.stale").to_owned());
    }
    let Some(done) = &merging.done else {
        let mut lines: Vec<(String, bool)> = warnings.into_iter().map(|text| (text, true)).collect();
        lines.push((words.text("merge.nothing_yet").to_owned(), false));
        return lines_ui(ui, body, "result", &lines, scope);
    };
    ui.scope_builder(egui::UiBuilder::new().max_rect(body), |ui| {
        ScrollArea::vertical().id_salt("result").auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 3.0;
            warnings.iter().for_each(|text| warning_ui(ui, text, scope));
            figures_ui(ui, done, scope);
        });
    });
}

fn warning_ui(ui: &mut Ui, text: &str, scope: &Scope) {
    ui.horizontal_top(|ui| {
        let (mark, _) = ui.allocate_exact_size(vec2(16.0, 16.0), Sense::hover());
        sign::problem(ui.painter(), mark, false, scope.theme);
        line_ui(ui, text, scope);
    });
}

fn line_ui(ui: &mut Ui, text: &str, scope: &Scope) {
    let text = RichText::new(text).font(fonts::regular(size::TABLE)).color(scope.theme.text);
    ui.add(egui::Label::new(text).wrap());
}

fn figures_ui(ui: &mut Ui, done: &Done, scope: &Scope) {
    let words = scope.words;
    let (result, extras, unit) = (&done.job.result, &done.job.extras, done.job.plan.unit);
    let (points_in, points_out) = (result.merged.points_in, result.merged.positions.len());
    let length = |value: f64| figures::with_unit(value, unit, words);
    let views = words.count("merge.count_views", result.files.len() - result.left_out().count());
    let values = [("in", words.thousands(points_in)), ("out", words.thousands(points_out)), ("views", views)];
    let text = words.fill("merge.out_of_in", &values.each_ref().map(|(key, value)| (*key, value.as_str())));
    let text = RichText::new(text).font(fonts::semibold(size::BODY)).color(scope.theme.text);
    ui.add(egui::Label::new(text).wrap());
    let distances = [("ds", length(result.merged.d_s)), ("grid", length(result.placed.d_grid))];
    let text = words.fill("merge.merged_by", &distances.each_ref().map(|(key, value)| (*key, value.as_str())));
    line_ui(ui, &text, scope);
    if !extras.features.is_empty() {
        table_ui(ui, done, unit, scope);
    }
    if let Some(wear) = &extras.wear {
        wear_ui(ui, wear, unit, scope);
    }
    for warning in result.placed.warnings.iter().chain(&result.merged.warnings) {
        warning_ui(ui, &words.told(warning), scope);
    }
    for file in [&done.job.cloud, &done.job.report].into_iter().chain(&done.job.pdf) {
        line_ui(ui, &words.fill("merge.written", &[("file", &clean(&file.display().to_string()))]), scope);
    }
}

/// What was found of wear: the answer on the whole, then the regions.
fn wear_ui(ui: &mut Ui, wear: &Wear, unit: LengthUnit, scope: &Scope) {
    let words = scope.words;
    let fill = |key: &str, values: &[(&str, String)]| {
        let values: Vec<(&str, &str)> = values.iter().map(|(key, value)| (*key, value.as_str())).collect();
        words.fill(key, &values)
    };
    let length_of = |value: f64| figures::with_unit(value, unit, words);
    let percent = |share: f64| format!("{} %", words.number(100.0 * share, 0));
    let told = match (&wear.verdict, wear.regions.len()) {
        (Verdict::CannotBeTold(_), 0) => words.text("merge.wear_open").to_owned(),
        (_, 0) => fill("merge.no_region", &[("least", length_of(wear.least_difference))]),
        (_, count) => words.count("merge.regions", count),
    };
    match wear.verdict {
        Verdict::CannotBeTold(Doubt::SmoothErrors { hidden, smooth_u }) => {
            let hidden = format!("{} {}", figures::signed(hidden, unit, words), figures::unit(unit));
            warning_ui(ui, &fill("merge.wear_smooth", &[("hidden", hidden), ("u", length_of(smooth_u))]), scope);
        }
        Verdict::CannotBeTold(Doubt::TwoFits { as_before, otherwise }) => {
            let shares = [("before", percent(as_before)), ("otherwise", percent(otherwise))];
            warning_ui(ui, &fill("merge.wear_two_fits", &shares), scope);
        }
        Verdict::Differs | Verdict::Same => {}
    }
    let measured = words.thousands(wear.difference.len() - wear.not_measured);
    let none = words.thousands(wear.not_measured);
    line_ui(ui, &fill("merge.wear_told", &[("regions", told), ("n", measured), ("none", none)]), scope);
    let with_u = |value: f64, u: f64| figures::with_u(value, u, unit, words);
    for (k, region) in wear.regions.iter().take(MOST_REGIONS).enumerate() {
        let values = [
            ("k", (k + 1).to_string()),
            ("area", figures::area(region.area, region.area_u, unit, words)),
            ("mean", with_u(region.mean, region.mean_u)),
            ("extreme", with_u(region.extreme, region.extreme_u)),
            ("unit", figures::unit(unit).to_owned()),
        ];
        let blurred = if region.blurred { words.text("merge.region_blurred") } else { "" };
        line_ui(ui, &format!("{}{blurred}", fill("merge.region", &values)), scope);
    }
    line_ui(ui, &fill("merge.wear_moved", &[("moved", length_of(wear.fit.moved))]), scope);
    if wear.fit.free_motions > 0 {
        line_ui(ui, &words.count("merge.wear_free", wear.fit.free_motions), scope);
    }
}

/// Regions of wear that are listed; the report has all.
const MOST_REGIONS: usize = 12;

/// Width of the words before and after, and of the columns of numbers, as shares of what the name leaves.
const SHARES: [f32; 4] = [0.2, 0.36, 0.24, 0.2];

/// Features before and after: radius against the certificate, how much the points scatter, and how many they are.
fn table_ui(ui: &mut Ui, done: &Done, unit: LengthUnit, scope: &Scope) {
    let words = scope.words;
    let symbol = |name: &str| format!("{name}, {}", figures::unit(unit));
    let [name, points] = ["merge.feature", "merge.points"].map(|key| words.text(key).to_owned());
    row_ui(ui, [name, String::new(), symbol("d_r ± u"), symbol("sigma_dev"), points], true, scope);
    let mut notes = Vec::new();
    for feature in &done.job.extras.features {
        for (key, fit) in [("merge.before", &feature.before), ("merge.after", &feature.after)] {
            let name = if key == "merge.before" { clean(&feature.name) } else { String::new() };
            let cells = match fit {
                Ok(fit) => {
                    let d_r = feature.d_r(fit);
                    let d_r = d_r.map_or_else(|| NONE.to_owned(), |d| figures::with_u(d.d_r, d.u, unit, words));
                    [d_r, figures::length(fit.sigma_dev, unit, words), words.thousands(fit.points)]
                }
                Err(_) => [NONE; 3].map(str::to_owned),
            };
            let [d_r, sigma, points] = cells;
            row_ui(ui, [name, words.text(key).to_owned(), d_r, sigma, points], false, scope);
        }
        if let Err(why) = &feature.after {
            let values = [("feature", feature.name.clone()), ("why", words.library(why).into_owned())];
            notes.push(words.fill("merge.does_not_fit", &values.each_ref().map(|(key, value)| (*key, value.as_str()))));
        } else if let Some((radius, u)) = feature.certified {
            let u = format!("{} {}", figures::as_given(u, words), figures::unit(unit));
            let values = [("r", figures::as_given(radius, words)), ("u", u)];
            notes.push(words.fill("merge.certificate", &values.each_ref().map(|(key, value)| (*key, value.as_str()))));
        }
    }
    notes.dedup();
    notes.iter().for_each(|note| line_ui(ui, note, scope));
}

/// A row of the table of features: name, before or after, and three numbers.
fn row_ui(ui: &mut Ui, cells: [String; 5], is_head: bool, scope: &Scope) {
    const ROW: f32 = 22.0;
    let theme = scope.theme;
    let width = ui.available_width() - 12.0;
    let (at, _) = ui.allocate_exact_size(vec2(width, ROW), Sense::hover());
    let (font, colour) = match is_head {
        true => (fonts::semibold as fn(f32) -> egui::FontId, theme.quiet),
        false => (fonts::mono as fn(f32) -> egui::FontId, theme.text),
    };
    let points = if is_head { size::NOTE } else { size::TABLE };
    let name_width = 0.24 * width;
    let [name, rest @ ..] = cells;
    let place = at.with_max_x(at.left() + name_width - 4.0);
    write::line(ui, place, Align2::LEFT_CENTER, &name, fonts::semibold(points), colour);
    let mut left = at.left() + name_width;
    for (k, (cell, share)) in rest.iter().zip(SHARES).enumerate() {
        let right = left + share * (width - name_width);
        let place = Rect::from_min_max(pos2(left + 4.0, at.top()), pos2(right, at.bottom()));
        let font = if k == 0 { fonts::regular } else { font };
        let align = if k == 0 { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER };
        let points = write::fitting_size(ui, cell, font, place.width(), points, 9.0);
        write::line(ui, place, align, cell, font(points), colour);
        left = right;
    }
    ui.painter().hline(at.x_range(), at.bottom(), Stroke::new(1.0, theme.raised));
}
