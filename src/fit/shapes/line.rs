//! The line: its direction is the first principal axis.

use super::{FitError, Normaliser, frame, turned};
use crate::fit::gauss_newton::Shape;
use crate::geometry::{Point3, UnitVector3, Vector3, decompose};
use nalgebra::{DMatrix, SVector};

/// A line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// The centroid of the points.
    pub point: Point3,
    /// Its direction, either way.
    pub direction: UnitVector3,
}

impl Line {
    /// Distance of a point from it.
    pub fn distance(&self, p: &Point3) -> f64 {
        (p - self.point).cross(&self.direction).norm()
    }
}

impl Shape<4, 2> for Line {
    fn residuals(&self, point: &Point3) -> ([f64; 2], [[f64; 4]; 2]) {
        let (u, v) = frame(&self.direction);
        let d = point - self.point;
        let along = d.dot(&self.direction);
        ([d.dot(&u), d.dot(&v)], [[-1.0, 0.0, -along, 0.0], [0.0, -1.0, 0.0, -along]])
    }

    fn moved(&self, step: &SVector<f64, 4>) -> Self {
        let (u, v) = frame(&self.direction);
        Self { point: self.point + u * step[0] + v * step[1], direction: turned(&self.direction, step[2], step[3]) }
    }

    fn is_sound(&self) -> bool {
        true
    }
}

/// Singular values and right singular vectors of the centred points, largest first.
pub(in crate::fit) fn principal_axes(
    points: &[Point3],
    weights: &[f64],
) -> Result<(Point3, [f64; 3], [Vector3; 3]), FitError> {
    let normaliser = Normaliser::of(points, 2)?;
    let scaled = normaliser.apply(points);
    let weight = |k: usize| weights.get(k).copied().unwrap_or(1.0);
    let total: f64 = (0..scaled.len()).map(weight).sum();
    if total <= 0.0 {
        return Err(FitError::Degenerate);
    }
    let mean = scaled.iter().enumerate().fold(Vector3::zeros(), |sum, (k, p)| sum + p.coords * weight(k)) / total;
    // QR first: the singular values of R are those of the tall matrix, without the cost of its left vectors.
    let rows = scaled.len().max(3);
    let tall = DMatrix::from_fn(rows, 3, |k, c| match scaled.get(k) {
        Some(p) => (p[c] - mean[c]) * weight(k).sqrt(),
        None => 0.0,
    });
    let svd = decompose::svd(tall.qr().r(), false, true).ok_or(FitError::Degenerate)?;
    let v_t = svd.v_t.ok_or(FitError::Degenerate)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    let axes = order.map(|k| Vector3::new(v_t[(k, 0)], v_t[(k, 1)], v_t[(k, 2)]));
    let values = order.map(|k| svd.singular_values[k]);
    Ok((normaliser.back(&Point3::from(mean)), values, axes))
}

/// Fits a line; `weights` is empty for equal weights. Also the ratio of the second to the first principal spread
/// inverted: how far the direction is from being free.
pub fn fit_line(points: &[Point3], weights: &[f64]) -> Result<(Line, f64), FitError> {
    let (point, values, axes) = principal_axes(points, weights)?;
    if values[0] <= 0.0 || values[1] > values[0] * (1.0 - 1e-12) {
        return Err(FitError::Degenerate);
    }
    let direction = UnitVector3::try_new(axes[0], 0.0).ok_or(FitError::Degenerate)?;
    Ok((Line { point, direction }, 1.0 / (1.0 - values[1] / values[0])))
}
