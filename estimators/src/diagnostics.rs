//! Diagnostics of residuals and posteriors: noise, autocorrelation, the band of the NIS, correlations.
//!
//! No thresholds for warnings here: the caller sets them. Read next: `analysis.rs`.

use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Third quartile of the standard normal distribution: median of |x| for unit sd.
pub(crate) const MEDIAN_ABSOLUTE: f64 = 0.674_489_750_196_081_7;

/// Degrees of freedom per third difference: the variance of the logarithm of a noise variance found from n of them is 2/(0.21 n).
/// Neighbours share three of four samples, and a median tells less than a mean square would.
const FREEDOM: f64 = 0.21;

/// Noise sd of an evenly sampled smooth series from its third differences: median |d3| / (0.6745 sqrt 20).
///
/// Differences that touch a NaN are skipped; NaN when none is left. Third differences remove any parabola, and white noise has
/// third differences of variance 1 + 9 + 9 + 1 = 20; a few jumps hardly change the median.
pub fn noise_from_third_differences(series: &[f64]) -> f64 {
    median(third_differences(series).map(f64::abs)) / (MEDIAN_ABSOLUTE * 20f64.sqrt())
}

/// The middle one of these values, or the mean of the two in the middle; NaN where there is none.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let (n, middle) = (values.len(), values.len() / 2);
    if n == 0 {
        return f64::NAN;
    }
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = if n % 2 == 1 { *upper } else { below.iter().copied().fold(f64::NEG_INFINITY, f64::max) };
    0.5 * (lower + *upper)
}

/// Third differences that touch no NaN.
fn third_differences(series: &[f64]) -> impl Iterator<Item = f64> {
    series.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).filter(|d| d.is_finite())
}

/// Number of third differences that [`noise_from_third_differences`] has of a series.
pub fn n_third_difference(series: &[f64]) -> usize {
    third_differences(series).count()
}

/// Degrees of freedom with which `n` third differences tell a noise variance: as many independent values of known mean would tell it as
/// well by their mean square.
pub fn freedom_of_third_differences(n: usize) -> f64 {
    FREEDOM * n.max(1) as f64
}

/// Autocorrelation at lags 0 to `max_lag` (length `max_lag + 1`), the biased estimate (Box & Jenkins 1976, section 2.1).
///
/// Products that touch a NaN count as zero, so values stay within [-1, 1]. NaN for a constant or empty series.
pub fn autocorrelation(series: &[f64], max_lag: usize) -> Vec<f64> {
    let deviation = Deviation::new(series);
    (0..=max_lag).map(|lag| deviation.correlation(lag)).collect()
}

/// Deviations of a series from its mean, zero where a value is missing.
struct Deviation {
    values: Vec<f64>,
    /// Number of values that are not missing.
    n: usize,
    /// Sum of squares.
    variance: f64,
}

impl Deviation {
    fn new(series: &[f64]) -> Self {
        let n = series.iter().filter(|v| v.is_finite()).count();
        let mean = series.iter().filter(|v| v.is_finite()).sum::<f64>() / n as f64;
        let values: Vec<f64> = series.iter().map(|v| if v.is_finite() { v - mean } else { 0.0 }).collect();
        let variance = values.iter().map(|d| d * d).sum();
        Self { values, n, variance }
    }

    /// Autocorrelation at one lag; NaN without variance.
    fn correlation(&self, lag: usize) -> f64 {
        let later = self.values.get(lag..).unwrap_or(&[]);
        if self.variance > 0.0 {
            later.iter().zip(&self.values).map(|(a, b)| a * b).sum::<f64>() / self.variance
        } else {
            f64::NAN
        }
    }
}

/// Number of independent values that would give the mean of this series the same variance: n / (1 + 2 sum rho).
///
/// The sum stops at the first pair of lags whose correlations no longer add up to something positive (Geyer 1992).
/// NaN for a constant or empty series; never more than the number of observed values.
pub fn effective_sample_size(series: &[f64]) -> f64 {
    let deviation = Deviation::new(series);
    if deviation.variance > 0.0 {
        // Every lag costs a pass over the series, so none is taken beyond the last that counts.
        let pairs: f64 = (0..series.len() / 2)
            .map(|k| deviation.correlation(2 * k) + deviation.correlation(2 * k + 1))
            .take_while(|s| *s > 0.0)
            .sum();
        deviation.n as f64 / (2.0 * pairs - 1.0).max(1.0)
    } else {
        f64::NAN
    }
}

/// Band that holds NIS per observation with probability `level` (in (0, 1)) when the model explains `n_used` values:
/// central chi-square quantiles over `n_used`. (NaN, NaN) without observations.
pub fn nis_band(n_used: usize, level: f64) -> (f64, f64) {
    effective_nis_band(n_used as f64, level)
}

/// The same for values that vary together as `n` independent ones do, not necessarily a whole number.
pub fn effective_nis_band(n: f64, level: f64) -> (f64, f64) {
    ChiSquared::new(n).map_or((f64::NAN, f64::NAN), |chi| {
        let tail = 0.5 * (1.0 - level);
        (chi.inverse_cdf(tail) / n, chi.inverse_cdf(1.0 - tail) / n)
    })
}

/// The same for squares over a variance that is itself uncertain, known with so many degrees of freedom (F distribution: Snedecor 1934);
/// with infinitely many it is [`nis_band`].
pub fn nis_band_of_uncertain_noise(n_used: usize, freedom: f64, level: f64) -> (f64, f64) {
    if freedom.is_infinite() {
        return nis_band(n_used, level);
    }
    FisherSnedecor::new(n_used as f64, freedom).map_or((f64::NAN, f64::NAN), |ratio| {
        let tail = 0.5 * (1.0 - level);
        (ratio.inverse_cdf(tail), ratio.inverse_cdf(1.0 - tail))
    })
}

/// Correlation matrix of a covariance; a variable without variance correlates with nothing (0, and 1 with itself).
pub fn correlation(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let sd = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| {
        let scale = sd[i] * sd[j];
        match (i == j, scale > 0.0) {
            (true, _) => 1.0,
            (false, true) => (covariance[(i, j)] / scale).clamp(-1.0, 1.0),
            (false, false) => 0.0,
        }
    })
}
