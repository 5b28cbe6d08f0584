//! Fleets around the in-process one: they compute in another order, lose particles, or stop after some calls.

use starlings_coordinator::fleet::{Fleet, FleetError, InProcess, Outcome, SetupId};
use starlings_models::{Job, ModelFailure, Setup};

/// Computes the jobs of a batch in another order, another one at every call; answers stand in the order of the jobs.
pub struct Shuffled {
    inner: InProcess,
    calls: usize,
}

impl Shuffled {
    pub fn new(threads: usize) -> Self {
        Self { inner: InProcess::new(threads), calls: 0 }
    }
}

impl Fleet for Shuffled {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        self.calls += 1;
        let n = jobs.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.rotate_left(self.calls % n.max(1));
        order.reverse();
        let permuted = order.iter().map(|i| jobs[*i].clone()).collect();
        let mut answers: Vec<(usize, Outcome)> =
            order.into_iter().zip(self.inner.run_mixed(permuted)?).collect();
        answers.sort_by_key(|(i, _)| *i);
        Ok(answers
            .into_iter()
            .map(|(i, mut outcome)| {
                outcome.attempts = 1 + (i % 3) as u32;
                outcome.worker = format!("worker {}", self.calls % 5);
                outcome
            })
            .collect())
    }

    fn n_workers(&self) -> usize {
        3
    }

    fn slots(&self) -> usize {
        self.inner.slots()
    }
}

/// Where in a run a job stands.
pub struct At<'a> {
    /// The job.
    pub job: &'a Job,
    /// Ensembles before this one; a particle that is tried again belongs to the ensemble before.
    pub ensemble: usize,
    /// The particle is tried again at a shorter distance.
    pub retried: bool,
}

/// Fails the jobs that a rule picks.
pub struct Failing<R> {
    inner: InProcess,
    rule: R,
    ensembles: usize,
    /// Jobs failed so far.
    pub failed: usize,
}

impl<R: FnMut(&At<'_>) -> bool> Failing<R> {
    pub fn new(rule: R) -> Self {
        Self { inner: InProcess::new(1), rule, ensembles: 0, failed: 0 }
    }
}

impl<R: FnMut(&At<'_>) -> bool> Fleet for Failing<R> {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        let retried = jobs.iter().all(|(_, job)| job.particle == jobs[0].1.particle);
        if !retried {
            self.ensembles += 1;
        }
        let ensemble = self.ensembles.saturating_sub(1);
        let fails: Vec<bool> =
            jobs.iter().map(|(_, job)| (self.rule)(&At { job, ensemble, retried })).collect();
        let mut outcomes = self.inner.run_mixed(jobs)?;
        for (outcome, fails) in outcomes.iter_mut().zip(fails) {
            if fails {
                outcome.result = Err(ModelFailure::Solver("made to fail".to_owned()).into());
                self.failed += 1;
            }
        }
        Ok(outcomes)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        1
    }
}

/// Stops for good after some calls, as a killed coordinator does.
pub struct Mortal {
    inner: InProcess,
    /// Calls it still answers.
    pub left: usize,
    /// Calls answered.
    pub answered: usize,
}

impl Mortal {
    pub fn new(left: usize) -> Self {
        Self { inner: InProcess::new(1), left, answered: 0 }
    }
}

impl Fleet for Mortal {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        if self.left == 0 {
            return Err(FleetError::Cancelled);
        }
        self.left -= 1;
        self.answered += 1;
        self.inner.run_mixed(jobs)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        1
    }
}
