//! The members of a forecast: drawn from the posterior, run on the fleet, gathered in their order.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::Gaussian;
use starlings_fleet::Fleet;
use starlings_models::{Job, Window};

use super::StudyForecastError;
use super::ask::Plan;
use crate::{RunError, Study};

/// Streams of the seed: draws of the posterior, and the noise of each output after them.
const DRAWS: u64 = 0;
const MEASURED: u64 = 1;

/// What the members predict.
pub(super) struct Members {
    n_obs: usize,
    /// Outputs of those that have a prediction, as [`starlings_models::Prediction::outputs`].
    predicted: Vec<Vec<f64>>,
    asked: usize,
    /// Why the first that failed did.
    pub(super) failure: Option<String>,
}

impl Members {
    /// Draws and runs them.
    ///
    /// # Errors
    /// When the fleet fails, or no member has a prediction.
    pub(super) fn run(
        study: &Study,
        fleet: &mut dyn Fleet,
        plan: &Plan,
        posterior: &Gaussian,
    ) -> Result<Self, StudyForecastError> {
        let n_obs = plan.setup.outputs.len();
        let record = &study.records[plan.record];
        let window = Arc::new(Window {
            start: plan.times[0],
            times: plan.times.clone(),
            observed: vec![f64::NAN; n_obs * plan.times.len()],
            inputs: record.inputs.clone(),
        });
        let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
        rng.set_stream(DRAWS);
        let root = root(&posterior.covariance);
        let job = |particle: u32| {
            let z = DVector::from_fn(root.ncols(), |_, _| StandardNormal.sample(&mut rng));
            let drawn: DVector<f64> = &posterior.mean + &root * z;
            let mut theta = study.theta_for(plan.record, drawn.as_slice());
            for (place, value) in &plan.fixed {
                theta[*place] = *value;
            }
            Job { particle, record: plan.record as u32, window: Arc::clone(&window), theta, state: None }
        };
        let jobs: Vec<Job> = (0..plan.members as u32).map(job).collect();
        let setup = fleet.install(&plan.setup).map_err(RunError::from)?;
        let outcomes = fleet.run(setup, jobs).map_err(RunError::from)?;
        let (mut predicted, mut failure) = (Vec::with_capacity(plan.members), None);
        for outcome in outcomes {
            match outcome.result {
                Ok(prediction) if prediction.outputs.len() == n_obs * plan.times.len() => {
                    predicted.push(prediction.outputs);
                }
                Ok(_) => failure = failure.or_else(|| Some("an answer of another length".to_owned())),
                Err(error) => failure = failure.or_else(|| Some(error.to_string())),
            }
        }
        if predicted.is_empty() {
            let reason = failure.unwrap_or_default();
            return Err(StudyForecastError::NoMember { members: plan.members, reason });
        }
        Ok(Self { n_obs, predicted, asked: plan.members, failure })
    }

    /// Members without a prediction.
    pub(super) fn n_failed(&self) -> usize {
        self.asked - self.predicted.len()
    }

    /// The course of one output in every member.
    pub(super) fn courses(&self, row: usize) -> Vec<Vec<f64>> {
        let of = |outputs: &Vec<f64>| outputs.iter().skip(row).step_by(self.n_obs).copied().collect();
        self.predicted.iter().map(of).collect()
    }

    /// The same as it would be measured, with errors of this standard deviation.
    pub(super) fn with_noise(&self, row: usize, sd: f64, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(MEASURED + row as u64);
        let mut courses = self.courses(row);
        for value in courses.iter_mut().flatten() {
            let z: f64 = StandardNormal.sample(&mut rng);
            *value += sd * z;
        }
        courses
    }
}

/// A square root of a covariance, which may lack directions.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    if let Some(root) = covariance.clone().cholesky() {
        return root.l();
    }
    let even = (covariance + covariance.transpose()) * 0.5;
    let SymmetricEigen { eigenvectors, eigenvalues } = even.symmetric_eigen();
    eigenvectors * DMatrix::from_diagonal(&eigenvalues.map(|v| v.max(0.0).sqrt()))
}
