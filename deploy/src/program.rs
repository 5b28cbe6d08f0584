//! Running a program of an engine: to its end, within a bounded time.

use std::ffi::OsStr;
use std::process::Stdio;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::process::{Child, Command};
use tokio::time::timeout;

use crate::error::DeployError;

/// How long a program of an engine may take. Those of Slurm give up a controller that is down after less.
const LIMIT: Duration = Duration::from_secs(120);

/// How long after its end what a program wrote is waited for: what it started may hold the other end for longer, as a master of ssh does.
const LAST_WORDS: Duration = Duration::from_secs(2);

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
    /// Heads of the names of variables that they do not have: options, where a deployment gives all that it needs itself.
    pub(crate) withheld: &'static [&'static str],
}

impl Programs {
    /// Runs a command to its end; `input` is what it reads.
    pub(crate) fn run(&self, command: &[String], input: &str) -> Result<Said, DeployError> {
        self.run_within(command, input, LIMIT)
    }

    fn run_within(&self, command: &[String], input: &str, limit: Duration) -> Result<Said, DeployError> {
        let shown = shell_words::join(command);
        let (program, arguments) = command.split_first().map_or(("", command), |(p, a)| (p.as_str(), a));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime =
            runtime.map_err(|source| DeployError::Unstarted { program: program.to_owned(), source })?;
        let heard = runtime.block_on(async {
            let mut child = self.start(program, arguments)?;
            Ok(hear(&mut child, input, limit).await)
        })?;
        let Some((is_well, [stdout, stderr])) = heard else {
            return Err(DeployError::NoAnswer {
                program: program.to_owned(),
                seconds: limit.as_secs(),
                command: shown,
            });
        };
        Ok(Said { is_well, stdout, stderr, command: shown, program: program.to_owned() })
    }

    /// Starts a program, which is killed where nobody waits for it any more.
    fn start(&self, program: &str, arguments: &[String]) -> Result<Child, DeployError> {
        let mut command = Command::new(program);
        let is_withheld = |name: &OsStr| {
            let name = name.to_string_lossy();
            self.withheld.iter().any(|head| name.starts_with(head))
        };
        for (name, _) in std::env::vars_os().filter(|(name, _)| is_withheld(name)) {
            command.env_remove(name);
        }
        command.args(arguments).envs(self.environment.iter().copied());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).kill_on_drop(true);
        command.spawn().map_err(|_| DeployError::Missing {
            program: program.to_owned(),
            engine: self.engine,
            remedy: self.remedy,
        })
    }
}

/// Whether a program ended well, and what it wrote; nothing where it did not end in time.
async fn hear(child: &mut Child, input: &str, limit: Duration) -> Option<(bool, [String; 2])> {
    let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
    let (mut out, mut err) = (Vec::new(), Vec::new());
    // A program that reads nothing may have ended, or hang: nobody waits for the end of this alone.
    let mut told = Box::pin(async {
        if let Some(mut stdin) = stdin {
            let _ = stdin.write_all(input.as_bytes()).await;
        }
    });
    let mut heard = Box::pin(async {
        let out = async {
            if let Some(mut stdout) = stdout {
                let _ = stdout.read_to_end(&mut out).await;
            }
        };
        let err = async {
            if let Some(mut stderr) = stderr {
                let _ = stderr.read_to_end(&mut err).await;
            }
        };
        tokio::join!(out, err);
    });
    let (mut is_told, mut is_heard) = (false, false);
    let ended = timeout(limit, async {
        loop {
            tokio::select! {
                status = child.wait() => break status,
                () = &mut told, if !is_told => is_told = true,
                () = &mut heard, if !is_heard => is_heard = true,
            }
        }
    });
    let ended = ended.await;
    if ended.is_ok() && !is_heard {
        let _ = timeout(LAST_WORDS, &mut heard).await;
    }
    drop(heard);
    let Ok(Ok(status)) = ended else {
        let _ = child.kill().await;
        return None;
    };
    Some((status.success(), [out, err].map(|bytes| String::from_utf8_lossy(&bytes).into_owned())))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHELL: Programs = Programs {
        engine: "a shell",
        remedy: "install one",
        environment: &[("GIVEN", "too")],
        withheld: &[],
    };

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
