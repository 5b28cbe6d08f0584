//! Workers that flood, hoard and repeat, over real sockets: the outcomes are exact, and what is kept of them is bounded.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::mpsc::Receiver;
use std::time::Duration;

use fleet_kit::hand::{Hand, block_on, hello, squared};
use fleet_kit::{ThreadWorker, any_port, assert_exact, await_workers, factory, jobs, listen, square};
use starlings_fleet::{Fleet, FleetEvent};
use starlings_models::{Job, ParticleError, Setup};
use starlings_proto::generated;
use starlings_proto::{FromWorker, HeldRun, Hello, Lease, LeaseOutcome, ToWorker};

/// Bytes of all events so far, as the store writes them.
fn written(events: &Receiver<FleetEvent>) -> (usize, Vec<FleetEvent>) {
    let events = events.try_iter().collect::<Vec<_>>();
    (events.iter().map(|event| event.to_string().len() + 64).sum(), events)
}

/// One honest worker makes the jobs while `attack` plays another by hand; everything is exact in the end.
fn beside(n: u32, attack: impl AsyncFnOnce(std::net::SocketAddr)) -> (usize, Vec<FleetEvent>) {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let outcomes = fleet.run(setup, jobs(n)).unwrap();
        (fleet, outcomes)
    });
    block_on(attack(address));
    let honest = ThreadWorker::start(address, factory(|job| Ok(square(job))));
    let (fleet, outcomes) = run.join().unwrap();
    assert_exact(&outcomes, &jobs(n));
    fleet.close();
    honest.end().unwrap();
    written(&events)
}

#[test]
fn three_hundred_hellos_with_megabytes_of_names_leave_kilobytes() {
    let (bytes, events) = beside(5, async |address| {
        for nonce in 0..300 {
            let version = "9".repeat(1_000_000);
            let bad = Hello { version, host: "\u{1b}[2J".repeat(300_000), nonce, ..hello() };
            let answer = Hand::dial(address, bad).await.hear().await;
            assert!(matches!(answer, Some(ToWorker::Refuse(_))), "{answer:?}");
        }
    });
    assert!(bytes < 200_000, "{bytes} bytes");
    assert!(events.iter().all(|event| !event.to_string().contains('\u{1b}')));
}

#[test]
fn three_thousand_failed_setups_with_megabytes_of_reasons_leave_kilobytes() {
    let (bytes, events) = beside(5, async |address| {
        let mut hand = Hand::dial(address, hello()).await;
        let mut failures = 0;
        while failures < 3_000 {
            let Some(message) = hand.hear().await else { break };
            let ToWorker::Setup { id, .. } = message else { continue };
            // Once for every time that it is sent, and then unasked.
            for _ in 0..3_000 {
                failures += 1;
                let failure = Some("no ".repeat(20_000));
                let result = generated::SetupResult { id: id.to_vec().into(), failure };
                let kind = Some(generated::from_worker::Kind::Setup(result));
                if hand.outbox.send(generated::FromWorker { kind }).is_err() {
                    break;
                }
            }
        }
        while hand.hear().await.is_some() {}
    });
    assert!(bytes < 200_000, "{bytes} bytes");
    let out =
        |e: &FleetEvent| matches!(e, FleetEvent::WorkerLeft { reason, .. } if reason.contains("not sent"));
    assert!(events.iter().any(out), "{events:?}");
}

#[test]
fn words_of_sixteen_megabytes_are_cut_wherever_a_worker_may_speak() {
    let bomb = || "b".repeat(10_000_000);
    let (bytes, _) = beside(5, async |address| {
        let mut hand = Hand::dial(address, hello()).await;
        let (lease, _) = hand.take_jobs(1).await.remove(0);
        let failure = LeaseOutcome::Ran(Err(ParticleError::Undecided(bomb())));
        hand.say(FromWorker::Result { lease, answer: failure, cost: 1.0 });
        hand.say(FromWorker::Goodbye(bomb()));
        while hand.hear().await.is_some() {}
    });
    assert!(bytes < 100_000, "{bytes} bytes");
}

#[test]
fn a_worker_that_says_goodbye_and_comes_again_a_thousand_times_holds_nothing_up() {
    let (bytes, events) = beside(20, async |address| {
        for nonce in 0..1_000 {
            let mut hand = Hand::dial(address, Hello { nonce, ..hello() }).await;
            assert!(matches!(hand.hear().await, Some(ToWorker::Welcome(_))));
            hand.say(FromWorker::Goodbye("for now".to_owned()));
            while hand.hear().await.is_some() {}
        }
    });
    assert!(bytes < 150_000, "{bytes} bytes");
    let untold = |e: &FleetEvent| matches!(e, FleetEvent::Untold { of, .. } if of == "worker-left");
    assert!(events.iter().any(untold), "the rest is a number");
}

#[test]
fn a_flood_of_answers_under_foreign_leases_ends_in_putting_the_worker_out() {
    let (bytes, events) = beside(20, async |address| {
        let mut hand = Hand::dial(address, hello()).await;
        let (lease, job) = hand.take_jobs(1).await.remove(0);
        for n in 0..20_000 {
            let foreign = Lease { epoch: lease.epoch - n % 3, job: lease.job + 1000 + n, ..lease };
            hand.answer(foreign, &job);
        }
        while hand.hear().await.is_some() {}
    });
    assert!(bytes < 100_000, "{bytes} bytes");
    let out = |e: &FleetEvent| matches!(e, FleetEvent::WorkerLeft { reason, .. } if reason.contains("was not given"));
    assert!(events.iter().any(out), "{events:?}");
}

#[test]
fn answers_that_are_repeated_or_belong_to_an_earlier_batch_are_never_taken() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let outcomes = [3, 5].map(|n| fleet.run(setup, jobs(n)).unwrap());
        fleet.close();
        outcomes
    });
    block_on(async {
        let mut hand = Hand::dial(address, hello()).await;
        let mut past = vec![];
        for _ in 0..8 {
            let (lease, job) = hand.take_jobs(1).await.remove(0);
            hand.answer(lease, &job);
            let wrong = Job { particle: 99, ..job.clone() };
            hand.answer(lease, &wrong);
            past.push((lease, wrong));
            for (lease, wrong) in &past {
                hand.answer(*lease, wrong);
            }
        }
        hand.stay_until_drained().await;
    });
    let [first, second] = run.join().unwrap();
    assert_exact(&first, &jobs(3));
    assert_exact(&second, &jobs(5));
    assert!(events.try_iter().any(|e| matches!(e, FleetEvent::LateAnswer { .. })));
}

#[test]
fn a_worker_of_4096_slots_that_only_sends_heartbeats_does_not_hold_a_batch() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let honest = ThreadWorker::start(address, factory(|job| Ok(square(job))));
    await_workers(&events, 1);
    let (over, is_over) = tokio::sync::oneshot::channel();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let outcomes = (0..3).map(|_| fleet.run(setup, jobs(900)).unwrap()).collect::<Vec<_>>();
        fleet.close();
        let _ = over.send(());
        outcomes
    });
    block_on(async {
        let mut hoarder = Hand::dial(address, Hello { slots: 4096, cores: 4096, ..hello() }).await;
        let hear = async {
            loop {
                match hoarder.hear().await {
                    Some(ToWorker::Setup { id, .. }) => hoarder.say(FromWorker::Setup { id, result: Ok(()) }),
                    Some(_) => hoarder.say(FromWorker::Heartbeat { running: 4096, queued: 0 }),
                    None => break,
                }
            }
        };
        tokio::select! {
            () = hear => {}
            _ = is_over => {}
        }
    });
    for outcomes in run.join().unwrap() {
        assert_exact(&outcomes, &jobs(900));
    }
    honest.end().unwrap();
}

#[test]
fn a_worker_that_gives_every_job_back_is_put_out() {
    let (bytes, events) = beside(20, async |address| {
        let mut hand = Hand::dial(address, hello()).await;
        while let Some(message) = hand.hear().await {
            match message {
                ToWorker::Setup { id, .. } => hand.say(FromWorker::Setup { id, result: Ok(()) }),
                ToWorker::Job { lease, .. } => {
                    hand.say(FromWorker::Result { lease, answer: LeaseOutcome::Withdrawn, cost: 0.0 });
                }
                _ => {}
            }
        }
    });
    assert!(bytes < 100_000, "{bytes} bytes");
    assert!(
        events.iter().any(
            |e| matches!(e, FleetEvent::WorkerLeft { reason, .. } if reason.contains("gives runs back"))
        )
    );
}

#[test]
fn times_that_no_run_can_take_are_not_believed() {
    for cost in [f64::NAN, f64::INFINITY, -1.0, 1e300, 0.0] {
        let (_, events) = beside(5, async |address| {
            let mut hand = Hand::dial(address, hello()).await;
            let (lease, job) = hand.take_jobs(1).await.remove(0);
            let answer = LeaseOutcome::Ran(Ok(squared(&job)));
            hand.say(FromWorker::Result { lease, answer, cost });
            hand.say(FromWorker::Goodbye("done".to_owned()));
            while hand.hear().await.is_some() {}
        });
        assert!(events.iter().all(|e| !matches!(e, FleetEvent::WorkerExcluded { .. })), "{cost}: {events:?}");
    }
}

#[test]
fn hellos_that_make_no_sense_are_refused_before_anything_is_kept_of_them() {
    let (fleet, events, _) = listen(any_port());
    block_on(async {
        for slots in [0, 4097, u32::MAX] {
            let mut client =
                generated::fleet_client::FleetClient::connect(format!("http://{}", fleet.address().unwrap()))
                    .await
                    .unwrap();
            let Ok(generated::FromWorker { kind: Some(generated::from_worker::Kind::Hello(mut bad)) }) =
                FromWorker::Hello(hello()).encode()
            else {
                panic!("it is a hello")
            };
            bad.slots = slots;
            let kind = Some(generated::from_worker::Kind::Hello(bad));
            let stream = tokio_stream::iter([generated::FromWorker { kind }]);
            let status = client.work(stream).await.expect_err("it makes no sense");
            assert!(status.message().contains("slots"), "{status}");
        }
    });
    assert_eq!(fleet.n_workers(), 0);
    assert!(events.try_iter().all(|e| !matches!(e, FleetEvent::WorkerJoined { .. })));
}

#[test]
fn a_worker_that_speaks_and_never_reads_is_put_away_before_it_fills_the_memory() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        (fleet.run(setup, jobs(5)).unwrap(), fleet)
    });
    let away = |event: FleetEvent| matches!(event, FleetEvent::WorkerLeft { reason, .. } if reason.starts_with("it does not read what it is sent"));
    block_on(async {
        let mut hand = Hand::dial(address, hello()).await;
        hand.take_jobs(1).await;
        // It asks for answers without end: nobody needs what it brings along.
        let flood = async {
            while !events.try_iter().any(away) {
                for _ in 0..1000 {
                    hand.say(FromWorker::Held(vec![HeldRun { key: [7; 32], ended: None }]));
                }
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        };
        tokio::time::timeout(Duration::from_secs(120), flood).await.expect("it is put away");
    });
    let honest = ThreadWorker::start(address, factory(|job| Ok(square(job))));
    let (outcomes, fleet) = run.join().unwrap();
    assert_exact(&outcomes, &jobs(5));
    fleet.close();
    honest.end().unwrap();
}
