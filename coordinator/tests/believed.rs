//! What a worker computes that others contradict is used by no resume, wherever the coordinator ends.
#![allow(clippy::unwrap_used)]

mod study_kit;

use std::net::{Ipv4Addr, SocketAddr};
use std::ops::ControlFlow;
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use starlings_coordinator::fleet::{
    Arrived, Factory, Fleet, FleetConfig, FleetError, FleetEvent, GrpcFleet, Held, InProcess, Outcome,
    SetupId,
};
use starlings_coordinator::study::RunError;
use starlings_models::{BuildSetup, Forward, Job, ParticleError, Prediction, Setup, SetupError, Spec};
use starlings_worker::{WorkerConfig, WorkerError, WorkerReport};
use study_kit::{Case, linear};
use tokio_util::sync::CancellationToken;

/// Holds up runs beyond a number.
#[derive(Default)]
struct Gate {
    /// Runs that began, and how many may.
    runs: Mutex<(usize, usize)>,
    changed: Condvar,
}

impl Gate {
    fn open_to(most: usize) -> Arc<Self> {
        let gate = Self::default();
        gate.runs.lock().unwrap().1 = most;
        Arc::new(gate)
    }

    fn open(&self) {
        self.runs.lock().unwrap().1 = usize::MAX;
        self.changed.notify_all();
    }

    fn pass(&self) {
        let mut runs = self.runs.lock().unwrap();
        runs.0 += 1;
        let own = runs.0;
        let _runs = self.changed.wait_while(runs, |runs| own > runs.1).unwrap();
    }

    fn begun(&self) -> usize {
        self.runs.lock().unwrap().0
    }
}

/// The model of the study with its outputs times a factor.
struct Scaled(Box<dyn Forward>, f64, Arc<Gate>);

impl Forward for Scaled {
    fn spec(&self) -> &Spec {
        self.0.spec()
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        self.2.pass();
        let mut prediction = self.0.run(job)?;
        prediction.outputs.iter_mut().for_each(|value| *value *= self.1);
        Ok(prediction)
    }
}

type Worker = JoinHandle<Result<WorkerReport, WorkerError>>;

fn worker(address: SocketAddr, factor: f64, gate: &Arc<Gate>) -> Worker {
    let gate = Arc::clone(gate);
    let factory: Factory = Arc::new(move |setup: &Setup| -> Result<Box<dyn Forward>, SetupError> {
        Ok(Box::new(Scaled(setup.build()?, factor, Arc::clone(&gate))))
    });
    let mut config = WorkerConfig::new(address.to_string());
    config.factory = factory;
    std::thread::spawn(move || starlings_worker::run(config))
}

fn await_worker(events: &Receiver<FleetEvent>) {
    let joined = |event: FleetEvent| matches!(event, FleetEvent::WorkerJoined { .. });
    while !joined(events.recv_timeout(Duration::from_secs(60)).expect("a worker comes")) {}
}

/// Calls `told` with the number of outcomes whenever the store was told of some or none.
struct Watched<F> {
    inner: GrpcFleet,
    told: F,
}

impl<F: FnMut(usize) -> ControlFlow<()>> Fleet for Watched<F> {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, _: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        unreachable!("states are held")
    }

    fn run_telling(
        &mut self,
        jobs: Vec<(SetupId, Job<Held>)>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome<Held>>, FleetError> {
        let told = &mut self.told;
        self.inner.run_telling(jobs, &mut |outcomes| {
            let n = outcomes.len();
            arrived(outcomes)?;
            told(n)
        })
    }

    fn n_workers(&self) -> usize {
        self.inner.n_workers()
    }

    fn slots(&self) -> usize {
        self.inner.slots()
    }
}

fn listen() -> (GrpcFleet, Receiver<FleetEvent>, SocketAddr) {
    let (sender, events) = mpsc::channel();
    let address = Some((Ipv4Addr::LOCALHOST, 0).into());
    let fleet =
        GrpcFleet::listen(FleetConfig::new(address, "test", CancellationToken::new(), sender)).unwrap();
    let address = fleet.address().unwrap();
    (fleet, events, address)
}

fn case() -> Case {
    let (times, z) = linear::data(12, 8);
    let one = |i: usize| linear::record(&format!("r{i}"), "line.csv", linear::NOISE, "");
    let study = linear::study_of("kind = \"batch\"", &(0..8).map(one).collect::<String>());
    Case::new(&study, &[("line.csv", linear::file(&times, &z))])
}

#[test]
fn what_nobody_has_compared_when_the_coordinator_dies_is_made_again() {
    let case = case();
    let whole = case.run();
    let (fleet, events, address) = listen();
    let (wrong, right) = (Gate::open_to(usize::MAX), Gate::open_to(0));
    let workers = [worker(address, 0.995, &wrong), worker(address, 1.0, &right)];
    (0..2).for_each(|_| await_worker(&events));
    let mut later = 0;
    // It dies when the first one has made runs for a while, and the second one none that could contradict them.
    let told = |_| {
        later += usize::from(wrong.begun() > 3 && right.begun() > 0);
        if later > 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut fleet = Watched { inner: fleet, told };
    let path = case.fresh();
    let ended = case.go(&path, &mut fleet).err().expect("it dies");
    assert!(matches!(ended, RunError::Fleet(FleetError::Cancelled)), "{ended}");
    right.open();
    fleet.inner.close();
    for worker in workers {
        worker.join().unwrap().unwrap();
    }
    assert_eq!(case.go(&path, &mut InProcess::new(2)).unwrap().csv, whole.csv);
}

#[test]
fn what_was_kept_of_workers_that_disagree_is_made_again() {
    let case = case();
    let whole = case.run();
    let (fleet, events, address) = listen();
    let (wrong, right) = (Gate::open_to(4), Gate::open_to(usize::MAX));
    let mut workers = vec![worker(address, 0.995, &wrong)];
    await_worker(&events);
    let (mut kept, mut second) = (0, None);
    // Alone it is believed; then comes another one.
    let told = |n| {
        kept += n;
        if kept >= 3 && second.is_none() {
            second = Some(worker(address, 1.0, &right));
            await_worker(&events);
            wrong.open();
        }
        ControlFlow::Continue(())
    };
    let mut fleet = Watched { inner: fleet, told };
    let path = case.fresh();
    let ended = case.go(&path, &mut fleet).err().expect("nobody can tell who is right");
    assert!(matches!(ended, RunError::Fleet(FleetError::Disagreement { .. })), "{ended}");
    fleet.inner.close();
    workers.extend(second);
    for worker in workers {
        worker.join().unwrap().unwrap();
    }
    assert_eq!(case.go(&path, &mut InProcess::new(2)).unwrap().csv, whole.csv);
}
