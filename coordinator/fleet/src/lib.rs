//! The fleet: runs a batch of jobs on whatever workers there are and returns their outcomes in job order.
//!
//! [`dispatcher`] decides (pure: events in, commands out); [`GrpcFleet`] is the shell that carries its commands over the
//! network; [`InProcess`] runs jobs on threads of this process; [`LocalWorkers`] keeps worker processes on this machine
//! alive. Nothing here knows estimators, studies or stores, and nothing here retries with other parameters: a particle whose
//! model fails is an [`Outcome`] whose result is an error. A failure of a place sets a worker aside; when none is left the batch
//! ends with a [`FleetError`]. Whoever dials passes the [`door`]. Next file to read: [`dispatcher`].

pub mod access;
mod bound;
mod config;
mod dispatcher;
mod door;
mod error;
mod event;
mod event_kind;
mod event_text;
mod explained;
mod grpc;
mod handle;
mod hub;
mod identity;
mod in_process;
mod job_name;
mod load;
mod local_workers;
mod network;
mod outbox;
mod probe;
mod recombination;
mod run_traces;
mod service;
mod tally;
mod transfer;
mod travel;
mod wire;

pub use bound::Bound;
pub use config::FleetConfig;
pub use door::Refused;
pub use error::FleetError;
pub use event::FleetEvent;
pub use grpc::GrpcFleet;
pub use handle::FleetHandle;
pub use identity::RunIdentity;
pub use in_process::InProcess;
pub use load::{Load, WorkerLoad};
pub use local_workers::{LocalConfig, LocalWorkers};
pub use recombination::{Piece, Recombine};
pub use run_traces::RunTraces;
pub use starlings_models::Factory;
pub use starlings_proto::{ProtocolError, SetupId, job_key};
pub use starlings_states::{
    CHUNK_VALUES, Folder, Held, PlaceName, StateError, StateStore, StateWriter, StoredState, hex, n_chunks,
};
pub use tally::{Census, FAILURE_TYPES, RUN_TIME_BOUNDS, Reading, Readings, Tally};
pub use travel::{returns, travels};

use std::ops::ControlFlow;
use std::time::Duration;

use starlings_models::{Failure, Job, Prediction, Setup, StateValues};

/// How often outcomes are told of while their batch goes on.
pub const TELL_EVERY: Duration = Duration::from_millis(500);

/// Takes outcomes of jobs, each with the place of its job in the batch, while the batch goes on. A break ends the batch.
pub type Arrived<'a> = &'a mut dyn FnMut(Vec<(usize, Outcome<Held>)>) -> ControlFlow<()>;

/// How one job of a batch ended. The state of its prediction is an `S`, as that of its job.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome<S = StateValues> {
    /// The prediction, or why there is none: the model's doing, or the limit of wall time. A failure of a place is never here.
    pub result: Result<Prediction<S>, Failure>,
    /// How often the job was started; depends on the workers and must not enter an estimate.
    pub attempts: u32,
    /// The worker that answered last.
    pub worker: String,
}

impl<S> Outcome<S> {
    /// The same outcome with its state as something else.
    ///
    /// # Errors
    /// What `change` says.
    pub fn try_map<T, E>(self, change: impl FnOnce(S) -> Result<T, E>) -> Result<Outcome<T>, E> {
        let Self { result, attempts, worker } = self;
        let result = match result {
            Ok(prediction) => Ok(prediction.try_map(change)?),
            Err(failure) => Err(failure),
        };
        Ok(Outcome { result, attempts, worker })
    }
}

/// Anything that runs batches of jobs. Same jobs, same results, whatever runs them.
pub trait Fleet {
    /// Makes a setup known, to be named in [`Fleet::run`] and [`Fleet::run_mixed`].
    ///
    /// # Errors
    /// [`FleetError::SetupFailed`] when it cannot be built or sent.
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError>;

    /// Runs jobs, each with a setup of its own choice, and returns one outcome per job, in job order.
    ///
    /// # Errors
    /// A failure of the fleet: cancelled, no workers, a setup that no worker can build, no place that can make the runs. A
    /// failure of the model is no error.
    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError>;

    /// Runs all jobs with one setup and returns one outcome per job, in job order.
    ///
    /// # Errors
    /// As [`Fleet::run_mixed`].
    fn run(&mut self, setup: SetupId, jobs: Vec<Job>) -> Result<Vec<Outcome>, FleetError> {
        self.run_mixed(jobs.into_iter().map(|job| (setup, job)).collect())
    }

    /// [`Fleet::run_mixed`] for jobs whose states, and those of the outcomes, may be in the fleet's store.
    ///
    /// # Errors
    /// As [`Fleet::run_mixed`], and when a state cannot be kept or read.
    fn run_held(&mut self, jobs: Vec<(SetupId, Job<Held>)>) -> Result<Vec<Outcome<Held>>, FleetError> {
        let jobs = jobs.into_iter().map(|(setup, job)| Ok((setup, job.try_map(Held::for_model)?)));
        let outcomes = self.run_mixed(jobs.collect::<Result<_, StateError>>()?)?;
        outcomes.into_iter().map(|outcome| outcome.try_map(|state| Ok(state.into()))).collect()
    }

    /// As [`Fleet::run_held`], and tells of outcomes while the batch goes on: every [`TELL_EVERY`], also when there are none, of
    /// those that were not told of before, and of the rest when it ends in an error. Of a batch that is over sooner nothing is told,
    /// and nothing by a fleet that runs in this process.
    ///
    /// # Errors
    /// As [`Fleet::run_held`]; [`FleetError::Cancelled`] when the caller breaks off.
    fn run_telling(
        &mut self,
        jobs: Vec<(SetupId, Job<Held>)>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome<Held>>, FleetError> {
        let _ = arrived;
        self.run_held(jobs)
    }

    /// The states after an analysis, made where the states are; `None` where the caller has to make them.
    ///
    /// # Errors
    /// When a state cannot be kept or read; [`FleetError::Cancelled`].
    fn recombine(&mut self, work: &Recombine<'_>) -> Result<Option<Vec<StoredState>>, FleetError> {
        let _ = work;
        Ok(None)
    }

    /// Where large states are kept; `None` for a fleet that takes all states as values.
    fn states(&self) -> Option<&StateStore> {
        None
    }

    /// Number of workers now.
    fn n_workers(&self) -> usize;

    /// Number of jobs that can run at the same time now.
    fn slots(&self) -> usize;
}
