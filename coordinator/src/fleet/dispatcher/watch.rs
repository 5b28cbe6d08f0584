//! The passing of time: silent workers, batches that wait, progress. Nothing else in the dispatcher looks at the clock.

use std::time::Duration;

use super::batch::Batch;
use super::{BatchError, Command, Dispatcher};
use crate::fleet::FleetEvent;

/// First notice of a batch that waits, seconds after it began to wait; each later one after twice as long.
const FIRST_NOTICE: Duration = Duration::from_secs(2);

/// Since when no worker can take a job, and when to say so next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Starved {
    since: Duration,
    next_notice: Duration,
}

impl Dispatcher {
    pub(super) fn tick(&mut self, now: Duration) {
        let gap = now.saturating_sub(self.last_tick.unwrap_or(now));
        self.last_tick = Some(now);
        if gap > self.rules.heartbeat {
            // This process stood still (suspended, or starved of processor time): what workers sent meanwhile is unread.
            self.workers.values_mut().for_each(|w| w.last_heard = (w.last_heard + gap).min(now));
        }
        let limit = self.rules.heartbeat * 2;
        let silent = self.workers.values().filter(|w| now.saturating_sub(w.last_heard) > limit);
        for id in silent.map(|w| w.id).collect::<Vec<_>>() {
            let reason = format!("silent for more than {:.0} s", limit.as_secs_f64());
            self.out.push(Command::Close { worker: id });
            self.lose(id, &reason, false);
        }
        if let Some(progress) = self.batch.as_mut().and_then(Batch::progress) {
            self.out.push(Command::Notice(progress));
        }
        self.watch_starvation(now);
    }

    /// Says what is missing while no worker can take a job, and ends the batch when patience does.
    fn watch_starvation(&mut self, now: Duration) {
        let Some(batch) = &self.batch else { return };
        if self.workers.values().any(|w| w.is_ready(&batch.setup)) {
            self.starved = None;
            return;
        }
        let starved = self.starved.get_or_insert(Starved { since: now, next_notice: FIRST_NOTICE });
        let waited = now.saturating_sub(starved.since);
        let names = self.workers.values().map(|w| w.name.as_str()).collect::<Vec<_>>().join(", ");
        let missing = if names.is_empty() {
            "no worker is connected".to_owned()
        } else {
            format!("the model is still being built by {names}")
        };
        if waited >= self.rules.patience {
            self.abort(BatchError::NoWorkers { waited, missing });
        } else if waited >= starved.next_notice {
            starved.next_notice *= 2;
            let notice = FleetEvent::Waiting { seconds: waited.as_secs_f64(), missing };
            self.out.push(Command::Notice(notice));
        }
    }
}
