//! A worker's jobs over the end of one stream and the beginning of the next: what was begun goes on, and its result is held.

use std::collections::HashMap;
use std::sync::Arc;

use starlings_models::{ParticleError, Prediction};
use starlings_proto::convert::ended;
use starlings_proto::{
    FromWorker, HeldRun, JobKey, JobKeys, Lease, LeaseOutcome, MAX_INLINE_STATE, State, generated,
};
use tokio::sync::mpsc::UnboundedSender;

use super::{Asked, Shared, Slots, Task, answer};
use crate::held::Ended;
use crate::held::large::Large;

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
    pub(crate) fn attach(&self, stream: UnboundedSender<generated::FromWorker>) -> Vec<JobKey> {
        let mut queue = self.shared.lock();
        queue.stream = Some(stream);
        queue.full = false;
        let (mut keys, all) = (JobKeys::default(), queue.running.iter().chain(&queue.tasks));
        let keys = all.map(|task| task.of().key(&mut keys)).collect();
        drop(queue);
        self.shared.filled.notify_all();
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

impl Shared {
    /// Answers a task that ran; held is the result whether there is somebody to answer or not.
    pub(super) fn finished(&self, task: Arc<Task>, result: Result<Prediction, ParticleError>, cost: f64) {
        match result {
            Ok(prediction) if prediction.state.len() * 8 > MAX_INLINE_STATE => {
                self.ended_large(task, Arc::new(Large::new(Prediction { cost, ..prediction })));
            }
            Ok(prediction) => {
                let Prediction { outputs, state, cost: own } = prediction;
                let prediction = Prediction { outputs, state: State::Values(state), cost: own };
                self.ended_small(&task, Ok(prediction), cost);
            }
            Err(error) => self.ended_small(&task, Err(error), cost),
        }
    }

    fn ended_small(&self, task: &Arc<Task>, result: Result<Prediction<State>, ParticleError>, cost: f64) {
        let stream = self.over(task, || Ended::inside(&result, cost));
        match (task.asked().take(), stream) {
            (Some(Asked { lease, outbox, .. }), _) => answer(&outbox, lease, LeaseOutcome::Ran(result), cost),
            (None, Some(stream)) => {
                let ended = Some(ended::encode(&result, cost).into());
                let run = HeldRun { key: task.of().key(&mut JobKeys::default()), ended };
                if let Ok(message) = FromWorker::Held(vec![run]).encode() {
                    let _ = stream.send(message);
                }
            }
            (None, None) => {}
        }
    }

    /// A stream that came meanwhile knows the run as one that goes on: it asks for the result.
    fn ended_large(&self, task: Arc<Task>, large: Arc<Large>) {
        self.over(&task, || Ended::Large(Arc::clone(&large)));
        let Some(Asked { lease, outbox, transfers }) = task.asked().take() else { return };
        let (is_wanted, cost) = (!task.stop.is_set(), large.cost());
        // What it began from is not needed for what it ended in.
        if let Some(state) = task.into_large_state() {
            transfers.recycle(state);
        }
        let answered =
            if is_wanted { LeaseOutcome::Ran(large.put(&transfers, lease)) } else { LeaseOutcome::Withdrawn };
        answer(&outbox, lease, answered, cost);
        if let Some(state) = Arc::into_inner(large).and_then(Large::into_memory) {
            transfers.recycle(state);
        }
    }

    /// Holds how a task ended, which computes no more; the stream of now.
    fn over(
        &self,
        task: &Arc<Task>,
        ended: impl FnOnce() -> Ended,
    ) -> Option<UnboundedSender<generated::FromWorker>> {
        let has_room = self.held.as_ref().is_none_or(|held| held.keep(task.of(), ended()));
        let mut queue = self.lock();
        queue.running.retain(|running| !Arc::ptr_eq(running, task));
        // A stream that came meanwhile has been told all that is held.
        if !has_room && queue.stream.is_none() && !std::mem::replace(&mut queue.full, true) {
            tracing::warn!(
                "no further run is begun until the coordinator is back: no more results can be held"
            );
        }
        queue.stream.clone()
    }
}
