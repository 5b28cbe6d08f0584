//! Every measured value of a study as one row, in a fixed order that all steps share.
//!
//! Predictions and residuals are vectors aligned with these rows. What is *whitened* is divided by the noise and, where the noise of
//! an output is known to be correlated, mapped to the innovations of that noise, every stretch of it from its own start:
//! residuals, Jacobians and influences by the same linear map, so that sums of squares mean the same whatever the noise is. Next
//! file to read: [`crate::run_cache`].

use nalgebra::DVector;
use starlings_estimators::{CorrelatedNoise, freedom_of_third_differences};
use starlings_study::Study;
use starlings_study::field::quantity_of;

#[cfg(test)]
mod sample;
#[cfg(test)]
pub(crate) use sample::white;

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
    /// Degrees of freedom with which its variance is known; infinite where the study gives it.
    pub noise_freedom: f64,
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
    /// The correlated noise of each output, in units of its stated variance; white where there is none.
    pub(crate) noise: Vec<Option<CorrelatedNoise>>,
}

impl Rows {
    /// Number of outputs that rows compare, or that stand before one of them.
    pub(crate) fn n_output(&self) -> usize {
        self.rows.iter().map(|row| row.output + 1).max().unwrap_or(0)
    }

    /// The mean square of the values, one for each row, of every output over the training rows that count; `None` for an output with fewer
    /// than `least` of them.
    pub(crate) fn mean_squares(
        &self,
        values: &[f64],
        least: usize,
        counts: impl Fn(&Row) -> bool,
    ) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0_usize); self.n_output()];
        for &i in self.train.iter().filter(|i| counts(&self.rows[**i])) {
            let (sum, n) = &mut sums[self.rows[i].output];
            (*sum, *n) = (*sum + values[i] * values[i], *n + 1);
        }
        sums.into_iter().map(|(sum, n)| (n >= least).then(|| sum / n as f64)).collect()
    }

    /// The rows of a study. Missing values have none.
    pub fn new(study: &Study) -> Self {
        let channels = || study.records.iter().flat_map(|record| &record.channels);
        let n = channels().flat_map(|channel| &channel.values).filter(|v| v.is_finite()).count();
        let mut rows = Vec::with_capacity(n);
        for (r, record) in study.records.iter().enumerate() {
            for (c, channel) in record.channels.iter().enumerate() {
                let noise_freedom =
                    channel.noise_found_from.map_or(f64::INFINITY, freedom_of_third_differences);
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
                    rows.push(Row {
                        record: r,
                        channel: c,
                        output,
                        step,
                        time,
                        observed,
                        noise,
                        noise_freedom,
                        usage,
                    });
                }
            }
        }
        let mut train: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].usage == Usage::Train).collect();
        train.shrink_to_fit();
        Self { rows, train, noise: Vec::new() }
    }

    /// Noise sd of a channel of a record, in the channel's unit.
    pub(crate) fn noise_of(&self, record: usize, channel: usize) -> Option<f64> {
        let mut of = self.rows[self.of_record(record)].iter().filter(|row| row.channel == channel);
        of.next().map(|row| row.noise)
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
        self.stretches_of(0..self.rows.len())
    }

    fn stretches_of(&self, part: std::ops::Range<usize>) -> Vec<std::ops::Range<usize>> {
        let key = |row: &Row| (row.record, row.channel, row.usage);
        let mut stretches = Vec::new();
        let mut first = part.start;
        for i in part.start + 1..=part.end {
            if i == part.end || key(&self.rows[i]) != key(&self.rows[first]) {
                stretches.push(first..i);
                first = i;
            }
        }
        stretches
    }

    /// (observed − predicted) / noise of every row.
    pub(crate) fn scaled(&self, predicted: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(predicted).map(|(row, y)| (row.observed - y) / row.noise).collect()
    }

    /// The same, whitened.
    pub(crate) fn whitened(&self, predicted: &[f64]) -> Vec<f64> {
        let mut whitened = self.scaled(predicted);
        self.whiten(0, &mut whitened);
        whitened
    }

    /// The whitened residuals of the training rows.
    pub(crate) fn train_residual(&self, predicted: &[f64]) -> DVector<f64> {
        let whitened = self.whitened(predicted);
        DVector::from_iterator(self.train.len(), self.train.iter().map(|i| whitened[*i]))
    }

    /// Whitens values in units of the noise, those of whole stretches of rows from `first` on.
    pub(crate) fn whiten(&self, first: usize, values: &mut [f64]) {
        self.map(first, values, CorrelatedNoise::whiten);
    }

    /// The inverse of [`Rows::whiten`].
    pub(crate) fn colour(&self, first: usize, values: &mut [f64]) {
        self.map(first, values, CorrelatedNoise::colour);
    }

    fn map(&self, first: usize, values: &mut [f64], by: fn(&CorrelatedNoise, &[f64], &mut [f64])) {
        if self.is_white() {
            return;
        }
        for stretch in self.stretches_of(first..first + values.len()) {
            if let Some(Some(noise)) = self.noise.get(self.rows[stretch.start].output) {
                by(noise, &self.times(&stretch), &mut values[stretch.start - first..stretch.end - first]);
            }
        }
    }

    /// Whether the noise of every output counts as white.
    pub(crate) fn is_white(&self) -> bool {
        self.noise.iter().all(Option::is_none)
    }

    /// The times of a stretch.
    pub(crate) fn times(&self, stretch: &std::ops::Range<usize>) -> Vec<f64> {
        self.rows[stretch.clone()].iter().map(|row| row.time).collect()
    }

    /// Degrees of freedom with which the mean noise variance of the rows that `of` takes is known; infinite where the study gives every
    /// noise of theirs. What has the same noise to the bit was found to have it together: components of a field, records of one channel.
    /// Variances that are known by themselves are weighed by their rows (Satterthwaite, Biometrics Bulletin 1946).
    pub(crate) fn noise_freedom(&self, of: impl Fn(&Row) -> bool) -> f64 {
        let mut found: Vec<(u64, f64, f64)> = Vec::new();
        let mut n = 0.0;
        for row in self.rows.iter().filter(|row| of(row)) {
            n += 1.0;
            if row.noise_freedom.is_infinite() {
                continue;
            }
            let key = row.noise.to_bits();
            match found.iter_mut().find(|(known, ..)| *known == key) {
                Some((_, of_it, _)) => *of_it += 1.0,
                None => found.push((key, 1.0, row.noise_freedom)),
            }
        }
        let spread = found.iter().map(|(_, of_it, freedom)| (of_it / n).powi(2) / freedom).sum::<f64>();
        if spread > 0.0 { 1.0 / spread } else { f64::INFINITY }
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
mod tests {
    use super::*;

    #[test]
    fn every_stretch_is_whitened_from_its_own_start_and_coloured_back() {
        let mut rows = Rows::sample(30, |i| if i < 20 { Usage::Train } else { Usage::HeldOut });
        let values = white(30, 2).as_slice().to_vec();
        let mut same = values.clone();
        rows.whiten(0, &mut same);
        assert_eq!(same, values, "white noise keeps the bits");
        let noise = CorrelatedNoise { white: 0.1, correlated: 0.9, length: 2.0 };
        rows.noise = vec![Some(noise)];
        let mut whole = values.clone();
        rows.whiten(0, &mut whole);
        let (mut train, mut held_out) = (values[..20].to_vec(), values[20..].to_vec());
        rows.whiten(0, &mut train);
        rows.whiten(20, &mut held_out);
        assert_eq!(whole, [train, held_out].concat(), "no stretch knows of another");
        assert!(whole.iter().zip(&values).skip(1).any(|(a, b)| (a - b).abs() > 0.1));
        rows.colour(0, &mut whole);
        // Two passes of thirty values.
        assert!(whole.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
