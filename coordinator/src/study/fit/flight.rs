//! One ensemble to the fleet and back: windows and particles become jobs, outcomes become predictions and states.
//!
//! Outcomes are gathered by particle and record, never by arrival, so the numbers do not know who computed them. What to do
//! about a particle that failed is not decided here: see [`super::rescue`].

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_models::{Job, ParticleError, Prediction, Setup, Window};

use crate::fleet::{Fleet, SetupId};
use crate::study::store::JobRow;
use crate::study::trial::named;
use crate::study::{RunError, Study};

/// The windows of one step, one per record that still has data: (record, window).
pub type StepWindows = Vec<(usize, Arc<Window>)>;

/// Where in the run a flight belongs; goes into the rows of the store.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Pass, from 1; 0 for the final forward run.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub step: usize,
}

/// A prediction per particle and window, or why there is none.
pub type Results = Vec<Vec<Result<Prediction, ParticleError>>>;

/// Sends runs to a fleet and keeps the rows that the store will want.
pub struct Flight<'a> {
    study: &'a Study,
    fleet: &'a mut dyn Fleet,
    setup: SetupId,
    /// One row per run since the last [`Flight::take_rows`].
    rows: Vec<JobRow>,
    /// Runs asked for.
    pub total: u64,
    /// Runs that failed for good.
    pub failed: u64,
    /// Extra attempts.
    pub retried: u64,
    /// Threads that recombine states; one unless somebody says more.
    pub threads: usize,
    /// Workers that answered.
    workers: BTreeSet<String>,
}

impl<'a> Flight<'a> {
    /// Installs the study's setup on the fleet.
    ///
    /// # Errors
    /// When the fleet refuses the setup.
    pub fn new(study: &'a Study, fleet: &'a mut dyn Fleet) -> Result<Self, RunError> {
        let setup = fleet.install(&study.setup)?;
        Ok(Self {
            study,
            fleet,
            setup,
            rows: Vec::new(),
            total: 0,
            failed: 0,
            retried: 0,
            threads: 1,
            workers: BTreeSet::new(),
        })
    }

    /// Runs the given particles over the windows and gives back what the study's channels measure of them. `theta` is p × r in transformed units, `states[record]` is n × r or
    /// `None` at a record's start. Returns `[particle in the order given][window]`.
    ///
    /// # Errors
    /// When the fleet fails as a whole.
    pub fn run(
        &mut self,
        place: Place,
        particles: &[usize],
        theta: &DMatrix<f64>,
        states: &[Option<DMatrix<f64>>],
        windows: &StepWindows,
    ) -> Result<Results, RunError> {
        let mut jobs = Vec::with_capacity(particles.len() * windows.len());
        let sent: StepWindows =
            windows.iter().map(|(record, window)| (*record, self.sent(*record, window))).collect();
        for &particle in particles {
            let column: DVector<f64> = theta.column(particle).into_owned();
            for (record, window) in &sent {
                jobs.push(Job {
                    particle: particle as u32,
                    record: *record as u32,
                    window: Arc::clone(window),
                    theta: self.study.theta_for(*record, column.as_slice()),
                    state: states[*record].as_ref().map(|x| x.column(particle).iter().copied().collect()),
                });
            }
        }
        self.total += jobs.len() as u64;
        let outcomes = self.fleet.run(self.setup, jobs)?;
        let mut outcomes = outcomes.into_iter();
        let mut results = Vec::with_capacity(particles.len());
        for &particle in particles {
            let mut of_particle = Vec::with_capacity(windows.len());
            for ((record, window), outcome) in windows.iter().zip(outcomes.by_ref()) {
                self.rows.push(self.row(place, *record, particle, &outcome));
                if !self.workers.contains(&outcome.worker) {
                    self.workers.insert(outcome.worker.clone());
                }
                self.retried += u64::from(outcome.attempts.saturating_sub(1));
                self.failed += u64::from(outcome.result.is_err());
                let mut sound = self.sound(outcome.result, *record, particle, theta, window)?;
                if let Ok(prediction) = &mut sound {
                    self.study.measure(*record, &window.times, &mut prediction.outputs);
                }
                of_particle.push(sound);
            }
            results.push(of_particle);
        }
        Ok(results)
    }

    /// Runs one particle over the windows with each of the setups, which differ from the study's in the model's numbers only.
    /// Returns `[setup][window]`.
    ///
    /// # Errors
    /// When the fleet fails as a whole, or refuses a setup.
    pub fn run_setups(
        &mut self,
        place: Place,
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
        self.total += jobs.len() as u64;
        let mut outcomes = self.fleet.run_mixed(jobs)?.into_iter();
        let mut results = Vec::with_capacity(setups.len());
        for particle in 0..setups.len() {
            let mut of_setup = Vec::with_capacity(windows.len());
            for ((record, window), outcome) in windows.iter().zip(outcomes.by_ref()) {
                self.rows.push(self.row(place, *record, particle, &outcome));
                let mut result = self.sound(outcome.result, *record, 0, theta, window)?;
                if let Ok(prediction) = &mut result {
                    self.study.measure(*record, &window.times, &mut prediction.outputs);
                }
                of_setup.push(result);
            }
            results.push(of_setup);
        }
        Ok(results)
    }

    /// The window that a job carries: what the solver answers for, with what an observer knows.
    fn sent(&self, record: usize, window: &Arc<Window>) -> Arc<Window> {
        self.study.sendable(record, &self.study.asked(record, window))
    }

    /// A failure of the model is data. A run that was lost with its workers, or that does not fit the study, is none: it
    /// says nothing of this particle, and treating it as a failure would let the fleet change the posterior.
    fn sound(
        &self,
        result: Result<Prediction, ParticleError>,
        record: usize,
        particle: usize,
        theta: &DMatrix<f64>,
        window: &Window,
    ) -> Result<Result<Prediction, ParticleError>, RunError> {
        let result = result.map(|prediction| {
            let outputs = self.study.picked(record, window, prediction.outputs);
            Prediction { outputs, ..prediction }
        });
        let reason = match &result {
            Err(error @ (ParticleError::Lost { .. } | ParticleError::BadJob(_))) => error.to_string(),
            Ok(p) if p.outputs.len() != window.observed.len() => {
                format!("{} predicted values where {} were asked for", p.outputs.len(), window.observed.len())
            }
            _ => return Ok(result),
        };
        let column: DVector<f64> = theta.column(particle).into_owned();
        let values = named(self.study, &self.study.theta_for(record, column.as_slice()));
        Err(RunError::NoAnswer { particle, record: self.study.records[record].name.clone(), values, reason })
    }

    fn row(&self, place: Place, record: usize, particle: usize, outcome: &crate::fleet::Outcome) -> JobRow {
        JobRow {
            pass: place.pass,
            step: place.step,
            record: self.study.records[record].name.clone(),
            particle: particle as u32,
            attempts: outcome.attempts,
            worker: outcome.worker.clone(),
            error: outcome.result.as_ref().err().map(ToString::to_string),
            cost_s: outcome.result.as_ref().map_or(0.0, |p| p.cost),
        }
    }

    /// The rows gathered since the last call.
    pub fn take_rows(&mut self) -> Vec<JobRow> {
        std::mem::take(&mut self.rows)
    }

    /// Workers that answered a run so far.
    pub fn n_answered(&self) -> usize {
        self.workers.len()
    }

    /// Workers at the moment.
    pub fn n_workers(&self) -> usize {
        self.fleet.n_workers()
    }

    /// The study that is run.
    pub fn study(&self) -> &'a Study {
        self.study
    }
}

/// Stacks the predictions of all particles: m × r, rows by window, then time, then output. A failed particle's column is
/// zero and must be masked by the caller.
pub fn stack_outputs(results: &Results, windows: &StepWindows) -> DMatrix<f64> {
    let columns: Vec<Vec<f64>> = results
        .iter()
        .map(|windows| windows.iter().flatten().flat_map(|p| p.outputs.iter().copied()).collect())
        .collect();
    let m = windows.iter().map(|(_, window)| window.observed.len()).sum();
    DMatrix::from_fn(m, columns.len(), |row, column| columns[column].get(row).copied().unwrap_or(0.0))
}

/// The states of all particles at the end of window `index`: n × r. A failed particle's column is zero.
pub fn stack_states(results: &Results, index: usize) -> DMatrix<f64> {
    let n = results.iter().filter_map(|w| w[index].as_ref().ok()).map(|p| p.state.len()).max().unwrap_or(0);
    let mut x = DMatrix::zeros(n, results.len());
    for (column, windows) in results.iter().enumerate() {
        if let Ok(p) = &windows[index] {
            x.column_mut(column).copy_from_slice(&p.state);
        }
    }
    x
}
