//! Jobs that wait behind a busy slot while another slot is idle.

use super::*;

#[test]
fn a_job_waiting_behind_a_long_one_is_called_back_for_an_idle_slot() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(3));
    let idle = jobs[1].0;
    assert_ne!(idle.epoch, jobs[0].0.epoch);
    let commands = stage.step(answered(idle, LeaseOutcome::Ran(Ok(prediction(1))), 1.0));
    let waiting = jobs[2].0;
    let kept = Command::Keep { control: ControlId(1), index: 1 };
    assert_eq!(
        commands,
        [kept, Command::Cancel { worker: WorkerId(waiting.epoch), leases: vec![waiting], stop: false }]
    );
    let moved = stage.jobs(answered(waiting, LeaseOutcome::Withdrawn, 0.0));
    assert_eq!(moved.len(), 1);
    assert_eq!((moved[0].0.epoch, moved[0].0.attempt), (idle.epoch, 2));
    let done = stage.step(answered(moved[0].0, LeaseOutcome::Ran(Ok(prediction(2))), 1.0));
    assert!(outcomes(&done).is_none());
    let done = stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    assert_eq!(outcomes(&done).expect("done")[2].attempts, 1, "a move is no attempt");
}

#[test]
fn a_job_is_called_back_only_once() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(2));
    // The job that failed on one worker waits behind the other's long one, and may not go where it failed.
    let commands = stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Err(solver("no"))), 1.0));
    let waiting = sent(&commands)[0].0;
    assert!(commands.contains(&Command::Cancel {
        worker: WorkerId(waiting.epoch),
        leases: vec![waiting],
        stop: false
    }));
    let retried = stage.step(answered(waiting, LeaseOutcome::Withdrawn, 0.0));
    assert_eq!(sent(&retried).len(), 1);
    assert_eq!(retried.len(), 1, "it stays there now");
}

#[test]
fn a_worker_whose_waiting_job_was_called_back_before_hides_no_other() {
    let mut stage = Stage::with(&[1, 1, 1]);
    let jobs = stage.jobs(submit(6));
    let of = |worker: u64| {
        jobs.iter().filter(move |(lease, _)| lease.epoch == worker).copied().collect::<Vec<_>>()
    };
    let mut last = vec![];
    for (lease, index) in of(3) {
        last = stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0));
    }
    // The third is idle: the second's waiting job is called back, but the second dies. Both its jobs go to the third.
    assert_eq!(last, [Command::Cancel { worker: WorkerId(2), leases: vec![of(2)[1].0], stop: false }]);
    let moved = stage.jobs(left(2, false));
    assert_eq!(moved.iter().map(|(lease, _)| lease.epoch).collect::<Vec<_>>(), [3, 3]);
    stage.step(Event::Joined(joining(4, 1)));
    let commands = stage.step(Event::SetupDone { worker: WorkerId(4), setup: SETUP });
    assert_eq!(commands, [Command::Cancel { worker: WorkerId(1), leases: vec![of(1)[1].0], stop: false }]);
}

#[test]
fn a_job_called_back_too_late_leaves_the_idle_slot_to_another() {
    let mut stage = Stage::with(&[1, 1, 1]);
    let jobs = stage.jobs(submit(6));
    let of = |worker: u64| {
        jobs.iter().filter(move |(lease, _)| lease.epoch == worker).copied().collect::<Vec<_>>()
    };
    let mut last = vec![];
    for (lease, index) in of(1) {
        last = stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0));
    }
    assert_eq!(last, [Command::Cancel { worker: WorkerId(3), leases: vec![of(3)[1].0], stop: false }]);
    // Before that message arrives, the job has started: the first worker is still idle.
    let (lease, index) = of(3)[0];
    let commands = stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0));
    assert_eq!(commands, [Command::Cancel { worker: WorkerId(2), leases: vec![of(2)[1].0], stop: false }]);
}
