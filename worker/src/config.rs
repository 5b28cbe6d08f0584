//! What a worker is told when it starts.

use std::hash::{BuildHasher, Hasher};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use starlings_models::{BuildSetup, Factory, Setup};
use starlings_pieces::PlaceName;
use starlings_proto::host::host_name;
use starlings_proto::{Hello, PROTOCOL, VERSION, own_build};
use starlings_sums::Reading;
use starlings_traces::Traces;
use tokio_util::sync::CancellationToken;

use crate::held::HoldLimits;
use crate::news::Tell;

/// What a worker is told when it starts.
#[derive(Clone)]
pub struct WorkerConfig {
    /// The coordinator, `host:port`, or [`starlings_proto::INHERITED`] for the standard input, which is served once.
    pub connect: String,
    /// The access file: what proves the coordinator and this worker to each other, and the addresses to dial where `connect` is
    /// empty. Without it the connection is plain and whoever answers is taken for the coordinator.
    pub access: Option<PathBuf>,
    /// Stay when a run is over and serve the next command that writes the access file, for as long without work.
    pub stay: Option<Duration>,
    /// Jobs at the same time, at least 1, at most [`starlings_proto::MAX_SLOTS`].
    pub slots: usize,
    /// End when the coordinator's connection closes, instead of dialling again. A coordinator that is silent while the connection
    /// stands, as when it is stopped, is waited for.
    pub once: bool,
    /// How long to dial without an answer before giving up.
    pub patience: Duration,
    /// Ends the worker: it says goodbye and its jobs go elsewhere.
    pub cancel: CancellationToken,
    /// Makes what runs jobs; [`Setup::build`] unless replaced.
    pub factory: Factory,
    /// Host name told to the coordinator.
    pub host: String,
    /// BLAKE3 of the executable told to the coordinator; `None` when unknown.
    pub build: Option<[u8; 32]>,
    /// How much of what it has computed it holds while nobody is connected.
    pub hold: HoldLimits,
    /// The folder for what does not fit into memory.
    pub scratch: PathBuf,
    /// The folder for states that machines share, as this machine sees it; used where the coordinator's is the same.
    pub states: Option<PlaceName>,
    /// Where spans of runs go, of those that belong in a trace.
    pub traces: Option<Traces>,
    /// Whether recordings that a setup names are read here; only where the coordinator has this user's rights anyway.
    pub reading: Reading,
    /// Takes news for whoever watches.
    pub tell: Tell,
}

impl WorkerConfig {
    /// One slot, native models, a minute of patience, and what this machine says of itself.
    pub fn new(connect: impl Into<String>) -> Self {
        Self {
            connect: connect.into(),
            access: None,
            stay: None,
            slots: 1,
            once: false,
            patience: Duration::from_secs(60),
            cancel: CancellationToken::new(),
            factory: Arc::new(Setup::build),
            host: host_name().unwrap_or_else(|| "unknown-host".to_owned()),
            build: own_build(),
            hold: HoldLimits::default(),
            scratch: std::env::temp_dir(),
            states: None,
            traces: None,
            reading: Reading::Refused,
            tell: Arc::new(|_| {}),
        }
    }

    pub(crate) fn hello(&self) -> Hello {
        Hello {
            protocol: PROTOCOL,
            version: VERSION.to_owned(),
            cores: std::thread::available_parallelism().map_or(1, |n| n.get() as u32),
            slots: self.slots.max(1) as u32,
            host: self.host.clone(),
            pid: std::process::id(),
            nonce: std::hash::RandomState::new().build_hasher().finish(),
            build: self.build,
        }
    }
}
