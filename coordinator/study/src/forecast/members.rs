//! The members of a forecast: run on the fleet, gathered in their order.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_fleet::Fleet;
use starlings_models::{Job, Window};

use super::StudyForecastError;
use super::ensemble::Ensemble;
use crate::RunError;

/// Stream of the seed for the errors of the first output; draws of the posterior have the one before.
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
    /// Runs an ensemble.
    ///
    /// # Errors
    /// When the fleet fails, or no member has a prediction.
    pub(super) fn run(fleet: &mut dyn Fleet, ensemble: &Ensemble) -> Result<Self, StudyForecastError> {
        let n_obs = ensemble.setup.outputs.len();
        let times = &ensemble.times;
        let window = Arc::new(Window::free(times[0], times.clone(), n_obs, ensemble.inputs.clone()));
        let job = |(particle, theta): (usize, &Vec<f64>)| Job {
            particle: particle as u32,
            record: ensemble.record.0,
            window: Arc::clone(&window),
            theta: theta.clone(),
            state: None,
        };
        let jobs: Vec<Job> = ensemble.members.iter().enumerate().map(job).collect();
        let asked = jobs.len();
        let setup = fleet.install(&ensemble.setup).map_err(RunError::from)?;
        let outcomes = fleet.run(setup, jobs).map_err(RunError::from)?;
        let (mut predicted, mut failure) = (Vec::with_capacity(asked), None);
        for outcome in outcomes {
            match outcome.result {
                Ok(prediction) if prediction.outputs.len() == n_obs * times.len() => {
                    predicted.push(prediction.outputs);
                }
                Ok(_) => failure = failure.or_else(|| Some("an answer of another length".to_owned())),
                Err(error) => failure = failure.or_else(|| Some(error.to_string())),
            }
        }
        if predicted.is_empty() {
            let reason = failure.unwrap_or_default();
            return Err(StudyForecastError::NoMember { members: asked, reason });
        }
        Ok(Self { n_obs, predicted, asked, failure })
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

    /// The same as it would be measured, with errors of this standard deviation at every time.
    pub(super) fn with_noise(&self, row: usize, sd: &[f64], seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(MEASURED + row as u64);
        let mut courses = self.courses(row);
        for (value, sd) in courses.iter_mut().flat_map(|course| course.iter_mut().zip(sd)) {
            let z: f64 = StandardNormal.sample(&mut rng);
            *value += sd * z;
        }
        courses
    }
}
