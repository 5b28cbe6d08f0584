//! A recording that is still written: the estimate after every block, and an alarm when the last blocks no longer fit those before.
//!
//! Everything is computed here, row by row, in constant memory. After an alarm the last blocks are the new reference and the new start of
//! the estimate. Next files to read: [`line`](mod@line), what is told, and `state.rs`, what a restart goes on from.

pub mod line;
mod state;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use starlings_estimators::inference::{
    Detector, Following, InferenceError, Memory, Posterior, Report, Stream, Window,
};
use starlings_study::Study;

use crate::blocks::even_step;
use crate::error::InferError;
use crate::rows::{Row, Rows};
use crate::run::{Asked, asked, choice};
use line::Line;
use state::Saved;

/// Rows from which the sampling step is taken where the study does not say it.
const FIRST: usize = 100;

/// Where rows come from, and what a restart goes on from.
pub struct Source<'a, R> {
    /// What the text is called in messages.
    pub name: &'a Path,
    /// The text: a line with the names of the columns, then rows.
    pub text: R,
    /// File of the state, read where it is there and written after every block.
    pub state: Option<PathBuf>,
}

/// Follows a recording to its end, with the columns of the study's first record. `told` hears a line per block.
///
/// # Errors
/// For a row that is not what it should be, with its line; for a state of another study; where the recording ends before its first block.
pub fn follow<R: Read>(
    study: &Study,
    source: Source<'_, R>,
    told: &mut dyn FnMut(&Line) -> Result<(), InferError>,
) -> Result<u64, InferError> {
    let settings = choice(study)?;
    let Some(record) = settings.records.first() else {
        return Err(InferError::Setting(
            "the study has no record whose columns could be followed".to_owned(),
        ));
    };
    let mut rows = Rows::new(source.name, source.text, &record.time, &record.columns)?;
    let saved = source.state.as_deref().map_or(Ok(None), state::read)?;
    let mut first = First::default();
    let step = match &saved {
        Some(saved) => saved.step,
        None => first.read(&mut rows, record.columns.len(), settings.sums.step)?,
    };
    let asked = asked(study, settings, step)?;
    let mut follower = Follower::new(&asked, step)?;
    let mut after = f64::NEG_INFINITY;
    if let Some(saved) = saved {
        let file = source.state.clone().unwrap_or_default();
        let damaged = |message: String| InferError::State { file: file.clone(), message };
        after = saved.time;
        follower.resume(saved).map_err(|error| damaged(error.to_string()))?;
    }
    let mut values = vec![0.0; record.columns.len()];
    while let Some((line, time)) = first.next(&mut rows, &mut values)? {
        if time <= after {
            continue;
        }
        after = f64::NEG_INFINITY;
        let answer = follower.push(time, &values).map_err(|error| told_at(&rows, line, &error))?;
        if let Some(answer) = answer {
            told(&answer)?;
            if let Some(file) = &source.state {
                state::write(file, &follower.saved()?)?;
            }
        }
    }
    if follower.n_step < settings.follow.block as u64 {
        let message = format!(
            "the recording ended after {} steps, before a block of {} was full",
            follower.n_step, settings.follow.block
        );
        return Err(rows.fault(None, message, "a smaller [infer.follow] block answers sooner"));
    }
    Ok(follower.n_step)
}

/// An error of a row with its line.
fn told_at<R: Read>(rows: &Rows<R>, line: u64, error: &InferenceError) -> InferError {
    let help = match error {
        InferenceError::NotIncreasing { .. } => "a stream gives every row once, in the order of time",
        InferenceError::TimeJump { .. } => "rows are missing: follow the part behind it by itself",
        InferenceError::NonUniform { .. } => "an inference needs equal steps",
        _ => "see [infer] of the study",
    };
    rows.fault(Some(line), error.to_string(), help)
}

/// The first rows, which say the sampling step.
#[derive(Default)]
struct First {
    /// Line, time and values, the next one last.
    rows: Vec<(u64, f64, Vec<f64>)>,
}

impl First {
    fn read<R: Read>(&mut self, rows: &mut Rows<R>, width: usize, given: f64) -> Result<f64, InferError> {
        if given > 0.0 {
            return Ok(given);
        }
        let mut values = vec![0.0; width];
        while self.rows.len() < FIRST {
            let Some(Row { line, time }) = rows.next(&mut values)? else { break };
            self.rows.push((line, time, values.clone()));
        }
        let times: Vec<f64> = self.rows.iter().map(|(_, time, _)| *time).collect();
        self.rows.reverse();
        let short = || {
            rows.fault(
                None,
                format!("the recording ended after {} rows", times.len()),
                "an inference needs many rows",
            )
        };
        even_step(&times).ok_or_else(short)
    }

    fn next<R: Read>(
        &mut self,
        rows: &mut Rows<R>,
        values: &mut [f64],
    ) -> Result<Option<(u64, f64)>, InferError> {
        if let Some((line, time, held)) = self.rows.pop() {
            values.copy_from_slice(&held);
            return Ok(Some((line, time)));
        }
        Ok(rows.next(values)?.map(|row| (row.line, row.time)))
    }
}

/// The estimate and the detector between two rows.
struct Follower<'a> {
    asked: &'a Asked<'a>,
    step: f64,
    detector: Detector,
    stream: Stream,
    window: Window,
    posterior: Option<Posterior>,
    n_step: u64,
    time: f64,
}

impl<'a> Follower<'a> {
    fn new(asked: &'a Asked<'a>, step: f64) -> Result<Self, InferError> {
        let settings = &asked.choice.follow;
        let memory = settings.window.map_or(Memory::Growing, Memory::Sliding);
        let following = Following {
            block: settings.block as u64,
            recent: settings.recent,
            reference: memory,
            least: settings.least as u64,
            rate: settings.rate,
            watched: Vec::new(),
        };
        let (basis, structure) = (&asked.question.basis, asked.question.structure.clone());
        Ok(Self {
            asked,
            step,
            detector: Detector::new(Arc::clone(basis), step, structure, asked.fit.clone(), following)?,
            stream: Stream::new(Arc::clone(basis), step)?,
            window: Window::new(memory),
            posterior: None,
            n_step: 0,
            time: f64::NAN,
        })
    }

    /// Takes a row; a line where it ends a block.
    fn push(&mut self, time: f64, values: &[f64]) -> Result<Option<Line>, InferenceError> {
        let first = self.stream.n_row() == 0;
        self.stream.push(time, values)?;
        let report = match self.detector.push(time, values) {
            Ok(report) => report,
            Err(error) if speaks_of_a_row(&error) => return Err(error),
            // There is no reference yet that could be estimated.
            Err(_) => None,
        };
        self.time = time;
        if first {
            return Ok(None);
        }
        self.n_step += 1;
        if !self.n_step.is_multiple_of(self.asked.choice.follow.block as u64) {
            return Ok(None);
        }
        let block = self.stream.take()?;
        self.window.push(block)?;
        if report.as_ref().is_some_and(|report| report.alarm) {
            self.restart()?;
        }
        self.estimate();
        Ok(Some(self.line(report.as_ref())))
    }

    /// After a change the last blocks are all that counts.
    fn restart(&mut self) -> Result<(), InferenceError> {
        let recent = self.detector.recent();
        match self.detector.accept() {
            Err(error) if speaks_of_a_row(&error) => return Err(error),
            _ => {}
        }
        self.window = Window::new(self.asked.choice.follow.window.map_or(Memory::Growing, Memory::Sliding));
        if let Some(recent) = recent {
            self.window.push(recent)?;
        }
        self.posterior = None;
        Ok(())
    }

    fn estimate(&mut self) {
        let (fit, structure) = (&self.asked.fit, &self.asked.question.structure);
        let Some(sums) = self.window.sums() else { return };
        let found = match &self.posterior {
            Some(earlier) => fit.update(&sums, structure, earlier),
            None => fit.posterior(&sums, structure),
        };
        // Too little is known: the line has no values.
        self.posterior = found.ok();
    }

    fn line(&self, report: Option<&Report>) -> Line {
        line::line(self.time, self.n_step, self.posterior.as_ref(), report, &self.asked.question.structure)
    }

    fn saved(&mut self) -> Result<Saved, InferError> {
        Ok(Saved {
            asked: state::fingerprint(self.asked)?,
            step: self.step,
            time: self.time,
            n_step: self.n_step,
            detector: self.detector.state()?,
            stream: self.stream.state()?,
            window: self.window.clone(),
            posterior: self.posterior.clone(),
        })
    }

    fn resume(&mut self, saved: Saved) -> Result<(), InferError> {
        let basis = &self.asked.question.basis;
        if saved.asked != state::fingerprint(self.asked)? {
            let message = "it is the state of another study, whose model, step, columns or [infer] differ";
            return Err(InferError::Setting(message.to_owned()));
        }
        saved.window.check(basis)?;
        saved
            .posterior
            .as_ref()
            .map_or(Ok(()), |posterior| posterior.check(&self.asked.question.structure))?;
        let fresh = Self::new(self.asked, self.step)?;
        self.detector = fresh.detector.resume(saved.detector)?;
        self.stream = Stream::resume(Arc::clone(basis), saved.stream)?;
        (self.window, self.posterior) = (saved.window, saved.posterior);
        (self.n_step, self.time) = (saved.n_step, saved.time);
        Ok(())
    }
}

/// Whether a row is at fault, rather than that too little is known.
fn speaks_of_a_row(error: &InferenceError) -> bool {
    matches!(
        error,
        InferenceError::Shape { .. }
            | InferenceError::NonFinite { .. }
            | InferenceError::NotIncreasing { .. }
            | InferenceError::TimeJump { .. }
            | InferenceError::NonUniform { .. }
            | InferenceError::Damaged { .. }
    )
}
