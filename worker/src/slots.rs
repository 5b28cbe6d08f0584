//! The threads that compute: one queue, one thread per slot, first in first out.
//!
//! A panicking model is a failed job, not a dead worker. The wall time of each run is measured here.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use starlings_models::{Forward, Job, ModelFailure, ParticleError, Stop, Until};
use starlings_proto::spent::spent;
use starlings_proto::words::panic_text;
use starlings_proto::{FromWorker, Lease, LeaseOutcome, generated};
use tokio::sync::mpsc::UnboundedSender;

/// Jobs that may wait per slot, twice what a coordinator sends ahead, and of the whole worker at least.
const WAITING: usize = 128;
const LEAST_WAITING: usize = 1024;

/// One job with everything needed to run and answer it. The outbox belongs to the stream that gave the lease: once that
/// stream is gone, so is the answer.
pub(crate) struct Task {
    pub(crate) lease: Lease,
    pub(crate) forward: Arc<dyn Forward>,
    pub(crate) job: Job,
    pub(crate) outbox: UnboundedSender<generated::FromWorker>,
}

/// The slots of this process.
pub(crate) struct Slots {
    shared: Arc<Shared>,
    /// Jobs that may wait.
    most: usize,
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
    /// What is being computed, each with the word that stops it.
    computing: Vec<(Lease, Stop)>,
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
        let slots = Self { shared: Arc::default(), most: WAITING.saturating_mul(n).max(LEAST_WAITING) };
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

    /// Answers the given leases as withdrawn where they have not started; where `stop` says so, those that have are told to stop
    /// and answered when they did.
    pub(crate) fn withdraw(&self, leases: &[Lease], stop: bool) {
        let mut queue = self.shared.lock();
        if stop {
            queue
                .computing
                .iter()
                .filter(|(lease, _)| leases.contains(lease))
                .for_each(|(_, stop)| stop.set());
        }
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

    /// Whether so many jobs wait that no coordinator that keeps to its own rules sent them.
    pub(crate) fn is_flooded(&self) -> bool {
        self.shared.lock().tasks.len() >= self.most
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

    /// The next task, and the word that stops it.
    fn next(&self) -> Option<(Task, Stop)> {
        let mut queue = self.lock();
        loop {
            if queue.closed {
                return None;
            }
            if let Some(task) = queue.tasks.pop_front() {
                let stop = Stop::default();
                queue.computing.push((task.lease, stop.clone()));
                return Some((task, stop));
            }
            queue = self.filled.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn work(&self) {
        while let Some((Task { lease, forward, job, outbox }, stop)) = self.next() {
            self.running.fetch_add(1, Ordering::Relaxed);
            let started = Instant::now();
            let spent = spent();
            let until = Until { spent: &spent, stop: &stop };
            let result = catch_unwind(AssertUnwindSafe(|| forward.run_within(&job, &until)))
                .unwrap_or_else(|panic| Err(ModelFailure::Solver(panic_text(panic.as_ref())).into()));
            let cost = started.elapsed().as_secs_f64();
            self.running.fetch_sub(1, Ordering::Relaxed);
            self.lock().computing.retain(|(other, _)| *other != lease);
            // A result that came all the same is as good as any; what a stopped run says of itself is not.
            if result.is_err() && stop.is_set() {
                answer(&outbox, lease, LeaseOutcome::Withdrawn, cost);
                continue;
            }
            let counter = if result.is_ok() { &self.predictions } else { &self.failures };
            counter.fetch_add(1, Ordering::Relaxed);
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

    /// Computes until it is told to stop.
    struct Endless;

    impl Forward for Endless {
        fn spec(&self) -> &starlings_models::Spec {
            unreachable!("nobody asks")
        }

        fn run(&self, _: &Job) -> Result<starlings_models::Prediction, ParticleError> {
            unreachable!("it is run within limits")
        }

        fn run_within(
            &self,
            _: &Job,
            until: &Until<'_>,
        ) -> Result<starlings_models::Prediction, ParticleError> {
            while !until.stop.is_set() {
                std::thread::yield_now();
            }
            Err(ParticleError::Infrastructure("stopped".to_owned()))
        }
    }

    #[test]
    fn a_computing_job_is_stopped_when_that_is_asked_for_and_answered_as_withdrawn() {
        let (outbox, mut sent) = tokio::sync::mpsc::unbounded_channel();
        let slots = Slots::start(1).unwrap();
        let lease = |job| Lease { epoch: 1, job, attempt: 1 };
        let window =
            starlings_models::Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![] };
        let window = Arc::new(window);
        for number in 1..=3 {
            let job = Job { particle: 0, record: 0, window: Arc::clone(&window), theta: vec![], state: None };
            slots.push(Task {
                lease: lease(number),
                forward: Arc::new(Endless),
                job,
                outbox: outbox.clone(),
            });
        }
        while slots.load().0 == 0 {
            std::thread::yield_now();
        }
        let mut withdrawn = || match FromWorker::decode(sent.blocking_recv().unwrap()).unwrap() {
            FromWorker::Result { lease, answer: LeaseOutcome::Withdrawn, .. } => lease.job,
            other => panic!("{other:?}"),
        };
        // Without the word, only what waits comes back.
        slots.withdraw(&[lease(1), lease(2)], false);
        assert_eq!(withdrawn(), 2);
        slots.withdraw(&[lease(1)], true);
        assert_eq!(withdrawn(), 1);
        while slots.load().0 == 0 {
            std::thread::yield_now();
        }
        slots.withdraw(&[lease(3)], true);
        assert_eq!(withdrawn(), 3);
        slots.close();
    }

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
