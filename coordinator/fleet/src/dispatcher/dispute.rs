//! Workers that give different results for one job: who else is asked, and what follows.
//!
//! A third worker decides; where there is none, each is asked once more, and one that contradicts itself is wrong. A worker
//! that is wrong is put out, and what it answered in this batch goes back to the queue. Where nobody can tell, the batch ends
//! with an error that names the workers. Programs outside are given more room: differences of rounding, and a program that
//! contradicts itself, are told and accuse no worker. Next file to read: [`super::opinion`], for who is wrong.

use std::collections::BTreeSet;

use super::Dispatcher;
use super::message::{BatchError, Command, Likeness, WorkerId};
use super::opinion::{Opinion, Verdict, difference, last_verdict, rounded, unsteady, verdict};
use super::roster::Worker;
use super::schedule::lease;
use crate::FleetEvent;

/// How often one worker is asked for the same run.
const ASKED: u32 = 2;

/// Workers asked for one run, lest a fleet of a thousand be asked one by one.
const JURY: usize = 7;

impl Dispatcher {
    /// Ends the disputes that can be ended and asks on in the others.
    pub(super) fn settle_disputes(&mut self) {
        for index in self.repeats.disputes.keys().copied().collect::<Vec<_>>() {
            if !self.repeats.repeats(index) {
                self.settle_dispute(index);
            }
        }
    }

    fn settle_dispute(&mut self, index: usize) {
        let (Some(dispute), Some(batch)) = (self.repeats.disputes.get(&index), &self.batch) else { return };
        let opinions = dispute.opinions.clone();
        let setup = *batch.setup_of(index);
        let promised = self.repeats.likeness(&setup) == Likeness::Promised;
        let mixed = self.rules.comparing.is_some_and(|comparing| comparing.mixed);
        if mixed || (promised && rounded(&opinions)) {
            return self.accept(index, &opinions, |what| FleetEvent::WorkersDiffer { what });
        }
        if promised && !unsteady(&opinions).is_empty() {
            self.accept(index, &opinions, |what| FleetEvent::NotReproducible { what });
            return self.compare_no_more(setup);
        }
        match verdict(&opinions) {
            Verdict::Wrong(wrong) if !promised || !self.ask(index, |w| wrong.contains(&w.id)) => {
                self.convict(index, &opinions, &wrong);
            }
            Verdict::Wrong(_) => {}
            Verdict::Open => {
                let known = opinions.iter().map(|o| o.by).collect::<BTreeSet<_>>();
                let others = |w: &Worker| !known.contains(&w.id) && known.len() < JURY;
                // One that still builds the setup is asked when it has it.
                let is_coming = |w: &Worker| others(w) && w.will_take(&setup) && !w.takes(&setup);
                if self.ask(index, others)
                    || self.workers.values().any(is_coming)
                    || self.ask(index, |_| true)
                {
                    return;
                }
                match last_verdict(&opinions, |id| self.workers.contains_key(id)) {
                    Verdict::Wrong(wrong) => self.convict(index, &opinions, &wrong),
                    Verdict::Open => self.undecidable(index, &opinions),
                }
            }
        }
    }

    /// Asks one of these workers for the run; false when none is left.
    fn ask(&mut self, index: usize, of: impl Fn(&Worker) -> bool) -> bool {
        let Some(batch) = &mut self.batch else { return false };
        let Some(dispute) = self.repeats.disputes.get_mut(&index) else { return false };
        let (job, setup) = (batch.job_number(index), *batch.setup_of(index));
        let times = dispute.asked.clone();
        let asked = |w: &Worker| times.get(&w.id).copied().unwrap_or(0);
        let fits = |w: &&Worker| w.takes(&setup) && !w.holds(job) && asked(w) < ASKED && of(w);
        let key = |w: &&Worker| (asked(w), w.load() * 1000 / w.slots);
        let next = self.workers.values().filter(fits).min_by_key(key).map(|w| w.id);
        let Some(mut worker) = next.and_then(|id| self.workers.get_mut(id)) else { return false };
        *dispute.asked.entry(worker.id).or_default() += 1;
        self.repeats.repeating(worker.id, index, self.run_times.last());
        self.out.push(lease(&mut worker, batch, index, self.now));
        true
    }

    /// Lets a difference be, told once per setup.
    fn accept(&mut self, index: usize, opinions: &[Opinion], event: impl FnOnce(String) -> FleetEvent) {
        let Some(batch) = &self.batch else { return };
        if self.repeats.told.insert(*batch.setup_of(index)) {
            self.out.push(Command::Notice(event(difference(opinions))));
        }
        self.repeats.no_dispute(index);
        for opinion in opinions {
            self.trusted(opinion.by);
        }
    }

    /// Puts workers out; what they answered in this batch is made again.
    fn convict(&mut self, index: usize, opinions: &[Opinion], wrong: &BTreeSet<WorkerId>) {
        self.repeats.no_dispute(index);
        let right = opinions.iter().filter(|o| !wrong.contains(&o.by)).collect::<Vec<_>>();
        for opinion in &right {
            self.trusted(opinion.by);
        }
        for &id in wrong {
            let Some(batch) = &self.batch else { return };
            let of_it = opinions.iter().filter(|o| o.by == id);
            let told = of_it.chain(right.iter().copied()).cloned().collect::<Vec<_>>();
            let name = batch.name(index);
            let how = if unsteady(opinions).contains(&id) {
                "it gives different results for one run"
            } else {
                "it gives other results than others do"
            };
            let reason = format!(
                "{how}: of particle {}, record {}, {}",
                name.particle,
                name.record,
                difference(&told)
            );
            self.put_out(id, &told[0].name, &reason);
        }
    }

    fn put_out(&mut self, id: WorkerId, called: &str, reason: &str) {
        let Some(batch) = &mut self.batch else { return };
        let again = batch.made_by(id);
        for &index in &again {
            batch.reopen(index);
            // Whoever repeats it makes it now.
            self.repeats.ended_but(id, index);
            self.repeats.no_dispute(index);
            // Whoever still has it, as the loser of a race, answers it or gives it back.
            let job = batch.job_number(index);
            let has = |w: &Worker| w.id != id && w.holds(job) && !w.has_dropped(job);
            if !self.workers.values().any(has) {
                batch.requeue(index);
            }
        }
        self.repeats.firsts.remove(id);
        self.repeats.hear_no_more(id);
        self.send_reopened();
        let (name, build, taken) = self.workers.get(id).map_or_else(
            || (called.to_owned(), String::new(), 0),
            |worker| (worker.name.clone(), worker.build.clone(), worker.taken),
        );
        let earlier = taken.saturating_sub(again.len() as u64);
        let notice = FleetEvent::WorkerExcluded {
            worker: name,
            build,
            reason: reason.to_owned(),
            again: again.len(),
            earlier,
        };
        self.out.push(Command::Notice(notice));
        if self.workers.contains_key(id) {
            self.out.push(Command::PutOut { worker: id, reason: reason.to_owned() });
            self.lose(id, reason, true);
        }
    }

    /// Sends the setups of jobs that are open again to the workers that came, or forgot them, when none was.
    fn send_reopened(&mut self) {
        let Some(batch) = &self.batch else { return };
        self.workers.for_each(|worker| {
            for &setup in batch.open_setups() {
                if !worker.setups.contains_key(&setup) && worker.wants(setup, self.now) {
                    self.out.push(Command::SendSetup { worker: worker.id, setup });
                }
            }
        });
    }

    fn undecidable(&mut self, index: usize, opinions: &[Opinion]) {
        let Some(batch) = &self.batch else { return };
        let name = batch.name(index);
        let workers = difference(opinions);
        self.abort(BatchError::Disagreement { particle: name.particle, record: name.record, workers });
    }
}
