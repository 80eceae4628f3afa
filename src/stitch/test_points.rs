//! Points for tests.

use crate::geometry::Point3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Points even in a box about the origin.
pub(super) fn scattered(count: usize, seed: u64, size: [f64; 3]) -> Vec<Point3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| Point3::from(size.map(|s| s * (rng.random::<f64>() - 0.5)))).collect()
}
