//! The passing of time: silent workers, slow setups, batches that wait, jobs that do not come back, progress. Nothing else in the
//! dispatcher looks at the clock.

use std::time::Duration;

use super::batch::Batch;
use super::roster::{SetupState, Worker};
use super::{BatchError, Command, Dispatcher};
use crate::FleetEvent;

/// First notice of a batch that waits, seconds after it began to wait; each later one after twice as long.
const FIRST_NOTICE: Duration = Duration::from_secs(2);

/// A job is overdue after this time at the earliest.
const SHORTEST_OVERDUE: Duration = Duration::from_secs(30);

/// A job is overdue after so many times the usual one.
const OVERDUE_FACTOR: f64 = 10.0;

/// Since when no worker can take a job, and when to say so next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Starved {
    since: Duration,
    next_notice: Duration,
}

/// Heartbeats of silence after which a worker is lost: with the time between two looks at the clock no more than two.
const SILENT: f64 = 1.95;

/// The job that has been computing for longest, and when to say so next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overdue {
    job: u64,
    since: Duration,
    next_notice: Duration,
}

impl Dispatcher {
    pub(super) fn tick(&mut self, now: Duration) {
        let gap = now.saturating_sub(self.last_tick.unwrap_or(now));
        self.last_tick = Some(now);
        if gap > self.rules.heartbeat {
            // This process stood still (suspended, or starved of processor time): what workers sent meanwhile is unread.
            self.workers.for_each(|w| w.stood_still(gap, now));
        }
        let limit = self.rules.heartbeat.mul_f64(SILENT);
        let silent = self.workers.values().filter(|w| now.saturating_sub(w.last_heard) > limit);
        for id in silent.map(|w| w.id).collect::<Vec<_>>() {
            let reason = format!("silent for more than {:.0} s", limit.as_secs_f64());
            self.out.push(Command::Close { worker: id });
            self.lose(id, &reason, false);
        }
        self.workers.for_each(|worker| {
            if let Some(aside) = &mut worker.aside {
                aside.look_again(now);
            }
        });
        if let Some(progress) = self.batch.as_mut().and_then(Batch::progress) {
            self.out.push(Command::Notice(progress));
        }
        self.watch_setups(now);
        self.watch_starvation(now);
        self.watch_overdue(now);
        self.watch_timeouts(now);
        self.watch_slow(now);
    }

    /// A worker that builds a setup for longer than patience counts as one that cannot build it.
    fn watch_setups(&mut self, now: Duration) {
        let Some(batch) = &self.batch else { return };
        let patience = self.rules.patience;
        self.workers.for_each(|worker| {
            for setup in batch.setups() {
                let Some(state) = worker.setups.get_mut(setup) else { continue };
                if matches!(state, SetupState::Pending { since } if now.saturating_sub(*since) >= patience) {
                    let reason = format!("it was not built within {:.0} s", patience.as_secs_f64());
                    *state = SetupState::Failed(reason.clone());
                    worker.unanswered.insert(*setup);
                    let notice = FleetEvent::SetupFailed { worker: worker.name.clone(), reason };
                    self.out.push(Command::Notice(notice));
                }
            }
        });
    }

    /// Says what is missing while no worker can take any job of the batch, and ends the batch when patience does.
    fn watch_starvation(&mut self, now: Duration) {
        let Some(batch) = &self.batch else { return };
        // One that only waits for what compares its results ends by itself.
        if batch.is_done() || batch.open_setups().any(|setup| self.workers.values().any(|w| w.takes(setup))) {
            self.starved = None;
            return;
        }
        let starved = self.starved.get_or_insert(Starved { since: now, next_notice: FIRST_NOTICE });
        let waited = now.saturating_sub(starved.since);
        let told = waited >= starved.next_notice;
        if told {
            starved.next_notice *= 2;
        }
        // A worker that was set aside and computes a run to try it may be well again.
        let tried = self.workers.values().any(|w| w.aside.is_some() && w.load() > 0);
        if waited >= self.rules.patience && !tried {
            let failed = batch.open_setups().find_map(|setup| self.failed_everywhere(setup));
            let aside = self.reasons_aside();
            let error = match failed {
                Some(reason) => BatchError::SetupFailed { reason },
                None if !aside.is_empty() => BatchError::Unavailable { waited, reasons: aside },
                None => BatchError::NoWorkers { waited, missing: self.missing(batch) },
            };
            self.abort(error);
        } else if told {
            let notice = FleetEvent::Waiting { seconds: waited.as_secs_f64(), missing: self.missing(batch) };
            self.out.push(Command::Notice(notice));
        }
    }

    /// The workers that are set aside, with their reasons.
    fn reasons_aside(&self) -> String {
        let aside = |w: &Worker| w.aside.as_ref().map(|aside| format!("{} ({})", w.name, aside.reason));
        self.workers.values().filter_map(aside).collect::<Vec<_>>().join("; ")
    }

    /// What a batch without a ready worker lacks.
    fn missing(&self, batch: &Batch) -> String {
        let mut building = Vec::new();
        let mut failed = Vec::new();
        for worker in self.workers.values() {
            let states = batch.open_setups().map(|setup| worker.setups.get(setup)).collect::<Vec<_>>();
            let reason = states.iter().find_map(|state| match state {
                Some(SetupState::Failed(reason)) => Some(reason),
                _ => None,
            });
            if let Some(reason) = reason {
                failed.push(format!("{} ({reason})", worker.name));
            }
            let is_failed = states.iter().all(|state| matches!(state, Some(SetupState::Failed(_))));
            if worker.aside.is_none() && !is_failed {
                building.push(worker.name.as_str());
            }
        }
        let mut parts = Vec::new();
        if !building.is_empty() {
            parts.push(format!("the model is still being built by {}", building.join(", ")));
        }
        if !failed.is_empty() {
            parts.push(format!("the model cannot be built by {}", failed.join(", ")));
        }
        // Their reasons were told when they were set aside.
        let aside = self.workers.values().filter(|w| w.aside.is_some());
        let aside = aside.map(|w| w.name.as_str()).collect::<Vec<_>>();
        if !aside.is_empty() {
            parts.push(format!(
                "every run fails on {}, which {} tried now and then",
                aside.join(", "),
                if aside.len() == 1 { "is" } else { "are" }
            ));
        }
        if parts.is_empty() { "no worker is connected".to_owned() } else { parts.join("; ") }
    }

    /// Names the job that has been computing for longest when it takes much longer than the others did, and again after twice as
    /// long. It is not ended: how long a run may take is not known here.
    fn watch_overdue(&mut self, now: Duration) {
        self.workers.for_each(|worker| worker.mark_running(now));
        let Some(batch) = &self.batch else { return };
        let running =
            self.workers.values().flat_map(|w| w.running().map(move |(job, since)| (since, job, w)));
        let oldest = running.filter(|(_, job, _)| batch.index_of(*job).is_some());
        let Some((since, job, worker)) = oldest.min_by_key(|&(since, job, _)| (since, job)) else {
            self.overdue = None;
            return;
        };
        let out = now.saturating_sub(since);
        if out < SHORTEST_OVERDUE {
            self.overdue = None;
            return;
        }
        let usual = self.run_times.median();
        let limit = SHORTEST_OVERDUE
            .max(Duration::try_from_secs_f64(OVERDUE_FACTOR * usual.unwrap_or(0.0)).unwrap_or_default());
        let known = self.overdue.filter(|overdue| (overdue.job, overdue.since) == (job, since));
        let next_notice = known.map_or(limit, |overdue| overdue.next_notice);
        let told = out >= next_notice;
        self.overdue = Some(Overdue { job, since, next_notice: if told { out * 2 } else { next_notice } });
        if told {
            let name = batch.describe(job);
            let usual = usual.map_or_else(String::new, |s| format!(", runs usually take {s:.3} s"));
            let missing = format!("{name} has not come back from worker {}{usual}", worker.name);
            self.out.push(Command::Notice(FleetEvent::Waiting { seconds: out.as_secs_f64(), missing }));
        }
    }
}
