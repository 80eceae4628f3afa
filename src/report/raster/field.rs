//! Deviations of the cloud as a field over the picture: the mean in each pixel, small gaps filled from around.

use super::surface::{SUPERSAMPLING, Surface};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};

/// A point of the cloud in the picture.
#[derive(Debug, Clone, Copy)]
pub struct Dot {
    /// Pixels from the left.
    pub x: f64,
    /// Pixels from the top.
    pub y: f64,
    /// Towards the eye, mm.
    pub depth_mm: f64,
    /// Its deviation, mm.
    pub deviation_mm: f32,
}

/// A value for each pixel, NaN where no point is near.
pub struct Field {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// mm.
    pub values: Vec<f32>,
}

/// A dot deeper than this behind (or before) the surface at its pixel belongs to another fold of the sheet, mm; its own
/// deviation comes on top.
const DEPTH_MM: f64 = 3.0;

/// Gaps up to this many point spacings are filled. In a Poisson cloud of spacing s no point lies within 2.5 s of a place
/// once in exp(-π 2.5²) = 3e-9 places, so what stays empty was not measured.
const REACH: f64 = 2.5;

/// Standard deviation of the fill's weights in point spacings: the values of the nearest few points count.
const SIGMA: f64 = 0.7;

/// Dots spread by one task.
const CHUNK: usize = 1 << 15;

/// Spreads so many dots, told by their number, over the pixels in which their surface is seen. `spacing_px` is the distance between
/// neighbouring points in pixels.
pub fn splat(
    count: usize,
    dot: impl Fn(usize) -> Dot + Sync,
    surface: &Surface,
    spacing_px: f64,
    run: &RunContext,
) -> Result<Field, Cancelled> {
    let (width, height) = (surface.width / SUPERSAMPLING, surface.height / SUPERSAMPLING);
    // Sums of whole nanometres do not depend on the order of the points.
    let sums: Vec<AtomicI64> = (0..width * height).map(|_| AtomicI64::new(0)).collect();
    let counts: Vec<AtomicU32> = (0..width * height).map(|_| AtomicU32::new(0)).collect();
    let spread = |dot: Dot| {
        if !(dot.x >= 0.0 && dot.y >= 0.0 && dot.x < width as f64 && dot.y < height as f64) {
            return;
        }
        let (x, y) = (dot.x as usize, dot.y as usize);
        let reach = (DEPTH_MM + 1.5 * f64::from(dot.deviation_mm).abs()) as f32;
        let visible = (0..SUPERSAMPLING * SUPERSAMPLING).any(|k| {
            let (sx, sy) = (SUPERSAMPLING * x + k % SUPERSAMPLING, SUPERSAMPLING * y + k / SUPERSAMPLING);
            (surface.samples[sy * surface.width + sx].depth_mm - dot.depth_mm as f32).abs() <= reach
        });
        if visible && dot.deviation_mm.is_finite() {
            sums[y * width + x].fetch_add((f64::from(dot.deviation_mm) * 1e6).round() as i64, Ordering::Relaxed);
            counts[y * width + x].fetch_add(1, Ordering::Relaxed);
        }
    };
    (0..count.div_ceil(CHUNK)).into_par_iter().try_for_each(|chunk| {
        run.check()?;
        (chunk * CHUNK..count.min((chunk + 1) * CHUNK)).for_each(|k| spread(dot(k)));
        Ok(())
    })?;
    let sums: Vec<f32> = sums.into_iter().map(|s| (s.into_inner() as f64 * 1e-6) as f32).collect();
    let counts: Vec<f32> = counts.into_iter().map(|n| n.into_inner() as f32).collect();
    let values = normalised_fill(&sums, &counts, width, height, spacing_px);
    Ok(Field { width, height, values })
}

/// Weighted mean over the neighbourhood of each pixel; NaN where it holds no point.
fn normalised_fill(sums: &[f32], counts: &[f32], width: usize, height: usize, spacing_px: f64) -> Vec<f32> {
    // Less than a pixel between points: nothing to fill but single pixels.
    let spacing = spacing_px.clamp(0.6, 60.0);
    let reach = (REACH * spacing).ceil() as usize;
    let sigma = SIGMA * spacing;
    let kernel: Vec<f32> = (0..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp() as f32).collect();
    let sums = convolve(sums, width, height, &kernel);
    let weights = convolve(counts, width, height, &kernel);
    sums.par_iter().zip(&weights).map(|(&s, &w)| if w > 0.0 { s / w } else { f32::NAN }).collect()
}

/// Convolution with a symmetric kernel (its half from the centre on) along rows, then along columns.
pub fn convolve(image: &[f32], width: usize, height: usize, kernel: &[f32]) -> Vec<f32> {
    let mut across = vec![0.0f32; image.len()];
    let width_of_rows = width.max(1);
    across.par_chunks_mut(width_of_rows).zip(image.par_chunks(width_of_rows)).for_each(|(out, row)| {
        if row.iter().all(|&v| v == 0.0) {
            return;
        }
        let n = row.len();
        let reach = kernel.len() - 1;
        let mut padded = vec![0.0f32; n + 2 * reach];
        padded[reach..reach + n].copy_from_slice(row);
        for (k, &weight) in kernel.iter().enumerate() {
            let left = &padded[reach - k..reach - k + n];
            let right = &padded[reach + k..reach + k + n];
            if k == 0 {
                out.iter_mut().zip(left).for_each(|(o, &v)| *o += weight * v);
            } else {
                out.iter_mut().zip(left).zip(right).for_each(|((o, &l), &r)| *o += weight * (l + r));
            }
        }
    });
    let mut result = vec![0.0f32; image.len()];
    result.par_chunks_mut(width_of_rows).enumerate().for_each(|(y, out)| {
        for (k, &weight) in kernel.iter().enumerate() {
            let rows = [y.checked_sub(k), (k > 0 && y + k < height).then_some(y + k)];
            for row in rows.into_iter().flatten() {
                let source = &across[row * width..(row + 1) * width];
                out.iter_mut().zip(source).for_each(|(o, &v)| *o += weight * v);
            }
        }
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::raster::surface::Sample;

    fn flat(width: usize, height: usize) -> Surface {
        let sample = Sample { depth_mm: 0.0, shade: 8, tilt: [0; 2], reverse: false };
        let (width, height) = (width * SUPERSAMPLING, height * SUPERSAMPLING);
        Surface { width, height, samples: vec![sample; width * height] }
    }

    fn dot(x: f64, y: f64, depth_mm: f64, deviation_mm: f32) -> Dot {
        Dot { x, y, depth_mm, deviation_mm }
    }

    fn spread(dots: &[Dot], surface: &Surface, spacing_px: f64) -> Field {
        splat(dots.len(), |k| dots[k], surface, spacing_px, &RunContext::silent()).unwrap()
    }

    #[test]
    fn a_constant_stays_constant_and_far_places_stay_empty() {
        let dots = (0..20).flat_map(|i| (0..20).map(move |j| dot(3.0 * f64::from(i), 3.0 * f64::from(j), 0.0, 0.25)));
        let field = spread(&dots.collect::<Vec<Dot>>(), &flat(100, 60), 3.0);
        for y in 0..58 {
            for x in 0..58 {
                assert!((field.values[y * 100 + x] - 0.25).abs() < 1e-5, "{x} {y}");
            }
            // Last dot at 57, reach 8 pixels.
            assert!(field.values[y * 100 + 66].is_nan());
        }
    }

    #[test]
    fn a_hidden_fold_does_not_show_through() {
        let dots = [
            dot(5.5, 5.5, 0.0, 0.1),
            dot(5.5, 5.5, -12.0, 2.0),
            dot(-1.0, 5.0, 0.0, 9.0),
            dot(f64::NAN, 5.0, 0.0, 9.0),
        ];
        let field = spread(&dots, &flat(10, 10), 1.0);
        assert!((field.values[55] - 0.1).abs() < 1e-5);
    }

    #[test]
    fn the_order_of_points_does_not_matter() {
        let dots: Vec<Dot> = (0..500)
            .map(|k| dot(f64::from(k * 7 % 40), f64::from(k * 11 % 30), 0.0, (k as f32 * 0.37).sin()))
            .collect();
        let a = spread(&dots, &flat(40, 30), 1.5);
        let b = spread(&dots.iter().rev().copied().collect::<Vec<Dot>>(), &flat(40, 30), 1.5);
        assert!(a.values.iter().zip(&b.values).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
