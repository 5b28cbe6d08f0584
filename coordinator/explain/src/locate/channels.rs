//! The misfit of every channel of every record in every use, in plain figures.
//!
//! Next file to read: [`super::bootstrap`].

use starlings_estimators::{autocorrelation, effective_sample_size, ljung_box};

use super::bootstrap::{DRAWS, block_bootstrap_rms, block_length};
use super::{ChannelGap, View};
use crate::rows::{Usage, unit};

/// The figures, by record, then channel, then use.
pub(super) fn channels(view: &View<'_>) -> Vec<ChannelGap> {
    let mut gaps = Vec::new();
    for (r, record) in view.study.records.iter().enumerate() {
        for c in 0..record.channels.len() {
            for usage in [Usage::Train, Usage::HeldOut, Usage::HeldOutChannel] {
                gaps.extend(gap(view, r, c, usage));
            }
        }
    }
    gaps
}

fn gap(view: &View<'_>, record: usize, channel: usize, usage: Usage) -> Option<ChannelGap> {
    let of = &view.study.records[record].channels[channel];
    // Missing steps stay as gaps, so that a lag is a number of steps of the record.
    let mut series: Vec<f64> = Vec::new();
    let mut first = None;
    for (row, predicted) in view.rows.rows.iter().zip(view.predicted) {
        if (row.record, row.channel, row.usage) == (record, channel, usage) && predicted.is_finite() {
            let start = *first.get_or_insert(row.step);
            series.resize(row.step - start, f64::NAN);
            series.push(row.observed - predicted);
        }
    }
    let values: Vec<f64> = series.iter().copied().filter(|e| e.is_finite()).collect();
    let n = values.len();
    if n == 0 {
        return None;
    }
    let seed = view.seed.wrapping_add((record * 1000 + channel) as u64);
    Some(ChannelGap {
        record: view.study.records[record].name.clone(),
        channel: of.output.clone(),
        unit: unit(view.study, record, channel),
        usage: usage.word().to_owned(),
        n,
        noise: of.noise,
        rmse: (values.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt(),
        interval95: block_bootstrap_rms(&values, block_length(&values), DRAWS, seed),
        bias: values.iter().sum::<f64>() / n as f64,
        lag1: known(autocorrelation(&series, 1)[1], 0.0),
        whiteness_p: known(ljung_box(&series, (n / 20).max(10)), 1.0),
        effective_n: known(effective_sample_size(&series), n as f64),
    })
}

/// A figure, or its value for white residuals where the values are too few or constant.
fn known(figure: f64, otherwise: f64) -> f64 {
    if figure.is_finite() { figure } else { otherwise }
}
