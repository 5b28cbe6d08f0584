//! What TLS costs a study of short runs: the same batches over a connection with proof and over a plain one, in turns.

use std::process::{Child, Command};
use std::sync::mpsc;
use std::time::Duration;

use starlings_coordinator::fleet::access::Secrets;
use starlings_coordinator::fleet::{FleetConfig, FleetEvent, GrpcFleet};
use starlings_proto::access::AccessFile;
use tokio_util::sync::CancellationToken;

use crate::{Failure, PARTICLES, WORKERS, install, quantile, run};

/// Batches of one kind per turn, each as long as a cycle of a study.
const PER_TURN: usize = 5;

/// Medians of the wall times of cycles of runs of 10 ms, and of runs that take no time, ms.
pub(crate) struct Tls {
    /// Over a plain connection.
    pub(crate) plain: Cycles,
    /// With TLS.
    pub(crate) sealed: Cycles,
}

/// Medians over cycles, ms.
pub(crate) struct Cycles {
    /// Of runs of 10 ms.
    pub(crate) busy_ms: f64,
    /// Of runs that take no time.
    pub(crate) noop_ms: f64,
}

impl Tls {
    /// How much longer a cycle of runs of 10 ms takes with TLS, a fraction.
    pub(crate) fn cost(&self) -> f64 {
        self.sealed.busy_ms / self.plain.busy_ms - 1.0
    }
}

/// Ends a worker with the measurement.
struct Worker(Child);

impl Drop for Worker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A fleet that listens on loopback, with workers that dial it.
struct Side {
    fleet: GrpcFleet,
    _workers: Vec<Worker>,
    _folder: Option<tempfile::TempDir>,
    busy: Vec<Duration>,
    noop: Vec<Duration>,
}

impl Side {
    fn start(secrets: Option<Secrets>) -> Result<Self, Failure> {
        let (sender, events) = mpsc::channel();
        let any_port: std::net::SocketAddr = ([127, 0, 0, 1], 0).into();
        let mut config = FleetConfig::new(any_port, "bench", CancellationToken::new(), sender);
        config.secrets.clone_from(&secrets);
        let fleet = GrpcFleet::listen(config)?;
        let address = fleet.address().ok_or("it does not listen")?.to_string();
        let mut folder = None;
        let arguments = match secrets {
            None => ["--connect".to_owned(), address],
            Some(secrets) => {
                let own = tempfile::tempdir()?;
                let path = own.path().join("access.json");
                let token = secrets.token().clone();
                AccessFile::new("bench", vec![address], secrets.authority(), token).write(&path)?;
                folder = Some(own);
                ["--access".to_owned(), path.display().to_string()]
            }
        };
        let start = |_| Ok(Worker(Command::new(std::env::current_exe()?).args(&arguments).spawn()?));
        let workers = (0..WORKERS).map(start).collect::<Result<Vec<_>, Failure>>()?;
        for _ in 0..WORKERS {
            while !matches!(events.recv_timeout(Duration::from_secs(30))?, FleetEvent::WorkerJoined { .. }) {}
        }
        let mut side = Self { fleet, _workers: workers, _folder: folder, busy: vec![], noop: vec![] };
        side.turn()?;
        (side.busy, side.noop) = (vec![], vec![]);
        Ok(side)
    }

    fn turn(&mut self) -> Result<(), Failure> {
        let (noop, busy) = (install(&mut self.fleet, "bench-noop")?, install(&mut self.fleet, "bench-busy")?);
        for _ in 0..PER_TURN {
            self.busy.push(run(&mut self.fleet, busy, PARTICLES)?);
            for _ in 0..20 {
                self.noop.push(run(&mut self.fleet, noop, PARTICLES)?);
            }
        }
        Ok(())
    }

    fn medians(mut self) -> Cycles {
        self.busy.sort_unstable();
        self.noop.sort_unstable();
        self.fleet.close();
        Cycles { busy_ms: 1e3 * quantile(&self.busy, 0.5), noop_ms: 1e3 * quantile(&self.noop, 0.5) }
    }
}

/// Measures both in turns, so that what else the machine does falls on both.
pub(crate) fn measure(turns: usize) -> Result<Tls, Failure> {
    let (mut plain, mut sealed) = (Side::start(None)?, Side::start(Some(Secrets::draw()?))?);
    for _ in 0..turns {
        plain.turn()?;
        sealed.turn()?;
    }
    Ok(Tls { plain: plain.medians(), sealed: sealed.medians() })
}
