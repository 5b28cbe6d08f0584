//! What a fleet has done and where it stands, in numbers, for whoever watches it from outside.
//!
//! Counted under the hub's lock where the events pass anyway; read when somebody asks. Nothing in the fleet reads them back. Next file
//! to read: [`super::event`], for what is told one by one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Weak;

use starlings_models::{ModelFailure, ParticleError};
use starlings_proto::{LeaseOutcome, State};

use super::hub::Hub;
use super::wire::Job;
use super::{FleetEvent, Load};

/// Upper bounds of the classes of run times, seconds; the last class has none.
pub const RUN_TIME_BOUNDS: [f64; 17] =
    [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];

/// Processes of workers that are remembered at most, to tell one that comes back from a new one.
const MAX_PROCESSES: usize = 65_536;

/// What was counted since the fleet began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Runs that ended in a prediction, those that repeat others for a comparison included.
    pub predictions: u64,
    /// Runs that ended in none, by the type of their failure.
    pub failures: BTreeMap<&'static str, u64>,
    /// Runs by their wall time in the worker, one count per class of [`RUN_TIME_BOUNDS`] and one beyond; whatever came of them.
    pub run_times: [u64; RUN_TIME_BOUNDS.len() + 1],
    /// Wall time of all these runs, seconds.
    pub run_seconds: f64,
    /// Runs given to workers to repeat another worker's.
    pub repeats: u64,
    /// Events by their kind, told or not.
    pub events: BTreeMap<&'static str, u64>,
    /// Connections of processes that had been connected before.
    pub reconnects: u64,
    /// Bytes of states of particles that came from workers, and that went to them; what stands in a shared folder goes nowhere.
    pub state_bytes_in: u64,
    /// The other way.
    pub state_bytes_out: u64,
}

/// Where a fleet stands at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Workers that are connected.
    pub workers: usize,
    /// Those of them that are given no runs for a while.
    pub aside: usize,
    /// Slots of all workers.
    pub slots: usize,
    /// Slots with a run.
    pub busy: usize,
    /// Runs of the batch that no worker has.
    pub queued: usize,
    /// Runs that a worker has and that wait there for a slot.
    pub ahead: usize,
    /// Runs of the batch without an outcome.
    pub open: usize,
}

/// One look at a fleet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// What was counted since it began.
    pub tally: Tally,
    /// Where it stands.
    pub census: Census,
    /// Whether its network has ended.
    pub has_ended: bool,
}

/// Looks at a fleet from any thread, and does not keep it alive.
#[derive(Clone)]
pub struct Readings(Weak<Hub>);

impl Readings {
    pub(super) fn new(hub: Weak<Hub>) -> Self {
        Self(hub)
    }

    /// A look now; `None` once the fleet is gone.
    pub fn read(&self) -> Option<Reading> {
        self.0.upgrade().map(|hub| hub.read())
    }

    /// How much work there is, and who makes it; `None` once the fleet is gone.
    pub fn load(&self) -> Option<Load> {
        self.0.upgrade().map(|hub| hub.load())
    }
}

/// Counts, and remembers what counting needs.
#[derive(Debug, Default)]
pub(super) struct Counting {
    pub(super) tally: Tally,
    processes: BTreeSet<u64>,
}

impl Counting {
    /// A run ended after so many seconds; one that was given back is none.
    pub(super) fn ended(&mut self, answer: &LeaseOutcome, seconds: f64) {
        let LeaseOutcome::Ran(result) = answer else { return };
        match result {
            Ok(prediction) => {
                self.tally.predictions += 1;
                self.tally.state_bytes_in += inside(&prediction.state);
            }
            Err(error) => *self.tally.failures.entry(failure_type(error)).or_default() += 1,
        }
        // What a worker says is checked nowhere else: it decides nothing.
        let seconds = if seconds.is_finite() { seconds.max(0.0) } else { 0.0 };
        self.tally.run_times[RUN_TIME_BOUNDS.partition_point(|bound| *bound < seconds)] += 1;
        self.tally.run_seconds += seconds;
    }

    /// A job goes to a worker.
    pub(super) fn given(&mut self, job: &Job) {
        self.tally.state_bytes_out += job.state.as_ref().map_or(0, inside);
    }

    /// Something happened.
    pub(super) fn happened(&mut self, event: &FleetEvent) {
        *self.tally.events.entry(event.kind()).or_default() += 1;
    }

    /// A process connected.
    pub(super) fn joined(&mut self, nonce: u64) {
        if self.processes.contains(&nonce) {
            self.tally.reconnects += 1;
        } else if self.processes.len() < MAX_PROCESSES {
            self.processes.insert(nonce);
        }
    }
}

/// Bytes of a state that travels inside its message.
fn inside(state: &State) -> u64 {
    match state {
        State::Values(values) => 8 * values.len() as u64,
        State::Named(_) => 0,
    }
}

/// The types of failures, in the words of [`Tally::failures`].
pub const FAILURE_TYPES: [&str; 9] = [
    "not-finite",
    "step-too-small",
    "too-many-steps",
    "outside-domain",
    "solver",
    "place",
    "timeout",
    "undecided",
    "bad-job",
];

fn failure_type(error: &ParticleError) -> &'static str {
    match error {
        ParticleError::Model(ModelFailure::NotFinite { .. }) => "not-finite",
        ParticleError::Model(ModelFailure::StepTooSmall { .. }) => "step-too-small",
        ParticleError::Model(ModelFailure::TooManySteps { .. }) => "too-many-steps",
        ParticleError::Model(ModelFailure::OutsideDomain(_)) => "outside-domain",
        ParticleError::Model(ModelFailure::Solver(_)) => "solver",
        ParticleError::Infrastructure(_) => "place",
        ParticleError::Timeout(_) => "timeout",
        ParticleError::Undecided(_) => "undecided",
        ParticleError::BadJob(_) => "bad-job",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::Prediction;

    #[test]
    fn a_run_counts_once_by_its_end_and_in_the_class_of_its_time() {
        let mut counting = Counting::default();
        let good =
            LeaseOutcome::Ran(Ok(Prediction { outputs: vec![], state: State::Values(vec![]), cost: 0.0 }));
        counting.ended(&good, 1e-4);
        counting.ended(&good, 0.02);
        counting.ended(&LeaseOutcome::Withdrawn, 5.0);
        let bad = |error: ParticleError| LeaseOutcome::Ran(Err(error));
        counting.ended(&bad(ParticleError::Infrastructure("no disk".to_owned())), 1e9);
        counting.ended(&bad(ModelFailure::OutsideDomain("choked".to_owned()).into()), f64::NAN);
        let tally = counting.tally;
        assert_eq!(tally.predictions, 2);
        assert_eq!(tally.failures, BTreeMap::from([("outside-domain", 1), ("place", 1)]));
        // A time on a bound is in the class below it: the first has 1e-4 s and what is no number.
        let mut classes = [0; RUN_TIME_BOUNDS.len() + 1];
        (classes[0], classes[5], classes[RUN_TIME_BOUNDS.len()]) = (2, 1, 1);
        assert_eq!(tally.run_times, classes);
        assert!(tally.failures.keys().all(|name| FAILURE_TYPES.contains(name)));
    }

    #[test]
    fn a_process_that_connects_again_is_a_reconnect_and_a_new_one_is_none() {
        let mut counting = Counting::default();
        for nonce in [1, 2, 1, 3, 1] {
            counting.joined(nonce);
        }
        assert_eq!(counting.tally.reconnects, 2);
    }
}
