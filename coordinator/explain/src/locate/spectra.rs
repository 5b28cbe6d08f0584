//! Residuals by frequency: averaged periodograms of overlapping segments.
//!
//! Channels that were not sampled evenly are left out. Next file to read: [`super::result`].

use std::f64::consts::TAU;

use super::{ResidualSpectrum, View};
use crate::rows::Usage;

/// Values per segment at most.
const SEGMENT: usize = 256;
/// Values from which a spectrum says anything.
const LEAST: usize = 32;
/// Largest departure of a spacing from the mean one.
const EVEN: f64 = 0.01;

/// Spectra of the evenly sampled channels of every record: over training values, or all of a channel that is never fitted.
pub(super) fn spectra(view: &View<'_>) -> Vec<ResidualSpectrum> {
    view.rows.stretches().into_iter().filter_map(|stretch| spectrum(view, stretch)).collect()
}

fn spectrum(view: &View<'_>, stretch: std::ops::Range<usize>) -> Option<ResidualSpectrum> {
    let rows = &view.rows.rows[stretch.clone()];
    let first = rows.first()?;
    let n = rows.len();
    if n < LEAST || first.usage == Usage::HeldOut {
        return None;
    }
    let spacing = (rows[n - 1].time - first.time) / (n - 1) as f64;
    let even = rows.windows(2).all(|w| (w[1].time - w[0].time - spacing).abs() <= EVEN * spacing);
    let series: Vec<f64> =
        rows.iter().zip(&view.predicted[stretch]).map(|(row, y)| (row.observed - y) / row.noise).collect();
    if !even || series.iter().any(|e| !e.is_finite()) {
        return None;
    }
    let length = (n / 2).min(SEGMENT) & !1;
    let power = welch(&series, length);
    let frequency: Vec<f64> = (1..=power.len()).map(|k| k as f64 / (length as f64 * spacing)).collect();
    let peak = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let record = &view.study.records[first.record];
    Some(ResidualSpectrum {
        record: record.name.clone(),
        channel: record.channels[first.channel].output.clone(),
        peak: frequency[peak],
        frequency,
        power_over_noise: power,
    })
}

/// Mean power over segments of this length that overlap by half, under Hann windows (Welch, IEEE Transactions on Audio and
/// Electroacoustics 15, 1967), at frequencies 1/length to 1/2; one for white noise of unit sd.
fn welch(series: &[f64], length: usize) -> Vec<f64> {
    let wave: Vec<(f64, f64)> = (0..length).map(|k| (TAU * k as f64 / length as f64).sin_cos()).collect();
    let window: Vec<f64> = wave.iter().map(|(_, cos)| 0.5 * (1.0 - cos)).collect();
    let weight: f64 = window.iter().map(|w| w * w).sum();
    let starts: Vec<usize> = (0..=series.len() - length).step_by(length / 2).collect();
    let mut power = vec![0.0; length / 2];
    for start in &starts {
        let segment: Vec<f64> = window.iter().zip(&series[*start..]).map(|(w, e)| w * e).collect();
        for (k, power) in power.iter_mut().enumerate() {
            let (mut re, mut im, mut at) = (0.0, 0.0, 0);
            for e in &segment {
                re += e * wave[at].1;
                im += e * wave[at].0;
                at += k + 1;
                at -= if at >= length { length } else { 0 };
            }
            *power += (re * re + im * im) / (weight * starts.len() as f64);
        }
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn white_noise_has_power_one_and_a_tone_stands_out_at_its_frequency() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let noise: Vec<f64> = (0..4000).map(|_| StandardNormal.sample(&mut rng)).collect();
        let power = welch(&noise, 200);
        let mean = power.iter().sum::<f64>() / power.len() as f64;
        // The mean over 100 frequencies of 4000 values has an sd of about 1/sqrt(2000).
        assert!((mean - 1.0).abs() < 0.08, "{mean}");
        let tone: Vec<f64> =
            noise.iter().enumerate().map(|(i, e)| e + (TAU * 0.1 * i as f64).sin()).collect();
        let power = welch(&tone, 200);
        let peak = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]));
        assert_eq!(peak, Some(19));
    }
}
