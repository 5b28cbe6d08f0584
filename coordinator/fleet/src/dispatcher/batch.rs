//! The jobs of one batch: the setup that each needs, how often each was tried, how each ended.
//!
//! Next files to read: `queue`, for those that wait, `doubt` for those that failed for an unknown reason.

mod arrived;
mod held;
mod notices;
mod recalls;
mod results;

use std::collections::BTreeMap;

use starlings_models::Failure;
use starlings_proto::SetupId;

use super::message::{ControlId, WorkerId};
use super::queue::{Queue, RetryKey};
use crate::job_name::JobName;
use crate::wire::{Outcome, Prediction};

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
    /// How each job ended, apart from them: handed to the caller as they are.
    outcomes: Vec<Option<Outcome>>,
    pub(super) queue: Queue,
    /// Jobs that failed twice and wait for a run that is known to work.
    parked: BTreeMap<usize, WorkerId>,
    /// Jobs with an outcome, in the order in which they ended.
    ended: Vec<usize>,
    /// Those of them that the caller was not told of.
    untold: Vec<usize>,
    /// How many there were when progress was told last.
    told: usize,
}

/// One job.
#[derive(Debug, Default)]
struct State {
    setup: usize,
    starts: u32,
    losses: u32,
    recalled: bool,
    /// The worker that it must not go to, as long as another one may run it.
    avoided: Option<WorkerId>,
    earlier: Option<Box<Earlier>>,
    doubt: Option<Doubt>,
    /// Who made the run of the outcome.
    by: Option<WorkerId>,
}

/// How an attempt ended, kept while the job is tried again.
#[derive(Debug)]
struct Earlier {
    end: Ended,
    name: String,
}

/// How an attempt without a prediction ended.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Ended {
    /// A failure of the model, or the limit of wall time.
    Decided(Failure),
    /// Abnormally: the cause, parameters or host, is not known yet.
    Undecided(String),
}

/// What the lease of a doubtful job stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Doubt {
    /// A run that is known to work.
    Control(ControlId),
    /// The job itself, in the place where a known run has just worked.
    Confirmed,
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
        Self {
            setups,
            open,
            first_job,
            outcomes: vec![None; names.len()],
            names,
            jobs: states,
            queue,
            parked: BTreeMap::new(),
            ended: Vec::new(),
            untold: Vec::new(),
            told: 0,
        }
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

    /// Jobs without an outcome.
    pub(super) fn n_unfinished(&self) -> usize {
        self.jobs.len() - self.ended.len()
    }

    pub(super) fn is_done(&self) -> bool {
        self.ended.len() == self.jobs.len()
    }

    pub(super) fn into_outcomes(self) -> Vec<Outcome> {
        self.outcomes.into_iter().flatten().collect()
    }

    /// Counts a start and returns its number, from 1.
    pub(super) fn start(&mut self, index: usize) -> u32 {
        self.jobs[index].starts += 1;
        self.jobs[index].starts
    }

    /// A job comes back that was not started.
    pub(super) fn withdrawn(&mut self, index: usize) {
        self.jobs[index].doubt = None;
        self.requeue(index);
    }

    /// Whether no attempt has failed yet: it may be tried once more.
    pub(super) fn may_retry(&self, index: usize) -> bool {
        self.jobs[index].earlier.is_none()
    }

    pub(super) fn retry_elsewhere(&mut self, index: usize, by: WorkerId, end: Ended, name: &str) {
        self.remember(index, end, name);
        self.jobs[index].avoided = Some(by);
        self.requeue(index);
    }

    /// Keeps how an attempt ended.
    pub(super) fn remember(&mut self, index: usize, end: Ended, name: &str) {
        self.jobs[index].earlier = Some(Box::new(Earlier { end, name: name.to_owned() }));
    }

    /// What it is being tried for.
    pub(super) fn doubt(&self, index: usize) -> Option<Doubt> {
        self.jobs[index].doubt
    }

    pub(super) fn set_doubt(&mut self, index: usize, doubt: Option<Doubt>) {
        self.jobs[index].doubt = doubt;
    }

    /// Has a job wait until a run is known to work that can be made where it failed.
    pub(super) fn park(&mut self, index: usize, by: WorkerId) {
        self.parked.insert(index, by);
    }

    /// The jobs that wait so, each with where it failed.
    pub(super) fn parked(&self) -> &BTreeMap<usize, WorkerId> {
        &self.parked
    }

    /// Takes a job out of those that wait so.
    pub(super) fn unpark(&mut self, index: usize) {
        self.parked.remove(&index);
    }

    /// The names of its jobs, in their order.
    pub(super) fn names(&self) -> impl Iterator<Item = &JobName> {
        self.names.iter()
    }

    pub(super) fn name(&self, index: usize) -> JobName {
        self.names[index]
    }

    /// Takes back a job whose worker is gone; `counted` when the worker may have died of it.
    pub(super) fn lost(&mut self, index: usize, counted: bool, limit: u32) -> Lost {
        let job = &mut self.jobs[index];
        job.losses += u32::from(counted);
        job.doubt = None;
        if counted && job.losses >= limit {
            return Lost::GivenUp;
        }
        self.requeue(index);
        Lost::Requeued
    }

    /// Jobs that come back and may go to no other worker: those that are decided end with the failure they had, the others may go
    /// back to where they failed. Returns those that ended.
    pub(super) fn settle(&mut self, key: RetryKey) -> Vec<usize> {
        let mut ended = Vec::new();
        for index in self.queue.take_all(key) {
            let attempts = self.attempts(index);
            let job = &mut self.jobs[index];
            let decided = job.earlier.take_if(|earlier| matches!(earlier.end, Ended::Decided(_)));
            if let Some(Earlier { end: Ended::Decided(failure), name }) = decided.map(|earlier| *earlier) {
                self.end(index, Outcome { result: Err(failure), attempts, worker: name });
                ended.push(index);
            } else {
                job.avoided = None;
                self.requeue(index);
            }
        }
        ended
    }

    /// Takes what `by` answered, whose name is told in the outcome.
    pub(super) fn finish(&mut self, index: usize, result: Result<Prediction, Failure>, by: (WorkerId, &str)) {
        let (attempts, (id, name)) = (self.attempts(index) + 1, by);
        self.jobs[index].by = Some(id);
        self.end(index, Outcome { result, attempts, worker: name.to_owned() });
    }

    /// Attempts that ended with a lost worker or a failure; those that a place could not make are none.
    pub(super) fn attempts(&self, index: usize) -> u32 {
        let job = &self.jobs[index];
        job.losses + u32::from(job.earlier.is_some())
    }

    /// Has a job wait again.
    pub(super) fn requeue(&mut self, index: usize) {
        let job = &self.jobs[index];
        self.queue.put_back(index, RetryKey { avoided: job.avoided, setup: job.setup });
    }

    fn end(&mut self, index: usize, outcome: Outcome) {
        let before = self.outcomes[index].replace(outcome);
        debug_assert!(before.is_none(), "a job ends once: its only lease is released before");
        if before.is_none() {
            self.ended.push(index);
            self.untold.push(index);
            self.open[self.jobs[index].setup] -= 1;
        }
    }
}
