//! Every measured value of a study as one row, in a fixed order that all steps share.
//!
//! Predictions and residuals are vectors aligned with these rows. Next file to read: [`crate::run_cache`].

use starlings_study::Study;
use starlings_study::field::quantity_of;

/// What a row may be used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usage {
    /// The fit sees it.
    Train,
    /// Beyond the training span, or in a record that is held out.
    HeldOut,
    /// In a channel that is never fitted.
    HeldOutChannel,
}

impl Usage {
    /// The word of `explain.json`.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::HeldOut => "held-out",
            Self::HeldOutChannel => "held-out-channel",
        }
    }
}

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Index in [`Study::records`].
    pub record: usize,
    /// Index in the record's channels.
    pub channel: usize,
    /// Index in the outputs of the setup.
    pub output: usize,
    /// Index in the record's times.
    pub step: usize,
    /// Time.
    pub time: f64,
    /// Measured value.
    pub observed: f64,
    /// Noise sd, in the channel's unit.
    pub noise: f64,
    /// What it may be used for.
    pub usage: Usage,
}

/// Unit label of a channel: its own where the study gives one, or that of its output, or of a state by that name.
pub(crate) fn unit(study: &Study, record: usize, channel: usize) -> String {
    let of = &study.records[record].channels[channel];
    let quantity = || {
        let output = quantity_of(&study.spec.outputs, &of.output);
        output.or_else(|| quantity_of(&study.spec.states, &of.output))
    };
    of.unit.clone().or_else(|| quantity().map(|q| q.unit.clone())).unwrap_or_default()
}

/// Every measured value: records in order, then channels, then times.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// The rows.
    pub rows: Vec<Row>,
    /// Positions of the rows that train, increasing.
    pub train: Vec<usize>,
}

impl Rows {
    /// The rows of a study. Missing values have none.
    pub fn new(study: &Study) -> Self {
        let channels = || study.records.iter().flat_map(|record| &record.channels);
        let n = channels().flat_map(|channel| &channel.values).filter(|v| v.is_finite()).count();
        let mut rows = Vec::with_capacity(n);
        for (r, record) in study.records.iter().enumerate() {
            for (c, channel) in record.channels.iter().enumerate() {
                for (step, (&time, &observed)) in record.times.iter().zip(&channel.values).enumerate() {
                    if !observed.is_finite() {
                        continue;
                    }
                    let usage = if channel.held_out {
                        Usage::HeldOutChannel
                    } else if record.trains_at(time) {
                        Usage::Train
                    } else {
                        Usage::HeldOut
                    };
                    let (output, noise) = (channel.row, channel.noise);
                    rows.push(Row { record: r, channel: c, output, step, time, observed, noise, usage });
                }
            }
        }
        let mut train: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].usage == Usage::Train).collect();
        train.shrink_to_fit();
        Self { rows, train }
    }

    /// Positions of the rows that do not train, increasing.
    pub(crate) fn others(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.rows.len()).filter(|i| self.rows[*i].usage != Usage::Train)
    }

    /// The rows of a record.
    pub(crate) fn of_record(&self, record: usize) -> std::ops::Range<usize> {
        let first = |record| self.rows.partition_point(|row| row.record < record);
        first(record)..first(record + 1)
    }

    /// Runs of consecutive rows of one record, channel and use: (first, one past the last).
    pub(crate) fn stretches(&self) -> Vec<std::ops::Range<usize>> {
        let key = |row: &Row| (row.record, row.channel, row.usage);
        let mut stretches = Vec::new();
        let mut first = 0;
        for i in 1..=self.rows.len() {
            if i == self.rows.len() || key(&self.rows[i]) != key(&self.rows[first]) {
                stretches.push(first..i);
                first = i;
            }
        }
        stretches.retain(|s| !s.is_empty());
        stretches
    }

    /// (observed − predicted) / noise of every row.
    pub(crate) fn whitened(&self, predicted: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(predicted).map(|(row, y)| (row.observed - y) / row.noise).collect()
    }

    /// Root mean square of observed − predicted over the rows that `of` takes; NaN for none.
    pub(crate) fn rmse(&self, predicted: &[f64], of: impl Fn(&Row) -> bool) -> f64 {
        let squares: Vec<f64> = self
            .rows
            .iter()
            .zip(predicted)
            .filter(|(row, _)| of(row))
            .map(|(row, y)| (row.observed - y).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }
}

#[cfg(test)]
impl Rows {
    /// One channel of n rows with noise 1 and the measured value zero, a step of time apart, each for the use that `usage` gives.
    pub(crate) fn sample(n: usize, usage: impl Fn(usize) -> Usage) -> Self {
        let row = |step: usize| {
            let (time, usage) = (step as f64, usage(step));
            Row { record: 0, channel: 0, output: 0, step, time, observed: 0.0, noise: 1.0, usage }
        };
        let rows: Vec<Row> = (0..n).map(row).collect();
        Self { train: (0..n).filter(|i| rows[*i].usage == Usage::Train).collect(), rows }
    }
}

/// White noise of sd 1.
#[cfg(test)]
pub(crate) fn white(n: usize, seed: u64) -> nalgebra::DVector<f64> {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    nalgebra::DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random))
}
