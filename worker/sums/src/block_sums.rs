//! Sums over the rows of one job, and such jobs.
//!
//! A block's last row is the first one of the next block, so that blocks in their order are the whole recording. At longer steps every
//! phase is summed, and a step belongs to the block in which it starts: a block has a few rows more than steps. Next file to read:
//! [`super::question`].

use std::sync::Arc;

use starlings_estimators::inference::{InferenceError, Stream, Sums};
use starlings_models::{
    BuildSetup, Forward, Job, ModelFailure, ParticleError, Prediction, Setup, Spec, Window,
};

use crate::error::SumsError;
use crate::question::Question;

/// Makes the sums of blocks.
pub struct BlockSums {
    question: Question,
    spec: Spec,
    step: f64,
    levels: u32,
}

/// The job of a block: its number, the number of its first row in the record, the number of steps that start in it, times, and rows of
/// states and inputs one after the other.
pub fn block(number: u32, first: u64, n_step: usize, times: Vec<f64>, rows: Vec<f64>) -> Job {
    let start = times.first().copied().unwrap_or(0.0);
    let window = Window { start, times, observed: rows, inputs: Vec::new() };
    Job {
        particle: number,
        record: 0,
        window: Arc::new(window),
        theta: vec![n_step as f64, first as f64],
        state: None,
    }
}

/// The sums that a job's prediction holds, by level.
///
/// # Errors
/// As for [`Sums::from_values`].
pub fn sums_of(
    question: &Question,
    step: f64,
    levels: u32,
    values: &[f64],
) -> Result<Vec<Sums>, InferenceError> {
    let n = Sums::n_value(&question.basis);
    let (expected, got) = (n * levels as usize, values.len());
    if expected != got {
        return Err(InferenceError::Shape { what: "numbers of block sums", expected, got });
    }
    let level = |(k, values)| Sums::from_values(&question.basis, step * f64::from(1_u32 << k), values);
    values.chunks_exact(n).enumerate().map(level).collect()
}

impl BlockSums {
    /// What makes the sums of a setup.
    ///
    /// # Errors
    /// As for [`Question::of`].
    pub fn new(setup: &Setup) -> Result<Self, SumsError> {
        let question = Question::of(setup)?;
        let def = setup.sums.as_deref().ok_or(SumsError::Unasked("the setup asks for no sums"))?;
        if !(def.step > 0.0 && def.step.is_finite()) {
            return Err(InferenceError::NotPositive { what: "the sampling step", value: def.step }.into());
        }
        if def.levels == 0 || def.levels > 8 {
            return Err(SumsError::Unasked("sums are made at 1 to 8 steps"));
        }
        Ok(Self { question, spec: setup.spec()?, step: def.step, levels: def.levels })
    }

    /// Sums at the sampling step of the first `n_step` steps, then at every longer one of the steps that start there.
    fn sums(&self, times: &[f64], rows: &[f64], n_step: usize) -> Result<Vec<f64>, InferenceError> {
        let mut values = Vec::new();
        for level in 0..self.levels {
            let stride = 1_usize << level;
            let mut whole: Option<Sums> = None;
            for phase in 0..stride {
                let sums = self.phase(times, rows, n_step, (phase, stride))?;
                let sums = if level == 0 { sums } else { sums.detach() };
                match &mut whole {
                    Some(whole) => whole.merge(&sums)?,
                    None => whole = Some(sums),
                }
            }
            values.extend(whole.map(|sums| sums.to_values()).unwrap_or_default());
        }
        Ok(values)
    }

    fn phase(
        &self,
        times: &[f64],
        rows: &[f64],
        n_step: usize,
        (phase, stride): (usize, usize),
    ) -> Result<Sums, InferenceError> {
        let width = self.question.basis.n_channel();
        let mut stream = Stream::new(Arc::clone(&self.question.basis), self.step * stride as f64)?;
        let mut row = phase;
        while row < times.len() {
            stream
                .push(times[row], &rows[row * width..][..width])
                .map_err(|error| moved(error, |n| n * stride as u64 + phase as u64))?;
            if row >= n_step {
                break;
            }
            row += stride;
        }
        stream.take().map_err(|error| moved(error, |n| n * stride as u64 + phase as u64))
    }
}

/// An error whose row has another number.
fn moved(error: InferenceError, number: impl Fn(u64) -> u64) -> InferenceError {
    match error {
        InferenceError::NonFinite { row, what, value } => {
            InferenceError::NonFinite { row: number(row), what, value }
        }
        InferenceError::NonUniform { row, got, step } => {
            InferenceError::NonUniform { row: number(row), got, step }
        }
        InferenceError::NotIncreasing { row, before, time } => {
            InferenceError::NotIncreasing { row: number(row), before, time }
        }
        InferenceError::TimeJump { row, before, time, step } => {
            InferenceError::TimeJump { row: number(row), before, time, step }
        }
        other => other,
    }
}

impl Forward for BlockSums {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        let Window { times, observed, .. } = &*job.window;
        let bad = |what: String| Err(ParticleError::BadJob(what));
        let [n_step, first] = job.theta[..] else {
            return bad(format!("block sums need 2 numbers, got {}", job.theta.len()));
        };
        let (n_step, first) = (n_step as usize, first as u64);
        if observed.len() != times.len() * self.question.basis.n_channel() || n_step >= times.len() {
            return bad(format!("{} values and {n_step} steps for {} rows", observed.len(), times.len()));
        }
        match self.sums(times, observed, n_step) {
            Ok(state) => Ok(Prediction { outputs: Vec::new(), state, cost: 0.0 }),
            Err(error) => {
                Err(ModelFailure::OutsideDomain(moved(error, |row| row + first).to_string()).into())
            }
        }
    }
}
