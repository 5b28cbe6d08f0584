//! The threads that compute: one queue, one thread per slot, first in first out.
//!
//! A panicking model is a failed job, not a dead worker. The wall time of each run is measured here. A thread without a job drives
//! the network until one comes; one that computes looks after it between short runs, and leaves it to its keeper for long ones. Next
//! files to read: [`task`], and [`streams`] for what becomes of runs when a connection ends.

mod streams;
mod task;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use starlings_models::{ModelFailure, Until};
use starlings_proto::driven::Driven;
use starlings_proto::spent::spent;
use starlings_proto::words::panic_text;
use starlings_proto::{Lease, LeaseOutcome};
use tokio::sync::Notify;

use crate::held::Held;
use crate::outbox::Outbox;
pub(crate) use task::{Asked, Task, Traced};

/// Jobs that may wait per slot, twice what a coordinator sends ahead, and of the whole worker at least.
const WAITING: usize = 128;
const LEAST_WAITING: usize = 1024;

/// How long a thread computes, in one run or in several, before the network is looked after.
const AWAY: Duration = Duration::from_micros(200);

/// The slots of this process.
#[derive(Clone)]
pub(crate) struct Slots {
    shared: Arc<Shared>,
    /// Jobs that may wait.
    most: usize,
}

struct Shared {
    /// Where results are held; `None` in a worker that ends with its connection.
    held: Option<Arc<Held>>,
    network: Arc<Driven>,
    queue: Mutex<Queue>,
    filled: Notify,
    running: AtomicU32,
    predictions: AtomicU64,
    failures: AtomicU64,
}

#[derive(Default)]
struct Queue {
    tasks: VecDeque<Arc<Task>>,
    running: Vec<Arc<Task>>,
    /// No task is begun: no more results can be held.
    full: bool,
    closed: bool,
    /// The stream of now, for results that an earlier one asked for.
    stream: Option<Outbox>,
}

/// What a thread does next.
enum Next {
    Task(Arc<Task>),
    /// There is none that may be begun.
    Later,
    Closed,
}

impl Slots {
    /// Starts the threads, or none: those that started end again when the system gives no more.
    pub(crate) fn start(n: usize, held: Option<Arc<Held>>, network: Arc<Driven>) -> std::io::Result<Self> {
        Self::start_with(n, held, network, |slot, work| {
            std::thread::Builder::new().name(format!("slot-{slot}")).spawn(work)
        })
    }

    fn start_with(
        n: usize,
        held: Option<Arc<Held>>,
        network: Arc<Driven>,
        spawn: impl Fn(usize, Box<dyn FnOnce() + Send>) -> std::io::Result<JoinHandle<()>>,
    ) -> std::io::Result<Self> {
        let shared = Shared {
            held,
            network,
            queue: Mutex::default(),
            filled: Notify::new(),
            running: AtomicU32::new(0),
            predictions: AtomicU64::new(0),
            failures: AtomicU64::new(0),
        };
        let most = WAITING.saturating_mul(n).max(LEAST_WAITING);
        let slots = Self { shared: Arc::new(shared), most };
        let mut started = Vec::with_capacity(n);
        for slot in 0..n {
            let shared = Arc::clone(&slots.shared);
            match spawn(slot, Box::new(move || shared.work())) {
                Ok(thread) => started.push(thread),
                Err(error) => {
                    slots.close();
                    // They are idle: none has been given a job.
                    for thread in started {
                        let _ = thread.join();
                    }
                    return Err(error);
                }
            }
        }
        Ok(slots)
    }

    pub(crate) fn push(&self, task: Task) {
        self.shared.lock().tasks.push_back(Arc::new(task));
        self.shared.filled.notify_one();
    }

    /// Answers the given leases as withdrawn where they have not started; where `stop` says so, those that have are told to stop
    /// and answered when they did.
    pub(crate) fn withdraw(&self, leases: &[Lease], stop: bool) {
        let mut queue = self.shared.lock();
        if stop {
            for running in queue.running.iter().filter(|task| task.has_lease(leases)) {
                running.stop.set();
            }
        }
        let (withdrawn, kept) = queue.tasks.drain(..).partition(|task| task.has_lease(leases));
        queue.tasks = kept;
        drop(queue);
        let withdrawn: VecDeque<Arc<Task>> = withdrawn;
        for Asked { lease, outbox, .. } in withdrawn.into_iter().filter_map(|task| task.asked().take()) {
            outbox.answer(lease, LeaseOutcome::Withdrawn, 0.0);
        }
    }

    /// Drops what waits and stops what is computed, as when its run is over; a result that comes all the same is nobody's.
    pub(crate) fn forget(&self) {
        let mut queue = self.shared.lock();
        queue.tasks.clear();
        (queue.stream, queue.full) = (None, false);
        for task in queue.running.drain(..) {
            task.asked().take();
            task.stop.set();
        }
    }

    /// Whether so many jobs wait, with those that wait for their states, that no coordinator that keeps to its own rules sent them.
    pub(crate) fn is_flooded(&self, without_states: usize) -> bool {
        self.shared.lock().tasks.len() + without_states >= self.most
    }

    /// Jobs being computed and jobs waiting.
    pub(crate) fn load(&self) -> (u32, u32) {
        (self.shared.running.load(Ordering::Relaxed), self.shared.lock().tasks.len() as u32)
    }

    /// Jobs answered with a prediction and with a failure.
    pub(crate) fn answered(&self) -> (u64, u64) {
        (self.shared.predictions.load(Ordering::Relaxed), self.shared.failures.load(Ordering::Relaxed))
    }

    /// Ends the threads, each after the job it computes.
    pub(crate) fn close(&self) {
        let mut queue = self.shared.lock();
        queue.closed = true;
        queue.tasks.clear();
        drop(queue);
        self.shared.filled.notify_waiters();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self) {
        // How long a run may take is not known before the first one.
        let (mut last, mut away) = (AWAY, Duration::ZERO);
        while let Some(task) = self.next(&mut away) {
            if last >= AWAY || task.is_large() {
                self.network.leave();
            }
            last = self.compute(task);
            away += last;
            if away >= AWAY {
                self.network.glance();
                away = Duration::ZERO;
            }
        }
    }

    /// The next task, once there is one; `None` where no more will come.
    fn next(&self, away: &mut Duration) -> Option<Arc<Task>> {
        match self.begin() {
            Next::Task(task) => Some(task),
            Next::Closed => None,
            Next::Later => {
                *away = Duration::ZERO;
                self.network.wait(self.filled()).flatten()
            }
        }
    }

    async fn filled(&self) -> Option<Arc<Task>> {
        loop {
            let mut filled = std::pin::pin!(self.filled.notified());
            filled.as_mut().enable();
            match self.begin() {
                Next::Task(task) => return Some(task),
                Next::Closed => return None,
                Next::Later => filled.await,
            }
        }
    }

    fn begin(&self) -> Next {
        let mut queue = self.lock();
        if queue.closed {
            return Next::Closed;
        }
        if queue.full {
            return Next::Later;
        }
        let Some(task) = queue.tasks.pop_front() else { return Next::Later };
        queue.running.push(Arc::clone(&task));
        Next::Task(task)
    }

    /// Runs a task and answers it; how long the run took.
    fn compute(&self, task: Arc<Task>) -> Duration {
        task.begun();
        self.running.fetch_add(1, Ordering::Relaxed);
        let started = Instant::now();
        let spent = spent();
        let (span, traceparent) = task.traced();
        let until = Until { spent: &spent, stop: &task.stop, traceparent: traceparent.as_deref() };
        let result = catch_unwind(AssertUnwindSafe(|| task.forward.run_within(&task.job, &until)))
            .unwrap_or_else(|panic| Err(ModelFailure::Solver(panic_text(panic.as_ref())).into()));
        let took = started.elapsed();
        let cost = took.as_secs_f64();
        task.log(result.as_ref().err(), cost);
        if let Some(span) = span {
            span.end_with(result.as_ref().err());
        }
        self.running.fetch_sub(1, Ordering::Relaxed);
        // A result that came all the same is as good as any; what a stopped run says of itself is not.
        if result.is_err() && task.stop.is_set() {
            self.lock().running.retain(|running| !Arc::ptr_eq(running, &task));
            if let Some(Asked { lease, outbox, .. }) = task.asked().take() {
                outbox.answer_when_room(lease, LeaseOutcome::Withdrawn, cost);
            }
            return took;
        }
        let counter = if result.is_ok() { &self.predictions } else { &self.failures };
        counter.fetch_add(1, Ordering::Relaxed);
        self.finished(task, result, cost);
        took
    }
}
