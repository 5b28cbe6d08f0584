//! What the dispatcher hears and what it asks for.

use std::time::Duration;

use starlings_proto::{Lease, LeaseOutcome, SetupId};
use starlings_states::hex;

use crate::FleetEvent;
use crate::job_name::JobName;
use crate::wire::Outcome;

/// Number of a worker's stream: the epoch of its leases. A process that connects again gets a new one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct WorkerId(pub u64);

/// A worker that asks to be taken.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Joining {
    /// Number of its stream.
    pub id: WorkerId,
    /// Its name in events and outcomes.
    pub name: String,
    /// Host name.
    pub host: String,
    /// Process number on that host.
    pub pid: u32,
    /// Jobs at the same time, at least 1.
    pub slots: u32,
    /// Cores that it sees.
    pub cores: u32,
    /// Drawn once per process.
    pub nonce: u64,
    /// BLAKE3 of its executable.
    pub build: Option<[u8; 32]>,
}

impl Joining {
    pub(super) fn notice(&self) -> FleetEvent {
        let build = self.build.map_or_else(String::new, |hash| hex(&hash));
        FleetEvent::WorkerJoined {
            worker: self.name.clone(),
            host: self.host.clone(),
            pid: self.pid,
            slots: self.slots,
            cores: self.cores,
            build,
        }
    }
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Event {
    /// A worker connected and was taken.
    Joined(Joining),
    /// A worker's stream ended. Clean: it said goodbye.
    Left {
        /// Which.
        worker: WorkerId,
        /// Why.
        reason: String,
        /// Whether it left on purpose.
        clean: bool,
    },
    /// A sign of life.
    Heard {
        /// From whom.
        worker: WorkerId,
    },
    /// A worker built a setup.
    SetupDone {
        /// Which worker.
        worker: WorkerId,
        /// Which setup.
        setup: SetupId,
    },
    /// A worker could not build a setup, or has forgotten one that it had built.
    SetupFailed {
        /// Which worker.
        worker: WorkerId,
        /// Which setup.
        setup: SetupId,
        /// Its words.
        reason: String,
    },
    /// A batch to run; one still running is cancelled.
    Submit {
        /// The setup that each job needs, and what it is called.
        jobs: Vec<(SetupId, JobName)>,
    },
    /// A worker answered a lease.
    Answered {
        /// Which worker.
        worker: WorkerId,
        /// Under which lease.
        lease: Lease,
        /// What.
        answer: LeaseOutcome,
        /// Wall time of the run, seconds.
        cost: f64,
    },
    /// How runs of a setup are to be compared; to the last bit where nothing was said.
    Likeness {
        /// The setup.
        setup: SetupId,
        /// How alike its runs are.
        likeness: Likeness,
    },
    /// All workers are processes of this machine, started from one program: what one of them cannot build, none can.
    LocalOnly,
    /// Time passed.
    Tick,
    /// The batch must end with this error.
    Abort(BatchError),
}

/// How alike two runs of one job are on two workers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Likeness {
    /// To the last bit: the model is computed by the worker itself.
    Exact,
    /// To the last bit as far as the program outside keeps what it says of itself.
    Promised,
    /// Runs may differ, so none is repeated.
    None,
}

/// Why a batch ended without outcomes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BatchError {
    /// Nobody wants it any more.
    Cancelled,
    /// No worker could take a job for too long.
    NoWorkers {
        /// How long.
        waited: Duration,
        /// What is missing.
        missing: String,
    },
    /// No worker can build the setup.
    SetupFailed {
        /// The workers' words.
        reason: String,
    },
    /// The worker processes on this machine cannot run.
    LocalWorkers(String),
    /// The network ended although nobody closed the fleet.
    Stopped(String),
    /// A state cannot be kept or read: why.
    State(String),
    /// Every worker that could take a job was set aside for too long.
    Unavailable {
        /// How long.
        waited: Duration,
        /// Each with its reason.
        reasons: String,
    },
    /// A program ends abnormally on every attempt, and no run is known to work that could tell whether the parameters or the host cause it.
    NoControl {
        /// Index of the job in the batch.
        index: usize,
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// Its parameters as a list, for whoever holds the jobs to fill in.
        parameters: String,
        /// How it ended last.
        reason: String,
    },
    /// Workers give different results for one job, and nobody is left who could say which is right.
    Disagreement {
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// The workers with their builds and a value in which they differ.
        workers: String,
    },
    /// A job has no answer, and not by the model's doing: it was lost with worker after worker, or does not fit the model.
    NoAnswer {
        /// Index of the job in the batch.
        index: usize,
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// What happened.
        reason: String,
    },
}

/// A run that is known to work, by the place in which it is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ControlId(pub u64);

/// Something to do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// Send a setup.
    SendSetup {
        /// To whom.
        worker: WorkerId,
        /// Which.
        setup: SetupId,
    },
    /// Send a job of the running batch.
    SendJob {
        /// To whom.
        worker: WorkerId,
        /// Under which lease.
        lease: Lease,
        /// Index of the job in the batch.
        index: usize,
    },
    /// Keep a copy of a job of the running batch: it is known to work.
    Keep {
        /// As what.
        control: ControlId,
        /// Index of the job in the batch.
        index: usize,
    },
    /// A kept job is of no more use.
    Forget {
        /// Which.
        control: ControlId,
    },
    /// Send a kept job, under the lease of the job that failed.
    SendControl {
        /// To whom.
        worker: WorkerId,
        /// Under which lease.
        lease: Lease,
        /// Which.
        control: ControlId,
    },
    /// Withdraw jobs.
    Cancel {
        /// From whom.
        worker: WorkerId,
        /// Which.
        leases: Vec<Lease>,
        /// Also those that are being computed; only those that have not started otherwise.
        stop: bool,
    },
    /// Put a worker out, and take its process no more.
    PutOut {
        /// Whom.
        worker: WorkerId,
        /// Why: told to it.
        reason: String,
    },
    /// End a worker's stream.
    Close {
        /// Whose.
        worker: WorkerId,
    },
    /// The batch ended: one outcome per job, in job order.
    BatchDone(Vec<Outcome>),
    /// The batch ended without outcomes.
    BatchFailed(BatchError),
    /// Something worth telling.
    Notice(FleetEvent),
    /// A job is given up, which is worth telling together with its parameters.
    GivenUp {
        /// Index of the job in the batch.
        index: usize,
        /// [`FleetEvent::JobFailed`] without parameters.
        notice: FleetEvent,
    },
}
