//! Where a robust fit begins: at the shape about which half of the points lie closest.
//!
//! Tukey's biweight goes on from a start; from one that a fifth of outliers has pulled away it may end at the wrong shape. Least squares
//! is start enough for a cylinder or cone whose residuals look like scatter. Else shapes through a few points drawn at random (the same every
//! time) are tried, the one with the least median residual is kept (Rousseeuw's least median of squares), and fitted once
//! to the half of the points that lie closest.

use super::outcome::{FitKind, Fitted, Known, distances, fit_weighted};
use super::robust::{mad_scale_about_zero, median, quantile};
use super::shapes::FitError;
use crate::geometry::Point3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Root mean square over robust scale: 1 for Gaussian residuals, less for even ones, 1.15 where one in fifty lies six sigma off.
const HEAVY: f64 = 1.15;
/// Points by which a draw is judged.
const JUDGES: usize = 600;

/// A start for the robust fit, given how least squares went.
pub(super) fn robust_start(
    kind: FitKind,
    points: &[Point3],
    known: Known,
    least_squares: Result<Fitted, FitError>,
) -> Result<Fitted, FitError> {
    let mut best = match least_squares {
        Ok(shape) => {
            let d = distances(&shape, points, known.plane);
            let rms = (d.iter().map(|d| d * d).sum::<f64>() / d.len() as f64).sqrt();
            let scattered = rms <= HEAVY * mad_scale_about_zero(&d).unwrap_or(0.0);
            // Of a given radius that outliers do not allow residuals are large and yet alike.
            let dear = matches!(kind, FitKind::Cylinder | FitKind::Cone) && known.radius.is_none();
            if scattered && dear {
                return Ok(shape);
            }
            Some((middle(&shape, points, known), shape))
        }
        Err(FitError::NotConverged { .. }) => None,
        Err(other) => return Err(other),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let judges: Vec<Point3> = points.iter().step_by(points.len().div_ceil(JUDGES)).copied().collect();
    for _ in 0..draws(kind) {
        // One more than needed: the starts of some shapes ask for it.
        let drawn: Vec<Point3> =
            (0..=kind.points_needed()).map(|_| points[rng.random_range(0..points.len())]).collect();
        let Ok((shape, _)) = fit_weighted(kind, &drawn, &[], known) else { continue };
        let score = middle(&shape, &judges, known);
        if best.as_ref().is_none_or(|(least, _)| score < *least) {
            best = Some((score, shape));
        }
    }
    let (_, shape) = best.ok_or(FitError::NotConverged { iterations: draws(kind) })?;
    Ok(fitted_to_the_closest_half(kind, points, known, &shape).unwrap_or(shape))
}

/// With a third of outliers a draw of n points is free of them with the chance (2/3)^n: 0.09 for a sphere, 0.06 for a cone. So many draws
/// leave less than one in a thousand without a good one. A cone costs milliseconds a draw, a line microseconds.
fn draws(kind: FitKind) -> usize {
    match kind {
        FitKind::Line | FitKind::Plane | FitKind::Circle | FitKind::Sphere => 500,
        FitKind::Cylinder | FitKind::Cone => 120,
    }
}

fn middle(shape: &Fitted, points: &[Point3], known: Known) -> f64 {
    let mut sizes: Vec<f64> = distances(shape, points, known.plane).iter().map(|d| d.abs()).collect();
    // Not a number is no good.
    median(&mut sizes).filter(|m| !m.is_nan()).unwrap_or(f64::INFINITY)
}

fn fitted_to_the_closest_half(kind: FitKind, points: &[Point3], known: Known, shape: &Fitted) -> Option<Fitted> {
    let sizes: Vec<f64> = distances(shape, points, known.plane).iter().map(|d| d.abs()).collect();
    let limit = quantile(&mut sizes.clone(), 0.5)?;
    let closest: Vec<Point3> = points.iter().zip(&sizes).filter(|(_, d)| **d <= limit).map(|(p, _)| *p).collect();
    let (again, _) = fit_weighted(kind, &closest, &[], known).ok()?;
    (middle(&again, points, known) <= middle(shape, points, known)).then_some(again)
}
