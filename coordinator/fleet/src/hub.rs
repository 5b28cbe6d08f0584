//! Carries the dispatcher's commands out: the one place where events meet the clock, the links and the waiting caller.
//!
//! Every event is handled to its end under one lock, on the thread that brings it. A panic under that lock is a broken invariant:
//! the next event panics too, and the network turns that into the end of the fleet. Nothing is decided here. Next file to
//! read: `state`, then [`super::service`], which brings the workers' events.

mod arrival;
mod blocks;
mod doorway;
mod excluded;
mod held;
mod link;
mod locked;
mod mixing;
mod parting;
mod reading;
mod replies;
mod state;
mod states;
mod teller;
mod telling;
#[cfg(test)]
mod tests;
mod transfers;
mod waiting;

use std::hash::{BuildHasher, Hasher};
use std::sync::mpsc::Sender;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use starlings_proto::{Bytes, HeldRun, Hello, PROTOCOL, SetupId, ToWorker, Welcome};
use starlings_states::hex;
use tokio::sync::Notify;

use super::dispatcher::{BatchError, Dispatcher, Event, Joining, Likeness, Rules, WorkerId};
use super::identity::RunIdentity;
use super::job_name::JobName;
use super::outbox::Outbox;
use super::{FleetEvent, Held, Load, Outcome, StateStore, StoredState};
pub(super) use blocks::{Made, Work};
use link::Link;
use locked::Locked;
use state::State;
pub(super) use state::{Closed, SetupShape, Submission};

/// Answer to the caller of a batch.
pub(super) type Reply = Result<Vec<Outcome<Held>>, BatchError>;

/// Shared by the network and the callers.
pub(super) struct Hub {
    state: Mutex<State>,
    started: Instant,
    run_name: String,
    identity: RunIdentity,
    heartbeat: Duration,
    build: Option<[u8; 32]>,
    max_attempts: u32,
    store: StateStore,
    /// By which workers find out whether they share its folder.
    probe: Option<StoredState>,
    /// Woken whenever a link ends.
    pub(super) link_ended: Notify,
}

impl Hub {
    pub(super) fn new(
        run_name: String,
        build: Option<[u8; 32]>,
        identity: RunIdentity,
        rules: Rules,
        opens: Duration,
        events: Sender<FleetEvent>,
        (store, probe): (StateStore, Option<StoredState>),
    ) -> Self {
        // Epochs start anywhere, so that answers to an earlier coordinator on the same port carry none of this one's.
        let first_epoch = std::hash::RandomState::new().build_hasher().finish() >> 1;
        let dispatcher = Dispatcher::new(rules).opening_at(opens);
        let state = State::new(first_epoch, dispatcher, events, store.clone());
        Self {
            state: Mutex::new(state),
            started: Instant::now(),
            run_name,
            identity,
            heartbeat: rules.heartbeat,
            build,
            max_attempts: rules.max_attempts,
            store,
            probe,
            link_ended: Notify::new(),
        }
    }

    pub(super) fn tell(&self, event: FleetEvent) {
        let now = self.now();
        let mut state = self.lock();
        if let FleetEvent::Listening { address } = event {
            state.doorway.address = Some(address);
        }
        state.counting.happened(&event);
        state.events.tell(now, event);
    }

    /// The time of an event that comes now.
    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    pub(super) fn handle(&self, event: Event) {
        let now = self.now();
        self.decide().handle(now, event);
    }

    pub(super) fn max_attempts(&self) -> u32 {
        self.max_attempts
    }

    /// The network ended: nobody else will answer the caller.
    pub(super) fn stopped(&self, reason: &str) {
        let mut state = self.lock();
        state.stopped = Some(reason.to_owned());
        state.reply(Err(BatchError::Stopped(reason.to_owned())));
    }

    /// Why the network ended by itself.
    pub(super) fn why_stopped(&self) -> String {
        self.lock().stopped.clone().unwrap_or_else(|| "its thread ended".to_owned())
    }

    /// Outcomes that the caller of the batch was not told of before.
    pub(super) fn arrived(&self) -> Vec<(usize, Outcome<Held>)> {
        self.lock().arrived()
    }

    pub(super) fn counts(&self) -> (usize, usize) {
        let state = self.lock();
        (state.dispatcher.n_workers(), state.dispatcher.slots())
    }

    pub(super) fn load(&self) -> Load {
        self.lock().dispatcher.load()
    }

    /// Takes a setup as it travels, with the names of its parameters, and the length of a state where it is known.
    pub(super) fn install(&self, id: SetupId, json: Bytes, shape: SetupShape, likeness: Likeness) {
        let now = self.now();
        let mut state = self.decide();
        state.handle(now, Event::Likeness { setup: id, likeness });
        state.setups.insert(id, json);
        state.shapes.insert(id, shape);
    }

    pub(super) fn knows<'a>(&self, mut setups: impl Iterator<Item = &'a SetupId>) -> bool {
        let state = self.lock();
        setups.all(|setup| state.setups.contains_key(setup))
    }

    /// Starts a batch.
    pub(super) fn submit(&self, batch: Submission) {
        let now = self.now();
        let mut state = self.decide();
        if let Some(reason) = state.given_up.clone().filter(|_| state.links.is_empty()) {
            let _ = batch.reply.send(Err(BatchError::LocalWorkers(reason)));
            return;
        }
        let jobs = batch.jobs.iter().map(|(setup, job)| (*setup, JobName::of(job))).collect();
        state.handle(now, Event::Abort(BatchError::Cancelled));
        state.states.forget();
        state.running = Some(batch);
        state.begin(now, jobs);
    }

    /// Takes a worker or says why not. The first message on its link is the welcome.
    pub(super) fn join(&self, hello: Hello, link: Outbox) -> Result<WorkerId, Closed> {
        let now = self.now();
        let mut state = self.decide();
        if let Err(closed) = state.admit(&hello) {
            if let Closed::Refused(reason) = closed.clone() {
                state.notify(FleetEvent::WorkerRefused { host: hello.host, reason });
            }
            return Err(closed);
        }
        state.joined += 1;
        let id = WorkerId(state.first_epoch + state.joined);
        let welcome = Welcome {
            protocol: PROTOCOL,
            run: self.run_name.clone(),
            heartbeat: self.heartbeat.as_secs_f64(),
            epoch: id.0,
            run_id: self.identity.id,
            incarnation: self.identity.incarnation,
            probe: self.probe.as_ref().map(|probe| probe.pieces()[0]),
        };
        link.send(ToWorker::welcome(welcome));
        state.counting.joined(hello.nonce);
        state.states.joined(id, hello.nonce, hello.slots);
        let name = format!("{}@{}/{}", state.joined, hello.host, hello.pid);
        state.links.insert(id, Link::new(name.clone(), link, hello.pid, hello.nonce));
        let Hello { cores, slots, host, pid, nonce, build, .. } = hello;
        let other = state.other_build(self.build, build).map(|(own, build)| FleetEvent::OtherBuild {
            worker: name.clone(),
            host: host.clone(),
            build: hex(&build),
            own: hex(&own),
        });
        state.handle(now, Event::Joined(Joining { id, name, host, pid, slots, cores, nonce, build }));
        if let Some(event) = other {
            state.counting.happened(&event);
            state.events.tell(now, event);
        }
        Ok(id)
    }

    /// Takes runs that a worker brings along from an earlier connection of the same run.
    pub(super) fn bring(&self, worker: WorkerId, runs: Vec<HeldRun>) {
        let now = self.now();
        let mut state = self.decide();
        // One that was put out speaks in vain.
        if state.links.contains_key(&worker) {
            state.bring(now, worker, runs);
        }
    }

    pub(super) fn leave(&self, worker: WorkerId, reason: String, clean: bool) {
        let now = self.now();
        // After a panic under the lock there is nothing left to decide: the next tick ends the fleet.
        if self.state.is_poisoned() {
            return;
        }
        let mut state = self.lock();
        state.links.remove(&worker);
        state.waiting.left(worker);
        state.states.left(worker);
        state.blocks.left(worker);
        state.spans.left(worker, &reason);
        state.give_blocks();
        state.handle(now, Event::Left { worker, reason, clean });
        drop(state);
        self.link_ended.notify_waiters();
    }

    /// Whether all workers are processes that this one started.
    pub(super) fn is_local_only(&self) -> bool {
        self.lock().dispatcher.is_local_only()
    }

    /// The local worker processes are given up: ends the batch unless other workers are there.
    pub(super) fn give_up(&self, reason: String) {
        let now = self.now();
        let mut state = self.lock();
        state.given_up = Some(reason);
        state.end_if_abandoned(now);
    }

    pub(super) fn beat(&self) {
        for link in self.lock().links.values() {
            link.outbox.send(ToWorker::heartbeat());
        }
    }

    pub(super) fn n_links(&self) -> usize {
        self.lock().links.len()
    }

    /// The state, for a decision.
    fn decide(&self) -> Locked<'_> {
        let state = self.state.lock();
        Locked::new(state.expect("an earlier decision ended in a panic, so the fleet's state is broken"))
    }

    fn lock(&self) -> Locked<'_> {
        Locked::new(self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
