//! Regions of a surface that differ from before.

use super::local::{Local, Sharp};
use crate::geometry::{Point3, Vector3};
use crate::stitch::cells::{Cells, TooManyCells};

/// A region grows around a certain difference to where differences are still so many standard uncertainties.
const GROWS_TO: f64 = 2.0;
/// So often may unworn surfaces show a region.
const FALSE_ALARMS: f64 = 0.01;
/// The largest of n independent normal numbers is about this times the root of 2 ln n (0.73 for 10, 0.79 for 100).
const OF_LARGEST: f64 = 0.76;
/// Half a depth of so many standard uncertainties by noise stands clear of it.
const CLEAR: f64 = 4.0;
/// Cylinders overlap: the largest of all means is that of many more independent ones than there are cylinders side by side. Half of 23 unworn pairs
/// of 92 cylinders have it beyond 3.7, which makes 35 times as many; scatters that some hundred points tell make tails longer.
const OVERLAP: f64 = 50.0;
/// Neighbours of one region lie within this share of the radius.
const LINK: f64 = 0.5;

/// A connected region where material is gone or was added.
#[derive(Debug, Clone, PartialEq)]
pub struct WornRegion {
    /// The area where the difference is at least half the extreme: blur moves no straight rim of that.
    pub area: f64,
    /// Standard uncertainty of the area: where half the extreme is, and how well a rim is seen.
    pub area_u: f64,
    /// The area where means over the largest radius differ by at least two standard uncertainties; blur makes it larger by up to a radius.
    pub area_told: f64,
    /// Mean difference over the area, signed as differences are: negative where material is gone.
    pub mean: f64,
    /// Standard uncertainty of the mean, with blur.
    pub mean_u: f64,
    /// The difference furthest from zero beyond its uncertainty.
    pub extreme: f64,
    /// Standard uncertainty of that one, with blur.
    pub extreme_u: f64,
    /// Radius that the extreme is a mean over.
    pub extreme_radius: f64,
    /// The region is narrower than two of these radii, or blur is the most of the extreme's uncertainty: it may be smaller and deeper than told.
    pub blurred: bool,
    /// Mean place of the points within the area, old cloud's frame.
    pub centre: Point3,
    /// Where the extreme is.
    pub extreme_at: Point3,
    /// Mean normal, towards the sensor.
    pub normal: Vector3,
    /// Size of the largest mean difference over the largest radius, in standard uncertainties.
    pub significance: f64,
    /// Its points, as indices of new points.
    pub points: Vec<u32>,
}

/// What regions are looked for in.
pub(super) struct Field<'a> {
    /// Old cloud's frame.
    pub positions: &'a [Point3],
    pub locals: &'a [Option<Local>],
    /// Of each difference over the whole radius: what noise, fit and (where they count) smooth errors make of it, and the last two alone.
    pub u: &'a [[f64; 2]],
    pub radius: f64,
}

impl Field<'_> {
    fn disc(&self) -> f64 {
        std::f64::consts::PI * self.radius * self.radius
    }

    fn local(&self, k: u32) -> &Local {
        self.locals[k as usize].as_ref().expect("members have a difference")
    }

    fn area_of(&self, k: u32) -> f64 {
        self.local(k).area
    }

    fn score(&self, k: u32) -> f64 {
        self.locals[k as usize].map_or(0.0, |l| l.difference / self.u[k as usize][0])
    }

    /// A difference over its best radius without its blur: noise, fit, smooth errors.
    fn sharp_u(&self, k: u32) -> f64 {
        self.local(k).sharp.u.hypot(self.u[k as usize][1])
    }
}

/// Where a mean differs by so many standard uncertainties, a region is told: one in a hundred comparisons of unworn surfaces.
pub(super) fn least_significance(locals: &[Option<Local>]) -> f64 {
    let cylinders = locals.iter().flatten().map(|l| 1.0 / l.new_points.max(1) as f64).sum::<f64>();
    quantile_of_many((OVERLAP * cylinders).max(1.0))
}

/// Regions of both signs, the largest area first.
pub(super) fn find(field: &Field<'_>, least_significance: f64) -> Result<Vec<WornRegion>, TooManyCells> {
    let mut regions = Vec::new();
    for sign in [-1.0, 1.0] {
        let all = 0..field.positions.len() as u32;
        let members: Vec<u32> = all.filter(|k| sign * field.score(*k) >= GROWS_TO).collect();
        for points in connected(field.positions, &members, LINK * field.radius)? {
            let area_told: f64 = points.iter().map(|k| field.area_of(*k)).sum();
            let significance = points.iter().map(|k| field.score(*k).abs()).fold(0.0, f64::max);
            if area_told >= field.disc() && significance >= least_significance {
                regions.push(describe(field, points, sign, area_told, significance));
            }
        }
    }
    regions.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.points[0].cmp(&b.points[0])));
    Ok(regions)
}

fn describe(field: &Field<'_>, points: Vec<u32>, sign: f64, area_told: f64, significance: f64) -> WornRegion {
    let depth_of = |k: u32| sign * field.local(k).sharp.difference;
    let total_u = |k: u32| field.sharp_u(k).hypot(field.local(k).sharp.blur);
    let sure = |k: &u32| depth_of(*k) - 2.0 * total_u(*k);
    let furthest = points.iter().copied().max_by(|a, b| sure(a).total_cmp(&sure(b)).then(b.cmp(a)));
    let furthest = furthest.expect("a region has points");
    let extreme = field.local(furthest).sharp;
    // Where a region ends is told by the least radius that its depth allows.
    let half = 0.5 * depth_of(furthest);
    let best = |k: u32| {
        let local = field.local(k);
        if local.finest.u < half / CLEAR { local.finest } else { local.sharp }
    };
    let depth = |k: u32| sign * best(k).difference;
    let at_least = |level: f64| points.iter().copied().filter(move |k| depth(*k) >= level);
    let area_at = |level: f64| at_least(level).map(|k| field.area_of(k)).sum::<f64>();
    let inside: Vec<u32> = at_least(half).collect();
    let area = area_at(half);
    let mean_of = |of: &dyn Fn(u32) -> f64| {
        inside.iter().map(|k| field.area_of(*k) * of(*k)).sum::<f64>() / area.max(f64::MIN_POSITIVE)
    };
    // Neighbouring differences share points: as many are by themselves as cylinders fit in.
    let apart = (area / field.disc()).max(1.0);
    let noise = mean_of(&|k| best(k).u.powi(2)) / apart;
    let common = mean_of(&|k| field.u[k as usize][1].powi(2));
    // Blur makes all of a region shallower at its rim: that does not average out.
    let blur = mean_of(&|k| best(k).blur);
    let centre = inside.iter().map(|k| field.positions[*k as usize].coords).sum::<Vector3>() / inside.len() as f64;
    // The largest of many places is so much beyond its own noise.
    let among = (area / (std::f64::consts::PI * extreme.radius * extreme.radius)).max(1.0);
    let extreme_u = total_u(furthest).hypot(extreme.u * OF_LARGEST * (2.0 * among.ln()).sqrt());
    let normal = points.iter().map(|k| field.local(*k).normal).sum::<Vector3>();
    WornRegion {
        area,
        area_u: area_u(field, &points, (&area_at, &best), area, half, extreme_u),
        area_told,
        mean: sign * mean_of(&depth),
        mean_u: (noise + common + blur * blur).sqrt(),
        extreme: extreme.difference,
        extreme_u,
        extreme_radius: extreme.radius,
        blurred: extreme.blur > field.sharp_u(furthest) || (area / std::f64::consts::PI).sqrt() < 2.0 * extreme.radius,
        centre: Point3::from(centre),
        extreme_at: field.positions[furthest as usize],
        normal: normal.try_normalize(1e-9).unwrap_or_else(|| field.local(furthest).normal),
        significance,
        points,
    }
}

/// Standard uncertainty of an area within the rim at half the extreme.
fn area_u(
    field: &Field<'_>,
    points: &[u32],
    (area_at, best): (&dyn Fn(f64) -> f64, &dyn Fn(u32) -> Sharp),
    area: f64,
    half: f64,
    extreme_u: f64,
) -> f64 {
    let size = |k: u32| best(k).difference.abs();
    let rim: Vec<u32> = points.iter().copied().filter(|k| (0.5 * half..1.5 * half).contains(&size(*k))).collect();
    let mean = |of: &dyn Fn(u32) -> f64| rim.iter().map(|k| of(*k)).sum::<f64>() / rim.len().max(1) as f64;
    // Half of an extreme that is off by its uncertainty, and a difference at the rim that is off by its own, move the rim to another level.
    let level_u = (0.5 * extreme_u).hypot(mean(&|k| best(k).u.hypot(field.u[k as usize][1])));
    let by_level = 0.5 * (area_at(half - level_u) - area_at(half + level_u));
    // A rim of the length of a disc of that area, half a radius to either side evenly: 1 / sqrt 3 of that is its standard deviation.
    let radius = if rim.is_empty() { field.radius } else { mean(&|k| best(k).radius) };
    let by_rim = 2.0 * (std::f64::consts::PI * area).sqrt() * 0.5 * radius / 3f64.sqrt();
    by_level.hypot(by_rim)
}

/// So many standard deviations that the largest of `count` independent normal numbers is beyond, either way, once in a hundred times.
fn quantile_of_many(count: f64) -> f64 {
    // Twice the normal tail is at most exp(-z² / 2) * sqrt(2 / pi) / z: solved for z by its own fixed point.
    let wanted = FALSE_ALARMS / count;
    let mut z: f64 = 3.0;
    for _ in 0..50 {
        z = (2.0 * ((2.0 / std::f64::consts::PI).sqrt() / (z * wanted)).ln()).max(1.0).sqrt();
    }
    z
}

/// Groups of members that hang together by steps of at most `link`, each in rising order.
fn connected(positions: &[Point3], members: &[u32], link: f64) -> Result<Vec<Vec<u32>>, TooManyCells> {
    let places: Vec<Point3> = members.iter().map(|k| positions[*k as usize]).collect();
    let cells = Cells::new(&places, link)?;
    let mut root: Vec<u32> = (0..places.len() as u32).collect();
    for (cell, around) in cells.walk(0) {
        for k in cells.points(cell) {
            for j in around.points() {
                if j < k && (cells.positions[j] - cells.positions[k]).norm_squared() <= link * link {
                    join(&mut root, cells.order[j], cells.order[k]);
                }
            }
        }
    }
    let mut groups: std::collections::BTreeMap<u32, Vec<u32>> = std::collections::BTreeMap::new();
    for k in 0..places.len() as u32 {
        groups.entry(root_of(&mut root, k)).or_default().push(members[k as usize]);
    }
    Ok(groups.into_values().collect())
}

fn root_of(root: &mut [u32], of: u32) -> u32 {
    let mut k = of;
    while root[k as usize] != k {
        root[k as usize] = root[root[k as usize] as usize];
        k = root[k as usize];
    }
    k
}

fn join(root: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root_of(root, a), root_of(root, b));
    // The lower one is the root, whatever the order of joining.
    root[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_that_of_the_largest_of_many() {
        // Two-sided normal tails: 0.01 at 2.576, 0.0001 at 3.891, 1e-5 at 4.417. The bound is a little above.
        for (count, z) in [(1.0, 2.576), (100.0, 3.891), (1000.0, 4.417)] {
            let found = quantile_of_many(count);
            assert!((z..z + 0.1).contains(&found), "{count}: {found}");
        }
    }
}
