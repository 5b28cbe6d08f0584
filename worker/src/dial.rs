//! Dials the coordinator until it answers: the whole way to its Welcome is one attempt, since a listener that is about to
//! close accepts connections and drops them.

use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use hyper_util::rt::TokioIo;
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::words::{causes, status_text};
use starlings_proto::{
    FRAME_SIZE, FromWorker, Hello, INHERITED, MAX_MESSAGE, ReceivedWindows, ToWorker, Welcome,
};
use tokio::sync::mpsc::{self, UnboundedSender};
use tokio_stream::wrappers::UnboundedReceiverStream;
use tonic::Streaming;
use tonic::transport::{Channel, Endpoint, Uri};
use tower::service_fn;

use crate::held::Run;
use crate::{WorkerConfig, WorkerError};

/// Longest time for one attempt.
const ATTEMPT: Duration = Duration::from_secs(10);

/// Wait after the first refusal; grows by half each time, up to [`LONGEST_WAIT`].
const FIRST_WAIT: Duration = Duration::from_millis(50);

/// Longest wait between two attempts.
const LONGEST_WAIT: Duration = Duration::from_secs(2);

/// Time between HTTP/2 keep-alive pings: far above the silence at which either side acts, since it is only for connections that
/// neither side would otherwise notice to be dead.
const KEEP_ALIVE: Duration = Duration::from_secs(60);

/// How long such a ping may stay unanswered.
const KEEP_ALIVE_PATIENCE: Duration = Duration::from_secs(30);

/// HTTP/2 windows per stream and per connection, bytes.
const WINDOWS: (u32, u32) = (4 * 1024 * 1024, 16 * 1024 * 1024);

/// An open stream whose Welcome has arrived.
pub(crate) struct Connection {
    pub(crate) welcome: Welcome,
    pub(crate) outbox: UnboundedSender<generated::FromWorker>,
    pub(crate) inbound: Streaming<generated::ToWorker>,
    /// The named windows that have arrived.
    pub(crate) windows: ReceivedWindows,
}

pub(crate) enum Dialled {
    Connected(Box<Connection>),
    /// The coordinator is there, but its run is over.
    Over(String),
    Cancelled,
}

enum Attempt {
    Failed(String),
    Refused(String),
    Over(String),
}

/// The way to the coordinator.
pub(crate) enum Way {
    /// Dialled, as often as it is needed.
    Dialled(Endpoint),
    /// The standard input, which is there already, and once.
    Inherited(Endpoint, UnixStream),
}

impl Way {
    pub(crate) fn is_inherited(&self) -> bool {
        matches!(self, Self::Inherited(..))
    }

    async fn open(&self) -> Result<Channel, String> {
        match self {
            Self::Dialled(endpoint) => endpoint.connect().await.map_err(|error| causes(&error)),
            Self::Inherited(endpoint, socket) => {
                let socket = socket.try_clone().and_then(|socket| {
                    socket.set_nonblocking(true)?;
                    tokio::net::UnixStream::from_std(socket)
                });
                let mut socket = Some(socket);
                let connect = move |_: Uri| {
                    let taken =
                        || Err(std::io::Error::other("the standard input was the connection already"));
                    std::future::ready(socket.take().unwrap_or_else(taken).map(TokioIo::new))
                };
                endpoint.connect_with_connector(service_fn(connect)).await.map_err(|error| causes(&error))
            }
        }
    }
}

/// The way that the worker was told.
///
/// # Errors
/// When it was told no address, or its standard input is no socket where that is the way.
pub(crate) fn way(config: &WorkerConfig) -> Result<Way, WorkerError> {
    if config.connect != INHERITED {
        return Ok(Way::Dialled(endpoint(config)?));
    }
    let own = std::io::stdin().as_fd().try_clone_to_owned().map_err(WorkerError::NoSocket)?;
    let socket = UnixStream::from(own);
    socket.peer_addr().map_err(WorkerError::NoSocket)?;
    // The address is never resolved.
    Ok(Way::Inherited(with_windows(Endpoint::from_static("http://coordinator")), socket))
}

fn with_windows(endpoint: Endpoint) -> Endpoint {
    endpoint
        .initial_stream_window_size(WINDOWS.0)
        .initial_connection_window_size(WINDOWS.1)
        .max_frame_size(FRAME_SIZE)
}

fn endpoint(config: &WorkerConfig) -> Result<Endpoint, WorkerError> {
    let address = &config.connect;
    let bad = || WorkerError::BadAddress { address: address.clone() };
    let bare = address.strip_prefix("http://").unwrap_or(address);
    let port =
        bare.rsplit_once(':').and_then(|(host, port)| port.parse::<u16>().ok().filter(|_| !host.is_empty()));
    port.ok_or_else(bad)?;
    let endpoint = Endpoint::from_shared(format!("http://{bare}")).map_err(|_| bad())?;
    let endpoint =
        with_windows(endpoint).connect_timeout(ATTEMPT).tcp_nodelay(true).tcp_keepalive(Some(KEEP_ALIVE));
    if config.once {
        // TCP's keep-alive alone: the system answers it even for a coordinator that is stopped, and not for a host that is gone.
        return Ok(endpoint);
    }
    Ok(endpoint
        .http2_keep_alive_interval(KEEP_ALIVE)
        .keep_alive_timeout(KEEP_ALIVE_PATIENCE)
        .keep_alive_while_idle(true))
}

/// Dials until a coordinator welcomes, refuses, or patience ends.
///
/// `seen` is the run that was served last: an earlier start of it is not served.
///
/// # Errors
/// When nobody answers within the patience, or the coordinator refuses.
pub(crate) async fn dial(
    config: &WorkerConfig,
    way: &Way,
    hello: &Hello,
    seen: Option<Run>,
) -> Result<Dialled, WorkerError> {
    let started = Instant::now();
    let mut wait = FIRST_WAIT;
    let mut told = false;
    loop {
        let attempt = async {
            let patience = tokio::time::timeout(ATTEMPT, attach(way, hello.clone()));
            let attached = patience.await;
            let attached = attached.unwrap_or_else(|_| Err(Attempt::Failed("no answer to Hello".to_owned())));
            attached.and_then(|connection| current(connection, seen))
        };
        let last = tokio::select! {
            () = config.cancel.cancelled() => return Ok(Dialled::Cancelled),
            attached = attempt => match attached {
                Ok(connection) => return Ok(Dialled::Connected(Box::new(connection))),
                Err(Attempt::Refused(reason)) => {
                    return Err(WorkerError::Refused { address: config.connect.clone(), reason });
                }
                Err(Attempt::Over(reason)) => return Ok(Dialled::Over(reason)),
                Err(Attempt::Failed(last)) => last,
            },
        };
        let waited = started.elapsed();
        if waited >= config.patience || way.is_inherited() {
            let address = config.connect.clone();
            return Err(WorkerError::NoCoordinator { address, waited: waited.as_secs_f64(), last });
        }
        if told {
            tracing::debug!(last, "dialling again");
        } else {
            told = true;
            let (address, patience) = (&config.connect, config.patience.as_secs_f64());
            tracing::warn!(
                "no coordinator at {address} yet ({last}): dialling for up to {patience} s (`--patience` sets the wait)"
            );
        }
        // Spread by the process's nonce, so that a thousand workers do not dial at the same moment.
        let spread = 0.5 + (hello.nonce % 1024) as f64 / 2048.0;
        tokio::select! {
            () = config.cancel.cancelled() => return Ok(Dialled::Cancelled),
            () = tokio::time::sleep(wait.mul_f64(spread).min(config.patience.saturating_sub(waited))) => {}
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

async fn attach(way: &Way, hello: Hello) -> Result<Connection, Attempt> {
    let channel = way.open().await.map_err(Attempt::Failed)?;
    let mut client = FleetClient::new(channel)
        .max_decoding_message_size(MAX_MESSAGE)
        .max_encoding_message_size(MAX_MESSAGE);
    let (outbox, outgoing) = mpsc::unbounded_channel();
    let failed = |text: &str| Attempt::Failed(text.to_owned());
    let hello = FromWorker::Hello(hello).encode().map_err(|error| failed(&error.to_string()))?;
    let _ = outbox.send(hello);
    let response =
        client.work(UnboundedReceiverStream::new(outgoing)).await.map_err(|s| failed(&status_text(&s)))?;
    let mut inbound = response.into_inner();
    let mut windows = ReceivedWindows::default();
    let first = inbound.message().await.map_err(|s| failed(&status_text(&s)))?;
    match first.map(|message| ToWorker::decode(message, &mut windows)) {
        Some(Ok(ToWorker::Welcome(welcome))) => Ok(Connection { welcome, outbox, inbound, windows }),
        Some(Ok(ToWorker::Refuse(reason))) => Err(Attempt::Refused(reason)),
        Some(Ok(ToWorker::Drain(reason))) => Err(Attempt::Over(reason)),
        Some(Ok(_)) => Err(failed("it did not answer with a Welcome")),
        Some(Err(error)) => Err(failed(&error.to_string())),
        None => Err(failed("it closed the connection")),
    }
}
