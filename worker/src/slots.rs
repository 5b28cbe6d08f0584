//! The threads that compute: one queue, one thread per slot, first in first out.
//!
//! A panicking model is a failed job, not a dead worker. The wall time of each run is measured here.

use std::collections::{HashMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use starlings_models::{ModelFailure, ParticleError, Prediction};
use starlings_proto::convert::ended;
use starlings_proto::spent::spent;
use starlings_proto::words::panic_text;
use starlings_proto::{FromWorker, HeldRun, JobKey, JobKeys, Lease, LeaseOutcome, generated, job_key};
use tokio::sync::mpsc::UnboundedSender;

use crate::held::Held;
use crate::task::{Asked, Task, answer};

/// The slots of this process.
pub(crate) struct Slots {
    shared: Arc<Shared>,
}

struct Shared {
    /// Where results are held; `None` in a worker that ends with its connection.
    held: Option<Arc<Held>>,
    queue: Mutex<Queue>,
    filled: Condvar,
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
    stream: Option<UnboundedSender<generated::FromWorker>>,
}

impl Slots {
    /// Starts the threads, or none: those that started end again when the system gives no more.
    pub(crate) fn start(n: usize, held: Option<Arc<Held>>) -> std::io::Result<Self> {
        Self::start_with(n, held, |slot, work| {
            std::thread::Builder::new().name(format!("slot-{slot}")).spawn(work)
        })
    }

    fn start_with(
        n: usize,
        held: Option<Arc<Held>>,
        spawn: impl Fn(usize, Box<dyn FnOnce() + Send>) -> std::io::Result<JoinHandle<()>>,
    ) -> std::io::Result<Self> {
        let shared = Shared {
            held,
            queue: Mutex::default(),
            filled: Condvar::new(),
            running: AtomicU32::new(0),
            predictions: AtomicU64::new(0),
            failures: AtomicU64::new(0),
        };
        let slots = Self { shared: Arc::new(shared) };
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

    /// Answers the given leases as withdrawn where they have not started.
    pub(crate) fn withdraw(&self, leases: &[Lease]) {
        let mut queue = self.shared.lock();
        let (withdrawn, kept) = queue.tasks.drain(..).partition(|task| task.has_lease(leases));
        queue.tasks = kept;
        drop(queue);
        let withdrawn: VecDeque<Arc<Task>> = withdrawn;
        for Asked { lease, outbox } in withdrawn.into_iter().filter_map(|task| task.asked().take()) {
            answer(&outbox, lease, LeaseOutcome::Withdrawn, 0.0);
        }
    }

    /// Drops what waits, and what is computed is for nobody, as when its run is over.
    pub(crate) fn forget(&self) {
        let mut queue = self.shared.lock();
        queue.tasks.clear();
        queue.running.iter().for_each(|task| drop(task.asked().take()));
    }

    /// Its stream is gone: what was begun and what waits goes on, and its results are held.
    pub(crate) fn detach(&self) {
        let mut queue = self.shared.lock();
        queue.stream = None;
        let all = queue.tasks.iter().chain(&queue.running);
        all.for_each(|task| drop(task.asked().take()));
    }

    /// A stream of the same run is there: the keys of what an earlier one asked for and is not finished. What finishes from now on is
    /// told to it.
    pub(crate) fn attach(&self, stream: UnboundedSender<generated::FromWorker>) -> Vec<JobKey> {
        let mut queue = self.shared.lock();
        queue.stream = Some(stream);
        queue.full = false;
        let (mut keys, all) = (JobKeys::default(), queue.running.iter().chain(&queue.tasks));
        let keys = all.map(|task| keys.of(&task.setup, &task.job)).collect();
        drop(queue);
        self.shared.filled.notify_all();
        keys
    }

    /// Gives leases to what an earlier stream asked for; those that are left over are neither computed nor wait.
    pub(crate) fn adopt(
        &self,
        runs: Vec<(JobKey, Lease)>,
        outbox: &UnboundedSender<generated::FromWorker>,
    ) -> Vec<(JobKey, Lease)> {
        let mut leases: HashMap<JobKey, Lease> = runs.into_iter().collect();
        if leases.is_empty() {
            return Vec::new();
        }
        let (mut keys, queue) = (JobKeys::default(), self.shared.lock());
        for task in queue.running.iter().chain(&queue.tasks) {
            if let Some(lease) = leases.remove(&keys.of(&task.setup, &task.job)) {
                *task.asked() = Some(Asked { lease, outbox: outbox.clone() });
            }
        }
        leases.into_iter().collect()
    }

    /// Drops what waits and nobody asks for any more.
    pub(crate) fn drop_void(&self) {
        self.shared.lock().tasks.retain(|task| task.asked().is_some());
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

    fn next(&self) -> Option<Arc<Task>> {
        let mut queue = self.lock();
        loop {
            if queue.closed {
                return None;
            }
            if !queue.full
                && let Some(task) = queue.tasks.pop_front()
            {
                queue.running.push(Arc::clone(&task));
                return Some(task);
            }
            queue = self.filled.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn work(&self) {
        while let Some(task) = self.next() {
            self.running.fetch_add(1, Ordering::Relaxed);
            let started = Instant::now();
            let result = catch_unwind(AssertUnwindSafe(|| task.forward.run_within(&task.job, &spent())))
                .unwrap_or_else(|panic| Err(ModelFailure::Solver(panic_text(panic.as_ref())).into()));
            let cost = started.elapsed().as_secs_f64();
            self.running.fetch_sub(1, Ordering::Relaxed);
            let counter = if result.is_ok() { &self.predictions } else { &self.failures };
            counter.fetch_add(1, Ordering::Relaxed);
            self.finished(&task, result, cost);
        }
    }

    /// Answers a task that ran; held is the result whether there is somebody to answer or not.
    fn finished(&self, task: &Arc<Task>, result: Result<Prediction, ParticleError>, cost: f64) {
        let has_room =
            self.held.as_ref().is_none_or(|held| held.keep(task.setup, Arc::clone(&task.job), &result, cost));
        let mut queue = self.lock();
        queue.running.retain(|running| !Arc::ptr_eq(running, task));
        // A stream that came meanwhile has been told all that is held.
        if !has_room && queue.stream.is_none() && !std::mem::replace(&mut queue.full, true) {
            tracing::warn!(
                "no further run is begun until the coordinator is back: no more results can be held"
            );
        }
        let stream = queue.stream.clone();
        drop(queue);
        match (task.asked().take(), stream) {
            (Some(Asked { lease, outbox }), _) => answer(&outbox, lease, LeaseOutcome::Ran(result), cost),
            (None, Some(stream)) => {
                let ended = Some(ended::encode(&result, cost).into());
                let run = HeldRun { key: job_key(&task.setup, &task.job), ended };
                if let Ok(message) = FromWorker::Held(vec![run]).encode() {
                    let _ = stream.send(message);
                }
            }
            (None, None) => {}
        }
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
        assert!(Slots::start_with(5, None, spawn).is_err());
        assert_eq!(ended.load(Ordering::Relaxed), 3);
    }
}
