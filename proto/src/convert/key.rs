//! The key of a job: a hash of everything in it, by which its result is known again.
//!
//! A run depends on its job alone, so a result with the key of a job is the result of that job, whoever asked for it first. Both ends
//! compute the key from the same arrays; it does not travel with a job. A state that travels inside its job has its part in the key by
//! its hash, a larger one by its name. The size of a state decides which of the two it is, on both sides alike, so a job never has two
//! keys, and no name is taken for a hash. Next file to read: [`super::ended`].

use std::collections::HashMap;
use std::sync::Arc;

use starlings_models::{Job, StateValues, Window};

use super::state::{self, StateId};
use super::{SetupId, State, floats, window, windows};
use crate::MAX_INLINE_STATE;

/// BLAKE3 of a job with its setup: particle, record, window, parameters and state, bit by bit.
pub type JobKey = [u8; 32];

/// A state, in whatever form, as a part of a key.
pub trait InKey {
    /// The hash of its values where it is small, its name where it is large.
    fn in_key(&self) -> [u8; 32];
}

impl InKey for [f64] {
    fn in_key(&self) -> [u8; 32] {
        if self.len() * 8 > MAX_INLINE_STATE { state::name(self) } else { hash(self) }
    }
}

impl InKey for StateValues {
    fn in_key(&self) -> [u8; 32] {
        (**self).in_key()
    }
}

impl InKey for State {
    fn in_key(&self) -> [u8; 32] {
        match self {
            Self::Values(values) => values.as_slice().in_key(),
            Self::Named(id) => *id,
        }
    }
}

fn hash(values: &[f64]) -> StateId {
    super::digest(&floats::encode(values))
}

/// Makes keys of jobs; the windows that they share are hashed once.
#[derive(Debug, Default)]
pub struct JobKeys {
    /// By the place of a window in memory, which stays its own for as long as the window is held here.
    windows: HashMap<usize, (Arc<Window>, [u8; 32])>,
}

impl JobKeys {
    /// The key of one job.
    pub fn of<S: InKey>(&mut self, setup: &SetupId, job: &Job<S>) -> JobKey {
        let place = Arc::as_ptr(&job.window) as usize;
        let (_, over) = self
            .windows
            .entry(place)
            .or_insert_with(|| (Arc::clone(&job.window), windows::digest(&window::encode(&job.window))));
        let mut hasher = blake3::Hasher::new();
        hasher.update(setup);
        hasher.update(&job.particle.to_le_bytes());
        hasher.update(&job.record.to_le_bytes());
        hasher.update(over);
        hasher.update(&(job.theta.len() as u64).to_le_bytes());
        hasher.update(&floats::encode(&job.theta));
        // Not by its values, so that a state has the same part in the key whatever form it has.
        if let Some(state) = &job.state {
            hasher.update(&state.in_key());
        }
        *hasher.finalize().as_bytes()
    }
}

/// The key of one job.
pub fn job_key<S: InKey>(setup: &SetupId, job: &Job<S>) -> JobKey {
    JobKeys::default().of(setup, job)
}

#[cfg(test)]
mod tests {
    use starlings_models::Signal;

    use super::*;

    fn job() -> Job {
        let inputs = vec![Signal { times: vec![0.0, 1.0], values: vec![2.0, 3.0] }];
        let window = Window::free(0.0, vec![1.0], 1, inputs);
        Job {
            particle: 1,
            record: 2,
            window: window.into(),
            theta: vec![0.5, -0.0],
            state: Some(vec![1.0].into()),
        }
    }

    #[test]
    fn every_part_of_a_job_has_its_part_in_the_key() {
        let with = |change: &dyn Fn(&mut Job)| {
            let mut job = job();
            change(&mut job);
            job_key(&[7; 32], &job)
        };
        let over = |change: &dyn Fn(&mut Window)| with(&|job| change(Arc::make_mut(&mut job.window)));
        let same = with(&|_| {});
        let mut keys = vec![
            same,
            job_key(&[8; 32], &job()),
            with(&|job| job.particle = 3),
            with(&|job| job.record = 3),
            with(&|job| job.theta[1] = 0.0),
            with(&|job| job.theta.truncate(1)),
            with(&|job| job.state = None),
            with(&|job| job.state = Some(StateValues::default())),
            with(&|job| job.state = Some(vec![1.5].into())),
            over(&|window| window.start = -1.0),
            over(&|window| window.times[0] = 2.0),
            over(&|window| window.observed[0] = 0.0),
            over(&|window| window.inputs[0].times[1] = 2.0),
            over(&|window| window.inputs[0].values[1] = 2.0),
            over(&|window| window.inputs.clear()),
            over(&|window| window.since = vec![-0.5]),
            over(&|window| window.since = vec![0.0]),
        ];
        assert_eq!(job_key(&[7; 32], &job()), same, "another copy of the same job");
        let n = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), n);
    }

    #[test]
    fn a_state_has_the_same_key_by_its_values_and_by_its_name_and_another_for_every_value() {
        let large = |last: f64| {
            let mut values = vec![0.5; MAX_INLINE_STATE / 8 + 1];
            values.extend([last]);
            values
        };
        let key = |state: State| job_key(&[7; 32], &job().try_map(|_| Ok::<_, ()>(state)).unwrap());
        let of_values = job_key(&[7; 32], &Job { state: Some(large(1.0).into()), ..job() });
        assert_eq!(key(State::Values(large(1.0))), of_values);
        assert_eq!(key(State::Named(state::name(&large(1.0)))), of_values);
        assert_ne!(key(State::Named(state::name(&large(2.0)))), of_values);
        assert_eq!(key(State::Values(vec![1.0])), job_key(&[7; 32], &job()), "a small one");
    }

    #[test]
    fn a_shared_window_gives_the_key_of_a_window_of_its_own() {
        let (mut keys, first) = (JobKeys::default(), job());
        let second = Job { particle: 9, ..first.clone() };
        assert_eq!(keys.of(&[7; 32], &first), job_key(&[7; 32], &job()));
        assert_eq!(keys.of(&[7; 32], &second), job_key(&[7; 32], &Job { particle: 9, ..job() }));
        assert_eq!(keys.windows.len(), 1);
    }
}
