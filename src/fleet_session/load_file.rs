//! How much work a command has, in a file beside its access file, for `starlings deploy watch`, which may run on another machine.
//!
//! It is written where the file stands already: a deployment whose number of workers follows the work has made it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use starlings_coordinator::fleet::{FleetHandle, Load};
use starlings_deploy::work::{Work, WorkerWork, path};

/// How often it is looked.
const LOOK: Duration = Duration::from_millis(100);

/// Looks between two writes. The largest amount of work among them is told: between two batches there is none for a moment.
const LOOKS: u64 = 10;

/// Writes the file until it is dropped, and then that the command has ended.
pub(super) struct LoadFile {
    stop: Option<Sender<()>>,
    writer: Option<JoinHandle<()>>,
}

impl LoadFile {
    /// Begins to write beside an access file; nothing where nobody asks for it.
    pub(super) fn beside(access: &Path, fleet: FleetHandle) -> Option<Self> {
        let path = path(access);
        if !path.is_file() {
            return None;
        }
        let (stop, stopped) = mpsc::channel();
        let mut looks = Looks { path, most: 0, worked: BTreeMap::new(), n: 0 };
        let writer = std::thread::spawn(move || {
            while stopped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                looks.look(&fleet.load(), Instant::now());
            }
            looks.write(&Work { ended: true, ..Work::default() });
        });
        Some(Self { stop: Some(stop), writer: Some(writer) })
    }
}

impl Drop for LoadFile {
    fn drop(&mut self) {
        self.stop.take();
        if let Some(writer) = self.writer.take() {
            // A panic in it has been printed already.
            let _ = writer.join();
        }
    }
}

/// What was seen since the last write.
struct Looks {
    path: PathBuf,
    /// The most unfinished runs.
    most: usize,
    /// When each worker was seen with something to do, or for the first time.
    worked: BTreeMap<String, Instant>,
    n: u64,
}

impl Looks {
    fn look(&mut self, load: &Load, now: Instant) {
        self.most = self.most.max(load.unfinished);
        self.worked.retain(|name, _| load.workers.iter().any(|worker| worker.name == *name));
        for worker in &load.workers {
            let worked = self.worked.entry(worker.name.clone()).or_insert(now);
            if worker.jobs > 0 {
                *worked = now;
            }
        }
        self.n += 1;
        if self.n.is_multiple_of(LOOKS) {
            let of_worker = |worker: &starlings_coordinator::fleet::WorkerLoad| WorkerWork {
                name: worker.name.clone(),
                slots: worker.slots,
                runs: worker.jobs,
                idle_s: self
                    .worked
                    .get(&worker.name)
                    .map_or(0, |worked| now.saturating_duration_since(*worked).as_secs()),
            };
            let workers = load.workers.iter().map(of_worker).collect();
            self.write(&Work { count: self.n, ended: false, unfinished: self.most, workers });
            self.most = 0;
        }
    }

    fn write(&self, work: &Work) {
        if let Err(error) = work.write(&self.path) {
            tracing::debug!(%error, path = %self.path.display(), "the amount of work is not written");
        }
    }
}
