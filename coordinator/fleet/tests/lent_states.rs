//! States that local workers read and write by descriptors: the same bits as in pieces, in bounded memory, whatever is lost.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use fleet_kit::inherited::{part, workers, workers_after};
use fleet_kit::large::{BYTES, assert_moved, await_bytes, await_nothing, job, moved};
use fleet_kit::lent::{fleet, run};
use fleet_kit::{await_event, factory};
use rustix::process::{Resource, Rlimit, setrlimit};
use starlings_fleet::{Fleet, FleetEvent};
use starlings_models::{Job, Prediction, Setup};
use starlings_proto::INHERITED;
use starlings_worker::WorkerConfig;

#[test]
#[ignore = "not a test: the worker process of the others"]
fn worker_process() {
    let Some(part) = part() else { return };
    match part.as_str() {
        "honest" => work(moved),
        "spoils" => work(|job| {
            let mut prediction = moved(job);
            prediction.state = (0..BYTES / 8).map(|i| if i == 70_000 { f64::NAN } else { 0.0 }).collect();
            prediction
        }),
        "narrow" => work(|job| {
            // No descriptor comes any more.
            setrlimit(Resource::Nofile, Rlimit { current: Some(0), maximum: Some(0) }).unwrap();
            moved(job)
        }),
        other => panic!("no part of this name: {other}"),
    }
}

fn work(run: impl Fn(&Job) -> Prediction + Send + Sync + Clone + 'static) {
    let mut config = WorkerConfig::new(INHERITED);
    config.factory = factory(move |job| Ok(run(job)));
    starlings_worker::run(config).unwrap();
}

#[test]
fn states_by_descriptors_are_those_in_pieces_to_the_last_bit_whatever_the_memory() {
    for memory in [64 * BYTES, 5 * BYTES + 17, BYTES, 0] {
        let (mut fleet, store, _events) = fleet(memory);
        let workers = workers(&fleet, 2, "worker_process", "honest");
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs: Vec<Job> = (0..7).map(|k| job(k, 1)).collect();
        assert_moved(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
        assert!(store.in_memory().1 <= memory, "{:?} of {memory}", store.in_memory());
        let state = run(&mut fleet, 3);
        assert!(state.into_values().unwrap() == moved(&job(3, 1)).state);
        // Which way they went: as much as there is room for.
        assert!(store.in_memory().0 >= if memory > 5 * BYTES { BYTES } else { 0 }, "memory is lent");
        let given = store.keep(&job(9, 1).state.unwrap()).unwrap();
        // Room for just one is free or not, as the states of the runs have come to rest.
        if memory != BYTES {
            assert_eq!(given.descriptor().is_some(), memory > BYTES, "with {memory} bytes");
        }
        drop((given, workers));
        drop(fleet);
        await_nothing(&store);
    }
}

#[test]
fn a_local_worker_that_writes_a_value_that_is_none_is_at_fault() {
    let (mut fleet, store, events) = fleet(usize::MAX);
    let bad = workers(&fleet, 1, "worker_process", "spoils");
    let run = std::thread::spawn(move || (run(&mut fleet, 1).into_values().unwrap(), fleet));
    let aside = await_event(&events, |event| matches!(event, FleetEvent::WorkerSetAside { .. }));
    assert!(format!("{aside:?}").contains("NaN is a value of the state"), "{aside:?}");
    // What it had borrowed is taken back: the state of the job is left.
    await_bytes(&store, BYTES);
    // Its supervisor lets it go, so the run waits for another one.
    drop(bad);
    drop(run);
    drop(store);
}

/// Runs seven particles, twice, on a worker that has these words before its start and plays this part; none of the memory that it could
/// not use is lent when they are done.
fn assert_in_pieces(words: &str, part: &str) {
    let (mut fleet, store, _events) = fleet(64 * BYTES);
    let workers = workers_after(words, &fleet, 1, "worker_process", part);
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs: Vec<Job> = (0..7).map(|k| job(k, 1)).collect();
    for _ in 0..2 {
        assert_moved(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
    }
    // Of the last batch the state of a control run is kept.
    await_bytes(&store, BYTES);
    drop((workers, fleet));
    await_nothing(&store);
}

#[test]
fn a_worker_that_gets_no_more_descriptors_reads_and_sends_states_in_pieces() {
    assert_in_pieces("", "narrow");
}

#[test]
fn a_worker_that_cannot_write_into_lent_memory_gives_it_back_and_sends_states_in_pieces() {
    // Whatever has a length stays empty for this process.
    assert_in_pieces("trap '' XFSZ; ulimit -f 0;", "honest");
}
