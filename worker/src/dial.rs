//! Dials the coordinator until it answers: the whole way to its Welcome is one attempt, since a listener that is about to
//! close accepts connections and drops them.

use std::time::{Duration, Instant};

use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::words::{causes, status_text};
use starlings_proto::{FRAME_SIZE, FromWorker, Hello, MAX_MESSAGE, ReceivedWindows, ToWorker, Welcome};
use tokio::sync::mpsc::{self, UnboundedSender};
use tokio_stream::wrappers::UnboundedReceiverStream;
use tonic::Streaming;
use tonic::transport::Endpoint;

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

pub(crate) fn endpoint(config: &WorkerConfig) -> Result<Endpoint, WorkerError> {
    let address = &config.connect;
    let bad = || WorkerError::BadAddress { address: address.clone() };
    let bare = address.strip_prefix("http://").unwrap_or(address);
    let port =
        bare.rsplit_once(':').and_then(|(host, port)| port.parse::<u16>().ok().filter(|_| !host.is_empty()));
    port.ok_or_else(bad)?;
    let endpoint = Endpoint::from_shared(format!("http://{bare}")).map_err(|_| bad())?;
    let endpoint = endpoint
        .connect_timeout(ATTEMPT)
        .tcp_nodelay(true)
        .tcp_keepalive(Some(KEEP_ALIVE))
        .initial_stream_window_size(WINDOWS.0)
        .initial_connection_window_size(WINDOWS.1)
        .max_frame_size(FRAME_SIZE);
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
pub(crate) async fn dial(
    config: &WorkerConfig,
    endpoint: &Endpoint,
    hello: &Hello,
) -> Result<Dialled, WorkerError> {
    let started = Instant::now();
    let mut wait = FIRST_WAIT;
    // Local workers may be a moment ahead of whoever listens; others are told what they wait for.
    let mut told = config.lifeline;
    loop {
        let attempt = async {
            let patience = tokio::time::timeout(ATTEMPT, attach(endpoint, hello.clone()));
            patience.await.unwrap_or_else(|_| Err(Attempt::Failed("no answer to Hello".to_owned())))
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
        if waited >= config.patience {
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

async fn attach(endpoint: &Endpoint, hello: Hello) -> Result<Connection, Attempt> {
    let channel = endpoint.connect().await.map_err(|error| Attempt::Failed(causes(&error)))?;
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
