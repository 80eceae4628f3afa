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
//! Window masks for large voids and the jackknife are to be added here: a mask changes [`Window::moments`] and, where it
//! touches the outline, [`outline::Outline::void`].

mod closed;
mod fit;
mod likelihood;
pub mod normal;
pub mod outline;

pub use closed::closed_log_likelihood;
pub use fit::{
    SoftEdgeError, SoftEdgeFit, SoftEdgeSettings, clutter_share, covered_share, fit_soft_edge, refine_soft_edge,
};
pub use outline::{Circle, Edge, Outline, Slot};

#[cfg(test)]
mod statistics;

use outline::Moments;

/// The part of the plane from which the points were taken: its area and first moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Area in mm², first moments along u and v in mm³.
    pub moments: Moments,
    /// Half its size, mm: the length over which a density gradient is told.
    pub reach_mm: f64,
}

impl Window {
    /// A disc about the origin.
    pub fn disc(radius_mm: f64) -> Self {
        Self { moments: [std::f64::consts::PI * radius_mm * radius_mm, 0.0, 0.0], reach_mm: radius_mm }
    }

    /// The rectangle between two corners.
    pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Self {
        let (w, h) = (high[0] - low[0], high[1] - low[1]);
        let area = w * h;
        Self {
            moments: [area, area * 0.5 * (low[0] + high[0]), area * 0.5 * (low[1] + high[1])],
            reach_mm: 0.5 * w.max(h),
        }
    }

    /// A simple polygon, counter-clockwise.
    pub fn polygon(corners: &[[f64; 2]]) -> Self {
        let (mut area, mut mu, mut mv, mut reach) = (0.0, 0.0, 0.0, 0.0_f64);
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let cross = a[0] * b[1] - b[0] * a[1];
            area += 0.5 * cross;
            mu += cross * (a[0] + b[0]) / 6.0;
            mv += cross * (a[1] + b[1]) / 6.0;
            reach = reach.max(a[0].hypot(a[1]));
        }
        Self { moments: [area, mu, mv], reach_mm: reach }
    }
}
