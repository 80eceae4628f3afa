//! What an earlier merged cloud of the same tool says of its wear: a signed difference at every point, with its uncertainty, and the worn
//! regions.
//!
//! **Problem.** Nobody knows which regions are worn, and wear is of the size of one point's noise. Best fit to the whole surface spreads the wear
//! over it.
//!
//! **Way.** Differences are taken between local means, not between points: around a place both clouds are cut out by a cylinder along the
//! surface's normal, a plane is laid through the heights of each, and their distance on the cylinder's axis is the difference (after
//! Lague, Brodu and Leroux 2013, M3C2, who take means). The best fit makes such differences small at places spread over the surface: it begins at
//! the motion under which the better half of them lies best (`starts`), and weighs each by Tukey's biweight anew until nothing moves: worn places
//! stand off the others by many times a mean's noise, lose their weight, and do not pull. What places differ in beyond their noise, smooth errors of
//! both measurements, is a part of the uncertainty, larger where points are worse by the metric that they were merged by (`smooth`); it is told by
//! the places outside worn regions, and both are found in turns until nothing changes.
//!
//! **Blur.** A mean over a wide cylinder is sure and blurred. Regions are found by the widest; a difference is told over the one of three radii at
//! which its noise and its blur, how far the difference goes up and down within the cylinder, are least together.
//!
//! **Answer.** Wear that is gentle looks like a smooth error, and of a step nobody can say which side moved. Where noise does not explain
//! the differences and smooth errors might, or two motions fit alike, the answer is that it cannot be told (`verdict`).
//!
//! **Sign.** Positive where the new surface lies nearer to the sensor than the old one: material was added; negative: worn away. Lengths are
//! in the unit of the clouds. Uncertainties are standard ones (k = 1).

mod best_fit;
mod local;
mod regions;
mod smooth;
mod starts;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_of_shapes;
mod verdict;

use super::cells::{Cells, TooManyCells};
use super::spacing::grid_distance;
use crate::fit::robust::quantile;
use crate::geometry::{Isometry3, Point3, Vector3};
use crate::run::{Cancelled, RunContext};
pub use best_fit::WearFit;
use local::{Finer, Local, Pair};
use regions::Field;
pub use regions::WornRegion;
pub use smooth::SmoothErrors;
pub use verdict::{Doubt, Verdict};

/// Radius of the cylinders in the spacing of the sparser cloud's points: some 110 points each, where every cell of the grid has its point.
pub const RADIUS_GRID: f64 = 6.0;
/// Radii that a difference is told over where a wider one blurs it: some 40 and 15 points each.
const FINER_GRID: [f64; 2] = [3.6, 2.2];
/// Regions and smooth errors are found in turns, so often at most.
const TURNS: usize = 4;
/// Fewer places do not tell smooth errors anew.
const LEAST_PLACES: usize = 60;

/// The new cloud.
#[derive(Debug, Clone, Copy)]
pub struct NewCloud<'a> {
    /// Its points.
    pub positions: &'a [Point3],
    /// Where the sensor stood that saw each, by the numbers in `seen_from`.
    pub sensors: &'a [Point3],
    /// Of each point, the index among `sensors`.
    pub seen_from: &'a [u32],
    /// Of each point how bad it is by the metric that both clouds were merged by; larger is worse. Nothing where it is not known.
    pub badness: Option<&'a [f32]>,
}

/// The earlier cloud.
#[derive(Debug, Clone, Copy)]
pub struct OldCloud<'a> {
    /// Its points.
    pub positions: &'a [Point3],
    /// By the same metric as the new ones'.
    pub badness: Option<&'a [f32]>,
}

/// Badness of new and old points in one list, where both are known.
fn badness_of(new: &NewCloud<'_>, old: &OldCloud<'_>) -> Vec<f32> {
    let both = new.badness.zip(old.badness);
    both.map(|(new, old)| new.iter().chain(old).copied().collect()).unwrap_or_default()
}

/// Why two clouds are not compared.
#[derive(Debug, thiserror::Error)]
pub enum WearError {
    /// Hardly any place of the new cloud has points of the old one around.
    #[error(
        "{found} of {of} places of the cloud have points of the earlier cloud within {reach:.4}, at least {needed} are needed"
    )]
    Apart {
        /// Places with a counterpart.
        found: usize,
        /// Places.
        of: usize,
        /// How far was looked.
        reach: f64,
        /// How many are needed.
        needed: usize,
    },
    /// Both lie near each other, and are not the same surface.
    #[error(
        "it is of another surface: at most places it lies {sigma:.4} off, with points that scatter by {scatter:.4} only"
    )]
    OtherSurface {
        /// Robust standard deviation of the differences.
        sigma: f64,
        /// Usual standard deviation of a point about the plane of its neighbours.
        scatter: f64,
    },
    /// The fit went further than poses in one frame leave to do.
    #[error(
        "it fits best turned by {turned_deg:.2} degrees and moved by {moved:.4}; at most {most_deg:.0} degrees and {reach:.4} are expected of poses in the same frame"
    )]
    Moved {
        /// Turn of the best fit.
        turned_deg: f64,
        /// The most that a place was moved by.
        moved: f64,
        /// The largest turn.
        most_deg: f64,
        /// How far a place may be moved.
        reach: f64,
    },
    /// A cloud of too few points.
    #[error("the {which} cloud has {found} points, too few to tell their distance")]
    TooFew {
        /// New or earlier.
        which: &'static str,
        /// Its points.
        found: usize,
    },
    /// Clouds that reach too far.
    #[error(transparent)]
    TooManyCells(#[from] TooManyCells),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// How a cloud differs from an earlier one.
#[derive(Debug, Clone, PartialEq)]
pub struct Wear {
    /// Puts the new cloud onto the old one.
    pub old_from_new: Isometry3,
    /// Radius of the cylinders that regions are found by, and that differences are told over where nothing goes up and down within it.
    pub radius: f64,
    /// The least radius that a difference is told over: finer structure than that is blurred.
    pub least_radius: f64,
    /// Signed difference at each new point; no number where there is no counterpart: not measured, which is not unworn.
    pub difference: Vec<f32>,
    /// Its standard uncertainty: noise of both clouds, best fit, smooth errors, blur.
    pub difference_u: Vec<f32>,
    /// New points without a difference.
    pub not_measured: usize,
    /// Old points with no new one around: what was not seen again.
    pub old_not_seen: usize,
    /// How well the clouds fit.
    pub fit: WearFit,
    /// The usual standard uncertainty by smooth errors of both measurements, widened for the few places that tell it.
    pub smooth_u: f64,
    /// What it says on the whole.
    pub verdict: Verdict,
    /// The largest first.
    pub regions: Vec<WornRegion>,
    /// Means over the radius differ over at least this area, or it is no region.
    pub least_area: f64,
    /// A region holds at least one mean of so many standard uncertainties: one region in a hundred comparisons of unworn surfaces.
    pub least_significance: f64,
    /// What that is in length, at nine of ten places: a region that differs by less may not be told.
    pub least_difference: f64,
}

/// Compares a new cloud with an earlier one that lies near its place already (within some ten distances of its points).
///
/// # Errors
/// Clouds of a few points, or far from each other, or the job was stopped.
///
/// # Panics
/// When `seen_from` has not the length of the positions, or names a sensor that is not there.
pub fn compare(new: &NewCloud<'_>, old: &OldCloud<'_>, run: &RunContext) -> Result<Wear, WearError> {
    assert_eq!(new.positions.len(), new.seen_from.len(), "a sensor for every point");
    let distance = |which, cloud: &[Point3]| match grid_distance(cloud)? {
        Some(distance) => Ok(distance),
        None => Err(WearError::TooFew { which, found: cloud.len() }),
    };
    let spacing = distance("new", new.positions)?.max(distance("earlier", old.positions)?);
    let radius = RADIUS_GRID * spacing;
    let (first_from_new, fit) = best_fit::best_fit(new, old, radius, run)?;
    run.check()?;
    let positions: Vec<Point3> = new.positions.iter().map(|p| first_from_new * p).collect();
    let sensors: Vec<Point3> = new.sensors.iter().map(|p| first_from_new * p).collect();
    let finer = Finer { radii: FINER_GRID.map(|grid| grid * spacing), excess: fit.excess };
    let pair = Pair::new(&positions, old.positions, &badness_of(new, old), radius)?.sharpened(finer);
    let toward = |k: usize| sensors[new.seen_from[k] as usize];
    let every: Vec<u32> = (0..positions.len() as u32).collect();
    let locals = pair.differences(&every, &toward, run)?;
    run.check()?;
    let least_significance = regions::least_significance(&locals);
    let found = turns(&positions, locals, fit, [radius, least_significance])?;
    let (locals, fit) = (found.locals, found.fit);
    let told = |of: &dyn Fn(usize, &Local) -> f64| -> Vec<f32> {
        locals.iter().enumerate().map(|(k, l)| l.as_ref().map_or(f32::NAN, |l| of(k, l) as f32)).collect()
    };
    let mut u: Vec<f64> = found.u.iter().map(|u| u[0]).filter(|u| u.is_finite()).collect();
    Ok(Wear {
        old_from_new: found.old_from_first * first_from_new,
        radius,
        least_radius: finer.radii[1],
        not_measured: locals.iter().filter(|l| l.is_none()).count(),
        old_not_seen: pair.old_alone(),
        difference: told(&|_, l| l.sharp.difference),
        difference_u: told(&|k, l| l.sharp.u.hypot(l.sharp.blur).hypot(found.u[k][1])),
        smooth_u: found.smooth.typical(),
        verdict: verdict::verdict(&fit, found.smooth.typical(), &found.regions, &found.beyond_noise),
        fit,
        regions: found.regions,
        least_area: std::f64::consts::PI * radius * radius,
        least_significance,
        least_difference: least_significance * quantile(&mut u, 0.9).unwrap_or(f64::NAN),
    })
}

/// Regions, and what lies outside them.
struct Turned {
    regions: Vec<WornRegion>,
    /// Those that there would be without smooth errors.
    beyond_noise: Vec<WornRegion>,
    smooth: SmoothErrors,
    /// Of each point: standard uncertainty of its difference over the whole radius, and what of it is not noise.
    u: Vec<[f64; 2]>,
    /// Differences, the fit that they belong to, and what it moved.
    locals: Vec<Option<Local>>,
    fit: WearFit,
    old_from_first: Isometry3,
}

/// Finds regions by the smooth errors, then fit and smooth errors outside the regions, until the regions stay.
fn turns(
    positions: &[Point3],
    mut locals: Vec<Option<Local>>,
    mut fit: WearFit,
    [radius, least_significance]: [f64; 2],
) -> Result<Turned, WearError> {
    let places = best_fit::places(positions, radius);
    let find = |locals: &[Option<Local>], u: &[[f64; 2]]| {
        regions::find(&Field { positions, locals, u, radius }, least_significance)
    };
    let mut old_from_first = Isometry3::identity();
    let mut worn = vec![false; positions.len()];
    let mut smooth = smooth_errors(&places, &locals).widened(least_significance);
    let mut u = uncertainties(positions, &locals, &fit, &smooth);
    let mut found = find(&locals, &u)?;
    for _ in 0..TURNS {
        let mut again = vec![false; positions.len()];
        found.iter().flat_map(|r| &r.points).for_each(|k| again[*k as usize] = true);
        if again == worn {
            break;
        }
        worn = again;
        let outside = away_from(positions, &worn, &places, radius)?;
        let told = |k: &u32| {
            let local = locals[*k as usize].as_ref()?;
            Some((positions[*k as usize], local.normal, [local.difference, local.u.hypot(u[*k as usize][1])]))
        };
        let left: Vec<(Point3, Vector3, [f64; 2])> = outside.iter().filter_map(told).collect();
        if left.len() < LEAST_PLACES {
            break;
        }
        if let Some(moves) = fit.again(&left) {
            for (place, local) in positions.iter().zip(&mut locals) {
                let Some(local) = local else { continue };
                let added = fit.adds(&moves, place, &local.normal);
                local.difference += added;
                local.sharp.difference += added;
                local.finest.difference += added;
            }
            old_from_first = fit.motion(&moves) * old_from_first;
        }
        smooth = smooth_errors(&outside, &locals).widened(least_significance);
        u = uncertainties(positions, &locals, &fit, &smooth);
        found = find(&locals, &u)?;
    }
    let beyond_noise = find(&locals, &uncertainties(positions, &locals, &fit, &SmoothErrors::new(&[])))?;
    Ok(Turned { regions: found, beyond_noise, smooth, u, locals, fit, old_from_first })
}

/// Places with no worn point within the radius.
fn away_from(positions: &[Point3], worn: &[bool], places: &[u32], radius: f64) -> Result<Vec<u32>, TooManyCells> {
    let cells = Cells::new(positions, radius)?;
    let mut is_near = vec![false; positions.len()];
    for (cell, around) in cells.walk(0) {
        let there: Vec<usize> = around.points().filter(|j| worn[cells.order[*j] as usize]).collect();
        for k in cells.points(cell) {
            let at = cells.positions[k];
            is_near[cells.order[k] as usize] =
                there.iter().any(|j| (cells.positions[*j] - at).norm_squared() <= radius * radius);
        }
    }
    Ok(places.iter().copied().filter(|k| !is_near[*k as usize]).collect())
}

fn smooth_errors(places: &[u32], locals: &[Option<Local>]) -> SmoothErrors {
    let told = |k: &u32| locals[*k as usize].as_ref().map(|l| [l.badness, l.difference, l.u]);
    SmoothErrors::new(&places.iter().filter_map(told).collect::<Vec<[f64; 3]>>())
}

/// Of each point: standard uncertainty of its difference over the whole radius, and what of it is not noise.
fn uncertainties(
    positions: &[Point3],
    locals: &[Option<Local>],
    fit: &WearFit,
    smooth: &SmoothErrors,
) -> Vec<[f64; 2]> {
    let of = |(place, local): (&Point3, &Option<Local>)| {
        let Some(local) = local else { return [f64::NAN; 2] };
        let common = smooth.beyond_noise(local.badness).hypot(fit.motion_u(place, &local.normal));
        [local.u.hypot(common), common]
    };
    positions.iter().zip(locals).map(of).collect()
}
