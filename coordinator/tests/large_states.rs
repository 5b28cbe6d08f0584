//! A model whose state is too large for a message: the posterior is, byte by byte, that of the same run in memory.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::fmt::Write as _;
use std::net::Ipv4Addr;
use std::path::Path;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use starlings_coordinator::fleet::{
    Factory, Fleet, FleetConfig, FleetEvent, GrpcFleet, InProcess, PlaceName, StateStore,
};
use starlings_models::{
    BuildSetup, Forward, Job, ModelFailure, ParticleError, Prediction, Setup, SetupError, Spec,
};
use starlings_worker::WorkerConfig;
use study_kit::{Case, Done};
use tokio_util::sync::CancellationToken;

/// Rings of the tube: a state of 40 001 values, two pieces.
const CELLS: usize = 20_000;

/// Bytes of a state of so many rings.
fn state(cells: usize) -> usize {
    (2 * cells + 1) * 8
}

/// An elastic tube of so many rings of which only the pressure at the inlet is seen.
fn tube(cells: usize, estimator: &str) -> Case {
    let study = format!(
        r#"
[study]
name = "long-tube"
[model]
kind = "fsi-tube"
[model.layout]
cells = {cells}
regions = 2
[[parameters]]
name = "E1"
unit = "dyn/cm^2"
prior = {{ transform = "log2", median = 5e6, sd = 0.5 }}
[[parameters]]
name = "E2"
unit = "dyn/cm^2"
prior = {{ transform = "log2", median = 5e6, sd = 0.5 }}
[[records]]
name = "rise"
file = "pressure.csv"
time = "time"
inputs = {{ flow = "flow.csv:flow" }}
channels = [ {{ column = "p", output = "inlet_pressure", unit = "dyn/cm^2", noise = 1e4 }} ]
[estimator]
{estimator}
"#
    );
    let mut pressure = "time,p\n".to_owned();
    let mut flow = "time,flow\n".to_owned();
    for step in 0..=12 {
        let t = f64::from(step) * 0.001;
        writeln!(flow, "{t},{}", 3.0 * f64::from(step)).unwrap();
        if step > 0 && step % 3 == 0 {
            writeln!(pressure, "{t},{}", 106_657.6 + 4e5 * t).unwrap();
        }
    }
    Case::new(&study, &[("pressure.csv", pressure), ("flow.csv", flow)])
}

/// The tube, which has no solution where its first region is too stiff.
struct Walled(Box<dyn Forward>, f64);

impl Forward for Walled {
    fn spec(&self) -> &Spec {
        self.0.spec()
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        if job.theta[0] > self.1 {
            return Err(ModelFailure::Solver("too stiff".to_owned()).into());
        }
        self.0.run(job)
    }
}

fn factory(wall: f64) -> Factory {
    Arc::new(move |setup: &Setup| -> Result<Box<dyn Forward>, SetupError> {
        Ok(Box::new(Walled(setup.build()?, wall)))
    })
}

/// A run on two workers over the network, with so much memory for states, or in a folder that they share.
fn over_the_network(
    case: &Case,
    path: &Path,
    wall: f64,
    memory: usize,
    place: Option<&PlaceName>,
) -> (Done, StateStore) {
    let (sender, events) = mpsc::channel();
    let cancel = CancellationToken::new();
    let mut config = FleetConfig::new(Some((Ipv4Addr::LOCALHOST, 0).into()), "test", cancel, sender);
    let folder = place.map(|place| place.of_run(&config.identity.id));
    config.states = folder.map_or_else(|| StateStore::new(memory), StateStore::shared);
    let store = config.states.clone();
    let mut fleet = GrpcFleet::listen(config).unwrap();
    let address = fleet.address().unwrap();
    let workers = [1, 2].map(|_| {
        let mut config = WorkerConfig::new(address.to_string());
        config.factory = factory(wall);
        config.states = place.cloned();
        std::thread::spawn(move || starlings_worker::run(config))
    });
    let mut sharing = if place.is_some() { 2 } else { 0 };
    while sharing > 0 {
        let event = events.recv_timeout(Duration::from_secs(60)).expect("the workers come");
        sharing -= usize::from(matches!(event, FleetEvent::SharesStates { .. }));
    }
    let done = case.go(path, &mut fleet).unwrap();
    assert!(fleet.states().is_some());
    fleet.close();
    for worker in workers {
        worker.join().unwrap().unwrap();
    }
    (done, store)
}

#[test]
fn the_posterior_is_that_of_the_same_run_in_memory() {
    // An affine set, one that is redrawn, and points that fail and are pulled.
    for (estimator, wall, rescued) in [
        ("passes = 1", f64::INFINITY, false),
        ("passes = 1\npoints = \"star\"", f64::INFINITY, false),
        ("passes = 1\npoints = \"star\"", 6.5e6, true),
    ] {
        let case = tube(CELLS, estimator);
        let small = case.run_on(&mut InProcess::new(2).with_factory(factory(wall))).unwrap();
        assert_eq!(small.summary.runs.rescued > 0, rescued, "{estimator}");
        for memory in [1 << 30, 2 * state(CELLS)] {
            let path = case.fresh();
            let (large, store) = over_the_network(&case, &path, wall, memory, None);
            assert_eq!(small.csv, large.csv, "{estimator}, {memory} bytes");
            assert!((1..=memory).contains(&store.in_memory().1), "it was used and bounded");
            assert_eq!(store.n_pieces(), 0, "a finished run needs none");
            assert!(!path.join("states").exists());
        }
        let shared = tempfile::tempdir().unwrap();
        let place = shared.path().to_str().unwrap().parse().unwrap();
        let (large, store) = over_the_network(&case, &case.fresh(), wall, 0, Some(&place));
        assert_eq!(small.csv, large.csv, "{estimator}, in a folder");
        assert_eq!(store.in_memory(), (0, 0));
        drop(store);
        assert_eq!(std::fs::read_dir(shared.path()).unwrap().count(), 0, "a finished run leaves nothing");
    }
}

#[test]
#[ignore = "minutes: half a million rings"]
fn the_posterior_with_a_state_of_8_megabytes_is_that_of_the_same_run_in_memory() {
    let cells = 500_000;
    let case = tube(cells, "passes = 1");
    let small = case.run_on(&mut InProcess::new(2).with_factory(factory(f64::INFINITY))).unwrap();
    let memory = 2 * state(cells);
    let (large, store) = over_the_network(&case, &case.fresh(), f64::INFINITY, memory, None);
    assert_eq!(small.csv, large.csv);
    assert!((1..=memory).contains(&store.in_memory().1) && store.n_pieces() == 0);
}
