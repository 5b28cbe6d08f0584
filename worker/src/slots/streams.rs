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
        let keys = all.map(|task| task.key(&mut keys)).collect();
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
            if let Some(lease) = leases.remove(&task.key(&mut keys)) {
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
    /// Answers a task that ran; held is the result whether there is somebody to answer or not, unless it has a large state.
    pub(super) fn finished(&self, task: Arc<Task>, result: Result<Prediction, ParticleError>, cost: f64) {
        let inside = inside(&result);
        let has_room = match (&self.held, &inside) {
            (Some(held), Some(inside)) => held.keep(task.setup, Arc::clone(&task.job), inside, cost),
            _ => true,
        };
        let mut queue = self.lock();
        queue.running.retain(|running| !Arc::ptr_eq(running, &task));
        // A stream that came meanwhile has been told all that is held.
        if !has_room && queue.stream.is_none() && !std::mem::replace(&mut queue.full, true) {
            tracing::warn!(
                "no further run is begun until the coordinator is back: no more results can be held"
            );
        }
        let stream = queue.stream.clone();
        drop(queue);
        let asked = task.asked().take();
        match (asked, stream, inside) {
            (Some(Asked { lease, outbox, .. }), _, Some(inside)) => {
                answer(&outbox, lease, LeaseOutcome::Ran(inside), cost);
            }
            (Some(Asked { lease, outbox, transfers }), _, None) => {
                let is_wanted = !task.stop.is_set();
                // What it began from is not needed for what it ended in.
                if let Some(state) = task.into_large_state() {
                    transfers.recycle(state);
                }
                let put = |prediction| transfers.sendable(lease, prediction);
                let answered =
                    if is_wanted { LeaseOutcome::Ran(result.and_then(put)) } else { LeaseOutcome::Withdrawn };
                answer(&outbox, lease, answered, cost);
            }
            (None, Some(stream), Some(inside)) => {
                let ended = Some(ended::encode(&inside, cost).into());
                let run = HeldRun { key: task.key(&mut JobKeys::default()), ended };
                if let Ok(message) = FromWorker::Held(vec![run]).encode() {
                    let _ = stream.send(message);
                }
            }
            (None, ..) => {}
        }
    }
}

/// How a run ended as it travels inside a message; `None` where its state is too large for that.
fn inside(result: &Result<Prediction, ParticleError>) -> Option<Result<Prediction<State>, ParticleError>> {
    match result {
        Ok(prediction) if prediction.state.len() * 8 > MAX_INLINE_STATE => None,
        Ok(prediction) => {
            prediction.clone().try_map(|values| Ok::<_, ()>(State::Values(values))).ok().map(Ok)
        }
        Err(error) => Some(Err(error.clone())),
    }
}
