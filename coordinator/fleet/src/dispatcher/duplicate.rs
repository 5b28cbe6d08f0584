//! Slow jobs at the end of a batch: given to another worker too, while slots idle. The first result wins.
//!
//! The loser is told to stop; if it answers all the same, its result is compared. So a worker that takes jobs and gives no
//! answers holds no batch up: others make its runs, and it is set aside. Nothing here ends a run that nobody else finished.
//! Next file to read: [`super::canary`].

use std::time::Duration;

use super::Dispatcher;
use super::batch::Batch;
use super::message::{Command, WorkerId};
use super::roster::Worker;
use super::schedule::lease;
use crate::FleetEvent;

/// A job is slow when it takes so many times the usual time.
const FACTOR: f64 = 4.0;

/// And never before this time.
const SHORTEST: Duration = Duration::from_secs(2);

/// Runs shorter than this, in seconds, are given to an idle worker many at a time, as they are otherwise.
const SHORT: f64 = 0.005;

/// Workers that have the same job at most.
const MOST: usize = 3;

/// Runs of a worker that others finish, without an answer of its own, before it is set aside.
const OVERTAKEN: u32 = 3;

/// After so many times the usual time a repeat is waited for no more.
const REPEAT_FACTOR: f64 = 10.0;
const REPEAT_SHORTEST: Duration = Duration::from_secs(30);

/// One job as one worker has it.
struct Slow {
    index: usize,
    age: Duration,
    everywhere: bool,
}

impl Dispatcher {
    /// Whether another worker has a job of the batch.
    pub(super) fn is_shared(&self, index: usize) -> bool {
        let Some(batch) = &self.batch else { return false };
        let job = batch.job_number(index);
        self.duplicated.contains(&index) && self.workers.values().any(|w| w.holds(job) && !w.has_dropped(job))
    }

    /// Gives the slowest jobs to idle slots, and waits no longer for repeats that do not come.
    pub(super) fn watch_slow(&mut self, now: Duration) {
        self.drop_slow_repeats(now);
        let Some(usual) = self.run_times.median() else { return };
        let Some(batch) = &mut self.batch else { return };
        let mut candidates = candidates(&self.workers.values().collect::<Vec<_>>(), batch, now, usual);
        candidates.retain(|slow| !self.repeats.repeats(slow.index));
        for Slow { index, .. } in candidates {
            let (job, setup) = (batch.job_number(index), *batch.setup_of(index));
            let has = |w: &&Worker| w.holds(job);
            let Some(slow) = self.workers.values().find(has).map(|w| w.name.clone()) else { continue };
            let idle = |w: &&Worker| {
                let has_room = if usual < SHORT { w.has_room() } else { w.load() < w.slots };
                w.takes(&setup) && has_room && !w.holds(job) && batch.may_duplicate(index, w.id)
            };
            let to = self.workers.values().find(idle).map(|w| w.id);
            let Some(mut worker) = to.and_then(|id| self.workers.get_mut(id)) else { continue };
            let (name, to) = (batch.name(index), worker.name.clone());
            let (particle, record) = (name.particle, name.record);
            self.out.push(Command::Notice(FleetEvent::JobDuplicated { particle, record, slow, worker: to }));
            self.out.push(lease(&mut worker, batch, index, now));
            self.duplicated.insert(index);
        }
    }

    /// A repeat that takes far too long says nothing.
    fn drop_slow_repeats(&mut self, now: Duration) {
        let Some(batch) = &self.batch else { return };
        let usual = self.run_times.median().unwrap_or(0.0);
        let mut late = Vec::new();
        for &(id, index) in self.repeats.open() {
            let Some(mut worker) = self.workers.get_mut(id) else { continue };
            let job = batch.job_number(index);
            let own = worker.ages(now).into_iter().find(|(held, _, _)| *held == job);
            if own.is_some_and(|(_, age, rounds)| age > limit(REPEAT_SHORTEST, REPEAT_FACTOR, usual, rounds))
            {
                late.push((id, index, worker.call_back(job)));
            }
        }
        for (worker, index, lease) in late {
            self.repeats.ended(worker, index);
            self.no_opinion(worker, index);
            self.out.push(Command::Cancel { worker, leases: lease.into_iter().collect(), stop: true });
        }
    }

    /// A job that several workers have is done: the others stop, and one that answers nothing is set aside.
    pub(super) fn overtake(&mut self, now: Duration, winner: WorkerId, index: usize) {
        if !self.is_shared(index) {
            return;
        }
        let Some(batch) = &self.batch else { return };
        let job = batch.job_number(index);
        let mut mute = Vec::new();
        let others = self.workers.values().filter(|w| w.id != winner && w.holds(job));
        for id in others.map(|w| w.id).collect::<Vec<_>>() {
            let Some(mut worker) = self.workers.get_mut(id) else { continue };
            let Some(lease) = worker.call_back(job) else { continue };
            self.out.push(Command::Cancel { worker: worker.id, leases: vec![lease], stop: true });
            worker.overtaken += 1;
            if worker.overtaken >= OVERTAKEN {
                mute.push((worker.id, worker.overtaken));
            }
        }
        for (id, times) in mute {
            let reason = format!("it has answered nothing while others finished {times} runs that it holds");
            self.set_aside(now, id, &reason);
        }
    }
}

/// How long a run may take that waits for so many others in its slot, itself included.
fn limit(shortest: Duration, factor: f64, usual: f64, rounds: usize) -> Duration {
    let expected = Duration::try_from_secs_f64(factor * usual * rounds as f64).unwrap_or(Duration::MAX);
    shortest.max(expected)
}

/// Jobs that every worker that has them is slow with, the slowest first.
fn candidates(workers: &[&Worker], batch: &Batch, now: Duration, usual: f64) -> Vec<Slow> {
    if workers.iter().all(|w| w.aside.is_some() || w.load() >= w.slots) {
        return Vec::new();
    }
    let mut held = std::collections::BTreeMap::<usize, (usize, Slow)>::new();
    for worker in workers {
        for (job, age, rounds) in worker.ages(now) {
            let open = |index: &usize| !batch.is_finished(*index) && !worker.has_dropped(job);
            let Some(index) = batch.index_of(job).filter(open) else { continue };
            let slow = age > limit(SHORTEST, FACTOR, usual, rounds);
            let entry = held.entry(index).or_insert((0, Slow { index, age, everywhere: true }));
            entry.0 += 1;
            entry.1.everywhere &= slow;
            entry.1.age = entry.1.age.min(age);
        }
    }
    let slow = held.into_values().filter(|(n, slow)| slow.everywhere && *n < MOST);
    let mut slow = slow.map(|(_, slow)| slow).collect::<Vec<_>>();
    slow.sort_by_key(|slow| std::cmp::Reverse(slow.age));
    slow
}
