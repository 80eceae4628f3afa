//! A plane, sphere or cylinder of known size fitted to a cloud: what merging is judged by (endoscope paper, section 3).

use crate::fit::two_step::{near_shape, two_step};
use crate::fit::{FitError, FitKind, Fitted};
use crate::geometry::Point3;
use crate::plan::merge::FeatureKind;

/// How a cloud fits a feature. Lengths in the unit of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureFit {
    /// The shape.
    pub shape: Fitted,
    /// Its radius; none of a plane.
    pub radius: Option<f64>,
    /// Standard uncertainty of the radius if the points' errors were independent. They are not: what neighbours have in common comes on top.
    pub radius_u: Option<f64>,
    /// Standard deviation of all points' distances from it, also of those that the fit left out.
    pub sigma_dev: f64,
    /// Points.
    pub points: usize,
    /// Of these, left out by the fit.
    pub rejected: usize,
}

impl FeatureFit {
    /// Fitted less certified radius.
    pub fn d_r(&self, certified: Option<f64>) -> Option<f64> {
        Some(self.radius? - certified?)
    }
}

/// The shape that `fit` calls by that kind.
pub fn fit_kind(kind: FeatureKind) -> FitKind {
    match kind {
        FeatureKind::Plane => FitKind::Plane,
        FeatureKind::Sphere => FitKind::Sphere,
        FeatureKind::Cylinder => FitKind::Cylinder,
    }
}

/// The two-step fit from a robust start.
///
/// # Errors
/// As [`two_step`].
pub fn fit_feature(kind: FeatureKind, points: &[Point3]) -> Result<FeatureFit, FitError> {
    fit_feature_near(&near_shape(fit_kind(kind), points)?, points)
}

/// The two-step fit from a shape that is near already.
///
/// # Errors
/// As [`two_step`].
pub fn fit_feature_near(near: &Fitted, points: &[Point3]) -> Result<FeatureFit, FitError> {
    let fit = two_step(near, points)?;
    let sum: f64 = points.iter().map(|p| fit.shape.distance(p).powi(2)).sum();
    Ok(FeatureFit {
        shape: fit.shape,
        radius: fit.shape.radius(),
        radius_u: fit.uncertainty.and_then(|u| u.diameter).map(|u| 0.5 * u),
        sigma_dev: (sum / points.len() as f64).sqrt(),
        points: points.len(),
        rejected: fit.rejected,
    })
}
