//! A worker's jobs over the end of one stream and the beginning of the next: what was begun goes on, and its result is held.

use std::collections::HashMap;
use std::sync::Arc;

use starlings_models::{ParticleError, Prediction};
use starlings_proto::convert::ended;
use starlings_proto::{FromWorker, HeldRun, JobKey, JobKeys, Lease, LeaseOutcome, MAX_INLINE_STATE, State};

use super::{Asked, Queue, Shared, Slots, Task};
use crate::held::Ended;
use crate::held::large::Large;
use crate::outbox::Outbox;

impl Slots {
    /// Its stream is gone: what was begun and what waits goes on, and its results are held.
    pub(crate) fn detach(&self) {
        let mut queue = self.shared.lock();
        queue.stream = None;
        let all = queue.tasks.iter().chain(&queue.running);
        all.for_each(|task| drop(task.asked().take()));
    }

    /// A stream of the same run is there: the keys of what an earlier one asked for and is not finished. What finishes from now on is
    /// told to it.
    pub(crate) fn attach(&self, stream: Outbox) -> Vec<JobKey> {
        let mut queue = self.shared.lock();
        queue.stream = Some(stream);
        queue.full = false;
        let (mut keys, all) = (JobKeys::default(), queue.running.iter().chain(&queue.tasks));
        let keys = all.map(|task| task.of().key(&mut keys)).collect();
        drop(queue);
        self.shared.filled.notify_waiters();
        keys
    }

    /// Gives leases to what an earlier stream asked for; those that are left over are neither computed nor wait.
    pub(crate) fn adopt(
        &self,
        runs: Vec<(JobKey, Lease)>,
        asked: impl Fn(Lease) -> Asked,
    ) -> Vec<(JobKey, Lease)> {
        let mut leases: HashMap<JobKey, Lease> = runs.into_iter().collect();
        if leases.is_empty() {
            return Vec::new();
        }
        let (mut keys, queue) = (JobKeys::default(), self.shared.lock());
        for task in queue.running.iter().chain(&queue.tasks) {
            if let Some(lease) = leases.remove(&task.of().key(&mut keys)) {
                *task.asked() = Some(asked(lease));
            }
        }
        leases.into_iter().collect()
    }

    /// Drops what waits and nobody asks for any more.
    pub(crate) fn drop_void(&self) {
        self.shared.lock().tasks.retain(|task| task.asked().is_some());
    }
}

/// Nobody needs what a task computed.
struct RunIsOver;

impl Queue {
    fn computes(&self, task: &Arc<Task>) -> bool {
        self.running.iter().any(|running| Arc::ptr_eq(running, task))
    }

    /// A task computes no more; the stream of now.
    fn ends(&mut self, task: &Arc<Task>) -> Result<Option<Outbox>, RunIsOver> {
        let at = self.running.iter().position(|running| Arc::ptr_eq(running, task)).ok_or(RunIsOver)?;
        self.running.remove(at);
        Ok(self.stream.clone())
    }
}

impl Shared {
    /// Answers a task that ran; held is the result whether there is somebody to answer or not.
    pub(super) fn finished(&self, task: Arc<Task>, result: Result<Prediction, ParticleError>, cost: f64) {
        match result {
            Ok(prediction) if prediction.state.len() * 8 > MAX_INLINE_STATE => {
                self.ended_large(task, Arc::new(Large::new(Prediction { cost, ..prediction })));
            }
            Ok(prediction) => {
                let Prediction { outputs, state, cost: own } = prediction;
                let prediction = Prediction { outputs, state: State::Values(state.into_vec()), cost: own };
                self.ended_small(&task, Ok(prediction), cost);
            }
            Err(error) => self.ended_small(&task, Err(error), cost),
        }
    }

    fn ended_small(&self, task: &Arc<Task>, result: Result<Prediction<State>, ParticleError>, cost: f64) {
        let Ok(stream) = self.over(task, || Ended::inside(&result, cost), false) else { return };
        match (task.asked().take(), stream) {
            (Some(Asked { lease, outbox, .. }), _) => {
                outbox.answer_when_room(lease, LeaseOutcome::Ran(result), cost);
            }
            (None, Some(stream)) => {
                let ended = Some(ended::encode(&result, cost).into());
                let run = HeldRun { key: task.of().key(&mut JobKeys::default()), ended };
                stream.send_when_room(FromWorker::Held(vec![run]));
            }
            (None, None) => {}
        }
    }

    /// A stream that came meanwhile knows the run as one that goes on: it asks for the result.
    fn ended_large(&self, task: Arc<Task>, large: Arc<Large>) {
        // This thread waits for its state to arrive.
        self.network.leave();
        let is_put = task.asked().is_some();
        if self.over(&task, || Ended::Large(Arc::clone(&large)), is_put).is_err() {
            return;
        }
        let Some(Asked { lease, outbox, transfers, .. }) = task.asked().take() else {
            self.was_put(&large, false);
            return;
        };
        let (is_wanted, cost) = (!task.stop.is_set(), large.cost());
        // What it began from is not needed for what it ended in.
        if let Some(state) = task.into_large_state() {
            transfers.recycle(state);
        }
        let answered =
            if is_wanted { LeaseOutcome::Ran(large.put(&transfers, lease)) } else { LeaseOutcome::Withdrawn };
        let mut gone = self.was_put(&large, !matches!(answered, LeaseOutcome::Ran(Err(_))));
        outbox.answer_when_room(lease, answered, cost);
        gone.push(large);
        for state in gone.into_iter().filter_map(Arc::into_inner).filter_map(Large::into_memory) {
            transfers.recycle(state);
        }
    }

    /// A large state has been put, or not; the ones that nobody needs any more.
    fn was_put(&self, large: &Arc<Large>, has_arrived: bool) -> Vec<Arc<Large>> {
        let Some(held) = &self.held else { return Vec::new() };
        let (has_room, gone) = held.was_put(large, has_arrived);
        Self::note_room(&mut self.lock(), has_room);
        gone
    }

    /// Holds how a task ended, which computes no more, where anything is held; the stream of now.
    fn over(
        &self,
        task: &Arc<Task>,
        ended: impl FnOnce() -> Ended,
        is_put: bool,
    ) -> Result<Option<Outbox>, RunIsOver> {
        let Some(held) = &self.held else { return self.lock().ends(task) };
        if !self.lock().computes(task) {
            return Err(RunIsOver);
        }
        let has_room = held.keep(task.of(), ended(), is_put);
        let mut queue = self.lock();
        // One that is over by now is held all the same.
        let stream = queue.ends(task).unwrap_or_else(|RunIsOver| queue.stream.clone());
        Self::note_room(&mut queue, has_room);
        Ok(stream)
    }

    /// No further run is begun where no more can be held.
    fn note_room(queue: &mut Queue, has_room: bool) {
        // A stream that came meanwhile has been told all that is held.
        if !has_room && queue.stream.is_none() && !std::mem::replace(&mut queue.full, true) {
            tracing::warn!(
                "no further run is begun until the coordinator is back: no more results can be held"
            );
        }
    }
}
