//! What of a merge people must know first: how many views came in and which did not, how far they agree, the features, and whether the tool wore.

use super::flow::Flow;
use super::merge::{FeatureRow, MergeReport, PairRow};
use super::page::{Font, Paint, Type, set};
use super::theme::{LEFT, QUIET, RIGHT, STRONG, TEXT};
use crate::report::mask_study::short;
use crate::report::uncertain::with_u;
use crate::report::words::thousands;
use crate::stitch::wear::{Verdict, Wear};

const NAME: Type = set(Font::SemiBold, 8.8);
const WORDS: Type = set(Font::Regular, 8.8);
/// Where the words begin, mm, and the height of a line of them.
const WORDS_AT: f64 = LEFT + 27.0;
const LINE: f64 = 4.1;
/// Views that are left out are told here up to so many, each in so many lines; the table of views has all of it.
const MOST_LEFT_OUT: usize = 6;
const MOST_LINES: usize = 4;

/// Puts the summary and what the merge was made by.
pub(super) fn summary(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    flow.y += 1.5;
    for (name, paragraphs) in told(report) {
        for (k, text) in paragraphs.iter().enumerate() {
            let fonts = flow.page().fonts;
            let lines = whole(fonts.wrapped(WORDS, &fonts.printable(WORDS.font, text), RIGHT - WORDS_AT));
            flow.need(LINE * lines.len() as f64);
            let y = flow.y;
            let page = flow.page();
            if k == 0 {
                let name = page.fonts.printable(NAME.font, &name);
                let name = page.fonts.fitted(NAME, &name, WORDS_AT - LEFT - 2.0);
                page.text(LEFT, y + 3.2, NAME, TEXT, &name);
            }
            for (row, line) in lines.iter().enumerate() {
                page.text(WORDS_AT, y + 3.2 + LINE * row as f64, WORDS, TEXT, line);
            }
            flow.y = y + LINE * lines.len() as f64;
        }
        flow.y += 1.2;
    }
    flow.y += 1.5;
    cells(flow, report);
}

/// So many lines of a reason; where it goes on, the last of them says where.
fn whole(mut lines: Vec<String>) -> Vec<String> {
    if lines.len() > MOST_LINES {
        lines.truncate(MOST_LINES - 1);
        lines.push("… all of it stands in the table of views.".to_owned());
    }
    lines
}

fn cells(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    let y = flow.y;
    let unit = report.unit;
    let share = 100.0 * report.positions.len() as f64 / report.points_in.max(1) as f64;
    let cells = [
        ("Merged", report.merged_by.clone()),
        ("d_grid", format!("{} {unit}", short(report.d_grid))),
        ("d_s", format!("{} {unit}", short(report.d_s))),
        ("In the cloud, of points kept", format!("{share:.1} %")),
    ];
    let page = flow.page();
    for ((x, width), (what, value)) in [(0.0, 76.0), (78.0, 30.0), (110.0, 30.0), (142.0, 40.4)].into_iter().zip(cells)
    {
        page.round_rect(LEFT + x, y, width, 13.0, 1.0, &Paint::stroke(STRONG, 0.2));
        page.text(LEFT + x + 2.4, y + 4.6, set(Font::Regular, 7.4), QUIET, what);
        let value = page.fonts.fitted(set(Font::SemiBold, 9.6), &value, width - 4.0);
        page.text(LEFT + x + 2.4, y + 10.0, set(Font::SemiBold, 9.6), TEXT, &value);
    }
    flow.y = y + 17.0;
}

/// What stands at the left, and its paragraphs.
fn told(report: &MergeReport<'_>) -> Vec<(String, Vec<String>)> {
    let mut all = vec![("Views".to_owned(), views(report))];
    all.extend(agreement(report).map(|text| ("Agreement".to_owned(), vec![text])));
    all.extend(report.features.iter().map(|row| (row.name.clone(), vec![feature(row, report.unit)])));
    match (report.wear, report.not_compared) {
        (Some((wear, old)), _) => all.push(("Wear".to_owned(), vec![worn(wear, old, report.unit)])),
        (None, Some(why)) => all.push(("Wear".to_owned(), vec![format!("Not told: {why}.")])),
        (None, None) => {}
    }
    all
}

fn views(report: &MergeReport<'_>) -> Vec<String> {
    let left_out: Vec<_> = report.views.iter().filter(|view| view.left_out.is_some()).collect();
    let used = report.views.len() - left_out.len();
    let points = format!(
        "{} points in the cloud, of {} that masks kept of them",
        thousands(report.positions.len()),
        thousands(report.points_in)
    );
    let all = match report.views.len() {
        1 => format!("The one view is in: {points}."),
        2 if left_out.is_empty() => format!("Both views are in: {points}."),
        count if left_out.is_empty() => format!("All {count} views are in: {points}."),
        count => format!("{used} of {count} views are in: {points}. Left out:"),
    };
    let why =
        |view: &&super::merge::ViewRow| format!("{}: {}.", view.name, view.left_out.as_deref().unwrap_or_default());
    let mut paragraphs: Vec<String> =
        std::iter::once(all).chain(left_out.iter().take(MOST_LEFT_OUT).map(why)).collect();
    if left_out.len() > MOST_LEFT_OUT {
        paragraphs.push(format!("And {} more, which the table of views names.", left_out.len() - MOST_LEFT_OUT));
    }
    paragraphs
}

/// How far the views say the same where several saw it; `None` of one view.
fn agreement(report: &MergeReport<'_>) -> Option<String> {
    let used: Vec<&PairRow> = report.pairs.iter().filter(|p| p.unused.is_none() && p.rms.is_finite()).collect();
    if report.pairs.is_empty() && report.views.iter().filter(|view| view.left_out.is_none()).count() > 1 {
        return Some("Not told: the views were not registered, they lie where they were given.".to_owned());
    }
    let mut rms: Vec<f64> = used.iter().map(|pair| pair.rms).collect();
    let usual = crate::fit::robust::median(&mut rms)?;
    let worst = used.iter().max_by(|a, b| a.rms.total_cmp(&b.rms))?;
    let [a, b] = worst.views;
    let mut text =
        format!("Where two views overlap they differ by {} {} (rms, the median of", short(usual), report.unit);
    text += &match used.len() {
        1 => " one overlap).".to_owned(),
        n => format!(" {n} overlaps), the worst by {} (views {a} and {b}).", short(worst.rms)),
    };
    let least = report.views.iter().filter_map(|v| Some((v.agreement.filter(|a| a.is_finite())?, v)));
    match least.min_by(|a, b| a.0.total_cmp(&b.0)) {
        // What is told to a tenth of a percent.
        Some((share, _)) if share >= 0.9995 => text += " All that neighbours see in the same place agrees.",
        Some((share, view)) => {
            let share = 100.0 * share;
            text += &format!(" Of what neighbours see in the same place at least {share:.1} % agrees ({}).", view.name);
        }
        None => {}
    }
    let unused = report.pairs.len() - report.pairs.iter().filter(|pair| pair.unused.is_none()).count();
    if unused > 0 {
        text += &format!(" {unused} of {} overlaps were not used, see the table.", report.pairs.len());
    }
    Some(text)
}

/// A feature after merging, beside what it was before.
fn feature(row: &FeatureRow, unit: &str) -> String {
    let after = match &row.after {
        Err(why) => return format!("Does not fit the merged cloud: {why}."),
        Ok(after) => after,
    };
    let sigma = |fit: &Result<crate::stitch::feature::FeatureFit, String>| match fit {
        Ok(fit) => format!("{} {unit}", short(fit.sigma_dev)),
        Err(_) => "not told".to_owned(),
    };
    let scatter = format!("sigma_dev {} after merging, {} before.", sigma(&row.after), sigma(&row.before));
    let Some((certified, u)) = row.certified else { return scatter };
    let Some(d_r) = row.d_r(after) else { return scatter };
    let before = row.before.as_ref().ok().and_then(|fit| row.d_r(fit));
    let before = before.map(|d_r| format!(", {} before", d_r.told())).unwrap_or_default();
    format!(
        "d_r = {} {unit} (k = 1) after merging{before}: fitted less certified radius, {certified} ± {u} {unit}. {scatter}",
        d_r.told()
    )
}

fn worn(wear: &Wear, old: &str, unit: &str) -> String {
    let regions = wear.regions.first().map(|largest| {
        let count = match wear.regions.len() {
            1 => "One region differs".to_owned(),
            n => format!("{n} regions differ"),
        };
        let blurred = if largest.blurred { "; blurred: it may be smaller and deeper" } else { "" };
        format!(
            "{count} from {old}, the largest by {} {unit} on average over {} {unit}²{blurred}.",
            with_u(largest.mean, largest.mean_u, true),
            with_u(largest.area, largest.area_u, false)
        )
    });
    let told = match (&wear.verdict, regions) {
        (Verdict::CannotBeTold(doubt), regions) => {
            let regions = regions.map(|regions| format!(" {regions}")).unwrap_or_default();
            format!("Whether it wore, or which part of it, cannot be told: {}.{regions}", doubt.words(unit))
        }
        (_, Some(regions)) => regions,
        (_, None) => format!(
            "No region differs from {old}: {} {unit} or more would have been told at nine of ten places.",
            short(wear.least_difference)
        ),
    };
    let measured = wear.difference.len() - wear.not_measured;
    format!(
        "{told} {} points compared, {} not measured. Put in place by moving up to {} {unit}: wear that is even, or grows evenly across, cannot be told from that.",
        thousands(measured),
        thousands(wear.not_measured),
        short(wear.fit.moved)
    )
}
