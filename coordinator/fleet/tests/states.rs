//! States of any size: they travel both ways to the last bit, in bounded memory, and nothing of them stays.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::{Arc, mpsc};
use std::time::Duration;

use fleet_kit::large::{BYTES, assert_moved, await_nothing, job, moved};
use fleet_kit::{Proxy, ThreadWorker, any_port, await_event, factory, listen_with};
use starlings_fleet::{Fleet, FleetError, FleetEvent, GrpcFleet, Held, StateStore, hex};
use starlings_models::{Job, Setup};
use starlings_worker::Factory;

fn models() -> Factory {
    factory(|job| Ok(moved(job)))
}

fn jobs(n: u32) -> Vec<Job> {
    (0..n).map(|k| job(k, 2)).collect()
}

fn fleet(memory: usize) -> (GrpcFleet, StateStore) {
    let store = StateStore::new(memory);
    let own = store.clone();
    let (fleet, _events, _) = listen_with(any_port(), move |config| config.states = own);
    (fleet, store)
}

#[test]
fn large_states_travel_both_ways_to_the_last_bit_in_memory_and_beyond_it() {
    for memory in [usize::MAX, 5 * BYTES, 0] {
        let (mut fleet, store) = fleet(memory);
        let address = fleet.address().unwrap();
        let _workers = [1, 2].map(|_| ThreadWorker::start(address, models()));
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs = jobs(7);
        assert_moved(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
        assert!(store.in_memory().1 <= memory);
        // The outcomes were values: nothing is needed any more, unless for a control run.
        drop(fleet);
        await_nothing(&store);
    }
}

#[test]
fn states_in_the_store_go_from_batch_to_batch_without_their_values() {
    let (mut fleet, store) = fleet(3 * BYTES);
    let address = fleet.address().unwrap();
    let _workers = [1, 2].map(|_| ThreadWorker::start(address, models()));
    let setup = fleet.install(&Setup::default()).unwrap();
    let mut now = jobs(6);
    let mut held: Vec<Job<Held>> = now.iter().cloned().map(|job| job.map(Held::from)).collect();
    for _ in 0..3 {
        let outcomes = fleet.run_held(held.iter().map(|job| (setup, job.clone())).collect()).unwrap();
        for ((job, held), outcome) in now.iter_mut().zip(&mut held).zip(outcomes) {
            let state = outcome.result.unwrap().state;
            assert!(matches!(state, Held::Stored(_)), "a large state is in the store");
            job.state = Some(moved(job).state);
            held.state = Some(state);
        }
    }
    for (job, held) in now.iter().zip(held) {
        assert!(held.state.unwrap().into_values().unwrap() == *job.state.as_ref().unwrap());
    }
    assert!(store.in_memory().1 <= 3 * BYTES);
}

#[test]
fn a_connection_that_is_cut_while_states_travel_loses_none() {
    let (mut fleet, store) = fleet(usize::MAX);
    let proxy = Proxy::to(fleet.address().unwrap());
    let cut = proxy.address;
    let (made, runs) = mpsc::channel();
    let counting = factory(move |job| {
        let _ = made.send(());
        Ok(moved(job))
    });
    let _workers = [1, 2].map(|_| ThreadWorker::start(cut, Arc::clone(&counting)));
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(40);
    let run = std::thread::spawn({
        let jobs = jobs.clone();
        move || (fleet.run(setup, jobs).unwrap(), fleet)
    });
    // Whenever the cut falls, the outcome is the same; each falls while states of runs travel that were just made.
    for _ in 0..3 {
        (0..6).for_each(|_| runs.recv_timeout(Duration::from_secs(60)).expect("runs go on"));
        proxy.cut();
    }
    let (outcomes, fleet) = run.join().unwrap();
    assert_moved(&outcomes, &jobs);
    drop(fleet);
    await_nothing(&store);
}

#[test]
fn a_state_that_is_damaged_in_its_folder_ends_the_batch_with_its_name() {
    let scratch = tempfile::tempdir().unwrap();
    let (mut fleet, store) = fleet(0);
    assert!(store.settle(scratch.path()));
    let address = fleet.address().unwrap();
    let _worker = ThreadWorker::start(address, models());
    let setup = fleet.install(&Setup::default()).unwrap();
    let state = store.keep(jobs(1)[0].state.as_ref().unwrap()).unwrap();
    let name = hex(&state.pieces()[1]);
    std::fs::write(scratch.path().join(&name), vec![0; BYTES]).unwrap();
    let job = jobs(1).remove(0);
    let job =
        Job { particle: 0, record: 0, window: job.window, theta: vec![], state: Some(Held::Stored(state)) };
    let error = fleet.run_held(vec![(setup, job)]).unwrap_err();
    assert!(matches!(&error, FleetError::State(text) if text.contains(&name)), "{error}");
}

#[test]
fn a_run_that_ends_in_a_large_state_which_is_not_finite_is_the_workers_fault() {
    let (mut fleet, events, _) = listen_with(any_port(), |_| {});
    let address = fleet.address().unwrap();
    let spoiled = factory(|job| {
        let mut prediction = moved(job);
        prediction.state = (0..BYTES / 8).map(|i| if i == 70_000 { f64::NAN } else { 0.0 }).collect();
        Ok(prediction)
    });
    let _bad = ThreadWorker::start(address, spoiled);
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(3);
    let run = std::thread::spawn({
        let jobs = jobs.clone();
        move || (fleet.run(setup, jobs).unwrap(), fleet)
    });
    await_event(&events, |event| matches!(event, FleetEvent::WorkerSetAside { .. }));
    let _good = ThreadWorker::start(address, models());
    assert_moved(&run.join().unwrap().0, &jobs);
}
