//! What can happen in a world of workers.

use std::time::Duration;

use starlings_models::ParticleError;
use starlings_proto::{Lease, LeaseOutcome};

use super::super::{answered, crash, joining, left, place, prediction, solver};
use super::act::{Act, Brought, late};
use super::draw::{choose, pick};
use super::world::World;
use crate::dispatcher::{Command, Event, Taken, WorkerId};
use crate::wire::Prediction;

impl World {
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
