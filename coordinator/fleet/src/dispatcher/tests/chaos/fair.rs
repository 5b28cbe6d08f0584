//! What the world holds the dispatcher to of every worker.

use std::time::Duration;

use super::world::World;
use crate::dispatcher::WorkerId;

impl World {
    /// A worker that is set aside gets nothing for a while, then one run at a time to try it.
    pub(super) fn assert_sound(&self, worker: WorkerId, index: usize) {
        let Some(since) = self.aside.get(&format!("w{}", worker.0)) else { return };
        if self.controlled == Some((worker.0, index)) {
            // A job that failed is made once more where a run that is known to work has just worked.
            return;
        }
        assert!(
            self.now >= *since + Duration::from_millis(500),
            "one that is set aside gets no run at first"
        );
        assert!(
            self.open.keys().all(|(of, _)| *of != worker.0),
            "one that is set aside is tried with one run"
        );
    }

    /// No worker is charged for what it does not have, or blamed for what it was asked for.
    pub(super) fn assert_fair(&self) {
        for &worker in &self.alive {
            let open = self.open.keys().filter(|(of, _)| *of == worker).count();
            assert_eq!(self.dispatcher.in_flight(WorkerId(worker)), open, "credit follows the open leases");
        }
        let strays: u32 = self.dispatcher.workers.values().map(|worker| worker.strays).sum();
        assert!(strays <= self.strays, "a worker is blamed for answers that it was asked for");
    }
}
