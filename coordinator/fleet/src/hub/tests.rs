//! The corners between threads, without a network: who is told when the last worker goes, and what a panic does.

use std::sync::mpsc::{self, Receiver};

use starlings_models::{ModelFailure, Setup, Window};
use starlings_proto::{JobEncoder, LeaseOutcome, ReceivedWindows, encode_setup};
use tokio::sync::oneshot;

use super::*;
use crate::outbox::outbox;

impl Hub {
    /// Leaves the state as a panic in the middle of a decision does.
    pub(crate) fn panic_inside(&self) {
        let _ = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _state = self.state.lock();
            panic!("in the middle of a decision");
        }));
    }
}

fn hello(pid: u32, build: Option<[u8; 32]>) -> Hello {
    Hello {
        protocol: PROTOCOL,
        version: starlings_proto::VERSION.to_owned(),
        cores: 1,
        slots: 1,
        host: "here".to_owned(),
        pid,
        nonce: u64::from(pid),
        build,
    }
}

fn hub(build: Option<[u8; 32]>) -> (Hub, Receiver<FleetEvent>) {
    let (sender, events) = mpsc::channel();
    let (heartbeat, patience) = (Duration::from_secs(8), Duration::from_secs(300));
    let rules = Rules { heartbeat, patience, max_attempts: 5, comparing: None, timeout_factor: None };
    let store = StateStore::new(0);
    (
        Hub::new("test".to_owned(), build, RunIdentity::new(), rules, Duration::ZERO, sender, (store, None)),
        events,
    )
}

fn batch(hub: &Hub) -> (Submission, oneshot::Receiver<Reply>) {
    let (setup, json) = encode_setup(&Setup::default()).expect("it travels");
    let shape = SetupShape { parameters: vec!["k".to_owned()], n_state: None, sums: false };
    hub.install(setup, json, shape, Likeness::Exact);
    let window = Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![], since: vec![] };
    let job = starlings_models::Job {
        particle: 0,
        record: 0,
        window: window.into(),
        theta: vec![2.5],
        state: None,
    };
    let (reply, replies) = oneshot::channel();
    (
        Submission { jobs: vec![(setup, job)], states: Vec::new(), encoder: JobEncoder::default(), reply },
        replies,
    )
}

#[test]
fn a_fleet_given_up_while_its_last_worker_was_still_linked_ends_when_it_leaves() {
    let (hub, _events) = hub(None);
    let (link, _outgoing) = outbox();
    let worker = hub.join(hello(1, None), link).expect("it fits");
    let (batch, mut replies) = batch(&hub);
    hub.submit(batch);
    hub.give_up("each died".to_owned());
    assert!(replies.try_recv().is_err(), "a worker is there");
    hub.leave(worker, "it died too".to_owned(), false);
    assert_eq!(replies.try_recv(), Ok(Err(BatchError::LocalWorkers("each died".to_owned()))));
}

#[test]
fn a_run_that_is_given_up_is_told_with_the_values_of_its_parameters() {
    let (hub, events) = hub(None);
    let (link, outgoing) = outbox();
    let worker = hub.join(hello(1, None), link).expect("it fits");
    let (batch, mut replies) = batch(&hub);
    let setup = batch.jobs[0].0;
    hub.submit(batch);
    hub.handle(Event::SetupDone { worker, setup });
    let sent = std::iter::from_fn(|| outgoing.try_next());
    let lease = sent.into_iter().find_map(|message| {
        match ToWorker::decode(message, &mut ReceivedWindows::default()) {
            Ok(ToWorker::Job { lease, .. }) => Some(lease),
            _ => None,
        }
    });
    let answer = LeaseOutcome::Ran(Err(ModelFailure::Solver("diverged".to_owned()).into()));
    hub.handle(Event::Answered { worker, lease: lease.expect("it is sent"), answer, cost: 0.1 });
    assert!(replies.try_recv().is_ok(), "the batch has ended");
    let told = events.try_iter().filter(FleetEvent::is_notable).map(|e| e.to_string()).collect::<Vec<_>>();
    assert_eq!(
        told,
        ["particle 0, record 0 (k = 2.5): given up after 1 attempt: the solver failed: diverged"]
    );
}

#[test]
fn another_build_of_the_same_version_is_told_once() {
    let (hub, events) = hub(Some([1; 32]));
    let (link, _outgoing) = outbox();
    for (pid, build) in [(1, Some([1; 32])), (2, None), (3, Some([2; 32])), (4, Some([2; 32]))] {
        hub.join(hello(pid, build), link.clone()).expect("it fits");
    }
    let told = events.try_iter().filter(|e| matches!(e, FleetEvent::OtherBuild { .. })).collect::<Vec<_>>();
    assert!(matches!(&told[..], [FleetEvent::OtherBuild { worker, .. }] if worker == "3@here/3"), "{told:?}");
    assert!(told[0].is_notable() && told[0].to_string().contains("last digits"), "{}", told[0]);
}

#[test]
fn a_draining_fleet_says_that_the_run_is_over_and_not_that_the_worker_is_wrong() {
    let (hub, events) = hub(None);
    hub.drain("the run is over");
    let (link, _outgoing) = outbox();
    assert_eq!(hub.join(hello(1, None), link.clone()), Err(Closed::Over("the run is over".to_owned())));
    assert_eq!(events.try_iter().count(), 0);
    let old = Hello { version: "0.0.1".to_owned(), ..hello(2, None) };
    assert!(matches!(hub.join(old, link), Err(Closed::Refused(_))));
}

#[test]
fn what_is_brought_along_waits_for_a_batch_while_its_worker_is_there_and_is_not_given_up() {
    let (hub, _events) = hub(None);
    let worker = |pid| hub.join(hello(pid, None), outbox().0).expect("it fits");
    let waiting = || {
        let mut keys: Vec<u8> = hub.lock().waiting.runs.keys().map(|key| key[0]).collect();
        keys.sort_unstable();
        keys
    };
    let run = |key: u8, is_made: bool| HeldRun {
        key: [key; 32],
        ended: is_made.then(|| Bytes::from_static(b"as it was")),
    };
    let (first, second) = (worker(1), worker(2));
    hub.bring(first, vec![run(1, true), run(2, false)]);
    hub.bring(second, vec![run(3, true)]);
    assert_eq!(waiting(), [1, 2, 3]);
    // The worker is told that what it still makes is of no use, and gives it up.
    let (batch, _replies) = batch(&hub);
    hub.submit(batch);
    assert_eq!(waiting(), [1, 3]);
    hub.bring(first, vec![run(4, true), run(5, false)]);
    assert_eq!(waiting(), [1, 3, 4]);
    hub.leave(first, "it is gone".to_owned(), false);
    assert_eq!(waiting(), [3]);
    // Nobody has heard of this one.
    hub.bring(first, vec![run(6, true)]);
    assert_eq!(waiting(), [3]);
}
