//! One program of a solver: its own process group, limits, and the end of what it says.
//!
//! Dropping it kills the whole group, children that the program left behind included. Next file to read: [`super::guard`].

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Resource, Rlimit, prlimit};
use rustix::thread::{CpuSet, sched_setaffinity};

use super::SolverError;
use super::guard::{Notice, kill_group};

/// Lines of the end of a program's output that travel with a failure, and the longest of them.
const TAIL_LINES: usize = 12;
const TAIL_WIDTH: usize = 240;

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
    reader: Option<std::thread::JoinHandle<()>>,
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
        let mut child =
            command.stdin(input).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map_err(failed)?;
        let group = child.id().cast_signed();
        if let Some(notice) = &notice {
            notice.begin(child.id());
        }
        let tail = Arc::default();
        let reader = child.stderr.take().map(|stderr| {
            let tail = Arc::clone(&tail);
            std::thread::spawn(move || remember(stderr, &tail))
        });
        let process = Self { child, group, tail, reader, notice };
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

    /// How it ended, if it has.
    pub(crate) fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().ok().flatten()
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
        if self.ended().is_some()
            && let Some(reader) = self.reader.take()
        {
            // A child of the program may hold the pipe open: it is killed first.
            kill_group(self.group);
            let _ = reader.join();
        }
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        tail.iter().map(String::as_str).collect::<Vec<_>>().join("\n")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        kill_group(self.group);
        let _ = self.child.wait();
        if let Some(notice) = &self.notice {
            notice.end(self.group.cast_unsigned());
        }
    }
}

/// How a program ended, in words.
pub(crate) fn ending(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exited with status {code}"),
        (None, Some(9)) => "was killed (signal 9: out of memory, or somebody killed it)".to_owned(),
        (None, Some(signal)) => format!("was ended by signal {signal}"),
        (None, None) => "ended".to_owned(),
    }
}

/// Whether somebody else ended a program.
pub(crate) fn is_killed(status: ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    matches!(status.signal(), Some(9 | 15))
}

/// A program next to the study, or wherever the system finds it.
fn resolved(program: &str, base: &str) -> PathBuf {
    let beside = Path::new(base).join(program);
    if !base.is_empty() && beside.is_file() { beside } else { PathBuf::from(program) }
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => {
            "no such program, neither in the study's folder nor on the search path; check `command`"
                .to_owned()
        }
        io::ErrorKind::PermissionDenied => {
            "it may not be executed; make it executable or name its interpreter first".to_owned()
        }
        _ => error.to_string(),
    }
}

/// Keeps the last lines of a stream.
fn remember(stream: impl Read, tail: &Mutex<VecDeque<String>>) {
    for line in BufReader::new(stream).split(b'\n') {
        let Ok(line) = line else { break };
        let text: String = String::from_utf8_lossy(&line).chars().take(TAIL_WIDTH).collect();
        let text = text.trim_end().to_owned();
        if text.is_empty() {
            continue;
        }
        let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
        if tail.len() == TAIL_LINES {
            tail.pop_front();
        }
        tail.push_back(text);
    }
}
