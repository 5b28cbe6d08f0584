//! Runs that workers bring along: who goes on with them, and what becomes of those who had them meanwhile.

use super::*;
use crate::dispatcher::Taken;

fn bring(
    stage: &mut Stage,
    worker: u64,
    index: usize,
    answer: Option<Result<Prediction, ParticleError>>,
) -> (Taken, Vec<Command>) {
    let answer = answer.map(|result| (LeaseOutcome::Ran(result), 1.0));
    stage.dispatcher.held(stage.now, WorkerId(worker), index, answer)
}

#[test]
fn whoever_had_a_run_that_another_one_brings_along_is_told_to_stop_and_is_no_stranger() {
    let mut stage = Stage::with(&[200, 1]);
    let n = 150;
    let jobs = stage.jobs(submit(n));
    let given: Vec<_> = jobs.into_iter().filter(|(lease, _)| lease.epoch == 1).collect();
    assert!(given.len() > 110, "{}", given.len());
    for &(lease, index) in &given {
        let (taken, commands) = bring(&mut stage, 2, index, Some(Ok(prediction(index))));
        assert_eq!(taken, Taken::Answer);
        let cancel = Command::Cancel { worker: WorkerId(1), leases: vec![lease], stop: true };
        assert!(commands.contains(&cancel), "{commands:?}");
    }
    // It had ended half of them before it heard of that.
    let mut commands = vec![];
    for (i, &(lease, index)) in given.iter().enumerate() {
        let answer =
            if i % 2 == 0 { LeaseOutcome::Withdrawn } else { LeaseOutcome::Ran(Ok(prediction(index))) };
        commands.extend(stage.step(answered(lease, answer, 1.0)));
    }
    let is_blamed =
        |c: &Command| matches!(c, Command::PutOut { .. } | Command::Notice(FleetEvent::LateAnswer { .. }));
    assert!(!commands.iter().any(is_blamed), "{commands:?}");
    assert_eq!((stage.dispatcher.n_workers(), stage.dispatcher.in_flight(WorkerId(1))), (2, 0));
}

#[test]
fn a_worker_that_brings_along_what_it_was_given_meanwhile_answers_it_by_itself() {
    let mut stage = Stage::with(&[1]);
    let [(lease, 0)] = stage.jobs(submit(1))[..] else { panic!("one job") };
    assert_eq!(bring(&mut stage, 1, 0, Some(Ok(prediction(0)))).0, Taken::No);
    assert!(outcomes(&stage.step(ran(lease, Ok(prediction(0))))).is_some());
}

#[test]
fn a_failure_of_one_machine_counts_once_even_where_it_brings_it_along_again() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(1));
    let (lease, _) = jobs[0];
    // The other one has it now; the first one comes back and has the failure still.
    let retried = stage.jobs(ran(lease, Err(solver("no"))));
    assert_eq!(retried.len(), 1);
    let (taken, commands) = bring(&mut stage, lease.epoch, 0, Some(Err(solver("no"))));
    assert_eq!((taken, commands), (Taken::No, vec![]));
    let done = stage.step(ran(retried[0].0, Ok(prediction(0))));
    let outcome = &outcomes(&done).expect("it ended")[0];
    assert_eq!((&outcome.result, outcome.attempts), (&Ok(prediction(0)), 2));
}

#[test]
fn a_run_that_waits_for_another_machine_is_not_made_by_the_one_where_it_failed() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(5));
    let (lease, index) = jobs[0];
    let commands = stage.step(ran(lease, Err(solver("no"))));
    assert!(!sent(&commands).iter().any(|(_, i)| *i == index), "the other one is full: {commands:?}");
    assert_eq!(bring(&mut stage, lease.epoch, index, None).0, Taken::No);
    assert_eq!(bring(&mut stage, lease.epoch, index, Some(Err(solver("no")))).0, Taken::No);
}
