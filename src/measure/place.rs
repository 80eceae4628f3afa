//! What was measured at the place itself, whatever its height. The window around it may be full of good sheet while the place is
//! a hole, a pit or a bump: the many around it must not answer for it.
//!
//! Two looks. Is there a gap: an empty disc, around the place or with the place half-way to its rim, or a crack through it? And do the points nearest to the place,
//! five of them and then more, lie on the surface that was fitted to all: is their median off it by more than chance?

use super::card::Card;
use super::frame::FeatureFrame;
use super::sight::is_of_another_wall;
use super::thin::is_taken;
use super::{Local, NotFound};
use crate::fit::robust::{SIGMA_OF_MAD, median};

/// The points at the place.
pub struct Place {
    /// (u, v, w) of every point, also of those too far off to be looked at by the fit; the nearest to the line first.
    points: Vec<[f64; 3]>,
    /// Distance from the line within which the place itself is.
    reach_mm: f64,
    /// Typical spacing of the scan's points.
    spacing_mm: f64,
}

/// The place itself reaches three spacings, and 1 mm at least; half the window at most, and one and a half spacings at least.
const PLACE_SPACINGS: f64 = 3.0;
const PLACE_MM: f64 = 1.0;
const PLACE_SHARE: f64 = 0.5;
const PLACE_LEAST_SPACINGS: f64 = 1.5;
/// Points that must stand there: a quarter of what the scan's density promises (a face that leans by 60 degrees gets half
/// of it, and noise takes some), and this many.
const PLACE_NEEDED: usize = 4;
const PLACE_FILLED: f64 = 0.25;
/// How far beyond the search points at the place still speak against the surface around it, mm.
const PLACE_BEYOND_MM: f64 = 4.0;

/// Radius of the disc around the place that must not be empty, in spacings, and the points that must stand in it. Of points
/// strewn at random 12.6 do; fewer than two in five of 100,000 cases.
const GAP_SPACINGS: f64 = 2.0;
const GAP_NEEDED: usize = 2;
/// The same for discs with the place half-way to their rim, in each of some directions: 19.6 and 12.6 points, and fewer than
/// these in one of 100,000 cases.
const WIDE_GAPS: [(f64, usize); 2] = [(2.5, 3), (2.0, 1)];
const WIDE_GAP_DIRECTIONS: u32 = 12;
/// The same for cracks: strips through the place, this wide and long in spacings, in each of some directions of half a turn. 16 points, and
/// fewer than three in one of 60,000 cases.
const CRACK_SPACINGS: [f64; 2] = [2.0, 8.0];
const CRACK_NEEDED: usize = 3;
const CRACK_DIRECTIONS: u32 = 18;
/// Points are told to be sparse by those within this many spacings: a gap at the place is the smaller part of that disc.
const ABOUT_SPACINGS: f64 = 10.0;
/// Points that are sparser than the scan's by more than this are gaps themselves.
const SPARSEST: f64 = 1.6;

/// Numbers of nearest points of which the median is looked at, besides that of all.
const NEAREST: [usize; 3] = [5, 12, 28];
/// Medians may be off by this many of their standard deviations. Less than one of 10,000 good places is.
const MOST_SIGMAS: f64 = 4.5;
/// From this many on what they are off is told as uncertainty.
const TOLD_SIGMAS: f64 = 2.0;
/// Share of the noise's variance that neighbours are taken to have in common.
const COMMON: f64 = 0.15;
/// Least noise that is assumed, mm: facets and the quadratic that stands for them are off by that much.
const LEAST_NOISE_MM: f64 = 0.05;
/// Share of all points at the place that must lie within this many standard deviations of the noise.
const PLACE_AGREES: f64 = 0.6;
const PLACE_SIGMAS: f64 = 3.5;

impl Place {
    /// Looks at the place itself, within a window of that radius.
    ///
    /// # Errors
    /// Next to nothing stands there.
    pub fn gather(
        local: &Local,
        frame: &FeatureFrame,
        window_mm: f64,
        search_mm: f64,
        card: &mut Card,
    ) -> Result<Self, NotFound> {
        let h = local.scan.spacing_mm;
        let wanted_mm = (PLACE_SPACINGS * h).max(PLACE_MM);
        let reach_mm = wanted_mm.min(PLACE_SHARE * window_mm).max(PLACE_LEAST_SPACINGS * h);
        let mut points = frame.gather(local, [0.0, 0.0], reach_mm.max(ABOUT_SPACINGS * h), search_mm + PLACE_BEYOND_MM);
        let distance = |p: &[f64; 3]| p[0].hypot(p[1]);
        // Heights are told from the place, not from the face: that may rise by twice the distance.
        points.retain(|p| !is_of_another_wall(local, frame, p, p[2], 2.0 * distance(p)));
        points.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let found = points.partition_point(|p| distance(p) <= reach_mm);
        let expected = std::f64::consts::PI * (reach_mm / h).powi(2);
        let needed = ((PLACE_FILLED * expected) as usize).max(PLACE_NEEDED);
        if !card.at_least("points at the place itself", "", found as f64, needed as f64) {
            return Err(too_few(found, reach_mm, needed));
        }
        Ok(Self { points, reach_mm, spacing_mm: h })
    }

    /// Whether points stand all around the place. Their spacing is that within the window; where the CAD has no sheet there is no gap.
    pub fn check_gaps(
        &self,
        window_mm: f64,
        has_sheet: &dyn Fn([f64; 2]) -> bool,
        card: &mut Card,
    ) -> Result<(), NotFound> {
        let seen_mm = window_mm.min(self.reach_mm.max(ABOUT_SPACINGS * self.spacing_mm));
        let around = self.points.partition_point(|p| p[0].hypot(p[1]) <= seen_mm);
        let area = std::f64::consts::PI * seen_mm * seen_mm;
        let h = (area / around.max(1) as f64).sqrt().min(SPARSEST * self.spacing_mm);
        let radius = GAP_SPACINGS * h;
        let near = self.points.partition_point(|p| p[0].hypot(p[1]) <= radius);
        if !card.at_least("points within two spacings of the place", "", near as f64, GAP_NEEDED as f64) {
            return Err(too_few(near, radius, GAP_NEEDED));
        }
        let gap_mm = self.wide_gap_mm(h, has_sheet).or_else(|| self.crack_mm(h, has_sheet));
        card.at_most("width of a gap at the place", "mm", gap_mm.unwrap_or(0.0), 0.0);
        gap_mm.map_or(Ok(()), |mm| {
            Err(NotFound::new(format!("the points have a gap at the place itself, {mm:.1} mm wide"), around))
        })
    }

    /// Width of an empty disc with the place half-way to its rim, mm.
    fn wide_gap_mm(&self, h: f64, has_sheet: &dyn Fn([f64; 2]) -> bool) -> Option<f64> {
        let around_place = |radius: f64| (0..WIDE_GAP_DIRECTIONS).map(move |k| turned(radius, k, WIDE_GAP_DIRECTIONS));
        let found = WIDE_GAPS.into_iter().find(|(spacings, needed)| {
            let radius = spacings * h;
            let is_gap = |[u, v]: [f64; 2]| {
                let within = self.points.iter().filter(|p| (p[0] - u).hypot(p[1] - v) <= radius).count();
                within < *needed && around_place(radius).all(|[a, b]| has_sheet([u + a, v + b]))
            };
            around_place(0.5 * radius).any(is_gap)
        });
        found.map(|(spacings, _)| 2.0 * spacings * h)
    }

    /// Width of an empty strip through the place, mm.
    fn crack_mm(&self, h: f64, has_sheet: &dyn Fn([f64; 2]) -> bool) -> Option<f64> {
        let [half_width, half_length] = CRACK_SPACINGS.map(|spacings| 0.5 * spacings * h);
        let is_crack = |k: u32| {
            // Half a turn: a strip turned by the other half is the same.
            let [c, s] = turned(1.0, k, 2 * CRACK_DIRECTIONS);
            let within =
                |p: &&[f64; 3]| (p[0] * c + p[1] * s).abs() <= half_length && (p[1] * c - p[0] * s).abs() <= half_width;
            self.points.iter().filter(within).count() < CRACK_NEEDED
                && [-1.0, -0.5, 0.5, 1.0].into_iter().all(|t| has_sheet([t * half_length * c, t * half_length * s]))
        };
        (0..CRACK_DIRECTIONS).any(is_crack).then_some(2.0 * half_width)
    }

    /// Whether the surface as fitted is the one at the place: `off` tells what a point (u, v, w) stands off it, mm; `noise_mm` is that of the
    /// points around. Tells the standard uncertainty that the points at the place leave, mm: 0 where they lie on it.
    pub fn check_height(
        &self,
        off: &dyn Fn(&[f64; 3]) -> f64,
        noise_mm: f64,
        card: &mut Card,
    ) -> Result<f64, NotFound> {
        let at_place = self.points.iter().take_while(|p| p[0].hypot(p[1]) <= self.reach_mm);
        let off: Vec<f64> = at_place.map(off).collect();
        const STEP: &str = "step of the place against the surface around it";
        let (mut left_mm, mut most_sigmas) = (0.0_f64, 0.0_f64);
        for count in NEAREST.into_iter().filter(|n| *n < off.len()).chain([off.len()]) {
            let step_mm = median(&mut off[..count].to_vec()).unwrap_or(0.0);
            let near = off[..count].iter().filter(|r| r.abs() <= PLACE_SIGMAS * noise_mm).count();
            let agrees = near as f64 / count as f64;
            let scattered = count == off.len()
                && !card.at_least(
                    "share of the points at the place that lie on that surface",
                    "",
                    agrees,
                    PLACE_AGREES,
                );
            // The variance of a median is pi / 2 that of the mean.
            let sd_mm = noise_mm * (std::f64::consts::FRAC_PI_2 / count as f64 + COMMON).sqrt();
            most_sigmas = f64::max(most_sigmas, step_mm.abs() / sd_mm);
            let on_it = card.at_most(STEP, "standard deviations", most_sigmas, MOST_SIGMAS);
            // A step that is no number is refused, too.
            if scattered || step_mm.is_nan() || !on_it {
                let reason = format!("the points at the place itself stand {step_mm:+.2} mm off those around it");
                return Err(NotFound::new(reason, off.len()));
            }
            left_mm = left_mm.max(step_mm.abs() - TOLD_SIGMAS * sd_mm);
        }
        Ok(left_mm)
    }
}

/// A place that far away, in the k-th of so many directions.
fn turned(radius: f64, k: u32, directions: u32) -> [f64; 2] {
    let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(directions)).sin_cos();
    [radius * cos, radius * sin]
}

fn too_few(found: usize, reach_mm: f64, needed: usize) -> NotFound {
    let stand = if found == 1 { "point stands" } else { "points stand" };
    NotFound::new(format!("{found} {stand} at the place itself, within {reach_mm:.1} mm, {needed} are needed"), found)
}

/// Standard deviation of the points' own noise, from the differences between nearest neighbours: whatever shape the surface
/// has, and however many surfaces there are, neighbours lie on the same one. [`LEAST_NOISE_MM`] at least.
pub fn noise_mm(points: &[[f64; 3]]) -> f64 {
    const ASKED: usize = 150;
    const AMONG: f64 = 600.0;
    // The middle of a large window is enough, and neighbours are all there.
    let distance_sq = |p: &[f64; 3]| p[0] * p[0] + p[1] * p[1];
    let reach_sq = points.iter().map(distance_sq).fold(0.0, f64::max) * (AMONG / points.len().max(1) as f64).min(1.0);
    let points: Vec<[f64; 3]> = points.iter().filter(|p| distance_sq(p) <= reach_sq).copied().collect();
    let nearest = |i: usize| {
        let to = |q: &[f64; 3]| (q[0] - points[i][0]).powi(2) + (q[1] - points[i][1]).powi(2);
        let others = points[..i].iter().chain(&points[i + 1..]);
        others.min_by(|a, b| to(a).total_cmp(&to(b)))
    };
    let stride = points.len().div_ceil(ASKED).max(1);
    let taken = (0..points.len()).filter(|&i| is_taken(points[i][0], points[i][1], stride));
    let differences = taken.filter_map(|i| Some((points[i][2] - nearest(i)?[2]).abs()));
    let mut differences: Vec<f64> = differences.collect();
    let sigma = SIGMA_OF_MAD * median(&mut differences).unwrap_or(0.0) * std::f64::consts::FRAC_1_SQRT_2;
    sigma.max(LEAST_NOISE_MM)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_told_beside_a_step_and_on_a_slope() {
        // Alternating rows of a lattice of 0.1 mm: neighbours within a row are alike, so the noise goes by columns of two.
        let noise = [0.1, -0.1];
        for shape in [|_: f64| 0.0, |u: f64| if u > 0.7 { 2.0 } else { 0.0 }, |u: f64| 0.1 * u] {
            let points: Vec<[f64; 3]> = (0..400)
                .map(|i| {
                    let (u, v) = ((i % 20) as f64 * 0.1, (i / 20) as f64 * 0.2);
                    [u, v, shape(u) + noise[i % 2]]
                })
                .collect();
            // All differences are 0.2 mm, give or take the slope's 0.01: 1.4826 * 0.2 / sqrt(2).
            assert!((noise_mm(&points) - 0.2097).abs() < 0.0106, "{}", noise_mm(&points));
        }
        assert_eq!(noise_mm(&[]), LEAST_NOISE_MM);
        assert_eq!(noise_mm(&[[0.0; 3]]), LEAST_NOISE_MM);
    }
}
