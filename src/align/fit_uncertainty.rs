//! How well a best fit knows its pose: the sandwich estimate of an M-estimator (Huber), its middle summed over cells.
//!
//! ```text
//! cov = A^-1 B A^-1,   A = sum psi'(r) J J',   B = sum over cells of s s',   s = sum of psi(r) J over the cell's points
//! ```
//!
//! with the residuals `r`, Jacobian `J` and weights of the registration, `psi(r) = w r`. The residuals themselves tell how
//! large errors are, so that form deviations of the part count as well as noise, and what neighbours have in common is
//! counted within a cell: cells are many times as wide as errors of a scan reach.

use super::candidates::WEAK_MM;
use super::icp::{Beyond, Sums, centroid, pairs_of, weakest_mm};
use super::pose::PoseUncertainty;
use super::rim::RimLock;
use crate::fit::robust::tukey_weight_of_square;
use crate::geometry::{Aabb, Isometry3, Point3, decompose};
use crate::part::Face;
use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};
use std::collections::BTreeMap;

/// What a registration that has ended was made of.
pub(super) struct Ended<'a> {
    pub face: &'a Face,
    /// Work frame.
    pub points: &'a [Point3],
    pub cad_from_work: &'a Isometry3,
    /// Of the biweight.
    pub width_mm: f64,
    /// Robust standard deviation of the residuals.
    pub scale_mm: f64,
    pub rim: Option<&'a RimLock<'a>>,
    /// Side of the cells.
    pub cell_mm: f64,
}

/// Independent motions of the part, CAD frame, each as likely as one standard uncertainty. `None` where the points leave a
/// motion free.
pub(super) fn pose_motions(ended: &Ended) -> Option<Vec<Isometry3>> {
    let (centre, covariance) = covariance(ended)?;
    motions_of(&centre, covariance)
}

/// What Tukey's biweight, in the width used, leaves of the information of Gaussian errors.
const EFFICIENCY: f64 = 0.95;

/// The uncertainty of a best fit to expect, before anything is measured: points spread evenly over the face, and nothing else.
/// `height_variance_mm4`: variance of a height told by a piece of the face, times the area of that piece. `None` where the
/// surface alone does not hold the part (its rims will have to).
pub fn expected_best_fit(face: &Face, height_variance_mm4: f64) -> Option<PoseUncertainty> {
    let points: Vec<Point3> = face.samples.iter().map(|sample| sample.point).collect();
    let bounds = Aabb::of_points(&points)?;
    let (centre, count) = (bounds.centre(), points.len() as f64);
    let mut sums = Sums::zero();
    for sample in &face.samples {
        sums.add(&(sample.point - centre), &sample.normal, 0.0, 1.0);
    }
    let half_extent_mm = 0.5 * bounds.diagonal();
    if weakest_mm(&sums.h, count, half_extent_mm) > WEAK_MM {
        return None;
    }
    let variance_mm2 = height_variance_mm4 * count / (face.mesh.area() * EFFICIENCY);
    let covariance = inverse_of(&sums.h, half_extent_mm)? * variance_mm2;
    let mut known = PoseUncertainty::none(centre);
    motions_of(&centre, covariance)?.into_iter().for_each(|motion| known.add(motion));
    Some(known)
}

/// Motions along the axes of a covariance of (turn in rad, shift in mm) about a centre.
fn motions_of(centre: &Point3, covariance: Matrix6<f64>) -> Option<Vec<Isometry3>> {
    let axes = decompose::symmetric_eigen(covariance)?;
    let motion = |k: usize| {
        let step = axes.eigenvectors.column(k) * axes.eigenvalues[k].max(0.0).sqrt();
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        let shift = Translation3::from(centre.coords + step.fixed_rows::<3>(3));
        Isometry3::from_parts(shift, turn) * Translation3::from(-centre.coords)
    };
    Some((0..6).map(motion).collect())
}

/// Centre of rotation, and the covariance of (turn in rad, shift in mm) about it.
fn covariance(ended: &Ended) -> Option<(Point3, Matrix6<f64>)> {
    let Ended { face, points, cad_from_work, width_mm, .. } = *ended;
    let mut seeds = vec![u32::MAX; points.len()];
    let pairs = pairs_of(face, points, cad_from_work, width_mm, Beyond::Nothing, &mut seeds);
    let centre = centroid(&pairs, width_mm);
    let mut sums = Sums::zero();
    let (mut weights, mut slopes) = (0.0, 0.0);
    let mut cells: BTreeMap<[i64; 3], Vector6<f64>> = BTreeMap::new();
    for pair in pairs.iter().flatten().filter(|p| p.counts) {
        let weight = tukey_weight_of_square(pair.distance_sq, width_mm);
        if weight <= 0.0 {
            continue;
        }
        let q = pair.at - centre;
        sums.add(&q, &pair.normal, pair.residual_mm, weight);
        weights += weight;
        // psi' of the biweight: (1 - u²)(1 - 5 u²).
        slopes += weight.sqrt() * (1.0 - 5.0 * pair.distance_sq / (width_mm * width_mm));
        let turn = q.cross(&pair.normal);
        let j = Vector6::new(turn.x, turn.y, turn.z, pair.normal.x, pair.normal.y, pair.normal.z);
        let cell = [q.x, q.y, q.z].map(|c| (c / ended.cell_mm).floor() as i64);
        *cells.entry(cell).or_insert_with(Vector6::zeros) += j * (weight * pair.residual_mm);
    }
    // Single points' psi' may be negative; their mean over all points is what counts, at least a fifth of that of the weights.
    let mut information = sums.h * (slopes / f64::max(weights, 1e-9)).max(0.2);
    let mut spread = cells.values().fold(Matrix6::zeros(), |sum, s| sum + s * s.transpose());
    if let Some(rim) = ended.rim {
        let mut rims = Sums::zero();
        rim.add_to(&mut rims, cad_from_work, &centre, ended.scale_mm);
        information += rims.h;
        spread += rims.h * (ended.scale_mm * ended.scale_mm * rim.overlap());
    }
    let inverse = inverse_of(&information, super::icp::half_extent(points))?;
    Some((centre, inverse * spread * inverse.transpose()))
}

/// The inverse, with turns counted by what they move at the extent, so that no digits are lost.
fn inverse_of(information: &Matrix6<f64>, extent_mm: f64) -> Option<Matrix6<f64>> {
    let lever = 1.0 / extent_mm.max(1e-6);
    let scale = Matrix6::from_diagonal(&Vector6::new(lever, lever, lever, 1.0, 1.0, 1.0));
    let scaled = scale * information * scale;
    let inverse = scaled.cholesky()?.inverse();
    inverse.iter().all(|v| v.is_finite()).then(|| scale * inverse * scale)
}
