//! A fleet without a network: runs the jobs on threads of this process.
//!
//! There is one host only: a run that it cannot make ends the batch. Next file to read: `settle`, for runs that end abnormally.

mod settle;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use starlings_models::{
    BuildSetup, Factory, Forward, Job, ModelFailure, ParticleError, Prediction, Setup, Stop, Until,
};
use starlings_proto::spent::spent;
use starlings_proto::words::panic_text;
use starlings_proto::{SetupId, encode_setup};

use super::{Fleet, FleetError, Outcome};

/// Threads of this process as a fleet.
pub struct InProcess {
    threads: usize,
    forwards: BTreeMap<SetupId, Box<dyn Forward>>,
    factory: Factory,
}

impl InProcess {
    /// A fleet of so many threads, at least one.
    pub fn new(threads: usize) -> Self {
        Self { threads: threads.max(1), forwards: BTreeMap::new(), factory: Arc::new(Setup::build) }
    }

    /// The same fleet with another maker of what runs jobs than [`Setup::build`], which starts no solver.
    #[must_use]
    pub fn with_factory(mut self, factory: Factory) -> Self {
        self.factory = factory;
        self
    }
}

impl Fleet for InProcess {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        let failed = |reason: String| FleetError::SetupFailed { reason };
        let (id, _) = encode_setup(setup).map_err(|e| failed(e.to_string()))?;
        if let Entry::Vacant(place) = self.forwards.entry(id) {
            place.insert((self.factory)(setup).map_err(|e| failed(e.to_string()))?);
        }
        Ok(id)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        let found = jobs.iter().map(|(setup, job)| self.forwards.get(setup).map(|forward| (&**forward, job)));
        let tasks = found.collect::<Option<Vec<_>>>().ok_or(FleetError::UnknownSetup)?;
        let next = AtomicUsize::new(0);
        let outcomes = Mutex::new(Vec::with_capacity(tasks.len()));
        std::thread::scope(|scope| {
            for thread in 0..self.threads.min(tasks.len()) {
                let (tasks, next, outcomes) = (&tasks, &next, &outcomes);
                scope.spawn(move || {
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        let Some(&(forward, job)) = tasks.get(index) else { break };
                        let result = run_one(forward, job);
                        outcomes.lock().unwrap_or_else(PoisonError::into_inner).push((index, result, thread));
                    }
                });
            }
        });
        let mut ran = outcomes.into_inner().unwrap_or_else(PoisonError::into_inner);
        ran.sort_unstable_by_key(|(index, _, _)| *index);
        let (results, threads) = ran.into_iter().map(|(_, result, thread)| (result, thread)).unzip();
        settle::settled(&jobs, &tasks, results, threads)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        self.threads
    }
}

/// One run; a panic of the model is a failure of the model.
fn run_one(forward: &dyn Forward, job: &Job) -> Result<Prediction, ParticleError> {
    let started = Instant::now();
    let mut result = catch_unwind(AssertUnwindSafe(|| {
        let until = Until { spent: &spent(), stop: &Stop::default(), traceparent: None };
        forward.run_within(job, &until)
    }))
    .unwrap_or_else(|panic| Err(ModelFailure::Solver(panic_text(panic.as_ref())).into()));
    if let Ok(prediction) = &mut result {
        prediction.cost = started.elapsed().as_secs_f64();
    }
    result
}
