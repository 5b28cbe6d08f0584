//! Workers that die, models that fail: what is tried again, where, and how often.

use super::*;

#[test]
fn a_lost_worker_returns_all_its_leases() {
    let mut stage = Stage::with(&[1, 1]);
    let first = stage.jobs(submit(4));
    assert_eq!(first.iter().filter(|(lease, _)| lease.epoch == 2).count(), 2);
    let commands = stage.step(left(2, false));
    let requeued = FleetEvent::WorkerLeft { worker: "w2".to_owned(), reason: "gone".to_owned(), requeued: 2 };
    assert!(commands.contains(&Command::Notice(requeued)));
    let mut done = 0;
    let mut open = first.into_iter().filter(|(lease, _)| lease.epoch == 1).collect::<Vec<_>>();
    while let Some((lease, index)) = open.pop() {
        done += 1;
        open.extend(stage.jobs(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0)));
    }
    assert_eq!(done, 4);
}

#[test]
fn only_the_jobs_that_were_running_count_an_attempt_when_their_worker_dies() {
    let mut stage = Stage::with(&[1]);
    let mut last = stage.step(submit(2));
    for id in 2..=3 {
        // Job 0 runs and kills two workers in turn; job 1 only waits behind it.
        let first = sent(&last).first().map(|(_, index)| *index);
        assert_eq!(first, Some(0), "the requeued job is first again");
        stage.step(left(id - 1, false));
        stage.step(Event::Joined(joining(id, 1)));
        last = stage.step(Event::SetupDone { worker: WorkerId(id), setup: SETUP });
    }
    let jobs = sent(&last);
    assert_eq!(jobs.len(), 2);
    stage.step(ran(jobs[0].0, Ok(prediction(0))));
    let last = stage.step(ran(jobs[1].0, Ok(prediction(1))));
    let outcomes = outcomes(&last).expect("both jobs ended");
    assert_eq!(
        outcomes.iter().map(|o| (o.attempts, o.result.is_ok())).collect::<Vec<_>>(),
        [(3, true), (1, true)]
    );
}

#[test]
fn a_job_that_loses_worker_after_worker_ends_the_batch_and_is_no_failure_of_its_parameters() {
    let mut stage = Stage::with(&[1]);
    stage.step(submit(2));
    let mut died = vec![];
    for id in 2..=4 {
        died = stage.step(left(id - 1, false));
        stage.step(Event::Joined(joining(id, 1)));
        stage.step(Event::SetupDone { worker: WorkerId(id), setup: SETUP });
    }
    let failed = died.iter().any(|c| {
        matches!(c, Command::GivenUp { notice: FleetEvent::JobFailed { particle: 0, attempts: 3, .. }, .. })
    });
    assert!(failed, "{died:?}");
    let reason = "given up after 3 attempts: w3 was lost: gone".to_owned();
    let ended = BatchError::NoAnswer { index: 0, particle: 0, record: 0, reason };
    assert!(died.contains(&Command::BatchFailed(ended)), "{died:?}");
}

#[test]
fn a_worker_that_says_goodbye_counts_no_attempt() {
    let mut stage = Stage::with(&[1]);
    stage.step(submit(1));
    let mut last = vec![];
    for id in 2..20 {
        stage.step(left(id - 1, true));
        stage.step(Event::Joined(joining(id, 1)));
        last = stage.jobs(Event::SetupDone { worker: WorkerId(id), setup: SETUP });
    }
    let done = stage.step(answered(last[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    assert_eq!(outcomes(&done).expect("done")[0].attempts, 1);
}

#[test]
fn a_model_failure_is_tried_once_more_on_another_worker() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(1));
    let retried = stage.jobs(answered(jobs[0].0, LeaseOutcome::Ran(Err(solver("no"))), 1.0));
    assert_eq!(retried.len(), 1);
    assert_ne!(retried[0].0.epoch, jobs[0].0.epoch);
    let done = stage.step(answered(retried[0].0, LeaseOutcome::Ran(Err(solver("no, again"))), 1.0));
    let outcome = &outcomes(&done).expect("a second failure ends it")[0];
    assert_eq!((outcome.result.clone(), outcome.attempts), (Err(failed("no, again").into()), 2));
}

#[test]
fn a_model_failure_on_the_only_worker_ends_at_once() {
    let mut stage = Stage::with(&[4]);
    let jobs = stage.jobs(submit(1));
    let done = stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Err(solver("no"))), 1.0));
    assert_eq!(outcomes(&done).expect("ended")[0].result, Err(failed("no").into()));
}

#[test]
fn a_failed_job_does_not_wait_for_another_worker_that_left() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(20));
    let on_first = jobs.iter().find(|(lease, _)| lease.epoch == 1).expect("spread").0;
    // The second worker is full, so the failed job waits for it; then it dies.
    assert!(
        stage
            .jobs(answered(on_first, LeaseOutcome::Ran(Err(solver("no"))), 1.0))
            .iter()
            .all(|(l, _)| l.epoch == 1)
    );
    let commands = stage.step(left(2, false));
    assert!(
        commands
            .iter()
            .any(|c| matches!(c, Command::GivenUp { notice: FleetEvent::JobFailed { attempts: 1, .. }, .. }))
    );
}

#[test]
fn a_process_that_connects_again_replaces_its_old_stream() {
    let mut stage = Stage::with(&[1]);
    stage.step(submit(1));
    let commands = stage.step(Event::Joined(Joining { nonce: 1, ..joining(5, 1) }));
    assert!(commands.contains(&Command::Close { worker: WorkerId(1) }));
    assert_eq!(stage.dispatcher.n_workers(), 1);
    let jobs = stage.jobs(Event::SetupDone { worker: WorkerId(5), setup: SETUP });
    assert_eq!(jobs.iter().map(|(lease, _)| lease.epoch).collect::<Vec<_>>(), [5]);
}

#[test]
fn a_job_that_does_not_fit_the_model_is_not_tried_elsewhere() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(1));
    let error = ParticleError::BadJob("three values, expected two".to_owned());
    let done = stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Err(error.clone())), 1.0));
    let reason =
        "given up after 1 attempt: the job does not fit the model: three values, expected two".to_owned();
    let ended = BatchError::NoAnswer { index: 0, particle: 0, record: 0, reason };
    assert!(done.contains(&Command::BatchFailed(ended)), "{done:?}");
}

#[test]
fn a_job_given_up_says_its_attempts_once() {
    let mut stage =
        Stage { dispatcher: Dispatcher::new(Rules { max_attempts: 1, ..RULES }), now: Duration::ZERO };
    stage.step(Event::Joined(joining(1, 1)));
    stage.step(Event::SetupDone { worker: WorkerId(1), setup: SETUP });
    assert_eq!(stage.jobs(submit(1)).len(), 1);
    let commands = stage.step(left(1, false));
    let text = commands.iter().find_map(|command| match command {
        Command::GivenUp { notice, index: 0 } => Some(notice.to_string()),
        _ => None,
    });
    assert_eq!(text.expect("told"), "particle 0, record 0: given up after 1 attempt: w1 was lost: gone");
}
