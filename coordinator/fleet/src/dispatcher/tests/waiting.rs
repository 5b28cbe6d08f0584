//! The passing of time: silence, patience, notices.

use super::*;

#[test]
fn a_worker_whose_second_heartbeat_fails_too_is_lost_within_16_s_and_a_beating_one_is_not() {
    let mut stage = Stage::with(&[1, 1]);
    stage.step(submit(2));
    assert!(!stage.seconds(15, &[1]).contains(&Command::Close { worker: WorkerId(2) }));
    let commands = stage.seconds(1, &[1]);
    assert!(commands.contains(&Command::Close { worker: WorkerId(2) }));
    assert_eq!(sent(&commands).len(), 1, "its job goes to the other worker");
    assert_eq!(stage.dispatcher.n_workers(), 1);
}

#[test]
fn a_coordinator_that_stood_still_does_not_blame_its_workers() {
    let mut stage = Stage::with(&[1]);
    stage.seconds(1, &[1]);
    stage.now += Duration::from_secs(3600);
    stage.step(Event::Tick);
    assert_eq!(stage.dispatcher.n_workers(), 1);
}

#[test]
fn a_setup_that_every_local_worker_fails_ends_the_batch_with_their_words() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    stage.step(Event::LocalOnly);
    stage.step(Event::Joined(joining(1, 1)));
    stage.step(Event::Joined(joining(2, 1)));
    stage.step(submit(3));
    let failed =
        |id| Event::SetupFailed { worker: WorkerId(id), setup: SETUP, reason: "no such model".to_owned() };
    assert_eq!(stage.step(failed(1)).len(), 1, "the other may still build it");
    let commands = stage.step(failed(2));
    let error = BatchError::SetupFailed { reason: "no such model".to_owned() };
    assert!(commands.contains(&Command::BatchFailed(error)));
}

#[test]
fn waiting_without_workers_is_told_and_ends_in_an_error() {
    let mut stage = Stage::with(&[]);
    stage.step(submit(1));
    let notices = |commands: &[Command]| {
        commands.iter().filter(|c| matches!(c, Command::Notice(FleetEvent::Waiting { .. }))).count()
    };
    assert_eq!(notices(&stage.seconds(60, &[])), 5, "after 2, 4, 8, 16 and 32 s");
    let commands = stage.seconds(1, &[]);
    assert!(
        matches!(&commands[..], [Command::BatchFailed(BatchError::NoWorkers { missing, .. })] if missing.contains("no worker"))
    );
}

#[test]
fn patience_starts_anew_after_a_worker_came_and_went() {
    let mut stage = Stage::with(&[]);
    stage.step(submit(1));
    stage.seconds(50, &[]);
    stage.step(Event::Joined(joining(1, 1)));
    stage.step(Event::SetupDone { worker: WorkerId(1), setup: SETUP });
    stage.seconds(1, &[1]);
    stage.step(left(1, true));
    let failed = |commands: Vec<Command>| commands.iter().any(|c| matches!(c, Command::BatchFailed(_)));
    assert!(!failed(stage.seconds(50, &[])));
    assert!(failed(stage.seconds(11, &[])));
}

#[test]
fn one_worker_that_cannot_build_the_setup_does_not_end_a_fleet_that_others_may_join() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    stage.step(Event::Joined(joining(1, 1)));
    stage.step(submit(1));
    let failed = Event::SetupFailed { worker: WorkerId(1), setup: SETUP, reason: "no such model".to_owned() };
    assert!(!stage.step(failed).iter().any(|c| matches!(c, Command::BatchFailed(_))));
    let told = stage.seconds(3, &[1]);
    let why = |c: &Command| matches!(c, Command::Notice(FleetEvent::Waiting { missing, .. }) if missing == "the model cannot be built by w1 (no such model)");
    assert!(told.iter().any(why), "{told:?}");
    let ended = stage.seconds(60, &[1]);
    let error = BatchError::SetupFailed { reason: "no such model".to_owned() };
    assert!(ended.contains(&Command::BatchFailed(error)), "patience ends: {ended:?}");
}

#[test]
fn a_setup_that_is_never_built_counts_as_failed_when_patience_ends() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    stage.step(Event::Joined(joining(1, 1)));
    stage.step(submit(1));
    stage.seconds(1, &[1]);
    let commands = stage.seconds(60, &[1]);
    let reason = "it was not built within 60 s".to_owned();
    let notice = FleetEvent::SetupFailed { worker: "w1".to_owned(), reason: reason.clone() };
    assert!(commands.contains(&Command::Notice(notice)), "{commands:?}");
    stage.seconds(1, &[1]);
    // Late, but built: the next batch uses it.
    stage.step(Event::SetupDone { worker: WorkerId(1), setup: SETUP });
    assert_eq!(stage.jobs(submit(1)).len(), 1);
}

#[test]
fn a_job_that_does_not_come_back_is_named_with_its_worker_at_doubled_times() {
    // At the earliest after 30 s, and after ten times what runs usually take.
    for (usual, first) in [(1.0, 30), (6.0, 60)] {
        let mut stage = Stage::with(&[1, 1]);
        let jobs = stage.jobs(submit(2));
        stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), usual));
        // The first tick sees it running.
        stage.seconds(1, &[1, 2]);
        assert_eq!(waits(&stage.seconds(first - 1, &[1, 2])), [] as [String; 0]);
        let told = waits(&stage.seconds(1, &[1, 2]));
        let expected =
            format!("particle 1, record 0 has not come back from worker w2, runs usually take {usual:.3} s");
        assert_eq!(told, std::slice::from_ref(&expected));
        assert_eq!(waits(&stage.seconds(first - 1, &[1, 2])), [] as [String; 0]);
        assert_eq!(waits(&stage.seconds(1, &[1, 2])), [expected]);
        let done = stage.step(answered(jobs[1].0, LeaseOutcome::Ran(Ok(prediction(1))), 1.0));
        assert!(outcomes(&done).is_some(), "it was not ended");
    }
}

fn waits(commands: &[Command]) -> Vec<String> {
    let told = commands.iter().filter_map(|command| match command {
        Command::Notice(FleetEvent::Waiting { missing, .. }) => Some(missing.clone()),
        _ => None,
    });
    told.collect()
}

/// Seconds until a batch with nothing left to run ends; an error fails.
fn until_done(stage: &mut Stage, most: u64, alive: &[u64]) -> u64 {
    for second in 1..=most {
        let commands = stage.seconds(1, alive);
        assert!(canary::failed_with(&commands).is_none(), "after {second} s: {commands:?}");
        if outcomes(&commands).is_some() {
            return second;
        }
    }
    most
}

#[test]
fn a_batch_whose_runs_are_all_made_does_not_starve_while_they_are_repeated() {
    let mut stage = canary::comparing(&[1, 1], false);
    let [(lease, 0)] = stage.jobs(submit(1))[..] else { panic!("one job") };
    let made = answered(lease, LeaseOutcome::Ran(Ok(prediction(0))), 100.0);
    let [(repeat, 0)] = stage.jobs(made)[..] else { panic!("its repeat") };
    let long = 3 * RULES.patience.as_secs();
    assert_eq!(until_done(&mut stage, long, &[1, 2]), long, "the repeat is waited for");
    assert!(outcomes(&stage.step(ran(repeat, Ok(prediction(0))))).is_some());
}

#[test]
fn a_batch_whose_runs_are_all_made_waits_for_a_slow_setup_as_long_as_patience_lasts() {
    let mut stage = canary::comparing(&[1], false);
    let [(lease, 0)] = stage.jobs(submit(1))[..] else { panic!("one job") };
    stage.step(Event::Joined(joining(2, 1)));
    assert!(outcomes(&stage.step(ran(lease, Ok(prediction(0))))).is_none(), "the other one may compare it");
    let patience = RULES.patience.as_secs();
    assert_eq!(until_done(&mut stage, 2 * patience, &[1, 2]), patience);
}

#[test]
fn a_worker_that_refuses_a_setup_after_patience_ended_is_not_blamed_the_first_time() {
    let worker = |stage: &Stage| {
        let one = stage.dispatcher.workers.get(WorkerId(1)).expect("it is there");
        (one.may_run(&SETUP), one.strays)
    };
    let mut stage = Stage::with(&[]);
    stage.step(submit(1));
    stage.step(Event::Joined(joining(1, 1)));
    stage.seconds(59, &[1]);
    // Another one makes the runs, so that the batch goes on.
    stage.step(Event::Joined(joining(2, 1)));
    stage.step(Event::SetupDone { worker: WorkerId(2), setup: SETUP });
    stage.seconds(2, &[1, 2]);
    assert_eq!(worker(&stage), (false, 0), "it counts as failed");
    let refused =
        || Event::SetupFailed { worker: WorkerId(1), setup: SETUP, reason: "no compiler".to_owned() };
    let told = stage.step(refused());
    assert!(told.iter().any(
        |c| matches!(c, Command::Notice(FleetEvent::SetupFailed { reason, .. }) if reason == "no compiler")
    ));
    assert_eq!(worker(&stage).1, 0);
    stage.step(refused());
    assert_eq!(worker(&stage).1, 1);
}
