//! Runs versions of the model on the fleet: every record from its start, freely, over training and held-out spans alike.
//!
//! Points of different versions go in one batch, so that a screening is one round for the fleet. Every answer is remembered
//! in the run's database: an explanation that was killed goes on by asking again, and what is known costs nothing. Only the
//! rows that train are ever shown to a fit; that is for the callers to keep. Next file to read: [`super::version`].

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use nalgebra::DVector;
use starlings_models::{Job, ParticleError, Window};

use super::memory::{Known, decode, encode, key};
use super::{Context, ExplainError, Rows, Stage};
use crate::fleet::{Fleet, FleetEvent, Outcome, SetupId};
use crate::study::store::{JobRow, RunKey, Store};
use crate::study::{RunError, Study};

/// A version of the model and a parameter vector (transformed units) to run it with.
pub struct Point<'v> {
    /// The version.
    pub study: &'v Study,
    /// Its parameters, in the order of its [`Study::theta`].
    pub theta: DVector<f64>,
}

/// What a point predicts for every row, or why it could not be run.
pub type Answer = Result<Arc<Vec<f64>>, String>;

/// Runs points and keeps count.
pub struct Laboratory<'a> {
    /// The study as it is.
    pub study: &'a Study,
    /// Its measured values.
    pub rows: Rows,
    fleet: &'a mut dyn Fleet,
    store: &'a Store,
    clock: &'a dyn Fn() -> f64,
    earlier_s: f64,
    watch: &'a mut dyn FnMut(&Stage),
    events: Option<&'a Receiver<FleetEvent>>,
    pub(super) windows: Vec<Arc<Window>>,
    known: HashMap<RunKey, Known>,
    budget: Option<u64>,
    stage: &'static str,
    runs: Vec<(&'static str, u64)>,
    workers: BTreeSet<String>,
    n_batch: usize,
}

impl<'a> Laboratory<'a> {
    /// A laboratory for one study.
    pub fn new(
        study: &'a Study,
        fleet: &'a mut dyn Fleet,
        store: &'a Store,
        context: &'a mut Context<'_>,
        budget: Option<u64>,
    ) -> Self {
        let windows = (0..study.records.len()).map(|r| Arc::new(study.whole(r, false))).collect();
        Self {
            study,
            rows: Rows::new(study),
            fleet,
            store,
            clock: context.clock,
            earlier_s: context.earlier_s,
            watch: &mut *context.watch,
            events: context.events,
            windows,
            known: HashMap::new(),
            budget,
            stage: "fit",
            runs: Vec::new(),
            workers: BTreeSet::new(),
            n_batch: 0,
        }
    }

    /// A new stage begins.
    pub fn stage(&mut self, name: &'static str, says: &str) {
        self.stage = name;
        self.tell(says);
    }

    fn tell(&mut self, says: &str) {
        let (runs, workers) = (self.runs(), self.fleet.n_workers());
        (self.watch)(&Stage { name: self.stage, says: says.to_owned(), runs, workers });
    }

    /// Runs so far: one particle over one record each.
    pub fn runs(&self) -> u64 {
        self.runs.iter().map(|(_, n)| n).sum()
    }

    /// Runs by stage.
    pub fn runs_by_stage(&self) -> Vec<(String, u64)> {
        self.runs.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect()
    }

    /// Counts runs that somebody else made on the fleet.
    pub fn count(&mut self, n: u64) {
        match self.runs.iter_mut().find(|(name, _)| *name == self.stage) {
            Some((_, count)) => *count += n,
            None => self.runs.push((self.stage, n)),
        }
    }

    /// Workers that answered.
    pub fn n_answered(&self) -> usize {
        self.workers.len()
    }

    /// The fleet, for what is no whole-record run.
    pub fn fleet(&mut self) -> &mut dyn Fleet {
        self.fleet
    }

    /// The folder of the run.
    pub fn folder(&self) -> &std::path::Path {
        self.store.folder()
    }

    /// Wall time so far, in s.
    pub fn elapsed(&self) -> f64 {
        self.earlier_s + (self.clock)()
    }

    /// Whether so many more points keep within the budget.
    pub fn affords(&self, n_point: usize) -> bool {
        self.budget.is_none_or(|budget| self.runs() + self.cost(n_point) <= budget)
    }

    /// The error of a budget that does not suffice for so many more points.
    pub fn beyond_budget(&self, n_point: usize) -> ExplainError {
        let (budget, needed) = (self.budget.unwrap_or(0), self.cost(n_point));
        ExplainError::Budget { budget, stage: self.stage, needed }
    }

    fn cost(&self, n_point: usize) -> u64 {
        (n_point * self.windows.len()) as u64
    }

    /// Runs all points over all records in one batch; one answer per point, in their order. A point whose run fails on any
    /// record has none.
    ///
    /// # Errors
    /// When the fleet or the store fails, or a run was lost with its workers.
    pub fn run(&mut self, points: &[Point<'_>]) -> Result<Vec<Answer>, ExplainError> {
        let n_obs = self.study.setup.outputs.len();
        let outputs = self.outputs(points)?;
        let of_point = |runs: &[Known]| -> Answer {
            let runs = runs.iter().cloned().collect::<Result<Vec<_>, String>>()?;
            let value = |row: &super::Row| runs[row.record][row.step * n_obs + row.output];
            Ok(Arc::new(self.rows.rows.iter().map(value).collect()))
        };
        Ok(outputs.chunks(self.windows.len()).map(of_point).collect())
    }

    /// The outputs of one run that is not over a record as it is; nothing where the model fails.
    ///
    /// # Errors
    /// As [`Laboratory::run`].
    pub fn run_alone(&mut self, study: &Study, job: Job) -> Result<Option<Vec<f64>>, ExplainError> {
        let setup = self.fleet.install(&study.setup)?;
        self.count(1);
        let outcome = self.fleet.run_mixed(vec![(setup, job)])?.into_iter().next();
        Ok(outcome.and_then(|o| o.result.ok()).map(|prediction| prediction.outputs))
    }

    /// Outputs of every point over every record: points in order, then records.
    pub(super) fn outputs(&mut self, points: &[Point<'_>]) -> Result<Vec<Known>, ExplainError> {
        let mut keys = Vec::with_capacity(points.len() * self.windows.len());
        let mut jobs: Vec<(SetupId, Job)> = Vec::new();
        let mut asked: Vec<(RunKey, usize)> = Vec::new();
        for (particle, point) in points.iter().enumerate() {
            let setup = self.fleet.install(&point.study.setup)?;
            for record in 0..self.windows.len() {
                let theta = point.study.theta_for(record, point.theta.as_slice());
                let key = key(&setup, record, &theta);
                keys.push(key);
                if self.known.contains_key(&key) || asked.iter().any(|(k, _)| *k == key) {
                    continue;
                }
                self.count(1);
                if let Some(body) = self.store.remembered_run(&key)? {
                    self.known.insert(key, decode(&body));
                    continue;
                }
                asked.push((key, record));
                let window = Arc::clone(&self.windows[record]);
                let (particle, record) = (particle as u32, record as u32);
                jobs.push((setup, Job { particle, record, window, theta, state: None }));
            }
        }
        self.fly(jobs, &asked)?;
        let answer = |key: &RunKey| self.known.get(key).cloned().unwrap_or_else(|| Err(String::new()));
        Ok(keys.iter().map(answer).collect())
    }

    /// Sends jobs and remembers their answers.
    fn fly(&mut self, jobs: Vec<(SetupId, Job)>, asked: &[(RunKey, usize)]) -> Result<(), ExplainError> {
        if jobs.is_empty() {
            return Ok(());
        }
        let particles: Vec<u32> = jobs.iter().map(|(_, job)| job.particle).collect();
        let outcomes = self.fleet.run_mixed(jobs)?;
        let mut bodies = Vec::with_capacity(asked.len());
        let mut rows = Vec::with_capacity(asked.len());
        for (((key, record), particle), outcome) in asked.iter().zip(particles).zip(outcomes) {
            rows.push(self.row(*record, particle, &outcome));
            self.workers.insert(outcome.worker.clone());
            let known = self.sound(outcome, *record, particle)?;
            bodies.push((*key, encode(&known)));
            self.known.insert(*key, known);
        }
        self.store.remember_runs(bodies.iter().map(|(key, body)| (key, body.as_slice())), &rows)?;
        if let Some(events) = self.events {
            let at = self.elapsed();
            for event in events.try_iter() {
                self.store.event(at, event.kind(), &event.to_string())?;
            }
        }
        self.n_batch += 1;
        self.tell("");
        Ok(())
    }

    /// A failure of the model is an answer; a run lost with its workers is none.
    fn sound(&self, outcome: Outcome, record: usize, particle: u32) -> Result<Known, ExplainError> {
        let window = &self.windows[record];
        match outcome.result {
            Err(error @ (ParticleError::Lost { .. } | ParticleError::BadJob(_))) => Err(RunError::NoAnswer {
                particle: particle as usize,
                record: self.study.records[record].name.clone(),
                reason: error.to_string(),
            }
            .into()),
            Err(error) => Ok(Err(error.to_string())),
            Ok(prediction) if prediction.outputs.len() != window.observed.len() => Ok(Err(format!(
                "{} predicted values for {}",
                prediction.outputs.len(),
                window.observed.len()
            ))),
            Ok(mut prediction) => {
                self.study.measure(record, &window.times, &mut prediction.outputs);
                Ok(Ok(Arc::new(prediction.outputs)))
            }
        }
    }

    fn row(&self, record: usize, particle: u32, outcome: &Outcome) -> JobRow {
        JobRow {
            pass: 0,
            step: self.n_batch,
            record: self.study.records[record].name.clone(),
            particle,
            attempts: outcome.attempts,
            worker: outcome.worker.clone(),
            error: outcome.result.as_ref().err().map(ToString::to_string),
            cost_s: outcome.result.as_ref().map_or(0.0, |p| p.cost),
        }
    }
}
