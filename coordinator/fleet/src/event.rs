//! What happens in a fleet, for the store and the progress display. Only facts; nobody in the fleet reads them back.

use std::net::SocketAddr;

use serde::Serialize;

/// Something that happened in the fleet.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "event")]
pub enum FleetEvent {
    /// Workers can connect.
    Listening {
        /// Where.
        address: SocketAddr,
    },
    /// A worker is taken.
    WorkerJoined {
        /// Its name in this run.
        worker: String,
        /// Host name.
        host: String,
        /// Process number on that host.
        pid: u32,
        /// Jobs at the same time.
        slots: u32,
        /// Cores that it sees.
        cores: u32,
        /// BLAKE3 of its executable, hexadecimal; empty when unknown.
        build: String,
    },
    /// A worker of the same version runs another executable than the coordinator; told once per executable.
    OtherBuild {
        /// Its name.
        worker: String,
        /// Its host.
        host: String,
        /// BLAKE3 of its executable, hexadecimal.
        build: String,
        /// BLAKE3 of the coordinator's.
        own: String,
    },
    /// A worker sees the folder for states: they do not travel to it and from it.
    SharesStates {
        /// Its name.
        worker: String,
    },
    /// A worker is refused.
    WorkerRefused {
        /// Its host.
        host: String,
        /// Why, with the remedy.
        reason: String,
    },
    /// Callers have not proved themselves; told of the first of a kind, the tenth, the hundredth and so on.
    CallerRefused {
        /// Address of the last one.
        from: String,
        /// Why, with the remedy.
        reason: String,
        /// Callers so far that were refused for this reason.
        count: u64,
    },
    /// A worker is gone.
    WorkerLeft {
        /// Its name.
        worker: String,
        /// Why.
        reason: String,
        /// Jobs that go back to the queue.
        requeued: usize,
    },
    /// A worker cannot build the setup.
    SetupFailed {
        /// Its name.
        worker: String,
        /// Why.
        reason: String,
    },
    /// A worker is given no jobs for a while, since its place cannot make runs.
    WorkerSetAside {
        /// Its name.
        worker: String,
        /// Why.
        reason: String,
        /// For how long, seconds; then it is tried with one job.
        seconds: f64,
    },
    /// A worker that was set aside makes runs again.
    WorkerBack {
        /// Its name.
        worker: String,
    },
    /// A run that is known to work was made again where another one had failed twice.
    ControlRun {
        /// Index of the sigma point that failed.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// Where.
        worker: String,
        /// Why the known run failed there, where it did: then the place is at fault, and not the parameters.
        fault: Option<String>,
    },
    /// A job goes to a worker again.
    JobRetried {
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// Where the last attempt ended.
        worker: String,
        /// How it ended.
        reason: String,
    },
    /// A job is given up.
    JobFailed {
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// Values of the parameters by name, in physical units; empty where they are not known.
        parameters: Vec<(String, f64)>,
        /// Attempts made.
        attempts: u32,
        /// How the last one ended.
        reason: String,
    },
    /// A worker that was connected before brought along what it had done meanwhile.
    RunsBrought {
        /// Its name.
        worker: String,
        /// Runs that it had finished, which count.
        finished: usize,
        /// Runs that it still makes.
        computing: usize,
    },
    /// A worker gives other results than others do for the same job: it is put out.
    WorkerExcluded {
        /// Its name.
        worker: String,
        /// BLAKE3 of its executable, hexadecimal; empty when unknown.
        build: String,
        /// What it answered and what the others did.
        reason: String,
        /// Its runs of this batch that are made again.
        again: usize,
        /// Its runs of earlier batches, which were taken.
        earlier: u64,
    },
    /// Workers give different results for the same job, which was allowed.
    WorkersDiffer {
        /// The workers with their builds and a value in which they differ.
        what: String,
    },
    /// A solver outside gives other results when it is asked again: its runs are compared no more.
    NotReproducible {
        /// The workers with a value in which their runs differ.
        what: String,
    },
    /// A job that takes long was given to another worker too.
    JobDuplicated {
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// Who has had it.
        slow: String,
        /// Who got it too.
        worker: String,
    },
    /// Events that were not told one by one.
    Untold {
        /// Their kind.
        of: String,
        /// How many.
        count: u64,
        /// The last of them, in words.
        last: String,
    },
    /// An answer to a lease that has ended; ignored.
    LateAnswer {
        /// Who sent it.
        worker: String,
        /// Number of the job.
        job: u64,
    },
    /// A batch cannot go on.
    Waiting {
        /// For how long, seconds.
        seconds: f64,
        /// What is missing.
        missing: String,
    },
    /// How far the running batch is.
    Progress {
        /// Jobs with an outcome.
        done: usize,
        /// Jobs in the batch.
        total: usize,
    },
    /// A worker process on this machine died and is started again.
    LocalWorkerRestarted {
        /// Process number of the dead one.
        pid: u32,
        /// How it ended.
        reason: String,
    },
    /// A worker process on this machine died too often and is not started again.
    LocalWorkerGivenUp {
        /// Process number of the last one.
        pid: u32,
        /// Deaths in a row.
        deaths: u32,
        /// How the last one ended.
        reason: String,
    },
}
