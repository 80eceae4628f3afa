//! Points around an outline whose place is known: for the tests of the estimators.

use super::normal::distribution;
use super::outline::{MAX_SHAPE, Outline};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// How the points of a trial lie. Lengths in mm.
#[derive(Clone, Copy)]
pub struct Pattern {
    pub spacing: f64,
    /// A turned, shifted lattice, each point off its place by 0.15 spacings (1 sigma); else points anywhere.
    pub lattice: bool,
    /// Share of points left out.
    pub dropout: f64,
    /// Density changes by that share from end to end of the square.
    pub gradient: f64,
    /// In-plane noise, 1 sigma.
    pub noise: f64,
    /// Random shifts that neighbours have in common, 1 sigma, over a length of 0.5.
    pub common_noise: f64,
    /// Points seen in error where there is no material, number in the circle of the outline's inner reach.
    pub clutter: usize,
    /// Round voids anywhere in the square: number and radius.
    pub voids: (usize, f64),
    /// A sector of 45 degrees about the origin without points.
    pub sector_missing: bool,
    /// The material seems to end that far inside its edge.
    pub erosion: f64,
}

pub const CLEAN: Pattern = Pattern {
    spacing: 0.168,
    lattice: true,
    dropout: 0.0,
    gradient: 0.0,
    noise: 0.0,
    common_noise: 0.0,
    clutter: 0,
    voids: (0, 0.0),
    sector_missing: false,
    erosion: 0.0,
};

/// A standard normal number (Box and Muller).
pub fn gauss(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * rng.random_range(1e-300_f64..1.0).ln()).sqrt();
    radius * (TAU * rng.random_range(0.0_f64..1.0)).cos()
}

/// A field of shifts that neighbours have in common: sums of 40 waves, `exp(-r² / 2 l²)` with l = 0.5 mm.
struct CommonNoise(Vec<[f64; 4]>, f64);

impl CommonNoise {
    fn new(sigma: f64, rng: &mut ChaCha8Rng) -> Self {
        const WAVES: usize = 40;
        const LENGTH: f64 = 0.5;
        let wave = |rng: &mut ChaCha8Rng| {
            let [a, b] = [gauss(rng) / LENGTH, gauss(rng) / LENGTH];
            [a, b, rng.random_range(0.0..TAU), rng.random_range(0.0..TAU)]
        };
        Self((0..WAVES).map(|_| wave(rng)).collect(), sigma * (2.0 / WAVES as f64).sqrt())
    }

    fn at(&self, p: [f64; 2]) -> [f64; 2] {
        let sum = |phase: usize| self.0.iter().map(|w| (w[0] * p[0] + w[1] * p[1] + w[phase]).cos()).sum::<f64>();
        [self.1 * sum(2), self.1 * sum(3)]
    }
}

/// Points of the material in the square |u|, |v| < reach, kept with probability Phi(s / 0.03 mm).
pub fn scatter<O: Outline>(outline: &O, reach: f64, pattern: &Pattern, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let square = |rng: &mut ChaCha8Rng| [rng.random_range(-reach..reach), rng.random_range(-reach..reach)];
    let voids: Vec<[f64; 2]> = (0..pattern.voids.0).map(|_| square(rng)).collect();
    let missing_from: f64 = rng.random_range(0.0..TAU);
    let field = (pattern.common_noise > 0.0).then(|| CommonNoise::new(pattern.common_noise, rng));
    let seen = |p: [f64; 2], rng: &mut ChaCha8Rng| {
        let s = outline.signed_mm(p, &mut [0.0; MAX_SHAPE]) - pattern.erosion;
        let density = (1.0 + pattern.gradient * p[0] / reach) / (1.0 + pattern.gradient);
        let in_void = voids.iter().any(|c| (p[0] - c[0]).hypot(p[1] - c[1]) < pattern.voids.1);
        let in_sector = pattern.sector_missing && (p[1].atan2(p[0]) - missing_from).rem_euclid(TAU) < TAU / 8.0;
        let chance = distribution(s / 0.03) * (1.0 - pattern.dropout) * density;
        !in_void && !in_sector && rng.random_range(0.0..1.0) < chance
    };
    let mut points = Vec::new();
    for p in places(1.5 * reach, pattern, rng) {
        if p[0].abs() < reach + 1.0 && p[1].abs() < reach + 1.0 && seen(p, rng) {
            let [du, dv] = field.as_ref().map_or([0.0; 2], |f| f.at(p));
            let q = [p[0] + du + pattern.noise * gauss(rng), p[1] + dv + pattern.noise * gauss(rng)];
            if q[0].abs() < reach && q[1].abs() < reach {
                points.push(q);
            }
        }
    }
    for _ in 0..pattern.clutter {
        let (rho, phi) = (4.0 * rng.random_range(0.0_f64..1.0).sqrt(), rng.random_range(0.0..TAU));
        points.push([rho * phi.cos(), rho * phi.sin()]);
    }
    points
}

/// Places in a square, at the pattern's mean density.
fn places(half: f64, pattern: &Pattern, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let h = pattern.spacing;
    let steps = (2.0 * half / h) as i64;
    let turn: f64 = rng.random_range(0.0..TAU);
    let shift = [rng.random_range(0.0..h), rng.random_range(0.0..h)];
    let (sin, cos) = turn.sin_cos();
    let place = |i: i64, rng: &mut ChaCha8Rng| {
        if !pattern.lattice {
            return [rng.random_range(-half..half), rng.random_range(-half..half)];
        }
        let (a, b) = ((i / steps) as f64 * h - half + shift[0], (i % steps) as f64 * h - half + shift[1]);
        let jitter = 0.15 * h;
        [a * cos - b * sin + jitter * gauss(rng), a * sin + b * cos + jitter * gauss(rng)]
    };
    (0..steps * steps).map(|i| place(i, rng)).collect()
}
