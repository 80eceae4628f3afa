//! A merged cloud on paper: which view each point came from.

use super::document::Picture;
use super::flow::Flow;
use super::merge::{HEADING, MergeReport, NAME};
use super::page::{Font, Page, Paint, set};
use super::plot::trimmed;
use super::theme::{LEFT, QUIET, TEXT, WHITE};
use crate::geometry::Point3;
use crate::report::raster::points::CloudPicture;
use crate::report::view_colours::view_colour;
use printpdf::XObjectId;

pub(super) const PX_PER_MM: f64 = 200.0 / 25.4;
/// Room below a picture for its scale, mm.
const BELOW: f64 = 7.0;

/// A length for a scale bar: 1, 2 or 5 times a power of ten, at most a quarter of what is seen.
fn bar_length(seen: f64) -> f64 {
    let power = 10f64.powf((0.25 * seen).log10().floor());
    [5.0, 2.0].into_iter().map(|s| s * power).find(|s| *s <= 0.25 * seen).unwrap_or(power)
}

/// How long a length is in the picture above, mm from the left and from the top.
fn scale_bar(page: &mut Page<'_>, [x, y]: [f64; 2], length_mm: f64, words: &str) {
    page.rule(x, x + length_mm, y, TEXT, 0.5);
    for end in [x, x + length_mm] {
        page.line(&[[end, y - 1.1], [end, y + 1.1]], TEXT, 0.3, false);
    }
    page.text(x + length_mm + 1.8, y + 1.0, NAME, TEXT, words);
}

/// Puts a picture in the middle of a width, at most so high, and how long lengths are in it below.
pub(super) fn place_picture(
    flow: &mut Flow<'_>,
    picture: CloudPicture,
    name: &str,
    (width, unit): (f64, &str),
    pictures: &mut Vec<Picture>,
    over: impl FnOnce(&mut Page<'_>, &dyn Fn(&Point3) -> [f64; 2]),
) {
    let size = [picture.width_px as f64 / PX_PER_MM, picture.height_px as f64 / PX_PER_MM];
    flow.need(size[1] + BELOW);
    let corner = [LEFT + 0.5 * (width - size[0]), flow.y];
    let id = XObjectId(name.to_owned());
    let page = flow.page();
    page.image(&id, corner[0], corner[1], size[0], size[1]);
    let at = |p: &Point3| {
        let [x, y] = picture.place_px(p);
        [corner[0] + x / PX_PER_MM, corner[1] + y / PX_PER_MM]
    };
    over(page, &at);
    let mm_per_unit = picture.px_per_unit() / PX_PER_MM;
    let length = bar_length(size[0] / mm_per_unit);
    let words = format!("{} {unit}", trimmed(length));
    scale_bar(page, [corner[0], corner[1] + size[1] + 3.0], length * mm_per_unit, &words);
    pictures.push(Picture { id, size_px: [picture.width_px, picture.height_px], pixels: picture.pixels });
    flow.y += size[1] + BELOW;
}

/// Which view each point came from, with the views' numbers.
pub(super) fn sources(flow: &mut Flow<'_>, report: &MergeReport<'_>, pictures: &mut Vec<Picture>) {
    let y = flow.y;
    flow.page().text(LEFT, y + 4.4, HEADING, TEXT, "Which view each point came from");
    flow.y = y + 7.5;
    let room = [182.4, 106.0].map(|mm: f64| (mm * PX_PER_MM) as usize);
    let colour = |k: usize| view_colour(report.source[k]);
    let Some(picture) = CloudPicture::of(report.positions, colour, &report.eye, report.d_s.max(report.d_grid), room)
    else {
        return;
    };
    let middles = middles(report);
    place_picture(flow, picture, "Sources", (182.4, report.unit), pictures, |page, at| {
        let size = if middles.len() > 40 { 5.6 } else { 7.4 };
        // One that would lie over another gives way.
        let mut taken: Vec<[f64; 3]> = Vec::new();
        for (view, middle) in &middles {
            let [x, y] = at(middle);
            let (text, label) = (view.to_string(), set(Font::SemiBold, size));
            let half = 0.5 * page.fonts.width_mm(label, &text) + 0.9;
            let over = |[x1, y1, half1]: &[f64; 3]| (x - x1).abs() < half + half1 && (y - y1).abs() < 0.48 * size;
            if taken.iter().any(over) {
                continue;
            }
            taken.push([x, y, half]);
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

#[cfg(test)]
mod tests {
    use super::bar_length;

    #[test]
    fn a_scale_bar_is_a_round_length_of_a_tenth_to_a_quarter_of_what_is_seen() {
        for k in 0..400 {
            let seen = 10f64.powf(f64::from(k) / 50.0 - 4.0);
            let length = bar_length(seen);
            // Between 1, 2, 5 and 10 the largest step is 2.5.
            assert!((0.0999..0.2501).contains(&(length / seen)), "{seen} {length}");
            let digit = length / 10f64.powf((length.log10() + 1e-9).floor());
            assert!([1.0, 2.0, 5.0].iter().any(|d| (digit - d).abs() < 1e-6), "{length}");
        }
        assert_eq!([bar_length(2600.0), bar_length(190.0), bar_length(1.0)], [500.0, 20.0, 0.2]);
    }
}
