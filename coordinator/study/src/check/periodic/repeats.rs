//! After which time signals repeat, and how well.
//!
//! The measure is the root mean square of u(t + T) − u(t), over the range of u.

use starlings_models::Signal;

use crate::checked::{Channel, Record};

/// Points at which a signal is compared with itself.
const POINTS: u32 = 256;
/// Lags that are tried at most.
const LAGS: usize = 4000;
/// Samples between two lags at most.
const COARSEST: f64 = 5.0;
/// Difference at a period that is found, at most.
const FOUND: f64 = 0.05;
/// Difference that a signal must have come to before it can be said to return.
const AWAY: f64 = 0.15;
/// Lags within a period at which a signal may have left.
const WITHIN: u32 = 32;
/// Steps of the search around a lag: each leaves 0.62 of the span.
const GOLDEN: usize = 60;
/// A period this near to a sample, in samples, is that sample.
const ON_SAMPLE: f64 = 0.02;
/// Pairs of measured values that say whether an output repeats.
const PAIRS: usize = 8;
/// How many times what noise makes of it a difference of measured values has to be, and which share of their range.
const BEYOND: (f64, f64) = (2.0, 0.2);

/// How much an input differs from itself a period later; `None` of a constant one, or one that is not as long.
pub(super) fn input_mismatch(signal: &Signal, start: f64, period: f64) -> Option<f64> {
    let range = range(&signal.values)?;
    let room = signal.times.last()? - start - period;
    if room < -1e-9 * period {
        return None;
    }
    let square = |k: u32| {
        let t = start + room.max(0.0) * f64::from(k) / f64::from(POINTS);
        (signal.at(t + period) - signal.at(t)).powi(2)
    };
    let sum: f64 = (0..=POINTS).map(square).sum();
    Some((sum / f64::from(POINTS + 1)).sqrt() / range)
}

/// How much a measured output differs from itself a period later, where noise cannot be the reason.
pub(super) fn channel_mismatch(record: &Record, channel: &Channel, period: f64) -> Option<f64> {
    if channel.node.is_some() {
        return None;
    }
    let seen = record.times.iter().zip(&channel.values).filter(|(_, v)| v.is_finite());
    let (times, values): (Vec<f64>, Vec<f64>) = seen.unzip();
    let (last, range) = (*times.last()?, range(&values)?);
    let signal = Signal { times, values };
    let later = signal.times.iter().zip(&signal.values).take_while(|(t, _)| **t + period <= last);
    let squares: Vec<f64> = later.map(|(t, v)| (signal.at(t + period) - v).powi(2)).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let noise = std::f64::consts::SQRT_2 * channel.noise;
    let differs = squares.len() >= PAIRS && rms > (BEYOND.0 * noise).max(BEYOND.1 * range);
    differs.then_some(rms / range)
}

/// The shortest time after which all inputs repeat; `None` where they do not within two thirds of their length.
pub(super) fn found(inputs: &[Signal], start: f64) -> Option<f64> {
    let end = inputs.iter().filter_map(|s| s.times.last().copied()).reduce(f64::min)?;
    let finest = inputs.iter().max_by_key(|s| s.times.len())?;
    let sample = spacing(inputs);
    let longest = (end - start) / 1.5;
    if !(longest > sample && sample > 0.0) {
        return None;
    }
    let step = sample.max(longest.min(LAGS as f64 * COARSEST * sample) / LAGS as f64);
    // The worst input decides: all have to repeat.
    let at = |lag: f64| inputs.iter().filter_map(|s| input_mismatch(s, start, lag)).reduce(f64::max);
    at(step)?;
    let far = |lag: f64| at(lag).unwrap_or(f64::INFINITY);
    let n = ((longest / step) as usize).min(LAGS);
    let course: Vec<f64> = (1..=n).map(|k| far(step * k as f64)).collect();
    let mut away = false;
    for k in 1..course.len().saturating_sub(1) {
        away |= course[k] > AWAY;
        if away && course[k] <= course[k - 1] && course[k] <= course[k + 1] {
            let lag = lowest(&far, step * k as f64, step * (k + 2) as f64);
            if far(lag) <= FOUND {
                return Some(on_sample(finest, start, lag, sample));
            }
        }
    }
    None
}

/// Time between two samples of the input that has most of them; 0 without any.
pub(super) fn spacing(inputs: &[Signal]) -> f64 {
    let of = |s: &Signal| Some((s.times.last()? - s.times.first()?) / (s.times.len() - 1).max(1) as f64);
    inputs.iter().max_by_key(|s| s.times.len()).and_then(of).unwrap_or(0.0)
}

/// Whether an input has changed within a time as a signal must that can be said to return; of inputs that never change nothing is asked.
pub(super) fn has_left(inputs: &[Signal], start: f64, period: f64) -> bool {
    let varying = || inputs.iter().filter(|signal| range(&signal.values).is_some());
    let mut lags = (1..WITHIN).map(|k| period * f64::from(k) / f64::from(WITHIN));
    varying().next().is_none()
        || lags.any(|lag| varying().filter_map(|s| input_mismatch(s, start, lag)).any(|share| share > AWAY))
}

/// The lowest place of a function between two ends (golden section; Kiefer 1953).
fn lowest(of: &dyn Fn(f64) -> f64, mut lo: f64, mut hi: f64) -> f64 {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..GOLDEN {
        let [left, right] = [hi - ratio * (hi - lo), lo + ratio * (hi - lo)];
        if of(left) <= of(right) { hi = right } else { lo = left }
    }
    0.5 * (lo + hi)
}

/// A lag that ends on a sample to within rounding ends there.
fn on_sample(signal: &Signal, start: f64, lag: f64, sample: f64) -> f64 {
    let place = signal.times.partition_point(|t| *t < start + lag);
    let beside = [place.saturating_sub(1), place].into_iter().filter_map(|k| signal.times.get(k));
    let near = beside.map(|t| t - start).find(|found| (found - lag).abs() < ON_SAMPLE * sample);
    near.unwrap_or(lag)
}

/// Highest less lowest value; `None` of a constant.
fn range(values: &[f64]) -> Option<f64> {
    let ends = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    Some(ends.1 - ends.0).filter(|range| *range > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A half sine of 0.3 in every period, sampled so often per period.
    fn beats(period: f64, per_period: u32, n: u32) -> Signal {
        let times: Vec<f64> =
            (0..=n * per_period).map(|k| period * f64::from(k) / f64::from(per_period)).collect();
        let flow = |t: f64| {
            let phase = t.rem_euclid(period);
            if phase < 0.3 { (std::f64::consts::PI * phase / 0.3).sin() } else { 0.0 }
        };
        let values = times.iter().map(|t| flow(*t)).collect();
        Signal { times, values }
    }

    #[test]
    fn a_period_is_found_to_rounding_where_it_ends_on_a_sample() {
        for (period, per_period, n) in [(0.8, 800, 10), (0.75, 50, 3), (1.1, 40, 2)] {
            let signal = beats(period, per_period, n);
            let known = found(std::slice::from_ref(&signal), 0.0).expect("a period");
            assert!((known - period).abs() < 1e-12, "{known} for {period}");
            // A run-in, or a start within a beat, changes nothing.
            let known = found(&[signal], 0.1).expect("a period");
            assert!((known - period).abs() < 1e-3 * period, "{known} for {period}");
        }
    }

    #[test]
    fn one_beat_a_ramp_and_a_constant_have_no_period() {
        assert_eq!(found(&[beats(0.8, 100, 1)], 0.0), None);
        let ramp = Signal { times: vec![0.0, 1.0, 2.0, 3.0], values: vec![0.0, 1.0, 2.0, 3.0] };
        assert_eq!(found(&[ramp], 0.0), None);
        let constant = Signal { times: vec![0.0, 1.0, 2.0, 3.0], values: vec![2.0; 4] };
        assert_eq!(found(&[constant], 0.0), None);
        assert_eq!(found(&[], 0.0), None);
    }

    #[test]
    fn a_signal_has_left_within_a_period_and_not_within_a_sample() {
        let signal = [beats(0.8, 40, 4)];
        assert!(
            has_left(&signal, 0.0, 0.8) && !has_left(&signal, 0.0, 1e-9) && !has_left(&signal, 0.0, 0.02)
        );
        let constant = Signal { times: vec![0.0, 1.0], values: vec![2.0; 2] };
        assert!(has_left(&[constant], 0.0, 1e-9) && has_left(&[], 0.0, 1e-9), "nothing that could leave");
        assert!((spacing(&signal) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_wrong_period_differs_by_a_large_share_of_the_range_and_the_right_one_by_none() {
        let signal = beats(0.8, 800, 4);
        assert!(input_mismatch(&signal, 0.0, 0.8).is_some_and(|share| share < 1e-10));
        assert!(input_mismatch(&signal, 0.0, 0.7).is_some_and(|share| share > 0.2));
        assert_eq!(input_mismatch(&signal, 0.0, 9.0), None);
    }
}
