//! The effective noise of correlated residuals: their inflation, and whether they could be white.
//!
//! Next file to read: [`super::null_distribution`].

use nalgebra::DVector;
use starlings_estimators::{effective_sample_size, ljung_box};

use crate::rows::{Rows, Usage};

/// Ranges of positions among the training rows that belong to one channel of one record.
pub(crate) fn training_stretches(rows: &Rows) -> Vec<std::ops::Range<usize>> {
    let mut at = 0;
    let mut ranges = Vec::new();
    for stretch in rows.stretches().into_iter().filter(|s| rows.rows[s.start].usage == Usage::Train) {
        ranges.push(at..at + stretch.len());
        at += stretch.len();
    }
    ranges
}

/// Factor on the variance of a smooth sum of residuals that their size and correlation make, at least 1: mean square times
/// n over the effective sample size (Geyer 1992), pooled over the stretches by their length.
pub(crate) fn inflation(rows: &Rows, residual: &DVector<f64>) -> f64 {
    let mut sum = 0.0;
    let mut n = 0.0;
    for stretch in training_stretches(rows) {
        let values = &residual.as_slice()[stretch];
        let length = values.len() as f64;
        let square = values.iter().map(|v| v * v).sum::<f64>();
        let effective = effective_sample_size(values);
        let correlation = if effective > 0.0 { (length / effective).max(1.0) } else { 1.0 };
        sum += square * correlation;
        n += length;
    }
    (sum / f64::max(n, 1.0)).max(1.0)
}

/// Probability of residuals at least as autocorrelated if they were white: the smallest of the stretches, Bonferroni. `None`
/// where no stretch has twenty values that vary.
pub(crate) fn whiteness(rows: &Rows, residual: &DVector<f64>) -> Option<f64> {
    let stretches: Vec<_> = training_stretches(rows).into_iter().filter(|s| s.len() >= 20).collect();
    let p = |stretch: &std::ops::Range<usize>| {
        let values = &residual.as_slice()[stretch.clone()];
        ljung_box(values, (values.len() / 20).max(10).min(values.len() / 3))
    };
    let known: Vec<f64> = stretches.iter().map(p).filter(|p| p.is_finite()).collect();
    let smallest = known.iter().copied().fold(1.0, f64::min);
    (!known.is_empty()).then(|| (smallest * known.len() as f64).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::white;

    fn rows(n: usize) -> Rows {
        Rows::sample(n, |_| Usage::Train)
    }

    #[test]
    fn white_residuals_are_not_inflated_and_look_white() {
        let (rows, mut factors) = (rows(400), Vec::new());
        for seed in 0..20 {
            let residual = white(400, seed);
            factors.push(inflation(&rows, &residual));
            assert!(whiteness(&rows, &residual).is_some_and(|p| p > 1e-3), "seed {seed}");
        }
        let mean = factors.iter().sum::<f64>() / 20.0;
        // One at least by definition; the estimate of the correlation adds a few percent.
        assert!((1.0..1.3).contains(&mean), "{factors:?}");
    }

    #[test]
    fn an_autoregression_is_inflated_by_its_integrated_correlation() {
        let (n, rho) = (20_000, 0.8);
        let shocks = white(n, 7);
        let mut residual = DVector::zeros(n);
        for i in 1..n {
            residual[i] = rho * residual[i - 1] + (1.0_f64 - rho * rho).sqrt() * shocks[i];
        }
        // Unit variance times (1 + rho)/(1 - rho) = 9; over twenty thousand values the estimate scatters by about 10 %.
        let factor = inflation(&rows(n), &residual);
        assert!((factor / 9.0 - 1.0).abs() < 0.3, "{factor}");
        assert!(whiteness(&rows(n), &residual).is_some_and(|p| p < 1e-10));
    }

    #[test]
    fn few_values_and_constant_residuals_tell_nothing_of_correlation() {
        assert_eq!(whiteness(&rows(19), &white(19, 1)), None);
        assert_eq!(whiteness(&rows(50), &DVector::from_element(50, 2.0)), None);
        assert_eq!(whiteness(&rows(0), &DVector::zeros(0)), None);
    }
}
