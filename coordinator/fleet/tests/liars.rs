//! Workers that lie, over real sockets: they are named and put out, and the outcomes are those of honest workers.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::sync::mpsc::{self, TryRecvError};

use fleet_kit::hand::{Hand, block_on, hello, inside};
use fleet_kit::{
    Run, ThreadWorker, any_port, assert_exact, await_workers, factory, jobs, listen, listen_with, square,
};
use starlings_fleet::{Fleet, FleetError, FleetEvent};
use starlings_models::{Job, ModelFailure, Prediction, Setup};
use starlings_proto::{FromWorker, Hello, ToWorker};

/// Has two honest workers and one that answers `lie` make batch after batch until an event of the liar `fits`; every outcome is
/// exact.
fn with_a_liar(
    lie: impl Fn(&Job) -> Run + Send + Sync + Clone + 'static,
    fits: impl Fn(&FleetEvent) -> bool,
) -> Vec<FleetEvent> {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let liar = ThreadWorker::start_with(address, factory(lie), |config| "liar".clone_into(&mut config.host));
    let honest = [0, 1].map(|_| ThreadWorker::start(address, factory(|job| Ok(square(job)))));
    await_workers(&events, 3);
    let setup = fleet.install(&Setup::default()).unwrap();
    let mut told = Vec::new();
    for _ in 0..1_000 {
        assert_exact(&fleet.run(setup, jobs(60)).expect("two honest workers are enough"), &jobs(60));
        told.extend(events.try_iter());
        if told.iter().any(&fits) {
            break;
        }
    }
    assert!(told.iter().any(fits), "{told:?}");
    fleet.close();
    for worker in honest.into_iter().chain([liar]) {
        let _ = worker.end();
    }
    told
}

/// The liar is named and put out, and the outcomes are exact.
fn assert_found_out(lie: impl Fn(&Job) -> Run + Send + Sync + Clone + 'static) {
    let excluded = |e: &FleetEvent| match e {
        FleetEvent::WorkerExcluded { worker, .. } => Some(worker.contains("liar")),
        _ => None,
    };
    let events = with_a_liar(lie, |event| excluded(event) == Some(true));
    assert!(events.iter().all(|event| excluded(event) != Some(false)), "{events:?}");
}

#[expect(clippy::unnecessary_wraps, reason = "it is what a toy gives")]
fn changed(job: &Job, change: impl Fn(&mut Prediction)) -> Run {
    let mut prediction = square(job);
    change(&mut prediction);
    Ok(prediction)
}

#[test]
fn a_worker_whose_outputs_are_half_a_per_cent_too_small_is_named_and_put_out() {
    assert_found_out(|job| changed(job, |p| p.outputs.iter_mut().for_each(|v| *v *= 0.995)));
}

#[test]
fn a_worker_with_the_sign_of_one_output_turned_is_named_and_put_out() {
    assert_found_out(|job| changed(job, |p| p.outputs[1] = -p.outputs[1]));
}

#[test]
fn a_worker_with_one_wrong_bit_in_a_state_is_named_and_put_out() {
    assert_found_out(|job| {
        changed(job, |p| p.state = p.state.iter().map(|x| f64::from_bits(x.to_bits() ^ 1)).collect())
    });
}

#[test]
fn a_worker_that_calls_every_run_a_failure_is_named_and_put_out() {
    assert_found_out(|_| Err(ModelFailure::OutsideDomain("no".to_owned()).into()));
}

#[test]
fn a_worker_with_values_that_are_none_or_too_few_or_too_many_changes_nothing() {
    let lies: [fn(&mut Prediction); 4] = [
        |p| p.outputs[0] = f64::NAN,
        |p| p.outputs.truncate(1),
        |p| p.outputs.extend([0.0; 1000]),
        |p| p.state = p.state.iter().map(|_| f64::INFINITY).collect(),
    ];
    for lie in lies {
        with_a_liar(
            move |job| changed(job, lie),
            |e| matches!(e, FleetEvent::WorkerSetAside { worker, reason, .. } if worker.contains("liar") && reason.contains("it sent")),
        );
    }
}

#[test]
fn a_worker_with_a_state_of_another_length_is_named_and_put_out() {
    // The length of a state is not known here, as of a model outside: only comparison tells.
    assert_found_out(|job| changed(job, |p| p.state = p.state.iter().copied().chain([1.0]).collect()));
}

#[test]
fn of_two_workers_one_of_which_lies_neither_is_believed_and_both_are_named() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let named = |host: &str, factor: f64| {
        let factory = factory(move |job| changed(job, |p| p.outputs[1] *= factor));
        let host = host.to_owned();
        ThreadWorker::start_with(address, factory, |config| config.host = host)
    };
    let workers = [named("left", 1.0), named("right", 0.995)];
    await_workers(&events, 2);
    let setup = fleet.install(&Setup::default()).unwrap();
    let error = fleet.run(setup, jobs(20)).expect_err("nobody can tell");
    let text = error.to_string();
    assert!(matches!(error, FleetError::Disagreement { .. }), "{text}");
    for part in ["@left/", "@right/", "predicted value 2 is", "--mixed"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    fleet.close();
    for worker in workers {
        worker.end().unwrap();
    }
}

#[test]
fn what_is_allowed_to_differ_is_told_with_both_values() {
    let (mut fleet, events, _) = listen_with(any_port(), |config| config.mixed = true);
    let address = fleet.address().unwrap();
    let workers = [1.0, 1.0 + 1e-12].map(|factor| {
        ThreadWorker::start(address, factory(move |job| changed(job, |p| p.outputs[1] *= factor)))
    });
    await_workers(&events, 2);
    let setup = fleet.install(&Setup::default()).unwrap();
    assert_eq!(fleet.run(setup, jobs(20)).unwrap().len(), 20);
    let told = events.try_iter().filter(|e| matches!(e, FleetEvent::WorkersDiffer { .. })).count();
    assert_eq!(told, 1);
    fleet.close();
    for worker in workers {
        worker.end().unwrap();
    }
}

#[test]
fn a_process_that_was_put_out_is_not_taken_again() {
    let (mut fleet, events, _) = listen(any_port());
    let address = fleet.address().unwrap();
    let honest = [0, 1].map(|_| ThreadWorker::start(address, factory(|job| Ok(square(job)))));
    await_workers(&events, 2);
    let (out, is_out) = mpsc::channel::<()>();
    let run = std::thread::spawn(move || {
        let setup = fleet.install(&Setup::default()).unwrap();
        // Until the liar got some of them and was found out.
        while is_out.try_recv() == Err(TryRecvError::Empty) {
            assert_exact(&fleet.run(setup, jobs(40)).unwrap(), &jobs(40));
        }
        fleet
    });
    block_on(async {
        let mut liar = Hand::dial(address, Hello { nonce: 13, ..hello() }).await;
        let end = loop {
            match liar.hear().await {
                Some(ToWorker::Setup { id, .. }) => liar.say(FromWorker::Setup { id, result: Ok(()) }),
                Some(ToWorker::Job { lease, job, .. }) => {
                    let mut job = job.try_map(inside).unwrap();
                    job.theta[0] += 1.0;
                    liar.answer(lease, &job);
                }
                Some(ToWorker::Drain(reason)) => break reason,
                Some(_) => {}
                None => break String::new(),
            }
        };
        assert!(end.contains("other results than others"), "{end}");
        let answer = Hand::dial(address, Hello { nonce: 13, ..hello() }).await.hear().await;
        assert!(matches!(&answer, Some(ToWorker::Refuse(why)) if why.contains("put out")), "{answer:?}");
        drop(out);
    });
    run.join().unwrap().close();
    for worker in honest {
        worker.end().unwrap();
    }
}
