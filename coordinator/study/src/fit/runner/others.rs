//! Runs beside a fit with other setups than the study's.

use nalgebra::DMatrix;
use starlings_fleet::Held;
use starlings_models::{Job, Setup};

use super::{AnalysisIndex, EnsembleRunner, Predicted, Results, StepWindows};
use crate::RunError;

impl EnsembleRunner<'_> {
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
        let outcomes = self.outcomes(at, jobs.len(), |index| jobs[index].clone())?;
        self.gather(at, outcomes, (0..setups.len()).map(|setup| (setup, 0)), theta, windows)
    }

    /// Runs jobs that begin where their records do with another setup, counts and keeps them, and returns what each predicts. How
    /// they fail is told by whoever asked: it says nothing of the runs of the fit.
    ///
    /// # Errors
    /// When the fleet fails as a whole, or refuses the setup.
    pub(crate) fn run_others(
        &mut self,
        at: AnalysisIndex,
        setup: &Setup,
        jobs: &[Job<Held>],
    ) -> Result<Vec<Predicted>, RunError> {
        let setup = self.fleet.install(setup)?;
        self.counts.total += jobs.len() as u64;
        let outcomes = self.outcomes(at, jobs.len(), |index| (setup, jobs[index].clone()))?;
        let mut results = Vec::with_capacity(outcomes.len());
        for (job, outcome) in jobs.iter().zip(outcomes) {
            self.count(at, job.record as usize, job.particle as usize, &outcome);
            results.push(outcome.result);
        }
        Ok(results)
    }
}
