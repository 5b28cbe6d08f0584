//! From recordings to windows: what a run sees of a record, and when.
//!
//! Held-out values are left out here only: no window that reaches the fleet holds one. Next file to read:
//! [`crate::fit::filter`], which runs the windows.

use std::sync::Arc;

use starlings_models::{Setup, Signal, Window};

use super::checked::{Record, Study};
use crate::fit::runner::StepWindows;

impl Study {
    /// The training windows of a record, `every` observation times each; none for a held-out record.
    ///
    /// Where the record's first row trains and the run starts there, the first window holds it alone and has no length: the initial
    /// state is observed without a step. Rows without a training value are left out, so a gap makes a longer window.
    pub fn windows(&self, record: usize) -> Vec<Arc<Window>> {
        let of_record = &self.records[record];
        let rows = training_rows(of_record);
        let Some(&first) = of_record.times.first() else { return Vec::new() };
        let mut windows = Vec::new();
        let mut start = of_record.start;
        let mut last = LastValues::of(of_record, self.setup.outputs.len());
        let alone = usize::from(rows.first() == Some(&0) && start >= first);
        let (initial, later) = rows.split_at(alone);
        for rows in initial.chunks(1).chain(later.chunks(of_record.every)) {
            let mut window = self.window(of_record, start, rows, !self.delays);
            if !self.observer_is_off() {
                window.since = last.before(start);
                last.see(&window);
            }
            start = window.times.last().copied().unwrap_or(start);
            windows.push(Arc::new(window));
        }
        windows
    }

    /// One window over a record from its start on. With `train_only` the times and values that train, for a fit of the
    /// whole record and for an observer, which then corrects at the times and spacings of the filter's windows; otherwise every
    /// time and no observed value, for a free run.
    pub fn whole(&self, record: usize, train_only: bool) -> Window {
        let of_record = &self.records[record];
        let start = of_record.start;
        if train_only {
            return self.window(of_record, start, &training_rows(of_record), false);
        }
        Window::free(start, of_record.times.clone(), self.setup.outputs.len(), of_record.inputs.clone())
    }

    /// Every trained record from its start, each with its number, as [`Study::whole`] gives it to a fit of the whole record.
    pub(crate) fn trained_windows(&self) -> StepWindows {
        let trained = (0..self.records.len()).filter(|record| self.records[*record].is_trained());
        trained.map(|record| (record, Arc::new(self.whole(record, true)))).collect()
    }

    /// The setup whose runs predict the derivatives by every value beside the outputs.
    pub(crate) fn with_slopes(&self) -> Setup {
        Setup { slopes: true, ..self.setup.clone() }
    }

    /// The window with room for the outputs and their derivatives by every value of a job, and no observed value.
    pub(crate) fn widened(&self, window: &Window) -> Arc<Window> {
        let n_obs = self.setup.outputs.len() * (1 + self.parameters.len());
        Arc::new(Window::free(window.start, window.times.clone(), n_obs, window.inputs.clone()))
    }

    /// The window that is asked for where this one is wanted from the record's start: all times of the record where the solver
    /// answers for nothing less, the values of the others missing.
    pub(super) fn asked(&self, record: usize, window: &Arc<Window>) -> Arc<Window> {
        if !self.whole_answers {
            return Arc::clone(window);
        }
        Arc::new(self.with_values(record, window))
    }

    /// All times of a record, with the observed values of a window of it and no others.
    pub(crate) fn with_values(&self, record: usize, window: &Window) -> Window {
        let n_obs = self.setup.outputs.len();
        let mut whole = self.whole(record, false);
        for (j, values) in rows_of(&whole.times, window).zip(window.observed.chunks(n_obs.max(1))) {
            whole.observed[j * n_obs..(j + 1) * n_obs].copy_from_slice(values);
        }
        whole
    }

    /// The outputs at the times of a window out of those at the times that were asked for.
    pub(super) fn picked(&self, record: usize, window: &Window, outputs: Vec<f64>) -> Vec<f64> {
        let (n_obs, times) = (self.setup.outputs.len(), &self.records[record].times);
        if !self.whole_answers || outputs.len() != n_obs * times.len() {
            return outputs;
        }
        rows_of(times, window).flat_map(|j| outputs[j * n_obs..(j + 1) * n_obs].iter().copied()).collect()
    }

    /// The end of the first period where a run from here finds its own periodic start, and else here.
    fn first_period(&self, record: &Record, start: f64) -> f64 {
        let place = self.records.iter().position(|known| known.name == record.name);
        let period = place.and_then(|place| self.setup.periods.get(place)).filter(|_| start <= record.start);
        start + period.copied().unwrap_or(0.0)
    }

    /// The window over these rows, their training values in it.
    fn window(&self, record: &Record, start: f64, rows: &[usize], cut: bool) -> Window {
        let n_obs = self.setup.outputs.len();
        let mut observed = vec![f64::NAN; rows.len() * n_obs];
        for channel in record.channels.iter().filter(|c| !c.held_out) {
            for (j, row) in rows.iter().enumerate() {
                observed[j * n_obs + channel.row] = channel.values[*row];
            }
        }
        let times: Vec<f64> = rows.iter().map(|row| record.times[*row]).collect();
        let end = times.last().copied().unwrap_or(start);
        let inputs = if cut {
            let until = end.max(self.first_period(record, start));
            record.inputs.iter().map(|signal| bracket(signal, start, until)).collect()
        } else {
            record.inputs.clone()
        };
        Window { start, times, observed, inputs, since: vec![] }
    }
}

/// When the rows of a record had their last values, for observers.
struct LastValues {
    /// Where the record starts.
    start: f64,
    /// `None` for a row that never has one.
    times: Vec<Option<f64>>,
}

impl LastValues {
    /// At the start of a record, from which rows that are fitted count.
    fn of(record: &Record, n_obs: usize) -> Self {
        let mut times = vec![None; n_obs];
        for channel in record.channels.iter().filter(|c| !c.held_out) {
            times[channel.row] = Some(record.start);
        }
        Self { start: record.start, times }
    }

    /// What a window that begins at `start` says of them; nothing where they all count from there.
    fn before(&self, start: f64) -> Vec<f64> {
        if self.times.iter().flatten().all(|time| *time >= start) {
            return Vec::new();
        }
        self.times.iter().map(|time| time.unwrap_or(self.start)).collect()
    }

    /// Notes the values of a window.
    fn see(&mut self, window: &Window) {
        let n_obs = self.times.len().max(1);
        for (t, values) in window.times.iter().zip(window.observed.chunks(n_obs)) {
            for (time, value) in self.times.iter_mut().zip(values) {
                if value.is_finite() {
                    *time = Some(*t);
                }
            }
        }
    }
}

/// Places of a window's times among these, which hold them all.
fn rows_of<'a>(times: &'a [f64], window: &'a Window) -> impl Iterator<Item = usize> + 'a {
    window.times.iter().filter_map(|time| times.binary_search_by(|t| t.total_cmp(time)).ok())
}

/// Rows within the training span where a channel that is fitted was measured.
pub(super) fn training_rows(record: &Record) -> Vec<usize> {
    let measured = |row: usize| record.channels.iter().any(|c| !c.held_out && c.values[row].is_finite());
    (0..record.times.len()).filter(|row| record.trains_at(record.times[*row]) && measured(*row)).collect()
}

/// The part of a signal that a run over `[start, end]` can see: one sample beyond either end, so that values and slopes at
/// the ends are those of the whole signal.
fn bracket(signal: &Signal, start: f64, end: f64) -> Signal {
    let from = signal.times.partition_point(|t| *t < start).saturating_sub(1);
    // Two samples after the end: a sample at the end to within rounding does not count as beyond it.
    let to = (signal.times.partition_point(|t| *t <= end) + 2).min(signal.times.len());
    Signal { times: signal.times[from..to].to_vec(), values: signal.values[from..to].to_vec() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    #[test]
    fn a_cut_signal_has_the_values_and_slopes_of_the_whole() {
        let times: Vec<f64> = (0..20).map(|i| f64::from(i) * 0.5).collect();
        let values = times.iter().map(|t| t * t).collect();
        let signal = Signal { times, values };
        let cut = bracket(&signal, 2.0, 3.2);
        assert!(cut.times.len() < 8, "{:?}", cut.times);
        for k in 0..=12 {
            let t = 2.0 + 0.1 * f64::from(k);
            assert_eq!(cut.at(t), signal.at(t), "t = {t}");
        }
    }

    #[test]
    fn a_signal_that_ends_early_is_cut_at_its_end() {
        let signal = Signal { times: vec![0.0, 1.0], values: vec![1.0, 2.0] };
        assert_eq!(bracket(&signal, 1.0, 1.0), signal);
        assert_eq!(bracket(&signal, 0.0, 0.0), signal);
    }
}
