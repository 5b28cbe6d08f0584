//! The threads that compute: one queue, one thread per slot, first in first out.
//!
//! A panicking model is a failed job, not a dead worker. The wall time of each run is measured here.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use starlings_models::{Forward, Job, ModelFailure, ParticleError};
use starlings_proto::spent::spent;
use starlings_proto::words::panic_text;
use starlings_proto::{FromWorker, Lease, LeaseOutcome, MAX_INLINE_STATE, generated};
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::mpsc::UnboundedSender;

use crate::transfer::Transfers;

/// One job with everything needed to run and answer it. The outbox belongs to the stream that gave the lease: once that
/// stream is gone, so is the answer.
pub(crate) struct Task {
    pub(crate) lease: Lease,
    pub(crate) forward: Arc<dyn Forward>,
    pub(crate) job: Job,
    pub(crate) outbox: UnboundedSender<generated::FromWorker>,
    /// The way of a large end state.
    pub(crate) transfers: Transfers,
    /// What a large state takes of the room for jobs that have not started.
    pub(crate) room: Option<OwnedSemaphorePermit>,
}

/// The slots of this process.
#[derive(Clone)]
pub(crate) struct Slots {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    filled: Condvar,
    running: AtomicU32,
    predictions: AtomicU64,
    failures: AtomicU64,
}

#[derive(Default)]
struct Queue {
    tasks: VecDeque<Task>,
    closed: bool,
}

impl Slots {
    /// Starts the threads, or none: those that started end again when the system gives no more.
    pub(crate) fn start(n: usize) -> std::io::Result<Self> {
        Self::start_with(n, |slot, work| std::thread::Builder::new().name(format!("slot-{slot}")).spawn(work))
    }

    fn start_with(
        n: usize,
        spawn: impl Fn(usize, Box<dyn FnOnce() + Send>) -> std::io::Result<JoinHandle<()>>,
    ) -> std::io::Result<Self> {
        let slots = Self { shared: Arc::default() };
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
        self.shared.lock().tasks.push_back(task);
        self.shared.filled.notify_one();
    }

    /// Answers the given leases as withdrawn where they have not started.
    pub(crate) fn withdraw(&self, leases: &[Lease]) {
        let mut queue = self.shared.lock();
        let (withdrawn, kept) = queue.tasks.drain(..).partition(|task| leases.contains(&task.lease));
        queue.tasks = kept;
        drop(queue);
        let withdrawn: VecDeque<Task> = withdrawn;
        for task in withdrawn {
            answer(&task.outbox, task.lease, LeaseOutcome::Withdrawn, 0.0);
        }
    }

    /// Drops what waits, as when its stream is gone.
    pub(crate) fn forget_queue(&self) {
        self.shared.lock().tasks.clear();
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
        self.shared.filled.notify_all();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn next(&self) -> Option<Task> {
        let mut queue = self.lock();
        loop {
            if queue.closed {
                return None;
            }
            if let Some(task) = queue.tasks.pop_front() {
                return Some(task);
            }
            queue = self.filled.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn work(&self) {
        while let Some(Task { lease, forward, job, outbox, transfers, room }) = self.next() {
            drop(room);
            self.running.fetch_add(1, Ordering::Relaxed);
            let started = Instant::now();
            let result = catch_unwind(AssertUnwindSafe(|| forward.run_within(&job, &spent())))
                .unwrap_or_else(|panic| Err(ModelFailure::Solver(panic_text(panic.as_ref())).into()));
            let cost = started.elapsed().as_secs_f64();
            self.running.fetch_sub(1, Ordering::Relaxed);
            let counter = if result.is_ok() { &self.predictions } else { &self.failures };
            counter.fetch_add(1, Ordering::Relaxed);
            if job.state.as_ref().is_some_and(|state| state.len() * 8 > MAX_INLINE_STATE) {
                transfers.recycle(job.state.unwrap_or_default());
            }
            let result = result.and_then(|prediction| transfers.sendable(lease, prediction));
            answer(&outbox, lease, LeaseOutcome::Ran(result), cost);
        }
    }
}

/// Answers a lease; an answer that does not fit in a message becomes a failure that says so.
pub(crate) fn answer(
    outbox: &UnboundedSender<generated::FromWorker>,
    lease: Lease,
    answer: LeaseOutcome,
    cost: f64,
) {
    let message = FromWorker::Result { lease, answer, cost }.encode().or_else(|error| {
        let answer = LeaseOutcome::Ran(Err(ParticleError::BadJob(error.to_string())));
        FromWorker::Result { lease, answer, cost }.encode()
    });
    if let Ok(message) = message {
        let _ = outbox.send(message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_started_end_again_when_the_system_gives_no_more() {
        let ended = Arc::new(AtomicU32::new(0));
        let spawn = |slot, work: Box<dyn FnOnce() + Send>| {
            if slot == 3 {
                return Err(std::io::Error::other("no more threads"));
            }
            let ended = Arc::clone(&ended);
            Ok(std::thread::spawn(move || {
                work();
                ended.fetch_add(1, Ordering::Relaxed);
            }))
        };
        assert!(Slots::start_with(5, spawn).is_err());
        assert_eq!(ended.load(Ordering::Relaxed), 3);
    }
}
