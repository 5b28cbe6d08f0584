//! What cannot work says why: taken ports, missing workers, models that fail, jobs and workers of impossible size.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::net::SocketAddr;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use fleet_kit::{ThreadWorker, any_port, await_workers, factory, jobs, listen, square};
use rustix::net::{AddressFamily, SocketType};
use starlings_fleet::{Fleet, FleetConfig, FleetError, GrpcFleet};
use starlings_models::{Failure, ModelFailure, Setup, SetupError};
use starlings_worker::{MAX_SLOTS, WorkerConfig, WorkerError};
use tokio_util::sync::CancellationToken;

#[test]
fn a_model_failure_is_an_outcome_after_two_workers_tried() {
    let (mut fleet, events, _) = listen(any_port());
    let failing = || {
        factory(|job| match job.particle {
            3 => Err(ModelFailure::NotFinite { what: "p".to_owned(), time: f64::INFINITY }.into()),
            4 => panic!("what a model"),
            _ => Ok(square(job)),
        })
    };
    let _workers = [0; 2].map(|_| ThreadWorker::start(fleet.address().unwrap(), failing()));
    await_workers(&events, 2);
    let setup = fleet.install(&Setup::default()).unwrap();
    let outcomes = fleet.run(setup, jobs(6)).unwrap();
    assert_eq!(
        outcomes[3].result,
        Err(ModelFailure::NotFinite { what: "p".to_owned(), time: f64::INFINITY }.into())
    );
    assert!(
        matches!(&outcomes[4].result, Err(Failure::Model(ModelFailure::Solver(text))) if text.contains("what a model"))
    );
    assert_eq!(outcomes.iter().map(|o| o.attempts).collect::<Vec<_>>(), [1, 1, 1, 2, 2, 1]);
    assert_eq!(outcomes.iter().filter(|o| o.result.is_ok()).count(), 4);
}

#[test]
fn a_port_in_use_is_named_with_a_remedy() {
    let (fleet, _events, _) = listen(any_port());
    let (sender, _receiver) = mpsc::channel();
    let config = FleetConfig::new(fleet.address().unwrap(), "second", CancellationToken::new(), sender);
    let error = GrpcFleet::listen(config).err().expect("the port is taken");
    let text = error.to_string();
    assert!(matches!(error, FleetError::Bind { .. }));
    assert!(
        text.contains(&fleet.address().unwrap().port().to_string()) && text.contains("another port"),
        "{text}"
    );
}

#[test]
fn a_fleet_without_workers_says_so_when_its_patience_ends() {
    let (sender, _events) = mpsc::channel();
    let mut config = FleetConfig::new(any_port(), "lonely", CancellationToken::new(), sender);
    config.patience = Duration::from_millis(100);
    let mut fleet = GrpcFleet::listen(config).unwrap();
    let setup = fleet.install(&Setup::default()).unwrap();
    let text = fleet.run(setup, jobs(1)).unwrap_err().to_string();
    assert!(text.contains("starlings worker --connect") && text.contains("no worker is connected"), "{text}");
}

#[test]
fn a_worker_without_a_coordinator_gives_up_and_names_the_address() {
    // A port that is taken and on which nobody listens.
    let socket = rustix::net::socket(AddressFamily::INET, SocketType::STREAM, None).unwrap();
    rustix::net::bind(&socket, &any_port()).unwrap();
    let address = SocketAddr::try_from(rustix::net::getsockname(&socket).unwrap()).unwrap();
    let lonely = |config: &mut WorkerConfig| config.patience = Duration::from_millis(50);
    let error = ThreadWorker::start_with(address, factory(|job| Ok(square(job))), lonely).end().unwrap_err();
    assert!(matches!(&error, WorkerError::NoCoordinator { .. }));
    let text = error.to_string();
    assert!(text.contains(&address.to_string()) && text.contains("refused"), "{text}");
}

#[test]
fn a_setup_that_no_worker_can_build_ends_the_run_with_its_text() {
    let (mut fleet, events, _) = listen(any_port());
    fleet.handle().local_only();
    let broken = || -> starlings_worker::Factory {
        Arc::new(|_| Err(SetupError::Invalid("the model has no legs".to_owned())))
    };
    let _workers = [0; 2].map(|_| ThreadWorker::start(fleet.address().unwrap(), broken()));
    await_workers(&events, 2);
    let setup = fleet.install(&Setup::default()).unwrap();
    let error = fleet.run(setup, jobs(1)).unwrap_err();
    assert!(
        matches!(&error, FleetError::SetupFailed { reason } if reason == "the model has no legs"),
        "{error}"
    );
}

#[test]
fn a_window_without_times_is_refused_before_anything_is_sent() {
    let (mut fleet, _events, _) = listen(any_port());
    let setup = fleet.install(&Setup::default()).unwrap();
    let mut jobs = jobs(1);
    Arc::make_mut(&mut jobs[0].window).times.clear();
    let error = fleet.run(setup, jobs).unwrap_err();
    assert!(matches!(&error, FleetError::TooLarge(_)) && error.to_string().contains("times"), "{error}");
}

#[test]
fn a_worker_with_too_many_slots_is_an_error_and_no_panic() {
    let many = |config: &mut WorkerConfig| config.slots = MAX_SLOTS + 1;
    let worker = ThreadWorker::start_with(any_port(), factory(|job| Ok(square(job))), many);
    let error = worker.end().unwrap_err();
    assert!(matches!(error, WorkerError::TooManySlots { .. }), "{error}");
}
