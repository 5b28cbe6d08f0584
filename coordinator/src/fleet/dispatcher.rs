//! Decides which worker runs which job: events in, commands out. No socket, clock or lock; time is only what events bring.
//!
//! Rules. A job is given under a lease (stream, job, attempt); an answer without a valid lease is ignored. Jobs go to the
//! least loaded worker, so that few jobs spread over all slots. A worker holds two jobs per slot when they are long, up to
//! 64 when they are shorter than a message's way. At the end of a batch, jobs that wait behind a busy slot are recalled for
//! an idle one. A lost worker's leases go back to the queue; the jobs it was running count an attempt. A model's failure is
//! tried once more on another worker, unless it could only fail again. The order of outcomes is the order of jobs, whatever happened.
//!
//! The jobs of a batch may need different setups: all of them are sent at once, and a job goes only to a worker that has built
//! its own, while others are still being built. A worker that forgets a setup is sent it again.
//!
//! Not here: what a job contains, the wire, other parameters for a failed particle. Next files to read: [`message`] for
//! events and commands, [`roster`] for workers, [`batch`] for jobs, `hand_out` for what follows from any event.

pub mod batch;
mod hand_out;
pub mod message;
mod queue;
pub mod roster;
mod run_times;
#[cfg(test)]
mod tests;
mod watch;

use std::collections::BTreeMap;
use std::time::Duration;

use starlings_models::ParticleError;
use starlings_proto::{Answer, Lease, SetupId};

use super::FleetEvent;
use batch::{Batch, JobName, Lost};
pub use message::{BatchError, Command, Event, Joining, WorkerId};
use roster::{SetupState, Worker};
use run_times::RunTimes;
use watch::{Overdue, Starved};

/// The numbers that the rules need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Time between heartbeats; a worker silent for twice as long is lost.
    pub heartbeat: Duration,
    /// How long a batch may wait without any worker that can take a job.
    pub patience: Duration,
    /// How many workers may be lost under one job before it is given up.
    pub max_attempts: u32,
}

/// The decisions of a fleet. One batch at a time.
#[derive(Debug)]
pub struct Dispatcher {
    rules: Rules,
    workers: BTreeMap<WorkerId, Worker>,
    batch: Option<Batch>,
    next_job: u64,
    last_setups: Vec<SetupId>,
    last_tick: Option<Duration>,
    starved: Option<Starved>,
    overdue: Option<Overdue>,
    run_times: RunTimes,
    local_only: bool,
    out: Vec<Command>,
}

impl Dispatcher {
    /// A dispatcher without workers or jobs.
    pub fn new(rules: Rules) -> Self {
        Self {
            rules,
            workers: BTreeMap::new(),
            batch: None,
            next_job: 1,
            last_setups: Vec::new(),
            last_tick: None,
            starved: None,
            overdue: None,
            run_times: RunTimes::default(),
            local_only: false,
            out: Vec::new(),
        }
    }

    /// Number of workers.
    pub fn n_workers(&self) -> usize {
        self.workers.len()
    }

    /// Number of slots of all workers.
    pub fn slots(&self) -> usize {
        self.workers.values().map(|w| w.slots).sum()
    }

    /// Number of leases that a worker holds.
    pub fn in_flight(&self, worker: WorkerId) -> usize {
        self.workers.get(&worker).map_or(0, Worker::load)
    }

    /// Takes one event at time `now` (any fixed origin) and returns what has to be done about it.
    pub fn step(&mut self, now: Duration, event: Event) -> Vec<Command> {
        match event {
            Event::Joined(joining) => self.joined(now, &joining),
            Event::Left { worker, reason, clean } => self.lose(worker, &reason, clean),
            Event::Heard { worker } => self.heard(now, worker),
            Event::SetupDone { worker, setup } => self.setup_answered(now, worker, setup, SetupState::Ready),
            Event::SetupFailed { worker, setup, reason } => {
                self.setup_answered(now, worker, setup, SetupState::Failed(reason));
            }
            Event::Submit { jobs } => self.submit(now, jobs),
            Event::Answered { worker, lease, answer, cost } => {
                self.answered(now, worker, lease, answer, cost);
            }
            Event::LocalOnly => self.local_only = true,
            Event::Tick => self.tick(now),
            Event::Abort(error) => self.abort(error),
        }
        self.proceed();
        std::mem::take(&mut self.out)
    }

    fn joined(&mut self, now: Duration, joining: &Joining) {
        let twin = self.workers.values().find(|w| w.nonce == joining.nonce).map(|w| w.id);
        if let Some(id) = twin {
            self.out.push(Command::Close { worker: id });
            self.lose(id, "its process connected again", true);
        }
        let mut worker = Worker::new(joining, now);
        self.out.push(Command::Notice(joining.notice()));
        if let Some(batch) = &self.batch {
            for &setup in batch.open_setups().filter(|setup| worker.wants(**setup, now)) {
                self.out.push(Command::SendSetup { worker: joining.id, setup });
            }
        }
        self.workers.insert(worker.id, worker);
    }

    fn heard(&mut self, now: Duration, worker: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&worker) {
            worker.last_heard = now;
        }
    }

    /// Takes a worker out and returns its leases to the queue. A clean leave counts no attempt.
    fn lose(&mut self, id: WorkerId, reason: &str, clean: bool) {
        let Some(worker) = self.workers.remove(&id) else { return };
        let mut requeued = 0;
        let leases = worker.leases_in_order();
        for (position, job) in leases.into_iter().enumerate() {
            let Some(batch) = &mut self.batch else { break };
            let Some(index) = batch.index_of(job) else { continue };
            let counted = !clean && position < worker.slots;
            let why = format!("{} was lost: {reason}", worker.name);
            match batch.lost(index, counted, self.rules.max_attempts, &worker.name, &why) {
                Lost::Requeued => {
                    requeued += 1;
                    if counted {
                        self.out.push(Command::Notice(batch.retried(index, &worker.name, &why)));
                    }
                }
                Lost::GivenUp => self.out.push(batch.failed(index)),
            }
        }
        let notice = FleetEvent::WorkerLeft { worker: worker.name, reason: reason.to_owned(), requeued };
        self.out.push(Command::Notice(notice));
    }

    fn setup_answered(&mut self, now: Duration, id: WorkerId, setup: SetupId, state: SetupState) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        worker.last_heard = now;
        let needed = self.batch.as_ref().is_some_and(|batch| batch.needs(&setup));
        if let SetupState::Failed(reason) = &state {
            if worker.is_ready(&setup) {
                // It had built it: its cache was full.
                worker.setups.remove(&setup);
                if needed && worker.wants(setup, now) {
                    self.out.push(Command::SendSetup { worker: id, setup });
                }
                return;
            }
            let notice = FleetEvent::SetupFailed { worker: worker.name.clone(), reason: reason.clone() };
            self.out.push(Command::Notice(notice));
        }
        worker.setup_answered(setup, state, now);
    }

    fn submit(&mut self, now: Duration, jobs: Vec<(SetupId, JobName)>) {
        self.abort(BatchError::Cancelled);
        let n = jobs.len() as u64;
        let batch = Batch::new(self.next_job, jobs);
        if !batch.shares(&self.last_setups) {
            self.workers.values_mut().for_each(Worker::forget_cost);
            self.run_times = RunTimes::default();
        }
        self.last_setups = batch.setups().to_vec();
        for worker in self.workers.values_mut() {
            for &setup in batch.setups() {
                if worker.wants(setup, now) {
                    self.out.push(Command::SendSetup { worker: worker.id, setup });
                }
            }
        }
        self.batch = Some(batch);
        self.next_job += n;
    }

    fn answered(&mut self, now: Duration, id: WorkerId, lease: Lease, answer: Answer, cost: f64) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        worker.last_heard = now;
        let valid = lease.epoch == id.0 && worker.release(lease.job, lease.attempt);
        let index = self.batch.as_ref().and_then(|batch| batch.index_of(lease.job));
        let (true, Some(index), Some(batch)) = (valid, index, &mut self.batch) else {
            if matches!(answer, Answer::Ran(_)) {
                let notice = FleetEvent::LateAnswer { worker: worker.name.clone(), job: lease.job };
                self.out.push(Command::Notice(notice));
            }
            return;
        };
        match answer {
            Answer::Withdrawn => batch.withdrawn(index),
            Answer::Ran(Ok(prediction)) => {
                worker.learn_cost(cost);
                self.run_times.learn(cost);
                batch.finish(index, Ok(prediction), &worker.name);
            }
            Answer::Ran(Err(error)) => self.model_failed(id, index, error),
        }
    }

    fn model_failed(&mut self, id: WorkerId, index: usize, error: ParticleError) {
        let Some(batch) = &mut self.batch else { return };
        let name = self.workers.get(&id).map_or("", |w| w.name.as_str());
        let setup = batch.setup_of(index);
        let other = self.workers.values().any(|w| w.id != id && w.may_run(setup));
        // A job that does not fit the model fits it nowhere.
        let repeatable = matches!(error, ParticleError::BadJob(_));
        if other && !repeatable && batch.may_retry(index) {
            self.out.push(Command::Notice(batch.retried(index, name, &error.to_string())));
            batch.retry_elsewhere(index, id, error, name);
        } else {
            batch.finish(index, Err(error), name);
            self.out.push(batch.failed(index));
        }
    }

    fn abort(&mut self, error: BatchError) {
        let Some(batch) = self.batch.take() else { return };
        for worker in self.workers.values() {
            let leases = worker.leases().filter(|l| batch.index_of(l.job).is_some()).collect::<Vec<_>>();
            if !leases.is_empty() {
                self.out.push(Command::Cancel { worker: worker.id, leases });
            }
        }
        self.starved = None;
        self.overdue = None;
        self.out.push(Command::BatchFailed(error));
    }
}
