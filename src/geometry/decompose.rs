//! Decompositions that end whatever they are given: nalgebra's own iterate for ever on a matrix with a NaN in it.

use nalgebra::allocator::Allocator;
use nalgebra::{DMatrix, DVector, DefaultAllocator, DimDiff, DimSub, Dyn, OMatrix, OVector, SVD, SymmetricEigen, U1};

/// Far more than any matrix needs: a few for each of its columns.
const MOST_STEPS: usize = 10_000;
/// What nalgebra takes for zero in a singular value decomposition, in the matrix's largest entry.
const ZERO: f64 = 5.0 * f64::EPSILON;

/// Singular values, the largest first, with left and right vectors where they are asked for. `None` for a matrix that is not finite.
pub fn svd(matrix: DMatrix<f64>, left: bool, right: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    is_finite(matrix.iter()).then(|| SVD::try_new(matrix, left, right, ZERO, MOST_STEPS))?
}

/// Singular values in no order. `None` for a matrix that is not finite.
pub fn singular_values(matrix: DMatrix<f64>) -> Option<DVector<f64>> {
    let svd = is_finite(matrix.iter()).then(|| SVD::try_new_unordered(matrix, false, false, ZERO, MOST_STEPS))??;
    Some(svd.singular_values)
}

/// Eigenvalues, in no order, and eigenvectors of a symmetric matrix. `None` for one that is not finite.
pub fn symmetric_eigen<D: DimSub<U1>>(matrix: OMatrix<f64, D, D>) -> Option<SymmetricEigen<f64, D>>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    is_finite(matrix.iter()).then(|| SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_STEPS))?
}

/// The eigenvalues alone, in no order.
pub fn symmetric_eigenvalues<D: DimSub<U1>>(matrix: OMatrix<f64, D, D>) -> Option<OVector<f64, D>>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    is_finite(matrix.iter()).then(|| matrix.symmetric_eigenvalues())
}

fn is_finite<'a>(mut entries: impl Iterator<Item = &'a f64>) -> bool {
    entries.all(|entry| entry.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn what_is_not_finite_is_not_decomposed() {
        for fault in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let tall = |value| DMatrix::from_fn(7, 6, |r, c| if (r, c) == (3, 4) { value } else { (r * c) as f64 });
            let square = |value| Matrix3::new(2.0, 0.5, 0.0, 0.5, value, 0.0, 0.0, 0.0, 1.0);
            assert!(svd(tall(fault), true, true).is_none() && singular_values(tall(fault)).is_none());
            assert!(symmetric_eigen(square(fault)).is_none() && symmetric_eigenvalues(square(fault)).is_none());
            assert!(svd(tall(1.0), true, true).is_some() && singular_values(tall(1.0)).is_some());
            assert!(symmetric_eigen(square(1.0)).is_some() && symmetric_eigenvalues(square(1.0)).is_some());
        }
    }

    #[test]
    fn zeros_have_zero_values() {
        let values = svd(DMatrix::zeros(6, 6), false, true).unwrap().singular_values;
        assert!(values.iter().all(|v| *v == 0.0), "{values}");
        assert_eq!(symmetric_eigenvalues(Matrix3::zeros()), Some(nalgebra::Vector3::zeros()));
    }
}
