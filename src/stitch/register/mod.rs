//! Registration of N overlapping views: where each of them lies in one world.
//!
//! ```text
//! views --surface: patches--> Surface         smoothed places with normals, a search tree, the noise of a point
//!   --rim: rims-->                            where the sheet ends though the sensor looked further: what holds flat views along themselves
//!   --overlap / search--> candidate pairs     by hashed occupancy under the prior poses; without them by many starts and a margin
//!   --pairwise--> Fitted                      robust symmetric point-to-plane; motions that the surface does not hold stay unmoved
//!   --network--> poses                        graph of poses, edges with weights of their own, priors as weak rows
//!   --joint--> poses                          all pairs matched again and solved together, until nothing moves
//!   --sight-->                                who has a surface where the others look through
//!   --verdict--> Registration                 who is placed, who is left out by name and why, pairs, cycles, weak motions
//! ```
//!
//! Views are taken in the order of their surfaces, so that neither names nor the order in which they are given change anything; sums run in
//! that order, so that threads change nothing either. Names count where no pose is known: views are tried with those of neighbouring names
//! first, and the first one is the gauge. Lengths are in the views' own unit, angles in rad.

mod cycles;
mod inputs;
mod joint;
mod matches;
mod motion;
mod network;
mod normal;
mod observed;
mod order;
#[cfg(test)]
mod order_tests;
mod overlap;
mod pairwise;
mod pipeline;
mod progress;
mod result;
mod rim;
#[cfg(test)]
mod rim_tests;
mod sampling;
mod search;
mod sight;
mod surface;
#[cfg(test)]
mod synthetic_tests;
mod unknown;
mod verdict;
mod weak;
#[cfg(test)]
mod wrong_tests;

pub use pipeline::{register, register_from};
pub use result::{Cycle, Gauge, LeftOut, Pair, PairState, Placed, RegisterError, Registration, ViewOutcome, Weak};

use crate::geometry::Isometry3;

/// What is known of a view's pose before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Where the view is thought to lie.
    pub world_from_view: Isometry3,
    /// Standard uncertainty of where the middle of the view's points lies, along each axis.
    pub translation_sigma: f64,
    /// Standard uncertainty of its turn about each axis through that middle, rad.
    pub rotation_sigma_rad: f64,
}

/// How views are registered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Distance of a view's points; estimated view by view where there is none.
    pub d_grid: Option<f64>,
    /// Standard deviation of a point about the surface; estimated from the views where there is none. A pair whose overlap fits
    /// worse than [`Options::most_residual`] times this is not used.
    pub noise: Option<f64>,
    /// Least share of the smaller view that must lie on the other one.
    pub least_share: f64,
    /// Most neighbours of a view that it is registered with, those with the largest shares.
    pub most_neighbours: usize,
    /// Largest residual of a pair that is used, in the noise of a point.
    pub most_residual: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { d_grid: None, noise: None, least_share: 0.15, most_neighbours: 8, most_residual: 2.0 }
    }
}
