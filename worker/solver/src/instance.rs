//! One program that serves `solver.proto`, and the connection to it.
//!
//! The program is told in the environment where to listen: `STARLINGS_SOLVER_SOCKET` is the path of a Unix socket, or
//! `STARLINGS_SOLVER_ADDRESS` a loopback address where the study asks for one with `{port}`. It is ready when it answers
//! Describe. Its standard input closes when the worker ends. Next files to read: [`super::process`], [`mod@connect`] for the
//! way to it, [`mod@answer`] for what can be wrong with an answer.

mod answer;
mod connect;
mod within;

use std::process::ChildStdin;
use std::sync::Arc;
use std::time::Duration;

use starlings_models::{Description, ModelFailure, ParticleError, Run, Solved, SolverDef};
use starlings_proto::ProtocolError;
use starlings_proto::convert::solver::{Reply, decode_reply, encode_run};
use starlings_proto::generated_solver::solver_client::SolverClient;
use starlings_proto::words::status_text;
use tokio::runtime::Runtime;
use tonic::transport::Channel;

pub use connect::SOCKET;
use connect::{SolverAddress, connect};
use within::within;

use super::SolverError;
use super::error::tail_text;
use super::process::{Launch, Process, ending, is_killed};
use super::scratch::Scratch;
use super::site::Site;
use super::stopped::stopped;

/// How long a run that is given up on purpose may go on.
const LEFT_AFTER: Duration = Duration::from_millis(2);
/// How long a program that broke its connection may take to end, as a launcher of ranks does, so that its ending can be told.
const LAST_WORDS: Duration = Duration::from_secs(5);
/// The same of one that only broke the protocol and need not end.
const SHORT: Duration = Duration::from_millis(500);
/// How long a program may take from its answer to the end of the call.
const CLOSING: Duration = Duration::from_secs(1);

/// Why a program is of no more use.
#[derive(Debug)]
pub(crate) struct Lost {
    pub(crate) how: How,
    what: String,
    tail: String,
}

/// How a program was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum How {
    /// It did not answer in time.
    Silent,
    /// It did not answer in time because somebody stopped it.
    Stopped,
    /// It ended by itself, or broke the protocol.
    Fell,
    /// Somebody killed it.
    Killed,
    /// Nobody wanted the answer any more.
    Unwanted,
}

impl Lost {
    /// In words, with how often it happened.
    pub(crate) fn text(&self, times: u32) -> String {
        let before =
            if times > 1 { format!(" (and {} before, on the same run)", times - 1) } else { String::new() };
        format!("{}{before}{}", self.what, tail_text(&self.tail))
    }
}

/// A program with its connection.
pub(crate) struct Instance {
    name: String,
    /// Absent where somebody else started it.
    process: Option<Process>,
    /// Closes when this is dropped, which tells the program to end.
    _lifeline: Option<ChildStdin>,
    scratch: Scratch,
    client: SolverClient<Channel>,
    runtime: Runtime,
    /// What it said of itself when it was ready, or what is wrong with that.
    described: Result<Description, String>,
}

impl Instance {
    /// Starts a program, or only connects where there is no command, and waits until it answers.
    ///
    /// # Errors
    /// When it cannot be started or does not answer in time.
    pub(crate) fn start(
        def: &SolverDef,
        command: &[String],
        site: &Arc<Site>,
        number: usize,
    ) -> Result<Self, SolverError> {
        let name = command.first().or(def.address.as_ref()).cloned().unwrap_or_default();
        let failed =
            |error: std::io::Error| SolverError::Start { program: name.clone(), reason: error.to_string() };
        let scratch = site.scratch("solver").map_err(failed)?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let address = SolverAddress::of(def, command, &scratch).map_err(failed)?;
        let mut process = None;
        if !command.is_empty() {
            let environment =
                def.environment.clone().into_iter().chain(address.environment.clone()).collect();
            let launch = Launch {
                command: &address.command,
                base: &def.folder,
                folder: None,
                environment,
                threads: def.threads,
                cores: def.pin.then(|| site.cores(number, def.threads)),
                memory: def.memory,
                input: true,
            };
            process = Some(site.start(&launch)?);
        }
        let lifeline = process.as_mut().and_then(Process::input);
        if let Some(process) = &mut process {
            process.remember_output();
        }
        let patience = Duration::try_from_secs_f64(def.start_timeout).unwrap_or(Duration::MAX);
        let (client, described) = connect(&runtime, &address.target, &name, process.as_mut(), patience)?;
        Ok(Self { name, process, _lifeline: lifeline, scratch, client, runtime, described })
    }

    /// What the program said of itself when it was ready.
    ///
    /// # Errors
    /// When that makes no sense.
    pub(crate) fn describe(&mut self) -> Result<Description, SolverError> {
        self.described.clone().map_err(|what| SolverError::Description {
            program: self.name.clone(),
            message: what + &tail_text(&self.tail()),
        })
    }

    /// Has one run made.
    ///
    /// # Errors
    /// When the program is of no more use; what it reports of the run itself is an answer, and so is an unsound prediction.
    pub(crate) fn run(
        &mut self,
        run: &Run<'_>,
        patience: Duration,
    ) -> Result<Result<Solved, ParticleError>, Lost> {
        let request = encode_run(run, &self.scratch.path().to_string_lossy());
        let client = &mut self.client;
        let conversation = async {
            let mut replies =
                client.run(request).await.map_err(|s| Broken::Connection(status_text(&s)))?.into_inner();
            loop {
                match replies.message().await {
                    Ok(Some(reply)) => match decode_reply(reply).map_err(|e| Broken::Protocol(plain(e)))? {
                        Reply::Progress(time) => tracing::debug!(particle = run.particle, time, "progress"),
                        Reply::Ended(answer) => return Ok((answer.map_err(answer::reported), replies)),
                    },
                    Ok(None) => {
                        return Err(Broken::Protocol("it ended the run without an answer".to_owned()));
                    }
                    Err(status) => return Err(Broken::Connection(status_text(&status))),
                }
            }
        };
        let process = self.process.as_ref();
        match self.runtime.block_on(within(patience, run.stop, process, conversation)) {
            Ok(Ok((answer, mut rest))) => {
                // A call that is left before its end counts against the connection, which takes a thousand of them.
                let end = async { while let Ok(Some(_)) = rest.message().await {} };
                let _ = self.runtime.block_on(async { tokio::time::timeout(CLOSING, end).await });
                Ok(answer.and_then(|solved| self.sound(run, solved)).map_err(|e| self.named(e)))
            }
            Ok(Err(broken)) => Err(self.lost(broken)),
            Err(how) => Err(self.late(how, patience.as_secs_f64())),
        }
    }

    /// No answer in time.
    fn late(&mut self, how: How, seconds: f64) -> Lost {
        let solver = format!("the solver `{}`", self.name);
        // A program that somebody else started is not ended.
        let ended = if self.process.is_some() { " and was ended" } else { "" };
        let what = match how {
            How::Stopped => stopped(&solver, seconds),
            How::Unwanted => format!("nobody wants the answer of {solver} any more"),
            _ => format!("{solver} did not answer within {seconds} s{ended} (`timeout` sets the limit)"),
        };
        Lost { how, what, tail: self.tail() }
    }

    /// Whether somebody has removed its folder.
    pub(crate) fn is_homeless(&self) -> bool {
        self.scratch.is_gone()
    }

    /// Asks for a run and cancels the call.
    pub(crate) fn leave(&mut self, run: &Run<'_>) {
        let request = encode_run(run, &self.scratch.path().to_string_lossy());
        let client = &mut self.client;
        let asked = async { tokio::time::timeout(LEFT_AFTER, client.run(request)).await };
        drop(self.runtime.block_on(asked));
    }

    /// Refuses an answer of another length than asked for, or one that is not finite, while the program's output is at hand.
    fn sound(&self, run: &Run<'_>, solved: Solved) -> Result<Solved, ParticleError> {
        let Ok(described) = &self.described else { return Ok(solved) };
        if let Some(fault) = answer::wrong_length(&described.spec, run, &solved) {
            return Err(ParticleError::Undecided(fault));
        }
        match answer::not_finite(&described.spec, run, &solved) {
            Some(fault) => Err(ModelFailure::Solver(fault).into()),
            None => Ok(solved),
        }
    }

    /// A failure of a run with the program's name and the end of its output.
    fn named(&mut self, error: ParticleError) -> ParticleError {
        let tail = tail_text(&self.tail());
        let name = &self.name;
        match error {
            ParticleError::BadJob(text) => ParticleError::BadJob(format!(
                "the solver `{name}` refuses it: {}{tail}",
                answer::short(&text)
            )),
            ParticleError::Undecided(text) => {
                ParticleError::Undecided(format!("the solver `{name}` {}{tail}", answer::short(&text)))
            }
            ParticleError::Infrastructure(text) => ParticleError::Infrastructure(format!(
                "the solver `{name}` cannot compute now: {}{tail}",
                answer::short(&text)
            )),
            ParticleError::Model(failed) => answer::named(name, failed, &tail).into(),
            ParticleError::Timeout(_) => error,
        }
    }

    fn tail(&mut self) -> String {
        self.process.as_mut().map(Process::tail).unwrap_or_default()
    }

    fn lost(&mut self, broken: Broken) -> Lost {
        let patience = if matches!(broken, Broken::Connection(_)) { LAST_WORDS } else { SHORT };
        let status = self.process.as_mut().and_then(|process| process.wait(patience));
        let tail = self.tail();
        let name = &self.name;
        let (how, what) = match (status, broken) {
            (Some(status), _) => {
                let how = if is_killed(status) { How::Killed } else { How::Fell };
                (how, format!("the solver `{name}` {} during a run", ending(status)))
            }
            (None, Broken::Connection(what)) => {
                (How::Fell, format!("the connection to the solver `{name}` broke: {what}"))
            }
            (None, Broken::Protocol(what)) => {
                (How::Fell, format!("the solver `{name}` breaks the protocol: {what}"))
            }
        };
        Lost { how, what: what + &self.homeless(), tail }
    }

    /// That its folder is gone, as the end of a sentence; this is the cause of its end, whatever it says itself.
    fn homeless(&self) -> String {
        let gone = self.is_homeless().then(|| self.scratch.path().display());
        gone.map(|folder| format!("; its folder {folder} was removed meanwhile")).unwrap_or_default()
    }
}

/// Why a run gave no answer.
enum Broken {
    Connection(String),
    Protocol(String),
}

/// What is wrong with a message, without the name of the field where that says nothing.
fn plain(error: ProtocolError) -> String {
    match error {
        ProtocolError::Shape { field: "description", message } => message,
        other => other.to_string(),
    }
}
