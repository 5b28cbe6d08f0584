//! Tests whether several series of residuals of one kind are white together: pooled autocorrelation around zero, and the factor
//! by which correlation raises the variance of a mean.
//!
//! Residuals of a right model have mean zero, so no mean is taken away: an offset shows as correlation at every lag.
//! No thresholds here: the caller chooses the probability to warn at. Read next: `whiteness.rs`.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Series of one kind, such as the residuals of the components of a field. Missing values are NaN and count as nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pooled {
    series: Vec<Vec<f64>>,
    n: usize,
    squares: f64,
}

impl Pooled {
    /// No series.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a series.
    pub fn add(&mut self, series: Vec<f64>) {
        for value in series.iter().filter(|v| v.is_finite()) {
            self.n += 1;
            self.squares += value * value;
        }
        self.series.push(series);
    }

    /// Number of values that are not missing, over all series.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Length of the longest series.
    pub fn length(&self) -> usize {
        self.series.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Autocorrelation around zero at one lag, all series together; NaN where all values are zero or missing.
    pub fn autocorrelation(&self, lag: usize) -> f64 {
        let of_series = |series: &Vec<f64>| -> f64 {
            let later = series.get(lag..).unwrap_or(&[]);
            later.iter().zip(series).map(|(a, b)| a * b).filter(|product| product.is_finite()).sum()
        };
        self.series.iter().map(of_series).sum::<f64>() / self.squares
    }

    /// Probability of autocorrelations at least as large at lags 1 to `lags` if all values were independent: the test of Ljung
    /// and Box (Biometrika 65, 1978, eq. 1.3) with the pooled autocorrelations and the number of all values. NaN without lags.
    pub fn ljung_box(&self, lags: usize) -> f64 {
        let lags = lags.min(self.length().saturating_sub(1));
        let n = self.n as f64;
        let q: f64 =
            (1..=lags).map(|k| self.autocorrelation(k).powi(2) / (n - k as f64)).sum::<f64>() * n * (n + 2.0);
        if lags == 0 || q.is_nan() {
            return f64::NAN;
        }
        ChiSquared::new(lags as f64).map_or(f64::NAN, |chi| chi.sf(q))
    }

    /// Factor by which correlation raises the variance of a mean, 1 + 2 sum rho, at least 1: the integrated autocorrelation
    /// time. The sum stops at the first pair of lags that no longer adds up to something positive (Geyer 1992, section 3.3).
    pub fn inflation(&self) -> f64 {
        if self.squares > 0.0 {
            let pair = |k: usize| self.autocorrelation(2 * k) + self.autocorrelation(2 * k + 1);
            let pairs: f64 = (0..self.length().div_ceil(2)).map(pair).take_while(|s| *s > 0.0).sum();
            (2.0 * pairs - 1.0).max(1.0)
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_of_ones_is_one_value_and_alternating_ones_are_all_of_them() {
        let mut ones = Pooled::new();
        ones.add(vec![1.0; 8]);
        // Products at lag k: 8 - k of 8.
        assert!((ones.autocorrelation(2) - 0.75).abs() < 1e-15);
        // 1 + 2 (7 + 6 + ... + 1) / 8 = 8.
        assert!((ones.inflation() - 8.0).abs() < 1e-12);
        let mut alternating = Pooled::new();
        alternating.add(vec![1.0, -1.0, 1.0, -1.0]);
        assert!((alternating.inflation() - 1.0).abs() < 1e-15);
        assert!(Pooled::new().inflation() >= 1.0 && Pooled::new().ljung_box(5).is_nan());
    }

    #[test]
    fn values_are_pooled_over_series_and_missing_ones_left_out() {
        let mut pooled = Pooled::new();
        pooled.add(vec![2.0, 1.0, f64::NAN, 1.0]);
        pooled.add(vec![1.0, 1.0]);
        assert_eq!(pooled.n(), 5);
        // Products 2 and 1 over squares 4 + 1 + 1 + 1 + 1.
        assert!((pooled.autocorrelation(1) - 3.0 / 8.0).abs() < 1e-15);
    }

    #[test]
    fn one_series_of_mean_zero_has_the_probability_of_the_plain_test() {
        let series = vec![0.5, -1.0, 0.25, 0.75, -0.5, 1.0, -1.0, 0.5, -0.75, 0.25];
        let mut pooled = Pooled::new();
        pooled.add(series.clone());
        assert!((pooled.ljung_box(3) - crate::ljung_box(&series, 3)).abs() < 1e-12);
    }
}
