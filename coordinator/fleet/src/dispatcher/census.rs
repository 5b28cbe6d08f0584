//! Where a dispatcher stands, in numbers.
//!
//! Next file to read: [`crate::tally`].

use super::Dispatcher;
use crate::tally::Census;

impl Dispatcher {
    /// Where it stands.
    pub(crate) fn census(&self) -> Census {
        let mut census = Census { workers: self.workers.len(), slots: self.slots(), ..Census::default() };
        for worker in self.workers.values() {
            let busy = worker.load().min(worker.slots);
            census.busy += busy;
            census.ahead += worker.load() - busy;
            census.aside += usize::from(worker.aside.is_some());
        }
        if let Some(batch) = &self.batch {
            census.open = batch.n_unfinished();
            census.queued = batch.queue.len() + batch.parked().len();
        }
        census
    }

    /// Runs that were given to workers to repeat others.
    pub(crate) fn n_repeat(&self) -> u64 {
        self.repeats.n_repeat
    }
}
