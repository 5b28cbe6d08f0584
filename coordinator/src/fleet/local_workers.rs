//! Worker processes on this machine: starts them, starts a dead one again, ends them all.
//!
//! A worker ends by itself when its connection closes, so none outlives this process, however it ends. Nothing is decided
//! about jobs here: a dead worker's jobs are the dispatcher's business.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::{FleetError, FleetEvent, FleetHandle};

/// How often the processes are looked at.
const LOOK: Duration = Duration::from_millis(50);

/// A process that lived this long was healthy: its next death counts as the first.
const HEALTHY: Duration = Duration::from_secs(10);

/// Deaths in a row, each before [`HEALTHY`], after which a process is given up.
const MAX_DEATHS: u32 = 5;

/// Wait before the first restart; doubled for each later one in a row.
const FIRST_WAIT: Duration = Duration::from_millis(100);

/// How long processes may take to leave when asked, before they are killed.
const LEAVE_PATIENCE: Duration = Duration::from_secs(2);

/// Lines of standard error kept per process.
const TAIL: usize = 20;

/// What to start and for whom.
#[derive(Clone)]
pub struct LocalConfig {
    /// The program, usually this one.
    pub program: PathBuf,
    /// Its first arguments, such as `worker --slots 1`; `--connect ADDRESS --once` follow.
    pub args: Vec<String>,
    /// How many processes.
    pub n: usize,
    /// Where they connect.
    pub address: SocketAddr,
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
    /// Starts the processes and a thread that keeps them alive. Processes that die at once, again and again, end the
    /// fleet's wait with [`FleetError::LocalWorkers`] and their last words.
    ///
    /// # Errors
    /// [`FleetError::Spawn`] when the program cannot be started.
    pub fn spawn(config: LocalConfig) -> Result<Self, FleetError> {
        let slots = (0..config.n).map(|_| Slot::start(&config)).collect::<Result<Vec<_>, _>>()?;
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
    process: Option<Process>,
    deaths: u32,
    restart_at: Option<Instant>,
    last_words: String,
}

struct Process {
    child: Child,
    started: Instant,
    stderr: Option<JoinHandle<()>>,
    tail: Arc<Mutex<VecDeque<String>>>,
}

impl Slot {
    fn start(config: &LocalConfig) -> Result<Self, FleetError> {
        let process = Process::start(config)?;
        Ok(Self { process: Some(process), deaths: 0, restart_at: None, last_words: String::new() })
    }

    /// Looks after the process; true when it changed.
    fn look(&mut self, config: &LocalConfig, now: Instant) -> bool {
        if let Some(process) = &mut self.process {
            let Ok(Some(status)) = process.child.try_wait() else { return false };
            self.bury(config, status, now);
            return true;
        }
        if self.restart_at.is_some_and(|at| at <= now) {
            self.restart_at = None;
            match Process::start(config) {
                Ok(process) => self.process = Some(process),
                Err(error) => {
                    self.deaths = MAX_DEATHS;
                    self.last_words = error.to_string();
                }
            }
            return true;
        }
        false
    }

    fn bury(&mut self, config: &LocalConfig, status: ExitStatus, now: Instant) {
        let Some(process) = self.process.take() else { return };
        let pid = process.child.id();
        self.deaths = if now - process.started >= HEALTHY { 1 } else { self.deaths + 1 };
        self.last_words = process.last_words(status);
        if self.deaths < MAX_DEATHS {
            self.restart_at = Some(now + FIRST_WAIT * 2_u32.pow(self.deaths - 1));
            config.fleet.tell(FleetEvent::LocalWorkerRestarted { pid, reason: self.last_words.clone() });
        }
    }

    fn given_up(&self) -> bool {
        self.process.is_none() && self.restart_at.is_none()
    }
}

impl Process {
    fn start(config: &LocalConfig) -> Result<Self, FleetError> {
        let mut command = Command::new(&config.program);
        command.args(&config.args).args(["--connect", &config.address.to_string(), "--once"]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        // A group of its own: an interrupt on the terminal reaches the coordinator only, which ends the workers in order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let spawn = |source| FleetError::Spawn { program: Path::new(&config.program).to_owned(), source };
        let mut child = command.spawn().map_err(spawn)?;
        let tail = Arc::new(Mutex::new(VecDeque::new()));
        let stderr = child.stderr.take().map(|pipe| {
            let tail = Arc::clone(&tail);
            std::thread::spawn(move || keep_tail(BufReader::new(pipe), &tail))
        });
        Ok(Self { child, started: Instant::now(), stderr, tail })
    }

    fn last_words(self, status: ExitStatus) -> String {
        // A grandchild may hold the pipe open: give the reader a moment, not for ever.
        if let Some(reader) = self.stderr {
            let patience = Instant::now() + LOOK;
            while !reader.is_finished() && Instant::now() < patience {
                std::thread::yield_now();
            }
        }
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let lines = tail.iter().map(String::as_str).collect::<Vec<_>>().join("\n");
        if lines.is_empty() { status.to_string() } else { format!("{status}\n{lines}") }
    }
}

fn keep_tail(lines: impl BufRead, tail: &Mutex<VecDeque<String>>) {
    for line in lines.lines().map_while(Result::ok) {
        tracing::debug!(line, "worker");
        let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
        if tail.len() == TAIL {
            tail.pop_front();
        }
        tail.push_back(line);
    }
}

fn pids(slots: &[Slot]) -> Vec<u32> {
    slots.iter().filter_map(|slot| Some(slot.process.as_ref()?.child.id())).collect()
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
            let words =
                slots.iter().map(|s| s.last_words.as_str()).find(|w| !w.is_empty()).unwrap_or_default();
            config.fleet.give_up(format!("each died {MAX_DEATHS} times in a row, last with {words}"));
        }
    }
    config.fleet.dismiss(&pids(&slots));
    end_all(&mut slots);
}

/// Waits for the dismissed processes to leave, and kills those that do not.
fn end_all(slots: &mut [Slot]) {
    let deadline = Instant::now() + LEAVE_PATIENCE;
    let mut alive = slots.iter_mut().filter_map(|s| s.process.as_mut()).collect::<Vec<_>>();
    while !alive.is_empty() && Instant::now() < deadline {
        alive.retain_mut(|process| matches!(process.child.try_wait(), Ok(None)));
        if !alive.is_empty() {
            std::thread::sleep(LOOK / 10);
        }
    }
    for process in alive {
        let _ = process.child.kill();
        let _ = process.child.wait();
    }
}
