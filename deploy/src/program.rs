//! Running a program of an engine: to its end, within a bounded time.

use std::io::{self, Read, Write};
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::error::DeployError;

/// How long a program of an engine may take. Those of Slurm give up a controller that is down after less.
const LIMIT: Duration = Duration::from_secs(120);

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
        let shown = shell_words::join(command);
        let (program, arguments) = command.split_first().map_or(("", command), |(p, a)| (p.as_str(), a));
        let missing = |_: io::Error| DeployError::Missing {
            program: program.to_owned(),
            engine: self.engine,
            remedy: self.remedy,
        };
        let mut child = Command::new(program)
            .args(arguments)
            .envs(self.environment.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(missing)?;
        let (stdout, stderr) = (listen(child.stdout.take()), listen(child.stderr.take()));
        if let Some(mut stdin) = child.stdin.take() {
            // A program that reads nothing may have ended.
            let _ = stdin.write_all(input.as_bytes());
        }
        let Some(is_well) = end(&mut child) else {
            return Err(DeployError::NoAnswer {
                program: program.to_owned(),
                seconds: LIMIT.as_secs(),
                command: shown,
            });
        };
        let [stdout, stderr] = [stdout, stderr].map(|reader| reader.join().unwrap_or_default());
        Ok(Said { is_well, stdout, stderr, command: shown, program: program.to_owned() })
    }
}

/// Reads to the end in a thread, so that a program that says much is not held up.
fn listen(source: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut source) = source {
            let _ = source.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Whether a program ended well; nothing where it did not end in time and was killed.
fn end(child: &mut Child) -> Option<bool> {
    let started = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.success()),
            Ok(None) if started.elapsed() < LIMIT => thread::sleep(TICK),
            Ok(None) | Err(_) => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
        }
    }
}
