//! How soon a lost worker is noticed, and that a busy one is not taken for lost: at the usual heartbeat of 8 s.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod fleet_kit;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use fleet_kit::{
    Proxy, ThreadWorker, any_port, assert_exact, await_event, await_workers, factory, jobs, listen, square,
};
use starlings_fleet::{Fleet, FleetEvent, GrpcFleet};
use starlings_models::Setup;

fn through_a_proxy() -> (GrpcFleet, Receiver<FleetEvent>, Proxy, ThreadWorker) {
    let (fleet, events, _) = listen(any_port());
    let proxy = Proxy::to(fleet.address().unwrap());
    let worker = ThreadWorker::start(proxy.address, factory(|job| Ok(square(job))));
    await_workers(&events, 1);
    (fleet, events, proxy, worker)
}

fn lost_after(events: &Receiver<FleetEvent>, since: Instant) -> Duration {
    await_event(events, |event| matches!(event, FleetEvent::WorkerLeft { .. }));
    since.elapsed()
}

#[test]
fn a_closed_connection_is_noticed_at_once_and_not_by_its_silence() {
    let (_fleet, events, proxy, worker) = through_a_proxy();
    let since = Instant::now();
    proxy.cut();
    let after = lost_after(&events, since);
    // Far below two heartbeats, on a machine that has other things to do as well.
    assert!(after < Duration::from_secs(8), "{after:?}");
    worker.cancel.cancel();
    worker.end().unwrap();
}

#[test]
#[ignore = "a third of a minute of waiting: `just deaths`"]
fn a_closed_connection_is_noticed_within_a_second_and_silence_within_sixteen() {
    let (_fleet, events, proxy, worker) = through_a_proxy();
    let mut slowest = Duration::ZERO;
    for _ in 0..20 {
        let since = Instant::now();
        proxy.cut();
        slowest = slowest.max(lost_after(&events, since));
        await_workers(&events, 1);
    }
    println!("a closed connection is noticed after {:.4} s at most", slowest.as_secs_f64());
    assert!(slowest < Duration::from_secs(1), "{slowest:?}");
    let since = Instant::now();
    proxy.mute();
    let after = lost_after(&events, since);
    println!("silence is noticed after {:.2} s", after.as_secs_f64());
    assert!(after <= Duration::from_secs(16), "{after:?}");
    worker.cancel.cancel();
    let _ = worker.end();
}

#[test]
#[ignore = "ten minutes with every core busy: `just deaths`"]
fn no_worker_is_taken_for_lost_while_every_core_is_busy_and_the_caller_thinks_for_a_minute() {
    let minutes: u64 = std::env::var("DEATHS_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(10);
    let (mut fleet, events, _) = listen(any_port());
    let start = || ThreadWorker::start(fleet.address().unwrap(), factory(|job| Ok(square(job))));
    let workers = [start(), start()];
    await_workers(&events, workers.len());
    let setup = fleet.install(&Setup::default()).unwrap();
    let over = Arc::new(AtomicBool::new(false));
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let spin = |over: Arc<AtomicBool>| {
        move || {
            while !over.load(Ordering::Relaxed) {
                std::hint::spin_loop();
            }
        }
    };
    let busy: Vec<_> = (0..2 * cores).map(|_| std::thread::spawn(spin(Arc::clone(&over)))).collect();
    let started = Instant::now();
    while started.elapsed() < Duration::from_secs(60 * minutes) {
        let batch = jobs(50);
        assert_exact(&fleet.run(setup, batch.clone()).unwrap(), &batch);
        // The analysis: a thread that computes and does not yield.
        let thinks = Instant::now();
        while thinks.elapsed() < Duration::from_secs(60) {
            std::hint::spin_loop();
        }
    }
    over.store(true, Ordering::Relaxed);
    for thread in busy {
        thread.join().unwrap();
    }
    let lost = |event: &FleetEvent| matches!(event, FleetEvent::WorkerLeft { .. });
    let left: Vec<FleetEvent> = events.try_iter().filter(lost).collect();
    assert!(left.is_empty(), "{left:?}");
    println!("{minutes} minutes, {} busy threads on {cores} cores: no worker was lost", 2 * cores + 1);
    fleet.close();
    for worker in workers {
        worker.end().unwrap();
    }
}
