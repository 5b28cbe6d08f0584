//! Serves the page, and whether the fleet is well, over HTTP, on a thread and a runtime of its own: a slow reader delays no worker.
//!
//! Next file to read: [`super::page`].

use std::net::{SocketAddr, TcpListener};
use std::thread::JoinHandle;

use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio_util::sync::CancellationToken;

use super::page::Source;

/// What the page is, by the specification of OpenMetrics.
const OPENMETRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Why metrics are not served.
#[derive(Debug, thiserror::Error)]
pub enum MetricsError {
    /// The address is taken or does not exist.
    #[error("cannot serve metrics on {address}: {source}; give another address, or port 0 for a free one")]
    Bind {
        /// What was asked for.
        address: SocketAddr,
        /// The system's words.
        source: std::io::Error,
    },
    /// No thread or runtime can start.
    #[error("cannot serve metrics: {0}")]
    Start(std::io::Error),
}

/// An address that is taken, and serves once there is a fleet.
#[derive(Debug)]
pub struct Address {
    listener: TcpListener,
    /// Where it is, with the port that was picked.
    pub address: SocketAddr,
}

/// Serves until it is dropped.
pub struct Server {
    stop: CancellationToken,
    thread: Option<JoinHandle<()>>,
}

impl Address {
    /// Takes an address; port 0 picks a free one.
    ///
    /// # Errors
    /// [`MetricsError::Bind`].
    pub fn take(address: SocketAddr) -> Result<Self, MetricsError> {
        let bind = |source| MetricsError::Bind { address, source };
        let listener = TcpListener::bind(address).map_err(bind)?;
        listener.set_nonblocking(true).map_err(bind)?;
        let address = listener.local_addr().map_err(bind)?;
        Ok(Self { listener, address })
    }
}

impl Server {
    /// Serves `/metrics`, `/healthz` (200 while the fleet's network lives) and `/readyz` (200 while a slot can take runs).
    ///
    /// # Errors
    /// [`MetricsError::Start`].
    pub fn start(at: Address, source: Source) -> Result<Self, MetricsError> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(MetricsError::Start)?;
        let stop = CancellationToken::new();
        let stopped = stop.clone();
        let serve = async move {
            let listener = match tokio::net::TcpListener::from_std(at.listener) {
                Ok(listener) => listener,
                Err(error) => return tracing::warn!(%error, "metrics are not served"),
            };
            let served = axum::serve(listener, router(source)).into_future();
            tokio::select! {
                ended = served => if let Err(error) = ended {
                    tracing::warn!(%error, "metrics are no longer served");
                },
                () = stopped.cancelled() => {}
            }
        };
        let thread = std::thread::Builder::new()
            .name("metrics".to_owned())
            .spawn(move || runtime.block_on(serve))
            .map_err(MetricsError::Start)?;
        Ok(Self { stop, thread: Some(thread) })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.cancel();
        if let Some(thread) = self.thread.take() {
            // A panic in it has been printed already.
            let _ = thread.join();
        }
    }
}

fn router(source: Source) -> Router {
    Router::new()
        .route("/metrics", get(metrics))
        .route("/healthz", get(healthy))
        .route("/readyz", get(ready))
        .with_state(source)
}

async fn metrics(State(source): State<Source>) -> Response {
    match source.page() {
        Ok(Some(page)) => ([(CONTENT_TYPE, OPENMETRICS)], page).into_response(),
        Ok(None) => (StatusCode::SERVICE_UNAVAILABLE, "the fleet is closed\n").into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
    }
}

async fn healthy(State(source): State<Source>) -> (StatusCode, &'static str) {
    match source.read() {
        Some(reading) if !reading.has_ended => (StatusCode::OK, "the fleet is open\n"),
        _ => (StatusCode::SERVICE_UNAVAILABLE, "the fleet's network has ended\n"),
    }
}

async fn ready(State(source): State<Source>) -> (StatusCode, &'static str) {
    match source.read() {
        Some(reading) if reading.census.workers > reading.census.aside => {
            (StatusCode::OK, "workers take runs\n")
        }
        Some(_) => (StatusCode::SERVICE_UNAVAILABLE, "no worker takes runs\n"),
        None => (StatusCode::SERVICE_UNAVAILABLE, "the fleet is closed\n"),
    }
}
