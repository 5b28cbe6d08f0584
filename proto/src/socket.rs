//! One end of a pair of sockets as an asynchronous stream that wakes its owner only for what it waits for.
//!
//! A Unix socket tells both of its watchers whenever the other side reads, since there is room to write again. Watched for both
//! directions, as a general stream is, every message that is read would wake the thread that sent it. So this one is watched for
//! reading alone, and for writing only while a write waits for room.

use std::io::{self, IoSlice, Write};
use std::os::unix::net::UnixStream;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::unix::pipe::{Receiver, Sender};
use tonic::transport::server::Connected;

/// One end of a pair of sockets. What the runtime calls the ends of a pipe are descriptors watched for one direction.
#[derive(Debug)]
pub struct SocketEnd {
    socket: UnixStream,
    incoming: Receiver,
    /// There while a write waits for room.
    room: Option<Sender>,
}

impl SocketEnd {
    /// Takes a socket over; only inside a runtime.
    ///
    /// # Errors
    /// When the system cannot watch it.
    pub fn new(socket: UnixStream) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        let incoming = Receiver::from_owned_fd_unchecked(socket.try_clone()?.into())?;
        Ok(Self { socket, incoming, room: None })
    }

    /// Writes at once, or when there is room.
    fn poll_write_by(
        &mut self,
        at_once: impl FnOnce(&UnixStream) -> io::Result<usize>,
        waiting: impl FnOnce(Pin<&mut Sender>) -> Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if self.room.is_none() {
            match at_once(&self.socket) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                done => return Poll::Ready(done),
            }
            self.room = Some(Sender::from_owned_fd_unchecked(self.socket.try_clone()?.into())?);
        }
        let written = self.room.as_mut().map_or(Poll::Pending, |room| waiting(Pin::new(room)));
        if written.is_ready() {
            self.room = None;
        }
        written
    }
}

impl AsyncRead for SocketEnd {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.incoming).poll_read(cx, buffer)
    }
}

impl AsyncWrite for SocketEnd {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.poll_write_by(|mut socket| socket.write(bytes), |room| room.poll_write(cx, bytes))
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.poll_write_by(
            |mut socket| socket.write_vectored(parts),
            |room| room.poll_write_vectored(cx, parts),
        )
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(self.socket.shutdown(std::net::Shutdown::Write))
    }
}

impl Connected for SocketEnd {
    type ConnectInfo = ();

    fn connect_info(&self) {}
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::Wake;

    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    fn runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime")
    }

    #[test]
    fn more_than_the_system_holds_arrives_whole_in_both_directions() {
        runtime().block_on(async {
            let (one, other) = UnixStream::pair().expect("a pair");
            let (mut one, mut other) =
                (SocketEnd::new(one).expect("one"), SocketEnd::new(other).expect("other"));
            let sent: Vec<u8> = (0..8_000_000_u32).map(|i| (i % 251) as u8).collect();
            let back = sent.clone();
            let echo = tokio::spawn(async move {
                let mut all = vec![0; 8_000_000];
                other.read_exact(&mut all).await.expect("all of it");
                other.write_all(&all).await.expect("all of it");
                other.shutdown().await.expect("an end");
            });
            one.write_all(&sent).await.expect("room comes");
            let mut all = Vec::new();
            one.read_to_end(&mut all).await.expect("all of it, and the end");
            assert!(all == back);
            echo.await.expect("no panic");
        });
    }

    /// Counts how often it is woken.
    #[derive(Default)]
    struct Woken(AtomicUsize);

    impl Wake for Woken {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn one_that_waits_for_a_message_is_not_woken_when_the_other_side_reads() {
        runtime().block_on(async {
            let (one, other) = UnixStream::pair().expect("a pair");
            let (mut one, mut other) =
                (SocketEnd::new(one).expect("one"), SocketEnd::new(other).expect("other"));
            let woken = Arc::new(Woken::default());
            let waker = Arc::clone(&woken).into();
            let mut waiting = Context::from_waker(&waker);
            let mut bytes = [0; 16];
            for round in 0..10 {
                one.write_all(b"a job").await.expect("there is room");
                assert!(
                    Pin::new(&mut one).poll_read(&mut waiting, &mut ReadBuf::new(&mut bytes)).is_pending()
                );
                let mut read = [0; 5];
                other.read_exact(&mut read).await.expect("it was sent");
                tokio::time::sleep(std::time::Duration::from_millis(1)).await;
                assert_eq!(woken.0.load(Ordering::Relaxed), 0, "round {round}");
            }
            other.write_all(b"x").await.expect("there is room");
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
            assert_eq!(woken.0.load(Ordering::Relaxed), 1, "and for a message it is");
        });
    }
}
