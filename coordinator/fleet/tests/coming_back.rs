//! Workers that outlive their coordinator: what they did meanwhile counts for the next start of the same run, and for no other.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::Duration;

use fleet_kit::{
    Proxy, ThreadWorker, assert_exact, await_event, await_workers, factory, incarnation, jobs, square,
};
use starlings_fleet::{Fleet, FleetEvent, GrpcFleet};
use starlings_models::{Factory, Job, Setup};
use starlings_worker::{HoldLimits, News, WorkerError};

/// Counts the runs of each particle, and holds up those beyond a number.
#[derive(Default)]
struct Gate {
    made: Mutex<Made>,
    changed: Condvar,
}

#[derive(Default)]
struct Made {
    runs: Vec<u32>,
    open_to: usize,
    ended: usize,
}

impl Gate {
    fn open_to(open_to: usize) -> Arc<Self> {
        let gate = Self::default();
        gate.made.lock().unwrap().open_to = open_to;
        Arc::new(gate)
    }

    fn factory(self: &Arc<Self>) -> Factory {
        let gate = Arc::clone(self);
        factory(move |job: &Job| {
            let mut made = gate.made.lock().unwrap();
            made.runs.push(job.particle);
            let started = made.runs.len();
            gate.changed.notify_all();
            made = gate.changed.wait_while(made, |made| started > made.open_to).unwrap();
            made.ended += 1;
            gate.changed.notify_all();
            Ok(square(job))
        })
    }

    fn open(&self, open_to: usize) {
        self.made.lock().unwrap().open_to = open_to;
        self.changed.notify_all();
    }

    fn wait(&self, ready: impl Fn(&Made) -> bool) {
        let limit = Duration::from_secs(60);
        let made = self.made.lock().unwrap();
        let (_made, late) = self.changed.wait_timeout_while(made, limit, |made| !ready(made)).unwrap();
        assert!(!late.timed_out(), "the runs are made within a minute");
    }

    fn runs(&self) -> Vec<u32> {
        let mut runs = self.made.lock().unwrap().runs.clone();
        runs.sort_unstable();
        runs
    }
}

/// A batch that is never answered, on a thread of its own: its coordinator is cut off from its workers.
fn abandon(mut fleet: GrpcFleet, batch: Vec<Job>) {
    let setup = fleet.install(&Setup::default()).unwrap();
    std::thread::spawn(move || fleet.run(setup, batch));
}

#[test]
fn what_was_done_without_a_coordinator_counts_for_the_next_start_and_no_run_is_made_twice() {
    let gate = Gate::open_to(5);
    let (first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| config.slots = 2);
    await_workers(&events, 1);
    let batch = jobs(20);
    abandon(first, batch.clone());
    // Five are done, the next two are held up in their slots, others wait there.
    gate.wait(|made| made.ended == 5 && made.runs.len() == 7);
    let (mut second, events) = incarnation(7, 2);
    let setup = second.install(&Setup::default()).unwrap();
    proxy.lead_to(second.address().unwrap());
    await_workers(&events, 1);
    let answers = batch.clone();
    let waiting = std::thread::spawn(move || second.run(setup, answers));
    let brought = await_event(&events, |event| matches!(event, FleetEvent::RunsBrought { .. }));
    assert!(matches!(brought, FleetEvent::RunsBrought { finished: 5, computing: 2.., .. }), "{brought}");
    gate.open(usize::MAX);
    assert_exact(&waiting.join().unwrap().unwrap(), &batch);
    assert_eq!(gate.runs(), (0..20).collect::<Vec<_>>());
    worker.cancel.cancel();
    worker.end().unwrap();
}

#[test]
fn what_is_done_while_nobody_is_there_waits_in_memory_and_then_on_disk() {
    let gate = Gate::open_to(0);
    let (first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let (told, news) = mpsc::channel();
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| {
        config.hold = HoldLimits { memory: 300, disk: 1 << 20 };
        config.tell = Arc::new(move |news| drop(told.send(news.clone())));
    });
    await_workers(&events, 1);
    let batch = jobs(2);
    abandon(first, batch.clone());
    gate.wait(|made| made.runs.len() == 1);
    // To nobody.
    proxy.lead_to("127.0.0.1:1".parse().unwrap());
    while !matches!(news.recv_timeout(Duration::from_secs(60)).unwrap(), News::Lost { .. }) {}
    gate.open(usize::MAX);
    gate.wait(|made| made.ended == 2);
    let (mut second, events) = incarnation(7, 2);
    proxy.lead_to(second.address().unwrap());
    let setup = second.install(&Setup::default()).unwrap();
    assert_exact(&second.run(setup, batch.clone()).unwrap(), &batch);
    let brought = await_event(&events, |event| matches!(event, FleetEvent::RunsBrought { .. }));
    assert!(matches!(brought, FleetEvent::RunsBrought { finished: 2, computing: 0, .. }), "{brought}");
    assert_eq!(gate.runs(), [0, 1]);
    worker.cancel.cancel();
    worker.end().unwrap();
}

#[test]
fn a_large_state_that_a_run_ended_in_while_nobody_was_there_is_put_for_the_next_start() {
    let gate = Gate::open_to(0);
    let (first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let (told, news) = mpsc::channel();
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| {
        // One state in memory, the others on disk.
        config.hold = HoldLimits { memory: 500_000, disk: 1 << 30 };
        config.tell = Arc::new(move |news| drop(told.send(news.clone())));
    });
    await_workers(&events, 1);
    let mut batch = jobs(4);
    for job in &mut batch {
        // The state at the end is the one at the start.
        job.state = Some((0..50_000).map(|i| f64::from(job.particle) + f64::from(i) / 7.0).collect());
    }
    abandon(first, batch.clone());
    gate.wait(|made| made.runs.len() == 1);
    proxy.lead_to("127.0.0.1:1".parse().unwrap());
    while !matches!(news.recv_timeout(Duration::from_secs(60)).unwrap(), News::Lost { .. }) {}
    gate.open(usize::MAX);
    // What had all of its state goes on; what had not is forgotten.
    gate.wait(|made| made.ended >= 1);
    let (mut second, events) = incarnation(7, 2);
    proxy.lead_to(second.address().unwrap());
    let setup = second.install(&Setup::default()).unwrap();
    assert_exact(&second.run(setup, batch.clone()).unwrap(), &batch);
    let brought = await_event(&events, |event| matches!(event, FleetEvent::RunsBrought { .. }));
    assert!(matches!(brought, FleetEvent::RunsBrought { finished: 0, computing: 1.., .. }), "{brought}");
    assert_eq!(gate.runs().iter().filter(|particle| **particle == 0).count(), 1, "{:?}", gate.runs());
    worker.cancel.cancel();
    worker.end().unwrap();
}

#[test]
fn another_run_gets_nothing_of_what_was_done_for_the_first() {
    let gate = Gate::open_to(usize::MAX);
    let (mut first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let worker = ThreadWorker::start(proxy.address, gate.factory());
    await_workers(&events, 1);
    let setup = first.install(&Setup::default()).unwrap();
    let batch = jobs(3);
    assert_exact(&first.run(setup, batch.clone()).unwrap(), &batch);
    let (mut other, events) = incarnation(8, 1);
    proxy.lead_to(other.address().unwrap());
    await_workers(&events, 1);
    let setup = other.install(&Setup::default()).unwrap();
    assert_exact(&other.run(setup, batch.clone()).unwrap(), &batch);
    assert_eq!(gate.runs(), [0, 0, 1, 1, 2, 2]);
    worker.cancel.cancel();
    worker.end().unwrap();
}

#[test]
fn an_earlier_start_of_the_same_run_is_not_served() {
    let gate = Gate::open_to(usize::MAX);
    let (mut second, events) = incarnation(7, 2);
    let proxy = Proxy::to(second.address().unwrap());
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| {
        config.patience = Duration::from_secs(3);
    });
    await_workers(&events, 1);
    let setup = second.install(&Setup::default()).unwrap();
    second.run(setup, jobs(1)).unwrap();
    let (first, _events) = incarnation(7, 1);
    proxy.lead_to(first.address().unwrap());
    let Err(WorkerError::NoCoordinator { last, .. }) = worker.end() else {
        panic!("it serves the first start")
    };
    assert!(last.contains("start 1 of the run `test`, and this worker has worked for start 2"), "{last}");
}

#[test]
fn a_large_state_whose_way_broke_is_put_for_the_next_start_and_its_run_is_not_made_again() {
    let gate = Gate::open_to(0);
    let (first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| {
        // Less than one state has.
        config.hold = HoldLimits { memory: 100_000, disk: 1 << 30 };
    });
    await_workers(&events, 1);
    let mut batch = jobs(1);
    batch[0].state = Some((0..50_000).map(|i| f64::from(i) / 7.0).collect());
    abandon(first, batch.clone());
    gate.wait(|made| made.runs.len() == 1);
    // Its end state does not arrive.
    proxy.mute();
    gate.open(usize::MAX);
    gate.wait(|made| made.ended == 1);
    let (mut second, events) = incarnation(7, 2);
    let setup = second.install(&Setup::default()).unwrap();
    proxy.lead_to(second.address().unwrap());
    proxy.unmute();
    assert_exact(&second.run(setup, batch.clone()).unwrap(), &batch);
    let brought = await_event(&events, |event| matches!(event, FleetEvent::RunsBrought { .. }));
    assert!(matches!(brought, FleetEvent::RunsBrought { finished: 0, computing: 1, .. }), "{brought}");
    assert_eq!(gate.runs(), [0]);
    worker.cancel.cancel();
    worker.end().unwrap();
}

#[test]
fn a_worker_that_stays_is_not_idle_while_a_run_computes_or_a_result_is_held() {
    let gate = Gate::open_to(0);
    let (first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let (told, news) = mpsc::channel();
    let idle = Duration::from_millis(300);
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| {
        config.stay = Some(idle);
        config.patience = Duration::from_secs(600);
        config.tell = Arc::new(move |news| drop(told.send(news.clone())));
    });
    await_workers(&events, 1);
    let batch = jobs(1);
    abandon(first, batch.clone());
    gate.wait(|made| made.runs.len() == 1);
    proxy.lead_to("127.0.0.1:1".parse().unwrap());
    while !matches!(news.recv_timeout(Duration::from_secs(60)).unwrap(), News::Lost { .. }) {}
    // First it computes, then it holds the result: longer than it may be idle.
    std::thread::sleep(4 * idle);
    gate.open(usize::MAX);
    gate.wait(|made| made.ended == 1);
    std::thread::sleep(4 * idle);
    let (mut second, _events) = incarnation(7, 2);
    proxy.lead_to(second.address().unwrap());
    let setup = second.install(&Setup::default()).unwrap();
    assert_exact(&second.run(setup, batch.clone()).unwrap(), &batch);
    assert_eq!(gate.runs(), [0]);
    second.close();
    let report = worker.end().unwrap();
    assert!(report.reason.contains("had no work for 0.3 s"), "{}", report.reason);
}

#[test]
fn a_worker_that_gives_up_says_how_many_runs_are_lost_with_it() {
    let gate = Gate::open_to(usize::MAX);
    let (mut first, events) = incarnation(7, 1);
    let proxy = Proxy::to(first.address().unwrap());
    let worker = ThreadWorker::start_with(proxy.address, gate.factory(), |config| {
        config.patience = Duration::from_millis(100);
    });
    await_workers(&events, 1);
    let setup = first.install(&Setup::default()).unwrap();
    first.run(setup, jobs(3)).unwrap();
    proxy.lead_to("127.0.0.1:1".parse().unwrap());
    let error = worker.end().unwrap_err().to_string();
    assert!(
        error.contains("3 of its runs, finished or begun, are dropped") && error.contains("`--patience`"),
        "{error}"
    );
}
