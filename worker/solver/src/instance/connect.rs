//! The way to a program that serves `solver.proto`: where it listens, and the wait until it answers.
//!
//! Next file to read: [`super`].

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use starlings_models::{Description, SolverDef};
use starlings_proto::convert::solver::SOLVER_PROTOCOL;
use starlings_proto::convert::solver::description::decode_description;
use starlings_proto::generated_solver::DescribeRequest;
use starlings_proto::generated_solver::solver_client::SolverClient;
use starlings_proto::words::{causes, status_text};
use starlings_proto::{FRAME_SIZE, LIFELINE};
use tokio::runtime::Runtime;
use tonic::transport::{Channel, Endpoint};

use super::plain;
use crate::SolverError;
use crate::machine::free_port;
use crate::process::{Process, ending, is_killed};
use crate::scratch::Scratch;

/// Variable that names the Unix socket on which a solver listens.
pub const SOCKET: &str = "STARLINGS_SOLVER_SOCKET";
/// Variable that names the loopback address on which a solver listens.
pub(crate) const ADDRESS: &str = "STARLINGS_SOLVER_ADDRESS";

/// HTTP/2 windows per stream and per connection, bytes: a state of many megabytes travels in one go.
const WINDOWS: (u32, u32) = (64 * 1024 * 1024, 64 * 1024 * 1024);
/// Largest message, bytes: the limit of the format.
const MAX_ANSWER: usize = i32::MAX as usize;
/// How often a program that starts is asked whether it is ready.
const LOOK: Duration = Duration::from_millis(5);

/// Where a program listens, and how it is told.
pub(super) struct SolverAddress {
    pub(super) target: String,
    pub(super) environment: BTreeMap<String, String>,
    pub(super) command: Vec<String>,
}

impl SolverAddress {
    pub(super) fn of(def: &SolverDef, command: &[String], scratch: &Scratch) -> std::io::Result<Self> {
        let mut environment = BTreeMap::from([(LIFELINE.to_owned(), "1".to_owned())]);
        let Some(address) = &def.address else {
            let socket = scratch.path().join("s");
            environment.insert(SOCKET.to_owned(), socket.display().to_string());
            let target = format!("unix:{}", socket.display());
            return Ok(Self { target, environment, command: command.to_vec() });
        };
        let port = if address.contains("{port}") { free_port()?.to_string() } else { String::new() };
        let filled = |text: &String| text.replace("{port}", &port);
        let address = filled(address);
        environment.insert(ADDRESS.to_owned(), address.clone());
        let target = if address.contains("://") || address.starts_with("unix:") {
            address
        } else {
            format!("http://{address}")
        };
        Ok(Self { target, environment, command: command.iter().map(filled).collect() })
    }
}

/// Connects until the program answers Describe, has ended, or time is up.
pub(super) fn connect(
    runtime: &Runtime,
    target: &str,
    name: &str,
    mut process: Option<&mut Process>,
    patience: Duration,
) -> Result<(SolverClient<Channel>, Result<Description, String>), SolverError> {
    let endpoint = Endpoint::from_shared(target.to_owned())
        .map_err(|error| {
            not_ready(name, format!("has an address that is none ({target}): {error}"), String::new())
        })?
        .initial_stream_window_size(WINDOWS.0)
        .initial_connection_window_size(WINDOWS.1)
        .max_frame_size(FRAME_SIZE)
        .tcp_nodelay(true);
    let started = Instant::now();
    let mut last;
    let mut told = process.is_some();
    loop {
        let attempt = async {
            let channel = endpoint.connect().await.map_err(|error| causes(&error))?;
            let mut client = SolverClient::new(channel)
                .max_decoding_message_size(MAX_ANSWER)
                .max_encoding_message_size(MAX_ANSWER);
            let request = DescribeRequest { protocol: SOLVER_PROTOCOL };
            let answer = client.describe(request).await.map_err(|status| status_text(&status))?;
            // What is wrong with it is said when somebody asks for it.
            Ok::<_, String>((client, decode_description(answer.get_ref()).map_err(plain)))
        };
        let left = patience.saturating_sub(started.elapsed());
        match runtime.block_on(async { tokio::time::timeout(left, attempt).await }) {
            Ok(Ok(ready)) => return Ok(ready),
            Ok(Err(error)) => last = error,
            Err(_) => last = "it accepts the connection but does not answer".to_owned(),
        }
        if let Some(process) = process.as_deref_mut()
            && let Some(status) = process.ended()
        {
            return Err(SolverError::NotReady {
                program: name.to_owned(),
                what: format!("{} before it was ready", ending(status)),
                tail: process.tail(),
                killed: is_killed(status),
            });
        }
        if started.elapsed() >= patience {
            return Err(too_late(name, process, patience, &last));
        }
        if !told {
            told = true;
            let seconds = patience.as_secs_f64();
            tracing::warn!(
                "waiting up to {seconds} s for a solver at {name} ({last}): start it there, such as by {ADDRESS}={name} python3 \
                 solver.py (`start_timeout` sets the wait)"
            );
        }
        std::thread::sleep(LOOK);
    }
}

fn not_ready(name: &str, what: String, tail: String) -> SolverError {
    SolverError::NotReady { program: name.to_owned(), what, tail, killed: false }
}

/// What is said of a program that did not answer in time; `last` is what the last attempt ended with.
fn too_late(name: &str, process: Option<&mut Process>, patience: Duration, last: &str) -> SolverError {
    let remedy = match &process {
        Some(_) => format!("it must serve solver.proto where {SOCKET} says"),
        None => "start it there, or give the study its `command`".to_owned(),
    };
    let what = format!("was not ready within {} s ({last}); {remedy}", patience.as_secs_f64());
    not_ready(name, what, process.map(Process::tail).unwrap_or_default())
}
