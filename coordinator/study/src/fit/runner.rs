//! One ensemble to the fleet and back: windows and particles become jobs, outcomes become predictions and states.
//!
//! Outcomes are gathered by particle and record, never by arrival, so the numbers do not depend on which worker computed them.
//! What to do about a particle that failed is not decided here: see [`super::rescue`].

mod others;

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_fleet::{Fleet, Held, Outcome, SetupId};
use starlings_models::{BuildSetup, Job, Prediction, Window};

pub(crate) use super::index::AnalysisIndex;
use super::kept::Kept;
pub(crate) use super::results::{Predicted, Results, StepWindows};
use crate::failures::{FailureCluster, Failures};
use crate::states::States;
use crate::store::snapshot::Counts;
use crate::store::{Answer, JobRow, Store};
use crate::trial::named;
use crate::{RunError, Study};

/// Sends runs to a fleet and keeps their rows for the store.
pub(crate) struct EnsembleRunner<'a> {
    study: &'a Study,
    fleet: &'a mut dyn Fleet,
    setup: SetupId,
    /// One row per run since the last [`EnsembleRunner::take_rows`].
    rows: Vec<JobRow>,
    /// Runs so far; `rescued` stays zero, since only the filter knows.
    pub(crate) counts: Counts,
    /// Threads that recombine states; one by default.
    pub(crate) threads: usize,
    /// Workers that answered.
    workers: BTreeSet<String>,
    /// Length of a state, where the model's specification says it.
    n_state: Option<usize>,
    /// What a store keeps of runs, where there is one.
    kept: Option<Kept<'a>>,
    /// Runs by how they ended.
    failures: Failures,
}

impl<'a> EnsembleRunner<'a> {
    /// Installs the study's setup on the fleet.
    ///
    /// # Errors
    /// When the fleet refuses the setup.
    pub(crate) fn new(study: &'a Study, fleet: &'a mut dyn Fleet) -> Result<Self, RunError> {
        let setup = fleet.install(&study.setup)?;
        let spec = study.setup.spec().ok();
        let n_state = spec.filter(|spec| spec.restart).map(|spec| spec.n_state());
        Ok(Self {
            study,
            fleet,
            setup,
            rows: Vec::new(),
            counts: Counts::default(),
            threads: 1,
            workers: BTreeSet::new(),
            n_state,
            kept: None,
            failures: Failures::default(),
        })
    }

    /// The same, with runs kept in a store: what it knows is not run again.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(crate) fn deciding(mut self, store: &'a Store) -> Result<Self, RunError> {
        self.kept = Some(Kept::read(store)?);
        Ok(self)
    }

    /// Where the runs are made.
    pub(super) fn fleet(&mut self) -> &mut (dyn Fleet + 'a) {
        self.fleet
    }

    /// A warning about the timeouts in the store, if there are any.
    pub(crate) fn timeouts(&self) -> Option<String> {
        self.kept.as_ref()?.warning()
    }

    /// How the runs ended so far, for a snapshot.
    pub(crate) fn learned(&self) -> Failures {
        self.failures.clone()
    }

    /// Goes on from how the runs before a resume ended.
    pub(crate) fn recall(&mut self, failures: Failures) {
        self.failures = failures;
    }

    /// Failed runs by message and place.
    pub(crate) fn failures(&self) -> Vec<FailureCluster> {
        self.failures.clusters(&self.study.setup.parameters)
    }

    /// Runs the given particles over the windows and gives back what the study's channels measure of them. `theta` is p × r in
    /// transformed units, `states[record]` has a state per particle or `None` at a record's start. Returns `[particle in the order
    /// given][window]`.
    ///
    /// # Errors
    /// When the fleet fails as a whole.
    pub(crate) fn run(
        &mut self,
        at: AnalysisIndex,
        particles: &[usize],
        theta: &DMatrix<f64>,
        states: &[Option<States>],
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let slopes = self.wants_slopes(at);
        let wide = |window: Arc<Window>| if slopes { self.study.widened(&window) } else { window };
        let sent: StepWindows =
            windows.iter().map(|(record, window)| (*record, wide(self.sent(*record, window)))).collect();
        let study = self.study;
        let setup = if slopes { self.fleet.install(&study.with_slopes())? } else { self.setup };
        let job = |index: usize| {
            let (particle, (record, window)) = (particles[index / sent.len()], &sent[index % sent.len()]);
            let column: DVector<f64> = theta.column(particle).into_owned();
            let job = Job {
                particle: particle as u32,
                record: *record as u32,
                window: Arc::clone(window),
                theta: study.theta_for(*record, column.as_slice()),
                state: states[*record].as_ref().map(|x| x.held(particle)),
            };
            (setup, job)
        };
        let n_job = particles.len() * sent.len();
        self.counts.total += n_job as u64;
        let outcomes = self.outcomes(at, n_job, job)?;
        self.gather(at, outcomes, particles.iter().map(|&particle| (particle, particle)), theta, windows)
    }

    /// Runs all particles, the columns of `theta`, over windows that begin where their records do. Returns `[particle][window]`.
    ///
    /// # Errors
    /// When the fleet fails as a whole.
    pub(crate) fn run_from_start(
        &mut self,
        at: AnalysisIndex,
        theta: &DMatrix<f64>,
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let everyone: Vec<usize> = (0..theta.ncols()).collect();
        let states = vec![None; self.study.records.len()];
        self.run(at, &everyone, theta, &states, windows)
    }

    /// Counts and notes the outcomes of the particles, each given with its column of `theta`, window after window, and takes from
    /// every prediction what the channels measure. Returns `[particle in the order given][window]`.
    fn gather(
        &mut self,
        at: AnalysisIndex,
        outcomes: Vec<Outcome<Held>>,
        particles: impl Iterator<Item = (usize, usize)>,
        theta: &DMatrix<f64>,
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let mut outcomes = outcomes.into_iter();
        let mut results = Vec::with_capacity(particles.size_hint().0);
        for (particle, column) in particles {
            let mut of_particle = Vec::with_capacity(windows.len());
            for ((record, window), outcome) in windows.iter().zip(outcomes.by_ref()) {
                let values = self.study.theta_for(*record, theta.column(column).into_owned().as_slice());
                self.note(at, *record, particle, &values, &outcome);
                let mut result = outcome.result;
                if let Ok(prediction) = &mut result {
                    // Of what the solver gave, the outputs that the study asked for.
                    let given = std::mem::take(&mut prediction.outputs);
                    prediction.outputs = self.study.picked(*record, window, given);
                    self.check(at, prediction, *record, column, theta, window)?;
                    self.study.measure(*record, &window.times, &mut prediction.outputs);
                }
                of_particle.push(result);
            }
            results.push(of_particle);
        }
        Ok(results)
    }

    /// Counts an outcome, keeps its row, and learns where runs fail.
    fn note(
        &mut self,
        at: AnalysisIndex,
        record: usize,
        particle: usize,
        values: &[f64],
        outcome: &Outcome<Held>,
    ) {
        self.count(at, record, particle, outcome);
        let failure = outcome.result.as_ref().err().map(ToString::to_string);
        self.failures.learn(values, failure.as_deref());
    }

    /// Counts an outcome and keeps its row.
    fn count(&mut self, at: AnalysisIndex, record: usize, particle: usize, outcome: &Outcome<Held>) {
        self.rows.push(self.row(at, record, particle, outcome));
        // A timeout that is repeated from the store has no worker.
        if !outcome.worker.is_empty() && !self.workers.contains(&outcome.worker) {
            self.workers.insert(outcome.worker.clone());
        }
        self.counts.retried += u64::from(outcome.attempts.saturating_sub(1));
        self.counts.failed += u64::from(outcome.result.is_err());
    }

    /// Whether the runs for this analysis predict derivatives beside the outputs.
    fn wants_slopes(&self, at: AnalysisIndex) -> bool {
        at.is_of_fit() && self.study.estimator.kind.has_exact_slopes()
    }

    /// The window that a job carries: what the solver answers for, with what an observer knows.
    fn sent(&self, record: usize, window: &Arc<Window>) -> Arc<Window> {
        self.study.sendable(record, &self.study.asked(record, window))
    }

    /// One outcome per job; those that the store knows are not run.
    fn outcomes(
        &mut self,
        at: AnalysisIndex,
        n_job: usize,
        job: impl Fn(usize) -> (SetupId, Job<Held>),
    ) -> Result<Vec<Outcome<Held>>, RunError> {
        let ran = match &mut self.kept {
            Some(kept) => kept.run(self.fleet, at, n_job, &job),
            None => self.fleet.run_held((0..n_job).map(&job).collect()).map_err(RunError::from),
        };
        ran.map_err(|error| error.naming(self.study, |at| (at < n_job).then(|| job(at).1.theta)))
    }

    /// A prediction of another length is an error of the run, not a failure of the particle.
    fn check(
        &self,
        at: AnalysisIndex,
        prediction: &Prediction<Held>,
        record: usize,
        particle: usize,
        theta: &DMatrix<f64>,
        window: &Window,
    ) -> Result<(), RunError> {
        let (outputs, state) = (prediction.outputs.len(), prediction.state.n_state());
        let with_slopes = self.wants_slopes(at).then(|| self.study.widened(window));
        let wanted = with_slopes.map_or(window.observed.len(), |window| window.observed.len());
        let reason = if outputs != wanted {
            format!("{outputs} predicted values where {wanted} were asked for")
        } else if let Some(wanted) = self.n_state.filter(|n| *n != state) {
            format!("a state of {state} values where {wanted} belong")
        } else {
            return Ok(());
        };
        let column: DVector<f64> = theta.column(particle).into_owned();
        let values = named(self.study, &self.study.theta_for(record, column.as_slice()));
        Err(RunError::NoAnswer { particle, record: self.study.records[record].name.clone(), values, reason })
    }

    fn row(&self, at: AnalysisIndex, record: usize, particle: usize, outcome: &Outcome<Held>) -> JobRow {
        JobRow {
            pass: at.pass,
            step: at.step,
            record: self.study.records[record].name.clone(),
            particle: particle as u32,
            attempts: outcome.attempts,
            worker: outcome.worker.clone(),
            error: outcome.result.as_ref().err().map(ToString::to_string),
            cost_s: outcome.result.as_ref().map_or(0.0, |p| p.cost),
            answer: outcome.result.as_ref().ok().map(Answer::of),
        }
    }

    /// The rows gathered since the last call.
    pub(crate) fn take_rows(&mut self) -> Vec<JobRow> {
        std::mem::take(&mut self.rows)
    }

    /// Workers that answered a run so far.
    pub(crate) fn n_answered(&self) -> usize {
        self.workers.len()
    }

    /// Workers at the moment.
    pub(crate) fn n_workers(&self) -> usize {
        self.fleet.n_workers()
    }

    /// The study that is run.
    pub(crate) fn study(&self) -> &'a Study {
        self.study
    }
}
