//! Which noise the residuals of the best version have: as stated, stated but correlated in time, or stated with something more on top.
//!
//! Every version is credited with the noise that suits its own residuals best, the model as it is among them, so that a
//! discrepancy competes with effects in one currency: the logarithm of the density of the training rows, less a price for what
//! was fitted. A gap is not taken for noise: a correlated discrepancy beside the whole white noise that was stated is something
//! on top of it. Next file to read: `correlated_noise.rs` of the estimators.

use starlings_estimators::{CorrelatedNoise, FittedNoise, Part, Series, fit_noise};

use super::adequacy::Adequacy;
use super::held_out::FAILS;
use super::search_result::SearchResult;
use crate::fit::fitted_variant::FittedVariant;
use crate::rows::{Row, Rows, Usage};
use crate::run_cache::RunCache;

/// Odds at which correlated noise is believed against the others, as a logarithm: 1000 to 1.
const BELIEVED: f64 = 6.907_755;
/// Versions with effects whose noise is looked at, the best by rank.
const MOST: usize = 5;
/// Values of a channel that tell its correlation at least, as in the test of whiteness, and lengths of that correlation that the data
/// must hold: what changes more slowly is a course of the recording, in which a missing effect would be lost.
pub(super) const LEAST: usize = 20;

/// The noise of one version, output by output.
struct VersionNoise {
    /// Log density of the training rows with the noise that suits them best, less the price of its parameters.
    log_density: f64,
    /// The noise of the outputs for which it is believed to be correlated.
    noise: Vec<Option<CorrelatedNoise>>,
}

/// The noise of every output at the version that is best supported, the model as it is included; without any where the residuals of
/// that version are no noise of the stated size.
pub(crate) fn best_supported(cache: &RunCache<'_>, found: &SearchResult<'_>) -> Vec<Option<CorrelatedNoise>> {
    let rows = &cache.rows;
    let version = |fit: &FittedVariant<'_>| of_version(rows, &fit.predicted);
    // Half the χ² of the prior, and of what a search pays for the parameters of effects.
    let prior = |fit: &FittedVariant<'_>| 0.5 * (fit.cost() - fit.residual().norm_squared());
    let base = version(&found.base);
    let mut best = (base.log_density - prior(&found.base), base, &found.base);
    let is_possible = |gate: &str| !matches!(gate, "failed" | "sign" | "range");
    let possible = found.judged.iter().filter(|j| j.refusal.as_ref().is_none_or(|r| is_possible(r.gate)));
    for judged in possible.take(MOST) {
        let (fit, variant) = (&judged.fit, &judged.fit.variant);
        let n_inner = variant.n_inner() as f64;
        let searched = variant.effects.len() as f64 * found.null_distribution.threshold;
        let price = 0.5 * (searched + n_inner * (rows.train.len().max(3) as f64).ln());
        let noise = version(fit);
        let support = noise.log_density - prior(fit) - price;
        if support > best.0 {
            best = (support, noise, fit);
        }
    }
    let (_, VersionNoise { noise, .. }, fit) = best;
    if noise.iter().all(Option::is_none) {
        return Vec::new();
    }
    // Residuals that the stated noise hides are none of its business, and larger ones are no noise.
    let is_gap = |noise| {
        let rows = Rows { noise, ..rows.clone() };
        Adequacy::of_rows(&rows, &fit.predicted).is_gap()
    };
    if is_gap(Vec::new()) && !is_gap(noise.clone()) { noise } else { Vec::new() }
}

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

/// The outputs whose noise was found, by differences that take the slow part of a noise for signal, and whose residuals are all noise if
/// theirs is as large as they are and correlated: white in units of that noise, and no larger where they were held out.
pub(crate) fn larger(rows: &Rows, predicted: &[f64]) -> Vec<LargerNoise> {
    let mut rows = Rows { noise: Vec::new(), ..rows.clone() };
    let scaled = rows.scaled(predicted);
    let found = |row: &Row| row.noise_freedom.is_finite();
    let shown = rows.mean_squares(&scaled, 1, found);
    let factors: Vec<f64> = shown.iter().map(|square| square.map_or(1.0, |s| s.sqrt().max(1.0))).collect();
    for row in rows.rows.iter_mut().filter(|row| found(row)) {
        row.noise *= factors[row.output];
    }
    rows.noise = of_version(&rows, predicted).noise;
    if Adequacy::of_rows(&rows, predicted).is_gap() {
        return Vec::new();
    }
    let whitened = rows.whitened(predicted);
    let is_as_large = |output: usize| {
        let unseen = (0..rows.rows.len())
            .filter(|i| rows.rows[*i].output == output && rows.rows[*i].usage == Usage::HeldOut);
        let squares: Vec<f64> = unseen.map(|i| whitened[i].powi(2)).collect();
        squares.iter().sum::<f64>() <= FAILS * FAILS * squares.len() as f64
    };
    let believed = |(output, noise): (usize, &Option<CorrelatedNoise>)| {
        let (factor, noise) = (factors[output], (*noise)?);
        (factor > 1.0 && is_as_large(output)).then_some(LargerNoise { output, factor, noise })
    };
    rows.noise.iter().enumerate().filter_map(believed).collect()
}

/// Whether two noises of every output are the same as far as a search is concerned: their variances and lengths differ by a tenth at
/// most.
pub(crate) fn alike(a: &[Option<CorrelatedNoise>], b: &[Option<CorrelatedNoise>]) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= 0.1 * a.abs().max(b.abs());
    let same = |pair: (&Option<CorrelatedNoise>, &Option<CorrelatedNoise>)| match pair {
        (Some(a), Some(b)) => near(a.correlated, b.correlated) && near(a.length, b.length),
        (None, None) => true,
        _ => false,
    };
    a.len() == b.len() && a.iter().zip(b).all(same)
}

fn of_version(rows: &Rows, predicted: &[f64]) -> VersionNoise {
    let n_output = rows.n_output();
    let scaled = rows.scaled(predicted);
    let mut version = VersionNoise { log_density: 0.0, noise: vec![None; n_output] };
    for output in 0..n_output {
        let of = |wanted: fn(Usage) -> bool| -> Vec<Series> {
            let stretches = rows.stretches().into_iter();
            let stretches =
                stretches.filter(|s| rows.rows[s.start].output == output && wanted(rows.rows[s.start].usage));
            stretches.map(|s| Series { times: rows.times(&s), values: scaled[s].to_vec() }).collect()
        };
        let fitted = of(|usage| usage == Usage::Train);
        // A channel that is never fitted tells its correlation by its own errors, which cannot grow beyond the stated size by it.
        let series =
            if fitted.is_empty() { of(|usage| usage == Usage::HeldOutChannel) } else { fitted.clone() };
        let Some((log_density, noise)) = of_output(&series) else { continue };
        version.noise[output] = noise;
        if !fitted.is_empty() {
            version.log_density += log_density;
        }
    }
    version
}

/// The log density with the best noise less its price, and that noise where it is correlated.
fn of_output(series: &[Series]) -> Option<(f64, Option<CorrelatedNoise>)> {
    let white = CorrelatedNoise { white: 1.0, correlated: 0.0, length: 1.0 };
    let n: usize = series.iter().map(|s| s.values.len()).sum();
    let of_white = series.iter().map(|s| white.log_density(&s.times, &s.values)).sum::<f64>();
    if n < LEAST || !of_white.is_finite() {
        return of_white.is_finite().then_some((of_white, None));
    }
    // Two parameters at ln(n)/2 each (Schwarz 1978).
    let priced = |part| {
        fit_noise(series, part).map(|f| FittedNoise { log_density: f.log_density - (n as f64).ln(), ..f })
    };
    let (inside, outside) = (priced(Part::OfTheNoise)?, priced(Part::OnTop)?);
    let other = of_white.max(outside.log_density);
    // What has no memory is refused by the test of whiteness, so that the odds are those against something on top.
    let is_likelier = inside.log_density > of_white.max(outside.log_density + BELIEVED);
    let span = |s: &Series| s.times.last().zip(s.times.first()).map_or(0.0, |(last, first)| last - first);
    let lengths = series.iter().map(span).sum::<f64>() / inside.noise.length;
    let believed = is_likelier && lengths >= LEAST as f64;
    Some((other.max(inside.log_density), believed.then_some(inside.noise)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::white;

    fn rows_of(noise: CorrelatedNoise, n: usize, seed: u64) -> Rows {
        let mut rows = Rows::sample(n, |_| Usage::Train);
        rows.noise = vec![Some(noise)];
        let mut values = white(n, seed).as_slice().to_vec();
        rows.colour(0, &mut values);
        for (row, value) in rows.rows.iter_mut().zip(values) {
            row.observed = value;
        }
        rows.noise.clear();
        rows
    }

    fn noise(white: f64, correlated: f64, length: f64) -> CorrelatedNoise {
        CorrelatedNoise { white, correlated, length }
    }

    #[test]
    fn correlated_noise_of_the_stated_size_is_told_from_white_noise_and_from_a_gap() {
        // AR(1) of 0.6 per step: exp(−1/1.96).
        for (seed, n) in (0..20).map(|seed| (seed, if seed % 2 == 0 { 137 } else { 550 })) {
            let zero = vec![0.0; n];
            let of = |noise| of_version(&rows_of(noise, n, seed), &zero).noise[0];
            let found = of(noise(1e-9, 1.0, 1.957_6)).unwrap_or_else(|| panic!("seed {seed}: not heard"));
            // Beside a white share of any size 137 values know the length to a factor of about 1.4: three of these.
            assert!((found.length / 1.957_6).ln().abs() < 1.0, "{found:?}");
            assert_eq!(of(noise(1.0, 1e-12, 1.0)), None, "seed {seed}: white noise");
            assert_eq!(of(noise(1.0, 1.0, 12.0)), None, "seed {seed}: as much again, and slow");
            assert_eq!(of(noise(1.0, 0.1, 30.0)), None, "seed {seed}: a slow gap below the noise");
            assert_eq!(
                of(noise(1e-3, 0.999, 0.5 * n as f64)),
                None,
                "seed {seed}: a course of the recording"
            );
        }
    }

    #[test]
    fn a_memory_need_not_be_proved_against_white_noise_in_a_short_record() {
        // AR(1) of 0.5 per step in 100 values: whiteness is refused in most records, at odds against it that are often below 1000.
        let heard = (0..20).filter(|seed| {
            let rows = rows_of(noise(1e-9, 1.0, 0.5_f64.ln().recip().abs()), 100, *seed);
            let zero = vec![0.0; 100];
            let is_white = !Adequacy::of_rows(&rows, &zero).is_gap();
            is_white || of_version(&rows, &zero).noise[0].is_some()
        });
        assert!(heard.count() >= 18);
    }

    #[test]
    fn a_noise_that_was_found_may_be_larger_and_correlated_where_one_that_was_stated_may_not() {
        let n = 550;
        let mut rows = rows_of(noise(1e-9, 1.0, 1.957_6), n, 3);
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

    #[test]
    fn whitening_by_the_noise_makes_its_residuals_white() {
        let n = 550;
        let mut rows = rows_of(noise(1e-9, 1.0, 1.957_6), n, 5);
        let zero = vec![0.0; n];
        assert!(Adequacy::of_rows(&rows, &zero).is_gap(), "correlated, as it is");
        rows.noise = of_version(&rows, &zero).noise;
        assert!(!Adequacy::of_rows(&rows, &zero).is_gap());
        assert!(alike(&rows.noise, &rows.noise) && !alike(&rows.noise, &[]) && !alike(&rows.noise, &[None]));
    }
}
