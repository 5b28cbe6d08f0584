//! Worker processes on this machine: killed ones come back, and what cannot run says why.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use fleet_kit::{assert_exact, await_event, factory, jobs, private, square};
use starlings_fleet::{Fleet, FleetConfig, FleetError, FleetEvent, GrpcFleet, LocalConfig, LocalWorkers};
use starlings_models::Setup;
use starlings_proto::INHERITED;
use starlings_worker::WorkerConfig;
use tokio_util::sync::CancellationToken;

fn local(fleet: &GrpcFleet, n: usize, program: &str, args: &[&str]) -> LocalConfig {
    LocalConfig {
        program: program.into(),
        args: args.iter().map(|&a| a.to_owned()).collect(),
        n,
        fleet: fleet.handle(),
    }
}

/// This test program as a worker: the shell turns `--connect stdin` into the variable that [`worker_process`] reads.
fn workers(fleet: &GrpcFleet, n: usize) -> LocalWorkers {
    let this = std::env::current_exe().unwrap();
    let script = format!(
        "TEST_WORKER_CONNECT=$2 exec '{}' --exact worker_process --ignored --test-threads 1",
        this.display()
    );
    LocalWorkers::spawn(local(fleet, n, "/bin/sh", &["-c", &script, "worker"])).unwrap()
}

#[test]
#[ignore = "not a test: the worker process of the others"]
fn worker_process() {
    let Ok(address) = std::env::var("TEST_WORKER_CONNECT") else { return };
    let mut config = WorkerConfig::new(address);
    config.factory = factory(|job| {
        // Long enough that a kill hits a running batch.
        let (_open, never) = mpsc::channel::<()>();
        let _ = never.recv_timeout(Duration::from_millis(5));
        Ok(square(job))
    });
    starlings_worker::run(config).unwrap();
}

#[test]
fn a_killed_worker_process_is_started_again_and_nothing_is_lost() {
    let (mut fleet, events, _) = private();
    let workers = workers(&fleet, 2);
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        let jobs = jobs(400);
        let outcomes = fleet.run(setup, jobs.clone()).unwrap();
        assert_exact(&outcomes, &jobs);
        fleet
    });
    await_event(&events, |e| matches!(e, FleetEvent::Progress { .. }));
    let victim = workers.pids()[0];
    assert!(Command::new("kill").args(["-9", &victim.to_string()]).status().unwrap().success());
    await_event(&events, |e| matches!(e, FleetEvent::LocalWorkerRestarted { pid, .. } if *pid == victim));
    let fleet = run.join().unwrap();
    let pids = workers.pids();
    drop(workers);
    for pid in pids {
        let alive = Command::new("kill").args(["-0", &pid.to_string()]).output().unwrap().status.success();
        assert!(!alive, "no worker outlives its supervisor");
    }
    drop(fleet);
}

#[test]
fn workers_that_die_at_once_end_the_run_with_their_last_words() {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(None, "broken", CancellationToken::new(), sender);
    config.max_attempts = 1;
    let mut fleet = GrpcFleet::listen(config).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let started = folder.path().join("started").display().to_string();
    let script = "echo \"$@\" >> \"$0\"; echo 'no such library: libphysics' >&2; exit 3";
    let _workers = LocalWorkers::spawn(local(&fleet, 2, "/bin/sh", &["-c", script, &started])).unwrap();
    let setup = fleet.install(&Setup::default()).unwrap();
    let error = fleet.run(setup, jobs(1)).unwrap_err();
    assert!(matches!(&error, FleetError::LocalWorkers(words) if words.contains("libphysics")), "{error}");
    assert!(
        matches!(fleet.run(setup, jobs(1)), Err(FleetError::LocalWorkers(_))),
        "and so does the next one"
    );
    let (mut given_up, mut restarted) = (0, 0);
    for event in events.try_iter() {
        match event {
            FleetEvent::LocalWorkerGivenUp { deaths, reason, .. } => {
                given_up += 1;
                assert!(
                    deaths > 1 && reason.contains("libphysics"),
                    "more deaths than a job has attempts: {deaths}"
                );
            }
            FleetEvent::LocalWorkerRestarted { .. } => restarted += 1,
            _ => {}
        }
    }
    assert_eq!((given_up, restarted), (2, 6), "each of two was started three times again");
    let told = std::fs::read_to_string(started).unwrap();
    for place in ["--place 0", "--place 1"] {
        let times = told.lines().filter(|line| line.ends_with(place)).count();
        assert_eq!(times, 4, "and kept its place: {told}");
    }
}

#[test]
fn a_start_in_vain_counts_as_one_more_death_and_not_as_the_last() {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(None, "gone", CancellationToken::new(), sender);
    config.max_attempts = 1;
    let fleet = GrpcFleet::listen(config).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("shell");
    std::os::unix::fs::symlink("/bin/sh", &program).unwrap();
    let program = program.display().to_string();
    let script = format!("rm '{program}'; exit 3");
    let _workers = LocalWorkers::spawn(local(&fleet, 1, &program, &["-c", &script, "worker"])).unwrap();
    let told = await_event(&events, |e| {
        assert!(!matches!(e, FleetEvent::LocalWorkerRestarted { .. }), "there is no program");
        matches!(e, FleetEvent::LocalWorkerGivenUp { .. })
    });
    let FleetEvent::LocalWorkerGivenUp { deaths, reason, .. } = told else { unreachable!() };
    assert!(deaths == 4 && reason.contains(&program), "{deaths} deaths: {reason}");
}

#[test]
fn a_program_that_does_not_exist_is_named() {
    let (fleet, _events, _) = private();
    let error = LocalWorkers::spawn(local(&fleet, 1, "/no/such/program", &[])).err().expect("cannot start");
    assert!(error.to_string().contains("/no/such/program"), "{error}");
}

#[test]
fn a_local_worker_ends_with_its_coordinator_even_before_it_is_welcomed() {
    let (own, its) = UnixStream::pair().unwrap();
    let mut worker = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "worker_process", "--ignored"])
        .env("TEST_WORKER_CONNECT", INHERITED)
        .stdin(OwnedFd::from(its))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    assert!(worker.try_wait().unwrap().is_none(), "it waits for an answer");
    let cut = std::time::Instant::now();
    drop(own);
    worker.wait().unwrap();
    assert!(cut.elapsed() < Duration::from_secs(30), "its patience is a minute, which it does not use");
}

#[test]
fn a_standard_input_that_is_no_socket_is_called_so() {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "worker_process", "--ignored", "--nocapture"])
        .env("TEST_WORKER_CONNECT", INHERITED)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && told.contains("NoSocket"), "{told}");
}
