//! A worker: dials the coordinator, builds the setups it is sent, runs jobs, answers each once.
//!
//! Every slot computes on a thread of its own, and drives the network while it waits for a job; the calling thread does while all
//! compute, so a model that never yields delays no heartbeat. A worker keeps nothing between jobs that a job needs: built setups
//! are a cache. No decision about retries is taken here. Next files to read: [`config`], then `session` for one session with a
//! coordinator and `slots` for the threads that compute.

mod blocks;
pub mod config;
mod dial;
mod held;
mod held_answers;
mod idle;
mod inbox;
mod news;
mod outbox;
mod patience;
mod pieces;
mod session;
mod setups;
mod shared;
mod slots;
mod spare;
mod transfer;
mod watch;
mod way;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

pub use config::WorkerConfig;
use dial::{Connection, Dialled};
pub use held::HoldLimits;
use held::delivery::Delivery;
use held::{Held, Run};
use idle::Idle;
pub use news::{News, Tell};
use outbox::Outbox;
use patience::Patience;
use session::Ended;
use slots::Slots;
pub use starlings_models::Factory;
pub use starlings_pieces::PlaceName;
pub use starlings_proto::access::AccessError;
use starlings_proto::driven::Driven;
use starlings_proto::{FromWorker, HeldRun, JobKey, Welcome};
pub use starlings_proto::{INHERITED, LIFELINE, MAX_SLOTS};
pub use starlings_sums::Reading;
use way::Way;
pub use way::check_address;

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
        "no coordinator at {address} for {waited:.0} s ({last}): is it running, and is the address right?{}", told(*dropped)
    )]
    NoCoordinator {
        /// The address dialled.
        address: String,
        /// How long, seconds.
        waited: f64,
        /// What the last attempt said.
        last: String,
        /// Results and runs of an earlier session that are lost with the worker.
        dropped: usize,
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
    /// The access file is of no use.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// The access file is of a run that has ended.
    #[error(
        "the run `{run}` of the access file {} has ended: start a coordinator with --access {}, or the worker with --stay to wait \
         for one",
        file.display(),
        file.display()
    )]
    Ended {
        /// The file.
        file: PathBuf,
        /// Name of the run.
        run: String,
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

/// What is lost with a worker, as the end of a sentence.
fn told(dropped: usize) -> String {
    match dropped {
        0 => String::new(),
        n => format!(
            " {n} of its runs, finished or begun, are dropped and made again by others (`--patience` sets how long a worker keeps them)"
        ),
    }
}

/// Serves coordinators at one address until the run is over, the worker is cancelled, or nobody answers any more.
///
/// Returns at once when it ends, even while a job computes: its threads are left behind for the process to end.
///
/// # Errors
/// [`WorkerError`]; a lost connection is none, unless nobody answers within the patience afterwards.
pub fn run(config: WorkerConfig) -> Result<WorkerReport, WorkerError> {
    if config.slots > MAX_SLOTS {
        return Err(WorkerError::TooManySlots { slots: config.slots });
    }
    // One that ends with its connection has nobody to bring results to.
    let lasts = !config.once && config.connect != INHERITED;
    let held = lasts.then(|| Arc::new(Held::new(config.hold, &config.scratch)));
    let network = Arc::new(Driven::new().map_err(WorkerError::Start)?);
    let slots =
        Slots::start(config.slots.max(1), held.clone(), Arc::clone(&network)).map_err(WorkerError::Start)?;
    let (config, served) = (Arc::new(config), slots.clone());
    let work = {
        let config = Arc::clone(&config);
        async move { serve(&config, &served, held.as_ref()).await }
    };
    let result = network.keep(work).unwrap_or_else(|ended| std::panic::resume_unwind(ended.into_panic()));
    slots.close();
    if let Ok(WorkerReport { reason, predictions, failures, .. }) = &result {
        (config.tell)(&News::Ended { reason: reason.clone(), answered: predictions + failures });
    }
    result
}

async fn serve(
    config: &WorkerConfig,
    slots: &Slots,
    held: Option<&Arc<Held>>,
) -> Result<WorkerReport, WorkerError> {
    let way = Way::of(config)?;
    let setups = setups::Setups::new(starlings_sums::factory(Arc::clone(&config.factory), config.reading));
    let hello = config.hello();
    let mut sessions = 0;
    let mut idle = config.stay.map(Idle::new);
    let mut owes = None;
    let mut is_told = false;
    loop {
        let seen = held.and_then(|held| held.run());
        let mut patience = Patience::new(config.patience, idle.as_mut(), slots, owes, is_told);
        let connection = match dial::dial(config, &way, &hello, &mut patience, seen).await? {
            Dialled::Connected(connection) => connection,
            other => {
                let dropped = told(patience.dropped());
                let end = if dropped.is_empty() { "" } else { ";" };
                let reason = unserved(&other, sessions, idle.as_ref()) + end + &dropped;
                return Ok(report(slots, sessions, &reason));
            }
        };
        sessions += 1;
        tracing::info!(run = connection.welcome.run, address = connection.address, "joined");
        let stayed_since = Instant::now();
        begin(config, slots, held, &connection);
        idle.iter_mut().for_each(Idle::begin);
        let outbox = connection.outbox.clone();
        let ended = session::serve(*connection, slots, &setups, held, config, idle.as_mut()).await;
        outbox.end();
        if let Some(held) = held {
            held.disconnected();
        }
        owes = held.map(AsRef::as_ref).filter(|_| matches!(ended, Ended::Lost(_)));
        is_told = owes.is_none();
        if owes.is_some() {
            slots.detach();
        } else {
            slots.forget();
        }
        if let Some(idle) = &mut idle {
            idle.look(slots, false);
        }
        tracing::info!(?ended, seconds = stayed_since.elapsed().as_secs_f64(), "left");
        match (ended, &idle) {
            (Ended::Drained(reason), Some(idle)) => {
                (config.tell)(&News::Stays { reason, left: idle.left() });
            }
            (Ended::Drained(reason), None) | (Ended::Idle(reason), _) => {
                return Ok(report(slots, sessions, &reason));
            }
            (Ended::Cancelled, _) => return Ok(report(slots, sessions, "cancelled")),
            (Ended::Lost(reason), _) if config.once || way.is_inherited() => {
                return Ok(report(slots, sessions, &reason));
            }
            (Ended::Lost(reason), _) => {
                let (running, queued) = slots.load();
                (config.tell)(&News::Lost { reason, computing: (running + queued) as usize });
            }
        }
    }
}

/// Why a worker ends that is not connected.
fn unserved(dialled: &Dialled, sessions: u64, idle: Option<&Idle>) -> String {
    match dialled {
        Dialled::Idle => idle.map(Idle::reason).unwrap_or_default(),
        Dialled::Over(reason) => reason.clone(),
        Dialled::Cancelled if sessions == 0 => "cancelled before it was connected".to_owned(),
        Dialled::Cancelled | Dialled::Connected(_) => "cancelled".to_owned(),
    }
}

/// Tells a coordinator what is held for its run, or forgets it where it is for another one.
fn begin(config: &WorkerConfig, slots: &Slots, held: Option<&Arc<Held>>, connection: &Connection) {
    let Welcome { run, run_id, incarnation, epoch, .. } = &connection.welcome;
    let (run, address) = (run.clone(), connection.address.clone());
    (config.tell)(&News::Connected { run, address, slots: config.slots.max(1), epoch: *epoch });
    if let Some(news) = &connection.sharing {
        (config.tell)(news);
    }
    let Some(held) = held else { return };
    if !held.connected(Run { id: *run_id, incarnation: *incarnation }) {
        slots.forget();
    }
    let outbox = connection.outbox.clone();
    let finished = held.len();
    let going_on = slots.attach(outbox.clone());
    let computing = going_on.len();
    if finished + computing > 0 {
        deliver(held.delivery(PORTION), [going_on, held.large()].concat(), outbox);
        (config.tell)(&News::Delivered { finished, computing });
    }
}

/// Sends what goes on and what is held, a portion when there is room for it.
fn deliver(mut delivery: Delivery, going_on: Vec<JobKey>, outbox: Outbox) {
    let mut first = delivery.next().unwrap_or_default();
    // What goes on is in the first message: it is given away otherwise.
    first.extend(going_on.into_iter().map(|key| HeldRun { key, ended: None }));
    outbox.send(FromWorker::Held(first));
    let rest = move || {
        if delivery.all(|runs| outbox.send_when_room(FromWorker::Held(runs))) {
            delivery.ended();
        }
    };
    if let Err(error) = std::thread::Builder::new().name("held-results".to_owned()).spawn(rest) {
        tracing::warn!(
            "the rest of the results that are held is not sent, their runs are made again: {error}"
        );
    }
}

/// Bytes of results in one message.
const PORTION: usize = 1 << 20;

fn report(slots: &Slots, sessions: u64, reason: &str) -> WorkerReport {
    let (predictions, failures) = slots.answered();
    WorkerReport { predictions, failures, sessions, reason: reason.to_owned() }
}
