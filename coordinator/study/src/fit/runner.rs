//! One ensemble to the fleet and back: windows and particles become jobs, outcomes become predictions and states.
//!
//! Outcomes are gathered by particle and record, never by arrival, so the numbers do not depend on which worker computed them.
//! What to do about a particle that failed is not decided here: see [`super::rescue`].

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_fleet::{Fleet, Outcome, SetupId};
use starlings_models::{BuildSetup, Failure, Job, Prediction, Setup, Window};

use super::timeouts::Timeouts;
use crate::store::snapshot::Counts;
use crate::store::{JobRow, Store};
use crate::trial::named;
use crate::{RunError, Study};

/// The windows of one step, one per record that still has data: (record, window).
pub(crate) type StepWindows = Vec<(usize, Arc<Window>)>;

/// The analysis that an ensemble belongs to; goes into the rows of the store.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnalysisIndex {
    /// Pass, from 1; 0 for the final forward run.
    pub(crate) pass: usize,
    /// Analysis within the pass, from 0.
    pub(crate) step: usize,
}

/// A prediction per particle and window, or why there is none: a failure of the model, or the limit of wall time.
pub(crate) type Results = Vec<Vec<Result<Prediction, Failure>>>;

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
    /// Runs that were given up after their limit of wall time, where a store keeps them.
    timeouts: Option<Timeouts<'a>>,
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
            timeouts: None,
        })
    }

    /// The same, with timeouts kept in a store: one that is there is repeated without a run.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(crate) fn deciding(mut self, store: &'a Store) -> Result<Self, RunError> {
        self.timeouts = Some(Timeouts::read(store)?);
        Ok(self)
    }

    /// A warning about the timeouts in the store, if there are any.
    pub(crate) fn timeouts(&self) -> Option<String> {
        self.timeouts.as_ref()?.warning()
    }

    /// Runs the given particles over the windows and gives back what the study's channels measure of them. `theta` is p × r in
    /// transformed units, `states[record]` is n × r or `None` at a record's start. Returns `[particle in the order
    /// given][window]`.
    ///
    /// # Errors
    /// When the fleet fails as a whole.
    pub(crate) fn run(
        &mut self,
        at: AnalysisIndex,
        particles: &[usize],
        theta: &DMatrix<f64>,
        states: &[Option<DMatrix<f64>>],
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let sent: StepWindows =
            windows.iter().map(|(record, window)| (*record, self.sent(*record, window))).collect();
        let study = self.study;
        let job = |index: usize| {
            let (particle, (record, window)) = (particles[index / sent.len()], &sent[index % sent.len()]);
            let column: DVector<f64> = theta.column(particle).into_owned();
            Job {
                particle: particle as u32,
                record: *record as u32,
                window: Arc::clone(window),
                theta: study.theta_for(*record, column.as_slice()),
                state: states[*record].as_ref().map(|x| x.column(particle).iter().copied().collect()),
            }
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

    /// Runs one particle over the windows with each of the setups, which differ from the study's in the model's numbers only.
    /// Returns `[setup][window]`.
    ///
    /// # Errors
    /// When the fleet fails as a whole, or refuses a setup.
    pub(crate) fn run_setups(
        &mut self,
        at: AnalysisIndex,
        setups: &[Setup],
        theta: &DMatrix<f64>,
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let values: Vec<f64> = theta.column(0).iter().copied().collect();
        let mut jobs = Vec::with_capacity(setups.len() * windows.len());
        for (particle, setup) in setups.iter().enumerate() {
            let setup = self.fleet.install(setup)?;
            for (record, window) in windows {
                let window = self.sent(*record, window);
                let theta = self.study.theta_for(*record, &values);
                let job =
                    Job { particle: particle as u32, record: *record as u32, window, theta, state: None };
                jobs.push((setup, job));
            }
        }
        self.counts.total += jobs.len() as u64;
        let outcomes =
            self.fleet.run_mixed(jobs).map_err(|error| RunError::of_fleet(self.study, error, |_| None))?;
        self.gather(at, outcomes, (0..setups.len()).map(|setup| (setup, 0)), theta, windows)
    }

    /// Counts and notes the outcomes of the particles, each given with its column of `theta`, window after window, and takes from
    /// every prediction what the channels measure. Returns `[particle in the order given][window]`.
    fn gather(
        &mut self,
        at: AnalysisIndex,
        outcomes: Vec<Outcome>,
        particles: impl Iterator<Item = (usize, usize)>,
        theta: &DMatrix<f64>,
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let mut outcomes = outcomes.into_iter();
        let mut results = Vec::with_capacity(particles.size_hint().0);
        for (particle, column) in particles {
            let mut of_particle = Vec::with_capacity(windows.len());
            for ((record, window), outcome) in windows.iter().zip(outcomes.by_ref()) {
                self.rows.push(self.row(at, *record, particle, &outcome));
                // A timeout that is repeated from the store has no worker.
                if !outcome.worker.is_empty() && !self.workers.contains(&outcome.worker) {
                    self.workers.insert(outcome.worker.clone());
                }
                self.counts.retried += u64::from(outcome.attempts.saturating_sub(1));
                self.counts.failed += u64::from(outcome.result.is_err());
                let mut result = outcome.result;
                if let Ok(prediction) = &mut result {
                    // Of what the solver gave, the outputs that the study asked for.
                    let given = std::mem::take(&mut prediction.outputs);
                    prediction.outputs = self.study.picked(*record, window, given);
                    self.check(prediction, *record, column, theta, window)?;
                    self.study.measure(*record, &window.times, &mut prediction.outputs);
                }
                of_particle.push(result);
            }
            results.push(of_particle);
        }
        Ok(results)
    }

    /// The window that a job carries: what the solver answers for, with what an observer knows.
    fn sent(&self, record: usize, window: &Arc<Window>) -> Arc<Window> {
        self.study.sendable(record, &self.study.asked(record, window))
    }

    /// One outcome per job; those that are known to be timeouts are not run.
    fn outcomes(
        &mut self,
        at: AnalysisIndex,
        n_job: usize,
        job: impl Fn(usize) -> Job,
    ) -> Result<Vec<Outcome>, RunError> {
        // The forward run with the estimate decides nothing about a sigma point: it is tried anew.
        let mut timeouts = self.timeouts.as_mut().filter(|_| at.pass > 0);
        let mut known: Vec<Option<Outcome>> = match &timeouts {
            Some(timeouts) if !timeouts.is_empty() => {
                (0..n_job).map(|index| timeouts.known(&self.setup, &job(index))).collect()
            }
            _ => vec![None; n_job],
        };
        let open: Vec<usize> = (0..n_job).filter(|index| known[*index].is_none()).collect();
        if open.is_empty() {
            return Ok(known.into_iter().flatten().collect());
        }
        let outcomes = self.fleet.run(self.setup, open.iter().map(|index| job(*index)).collect());
        let values = |at: usize| open.get(at).map(|index| named(self.study, &job(*index).theta));
        for (index, outcome) in
            open.iter().zip(outcomes.map_err(|error| RunError::of_fleet(self.study, error, values))?)
        {
            if let (Some(timeouts), Err(Failure::Timeout(timeout))) = (&mut timeouts, &outcome.result) {
                timeouts.keep(&self.setup, &job(*index), timeout)?;
            }
            known[*index] = Some(outcome);
        }
        Ok(known.into_iter().flatten().collect())
    }

    /// A prediction of another length is an error of the run, not a failure of the particle.
    fn check(
        &self,
        prediction: &Prediction,
        record: usize,
        particle: usize,
        theta: &DMatrix<f64>,
        window: &Window,
    ) -> Result<(), RunError> {
        let (outputs, state) = (prediction.outputs.len(), prediction.state.len());
        let reason = if outputs != window.observed.len() {
            format!("{outputs} predicted values where {} were asked for", window.observed.len())
        } else if let Some(wanted) = self.n_state.filter(|n| *n != state) {
            format!("a state of {state} values where {wanted} belong")
        } else {
            return Ok(());
        };
        let column: DVector<f64> = theta.column(particle).into_owned();
        let values = named(self.study, &self.study.theta_for(record, column.as_slice()));
        Err(RunError::NoAnswer { particle, record: self.study.records[record].name.clone(), values, reason })
    }

    fn row(&self, at: AnalysisIndex, record: usize, particle: usize, outcome: &Outcome) -> JobRow {
        JobRow {
            pass: at.pass,
            step: at.step,
            record: self.study.records[record].name.clone(),
            particle: particle as u32,
            attempts: outcome.attempts,
            worker: outcome.worker.clone(),
            error: outcome.result.as_ref().err().map(ToString::to_string),
            cost_s: outcome.result.as_ref().map_or(0.0, |p| p.cost),
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
