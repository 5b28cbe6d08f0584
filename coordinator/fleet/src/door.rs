//! The door of a fleet that listens: callers prove themselves before anything of the run is said or read.
//!
//! A caller comes as a connection. It speaks TLS, unless the door is open to all, and sends the token with its first call; until
//! then it is a stranger. There are at most [`strangers::MOST`] strangers at a time, the oldest of which makes room for the next,
//! and each has [`PATIENCE`] to prove itself. Next files to read: [`strangers`], [`connection`], then [`check`] for the token.

mod check;
mod connection;
mod refusals;
mod strangers;

use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;

use tokio::io::BufReader;
use tokio::net::TcpStream;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio_rustls::TlsAcceptor;
use tokio_stream::wrappers::UnboundedReceiverStream;

use super::access::Secrets;
pub(super) use check::Check;
use connection::Connection;
pub(super) use refusals::Refusals;
pub use refusals::Refused;
use refusals::Why;
use strangers::{Caller, Strangers};

/// How long a caller may take from its connection to the proof that it belongs here.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long the door stays shut when the system has no means for another connection.
const PAUSE: Duration = Duration::from_millis(100);

/// Bytes that are read ahead of TLS, which asks the system for a quarter of a record at a time.
const AHEAD: usize = 64 * 1024;

/// Connections whose TLS is done, where they need it.
pub(super) type Incoming = UnboundedReceiverStream<std::io::Result<Connection>>;

/// Who may come in, and how.
pub(super) struct Door {
    listener: TcpListener,
    tls: Option<TlsAcceptor>,
    check: Check,
    refusals: Arc<Refusals>,
}

impl Door {
    /// A door that is opened with these secrets; without them it is open to all.
    ///
    /// # Errors
    /// When the secrets make no certificate.
    pub(super) fn new(
        listener: TcpListener,
        secrets: Option<&Secrets>,
        refusals: Arc<Refusals>,
    ) -> Result<Self, String> {
        let tls = secrets.map(Secrets::server).transpose()?.map(TlsAcceptor::from);
        let check = Check::new(secrets.map(|secrets| secrets.token().clone()), Arc::clone(&refusals));
        Ok(Self { listener, tls, check, refusals })
    }

    /// What asks every call for the token.
    pub(super) fn check(&self) -> Check {
        self.check.clone()
    }

    /// Opens it: takes connections until the runtime ends.
    ///
    /// # Errors
    /// When the system does not let this thread listen.
    pub(super) fn open(self) -> std::io::Result<Incoming> {
        let listener = tokio::net::TcpListener::from_std(self.listener)?;
        let (entered, incoming) = unbounded_channel();
        let (tls, refusals) = (self.tls, self.refusals);
        tokio::spawn(async move {
            let strangers = Strangers::default();
            loop {
                match listener.accept().await {
                    Ok((stream, peer)) => {
                        let caller = strangers.arrive(peer.ip());
                        let (tls, refusals) = (tls.clone(), Arc::clone(&refusals));
                        tokio::spawn(enter(stream, caller, tls, refusals, entered.clone()));
                    }
                    Err(error) => {
                        tracing::debug!(%error, "no connection could be taken");
                        tokio::time::sleep(PAUSE).await;
                    }
                }
            }
        });
        Ok(UnboundedReceiverStream::new(incoming))
    }
}

/// Makes a stranger's connection speak TLS.
async fn enter(
    stream: TcpStream,
    caller: Arc<Caller>,
    tls: Option<TlsAcceptor>,
    refusals: Arc<Refusals>,
    entered: UnboundedSender<std::io::Result<Connection>>,
) {
    // Small messages leave at once; a connection that has ended says so when it is used.
    let _ = stream.set_nodelay(true);
    let mut patience = Box::pin(caller.patience(PATIENCE));
    let connection = match tls {
        None => Ok(Connection::new(Box::new(stream), caller, patience, refusals)),
        Some(tls) => tokio::select! {
            done = tls.accept(BufReader::with_capacity(AHEAD, stream)) => match done {
                Ok(stream) => Ok(Connection::new(Box::new(stream), caller, patience, refusals)),
                Err(error) => Err((Why::of_handshake(&error), caller, refusals)),
            },
            () = &mut patience => Err((Why::Silent, caller, refusals)),
        },
    };
    match connection {
        Ok(connection) => drop(entered.send(Ok(connection))),
        Err((why, caller, refusals)) => refusals.note(caller.peer(), &why),
    }
}
