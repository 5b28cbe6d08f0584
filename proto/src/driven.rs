//! A network without a thread of its own: whoever waits for it drives it.
//!
//! Between two threads a message costs a call of the system and the time that a thread needs to wake, more than a short run takes. A
//! thread that waits for the network has nothing else to do: here it reads and writes the sockets itself, and what came for it is
//! there when it stops waiting. Where nobody waits for longer than [`LOOK`], as while a model computes, the network's keeper drives it,
//! so that no heartbeat is late; it lets go as soon as somebody waits. One thread drives at a time.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Thread;
use std::time::{Duration, Instant};

use tokio::runtime::{Builder, Handle, Runtime};
use tokio::sync::{Notify, oneshot};
use tokio::task::JoinError;
use tokio_util::sync::CancellationToken;

/// Time between two looks of the keeper, at first and at most: it doubles while turns are short. The keeper drives where nobody did from
/// one look to the next, and sleeps where somebody waited all the time.
const LOOK: Duration = Duration::from_millis(2);
const LONGEST_LOOK: Duration = Duration::from_millis(32);

/// How long the end of a network waits for those who waited for it; where one is later, its connections end with that one.
const LETTING_GO: Duration = Duration::from_secs(1);

/// A network that is driven by whoever waits for it.
pub struct Driven {
    /// Until the end.
    runtime: Mutex<Option<Arc<Owned>>>,
    handle: Handle,
    ended: CancellationToken,
    /// Threads that wait: one of them drives.
    waiting: AtomicUsize,
    /// How often a thread began to wait.
    turns: AtomicU64,
    keeper: Keeper,
}

/// What the keeper's thread and the others know of each other.
#[derive(Default)]
struct Keeper {
    thread: OnceLock<Thread>,
    /// It drives, until somebody waits.
    drives: AtomicBool,
    wanted: Notify,
    /// It looks no more, until somebody who waits stops.
    sleeps: AtomicBool,
    /// Who drove is away for longer.
    asked: AtomicBool,
}

/// A runtime whose end waits for nothing.
struct Owned(Option<Runtime>);

impl Driven {
    /// A network that does nothing yet.
    ///
    /// # Errors
    /// Where the system gives none.
    pub fn new() -> io::Result<Self> {
        let runtime =
            Builder::new_current_thread().enable_all().on_thread_start(crate::batch::computes).build()?;
        let handle = runtime.handle().clone();
        Ok(Self {
            runtime: Mutex::new(Some(Arc::new(Owned(Some(runtime))))),
            handle,
            ended: CancellationToken::new(),
            waiting: AtomicUsize::new(0),
            turns: AtomicU64::new(0),
            keeper: Keeper::default(),
        })
    }

    /// Waits for what the network does, on a thread outside of it; `None` where the network has ended.
    pub fn wait<T>(&self, future: impl Future<Output = T>) -> Option<T> {
        let runtime = self.runtime()?;
        let _turn = Turn::begin(self);
        runtime.get().block_on(self.ended.run_until_cancelled(future))
    }

    /// Lets the network do what it can at once, where nobody else drives it.
    pub fn glance(&self) {
        if self.waiting.load(SeqCst) == 0 && !self.keeper.drives.load(SeqCst) {
            // What arrived is read in the first turn of the runtime, what was made of it is written in the second.
            self.wait(async {
                tokio::task::yield_now().await;
                tokio::task::yield_now().await;
            });
        }
    }

    /// Says that this thread will be away for longer, so that the keeper drives from now on, where nobody else does.
    pub fn leave(&self) {
        if self.waiting.load(SeqCst) == 0 {
            // One that drives may be about to let go.
            self.keeper.asked.store(true, SeqCst);
            if !self.keeper.drives.load(SeqCst) {
                self.keeper.wake();
            }
        }
    }

    /// Does something in the network, and is its keeper until that ends; then the network ends.
    ///
    /// # Errors
    /// [`JoinError`] where it panicked.
    ///
    /// # Panics
    /// Where the network has a keeper already.
    pub fn keep<T: Send + 'static>(
        &self,
        work: impl Future<Output = T> + Send + 'static,
    ) -> Result<T, JoinError> {
        let keeper = std::thread::current();
        assert!(self.keeper.thread.set(keeper.clone()).is_ok(), "a network has one keeper");
        let (told, ended) = oneshot::channel();
        let work = self.handle.spawn(work);
        self.handle.spawn(async move {
            let _ = told.send(work.await);
            keeper.unpark();
        });
        let outcome = self.keep_until(ended);
        self.end();
        outcome
    }

    fn keep_until<T>(&self, mut ended: oneshot::Receiver<Result<T, JoinError>>) -> Result<T, JoinError> {
        let runtime = self.runtime().expect("nobody else ends it");
        let (mut seen, mut look) = (None, LOOK);
        self.keeper.asked.store(true, SeqCst);
        loop {
            if let Ok(outcome) = ended.try_recv() {
                return outcome;
            }
            // In this order: one who asks, and who begins and ends a turn meanwhile, is not passed over.
            let is_asked = self.keeper.asked.swap(false, SeqCst);
            let (turns, waiting) = (self.turns.load(SeqCst), self.waiting.load(SeqCst));
            let is_same = seen.replace(turns) == Some(turns);
            if waiting == 0 && (is_same || is_asked) {
                let outcome = self.drive(&runtime, &mut ended);
                if let Some(outcome) = outcome {
                    return outcome;
                }
                (seen, look) = (None, LOOK);
            } else if is_same {
                self.sleep();
                (seen, look) = (None, LOOK);
            } else {
                std::thread::park_timeout(look);
                look = LONGEST_LOOK.min(2 * look);
            }
        }
    }

    /// Drives until somebody else wants to, or it is over.
    fn drive<T>(
        &self,
        runtime: &Owned,
        ended: &mut oneshot::Receiver<Result<T, JoinError>>,
    ) -> Option<Result<T, JoinError>> {
        self.keeper.drives.store(true, SeqCst);
        // Who began to wait before that was seen gives no notice.
        let outcome = (self.waiting.load(SeqCst) == 0).then(|| {
            runtime.get().block_on(async {
                tokio::select! {
                    biased;
                    outcome = ended => outcome.ok(),
                    () = self.wanted() => None,
                }
            })
        });
        self.keeper.drives.store(false, SeqCst);
        outcome.flatten()
    }

    /// Until somebody waits: a notice may be left over from one who waits no more.
    async fn wanted(&self) {
        while self.waiting.load(SeqCst) == 0 {
            self.keeper.wanted.notified().await;
        }
    }

    /// Sleeps until nobody waits, or it is over.
    fn sleep(&self) {
        self.keeper.sleeps.store(true, SeqCst);
        // Who stopped waiting before that was seen wakes nobody.
        if self.waiting.load(SeqCst) > 0 {
            std::thread::park();
        }
        self.keeper.sleeps.store(false, SeqCst);
    }

    /// Where tasks of the network are begun.
    pub fn handle(&self) -> &Handle {
        &self.handle
    }

    /// Ends the network: nobody waits any more, and its tasks and connections are dropped.
    fn end(&self) {
        self.ended.cancel();
        let Some(runtime) = self.lock().take() else { return };
        // Those who waited let go of it.
        let deadline = Instant::now() + LETTING_GO;
        while Arc::strong_count(&runtime) > 1 && Instant::now() < deadline {
            std::thread::yield_now();
        }
    }

    fn runtime(&self) -> Option<Arc<Owned>> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Option<Arc<Owned>>> {
        self.runtime.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Keeper {
    fn wake(&self) {
        if let Some(thread) = self.thread.get() {
            thread.unpark();
        }
    }
}

/// The time for which a thread waits.
struct Turn<'a>(&'a Driven);

impl<'a> Turn<'a> {
    fn begin(driven: &'a Driven) -> Self {
        driven.turns.fetch_add(1, SeqCst);
        driven.waiting.fetch_add(1, SeqCst);
        if driven.keeper.drives.load(SeqCst) {
            driven.keeper.wanted.notify_one();
        }
        Self(driven)
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        let Driven { waiting, keeper, .. } = self.0;
        if waiting.fetch_sub(1, SeqCst) == 1 && keeper.sleeps.load(SeqCst) {
            keeper.wake();
        }
    }
}

impl Owned {
    fn get(&self) -> &Runtime {
        self.0.as_ref().expect("it is taken when it is dropped")
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        if let Some(runtime) = self.0.take() {
            runtime.shutdown_background();
        }
    }
}

#[cfg(test)]
mod tests;
