//! How certain the noise is that residuals at lag zero and one give, and what that does to the coefficients.
//!
//! D = h (γ₀ + 2γ₁), with γ₀ and γ₁ the mean products of an equation's residuals r_n r_n and r_n r_{n+1}. Residuals of steps between rows
//! with errors are a moving average of first order, of N whose autocovariances have N var γ₀ = 2γ₀² + 4γ₁², N var γ₁ = γ₀² + 3γ₁² and
//! N cov(γ₀, γ₁) = 4γ₀γ₁ (Bartlett, *J. R. Statist. Soc. Suppl.* 1946), so N var(γ₀ + 2γ₁) = 6γ₀² + 16γ₀γ₁ + 16γ₁²: six times γ₀² where
//! nothing is shared, and much more of what is left where errors are most of it. Read next: `fit.rs`, which asks.

use nalgebra::{DMatrix, DVector};

use super::Diffusion;

/// The degrees of freedom of a variance from lagged residuals, as a share of those of a variance from N independent ones, whose
/// relative variance is 2/N; for mean products at lag zero and one.
pub(crate) fn share(at_zero: f64, at_one: f64) -> f64 {
    let noise = 2.0f64.mul_add(at_one, at_zero);
    let spread = (3.0 * at_zero).mul_add(at_zero, 8.0 * at_one * (at_zero + at_one));
    noise * noise / spread
}

/// N times the variance of γ₀ + γ₁ + γ₋₁ of two equations that share nothing, with the mean products of each at lag zero and one: the sum of
/// γᵢ(k) γⱼ(k + m) over all k, three times for m = 0, twice for m = ±1 and once for m = ±2 (Bartlett 1946).
pub(crate) fn spread([zero_i, zero_j]: [f64; 2], [one_i, one_j]: [f64; 2]) -> f64 {
    3.0 * zero_i * zero_j + 4.0 * (zero_i * one_j + one_i * zero_j) + 8.0 * one_i * one_j
}

/// The shares of all equations, from sums of products of N residuals at lag zero and of P pairs at lag one, L x L each.
pub(crate) fn shares(
    diffusion: &Diffusion,
    (squares, n): (&DMatrix<f64>, f64),
    (lagged, pairs): (&DMatrix<f64>, f64),
) -> Vec<f64> {
    let (zero, one) = (squares.diagonal() / n, lagged.diagonal() / pairs);
    match diffusion {
        Diffusion::Isotropic => vec![share(zero.mean(), one.mean()); zero.len()],
        _ => zero.iter().zip(&one).map(|(zero, one)| share(*zero, *one)).collect(),
    }
}

/// Adds to covariance and precision of the coefficients what an uncertain D moves them by: c moves by `slope` times an independent
/// error of this standard deviation.
pub(crate) fn widen(
    covariance: &mut DMatrix<f64>,
    precision: &mut DMatrix<f64>,
    slope: &DVector<f64>,
    sd: f64,
) {
    let variance = sd * sd;
    let weighted = &*precision * slope;
    let shrunk = variance / variance.mul_add(slope.dot(&weighted), 1.0);
    covariance.ger(variance, slope, slope, 1.0);
    precision.ger(-shrunk, &weighted, &weighted, 1.0);
}

/// Entries of D that a form leaves free to err by themselves: pairs of equations, i <= j.
pub(crate) fn free(diffusion: &Diffusion, n: usize) -> Vec<Vec<(usize, usize)>> {
    let diagonal = (0..n).map(|l| (l, l));
    match diffusion {
        Diffusion::Known(_) => Vec::new(),
        Diffusion::Isotropic => vec![diagonal.collect()],
        Diffusion::Diagonal => diagonal.map(|entry| vec![entry]).collect(),
        Diffusion::Full => (0..n).flat_map(|i| (i..n).map(move |j| vec![(i, j)])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_residuals_leave_a_third_and_errors_of_the_measurement_less() {
        assert!((share(2.0, 0.0) - 1.0 / 3.0).abs() < 1e-15);
        // Twice as much error of the measurement as noise: γ₀ = 1 + 2·2, γ₁ = −2; 1 over 75 − 80 + 32.
        assert!((share(5.0, -2.0) - 1.0 / 27.0).abs() < 1e-15);
    }

    #[test]
    fn two_alike_equations_have_half_the_spread_of_one() {
        // One by itself has 6γ₀² + 16γ₀γ₁ + 16γ₁², which is (γ₀ + 2γ₁)² of two over its share.
        let (zero, one) = (5.0, -2.0);
        let by_itself = 2.0 * (zero + 2.0 * one) * (zero + 2.0 * one) / share(zero, one);
        assert!((2.0 * spread([zero; 2], [one; 2]) - by_itself).abs() < 1e-12);
        assert!((spread([2.0, 3.0], [0.0; 2]) - 18.0).abs() < 1e-15, "white residuals");
    }

    #[test]
    fn a_widened_covariance_is_the_inverse_of_its_precision() {
        let precision = DMatrix::from_row_slice(2, 2, &[3.0, 1.0, 1.0, 2.0]);
        let mut covariance = precision.clone().try_inverse().unwrap();
        let mut narrower = precision;
        widen(&mut covariance, &mut narrower, &DVector::from_vec(vec![1.0, -2.0]), 0.5);
        assert!((covariance * narrower - DMatrix::identity(2, 2)).amax() < 1e-14);
    }
}
