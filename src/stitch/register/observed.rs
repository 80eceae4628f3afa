//! Which motions an overlap holds, and how well.
//!
//! Motions are told by what they displace the overlap's places by, root mean square: six independent motions of displacement one. For each, the
//! mean square `seen` of the residual that it makes is between 0 (the surface slides on itself) and 1 (it moves along the normal). What
//! normals make up by being unsure is taken off it: two noisy planes would otherwise claim to hold each other everywhere.

use super::matches::{Group, Sums, by_neighbourhood};
use super::motion::Motion;
use crate::geometry::{Point3, decompose};
use nalgebra::{Matrix6, Vector6};

/// A motion is held fully when it is seen this many times as strongly as normals are unsure, and not at all below the other one.
const FULLY: f64 = 2.5;
const NOT_AT_ALL: f64 = 1.5;
/// Fewer neighbourhoods tell no variance.
const LEAST_NEIGHBOURHOODS: f64 = 12.0;
/// Nothing is seen below this: a tilt of the surface of 0.1 mrad.
const LEAST_SEEN: f64 = 1e-8;

/// Six motions about the sums' centre.
#[derive(Debug, Clone)]
pub(super) struct Observed {
    /// Columns: motions of displacement one.
    pub motions: Matrix6<f64>,
    /// Takes a motion to its displacements along the six.
    pub told: Matrix6<f64>,
    /// Mean square residual of each, that of unsure normals taken off.
    pub seen: Vector6<f64>,
    /// How far each is held: 0 not at all, 1 fully.
    pub held: Vector6<f64>,
    /// Displacement along each that the residuals ask for, where it is held.
    pub asked: Vector6<f64>,
    /// Sum of the weights.
    pub weight: f64,
}

impl Observed {
    /// Of sums; `None` where the places lie on a line.
    pub(super) fn of(sums: &Sums) -> Option<Self> {
        let mean = sums.displaced / sums.weight;
        let lower = (mean + ridge(&mean)).cholesky()?.l();
        let inverse = lower.try_inverse()?;
        let whitened = |m: &Matrix6<f64>| inverse * (m / sums.weight) * inverse.transpose();
        let eigen = decompose::symmetric_eigen(whitened(&sums.h))?;
        let basis = eigen.eigenvectors;
        let unsure = (basis.transpose() * whitened(&sums.unsure) * basis).diagonal();
        let asked = basis.transpose() * inverse * (sums.g / sums.weight);
        let mut out = Self {
            motions: inverse.transpose() * basis,
            told: basis.transpose() * lower.transpose(),
            seen: Vector6::zeros(),
            held: Vector6::zeros(),
            asked: Vector6::zeros(),
            weight: sums.weight,
        };
        for k in 0..6 {
            let (all, unsure) = (eigen.eigenvalues[k].max(0.0), unsure[k].max(0.0));
            let clear =
                if all <= LEAST_SEEN { 0.0 } else { (all / unsure.max(1e-300) - NOT_AT_ALL) / (FULLY - NOT_AT_ALL) };
            out.held[k] = clear.clamp(0.0, 1.0);
            out.seen[k] = (all - unsure).max(0.2 * all).max(LEAST_SEEN);
            out.asked[k] = -asked[k] / out.seen[k];
        }
        Some(out)
    }

    /// The motion asked for along what is held, no further than `most` along each.
    pub(super) fn step(&self, most: f64) -> Motion {
        let along = Vector6::from_fn(|k, _| (self.held[k] * self.asked[k]).clamp(-most, most));
        self.motions * along
    }

    /// The same when nothing is known of where it is: everything is held, strongly damped.
    pub(super) fn free_step(&self, most: f64) -> Motion {
        const DAMPING: f64 = 1e-3;
        let along =
            Vector6::from_fn(|k, _| (self.asked[k] * self.seen[k] / (self.seen[k] + DAMPING)).clamp(-most, most));
        self.motions * along
    }

    /// Variance of each displacement, by what the residuals of whole neighbourhoods add up to: places near each other share their points and
    /// their errors. Neighbourhoods are taken as large as leaves enough of them, beginning with cells of a side; the largest variance counts. Not
    /// below what independent residuals of `scale` would leave.
    pub(super) fn variances(&self, centre: &Point3, group: &Group, scale: f64, side: f64) -> Vector6<f64> {
        let mut variances = self.independent(scale);
        let mut side = side;
        loop {
            let cells = by_neighbourhood(group, centre, side);
            let count = cells.len() as f64;
            if count < LEAST_NEIGHBOURHOODS {
                return variances;
            }
            let spread = cells.iter().fold(Matrix6::zeros(), |sum, s| sum + s * s.transpose());
            // The motion that fits best takes six of them away.
            let along = (self.motions.transpose() * spread * self.motions).diagonal() * (count / (count - 6.0));
            for k in 0..6 {
                let information = self.seen[k] * self.weight;
                variances[k] = variances[k].max(along[k] / (information * information));
            }
            side *= 2.0;
        }
    }

    /// Variance of each displacement when residuals are independent.
    pub(super) fn independent(&self, scale: f64) -> Vector6<f64> {
        self.seen.map(|seen| scale * scale / (seen * self.weight))
    }

    /// Precision of motions about the centre from variances of the six displacements; nothing where they are not held.
    pub(super) fn precision(&self, variances: &Vector6<f64>) -> Matrix6<f64> {
        let diagonal = Vector6::from_fn(|k, _| self.held[k] / variances[k]);
        self.told.transpose() * Matrix6::from_diagonal(&diagonal) * self.told
    }

    /// Covariance of motions about the centre; what is not held is uncertain by `free`.
    pub(super) fn covariance(&self, variances: &Vector6<f64>, free: f64) -> Matrix6<f64> {
        let diagonal = Vector6::from_fn(|k, _| (variances[k] / self.held[k].max(1e-12)).min(free * free));
        self.motions * Matrix6::from_diagonal(&diagonal) * self.motions.transpose()
    }
}

/// Keeps places on a line from having no inverse.
fn ridge(mean: &Matrix6<f64>) -> Matrix6<f64> {
    let turn = (mean[(0, 0)] + mean[(1, 1)] + mean[(2, 2)]) / 3.0 + f64::MIN_POSITIVE;
    let shift = mean[(3, 3)];
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift)) * 1e-9
}
