//! What the network does: serves the workers' streams, keeps time, and starts the caller's batches; and the thread that keeps it.

use std::sync::Arc;
use std::time::Duration;

use starlings_proto::driven::Driven;
use starlings_proto::generated::fleet_server::FleetServer;
use starlings_proto::socket::SocketEnd;
use starlings_proto::words::{causes, panic_words};
use starlings_proto::{FRAME_SIZE, MAX_MESSAGE};
use tokio::sync::mpsc::UnboundedReceiver;
use tokio::task::{JoinError, JoinSet};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::UnboundedReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::Server;

use super::dispatcher::{BatchError, Event};
use super::door::Door;
use super::handle::Adopted;
use super::hub::{Hub, Submission};
use super::service::Service;

/// How long a closing fleet waits for its workers to leave.
const GOODBYE_PATIENCE: Duration = Duration::from_secs(2);

/// Longest time between two looks at the clock.
const TICK: Duration = Duration::from_millis(250);

/// Time between HTTP/2 keep-alive pings, and how long one may stay unanswered: far above the silence at which the dispatcher gives
/// a worker up, and above the time that this process may stand still. They only end connections that nobody uses any more.
const KEEP_ALIVE: (Duration, Duration) = (Duration::from_secs(60), Duration::from_secs(30));

/// HTTP/2 windows per stream and per connection, bytes: enough for a long fat network.
const WINDOWS: (u32, u32) = (4 * 1024 * 1024, 16 * 1024 * 1024);

/// Calls of one connection at the same time: a worker makes one, and up to four for large states, two each way.
const STREAMS: u32 = 16;

/// The ways on which workers come.
pub(super) struct Ways {
    /// From anywhere that reaches the address, once it has proved itself.
    pub(super) door: Option<Door>,
    /// Ends of the pairs of sockets that processes of this one hold the other ends of. Nothing else can come on them.
    pub(super) adopted: UnboundedReceiver<Adopted>,
}

/// Keeps the network until it is stopped; then asks the workers to leave and waits shortly for them.
pub(super) fn run(
    network: &Driven,
    ways: Ways,
    hub: &Arc<Hub>,
    heartbeat: Duration,
    submitted: UnboundedReceiver<Submission>,
    (cancel, stop): (CancellationToken, CancellationToken),
) -> Result<(), String> {
    let served = network.keep(serve(ways, Arc::clone(hub), heartbeat, submitted, cancel, stop));
    let outcome = served.unwrap_or_else(|ended| Err(task_ended(Err(ended))));
    if let Err(reason) = &outcome {
        hub.stopped(reason);
    }
    outcome
}

async fn serve(
    ways: Ways,
    hub: Arc<Hub>,
    heartbeat: Duration,
    submitted: UnboundedReceiver<Submission>,
    cancel: CancellationToken,
    stop: CancellationToken,
) -> Result<(), String> {
    let Ways { door, adopted } = ways;
    let opened = door.map(|door| Ok((door.check(), door.open()?))).transpose();
    let opened = opened.map_err(|error: std::io::Error| error.to_string())?;
    let mut tasks = JoinSet::new();
    tasks.spawn(tick(Arc::clone(&hub), heartbeat));
    tasks.spawn(beat(Arc::clone(&hub), heartbeat));
    tasks.spawn(submit(Arc::clone(&hub), submitted, cancel.clone()));
    tasks.spawn(abort_on_cancel(Arc::clone(&hub), cancel));
    let service = service(&hub);
    let server = || {
        Server::builder()
            .http2_keepalive_interval(Some(KEEP_ALIVE.0))
            .http2_keepalive_timeout(Some(KEEP_ALIVE.1))
            .initial_stream_window_size(WINDOWS.0)
            .initial_connection_window_size(WINDOWS.1)
            .max_frame_size(FRAME_SIZE)
            .max_concurrent_streams(Some(STREAMS))
    };
    let inherited = UnboundedReceiverStream::new(adopted).map(|adopted| {
        SocketEnd::new(adopted.connection).map(|end| end.with_descriptors(adopted.descriptors))
    });
    let listening = async {
        match opened {
            Some((check, incoming)) => {
                let checked = InterceptedService::new(service.clone(), check);
                server().add_service(checked).serve_with_incoming(incoming).await
            }
            None => std::future::pending().await,
        }
    };
    let server = async {
        tokio::select! {
            ended = listening => ended,
            // The handles of the fleet hold its other end open.
            ended = server().add_service(service.clone()).serve_with_incoming(inherited) => ended,
        }
    };
    tokio::select! {
        ended = server => Err(ended.err().map_or_else(|| "its server ended".to_owned(), |error| causes(&error))),
        Some(ended) = tasks.join_next() => Err(task_ended(ended)),
        () = drained(&hub, &stop) => Ok(()),
    }
}

/// What answers workers.
fn service(hub: &Arc<Hub>) -> FleetServer<Service> {
    FleetServer::new(Service { hub: Arc::clone(hub) })
        .max_decoding_message_size(MAX_MESSAGE)
        .max_encoding_message_size(MAX_MESSAGE)
}

/// Why the fleet cannot go on without one of its tasks.
fn task_ended(ended: Result<(), JoinError>) -> String {
    match ended.map_err(JoinError::try_into_panic) {
        Err(Ok(panic)) => format!("a part of it panicked: {}", panic_words(panic.as_ref())),
        _ => "a part of it ended".to_owned(),
    }
}

async fn tick(hub: Arc<Hub>, heartbeat: Duration) {
    let mut ticks = tokio::time::interval(TICK.min(heartbeat / 4));
    loop {
        ticks.tick().await;
        hub.handle(Event::Tick);
    }
}

async fn beat(hub: Arc<Hub>, heartbeat: Duration) {
    let mut beats = tokio::time::interval(heartbeat);
    loop {
        beats.tick().await;
        hub.beat();
    }
}

/// Starts batches on this thread: all first jobs of a link are queued before it writes, so they leave in one packet.
async fn submit(hub: Arc<Hub>, mut submitted: UnboundedReceiver<Submission>, cancel: CancellationToken) {
    while let Some(batch) = submitted.recv().await {
        hub.submit(batch);
        if cancel.is_cancelled() {
            hub.handle(Event::Abort(BatchError::Cancelled));
        }
    }
    // The caller is gone; the drain follows.
    std::future::pending::<()>().await;
}

async fn abort_on_cancel(hub: Arc<Hub>, cancel: CancellationToken) {
    cancel.cancelled().await;
    hub.handle(Event::Abort(BatchError::Cancelled));
    // Done, but not ended: the end of a task ends the fleet.
    std::future::pending::<()>().await;
}

/// Waits for the stop, asks the workers to leave, and returns when they did or time is up.
async fn drained(hub: &Hub, stop: &CancellationToken) {
    stop.cancelled().await;
    hub.handle(Event::Abort(BatchError::Cancelled));
    hub.drain(hub.last_word());
    let empty = async {
        loop {
            let mut ended = std::pin::pin!(hub.link_ended.notified());
            ended.as_mut().enable();
            if hub.n_links() == 0 {
                return;
            }
            ended.await;
        }
    };
    let _ = tokio::time::timeout(GOODBYE_PATIENCE, empty).await;
}
