//! The deviation map as a picture, drawn by the processor: no display, no GPU, the same pixels everywhere.
//!
//! `view` chooses from where the part is seen, `surface` decides what each sample shows (z-buffer), `field` spreads the
//! cloud's deviations over the visible pixels, `compose` makes colours of both.

mod compose;
mod field;
pub mod points;
mod surface;
mod view;

use super::palette::Palette;
use crate::geometry::{Mesh, Point3};
use crate::run::{Cancelled, RunContext};
pub use field::Dot;
use rayon::prelude::*;
use surface::SUPERSAMPLING;
pub use view::View;

/// What to draw.
pub struct MapInput<'a> {
    /// The face that was seen, normals towards the camera, CAD frame.
    pub face: &'a Mesh,
    /// Points that carry a deviation, CAD frame.
    pub points: &'a [Point3],
    /// Their deviations, mm; as many as points.
    pub deviations_mm: &'a [f32],
    /// Typical distance between neighbouring points, mm.
    pub spacing_mm: f64,
}

/// How to draw it.
#[derive(Debug, Clone, Copy)]
pub struct MapStyle {
    /// The scale runs from minus to plus this value, mm.
    pub range_mm: f64,
    /// Its colours.
    pub palette: Palette,
    /// The picture is at most this wide, pixels.
    pub max_width_px: usize,
    /// The picture is at most this high, pixels.
    pub max_height_px: usize,
    /// Width of the part's outline, pixels.
    pub line_px: usize,
}

/// A picture of the part that just holds it, with the way from CAD coordinates to its pixels.
pub struct MapPicture {
    /// Pixels a row.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// RGB, row by row from the top.
    pub pixels: Vec<u8>,
    /// From where it is seen.
    pub view: View,
    /// Scale.
    pub px_per_mm: f64,
    /// Points beyond the scale's lower and upper end.
    pub beyond: [usize; 2],
    /// Somewhere the sheet is seen from behind (a fold), drawn in grey.
    pub reverse_seen: bool,
}

impl MapPicture {
    /// Pixels from the left and from the top of a point in the CAD frame.
    pub fn place_px(&self, point_cad: &Point3) -> [f64; 2] {
        let [right, up, _] = self.view.project(point_cad);
        [0.5 * self.width_px as f64 + right * self.px_per_mm, 0.5 * self.height_px as f64 - up * self.px_per_mm]
    }
}

/// Room around the part in pixels, for the outline.
const EDGE_PX: usize = 3;

/// Draws the map; `None` when the face has no extent.
pub fn draw(input: &MapInput<'_>, style: &MapStyle, run: &RunContext) -> Result<Option<MapPicture>, Cancelled> {
    run.check()?;
    let Some(view) = View::best(input.face) else { return Ok(None) };
    let (w, h) = (2.0 * view.half_width_mm, 2.0 * view.half_height_mm);
    let room = |px: usize| px.saturating_sub(2 * EDGE_PX).max(1) as f64;
    let px_per_mm = (room(style.max_width_px) / w).min(room(style.max_height_px) / h);
    if !px_per_mm.is_finite() || px_per_mm <= 0.0 {
        return Ok(None);
    }
    let size = |extent: f64| (extent * px_per_mm).ceil() as usize + 2 * EDGE_PX;
    let (width_px, height_px) = (size(w), size(h));
    let samples = SUPERSAMPLING as f64 * px_per_mm;
    run.check()?;
    let surface = surface::draw(input.face, &view, [width_px, height_px].map(|px| SUPERSAMPLING * px), samples, run)?;
    let mut picture =
        MapPicture { width_px, height_px, pixels: Vec::new(), view, px_per_mm, beyond: [0, 0], reverse_seen: false };
    let reverse = surface.samples.par_iter().filter(|s| s.reverse).count();
    picture.reverse_seen = 1000 * reverse > surface.samples.len();
    let dot = |k: usize| {
        let point = &input.points[k];
        let [x, y] = picture.place_px(point);
        Dot { x, y, depth_mm: view.project(point)[2], deviation_mm: input.deviations_mm[k] }
    };
    let count = input.points.len().min(input.deviations_mm.len());
    let field = field::splat(count, dot, &surface, input.spacing_mm * px_per_mm, run)?;
    run.check()?;
    let range = style.range_mm as f32;
    picture.beyond = [
        input.deviations_mm.iter().filter(|&&d| d < -range).count(),
        input.deviations_mm.iter().filter(|&&d| d > range).count(),
    ];
    let style = compose::Style { range_mm: style.range_mm, palette: style.palette, px_per_mm, line_px: style.line_px };
    picture.pixels = compose::compose(&surface, &field, &style, run)?;
    Ok(Some(picture))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(input: &MapInput<'_>, style: &MapStyle) -> Option<MapPicture> {
        super::draw(input, style, &RunContext::silent()).unwrap()
    }
    use crate::report::example;

    fn style() -> MapStyle {
        MapStyle { range_mm: 1.0, palette: Palette::default(), max_width_px: 400, max_height_px: 300, line_px: 1 }
    }

    fn pixel(picture: &MapPicture, at: &Point3) -> [u8; 3] {
        let [x, y] = picture.place_px(at);
        let k = 3 * (y as usize * picture.width_px + x as usize);
        [picture.pixels[k], picture.pixels[k + 1], picture.pixels[k + 2]]
    }

    #[test]
    fn colours_stand_where_the_deviations_are() {
        let dome = example::dome(40);
        let (points, deviations) = example::dome_cloud(40_000, |p| if p.x > 0.0 { 0.5 } else { -0.5 });
        let spacing_mm = example::dome_spacing(points.len());
        let picture =
            draw(&MapInput { face: &dome, points: &points, deviations_mm: &deviations, spacing_mm }, &style()).unwrap();
        assert!(picture.width_px <= 400 && picture.height_px <= 300);
        assert_eq!(picture.pixels.len(), picture.width_px * picture.height_px * 3);
        // Shade may take 12 % of the light, the lines' smoothing nothing: compare the hue's order of channels.
        let left = pixel(&picture, &example::dome_point(-60.0, 25.0));
        let right = pixel(&picture, &example::dome_point(60.0, 25.0));
        assert!(left[2] > left[1] && left[1] > left[0], "{left:?}");
        assert!(right[0] > right[1] && right[1] > right[2], "{right:?}");
        // The hole in the dome's middle and the corner of the picture are paper.
        assert_eq!(pixel(&picture, &Point3::new(0.0, 0.0, 20.0)), [255; 3]);
        assert_eq!(picture.pixels[..3], [255; 3]);
    }

    #[test]
    fn a_place_without_points_is_hatched() {
        let dome = example::dome(40);
        let (points, deviations) = example::dome_cloud(40_000, |_| 0.0);
        let (points, deviations): (Vec<_>, Vec<_>) =
            points.into_iter().zip(deviations).filter(|(p, _)| (p.x - 60.0).hypot(p.y) > 15.0).unzip();
        let spacing_mm = example::dome_spacing(40_000);
        let picture =
            draw(&MapInput { face: &dome, points: &points, deviations_mm: &deviations, spacing_mm }, &style()).unwrap();
        let hatch = pixel(&picture, &example::dome_point(60.0, 0.0));
        assert!(hatch[2] > hatch[0], "bluish grey, not the scale's warm grey: {hatch:?}");
        let map = pixel(&picture, &example::dome_point(-60.0, 0.0));
        assert!(map[0] > map[2], "{map:?}");
    }

    #[test]
    fn the_same_pixels_with_any_number_of_threads() {
        let dome = example::dome(30);
        let (points, deviations) = example::dome_cloud(20_000, |p| 0.01 * p.x);
        let render = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let input = MapInput { face: &dome, points: &points, deviations_mm: &deviations, spacing_mm: 1.0 };
            pool.install(|| draw(&input, &style()).unwrap().pixels)
        };
        assert!(render(1) == render(3));
    }

    #[test]
    fn nothing_to_draw_is_no_picture() {
        let empty = Mesh::default();
        let input = MapInput { face: &empty, points: &[], deviations_mm: &[], spacing_mm: 1.0 };
        assert!(draw(&input, &style()).is_none());
        let dome = example::dome(8);
        let input = MapInput { face: &dome, points: &[], deviations_mm: &[], spacing_mm: 1.0 };
        assert!(draw(&input, &style()).is_some());
    }
}
