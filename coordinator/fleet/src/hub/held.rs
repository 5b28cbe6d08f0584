//! Runs that workers brought along, matched with jobs by the keys of both.
//!
//! What no job needs yet waits for the next batches, as when a worker is back before the coordinator has read how far it was. Next
//! file to read: [`crate::dispatcher`]'s `held`.

use std::collections::HashMap;
use std::time::Duration;

use starlings_proto::convert::ended;
use starlings_proto::{HeldRun, JobKey, JobKeys, Lease, LeaseOutcome, SetupId, ToWorker};

use super::state::State;
use super::waiting::Run;
use crate::FleetEvent;
use crate::dispatcher::{Event, Taken, WorkerId};
use crate::job_name::JobName;
use crate::wire::Job;

/// Batches for which a run waits: the one that a resumed run goes on with, and the rest of it where its first particles are rescued.
const BATCHES: u32 = 2;

/// What came of the runs that one worker brought along.
#[derive(Default)]
struct Count {
    finished: usize,
    adopted: Vec<(JobKey, Lease)>,
}

impl State {
    /// Takes the runs that a worker brings along.
    pub(super) fn bring(&mut self, now: Duration, worker: WorkerId, runs: Vec<HeldRun>) {
        let runs = runs.into_iter().map(|HeldRun { key, ended }| (key, Run { worker, ended, passed: 0 }));
        self.match_held(now, runs.collect());
    }

    /// Begins a batch; of its jobs those are not given away that a worker brought along.
    pub(super) fn begin(&mut self, now: Duration, jobs: Vec<(SetupId, JobName)>) {
        self.waiting.places = None;
        self.dispatcher.is_matching = !self.waiting.runs.is_empty();
        self.handle(now, Event::Submit { jobs });
        if !self.dispatcher.is_matching {
            return;
        }
        let mut runs = self.waiting.take_all();
        for run in runs.values_mut() {
            run.passed += 1;
        }
        self.match_held(now, runs.into_iter().collect());
        self.dispatcher.is_matching = false;
        self.handle(now, Event::Tick);
    }

    fn match_held(&mut self, now: Duration, runs: Vec<(JobKey, Run)>) {
        let is_running = self.running.is_some();
        let mut counts: HashMap<WorkerId, Count> = HashMap::new();
        for (key, run) in runs {
            let count = counts.entry(run.worker).or_default();
            let Some(index) = self.place(&key) else {
                // What was not finished is given up by its worker, which is told what is of use.
                if run.passed < BATCHES && (run.ended.is_some() || !is_running) {
                    self.waiting.put(key, run);
                }
                continue;
            };
            match self.take(now, &run, index) {
                Taken::Answer => count.finished += 1,
                Taken::Lease(lease) => count.adopted.push((key, lease)),
                Taken::No => {}
            }
        }
        for (worker, Count { finished, adopted }) in counts {
            // Before there is a batch nobody knows what is of use.
            if is_running {
                self.send(worker, ToWorker::adopt(&adopted, true));
            }
            let computing = adopted.len();
            if finished + computing > 0 {
                self.tell(FleetEvent::RunsBrought { worker: self.name(worker), finished, computing });
            }
        }
    }

    /// The place of a job in the running batch.
    fn place(&mut self, key: &JobKey) -> Option<usize> {
        let jobs = &self.running.as_ref()?.jobs;
        let places = self.waiting.places.get_or_insert_with(|| places(jobs));
        places.get(key).copied()
    }

    fn take(&mut self, now: Duration, run: &Run, index: usize) -> Taken {
        let answer = match run.ended.as_deref().map(ended::decode) {
            None => None,
            Some(Ok((result, cost))) => Some((self.checked_at(index, LeaseOutcome::Ran(result)), cost)),
            // It is made again.
            Some(Err(_)) => return Taken::No,
        };
        let (taken, commands) = self.dispatcher.held(now, run.worker, index, answer);
        for command in commands {
            self.carry_out(command);
        }
        taken
    }
}

fn places(jobs: &[(SetupId, Job)]) -> HashMap<JobKey, usize> {
    let mut keys = JobKeys::default();
    jobs.iter().enumerate().map(|(index, (setup, job))| (keys.of(setup, job), index)).collect()
}
