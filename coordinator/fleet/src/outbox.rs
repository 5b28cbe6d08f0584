//! What waits to be sent to one worker. A worker that does not read has all of it let go, and its session ends.
//!
//! Leases bound the jobs that wait, but whatever a worker says may be answered, and one that only speaks would fill the memory of the
//! coordinator; one that says it is there and reads nothing would keep the place of one that works. Next file to read:
//! [`super::service`].

use std::collections::VecDeque;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use starlings_proto::{ToWorker, generated};
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::Status;

/// Bytes that may wait: above what the jobs have that a worker holds before it has answered any, with states inside.
const MOST: usize = 160 << 20;

/// How long messages may wait while none is taken: far above what the largest one needs on a slow network, and above the silence at
/// which a worker that stands still is lost.
const PATIENCE: Duration = Duration::from_secs(120);

/// What one look adds to that time at most: a coordinator that stood still itself learns nothing of its workers.
const STEP: Duration = Duration::from_secs(10);

/// What a link carries to its worker.
type Outgoing = Result<generated::ToWorker, Status>;

/// Where messages to a worker are put. The last clone takes the link with it, once all is read.
#[derive(Clone)]
pub(super) struct Outbox(Arc<Sender>);

/// What was put and is not yet sent, in its order.
pub(super) struct Unread(Arc<Shared>);

struct Sender(Arc<Shared>);

struct Shared {
    queue: Mutex<Queue>,
    most: usize,
    patience: Duration,
    given_up: GivenUp,
}

/// That a worker does not read; it has no part in the link.
#[derive(Clone, Default)]
pub(super) struct GivenUp {
    token: CancellationToken,
    why: Arc<OnceLock<String>>,
}

impl GivenUp {
    /// Waits until it is so; what the worker does.
    pub(super) async fn reason(&self) -> String {
        self.token.cancelled().await;
        self.why.get().cloned().unwrap_or_default()
    }

    fn say(&self, why: String) {
        // The first one counts.
        let _ = self.why.set(why);
        self.token.cancel();
    }
}

#[derive(Default)]
struct Queue {
    messages: VecDeque<(usize, generated::ToWorker)>,
    bytes: usize,
    is_closed: bool,
    reader: Option<Waker>,
    /// For how long messages have waited while none was taken, and when that was looked at last.
    waited: Duration,
    looked: Option<Instant>,
}

/// Both ends of a link.
pub(super) fn outbox() -> (Outbox, Unread) {
    bounded(MOST, PATIENCE)
}

fn bounded(most: usize, patience: Duration) -> (Outbox, Unread) {
    let shared = Arc::new(Shared { queue: Mutex::default(), most, patience, given_up: GivenUp::default() });
    (Outbox(Arc::new(Sender(Arc::clone(&shared)))), Unread(shared))
}

impl Outbox {
    /// Has a message wait; one that goes to nobody is dropped. Whether the worker reads is seen at every one, and there is one at
    /// every heartbeat.
    pub(super) fn send(&self, message: generated::ToWorker) {
        let shared = &self.0.0;
        let mut queue = shared.lock();
        if queue.is_closed {
            return;
        }
        let bytes = ToWorker::weight(&message);
        queue.bytes += bytes;
        queue.messages.push_back((bytes, message));
        if let Some(why) = shared.is_unread(&mut queue) {
            queue.close();
            shared.given_up.say(why);
        }
        queue.wake();
    }

    /// What tells when the worker is given up, and nothing more is sent.
    pub(super) fn given_up(&self) -> GivenUp {
        self.0.0.given_up.clone()
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why the worker that the messages are for is one that does not read.
    fn is_unread(&self, queue: &mut Queue) -> Option<String> {
        if queue.bytes > self.most {
            let mib = self.most >> 20;
            return Some(format!("it does not read what it is sent: more than {mib} MiB wait for it"));
        }
        let now = Instant::now();
        let since =
            queue.looked.replace(now).map_or(Duration::ZERO, |looked| now.saturating_duration_since(looked));
        queue.waited += since.min(STEP);
        let s = self.patience.as_secs();
        // Of a message that has just come nobody knows.
        (queue.messages.len() > 1 && queue.waited >= self.patience)
            .then(|| format!("it does not read what it is sent: nothing for {s} s"))
    }
}

impl Queue {
    /// Nothing is sent any more, nor what waits.
    fn close(&mut self) {
        (self.messages, self.bytes, self.is_closed) = (VecDeque::new(), 0, true);
    }

    fn wake(&mut self) {
        if let Some(reader) = self.reader.take() {
            reader.wake();
        }
    }

    fn next(&mut self) -> Option<generated::ToWorker> {
        let (bytes, message) = self.messages.pop_front()?;
        self.bytes -= bytes;
        (self.waited, self.looked) = (Duration::ZERO, None);
        Some(message)
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        let mut queue = self.0.lock();
        queue.is_closed = true;
        queue.wake();
    }
}

impl Drop for Unread {
    fn drop(&mut self) {
        self.0.lock().close();
    }
}

impl Stream for Unread {
    type Item = Outgoing;

    fn poll_next(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Outgoing>> {
        let mut queue = self.0.lock();
        match queue.next() {
            Some(message) => Poll::Ready(Some(Ok(message))),
            None if queue.is_closed => Poll::Ready(None),
            None => {
                queue.reader = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

#[cfg(test)]
impl Unread {
    /// The next message, if one waits.
    pub(super) fn try_next(&self) -> Option<generated::ToWorker> {
        self.0.lock().next()
    }
}

#[cfg(test)]
mod tests {
    use tokio_stream::StreamExt;

    use super::*;

    fn notice(n: usize) -> generated::ToWorker {
        ToWorker::notice(&n.to_string())
    }

    #[tokio::test]
    async fn all_arrives_in_its_order_and_ends_with_the_last_sender() {
        let (outbox, unread) = outbox();
        let reader = tokio::spawn(unread.map(|message| message.expect("no error")).collect::<Vec<_>>());
        for n in 0..1000 {
            outbox.clone().send(notice(n));
            if n % 100 == 0 {
                tokio::task::yield_now().await;
            }
        }
        assert!(!outbox.given_up().token.is_cancelled());
        drop(outbox);
        assert_eq!(reader.await.expect("it ends"), (0..1000).map(notice).collect::<Vec<_>>());
    }

    #[test]
    fn what_is_not_read_is_let_go_when_it_is_too_much_and_what_is_read_counts_no_more() {
        let one = ToWorker::weight(&notice(0));
        let (outbox, unread) = bounded(10 * one, PATIENCE);
        for n in 0..100 {
            outbox.send(notice(n % 10));
            assert!(unread.try_next().is_some());
        }
        (0..10).for_each(|n| outbox.send(notice(n)));
        assert!(!outbox.given_up().token.is_cancelled());
        outbox.send(notice(10));
        assert!(outbox.given_up().token.is_cancelled());
        assert!(unread.try_next().is_none(), "nothing is held");
        outbox.send(notice(11));
        assert!(unread.try_next().is_none());
    }

    #[tokio::test]
    async fn a_worker_that_takes_nothing_is_given_up_after_a_while_and_one_that_takes_something_is_not() {
        // Without any patience whatever waits behind another message has waited too long.
        let (outbox, unread) = bounded(MOST, Duration::ZERO);
        for n in 0..100 {
            outbox.send(notice(n));
            assert!(unread.try_next().is_some());
        }
        assert!(!outbox.given_up().token.is_cancelled());
        outbox.send(notice(0));
        outbox.send(notice(1));
        assert_eq!(outbox.given_up().reason().await, "it does not read what it is sent: nothing for 0 s");
        assert!(unread.try_next().is_none(), "nothing is held");
        // With some, what waits is no matter.
        let (outbox, unread) = bounded(MOST, Duration::from_secs(3600));
        (0..1000).for_each(|n| outbox.send(notice(n)));
        assert!(!outbox.given_up().token.is_cancelled() && unread.try_next().is_some());
    }
}
