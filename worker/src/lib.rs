//! A worker: dials the coordinator, builds the setups it is sent, runs jobs, answers each once.
//!
//! The network lives on the calling thread; every slot computes on a thread of its own, so a model that never yields delays
//! no heartbeat. A worker keeps nothing between jobs that a job needs: built setups are a cache. No decision about retries
//! is taken here. Next files to read: [`config`], then `session` for one session with a coordinator and `slots` for the threads
//! that compute.

pub mod config;
mod dial;
mod inbox;
mod session;
mod setups;
mod slots;
mod spare;
mod transfer;

use std::sync::Arc;
use std::time::Instant;

pub use config::WorkerConfig;
use dial::Dialled;
use session::Ended;
use slots::Slots;
pub use starlings_models::Factory;
pub use starlings_proto::{LIFELINE, MAX_SLOTS};

/// What a worker did until it ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerReport {
    /// Jobs answered with a prediction.
    pub predictions: u64,
    /// Jobs answered with a failure.
    pub failures: u64,
    /// Sessions with a coordinator.
    pub sessions: u64,
    /// Why it ended, one sentence.
    pub reason: String,
}

/// Why a worker could not serve.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// No coordinator answered in time.
    #[error(
        "no coordinator at {address} for {waited:.0} s ({last}): is it running, and is the address right?"
    )]
    NoCoordinator {
        /// The address dialled.
        address: String,
        /// How long, seconds.
        waited: f64,
        /// What the last attempt said.
        last: String,
    },
    /// The coordinator does not take this worker.
    #[error("the coordinator at {address} refused this worker: {reason}")]
    Refused {
        /// The address dialled.
        address: String,
        /// Its words.
        reason: String,
    },
    /// The address is no `host:port`.
    #[error("`{address}` is no address: expected host:port, such as 127.0.0.1:7000")]
    BadAddress {
        /// The address given.
        address: String,
    },
    /// The standard input is to be the connection and is no socket.
    #[error("the standard input is no connection to a coordinator ({0}): give --connect HOST:PORT")]
    NoSocket(std::io::Error),
    /// More slots than a worker may have.
    #[error("{slots} slots: a worker has at most {MAX_SLOTS}; start several workers instead")]
    TooManySlots {
        /// The number asked for.
        slots: usize,
    },
    /// The system gives no thread or no network.
    #[error("the worker cannot start: {0}")]
    Start(std::io::Error),
}

/// Serves coordinators at one address until the run is over, the worker is cancelled, or nobody answers any more.
///
/// Returns at once when it ends, even while a job computes: its threads are left behind for the process to end.
///
/// # Errors
/// [`WorkerError`]; a lost connection is none, unless nobody answers within the patience afterwards.
#[expect(clippy::needless_pass_by_value, reason = "a worker owns what it was told")]
pub fn run(config: WorkerConfig) -> Result<WorkerReport, WorkerError> {
    if config.slots > MAX_SLOTS {
        return Err(WorkerError::TooManySlots { slots: config.slots });
    }
    let slots = Slots::start(config.slots.max(1)).map_err(WorkerError::Start)?;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(WorkerError::Start)?;
    let result = runtime.block_on(serve(&config, &slots));
    slots.close();
    runtime.shutdown_background();
    result
}

async fn serve(config: &WorkerConfig, slots: &Slots) -> Result<WorkerReport, WorkerError> {
    let way = dial::way(config)?;
    let setups = setups::Setups::new(Arc::clone(&config.factory));
    let hello = config.hello();
    let mut sessions = 0;
    loop {
        let connection = match dial::dial(config, &way, &hello).await? {
            Dialled::Cancelled => return Ok(report(slots, sessions, "cancelled before it was connected")),
            Dialled::Over(reason) => return Ok(report(slots, sessions, &reason)),
            Dialled::Connected(connection) => connection,
        };
        sessions += 1;
        tracing::info!(run = connection.welcome.run, address = config.connect, "joined");
        let stayed_since = Instant::now();
        let ended = session::serve(*connection, slots, &setups, config).await;
        slots.forget_queue();
        tracing::info!(?ended, seconds = stayed_since.elapsed().as_secs_f64(), "left");
        match ended {
            Ended::Drained(reason) => return Ok(report(slots, sessions, &reason)),
            Ended::Cancelled => return Ok(report(slots, sessions, "cancelled")),
            Ended::Lost(reason) if config.once || way.is_inherited() => {
                return Ok(report(slots, sessions, &reason));
            }
            Ended::Lost(_) => {}
        }
    }
}

fn report(slots: &Slots, sessions: u64, reason: &str) -> WorkerReport {
    let (predictions, failures) = slots.answered();
    WorkerReport { predictions, failures, sessions, reason: reason.to_owned() }
}
