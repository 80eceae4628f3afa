//! The larger of two covariances, direction by direction.

use crate::geometry::decompose;
use nalgebra::{Cholesky, DMatrix};

/// The covariance `first`, grown within each block of parameters (from and to) until no direction of it has less variance than in
/// `second`. Between blocks the correlations stay those of `first`.
///
/// In the coordinates in which a block of `first` is the identity, that of `second` is turned to its own axes and every
/// variance below one is raised to one.
pub fn larger(first: &DMatrix<f64>, second: &DMatrix<f64>, blocks: &[[usize; 2]]) -> DMatrix<f64> {
    let n = first.nrows();
    let mut growth = DMatrix::identity(n, n);
    for [from, to] in blocks {
        // A parameter that is fixed has no variance.
        let free: Vec<usize> = (*from..*to).filter(|k| first[(*k, *k)] > 0.0).collect();
        let part = |m: &DMatrix<f64>| DMatrix::from_fn(free.len(), free.len(), |a, b| m[(free[a], free[b])]);
        let Some(root) = Cholesky::new(part(first)).map(|c| c.l()) else { continue };
        let Some(inverse) = root.clone().try_inverse() else { continue };
        let Some(own) = decompose::symmetric_eigen(&inverse * part(second) * inverse.transpose()) else {
            // Nothing is known where one of them is not.
            return DMatrix::from_element(n, n, f64::NAN);
        };
        let grown = own.eigenvalues.map(|v| v.max(1.0).sqrt());
        let turned = &root * &own.eigenvectors;
        let block = &turned * DMatrix::from_diagonal(&grown) * own.eigenvectors.transpose() * inverse;
        for (a, ka) in free.iter().enumerate() {
            for (b, kb) in free.iter().enumerate() {
                growth[(*ka, *kb)] = block[(a, b)];
            }
        }
    }
    &growth * first * growth.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_direction_of_a_block_has_less_variance_than_in_either() {
        let first = DMatrix::from_row_slice(3, 3, &[2.0, 0.5, 0.3, 0.5, 1.0, 0.1, 0.3, 0.1, 0.5]);
        let second = DMatrix::from_row_slice(3, 3, &[1.0, -0.8, 0.2, -0.8, 3.0, 0.0, 0.2, 0.0, 0.4]);
        let joined = larger(&first, &second, &[[0, 2], [2, 3]]);
        for k in 0..180 {
            let (sin, cos) = f64::from(k).to_radians().sin_cos();
            let along = |m: &DMatrix<f64>| cos * cos * m[(0, 0)] + 2.0 * sin * cos * m[(0, 1)] + sin * sin * m[(1, 1)];
            let least = along(&first).max(along(&second));
            // Rounding of small matrices; and it is no larger than both together.
            assert!(along(&joined) >= least - 1e-12 && along(&joined) <= along(&first) + along(&second) + 1e-12);
        }
        // The third is a block of its own in which the first is larger.
        assert!((joined[(2, 2)] - 0.5).abs() < 1e-12);
        assert!(Cholesky::new(joined).is_some());
        // The larger of equals is the same; of a fixed parameter there is nothing to grow.
        assert!((larger(&first, &first, &[[0, 3]]) - &first).amax() < 1e-12);
        let mut fixed = first.clone();
        (0..3).for_each(|k| (fixed[(1, k)], fixed[(k, 1)]) = (0.0, 0.0));
        assert_eq!(larger(&fixed, &second, &[[0, 2], [2, 3]])[(1, 1)], 0.0);
    }
}
