//! Why a run gave no prediction, in three types: what speaks of the parameters, what speaks of the place, and a time limit.
//!
//! A [`ModelFailure`] is data about θ. An infrastructure failure says only that a place could not make the run; it moves no sigma
//! point and no [`Outcome`](Failure) can hold it. A [`Timeout`] is a decision about a run, which is stored. An abnormal end of a
//! program is undecided until a control run has told which of the first two it is. Who retries what is not decided here. Next file
//! to read: [`crate::job`].

/// The model has no prediction for these parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelFailure {
    /// A state or output stopped being a finite number.
    #[error("{what} is not a finite number at t = {time}")]
    NotFinite {
        /// The state or output.
        what: String,
        /// Time in the study's unit.
        time: f64,
    },
    /// The integrator could not go on with a positive step.
    #[error(
        "the integrator's step fell to {step:e} at t = {time}: the model is too stiff for it or has a singularity there"
    )]
    StepTooSmall {
        /// Time in the study's unit.
        time: f64,
        /// The refused step.
        step: f64,
    },
    /// The run would take more steps than allowed: a step, a delay or a time constant is too short for it.
    #[error("more than {limit} steps of integration, at t = {time}")]
    TooManySteps {
        /// Time reached.
        time: f64,
        /// The limit.
        limit: u64,
    },
    /// The solver says that the model has no solution there.
    #[error("outside the model's domain: {0}")]
    OutsideDomain(String),
    /// A native model broke down or panicked, or a control run has shown that an abnormal end was the parameters' doing.
    #[error("the solver failed: {0}")]
    Solver(String),
}

/// A run took longer than its limit of wall time, which is no property of θ alone: a slower place may decide otherwise.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{says}")]
pub struct Timeout {
    /// The limit, seconds of wall time.
    pub limit: f64,
    /// One sentence with the limit and who sets it.
    pub says: String,
}

/// Why a run gave no prediction, as the place that made it tells it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParticleError {
    /// It is the parameters' doing.
    #[error(transparent)]
    Model(#[from] ModelFailure),
    /// It is the place's doing: a program or a folder is missing, the disk is full, a licence is refused, somebody killed the
    /// program. Nothing is known of the parameters.
    #[error("it could not be run: {0}")]
    Infrastructure(String),
    /// The limit of wall time was reached.
    #[error(transparent)]
    Timeout(#[from] Timeout),
    /// The program ended abnormally or answered nonsense. Only a control run tells whether the parameters or the place did it.
    #[error("the solver failed: {0}")]
    Undecided(String),
    /// The job does not fit the setup: a wrong length or an unknown record.
    #[error("the job does not fit the model: {0}")]
    BadJob(String),
}

/// Why a run that was decided has no prediction: data of the study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Failure {
    /// The model has none for these parameters.
    #[error(transparent)]
    Model(#[from] ModelFailure),
    /// It was given up after its limit of wall time.
    #[error(transparent)]
    Timeout(#[from] Timeout),
}
