//! Fixed subsets of the kept points, and the frame in which a pose is searched.
//!
//! A subset is one point out of every block of consecutive points, its place in the block chosen by a hash of the block's
//! number. So it is spread over the scan as its points are (scanners write row by row), it has no stride that could fall
//! into step with the rows, and it depends on nothing but the number of points: a moved cloud gives the same subset.

use super::view::View;
use crate::fit::robust::middle_value;
use crate::geometry::{Isometry3, Point3, Vector3, decompose};
use crate::scan::ConditionedScan;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Points looked at in rasters and for rims.
const DENSE_POINTS: usize = 150_000;

/// The places in `0..count` of a subset of at most `wanted`, ascending.
pub(super) fn spread(count: usize, wanted: usize) -> Vec<u32> {
    if count <= wanted {
        return (0..count as u32).collect();
    }
    let block = |b: usize| (b as u64 * count as u64 / wanted as u64) as usize;
    (0..wanted)
        .map(|b| {
            let (first, end) = (block(b), block(b + 1));
            (first + (split_mix(b as u64) % (end - first) as u64) as usize) as u32
        })
        .collect()
}

/// SplitMix64's output function (Steele, Lea, Flood 2014).
fn split_mix(x: u64) -> u64 {
    let mut z = x.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The kept points in the *work* frame: z is the belt's normal, or without a belt the cloud's thinnest extent, towards the
/// camera if anybody knows it; origin at the middle of the points, with a belt on the belt.
pub(super) struct WorkCloud {
    /// Scan to work.
    pub work_from_scan: Isometry3,
    /// An even subset of the kept points.
    pub dense: Vec<Point3>,
    /// Whether z = 0 is the belt.
    pub on_belt: bool,
}

impl WorkCloud {
    /// Takes the kept points over. The scan must have kept points.
    pub fn new(scan: &ConditionedScan, view: &View) -> Self {
        let picks = spread(scan.kept.len(), DENSE_POINTS);
        let points_scan: Vec<Point3> =
            picks.iter().map(|&k| scan.cloud.positions[scan.kept[k as usize] as usize]).collect();
        let mut origin = median_point(&points_scan);
        let up_scan = match (&scan.belt, &view.to_camera_scan) {
            (Some(belt), _) => belt.normal.into_inner(),
            (None, Some(camera)) => {
                let thin = thin_axis(&points_scan, &origin);
                if thin.dot(camera) < 0.0 { -thin } else { thin }
            }
            (None, None) => thin_axis(&points_scan, &origin),
        };
        if let Some(belt) = &scan.belt {
            origin -= up_scan * belt.height_mm(&origin);
        }
        let turn = rotation_to_z(&up_scan);
        let work_from_scan = Isometry3::from_parts(Translation3::from(-(turn * origin).coords), turn);
        let dense = points_scan.iter().map(|p| work_from_scan * p).collect();
        Self { work_from_scan, dense, on_belt: scan.belt.is_some() }
    }

    /// The same cloud seen from the other end of z.
    pub fn flipped(&self) -> Self {
        let flip = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Self {
            work_from_scan: Isometry3::from_parts(Translation3::identity(), flip) * self.work_from_scan,
            dense: self.dense.iter().map(|p| flip * p).collect(),
            on_belt: false,
        }
    }

    /// A subset of the dense points.
    pub fn subset(&self, wanted: usize) -> Vec<Point3> {
        spread(self.dense.len(), wanted).into_iter().map(|k| self.dense[k as usize]).collect()
    }
}

/// Median of each coordinate: a middle that outliers hardly move.
fn median_point(points: &[Point3]) -> Point3 {
    let picks = spread(points.len(), 20_001);
    let coordinate = |axis: usize| {
        let mut values: Vec<f64> = picks.iter().map(|&k| points[k as usize][axis]).collect();
        middle_value(&mut values).unwrap_or(0.0)
    };
    Point3::new(coordinate(0), coordinate(1), coordinate(2))
}

/// Unit direction of least variance, the variance weighted down for far points (two rounds of a Cauchy-like weight).
fn thin_axis(points: &[Point3], middle: &Point3) -> Vector3 {
    let picks = spread(points.len(), 20_001);
    let mut axis = Vector3::z();
    let mut width = f64::INFINITY;
    for _ in 0..4 {
        let mut centre = Vector3::zeros();
        let mut total = 0.0;
        let weight = |d: &Vector3| if width.is_finite() { 1.0 / (1.0 + (d.dot(&axis) / width).powi(4)) } else { 1.0 };
        for &k in &picks {
            let d = points[k as usize] - middle;
            let w = weight(&d);
            centre += d * w;
            total += w;
        }
        centre /= total;
        let mut covariance = Matrix3::zeros();
        for &k in &picks {
            let d = points[k as usize] - middle;
            let q = d - centre;
            covariance += q * q.transpose() * weight(&d);
        }
        let Some(eigen) = decompose::symmetric_eigen(covariance / total) else { break };
        let least = eigen.eigenvalues.imin();
        axis = eigen.eigenvectors.column(least).into_owned().normalize();
        width = 3.0 * eigen.eigenvalues[least].max(1e-6).sqrt();
    }
    axis
}

/// The rotation that takes the unit vector `up` to +z and is otherwise as small as it can be.
pub(super) fn rotation_to_z(up: &Vector3) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(up, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subset_takes_one_point_of_each_block() {
        let picks = spread(100_003, 1_000);
        assert_eq!(picks.len(), 1_000);
        assert!(picks.windows(2).all(|w| w[0] < w[1]));
        for (b, &k) in picks.iter().enumerate() {
            assert!((b * 100_003 / 1_000..(b + 1) * 100_003 / 1_000).contains(&(k as usize)));
        }
        // No stride: the gaps take many values (blocks of 100 give gaps from 1 to 199).
        let mut gaps: Vec<u32> = picks.windows(2).map(|w| w[1] - w[0]).collect();
        gaps.sort_unstable();
        gaps.dedup();
        assert!(gaps.len() > 100);
        assert_eq!(spread(5, 10), vec![0, 1, 2, 3, 4]);
    }
}
