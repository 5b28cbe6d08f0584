//! One program of a solver: its own process group, limits, and the end of what it says.
//!
//! Dropping it kills the whole group, children that the program left behind included. Next file to read: [`super::guard`].

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Resource, Rlimit, prlimit};
use rustix::thread::{CpuSet, sched_setaffinity};

use super::SolverError;
use super::error::ABSENT;
use super::guard::{Notice, kill_group};

/// Lines of the end of a program's output that travel with a failure, and the longest of them.
const TAIL_LINES: usize = 12;
const TAIL_WIDTH: usize = 240;

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
        let mut child =
            command.stdin(input).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map_err(failed)?;
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

/// Whether somebody else ended a program, or what a shell or a launcher of MPI started for it: those pass a signal on as 128
/// and its number.
pub(crate) fn is_killed(status: ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    matches!(status.signal(), Some(9 | 15)) || matches!(status.code(), Some(137 | 143))
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

/// Keeps the last lines of a stream, and of a long line its beginning.
fn remember(stream: impl Read, tail: &Mutex<VecDeque<String>>) {
    let mut stream = BufReader::new(stream);
    let mut line = Vec::new();
    loop {
        let piece = match stream.fill_buf() {
            Ok(piece) if !piece.is_empty() => piece,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            _ => break,
        };
        let end = piece.iter().position(|byte| *byte == b'\n');
        let own = &piece[..end.unwrap_or(piece.len())];
        // A character has at most four bytes.
        let room = (4 * TAIL_WIDTH).saturating_sub(line.len());
        line.extend_from_slice(&own[..own.len().min(room)]);
        let read = end.map_or(piece.len(), |end| end + 1);
        stream.consume(read);
        if end.is_some() {
            keep_line(&line, tail);
            line.clear();
        }
    }
    keep_line(&line, tail);
}

fn keep_line(line: &[u8], tail: &Mutex<VecDeque<String>>) {
    // Bytes that would steer a terminal are shown as what they are: no text.
    let shown = |c: char| if c.is_control() && c != '\t' { char::REPLACEMENT_CHARACTER } else { c };
    let text = String::from_utf8_lossy(line.trim_ascii_end());
    let text: String = text.chars().take(TAIL_WIDTH).map(shown).collect();
    if text.is_empty() {
        return;
    }
    let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
    if tail.len() == TAIL_LINES {
        tail.pop_front();
    }
    tail.push_back(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn remembered(bytes: &[u8]) -> Vec<String> {
        let tail = Mutex::default();
        remember(bytes, &tail);
        tail.into_inner().expect("nobody panicked").into()
    }

    #[test]
    fn of_what_a_program_says_the_last_lines_are_kept_and_of_a_long_line_the_beginning() {
        let many = (0..50).map(|i| format!("line {i}\r\n\n")).collect::<Vec<_>>().concat();
        let kept = remembered(many.as_bytes());
        assert_eq!((kept.len(), kept[0].as_str(), kept[11].as_str()), (TAIL_LINES, "line 38", "line 49"));
        let long = [vec![b'x'; 10_000_000], b"\nend".to_vec()].concat();
        assert_eq!(remembered(&long), ["x".repeat(TAIL_WIDTH), "end".to_owned()]);
    }

    #[test]
    fn a_program_that_was_killed_under_a_wrapper_was_killed_and_one_that_failed_was_not() {
        let ended = |script: &str| {
            let status = Command::new("sh").args(["-c", script]).stderr(Stdio::null()).status();
            is_killed(status.expect("there is a shell"))
        };
        assert!(ended("kill -9 $$") && ended("kill -15 $$"));
        assert!(ended("sh -c 'kill -9 $$'; exit $?") && ended("sh -c 'kill -15 $$'; exit $?"));
        assert!(!ended("exit 3") && !ended("sh -c 'kill -11 $$'; exit $?"));
    }

    #[test]
    fn garbage_is_shown_as_no_text_and_steers_no_terminal() {
        assert_eq!(
            remembered(b"\x1b[2Jcleared \xff\n\0\0"),
            ["\u{fffd}[2Jcleared \u{fffd}", "\u{fffd}\u{fffd}"]
        );
    }
}
