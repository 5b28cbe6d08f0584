//! Descriptors that a coordinator passes to a worker that it started, beside their connection.
//!
//! The coordinator makes a second pair of sockets and offers one end in the first byte of the connection, before its process starts;
//! later it sends descriptors on the pair, each under a number that the worker has drawn and named in a request. A descriptor is in
//! the pair before the answer that tells of it. None goes the other way: what a worker sends is bytes alone. A descriptor may be lost on
//! its way, as where a process has all that it may have: then there is none under its number, and whoever asked does without. What the
//! descriptors are of is no matter here. Next file to read: [`crate::convert::lent`].

use std::collections::BTreeMap;
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rustix::net::{
    AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, SocketFlags, SocketType, recvmsg, sendmsg, socketpair,
};

/// The byte that comes before all others on a connection that a worker inherits, with a descriptor or without.
const OFFER: u8 = b'd';

/// Sends descriptors to one worker; clones are the same way.
#[derive(Clone, Debug)]
pub struct DescriptorSender(Arc<OwnedFd>);

impl DescriptorSender {
    /// Sends a descriptor under a number; never waits.
    ///
    /// # Errors
    /// When the worker does not take what was sent before, or is gone.
    pub fn send(&self, number: u64, descriptor: BorrowedFd<'_>) -> io::Result<()> {
        send(self.0.as_fd(), &number.to_le_bytes(), Some(descriptor))
    }
}

/// Makes the way of descriptors of a worker that is about to start and offers it on its connection, of which this is the own end:
/// the first byte there. Where the system gives no such way, or none that it can pass on, the byte comes alone.
///
/// # Errors
/// When the connection takes no byte.
pub fn offer(connection: &UnixStream) -> io::Result<Option<DescriptorSender>> {
    let pair = socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None);
    if let Ok((own, its)) = pair
        && send(connection.as_fd(), &[OFFER], Some(its.as_fd())).is_ok()
    {
        return Ok(Some(DescriptorSender(Arc::new(own))));
    }
    send(connection.as_fd(), &[OFFER], None).map(|()| None)
}

fn send(socket: BorrowedFd<'_>, bytes: &[u8], descriptor: Option<BorrowedFd<'_>>) -> io::Result<()> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut beside = SendAncillaryBuffer::new(&mut space);
    let descriptors: Vec<BorrowedFd<'_>> = descriptor.into_iter().collect();
    if !descriptors.is_empty() && !beside.push(SendAncillaryMessage::ScmRights(&descriptors)) {
        return Err(io::Error::other("no room for a descriptor"));
    }
    let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
    sendmsg(socket, &[IoSlice::new(bytes)], &mut beside, flags)?;
    Ok(())
}

/// What has come on a socket, with the descriptor that came with it, unless the system had none left for it; no bytes at its end.
fn receive<const N: usize>(socket: BorrowedFd<'_>) -> io::Result<(usize, [u8; N], Option<OwnedFd>)> {
    let mut bytes = [0; N];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut beside = RecvAncillaryBuffer::new(&mut space);
    let flags = RecvFlags::DONTWAIT | RecvFlags::CMSG_CLOEXEC;
    let length = recvmsg(socket, &mut [IoSliceMut::new(&mut bytes)], &mut beside, flags)?.bytes;
    let descriptor = beside.drain().find_map(|message| match message {
        RecvAncillaryMessage::ScmRights(mut descriptors) => descriptors.next(),
        _ => None,
    });
    Ok((length, bytes, descriptor))
}

/// Takes descriptors that a coordinator sends.
#[derive(Debug)]
pub struct DescriptorReceiver {
    socket: OwnedFd,
    /// Those that are asked for, by their numbers; there when they have come.
    asked: Mutex<BTreeMap<u64, Option<OwnedFd>>>,
    last: AtomicU64,
}

/// What the coordinator offers on a connection that this process inherited; before anything else is read there.
///
/// # Errors
/// When the connection does not begin as it should.
pub fn offered(connection: &UnixStream) -> io::Result<Option<Arc<DescriptorReceiver>>> {
    match receive::<1>(connection.as_fd()) {
        Ok((1, [OFFER], socket)) => {
            let receiver =
                |socket| DescriptorReceiver { socket, asked: Mutex::default(), last: AtomicU64::new(0) };
            Ok(socket.map(receiver).map(Arc::new))
        }
        Ok((0, ..)) => Ok(None),
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidData, "it begins with another byte")),
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
        Err(error) => Err(error),
    }
}

impl DescriptorReceiver {
    /// Begins to wait for a descriptor, under a number of its own.
    pub fn ask(self: &Arc<Self>) -> Asked {
        let number = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        self.lock().insert(number, None);
        Asked { number, receiver: Arc::clone(self) }
    }

    /// Takes all that has come; what nobody asked for is closed. A number whose descriptor was lost has none.
    fn drain(&self) {
        let mut asked = self.lock();
        while let Ok((8, number, descriptor)) = receive::<8>(self.socket.as_fd()) {
            if let Some(place) = asked.get_mut(&u64::from_le_bytes(number)) {
                *place = descriptor;
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Option<OwnedFd>>> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A descriptor that a worker waits for; one that comes after this is dropped is closed.
#[derive(Debug)]
pub struct Asked {
    number: u64,
    receiver: Arc<DescriptorReceiver>,
}

impl Asked {
    /// Its number, not 0.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The descriptor, once an answer told that it was sent; `None` where it was lost.
    pub fn take(self) -> Option<OwnedFd> {
        self.receiver.drain();
        self.receiver.lock().get_mut(&self.number)?.take()
    }
}

impl Drop for Asked {
    fn drop(&mut self) {
        self.receiver.drain();
        self.receiver.lock().remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::FileExt;

    use super::*;

    fn file(text: &str) -> std::fs::File {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(text.as_bytes()).expect("room");
        file
    }

    fn text(descriptor: OwnedFd) -> String {
        let mut bytes = [0; 16];
        let n = std::fs::File::from(descriptor).read_at(&mut bytes, 0).expect("readable");
        String::from_utf8_lossy(&bytes[..n]).into_owned()
    }

    #[test]
    fn descriptors_come_under_their_numbers_in_any_order_and_the_connection_is_as_it_was() {
        let (own, mut its) = UnixStream::pair().expect("a pair");
        let sender = offer(&own).expect("room").expect("a way");
        (&own).write_all(b"then").expect("room");
        let receiver = offered(&its).expect("a beginning").expect("a way");
        let mut rest = [0; 4];
        its.read_exact(&mut rest).expect("it comes");
        assert_eq!(&rest, b"then");
        let (a, b) = (receiver.ask(), receiver.ask());
        for (asked, name) in [(&b, "b"), (&a, "a")] {
            sender.send(asked.number(), file(name).as_fd()).expect("room");
        }
        assert_eq!(text(a.take().expect("sent")), "a");
        assert_eq!(text(b.take().expect("sent")), "b");
        assert!(receiver.ask().take().is_none(), "nothing was sent");
    }

    #[test]
    fn descriptors_that_nobody_waits_for_are_closed_and_a_full_way_never_waits() {
        let (own, its) = UnixStream::pair().expect("a pair");
        let sender = offer(&own).expect("room").expect("a way");
        let receiver = offered(&its).expect("a beginning").expect("a way");
        let (x, mut sent) = (file("x"), 0);
        while sender.send(900 + sent, x.as_fd()).is_ok() {
            sent += 1;
            assert!(sent < 100_000, "no end");
        }
        drop(receiver.ask());
        // Other tests open files meanwhile: only descriptors of this one count.
        let own_link = std::fs::read_link(format!("/proc/self/fd/{}", x.as_raw_fd())).expect("a link");
        let open = std::fs::read_dir("/proc/self/fd").expect("it has some").flatten();
        let of_x = open.filter(|entry| std::fs::read_link(entry.path()).is_ok_and(|link| link == own_link));
        assert_eq!(of_x.count(), 1, "those that were sent are not kept");
        let asked = receiver.ask();
        sender.send(asked.number(), file("y").as_fd()).expect("there is room again");
        assert_eq!(text(asked.take().expect("sent")), "y");
        assert!(receiver.lock().is_empty());
        drop(receiver);
        // A process that another test starts holds the other end until it is another program.
        let is_gone = (0..200).any(|_| {
            let refused = sender.send(1, file("z").as_fd()).is_err();
            if !refused {
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
            refused
        });
        assert!(is_gone, "the worker is gone");
    }

    #[test]
    fn a_connection_without_an_offer_has_no_way_and_another_beginning_is_told() {
        let (own, its) = UnixStream::pair().expect("a pair");
        assert!(offered(&its).expect("nothing was said").is_none());
        (&own).write_all(b"P").expect("room");
        assert!(offered(&its).is_err());
        drop(own);
        assert!(offered(&its).expect("its end").is_none());
    }
}
