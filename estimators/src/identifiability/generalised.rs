//! Generalised sensitivity functions (Thomaseth & Cobelli 1999): when the data determine each parameter.
//!
//! A function rises where the data bear on its parameter; it may fall where parameters are correlated, and it always ends
//! at one.

use nalgebra::DMatrix;

use super::fisher::Fisher;

/// GS_j after every step: the sum over rows of (F^{-1} s_i)_j s_ij; `None` without F^{-1}.
pub(super) fn cumulated(
    scaled: &DMatrix<f64>,
    fisher: &Fisher,
    step: &[usize],
    n_step: usize,
) -> Vec<Option<Vec<f64>>> {
    // In units of the prior sd, as the factors of one cancel those of the other.
    let gain = scaled * fisher.inverse();
    let function = |j: usize| {
        if fisher.is_hidden(j) {
            return None;
        }
        let mut sums = vec![0.0; n_step];
        for (row, k) in step.iter().enumerate() {
            sums[*k] += gain[(row, j)] * scaled[(row, j)];
        }
        let mut total = 0.0;
        for sum in &mut sums {
            total += *sum;
            *sum = total;
        }
        Some(sums)
    };
    (0..scaled.ncols()).map(function).collect()
}
