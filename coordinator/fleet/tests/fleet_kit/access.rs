//! Fleets that ask for proof, their access files, and callers that have none.

use std::net::{SocketAddr, TcpStream};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

use starlings_fleet::access::Secrets;
use starlings_fleet::{FleetConfig, FleetEvent, GrpcFleet};
use starlings_proto::access::{AccessFile, Token};
use starlings_worker::{WorkerConfig, WorkerError, WorkerReport};
use tokio_util::sync::CancellationToken;

use super::{ThreadWorker, any_port, factory, square};

/// A name that nobody without the token may learn.
pub const RUN: &str = "the-name-of-a-secret-run";

/// A fleet that asks for proof.
pub struct Guarded {
    pub fleet: GrpcFleet,
    pub events: Receiver<FleetEvent>,
    pub secrets: Secrets,
    pub address: SocketAddr,
}

impl Guarded {
    pub fn new() -> Self {
        Self::with(Secrets::draw().unwrap())
    }

    pub fn with(secrets: Secrets) -> Self {
        let (sender, events) = mpsc::channel();
        let mut config = FleetConfig::new(any_port(), RUN, CancellationToken::new(), sender);
        config.patience = Duration::from_secs(60);
        config.secrets = Some(secrets.clone());
        let fleet = GrpcFleet::listen(config).unwrap();
        let address = fleet.address().unwrap();
        Self { fleet, events, secrets, address }
    }

    /// What happened until now: nothing of it is joining.
    pub fn assert_nobody_joined(&self) -> Vec<FleetEvent> {
        let events: Vec<_> = self.events.try_iter().collect();
        for event in &events {
            assert!(
                !matches!(event, FleetEvent::WorkerJoined { .. } | FleetEvent::WorkerRefused { .. }),
                "{event:?}"
            );
        }
        events
    }

    /// Waits for a refusal whose reason holds these words.
    pub fn await_refusal(&self, words: &str) {
        super::await_event(
            &self.events,
            |event| matches!(event, FleetEvent::CallerRefused { reason, .. } if reason.contains(words)),
        );
    }
}

/// A folder with an access file.
pub struct File {
    pub folder: tempfile::TempDir,
    pub path: PathBuf,
}

impl File {
    pub fn of(secrets: &Secrets, address: SocketAddr) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("access.json");
        let file = Self { folder, path };
        file.write(secrets, address);
        file
    }

    pub fn write(&self, secrets: &Secrets, address: SocketAddr) {
        self.write_with(secrets.authority(), secrets.token().clone(), address, false);
    }

    pub fn write_with(&self, authority: &str, token: Token, address: SocketAddr, ended: bool) {
        let mut file = AccessFile::new(RUN, vec![address.to_string()], authority, token);
        file.ended = ended;
        file.write(&self.path).unwrap();
    }

    /// A worker on a thread that has this file.
    pub fn worker(&self, change: impl FnOnce(&mut WorkerConfig)) -> ThreadWorker {
        let path = self.path.clone();
        let run = factory(|job| Ok(square(job)));
        ThreadWorker::start_with(any_port(), run, move |config| {
            config.connect = String::new();
            config.access = Some(path);
            change(config);
        })
    }

    /// How a worker ends that tries once.
    pub fn tried(&self) -> Result<WorkerReport, WorkerError> {
        self.worker(|config| config.patience = Duration::ZERO).end()
    }
}

/// A connection of somebody who waits for an answer for half a minute at most.
pub fn raw(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    stream
}

/// Whether bytes hold a text.
pub fn holds(bytes: &[u8], text: &str) -> bool {
    bytes.windows(text.len()).any(|window| window == text.as_bytes())
}
