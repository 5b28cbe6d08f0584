//! Repeated runs: a worker that computes other numbers than others do is found out before its results are used.
//!
//! The first result of every worker is repeated on another one, and the batch waits for it; workers that are processes of this
//! machine, started from one program, are spared that. Later one run in 64 is drawn by the study's seed and repeated elsewhere, as
//! long as repeats stay below two per cent of the runs and of their time: while other jobs wait, so that it costs a run and not the
//! end of a batch, or when the last one at an end is long ago. The loser of a race for a slow job is compared too. A repeat never is an outcome.
//! Next file to read: [`super::dispute`], for results that differ.

use std::time::Duration;

use starlings_models::ParticleError;
use starlings_proto::{LeaseOutcome, SetupId};

use super::Dispatcher;
use super::batch::Batch;
use super::firsts::Contributor;
use super::message::{Likeness, WorkerId};
use super::opinion::{Opinion, Said, alike};
use super::repeats::{Dispute, MOST, draws};
use super::roster::Worker;
use super::schedule::lease;
use crate::wire::Prediction;

impl Dispatcher {
    /// How runs of a job are compared; not at all where that was not asked for.
    fn likeness(&self, index: usize) -> Likeness {
        match (&self.batch, self.rules.comparing) {
            (Some(batch), Some(_)) => self.repeats.likeness(batch.setup_of(index)),
            _ => Likeness::None,
        }
    }

    /// Takes note of a prediction, or a failure that nobody has seen but one worker, that became an outcome.
    pub(super) fn contributed(&mut self, id: WorkerId, index: usize) {
        if self.likeness(index) == Likeness::None {
            return;
        }
        let (Some(batch), Some(comparing)) = (&self.batch, self.rules.comparing) else { return };
        let Some(mut worker) = self.workers.get_mut(id) else { return };
        worker.taken += 1;
        let (repeats, setup) = (&mut self.repeats, *batch.setup_of(index));
        let seconds = self.run_times.last();
        repeats.n_run += 1;
        repeats.run_time += seconds;
        repeats.since_last += 1;
        if !worker.compared && !self.local_only {
            let new = || Contributor { name: worker.called(), index, tried: [].into() };
            repeats.firsts.add(id, new);
        }
        let is_first = !repeats.compared.contains(&(id, setup)) && repeats.affords(seconds);
        if is_first || draws(comparing.seed, batch.job_number(index)) {
            repeats.compared.insert((id, setup));
            repeats.sampled.push_back(index);
        }
    }

    /// A job that failed on one worker and has a prediction of another: one of them is wrong.
    pub(super) fn succeeded_where_another_failed(&mut self, id: WorkerId, index: usize, said: &Prediction) {
        let failed = self.batch.as_ref().and_then(|batch| batch.failed_before(index));
        let counts = |(by, _): &(WorkerId, String)| {
            self.likeness(index) != Likeness::None && !self.repeats.wrong.contains(by)
        };
        if let Some((other, why)) = failed.filter(counts) {
            self.dispute(index, [(other, Err(why)), (id, Ok(said.clone()))]);
        }
    }

    /// Starts the repeats that are due and possible.
    pub(super) fn canaries(&mut self) {
        if self.batch.is_none() || self.rules.comparing.is_none() {
            return;
        }
        self.settle_disputes();
        self.repeat_firsts();
        self.repeat_sampled();
    }

    /// Has the first result of every worker repeated that nobody repeats yet.
    fn repeat_firsts(&mut self) {
        let is_done = self.batch.as_ref().is_some_and(Batch::is_done);
        let mut passed = None;
        while let Some((id, index)) = self.repeats.next_first(passed) {
            // When nothing else is left to do, one that repeats need not have room.
            if !is_done && !self.workers.have_room() {
                return;
            }
            if self.repeat(index, id) {
                self.repeats.firsts.wait(id);
            }
            passed = Some(id);
        }
    }

    /// Compares runs of a setup no more.
    pub(super) fn compare_no_more(&mut self, setup: SetupId) {
        self.repeats.likeness.insert(setup, Likeness::None);
        let Some(batch) = &self.batch else { return };
        let other = |index: usize| *batch.setup_of(index) != setup;
        self.repeats.firsts.retain(|contributor| other(contributor.index));
        self.repeats.disputes.retain(|index, _| other(*index));
        self.repeats.sampled.retain(|index| other(*index));
    }

    /// Has a result of a worker repeated by another one; false when nobody has room.
    fn repeat(&mut self, index: usize, by: WorkerId) -> bool {
        let Some(batch) = &mut self.batch else { return false };
        let (is_done, job, setup) = (batch.is_done(), batch.job_number(index), *batch.setup_of(index));
        let tried = self.repeats.firsts.get(by).map(|contributor| &contributor.tried);
        let may =
            |w: &Worker| w.id != by && !w.holds(job) && tried.is_none_or(|tried| !tried.contains(&w.id));
        // When nothing else is left to do, it need not have room.
        let Some(mut worker) = self.workers.least_loaded_sound(&setup, is_done, may) else { return false };
        self.repeats.repeating(worker.id, index, self.run_times.last());
        self.out.push(lease(&mut worker, batch, index, self.now));
        true
    }

    fn repeat_sampled(&mut self) {
        let slots = self.slots() as u64;
        while let Some(&index) = self.repeats.sampled.front() {
            let Some(batch) = &self.batch else { return };
            let Some((by, _)) = batch.said(index).filter(|_| self.repeats.affords(self.run_times.last()))
            else {
                self.repeats.sampled.pop_front();
                continue;
            };
            let is_busy = batch.queue.fresh_setups().next().is_some();
            if !is_busy && self.repeats.since_last < MOST * slots {
                // It would prolong the batch: a later one is drawn.
                self.repeats.sampled.clear();
                return;
            }
            if !self.repeat(index, by) {
                return;
            }
            if !is_busy {
                self.repeats.since_last = 0;
            }
            self.repeats.sampled.pop_front();
        }
    }

    /// Takes the answer to a repeat, or of one who was too late.
    pub(super) fn repeated(&mut self, now: Duration, id: WorkerId, index: usize, answer: LeaseOutcome) {
        let said: Said = match answer {
            LeaseOutcome::Ran(Ok(prediction)) => Ok(prediction),
            LeaseOutcome::Ran(Err(ParticleError::Model(failed))) => Err(failed.to_string()),
            LeaseOutcome::Ran(Err(error)) => {
                self.no_opinion(id, index);
                if let ParticleError::Infrastructure(reason) = error {
                    self.set_aside(now, id, &reason);
                }
                return;
            }
            LeaseOutcome::Withdrawn => return,
        };
        self.works(id);
        self.compare(id, index, said);
    }

    /// One who was asked to repeat a job gave no result.
    pub(super) fn no_opinion(&mut self, id: WorkerId, index: usize) {
        self.repeats.firsts.no_opinion(id, index);
    }

    fn compare(&mut self, id: WorkerId, index: usize, said: Said) {
        if self.likeness(index) == Likeness::None {
            return;
        }
        if self.repeats.disputes.contains_key(&index) {
            self.opine(index, id, said);
            return;
        }
        let Some(batch) = &self.batch else { return };
        // An outcome that was taken back meanwhile is compared when there is a new one.
        let Some((by, first)) = batch.said(index).filter(|(by, _)| *by != id) else { return };
        if alike(&said, &first) {
            // That the other one repeats well says nothing of what it answers of its own.
            self.trusted(by);
        } else {
            self.dispute(index, [(by, first), (id, said)]);
        }
    }

    fn dispute(&mut self, index: usize, opinions: [(WorkerId, Said); 2]) {
        let asked = opinions.iter().map(|(id, _)| (*id, 1)).collect();
        self.repeats.disputes.insert(index, Dispute { opinions: Vec::new(), asked });
        for (id, said) in opinions {
            self.opine(index, id, said);
        }
    }

    fn opine(&mut self, index: usize, by: WorkerId, said: Said) {
        let left = || "a worker that left".to_owned();
        let gone = || self.repeats.firsts.get(by).map_or_else(left, |c| c.name.clone());
        let name = self.workers.get(by).map_or_else(gone, Worker::called);
        let Some(dispute) = self.repeats.disputes.get_mut(&index) else { return };
        dispute.opinions.push(Opinion { by, name, said });
    }

    /// The build of a worker, in hexadecimal, and how many of its results were taken so far.
    pub(crate) fn taken(&self, id: WorkerId) -> (String, u64) {
        self.workers.get(id).map_or_else(|| (String::new(), 0), |w| (w.build.clone(), w.taken))
    }

    /// Results of this worker are those of others.
    pub(super) fn trusted(&mut self, id: WorkerId) {
        self.repeats.firsts.remove(id);
        if let Some(mut worker) = self.workers.get_mut(id) {
            worker.compared = true;
        }
    }

    /// Whether nothing is left to compare before the batch may end.
    pub(super) fn is_compared(&self) -> bool {
        let is_settled = self.repeats.disputes.is_empty() && self.repeats.open().is_empty();
        is_settled && self.repeats.firsts.iter().all(|(id, first)| !self.may_be_compared(id, first))
    }
}
