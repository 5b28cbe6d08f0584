//! Solvers that misbehave: each gives a sentence with the solver's name and the end of its output, and leaves nothing behind.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

#[path = "bad/kit.rs"]
mod kit;
#[path = "bad/processes.rs"]
mod processes;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use kit::{Bad, Reaction, finished, job, quantity, reaching, setup, sound, soundly};
use starlings_models::{ModelFailure, ParticleError};
use starlings_proto::convert::floats;
use starlings_proto::generated_solver::run_reply::Kind;
use starlings_proto::generated_solver::{Failure, Finished, Measure, Progress, RunReply, failure};
use starlings_solver::{SiteOptions, Solvers};
use tonic::Status;

fn reply(kind: Kind) -> RunReply {
    RunReply { kind: Some(kind) }
}

fn failing(kind: failure::Kind, text: &str, time: Option<f64>) -> Reaction {
    Reaction::Says(vec![reply(Kind::Failure(Failure { kind: kind.into(), text: text.to_owned(), time }))])
}

/// How a run of a solver that reacts like this fails.
fn failure_of(react: impl Fn() -> Reaction + Send + Sync + 'static) -> ParticleError {
    let bad = Bad::new(sound(), move |_| react());
    let (solvers, def) = bad.reached();
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    forward.run(&job(None)).unwrap_err()
}

#[test]
fn an_answer_of_another_shape_or_without_finite_values_is_told_with_the_solver_and_what_is_wrong() {
    // Two outputs at three times, two states.
    let cases: [(&[f64], &[f64], &str); 8] = [
        (&[0.0; 4], &[0.0; 2], "returned 4 output values where 6 belong"),
        (&[0.0; 7], &[0.0; 2], "returned 7 output values where 6 belong"),
        (&[], &[0.0; 2], "returned 0 output values where 6 belong"),
        (&[0.0; 6], &[0.0; 1], "returned 1 state values where 2 belong"),
        (&[0.0; 6], &[], "returned 0 state values where 2 belong"),
        (
            &[0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0],
            &[0.0; 2],
            "returned NaN: output `slope` is not a finite number at t = 0.2",
        ),
        (
            &[0.0, 0.0, 0.0, 0.0, f64::INFINITY, 0.0],
            &[0.0; 2],
            "returned inf: output `tip` is not a finite number at t = 0.3",
        ),
        (&[0.0; 6], &[0.0, f64::NEG_INFINITY], "returned -inf: state `v` is not a finite number at t = 0.3"),
    ];
    for (outputs, state, wanted) in cases {
        let (outputs, state) = (outputs.to_vec(), state.to_vec());
        let says = failure_of(move || Reaction::Says(vec![finished(&outputs, &state)])).to_string();
        assert!(says.contains("the solver `") && says.contains(wanted), "`{wanted}` is missing in: {says}");
    }
}

#[test]
fn a_call_is_not_left_before_its_end_however_much_later_than_the_answer_that_comes() {
    // A connection breaks after a thousand calls that were.
    let linger = Duration::from_millis(20);
    let bad = Bad::new(sound(), move |_| Reaction::Lingers(vec![finished(&[0.0; 6], &[0.0; 2])], linger));
    let (solvers, def) = bad.reached();
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    assert!((0..5).all(|_| forward.run(&job(None)).is_ok()));
    std::thread::sleep(2 * linger);
    assert_eq!(bad.left(), 0);
}

#[test]
fn an_answer_whose_stream_never_ends_is_an_answer() {
    let linger = Duration::from_secs(1000);
    let bad = Bad::new(sound(), move |_| Reaction::Lingers(vec![finished(&[0.0; 6], &[0.0; 2])], linger));
    let (solvers, def) = bad.reached();
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    assert!((0..2).all(|_| forward.run(&job(None)).is_ok()));
}

#[test]
fn bytes_that_are_no_numbers_and_empty_messages_break_the_protocol() {
    let ragged = || {
        let (outputs, state) = (floats::encode(&[0.0; 6]).slice(..13), floats::encode(&[0.0; 2]));
        Reaction::Says(vec![reply(Kind::Finished(Finished { outputs, state }))])
    };
    let empty = || Reaction::Says(vec![RunReply { kind: None }]);
    let timeless = || Reaction::Says(vec![reply(Kind::Progress(Progress { time: None }))]);
    for react in [ragged as fn() -> Reaction, empty, timeless] {
        let says = failure_of(react).to_string();
        assert!(
            says.contains("breaks the protocol") && says.contains("(and 1 before, on the same run)"),
            "{says}"
        );
    }
}

#[test]
fn failures_that_a_solver_reports_carry_its_name_and_keep_their_kind() {
    let says = failure_of(|| failing(failure::Kind::Solver, "the mesh is tangled", None)).to_string();
    assert!(says.contains("the solver `unix:") && says.contains("` reports: the mesh is tangled"), "{says}");
    let says = failure_of(|| failing(failure::Kind::Solver, "  ", None)).to_string();
    assert!(says.contains("reports a failure and does not say which"), "{says}");
    let refused = failure_of(|| failing(failure::Kind::BadRequest, "no gravity here", None));
    assert!(
        matches!(&refused, ParticleError::BadJob(text) if text.contains("` refuses it: no gravity here")),
        "{refused}"
    );
    let broken = failure_of(|| failing(failure::Kind::NotFinite, "pressure", Some(0.25)));
    let ParticleError::Model(ModelFailure::NotFinite { what, time }) = &broken else { panic!("{broken}") };
    assert!(what.starts_with("pressure of the solver `") && time.to_bits() == 0.25_f64.to_bits(), "{broken}");
    let timeless = failure_of(|| failing(failure::Kind::NotFinite, "pressure", None)).to_string();
    assert!(
        timeless.contains("says that pressure is not a finite number") && !timeless.contains("t = NaN"),
        "{timeless}"
    );
    let endless = failure_of(|| failing(failure::Kind::Solver, &"x".repeat(1_000_000), None)).to_string();
    assert!(endless.len() < 3000, "{} letters", endless.len());
}

#[test]
fn an_error_of_the_call_and_a_stream_without_an_end_are_tried_once_more_and_then_told() {
    let runs = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&runs);
    let says = failure_of(move || {
        counted.fetch_add(1, Ordering::Relaxed);
        Reaction::Says(vec![reply(Kind::Progress(Progress { time: Some(0.1) }))])
    });
    assert!(says.to_string().contains("it ended the run without an answer (and 1 before"), "{says}");
    assert_eq!(runs.load(Ordering::Relaxed), 2);
    let says = failure_of(|| Reaction::Refuses(Status::internal("licence server is down"))).to_string();
    assert!(
        says.contains("the connection to the solver `") && says.contains("licence server is down"),
        "{says}"
    );
    let says = failure_of(|| Reaction::Panics).to_string();
    assert!(says.contains("the connection to the solver `") && says.contains("broke"), "{says}");
}

#[test]
fn after_a_broken_connection_the_next_run_is_made_on_a_new_one() {
    let runs = AtomicUsize::new(0);
    let bad = Bad::new(sound(), move |request| match runs.fetch_add(1, Ordering::Relaxed) {
        0 | 2 => Reaction::Panics,
        _ => soundly(request),
    });
    let (solvers, def) = bad.reached();
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    for _ in 0..2 {
        assert_eq!(forward.run(&job(None)).unwrap().outputs, [0.0; 6]);
    }
}

#[test]
fn of_two_answers_the_first_counts_and_the_next_run_hears_its_own() {
    let runs = AtomicUsize::new(0);
    let bad = Bad::new(sound(), move |_| {
        let run = runs.fetch_add(1, Ordering::Relaxed) as f64;
        Reaction::Says(vec![finished(&[run; 6], &[run; 2]), finished(&[99.0; 6], &[99.0; 2])])
    });
    let (solvers, def) = bad.reached();
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    for run in 0..3 {
        assert_eq!(forward.run(&job(None)).unwrap().outputs, [f64::from(run); 6]);
    }
}

#[test]
fn a_solver_that_never_answers_is_given_up_after_its_time() {
    let bad = Bad::new(sound(), |_| Reaction::Never);
    let (solvers, mut def) = bad.reached();
    def.timeout = 0.3;
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    let says = forward.run(&job(None)).unwrap_err().to_string();
    assert!(says.contains("did not answer within 0.3 s (`timeout` sets the limit)"), "{says}");
    let mute = Bad::mute();
    let (solvers, mut def) = mute.reached();
    def.start_timeout = 0.3;
    let says = solvers.describe(&def).unwrap_err().to_string();
    assert!(
        says.contains("was not ready within 0.3 s (it accepts the connection but does not answer)"),
        "{says}"
    );
}

#[test]
fn nobody_listening_is_told_after_the_time_for_a_start() {
    let folder = tempfile::tempdir().unwrap();
    let mut def = reaching(&folder.path().join("nobody"));
    def.start_timeout = 0.2;
    let says = Solvers::new(SiteOptions::default()).describe(&def).unwrap_err().to_string();
    assert!(says.contains("nobody` was not ready within 0.2 s"), "{says}");
}

/// How a description is refused that somebody has changed.
fn refused(change: impl FnOnce(&mut starlings_proto::generated_solver::Description)) -> String {
    let mut described = sound();
    change(&mut described);
    let bad = Bad::new(described, soundly);
    let (solvers, def) = bad.reached();
    solvers.describe(&def).unwrap_err().to_string()
}

#[test]
fn a_description_that_makes_no_sense_is_refused_with_what_is_wrong() {
    let starts = "describes itself wrongly: ";
    let says = refused(|d| d.protocol = 9);
    assert!(says.contains(&format!("{starts}it speaks protocol 9, this worker speaks 2")), "{says}");
    let says = refused(|d| d.parameters.push(quantity("k", "N/m")));
    assert!(says.contains(&format!("{starts}it describes the parameter `k` twice")), "{says}");
    let says = refused(|d| d.parameters[1].size = 40);
    assert!(says.contains("parameter `c` has 40 components; it must be a scalar"), "{says}");
    let says = refused(|d| d.measures.push(Measure { output: "tip".to_owned(), state: "xx".to_owned() }));
    assert!(says.contains("it names the state `xx`, which is not among its states"), "{says}");
    let says = refused(|d| d.hosts.push("vv".to_owned()));
    assert!(says.contains("it names the state `vv`"), "{says}");
    let says = refused(|d| d.outputs.clear());
    assert!(says.contains("it has no outputs"), "{says}");
    let says = refused(|d| d.states.clear());
    assert!(says.contains("it can restart from a state but describes no states"), "{says}");
    let says = refused(|d| d.parameters[0].name = "k[0]".to_owned());
    assert!(says.contains("`k[0]` is no name for a parameter"), "{says}");
    let says = refused(|d| d.parameters[0].role = "colour".to_owned());
    assert!(says.contains("has the role `colour`, which does not exist"), "{says}");
}

#[test]
fn a_solver_that_is_another_one_than_the_study_was_made_for_is_refused() {
    let bad = Bad::new(sound(), soundly);
    let (solvers, def) = bad.reached();
    let good = setup(&solvers, &def);
    let mut other = sound();
    other.parameters[1].name = "damping".to_owned();
    let changed = Bad::new(other, soundly);
    let (others, def) = changed.reached();
    let mut setup = good;
    let known = setup.model.solver.as_ref().unwrap().described.clone();
    setup.model.solver = Some(Box::new(starlings_models::SolverDef { described: known, ..def }));
    let says = others.build(&setup).err().unwrap().to_string();
    assert!(says.contains("its parameters are k, damping where the study knows k, c"), "{says}");
}

#[test]
fn a_run_that_fails_does_not_spoil_the_next_one() {
    let bad = Bad::new(sound(), |request| {
        let k = floats::decode(&request.parameters, "parameters").unwrap()[0];
        if k > 100.0 { failing(failure::Kind::Solver, "too stiff", None) } else { soundly(request) }
    });
    let (solvers, def) = bad.reached();
    let forward = solvers.build(&setup(&solvers, &def)).unwrap();
    let mut stiff = job(None);
    stiff.theta[0] = 1000.0;
    for _ in 0..3 {
        assert!(forward.run(&stiff).unwrap_err().to_string().contains("too stiff"));
        assert!(forward.run(&job(None)).is_ok());
    }
    assert!(forward.run(&job(Some(vec![0.0; 2]))).is_ok());
}
