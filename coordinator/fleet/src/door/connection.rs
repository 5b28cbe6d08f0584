//! A connection that is cut off when its caller has not proved itself in time, whatever it sends meanwhile.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tonic::transport::server::Connected;

use super::refusals::{Refusals, Why};
use super::strangers::Caller;

/// What carries bytes both ways.
pub(super) trait Io: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Io for T {}

/// A caller's connection.
pub(crate) struct Connection {
    io: Box<dyn Io>,
    caller: Arc<Caller>,
    /// Ends when a stranger's time is up; absent once it has proved itself.
    patience: Option<Pin<Box<dyn Future<Output = ()> + Send>>>,
    refusals: Arc<Refusals>,
}

impl Connection {
    pub(super) fn new(
        io: Box<dyn Io>,
        caller: Arc<Caller>,
        patience: Pin<Box<dyn Future<Output = ()> + Send>>,
        refusals: Arc<Refusals>,
    ) -> Self {
        Self { io, caller, patience: Some(patience), refusals }
    }

    /// An error when the caller's time is up.
    fn look(&mut self, cx: &mut Context<'_>) -> io::Result<()> {
        let Some(patience) = &mut self.patience else { return Ok(()) };
        if self.caller.is_proven() {
            self.patience = None;
            return Ok(());
        }
        if patience.as_mut().poll(cx).is_pending() {
            return Ok(());
        }
        if !self.caller.is_refused() {
            self.refusals.note(self.caller.peer(), &Why::Silent);
        }
        Err(io::ErrorKind::TimedOut.into())
    }
}

impl Connected for Connection {
    type ConnectInfo = Whose;

    fn connect_info(&self) -> Whose {
        Whose(Arc::clone(&self.caller))
    }
}

/// Whose call it is.
#[derive(Clone)]
pub(crate) struct Whose(pub(super) Arc<Caller>);

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.look(cx)?;
        Pin::new(&mut self.io).poll_read(cx, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write(cx, bytes)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write_vectored(cx, bytes)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(cx)
    }
}
