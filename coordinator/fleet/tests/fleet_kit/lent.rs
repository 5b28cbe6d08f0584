//! Fleets whose workers are processes of this test program and take large states by descriptors.

use std::sync::mpsc::Receiver;

use starlings_fleet::{Fleet, FleetEvent, GrpcFleet, Held, StateStore};
use starlings_models::Setup;

use super::inherited::workers;
use super::large::{await_nothing, job};
use super::private_with;

pub fn fleet(memory: usize) -> (GrpcFleet, StateStore, Receiver<FleetEvent>) {
    let store = StateStore::new(memory);
    let own = store.clone();
    let (fleet, events, _) = private_with(move |config| config.states = own);
    (fleet, store, events)
}

/// Runs this particle alone; the state that came of it.
pub fn run(fleet: &mut GrpcFleet, particle: u32) -> Held {
    let setup = fleet.install(&Setup::default()).unwrap();
    let job = job(particle, 1).map(Held::from);
    fleet.run_held(vec![(setup, job)]).unwrap().remove(0).result.unwrap().state
}

/// The run of a worker that plays this part of the test `worker_process`: the state that came of it.
pub fn under(part: &str, memory: usize) -> Vec<f64> {
    let (mut fleet, store, _events) = fleet(memory);
    let workers = workers(&fleet, 1, "worker_process", part);
    let values = run(&mut fleet, 1).into_values().unwrap();
    assert!(store.in_memory().1 <= memory);
    drop(workers);
    drop(fleet);
    await_nothing(&store);
    values
}
