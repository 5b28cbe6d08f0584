//! Runs with states that travel by themselves: a model whose every value tells what went in, and workers by hand that are given them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use starlings_fleet::{Outcome, StateStore};
use starlings_models::{Job, Prediction, Window};
use starlings_proto::{FromWorker, Lease, LeaseOutcome, State, StateId, ToWorker};

use super::hand::Hand;

/// Values of a state that is no multiple of a piece.
pub const N: usize = 100_003;

/// Bytes of one state.
pub const BYTES: usize = N * 8;

/// Every value depends on the one before the run, its place and the particle.
pub fn moved(job: &Job) -> Prediction {
    let from = job.state.as_deref().expect("every job has a state");
    let p = f64::from(job.particle);
    let state = from.iter().enumerate().map(|(i, x)| x * 1.000_001 + p / (1.0 + i as f64)).collect();
    let outputs = vec![from.iter().sum::<f64>() + p; job.window.observed.len()];
    Prediction { outputs, state, cost: 0.0 }
}

/// A particle's run over a window with so many observed values, from a state with values that are hard to carry.
pub fn job(particle: u32, n_observed: usize) -> Job {
    let window = Window::free(0.0, vec![1.0], n_observed, vec![]);
    let mut state: Vec<f64> = (0..N).map(|i| ((i * 31 + particle as usize) % 1009) as f64 / 7.0).collect();
    (state[1], state[2]) = (-0.0, f64::MIN_POSITIVE / 4.0);
    Job { particle, record: 0, window: Arc::new(window), theta: vec![], state: Some(state.into()) }
}

/// Asserts that each outcome is, to the last bit, that of the job of its place.
pub fn assert_moved(outcomes: &[Outcome], jobs: &[Job]) {
    assert_eq!(outcomes.len(), jobs.len());
    for (outcome, job) in outcomes.iter().zip(jobs) {
        let (got, wanted) = (outcome.result.as_ref().unwrap(), moved(job));
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&got.outputs), bits(&wanted.outputs));
        assert!(bits(&got.state) == bits(&wanted.state), "particle {}", job.particle);
    }
}

/// Builds the setup and takes a job, with the name of its state.
pub async fn given(hand: &mut Hand) -> (Lease, StateId) {
    loop {
        match hand.hear().await.expect("still connected") {
            ToWorker::Setup { id, .. } => hand.say(FromWorker::Setup { id, result: Ok(()) }),
            ToWorker::Job { lease, job, .. } => {
                let Some(State::Named(id)) = job.state else { panic!("a large state has a name") };
                return (lease, id);
            }
            _ => {}
        }
    }
}

/// Answers a job with the state that was put.
pub fn answer(hand: &Hand, lease: Lease, state: StateId) {
    let prediction = Prediction { outputs: vec![1.0], state: State::Named(state), cost: 0.0 };
    hand.say(FromWorker::Result { lease, answer: LeaseOutcome::Ran(Ok(prediction)), cost: 0.1 });
}

/// Waits until the store has so many bytes in memory: what is let go of goes on a thread of its own.
pub fn await_bytes(store: &StateStore, bytes: usize) {
    await_store(store, || store.in_memory().0 == bytes);
}

/// Waits until the store is empty.
pub fn await_nothing(store: &StateStore) {
    await_store(store, || (store.n_pieces(), store.in_memory().0) == (0, 0));
}

fn await_store(store: &StateStore, is_so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed().as_secs() < 60, "{} pieces, {:?}", store.n_pieces(), store.in_memory());
        std::thread::sleep(Duration::from_millis(1));
    }
}
