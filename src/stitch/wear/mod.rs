//! What an earlier merged cloud of the same tool says of its wear: a signed difference at every point, with its uncertainty, and the worn
//! regions.
//!
//! **Problem.** Nobody knows which regions are worn, and wear is of the size of one point's noise. Best fit to the whole surface spreads the wear
//! over it.
//!
//! **Way.** Differences are taken between local means, not between points: around a place both clouds are cut out by a cylinder along the
//! surface's normal, a plane is laid through the heights of each, and their distance on the cylinder's axis is the difference (after
//! Lague, Brodu and Leroux 2013, M3C2, who take means). The best fit makes such differences small at places spread over the surface, each
//! weighted by Tukey's biweight anew until nothing moves: worn places stand off the others by many times a mean's noise, lose their weight,
//! and do not pull. What places differ in beyond their noise, smooth errors of both measurements, is a part of the uncertainty, larger where points
//! are worse by the metric that they were merged by (`smooth`).
//!
//! **Sign.** Positive where the new surface lies nearer to the sensor than the old one: material was added; negative: worn away. Lengths are
//! in the unit of the clouds. Uncertainties are standard ones (k = 1).

mod best_fit;
mod local;
mod regions;
mod smooth;
#[cfg(test)]
mod tests;

use super::cells::TooManyCells;
use super::spacing::grid_distance;
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
pub use best_fit::WearFit;
use local::{Local, Pair};
pub use regions::WornRegion;
pub use smooth::SmoothErrors;

/// Radius of the cylinders in d_grid of the sparser cloud: some 110 points each, where every cell of the grid has its point.
pub const RADIUS_GRID: f64 = 6.0;

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
    /// Radius of the cylinders: finer structure than that is blurred.
    pub radius: f64,
    /// Signed difference at each new point; no number where there is no counterpart: not measured, which is not unworn.
    pub difference: Vec<f32>,
    /// Its standard uncertainty: noise of both clouds, best fit, smooth errors.
    pub difference_u: Vec<f32>,
    /// New points without a difference.
    pub not_measured: usize,
    /// Old points with no new one around: what was not seen again.
    pub old_not_seen: usize,
    /// How well the clouds fit.
    pub fit: WearFit,
    /// The largest first.
    pub regions: Vec<WornRegion>,
    /// Smaller regions are not told.
    pub least_area: f64,
    /// A region holds at least one difference of so many standard uncertainties, and more where these are smooth errors, which few places
    /// tell: one region in a hundred comparisons of unworn surfaces.
    pub least_significance: f64,
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
    let radius = RADIUS_GRID * distance("new", new.positions)?.max(distance("earlier", old.positions)?);
    let (old_from_new, fit) = best_fit::best_fit(new, old, radius, run)?;
    run.check()?;
    let moved: Vec<Point3> = new.positions.iter().map(|p| old_from_new * p).collect();
    let sensors: Vec<Point3> = new.sensors.iter().map(|p| old_from_new * p).collect();
    let pair = Pair::new(&moved, old.positions, &badness_of(new, old), radius)?;
    let toward = |k: usize| sensors[new.seen_from[k] as usize];
    let every: Vec<u32> = (0..moved.len() as u32).collect();
    let locals = pair.differences(&every, &toward, run)?;
    let uncertainty = |k: usize, local: &Local| {
        let smooth = fit.smooth.beyond_noise(local.badness);
        (local.u * local.u + smooth * smooth + fit.motion_u(&moved[k], &local.normal).powi(2)).sqrt()
    };
    let column = |of: &dyn Fn(usize, &Local) -> f64| -> Vec<f32> {
        locals.iter().enumerate().map(|(k, l)| l.as_ref().map_or(f32::NAN, |l| of(k, l) as f32)).collect()
    };
    let difference = column(&|_, local| local.difference);
    let difference_u = column(&uncertainty);
    let found = regions::find(&moved, &locals, &difference_u, &fit, radius)?;
    Ok(Wear {
        old_from_new,
        radius,
        not_measured: locals.iter().filter(|l| l.is_none()).count(),
        old_not_seen: pair.old_alone(),
        difference,
        difference_u,
        fit,
        regions: found.regions,
        least_area: found.least_area,
        least_significance: found.least_significance,
    })
}
