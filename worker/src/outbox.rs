//! The way of a worker's messages to its coordinator: a queue of a bounded size between the threads and the network.
//!
//! A thread that computes waits where the coordinator takes nothing, as when it is stopped; the network never waits,
//! and what it sends is small. Next file to read: [`crate::session`].

use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use starlings_models::ParticleError;
use starlings_proto::{FromWorker, Lease, LeaseOutcome, generated};
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};
use tokio_stream::Stream;

/// Bytes that wait for the network, from which on a thread waits too.
const MOST: usize = 16 * 1024 * 1024;

/// The near end of the way. Every job holds one: a clone costs a count.
#[derive(Clone, Debug)]
pub(crate) struct Outbox(Arc<Near>);

#[derive(Debug)]
struct Near {
    sender: UnboundedSender<(usize, generated::FromWorker)>,
    room: Arc<Room>,
}

/// The far end, from which the network takes.
pub(crate) struct Outgoing {
    receiver: UnboundedReceiver<(usize, generated::FromWorker)>,
    room: Arc<Room>,
}

/// What waits.
#[derive(Debug, Default)]
struct Room {
    queued: Mutex<Queued>,
    freed: Condvar,
}

#[derive(Debug, Default)]
struct Queued {
    bytes: usize,
    /// Nothing is taken any more.
    has_ended: bool,
    /// Threads that wait for room. Without one nobody is told of any, which is a call of the system for every message.
    waiting: usize,
}

impl Outbox {
    /// Both ends.
    pub(crate) fn new() -> (Self, Outgoing) {
        let (sender, receiver) = mpsc::unbounded_channel();
        let room = Arc::<Room>::default();
        (Self(Arc::new(Near { sender, room: Arc::clone(&room) })), Outgoing { receiver, room })
    }

    /// Sends a message; one of a stream that has ended is nobody's.
    pub(crate) fn send(&self, message: FromWorker) {
        if let Ok(message) = message.encode() {
            self.put(message);
        }
    }

    /// The same for a thread that may wait until there is room; false where the stream has ended.
    pub(crate) fn send_when_room(&self, message: FromWorker) -> bool {
        let Ok(message) = message.encode() else { return true };
        self.0.room.wait() && self.put(message)
    }

    /// Answers a lease; an answer that does not fit in a message becomes a failure that says so.
    pub(crate) fn answer(&self, lease: Lease, answer: LeaseOutcome, cost: f64) {
        if let Some(message) = encoded(lease, answer, cost) {
            self.put(message);
        }
    }

    /// The same for a thread that may wait until there is room.
    pub(crate) fn answer_when_room(&self, lease: Lease, answer: LeaseOutcome, cost: f64) {
        if let Some(message) = encoded(lease, answer, cost).filter(|_| self.0.room.wait()) {
            self.put(message);
        }
    }

    /// Nothing is taken any more: nobody waits.
    pub(crate) fn end(&self) {
        self.0.room.end();
    }

    fn put(&self, message: generated::FromWorker) -> bool {
        let bytes = FromWorker::wire_size(&message);
        self.0.room.lock().bytes += bytes;
        self.0.sender.send((bytes, message)).is_ok()
    }
}

fn encoded(lease: Lease, answer: LeaseOutcome, cost: f64) -> Option<generated::FromWorker> {
    let message = FromWorker::Result { lease, answer, cost }.encode().or_else(|error| {
        let answer = LeaseOutcome::Ran(Err(ParticleError::BadJob(error.to_string())));
        FromWorker::Result { lease, answer, cost }.encode()
    });
    message.ok()
}

impl Room {
    fn lock(&self) -> MutexGuard<'_, Queued> {
        self.queued.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until less waits than may; false where nothing is taken any more.
    fn wait(&self) -> bool {
        let full = |queued: &mut Queued| queued.bytes >= MOST && !queued.has_ended;
        let mut queued = self.lock();
        if full(&mut queued) {
            queued.waiting += 1;
            queued = self.freed.wait_while(queued, full).unwrap_or_else(PoisonError::into_inner);
            queued.waiting -= 1;
        }
        !queued.has_ended
    }

    fn end(&self) {
        self.lock().has_ended = true;
        self.freed.notify_all();
    }
}

impl Outgoing {
    fn took(&self, bytes: usize) {
        let mut queued = self.room.lock();
        queued.bytes = queued.bytes.saturating_sub(bytes);
        let tells = queued.waiting > 0 && queued.bytes < MOST;
        drop(queued);
        if tells {
            self.room.freed.notify_all();
        }
    }

    /// The next message, for tests.
    #[cfg(test)]
    pub(crate) fn blocking_recv(&mut self) -> Option<generated::FromWorker> {
        let (bytes, message) = self.receiver.blocking_recv()?;
        self.took(bytes);
        Some(message)
    }
}

impl Stream for Outgoing {
    type Item = generated::FromWorker;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.receiver.poll_recv(context).map(|next| {
            let (bytes, message) = next?;
            self.took(bytes);
            Some(message)
        })
    }
}

impl Drop for Outgoing {
    fn drop(&mut self) {
        self.room.end();
    }
}

#[cfg(test)]
mod tests {
    use starlings_models::Prediction;
    use starlings_proto::State;

    use super::*;

    fn answer(outbox: &Outbox, number: u64) {
        let prediction = Prediction { outputs: vec![0.5; 250_000], state: State::default(), cost: 0.0 };
        let lease = Lease { epoch: 1, job: number, attempt: 1 };
        outbox.answer_when_room(lease, LeaseOutcome::Ran(Ok(prediction)), 0.0);
    }

    #[test]
    fn a_thread_waits_where_nothing_is_taken_and_goes_on_when_something_is() {
        let (outbox, mut outgoing) = Outbox::new();
        let near = outbox.clone();
        let thread = std::thread::spawn(move || (0..100).for_each(|number| answer(&near, number)));
        // 2 MB each: nine are more than may wait.
        let queued = || outgoing.room.lock().bytes;
        while queued() < MOST {
            std::thread::yield_now();
        }
        outbox.send(FromWorker::Heartbeat { running: 1, queued: 0 });
        let mut most = 0;
        for _ in 0..101 {
            most = most.max(outgoing.room.lock().bytes);
            outgoing.blocking_recv().unwrap();
        }
        thread.join().unwrap();
        assert!(most < MOST + 4_100_000, "{most} bytes waited");
        assert_eq!(outgoing.room.lock().bytes, 0);
    }

    #[test]
    fn nobody_waits_for_a_stream_that_has_ended() {
        let (outbox, outgoing) = Outbox::new();
        let near = outbox.clone();
        let thread = std::thread::spawn(move || (0..20).for_each(|number| answer(&near, number)));
        while outgoing.room.lock().bytes < MOST {
            std::thread::yield_now();
        }
        drop(outgoing);
        thread.join().unwrap();
        assert!(!outbox.send_when_room(FromWorker::Held(vec![])));
    }
}
