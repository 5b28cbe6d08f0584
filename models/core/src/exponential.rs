//! The matrix exponential of a linear step, where its digits mean something.
//!
//! It is computed by scaling and squaring (Higham 2005; Al-Mohy & Higham 2009). The number of squarings grows with the
//! logarithm of the norm, and roundings of the fast modes with the norm itself. Next file to read: [`crate::segment`]: a linear
//! model steps over one by it.

use nalgebra::DMatrix;

/// Largest norm: beyond it roundings of the fastest modes, 10⁻¹⁶ of the norm, are more than 10⁻⁵ of what the slow modes do
/// in the same step, and powers in the choice of squarings, up to the 27th, leave the range of numbers.
const LARGEST_NORM: f64 = 1e11;

/// e^A of a square matrix; NaN where A is not finite or its norm is above 10¹¹.
pub fn exponential(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let fits = |size: f64| size <= LARGEST_NORM;
    if matrix.column_iter().all(|column| fits(column.iter().map(|v| v.abs()).sum())) {
        matrix.exp()
    } else {
        DMatrix::from_element(matrix.nrows(), matrix.ncols(), f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_mode_beside_a_fast_one_keeps_the_digits_that_the_norm_leaves() {
        // Two stores joined by a rate a, one of which empties at a rate of 2: together they empty at 1, to 1/a.
        for a in [1e6, 1e8, 0.4 * LARGEST_NORM] {
            let step = exponential(&DMatrix::from_row_slice(2, 2, &[-a, a, a, -a - 2.0]));
            let half = 0.5 * (-1.0_f64).exp();
            let error = step.map(|v| v - half).amax();
            // Roundings of the norm, 2a, in the log2(a) squarings.
            assert!(error < 1e-15 * a + 2.0 / a, "{a:e}: {error:e}");
        }
    }

    #[test]
    fn what_is_not_finite_or_too_large_to_step_is_nan_at_once() {
        for value in [1.1 * LARGEST_NORM, 1e40, -1e300, f64::INFINITY, f64::NAN] {
            let matrix = DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, value, -2.0]);
            assert!(exponential(&matrix).iter().all(|v| v.is_nan()), "{value}");
        }
    }
}
