//! The report of a merge on paper: what became of every view, how overlaps fit, features before and after; which view each point came from and
//! where the tool is worn stand in files of their own.

use super::document::{self, Picture};
use super::flow::Flow;
use super::footer;
use super::merge_summary::summary;
use super::page::{Font, Fonts, Page, Type, set};
use super::sources::sources;
use super::table::{Align, Column, Row, put};
use super::theme::{LEFT, RIGHT, TEXT};
use super::wear::wear_pages;
use crate::geometry::Point3;
use crate::report::mask_study::short;
use crate::report::uncertain::with_u;
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
    /// Share of what its neighbours see in the same place that agrees.
    pub agreement: Option<f64>,
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

/// Fitted less certified radius, and its standard uncertainty where that is known: the points' independent errors and the certificate's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadiusError {
    /// Fitted less certified.
    pub d_r: f64,
    /// Its standard uncertainty; NaN where it is not known.
    pub u: f64,
}

impl RadiusError {
    /// Both, to a tenth of the uncertainty.
    pub fn told(self) -> String {
        with_u(self.d_r, self.u, true)
    }
}

impl FeatureRow {
    /// What a fit of it says of its radius; `None` of a plane, and where nobody certified one.
    pub fn d_r(&self, fit: &FeatureFit) -> Option<RadiusError> {
        let (certified, certified_u) = self.certified?;
        let d_r = fit.d_r(Some(certified))?;
        Some(RadiusError { d_r, u: fit.d_r_u(certified_u).unwrap_or(f64::NAN) })
    }
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
    /// Why there is none, where it was asked for.
    pub not_compared: Option<&'a str>,
    /// What people should know.
    pub notes: Vec<String>,
    /// The JSON report: the document's id is made of it.
    pub seed: &'a [u8],
}

/// The document. The same report gives the same bytes.
pub fn merge_pdf(report: &MergeReport<'_>) -> Vec<u8> {
    let fonts = Fonts::new();
    let (pages, pictures) = pages(&fonts, report);
    document::bytes(pages, &fonts, pictures, &format!("Merged: {}", report.file), report.seed)
}

/// Its pages and the pictures on them.
pub(super) fn pages<'a>(fonts: &'a Fonts, report: &MergeReport<'_>) -> (Vec<Page<'a>>, Vec<Picture>) {
    let used = report.views.iter().filter(|v| v.left_out.is_none()).count();
    let about =
        format!("{used} of {} views, {} points in the cloud", report.views.len(), thousands(report.positions.len()));
    let mut flow = Flow::titled(fonts, "Merged", &about, report.file);
    let mut pictures = Vec::new();
    summary(&mut flow, report);
    sources(&mut flow, report, &mut pictures);
    features(&mut flow, report);
    // Few views fill the page that the map leaves; many would push the wear far back.
    let views_first = flow.has(table_height(report.views.len()));
    if views_first {
        views(&mut flow, report);
    }
    if let Some((wear, old)) = report.wear {
        flow.turn();
        wear_pages(&mut flow, report, wear, old, &mut pictures);
    }
    if !views_first {
        views(&mut flow, report);
    }
    pairs(&mut flow, report);
    notes(&mut flow, report);
    let mut pages = flow.into_pages();
    let count = pages.len();
    let words = format!("All lengths in {}. Uncertainties are standard ones, k = 1.", report.unit);
    for (k, page) in pages.iter_mut().enumerate() {
        footer(page, "merge", &words, k + 1, count);
    }
    (pages, pictures)
}

/// About how high a table is, each row with a line of words, mm.
fn table_height(rows: usize) -> f64 {
    14.0 + 8.0 * rows as f64
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
        left("Feature", LEFT, 36.0),
        left("", LEFT + 38.0, 14.0),
        right("Radius", 88.0, 24.0),
        right("u (noise)", 104.0, 15.0),
        right("d_r", 122.0, 17.0),
        right("u (d_r)", 137.0, 14.0),
        right("sigma_dev", 156.0, 18.0),
        right("Points", 176.0, 18.0),
        right("Rejected", RIGHT, 16.0),
    ];
    let mut rows = Vec::new();
    for feature in &report.features {
        for (when, fit) in [("before", &feature.before), ("after", &feature.after)] {
            let name = if when == "before" { feature.name.clone() } else { String::new() };
            rows.push(match fit {
                Ok(fit) => Row { cells: feature_cells(name, when, feature, fit), ..Row::default() },
                Err(why) => Row { cells: vec![name, when.to_owned()], words: why.clone(), ..Row::default() },
            });
        }
        if let (Some((radius, u)), Some(row)) = (feature.certified, rows.last_mut()) {
            row.words = format!(
                "d_r: radius less the certified one, {radius}, whose standard uncertainty is {u}. u (noise) knows the points' independent errors only, u (d_r) these and the certificate's; what neighbouring points have in common comes on top."
            );
        }
    }
    put(flow, "Features before and after merging", &columns, &rows);
}

fn feature_cells(name: String, when: &str, feature: &FeatureRow, fit: &FeatureFit) -> Vec<String> {
    let in_two = |value: Option<f64>, u: Option<f64>, signed: bool| {
        let Some(value) = value else { return [String::new(), String::new()] };
        let text = with_u(value, u.unwrap_or(f64::NAN), signed);
        let (value, u) = text.split_once(" ± ").unwrap_or((&text, ""));
        [value.to_owned(), u.to_owned()]
    };
    let d_r = feature.d_r(fit);
    let [radius, radius_u] = in_two(fit.radius, fit.radius_u, false);
    let [d_r, d_r_u] = in_two(d_r.map(|d| d.d_r), d_r.map(|d| d.u), true);
    let sigma = number(Some(fit.sigma_dev));
    vec![name, when.to_owned(), radius, radius_u, d_r, d_r_u, sigma, thousands(fit.points), thousands(fit.rejected)]
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
        ],
        words: pair.unused.as_ref().map(|why| format!("Not used: {why}")).unwrap_or_default(),
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
