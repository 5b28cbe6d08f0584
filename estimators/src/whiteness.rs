//! Tests whether residuals are white: the portmanteau test of Ljung and Box.
//!
//! No thresholds here: the caller chooses the probability to warn at. Read next: `diagnostics.rs`.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::autocorrelation;

/// Probability of autocorrelations at least as large at lags 1 to `lags` if the series were white: the chi-square tail of
/// Q = n (n + 2) sum of rho_k^2 / (n - k), with `lags` degrees of freedom (Ljung & Box, Biometrika 65, 1978, eq. 1.3).
///
/// Missing values are NaN: they take no part in a product and are not counted. Lags beyond the series are left out. NaN
/// for fewer than two values, a constant series, or no lags.
pub fn ljung_box(series: &[f64], lags: usize) -> f64 {
    let n = series.iter().filter(|v| v.is_finite()).count();
    let lags = lags.min(n.saturating_sub(1));
    if lags == 0 {
        return f64::NAN;
    }
    let count = n as f64;
    let rho = autocorrelation(series, lags);
    let q: f64 =
        (1..=lags).map(|k| rho[k] * rho[k] / (count - k as f64)).sum::<f64>() * count * (count + 2.0);
    if q.is_nan() {
        return f64::NAN;
    }
    ChiSquared::new(lags as f64).map_or(f64::NAN, |chi| chi.sf(q))
}
