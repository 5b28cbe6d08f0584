//! One worker process: started with a lifeline, never left behind, its last words kept.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use starlings_proto::{BUILD, INHERITED, build_of_file, descriptors};

use super::LocalConfig;
use crate::FleetError;

/// How long to wait for the end of a dead process's standard error.
const LAST_WORDS: Duration = Duration::from_millis(50);

/// Lines of standard error kept per process.
const TAIL: usize = 20;

/// A child process; dropping kills it and waits for it.
pub(super) struct Process {
    child: Child,
    started: Instant,
    stderr: Option<JoinHandle<()>>,
    tail: Arc<Mutex<VecDeque<String>>>,
}

/// The program, where it is this one also after another was put in its place: all workers of a run are of one build.
fn standing(program: &Path) -> &Path {
    let own = std::fs::read_link(OWN).unwrap_or_default();
    let gone = own.to_str().and_then(|own| own.strip_suffix(DELETED)).map(Path::new);
    if gone == Some(program) { Path::new(OWN) } else { program }
}

/// Where Linux keeps the program that a process runs, and how it says that its file is gone.
const OWN: &str = "/proc/self/exe";
const DELETED: &str = " (deleted)";

impl Process {
    pub(super) fn start(config: &LocalConfig, place: usize) -> Result<Self, FleetError> {
        let mut command = Command::new(standing(&config.program));
        let spawn = |source| FleetError::Spawn { program: config.program.clone(), source };
        let (own, its) = UnixStream::pair().map_err(spawn)?;
        let descriptors = descriptors::offer(&own).map_err(spawn)?;
        command.args(&config.args).args(["--connect", INHERITED, "--place", &place.to_string()]);
        command.stdin(OwnedFd::from(its)).stdout(Stdio::null()).stderr(Stdio::piped());
        command.envs(build_of_file().map(|told| (BUILD, told)));
        // A group of its own: an interrupt on the terminal reaches the coordinator only, which ends the workers in order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(spawn)?;
        // The command holds the child's end: as long as it does, the end of the child would not be noticed.
        drop(command);
        config.fleet.adopt(own, descriptors);
        let pipe = child.stderr.take();
        let tail = Arc::new(Mutex::new(VecDeque::new()));
        // From here on the guard ends the child, whatever fails.
        let mut process = Self { child, started: Instant::now(), stderr: None, tail };
        if let Some(pipe) = pipe {
            let tail = Arc::clone(&process.tail);
            let keep = move || keep_tail(BufReader::new(pipe), &tail);
            let reader = std::thread::Builder::new().name("worker-stderr".to_owned()).spawn(keep);
            process.stderr = Some(reader.map_err(spawn)?);
        }
        Ok(process)
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// How it ended, if it did.
    pub(super) fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().ok().flatten()
    }

    pub(super) fn lived(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.started)
    }

    /// How a dead process ended and what it wrote last.
    pub(super) fn last_words(&self, status: ExitStatus) -> String {
        // A grandchild may hold the pipe open: give the reader a moment, not for ever.
        if let Some(reader) = &self.stderr {
            let patience = Instant::now() + LAST_WORDS;
            while !reader.is_finished() && Instant::now() < patience {
                std::thread::yield_now();
            }
        }
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let lines = tail.iter().map(String::as_str).collect::<Vec<_>>().join("\n");
        if lines.is_empty() { status.to_string() } else { format!("{status}\n{lines}") }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.ended().is_none() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
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

#[cfg(all(test, unix))]
mod tests {
    use std::sync::mpsc;

    use tokio_util::sync::CancellationToken;

    use super::*;
    use crate::{FleetConfig, GrpcFleet};

    #[test]
    fn a_process_that_nobody_keeps_is_killed() {
        let (sender, _events) = mpsc::channel();
        let fleet = GrpcFleet::listen(FleetConfig::new(None, "test", CancellationToken::new(), sender));
        let fleet = fleet.expect("a fleet");
        let config = LocalConfig {
            program: "/bin/sh".into(),
            args: ["-c", "exec sleep 600"].map(str::to_owned).to_vec(),
            n: 1,
            fleet: fleet.handle(),
        };
        let process = Process::start(&config, 0).expect("there is a shell");
        let pid = process.pid().to_string();
        let alive = || {
            let sent = Command::new("kill").args(["-0", &pid]).stderr(Stdio::null()).status();
            sent.is_ok_and(|status| status.success())
        };
        assert!(alive());
        drop(process);
        assert!(!alive());
    }
}
