//! The variance of a sum of correlated scores from their lowest-frequency cosines.
//!
//! The spectrum at zero is the mean square of the first B coefficients of the cosine transform, which has B degrees of freedom and
//! takes Student's t (Müller 2007; Lazarus, Lewis, Stock & Watson 2018). B is the number with the least mean squared error
//! for this basis (Phillips 2005), its curvature from an autoregression of the scores (Andrews 1991, eq. 6.4). Scores, not
//! residuals: noise that changes its size with the sensitivity is covered. Deliberately one parameter at a time. Read next:
//! `working.rs`.

use std::f64::consts::PI;

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::quantiles::Z95;

/// Largest autocorrelation that the choice of B takes into account (Andrews 1991, note to table II).
const MOST_CORRELATED: f64 = 0.97;
/// Cosines at most: beyond, Student's t is a Gaussian.
const MOST: usize = 400;

/// Variance of the sum of the scores of all records, each a series in time, times the square of the t quantile over the Gaussian
/// one. Their degrees of freedom are joined after Satterthwaite (1946).
pub(super) fn variance(records: &[Vec<f64>]) -> f64 {
    let parts: Vec<Part> = records.iter().map(|scores| part(scores, records.len())).collect();
    let sum: f64 = parts.iter().map(|part| part.variance).sum();
    let spread: f64 = parts.iter().map(|part| part.variance * part.variance / part.freedom).sum();
    if sum > 0.0 && spread > 0.0 { sum * (quantile(sum * sum / spread) / Z95).powi(2) } else { 0.0 }
}

/// Variance of the sum of white scores whose size follows no stated noise: their sum of squares (White 1980), times the t quantile
/// as above. `None` unless it is above what errors of one size would make it, by more than twice the standard error of
/// that; `expected` are the variances of the scores for errors of variance one, record after record.
pub(super) fn uneven(records: &[Vec<f64>], expected: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut squares, mut sum, mut spread, mut size, mut n) = (0.0, 0.0, 0.0, 0.0, 0_u32);
    for (score, expected) in records.iter().flatten().zip(expected) {
        squares += score * score;
        sum += expected;
        spread += expected * expected;
        if expected > 0.0 {
            size += score * score / expected;
            n += 1;
        }
    }
    let (size, relative) = (size / f64::from(n.max(1)), (2.0 * spread).sqrt() / sum);
    let freedom = 2.0 / (relative * relative);
    (squares > size * sum * (1.0 + 2.0 * relative)).then(|| squares * (quantile(freedom) / Z95).powi(2))
}

/// The 97.5 % quantile of Student's t.
fn quantile(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(Z95, |t| t.inverse_cdf(0.975))
}

/// The variance of the sum of one record's scores, and its degrees of freedom.
struct Part {
    variance: f64,
    freedom: f64,
}

fn part(scores: &[f64], n_record: usize) -> Part {
    let n = scores.len();
    let count = cosines(scores);
    let squares: f64 = (1..=count).map(|k| coefficient(scores, k).powi(2)).sum();
    // With several records the sum of one record's scores is an error too: the fit sets only the sum over all records to zero.
    if n_record == 1 {
        return Part { variance: n as f64 * squares / count as f64, freedom: count as f64 };
    }
    let others = n_record as f64 / (n_record as f64 - 1.0);
    let mean = scores.iter().sum::<f64>().powi(2) / n as f64 * others;
    let freedom = (count + 1) as f64;
    Part { variance: n as f64 * (squares + mean) / freedom, freedom }
}

/// Number of cosines: the spectrum S of an autoregression of first order has the curvature S''/S = -2 rho / (1 - rho)^2 at zero;
/// the mean over B cosines is off by S'' (pi B / n)^2 / 6 and has the variance 2 S^2 / B.
fn cosines(scores: &[f64]) -> usize {
    let n = scores.len();
    let squares: f64 = scores.iter().map(|v| v * v).sum();
    let products: f64 = scores.iter().zip(&scores[1..]).map(|(a, b)| a * b).sum();
    let rho = if squares > 0.0 { products / squares } else { 0.0 };
    let rho = rho.clamp(-MOST_CORRELATED, MOST_CORRELATED);
    let curvature = PI * PI / 6.0 * 2.0 * rho.abs() / (1.0 - rho).powi(2);
    let best = ((n as f64).powi(4) / (2.0 * curvature * curvature)).powf(0.2).floor();
    let most = (n / 2).clamp(2, MOST).min(n.saturating_sub(1));
    // An infinite number, for no correlation at all, is the most.
    (best.clamp(2.0, MOST as f64) as usize).min(most)
}

/// sqrt(2 / n) times the sum of x_t cos(pi k (t + 1/2) / n), by the recurrence of the cosine.
fn coefficient(scores: &[f64], k: usize) -> f64 {
    let n = scores.len() as f64;
    let half = PI * k as f64 / n / 2.0;
    let (mut previous, mut now) = (half.cos(), half.cos());
    let double = 2.0 * (2.0 * half).cos();
    let mut sum = 0.0;
    for value in scores {
        sum += value * now;
        (previous, now) = (now, double * now - previous);
    }
    sum * (2.0 / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coefficient_is_the_sum_that_it_abbreviates() {
        let scores: Vec<f64> = (0..50).map(|t| f64::from((t * 37) % 11) - 5.0).collect();
        for k in [1, 7, 24] {
            let angle = |t: usize| (PI * k as f64 * (t as f64 + 0.5) / 50.0).cos();
            let sum: f64 = scores.iter().enumerate().map(|(t, v)| v * angle(t)).sum();
            // Rounding of fifty steps of the recurrence.
            assert!((coefficient(&scores, k) - sum * 0.2).abs() < 1e-11, "{k}");
        }
    }

    #[test]
    fn correlated_scores_are_given_fewer_cosines() {
        let alternating: Vec<f64> = (0..200).map(|t| if t % 4 < 2 { 1.0 } else { -1.0 }).collect();
        let slow: Vec<f64> = (0..200).map(|t| (f64::from(t) * 0.05).sin()).collect();
        assert_eq!((cosines(&alternating), cosines(&slow), cosines(&[0.0; 200])), (100, 2, 100));
        assert_eq!((cosines(&[1.0]), cosines(&[1.0, 2.0]), cosines(&[1.0, 2.0, 0.0])), (0, 1, 2));
    }

    #[test]
    fn all_cosines_of_one_record_hold_its_whole_variance() {
        // Parseval: with every coefficient the estimate is the sum of squares about the mean, n / (n - 1) times.
        let scores = vec![1.0, -2.0, 4.0, -3.0];
        let squares: f64 = (1..4).map(|k| coefficient(&scores, k).powi(2)).sum();
        assert!((squares - 30.0).abs() < 1e-12, "{squares}");
    }
}
