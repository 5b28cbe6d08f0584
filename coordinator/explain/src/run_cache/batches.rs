//! Batches of runs: which runs the fleet is asked for, how many at a time, and how their results are read back.
//!
//! Next file to read: [`super::remembered`].

use std::collections::{HashMap, HashSet};
use std::ops::ControlFlow;
use std::sync::Arc;

use starlings_fleet::{Held, Outcome, SetupId};
use starlings_models::Job;
use starlings_study::store::{JobRow, RunKey, Store, StoreError};
use starlings_study::{Study, run_key};

use super::remembered::{RememberedRun, decode, encode, from_outcome};
use super::{Point, RowPredictions, RunCache};
use crate::error::{ExplainError, fleet_failure};
use crate::rows::Row;

/// Approximate bytes of outputs of one batch.
const PORTION: usize = 2 << 20;
/// Least number of runs of one batch per slot, so that no slot waits.
const PER_SLOT: usize = 4;

/// A run that the fleet was asked for.
struct RequestedRun {
    key: RunKey,
    record: usize,
    particle: u32,
    /// Values that it must predict.
    n_value: usize,
}

impl RunCache<'_> {
    /// Runs all points over all records in one batch and returns the predictions of each point, in their order. A point whose run
    /// fails on any record has the reason instead.
    ///
    /// # Errors
    /// When the fleet or the store fails, or no place could make a run.
    pub fn run(&mut self, points: &[Point<'_>]) -> Result<Vec<RowPredictions>, ExplainError> {
        let mut answers = Vec::with_capacity(points.len());
        self.run_each(points, |_, _, _, answer| answers.push(answer))?;
        Ok(answers)
    }

    /// As [`RunCache::run`], but hands the predictions of a point to `take` as soon as its batch has arrived: the position of the
    /// point, the keys of its runs over the records, the predictions.
    ///
    /// # Errors
    /// As [`RunCache::run`].
    pub(crate) fn run_each(
        &mut self,
        points: &[Point<'_>],
        mut take: impl FnMut(&Self, usize, &[RunKey], RowPredictions),
    ) -> Result<(), ExplainError> {
        let at_a_time = self.at_a_time();
        for (batch, some) in points.chunks(at_a_time).enumerate() {
            let keys = self.request_points(some)?;
            for (k, of_point) in keys.chunks(self.windows.len()).enumerate() {
                let runs: Result<Vec<RememberedRun>, _> =
                    of_point.iter().map(|key| self.remembered(key)).collect();
                take(self, batch * at_a_time + k, of_point, self.predictions(&runs?)?);
            }
        }
        Ok(())
    }

    /// The rows of a point that was run before, from its runs over the records.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn recall(&self, runs: &[RunKey]) -> Result<RowPredictions, ExplainError> {
        let runs: Result<Vec<RememberedRun>, _> = runs.iter().map(|key| self.stored(key)).collect();
        self.predictions(&runs?)
    }

    /// Points of one batch: as many as [`PORTION`] of their outputs allows, but enough to keep every slot busy.
    fn at_a_time(&self) -> usize {
        let bytes: usize = self.windows.iter().map(|window| 8 * window.observed.len()).sum();
        let busy = PER_SLOT * self.fleet.slots() / self.windows.len().max(1);
        (PORTION / bytes.max(1)).max(busy).max(1)
    }

    /// The predictions of one point from its runs over the records: outputs turned into what the channels measure.
    fn predictions(&self, runs: &[RememberedRun]) -> Result<RowPredictions, ExplainError> {
        let n_obs = self.study.setup.outputs.len();
        let mut measured = Vec::with_capacity(runs.len());
        for (run, (record, window)) in runs.iter().zip(self.windows.iter().enumerate()) {
            let mut outputs = match run {
                Ok(outputs) => outputs.to_vec(),
                Err(reason) => return Ok(Err(reason.clone())),
            };
            let (n, wanted) = (outputs.len(), window.observed.len());
            if n != wanted {
                return Err(self.store.damaged("run", format!("{n} values where {wanted} belong")).into());
            }
            self.study.measure(record, &window.times, &mut outputs);
            measured.push(outputs);
        }
        let value = |row: &Row| measured[row.record][row.step * n_obs + row.output];
        Ok(Ok(Arc::new(self.rows.rows.iter().map(value).collect())))
    }

    /// The outputs of runs over records that were changed, all in one batch; `None` where the model fails.
    ///
    /// # Errors
    /// As [`RunCache::run`].
    pub(crate) fn run_alone(
        &mut self,
        runs: Vec<(&Study, Job)>,
    ) -> Result<Vec<Option<Arc<Vec<f64>>>>, ExplainError> {
        let mut jobs = Vec::with_capacity(runs.len());
        for (study, job) in runs {
            jobs.push((self.fleet.install(&study.setup)?, job));
        }
        let keys = self.request_jobs(jobs)?;
        keys.iter().map(|key| Ok(self.remembered(key)?.ok())).collect()
    }

    /// Outputs of every point over every record, as the model gives them: points in order, then records.
    pub(crate) fn outputs(&mut self, points: &[Point<'_>]) -> Result<Vec<RememberedRun>, ExplainError> {
        let keys = self.request_points(points)?;
        keys.iter().map(|key| self.remembered(key)).collect()
    }

    /// Runs every point over every record; the keys of the runs, by point, then record.
    fn request_points(&mut self, points: &[Point<'_>]) -> Result<Vec<RunKey>, ExplainError> {
        let mut jobs = Vec::with_capacity(points.len() * self.windows.len());
        for (particle, point) in points.iter().enumerate() {
            let setup = self.fleet.install(&point.study.setup)?;
            for (record, window) in self.windows.iter().enumerate() {
                let theta = point.study.theta_for(record, point.theta.as_slice());
                let (particle, record, window) = (particle as u32, record as u32, Arc::clone(window));
                jobs.push((setup, Job { particle, record, window, theta, state: None }));
            }
        }
        self.request_jobs(jobs)
    }

    /// The keys of these jobs, in their order. Jobs whose result is in the store are not run again.
    fn request_jobs(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<RunKey>, ExplainError> {
        let mut keys = Vec::with_capacity(jobs.len());
        let programs = self.store.program()?.digest();
        let (mut open, mut requested, mut here) = (Vec::new(), Vec::new(), HashSet::new());
        for (setup, job) in jobs {
            let key = run_key::free(&programs, &setup, &job);
            keys.push(key);
            if !here.insert(key) || self.counted.contains(&key) {
                continue;
            }
            self.counted.insert(key);
            self.count(1);
            if self.store.has_remembered_run(&key)? {
                continue;
            }
            let (record, particle) = (job.record as usize, job.particle);
            requested.push(RequestedRun { key, record, particle, n_value: job.window.observed.len() });
            open.push((setup, job));
        }
        self.dispatch(open, &requested)?;
        Ok(keys)
    }

    /// The result of an earlier run, read from the store if it is not held in memory.
    fn remembered(&mut self, key: &RunKey) -> Result<RememberedRun, ExplainError> {
        if let Some(known) = self.recent.get(key) {
            return Ok(known);
        }
        let known = self.stored(key)?;
        self.recent.insert(*key, known.clone());
        Ok(known)
    }

    fn stored(&self, key: &RunKey) -> Result<RememberedRun, ExplainError> {
        let body = self.store.remembered_run(key)?;
        Ok(body.map_or_else(|| Err(String::new()), |body| decode(&body)))
    }

    /// Sends jobs to the fleet and remembers their results, those of a long batch as they arrive.
    fn dispatch(
        &mut self,
        jobs: Vec<(SetupId, Job)>,
        requested: &[RequestedRun],
    ) -> Result<(), ExplainError> {
        if jobs.is_empty() {
            return Ok(());
        }
        let mut arrivals = Arrivals {
            study: self.study,
            store: self.store,
            requested,
            batch: self.n_batch,
            early: HashMap::new(),
            refused: None,
        };
        self.report_stage("", jobs.len());
        // Nobody reads the states that whole records end in.
        let held = jobs.into_iter().map(|(setup, job)| (setup, job.map(Held::from)));
        let outcomes = self.fleet.run_telling(held.collect(), &mut |early| arrivals.take_early(early));
        let Arrivals { mut early, refused, .. } = arrivals;
        // The events are kept even if the runs end in an error.
        self.keep_events()?;
        if let Some(error) = refused {
            return Err(error);
        }
        let outcomes = outcomes.map_err(|error| fleet_failure(self.study, error))?;
        let mut answers = Vec::with_capacity(requested.len());
        let mut rows = Vec::with_capacity(requested.len());
        for (index, (requested, outcome)) in requested.iter().zip(outcomes).enumerate() {
            self.workers.insert(outcome.worker.clone());
            if let Some(known) = early.remove(&index) {
                self.recent.insert(requested.key, known);
                continue;
            }
            let (row, known) = remembered(self.study, self.n_batch, requested, outcome)?;
            rows.push(row);
            answers.push((requested.key, known));
        }
        self.store.note_elapsed(self.elapsed())?;
        self.store.remember_runs(answers.iter().map(|(key, known)| (key, encode(known))), &rows)?;
        for (key, known) in answers {
            self.recent.insert(key, known);
        }
        self.n_batch += 1;
        self.report_stage("", 0);
        Ok(())
    }

    fn keep_events(&self) -> Result<(), StoreError> {
        for event in self.events.iter().flat_map(|events| events.try_iter()) {
            self.store.event(self.elapsed(), event.kind(), &event.to_string())?;
        }
        Ok(())
    }
}

/// What becomes of results that arrive while their batch goes on.
struct Arrivals<'a> {
    study: &'a Study,
    store: &'a Store,
    requested: &'a [RequestedRun],
    batch: usize,
    /// Results that are in the store, by the places of their jobs.
    early: HashMap<usize, RememberedRun>,
    refused: Option<ExplainError>,
}

impl Arrivals<'_> {
    /// Remembers results; one that cannot be remembered ends the batch.
    fn take_early(&mut self, outcomes: Vec<(usize, Outcome<Held>)>) -> ControlFlow<()> {
        match self.remember(outcomes) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.refused = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    fn remember(&mut self, outcomes: Vec<(usize, Outcome<Held>)>) -> Result<(), ExplainError> {
        if outcomes.is_empty() {
            return Ok(());
        }
        let (mut rows, mut runs) = (Vec::new(), Vec::new());
        for (index, outcome) in outcomes {
            let (row, known) = remembered(self.study, self.batch, &self.requested[index], outcome)?;
            rows.push(row);
            runs.push((index, known));
        }
        let keyed = runs.iter().map(|(index, known)| (&self.requested[*index].key, encode(known)));
        self.store.remember_runs(keyed, &rows)?;
        self.early.extend(runs);
        Ok(())
    }
}

/// The row and the result to remember of a run.
///
/// # Errors
/// When the prediction has another length than was requested.
fn remembered(
    study: &Study,
    batch: usize,
    requested: &RequestedRun,
    outcome: Outcome<Held>,
) -> Result<(JobRow, RememberedRun), ExplainError> {
    let RequestedRun { record, particle, n_value, .. } = *requested;
    let row = JobRow {
        pass: 0,
        step: batch,
        record: study.records[record].name.clone(),
        particle,
        attempts: outcome.attempts,
        worker: outcome.worker.clone(),
        error: outcome.result.as_ref().err().map(ToString::to_string),
        cost_s: outcome.result.as_ref().map_or(0.0, |p| p.cost),
        // The run itself is remembered, by what it depends on.
        answer: None,
    };
    Ok((row, from_outcome(study, outcome, particle, record, n_value)?))
}
