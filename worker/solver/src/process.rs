//! One program of a solver: its own process group, limits, and the end of what it says.
//!
//! Dropping it kills the whole group, children that the program left behind included. The number of a group belongs to it as long
//! as its leader is not reaped, so the leader is reaped last, after the group was signalled. Next file to read: [`super::guard`].

mod ending;
mod last_lines;

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Resource, Rlimit, WaitId, WaitIdOptions, prlimit, waitid};
use rustix::thread::{CpuSet, sched_setaffinity};

use super::SolverError;
use super::error::ABSENT;
use super::guard::{Notice, kill_group};
use super::orphans;
use super::stopped::is_stopped;
pub(crate) use ending::{ending, is_killed};
use last_lines::remember;

/// How long the words of a program that runs on are waited for once it has failed.
const MOMENT: Duration = Duration::from_millis(20);

/// How long the last lines of a program that has ended may take to arrive.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Variables by which numerical libraries learn how many threads they may start.
const THREAD_COUNTS: [&str; 6] = [
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "RAYON_NUM_THREADS",
];

/// How often a program is looked at while it is waited for: first often, since most runs are short.
const LOOKS: [Duration; 2] = [Duration::from_micros(200), Duration::from_millis(20)];

/// What to start, and how.
pub(crate) struct Launch<'a> {
    /// Program and arguments.
    pub(crate) command: &'a [String],
    /// Where relative names of the program and its arguments lead.
    pub(crate) base: &'a str,
    /// Where it runs; `base` without it.
    pub(crate) folder: Option<&'a Path>,
    /// Variables set for it.
    pub(crate) environment: BTreeMap<String, String>,
    /// Threads that it may use.
    pub(crate) threads: usize,
    /// Cores that it is bound to.
    pub(crate) cores: Option<Vec<usize>>,
    /// Address space that it may use, bytes.
    pub(crate) memory: Option<u64>,
    /// Whether it is written to on its standard input; it is empty otherwise.
    pub(crate) input: bool,
}

/// A running program.
pub(crate) struct Process {
    child: Child,
    group: i32,
    tail: Arc<Mutex<VecDeque<String>>>,
    /// Closes when its standard error is read up.
    read_up: Option<Receiver<()>>,
    notice: Option<Notice>,
}

impl Process {
    pub(crate) fn start(launch: &Launch<'_>, notice: Option<Notice>) -> Result<Self, SolverError> {
        let Some((program, arguments)) = launch.command.split_first() else {
            return Err(SolverError::Incomplete("the solver has no command".to_owned()));
        };
        let failed =
            |error: io::Error| SolverError::Start { program: program.clone(), reason: reason(&error) };
        let mut command = Command::new(resolved(program, launch.base));
        command.args(arguments).envs(&launch.environment).process_group(0);
        for name in THREAD_COUNTS.iter().filter(|name| !launch.environment.contains_key(**name)) {
            command.env(name, launch.threads.max(1).to_string());
        }
        let folder = launch.folder.map(Path::to_path_buf);
        let base = (!launch.base.is_empty()).then(|| PathBuf::from(launch.base));
        if let Some(folder) = folder.or(base) {
            command.current_dir(folder);
        }
        let input = if launch.input { Stdio::piped() } else { Stdio::null() };
        command.stdin(input).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = orphans::start(&mut command).map_err(failed)?;
        let group = child.id().cast_signed();
        if let Some(notice) = &notice {
            notice.begin(child.id());
        }
        let tail = Arc::default();
        let read_up = child.stderr.take().map(|stderr| {
            let (done, read_up) = channel();
            let tail = Arc::clone(&tail);
            std::thread::spawn(move || {
                remember(stderr, &tail);
                drop(done);
            });
            read_up
        });
        let process = Self { child, group, tail, read_up, notice };
        process.limit(launch).map_err(failed)?;
        Ok(process)
    }

    /// Binds the program and limits its memory.
    fn limit(&self, launch: &Launch<'_>) -> io::Result<()> {
        let pid = Pid::from_raw(self.group);
        if let Some(bytes) = launch.memory {
            let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
            prlimit(pid, Resource::As, limit)?;
        }
        if let Some(cores) = &launch.cores {
            let mut set = CpuSet::new();
            for core in cores {
                set.set(*core);
            }
            sched_setaffinity(pid, &set)?;
        }
        Ok(())
    }

    /// Its standard output, once.
    pub(crate) fn output(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// Its standard input, once, where it has one.
    pub(crate) fn input(&mut self) -> Option<std::process::ChildStdin> {
        self.child.stdin.take()
    }

    /// Also remembers lines that the program writes to its standard output.
    pub(crate) fn remember_output(&mut self) {
        if let Some(output) = self.output() {
            let tail = Arc::clone(&self.tail);
            std::thread::spawn(move || remember(output, &tail));
        }
    }

    /// How it ended, if it has. It is not reaped: its number, and that of its group, are given to no other process.
    pub(crate) fn ended(&self) -> Option<ExitStatus> {
        let pid = Pid::from_raw(self.group)?;
        let looks = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        let ended = waitid(WaitId::Pid(pid), looks).ok().flatten()?;
        // As `wait` packs them: the code in the second byte, a signal in the first.
        let raw = ended.exit_status().map(|code| code << 8).or(ended.terminating_signal())?;
        Some(ExitStatus::from_raw(raw))
    }

    /// Whether somebody stopped it, or a process that it started.
    pub(crate) fn is_stopped(&self) -> bool {
        is_stopped(self.group)
    }

    /// Waits for its end for so long.
    pub(crate) fn wait(&mut self, patience: Duration) -> Option<ExitStatus> {
        let started = Instant::now();
        loop {
            if let Some(status) = self.ended() {
                return Some(status);
            }
            let waited = started.elapsed();
            if waited >= patience {
                return None;
            }
            let look = if waited < LOOKS[1] { LOOKS[0] } else { LOOKS[1] };
            std::thread::sleep(look.min(patience.saturating_sub(waited)));
        }
    }

    /// The end of what it said on its standard error. Waits for the last of it when the program has ended.
    pub(crate) fn tail(&mut self) -> String {
        if self.ended().is_none() {
            // What it said before its answer may still be in the pipe.
            std::thread::sleep(MOMENT);
        } else if let Some(read_up) = self.read_up.take() {
            // A child of the program may hold the pipe open: it is killed first. One that left the group is not waited for.
            kill_group(self.group);
            let _: Result<(), _> = read_up.recv_timeout(LAST_LINES);
        }
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        tail.iter().map(String::as_str).collect::<Vec<_>>().join("\n")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        kill_group(self.group);
        if let Some(notice) = &self.notice {
            notice.end(self.group.cast_unsigned());
        }
        orphans::forget(self.group);
        let _ = self.child.wait();
        orphans::end_orphans();
    }
}

/// A program next to the study, or wherever the system finds it.
fn resolved(program: &str, base: &str) -> PathBuf {
    let beside = Path::new(base).join(program);
    if !base.is_empty() && beside.is_file() { beside } else { PathBuf::from(program) }
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => ABSENT.to_owned(),
        io::ErrorKind::PermissionDenied => {
            "it may not be executed; make it executable or name its interpreter first".to_owned()
        }
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn started(script: &str) -> Process {
        let command = ["sh", "-c", script].map(str::to_owned);
        let launch = Launch {
            command: &command,
            base: "",
            folder: None,
            environment: BTreeMap::new(),
            threads: 1,
            cores: None,
            memory: None,
            input: false,
        };
        Process::start(&launch, None).expect("there is a shell")
    }

    #[test]
    fn a_program_that_ended_keeps_its_number_until_its_group_was_ended() {
        let mut process = started("sleep 1000 & echo last words >&2; exit 7");
        let status = process.wait(Duration::from_mins(1)).expect("it ends at once");
        assert_eq!(status.code(), Some(7));
        assert_eq!(process.tail(), "last words");
        // Asking again gives the same: it is still there to be asked.
        assert_eq!(process.ended().and_then(|status| status.code()), Some(7));
        let pid = Pid::from_raw(process.group).expect("a number above zero");
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        let looked = || waitid(WaitId::Pid(pid), options);
        assert!(looked().is_ok_and(|found| found.is_some()), "nobody has reaped it");
        drop(process);
        assert!(looked().is_err(), "it is reaped");
    }

    #[test]
    fn a_program_that_is_killed_tells_its_signal() {
        let mut process = started("kill -9 $$");
        let status = process.wait(Duration::from_mins(1)).expect("it ends at once");
        assert!(is_killed(status) && ending(status).contains("signal 9"), "{}", ending(status));
    }
}
