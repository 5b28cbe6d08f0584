//! Noise with a memory that is larger than the one that was found.
//!
//! A noise that nobody stated is found from third differences, which take its slow part for signal: what it leaves may be that noise, of a
//! size that only the residuals tell. Next file to read: [`super::noise_model`].

use starlings_estimators::CorrelatedNoise;

use super::adequacy::Adequacy;
use super::contribution::SECOND_SHARE;
use super::held_out::{FAR, is_larger};
use super::noise_model::{VersionNoise, most_supported, of_version};
use super::search_result::SearchResult;
use crate::fit::fitted_variant::FittedVariant;
use crate::rows::{Row, Rows, Usage};
use crate::run_cache::RunCache;

/// A noise with a memory that the stated size excludes and one that was found does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LargerNoise {
    /// Index of the output.
    pub output: usize,
    /// Its sd, over the one that was found.
    pub factor: f64,
    /// It, in units of its own variance.
    pub noise: CorrelatedNoise,
}

/// The rows in units of the noise of the version that is best supported, the model as it is included, of those that leave nothing but noise
/// if it is as large as their residuals; `None` without any.
pub(crate) fn in_larger_noise(cache: &RunCache<'_>, found: &SearchResult<'_>) -> Option<Rows> {
    cache.rows.rows.iter().find(|row| is_found(row))?;
    let of = |fit: &FittedVariant<'_>| {
        let in_noise = in_noise_of(&cache.rows, &fit.predicted);
        in_noise.filter(|_| leaves_little(&cache.rows, found, fit))
    };
    most_supported(cache, found, of).map(|(rows, _)| rows)
}

/// Whether what a version leaves is near the noise that was found in these rows, and less of the gap than a further effect would have to bring:
/// more is no matter of a noise's memory. The model as it is has brought nothing, and leaves all of it.
pub(crate) fn leaves_little(rows: &Rows, found: &SearchResult<'_>, fit: &FittedVariant<'_>) -> bool {
    let rows = Rows { noise: Vec::new(), ..rows.clone() };
    let square = |fit: &FittedVariant<'_>| Adequacy::of_rows(&rows, &fit.predicted).rmse_over_noise.powi(2);
    let (was, is) = (square(&found.base), square(fit));
    let is_most_taken = is - 1.0 <= SECOND_SHARE * (was - 1.0);
    is <= FAR * FAR && (fit.variant.effects.is_empty() || is_most_taken)
}

/// The rows in units of a noise as large as what these predictions leave, where that may be all noise, with the log density of the training
/// rows less the price of that noise.
fn in_noise_of(rows: &Rows, predicted: &[f64]) -> Option<(f64, Rows)> {
    let as_large = AsLarge::new(rows, predicted);
    let larger = as_large.believed(predicted);
    // The size is one more number that is fitted (Schwarz 1978).
    let n_size = as_large.factors.iter().filter(|factor| **factor > 1.0).count() as f64;
    let log_density = as_large.log_density - 0.5 * n_size * (rows.train.len().max(1) as f64).ln();
    let mut rows = rows.clone();
    rows.noise.resize(rows.n_output(), None);
    for LargerNoise { output, factor, noise } in &larger {
        rows.noise[*output] = Some(*noise);
        for row in rows.rows.iter_mut().filter(|row| row.output == *output && is_found(row)) {
            row.noise *= factor;
        }
    }
    let is_all = !larger.is_empty() && !Adequacy::of_rows(&rows, predicted).is_gap();
    is_all.then_some((log_density, rows))
}

/// The outputs whose noise was found, by differences that take the slow part of a noise for signal, and whose residuals are all noise if
/// theirs is as large as they are and correlated: white in units of that noise, and no larger where they were held out.
pub(crate) fn larger(rows: &Rows, predicted: &[f64]) -> Vec<LargerNoise> {
    AsLarge::new(rows, predicted).believed(predicted)
}

/// The rows in units of a noise as large as the residuals, where it was found.
struct AsLarge {
    rows: Rows,
    /// By how much the noise of each output grows.
    factors: Vec<f64>,
    /// Log density of the training rows, less the price of the memory.
    log_density: f64,
}

impl AsLarge {
    fn new(rows: &Rows, predicted: &[f64]) -> Self {
        let mut rows = Rows { noise: Vec::new(), ..rows.clone() };
        let scaled = rows.scaled(predicted);
        let shown = rows.mean_squares(&scaled, 1, is_found);
        let factors: Vec<f64> =
            shown.iter().map(|square| square.map_or(1.0, |s| s.sqrt().max(1.0))).collect();
        for row in rows.rows.iter_mut().filter(|row| is_found(row)) {
            row.noise *= factors[row.output];
        }
        let VersionNoise { log_density, noise } =
            of_version(&rows, predicted, &|output| shown[output].is_none());
        let trained = rows.train.iter().map(|i| &rows.rows[*i]).filter(|row| is_found(row));
        let grown: f64 = trained.map(|row| factors[row.output].ln()).sum();
        rows.noise = noise;
        Self { rows, factors, log_density: log_density - grown }
    }

    /// The noises with a memory, where these predictions leave nothing else.
    fn believed(&self, predicted: &[f64]) -> Vec<LargerNoise> {
        let Self { rows, factors, .. } = self;
        if Adequacy::of_rows(rows, predicted).is_gap() {
            return Vec::new();
        }
        let whitened = rows.whitened(predicted);
        let squares = |output: usize, usage: Usage| -> Vec<f64> {
            let is_of = |row: &Row| row.output == output && row.usage == usage;
            let of = rows.rows.iter().zip(&whitened).filter(|(row, _)| is_of(row));
            of.map(|(_, e)| e * e).collect()
        };
        let is_as_large = |output: usize| {
            let (unseen, n) = (squares(output, Usage::HeldOut), squares(output, Usage::Train).len());
            let mean = unseen.iter().sum::<f64>() / unseen.len().max(1) as f64;
            !is_larger(mean, unseen.len(), n as f64)
        };
        let with_memory = |(output, noise): (usize, &Option<CorrelatedNoise>)| {
            let (factor, noise) = (factors[output], (*noise)?);
            (factor > 1.0).then_some(LargerNoise { output, factor, noise })
        };
        let larger: Vec<LargerNoise> = rows.noise.iter().enumerate().filter_map(with_memory).collect();
        if larger.iter().all(|of| is_as_large(of.output)) { larger } else { Vec::new() }
    }
}

/// Whether the noise of a row was found.
fn is_found(row: &Row) -> bool {
    row.noise_freedom.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noise_that_was_found_may_be_larger_and_correlated_where_one_that_was_stated_may_not() {
        let n = 550;
        let mut rows =
            Rows::of_noise(CorrelatedNoise { white: 1e-9, correlated: 1.0, length: 1.957_6 }, n, 3);
        let zero = vec![0.0; n];
        for row in &mut rows.rows {
            row.noise = 0.6;
        }
        assert_eq!(larger(&rows, &zero), [], "stated");
        for row in &mut rows.rows {
            row.noise_freedom = 100.0;
        }
        let [found] = larger(&rows, &zero)[..] else { panic!("not heard") };
        // Of 550 values some 140 are independent: the sd is known to 6 %, the length to a factor.
        assert!(
            (0.6 * found.factor - 1.0).abs() < 0.2 && (found.noise.length / 1.957_6).ln().abs() < 1.0,
            "{found:?}"
        );
        // A second record whose noise of the same output was stated: larger residuals there are a gap.
        let mut beside = rows.clone();
        beside.rows.extend(rows.rows.iter().map(|row| Row {
            record: 1,
            noise_freedom: f64::INFINITY,
            ..*row
        }));
        beside.train = (0..2 * n).collect();
        assert_eq!(larger(&beside, &vec![0.0; 2 * n]), [], "one of them stated");
        // A second output with a slow gap above its stated noise.
        let slow = |i: usize| 4.0 * (0.05 * i as f64).sin();
        let other = |(i, row): (usize, &Row)| Row {
            output: 1,
            channel: 1,
            observed: slow(i),
            noise: 1.0,
            noise_freedom: f64::INFINITY,
            ..*row
        };
        beside.rows.truncate(n);
        beside.rows.extend(rows.rows.iter().enumerate().map(other));
        assert_eq!(larger(&beside, &vec![0.0; 2 * n]), [], "not all is noise");
        for row in rows.rows.iter_mut().skip(300) {
            (row.usage, row.observed) = (Usage::HeldOut, row.observed + 2.5);
        }
        rows.train.truncate(300);
        assert_eq!(larger(&rows, &zero), [], "what was held out is no such noise");
    }
}
