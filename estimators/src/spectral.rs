//! Eigenvalues and singular values with a limit on their iterations: a decomposition that does not end is an error that
//! names its matrix.
//!
//! The iterations are nalgebra's; the limit and the error are added here. Read next: `information.rs`, which computes the
//! information of the data from a decomposition.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

use crate::EstimatorError;

/// Iterations per row. The implicit QR iteration takes two or three on average (Golub & Van Loan 2013, section 8.3.3).
const PER_ROW: usize = 100;
/// Rows that small matrices are counted as.
const FEWEST: usize = 30;

/// Eigenvalues and eigenvectors of a symmetric matrix; `what` names it.
///
/// # Errors
/// `NotFinite` for an entry that is no finite number, `NotDecomposed` when the iteration does not end.
pub(crate) fn eigen(
    matrix: DMatrix<f64>,
    what: &'static str,
) -> Result<SymmetricEigen<f64, Dyn>, EstimatorError> {
    let limit = limit(&matrix);
    eigen_within(matrix, what, limit)
}

fn eigen_within(
    matrix: DMatrix<f64>,
    what: &'static str,
    limit: usize,
) -> Result<SymmetricEigen<f64, Dyn>, EstimatorError> {
    finite(&matrix, what)?;
    SymmetricEigen::try_new(matrix, f64::EPSILON, limit).ok_or(EstimatorError::NotDecomposed { what, limit })
}

/// U, s in decreasing order and V^T of M = U diag(s) V^T.
pub(crate) type Svd = (DMatrix<f64>, DVector<f64>, DMatrix<f64>);

/// M = U diag(s) V^T; `what` names M.
///
/// # Errors
/// As for [`eigen`].
pub(crate) fn svd(matrix: DMatrix<f64>, what: &'static str) -> Result<Svd, EstimatorError> {
    let limit = limit(&matrix);
    svd_within(matrix, what, limit)
}

fn svd_within(matrix: DMatrix<f64>, what: &'static str, limit: usize) -> Result<Svd, EstimatorError> {
    finite(&matrix, what)?;
    let found = matrix.try_svd(true, true, 5.0 * f64::EPSILON, limit);
    let parts = found.and_then(|svd| Some((svd.u?, svd.singular_values, svd.v_t?)));
    parts.ok_or(EstimatorError::NotDecomposed { what, limit })
}

fn limit(matrix: &DMatrix<f64>) -> usize {
    PER_ROW * matrix.nrows().max(matrix.ncols()).max(FEWEST)
}

/// The iteration on anything else would not end.
fn finite(matrix: &DMatrix<f64>, what: &'static str) -> Result<(), EstimatorError> {
    if matrix.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(EstimatorError::NotFinite { what }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dense(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| 1.0 / (1.0 + (i + j) as f64) + if i == j { i as f64 } else { 0.0 })
    }

    #[test]
    fn an_iteration_that_reaches_its_limit_is_an_error_that_names_the_matrix() {
        let expected = EstimatorError::NotDecomposed { what: "posterior", limit: 1 };
        assert_eq!(eigen_within(dense(8), "posterior", 1).map(|_| ()), Err(expected.clone()));
        assert_eq!(svd_within(dense(8), "posterior", 1).map(|_| ()), Err(expected.clone()));
        assert_eq!(
            expected.to_string(),
            "the decomposition of the posterior matrix did not end within 1 iterations: its entries are out of all \
             proportion, scale priors and noise to the data"
        );
    }

    #[test]
    fn what_is_not_finite_is_never_iterated_on() {
        for bad in [f64::NAN, f64::INFINITY] {
            let mut matrix = dense(4);
            matrix[(2, 2)] = bad;
            let expected = Err(EstimatorError::NotFinite { what: "noise" });
            assert_eq!(eigen(matrix.clone(), "noise").map(|_| ()), expected);
            assert_eq!(svd(matrix, "noise").map(|_| ()), expected);
        }
    }

    #[test]
    fn within_the_limit_the_parts_make_the_matrix_again() {
        let matrix = dense(40);
        let parts = eigen(matrix.clone(), "test").expect("ends");
        let again =
            &parts.eigenvectors * DMatrix::from_diagonal(&parts.eigenvalues) * parts.eigenvectors.transpose();
        let (u, s, v_t) = svd(matrix.clone(), "test").expect("ends");
        // Rounding of sums of forty products.
        assert!((again - &matrix).amax() < 1e-12 * matrix.norm());
        assert!((u * DMatrix::from_diagonal(&s) * v_t - &matrix).amax() < 1e-12 * matrix.norm());
    }
}
