//! What is known of repeated runs: how many were made, which are open, whose results nobody has compared yet.
//!
//! Only data. Next files to read: [`super::canary`], [`super::dispute`].

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use starlings_proto::SetupId;

use super::firsts::Firsts;
use super::message::{Likeness, WorkerId};
use super::opinion::Opinion;

/// How results are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Comparing {
    /// Draws the runs that are repeated.
    pub seed: u64,
    /// Whether workers may differ, which is then told and nothing else.
    pub mixed: bool,
}

/// One run in so many is repeated.
const SAMPLED: u64 = 64;

/// Of so many runs, and of so many seconds of theirs, at most one is a repeat, beside the first ones of each worker.
pub(super) const MOST: u64 = 50;

/// Workers that say different things of a job.
#[derive(Debug)]
pub(super) struct Dispute {
    pub(super) opinions: Vec<Opinion>,
    /// How often each was asked.
    pub(super) asked: BTreeMap<WorkerId, u32>,
}

/// Repeated runs.
#[derive(Debug, Default)]
pub(super) struct Repeats {
    /// Setups whose runs are not compared to the last bit.
    pub(super) likeness: BTreeMap<SetupId, Likeness>,
    /// Workers and setups of which a run was compared.
    pub(super) compared: BTreeSet<(WorkerId, SetupId)>,
    /// Runs with a prediction, and those of them that repeated another.
    pub(super) n_run: u64,
    pub(super) n_repeat: u64,
    /// What they took together, seconds.
    pub(super) run_time: f64,
    pub(super) repeat_time: f64,
    /// Runs since one was repeated at the end of a batch.
    pub(super) since_last: u64,
    /// Leases of this batch that repeat a job.
    open: BTreeSet<(WorkerId, usize)>,
    /// The same by their jobs.
    of_job: BTreeSet<(usize, WorkerId)>,
    /// Workers whose results of this batch nobody has compared yet.
    pub(super) firsts: Firsts,
    /// Jobs of this batch to repeat.
    pub(super) sampled: VecDeque<usize>,
    pub(super) disputes: BTreeMap<usize, Dispute>,
    /// Workers that were wrong in this batch.
    pub(super) wrong: BTreeSet<WorkerId>,
    /// Setups of which a difference was told.
    pub(super) told: BTreeSet<SetupId>,
}

impl Repeats {
    /// Forgets what belongs to a batch.
    pub(super) fn begin(&mut self) {
        self.open.clear();
        self.of_job.clear();
        self.firsts = Firsts::default();
        self.sampled.clear();
        self.disputes.clear();
        self.wrong.clear();
    }

    /// How runs of a setup are compared.
    pub(super) fn likeness(&self, setup: &SetupId) -> Likeness {
        self.likeness.get(setup).copied().unwrap_or(Likeness::Exact)
    }

    /// Whether one more repeat, of a run of so many seconds, stays within its share of the runs and of their time: a million short runs
    /// pay for no long ones.
    pub(super) fn affords(&self, seconds: f64) -> bool {
        let most = MOST as f64;
        (self.n_repeat + 1) * MOST <= self.n_run && (self.repeat_time + seconds) * most <= self.run_time
    }

    /// Takes note of a repeat of a run of so many seconds.
    pub(super) fn repeating(&mut self, worker: WorkerId, index: usize, seconds: f64) {
        self.open.insert((worker, index));
        self.of_job.insert((index, worker));
        self.n_repeat += 1;
        self.repeat_time += seconds;
    }

    /// Leases of this batch that repeat a job.
    pub(super) fn open(&self) -> &BTreeSet<(WorkerId, usize)> {
        &self.open
    }

    /// Whether a worker repeats a job.
    pub(super) fn is_open(&self, worker: WorkerId, index: usize) -> bool {
        self.open.contains(&(worker, index))
    }

    /// A worker repeats a job no more; false where it did not.
    pub(super) fn ended(&mut self, worker: WorkerId, index: usize) -> bool {
        let was_open = self.open.remove(&(worker, index));
        if was_open {
            self.of_job.remove(&(index, worker));
            self.firsts.look_again(index);
        }
        was_open
    }

    /// Nobody repeats a job any more but this worker, where it does.
    pub(super) fn ended_but(&mut self, worker: WorkerId, index: usize) {
        for other in self.repeating_it(index).filter(|by| *by != worker).collect::<Vec<_>>() {
            self.ended(other, index);
        }
    }

    /// Whether a job of this batch is being repeated.
    pub(super) fn repeats(&self, index: usize) -> bool {
        self.repeating_it(index).next().is_some()
    }

    fn repeating_it(&self, index: usize) -> impl Iterator<Item = WorkerId> {
        let all = (index, WorkerId(0))..=(index, WorkerId(u64::MAX));
        self.of_job.range(all).map(|(_, worker)| *worker)
    }

    /// A dispute is over.
    pub(super) fn no_dispute(&mut self, index: usize) {
        if self.disputes.remove(&index).is_some() {
            self.firsts.look_again(index);
        }
    }

    /// A worker after this one, and its first result, that nobody repeats and of which there is no dispute.
    pub(super) fn next_first(&mut self, passed: Option<WorkerId>) -> Option<(WorkerId, usize)> {
        let mut at = passed;
        while let Some((id, index)) = self.firsts.next_due(at) {
            if !self.repeats(index) && !self.disputes.contains_key(&index) {
                return Some((id, index));
            }
            self.firsts.wait(id);
            at = Some(id);
        }
        None
    }

    /// A worker was wrong: what it says elsewhere is no opinion, and where only one is left there is no dispute.
    pub(super) fn hear_no_more(&mut self, worker: WorkerId) {
        self.wrong.insert(worker);
        for dispute in self.disputes.values_mut() {
            dispute.opinions.retain(|opinion| opinion.by != worker);
        }
        let over = self.disputes.iter().filter(|(_, dispute)| dispute.opinions.len() < 2);
        for index in over.map(|(index, _)| *index).collect::<Vec<_>>() {
            self.no_dispute(index);
        }
    }

    /// A worker is gone: its repeats are.
    pub(super) fn forget(&mut self, worker: WorkerId) {
        let its = self.open.range((worker, 0)..=(worker, usize::MAX));
        for (_, index) in its.copied().collect::<Vec<_>>() {
            self.ended(worker, index);
        }
        self.compared.retain(|(by, _)| *by != worker);
    }
}

/// Whether what has this number is drawn to be made again: one in [`SAMPLED`] is.
pub(crate) fn draws(seed: u64, job: u64) -> bool {
    mixed(seed ^ mixed(job)).is_multiple_of(SAMPLED)
}

/// Bits that look like drawn ones (splitmix64).
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
