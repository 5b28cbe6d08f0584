//! The residuals of one channel in one use, over all records, with the record and time of each.
//!
//! Next file to read: [`super::signal`].

use super::View;
use crate::rows::{Usage, unit};

/// Residuals of one channel in one use, in the order of the rows.
pub(super) struct Residuals {
    /// Output name.
    pub(super) channel: String,
    /// Unit label.
    pub(super) unit: String,
    /// Noise sd, root mean square over the values.
    pub(super) noise: f64,
    /// Use of every value.
    pub(super) usage: Usage,
    /// Observed − predicted.
    pub(super) value: Vec<f64>,
    /// Variance that noise and the uncertainty of the fit explain.
    pub(super) variance: Vec<f64>,
    /// Index of the record.
    pub(super) record: Vec<usize>,
    /// Index in the record's times.
    pub(super) step: Vec<usize>,
    /// Time.
    pub(super) time: Vec<f64>,
}

impl Residuals {
    /// Number of values.
    pub(super) fn len(&self) -> usize {
        self.value.len()
    }

    /// The residuals in units of what is expected of them.
    pub(super) fn standardised(&self) -> Vec<f64> {
        self.value.iter().zip(&self.variance).map(|(e, v)| e / v.sqrt()).collect()
    }

    /// Whether the value after this one is the next of the same record.
    pub(super) fn goes_on(&self, i: usize) -> bool {
        self.record.get(i + 1).is_some_and(|next| *next == self.record[i])
    }
}

/// The residuals by output and use: outputs in the order of the setup, training values first.
pub(super) fn groups(view: &View<'_>) -> Vec<Residuals> {
    let mut groups = Vec::new();
    for (output, name) in view.study.setup.outputs.iter().enumerate() {
        for usage in [Usage::Train, Usage::HeldOut, Usage::HeldOutChannel] {
            if let Some(group) = group(view, output, name, usage) {
                groups.push(group);
            }
        }
    }
    groups
}

fn group(view: &View<'_>, output: usize, name: &str, usage: Usage) -> Option<Residuals> {
    let at: Vec<usize> = (0..view.rows.rows.len())
        .filter(|i| {
            let row = &view.rows.rows[*i];
            row.output == output && row.usage == usage && view.predicted[*i].is_finite()
        })
        .collect();
    let first = view.rows.rows.get(*at.first()?)?;
    let row = |i: &usize| &view.rows.rows[*i];
    let sd = |i: usize| view.prediction_sd.and_then(|sd| sd.get(i).copied()).filter(|s| s.is_finite());
    Some(Residuals {
        channel: name.to_owned(),
        unit: unit(view.study, first.record, first.channel),
        noise: (at.iter().map(|i| row(i).noise.powi(2)).sum::<f64>() / at.len() as f64).sqrt(),
        usage,
        value: at.iter().map(|i| row(i).observed - view.predicted[*i]).collect(),
        variance: at.iter().map(|i| row(i).noise.powi(2) + sd(*i).unwrap_or(0.0).powi(2)).collect(),
        record: at.iter().map(|i| row(i).record).collect(),
        step: at.iter().map(|i| row(i).step).collect(),
        time: at.iter().map(|i| row(i).time).collect(),
    })
}

/// The groups that show what a channel does: its training values, or all that there are of a channel that is never fitted.
pub(super) fn primary(groups: &[Residuals]) -> Vec<&Residuals> {
    let mut chosen: Vec<&Residuals> = Vec::new();
    for group in groups {
        if chosen.iter().all(|other| other.channel != group.channel) {
            chosen.push(group);
        }
    }
    chosen
}
