//! Where an edge lies between points: the soft-edge likelihood of a planar point process.
//!
//! A circle fitted to the outermost points of a hole's surroundings is too big by about 0.9 point spacings, because the
//! rim falls between points. The remedy is to model where points appear rather than which of them are "on the edge":
//!
//! `lambda(x) = lambda0 (1 + g.x) [eps + (1 - eps) Phi(s(x; theta) / tau)]`
//!
//! with s the signed distance to the outline (positive in material), tau the blur of the edge, eps the share of clutter
//! where there is no material and g a density gradient. With lambda0 profiled out, the log-likelihood of N points in the
//! window is `sum log q(x_i) (1 + g.x_i) - N log A_eff`, and `A_eff = A - (1 - eps) V` where A and V are the moments of
//! window and blurred void weighted with `1 + g.x`, in closed form ([`outline`]). Nothing depends on the points being a
//! lattice, jittered or random.
//!
//! Voids in the surroundings (shadows, glare) that touch the outline are no part of it: the sectors that they touch are cut
//! out of the window (`voids`), whose area is then summed over the cells of the cut.
//!
//! The covariance told is the larger, direction by direction, of two: the inverse of the observed information, true where
//! points fall as the model says, and a jackknife over twelve sectors (`jackknife`), which sees what the model does not.

mod closed;
mod clutter;
mod covariance;
mod data;
mod fit;
mod jackknife;
mod likelihood;
mod newton;
pub mod normal;
pub mod outline;
mod sectors;
mod voids;
mod window;

pub use closed::closed_log_likelihood;
pub use clutter::clutter_share;
pub use fit::{Kept, SoftEdgeError, SoftEdgeFit, SoftEdgeSettings, fit_soft_edge, refine_soft_edge};
pub use outline::{Circle, Edge, Outline, Slot};
pub use window::Window;

#[cfg(test)]
mod simulated;
#[cfg(test)]
mod table_tests;
#[cfg(test)]
mod voids_tests;
