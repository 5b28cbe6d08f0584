//! Dials the coordinator until it answers: the whole way to its Welcome is one attempt, since a listener that is about to
//! close accepts connections and drops them.

use std::time::{Duration, Instant};

use starlings_pieces::PlaceName;
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::words::status_text;
use starlings_proto::{FromWorker, Hello, MAX_MESSAGE, ReceivedWindows, ToWorker, Welcome};
use tonic::Streaming;

use crate::held::Run;
use crate::news::News;
use crate::outbox::Outbox;
use crate::patience::Patience;
use crate::transfer::{Compared, Transfers};
use crate::way::{ATTEMPT, NoWay, Way};
use crate::{WorkerConfig, WorkerError, shared};

/// Wait after the first refusal; grows by half each time, up to [`LONGEST_WAIT`].
const FIRST_WAIT: Duration = Duration::from_millis(50);

/// Longest wait between two attempts.
const LONGEST_WAIT: Duration = Duration::from_secs(2);

/// An open stream whose Welcome has arrived.
pub(crate) struct Connection {
    /// Where the coordinator is.
    pub(crate) address: String,
    pub(crate) welcome: Welcome,
    pub(crate) outbox: Outbox,
    pub(crate) inbound: Streaming<generated::ToWorker>,
    /// The named windows that have arrived.
    pub(crate) windows: ReceivedWindows,
    /// The way of large states.
    pub(crate) transfers: Transfers,
    /// What is to be said of the folder for states.
    pub(crate) sharing: Option<News>,
}

pub(crate) enum Dialled {
    Connected(Box<Connection>),
    /// The coordinator is there, but its run is over.
    Over(String),
    Cancelled,
    /// A worker that stays was not needed for as long as it waits.
    Idle,
}

enum Attempt {
    Failed(String),
    Refused(String),
    Over(String),
}

impl From<NoWay> for Attempt {
    fn from(none: NoWay) -> Self {
        match none {
            NoWay::Failed(text) => Self::Failed(text),
            NoWay::Ended(text) => Self::Over(text),
        }
    }
}

/// Dials until a coordinator welcomes, refuses, or patience ends. A worker that stays waits for the next one where a run is over.
///
/// `seen` is the run that was served last: an earlier start of it is not served.
///
/// # Errors
/// When nobody answers within the patience, or the coordinator refuses.
pub(crate) async fn dial(
    config: &WorkerConfig,
    way: &Way,
    hello: &Hello,
    patience: &mut Patience<'_>,
    seen: Option<Run>,
) -> Result<Dialled, WorkerError> {
    let stays = config.stay.is_some();
    let started = Instant::now();
    let (mut wait, mut told) = (FIRST_WAIT, None::<String>);
    loop {
        let attempt = async {
            let attached = attach(way, hello.clone(), config.states.as_ref());
            let attached = tokio::time::timeout(ATTEMPT, attached).await;
            let attached = attached.unwrap_or_else(|_| Err(Attempt::Failed("no answer to Hello".to_owned())));
            attached.and_then(|connection| current(connection, seen))
        };
        let last = tokio::select! {
            () = config.cancel.cancelled() => return Ok(Dialled::Cancelled),
            attached = attempt => match attached {
                Ok(connection) => return Ok(Dialled::Connected(Box::new(connection))),
                Err(Attempt::Refused(reason)) => {
                    return Err(WorkerError::Refused { address: way.name(), reason });
                }
                Err(Attempt::Over(reason)) if !stays => return Ok(Dialled::Over(reason)),
                Err(Attempt::Failed(last) | Attempt::Over(last)) => last,
            },
        };
        let left = patience.left();
        if left.is_zero() || way.is_inherited() {
            if stays {
                return Ok(Dialled::Idle);
            }
            let (address, waited) = (way.name(), started.elapsed().as_secs_f64());
            return Err(WorkerError::NoCoordinator { address, waited, last, dropped: patience.dropped() });
        }
        // An access file that was missing, and now leads to where nobody answers, is news.
        let address = way.name();
        let leads_elsewhere = told.replace(address.clone()).is_some_and(|told| told != address);
        if std::mem::replace(&mut patience.is_told, true) && !leads_elsewhere {
            tracing::debug!(last, "dialling again");
        } else {
            (config.tell)(&News::Waiting { address, last, left, option: patience.option() });
        }
        // Spread by the process's nonce, so that a thousand workers do not dial at the same moment.
        let spread = 0.5 + (hello.nonce % 1024) as f64 / 2048.0;
        tokio::select! {
            () = config.cancel.cancelled() => return Ok(Dialled::Cancelled),
            () = tokio::time::sleep(wait.mul_f64(spread).min(left)) => {}
        }
        wait = (wait * 3 / 2).min(LONGEST_WAIT);
    }
}

/// Refuses a coordinator whose run was started again since it began.
fn current(connection: Connection, seen: Option<Run>) -> Result<Connection, Attempt> {
    let Welcome { run, run_id, incarnation, .. } = &connection.welcome;
    match seen.filter(|seen| seen.id == *run_id && seen.incarnation > *incarnation) {
        None => Ok(connection),
        Some(seen) => Err(Attempt::Failed(format!(
            "the coordinator there is start {incarnation} of the run `{run}`, and this worker has worked for start {} of it: end the \
             earlier one",
            seen.incarnation
        ))),
    }
}

async fn attach(way: &Way, hello: Hello, states: Option<&PlaceName>) -> Result<Connection, Attempt> {
    let (channel, address) = way.open().await?;
    let mut client = FleetClient::new(channel)
        .max_decoding_message_size(MAX_MESSAGE)
        .max_encoding_message_size(MAX_MESSAGE);
    let (outbox, outgoing) = Outbox::new();
    let failed = |text: &str| Attempt::Failed(text.to_owned());
    let nonce = hello.nonce;
    outbox.send(FromWorker::Hello(hello));
    let silent = |status: &tonic::Status| failed(&(status_text(status) + way.hint()));
    let response = client.work(outgoing).await.map_err(|s| silent(&s))?;
    let mut inbound = response.into_inner();
    let mut windows = ReceivedWindows::default();
    let first = inbound.message().await.map_err(|s| failed(&status_text(&s)))?;
    match first.map(|message| ToWorker::decode(message, &mut windows)) {
        Some(Ok(ToWorker::Welcome(welcome))) => {
            let (folder, sharing) = shared::find(states, &welcome).await;
            if folder.is_some() {
                outbox.send(FromWorker::SharesStates);
            }
            let beside = (way.descriptors(), Compared::new(way.is_safe()));
            let transfers = Transfers::new(client, (welcome.epoch, nonce), folder, beside);
            Ok(Connection { address, welcome, outbox, inbound, windows, transfers, sharing })
        }
        Some(Ok(ToWorker::Refuse(reason))) => Err(Attempt::Refused(reason)),
        Some(Ok(ToWorker::Drain(reason))) => Err(Attempt::Over(reason)),
        Some(Ok(_)) => Err(failed("it did not answer with a Welcome")),
        Some(Err(error)) => Err(failed(&error.to_string())),
        None => Err(failed("it closed the connection")),
    }
}
