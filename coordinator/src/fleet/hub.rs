//! Carries the dispatcher's commands out: the one place where events meet the clock, the links and the waiting caller.
//!
//! Every event is handled to its end under one lock, on the thread that brings it. Nothing is decided here. Next file to
//! read: [`super::service`], which brings the workers' events.

use std::collections::BTreeMap;
use std::hash::{BuildHasher, Hasher};
use std::sync::mpsc::Sender;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use starlings_models::Job;
use starlings_proto::{Bytes, Hello, JobEncoder, PROTOCOL, SetupId, ToWorker, VERSION, Welcome, wire};
use tokio::sync::{Notify, mpsc::UnboundedSender};
use tonic::Status;

use super::dispatcher::batch::JobName;
use super::dispatcher::{BatchError, Command, Dispatcher, Event, Joining, Rules, WorkerId};
use super::{FleetEvent, Outcome};

/// What a link carries to its worker.
pub(super) type Outgoing = Result<wire::ToWorker, Status>;

/// Answer to the caller of a batch.
pub(super) type Reply = Result<Vec<Outcome>, BatchError>;

/// Shared by the network thread and the callers.
pub(super) struct Hub {
    state: Mutex<State>,
    started: Instant,
    run_name: String,
    heartbeat: Duration,
    /// Woken whenever a link ends.
    pub(super) link_ended: Notify,
}

struct State {
    dispatcher: Dispatcher,
    links: BTreeMap<WorkerId, Link>,
    setups: BTreeMap<SetupId, Bytes>,
    running: Option<Submission>,
    encoder: JobEncoder,
    events: Sender<FleetEvent>,
    first_epoch: u64,
    joined: u64,
    draining: bool,
    given_up: Option<String>,
}

/// The way to one worker.
struct Link {
    sender: UnboundedSender<Outgoing>,
    pid: u32,
}

/// A batch and who waits for it.
pub(super) struct Submission {
    pub(super) setup: SetupId,
    pub(super) jobs: Vec<Job>,
    pub(super) reply: Sender<Reply>,
}

impl Hub {
    pub(super) fn new(run_name: String, rules: Rules, events: Sender<FleetEvent>) -> Self {
        // Epochs start anywhere, so that answers to an earlier coordinator on the same port carry none of this one's.
        let first_epoch = std::hash::RandomState::new().build_hasher().finish() >> 1;
        let state = State {
            dispatcher: Dispatcher::new(rules),
            links: BTreeMap::new(),
            setups: BTreeMap::new(),
            running: None,
            encoder: JobEncoder::default(),
            events,
            first_epoch,
            joined: 0,
            draining: false,
            given_up: None,
        };
        Self {
            state: Mutex::new(state),
            started: Instant::now(),
            run_name,
            heartbeat: rules.heartbeat,
            link_ended: Notify::new(),
        }
    }

    pub(super) fn tell(&self, event: FleetEvent) {
        let _ = self.lock().events.send(event);
    }

    pub(super) fn handle(&self, event: Event) {
        let now = self.started.elapsed();
        self.lock().handle(now, event);
    }

    pub(super) fn counts(&self) -> (usize, usize) {
        let state = self.lock();
        (state.dispatcher.n_workers(), state.dispatcher.slots())
    }

    pub(super) fn install(&self, id: SetupId, json: Bytes) {
        self.lock().setups.insert(id, json);
    }

    pub(super) fn knows(&self, setup: &SetupId) -> bool {
        self.lock().setups.contains_key(setup)
    }

    /// Starts a batch.
    pub(super) fn submit(&self, batch: Submission) {
        let now = self.started.elapsed();
        let mut state = self.lock();
        if let Some(reason) = state.given_up.clone().filter(|_| state.links.is_empty()) {
            let _ = batch.reply.send(Err(BatchError::LocalWorkers(reason)));
            return;
        }
        let names = batch.jobs.iter().map(|j| JobName { particle: j.particle, record: j.record }).collect();
        let setup = batch.setup;
        state.handle(now, Event::Abort(BatchError::Cancelled));
        state.running = Some(batch);
        state.handle(now, Event::Submit { setup, jobs: names });
    }

    /// Takes a worker or says why not. The first message on its link is the welcome.
    pub(super) fn join(&self, hello: Hello, link: UnboundedSender<Outgoing>) -> Result<WorkerId, String> {
        let now = self.started.elapsed();
        let mut state = self.lock();
        if let Err(reason) = state.admit(&hello) {
            let _ = state.events.send(FleetEvent::WorkerRefused { host: hello.host, reason: reason.clone() });
            return Err(reason);
        }
        state.joined += 1;
        let id = WorkerId(state.first_epoch + state.joined);
        let welcome = Welcome {
            protocol: PROTOCOL,
            run: self.run_name.clone(),
            heartbeat: self.heartbeat.as_secs_f64(),
            epoch: id.0,
        };
        let _ = link.send(Ok(ToWorker::welcome(welcome)));
        state.links.insert(id, Link { sender: link, pid: hello.pid });
        let name = format!("{}@{}/{}", state.joined, hello.host, hello.pid);
        let Hello { cores, slots, host, pid, nonce, build, .. } = hello;
        state.handle(now, Event::Joined(Joining { id, name, host, pid, slots, cores, nonce, build }));
        Ok(id)
    }

    pub(super) fn leave(&self, worker: WorkerId, reason: String, clean: bool) {
        let now = self.started.elapsed();
        let mut state = self.lock();
        state.links.remove(&worker);
        state.handle(now, Event::Left { worker, reason, clean });
        drop(state);
        self.link_ended.notify_waiters();
    }

    /// The local worker processes are given up: ends the batch unless other workers are there.
    pub(super) fn give_up(&self, reason: String) {
        let now = self.started.elapsed();
        let mut state = self.lock();
        state.given_up = Some(reason.clone());
        if state.links.is_empty() {
            state.handle(now, Event::Abort(BatchError::LocalWorkers(reason)));
        }
    }

    pub(super) fn beat(&self) {
        for link in self.lock().links.values() {
            let _ = link.sender.send(Ok(ToWorker::heartbeat()));
        }
    }

    /// Asks all workers to leave and takes no new ones.
    pub(super) fn drain(&self, reason: &str) {
        let mut state = self.lock();
        state.draining = true;
        for link in state.links.values() {
            let _ = link.sender.send(Ok(ToWorker::drain(reason)));
        }
    }

    /// Asks the workers with these process numbers to leave.
    pub(super) fn dismiss(&self, pids: &[u32]) {
        for link in self.lock().links.values().filter(|link| pids.contains(&link.pid)) {
            let _ = link.sender.send(Ok(ToWorker::drain("the run is over")));
        }
    }

    pub(super) fn n_links(&self) -> usize {
        self.lock().links.len()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn admit(&self, hello: &Hello) -> Result<(), String> {
        if hello.protocol != PROTOCOL || hello.version != VERSION {
            return Err(format!(
                "the worker on {} is starlings {} (protocol {}), the coordinator {VERSION} (protocol {PROTOCOL}): start the \
                 worker from the coordinator's release",
                hello.host, hello.version, hello.protocol
            ));
        }
        if self.draining {
            return Err("the run is over".to_owned());
        }
        Ok(())
    }

    fn handle(&mut self, now: Duration, event: Event) {
        for command in self.dispatcher.step(now, event) {
            self.carry_out(command);
        }
    }

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::SendSetup { worker, setup } => {
                if let Some(json) = self.setups.get(&setup) {
                    self.send(worker, ToWorker::setup(&setup, json.clone()));
                }
            }
            Command::SendJob { worker, lease, index } => {
                let Some(running) = &self.running else { return };
                let Some(job) = running.jobs.get(index) else { return };
                let message = self.encoder.encode(lease, &running.setup, job);
                self.send(worker, message);
            }
            Command::Cancel { worker, leases } => self.send(worker, ToWorker::cancel(&leases)),
            // Its stream ends without a word: a worker that still lives dials again.
            Command::Close { worker } => {
                self.links.remove(&worker);
            }
            Command::BatchDone(outcomes) => self.reply(Ok(outcomes)),
            Command::BatchFailed(error) => self.reply(Err(error)),
            Command::Notice(event) => {
                tracing::debug!(?event, "fleet");
                let _ = self.events.send(event);
            }
        }
    }

    fn send(&self, worker: WorkerId, message: wire::ToWorker) {
        // A link that is closing ends in `leave`, which returns its leases.
        if let Some(link) = self.links.get(&worker) {
            let _ = link.sender.send(Ok(message));
        }
    }

    fn reply(&mut self, reply: Reply) {
        if let Some(running) = self.running.take() {
            let _ = running.reply.send(reply);
        }
    }
}
