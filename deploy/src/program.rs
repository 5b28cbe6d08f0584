//! Running a program of an engine: to its end, within a bounded time.

use std::ffi::OsStr;
use std::io::{self, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use crate::error::DeployError;

/// How long a program of an engine may take. Those of Slurm give up a controller that is down after less.
const LIMIT: Duration = Duration::from_secs(120);

/// How long after its end what a program wrote is waited for.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// How often it is looked whether a program has ended.
const TICK: Duration = Duration::from_millis(10);

/// What a program said, and whether it says that all went well.
pub(crate) struct Said {
    pub(crate) is_well: bool,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
    /// The command, for a message.
    pub(crate) command: String,
    /// The program, for a message.
    pub(crate) program: String,
}

impl Said {
    /// Its words on what went wrong, on one line.
    pub(crate) fn words(&self) -> String {
        let words = if self.stderr.trim().is_empty() { &self.stdout } else { &self.stderr };
        let lines: Vec<&str> = words.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        if lines.is_empty() { "it says nothing".to_owned() } else { lines.join("; ") }
    }

    /// What it wrote, where all went well.
    pub(crate) fn answer(self) -> Result<String, DeployError> {
        if self.is_well { Ok(self.stdout) } else { Err(self.failed()) }
    }

    pub(crate) fn failed(self) -> DeployError {
        let said = self.words();
        DeployError::Failed { program: self.program, said, command: self.command }
    }

    pub(crate) fn refused(self) -> DeployError {
        let said = self.words();
        DeployError::Refused { program: self.program, said, command: self.command }
    }
}

/// Whose programs are run, and what to say where one is missing.
pub(crate) struct Programs {
    pub(crate) engine: &'static str,
    pub(crate) remedy: &'static str,
    /// Variables of the environment that they have besides those of this process.
    pub(crate) environment: &'static [(&'static str, &'static str)],
}

impl Programs {
    /// Runs a command to its end; `input` is what it reads.
    pub(crate) fn run(&self, command: &[String], input: &str) -> Result<Said, DeployError> {
        self.run_within(command, input, LIMIT)
    }

    fn run_within(&self, command: &[String], input: &str, limit: Duration) -> Result<Said, DeployError> {
        let shown = shell_words::join(command);
        let (program, arguments) = command.split_first().map_or(("", command), |(p, a)| (p.as_str(), a));
        let missing = |_: io::Error| DeployError::Missing {
            program: program.to_owned(),
            engine: self.engine,
            remedy: self.remedy,
        };
        let mut command = Command::new(program);
        for (name, _) in std::env::vars_os().filter(|(name, _)| is_option(name)) {
            command.env_remove(name);
        }
        let mut child = command
            .args(arguments)
            .envs(self.environment.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(missing)?;
        let (stdout, stderr) = (listen(child.stdout.take()), listen(child.stderr.take()));
        if let Some(mut stdin) = child.stdin.take() {
            let input = input.as_bytes().to_vec();
            // A program that reads nothing may have ended, or hang: the limit holds for it too.
            thread::spawn(move || stdin.write_all(&input));
        }
        let Some(is_well) = end(&mut child, limit) else {
            return Err(DeployError::NoAnswer {
                program: program.to_owned(),
                seconds: limit.as_secs(),
                command: shown,
            });
        };
        let [stdout, stderr] = [stdout, stderr].map(Heard::text);
        Ok(Said { is_well, stdout, stderr, command: shown, program: program.to_owned() })
    }
}

/// Whether a variable of the environment is an option of a program of Slurm: a deployment gives all that it needs itself.
fn is_option(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    ["SBATCH_", "SQUEUE_", "SCANCEL_"].iter().any(|head| name.starts_with(head))
}

/// What a program writes, read in a thread, so that one that says much is not held up.
struct Heard {
    bytes: Arc<Mutex<Vec<u8>>>,
    /// Closed at the end of what is read.
    open: mpsc::Receiver<()>,
}

fn listen(source: Option<impl Read + Send + 'static>) -> Heard {
    let bytes = Arc::<Mutex<Vec<u8>>>::default();
    let (end, open) = mpsc::channel();
    let kept = Arc::clone(&bytes);
    thread::spawn(move || {
        let _end: mpsc::Sender<()> = end;
        let (Some(mut source), mut part) = (source, [0; 8192]) else { return };
        while let Ok(n) = source.read(&mut part) {
            if n == 0 {
                break;
            }
            kept.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(&part[..n]);
        }
    });
    Heard { bytes, open }
}

impl Heard {
    /// All of it, once the program has ended; what it started may hold the other end for longer, as a master of ssh does.
    fn text(self) -> String {
        let _ = self.open.recv_timeout(LAST_WORDS);
        String::from_utf8_lossy(&self.bytes.lock().unwrap_or_else(PoisonError::into_inner)).into_owned()
    }
}

/// Whether a program ended well; nothing where it did not end in time and was killed.
fn end(child: &mut Child, limit: Duration) -> Option<bool> {
    let started = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.success()),
            Ok(None) if started.elapsed() < limit => thread::sleep(TICK),
            Ok(None) | Err(_) => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHELL: Programs =
        Programs { engine: "a shell", remedy: "install one", environment: &[("GIVEN", "too")] };

    fn run(words: &[&str], input: &str) -> Result<Said, DeployError> {
        SHELL.run(&words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>(), input)
    }

    #[test]
    fn a_program_is_heard_to_its_end_and_a_process_that_it_leaves_holds_nobody_up() {
        let said = run(&["sh", "-c", "cat; echo $GIVEN; sleep 60 & exit 0"], "read, ").unwrap();
        assert!(said.is_well);
        assert_eq!(said.stdout, "read, too\n");
    }

    #[test]
    fn a_program_that_reads_nothing_of_a_long_input_is_ended_at_the_limit() {
        let command = ["sh", "-c", "exec sleep 60"].map(str::to_owned);
        let longer_than_a_pipe = "x".repeat(1 << 20);
        let said = SHELL.run_within(&command, &longer_than_a_pipe, Duration::from_millis(200));
        assert!(matches!(said, Err(DeployError::NoAnswer { .. })));
    }

    #[test]
    fn what_goes_wrong_is_told_in_the_words_of_the_program() {
        let failed = run(&["sh", "-c", "echo one >&2; echo two >&2; exit 3"], "").unwrap().answer();
        let text = failed.unwrap_err().to_string();
        assert!(text.starts_with("sh failed: one; two") && text.contains("exit 3"), "{text}");
        let missing = run(&["no-such-program"], "").err().unwrap();
        assert!(
            missing.is_input() && missing.to_string().contains("no program `no-such-program`"),
            "{missing}"
        );
    }
}
