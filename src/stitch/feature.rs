//! A plane, sphere or cylinder of known size fitted to a cloud: what merging is judged by (endoscope paper, section 3).

use super::cells::Cells;
use super::units::size;
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

    /// Standard uncertainty of that difference from the one of the certificate: the points' independent errors and the certificate's, no more.
    pub fn d_r_u(&self, certified_u: f64) -> Option<f64> {
        Some(self.radius_u?.hypot(certified_u))
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

/// A fit scatters more than so many times as much as its points do beside their neighbours: they lie off the shape in a pattern, and are of another
/// one. A wrong shape comes to tens; form errors as large as the noise, and noise that neighbours share, to 1.5 to 2.
pub const MISFIT: f64 = 3.0;

/// How much points scatter about a shape beside their neighbours: the standard deviation of the distances from it less their mean in cells on it
/// that are small against the feature (a 45th of its diagonal, or four distances of points). That is the points' noise, whatever the shape. `None`
/// where too few points stand together to tell.
pub fn local_scatter(shape: &Fitted, points: &[Point3]) -> Option<f64> {
    const LEAST: usize = 100;
    let extent = size(points);
    // The distance of points on a square of that diagonal.
    let pitch = extent / (2.0 * points.len() as f64).sqrt();
    // Cells of the points themselves would part the high ones from the low ones.
    let feet: Vec<Point3> = points.iter().map(|p| foot(shape, p)).collect();
    let cells = Cells::new(&feet, (extent / 45.0).max(4.0 * pitch)).ok().filter(|_| extent > 0.0)?;
    let (mut squares, mut free) = (0.0, 0);
    for cell in 0..cells.len() {
        let off: Vec<f64> =
            cells.order[cells.points(cell)].iter().map(|k| shape.distance(&points[*k as usize])).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        squares += off.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
        free += off.len() - 1;
    }
    // What is left of rounding is no noise.
    (free >= LEAST).then(|| (squares / free as f64).sqrt().max(1e-7 * extent))
}

/// The point of a plane, sphere or cylinder that is nearest to another one.
fn foot(shape: &Fitted, p: &Point3) -> Point3 {
    let away = match shape {
        Fitted::Plane(plane) => plane.normal.into_inner(),
        Fitted::Sphere(sphere) => p - sphere.centre,
        Fitted::Cylinder(cylinder) => {
            let from = p - cylinder.point;
            from - cylinder.axis.into_inner() * cylinder.axis.dot(&from)
        }
        Fitted::Line(_) | Fitted::Circle(_) | Fitted::Cone(_) => return *p,
    };
    away.try_normalize(0.0).map_or(*p, |away| p - away * shape.distance(p))
}

/// The scatter beside neighbours of points that a shape does not fit, by [`MISFIT`].
pub fn misfit(shape: &Fitted, sigma_dev: f64, points: &[Point3]) -> Option<f64> {
    local_scatter(shape, points).filter(|noise| sigma_dev > MISFIT * noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A patch of a cylinder of radius 1000, 400 across, with noise of 5 and a share of points anywhere up to 100 off it.
    fn patch(count: usize, wild: f64) -> Vec<Point3> {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut point = |_| {
            let [x, y]: [f64; 2] = std::array::from_fn(|_| rng.random_range(-200.0..200.0));
            let noise: f64 = StandardNormal.sample(&mut rng);
            let off = if rng.random::<f64>() < wild { rng.random_range(-100.0..100.0) } else { 5.0 * noise };
            Point3::new(x, y, (1e6 - x * x).sqrt() + off)
        };
        (0..count).map(&mut point).collect()
    }

    #[test]
    fn a_shape_of_another_kind_is_told_and_noise_is_not() {
        for (count, wild) in [(2_000, 0.0), (20_000, 0.0), (20_000, 0.05)] {
            let points = patch(count, wild);
            let right = fit_feature(FeatureKind::Cylinder, &points).unwrap();
            let noise = local_scatter(&right.shape, &points).unwrap();
            // The standard deviation of 1,000 numbers and more is known to 2 %; cells of some points take their mean's share off again by the
            // count of free ones, and bend by less than a tenth of the noise.
            assert!((noise / right.sigma_dev - 1.0).abs() < 0.06, "{noise} {}", right.sigma_dev);
            assert_eq!(misfit(&right.shape, right.sigma_dev, &points), None);
        }
        // 400 across, the cylinder rises by 20 at its edges: a plane lies off it by 6 at most on average, which is hardly more than the noise.
        let points = patch(20_000, 0.0);
        let plane = fit_feature(FeatureKind::Plane, &points).unwrap();
        assert_eq!(misfit(&plane.shape, plane.sigma_dev, &points), None);
        // Ten times as large (4,000 across a radius of 10,000) it lies off by 60.
        let large: Vec<Point3> = patch(20_000, 0.0)
            .into_iter()
            .map(|p| {
                let off = p.z - (1e6 - p.x * p.x).sqrt();
                Point3::new(10.0 * p.x, 10.0 * p.y, (1e8 - 100.0 * p.x * p.x).sqrt() + off)
            })
            .collect();
        for kind in [FeatureKind::Plane, FeatureKind::Sphere] {
            let wrong = fit_feature(kind, &large).unwrap();
            assert!(misfit(&wrong.shape, wrong.sigma_dev, &large).is_some(), "{kind:?} {wrong:?}");
        }
        let right = fit_feature(FeatureKind::Cylinder, &large).unwrap();
        assert_eq!(misfit(&right.shape, right.sigma_dev, &large), None);
    }

    #[test]
    fn few_points_and_points_without_noise_are_no_misfit() {
        let plane = |count: usize| -> Vec<Point3> {
            (0..count).map(|k| Point3::new((k % 50) as f64, (k / 50) as f64, 0.25 * (k % 50) as f64)).collect()
        };
        let points = plane(2500);
        let fit = fit_feature(FeatureKind::Plane, &points).unwrap();
        assert_eq!(misfit(&fit.shape, fit.sigma_dev, &points), None);
        assert_eq!(local_scatter(&fit.shape, &plane(60)), None);
    }
}
