//! The estimate and the detector between two rows.
//!
//! Next files to read: `line.rs`, what is told, and `state.rs`, what a restart goes on from.

use std::sync::Arc;

use starlings_estimators::inference::{
    Detector, Following, InferenceError, Memory, Posterior, Report, Stream, Verdict, Window,
};

use super::line::{self, Line};
use super::state::{self, Saved};
use crate::error::InferError;
use crate::fitted::{Fitted, Given};
use crate::run::Asked;

/// Why there is no test where errors of the measurement matter.
const NOISY: &str = "no test of a change: errors of the measurement matter, which neighbouring residuals share, so that no rate of false alarms \
                     holds; average rows to fewer and longer steps";

/// The estimate and the detector.
pub(super) struct Follower<'a> {
    asked: &'a Asked<'a>,
    step: f64,
    detector: Detector,
    stream: Stream,
    window: Window,
    posterior: Option<Posterior>,
    lag_corrected: bool,
    /// Whether errors of the measurement matter, as far as the last block: then neighbouring residuals share them, and no test holds.
    is_noisy: bool,
    /// Why there is no estimate or no test.
    error: Option<String>,
    pub(super) n_step: u64,
    time: f64,
}

impl<'a> Follower<'a> {
    pub(super) fn new(asked: &'a Asked<'a>, step: f64) -> Result<Self, InferError> {
        let settings = &asked.choice.follow;
        let memory = settings.window.map_or(Memory::Growing, Memory::Sliding);
        let following = Following {
            block: settings.block as u64,
            recent: settings.recent,
            reference: memory,
            least: settings.least as u64,
            longer: true,
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
            lag_corrected: false,
            is_noisy: false,
            error: None,
            n_step: 0,
            time: f64::NAN,
        })
    }

    /// Takes a row; a line where it ends a block.
    pub(super) fn push(&mut self, time: f64, values: &[f64]) -> Result<Option<Line>, InferenceError> {
        let first = self.stream.n_row() == 0;
        self.stream.push(time, values)?;
        self.error = None;
        let tested = self.detector.push(time, values);
        let report = self.known(tested)?.flatten();
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
        let report = report.filter(|_| !self.is_noisy);
        if self.is_noisy {
            self.error.get_or_insert_with(|| NOISY.to_owned());
        }
        if let Some(report) = report.as_ref().filter(|report| report.alarm) {
            self.restart(report)?;
        }
        let fitted = self.fitted();
        let fitted = self.known(fitted)?.flatten();
        self.lag_corrected = fitted.as_ref().is_some_and(|fitted| fitted.fit.lag_corrected);
        self.is_noisy = fitted
            .as_ref()
            .is_some_and(|fitted| fitted.checks.iter().any(|check| check.verdict == Verdict::Matters));
        self.posterior = fitted.map(|fitted| fitted.posterior);
        Ok(Some(self.line(report.as_ref())))
    }

    /// After a change the blocks since then are all that counts.
    fn restart(&mut self, report: &Report) -> Result<(), InferenceError> {
        let accepted = self.detector.accept(report);
        self.known(accepted)?;
        self.window = Window::new(self.asked.choice.follow.window.map_or(Memory::Growing, Memory::Sliding));
        if let Some(since) = self.detector.reference() {
            self.window.push(since)?;
        }
        self.posterior = None;
        Ok(())
    }

    fn fitted(&self) -> Result<Option<Fitted>, InferenceError> {
        let Asked { choice, fit, question, .. } = self.asked;
        let Some(sums) = self.window.sums() else { return Ok(None) };
        Fitted::of(choice, fit, &question.structure, &sums, Given::Earlier(self.posterior.as_ref())).map(Some)
    }

    /// What was found. Where too little is known yet it is nothing; what more rows alone do not mend stands in the line.
    fn known<T>(&mut self, found: Result<T, InferenceError>) -> Result<Option<T>, InferenceError> {
        match found {
            Ok(found) => Ok(Some(found)),
            Err(InferenceError::TooFew { .. } | InferenceError::NothingObserved) => Ok(None),
            Err(error) if speaks_of_a_row(&error) => Err(error),
            Err(error) => {
                self.error.get_or_insert_with(|| InferError::from(error).to_string());
                Ok(None)
            }
        }
    }

    fn line(&self, report: Option<&Report>) -> Line {
        let structure = &self.asked.question.structure;
        let line = line::line(self.time, self.n_step, self.posterior.as_ref(), report, structure);
        Line { lag_corrected: self.lag_corrected, error: self.error.clone(), ..line }
    }

    /// Rows that were taken since the one at fault, whose functions are summed some rows later.
    pub(super) fn rows_since(&self, error: &InferenceError) -> u64 {
        match error {
            InferenceError::NonFinite { row, .. } => self.stream.n_row().saturating_sub(row + 1),
            _ => 0,
        }
    }

    pub(super) fn saved(&mut self) -> Result<Saved, InferError> {
        Ok(Saved {
            asked: state::fingerprint(self.asked)?,
            step: self.step,
            time: self.time,
            n_step: self.n_step,
            detector: self.detector.state()?,
            stream: self.stream.state()?,
            window: self.window.clone(),
            posterior: self.posterior.clone(),
            is_noisy: self.is_noisy,
        })
    }

    pub(super) fn resume(&mut self, saved: Saved) -> Result<(), InferError> {
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
        (self.n_step, self.time, self.is_noisy) = (saved.n_step, saved.time, saved.is_noisy);
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
