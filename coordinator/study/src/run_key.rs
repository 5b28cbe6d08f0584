//! The key of a run: everything that its answer depends on, as one hash.
//!
//! Next file to read: [`crate::store`], which keeps answers by it.

use starlings_fleet::{Held, SetupId};
use starlings_models::Job;

use crate::store::RunKey;

/// The key of a run without observer: the programs that make it (a digest), the setup and the job, without what was observed.
pub fn free(programs: &[u8; 32], setup: &SetupId, job: &Job) -> RunKey {
    let mut hasher = blake3::Hasher::new();
    hash(&mut hasher, programs, setup, job, |hasher, state| numbers(hasher, state));
    *hasher.finalize().as_bytes()
}

/// The key of a run that an observer may correct by what was observed.
pub(crate) fn observed(programs: &[u8; 32], setup: &SetupId, job: &Job<Held>) -> RunKey {
    let mut hasher = blake3::Hasher::new();
    hash(&mut hasher, programs, setup, job, |hasher, state| match state {
        Held::Values(values) => numbers(hasher, values),
        // Its name says its values.
        Held::Stored(state) => drop(hasher.update(&state.id())),
    });
    numbers(&mut hasher, &job.window.observed);
    *hasher.finalize().as_bytes()
}

fn hash<S>(
    hasher: &mut blake3::Hasher,
    programs: &[u8; 32],
    setup: &SetupId,
    job: &Job<S>,
    of_state: impl Fn(&mut blake3::Hasher, &S),
) {
    hasher.update(programs);
    hasher.update(setup);
    hasher.update(&u64::from(job.record).to_le_bytes());
    numbers(hasher, &job.theta);
    match &job.state {
        Some(state) => of_state(hasher, state),
        None => numbers(hasher, &[]),
    }
    numbers(hasher, &[job.window.start]);
    numbers(hasher, &job.window.times);
    for signal in &job.window.inputs {
        numbers(hasher, &signal.times);
        numbers(hasher, &signal.values);
    }
}

/// Adds numbers, bit by bit, for keys and for comparisons of studies.
pub(crate) fn numbers(hasher: &mut blake3::Hasher, values: &[f64]) {
    // Lengths keep neighbouring lists apart.
    hasher.update(&(values.len() as u64).to_le_bytes());
    for value in values {
        hasher.update(&value.to_le_bytes());
    }
}
