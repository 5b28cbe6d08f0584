//! Batches whose jobs need different setups.

use super::*;

fn done(worker: u64, i: u8) -> Event {
    Event::SetupDone { worker: WorkerId(worker), setup: setup(i) }
}

fn failed(worker: u64, i: u8, reason: &str) -> Event {
    Event::SetupFailed { worker: WorkerId(worker), setup: setup(i), reason: reason.to_owned() }
}

fn setups_sent(commands: &[Command]) -> Vec<(u64, u8)> {
    let sent = commands.iter().filter_map(|command| match command {
        Command::SendSetup { worker, setup } => Some((worker.0, setup[0])),
        _ => None,
    });
    sent.collect()
}

fn empty(slots: &[u32]) -> Stage {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    for (i, &slots) in slots.iter().enumerate() {
        stage.step(Event::Joined(joining(i as u64 + 1, slots)));
    }
    stage
}

#[test]
fn all_setups_of_a_batch_are_sent_at_once_each_once() {
    let mut stage = empty(&[1, 1]);
    let commands = stage.step(submit_mixed(&[3, 1, 3, 2, 1]));
    assert_eq!(setups_sent(&commands), [(1, 3), (1, 1), (1, 2), (2, 3), (2, 1), (2, 2)]);
    assert_eq!(commands.len(), 6, "no job yet");
}

#[test]
fn a_job_starts_as_soon_as_its_own_setup_is_built() {
    let mut stage = empty(&[1]);
    stage.step(submit_mixed(&[1, 2, 2, 1]));
    let jobs = stage.jobs(done(1, 2));
    assert_eq!(jobs.iter().map(|(_, index)| *index).collect::<Vec<_>>(), [1, 2], "those of the built setup");
    assert_eq!(stage.jobs(done(1, 1)), [], "both places are taken");
    let next = stage.jobs(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(1))), 1.0));
    assert_eq!(next.iter().map(|(_, index)| *index).collect::<Vec<_>>(), [0], "the earliest job");
}

#[test]
fn a_job_goes_only_to_a_worker_that_has_its_setup() {
    let mut stage = empty(&[1, 1]);
    stage.step(submit_mixed(&[1, 2, 1, 2]));
    let first = stage.jobs(done(1, 1));
    assert!(first.iter().all(|(lease, index)| lease.epoch == 1 && index % 2 == 0), "{first:?}");
    let second = stage.jobs(done(2, 2));
    assert!(second.iter().all(|(lease, index)| lease.epoch == 2 && index % 2 == 1), "{second:?}");
    assert_eq!((first.len(), second.len()), (2, 2));
}

#[test]
fn a_waiting_job_is_not_called_back_for_an_idle_slot_without_its_setup() {
    let mut stage = empty(&[1, 1]);
    stage.step(submit_mixed(&[1, 1, 2]));
    assert_eq!(stage.jobs(done(1, 1)).len(), 2);
    let commands = stage.step(done(2, 2));
    assert_eq!(sent(&commands).len(), 1);
    let job = sent(&commands)[0].0;
    let commands = stage.step(answered(job, LeaseOutcome::Ran(Ok(prediction(2))), 1.0));
    let kept = Command::Keep { control: ControlId(1), index: 2 };
    assert_eq!(commands, [kept], "the idle worker could not run it");
    let commands = stage.step(done(2, 1));
    assert!(matches!(&commands[..], [Command::Cancel { worker: WorkerId(1), .. }]), "{commands:?}");
}

#[test]
fn a_setup_that_no_local_worker_builds_ends_the_whole_batch_with_its_words() {
    let mut stage = empty(&[1, 1]);
    stage.step(Event::LocalOnly);
    stage.step(submit_mixed(&[1, 2]));
    stage.step(done(1, 1));
    stage.step(failed(1, 2, "no legs"));
    let commands = stage.step(failed(2, 2, "no legs"));
    let error = BatchError::SetupFailed { reason: "no legs".to_owned() };
    assert!(commands.contains(&Command::BatchFailed(error)), "{commands:?}");
    assert!(commands.iter().any(|c| matches!(c, Command::Cancel { .. })), "the running job is withdrawn");
}

#[test]
fn a_setup_that_failed_matters_no_more_once_its_jobs_are_done() {
    let mut stage = empty(&[1]);
    stage.step(Event::LocalOnly);
    stage.step(submit_mixed(&[1, 2]));
    let jobs = stage.jobs(done(1, 1));
    stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    stage.step(Event::Joined(joining(2, 1)));
    let jobs = stage.jobs(done(2, 2));
    assert_eq!(jobs.len(), 1, "a late worker is sent only what is still needed, and runs it");
    assert_eq!(stage.step(failed(1, 2, "no legs")).len(), 1, "only told: the other one has it");
}

#[test]
fn a_batch_that_waits_for_one_setup_says_which_worker_cannot_build_it_and_ends_with_patience() {
    let mut stage = empty(&[1]);
    stage.step(submit_mixed(&[1, 2]));
    let jobs = stage.jobs(done(1, 1));
    stage.step(failed(1, 2, "no legs"));
    assert!(
        !stage.seconds(70, &[1]).iter().any(|c| matches!(c, Command::BatchFailed(_))),
        "a job is still being computed"
    );
    stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    let told = stage.seconds(3, &[1]);
    let why = |c: &Command| matches!(c, Command::Notice(FleetEvent::Waiting { missing, .. }) if missing == "the model cannot be built by w1 (no legs)");
    assert!(told.iter().any(why), "{told:?}");
    let error = BatchError::SetupFailed { reason: "no legs".to_owned() };
    assert!(stage.seconds(60, &[1]).contains(&Command::BatchFailed(error)));
}

#[test]
fn setups_that_wait_behind_others_are_not_blamed_for_them() {
    let mut stage = empty(&[1]);
    stage.step(submit_mixed(&[1, 2, 3]));
    stage.seconds(50, &[1]);
    let jobs = stage.jobs(done(1, 1));
    let later = stage.seconds(50, &[1]);
    assert!(!later.iter().any(|c| matches!(c, Command::Notice(FleetEvent::SetupFailed { .. }))), "{later:?}");
    stage.step(done(1, 2));
    stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    let late = stage.seconds(60, &[1]);
    assert!(late.iter().any(|c| matches!(c, Command::Notice(FleetEvent::SetupFailed { .. }))), "{late:?}");
}

#[test]
fn a_worker_that_forgot_a_setup_is_sent_it_again_and_loses_no_job() {
    let mut stage = empty(&[1]);
    stage.step(submit_mixed(&[1, 1, 1]));
    let jobs = stage.jobs(done(1, 1));
    assert_eq!(setups_sent(&stage.step(failed(1, 1, "it is forgotten"))), [(1, 1)]);
    for (lease, _) in &jobs {
        assert_eq!(
            stage.jobs(answered(*lease, LeaseOutcome::Withdrawn, 0.0)),
            [],
            "not before it is built again"
        );
    }
    let mut jobs = stage.jobs(done(1, 1));
    let mut last = vec![];
    while let Some((lease, index)) = jobs.pop() {
        last = stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0));
        jobs.extend(sent(&last));
    }
    let attempts = outcomes(&last).expect("done").iter().map(|o| o.attempts).collect::<Vec<_>>();
    assert_eq!(attempts, [1, 1, 1], "a job that was not started is no attempt");
}

#[test]
fn a_failed_job_goes_to_another_worker_only_if_that_may_have_its_setup() {
    let mut stage = empty(&[1, 1]);
    stage.step(submit_mixed(&[1, 2]));
    stage.step(failed(2, 1, "no legs"));
    let jobs = stage.jobs(done(1, 1));
    let commands = stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Err(solver("no"))), 1.0));
    assert!(commands.iter().any(|c| matches!(c, Command::GivenUp { .. })), "{commands:?}");
}
