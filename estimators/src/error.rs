//! Every way an estimator can refuse its input or fail, one variant per decision a caller can take.
//!
//! Deliberately no free text inside: the numbers are fields, so that a caller can name its own channels and parameters.
//! Read next: `data.rs`, where most of these arise.

use thiserror::Error;

/// What an estimator could not do, and why.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EstimatorError {
    /// Rows of different blocks of parameters whose noise is correlated.
    #[error("a fit in blocks of parameters needs noise that is independent from row to row")]
    CorrelatedBlocks,
    /// There is nothing to estimate.
    #[error("no parameter to estimate: at least one is needed")]
    NoParameters,
    /// The free constant of the Julier-Uhlmann set leaves its centre without a positive weight.
    #[error(
        "kappa = {kappa} is not a positive finite number: the centre of the sigma set needs a positive weight"
    )]
    Kappa {
        /// The value given.
        kappa: f64,
    },
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
    /// A prediction that the analysis needs is not a finite number.
    #[error(
        "prediction {row} of particle {particle} is {value}: run it again, pull it towards the mean, or drop it"
    )]
    NonFinitePrediction {
        /// Row of the prediction, from 0.
        row: usize,
        /// Column of the prediction, from 0.
        particle: usize,
        /// What was found.
        value: f64,
    },
    /// An observation is infinite (a missing one is NaN).
    #[error("observation {row} is {value}: a missing value is NaN, any other must be finite")]
    NonFiniteObservation {
        /// Row of the observation, from 0.
        row: usize,
        /// What was found.
        value: f64,
    },
    /// A noise standard deviation is not positive and finite.
    #[error("noise standard deviation {value} of observation {row}: it must be positive and finite")]
    NoiseNotPositive {
        /// Row of the observation, from 0.
        row: usize,
        /// Standard deviation given.
        value: f64,
    },
    /// The noise covariance is not symmetric.
    #[error(
        "the noise covariance of observations {row} and {column} is {above} one way and {below} the other: it must be symmetric"
    )]
    NoiseNotSymmetric {
        /// Row of the covariance, from 0.
        row: usize,
        /// Column of the covariance, from 0.
        column: usize,
        /// Entry (row, column).
        above: f64,
        /// Entry (column, row).
        below: f64,
    },
    /// The noise covariance of the observed rows has no Cholesky factor.
    #[error("the covariance of the {n_used} observed rows is not positive definite")]
    NoiseNotDefinite {
        /// Number of rows that are not missing.
        n_used: usize,
    },
    /// A covariance of parameters has no Cholesky factor.
    #[error("{what} covariance of the parameters is not positive definite")]
    NotPositiveDefinite {
        /// Which covariance.
        what: &'static str,
    },
    /// Without the lost particles the others no longer span the parameters.
    #[error(
        "{n_left} particles are left, which do not span the {n_param} parameters (parameter number {parameters:?} \
         would move freely): bound these parameters with a logit transform, tighten their prior, or use star points, \
         which can lose a particle"
    )]
    NotSpanned {
        /// Particles that are left.
        n_left: usize,
        /// Number of parameters.
        n_param: usize,
        /// Parameters (from 0) that take part in the direction that is lost, the strongest first.
        parameters: Vec<usize>,
    },
    /// The particles no longer spread in some direction, so a factor of their covariance cannot be inverted.
    #[error(
        "the particles have no spread left in parameter number {parameter}: its drift or prior must not be zero"
    )]
    NoSpread {
        /// Parameter, from 0.
        parameter: usize,
    },
    /// A drift lies outside its range.
    #[error(
        "drift {value} of parameter number {parameter}: forgetting lies in (0, 1], a walk is not negative"
    )]
    DriftOutOfRange {
        /// Parameter, from 0.
        parameter: usize,
        /// Value given.
        value: f64,
    },
    /// The spread of the points of a batch fit is not positive and finite.
    #[error("spread {value} of the sigma points: it must be positive and finite")]
    Spread {
        /// Value given.
        value: f64,
    },
    /// An intensity of a random walk is not positive and finite, or none is given.
    #[error("intensity {value} of the random walk: give at least one, all positive and finite")]
    Intensity {
        /// Value given; NaN where there is none.
        value: f64,
    },
    /// The model could not be run at the first centre of a batch fit, or nowhere close to it.
    #[error(
        "the model cannot be run at the prior mean (attempt {attempt}): move the prior or bound its parameters"
    )]
    StartFailed {
        /// How many ensembles were tried.
        attempt: usize,
    },
    /// Eigenvalues or singular values were not found within the limit of their iteration.
    #[error(
        "the decomposition of the {what} matrix did not end within {limit} iterations: its entries are out of all \
         proportion, scale priors and noise to the data"
    )]
    NotDecomposed {
        /// Which matrix.
        what: &'static str,
        /// Iterations that were allowed.
        limit: usize,
    },
    /// An iteration produced no finite number (an observation model that overflows).
    #[error("{what} is not finite")]
    NotFinite {
        /// The quantity.
        what: &'static str,
    },
}
