//! What the dispatcher knows of each worker: its slots, its leases, its setups, how long its jobs take.

mod leases;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use starlings_proto::{Lease, SetupId};
use starlings_states::hex;

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

/// Leases that a worker holds at most before it has answered any: each may carry a state.
const UNPROVEN: usize = 512;

/// Setups known of a worker, beyond which none is taken note of that it was not sent.
const UNASKED: usize = 1024;

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
    /// Setups that count as failed because it took too long to answer: the answer is no surprise.
    pub(super) unanswered: BTreeSet<SetupId>,
    /// Why it gets no jobs at the moment.
    pub(super) aside: Option<Aside>,
    held: BTreeMap<u64, Held>,
    /// Of these, how many were called back.
    n_recalled: usize,
    sent: u64,
    cost: Option<f64>,
    /// BLAKE3 of its executable in hexadecimal; empty when unknown.
    pub(super) build: String,
    /// Whether one of its results was compared with another worker's.
    pub(super) compared: bool,
    /// Its predictions that became outcomes.
    pub(super) taken: u64,
    /// Answers that nobody had asked for, less those that somebody had.
    pub(super) strays: u32,
    /// Its runs that others finished since it last answered.
    pub(super) overtaken: u32,
    /// Leases that it has answered.
    answers: usize,
}

/// A lease that has ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Released {
    /// It had been called back.
    pub(super) recalled: bool,
    /// Its answer does not matter.
    pub(super) dropped: bool,
}

/// One lease: how often the job was started, when in the worker's order, whether it was called back, since when it has certainly
/// been computed.
#[derive(Clone, Copy, Debug)]
struct Held {
    attempt: u32,
    order: u64,
    recalled: bool,
    dropped: bool,
    since: Duration,
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
            unanswered: BTreeSet::new(),
            aside: None,
            held: BTreeMap::new(),
            n_recalled: 0,
            sent: 0,
            cost: None,
            build: joining.build.map_or_else(String::new, |hash| hex(&hash)),
            compared: false,
            taken: 0,
            strays: 0,
            overtaken: 0,
            answers: 0,
        }
    }

    /// Number of leases held.
    pub(super) fn load(&self) -> usize {
        self.held.len()
    }

    /// Leases called back that have not started: they are on their way back. One that had started meanwhile runs to its end.
    pub(super) fn n_returning(&self) -> usize {
        if self.n_recalled == 0 {
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

    /// Whether it runs jobs of this setup now, or once it has built what it was sent.
    pub(super) fn will_take(&self, setup: &SetupId) -> bool {
        let state = self.setups.get(setup);
        self.aside.is_none() && matches!(state, Some(SetupState::Ready | SetupState::Pending { .. }))
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
        // A worker that has answered little holds little, however many slots it says it has.
        self.load() < (self.slots * credit).min(UNPROVEN + self.answers)
    }

    pub(super) fn hold(&mut self, lease: Lease, since: Duration) {
        self.sent += 1;
        let (attempt, order) = (lease.attempt, self.sent);
        let held = Held { attempt, order, recalled: false, dropped: false, since, running_since: None };
        let before = self.held.insert(lease.job, held);
        self.n_recalled -= usize::from(before.is_some_and(|held| held.recalled));
    }

    /// Its name, with its build where that is known.
    pub(super) fn called(&self) -> String {
        match self.build.get(..12) {
            Some(build) => format!("{} (build {build})", self.name),
            None => self.name.clone(),
        }
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

    /// Whether an answer about a setup is of no use: of a setup that it failed to build before, or of far more than it was sent.
    pub(super) fn answers_unasked(&self, setup: &SetupId, state: &SetupState) -> bool {
        match self.setups.get(setup) {
            Some(SetupState::Failed(_)) => {
                matches!(state, SetupState::Failed(_)) && !self.unanswered.contains(setup)
            }
            Some(_) => false,
            None => self.setups.len() >= UNASKED,
        }
    }

    /// Takes an answer about a setup: those that wait behind it are being built from now on.
    pub(super) fn setup_answered(&mut self, setup: SetupId, state: SetupState, now: Duration) {
        // One that was sent anew meanwhile is answered twice.
        if !matches!(self.setups.insert(setup, state), Some(SetupState::Pending { .. })) {
            self.unanswered.remove(&setup);
        }
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
