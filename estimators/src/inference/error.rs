//! Every way a dynamical inference can refuse its input or fail, one variant per decision a caller can take.
//!
//! An enum of its own beside [`EstimatorError`](crate::EstimatorError): these speak of a recording and of the terms of an
//! equation, which the filters do not know. Terms and channels are named as the caller named them.
//! Read next: `stream.rs`, where a recording is refused, and `fit.rs`, where an estimate is.

use thiserror::Error;

/// What a dynamical inference could not do, and why.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum InferenceError {
    /// Two things that must have the same length do not.
    #[error("{what}: expected {expected}, got {got}")]
    Shape {
        /// What was measured.
        what: &'static str,
        /// Length that was needed.
        expected: usize,
        /// Length that was found.
        got: usize,
    },
    /// Two functions, coefficients or equations have one name.
    #[error("the name {name} is there twice")]
    RepeatedName {
        /// The name.
        name: String,
    },
    /// Something is named that is not there.
    #[error("there is no {what} {name}")]
    Unknown {
        /// Function, equation or coefficient.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A number that has to be positive and finite is not.
    #[error("{what} is {value}: it must be positive and finite")]
    NotPositive {
        /// The quantity.
        what: &'static str,
        /// Value given.
        value: f64,
    },
    /// A recorded value, or the value of a function at it, is no finite number.
    #[error("{what} is {value} at row {row}")]
    NonFinite {
        /// Row of the recording, from 0.
        row: u64,
        /// Channel or function.
        what: String,
        /// What was found.
        value: f64,
    },
    /// A time is not later than the one before: a row that repeats, or a recording out of order.
    #[error("time {time} of row {row} is not later than {before} of the row before")]
    NotIncreasing {
        /// Row of the recording, from 0.
        row: u64,
        /// Time of the row before.
        before: f64,
        /// Its own.
        time: f64,
    },
    /// Rows are missing.
    #[error(
        "time jumps from {before} to {time} at row {row}, over more than one step of {step}: break the recording there"
    )]
    TimeJump {
        /// Row of the recording, from 0.
        row: u64,
        /// Time of the row before.
        before: f64,
        /// Its own.
        time: f64,
        /// Sampling step.
        step: f64,
    },
    /// The recording is not sampled uniformly.
    #[error("the step to row {row} is {got} where the recording's is {step}: resample it to equal steps")]
    NonUniform {
        /// Row of the recording, from 0.
        row: u64,
        /// Step found.
        got: f64,
        /// Sampling step.
        step: f64,
    },
    /// Sums that were made with other functions, another step or other channels.
    #[error("these sums differ in {what} and cannot be put together")]
    Incompatible {
        /// What differs.
        what: &'static str,
    },
    /// Sums from elsewhere whose parts do not fit together.
    #[error("these sums are damaged: {what}")]
    Damaged {
        /// What is wrong.
        what: &'static str,
    },
    /// There are not more steps than unknowns.
    #[error("{n_step} steps do not determine the {n_unknown} unknowns of {equation} and their noise")]
    TooFew {
        /// Steps.
        n_step: u64,
        /// Coefficients that enter the equation.
        n_unknown: usize,
        /// The equation.
        equation: String,
    },
    /// No coefficient is left: none has any information.
    #[error("the data say nothing of any coefficient")]
    NothingObserved,
    /// A combination of coefficients that the data do not determine.
    #[error("the data cannot tell these terms apart: {}", columns.join(", "))]
    Collinear {
        /// Coefficients that take part in the combination, the strongest first.
        columns: Vec<String>,
    },
    /// The noise has no positive definite covariance, as in equations without noise or with the same noise.
    #[error(
        "the noise of {} has no positive definite covariance: an equation without noise of its own is a known input",
        equations.join(", ")
    )]
    DiffusionNotDefinite {
        /// Equations that take part.
        equations: Vec<String>,
    },
    /// A covariance or precision that was given is not symmetric and positive definite.
    #[error("{what} is not symmetric and positive definite")]
    NotDefinite {
        /// Which.
        what: &'static str,
    },
    /// Coefficients and noise do not settle.
    #[error(
        "coefficients and noise have not settled after {passes} pass{}: there are too few steps for so many terms, or \
         each is too long for the dynamics",
        if *passes == 1 { "" } else { "es" }
    )]
    NotSettled {
        /// Passes made.
        passes: usize,
    },
    /// A result would not be a finite number.
    #[error("{what} is not finite")]
    Overflow {
        /// The quantity.
        what: &'static str,
    },
}
