//! Eigenvalues and singular values with a limit on their iterations: a decomposition that does not end is an error that
//! names its matrix.
//!
//! The iterations are nalgebra's; the limit and the error are added here, and what its singular values lack, in
//! `spectral/jacobi.rs`. Read next: `information.rs`, which computes the information of the data from a decomposition.

mod jacobi;

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
pub type Svd = (DMatrix<f64>, DVector<f64>, DMatrix<f64>);

/// M = U diag(s) V^T, with as many columns in U and V as M has rows or columns, whichever are fewer; `what` names M. The columns
/// of U and V are orthonormal where s is zero, too.
///
/// # Errors
/// `NotFinite` for an entry that is no finite number, `NotDecomposed` when the iteration does not end.
pub fn svd(matrix: &DMatrix<f64>, what: &'static str) -> Result<Svd, EstimatorError> {
    let limit = limit(matrix);
    svd_within(matrix, what, limit)
}

fn svd_within(matrix: &DMatrix<f64>, what: &'static str, limit: usize) -> Result<Svd, EstimatorError> {
    finite(matrix, what)?;
    if matrix.nrows() < matrix.ncols() {
        let (u, values, v_t) = svd_within(&matrix.transpose(), what, limit)?;
        return Ok((v_t.transpose(), values, u.transpose()));
    }
    let found = matrix.clone().try_svd(false, true, 5.0 * f64::EPSILON, limit);
    let parts = found.and_then(|svd| jacobi::finish(matrix, svd.v_t?.transpose()));
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
    use proptest::prelude::*;

    use super::*;

    fn dense(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| 1.0 / (1.0 + (i + j) as f64) + if i == j { i as f64 } else { 0.0 })
    }

    #[test]
    fn an_iteration_that_reaches_its_limit_is_an_error_that_names_the_matrix() {
        let expected = EstimatorError::NotDecomposed { what: "posterior", limit: 1 };
        assert_eq!(eigen_within(dense(8), "posterior", 1).map(|_| ()), Err(expected.clone()));
        assert_eq!(svd_within(&dense(8), "posterior", 1).map(|_| ()), Err(expected.clone()));
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
            assert_eq!(svd(&matrix, "noise").map(|_| ()), expected);
        }
    }

    #[test]
    fn within_the_limit_the_parts_make_the_matrix_again() {
        let matrix = dense(40);
        let parts = eigen(matrix.clone(), "test").expect("ends");
        let again =
            &parts.eigenvectors * DMatrix::from_diagonal(&parts.eigenvalues) * parts.eigenvectors.transpose();
        let (u, s, v_t) = svd(&matrix, "test").expect("ends");
        // Rounding of sums of forty products.
        assert!((again - &matrix).amax() < 1e-12 * matrix.norm());
        assert!((u * DMatrix::from_diagonal(&s) * v_t - &matrix).amax() < 1e-12 * matrix.norm());
    }

    /// The parts make the matrix again, and their columns are orthonormal.
    fn check(matrix: &DMatrix<f64>) {
        let (u, s, v_t) = svd(matrix, "test").expect("ends");
        let (p, norm) = (s.len(), matrix.norm());
        let identity = DMatrix::identity(p, p);
        // Rounding of sums of a few hundred products.
        let rounding = 1e-13;
        assert!((u.tr_mul(&u) - &identity).amax() < rounding, "{matrix} {u}");
        assert!((&v_t * v_t.transpose() - &identity).amax() < rounding, "{matrix} {v_t}");
        assert!((u * DMatrix::from_diagonal(&s) * v_t - matrix).amax() <= rounding * norm, "{matrix} {s}");
        assert!(s.as_slice().is_sorted_by(|a, b| a >= b), "{s}");
    }

    #[test]
    fn matrices_of_ones_have_one_singular_value() {
        for rows in 1..=30 {
            for columns in 1..=30 {
                let ones = DMatrix::from_element(rows, columns, 1.0);
                check(&ones);
                let (_, s, _) = svd(&ones, "test").expect("ends");
                let expected = ((rows * columns) as f64).sqrt();
                assert!((s[0] - expected).abs() < 1e-12 * expected && s.iter().skip(1).all(|s| *s < 1e-12));
            }
        }
    }

    #[test]
    fn a_matrix_of_whole_numbers_has_singular_values_of_its_norm() {
        let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 2.0, 2.0, 2.0, -1.0, -1.0, 2.0, 1.0, -1.0]);
        check(&matrix);
        let (_, s, _) = svd(&matrix, "test").expect("ends");
        assert!((s.norm_squared() - 21.0).abs() < 1e-13);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Small whole numbers make many matrices of deficient rank and with equal singular values; scales make others.
        #[test]
        fn any_matrix_is_the_product_of_its_parts(
            values in proptest::collection::vec(-2_i32..3, 64),
            rows in 1_usize..9,
            columns in 1_usize..9,
            scales in proptest::collection::vec(-6_i32..7, 8),
        ) {
            let matrix = DMatrix::from_fn(rows, columns, |i, j| f64::from(values[8 * i + j]));
            check(&matrix);
            check(&DMatrix::from_fn(rows, columns, |i, j| matrix[(i, j)] * 10_f64.powi(scales[j])));
            let symmetric = matrix.tr_mul(&matrix);
            let parts = eigen(symmetric.clone(), "test").expect("ends");
            let again = &parts.eigenvectors
                * DMatrix::from_diagonal(&parts.eigenvalues)
                * parts.eigenvectors.transpose();
            prop_assert!((again - &symmetric).amax() <= 1e-13 * symmetric.norm(), "{symmetric}");
        }

        #[test]
        fn full_matrices_are_the_products_of_their_parts(
            values in proptest::collection::vec(-1.0_f64..1.0, 64),
            rows in 1_usize..9,
            columns in 1_usize..9,
        ) {
            check(&DMatrix::from_fn(rows, columns, |i, j| values[8 * i + j]));
        }
    }
}
