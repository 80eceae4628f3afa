//! The two-step fit of the endoscope paper, section 3: least squares, points beyond three standard deviations left out, least squares once
//! more. Gross outliers would make that standard deviation as large as themselves: it begins at a shape that they cannot pull away.

use super::outcome::{FitKind, FitMethod, FitOutcome, Fitted, Known, figures, fit_points, fit_weighted_near};
use super::robust::mad_scale_about_zero;
use super::shapes::FitError;
use crate::geometry::Point3;

/// Points by which the start is told; they are spread over the list.
const START_POINTS: usize = 3000;
/// Beyond so many robust standard deviations a point is gross: it has no part in the first step. Of normal residuals there is none.
const GROSS_SIGMAS: f64 = 10.0;
/// Beyond so many standard deviations of the first step a point has no part in the second.
const STEP_SIGMAS: f64 = 3.0;

/// A shape near to which most of the points lie, however wild the others are (up to a third).
///
/// # Errors
/// As [`fit_points`].
pub fn near_shape(kind: FitKind, points: &[Point3]) -> Result<Fitted, FitError> {
    let step = points.len().div_ceil(START_POINTS).max(1);
    let few: Vec<Point3> = points.iter().step_by(step).copied().collect();
    fit_points(kind, &few, FitMethod::Robust, None).map(|fit| fit.shape)
}

/// The two-step fit that begins near a shape; its kind is that of the shape. `rejected` counts gross points too.
///
/// # Errors
/// As [`fit_points`].
pub fn two_step(near: &Fitted, points: &[Point3]) -> Result<FitOutcome, FitError> {
    let kind = near.kind();
    let sizes = |shape: &Fitted, points: &[Point3]| -> Vec<f64> { points.iter().map(|p| shape.distance(p)).collect() };
    let within = |points: &[Point3], sizes: &[f64], limit: f64| -> Vec<Point3> {
        points.iter().zip(sizes).filter(|(_, d)| d.abs() <= limit).map(|(p, _)| *p).collect()
    };
    let off = sizes(near, points);
    let scale = mad_scale_about_zero(&off).filter(|s| *s > 0.0).unwrap_or(f64::INFINITY);
    let plausible = within(points, &off, GROSS_SIGMAS * scale);
    let (first, _) = fit_weighted_near(near, kind, &plausible, &[], Known::default())?;
    let off = sizes(&first, &plausible);
    let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    // Points that fit to rounding leave nothing to reject.
    let limit = if rms > 0.0 { STEP_SIGMAS * rms } else { f64::INFINITY };
    let kept = within(&plausible, &off, limit);
    let (shape, condition) = fit_weighted_near(&first, kind, &kept, &[], Known::default())?;
    let fit = figures(kind, shape, condition, &kept)?;
    Ok(FitOutcome { points: points.len(), rejected: points.len() - kept.len(), ..fit })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A bent sheet of radius 100 with noise of 1, and a share of points far above it.
    fn cylinder(count: usize, wild: f64, seed: u64) -> Vec<Point3> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| {
                let [angle, along] = [rng.random_range(-1.2..1.2), rng.random_range(-90.0..90.0)];
                let noise: f64 = StandardNormal.sample(&mut rng);
                let off = if rng.random::<f64>() < wild { rng.random_range(20.0..60.0) } else { noise };
                let radius: f64 = 100.0 + off;
                Point3::new(along, radius * f64::sin(angle), radius * f64::cos(angle))
            })
            .collect()
    }

    /// Of normal residuals 0.27 % lie beyond 3 sigma, and what is left scatters by 0.9866 of sigma.
    #[test]
    fn of_normal_scatter_so_much_is_left_out_as_theory_says() {
        let points = cylinder(40_000, 0.0, 1);
        let fit = two_step(&near_shape(FitKind::Cylinder, &points).unwrap(), &points).unwrap();
        let share = fit.rejected as f64 / 40_000.0;
        // 108 points, give or take 10: four of that.
        assert!((share - 0.0027).abs() < 0.001, "{share}");
        // The standard deviation of 40,000 normal numbers is known to 0.0035.
        assert!((fit.rms - 0.9866).abs() < 0.014, "{}", fit.rms);
        let Fitted::Cylinder(c) = fit.shape else { panic!("a cylinder") };
        let u = fit.uncertainty.unwrap().diameter.unwrap();
        assert!((c.radius - 100.0).abs() < 4.0 * 0.5 * u, "{} u {u}", c.radius);
    }

    /// A fifth of wild points pulls plain least squares off by some units; the two steps do not see them.
    #[test]
    fn wild_points_do_not_pull() {
        let points = cylinder(20_000, 0.2, 2);
        let fit = two_step(&near_shape(FitKind::Cylinder, &points).unwrap(), &points).unwrap();
        let Fitted::Cylinder(c) = fit.shape else { panic!("a cylinder") };
        let u = fit.uncertainty.unwrap().diameter.unwrap();
        assert!((c.radius - 100.0).abs() < 4.0 * 0.5 * u, "{} u {u}", c.radius);
        let plain = fit_points(FitKind::Cylinder, &points, FitMethod::ThreeSigma, None).unwrap();
        let Fitted::Cylinder(p) = plain.shape else { panic!("a cylinder") };
        assert!((p.radius - 100.0).abs() > 1.0, "the case is hard: {}", p.radius);
    }
}
