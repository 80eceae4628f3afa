//! From surface and field to pixels: colour times shade, hatch, lines, outline, white around it.

use super::field::{Field, convolve};
use super::surface::{SHADES, SUPERSAMPLING, Sample, Surface};
use crate::report::palette::{Palette, Rgb};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;

/// How the picture is coloured.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    /// The scale runs from minus to plus this value, mm.
    pub range_mm: f64,
    /// Its colours.
    pub palette: Palette,
    /// Pixels a millimetre of the part.
    pub px_per_mm: f64,
    /// Width of the outline in pixels.
    pub line_px: usize,
}

/// The sheet's other side, and its outline.
const REVERSE: [f64; 3] = [166.0, 173.0, 181.0];
const OUTLINE: [f64; 3] = [57.0, 66.0, 77.0];
const HATCH_LIGHT: [f64; 3] = [204.0, 209.0, 217.0];
const HATCH_DARK: [f64; 3] = [133.0, 143.0, 156.0];

/// Steps of the scale from its end to zero: fine enough not to be seen, coarse enough for the picture to compress well.
const COLOUR_STEPS: f64 = 96.0;

/// A turn of the normal within a millimetre that is a bend: four degrees, a radius of 14 mm. Crowns are flatter.
const BEND: f32 = 0.07;

/// Lines that reach less far than this are left out, mm: they go round a single stray value, or are pieces of noise.
const LEAST_LEVEL_MM: f64 = 10.0;
const LEAST_BEND_MM: f64 = 5.0;

/// A jump in depth between neighbouring pixels that is drawn as an outline, mm.
const JUMP_MM: f32 = 3.0;

/// Pixels as RGB, row by row from the top.
pub fn compose(surface: &Surface, field: &Field, style: &Style, run: &RunContext) -> Result<Vec<u8>, Cancelled> {
    let (width, height) = (field.width, field.height);
    let seen = Seen::of(surface, width, height);
    let lines = without_specks(level_lines(field, &seen, style), width, LEAST_LEVEL_MM * style.px_per_mm);
    run.check()?;
    let bends = without_specks(seen.bend_lines(style.px_per_mm), width, LEAST_BEND_MM * style.px_per_mm);
    run.check()?;
    let colours: Vec<Rgb> =
        (0..=2 * COLOUR_STEPS as usize).map(|k| style.palette.colour(k as f64 / COLOUR_STEPS - 1.0)).collect();
    let mut pixels = vec![255u8; width * height * 3];
    pixels.par_chunks_mut(3 * width.max(1)).enumerate().for_each(|(y, row)| {
        for x in 0..width {
            if seen.part[y * width + x] == 0 {
                continue;
            }
            let base = base_colour(field.values[y * width + x], x, y, style, &colours);
            let mut sum = [0.0f64; 3];
            for k in 0..SUPERSAMPLING * SUPERSAMPLING {
                let colour = sample_colour(sample(surface, x, y, k), &base);
                (0..3).for_each(|c| sum[c] += colour[c]);
            }
            let mut colour = sum.map(|s| s / (SUPERSAMPLING * SUPERSAMPLING) as f64);
            if seen.is_outline(x, y, style.line_px) {
                colour = OUTLINE;
            } else if lines[y * width + x] {
                colour = colour.map(|c| 0.72 * c);
            } else if bends[y * width + x] {
                colour = colour.map(|c| 0.86 * c);
            }
            (0..3).for_each(|c| row[3 * x + c] = (colour[c] + 0.5) as u8);
        }
    });
    Ok(pixels)
}

fn sample(surface: &Surface, x: usize, y: usize, k: usize) -> &Sample {
    let (sx, sy) = (SUPERSAMPLING * x + k % SUPERSAMPLING, SUPERSAMPLING * y + k / SUPERSAMPLING);
    &surface.samples[sy * surface.width + sx]
}

fn sample_colour(sample: &Sample, base: &[f64; 3]) -> [f64; 3] {
    if !sample.is_part() {
        return [255.0; 3];
    }
    // Between 0.88 and 1.00, so that picture and legend agree.
    let light = 0.88 + 0.12 * f64::from(sample.shade) / f64::from(SHADES);
    if sample.reverse { REVERSE.map(|c| c * light) } else { base.map(|c| c * light) }
}

/// The map's colour, or the hatch where nothing was measured.
fn base_colour(value_mm: f32, x: usize, y: usize, style: &Style, colours: &[Rgb]) -> [f64; 3] {
    if value_mm.is_nan() {
        let period = 6 * style.line_px;
        return if (x + y) % period < period / 2 { HATCH_DARK } else { HATCH_LIGHT };
    }
    let t = (f64::from(value_mm) / style.range_mm).clamp(-1.0, 1.0);
    colours[((t + 1.0) * COLOUR_STEPS + 0.5) as usize].map(f64::from)
}

/// What each pixel shows: how many of its samples are part, and the depth of its nearest one.
struct Seen {
    width: usize,
    height: usize,
    part: Vec<u8>,
    depth_mm: Vec<f32>,
    /// The normal of the middle sample to the right and up.
    tilt: Vec<[f32; 2]>,
}

impl Seen {
    fn of(surface: &Surface, width: usize, height: usize) -> Seen {
        let all = 0..SUPERSAMPLING * SUPERSAMPLING;
        let at = |p: usize| all.clone().map(move |k| sample(surface, p % width, p / width, k));
        let part = (0..width * height).into_par_iter().map(|p| at(p).filter(|s| s.is_part()).count() as u8).collect();
        let depth_mm = (0..width * height)
            .into_par_iter()
            .map(|p| at(p).map(|s| s.depth_mm).fold(f32::NEG_INFINITY, f32::max))
            .collect();
        let tilt = (0..width * height)
            .into_par_iter()
            .map(|p| sample(surface, p % width, p / width, 0).tilt.map(|t| f32::from(t) / 127.0))
            .collect();
        Seen { width, height, part, depth_mm, tilt }
    }

    fn inside(&self, x: usize, y: usize) -> bool {
        2 * usize::from(self.part[y * self.width + x]) >= SUPERSAMPLING * SUPERSAMPLING
    }

    /// Whether the part ends within `reach` pixels of this one, or falls away to a deeper fold.
    fn is_outline(&self, x: usize, y: usize, reach: usize) -> bool {
        if !self.inside(x, y) {
            return false;
        }
        let depth = self.depth_mm[y * self.width + x];
        let ends = |x: Option<usize>, y: Option<usize>| match (x, y) {
            (Some(x), Some(y)) if x < self.width && y < self.height => {
                !self.inside(x, y) || self.depth_mm[y * self.width + x] < depth - JUMP_MM
            }
            _ => true,
        };
        (1..=reach).any(|r| {
            ends(x.checked_sub(r), Some(y))
                || ends(Some(x + r), Some(y))
                || ends(Some(x), y.checked_sub(r))
                || ends(Some(x), Some(y + r))
        })
    }
}

impl Seen {
    /// Thin lines where bends begin and end: around the places at which the normal turns by more than `BEND` within a
    /// millimetre.
    fn bend_lines(&self, px_per_mm: f64) -> Vec<bool> {
        let (width, height) = (self.width, self.height);
        let reach = (px_per_mm.round() as usize).max(1);
        let bent: Vec<bool> = (0..width * height)
            .into_par_iter()
            .map(|p| {
                let (x, y) = (p % width, p / width);
                let turn = |from: usize, to: usize| {
                    let known = self.part[from] > 0 && self.part[to] > 0;
                    let same_fold = (self.depth_mm[from] - self.depth_mm[to]).abs() < JUMP_MM;
                    let (a, b) = (self.tilt[from], self.tilt[to]);
                    if known && same_fold { (a[0] - b[0]).hypot(a[1] - b[1]) } else { 0.0 }
                };
                let half = reach.div_ceil(2);
                let (left, right) = (x.saturating_sub(half), (x + half).min(width - 1));
                let (up, down) = (y.saturating_sub(half), (y + half).min(height - 1));
                self.part[p] > 0
                    && (turn(y * width + left, y * width + right) > BEND
                        || turn(up * width + x, down * width + x) > BEND)
            })
            .collect();
        (0..width * height)
            .into_par_iter()
            .map(|p| {
                let (x, y) = (p % width, p / width);
                bent[p] && !(x > 0 && x + 1 < width && y > 0 && y + 1 < height)
                    || bent[p] && !(bent[p - 1] && bent[p + 1] && bent[p - width] && bent[p + width])
            })
            .collect()
    }
}

/// The lines without those (connected over sides and corners) whose frame's longer side is shorter than `least_px`.
fn without_specks(mut lines: Vec<bool>, width: usize, least_px: f64) -> Vec<bool> {
    let height = lines.len() / width.max(1);
    let mut seen = vec![false; lines.len()];
    let mut line = Vec::new();
    for start in 0..lines.len() {
        if !lines[start] || seen[start] {
            continue;
        }
        seen[start] = true;
        line.clear();
        line.push(start);
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        let mut next = 0;
        while next < line.len() {
            let at = [line[next] % width, line[next] / width];
            next += 1;
            for k in 0..2 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
            for y in at[1].saturating_sub(1)..=(at[1] + 1).min(height - 1) {
                for x in at[0].saturating_sub(1)..=(at[0] + 1).min(width - 1) {
                    let p = y * width + x;
                    if lines[p] && !seen[p] {
                        seen[p] = true;
                        line.push(p);
                    }
                }
            }
        }
        let reach = (high[0] - low[0]).max(high[1] - low[1]);
        if (reach as f64) < least_px {
            line.iter().for_each(|&p| lines[p] = false);
        }
    }
    lines
}

/// Lines of equal deviation, every quarter of the range. The field is smoothed for them (they show form, not noise), and
/// there is no line where the deviation hardly changes: it would only be noise crossing the level.
fn level_lines(field: &Field, seen: &Seen, style: &Style) -> Vec<bool> {
    let (width, height) = (field.width, field.height);
    let known: Vec<f32> = field.values.iter().map(|v| if v.is_nan() { 0.0 } else { 1.0 }).collect();
    let values: Vec<f32> = field.values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect();
    let sigma = (2.0 * style.px_per_mm).clamp(1.0, 18.0);
    let kernel: Vec<f32> =
        (0..=(2.0 * sigma) as usize).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp() as f32).collect();
    let sums = convolve(&values, width, height, &kernel);
    let weights = convolve(&known, width, height, &kernel);
    let step = (0.25 * style.range_mm) as f32;
    // A line stands for a change of one step within 30 mm or less, seen over a distance at which the noise left by the
    // smoothing has no slope to speak of.
    let least_change = step / (30.0 * style.px_per_mm) as f32;
    let base = (3.0 * sigma) as usize;
    let smooth: Vec<f32> = (0..width * height)
        .into_par_iter()
        .map(|p| if known[p] > 0.0 { sums[p] / weights[p] } else { f32::NAN })
        .collect();
    let level = |v: f32| (v / step).clamp(-4.0, 3.0).floor();
    (0..width * height)
        .into_par_iter()
        .map(|p| {
            let (x, y) = (p % width, p / width);
            if x + 1 >= width || y + 1 >= height {
                return false;
            }
            // Where a value is unknown, every comparison with it is false.
            let here = smooth[p];
            let crosses = |q: usize| {
                let same_fold = (seen.depth_mm[p] - seen.depth_mm[q]).abs() < JUMP_MM;
                same_fold && (level(here) - level(smooth[q])).abs() > 0.5
            };
            if !(crosses(p + 1) || crosses(p + width)) {
                return false;
            }
            let change = |q: usize| (smooth[q] - here).abs();
            let (right, down) = (base.min(width - 1 - x), base.min(height - 1 - y));
            let (left, up) = (base.min(x), base.min(y));
            let slope = |q: usize, distance: usize| change(q) / distance.max(1) as f32;
            [slope(p + right, right), slope(p - left, left), slope(p + down * width, down), slope(p - up * width, up)]
                .iter()
                .any(|&slope| slope >= least_change)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_lines_that_reach_far_enough_stay() {
        // Twelve pixels aslant in row-wise order, and a square ring of three.
        let mut lines = vec![false; 20 * 16];
        (0..12).for_each(|k| lines[(k + 1) * 20 + k] = true);
        let long = lines.clone();
        [15, 16, 17, 35, 37, 55, 56, 57].into_iter().for_each(|p| lines[p] = true);
        assert!(without_specks(lines.clone(), 20, 5.0) == long);
        assert!(without_specks(lines.clone(), 20, 2.0) == lines);
        assert!(without_specks(Vec::new(), 0, 2.0).is_empty());
    }
}
