//! How much a run has to do: runs of the model, each weighed by the time that it simulates, and what the coordinator does after them.
//!
//! Rescued runs and resampled ensembles are not foreseen: they make the work slower, not more. Next file to read: [`crate::run`].

use starlings_estimators::Form;
use starlings_models::Window;

use super::settling::More;
use super::{Part, Takes, Work};
use crate::fit::LIMIT;
use crate::{Study, constants};

/// Passes that are expected where they go on until the estimate has settled, until their moves tell more.
const PASSES: usize = 4;
/// Iterations that are expected of a batch fit, until their steps tell more.
const ITERATIONS: usize = 4;
/// What a run of a whole record takes of the time of windows as long as it, until one was made: these wait for one another at every
/// analysis. The share where a run takes no time of its own.
const WHOLE: f64 = 0.4;
/// Runs of a whole record between two passes that go on until the estimate has settled.
const SEARCH: f64 = 2.0;
/// What the coordinator does after the runs, s: the statistics of the residuals, the summary, the files; of every study, and for every value
/// that is compared and every parameter, as it took in the coarctation and the plate in the development profile.
const FILES_S: f64 = 0.03;
const VALUE_S: f64 = 1e-5;

/// Kinds of work, by their places: windows of a filter, whole records, the coordinator's own.
const WINDOWS: usize = 0;
const RECORDS: usize = 1;
const OWN: usize = 2;

/// The parts of a run that are known before it begins.
#[derive(Clone, Debug)]
pub(crate) struct WorkPlan {
    /// Of one particle up to every step of a pass; the last one is the whole pass.
    before: Vec<f64>,
    particles: f64,
    passes: Option<usize>,
    /// Passes of a filter or iterations of a batch fit, at most.
    most: usize,
    is_filter: bool,
    /// Of the runs after the fit, in their order.
    last: Vec<f64>,
    /// Seconds of the coordinator after all runs.
    own_s: f64,
}

impl WorkPlan {
    /// The plan of a study whose fit makes so many runs at a time.
    pub(crate) fn new(study: &Study, n_particle: usize) -> Self {
        let is_filter = matches!(study.estimator.kind.form, Form::Windows(_));
        let length = |window: &Window| window.times.last().map_or(0.0, |end| end - window.start).max(0.0);
        let records = 0..study.records.len();
        let whole_windows: Vec<Window> = records.clone().map(|record| study.whole(record, false)).collect();
        let whole: f64 = whole_windows.iter().map(length).sum();
        let values: usize = whole_windows.iter().map(|window| window.observed.len()).sum();
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
        Self {
            before,
            particles: n_particle as f64,
            passes: study.passes(),
            most: if is_filter { LIMIT } else { study.estimator.max_iterations },
            is_filter,
            last: vec![whole, observer, constants, residuals, predicted],
            own_s: VALUE_S.mul_add((values * study.parameters.len()) as f64, FILES_S),
        }
    }

    /// After so many steps of a pass, from 0: of a filter, or iterations of a batch fit in pass 0. `more` are the
    /// passes after this one, or the iterations after those.
    pub(crate) fn at(&self, pass: usize, step: usize, more: More) -> Work {
        let ends = more != More::Unknown || self.passes.is_some() && self.is_filter;
        Work { ends, ..self.foreseen(pass, step, more) }
    }

    fn foreseen(&self, pass: usize, step: usize, more: More) -> Work {
        let of_pass = self.particles * self.of_pass();
        if !self.is_filter {
            let left = expected(more).unwrap_or_else(|| ITERATIONS.saturating_sub(step).max(1));
            let left = left.min(self.most.saturating_sub(step));
            let fit = [step as f64 * of_pass, left as f64 * of_pass];
            return self.work([[0.0; 2], fit], 0, if left > 0 { of_pass } else { 0.0 }, RECORDS);
        }
        let search = if self.passes.is_none() { SEARCH * self.of_pass() } else { 0.0 };
        let upto = |step: usize| self.before.get(step).copied();
        let of_this = self.particles * upto(step).unwrap_or(0.0);
        let later = match self.passes {
            Some(passes) => passes.saturating_sub(pass + 1),
            None => expected(more)
                .unwrap_or_else(|| PASSES.saturating_sub(pass + 1))
                .min(self.most.saturating_sub(pass + 1)),
        } as f64;
        let windows = [of_pass.mul_add(pass as f64, of_this), of_pass.mul_add(later + 1.0, -of_this)];
        let searches = [pass as f64 * search, later * search];
        match upto(step + 1).zip(upto(step)) {
            Some((to, from)) => self.work([windows, searches], 0, self.particles * (to - from), WINDOWS),
            None => self.work([windows, searches], 0, search.min(searches[1]), RECORDS),
        }
    }

    /// After a fit that did this much, before the runs after it with this place: the final run, the observer, constants, residuals,
    /// predictions; after the last of them the coordinator's own work.
    pub(crate) fn after(&self, fit: [f64; 2], place: usize) -> Work {
        let next = self.last.get(place).copied();
        let at = if next.is_some() { RECORDS } else { OWN };
        self.work(fit.map(|done| [done, 0.0]), place, next.unwrap_or(0.0), at)
    }

    /// Of a pass, for one particle.
    fn of_pass(&self) -> f64 {
        self.before.last().copied().unwrap_or(0.0)
    }

    /// Done and left of the windows and of the whole records of the fit, and the runs after it, before that with a place.
    fn work(&self, [windows, records]: [[f64; 2]; 2], place: usize, next: f64, at: usize) -> Work {
        let done: f64 = self.last.iter().take(place).sum();
        let left: f64 = self.last.iter().skip(place).sum();
        let part = |takes, [done, left]: [f64; 2]| Part { takes, done, left };
        let whole = if self.is_filter { WHOLE } else { 1.0 };
        let parts = vec![
            part(Takes::Runs(1.0), windows),
            part(Takes::Runs(whole), [records[0] + done, records[1] + left]),
            part(Takes::Seconds(self.own_s), [0.0, 1.0]),
        ];
        Work { parts, at, next, ends: true }
    }
}

fn expected(more: More) -> Option<usize> {
    if let More::Expected(more) = more { Some(more) } else { None }
}

/// What a fit did, of windows and of whole records.
pub(crate) fn done(work: &Work) -> [f64; 2] {
    [WINDOWS, RECORDS].map(|kind| work.parts[kind].done)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(passes: Option<usize>) -> WorkPlan {
        WorkPlan {
            before: vec![0.0, 1.0, 3.0],
            particles: 4.0,
            passes,
            most: 12,
            is_filter: true,
            last: vec![3.0, 0.0, 6.0, 6.0],
            own_s: 1.0,
        }
    }

    fn is_close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn the_work_of_a_fixed_number_of_passes_adds_up_to_all_of_it() {
        let plan = plan(Some(2));
        let mut done = 0.0;
        for (pass, step) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let work = plan.at(pass, step, More::Usual);
            assert!(is_close(work.parts[WINDOWS].done, done) && work.at == WINDOWS, "{work:?}");
            assert!(is_close(work.parts[WINDOWS].left, 24.0 - done), "{work:?}");
            assert!(is_close(work.parts[RECORDS].left, 15.0), "{work:?}");
            done += work.next;
        }
        assert!(is_close(done, 24.0));
        let mut after = 0.0;
        for place in 0..4 {
            let work = plan.after([24.0, 0.0], place);
            let records = work.parts[RECORDS];
            assert!(is_close(records.done, after) && is_close(records.left, 15.0 - after), "{work:?}");
            after += work.next;
        }
        assert!(is_close(after, 15.0));
        let own = plan.after([24.0, 0.0], 4);
        assert!(
            own.at == OWN && is_close(own.parts[OWN].left, 1.0) && is_close(own.parts[RECORDS].left, 0.0)
        );
    }

    #[test]
    fn passes_that_are_expected_are_as_many_as_their_moves_tell() {
        let plan = plan(None);
        let left = |pass, more| plan.at(pass, 2, more).parts[WINDOWS].left;
        assert!(is_close(left(0, More::Usual), 36.0), "three passes more");
        assert!(is_close(left(1, More::Expected(1)), 12.0), "the moves are short");
        assert!(is_close(left(5, More::Usual), 0.0), "more passes than are usual");
        assert!(
            is_close(left(9, More::Expected(50)), 24.0),
            "two are left of the twelve that there are at most"
        );
        assert!(plan.at(1, 1, More::Usual).ends && !plan.at(1, 1, More::Unknown).ends);
        let search = plan.at(0, 2, More::Expected(2));
        assert!(search.at == RECORDS && is_close(search.next, 6.0), "{search:?}");
        assert!(is_close(search.parts[RECORDS].left, 2.0 * 6.0 + 15.0), "{search:?}");
    }

    #[test]
    fn iterations_of_a_batch_fit_are_runs_of_whole_records() {
        let plan = WorkPlan { is_filter: false, before: vec![0.0, 3.0], ..plan(Some(1)) };
        let first = plan.at(0, 0, More::Usual);
        assert!(first.at == RECORDS && is_close(first.next, 12.0), "{first:?}");
        assert!(is_close(first.parts[RECORDS].left, 4.0 * 12.0 + 15.0), "{first:?}");
        let settled = plan.at(0, 3, More::Expected(0));
        assert!(is_close(settled.parts[RECORDS].left, 15.0) && is_close(settled.next, 0.0), "{settled:?}");
        let slow = plan.at(0, 10, More::Expected(50));
        assert!(is_close(slow.parts[RECORDS].left, 2.0 * 12.0 + 15.0), "two more may follow: {slow:?}");
    }
}
