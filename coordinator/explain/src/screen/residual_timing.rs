//! Dominant periods and change points of the residuals: values at which a period or an instant inside a term is screened.
//!
//! A sine whose period is wrong by more than a cycle over the record is uncorrelated with the one that is missing, and so is a
//! step at the wrong instant. A fixed grid would miss both. Next file to read: [`crate::fit::candidate`].

use crate::rows::{Rows, Usage};

/// Periods, and change points, at most.
const MOST: usize = 2;
/// Values in a window before or after a change at least.
const SHORTEST: usize = 3;
/// Jump, over what white noise makes of one, from which an instant is worth a run.
const AUDIBLE: f64 = 4.0;
/// Frequencies per cycle over the record.
const OVERSAMPLING: f64 = 4.0;
/// Frequencies at most.
const FREQUENCIES: usize = 600;

/// What the residuals show of times.
pub(crate) struct Timing {
    /// Periods with the most power.
    pub(crate) periods: Vec<f64>,
    /// Instants at which they change most.
    pub(crate) change_points: Vec<f64>,
    /// Instants at which they jump.
    pub(crate) jumps: Vec<f64>,
}

impl Timing {
    /// That of the training rows with these predictions.
    pub(crate) fn of(rows: &Rows, predicted: &[f64]) -> Self {
        let (change_points, jumps) = (change_points(rows, predicted), jumps(rows, predicted));
        Self { periods: periods(rows, predicted), change_points, jumps }
    }
}

/// The periods at which the residuals of the training rows have the most power, the strongest first: least-squares power at
/// each frequency (Lomb 1976, without the shift in time), summed over channels and records.
pub(crate) fn periods(rows: &Rows, predicted: &[f64]) -> Vec<f64> {
    let whitened = rows.whitened(predicted);
    let stretches = training(rows);
    let span = |s: &std::ops::Range<usize>| rows.rows[s.end - 1].time - rows.rows[s.start].time;
    let longest = stretches.iter().map(span).fold(0.0, f64::max);
    let samples = stretches.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
    if longest <= 0.0 || samples < 8 {
        return Vec::new();
    }
    let step = 1.0 / (OVERSAMPLING * longest);
    // Up to half the Nyquist frequency of even samples, from one cycle per record on.
    let n = ((OVERSAMPLING * samples as f64 / 4.0) as usize).min(FREQUENCIES);
    let mut powers: Vec<(f64, f64)> = Vec::new();
    for k in OVERSAMPLING as usize..n {
        let omega = std::f64::consts::TAU * step * k as f64;
        let power = stretches.iter().map(|s| power(rows, &whitened, s, omega)).sum();
        powers.push((power, step * k as f64));
    }
    powers.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<f64> = Vec::new();
    for (_, frequency) in powers {
        if found.len() < MOST && !found.iter().any(|known| (known - frequency).abs() < 1.5 / longest) {
            found.push(frequency);
        }
    }
    found.into_iter().map(|f| 1.0 / f).collect()
}

/// Power of the residuals of one stretch, less their mean, at one angular frequency.
fn power(rows: &Rows, whitened: &[f64], stretch: &std::ops::Range<usize>, omega: f64) -> f64 {
    let n = stretch.len().max(1) as f64;
    let mean = whitened[stretch.clone()].iter().sum::<f64>() / n;
    let (mut cosine, mut sine) = (0.0, 0.0);
    for i in stretch.clone() {
        let (s, c) = (omega * rows.rows[i].time).sin_cos();
        cosine += (whitened[i] - mean) * c;
        sine += (whitened[i] - mean) * s;
    }
    2.0 * (cosine * cosine + sine * sine) / n
}

/// The instants at which the residuals of the training rows change most, the largest change first: where the means of two windows,
/// before and after, differ most for what white noise leaves in them. At the ends of a stretch there is room for shorter windows only.
fn change_points(rows: &Rows, predicted: &[f64]) -> Vec<f64> {
    largest(in_stretches(rows, predicted, |times, values| {
        let n = values.len();
        let width = (n / 16).max(SHORTEST);
        let change = |i: usize| {
            let (before, after) = (&values[i.saturating_sub(width)..i], &values[i..n.min(i + width)]);
            let spread = (1.0 / before.len() as f64 + 1.0 / after.len() as f64).sqrt();
            let first = i.min(n.saturating_sub(width));
            let apart = times[n.min(first + width) - 1] - times[first];
            Change { size: (mean(after) - mean(before)).abs() / spread, at: times[i], apart }
        };
        (SHORTEST..(n + 1).saturating_sub(SHORTEST)).map(change).collect()
    }))
}

/// The instants at which they jump more than noise does, and those at which they jump more than a window earlier and later, where a bend of their
/// course jumps as far: a small jump is hidden where they also change smoothly.
fn jumps(rows: &Rows, predicted: &[f64]) -> Vec<f64> {
    let found = |of: fn(&[f64], &[f64]) -> Vec<Change>| {
        let mut jumps = in_stretches(rows, predicted, of);
        jumps.retain(|jump| jump.size.abs() > AUDIBLE);
        largest(jumps)
    };
    let (mut jumps, sharp) = (found(jumps_of), found(sharp_jumps_of));
    let further: Vec<f64> = sharp.into_iter().filter(|at| !jumps.contains(at)).collect();
    jumps.extend(further);
    jumps
}

/// The changes in each stretch of training rows, by its times and residuals in units of the noise.
fn in_stretches(rows: &Rows, predicted: &[f64], of: impl Fn(&[f64], &[f64]) -> Vec<Change>) -> Vec<Change> {
    let scaled = rows.scaled(predicted);
    let within = |stretch: std::ops::Range<usize>| {
        let (times, values): (Vec<f64>, Vec<f64>) = stretch.map(|i| (rows.rows[i].time, scaled[i])).unzip();
        of(&times, &values)
    };
    training(rows).into_iter().flat_map(within).collect()
}

/// A change of the residuals.
#[derive(Clone, Copy)]
struct Change {
    /// Over the standard deviation that white noise gives it, with the sign of a jump.
    size: f64,
    at: f64,
    /// How far others are from it, of which it is one.
    apart: f64,
}

/// The largest changes, none near another one.
fn largest(mut changes: Vec<Change>) -> Vec<f64> {
    changes.sort_by(|a, b| b.size.abs().total_cmp(&a.size.abs()));
    let mut instants: Vec<f64> = Vec::new();
    for Change { at, apart, .. } in changes {
        if instants.len() < MOST && !instants.iter().any(|other| (other - at).abs() <= apart) {
            instants.push(at);
        }
    }
    instants
}

/// Values in a window before or after a jump.
fn window(n: usize) -> usize {
    (n / 60).max(2 * SHORTEST)
}

/// How far values jump between two short windows on lines of one slope.
fn jumps_of(times: &[f64], values: &[f64]) -> Vec<Change> {
    let (n, width) = (values.len(), window(values.len()));
    let jump = |i: usize| {
        let (before, after) = (i - width..i, i..i + width);
        let [(t0, v0), (t1, v1)] =
            [&before, &after].map(|w| (mean(&times[w.clone()]), mean(&values[w.clone()])));
        let within = |w: &std::ops::Range<usize>, t: f64, v: f64| {
            let of = w.clone().map(|k| (times[k] - t, values[k] - v));
            of.fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + x * x, xy + x * y))
        };
        let ((xx0, xy0), (xx1, xy1)) = (within(&before, t0, v0), within(&after, t1, v1));
        let (xx, away) = (xx0 + xx1, t1 - t0);
        let spread = (2.0 / width as f64 + away * away / xx).sqrt();
        let size = (v1 - v0 - (xy0 + xy1) / xx * away) / spread;
        Change { size, at: times[i], apart: times[i + width - 1] - times[i] }
    };
    (width..(n + 1).saturating_sub(width)).map(jump).collect()
}

/// How much further they jump than on the mean of a window earlier and a window later.
fn sharp_jumps_of(times: &[f64], values: &[f64]) -> Vec<Change> {
    let (width, jumps) = (window(values.len()), jumps_of(times, values));
    let sharper = |j: usize| {
        let size = jumps[j].size - 0.5 * (jumps[j - width].size + jumps[j + width].size);
        Change { size, ..jumps[j] }
    };
    (width..jumps.len().saturating_sub(width)).map(sharper).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn training(rows: &Rows) -> Vec<std::ops::Range<usize>> {
    rows.stretches().into_iter().filter(|s| rows.rows[s.start].usage == Usage::Train).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(f: impl Fn(f64) -> f64) -> (Rows, Vec<f64>) {
        let mut rows = Rows::sample(300, |_| Usage::Train);
        for row in &mut rows.rows {
            row.time *= 0.1;
            row.observed = f(row.time);
        }
        (rows, vec![0.0; 300])
    }

    #[test]
    fn the_period_of_a_sine_is_found_to_a_fraction_of_a_cycle_over_the_record() {
        let (rows, zero) = sampled(|t| 3.0 + (std::f64::consts::TAU * t / 1.7).sin());
        let found = periods(&rows, &zero);
        // The frequencies are a quarter of a cycle over the record apart.
        assert!((30.0 / found[0] - 30.0 / 1.7).abs() <= 0.13, "{found:?}");
    }

    #[test]
    fn a_jump_is_found_at_its_instant_also_near_the_end() {
        let (rows, zero) = sampled(|t| if t < 29.45 { 0.0 } else { 2.0 });
        assert!((change_points(&rows, &zero)[0] - 29.5).abs() < 1e-9);
        let (rows, zero) = sampled(|t| if t < 12.35 { 0.0 } else { 2.0 });
        assert!((change_points(&rows, &zero)[0] - 12.4).abs() < 1e-9);
    }

    #[test]
    fn a_jump_is_found_under_a_change_that_is_larger_and_smooth() {
        let smooth = |t: f64| 200.0 * (0.4 * t).sin();
        let (rows, zero) = sampled(|t| smooth(t) + if t < 17.75 { 0.0 } else { 6.0 });
        let Timing { change_points, jumps, .. } = Timing::of(&rows, &zero);
        assert!(change_points.len() == 2 && (1..=4).contains(&jumps.len()), "{change_points:?} {jumps:?}");
        assert!((jumps[0] - 17.8).abs() < 1e-9, "{jumps:?}");
        let (rows, zero) = sampled(smooth);
        let Timing { change_points, jumps, .. } = Timing::of(&rows, &zero);
        assert_eq!((change_points.len(), jumps.len()), (2, 0), "nothing jumps");
    }
}
