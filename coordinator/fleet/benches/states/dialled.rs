//! The same states over a network: to workers that dial the loopback address, plainly and inside TLS.

use std::net::Ipv4Addr;
use std::process::{Child, Command};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use starlings_fleet::access::Secrets;
use starlings_fleet::{FleetConfig, FleetEvent, GrpcFleet};
use starlings_proto::access::AccessFile;

use super::{Failure, WORKERS};

/// Workers that dialled; dropping ends them.
pub(super) struct Dialled {
    processes: Vec<Child>,
    _access: Option<tempfile::TempDir>,
}

impl Drop for Dialled {
    fn drop(&mut self) {
        for process in &mut self.processes {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// A fleet that listens, and its workers.
pub(super) fn fleet(
    mut config: FleetConfig,
    events: &Receiver<FleetEvent>,
    tls: bool,
) -> Result<(GrpcFleet, Dialled), Failure> {
    config.address = Some((Ipv4Addr::LOCALHOST, 0).into());
    let secrets = if tls { Some(Secrets::draw()?) } else { None };
    config.secrets.clone_from(&secrets);
    let fleet = GrpcFleet::listen(config)?;
    let address = fleet.address().ok_or("it listens")?.to_string();
    let mut command = Command::new(std::env::current_exe()?);
    let mut access = None;
    if let Some(secrets) = &secrets {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("access.json");
        AccessFile::new("bench", vec![address], secrets.authority(), secrets.token().clone()).write(&file)?;
        command.arg("--access").arg(file);
        access = Some(folder);
    } else {
        command.args(["--connect", &address]);
    }
    let processes = (0..WORKERS).map(|_| command.spawn()).collect::<Result<Vec<_>, _>>()?;
    let workers = Dialled { processes, _access: access };
    for _ in 0..WORKERS {
        let is_here = |event: &FleetEvent| matches!(event, FleetEvent::WorkerJoined { .. });
        while !is_here(&events.recv_timeout(Duration::from_secs(30))?) {}
    }
    Ok((fleet, workers))
}
