//! The runs of a twin: its start, and its record.
//!
//! Next file to read: [`starlings_models::periodic`].

use std::sync::Arc;

use starlings_models::periodic::{NotPeriodic, fixed_point, sizes};
use starlings_models::{Forward, Job, ParticleError, Prediction, Signal, Window};

use super::TwinError;

/// Change of an input's value from one period to the next, as a share of its range, beyond which it is not periodic.
const NOT_PERIODIC: f64 = 0.05;
/// Parts of a period at whose ends the sizes of the states are taken.
const PARTS: usize = 32;

/// A model with the values of one twin.
pub(super) struct Run<'a> {
    pub(super) model: &'a dyn Forward,
    /// Index of the record.
    pub(super) record: usize,
    /// A job's parameter values.
    pub(super) theta: Vec<f64>,
    /// Number of output components.
    pub(super) n_obs: usize,
    /// Periods that were run, after [`Run::periodic`].
    pub(super) n_period: Option<usize>,
}

impl Run<'_> {
    /// Runs one window from a state, or from the model's initial one.
    pub(super) fn predict(
        &self,
        window: &Arc<Window>,
        state: Option<Vec<f64>>,
    ) -> Result<Prediction, ParticleError> {
        let (window, theta, state) = (Arc::clone(window), self.theta.clone(), state.map(Into::into));
        self.model.run(&Job { particle: 0, record: self.record as u32, window, theta, state })
    }

    /// The initial state: what a run of no length ends with.
    pub(super) fn initial(&self, window: &Window) -> Result<Vec<f64>, ParticleError> {
        Ok(self.predict(&self.part(window, window.start, vec![window.start]), None)?.state.into_vec())
    }

    /// The periodic state; inputs are made to go on periodically to the window's end.
    pub(super) fn periodic(&mut self, window: &mut Window, period: f64) -> Result<Vec<f64>, TwinError> {
        let spec = self.model.spec();
        let end = window.start + period;
        for (signal, input) in window.inputs.iter_mut().zip(&spec.inputs) {
            check_input(signal, &input.name, window.start, end)?;
            repeat(signal, end, period, window.times.last().copied().unwrap_or(end));
        }
        let start = self.initial(window)?;
        if start.len() != spec.n_state() {
            return Err(TwinError::Request("a model with delays has no periodic start".to_owned()));
        }
        // The record's own times, since steps end at them: what is periodic must be what the record is made of.
        let times = within(&window.times, window.start, end);
        let size = self.sizes(window, &times, start.clone())?;
        let whole = self.part(window, window.start, times);
        let mut once = |x: &[f64]| Ok(self.predict(&whole, Some(x.to_vec()))?.state.into_vec());
        let found = fixed_point(&mut once, start, &size).map_err(|refused| match refused {
            NotPeriodic::Model(error) => TwinError::Model(error),
            NotPeriodic::StillMoving { n_period, change } => TwinError::Request(format!(
                "no periodic state: after {n_period} periods of {period} the state still changes by {change:.1e} of its \
                 size per period; check the period, or the tolerances of the model's solver"
            )),
        })?;
        self.n_period = Some(found.n_period);
        Ok(found.state)
    }

    /// The size of every state component: the largest value of its quantity over a period, at a few times.
    fn sizes(&self, window: &Window, times: &[f64], mut x: Vec<f64>) -> Result<Vec<f64>, ParticleError> {
        let mut states = Vec::with_capacity(PARTS + 1);
        let mut from = window.start;
        for times in times.chunks(times.len().div_ceil(PARTS)) {
            states.push(x.clone());
            x = self.predict(&self.part(window, from, times.to_vec()), Some(x))?.state.into_vec();
            from = times.last().copied().unwrap_or(from);
        }
        states.push(x);
        Ok(sizes(self.model.spec(), &states))
    }

    /// A window over these times with the inputs of another.
    fn part(&self, window: &Window, start: f64, times: Vec<f64>) -> Arc<Window> {
        Arc::new(Window::free(start, times, self.n_obs, window.inputs.clone()))
    }
}

/// The times after `start` up to `end`, and `end` itself.
fn within(times: &[f64], start: f64, end: f64) -> Vec<f64> {
    let near = 1e-9 * (end - start);
    let mut inner: Vec<f64> = times.iter().copied().filter(|t| *t > start && *t < end - near).collect();
    inner.push(end);
    inner
}

/// Refuses an input that does not reach over the period or does not come back to its value.
fn check_input(signal: &Signal, name: &str, start: f64, end: f64) -> Result<(), TwinError> {
    let last = signal.times.last().copied().unwrap_or(start);
    if last < end - 1e-9 * (end - start) {
        return Err(TwinError::Request(format!(
            "input `{name}` ends at {last}, before the first period does at {end}"
        )));
    }
    let values = signal.values.iter().copied();
    let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    // Every sample against the same time of the next period, as far as the input reaches: the two ends alone can agree by
    // chance, as those of a flow at rest do.
    let period = end - start;
    let inner = signal.times.iter().copied().filter(|t| *t > start && t + period <= last);
    for t in std::iter::once(start).chain(inner) {
        let (a, b) = (signal.at(t), signal.at(t + period));
        if (b - a).abs() > NOT_PERIODIC * (hi - lo) {
            return Err(TwinError::Request(format!(
                "input `{name}` is {a} at {t} and {b} a period later: it has another period"
            )));
        }
    }
    Ok(())
}

/// Repeats a signal's last whole period until `until`, if it ends earlier.
fn repeat(signal: &mut Signal, first_end: f64, period: f64, until: f64) {
    let Some(&last) = signal.times.last() else { return };
    let near = 1e-9 * period;
    if last >= until - near {
        return;
    }
    // Samples of the first period, its end included and its start not.
    let start = first_end - period;
    let cycle: Vec<(f64, f64)> = signal
        .times
        .iter()
        .zip(&signal.values)
        .filter(|(t, _)| **t > start + near && **t < first_end - near)
        .map(|(t, v)| (*t, *v))
        .chain([(first_end, signal.at(first_end))])
        .collect();
    let n_whole = ((last - start) / period + 1e-9).floor().max(1.0);
    let kept = signal.times.partition_point(|t| *t <= n_whole.mul_add(period, start) + near);
    signal.times.truncate(kept);
    signal.values.truncate(kept);
    let mut shift = n_whole * period;
    while shift + start < until - near {
        signal.times.extend(cycle.iter().map(|(t, _)| t + shift));
        signal.values.extend(cycle.iter().map(|(_, v)| *v));
        shift += period;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_of_one_period_goes_on_with_the_same_samples() {
        let mut signal =
            Signal { times: vec![1.0, 1.25, 1.5, 2.0, 2.1], values: vec![0.0, 1.0, 3.0, 0.0, 7.0] };
        repeat(&mut signal, 2.0, 1.0, 4.0);
        // Sums of numbers with few binary digits are exact, also as text.
        assert_eq!(format!("{:?}", signal.times), "[1.0, 1.25, 1.5, 2.0, 2.25, 2.5, 3.0, 3.25, 3.5, 4.0]");
        assert_eq!(format!("{:?}", signal.values), "[0.0, 1.0, 3.0, 0.0, 1.0, 3.0, 0.0, 1.0, 3.0, 0.0]");
    }

    #[test]
    fn an_input_that_is_at_rest_at_both_ends_still_has_another_period() {
        // A pulse of 0.3 s in a beat of 0.8 s, over two beats.
        let times: Vec<f64> = (0..=160).map(|k| 0.01 * f64::from(k)).collect();
        let pulse =
            |t: &f64| (std::f64::consts::PI * (t % 0.8) / 0.3).sin().max(0.0) * f64::from(t % 0.8 < 0.3);
        let signal = Signal { values: times.iter().map(pulse).collect(), times };
        let told = |period: f64| check_input(&signal, "flow", 0.0, period).map_err(|error| error.to_string());
        assert_eq!(told(0.8), Ok(()));
        for wrong in [0.3, 0.4, 0.79] {
            let refused = told(wrong).unwrap_err();
            assert!(refused.contains("it has another period"), "{wrong}: {refused}");
        }
    }

    #[test]
    fn the_times_of_a_period_end_with_its_end_once() {
        let times: Vec<f64> = (0..30).map(|k| 0.1 * f64::from(k)).collect();
        let inside = within(&times, 0.0, 0.8);
        assert_eq!(inside.len(), 8, "{inside:?}");
        assert_eq!(inside.last().map(|t| format!("{t:?}")).as_deref(), Some("0.8"));
    }
}
