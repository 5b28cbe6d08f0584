//! How much a run has to do: runs of the model, each weighed by the time that it simulates.
//!
//! An estimate for whoever waits; no number of a result depends on it. Rescued runs and resampled ensembles are not foreseen: they
//! make the work slower, not more. Next file to read: [`crate::run`].

use serde::{Deserialize, Serialize};
use starlings_estimators::Form;
use starlings_models::Window;

use crate::{Study, constants};

/// Passes that are expected where they go on until the estimate has settled, until there are more.
const PASSES: usize = 4;
/// Iterations that are expected of a batch fit, until there are more.
const ITERATIONS: usize = 6;
/// What a run of a whole record takes of the time of windows as long as it: these wait for one another at every analysis.
const WHOLE: f64 = 0.4;
/// Runs of a whole record between two passes that go on until the estimate has settled.
const SEARCH: f64 = 2.0;

/// Work of a command, in a unit of its own: of a run simulated time times runs, in its study's time; of an explanation, an identification, a
/// diagnosis and a forecast runs of the model; of an inference steps of the recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// What is done.
    pub done: f64,
    /// What the next batch of runs holds.
    pub next: f64,
    /// All of it, as far as it can be foreseen.
    pub total: f64,
}

/// The parts of a run that are known before it begins.
#[derive(Clone, Debug)]
pub(crate) struct WorkPlan {
    /// Of one particle up to every step of a pass; the last one is the whole pass.
    before: Vec<f64>,
    particles: f64,
    passes: Option<usize>,
    is_filter: bool,
    /// Of the runs after the fit, in their order.
    last: Vec<f64>,
}

impl WorkPlan {
    /// The plan of a study whose fit makes so many runs at a time.
    pub(crate) fn new(study: &Study, n_particle: usize) -> Self {
        let is_filter = matches!(study.estimator.kind.form, Form::Windows(_));
        let length = |window: &Window| window.times.last().map_or(0.0, |end| end - window.start).max(0.0);
        let records = 0..study.records.len();
        let whole: f64 = records.clone().map(|record| length(&study.whole(record, false))).sum();
        let trained: f64 = study.trained_windows().iter().map(|(_, window)| length(window)).sum();
        let mut before = vec![0.0];
        if is_filter {
            let windows: Vec<_> = records.map(|record| study.windows(record)).collect();
            for step in 0..windows.iter().map(Vec::len).max().unwrap_or(0) {
                let of_step: f64 =
                    windows.iter().filter_map(|windows| windows.get(step)).map(|w| length(w)).sum();
                before.push(before[step] + of_step);
            }
        } else {
            before.push(trained);
        }
        let beside = study.parameters.len() as f64 + 1.0;
        let n_constant = if study.drifts() { 0 } else { constants::n_run(study) };
        let observer = if study.observer_is_off() { 0.0 } else { trained };
        let constants = if n_constant > 0 { (beside + n_constant as f64) * trained } else { 0.0 };
        let residuals = if study.drifts() && is_filter { 0.0 } else { beside * whole };
        let predicted =
            if study.predict.outputs.is_empty() { 0.0 } else { study.predict.members as f64 * whole };
        let weight = if is_filter { WHOLE } else { 1.0 };
        Self {
            before,
            particles: n_particle as f64,
            passes: study.passes(),
            is_filter,
            last: [whole, observer, constants, residuals, predicted].map(|work| weight * work).to_vec(),
        }
    }

    /// After so many steps of a pass, from 0: of a filter, or iterations of a batch fit in pass 0.
    pub(crate) fn at(&self, pass: usize, step: usize) -> Work {
        let of_pass = self.particles * self.before.last().copied().unwrap_or(0.0);
        let search = if self.is_filter && self.passes.is_none() {
            SEARCH * WHOLE * of_pass / self.particles
        } else {
            0.0
        };
        let (done, n) = if self.is_filter {
            let upto = self.before.get(step).copied().unwrap_or(0.0);
            (
                pass as f64 * (of_pass + search) + self.particles * upto,
                self.passes.unwrap_or(PASSES.max(pass + 1)),
            )
        } else {
            (step as f64 * of_pass, ITERATIONS.max(step + 1))
        };
        let next = if self.is_filter {
            let of_step = |step: usize| self.before.get(step).copied();
            of_step(step + 1).zip(of_step(step)).map_or(search, |(to, from)| self.particles * (to - from))
        } else {
            of_pass
        };
        let fit = n as f64 * of_pass + (n - 1) as f64 * search;
        Work { done, next, total: fit + self.last.iter().sum::<f64>() }
    }

    /// After a fit with this much done, before the runs after it with this place: the final run, the observer, constants, residuals,
    /// predictions.
    pub(crate) fn after(&self, fit: f64, place: usize) -> Work {
        let done = self.last.iter().take(place).sum::<f64>();
        let next = self.last.get(place).copied().unwrap_or(0.0);
        Work { done: fit + done, next, total: fit + self.last.iter().sum::<f64>() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(passes: Option<usize>) -> WorkPlan {
        WorkPlan {
            before: vec![0.0, 1.0, 3.0],
            particles: 4.0,
            passes,
            is_filter: true,
            last: vec![3.0, 0.0, 6.0, 6.0],
        }
    }

    #[test]
    fn the_work_of_a_fixed_number_of_passes_adds_up_to_all_of_it() {
        let plan = plan(Some(2));
        let mut done = 0.0;
        for (pass, step) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let work = plan.at(pass, step);
            assert!((work.done - done).abs() < 1e-12, "{work:?}");
            done += work.next;
        }
        assert!((done - 24.0).abs() < 1e-12);
        for place in 0..4 {
            let work = plan.after(24.0, place);
            assert!((work.done - done).abs() < 1e-12 && (work.total - 39.0).abs() < 1e-12, "{work:?}");
            done += work.next;
        }
        assert!((done - plan.at(0, 0).total).abs() < 1e-12);
    }

    #[test]
    fn more_passes_than_expected_move_the_end_and_never_the_start() {
        let plan = plan(None);
        let work = |pass| plan.at(pass, 1);
        assert!((work(0).total - work(3).total).abs() < 1e-12);
        assert!(work(4).total > work(3).total && work(4).done < work(4).total);
    }
}
