//! What the dispatcher knows of each worker: its slots, its leases, its setups, how long its jobs take.

use std::collections::BTreeMap;
use std::time::Duration;

use starlings_proto::{Lease, SetupId};

use super::aside::Aside;
use super::message::{Joining, WorkerId};

/// Jobs per slot held by a worker whose jobs are long: one runs, one waits.
const MIN_CREDIT: usize = 2;

/// Jobs per slot held by a worker whose jobs are shorter than a message's way.
const MAX_CREDIT: usize = 64;

/// Seconds of work per slot that a worker should hold; between the two limits above.
const LOOKAHEAD: f64 = 0.01;

/// Weight of the newest run in the moving average of run times.
const NEWEST: f64 = 0.3;

/// Shortest run, in seconds, for which calling a job back is worth two messages.
const RECALL_WORTH: f64 = 0.005;

/// Where a setup stands on a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum SetupState {
    /// Sent, not answered.
    Pending {
        /// When it was sent.
        since: Duration,
    },
    /// Built.
    Ready,
    /// Not built: why.
    Failed(String),
}

/// One worker.
#[derive(Debug)]
pub(super) struct Worker {
    pub(super) id: WorkerId,
    pub(super) name: String,
    pub(super) slots: usize,
    pub(super) nonce: u64,
    pub(super) last_heard: Duration,
    pub(super) setups: BTreeMap<SetupId, SetupState>,
    /// Why it gets no jobs at the moment.
    pub(super) aside: Option<Aside>,
    held: BTreeMap<u64, Held>,
    sent: u64,
    cost: Option<f64>,
}

/// One lease: how often the job was started, when in the worker's order, whether it was called back, since when it has certainly
/// been computed.
#[derive(Clone, Copy, Debug)]
struct Held {
    attempt: u32,
    order: u64,
    recalled: bool,
    running_since: Option<Duration>,
}

impl Worker {
    pub(super) fn new(joining: &Joining, now: Duration) -> Self {
        Self {
            id: joining.id,
            name: joining.name.clone(),
            slots: joining.slots.max(1) as usize,
            nonce: joining.nonce,
            last_heard: now,
            setups: BTreeMap::new(),
            aside: None,
            held: BTreeMap::new(),
            sent: 0,
            cost: None,
        }
    }

    /// Number of leases held.
    pub(super) fn load(&self) -> usize {
        self.held.len()
    }

    /// Leases called back that have not started: they are on their way back. One that had started meanwhile runs to its end.
    pub(super) fn n_returning(&self) -> usize {
        if self.held.values().all(|held| !held.recalled) {
            return 0;
        }
        let waiting = self.leases_in_order().split_off(self.slots.min(self.load()));
        waiting.iter().filter(|job| self.held.get(job).is_some_and(|held| held.recalled)).count()
    }

    /// Notes since when the jobs in its slots have been computed.
    pub(super) fn mark_running(&mut self, now: Duration) {
        if self.held.is_empty() {
            return;
        }
        for job in self.leases_in_order().into_iter().take(self.slots) {
            if let Some(held) = self.held.get_mut(&job) {
                held.running_since.get_or_insert(now);
            }
        }
    }

    /// Jobs in its slots, each with the time since when.
    pub(super) fn running(&self) -> impl Iterator<Item = (u64, Duration)> + '_ {
        self.held.iter().filter_map(|(&job, held)| Some((job, held.running_since?)))
    }

    /// Leases that certainly wait behind a busy slot and are worth calling back.
    pub(super) fn surplus(&self) -> usize {
        if self.cost.is_some_and(|cost| cost < RECALL_WORTH) {
            return 0;
        }
        self.load().saturating_sub(self.slots + self.n_returning())
    }

    pub(super) fn is_ready(&self, setup: &SetupId) -> bool {
        matches!(self.setups.get(setup), Some(SetupState::Ready))
    }

    /// Whether the worker runs jobs of this setup, now or once it is built.
    pub(super) fn may_run(&self, setup: &SetupId) -> bool {
        !matches!(self.setups.get(setup), Some(SetupState::Failed(_)))
    }

    /// Whether the worker may get jobs of this setup, now or once it is built.
    pub(super) fn could_take(&self, setup: &SetupId) -> bool {
        self.aside.is_none() && self.may_run(setup)
    }

    /// Whether it runs jobs of this setup now.
    pub(super) fn takes(&self, setup: &SetupId) -> bool {
        self.aside.is_none() && self.is_ready(setup)
    }

    /// Whether a control run can be made there now. In a place that was set aside it is how the place is tried when a job that
    /// tried it crashed.
    pub(super) fn may_control(&self, setup: &SetupId) -> bool {
        self.is_ready(setup) && self.aside.as_ref().is_none_or(|aside| aside.is_due && self.load() == 0)
    }

    pub(super) fn has_room(&self) -> bool {
        if let Some(aside) = &self.aside {
            return aside.is_due && self.load() == 0;
        }
        let credit = match self.cost {
            Some(cost) => ((LOOKAHEAD / cost.max(1e-9)) as usize).clamp(MIN_CREDIT, MAX_CREDIT),
            None => MIN_CREDIT,
        };
        self.load() < self.slots * credit
    }

    pub(super) fn hold(&mut self, lease: Lease) {
        self.sent += 1;
        self.held.insert(
            lease.job,
            Held { attempt: lease.attempt, order: self.sent, recalled: false, running_since: None },
        );
    }

    /// Ends a lease; false when it is not held.
    pub(super) fn release(&mut self, job: u64, attempt: u32) -> bool {
        let held = self.held.get(&job).is_some_and(|h| h.attempt == attempt);
        if held {
            self.held.remove(&job);
        }
        held
    }

    /// Ends the lease of a job, whatever its attempt.
    pub(super) fn take_back(&mut self, job: u64) -> Option<Lease> {
        let held = self.held.remove(&job)?;
        Some(Lease { epoch: self.id.0, job, attempt: held.attempt })
    }

    pub(super) fn leases(&self) -> impl Iterator<Item = Lease> + '_ {
        self.held.iter().map(|(&job, held)| Lease { epoch: self.id.0, job, attempt: held.attempt })
    }

    /// Jobs held, oldest lease first. Workers start jobs in this order, so the first ones were running.
    pub(super) fn leases_in_order(&self) -> Vec<u64> {
        let mut jobs = self.held.iter().map(|(&job, held)| (held.order, job)).collect::<Vec<_>>();
        jobs.sort_unstable();
        jobs.into_iter().map(|(_, job)| job).collect()
    }

    /// Marks the youngest lease that waits behind the running ones and `may` be called back.
    pub(super) fn youngest(&mut self, may: impl Fn(u64) -> bool) -> Option<Lease> {
        let waiting = self.leases_in_order().split_off(self.slots.min(self.load()));
        let open = |job: &u64| may(*job) && self.held.get(job).is_some_and(|held| !held.recalled);
        let job = waiting.into_iter().rfind(open)?;
        let held = self.held.get_mut(&job)?;
        held.recalled = true;
        Some(Lease { epoch: self.id.0, job, attempt: held.attempt })
    }

    pub(super) fn learn_cost(&mut self, seconds: f64) {
        self.cost = Some(self.cost.map_or(seconds, |mean| mean + NEWEST * (seconds - mean)));
    }

    /// Notes that a setup is on its way, unless it is built or being built; says whether to send it.
    pub(super) fn wants(&mut self, setup: SetupId, now: Duration) -> bool {
        // A setup that failed is tried again: what was missing on that host may be there now.
        if matches!(self.setups.get(&setup), Some(SetupState::Ready | SetupState::Pending { .. })) {
            return false;
        }
        self.setups.insert(setup, SetupState::Pending { since: now });
        true
    }

    /// Takes an answer about a setup: those that wait behind it are being built from now on.
    pub(super) fn setup_answered(&mut self, setup: SetupId, state: SetupState, now: Duration) {
        self.setups.insert(setup, state);
        for state in self.setups.values_mut() {
            if let SetupState::Pending { since } = state {
                *since = now;
            }
        }
    }

    pub(super) fn forget_cost(&mut self) {
        self.cost = None;
    }
}

/// The worker with the fewest leases per slot among those that are ready and have room; the earlier one of equals.
pub(super) fn least_loaded<'a>(
    workers: &'a mut BTreeMap<WorkerId, Worker>,
    setup: &SetupId,
    avoided: Option<WorkerId>,
) -> Option<&'a mut Worker> {
    workers
        .values_mut()
        .filter(|w| Some(w.id) != avoided && w.has_room() && w.is_ready(setup))
        .min_by(|a, b| (a.load() * b.slots).cmp(&(b.load() * a.slots)))
}
