//! The report of a merge on paper: which view each point came from, what became of every view, how overlaps fit, features before and after,
//! and where the tool is worn.

use super::document::{self, Picture};
use super::flow::Flow;
use super::footer;
use super::page::{Font, Fonts, Page, Paint, Type, set};
use super::table::{Align, Column, Row, put};
use super::theme::{LEFT, QUIET, RIGHT, STRONG, TEXT, WHITE};
use crate::geometry::Point3;
use crate::report::mask_study::short;
use crate::report::palette::{Palette, Rgb};
use crate::report::raster::points::CloudPicture;
use crate::report::words::{capital, thousands};
use crate::stitch::feature::FeatureFit;
use crate::stitch::wear::Wear;
use printpdf::XObjectId;

/// Colours of views; lighter repeats follow.
const VIEWS: [Rgb; 6] = [
    [0x3B, 0x7D, 0xC4],
    [0xE0, 0x8A, 0x2E],
    [0x2E, 0x9C, 0x86],
    [0x8A, 0x63, 0xB8],
    [0xC2, 0x57, 0x7A],
    [0x7D, 0x8B, 0x2E],
];
/// Points that are the mean of several views', and what was not measured.
const GREY: Rgb = [0xA6, 0xAD, 0xB5];
const PX_PER_MM: f64 = 200.0 / 25.4;
const PLAIN: Type = set(Font::Regular, 8.4);
const CELL: Type = set(Font::Mono, 7.4);
const NAME: Type = set(Font::Regular, 7.8);
const HEADING: Type = set(Font::SemiBold, 10.3);
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

/// Colour of a view: the same ones again, lighter each time round.
pub fn view_colour(view: i32) -> Rgb {
    let Ok(view) = usize::try_from(view) else { return GREY };
    let lighter = [0.0, 0.35, 0.6][(view / VIEWS.len()).min(2)];
    VIEWS[view % VIEWS.len()].map(|c| (f64::from(c) + lighter * (255.0 - f64::from(c))).round() as u8)
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

/// Puts a picture in the middle of the page, at most so high; where it begins.
fn place_picture(
    flow: &mut Flow<'_>,
    picture: CloudPicture,
    name: &str,
    width: f64,
    pictures: &mut Vec<Picture>,
    over: impl FnOnce(&mut Page<'_>, &dyn Fn(&Point3) -> [f64; 2]),
) {
    let size = [picture.width_px as f64 / PX_PER_MM, picture.height_px as f64 / PX_PER_MM];
    flow.need(size[1] + 4.0);
    let corner = [LEFT + 0.5 * (width - size[0]), flow.y];
    let id = XObjectId(name.to_owned());
    let page = flow.page();
    page.image(&id, corner[0], corner[1], size[0], size[1]);
    let at = |p: &Point3| {
        let [x, y] = picture.place_px(p);
        [corner[0] + x / PX_PER_MM, corner[1] + y / PX_PER_MM]
    };
    over(page, &at);
    pictures.push(Picture { id, size_px: [picture.width_px, picture.height_px], pixels: picture.pixels });
    flow.y += size[1] + 4.0;
}

/// Which view each point came from, with the views' numbers.
fn sources(flow: &mut Flow<'_>, report: &MergeReport<'_>, pictures: &mut Vec<Picture>) {
    let y = flow.y;
    flow.page().text(LEFT, y + 4.4, HEADING, TEXT, "Which view each point came from");
    flow.y = y + 7.5;
    let room = [182.4, 118.0].map(|mm: f64| (mm * PX_PER_MM) as usize);
    let colour = |k: usize| view_colour(report.source[k]);
    let Some(picture) = CloudPicture::of(report.positions, colour, &report.eye, report.d_s.max(report.d_grid), room)
    else {
        return;
    };
    let middles = middles(report);
    place_picture(flow, picture, "Sources", 182.4, pictures, |page, at| {
        let size = if middles.len() > 40 { 5.6 } else { 7.4 };
        for (view, middle) in &middles {
            let [x, y] = at(middle);
            let (text, label) = (view.to_string(), set(Font::SemiBold, size));
            let half = 0.5 * page.fonts.width_mm(label, &text) + 0.9;
            page.round_rect(
                x - half,
                y - 0.24 * size,
                2.0 * half,
                0.48 * size,
                0.7,
                &Paint::both(WHITE, view_colour(*view), 0.35),
            );
            page.text_centre(x, y + 0.13 * size, label, TEXT, &text);
        }
    });
    let words = "Numbers are those of the table of views. A point is of the view whose point is the best one around it; grey: the mean of several.";
    let y = flow.y;
    flow.page().text(LEFT, y + 1.5, NAME, QUIET, words);
    flow.y = y + 5.5;
}

/// Of each view the point of its own that lies nearest to the middle of them.
fn middles(report: &MergeReport<'_>) -> Vec<(i32, Point3)> {
    let mut sums: std::collections::BTreeMap<i32, (nalgebra::Vector3<f64>, f64)> = std::collections::BTreeMap::new();
    for (p, view) in report.positions.iter().zip(report.source).filter(|(_, view)| **view >= 0) {
        let sum = sums.entry(*view).or_default();
        *sum = (sum.0 + p.coords, sum.1 + 1.0);
    }
    let mut best: std::collections::BTreeMap<i32, (f64, Point3)> = std::collections::BTreeMap::new();
    for (p, view) in report.positions.iter().zip(report.source) {
        let Some((sum, count)) = sums.get(view) else { continue };
        let off = (p.coords - sum / *count).norm_squared();
        let best = best.entry(*view).or_insert((off, *p));
        if off < best.0 {
            *best = (off, *p);
        }
    }
    best.into_iter().map(|(view, (_, p))| (view, p)).collect()
}

fn right(head: &'static str, x: f64, room: f64) -> Column {
    Column { head, align: Align::Right(x), set: CELL, room }
}

fn left(head: &'static str, x: f64, room: f64) -> Column {
    Column { head, align: Align::Left(x), set: NAME, room }
}

fn number(value: Option<f64>) -> String {
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

fn paragraph(flow: &mut Flow<'_>, text: &str) {
    let fonts = flow.page().fonts;
    for line in fonts.wrapped(PLAIN, &fonts.printable(PLAIN.font, text), RIGHT - LEFT) {
        flow.need(4.2);
        let y = flow.y;
        flow.page().text(LEFT, y + 3.2, PLAIN, TEXT, &line);
        flow.y = y + 4.2;
    }
    flow.y += 1.6;
}

/// The scale of the wear map: the larger of the worst region and four usual uncertainties, in round numbers.
fn wear_range(wear: &Wear) -> f64 {
    let worst = wear.regions.iter().map(|r| r.extreme.abs()).fold(0.0, f64::max);
    let mut u: Vec<f64> = wear.difference_u.iter().filter(|u| u.is_finite()).map(|u| f64::from(*u)).collect();
    let usual = crate::fit::robust::median(&mut u).unwrap_or(1.0);
    let wanted = worst.max(4.0 * usual).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(wanted.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|s| s * power).find(|s| *s >= wanted).unwrap_or(wanted)
}

fn wear_pages(flow: &mut Flow<'_>, report: &MergeReport<'_>, wear: &Wear, old: &str, pictures: &mut Vec<Picture>) {
    let y = flow.y;
    flow.page().text(LEFT, y + 4.4, HEADING, TEXT, &format!("Difference to {old}"));
    flow.y = y + 7.5;
    let range = wear_range(wear);
    let colour = |k: usize| match f64::from(wear.difference[k]) {
        d if d.is_finite() => Palette::default().colour(d / range),
        _ => GREY,
    };
    let room = [160.0, 112.0].map(|mm: f64| (mm * PX_PER_MM) as usize);
    let top = flow.y;
    if let Some(picture) = CloudPicture::of(report.positions, colour, &report.eye, report.d_s.max(report.d_grid), room)
    {
        let new_from_old = wear.old_from_new.inverse();
        place_picture(flow, picture, "Wear", 160.0, pictures, |page, at| {
            for (k, region) in wear.regions.iter().enumerate() {
                let [x, y] = at(&(new_from_old * region.centre));
                page.circle(x, y, 2.1, &Paint::both(WHITE, TEXT, 0.3));
                page.text_centre(x, y + 1.0, set(Font::SemiBold, 7.4), TEXT, &(k + 1).to_string());
            }
        });
    }
    legend(flow.page(), range, top, report.unit);
    flow.y = flow.y.max(top + 74.0);
    paragraph(flow, &wear_words(wear, report));
    regions(flow, wear);
}

fn legend(page: &mut Page<'_>, range: f64, top: f64, unit: &str) {
    const SLICES: usize = 80;
    let (x, height) = (LEFT + 164.0, 56.0);
    page.text(x, top + 2.6, set(Font::SemiBold, 7.8), TEXT, &format!("New less old, {unit}"));
    let top = top + 5.0;
    for k in 0..SLICES {
        let value = 1.0 - 2.0 * (k as f64 + 0.5) / SLICES as f64;
        let y = top + height * k as f64 / SLICES as f64;
        let tall = height / SLICES as f64 * if k + 1 == SLICES { 1.0 } else { 1.4 };
        page.rect(x, y, 3.8, tall, &Paint::fill(Palette::default().colour(value)));
    }
    page.rect(x, top, 3.8, height, &Paint::stroke(STRONG, 0.2));
    for k in 0..=4 {
        let value = range * (1.0 - f64::from(k) / 2.0);
        let y = top + height * f64::from(k) / 4.0;
        page.text(x + 5.4, y + 0.95, set(Font::Mono, 7.2), TEXT, &number(Some(value)));
    }
    page.rect(x, top + height + 3.0, 3.8, 2.8, &Paint::both(GREY, STRONG, 0.15));
    page.text(x + 5.4, top + height + 5.2, set(Font::Regular, 7.2), TEXT, "Not measured");
}

fn wear_words(wear: &Wear, report: &MergeReport<'_>) -> String {
    let unit = report.unit;
    let all = wear.difference.len();
    let mut text = format!(
        "Negative: material is gone; positive: it was added. Differences are between local means over a radius of {} {unit}; finer structure is blurred. {} of {} points are not measured: the earlier cloud has no surface there (or one further away than {} {unit}); that does not mean that they are unworn. {} points of the earlier cloud were not seen again. ",
        short(wear.radius),
        thousands(wear.not_measured),
        thousands(all),
        short(1.5 * wear.radius),
        thousands(wear.old_not_seen),
    );
    let least = format!(
        "A region is told from {} {unit}² on, where a difference is {:.1} standard uncertainties: smaller or shallower ones cannot be told apart from errors. ",
        short(wear.least_area),
        wear.least_significance
    );
    text += &least;
    if wear.fit.free_motions > 0 {
        text += &format!(
            "The surface leaves {} of six motions free; along these the cloud lies as it was registered. ",
            wear.fit.free_motions
        );
    }
    if wear.regions.is_empty() {
        text += "No region differs from before.";
    }
    text
}

fn regions(flow: &mut Flow<'_>, wear: &Wear) {
    if wear.regions.is_empty() {
        return;
    }
    let columns = [
        right("No.", LEFT + 6.0, 8.0),
        right("Area", LEFT + 28.0, 20.0),
        right("u", LEFT + 44.0, 15.0),
        right("Mean", LEFT + 62.0, 17.0),
        right("u", LEFT + 76.0, 13.0),
        right("Extreme", LEFT + 95.0, 18.0),
        right("u", LEFT + 109.0, 13.0),
        right("Times its u", LEFT + 126.0, 16.0),
        right("x", LEFT + 146.0, 18.0),
        right("y", LEFT + 164.0, 18.0),
        right("z", RIGHT, 18.0),
    ];
    let row = |(k, r): (usize, &crate::stitch::wear::WornRegion)| {
        let mut cells = vec![(k + 1).to_string()];
        cells.extend([r.area, r.area_u, r.mean, r.mean_u, r.extreme, r.extreme_u].map(|v| number(Some(v))));
        cells.push(format!("{:.1}", r.significance));
        cells.extend((0..3).map(|axis| number(Some(r.extreme_at[axis]))));
        Row { cells, ..Row::default() }
    };
    let rows: Vec<Row> = wear.regions.iter().enumerate().map(row).collect();
    put(
        flow,
        "Regions that differ, the largest first; places of the extreme in the earlier cloud's frame",
        &columns,
        &rows,
    );
}
