//! A world of workers around a dispatcher, and what can happen in it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use starlings_models::ParticleError;
use starlings_proto::{Lease, LeaseOutcome, SetupId};

use super::super::{RULES, answered, crash, joining, left, place, prediction, setup, solver, submit_mixed};
use super::act::{Act, Brought, late};
use super::draw::{choose, pick};
use crate::FleetEvent;
use crate::dispatcher::{
    BatchError, Command, Comparing, ControlId, Dispatcher, Event, Rules, Taken, WorkerId,
};
use crate::wire::{Outcome, Prediction};

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

    pub(super) fn act(&mut self, act: &Act) {
        match *act {
            Act::Join(slots) => self.join(slots),
            Act::Reconnect(which) => {
                let Some(old) = choose(&self.alive, which) else { return };
                self.next_id += 1;
                self.alive.insert(self.next_id);
                let mut twin = joining(self.next_id, 1);
                twin.nonce = old;
                self.event(Event::Joined(twin));
            }
            Act::Lose(which, clean) => {
                let Some(worker) = choose(&self.alive, which) else { return };
                self.forget(worker);
                self.event(left(worker, clean));
            }
            Act::BuildSetup(which, ok) => {
                let Some(key) = choose(&self.to_build, which) else { return };
                self.to_build.remove(&key);
                if ok {
                    self.built.insert(key);
                }
                let (worker, setup) = (WorkerId(key.0), key.1);
                let reason = "cannot".to_owned();
                self.event(if ok {
                    Event::SetupDone { worker, setup }
                } else {
                    Event::SetupFailed { worker, setup, reason }
                });
            }
            Act::ForgetSetup(which) => {
                let Some(key) = choose(&self.built, which) else { return };
                self.built.remove(&key);
                let reason = "forgotten".to_owned();
                self.event(Event::SetupFailed { worker: WorkerId(key.0), setup: key.1, reason });
            }
            Act::Answer(which, cost) => match pick(&self.open, which) {
                // A called-back job may come back unstarted.
                Some((_, (lease, _))) if self.withdrawn.contains(lease) && which % 2 == 0 => {
                    self.answer(which, |_| LeaseOutcome::Withdrawn, 0.0);
                }
                _ => self.answer(which, |index| LeaseOutcome::Ran(Ok(prediction(index))), cost),
            },
            Act::Fail(which) => self.answer(which, |_| LeaseOutcome::Ran(Err(solver("no"))), 1.0),
            Act::Crash(which) => self.answer(which, |_| LeaseOutcome::Ran(Err(crash("crash"))), 1.0),
            Act::Place(which) => self.answer(which, |_| LeaseOutcome::Ran(Err(place("disk full"))), 1.0),
            Act::Late(which) => self.answer(which, |_| LeaseOutcome::Ran(Err(late().into())), 1.0),
            Act::Repeat(which) => self.repeat(which),
            Act::Bring(who, which, how) => self.bring(who, which, how),
            Act::Wait(seconds) => {
                self.now += Duration::from_secs(seconds);
                self.event(Event::Tick);
            }
        }
        self.assert_fair();
    }

    fn repeat(&mut self, which: usize) {
        if !self.past.is_empty() {
            let lease = self.past[which % self.past.len()];
            self.strays += 1;
            self.event(answered(lease, LeaseOutcome::Ran(Ok(prediction(usize::MAX))), 1.0));
        }
    }

    /// Whoever has the job meanwhile hears of it later, and has perhaps ended it before.
    fn bring(&mut self, who: usize, which: usize, how: Brought) {
        let Some(worker) = choose(&self.alive, who) else { return };
        let index = which % self.setups.len();
        let result = match how {
            Brought::Computing => None,
            Brought::Made => Some(Ok(prediction(index))),
            Brought::Failed => Some(Err(solver("no"))),
        };
        let answer = result.map(|result| (LeaseOutcome::Ran(result), 1.0));
        let is_finished = answer.is_some();
        let of = |(_, (lease, open)): (_, &(Lease, usize))| (*open == index).then_some(*lease);
        let before: Vec<Lease> = self.open.iter().filter_map(of).collect();
        let (taken, commands) = self.dispatcher.held(self.now, WorkerId(worker), index, answer);
        if let Taken::Lease(lease) = taken {
            let own = self.open.insert((worker, lease.job), (lease, index));
            assert!(own.is_none(), "a worker has one lease of a job at a time");
        }
        if taken != Taken::No {
            self.answered.extend(is_finished.then_some(index));
            let stopped = |lease: &Lease| {
                let stops =
                    |c: &Command| matches!(c, Command::Cancel { leases, .. } if leases.contains(lease));
                self.withdrawn.contains(lease) || commands.iter().any(stops)
            };
            assert!(before.iter().all(stopped), "what another one brings along is stopped everywhere else");
            let in_doubt = before.iter().any(|lease| self.controls.contains(&(lease.epoch, lease.job)));
            assert!(!in_doubt, "what is in doubt is decided by runs of its own");
        }
        for command in commands {
            self.obey(command);
        }
    }

    /// Answers a lease as what it asks for ends: a control run works.
    pub(super) fn truly(&mut self, which: usize, ends: impl Fn(usize) -> Result<Prediction, ParticleError>) {
        let Some((&key, _)) = pick(&self.open, which) else { return };
        let is_control = self.controls.contains(&key);
        let end = |index: usize| if is_control { Ok(prediction(index)) } else { ends(index) };
        self.answer(which, |index| LeaseOutcome::Ran(end(index)), 1.0);
    }

    /// From here on the world is kind: one good worker, prompt answers.
    pub(super) fn finish(&mut self) {
        self.join(2);
        for _ in 0..20 * self.setups.len() + 50 {
            if self.ended.is_some() {
                return;
            }
            self.act(&Act::BuildSetup(0, true));
            self.act(&Act::Answer(1, 1e-3));
        }
        panic!("a batch with a good worker ends within a few events per job");
    }
}
