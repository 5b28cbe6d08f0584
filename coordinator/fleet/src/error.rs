//! Why a fleet cannot run a batch.

use std::net::SocketAddr;
use std::path::PathBuf;

use starlings_proto::ProtocolError;
use starlings_states::StateError;

/// A failure of the fleet as a whole; a failed job is an [`super::Outcome`].
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {source}{}", remedy(source, *address))]
    Bind {
        /// The address asked for.
        address: SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
    /// The secrets of the run make no certificate.
    #[error("cannot listen with the secrets of this run: {0}")]
    Secrets(String),
    /// The run was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// No worker could take a job for too long.
    #[error("waited {waited:.0} s for a worker{}", waited_for(*address, *is_open, start.as_deref(), missing))]
    NoWorkers {
        /// Where workers can connect; `None` where only processes of this one work.
        address: Option<SocketAddr>,
        /// Whether whoever reaches the address is taken.
        is_open: bool,
        /// The command that starts a worker, where it was told.
        start: Option<String>,
        /// How long it was waited, seconds.
        waited: f64,
        /// What is missing.
        missing: String,
    },
    /// No worker can build the setup.
    #[error("the model cannot be built: {reason}")]
    SetupFailed {
        /// The workers' words.
        reason: String,
    },
    /// A job or a setup does not fit the protocol; for a state, the text says how large it may be.
    #[error(transparent)]
    TooLarge(ProtocolError),
    /// A setup that was never installed.
    #[error("the setup was not installed in this fleet")]
    UnknownSetup,
    /// The worker processes on this machine die again and again, or cannot start.
    #[error("the local workers cannot run: {0}")]
    LocalWorkers(String),
    /// A worker program that cannot be started.
    #[error("cannot start the worker program {}: {source}", program.display())]
    Spawn {
        /// The program.
        program: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Every place that could make the runs cannot, for too long.
    #[error(
        "no worker could run the model for {waited:.0} s: {reasons}; mend that, then continue with --resume"
    )]
    Unavailable {
        /// How long it was waited, seconds.
        waited: f64,
        /// Each worker with its reason.
        reasons: String,
    },
    /// A program ends abnormally, and no run is known to work that could tell whether the parameters or the host cause it.
    #[error(
        "the run of particle {particle} over record {record}{} ends abnormally wherever it is made, and no other run of that \
         window works: nobody can tell whether its parameters or the machines are at fault: {reason}\n  mend what it names, then \
         continue with --resume",
        in_brackets(parameters)
    )]
    NoControl {
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// Values of the parameters in physical units by name, as a list.
        parameters: String,
        /// How it ended last.
        reason: String,
    },
    /// A job has no answer, for another reason than a failure of the model.
    #[error("the run of particle {particle} over record {record} has no usable answer: {reason}")]
    NoAnswer {
        /// Index of the job among those that were to run.
        job: usize,
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// What happened.
        reason: String,
    },
    /// Workers give different results for the same run, and nobody could say which is right.
    #[error(
        "workers give different results for the run of particle {particle} over record {record}, and no third one could say which is \
         right: {workers}\n  start workers of one build on machines of one kind and continue with --resume, or allow differences with \
         --mixed"
    )]
    Disagreement {
        /// Index of the sigma point.
        particle: u32,
        /// Index of the record.
        record: u32,
        /// The workers with their builds, and a value in which they differ.
        workers: String,
    },
    /// A large state of a particle cannot be kept or read.
    #[error("{0}")]
    State(String),
    /// The network ended although nobody closed the fleet.
    #[error("the fleet's network stopped: {0}")]
    Stopped(String),
}

impl From<StateError> for FleetError {
    fn from(error: StateError) -> Self {
        Self::State(error.to_string())
    }
}

fn in_brackets(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(" ({text})") }
}

/// Where a worker was expected, what is missing, and what to do.
fn waited_for(address: Option<SocketAddr>, is_open: bool, start: Option<&str>, missing: &str) -> String {
    let Some(address) = address else { return format!(" on this machine: {missing}") };
    let start = match start {
        Some(start) => format!("`{start}`"),
        None if is_open => format!("`starlings worker --connect {address} --insecure`"),
        None => "`starlings worker --access FILE`, where FILE is this run's access file".to_owned(),
    };
    format!(
        " at {address}: {missing}; start one with {start}, or wait longer with `patience` under `[fleet]` of the study"
    )
}

fn remedy(source: &std::io::Error, address: SocketAddr) -> String {
    match source.kind() {
        std::io::ErrorKind::AddrInUse => {
            format!(
                "; port {} is taken by another process: stop it or choose another port (0 picks a free one)",
                address.port()
            )
        }
        std::io::ErrorKind::PermissionDenied => {
            "; ports below 1024 need privileges: choose a higher one".to_owned()
        }
        std::io::ErrorKind::AddrNotAvailable => {
            "; this machine has no such address: use 127.0.0.1 or 0.0.0.0".to_owned()
        }
        _ => String::new(),
    }
}
