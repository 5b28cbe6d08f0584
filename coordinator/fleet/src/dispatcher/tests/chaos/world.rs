//! A world of workers around a dispatcher, which obeys its commands. Next file to read: `happen.rs`, what can happen in it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use starlings_proto::{Lease, LeaseOutcome, SetupId};

use super::super::{RULES, answered, joining, setup, submit_mixed};
use super::draw::pick;
use crate::FleetEvent;
use crate::dispatcher::{BatchError, Command, Comparing, ControlId, Dispatcher, Event, Rules};
use crate::wire::Outcome;

/// Workers as the dispatcher's commands make them: what each was sent and has not answered.
pub(super) struct World {
    pub(super) dispatcher: Dispatcher,
    pub(super) now: Duration,
    pub(super) next_id: u64,
    pub(super) alive: BTreeSet<u64>,
    pub(super) setups: Vec<u8>,
    pub(super) to_build: BTreeSet<(u64, SetupId)>,
    pub(super) built: BTreeSet<(u64, SetupId)>,
    pub(super) open: BTreeMap<(u64, u64), (Lease, usize)>,
    pub(super) withdrawn: Vec<Lease>,
    pub(super) past: Vec<Lease>,
    pub(super) kept: BTreeSet<ControlId>,
    /// Which of the open leases are control runs.
    pub(super) controls: BTreeSet<(u64, u64)>,
    /// Jobs that were given to another worker too, because they took long.
    pub(super) duplicated: BTreeSet<usize>,
    /// Jobs that somebody answered with a prediction or a failure of the model.
    pub(super) answered: BTreeSet<usize>,
    /// Answers that nobody had asked for.
    pub(super) strays: u32,
    /// Workers that were put out.
    pub(super) put_out: BTreeSet<u64>,
    /// Names of workers that are set aside, each with the time since when.
    pub(super) aside: BTreeMap<String, Duration>,
    /// The control run that is being answered: its worker and the job that it was made for.
    pub(super) controlled: Option<(u64, usize)>,
    pub(super) ended: Option<Result<Vec<Outcome>, BatchError>>,
}

impl World {
    /// The same with results that are compared.
    pub(super) fn comparing(setups: &[u8], local: bool) -> Self {
        let comparing = Some(Comparing { seed: 3, mixed: false });
        Self::with(Rules { comparing, timeout_factor: Some(4.0), ..RULES }, setups, local)
    }

    /// One job per setup number.
    pub(super) fn new(setups: &[u8], local: bool) -> Self {
        Self::with(RULES, setups, local)
    }

    fn with(rules: Rules, setups: &[u8], local: bool) -> Self {
        let mut world = Self {
            dispatcher: Dispatcher::new(rules),
            now: Duration::ZERO,
            next_id: 0,
            alive: BTreeSet::new(),
            setups: setups.to_vec(),
            to_build: BTreeSet::new(),
            built: BTreeSet::new(),
            open: BTreeMap::new(),
            withdrawn: vec![],
            past: vec![],
            kept: BTreeSet::new(),
            controls: BTreeSet::new(),
            duplicated: BTreeSet::new(),
            answered: BTreeSet::new(),
            strays: 0,
            put_out: BTreeSet::new(),
            aside: BTreeMap::new(),
            controlled: None,
            ended: None,
        };
        if local {
            world.event(Event::LocalOnly);
        }
        world.event(submit_mixed(setups));
        world
    }

    pub(super) fn event(&mut self, event: Event) {
        for command in self.dispatcher.step(self.now, event) {
            self.obey(command);
        }
    }

    pub(super) fn obey(&mut self, command: Command) {
        match command {
            Command::SendSetup { worker, setup } => {
                assert!(self.alive.contains(&worker.0), "a setup is sent only to a live worker");
                assert!(self.to_build.insert((worker.0, setup)), "a setup is sent once while it is built");
            }
            Command::SendJob { worker, lease, index } => {
                let needed = (worker.0, setup(self.setups[index]));
                assert!(self.built.contains(&needed), "a job is sent only to a worker with its setup");
                assert!(self.alive.contains(&worker.0), "a job is sent only to a live worker");
                self.assert_sound(worker, index);
                let twice = self.open.values().any(|(_, open)| *open == index);
                let again = self.duplicated.contains(&index) || self.answered.contains(&index);
                let stopped =
                    self.open.values().all(|(lease, open)| *open != index || self.withdrawn.contains(lease));
                assert!(
                    !twice || again || stopped,
                    "a job has one lease at a time, unless it is slow or compared"
                );
                let held = self.open.insert((worker.0, lease.job), (lease, index));
                assert!(held.is_none(), "a worker has one lease of a job at a time");
            }
            Command::SendControl { worker, lease, control } => {
                assert!(self.kept.contains(&control), "a control run is one that is kept");
                assert!(self.alive.contains(&worker.0), "a control run is made by a live worker");
                let index = (lease.job - 1) as usize;
                self.assert_sound(worker, index);
                let stopped =
                    |(lease, open): &(Lease, usize)| *open != index || self.withdrawn.contains(lease);
                assert!(
                    self.open.values().all(stopped),
                    "a job has one lease at a time that is not called back"
                );
                self.controls.insert((worker.0, lease.job));
                self.open.insert((worker.0, lease.job), (lease, index));
            }
            Command::Keep { control, .. } => assert!(self.kept.insert(control), "it is kept once"),
            Command::Forget { control } => assert!(self.kept.remove(&control), "it was kept"),
            Command::Cancel { leases, .. } => self.withdrawn.extend(leases),
            Command::Close { worker } => self.forget(worker.0),
            Command::BatchDone(outcomes) => {
                assert!(self.ended.replace(Ok(outcomes)).is_none(), "a batch ends once");
            }
            Command::BatchFailed(error) => {
                assert!(self.ended.replace(Err(error)).is_none(), "a batch ends once");
            }
            Command::PutOut { worker, .. } => {
                self.forget(worker.0);
                self.put_out.insert(worker.0);
            }
            Command::Notice(FleetEvent::JobDuplicated { particle, .. }) => {
                self.duplicated.insert(particle as usize);
            }
            Command::Notice(FleetEvent::WorkerSetAside { worker, .. }) => {
                self.aside.insert(worker, self.now);
            }
            Command::Notice(FleetEvent::WorkerBack { worker }) => {
                self.aside.remove(&worker);
            }
            Command::Notice(_) | Command::GivenUp { .. } => {}
        }
    }

    pub(super) fn forget(&mut self, worker: u64) {
        self.aside.remove(&format!("w{worker}"));
        self.alive.remove(&worker);
        self.to_build.retain(|(of, _)| *of != worker);
        self.built.retain(|(of, _)| *of != worker);
        self.past.extend(self.open.values().map(|(lease, _)| *lease).filter(|lease| lease.epoch == worker));
        self.open.retain(|(of, _), _| *of != worker);
        self.controls.retain(|(of, _)| *of != worker);
        self.withdrawn.retain(|lease| lease.epoch != worker);
    }

    pub(super) fn join(&mut self, slots: u32) {
        self.next_id += 1;
        self.alive.insert(self.next_id);
        self.event(Event::Joined(joining(self.next_id, slots)));
    }

    pub(super) fn answer(&mut self, which: usize, answer: impl FnOnce(usize) -> LeaseOutcome, cost: f64) {
        let Some((&key, &(lease, index))) = pick(&self.open, which) else { return };
        self.open.remove(&key);
        self.controlled = self.controls.remove(&key).then_some((key.0, index));
        self.withdrawn.retain(|other| *other != lease);
        self.past.push(lease);
        self.answered.insert(index);
        self.event(answered(lease, answer(index), cost));
        self.controlled = None;
    }
}
