//! Sums over the rows of one job, and such jobs.
//!
//! A block's last row is the first one of the next block, so that blocks in their order are the whole recording. At longer steps every
//! phase is summed, and a step belongs to the block in which it starts: a block has a few rows more than steps. Next file to read:
//! [`super::question`].

use std::sync::Arc;

use starlings_estimators::inference::{InferenceError, Pairs, Stream, Sums};
use starlings_models::{
    BuildSetup, Forward, Job, ModelFailure, ParticleError, Prediction, Setup, Spec, SumsFile, Window,
};

use crate::answer::{Fault, fault_values, sums_values};
use crate::error::SumsError;
use crate::file_rows::{self, Bytes, Part};
use crate::question::Question;

/// Makes the sums of blocks.
pub struct BlockSums {
    question: Question,
    spec: Spec,
    step: f64,
    levels: u32,
    files: Vec<SumsFile>,
}

/// Whether files that a setup names are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// They are not, and such a setup is refused.
    Refused,
    /// They are: the setup comes from the user whose process this is.
    Allowed,
}

/// The job of a block: the number of its record, the number of its first row there, the number of steps that start in it, times, and
/// rows of states and inputs one after the other.
pub fn block(record: u32, first: u64, n_step: usize, times: Vec<f64>, rows: Vec<f64>) -> Job {
    let start = times.first().copied().unwrap_or(0.0);
    let window = Window { start, times, observed: rows, inputs: Vec::new(), since: vec![] };
    job(record, window, vec![n_step as f64, first as f64])
}

/// The job of a block whose rows are bytes of the record's file.
pub fn file_block(record: u32, first: u64, n_step: usize, bytes: Bytes) -> Job {
    let Bytes { start, length, n_row } = bytes;
    // A window has a time; these rows have their own.
    let window = Window::free(0.0, vec![0.0], 0, Vec::new());
    job(record, window, vec![n_step as f64, first as f64, start as f64, length as f64, n_row as f64])
}

/// The job of a block whose rows are those of a part of the record's file. The numbers of its rows are not known.
pub fn file_part(record: u32, part: Part) -> Job {
    let window = Window::free(0.0, vec![0.0], 0, Vec::new());
    job(record, window, vec![part.from as f64, part.to as f64, part.ahead as f64])
}

fn job(record: u32, window: Window, theta: Vec<f64>) -> Job {
    Job { particle: 0, record, window: Arc::new(window), theta, state: None }
}

impl BlockSums {
    /// What makes the sums of a setup.
    ///
    /// # Errors
    /// As for [`Question::of`]; `Unasked` for files that are not to be read.
    pub fn new(setup: &Setup, reading: Reading) -> Result<Self, SumsError> {
        let question = Question::of(setup)?;
        let def = setup.sums.as_deref().ok_or(SumsError::Unasked("the setup asks for no sums"))?;
        if !(def.step > 0.0 && def.step.is_finite()) {
            return Err(InferenceError::NotPositive { what: "the sampling step", value: def.step }.into());
        }
        if def.levels == 0 || def.levels > 8 {
            return Err(SumsError::Unasked("sums are made at 1 to 8 steps"));
        }
        if reading == Reading::Refused && !def.files.is_empty() {
            return Err(SumsError::Unasked(
                "this worker reads no recordings: those that --allow-commands-from-study trusts with its user's rights do",
            ));
        }
        let (step, levels, files) = (def.step, def.levels, def.files.clone());
        Ok(Self { question, spec: setup.spec()?, step, levels, files })
    }

    /// The answer for rows, the first of which has the number `first` in its record.
    fn answer(
        &self,
        times: &[f64],
        rows: &[f64],
        n_step: usize,
        first: u64,
    ) -> Result<Vec<f64>, InferenceError> {
        let found = self.sums(times, rows, n_step).map_err(|error| moved(error, |row| row + first));
        match found {
            Ok(levels) => {
                let Question { basis, pairs, .. } = &self.question;
                let pairs = Pairs::of_block(times, rows, basis.n_channel(), n_step, *pairs);
                Ok(sums_values(&levels, [times[0], times[n_step]], &pairs))
            }
            Err(error) => fault_values(&self.question, &Fault::Row(error.clone())).ok_or(error),
        }
    }

    /// The answer for bytes of a file.
    fn answer_of_file(
        &self,
        record: u32,
        n_step: usize,
        first: u64,
        bytes: Bytes,
    ) -> Result<Vec<f64>, InferenceError> {
        let file = self.files.get(record as usize);
        let rows = file.and_then(|file| file_rows::read(file, bytes));
        self.answer_if_read(rows.map(|(times, rows)| (n_step, times, rows)), first)
    }

    /// The answer for a part of a file.
    fn answer_of_part(&self, record: u32, part: Part) -> Result<Vec<f64>, InferenceError> {
        let file = self.files.get(record as usize);
        self.answer_if_read(file.and_then(|file| file_rows::read_part(file, part)), 0)
    }

    /// The answer for steps, times and rows, where they could be read.
    fn answer_if_read(
        &self,
        read: Option<(usize, Vec<f64>, Vec<f64>)>,
        first: u64,
    ) -> Result<Vec<f64>, InferenceError> {
        let width = self.question.basis.n_channel();
        let fits = |(n_step, times, rows): &(usize, Vec<f64>, Vec<f64>)| {
            *n_step < times.len() && rows.len() == times.len() * width
        };
        match read.filter(fits) {
            Some((n_step, times, rows)) => self.answer(&times, &rows, n_step, first),
            None => Ok(fault_values(&self.question, &Fault::Unread).unwrap_or_default()),
        }
    }

    /// Sums at the sampling step of the first `n_step` steps, then at every longer one of the steps that start there.
    fn sums(&self, times: &[f64], rows: &[f64], n_step: usize) -> Result<Vec<Sums>, InferenceError> {
        let mut levels = Vec::new();
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
            levels.extend(whole);
        }
        Ok(levels)
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
        let answer = match job.theta[..] {
            [n_step, first] => {
                let n_step = n_step as usize;
                if observed.len() != times.len() * self.question.basis.n_channel() || n_step >= times.len() {
                    return bad(format!(
                        "{} values and {n_step} steps for {} rows",
                        observed.len(),
                        times.len()
                    ));
                }
                self.answer(times, observed, n_step, first as u64)
            }
            [n_step, first, start, length, n_row] => {
                let bytes = Bytes { start: start as u64, length: length as u64, n_row: n_row as usize };
                self.answer_of_file(job.record, n_step as usize, first as u64, bytes)
            }
            [from, to, ahead] => {
                let part = Part { from: from as u64, to: to as u64, ahead: ahead as usize };
                self.answer_of_part(job.record, part)
            }
            _ => return bad(format!("block sums need 2, 3 or 5 numbers, got {}", job.theta.len())),
        };
        match answer {
            Ok(state) => Ok(Prediction { outputs: Vec::new(), state: state.into(), cost: 0.0 }),
            Err(error) => Err(ModelFailure::OutsideDomain(error.to_string()).into()),
        }
    }
}
