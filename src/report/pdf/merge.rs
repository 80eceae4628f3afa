//! The report of a merge on paper: what became of every view, how overlaps fit, features before and after; which view each point came from and
//! where the tool is worn stand in files of their own.

use super::document;
use super::flow::Flow;
use super::footer;
use super::page::{Font, Fonts, Paint, Type, set};
use super::sources::sources;
use super::table::{Align, Column, Row, put};
use super::theme::{LEFT, QUIET, RIGHT, STRONG, TEXT};
use super::wear::wear_pages;
use crate::geometry::Point3;
use crate::report::mask_study::short;
use crate::report::words::{capital, thousands};
use crate::stitch::feature::FeatureFit;
use crate::stitch::wear::Wear;

const PLAIN: Type = set(Font::Regular, 8.4);
const CELL: Type = set(Font::Mono, 7.4);
pub(super) const NAME: Type = set(Font::Regular, 7.8);
pub(super) const HEADING: Type = set(Font::SemiBold, 10.3);
/// Rows of pairs that are printed, the worst first; the JSON has all.
const MOST_PAIRS: usize = 40;

/// A view in the report.
#[derive(Debug, Clone, Default)]
pub struct ViewRow {
    /// Its file.
    pub name: String,
    /// Points read, masked, kept for merging, in the cloud.
    pub points: [usize; 4],
    /// How far registration moved it, at the middle of its points.
    pub moved: Option<f64>,
    /// And turned it, degrees.
    pub turned_deg: Option<f64>,
    /// Standard uncertainty of where it lies.
    pub place_u: Option<f64>,
    /// Why it is not in the cloud.
    pub left_out: Option<String>,
}

/// How two views fit.
#[derive(Debug, Clone)]
pub struct PairRow {
    /// Indices of the views.
    pub views: [usize; 2],
    /// Points of the smaller view that lie on the other one, as a share.
    pub share: f64,
    /// Of their distances from the other view.
    pub rms: f64,
    /// Their mean.
    pub mean: f64,
    /// Why registration did not use it.
    pub unused: Option<String>,
}

/// A feature, before and after merging.
#[derive(Debug, Clone)]
pub struct FeatureRow {
    /// What people call it.
    pub name: String,
    /// Certified radius and its standard uncertainty.
    pub certified: Option<(f64, f64)>,
    /// All points of the placed views; why it does not fit, else.
    pub before: Result<FeatureFit, String>,
    /// The merged cloud.
    pub after: Result<FeatureFit, String>,
}

/// What is printed. Lengths in `unit`.
pub struct MergeReport<'a> {
    /// The settings' file.
    pub file: &'a str,
    /// Unit of all lengths.
    pub unit: &'a str,
    /// By what points were judged, and the distance within which, in words.
    pub merged_by: String,
    /// Distance of points in a view.
    pub d_grid: f64,
    /// Distance within which points were merged.
    pub d_s: f64,
    /// Points before.
    pub points_in: usize,
    /// The cloud.
    pub positions: &'a [Point3],
    /// The view of each point; negative for a mean over several.
    pub source: &'a [i32],
    /// Where the sensors stood, about: the side from which the cloud is drawn.
    pub eye: Point3,
    /// All files.
    pub views: Vec<ViewRow>,
    /// Overlaps.
    pub pairs: Vec<PairRow>,
    /// The fitted features.
    pub features: Vec<FeatureRow>,
    /// The comparison with an earlier cloud, and that one's file.
    pub wear: Option<(&'a Wear, &'a str)>,
    /// What people should know.
    pub notes: Vec<String>,
    /// The JSON report: the document's id is made of it.
    pub seed: &'a [u8],
}

/// The document. The same report gives the same bytes.
pub fn merge_pdf(report: &MergeReport<'_>) -> Vec<u8> {
    let fonts = Fonts::new();
    let used = report.views.iter().filter(|v| v.left_out.is_none()).count();
    let about = format!(
        "{used} of {} views, {} of {} points",
        report.views.len(),
        thousands(report.positions.len()),
        thousands(report.points_in)
    );
    let mut flow = Flow::titled(&fonts, "Merged", &about, report.file);
    let mut pictures = Vec::new();
    summary(&mut flow, report);
    sources(&mut flow, report, &mut pictures);
    features(&mut flow, report);
    if let Some((wear, old)) = report.wear {
        flow.turn();
        wear_pages(&mut flow, report, wear, old, &mut pictures);
    }
    views(&mut flow, report);
    pairs(&mut flow, report);
    notes(&mut flow, report);
    let mut pages = flow.into_pages();
    let count = pages.len();
    let words = format!("All lengths in {}. Uncertainties are standard ones, k = 1.", report.unit);
    for (k, page) in pages.iter_mut().enumerate() {
        footer(page, "merge", &words, k + 1, count);
    }
    document::bytes(pages, &fonts, pictures, &format!("Merged: {}", report.file), report.seed)
}

fn summary(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    let y = flow.y;
    let unit = report.unit;
    let cells = [
        ("Merged", report.merged_by.clone()),
        ("d_grid", format!("{} {unit}", short(report.d_grid))),
        ("d_s", format!("{} {unit}", short(report.d_s))),
        ("Points left", format!("{:.1} %", 100.0 * report.positions.len() as f64 / report.points_in.max(1) as f64)),
    ];
    let page = flow.page();
    for ((x, width), (what, value)) in [(0.0, 84.0), (86.0, 30.0), (118.0, 30.0), (150.0, 32.4)].into_iter().zip(cells)
    {
        page.round_rect(LEFT + x, y, width, 13.0, 1.0, &Paint::stroke(STRONG, 0.2));
        page.text(LEFT + x + 2.4, y + 4.6, set(Font::Regular, 7.4), QUIET, what);
        let value = page.fonts.fitted(set(Font::SemiBold, 9.6), &value, width - 4.0);
        page.text(LEFT + x + 2.4, y + 10.0, set(Font::SemiBold, 9.6), TEXT, &value);
    }
    flow.y = y + 18.0;
}

pub(super) fn right(head: &'static str, x: f64, room: f64) -> Column {
    Column { head, align: Align::Right(x), set: CELL, room }
}

pub(super) fn left(head: &'static str, x: f64, room: f64) -> Column {
    Column { head, align: Align::Left(x), set: NAME, room }
}

pub(super) fn number(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map(short).unwrap_or_default().replace('-', "\u{2212}")
}

fn features(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    if report.features.is_empty() {
        return;
    }
    let columns = [
        left("Feature", LEFT, 40.0),
        left("", LEFT + 44.0, 20.0),
        right("Radius", 98.0, 22.0),
        right("u (noise)", 114.0, 15.0),
        right("Less certified", 136.0, 20.0),
        right("sigma_dev", 156.0, 18.0),
        right("Points", 176.0, 18.0),
        right("Rejected", RIGHT, 16.0),
    ];
    let mut rows = Vec::new();
    for feature in &report.features {
        for (when, fit) in [("before", &feature.before), ("after", &feature.after)] {
            let name = if when == "before" { feature.name.clone() } else { String::new() };
            rows.push(match fit {
                Ok(fit) => Row {
                    cells: vec![
                        name,
                        when.to_owned(),
                        fit.radius.map(|r| format!("{r:.4}")).unwrap_or_default(),
                        number(fit.radius_u),
                        fit.d_r(feature.certified.map(|c| c.0))
                            .map(|d| format!("{d:+.3}").replace('-', "\u{2212}"))
                            .unwrap_or_default(),
                        number(Some(fit.sigma_dev)),
                        thousands(fit.points),
                        thousands(fit.rejected),
                    ],
                    ..Row::default()
                },
                Err(why) => Row { cells: vec![name, when.to_owned()], words: why.clone(), ..Row::default() },
            });
        }
        if let (Some((radius, u)), Some(row)) = (feature.certified, rows.last_mut()) {
            row.words = format!(
                "Certified radius {radius}, standard uncertainty {u}. u (noise) knows independent errors only; what neighbouring points have in common comes on top."
            );
        }
    }
    put(flow, "Features before and after merging", &columns, &rows);
}

fn views(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    let columns = [
        right("No.", LEFT + 6.0, 8.0),
        left("View", LEFT + 9.0, 44.0),
        right("Read", 88.0, 17.0),
        right("Masked", 106.0, 17.0),
        right("Kept", 124.0, 17.0),
        right("In the cloud", 144.0, 18.0),
        right("Moved", 160.0, 15.0),
        right("Turned, °", 178.0, 16.0),
        right("u (place)", RIGHT, 16.0),
    ];
    let row = |(k, view): (usize, &ViewRow)| {
        let mut cells = vec![k.to_string(), view.name.clone()];
        cells.extend(view.points.iter().map(|n| thousands(*n)));
        cells.extend([number(view.moved), number(view.turned_deg), number(view.place_u)]);
        let words = view.left_out.as_ref().map(|why| format!("Left out: {why}")).unwrap_or_default();
        Row { cells, words, ..Row::default() }
    };
    let rows: Vec<Row> = report.views.iter().enumerate().map(row).collect();
    put(flow, "Views", &columns, &rows);
}

fn pairs(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    if report.pairs.is_empty() {
        return;
    }
    let columns = [
        right("Views", LEFT + 8.0, 10.0),
        right("", LEFT + 18.0, 10.0),
        right("Overlap, %", LEFT + 40.0, 16.0),
        right("rms", LEFT + 60.0, 18.0),
        right("Mean", LEFT + 80.0, 18.0),
        left("", LEFT + 86.0, 90.0),
    ];
    let mut sorted: Vec<&PairRow> = report.pairs.iter().collect();
    sorted.sort_by(|a, b| b.rms.total_cmp(&a.rms).then(a.views.cmp(&b.views)));
    let row = |pair: &&PairRow| Row {
        cells: vec![
            pair.views[0].to_string(),
            pair.views[1].to_string(),
            format!("{:.0}", 100.0 * pair.share),
            number(Some(pair.rms)),
            number(Some(pair.mean)),
            pair.unused.as_ref().map(|why| format!("not used: {why}")).unwrap_or_default(),
        ],
        ..Row::default()
    };
    let rows: Vec<Row> = sorted.iter().take(MOST_PAIRS).map(row).collect();
    let title = match sorted.len() {
        n if n > MOST_PAIRS => "Overlaps, the worst (all are in the JSON report)",
        _ => "Overlaps, the worst first",
    };
    put(flow, title, &columns, &rows);
}

fn notes(flow: &mut Flow<'_>, report: &MergeReport<'_>) {
    for note in &report.notes {
        paragraph(flow, &capital(note));
    }
}

pub(super) fn paragraph(flow: &mut Flow<'_>, text: &str) {
    let fonts = flow.page().fonts;
    for line in fonts.wrapped(PLAIN, &fonts.printable(PLAIN.font, text), RIGHT - LEFT) {
        flow.need(4.2);
        let y = flow.y;
        flow.page().text(LEFT, y + 3.2, PLAIN, TEXT, &line);
        flow.y = y + 4.2;
    }
    flow.y += 1.6;
}
