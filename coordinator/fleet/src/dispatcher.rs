//! Decides which worker runs which job: events in, commands out. No socket, clock or lock; time is only what events bring.
//!
//! Rules. A job is given under a lease (stream, job, attempt); an answer without a valid lease is ignored. Jobs go to the
//! least loaded worker, so that few jobs spread over all slots. A worker holds two jobs per slot when they are long, up to
//! 64 when they are shorter than a message's way. At the end of a batch, jobs that wait behind a busy slot are recalled for
//! an idle one. A lost worker's leases go back to the queue; the jobs it was running count an attempt. The order of outcomes is the
//! order of jobs, whatever happened.
//!
//! A model failure and a timeout are tried once more on another worker, if there is one; then they are the outcome. An
//! infrastructure failure is none: it sets the worker aside (`aside`) and the job runs elsewhere or waits. An abnormal end is decided by
//! a control run (`doubt`), made of a run that is known to work (`proven`).
//!
//! The jobs of a batch may need different setups: all of them are sent at once, and a job goes only to a worker that has built
//! its own, while others are still being built. A worker that forgets a setup is sent it again.
//!
//! Not here: what a job contains, the protocol, other parameters for a failed particle. Next files to read: [`message`] for
//! events and commands, [`roster`] for workers, [`batch`] for jobs, `schedule` for what follows from any event.

mod answers;
mod aside;
pub(crate) mod batch;
mod belief;
mod canary;
mod census;
mod dispute;
mod doubt;
mod duplicate;
mod firsts;
mod held;
pub(crate) mod message;
mod opinion;
mod proven;
mod queue;
mod repeats;
pub(crate) mod roster;
mod run_times;
mod schedule;
mod setups;
mod strays;
#[cfg(test)]
mod tests;
mod timeout;
mod watch;
mod workers;

use std::collections::BTreeSet;
use std::time::Duration;

use starlings_proto::{SetupId, StateId};

use super::job_name::JobName;
use super::wire::Outcome;
use super::{FleetEvent, Load, WorkerLoad};
use batch::{Batch, Lost};
pub(crate) use doubt::Asked;
pub(crate) use held::Taken;
pub(crate) use message::{BatchError, Command, ControlId, Event, Joining, Likeness, WorkerId};
use proven::Proven;
use repeats::Repeats;
pub(crate) use repeats::{Comparing, draws};
use roster::{SetupState, Worker};
use run_times::RunTimes;
use watch::{Overdue, Starved};
use workers::Workers;

/// The numbers that the rules need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rules {
    /// Time between heartbeats; a worker that is silent for two of them is lost.
    pub heartbeat: Duration,
    /// How long a batch may wait without any worker that can take a job.
    pub patience: Duration,
    /// How many workers may be lost under one job before it is given up.
    pub max_attempts: u32,
    /// How results of workers are compared; not at all without it.
    pub comparing: Option<Comparing>,
    /// A run that takes so many times the usual time is given up; none is without it.
    pub timeout_factor: Option<f64>,
}

/// The decisions of a fleet. One batch at a time.
#[derive(Debug)]
pub(crate) struct Dispatcher {
    rules: Rules,
    workers: Workers,
    batch: Option<Batch>,
    next_job: u64,
    last_setups: Vec<SetupId>,
    last_tick: Option<Duration>,
    starved: Option<Starved>,
    overdue: Option<Overdue>,
    run_times: RunTimes,
    proven: Proven,
    repeats: Repeats,
    /// Jobs of the batch that more than one worker was given.
    duplicated: BTreeSet<usize>,
    local_only: bool,
    /// No job is given away before: workers of an earlier start may come back with them.
    opens: Duration,
    /// No job is given away while it is looked for what workers brought along.
    pub(crate) is_matching: bool,
    /// The time of the event that is being handled.
    now: Duration,
    /// Outcomes of a batch that ended in an error, of which its caller was not told.
    left: Vec<(usize, Outcome)>,
    out: Vec<Command>,
}

impl Dispatcher {
    /// A dispatcher without workers or jobs.
    pub(crate) fn new(rules: Rules) -> Self {
        Self {
            rules,
            workers: Workers::default(),
            batch: None,
            next_job: 1,
            last_setups: Vec::new(),
            last_tick: None,
            starved: None,
            overdue: None,
            run_times: RunTimes::default(),
            proven: Proven::default(),
            repeats: Repeats::default(),
            duplicated: BTreeSet::new(),
            local_only: false,
            opens: Duration::ZERO,
            is_matching: false,
            now: Duration::ZERO,
            left: Vec::new(),
            out: Vec::new(),
        }
    }

    /// The same, which gives no job away before this time.
    pub(crate) fn opening_at(self, opens: Duration) -> Self {
        Self { opens, ..self }
    }

    /// Number of workers.
    pub(crate) fn n_workers(&self) -> usize {
        self.workers.len()
    }

    /// How much work there is, and who makes it.
    pub(crate) fn load(&self) -> Load {
        let worker = |w: &Worker| WorkerLoad { name: w.name.clone(), slots: w.slots, jobs: w.load() };
        Load {
            unfinished: self.batch.as_ref().map_or(0, Batch::n_unfinished),
            workers: self.workers.values().map(worker).collect(),
        }
    }

    /// Number of slots of all workers.
    pub(crate) fn slots(&self) -> usize {
        self.workers.slots()
    }

    /// Whether all workers are processes of this machine that were started for the run.
    pub(crate) fn is_local_only(&self) -> bool {
        self.local_only
    }

    /// Whether an outcome of the running batch names a state. Without a batch nobody knows: whoever began it has the outcomes.
    pub(crate) fn needs_state(&self, id: &StateId) -> bool {
        self.batch.as_ref().is_none_or(|batch| batch.names_state(id))
    }

    /// Takes one event at time `now` (any fixed origin) and returns what has to be done about it.
    pub(crate) fn step(&mut self, now: Duration, event: Event) -> Vec<Command> {
        self.now = now;
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
            Event::Likeness { setup, likeness } => _ = self.repeats.likeness.insert(setup, likeness),
            Event::LocalOnly => self.local_only = true,
            Event::Tick => self.tick(now),
            Event::Abort(error) => self.abort(error),
        }
        self.proceed();
        #[cfg(test)]
        tests::plain::exact(&self.workers);
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
        self.workers.insert(worker);
    }

    fn heard(&mut self, now: Duration, worker: WorkerId) {
        if let Some(mut worker) = self.workers.get_mut(worker) {
            worker.last_heard = now;
        }
    }

    /// Takes a worker out and returns its leases to the queue. A clean leave counts no attempt.
    fn lose(&mut self, id: WorkerId, reason: &str, clean: bool) {
        let Some(worker) = self.workers.remove(id) else { return };
        let (mut requeued, mut given_up) = (0, None);
        let leases = worker.leases_in_order();
        for (position, job) in leases.into_iter().enumerate() {
            let Some(batch) = &mut self.batch else { break };
            let Some(index) = batch.index_of(job) else { continue };
            // What it repeated, or others have too, does not depend on it.
            let shared = || self.workers.values().any(|w| w.holds(job) && !w.has_dropped(job));
            let repeated = self.repeats.is_open(id, index) || worker.has_dropped(job);
            if repeated || batch.is_finished(index) || (self.duplicated.contains(&index) && shared()) {
                continue;
            }
            let counted = !clean && position < worker.slots;
            let why = format!("{} was lost: {reason}", worker.name);
            match batch.lost(index, counted, self.rules.max_attempts) {
                Lost::Requeued => {
                    requeued += 1;
                    if counted {
                        self.out.push(Command::Notice(batch.retried(index, &worker.name, &why)));
                    }
                }
                Lost::GivenUp => given_up = Some((index, batch.attempts(index), why)),
            }
        }
        self.repeats.forget(id);
        let notice = FleetEvent::WorkerLeft { worker: worker.name, reason: reason.to_owned(), requeued };
        self.out.push(Command::Notice(notice));
        if let Some((index, attempts, why)) = given_up {
            self.unanswered(index, attempts, &why);
        }
    }

    fn submit(&mut self, now: Duration, jobs: Vec<(SetupId, JobName)>) {
        self.abort(BatchError::Cancelled);
        let n = jobs.len() as u64;
        let batch = Batch::new(self.next_job, jobs);
        if !batch.shares(&self.last_setups) {
            self.workers.for_each(Worker::forget_cost);
            self.run_times = RunTimes::default();
        }
        self.last_setups = batch.setups().to_vec();
        self.workers.for_each(|worker| {
            for &setup in batch.setups() {
                if worker.wants(setup, now) {
                    self.out.push(Command::SendSetup { worker: worker.id, setup });
                }
            }
        });
        self.workers.want(batch.setups());
        self.repeats.begin();
        self.duplicated.clear();
        self.proven.keep_only(batch.names(), &mut self.out);
        self.left.clear();
        self.batch = Some(batch);
        self.next_job += n;
    }

    fn abort(&mut self, error: BatchError) {
        if self.batch.is_some() {
            self.left = self.leftover(&error);
        }
        let Some(batch) = self.batch.take() else { return };
        for worker in self.workers.values() {
            let leases = worker.leases().filter(|l| batch.index_of(l.job).is_some()).collect::<Vec<_>>();
            if !leases.is_empty() {
                self.out.push(Command::Cancel { worker: worker.id, leases, stop: true });
            }
        }
        self.starved = None;
        self.overdue = None;
        self.out.push(Command::BatchFailed(error));
    }
}
