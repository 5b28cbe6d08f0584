//! Worker processes on this machine: starts them, starts a dead one again, ends them all.
//!
//! The standard input of each is its connection: one of a pair of sockets, which nobody else can reach; descriptors of memory for large
//! states come on a second pair. A worker ends by itself
//! when it closes, so none outlives this process, however it ends. Nothing is decided about jobs here: a dead worker's jobs are the dispatcher's business. Next file to read: `process`.

mod process;

use std::path::PathBuf;
use std::process::ExitStatus;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use process::Process;

use super::{FleetError, FleetEvent, FleetHandle};

/// How often the processes are looked at.
const LOOK: Duration = Duration::from_millis(50);

/// A process that lived this long was healthy: its next death counts as the first.
const HEALTHY: Duration = Duration::from_secs(10);

/// How many more deaths in a row, each before [`HEALTHY`], give a process up than losses give a job up: a job that kills its
/// workers must end before its last worker does.
const EXTRA_DEATHS: u32 = 3;

/// Wait before the first restart; doubled for each later one in a row, up to [`LONGEST_WAIT`].
const FIRST_WAIT: Duration = Duration::from_millis(100);

/// Longest wait before a restart.
const LONGEST_WAIT: Duration = Duration::from_millis(500);

/// How long processes may take to leave when asked, before they are killed.
const LEAVE_PATIENCE: Duration = Duration::from_secs(2);

/// What to start and for whom.
#[derive(Clone)]
pub struct LocalConfig {
    /// The program, usually this one.
    pub program: PathBuf,
    /// Its first arguments, such as `worker --slots 1`; `--connect stdin --place I` follow, the
    /// last with the process's place among the `n`, which the one that is started after it keeps.
    pub args: Vec<String>,
    /// How many processes.
    pub n: usize,
    /// The fleet to tell when they die.
    pub fleet: FleetHandle,
}

/// Supervised worker processes; dropping ends them all and waits for them.
pub struct LocalWorkers {
    stop: Sender<()>,
    supervisor: Option<JoinHandle<()>>,
    pids: Arc<Mutex<Vec<u32>>>,
}

impl LocalWorkers {
    /// Tells the fleet that it has no other workers, starts the processes and a thread that keeps them alive. Processes that die at once, again and again, end the
    /// fleet's wait with [`FleetError::LocalWorkers`] and their last words.
    ///
    /// # Errors
    /// [`FleetError::Spawn`] when the program cannot be started.
    pub fn spawn(config: LocalConfig) -> Result<Self, FleetError> {
        config.fleet.local_only();
        let slots = (0..config.n).map(|place| Slot::start(&config, place)).collect::<Result<Vec<_>, _>>()?;
        let pids = Arc::new(Mutex::new(pids(&slots)));
        let (stop, stopped) = mpsc::channel();
        let shared = Arc::clone(&pids);
        let supervisor = std::thread::Builder::new()
            .name("local-workers".to_owned())
            .spawn(move || supervise(&config, slots, &stopped, &shared))
            .map_err(|e| FleetError::LocalWorkers(e.to_string()))?;
        Ok(Self { stop, supervisor: Some(supervisor), pids })
    }

    /// Process numbers of the living workers.
    pub fn pids(&self) -> Vec<u32> {
        self.pids.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for LocalWorkers {
    fn drop(&mut self) {
        let _ = self.stop.send(());
        if let Some(supervisor) = self.supervisor.take() {
            let _ = supervisor.join();
        }
    }
}

/// The place of one process.
struct Slot {
    place: usize,
    process: Option<Process>,
    deaths: u32,
    restart_at: Option<Instant>,
    last_pid: u32,
    last_words: String,
}

impl Slot {
    fn start(config: &LocalConfig, place: usize) -> Result<Self, FleetError> {
        let process = Process::start(config, place)?;
        let last_pid = process.pid();
        Ok(Self {
            place,
            process: Some(process),
            deaths: 0,
            restart_at: None,
            last_pid,
            last_words: String::new(),
        })
    }

    /// Looks after the process; true when it changed.
    fn look(&mut self, config: &LocalConfig, now: Instant) -> bool {
        if let Some(process) = &mut self.process {
            let Some(status) = process.ended() else { return false };
            self.bury(config, status, now);
            return true;
        }
        if self.restart_at.is_some_and(|at| at <= now) {
            self.restart_at = None;
            match Process::start(config, self.place) {
                Ok(process) => {
                    let (pid, reason) = (self.last_pid, self.last_words.clone());
                    config.fleet.tell(FleetEvent::LocalWorkerRestarted { pid, reason });
                    self.last_pid = process.pid();
                    self.process = Some(process);
                }
                // The system may have a place for it later.
                Err(error) => {
                    self.last_words = error.to_string();
                    self.died(config, now);
                }
            }
            return true;
        }
        false
    }

    fn bury(&mut self, config: &LocalConfig, status: ExitStatus, now: Instant) {
        let Some(process) = self.process.take() else { return };
        if process.lived(now) >= HEALTHY {
            self.deaths = 0;
        }
        self.last_words = process.last_words(status);
        self.died(config, now);
    }

    /// Counts one more death, or start in vain, and says when to start again, if at all.
    fn died(&mut self, config: &LocalConfig, now: Instant) {
        self.deaths += 1;
        if self.deaths < config.fleet.max_attempts().saturating_add(EXTRA_DEATHS) {
            let wait = FIRST_WAIT.saturating_mul(2_u32.saturating_pow(self.deaths - 1)).min(LONGEST_WAIT);
            self.restart_at = Some(now + wait);
        } else {
            self.tell_given_up(config);
        }
    }

    fn tell_given_up(&self, config: &LocalConfig) {
        let (pid, deaths, reason) = (self.last_pid, self.deaths, self.last_words.clone());
        config.fleet.tell(FleetEvent::LocalWorkerGivenUp { pid, deaths, reason });
    }

    fn given_up(&self) -> bool {
        self.process.is_none() && self.restart_at.is_none()
    }
}

fn pids(slots: &[Slot]) -> Vec<u32> {
    slots.iter().filter_map(|slot| Some(slot.process.as_ref()?.pid())).collect()
}

fn supervise(
    config: &LocalConfig,
    mut slots: Vec<Slot>,
    stopped: &mpsc::Receiver<()>,
    shared: &Mutex<Vec<u32>>,
) {
    let mut told = false;
    while stopped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
        let now = Instant::now();
        let mut changed = false;
        for slot in &mut slots {
            changed |= slot.look(config, now);
        }
        if changed {
            *shared.lock().unwrap_or_else(PoisonError::into_inner) = pids(&slots);
        }
        if !told && !slots.is_empty() && slots.iter().all(Slot::given_up) {
            told = true;
            let last = slots.iter().find(|slot| !slot.last_words.is_empty());
            let (deaths, words) = last.map_or((0, ""), |slot| (slot.deaths, slot.last_words.as_str()));
            config
                .fleet
                .give_up(format!("each died again and again ({deaths} times in a row), last with {words}"));
        }
    }
    config.fleet.dismiss(&pids(&slots));
    end_all(&mut slots);
}

/// Waits for the dismissed processes to leave; dropping the slots kills those that do not.
fn end_all(slots: &mut [Slot]) {
    let deadline = Instant::now() + LEAVE_PATIENCE;
    let mut alive = slots.iter_mut().filter_map(|s| s.process.as_mut()).collect::<Vec<_>>();
    while !alive.is_empty() && Instant::now() < deadline {
        alive.retain_mut(|process| process.ended().is_none());
        if !alive.is_empty() {
            std::thread::sleep(LOOK / 10);
        }
    }
}
