//! Regions of a surface that differ from before.

use super::best_fit::WearFit;
use super::local::Local;
use crate::geometry::{Point3, Vector3};
use crate::stitch::cells::{Cells, TooManyCells};

/// A region grows around a certain difference to where differences are still so many standard uncertainties.
const GROWS_TO: f64 = 2.0;
/// So often may unworn surfaces show a region.
const FALSE_ALARMS: f64 = 0.01;
/// Neighbours of one region lie within this share of the radius.
const LINK: f64 = 0.5;

/// A connected region where material is gone or was added.
#[derive(Debug, Clone, PartialEq)]
pub struct WornRegion {
    /// The area where the difference is at least two standard uncertainties.
    pub area: f64,
    /// Standard uncertainty of the area: half a cylinder's radius all around it.
    pub area_u: f64,
    /// Mean difference, signed as differences are: negative where material is gone.
    pub mean: f64,
    /// Standard uncertainty of the mean.
    pub mean_u: f64,
    /// The difference furthest from zero, blurred over a cylinder's radius.
    pub extreme: f64,
    /// Standard uncertainty of that one.
    pub extreme_u: f64,
    /// Mean place of its points, old cloud's frame.
    pub centre: Point3,
    /// Where the extreme is.
    pub extreme_at: Point3,
    /// Mean normal, towards the sensor.
    pub normal: Vector3,
    /// Size of the largest difference in standard uncertainties.
    pub significance: f64,
    /// Its points, as indices of new points.
    pub points: Vec<u32>,
}

pub(super) struct Found {
    pub regions: Vec<WornRegion>,
    pub least_area: f64,
    pub least_significance: f64,
}

/// Regions of both signs, the largest area first.
pub(super) fn find(
    positions: &[Point3],
    locals: &[Option<Local>],
    u: &[f32],
    fit: &WearFit,
    radius: f64,
) -> Result<Found, TooManyCells> {
    let disc = std::f64::consts::PI * radius * radius;
    // A point stands for its share of the disc that it was told by, so that clouds may be dense here and sparse there.
    let area_of = |local: &Local| disc / local.new_points.max(1) as f64;
    let discs = (locals.iter().flatten().map(area_of).sum::<f64>() / disc).max(1.0);
    let least_significance = quantile_of_many(discs);
    let score = |k: u32| {
        let k = k as usize;
        locals[k].map_or(0.0, |l| l.difference / f64::from(u[k]))
    };
    // How large smooth errors are is itself told by few places: they have to be exceeded by more.
    let student = fit.smooth.student(least_significance);
    let is_certain = |k: u32| {
        locals[k as usize].is_some_and(|l| {
            let motion = fit.motion_u(&positions[k as usize], &l.normal);
            let noise = least_significance * l.u.hypot(motion);
            l.difference.abs() >= noise.hypot(student * fit.smooth.beyond_noise(l.badness))
        })
    };
    let mut regions = Vec::new();
    for sign in [-1.0, 1.0] {
        let members: Vec<u32> = (0..positions.len() as u32).filter(|k| sign * score(*k) >= GROWS_TO).collect();
        for points in connected(positions, &members, LINK * radius)? {
            let area = points.iter().filter_map(|k| locals[*k as usize].as_ref()).map(area_of).sum::<f64>();
            if area >= disc && points.iter().any(|k| is_certain(*k)) {
                regions.push(describe(points, positions, locals, u, fit, [area, disc]));
            }
        }
    }
    regions.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.points[0].cmp(&b.points[0])));
    Ok(Found { regions, least_area: disc, least_significance })
}

fn describe(
    points: Vec<u32>,
    positions: &[Point3],
    locals: &[Option<Local>],
    u: &[f32],
    fit: &WearFit,
    [area, disc]: [f64; 2],
) -> WornRegion {
    let of = |k: &u32| locals[*k as usize].expect("members have a difference");
    let count = points.len() as f64;
    let mean = points.iter().map(|k| of(k).difference).sum::<f64>() / count;
    let noise = points.iter().map(|k| of(k).u.powi(2)).sum::<f64>() / count;
    let centre = points.iter().map(|k| positions[*k as usize].coords).sum::<Vector3>() / count;
    let normal = points.iter().map(|k| of(k).normal).sum::<Vector3>();
    let normal = normal.try_normalize(1e-9).unwrap_or_else(|| of(&points[0]).normal);
    let centre = Point3::from(centre);
    // Neighbouring differences share points: as many are by themselves as cylinders fit in.
    let apart = (area / disc).max(1.0);
    let smooth = points.iter().map(|k| fit.smooth.beyond_noise(of(k).badness).powi(2)).sum::<f64>() / count;
    let common = smooth + fit.motion_u(&centre, &normal).powi(2);
    let furthest = *points
        .iter()
        .max_by(|a, b| of(a).difference.abs().total_cmp(&of(b).difference.abs()).then(b.cmp(a)))
        .expect("a region has points");
    let significance = points.iter().map(|k| (of(k).difference / f64::from(u[*k as usize])).abs()).fold(0.0, f64::max);
    WornRegion {
        area,
        // A rim of the length of a disc of that area, half a radius to either side evenly: 1 / sqrt 3 of that is its standard deviation.
        area_u: 2.0 * (std::f64::consts::PI * area).sqrt() * 0.5 * (disc / std::f64::consts::PI).sqrt() / 3f64.sqrt(),
        mean,
        mean_u: (noise / apart + common).sqrt(),
        extreme: of(&furthest).difference,
        extreme_u: f64::from(u[furthest as usize]),
        centre,
        extreme_at: positions[furthest as usize],
        normal,
        significance,
        points,
    }
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
