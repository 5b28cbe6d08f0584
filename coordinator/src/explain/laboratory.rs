//! Runs versions of the model on the fleet: every record from its start, freely, over training and held-out spans alike.
//!
//! Points of different versions go in one batch, so that a screening is one round for the fleet. Every answer is remembered
//! in the run's database: an explanation that was killed goes on by asking again, and what is known costs nothing. Only the
//! rows that train are ever shown to a fit; that is for the callers to keep. Next file to read: [`super::version`].

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use nalgebra::DVector;
use starlings_models::{Job, Window};

use super::memory::{Known, decode, encode, taken, told};
use super::recent::Recent;
use super::{Context, ExplainError, Rows, Stage};
use crate::fleet::{Fleet, FleetEvent, Outcome, SetupId};
use crate::study::store::{JobRow, RunKey, Store, StoreError};
use crate::study::{Study, run_key};

/// A version of the model and a parameter vector (transformed units) to run it with.
pub struct Point<'v> {
    /// The version.
    pub study: &'v Study,
    /// Its parameters, in the order of its [`Study::theta`].
    pub theta: DVector<f64>,
}

/// What a point predicts for every row, or why it could not be run.
pub type Answer = Result<Arc<Vec<f64>>, String>;

/// Bytes of outputs that one batch brings, about.
const PORTION: usize = 4 << 20;
/// Runs of one batch per slot at least: that many keep every slot busy.
const PER_SLOT: usize = 8;

/// A run that the fleet was asked for.
struct Asked {
    key: RunKey,
    record: usize,
    particle: u32,
    /// Values that it must predict.
    n_value: usize,
}

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
    /// Every run that was asked for and counted; its answer is in the store.
    counted: HashSet<RunKey>,
    recent: Recent,
    budget: Option<u64>,
    stage: &'static str,
    runs: Vec<(&'static str, u64)>,
    workers: BTreeSet<String>,
    n_batch: usize,
    cut_short: bool,
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
            counted: HashSet::new(),
            recent: Recent::new(),
            budget,
            stage: "fit",
            runs: Vec::new(),
            workers: BTreeSet::new(),
            n_batch: 0,
            cut_short: false,
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
        self.affords_runs(self.cost(n_point))
    }

    /// Whether so many more runs keep within the budget.
    pub fn affords_runs(&self, n: u64) -> bool {
        self.budget.is_none_or(|budget| self.runs() + n <= budget)
    }

    /// Notes that something was left undone for want of budget.
    pub fn cut_short(&mut self) {
        self.cut_short = true;
    }

    /// Whether something was left undone for want of budget.
    pub fn was_cut_short(&self) -> bool {
        self.cut_short
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
    /// When the fleet or the store fails, or no place could make a run.
    pub fn run(&mut self, points: &[Point<'_>]) -> Result<Vec<Answer>, ExplainError> {
        let mut answers = Vec::with_capacity(points.len());
        while answers.len() < points.len() {
            let rest = &points[answers.len()..];
            let outputs = self.outputs(&rest[..self.at_a_time().min(rest.len())])?;
            answers.extend(outputs.chunks(self.windows.len()).map(|runs| self.answer(runs)));
        }
        Ok(answers)
    }

    /// Points of one batch: as many as [`PORTION`] of their outputs allows, but enough for every slot to have work.
    fn at_a_time(&self) -> usize {
        let bytes: usize = self.windows.iter().map(|window| 8 * window.observed.len()).sum();
        let busy = PER_SLOT * self.fleet.slots() / self.windows.len().max(1);
        (PORTION / bytes.max(1)).max(busy).max(1)
    }

    /// The rows of one point from its runs over the records: outputs turned into what the channels measure.
    fn answer(&self, runs: &[Known]) -> Answer {
        let n_obs = self.study.setup.outputs.len();
        let mut measured = Vec::with_capacity(runs.len());
        for (record, run) in runs.iter().enumerate() {
            let mut outputs = run.as_ref().map_err(Clone::clone)?.to_vec();
            self.study.measure(record, &self.windows[record].times, &mut outputs);
            measured.push(outputs);
        }
        let value = |row: &super::Row| measured[row.record][row.step * n_obs + row.output];
        Ok(Arc::new(self.rows.rows.iter().map(value).collect()))
    }

    /// The outputs of runs that are not over a record as it is, one batch for all; nothing where the model fails.
    ///
    /// # Errors
    /// As [`Laboratory::run`].
    pub fn run_alone(
        &mut self,
        runs: Vec<(&Study, Job)>,
    ) -> Result<Vec<Option<Arc<Vec<f64>>>>, ExplainError> {
        let mut jobs = Vec::with_capacity(runs.len());
        for (study, job) in runs {
            jobs.push((self.fleet.install(&study.setup)?, job));
        }
        Ok(self.ask(jobs)?.into_iter().map(Result::ok).collect())
    }

    /// Outputs of every point over every record, as the model gives them: points in order, then records.
    pub(super) fn outputs(&mut self, points: &[Point<'_>]) -> Result<Vec<Known>, ExplainError> {
        let mut jobs = Vec::with_capacity(points.len() * self.windows.len());
        for (particle, point) in points.iter().enumerate() {
            let setup = self.fleet.install(&point.study.setup)?;
            for (record, window) in self.windows.iter().enumerate() {
                let theta = point.study.theta_for(record, point.theta.as_slice());
                let (particle, record, window) = (particle as u32, record as u32, Arc::clone(window));
                jobs.push((setup, Job { particle, record, window, theta, state: None }));
            }
        }
        self.ask(jobs)
    }

    /// The answers of these jobs, in their order; only those that nobody has asked for before are run.
    fn ask(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Known>, ExplainError> {
        let mut keys = Vec::with_capacity(jobs.len());
        let programs = self.store.program()?.digest();
        let (mut open, mut asked, mut here) = (Vec::new(), Vec::new(), HashSet::new());
        for (setup, job) in jobs {
            let key = run_key::free(&programs, &setup, &job);
            keys.push((key, job.window.observed.len()));
            if !here.insert(key) || self.counted.contains(&key) {
                continue;
            }
            self.counted.insert(key);
            self.count(1);
            if self.store.has_remembered_run(&key)? {
                continue;
            }
            let (record, particle) = (job.record as usize, job.particle);
            asked.push(Asked { key, record, particle, n_value: job.window.observed.len() });
            open.push((setup, job));
        }
        self.fly(open, &asked)?;
        keys.iter().map(|(key, n_value)| self.remembered(key, *n_value)).collect()
    }

    /// An answer that was given before, read back from the store if it is not held.
    fn remembered(&mut self, key: &RunKey, n_value: usize) -> Result<Known, ExplainError> {
        if let Some(known) = self.recent.get(key) {
            return Ok(known);
        }
        let body = self.store.remembered_run(key)?;
        let known = body.map_or_else(|| Err(String::new()), |body| decode(&body));
        if let Some(n) = known.as_ref().map(|outputs| outputs.len()).ok().filter(|n| *n != n_value) {
            return Err(self.store.damaged("run", format!("{n} values where {n_value} belong")).into());
        }
        self.recent.insert(*key, known.clone());
        Ok(known)
    }

    /// Sends jobs and remembers their answers.
    fn fly(&mut self, jobs: Vec<(SetupId, Job)>, asked: &[Asked]) -> Result<(), ExplainError> {
        if jobs.is_empty() {
            return Ok(());
        }
        let outcomes = self.fleet.run_mixed(jobs);
        // Also those that led to an error.
        self.keep_events()?;
        let outcomes = outcomes.map_err(|error| told(self.study, error))?;
        let mut bodies = Vec::with_capacity(asked.len());
        let mut rows = Vec::with_capacity(asked.len());
        for (asked, outcome) in asked.iter().zip(outcomes) {
            rows.push(self.row(asked.record, asked.particle, &outcome));
            self.workers.insert(outcome.worker.clone());
            let known = taken(self.study, outcome, asked.particle, asked.record, asked.n_value)?;
            bodies.push((asked.key, encode(&known)));
            self.recent.insert(asked.key, known);
        }
        self.store.note_elapsed(self.elapsed())?;
        self.store.remember_runs(bodies.iter().map(|(key, body)| (key, body.as_slice())), &rows)?;
        self.n_batch += 1;
        self.tell("");
        Ok(())
    }

    fn keep_events(&self) -> Result<(), StoreError> {
        for event in self.events.iter().flat_map(|events| events.try_iter()) {
            self.store.event(self.elapsed(), event.kind(), &event.to_string())?;
        }
        Ok(())
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
