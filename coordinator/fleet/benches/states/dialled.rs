//! The same states over a network: to workers that dial the loopback address, plainly and inside TLS, in turns, so that whatever
//! else the machine does meets both alike. The processor time of both is told too, which says what TLS costs on a machine that is busy.

use std::net::Ipv4Addr;
use std::process::{Child, Command};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use starlings_fleet::access::Secrets;
use starlings_fleet::{FleetConfig, FleetEvent, GrpcFleet, StateStore};
use starlings_proto::access::AccessFile;

use super::{Failure, There, WORKERS, config};

/// What was measured of one way.
pub(super) struct Measured {
    /// Wall times of cycles, fastest first.
    pub(super) walls: Vec<Duration>,
    /// Processor time of coordinator and workers in these cycles.
    pub(super) seconds: f64,
}

/// Cycles plainly and inside TLS, in turns.
pub(super) fn compared(cycles: usize) -> Result<[Measured; 2], Failure> {
    let mut ways = [Way::begin(false)?, Way::begin(true)?];
    for way in &mut ways {
        // The first one warms up.
        way.there.cycle()?;
    }
    let before = [ways[0].workers.seconds()?, ways[1].workers.seconds()?];
    for _ in 0..cycles {
        ways.iter_mut().try_for_each(Way::cycle)?;
    }
    let [plain, tls] = ways;
    Ok([plain.end(before[0])?, tls.end(before[1])?])
}

/// One way in the midst of its cycles.
struct Way {
    there: There,
    workers: Dialled,
    measured: Measured,
}

impl Way {
    fn begin(tls: bool) -> Result<Self, Failure> {
        let store = StateStore::new(usize::MAX);
        let (config, events) = config(&store);
        let (fleet, workers) = fleet(config, &events, tls)?;
        let measured = Measured { walls: Vec::new(), seconds: 0.0 };
        Ok(Self { there: There::begin(fleet, &store)?, workers, measured })
    }

    fn cycle(&mut self) -> Result<(), Failure> {
        let before = own_seconds();
        self.measured.walls.push(self.there.cycle()?);
        self.measured.seconds += own_seconds() - before;
        Ok(())
    }

    /// With the time of its workers since they had computed for so many seconds.
    fn end(mut self, before: f64) -> Result<Measured, Failure> {
        self.measured.seconds += self.workers.seconds()? - before;
        self.measured.walls.sort_unstable();
        drop(self.workers);
        self.there.end()?;
        Ok(self.measured)
    }
}

/// Processor time of this process.
fn own_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Workers that dialled; dropping ends them.
pub(super) struct Dialled {
    processes: Vec<Child>,
    _access: Option<tempfile::TempDir>,
}

impl Dialled {
    /// Processor time of all of them: user and system, in ticks of a hundredth of a second (proc_pid_stat(5)).
    fn seconds(&self) -> Result<f64, Failure> {
        let of = |process: &Child| {
            let text = std::fs::read_to_string(format!("/proc/{}/stat", process.id()))?;
            let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace();
            // The third field of all is the first one after the name.
            let ticks = fields.skip(14 - 3).take(2).map(str::parse::<u64>).sum::<Result<u64, _>>()?;
            Ok(ticks as f64 / 100.0)
        };
        self.processes.iter().map(of).sum()
    }
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
fn fleet(
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
