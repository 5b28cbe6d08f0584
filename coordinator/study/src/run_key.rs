//! The key of a run: everything that its answer depends on, as one hash.
//!
//! Next file to read: [`crate::store`], which keeps answers by it.

use starlings_fleet::{Held, SetupId};
use starlings_models::Job;
use starlings_proto::JobKeys;

use crate::store::RunKey;

/// The key of a run without observer: the programs that make it (a digest), the setup and the job, without what was observed.
pub fn free(programs: &[u8; 32], setup: &SetupId, job: &Job) -> RunKey {
    let mut hasher = blake3::Hasher::new();
    hash(&mut hasher, programs, setup, job);
    *hasher.finalize().as_bytes()
}

/// The key of a run that an observer may correct by what was observed: the programs and the whole job.
pub(crate) fn observed(programs: &[u8; 32], keys: &mut JobKeys, setup: &SetupId, job: &Job<Held>) -> RunKey {
    let mut hasher = blake3::Hasher::new();
    hasher.update(programs);
    hasher.update(&keys.of(setup, job));
    *hasher.finalize().as_bytes()
}

fn hash(hasher: &mut blake3::Hasher, programs: &[u8; 32], setup: &SetupId, job: &Job) {
    hasher.update(programs);
    hasher.update(setup);
    hasher.update(&u64::from(job.record).to_le_bytes());
    numbers(hasher, &job.theta);
    numbers(hasher, job.state.as_deref().unwrap_or_default());
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
