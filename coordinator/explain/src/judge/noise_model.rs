//! Which noise the residuals of the best version have: as stated, stated but correlated in time, or stated with something more on top.
//!
//! Every version is credited with the noise that suits its own residuals best, the model as it is among them, so that a
//! discrepancy competes with effects in one currency: the logarithm of the density of the training rows, less a price for what
//! was fitted. A gap is not taken for noise: a correlated discrepancy beside the whole white noise that was stated is something
//! on top of it. Next file to read: `correlated_noise.rs` of the estimators.

use starlings_estimators::{CorrelatedNoise, FittedNoise, Part, Series, fit_noise};

use super::adequacy::Adequacy;
use super::gates::Refusal;
use super::search_result::SearchResult;
use crate::fit::fitted_variant::FittedVariant;
use crate::rows::{Rows, Usage};
use crate::run_cache::RunCache;

/// Odds at which correlated noise is believed against the others, as a logarithm: 1000 to 1.
const BELIEVED: f64 = 6.907_755;
/// Versions with effects whose noise is looked at, the best by rank.
const MOST: usize = 5;
/// Values of a channel that tell its correlation at least, as in the test of whiteness, and lengths of that correlation that the data
/// must hold: what changes more slowly is a course of the recording, in which a missing effect would be lost.
pub(super) const LEAST: usize = 20;

/// The noise of one version, output by output.
pub(super) struct VersionNoise {
    /// Log density of the training rows with the noise that suits them best, less the price of its parameters.
    pub log_density: f64,
    /// The noise of the outputs for which it is believed to be correlated.
    pub noise: Vec<Option<CorrelatedNoise>>,
}

/// The noise of every output at the version that is best supported, the model as it is included; without any where the residuals of
/// that version are no noise of the stated size.
pub(crate) fn best_supported(cache: &RunCache<'_>, found: &SearchResult<'_>) -> Vec<Option<CorrelatedNoise>> {
    let rows = &cache.rows;
    let of = |fit: &FittedVariant<'_>| {
        let VersionNoise { log_density, noise } = of_version(rows, &fit.predicted, &|_| true);
        Some((log_density, noise))
    };
    let Some((noise, fit)) = most_supported(cache, found, of) else { return Vec::new() };
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

/// The version that is best supported, the model as it is included, and its noise; `of` gives the log density of the training rows with the
/// noise that suits a version, less the price of that, and the noise. Those that it gives none are passed over.
pub(super) fn most_supported<'f, 'c, N>(
    cache: &RunCache<'_>,
    found: &'f SearchResult<'c>,
    of: impl Fn(&FittedVariant<'_>) -> Option<(f64, N)>,
) -> Option<(N, &'f FittedVariant<'c>)> {
    // What a search pays for the parameters of effects.
    let price = |fit: &FittedVariant<'_>| {
        let n_inner = fit.variant.n_inner() as f64;
        let searched = fit.variant.effects.len() as f64 * found.null_distribution.threshold;
        0.5 * (searched + n_inner * (cache.rows.train.len().max(3) as f64).ln())
    };
    // Half the χ² of the prior.
    let prior = |fit: &FittedVariant<'_>| 0.5 * (fit.cost() - fit.residual().norm_squared());
    let possible = found.judged.iter().filter(|j| !j.refusal.as_ref().is_some_and(Refusal::is_impossible));
    let versions = std::iter::once(&found.base).chain(possible.take(MOST).map(|judged| &judged.fit));
    let supported = versions.filter_map(|fit| {
        let (log_density, noise) = of(fit)?;
        Some((log_density - prior(fit) - price(fit), noise, fit))
    });
    // Of equals the first.
    let best = supported.reduce(|best, other| if other.0 > best.0 { other } else { best });
    best.map(|(_, noise, fit)| (noise, fit))
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

/// The noise of the version with these predictions. An output whose size `is_stated` may have something on top of it.
pub(super) fn of_version(rows: &Rows, predicted: &[f64], is_stated: &dyn Fn(usize) -> bool) -> VersionNoise {
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
        let Some((log_density, noise)) = of_output(&series, is_stated(output)) else { continue };
        version.noise[output] = noise;
        if !fitted.is_empty() {
            version.log_density += log_density;
        }
    }
    version
}

/// The log density with the best noise less its price, and that noise where it is correlated.
fn of_output(series: &[Series], is_stated: bool) -> Option<(f64, Option<CorrelatedNoise>)> {
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
    let inside = priced(Part::OfTheNoise)?;
    let outside = if is_stated { priced(Part::OnTop)?.log_density } else { f64::NEG_INFINITY };
    let other = of_white.max(outside);
    // What has no memory is refused by the test of whiteness, so that the odds are those against something on top.
    let is_likelier = inside.log_density > of_white.max(outside + BELIEVED);
    let span = |s: &Series| s.times.last().zip(s.times.first()).map_or(0.0, |(last, first)| last - first);
    let lengths = series.iter().map(span).sum::<f64>() / inside.noise.length;
    let believed = is_likelier && lengths >= LEAST as f64;
    Some((other.max(inside.log_density), believed.then_some(inside.noise)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(white: f64, correlated: f64, length: f64) -> CorrelatedNoise {
        CorrelatedNoise { white, correlated, length }
    }

    #[test]
    fn correlated_noise_of_the_stated_size_is_told_from_white_noise_and_from_a_gap() {
        // AR(1) of 0.6 per step: exp(−1/1.96).
        for (seed, n) in (0..20).map(|seed| (seed, if seed % 2 == 0 { 137 } else { 550 })) {
            let zero = vec![0.0; n];
            let of = |noise| of_version(&Rows::of_noise(noise, n, seed), &zero, &|_| true).noise[0];
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
            let rows = Rows::of_noise(noise(1e-9, 1.0, 0.5_f64.ln().recip().abs()), 100, *seed);
            let zero = vec![0.0; 100];
            let is_white = !Adequacy::of_rows(&rows, &zero).is_gap();
            is_white || of_version(&rows, &zero, &|_| true).noise[0].is_some()
        });
        assert!(heard.count() >= 18);
    }

    #[test]
    fn whitening_by_the_noise_makes_its_residuals_white() {
        let n = 550;
        let mut rows = Rows::of_noise(noise(1e-9, 1.0, 1.957_6), n, 5);
        let zero = vec![0.0; n];
        assert!(Adequacy::of_rows(&rows, &zero).is_gap(), "correlated, as it is");
        rows.noise = of_version(&rows, &zero, &|_| true).noise;
        assert!(!Adequacy::of_rows(&rows, &zero).is_gap());
        assert!(alike(&rows.noise, &rows.noise) && !alike(&rows.noise, &[]) && !alike(&rows.noise, &[None]));
    }
}
