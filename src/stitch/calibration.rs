//! Quality by the calibration nearby (endoscope paper, section 4.2): distance to the nearest calibrated feature, its reprojection error,
//! and how many features lie around it.

use crate::geometry::Point3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// A feature that a camera or projector was calibrated with, in the view's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedFeature {
    /// Where it was.
    pub position: Point3,
    /// Norm of its reprojection error, pixels.
    pub reprojection_px: f32,
}

/// Share of all features that lie within the cut-off distance of one on average: the middle of the rule's 1 to 2 %.
const NEIGHBOUR_SHARE: f64 = 0.015;
/// Features among which the cut-off distance is told: the first of a list so spread.
const SAMPLED: usize = 2000;

/// Why features cannot be asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CalibrationError {
    /// There are none.
    #[error("found no calibrated feature, expected at least one")]
    None,
    /// A place is no number, or there are more than can be numbered.
    #[error("the calibrated features cannot be sorted by place: {0}")]
    NotSorted(String),
}

/// Calibrated features, to be asked for the nearest.
pub struct Calibration {
    features: Vec<CalibratedFeature>,
    density: Vec<f32>,
    cut_off: f64,
    tree: Tree,
}

/// What the calibration says of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// Distance to the nearest feature.
    pub distance: f32,
    /// Its reprojection error, pixels.
    pub reprojection_px: f32,
    /// Features within the cut-off distance of it, itself left out: equation (3).
    pub density: f32,
}

impl Calibration {
    /// Of features.
    ///
    /// # Errors
    /// No feature, or one whose place is no number.
    pub fn new(features: Vec<CalibratedFeature>) -> Result<Self, CalibrationError> {
        if features.is_empty() {
            return Err(CalibrationError::None);
        }
        let positions: Vec<Point3> = features.iter().map(|f| f.position).collect();
        if !positions.iter().all(|p| p.coords.iter().all(|c| c.is_finite())) {
            return Err(CalibrationError::NotSorted("a coordinate is no number".to_owned()));
        }
        let tree = Tree::new(&positions)?;
        let cut_off = cut_off(&positions);
        let density = positions.iter().map(|p| (tree.within(p, cut_off).saturating_sub(1)) as f32).collect();
        Ok(Self { features, density, cut_off, tree })
    }

    /// How far the features reach: the diagonal of their box.
    pub fn size(&self) -> f64 {
        crate::geometry::Aabb::of_points(self.features.iter().map(|f| &f.position)).map_or(0.0, |b| b.extents().norm())
    }

    /// The distance d_c within which features count as neighbours.
    pub fn cut_off(&self) -> f64 {
        self.cut_off
    }

    /// Of the nearest feature.
    pub fn near(&self, place: &Point3) -> Near {
        let (k, distance) = self.tree.nearest(place);
        Near { distance: distance as f32, reprojection_px: self.features[k].reprojection_px, density: self.density[k] }
    }
}

/// The distance within which 1.5 % of the other features lie on average: that quantile of all distances of pairs.
fn cut_off(positions: &[Point3]) -> f64 {
    let step = positions.len().div_ceil(SAMPLED);
    let few: Vec<&Point3> = positions.iter().step_by(step.max(1)).collect();
    let pairs = few.iter().enumerate().flat_map(|(k, a)| few[..k].iter().map(move |b| (*a - **b).norm()));
    let mut distances: Vec<f64> = pairs.collect();
    if distances.is_empty() {
        return 0.0;
    }
    let at = ((distances.len() - 1) as f64 * NEIGHBOUR_SHARE).round() as usize;
    let (_, quantile, beyond) = distances.select_nth_unstable_by(at, f64::total_cmp);
    let next = beyond.iter().copied().min_by(f64::total_cmp).unwrap_or(*quantile);
    // Between two distances, so that no pair lies on the bound, where rounding would decide.
    0.5 * (*quantile + next)
}

/// Features by place.
struct Tree(ImmutableKdTree<f64, 3>);

impl Tree {
    fn new(positions: &[Point3]) -> Result<Self, CalibrationError> {
        let entries: Vec<[f64; 3]> = positions.iter().map(|p| p.coords.into()).collect();
        ImmutableKdTree::new_from_slice(&entries).map(Self).map_err(|e| CalibrationError::NotSorted(e.to_string()))
    }

    /// Index and distance of the nearest feature.
    fn nearest(&self, place: &Point3) -> (usize, f64) {
        let near = self.0.query(&place.coords.into()).nearest_one::<SquaredEuclidean<f64>>().execute();
        (near.item as usize, near.distance.sqrt())
    }

    /// How many features lie nearer than a distance.
    fn within(&self, place: &Point3, distance: f64) -> usize {
        let place = place.coords.into();
        let around = self.0.query(&place).within::<SquaredEuclidean<f64>>(distance * distance);
        around.unsorted().exclusive_boundaries().execute().len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::test_points::scattered;

    fn features(positions: &[Point3]) -> Vec<CalibratedFeature> {
        let one = |(k, p): (usize, &Point3)| CalibratedFeature { position: *p, reprojection_px: k as f32 };
        positions.iter().enumerate().map(one).collect()
    }

    #[test]
    fn the_nearest_feature_tells_distance_error_and_density() {
        // Flat, as the features of one board are, and in space.
        for size in [[8.0, 6.0, 0.0], [8.0, 6.0, 5.0]] {
            let positions = scattered(900, 11, size);
            let calibration = Calibration::new(features(&positions)).unwrap();
            for place in scattered(200, 12, [10.0, 8.0, 6.0]) {
                let squared = |k: &usize| (positions[*k] - place).norm_squared();
                let nearest = (0..900).min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap();
                let near = calibration.near(&place);
                assert_eq!(near.reprojection_px, nearest as f32);
                assert!((f64::from(near.distance) - squared(&nearest).sqrt()).abs() < 1e-6);
                let around = positions.iter().filter(|p| (*p - positions[nearest]).norm() < calibration.cut_off());
                assert_eq!(near.density, (around.count() - 1) as f32);
            }
        }
    }

    /// By the rule 1 to 2 % of all features lie within the cut-off distance, on average.
    #[test]
    fn the_cut_off_distance_follows_the_rule() {
        let positions = scattered(3000, 13, [20.0, 20.0, 10.0]);
        let calibration = Calibration::new(features(&positions)).unwrap();
        let mean = positions.iter().map(|p| f64::from(calibration.near(p).density)).sum::<f64>() / 3000.0;
        // 2000 of them tell the quantile of 2 million distances to some per cent.
        assert!((0.01..0.02).contains(&(mean / 3000.0)), "{mean}");
    }

    #[test]
    fn no_feature_or_one_that_is_no_number_is_refused_and_one_is_enough() {
        assert_eq!(Calibration::new(Vec::new()).err(), Some(CalibrationError::None));
        let odd = [Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0)];
        assert!(matches!(Calibration::new(features(&odd)), Err(CalibrationError::NotSorted(_))));
        let one = Calibration::new(features(&odd[..1])).unwrap().near(&Point3::new(0.0, 3.0, 4.0));
        assert_eq!(one, Near { distance: 5.0, reprojection_px: 0.0, density: 0.0 });
    }
}
