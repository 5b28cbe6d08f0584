//! Server and workers over loopback, in one process: what arrives, in which order, and what a failure does.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::net::TcpListener;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use fleet_kit::{
    Proxy, ThreadWorker, any_port, assert_exact, await_event, await_workers, factory, jobs, listen, square,
};
use starlings_fleet::{Fleet, FleetConfig, FleetError, FleetEvent, GrpcFleet, InProcess};
use starlings_models::{Job, ModelDef, Setup, Window};
use starlings_worker::WorkerConfig;
use tokio_util::sync::CancellationToken;

#[test]
fn one_two_and_four_workers_give_the_same_outcomes_in_job_order() {
    for n in [1, 2, 4] {
        let (mut fleet, events, _) = listen(any_port());
        let workers = (0..n)
            .map(|_| ThreadWorker::start(fleet.address().unwrap(), factory(|job| Ok(square(job)))))
            .collect::<Vec<_>>();
        await_workers(&events, n);
        assert_eq!((fleet.n_workers(), fleet.slots()), (n, n));
        let setup = fleet.install(&Setup::default()).unwrap();
        for size in [0, 1, 22, 500] {
            let jobs = jobs(size);
            assert_exact(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
        }
        fleet.close();
        for worker in workers {
            let report = worker.end().expect("a drained worker ends well");
            assert_eq!((report.reason.as_str(), report.failures), ("the run is over", 0));
        }
        // Whoever reads the events learns from the closed channel that there are no more.
        let end = loop {
            if let Err(end) = events.recv_timeout(Duration::from_secs(60)) {
                break end;
            }
        };
        assert_eq!(end, mpsc::RecvTimeoutError::Disconnected);
    }
}

#[test]
fn threads_and_a_worker_over_the_wire_give_the_same_bits() {
    let model = ModelDef { kind: "oscillator".to_owned(), ..ModelDef::default() };
    let names = |names: &[&str]| names.iter().map(|&n| n.to_owned()).collect::<Vec<_>>();
    let setup = Setup {
        model,
        parameters: names(&["m", "c", "k"]),
        outputs: names(&["position"]),
        ..Setup::default()
    };
    let window = Arc::new(Window::free(0.0, (1..40).map(|i| 0.1 * f64::from(i)).collect(), 1, vec![]));
    let job = |particle| Job {
        particle,
        record: 0,
        window: Arc::clone(&window),
        theta: vec![1.0, 0.1 + 0.01 * f64::from(particle), 3.0],
        state: None,
    };
    let jobs = (0..8).map(job).collect::<Vec<_>>();
    let run = |fleet: &mut dyn Fleet| {
        let id = fleet.install(&setup).unwrap();
        let outcomes = fleet.run(id, jobs.clone()).unwrap();
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let results = outcomes.into_iter().map(|o| o.result.unwrap());
        results.map(|p| (bits(&p.outputs), bits(&p.state))).collect::<Vec<_>>()
    };
    let here = run(&mut InProcess::new(2));
    let (mut fleet, _events, _) = listen(any_port());
    let mut config = WorkerConfig::new(fleet.address().unwrap().to_string());
    config.slots = 2;
    let worker = std::thread::spawn(move || starlings_worker::run(config));
    assert_eq!(run(&mut fleet), here);
    fleet.close();
    assert_eq!(worker.join().unwrap().unwrap().predictions, 8);
}

#[test]
fn a_worker_may_start_before_its_coordinator() {
    let listener = TcpListener::bind(any_port()).unwrap();
    let address = listener.local_addr().unwrap();
    let worker = ThreadWorker::start(address, factory(|job| Ok(square(job))));
    // It dialled once and was hung up on; only now the coordinator starts.
    drop(listener.accept().unwrap());
    drop(listener);
    let (mut fleet, _events, _) = listen(address);
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(5);
    assert_exact(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
    fleet.close();
    assert_eq!(worker.end().unwrap().predictions, 5);
}

#[test]
fn a_worker_whose_wire_is_cut_in_the_middle_loses_nothing_and_comes_back() {
    let (mut fleet, events, _) = listen(any_port());
    let proxy = Arc::new(Proxy::to(fleet.address().unwrap()));
    let (cut, runs) = (Arc::clone(&proxy), Arc::new(AtomicU32::new(0)));
    let unsteady = factory(move |job| {
        if runs.fetch_add(1, Ordering::Relaxed) == 7 {
            cut.cut();
        }
        Ok(square(job))
    });
    let near = ThreadWorker::start(proxy.address, unsteady);
    await_workers(&events, 1);
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(200);
    let outcomes = fleet.run(setup, jobs.clone()).unwrap();
    assert_exact(&outcomes, &jobs);
    await_event(&events, |e| matches!(e, FleetEvent::WorkerLeft { requeued, .. } if *requeued > 0));
    await_workers(&events, 1);
    fleet.close();
    assert_eq!(near.end().unwrap().sessions, 2);
}

#[test]
fn a_once_worker_ends_when_its_wire_is_cut_even_while_a_job_computes() {
    let (mut fleet, events, _) = listen(any_port());
    let proxy = Proxy::to(fleet.address().unwrap());
    let (started, starts) = mpsc::channel();
    let started = Mutex::new(started);
    let started = Arc::new(started);
    let endless = factory(move |_| {
        started.lock().unwrap().send(()).unwrap();
        loop {
            std::thread::park();
        }
    });
    let once = ThreadWorker::start_with(proxy.address, endless, |config| config.once = true);
    await_workers(&events, 1);
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs = jobs(1);
        (fleet.run(setup, jobs.clone()).unwrap(), jobs, fleet)
    });
    starts.recv().unwrap();
    proxy.cut();
    let report = once.end().expect("a vanished coordinator is no error to a worker that serves once");
    assert_eq!((report.predictions, report.sessions), (0, 1));
    let address = match await_event(&events, |e| matches!(e, FleetEvent::WorkerLeft { .. })) {
        FleetEvent::WorkerLeft { requeued, .. } => {
            assert_eq!(requeued, 1);
            proxy.address
        }
        _ => unreachable!("awaited"),
    };
    let _second = ThreadWorker::start(address, factory(|job| Ok(square(job))));
    let (outcomes, jobs, _fleet) = run.join().unwrap();
    assert_exact(&outcomes, &jobs);
    assert_eq!(outcomes[0].attempts, 2, "the cut counts as one attempt");
}

#[test]
fn a_cancelled_worker_says_goodbye_and_its_jobs_go_elsewhere() {
    let (mut fleet, events, _) = listen(any_port());
    let leaving = CancellationToken::new();
    let (token, seen) = (leaving.clone(), leaving.clone());
    let first = ThreadWorker::start_with(
        fleet.address().unwrap(),
        factory(move |job| {
            token.cancel();
            Ok(square(job))
        }),
        |config| config.cancel = leaving.clone(),
    );
    // It waits for the other one, which may join much later on a busy machine.
    let slow = factory(move |job| {
        while !seen.is_cancelled() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(square(job))
    });
    let _second = ThreadWorker::start(fleet.address().unwrap(), slow);
    await_workers(&events, 2);
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(50);
    assert_exact(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
    assert_eq!(first.end().unwrap().reason, "cancelled");
    await_event(
        &events,
        |e| matches!(e, FleetEvent::WorkerLeft { reason, .. } if reason == "it was told to end"),
    );
}

#[test]
fn a_cancelled_run_returns_although_its_job_never_ends() {
    let (mut fleet, events, cancel) = listen(any_port());
    let stop = cancel.clone();
    let endless = factory(move |_| {
        stop.cancel();
        loop {
            std::thread::park();
        }
    });
    let worker = ThreadWorker::start(fleet.address().unwrap(), endless);
    await_workers(&events, 1);
    let setup = fleet.install(&Setup::default()).unwrap();
    assert!(matches!(fleet.run(setup, jobs(3)), Err(FleetError::Cancelled)));
    assert!(
        matches!(fleet.run(setup, jobs(3)), Err(FleetError::Cancelled)),
        "a cancelled fleet stays cancelled"
    );
    fleet.close();
    worker.end().unwrap();
}

#[test]
fn a_model_that_computes_for_several_heartbeats_is_not_declared_dead() {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(any_port(), "slow", CancellationToken::new(), sender);
    config.heartbeat = Duration::from_millis(1500);
    let mut fleet = GrpcFleet::listen(config).unwrap();
    let (release, gate) = mpsc::channel::<()>();
    let gate = Arc::new(Mutex::new(gate));
    let slow = factory(move |job| {
        let _ = gate.lock().unwrap().recv();
        Ok(square(job))
    });
    let _worker = ThreadWorker::start(fleet.address().unwrap(), slow);
    await_workers(&events, 1);
    // Time itself is what is tested here: the job takes four heartbeats, silence of two is a loss. They are long enough for a machine
    // that has ten other things to do.
    let clock = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(6));
        release.send(()).unwrap();
    });
    let setup = fleet.install(&Setup::default()).unwrap();
    let outcomes = fleet.run(setup, jobs(1)).unwrap();
    clock.join().unwrap();
    assert_eq!(outcomes[0].attempts, 1);
    assert!(!events.try_iter().any(|e| matches!(e, FleetEvent::WorkerLeft { .. })));
}

#[test]
fn a_coordinator_that_stands_still_loses_no_worker_that_serves_once() {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(any_port(), "still", CancellationToken::new(), sender);
    config.heartbeat = Duration::from_millis(1500);
    config.patience = Duration::from_secs(60);
    let mut fleet = GrpcFleet::listen(config).unwrap();
    let proxy = Proxy::to(fleet.address().unwrap());
    let local = factory(|job| Ok(square(job)));
    let worker = ThreadWorker::start_with(proxy.address, local, |config| config.once = true);
    await_workers(&events, 1);
    // An answered batch: the worker has had its welcome.
    let setup = fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(20);
    assert_exact(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
    // Time itself is what is tested here: the worker hears nothing for four heartbeats, three are its patience otherwise. The coordinator
    // hears the worker, and would lose it after two.
    proxy.silence(true);
    std::thread::sleep(Duration::from_secs(6));
    proxy.silence(false);
    assert_exact(&fleet.run(setup, jobs.clone()).unwrap(), &jobs);
    fleet.close();
    let report = worker.end().unwrap();
    assert_eq!((report.sessions, report.reason.as_str()), (1, "the run is over"));
}
