//! Abnormal ends: when a control run is made, where, and what follows from it.

use super::*;

/// Two jobs on one worker of two slots; the first one ends abnormally twice, before the second one has ended.
fn parked() -> (Stage, Lease) {
    let mut stage = Stage::with(&[2]);
    let jobs = stage.jobs(submit(2));
    let retried = stage.jobs(ran(jobs[0].0, Err(crash("signal 11"))));
    assert_eq!(retried.len(), 1, "the only worker tries it once more");
    let commands = stage.step(ran(retried[0].0, Err(crash("signal 11"))));
    assert!(sent(&commands).is_empty() && controls(&commands).is_empty(), "nothing is known to work yet");
    (stage, jobs[1].0)
}

#[test]
fn a_crash_that_repeats_around_a_control_run_that_works_is_a_failure_of_the_model() {
    let (mut stage, second) = parked();
    let commands = stage.step(ran(second, Ok(prediction(1))));
    assert!(matches!(commands[0], Command::Keep { index: 1, .. }), "{commands:?}");
    let control = controls(&commands)[0].0;
    assert_eq!(
        (control.epoch, control.attempt),
        (1, 3),
        "on that very worker, under the lease of the failed job"
    );
    let confirm = stage.jobs(ran(control, Ok(prediction(1))));
    assert_eq!(confirm[0].1, 0, "the failed job once more");
    let done = stage.step(ran(confirm[0].0, Err(crash("signal 11"))));
    let outcomes = outcomes(&done).expect("both ended");
    assert_eq!(outcomes[0].result, Err(failed("signal 11").into()));
    assert_eq!(outcomes[1].result, Ok(prediction(1)));
}

#[test]
fn a_crash_that_does_not_repeat_after_the_control_run_was_no_failure_of_the_model() {
    let (mut stage, second) = parked();
    let control = controls(&stage.step(ran(second, Ok(prediction(1)))))[0].0;
    let confirm = stage.jobs(ran(control, Ok(prediction(1))));
    let done = stage.step(ran(confirm[0].0, Ok(prediction(0))));
    assert_eq!(outcomes(&done).expect("both ended")[0].result, Ok(prediction(0)));
}

#[test]
fn a_control_run_that_fails_sets_the_worker_aside_and_the_job_runs_elsewhere() {
    let (mut stage, second) = parked();
    let control = controls(&stage.step(ran(second, Ok(prediction(1)))))[0].0;
    let commands = stage.step(ran(control, Err(crash("no licence"))));
    let reason = "a run that worked before fails there: the solver failed: no licence".to_owned();
    let notice = FleetEvent::WorkerSetAside { worker: "w1".to_owned(), reason, seconds: 0.5 };
    assert!(commands.contains(&Command::Notice(notice)), "{commands:?}");
    assert!(sent(&commands).is_empty());
    stage.step(Event::Joined(joining(2, 1)));
    let elsewhere = stage.jobs(Event::SetupDone { worker: WorkerId(2), setup: SETUP });
    assert_eq!(elsewhere.iter().map(|(l, index)| (l.epoch, *index)).collect::<Vec<_>>(), [(2, 0)]);
    let done = stage.step(ran(elsewhere[0].0, Ok(prediction(0))));
    assert_eq!(outcomes(&done).expect("both ended")[0].result, Ok(prediction(0)));
}

#[test]
fn a_crash_where_nothing_else_works_ends_the_batch_with_its_words() {
    let (mut stage, second) = parked();
    let retried = stage.jobs(ran(second, Err(crash("signal 11"))));
    let ended = stage.step(ran(retried[0].0, Err(crash("signal 6"))));
    let error = BatchError::NoControl {
        index: 0,
        particle: 0,
        record: 0,
        parameters: String::new(),
        reason: "signal 11".to_owned(),
    };
    assert!(ended.contains(&Command::BatchFailed(error)), "{ended:?}");
}

#[test]
fn a_run_that_worked_in_the_batch_before_is_a_control_run_in_the_next_of_the_same_window() {
    let mut stage = Stage::with(&[1]);
    let first = stage.jobs(submit(1));
    stage.step(ran(first[0].0, Ok(prediction(0))));
    let jobs = stage.jobs(submit(1));
    let retried = stage.jobs(ran(jobs[0].0, Err(crash("signal 11"))));
    assert_eq!(controls(&stage.step(ran(retried[0].0, Err(crash("signal 11"))))).len(), 1);
    // Another window: what worked before says nothing of it, and is forgotten.
    let name = JobName { particle: 0, record: 0, span: [1, 2] };
    let commands = stage.step(Event::Submit { jobs: vec![(SETUP, name)] });
    assert!(commands.iter().any(|c| matches!(c, Command::Forget { .. })), "{commands:?}");
}

#[test]
fn a_crash_is_tried_on_another_worker_first_and_controlled_there() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(2));
    stage.step(ran(jobs[1].0, Ok(prediction(1))));
    let retried = stage.jobs(ran(jobs[0].0, Err(crash("signal 11"))));
    assert_ne!(retried[0].0.epoch, jobs[0].0.epoch);
    let control = controls(&stage.step(ran(retried[0].0, Err(crash("signal 11")))))[0].0;
    assert_eq!(control.epoch, retried[0].0.epoch);
}

/// What a batch ends with where every run crashes from now on, and after how many runs and seconds.
fn crashing(stage: &mut Stage, mut commands: Vec<Command>, workers: &[u64]) -> (BatchError, usize, usize) {
    let mut open = std::collections::VecDeque::new();
    let (mut runs, mut seconds) = (0, 0);
    loop {
        let failed =
            commands.iter().find_map(|c| if let Command::BatchFailed(e) = c { Some(e) } else { None });
        if let Some(error) = failed {
            return (error.clone(), runs, seconds);
        }
        open.extend(sent(&commands).iter().map(|s| s.0));
        open.extend(controls(&commands).iter().map(|c| c.0));
        commands = if let Some(lease) = open.pop_front() {
            runs += 1;
            stage.step(ran(lease, Err(crash("no licence"))))
        } else {
            seconds += 1;
            stage.seconds(1, workers)
        };
        assert!(runs < 200 && seconds < 200, "{runs} runs in {seconds} s");
    }
}

#[test]
fn places_in_which_everything_crashes_are_tried_ever_less_often_until_patience_ends() {
    for workers in [&[1][..], &[1, 1], &[2, 3, 1]] {
        let names: Vec<u64> = (1..=workers.len() as u64).collect();
        let mut stage = Stage::with(workers);
        let first = stage.jobs(submit(1));
        stage.step(ran(first[0].0, Ok(prediction(0))));
        let commands = stage.step(submit(5));
        let (error, runs, seconds) = crashing(&mut stage, commands, &names);
        assert!(
            matches!(&error, BatchError::Unavailable { reasons, .. } if reasons.contains("no licence")),
            "{error:?}"
        );
        // Of every worker a job, the job again and a control run, at first and after pauses of 0.5, 1, 2, 4, 8, 16 and 30 s.
        assert!(runs <= 24 * workers.len() + 10, "{runs} runs");
        assert!((60..100).contains(&seconds), "{seconds} s");
    }
}
