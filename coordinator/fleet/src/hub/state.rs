//! What the fleet is at one moment: the dispatcher, the links, the batch that somebody waits for.
//!
//! Commands become messages here. The lock around it is [`super::Hub`]'s.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::Sender;
use std::time::Duration;

use starlings_proto::{Bytes, Hello, JobEncoder, PROTOCOL, SetupId, ToWorker, VERSION, generated};
use tokio::sync::oneshot;

use super::Reply;
use super::blocks::Blocks;
use super::doorway::Doorway;
use super::excluded::Excluded;
use super::link::Link;
use super::states::States;
use super::teller::Teller;
use super::waiting::Waiting;
use crate::dispatcher::{BatchError, Command, ControlId, Dispatcher, Event, WorkerId};
use crate::event_kind::OVER;
use crate::run_traces::Spans;
use crate::tally::Counting;
use crate::wire::{Job, named};
use crate::{FleetEvent, StateStore, StoredState};

/// Workers of one coordinator at most.
const MAX_WORKERS: usize = 4096;

/// Builds of workers that are told one by one.
const MAX_BUILDS: usize = 64;

/// Guarded by the hub's lock.
pub(super) struct State {
    pub(super) dispatcher: Dispatcher,
    pub(super) links: BTreeMap<WorkerId, Link>,
    pub(super) setups: BTreeMap<SetupId, Bytes>,
    pub(super) shapes: BTreeMap<SetupId, SetupShape>,
    pub(super) running: Option<Submission>,
    /// Jobs that are known to work, for control runs.
    pub(super) kept: BTreeMap<ControlId, (SetupId, Job)>,
    /// Large states of jobs and answers.
    pub(super) states: States,
    /// Blocks of rows that workers mix.
    pub(super) blocks: Blocks,
    pub(super) events: Teller,
    pub(super) counting: Counting,
    pub(super) spans: Spans,
    /// The time of the last event.
    now: Duration,
    pub(super) first_epoch: u64,
    pub(super) joined: u64,
    pub(super) draining: bool,
    /// What workers are told when they are asked to leave.
    pub(super) last_word: &'static str,
    pub(super) given_up: Option<String>,
    pub(super) stopped: Option<String>,
    pub(super) other_builds: BTreeSet<[u8; 32]>,
    /// Runs that workers brought along.
    pub(super) waiting: Waiting,
    pub(super) excluded: Excluded,
    pub(super) doorway: Doorway,
}

/// Names and sizes of what a setup runs, as far as they are known without building it.
pub(crate) struct SetupShape {
    /// Names of its parameters, in the order of a job's.
    pub(crate) parameters: Vec<String>,
    /// Length of a state, where it is known.
    pub(crate) n_state: Option<usize>,
    /// Whether it sums over rows and predicts none.
    pub(crate) sums: bool,
}

/// Why a worker is not taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Closed {
    /// It does not fit: dialling again would not help.
    Refused(String),
    /// There is no more work: it may leave.
    Over(String),
}

/// A batch and who waits for it.
pub(crate) struct Submission {
    pub(crate) jobs: Vec<(SetupId, Job)>,
    /// The states that the jobs name.
    pub(crate) states: Vec<StoredState>,
    /// Holds the windows of the jobs as they travel.
    pub(crate) encoder: JobEncoder,
    pub(crate) reply: oneshot::Sender<Reply>,
}

impl State {
    pub(super) fn new(
        first_epoch: u64,
        dispatcher: Dispatcher,
        events: Sender<FleetEvent>,
        store: StateStore,
    ) -> Self {
        Self {
            dispatcher,
            links: BTreeMap::new(),
            setups: BTreeMap::new(),
            shapes: BTreeMap::new(),
            running: None,
            kept: BTreeMap::new(),
            states: States::new(store),
            blocks: Blocks::default(),
            events: Teller::new(events),
            counting: Counting::default(),
            spans: Spans::default(),
            now: Duration::ZERO,
            first_epoch,
            joined: 0,
            draining: false,
            last_word: OVER,
            given_up: None,
            stopped: None,
            other_builds: BTreeSet::new(),
            waiting: Waiting::default(),
            excluded: Excluded::default(),
            doorway: Doorway::default(),
        }
    }

    pub(super) fn admit(&self, hello: &Hello) -> Result<(), Closed> {
        if hello.protocol != PROTOCOL || hello.version != VERSION {
            return Err(Closed::Refused(format!(
                "the worker on {} is starlings {} (protocol {}), the coordinator {VERSION} (protocol {PROTOCOL}): start the \
                 worker from the coordinator's release",
                hello.host, hello.version, hello.protocol
            )));
        }
        if let Some(reason) = self.excluded.why(hello.nonce) {
            return Err(Closed::Refused(reason.to_owned()));
        }
        if self.links.len() >= MAX_WORKERS {
            let reason = format!("{MAX_WORKERS} workers are connected, and no more are taken");
            return Err(Closed::Refused(reason));
        }
        if self.draining {
            return Err(Closed::Over(self.last_word.to_owned()));
        }
        Ok(())
    }

    pub(super) fn handle(&mut self, now: Duration, event: Event) {
        self.now = now;
        let mut ended_in = None;
        let event = match event {
            Event::Answered { worker, lease, answer, cost } => {
                let own = lease.epoch == worker.0;
                let answer = if own { self.checked(&lease, answer) } else { answer };
                self.spans.end(&lease, &answer);
                if own && self.dispatcher.holds(&lease) {
                    self.counting.ended(&answer, cost);
                }
                ended_in = named(&answer).copied();
                Event::Answered { worker, lease, answer, cost }
            }
            other => other,
        };
        for command in self.dispatcher.step(now, event) {
            self.carry_out(command);
        }
        // The state of a run that was made twice, or in vain, is nobody's.
        if let Some(id) = ended_in.filter(|id| !self.dispatcher.needs_state(id)) {
            self.states.let_go(&id);
        }
        self.end_if_abandoned(now);
    }

    /// Ends the batch when the local workers are given up and the last link is gone, whichever came first.
    pub(super) fn end_if_abandoned(&mut self, now: Duration) {
        if !self.links.is_empty() || self.running.is_none() {
            return;
        }
        let Some(reason) = self.given_up.clone() else { return };
        for command in self.dispatcher.step(now, Event::Abort(BatchError::LocalWorkers(reason))) {
            self.carry_out(command);
        }
    }

    /// The coordinator's build and a worker's, when they differ and this one was not seen before.
    pub(super) fn other_build(
        &mut self,
        own: Option<[u8; 32]>,
        build: Option<[u8; 32]>,
    ) -> Option<([u8; 32], [u8; 32])> {
        let pair = own.zip(build).filter(|(own, build)| own != build)?;
        let is_new = self.other_builds.len() < MAX_BUILDS && self.other_builds.insert(pair.1);
        is_new.then_some(pair)
    }

    pub(super) fn carry_out(&mut self, command: Command) {
        match command {
            Command::SendSetup { worker, setup } => {
                if let Some(json) = self.setups.get(&setup) {
                    self.send(worker, ToWorker::setup(&setup, json.clone()));
                }
            }
            Command::SendJob { worker, lease, index } => {
                let Some(Submission { jobs, encoder, .. }) = &mut self.running else { return };
                let (Some(job), Some(link)) = (jobs.get(index), self.links.get_mut(&worker)) else { return };
                self.counting.given(&job.1);
                link.give(encoder, &mut self.spans, lease, job);
            }
            Command::SendControl { worker, lease, control } => {
                let Some(Submission { encoder, .. }) = &mut self.running else { return };
                let (Some(job), Some(link)) = (self.kept.get(&control), self.links.get_mut(&worker)) else {
                    return;
                };
                link.give(encoder, &mut self.spans, lease, job);
            }
            Command::Keep { control, index } => {
                let job = self.running.as_ref().and_then(|running| running.jobs.get(index));
                if let Some(job) = job {
                    self.states.keep(control, &job.1);
                    self.kept.insert(control, job.clone());
                }
            }
            Command::Forget { control } => {
                self.kept.remove(&control);
                self.states.forget_kept(control);
            }
            Command::Cancel { worker, leases, stop } => self.send(worker, ToWorker::cancel(&leases, stop)),
            Command::PutOut { worker, reason } => self.put_out(worker, &reason),
            // Its stream ends without a word: a worker that still lives dials again.
            Command::Close { worker } => {
                self.links.remove(&worker);
            }
            Command::BatchDone(outcomes) => {
                let lost = || BatchError::State("the state of a run that had ended is gone".to_owned());
                let held = outcomes.into_iter().map(|outcome| self.states.held(outcome));
                let outcomes = held.collect::<Option<Vec<_>>>().ok_or_else(lost);
                self.reply(outcomes);
            }
            Command::BatchFailed(error) => {
                let error = self.detailed(error);
                self.reply(Err(error));
            }
            Command::Notice(event) => self.notify(event),
            Command::GivenUp { index, mut notice } => {
                if let FleetEvent::JobFailed { parameters, .. } = &mut notice {
                    *parameters = self.parameters(index);
                }
                self.tell(notice);
            }
        }
    }

    /// Why a batch ended, with what the dispatcher does not know.
    fn detailed(&self, mut error: BatchError) -> BatchError {
        match &mut error {
            BatchError::NoControl { index, parameters, .. } => {
                let named = self.parameters(*index);
                let listed = named.iter().map(|(name, value)| format!("{name} = {value}"));
                *parameters = listed.collect::<Vec<_>>().join(", ");
            }
            BatchError::NoWorkers { missing, .. } => missing.push_str(&self.turned_away()),
            _ => {}
        }
        error
    }

    pub(super) fn tell(&mut self, event: FleetEvent) {
        tracing::debug!(?event, "fleet");
        self.counting.happened(&event);
        self.events.tell(self.now, event);
    }

    /// Names and values of the parameters of a job of the running batch.
    fn parameters(&self, index: usize) -> Vec<(String, f64)> {
        let job = self.running.as_ref().and_then(|running| running.jobs.get(index));
        let Some((setup, job)) = job else { return Vec::new() };
        let names = self.shapes.get(setup).map(|shape| &shape.parameters).into_iter().flatten();
        names.cloned().zip(job.theta.iter().copied()).collect()
    }

    pub(super) fn send(&self, worker: WorkerId, message: generated::ToWorker) {
        if let Some(link) = self.links.get(&worker) {
            link.outbox.send(message);
        }
    }

    /// What a worker is called in events.
    pub(super) fn name(&self, worker: WorkerId) -> String {
        self.links.get(&worker).map_or_else(String::new, |link| link.name.clone())
    }
}
