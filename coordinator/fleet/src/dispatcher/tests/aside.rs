//! Workers whose place fails: set aside, tried again, and the end of a batch that nobody can run.

use super::*;

#[test]
fn a_failure_of_the_place_sets_the_worker_aside_and_counts_no_attempt() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(2));
    let commands = stage.step(ran(jobs[0].0, Err(place("the scratch folder is gone"))));
    let reason = "the scratch folder is gone".to_owned();
    let notice = FleetEvent::WorkerSetAside { worker: "w1".to_owned(), reason, seconds: 0.5 };
    assert!(commands.contains(&Command::Notice(notice)), "{commands:?}");
    let elsewhere = sent(&commands);
    assert_eq!(elsewhere.iter().map(|(l, index)| (l.epoch, *index)).collect::<Vec<_>>(), [(2, 0)]);
    stage.step(ran(jobs[1].0, Ok(prediction(1))));
    let done = stage.step(ran(elsewhere[0].0, Ok(prediction(0))));
    let outcomes = outcomes(&done).expect("both ended");
    assert_eq!((outcomes[0].attempts, outcomes[0].result.clone()), (1, Ok(prediction(0))));
}

#[test]
fn what_waits_in_a_worker_that_is_set_aside_is_called_back() {
    let mut stage = Stage::with(&[1]);
    let jobs = stage.jobs(submit(2));
    let commands = stage.step(ran(jobs[0].0, Err(place("disk full"))));
    assert!(commands.contains(&Command::Cancel {
        worker: WorkerId(1),
        leases: vec![jobs[1].0],
        stop: false
    }));
}

#[test]
fn a_worker_that_was_set_aside_is_tried_with_one_job_and_gets_all_again_when_it_works() {
    let mut stage = Stage::with(&[2]);
    let jobs = stage.jobs(submit(3));
    stage.step(ran(jobs[0].0, Err(place("no licence"))));
    for (lease, _) in &jobs[1..] {
        stage.step(answered(*lease, LeaseOutcome::Withdrawn, 0.0));
    }
    let tried = sent(&stage.seconds(1, &[1]));
    assert_eq!(tried.len(), 1, "one job to try it");
    // It fails again: the pause doubles.
    stage.step(ran(tried[0].0, Err(place("no licence"))));
    let tried = sent(&stage.seconds(1, &[1]));
    let commands = stage.step(ran(tried[0].0, Ok(prediction(tried[0].1))));
    let back = Command::Notice(FleetEvent::WorkerBack { worker: "w1".to_owned() });
    assert!(commands.contains(&back), "{commands:?}");
    assert_eq!(sent(&commands).len(), 2, "all that waits");
}

#[test]
fn a_batch_that_no_place_can_run_ends_with_the_reasons_when_patience_does() {
    let mut stage = Stage::with(&[1]);
    let mut open = stage.jobs(submit(1));
    let mut ended = vec![];
    for _ in 0..90 {
        for (lease, _) in std::mem::take(&mut open) {
            stage.step(ran(lease, Err(place("no licence"))));
        }
        let commands = stage.seconds(1, &[1]);
        open = sent(&commands);
        ended.extend(commands.into_iter().filter(|c| matches!(c, Command::BatchFailed(_))));
    }
    let [Command::BatchFailed(BatchError::Unavailable { waited, reasons })] = ended.as_slice() else {
        panic!("{ended:?}")
    };
    assert!(*waited >= RULES.patience && reasons == "w1 (no licence)", "{waited:?}: {reasons}");
}

#[test]
fn a_timeout_is_an_outcome_of_its_own_type() {
    let mut stage = Stage::with(&[1]);
    let jobs = stage.jobs(submit(1));
    let late = starlings_models::Timeout { limit: 3.0, says: "it took more than 3 s".to_owned() };
    let done = stage.step(ran(jobs[0].0, Err(late.clone().into())));
    assert_eq!(outcomes(&done).expect("ended")[0].result, Err(late.into()));
}
