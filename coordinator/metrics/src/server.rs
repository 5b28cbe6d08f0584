//! Serves over HTTP, on a thread and a runtime of its own: a slow reader delays no worker.
//!
//! What is served is a router of the caller's. Next file to read: [`super::routes`], for the metrics.

use std::net::{SocketAddr, TcpListener};
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use tokio_util::sync::CancellationToken;

/// Why something is not served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is taken or does not exist.
    #[error("cannot serve {what} on {address}: {source}; give another address, or port 0 for a free one")]
    Bind {
        /// What was to be served.
        what: &'static str,
        /// What was asked for.
        address: SocketAddr,
        /// The system's words.
        source: std::io::Error,
    },
    /// No thread or runtime can start.
    #[error("cannot serve {what}: {source}")]
    Start {
        /// What was to be served.
        what: &'static str,
        /// The system's words.
        source: std::io::Error,
    },
}

/// An address that is taken, and serves once there is a fleet.
#[derive(Debug)]
pub struct Address {
    listener: TcpListener,
    what: &'static str,
    /// Where it is, with the port that was picked.
    pub address: SocketAddr,
}

/// Serves until it is dropped.
pub struct Server {
    stop: CancellationToken,
    thread: Option<JoinHandle<()>>,
}

impl Address {
    /// Takes an address for what messages call `what`; port 0 picks a free one.
    ///
    /// # Errors
    /// [`ServeError::Bind`].
    pub fn take(address: SocketAddr, what: &'static str) -> Result<Self, ServeError> {
        let bind = |source| ServeError::Bind { what, address, source };
        let listener = TcpListener::bind(address).map_err(bind)?;
        listener.set_nonblocking(true).map_err(bind)?;
        let address = listener.local_addr().map_err(bind)?;
        Ok(Self { listener, what, address })
    }
}

impl Server {
    /// Serves a router. When it is dropped, answers that are on their way have `grace` to arrive.
    ///
    /// # Errors
    /// [`ServeError::Start`].
    pub fn start(at: Address, router: Router, grace: Duration) -> Result<Self, ServeError> {
        let Address { listener, what, .. } = at;
        let failed = |source| ServeError::Start { what, source };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let stop = CancellationToken::new();
        let (begins, ends) = (stop.clone(), stop.clone());
        let serve = async move {
            let listener = match tokio::net::TcpListener::from_std(listener) {
                Ok(listener) => listener,
                Err(error) => return tracing::warn!(%error, "{what} are not served"),
            };
            let served = axum::serve(listener, router).with_graceful_shutdown(begins.cancelled_owned());
            let over = async {
                ends.cancelled().await;
                tokio::time::sleep(grace).await;
            };
            tokio::select! {
                ended = served.into_future() => if let Err(error) = ended {
                    tracing::warn!(%error, "{what} are no longer served");
                },
                () = over => {}
            }
        };
        let thread = std::thread::Builder::new()
            .name("http".to_owned())
            .spawn(move || runtime.block_on(serve))
            .map_err(failed)?;
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
