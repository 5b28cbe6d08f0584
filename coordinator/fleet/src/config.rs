//! What a fleet is told when it starts.
//!
//! Next file to read: [`super::grpc`].

use std::net::SocketAddr;
use std::sync::mpsc::Sender;
use std::time::Duration;

use starlings_proto::own_build;
use tokio_util::sync::CancellationToken;

use super::access::Secrets;
use super::identity::RunIdentity;
use super::run_traces::RunTraces;
use super::{FleetEvent, StateStore};

/// How a fleet listens and when it loses patience.
#[derive(Clone, Debug)]
pub struct FleetConfig {
    /// Where to listen, port 0 picks a free one; `None`: nowhere, for a fleet of processes that this one starts.
    pub address: Option<SocketAddr>,
    /// What proves this coordinator to workers and workers to it where it listens; without it, connections are plain and whoever
    /// reaches the address is taken.
    pub secrets: Option<Secrets>,
    /// Name of the run, told to workers.
    pub run_name: String,
    /// Time between heartbeats; a worker that is silent for two of them is lost.
    pub heartbeat: Duration,
    /// How long a batch waits without any usable worker before it is an error.
    pub patience: Duration,
    /// How many workers may be lost under one job before it is given up.
    pub max_attempts: u32,
    /// The run: workers of an earlier start of it bring along what they have done.
    pub identity: RunIdentity,
    /// How results of workers are compared: what draws the runs that are repeated, the study's seed.
    pub seed: u64,
    /// Whether workers whose results differ are allowed, and only told of.
    pub mixed: bool,
    /// A run that takes so many times the usual time is given up as a timeout; none is without it.
    pub timeout_factor: Option<f64>,
    /// BLAKE3 of this executable: a worker of another one is told of. `None`: none is.
    pub build: Option<[u8; 32]>,
    /// Ends [`super::Fleet::run`] promptly with [`super::FleetError::Cancelled`].
    pub cancel: CancellationToken,
    /// Where events go.
    pub events: Sender<FleetEvent>,
    /// Where spans of runs go, below one of the caller's.
    pub traces: Option<RunTraces>,
    /// Where states are kept that are too large to travel inside a message.
    pub states: StateStore,
}

impl FleetConfig {
    /// The usual numbers: heartbeat 8 s, patience 5 minutes, five losses per job.
    pub fn new(
        address: impl Into<Option<SocketAddr>>,
        run_name: &str,
        cancel: CancellationToken,
        events: Sender<FleetEvent>,
    ) -> Self {
        Self {
            address: address.into(),
            secrets: None,
            run_name: run_name.to_owned(),
            heartbeat: Duration::from_secs(8),
            patience: Duration::from_secs(300),
            max_attempts: 5,
            identity: RunIdentity::new(),
            seed: 0,
            mixed: false,
            timeout_factor: None,
            build: own_build(),
            cancel,
            events,
            traces: None,
            states: StateStore::new(StateStore::MEMORY),
        }
    }
}
