//! The camera's side as a cloud's own normals tell it.

use crate::geometry::{PointCloud, UnitVector3, Vector3};

/// A mean normal shorter than this tells no side.
const LEAST_MEAN_NORMAL: f64 = 0.3;

/// Mean of the kept points' normals (a file's normals point out to the camera), if it is clear enough.
pub(super) fn mean_normal(cloud: &PointCloud, kept: &[u32]) -> Option<UnitVector3> {
    let normals = cloud.normals.as_ref()?;
    let unit = kept.iter().filter_map(|&k| {
        let [x, y, z] = normals[k as usize].map(f64::from);
        let normal = Vector3::new(x, y, z);
        (normal.iter().all(|c| c.is_finite())).then(|| normal.try_normalize(0.0)).flatten()
    });
    let (sum, count) = unit.fold((Vector3::zeros(), 0.0), |(sum, count), n| (sum + n, count + 1.0));
    let mean = sum / f64::max(count, 1.0);
    (mean.norm() >= LEAST_MEAN_NORMAL).then(|| UnitVector3::new_normalize(mean))
}
