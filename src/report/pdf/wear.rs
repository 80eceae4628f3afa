//! The wear of a tool on paper: the map of differences, what it knows, and the regions that differ.

use super::document::Picture;
use super::flow::Flow;
use super::merge::{HEADING, MergeReport, number, paragraph, right};
use super::page::{Font, Page, Paint, set};
use super::sources::{PX_PER_MM, place_picture};
use super::table::{Row, put};
use super::theme::{LEFT, RIGHT, STRONG, TEXT, WHITE};
use crate::report::mask_study::short;
use crate::report::palette::Palette;
use crate::report::raster::points::CloudPicture;
use crate::report::uncertain::with_u;
use crate::report::view_colours::GREY;
use crate::report::words::thousands;
use crate::stitch::wear::{Verdict, Wear};

/// Width of the map, mm; the legend stands beside it.
const MAP: f64 = 150.0;

/// The scale of the wear map: the larger of the worst region and four usual uncertainties, in round numbers.
fn wear_range(wear: &Wear) -> f64 {
    let worst = wear.regions.iter().map(|r| r.extreme.abs()).fold(0.0, f64::max);
    let mut u: Vec<f64> = wear.difference_u.iter().filter(|u| u.is_finite()).map(|u| f64::from(*u)).collect();
    let usual = crate::fit::robust::median(&mut u).unwrap_or(1.0);
    let wanted = worst.max(4.0 * usual).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(wanted.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|s| s * power).find(|s| *s >= wanted).unwrap_or(wanted)
}

pub(super) fn wear_pages(
    flow: &mut Flow<'_>,
    report: &MergeReport<'_>,
    wear: &Wear,
    old: &str,
    pictures: &mut Vec<Picture>,
) {
    let y = flow.y;
    flow.page().text(LEFT, y + 4.4, HEADING, TEXT, &format!("Difference to {old}"));
    flow.y = y + 7.5;
    let range = wear_range(wear);
    let colour = |k: usize| match f64::from(wear.difference[k]) {
        d if d.is_finite() => Palette::default().colour(d / range),
        _ => GREY,
    };
    let room = [MAP, 112.0].map(|mm: f64| (mm * PX_PER_MM) as usize);
    let top = flow.y;
    if let Some(picture) = CloudPicture::of(report.positions, colour, &report.eye, report.d_s.max(report.d_grid), room)
    {
        let new_from_old = wear.old_from_new.inverse();
        place_picture(flow, picture, "Wear", (MAP, report.unit), pictures, |page, at| {
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
    let (x, height) = (LEFT + MAP + 4.0, 56.0);
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
    let mut text = match &wear.verdict {
        Verdict::Differs => String::new(),
        Verdict::Same => format!(
            "No region differs from before: by {} {unit} or more at nine of ten places it would have been told. ",
            short(wear.least_difference)
        ),
        Verdict::CannotBeTold(doubt) => {
            format!("Whether it wore, or which part of it, cannot be told: {}. ", doubt.words(unit))
        }
    };
    text += &format!(
        "Negative: material is gone; positive: it was added. A difference is between local means over a radius of {} to {} {unit}, the one at which noise and blur are least together; finer structure is blurred, which its uncertainty u covers. {} of {} points are not measured: the earlier cloud has no surface there (or one further away than {} {unit}); that does not mean that they are unworn. {} points of the earlier cloud were not seen again. ",
        short(wear.least_radius),
        short(wear.radius),
        thousands(wear.not_measured),
        thousands(all),
        short(1.5 * wear.radius),
        thousands(wear.old_not_seen),
    );
    text += &format!(
        "A region is told where means over {} {unit} differ over at least {} {unit}², one of them by {:.1} standard uncertainties: smaller or shallower ones cannot be told apart from errors. ",
        short(wear.radius),
        short(wear.least_area),
        wear.least_significance
    );
    text += &format!(
        "The cloud was moved by up to {} {unit} for the best fit: wear that is even all over, or grows evenly across, is a part of that and not told. ",
        short(wear.fit.moved)
    );
    if wear.fit.free_motions > 0 {
        text += &format!(
            "The surface leaves {} of six motions free; along these the cloud lies as it was registered. ",
            wear.fit.free_motions
        );
    }
    if !wear.regions.is_empty() {
        text += "The area of a region is where the difference is at least half its extreme, the mean is that of this area; one with * is blurred: it may be smaller and deeper. ";
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
        let mut cells = vec![format!("{}{}", k + 1, if r.blurred { "*" } else { "" })];
        for (value, u, signed) in [(r.area, r.area_u, false), (r.mean, r.mean_u, true), (r.extreme, r.extreme_u, true)]
        {
            let told = with_u(value, u, signed);
            let (value, u) = told.split_once(" ± ").unwrap_or((&told, ""));
            cells.extend([value.to_owned(), u.to_owned()]);
        }
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
