//! Clients that speak the protocol by hand: wrong versions, two incarnations of one process, answers from the past.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::net::SocketAddr;

use fleet_kit::{
    ThreadWorker, any_port, assert_exact, await_event, await_workers, factory, jobs, listen, square,
};
use starlings_fleet::{Fleet, FleetEvent};
use starlings_models::Setup;
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::{
    FromWorker, Hello, Lease, LeaseOutcome, PROTOCOL, ReceivedWindows, State, ToWorker, VERSION,
};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio_stream::wrappers::UnboundedReceiverStream;
use tonic::Streaming;

/// A worker played by hand.
struct Hand {
    outbox: UnboundedSender<generated::FromWorker>,
    inbound: Streaming<generated::ToWorker>,
    windows: ReceivedWindows,
}

impl Hand {
    async fn dial(address: SocketAddr, hello: Hello) -> Self {
        let mut client = FleetClient::connect(format!("http://{address}")).await.unwrap();
        let (outbox, outgoing) = unbounded_channel();
        outbox.send(FromWorker::Hello(hello).encode().unwrap()).unwrap();
        let inbound = client.work(UnboundedReceiverStream::new(outgoing)).await.unwrap().into_inner();
        Self { outbox, inbound, windows: ReceivedWindows::default() }
    }

    fn say(&self, message: FromWorker) {
        self.outbox.send(message.encode().unwrap()).unwrap();
    }

    /// The next message that is no heartbeat; `None` when the stream ended.
    async fn hear(&mut self) -> Option<ToWorker> {
        while let Ok(Some(message)) = self.inbound.message().await {
            match ToWorker::decode(message, &mut self.windows).unwrap() {
                ToWorker::Heartbeat => {}
                message => return Some(message),
            }
        }
        None
    }

    /// Builds the setup and returns the first jobs, as many as asked for.
    async fn take_jobs(&mut self, n: usize) -> Vec<(Lease, starlings_models::Job)> {
        let mut jobs = vec![];
        while jobs.len() < n {
            match self.hear().await.expect("still connected") {
                ToWorker::Setup { id, .. } => self.say(FromWorker::Setup { id, result: Ok(()) }),
                ToWorker::Job { lease, job, .. } => jobs.push((lease, job.try_map(inside).unwrap())),
                _ => {}
            }
        }
        jobs
    }

    /// Until the run is over; a stream dropped earlier would take unsent answers with it.
    async fn stay_until_drained(&mut self) {
        while !matches!(self.hear().await, Some(ToWorker::Drain(_)) | None) {}
    }

    fn answer(&self, lease: Lease, job: &starlings_models::Job) {
        let answer = square(job).try_map(|values| Ok::<_, ()>(State::from(values))).unwrap();
        self.say(FromWorker::Result { lease, answer: LeaseOutcome::Ran(Ok(answer)), cost: 1.0 });
    }
}

/// A state that came inside its job.
fn inside(state: State) -> Result<Vec<f64>, State> {
    if let State::Values(values) = state { Ok(values) } else { Err(state) }
}

fn hello() -> Hello {
    Hello {
        protocol: PROTOCOL,
        version: VERSION.to_owned(),
        cores: 1,
        slots: 1,
        host: "hand".to_owned(),
        pid: 1,
        nonce: 42,
        build: None,
    }
}

fn block_on<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(future)
}

#[test]
fn another_release_is_refused_with_the_remedy() {
    let (fleet, events, _) = listen(any_port());
    block_on(async {
        let old = Hello { version: "0.0.1".to_owned(), ..hello() };
        let answer = Hand::dial(fleet.address().unwrap(), old).await.hear().await;
        assert!(matches!(&answer, Some(ToWorker::Refuse(reason)) if reason.contains("0.0.1")), "{answer:?}");
    });
    await_event(&events, |e| matches!(e, FleetEvent::WorkerRefused { .. }));
    assert_eq!(fleet.n_workers(), 0);
}

#[test]
fn a_process_that_dials_again_takes_over_and_its_old_answers_are_late() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs = jobs(4);
        let outcomes = fleet.run(setup, jobs.clone()).unwrap();
        fleet.close();
        (outcomes, jobs)
    });
    block_on(async {
        let mut first = Hand::dial(address, hello()).await;
        let old = first.take_jobs(1).await;
        let mut second = Hand::dial(address, hello()).await;
        // A dead epoch's answer, on the living stream: must not be taken for the job's.
        let wrong = starlings_models::Job { particle: 77, ..old[0].1.clone() };
        second.answer(old[0].0, &wrong);
        for _ in 0..4 {
            let (lease, job) = second.take_jobs(1).await.remove(0);
            assert_ne!(lease.epoch, old[0].0.epoch);
            second.answer(lease, &job);
        }
        // Ends only because the old stream is closed.
        while first.hear().await.is_some() {}
        second.stay_until_drained().await;
    });
    let (outcomes, jobs) = run.join().unwrap();
    assert_exact(&outcomes, &jobs);
    await_workers(&events, 2);
    await_event(&events, |e| matches!(e, FleetEvent::LateAnswer { .. }));
}

#[test]
fn a_worker_that_vanishes_with_jobs_in_hand_loses_none_of_them() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs = jobs(10);
        let outcomes = fleet.run(setup, jobs.clone()).unwrap();
        fleet.close();
        (outcomes, jobs)
    });
    block_on(async {
        let mut doomed = Hand::dial(address, Hello { nonce: 1, ..hello() }).await;
        let held = doomed.take_jobs(2).await;
        doomed.answer(held[0].0, &held[0].1);
        doomed.take_jobs(1).await;
        drop(doomed);
        let mut heir = Hand::dial(address, Hello { nonce: 2, ..hello() }).await;
        for _ in 0..9 {
            let (lease, job) = heir.take_jobs(1).await.remove(0);
            heir.answer(lease, &job);
        }
        heir.stay_until_drained().await;
    });
    let (outcomes, jobs) = run.join().unwrap();
    assert_exact(&outcomes, &jobs);
    await_event(&events, |e| matches!(e, FleetEvent::WorkerLeft { requeued: 2, .. }));
}

#[test]
fn a_malformed_message_ends_the_stream_and_nothing_else() {
    let (fleet, events, _) = listen(any_port());
    block_on(async {
        let mut hand = Hand::dial(fleet.address().unwrap(), hello()).await;
        assert!(matches!(hand.hear().await, Some(ToWorker::Welcome(_))));
        hand.outbox.send(generated::FromWorker { kind: None }).unwrap();
        assert_eq!(hand.hear().await, None);
    });
    await_event(
        &events,
        |e| matches!(e, FleetEvent::WorkerLeft { reason, .. } if reason.contains("malformed")),
    );
    assert_eq!(fleet.n_workers(), 0);
}

#[test]
fn a_worker_that_dials_when_the_run_is_over_ends_well() {
    let (fleet, _events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    block_on(async {
        let mut hand = Hand::dial(address, hello()).await;
        assert!(matches!(hand.hear().await, Some(ToWorker::Welcome(_))));
        // Waits for the hand, which hears of the end and stays.
        let closing = std::thread::spawn(move || fleet.close());
        hand.stay_until_drained().await;
        let report = ThreadWorker::start(address, factory(|job| Ok(square(job)))).end().unwrap();
        assert_eq!((report.reason.as_str(), report.sessions), ("the run is over", 0));
        drop(hand);
        closing.join().unwrap();
    });
}

#[test]
fn a_broken_connection_says_what_broke() {
    let (fleet, events, _) = listen(any_port());
    block_on(async {
        let mut hand = Hand::dial(fleet.address().unwrap(), hello()).await;
        assert!(matches!(hand.hear().await, Some(ToWorker::Welcome(_))));
    });
    // The runtime is gone in the middle of the stream.
    let event = await_event(&events, |e| matches!(e, FleetEvent::WorkerLeft { .. }));
    let FleetEvent::WorkerLeft { reason, .. } = &event else { unreachable!("awaited") };
    assert!(reason.starts_with("the connection broke: ") && !reason.contains("code:"), "{reason}");
    assert!(!reason.contains("Unknown error"), "{reason}");
}
