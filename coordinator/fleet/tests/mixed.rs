//! Batches whose jobs need different setups, over loopback and on threads.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::collections::BTreeSet;
use std::sync::Arc;

use fleet_kit::{ThreadWorker, any_port, await_workers, factory, jobs, listen};
use starlings_fleet::{Fleet, FleetError, FleetEvent, InProcess, Outcome, SetupId};
use starlings_models::{
    Addition, BuildSetup, EffectDef, EffectParameter, Job, ModelDef, Prediction, Setup, SetupError, Window,
};
use starlings_worker::Factory;

/// A setup that multiplies.
fn gain(factor: f64) -> Setup {
    let model = ModelDef { constants: [("gain".to_owned(), factor)].into(), ..ModelDef::default() };
    Setup { model, ..Setup::default() }
}

fn multiplied(job: &Job, factor: f64) -> Prediction {
    let outputs = job.theta.iter().map(|x| factor * x + f64::from(job.particle) / 3.0).collect();
    Prediction { outputs, state: vec![factor].into(), cost: 0.0 }
}

/// Multiplies by the setup's gain; a negative one cannot be built.
fn gains() -> Factory {
    Arc::new(|setup: &Setup| {
        let factor = setup.model.constants["gain"];
        if factor < 0.0 {
            return Err(SetupError::Invalid(format!("a gain of {factor}")));
        }
        factory(move |job| Ok(multiplied(job, factor)))(setup)
    })
}

/// `n` jobs over these setups in turn.
fn mixed(setups: &[SetupId], n: u32) -> Vec<(SetupId, Job)> {
    jobs(n).into_iter().enumerate().map(|(i, job)| (setups[i % setups.len()], job)).collect()
}

fn assert_multiplied(outcomes: &[Outcome], jobs: &[(SetupId, Job)], n_setup: usize) {
    assert_eq!(outcomes.len(), jobs.len());
    for (i, (outcome, (_, job))) in outcomes.iter().zip(jobs).enumerate() {
        let got = outcome.result.as_ref().expect("the toy does not fail");
        let want = multiplied(job, (i % n_setup) as f64);
        assert_eq!((&got.outputs, &got.state, outcome.attempts), (&want.outputs, &want.state, 1), "job {i}");
    }
}

#[test]
fn every_job_of_a_mixed_batch_runs_with_its_own_setup() {
    let (mut fleet, events, _) = listen(any_port());
    let _workers = [0; 2].map(|_| ThreadWorker::start(fleet.address().unwrap(), gains()));
    await_workers(&events, 2);
    for n_setup in [2, 40] {
        let setups: Vec<_> = (0..n_setup).map(|i| fleet.install(&gain(f64::from(i))).unwrap()).collect();
        for n in [0, 40, 300] {
            let jobs = mixed(&setups, n);
            assert_multiplied(&fleet.run_mixed(jobs.clone()).unwrap(), &jobs, setups.len());
        }
    }
    fleet.close();
}

#[test]
fn more_setups_than_a_worker_keeps_are_sent_again_and_no_job_is_lost() {
    let (mut fleet, events, _) = listen(any_port());
    let worker = ThreadWorker::start(fleet.address().unwrap(), gains());
    await_workers(&events, 1);
    let setups: Vec<_> = (0..600).map(|i| fleet.install(&gain(f64::from(i))).unwrap()).collect();
    assert_eq!(setups.iter().collect::<BTreeSet<_>>().len(), 600);
    for _ in 0..2 {
        let jobs = mixed(&setups, 1200);
        assert_multiplied(&fleet.run_mixed(jobs.clone()).unwrap(), &jobs, 600);
    }
    fleet.close();
    let report = worker.end().unwrap();
    assert_eq!((report.predictions, report.failures), (2400, 0), "each ran once, none was refused");
}

#[test]
fn jobs_of_one_forgotten_setup_in_flight_together_do_not_end_a_batch_of_local_workers() {
    let (mut fleet, events, _) = listen(any_port());
    fleet.handle().local_only();
    let worker = ThreadWorker::start(fleet.address().unwrap(), gains());
    await_workers(&events, 1);
    let setups: Vec<_> = (0..600).map(|i| fleet.install(&gain(f64::from(i))).unwrap()).collect();
    let pairs: Vec<_> = setups.iter().flat_map(|&setup| [setup; 2]).collect();
    let factor = |i: usize| (i / 2) as f64;
    for _ in 0..2 {
        let jobs = mixed(&pairs, 1200);
        let outcomes = fleet.run_mixed(jobs.clone()).unwrap();
        for (i, (outcome, (_, job))) in outcomes.iter().zip(&jobs).enumerate() {
            assert_eq!(
                outcome.result.as_ref().unwrap().outputs,
                multiplied(job, factor(i)).outputs,
                "job {i}"
            );
        }
    }
    fleet.close();
    let report = worker.end().unwrap();
    assert_eq!((report.predictions, report.failures), (2400, 0), "each ran once, none was refused");
    let unbuilt = |event: &FleetEvent| matches!(event, FleetEvent::SetupFailed { .. });
    assert!(!events.try_iter().any(|event| unbuilt(&event)), "a setup that is forgotten can be built");
}

#[test]
fn a_mixed_batch_gives_the_same_bits_on_threads_and_over_the_wire() {
    let names = |names: &[&str]| names.iter().map(|&n| n.to_owned()).collect::<Vec<_>>();
    let model = ModelDef { kind: "oscillator".to_owned(), ..ModelDef::default() };
    let plain = Setup {
        model,
        parameters: names(&["m", "c", "k"]),
        outputs: names(&["position"]),
        ..Setup::default()
    };
    let drag = EffectDef {
        name: "drag".to_owned(),
        adds: vec![Addition { to: "v".to_owned(), term: "-a*v*abs(v)".to_owned() }],
        parameters: vec![EffectParameter { name: "a".to_owned(), ..EffectParameter::default() }],
        ..EffectDef::default()
    };
    let mut dragged = Setup { effects: vec![drag], outputs: names(&["v", "position"]), ..plain.clone() };
    dragged.model.constants.insert("a".to_owned(), 0.7);
    let times: Vec<f64> = (1..40).map(|i| 0.1 * f64::from(i)).collect();
    let windows = [1, 2].map(|n_obs| Arc::new(Window::free(0.0, times.clone(), n_obs, vec![])));
    let job = |particle: u32| Job {
        particle,
        record: 0,
        window: Arc::clone(&windows[particle as usize % 2]),
        theta: vec![1.0, 0.1 + 0.01 * f64::from(particle), 3.0],
        state: Some(vec![1.0, 0.0].into()),
    };
    let run = |fleet: &mut dyn Fleet| {
        let ids = [&plain, &dragged].map(|setup| fleet.install(setup).unwrap());
        let jobs = (0..12).map(|i| (ids[i as usize % 2], job(i))).collect();
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let outcomes = fleet.run_mixed(jobs).unwrap().into_iter();
        outcomes.map(|o| o.result.unwrap()).map(|p| (bits(&p.outputs), bits(&p.state))).collect::<Vec<_>>()
    };
    let here = run(&mut InProcess::new(2));
    assert_eq!((here[0].0.len(), here[1].0.len()), (39, 78));
    let (mut fleet, events, _) = listen(any_port());
    let real: Factory = Arc::new(|setup: &Setup| setup.build());
    let _workers = [0; 2].map(|_| ThreadWorker::start(fleet.address().unwrap(), Arc::clone(&real)));
    await_workers(&events, 2);
    assert_eq!(run(&mut fleet), here);
    fleet.close();
}

#[test]
fn one_setup_that_no_worker_can_build_ends_a_mixed_batch_with_its_reason_and_the_next_batch_runs() {
    let (mut fleet, events, _) = listen(any_port());
    fleet.handle().local_only();
    let _workers = [0; 2].map(|_| ThreadWorker::start(fleet.address().unwrap(), gains()));
    await_workers(&events, 2);
    let good = fleet.install(&gain(0.0)).unwrap();
    let bad = fleet.install(&gain(-3.0)).unwrap();
    let error = fleet.run_mixed(mixed(&[good, bad], 20)).unwrap_err();
    assert!(matches!(&error, FleetError::SetupFailed { reason } if reason == "a gain of -3"), "{error}");
    let jobs = mixed(&[good], 20);
    assert_multiplied(&fleet.run_mixed(jobs.clone()).unwrap(), &jobs, 1);
    fleet.close();
}

#[test]
fn a_setup_that_was_never_installed_is_refused_before_any_job_runs() {
    let (mut fleet, _events, _) = listen(any_port());
    let known = fleet.install(&gain(1.0)).unwrap();
    let error = fleet.run_mixed(mixed(&[known, [9; 32]], 2)).unwrap_err();
    assert!(matches!(error, FleetError::UnknownSetup), "{error}");
    let error = InProcess::new(1).run_mixed(mixed(&[[9; 32]], 1)).unwrap_err();
    assert!(matches!(error, FleetError::UnknownSetup), "{error}");
}
