//! The jobs of one batch: the setup that each needs, how often each was tried, how each ended.
//!
//! Next file to read: `queue`, for those that wait.

use std::collections::{BTreeMap, BTreeSet};

use starlings_models::{ParticleError, Prediction};
use starlings_proto::SetupId;

use super::message::{Command, WorkerId};
use super::queue::{Again, Queue};
use crate::fleet::{FleetEvent, Outcome};

/// What a job is called in events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JobName {
    /// Index of the sigma point.
    pub particle: u32,
    /// Index of the record.
    pub record: u32,
}

/// What the loss of a worker means for a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lost {
    /// It waits again.
    Requeued,
    /// It was lost too often.
    GivenUp,
}

/// One batch.
#[derive(Debug)]
pub(super) struct Batch {
    /// Its setups, in the order of their first jobs.
    setups: Vec<SetupId>,
    /// Per setup, the jobs without an outcome.
    open: Vec<usize>,
    first_job: u64,
    names: Vec<JobName>,
    jobs: Vec<State>,
    pub(super) queue: Queue,
    done: usize,
    told: usize,
}

/// One job.
#[derive(Debug, Default)]
struct State {
    setup: usize,
    starts: u32,
    losses: u32,
    recalled: bool,
    failure: Option<Failure>,
    outcome: Option<Outcome>,
}

/// A model's failure, kept while another worker tries.
#[derive(Debug)]
struct Failure {
    error: ParticleError,
    by: WorkerId,
    name: String,
}

impl Batch {
    pub(super) fn new(first_job: u64, jobs: Vec<(SetupId, JobName)>) -> Self {
        let (mut setups, mut open, mut known) = (Vec::new(), Vec::new(), BTreeMap::new());
        let (mut names, mut states) = (Vec::with_capacity(jobs.len()), Vec::with_capacity(jobs.len()));
        for (id, name) in jobs {
            let setup = *known.entry(id).or_insert_with(|| {
                setups.push(id);
                open.push(0);
                setups.len() - 1
            });
            open[setup] += 1;
            names.push(name);
            states.push(State { setup, ..State::default() });
        }
        let queue = Queue::new(setups.len(), states.iter().map(|job| job.setup));
        Self { setups, open, first_job, names, jobs: states, queue, done: 0, told: 0 }
    }

    /// The setup at this position.
    pub(super) fn setup(&self, at: usize) -> &SetupId {
        &self.setups[at]
    }

    /// The setup of a job.
    pub(super) fn setup_of(&self, index: usize) -> &SetupId {
        &self.setups[self.jobs[index].setup]
    }

    /// Setups of jobs without an outcome, in the order of their first jobs.
    pub(super) fn open_setups(&self) -> impl Iterator<Item = &SetupId> {
        self.setups.iter().zip(&self.open).filter(|(_, open)| **open > 0).map(|(setup, _)| setup)
    }

    /// Whether jobs of this setup have no outcome yet.
    pub(super) fn needs(&self, setup: &SetupId) -> bool {
        self.open_setups().any(|open| open == setup)
    }

    /// Whether it has a setup in common with these.
    pub(super) fn shares(&self, setups: &[SetupId]) -> bool {
        self.setups.iter().any(|setup| setups.contains(setup))
    }

    /// All its setups.
    pub(super) fn setups(&self) -> &[SetupId] {
        &self.setups
    }

    pub(super) fn job_number(&self, index: usize) -> u64 {
        self.first_job + index as u64
    }

    /// Index of an unfinished or finished job of this batch; `None` for another batch's.
    pub(super) fn index_of(&self, job: u64) -> Option<usize> {
        let index = job.checked_sub(self.first_job)? as usize;
        (index < self.jobs.len()).then_some(index)
    }

    pub(super) fn is_done(&self) -> bool {
        self.done == self.jobs.len()
    }

    pub(super) fn into_outcomes(self) -> Vec<Outcome> {
        self.jobs.into_iter().filter_map(|job| job.outcome).collect()
    }

    /// How far the batch is, when that changed.
    pub(super) fn progress(&mut self) -> Option<FleetEvent> {
        let changed = self.told != self.done;
        self.told = self.done;
        changed.then_some(FleetEvent::Progress { done: self.done, total: self.jobs.len() })
    }

    /// What a job is called in a sentence.
    pub(super) fn describe(&self, job: u64) -> String {
        let name = self.index_of(job).and_then(|index| self.names.get(index));
        name.map_or_else(|| format!("run {job}"), |n| format!("particle {}, record {}", n.particle, n.record))
    }

    /// Counts a start and returns its number, from 1.
    pub(super) fn start(&mut self, index: usize) -> u32 {
        self.jobs[index].starts += 1;
        self.jobs[index].starts
    }

    pub(super) fn withdrawn(&mut self, index: usize) {
        self.requeue(index);
    }

    /// Whether a model's failure may be tried on another worker.
    pub(super) fn may_retry(&self, index: usize) -> bool {
        self.jobs[index].failure.is_none()
    }

    pub(super) fn retry_elsewhere(&mut self, index: usize, by: WorkerId, error: ParticleError, name: &str) {
        self.jobs[index].failure = Some(Failure { error, by, name: name.to_owned() });
        self.requeue(index);
    }

    /// Takes back a job whose worker is gone; `counted` when the worker may have died of it.
    pub(super) fn lost(&mut self, index: usize, counted: bool, limit: u32, name: &str, reason: &str) -> Lost {
        let job = &mut self.jobs[index];
        job.losses += u32::from(counted);
        if counted && job.losses >= limit {
            let attempts = self.attempts(index);
            let error = ParticleError::Lost { attempts, reason: reason.to_owned() };
            self.end(index, Outcome { result: Err(error), attempts, worker: name.to_owned() });
            return Lost::GivenUp;
        }
        self.requeue(index);
        Lost::Requeued
    }

    /// Ends jobs that come back and may go nowhere, with the failure they had.
    pub(super) fn settle(&mut self, again: Again) -> Vec<usize> {
        let indices = self.queue.take_all(again);
        for &index in &indices {
            let attempts = self.attempts(index);
            if let Some(failure) = self.jobs[index].failure.take() {
                self.end(index, Outcome { result: Err(failure.error), attempts, worker: failure.name });
            }
        }
        indices
    }

    pub(super) fn finish(&mut self, index: usize, result: Result<Prediction, ParticleError>, name: &str) {
        let attempts = self.attempts(index) + 1;
        self.end(index, Outcome { result, attempts, worker: name.to_owned() });
    }

    /// A job is called back only for one of these setups, and at most once, so that it cannot travel for ever.
    pub(super) fn may_recall(&self, job: u64, setups: &BTreeSet<SetupId>) -> bool {
        self.index_of(job)
            .is_some_and(|index| !self.jobs[index].recalled && setups.contains(self.setup_of(index)))
    }

    pub(super) fn mark_recalled(&mut self, job: u64) {
        if let Some(index) = self.index_of(job) {
            self.jobs[index].recalled = true;
        }
    }

    pub(super) fn retried(&self, index: usize, worker: &str, reason: &str) -> FleetEvent {
        let JobName { particle, record } = self.names[index];
        FleetEvent::JobRetried { particle, record, worker: worker.to_owned(), reason: reason.to_owned() }
    }

    /// That a job is given up; its parameters are known to whoever holds the jobs.
    pub(super) fn failed(&self, index: usize) -> Command {
        let JobName { particle, record } = self.names[index];
        let outcome = self.jobs[index].outcome.as_ref();
        let attempts = outcome.map_or(0, |o| o.attempts);
        let reason = match outcome.and_then(|o| o.result.as_ref().err()) {
            // The event counts the attempts itself.
            Some(ParticleError::Lost { reason, .. }) => reason.clone(),
            Some(error) => error.to_string(),
            None => String::new(),
        };
        let notice = FleetEvent::JobFailed { particle, record, parameters: Vec::new(), attempts, reason };
        Command::GivenUp { index, notice }
    }

    /// Attempts that ended with a lost worker or a model's failure.
    fn attempts(&self, index: usize) -> u32 {
        let job = &self.jobs[index];
        job.losses + u32::from(job.failure.is_some())
    }

    fn requeue(&mut self, index: usize) {
        let avoided = self.jobs[index].failure.as_ref().map(|f| f.by);
        self.queue.put_back(index, Again { avoided, setup: self.jobs[index].setup });
    }

    fn end(&mut self, index: usize, outcome: Outcome) {
        let job = &mut self.jobs[index];
        debug_assert!(job.outcome.is_none(), "a job ends once: its only lease is released before");
        if job.outcome.replace(outcome).is_none() {
            self.done += 1;
            self.open[job.setup] -= 1;
        }
    }
}
