//! What came out of the last merge: figures, features before and after, wear, files; or why nothing did.

use super::facts::{Done, Merging};
use super::figures::{self, NONE};
use super::state::{MergeView, Pane};
use super::study::title_ui;
use super::views::lines_ui;
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, sign, words as write};
use crate::report::words::clean;
use crate::stitch::feature::FeatureFit;
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
    if merging.is_stale() {
        warnings.push(words.text("merge.stale").to_owned());
    }
    let Some(done) = &merging.done else {
        let mut lines: Vec<(String, bool)> = warnings.into_iter().map(|text| (text, true)).collect();
        lines.push((words.text("merge.nothing_yet").to_owned(), false));
        return lines_ui(ui, body, "result", &lines, scope);
    };
    ui.scope_builder(egui::UiBuilder::new().max_rect(body), |ui| {
        ScrollArea::vertical().id_salt("result").auto_shrink(false).show(ui, |ui| {
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
    let values = [
        ("in", words.thousands(points_in)),
        ("out", words.thousands(points_out)),
        ("grid", length(result.placed.d_grid)),
        ("ds", length(result.merged.d_s)),
    ];
    let text = words.fill("merge.out_of_in", &values.each_ref().map(|(key, value)| (*key, value.as_str())));
    let text = RichText::new(text).font(fonts::semibold(size::BODY)).color(scope.theme.text);
    ui.add(egui::Label::new(text).wrap());
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
    let with_u =
        |value: f64, u: f64| format!("{} ± {}", figures::signed(value, unit, words), figures::length(u, unit, words));
    for (k, region) in wear.regions.iter().take(MOST_REGIONS).enumerate() {
        let area = [region.area, region.area_u].map(|value| words.number(value, area_decimals(region.area)));
        let values = [
            ("k", (k + 1).to_string()),
            ("area", format!("{} ± {} {}²", area[0], area[1], figures::unit(unit))),
            ("mean", with_u(region.mean, region.mean_u)),
            ("extreme", with_u(region.extreme, region.extreme_u)),
        ];
        let blurred = if region.blurred { words.text("merge.region_blurred") } else { "" };
        line_ui(ui, &format!("{}{blurred}", fill("merge.region", &values)), scope);
    }
}

/// Regions of wear that are listed; the report has all.
const MOST_REGIONS: usize = 12;

fn area_decimals(area: f64) -> usize {
    if area >= 100.0 { 0 } else { 2 }
}

/// Features before and after: radius against the certificate, and how much the points scatter.
fn table_ui(ui: &mut Ui, done: &Done, unit: LengthUnit, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    const ROW: f32 = 22.0;
    let width = ui.available_width() - 12.0;
    let name_width = 0.28 * width;
    let each = (width - name_width) / 4.0;
    let row = |ui: &mut Ui, cells: [String; 5], is_head: bool| {
        let (at, _) = ui.allocate_exact_size(vec2(width, ROW), Sense::hover());
        let (font, colour) = match is_head {
            true => (fonts::semibold(size::NOTE), theme.quiet),
            false => (fonts::mono(size::TABLE), theme.text),
        };
        let [name, numbers @ ..] = cells;
        let name_font = if is_head { font.clone() } else { fonts::semibold(size::TABLE) };
        write::line(ui, at.with_max_x(at.left() + name_width), Align2::LEFT_CENTER, &name, name_font, colour);
        for (k, cell) in numbers.iter().enumerate() {
            let left = at.left() + name_width + each * k as f32;
            let place = Rect::from_min_max(pos2(left + 4.0, at.top()), pos2(left + each, at.bottom()));
            write::line(ui, place, Align2::RIGHT_CENTER, cell, font.clone(), colour);
        }
        ui.painter().hline(at.x_range(), at.bottom(), Stroke::new(1.0, theme.raised));
    };
    let text = |key: &str| words.fill(key, &[("unit", figures::unit(unit))]);
    let head = ["merge.feature", "merge.d_r_before", "merge.d_r_after", "merge.sigma_before", "merge.sigma_after"];
    row(ui, head.map(text), true);
    let mut notes = Vec::new();
    for feature in &done.job.extras.features {
        let certified = feature.certified.map(|c| c.0);
        let d_r = |fit: &Result<FeatureFit, String>| match fit {
            Ok(fit) => fit.d_r(certified).map_or_else(|| NONE.to_owned(), |d| figures::signed(d, unit, words)),
            Err(_) => NONE.to_owned(),
        };
        let sigma = |fit: &Result<FeatureFit, String>| match fit {
            Ok(fit) => figures::length(fit.sigma_dev, unit, words),
            Err(_) => NONE.to_owned(),
        };
        let (before, after) = (&feature.before, &feature.after);
        row(ui, [clean(&feature.name), d_r(before), d_r(after), sigma(before), sigma(after)], false);
        if let Err(why) = after {
            let values = [("feature", feature.name.clone()), ("why", words.library(why).into_owned())];
            notes.push(words.fill("merge.does_not_fit", &values.each_ref().map(|(key, value)| (*key, value.as_str()))));
        } else if let Some((radius, u)) = feature.certified {
            let values = [
                ("feature", feature.name.clone()),
                ("r", figures::length(radius, unit, words)),
                ("u", figures::with_unit(u, unit, words)),
            ];
            notes.push(certificate(&values, words));
        }
    }
    notes.iter().for_each(|note| line_ui(ui, note, scope));
}

fn certificate(values: &[(&str, String); 3], words: &Words) -> String {
    words.fill("merge.certificate", &values.each_ref().map(|(key, value)| (*key, value.as_str())))
}
