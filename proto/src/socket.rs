//! One end of a pair of sockets as an asynchronous stream that wakes its owner only for what it waits for.
//!
//! A Unix socket tells both of its watchers whenever the other side reads, since there is room to write again. Watched for both
//! directions, as a general stream is, every message that is read would wake the thread that sent it. So this one is watched for
//! reading alone, and for writing only while a write waits for room.

use std::io::{self, IoSlice, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::unix::pipe::{Receiver, Sender};
use tonic::transport::server::Connected;

use crate::descriptors::DescriptorSender;

/// One end of a pair of sockets. What the runtime calls the ends of a pipe are descriptors watched for one direction.
#[derive(Debug)]
pub struct SocketEnd {
    socket: UnixStream,
    incoming: Receiver,
    /// There while a write waits for room.
    room: Option<Sender>,
    /// What `room` is made of: a process that has all descriptors that it may have can still wait.
    spare: Option<OwnedFd>,
    /// The way of descriptors beside it.
    descriptors: Option<DescriptorSender>,
}

impl SocketEnd {
    /// Takes a socket over; only inside a runtime.
    ///
    /// # Errors
    /// When the system cannot watch it.
    pub fn new(socket: UnixStream) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        let incoming = Receiver::from_owned_fd_unchecked(socket.try_clone()?.into())?;
        let spare = Some(socket.try_clone()?.into());
        Ok(Self { socket, incoming, room: None, spare, descriptors: None })
    }

    /// The same with a way of descriptors beside it, which those who serve on it are told of.
    #[must_use]
    pub fn with_descriptors(self, descriptors: Option<DescriptorSender>) -> Self {
        Self { descriptors, ..self }
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
            let spare = self.spare.take().map_or_else(|| self.socket.try_clone().map(OwnedFd::from), Ok)?;
            self.room = Some(Sender::from_owned_fd_unchecked(spare)?);
        }
        let written = self.room.as_mut().map_or(Poll::Pending, |room| waiting(Pin::new(room)));
        if written.is_ready() {
            self.spare = self.room.take().and_then(|room| room.into_nonblocking_fd().ok());
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
    type ConnectInfo = Option<DescriptorSender>;

    fn connect_info(&self) -> Self::ConnectInfo {
        self.descriptors.clone()
    }
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsFd;

    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    /// More than the system holds for a reader that is late.
    const MUCH: usize = 8_000_000;

    fn block_on<T>(future: impl Future<Output = T>) -> T {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.expect("a runtime").block_on(future)
    }

    /// Both ends; only inside a runtime.
    fn pair() -> (SocketEnd, SocketEnd) {
        let (one, other) = UnixStream::pair().expect("a pair");
        (SocketEnd::new(one).expect("one"), SocketEnd::new(other).expect("other"))
    }

    /// The directions for which the system watches a socket for this process: reading, writing.
    fn watched(socket: &UnixStream) -> [bool; 2] {
        // EPOLLIN and EPOLLOUT of epoll_ctl(2); /proc/PID/fdinfo of an epoll file has a line for every watched file (proc(5)).
        let (reading, writing) = (0x1_u32, 0x4);
        let inode = rustix::fs::fstat(socket.as_fd()).expect("an open socket").st_ino;
        let infos = std::fs::read_dir("/proc/self/fdinfo").expect("a process has one");
        let texts = infos.filter_map(|info| std::fs::read_to_string(info.ok()?.path()).ok());
        let all: String = texts.collect::<Vec<_>>().join("\n");
        let of_socket = all.lines().filter(|line| {
            line.starts_with("tfd:") && line.split_whitespace().any(|word| word == format!("ino:{inode:x}"))
        });
        let events = of_socket.map(|line| {
            let mask = line.split_whitespace().skip_while(|word| *word != "events:").nth(1).expect("a mask");
            u32::from_str_radix(mask, 16).expect("in hexadecimal")
        });
        let events = events.fold(0, |all, events| all | events);
        [events & reading != 0, events & writing != 0]
    }

    #[test]
    fn more_than_the_system_holds_arrives_whole_in_both_directions() {
        block_on(async {
            let (mut one, mut other) = pair();
            let sent: Vec<u8> = (0..MUCH).map(|i| (i % 251) as u8).collect();
            let echo = tokio::spawn(async move {
                let mut all = vec![0; MUCH];
                other.read_exact(&mut all).await.expect("all of it");
                other.write_all(&all).await.expect("all of it");
                other.shutdown().await.expect("an end");
            });
            one.write_all(&sent).await.expect("room comes");
            let mut all = Vec::new();
            one.read_to_end(&mut all).await.expect("all of it, and the end");
            assert!(all == sent);
            echo.await.expect("no panic");
        });
    }

    #[test]
    fn it_is_watched_for_writing_only_while_a_write_waits_for_room() {
        block_on(async {
            let (mut one, mut other) = pair();
            one.write_all(b"a job").await.expect("there is room");
            assert_eq!(watched(&one.socket), [true, false]);

            let much = vec![7; MUCH];
            let mut writing = Box::pin(one.write_all(&much));
            let is_waiting = std::future::poll_fn(|cx| Poll::Ready(writing.as_mut().poll(cx).is_pending()));
            assert!(is_waiting.await, "nobody has read");
            drop(writing);
            assert_eq!(watched(&one.socket), [true, true]);

            // What is still to be written is given up; the next write finds room.
            let taken = other.read(&mut vec![0; MUCH]).await.expect("it was written");
            assert!(taken > 0);
            one.write_all(b"another").await.expect("there is room again");
            assert_eq!(watched(&one.socket), [true, false]);
        });
    }
}
