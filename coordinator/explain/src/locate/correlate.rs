//! Signals with which the residuals correlate: those of the simulation, their rates, signs, squares and past.
//!
//! Rates are differences of simulated signals and inputs, never of measured values. Next file to read: [`super::signal`].

use starlings_estimators::quantiles::Z95;
use starlings_models::units::spaced;
use starlings_study::{Record, Study};

use super::residuals::{Residuals, primary};
use super::signal::{MOST_TRACKS, along};
use super::{Correlated, Track, View};

/// Correlations reported at most.
const MOST: usize = 12;
/// Least distance from zero, in sd, large enough for a choice among some hundred signals.
const SURE: f64 = 3.3;
/// Smallest correlation that is reported.
const LEAST: f64 = 0.1;
/// Correlation of two signals above which the weaker one is not reported.
const ALIKE: f64 = 0.95;
/// Lags tried over the largest share of a record.
const LAGS: usize = 12;
/// Largest lag as a share of the record.
const LAG_SHARE: f64 = 0.1;
/// Least difference in correlation by which a derived signal must exceed a simpler one, per step of derivation.
const PLAIN: f64 = 0.004;
/// Least correlation that a lag must add to that without a lag.
const LAG_GAIN: f64 = 0.05;

/// A signal made of a track.
struct Candidate {
    words: String,
    values: Vec<f64>,
    /// Number of steps by which it is derived from the track.
    steps: f64,
}

/// Correlations of every channel, strongest first, without near-duplicates.
pub(super) fn correlations(view: &View<'_>, groups: &[Residuals]) -> Vec<Correlated> {
    let mut all: Vec<(f64, Correlated)> = Vec::new();
    for group in primary(groups) {
        all.extend(of_channel(view, group));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, c)| c).take(MOST).collect()
}

fn of_channel(view: &View<'_>, group: &Residuals) -> Vec<(f64, Correlated)> {
    let mut found: Vec<(f64, Candidate, Correlated)> = Vec::new();
    for track in view.tracks.iter().take(MOST_TRACKS) {
        for candidate in candidates(view.study, track, group) {
            if let Some((coefficient, interval95)) = correlate(group, &candidate.values, SURE) {
                let rank = coefficient.abs() - PLAIN * candidate.steps;
                let (channel, with) = (group.channel.clone(), candidate.words.clone());
                found.push((rank, candidate, Correlated { channel, with, coefficient, interval95 }));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<(f64, Candidate, Correlated)> = Vec::new();
    for item in found {
        let alike = |other: &(f64, Candidate, Correlated)| {
            pearson(&other.1.values, &item.1.values).is_some_and(|(r, _)| r.abs() > ALIKE)
        };
        if kept.len() < MOST && !kept.iter().any(alike) {
            kept.push(item);
        }
    }
    kept.into_iter().map(|(rank, _, correlated)| (rank, correlated)).collect()
}

/// The track itself, its rate, sign, square and product with its size, and its past where that does better.
fn candidates(study: &Study, track: &Track, group: &Residuals) -> Vec<Candidate> {
    let values = along(track, group);
    let name = &track.name;
    let signed = values.iter().any(|v| *v < 0.0) && values.iter().any(|v| *v > 0.0);
    let of = |words: String, steps: f64, f: &dyn Fn(f64) -> f64| Candidate {
        words,
        values: values.iter().map(|v| f(*v)).collect(),
        steps,
    };
    let mut candidates = vec![of(name.clone(), 0.0, &|v| v)];
    if signed {
        candidates.push(of(format!("sign of {name}"), 1.0, &|v| if v.abs() > 0.0 { v.signum() } else { v }));
        candidates.push(of(format!("{name}·|{name}|"), 2.0, &|v| v * v.abs()));
    }
    candidates.push(of(format!("square of {name}"), 2.0, &|v| v * v));
    let rate = Track { values: rates(study, track), name: String::new(), unit: String::new() };
    candidates.push(Candidate { words: format!("rate of {name}"), values: along(&rate, group), steps: 1.0 });
    candidates.extend(lagged(study, track, group, &values));
    candidates
}

/// Central differences over each record's times, one-sided at the ends.
fn rates(study: &Study, track: &Track) -> Vec<Vec<f64>> {
    let of = |(r, record): (usize, &Record)| {
        let n = track.values.get(r).map_or(0, Vec::len);
        (0..n).map(|i| track.slope(r, i, &record.times).unwrap_or(f64::NAN)).collect()
    };
    study.records.iter().enumerate().map(of).collect()
}

/// The track some steps earlier, at the lag of the largest correlation where that is clearly larger than without.
fn lagged(study: &Study, track: &Track, group: &Residuals, now: &[f64]) -> Option<Candidate> {
    let longest = study.records.iter().max_by_key(|r| r.times.len())?;
    let most = (LAG_SHARE * longest.times.len() as f64) as usize;
    let stride = most.div_ceil(LAGS).max(1);
    let size = |values: &[f64]| pearson(&group.value, values).map_or(0.0, |(r, _)| r.abs());
    let mut best = (size(now) + LAG_GAIN, None);
    for lag in (1..=most / stride).map(|k| k * stride) {
        let shifted = |values: &Vec<f64>| {
            let mut shifted = vec![f64::NAN; lag.min(values.len())];
            shifted.extend(&values[..values.len().saturating_sub(lag)]);
            shifted
        };
        let past = Track {
            values: track.values.iter().map(shifted).collect(),
            name: String::new(),
            unit: String::new(),
        };
        let values = along(&past, group);
        let r = size(&values);
        if r > best.0 {
            best = (r, Some((lag, values)));
        }
    }
    let (lag, values) = best.1?;
    let span = longest.times.last()? - longest.times.first()?;
    let earlier = span * lag as f64 / (longest.times.len() - 1) as f64;
    let words =
        format!("{} {}{} earlier", track.name, crate::number::three(earlier), spaced(&study.time_unit));
    Some(Candidate { words, values, steps: 3.0 })
}

/// Correlation of the residuals with a signal and its 95 % interval by Fisher's transform; `None` when it is small or less
/// than `sure` sd from zero. The sample size is that of two series with these autocorrelations at lag 1 (Bretherton et
/// al., Journal of Climate 12, 1999, eq. 31).
fn correlate(group: &Residuals, signal: &[f64], sure: f64) -> Option<(f64, [f64; 2])> {
    let (r, n) = pearson(&group.value, signal)?;
    let memory = lag1(group, &group.value) * lag1(group, signal);
    interval(r, n as f64 * (1.0 - memory) / (1.0 + memory), sure)
}

/// Fisher's interval, `None` when the correlation is small or not surely other than zero.
fn interval(r: f64, effective: f64, sure: f64) -> Option<(f64, [f64; 2])> {
    let sd = 1.0 / (effective - 3.0).max(1.0).sqrt();
    let z = r.clamp(-0.999_999_9, 0.999_999_9).atanh();
    if r.abs() < LEAST || z.abs() < sure * sd {
        return None;
    }
    Some((r, [(z - Z95 * sd).tanh(), (z + Z95 * sd).tanh()]))
}

/// Pearson's coefficient over the pairs without a missing value, and their number.
fn pearson(a: &[f64], b: &[f64]) -> Option<(f64, usize)> {
    let pairs = || a.iter().zip(b).filter(|(a, b)| a.is_finite() && b.is_finite());
    let (mut n, mut sum_a, mut sum_b) = (0_usize, 0.0, 0.0);
    for (a, b) in pairs() {
        n += 1;
        sum_a += a;
        sum_b += b;
    }
    if n < 8 {
        return None;
    }
    let (mean_a, mean_b) = (sum_a / n as f64, sum_b / n as f64);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs() {
        let (a, b) = (a - mean_a, b - mean_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    // A constant has no more than the rounding of its mean.
    let constant = bb <= 1e-20 * n as f64 * mean_b * mean_b || aa <= 1e-20 * n as f64 * mean_a * mean_a;
    (aa > 0.0 && bb > 0.0 && !constant).then(|| (ab / (aa * bb).sqrt(), n))
}

/// Autocorrelation at lag 1 within records, not below zero.
fn lag1(group: &Residuals, values: &[f64]) -> f64 {
    let next: Vec<f64> =
        (0..values.len()).map(|i| if group.goes_on(i) { values[i + 1] } else { f64::NAN }).collect();
    pearson(values, &next).map_or(0.0, |(r, _)| r.clamp(0.0, 0.999))
}
