//! Slow jobs given to another worker, hoarders, and answers that nobody asked for.

use super::*;

/// Many short runs on the first of two workers, so that the usual time is known.
fn warm(slots: &[u32], seconds: f64) -> Stage {
    let mut stage = Stage::with(slots);
    let mut open = stage.jobs(submit(20));
    while let Some((lease, index)) = open.pop() {
        open.extend(stage.jobs(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), seconds)));
    }
    stage
}

#[test]
fn a_slow_job_is_given_to_an_idle_worker_too_and_the_first_result_wins() {
    let mut stage = warm(&[1, 1], 1.0);
    let jobs = stage.jobs(submit(2));
    let slow = jobs[0];
    stage.step(ran(jobs[1].0, Ok(prediction(1))));
    assert_eq!(sent(&stage.seconds(4, &[1, 2])), [], "four times the usual time");
    let commands = stage.seconds(1, &[1, 2]);
    let [(other, 0)] = sent(&commands)[..] else { panic!("{commands:?}") };
    assert_ne!(other.epoch, slow.0.epoch);
    let told =
        commands.iter().any(|c| matches!(c, Command::Notice(FleetEvent::JobDuplicated { particle: 0, .. })));
    assert!(told, "{commands:?}");
    let done = stage.step(ran(other, Ok(prediction(0))));
    let stopped = Command::Cancel { worker: WorkerId(slow.0.epoch), leases: vec![slow.0], stop: true };
    assert!(done.contains(&stopped), "{done:?}");
    assert_eq!(outcomes(&done).expect("both ended")[0].result, Ok(prediction(0)));
    // Its slot is free again when it says so.
    assert_eq!(stage.dispatcher.in_flight(WorkerId(slow.0.epoch)), 1);
    stage.step(answered(slow.0, LeaseOutcome::Withdrawn, 0.0));
    assert_eq!(stage.dispatcher.in_flight(WorkerId(slow.0.epoch)), 0);
}

#[test]
fn what_fails_on_one_of_two_workers_that_have_a_job_is_decided_by_the_other() {
    for failure in [solver("no"), crash("signal 11"), place("disk full")] {
        let mut stage = warm(&[1, 1], 1.0);
        let jobs = stage.jobs(submit(2));
        stage.step(ran(jobs[1].0, Ok(prediction(1))));
        let other = sent(&stage.seconds(5, &[1, 2]))[0].0;
        let commands = stage.step(ran(other, Err(failure)));
        assert!(sent(&commands).is_empty() && outcomes(&commands).is_none(), "{commands:?}");
        let done = stage.step(ran(jobs[0].0, Ok(prediction(0))));
        assert_eq!(outcomes(&done).expect("both ended")[0].result, Ok(prediction(0)));
    }
}

#[test]
fn a_job_whose_one_worker_is_lost_stays_with_the_other() {
    let mut stage = warm(&[1, 1], 1.0);
    let jobs = stage.jobs(submit(2));
    stage.step(ran(jobs[1].0, Ok(prediction(1))));
    let other = sent(&stage.seconds(5, &[1, 2]))[0].0;
    let commands = stage.step(left(jobs[0].0.epoch, false));
    assert!(sent(&commands).is_empty(), "{commands:?}");
    let done = stage.step(ran(other, Ok(prediction(0))));
    assert_eq!(outcomes(&done).expect("both ended")[0].result, Ok(prediction(0)));
}

#[test]
fn a_worker_of_4096_slots_that_only_beats_does_not_hold_a_batch_and_is_set_aside() {
    let mut stage = Stage::with(&[4096, 1]);
    let mut open = stage.jobs(submit(600));
    assert!(stage.dispatcher.in_flight(WorkerId(1)) <= 512, "one that has answered nothing holds little");
    let (mut done, mut aside) = (false, false);
    for _ in 0..1000 {
        for (lease, index) in std::mem::take(&mut open) {
            if lease.epoch == 2 {
                let commands = stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 0.1));
                done |= outcomes(&commands).is_some();
                open.extend(sent(&commands));
            }
        }
        let commands = stage.seconds(1, &[1, 2]);
        open.extend(sent(&commands));
        aside |= commands.iter().any(
            |c| matches!(c, Command::Notice(FleetEvent::WorkerSetAside { worker, .. }) if worker == "w1"),
        );
        if done {
            break;
        }
    }
    assert!(done, "the other one made all");
    // The next batch does not wait for it at all.
    let next = stage.jobs(submit(5));
    assert!(next.iter().all(|(lease, _)| lease.epoch == 2), "{next:?} {aside}");
}

#[test]
fn a_worker_that_gives_everything_back_or_answers_what_it_was_not_asked_is_put_out() {
    let mut stage = Stage::with(&[1]);
    let mut open = stage.jobs(submit(3));
    let mut given_back = 0;
    while let Some((lease, _)) = open.pop() {
        let commands = stage.step(answered(lease, LeaseOutcome::Withdrawn, 0.0));
        given_back += 1;
        assert!(given_back < 1000, "for ever");
        open.extend(sent(&commands));
    }
    assert!((100..110).contains(&given_back) && stage.dispatcher.n_workers() == 0, "{given_back}");

    let mut stage = Stage::with(&[1]);
    let foreign = |job| answered(Lease { epoch: 1, job, attempt: 1 }, LeaseOutcome::Withdrawn, 0.0);
    let out = (1000..2000).find(|job| {
        stage.step(foreign(*job)).iter().any(|c| matches!(c, Command::PutOut { worker: WorkerId(1), .. }))
    });
    assert_eq!(out, Some(1100));
}

#[test]
fn a_run_of_many_times_the_usual_time_is_given_up_where_that_is_asked_for_and_tried_once_more_elsewhere() {
    let mut stage = warm(&[1, 1], 1.0);
    stage.dispatcher.rules.timeout_factor = Some(3.0);
    let jobs = stage.jobs(submit(2));
    stage.step(ran(jobs[1].0, Ok(prediction(1))));
    let first = jobs[0].0;
    let commands = stage.seconds(5, &[1, 2]);
    let stopped = Command::Cancel { worker: WorkerId(first.epoch), leases: vec![first], stop: true };
    assert!(commands.contains(&stopped), "{commands:?}");
    let [(again, 0)] = sent(&commands)[..] else { panic!("{commands:?}") };
    assert_ne!(again.epoch, first.epoch);
    // What the first one says now does not matter, and frees its slot.
    assert_eq!(stage.step(answered(first, LeaseOutcome::Withdrawn, 0.0)), []);
    let done = stage.seconds(6, &[1, 2]);
    let outcome = &outcomes(&done).expect("both ended")[0];
    let Err(starlings_models::Failure::Timeout(timeout)) = &outcome.result else { panic!("{outcome:?}") };
    assert!((timeout.limit - 3.0).abs() < 1e-9 && timeout.says.contains("timeout_factor"), "{timeout:?}");
    // Without the factor nobody gives it up.
    let mut stage = warm(&[1], 1.0);
    stage.step(submit(1));
    assert!(outcomes(&stage.seconds(60, &[1])).is_none());
}

#[test]
fn a_worker_that_fails_setups_without_end_is_put_out_and_told_of_once() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    stage.step(Event::Joined(joining(1, 1)));
    stage.step(submit(1));
    let failed = |n: u32| Event::SetupFailed { worker: WorkerId(1), setup: SETUP, reason: format!("no {n}") };
    let commands = (0..3000).flat_map(|n| stage.step(failed(n))).collect::<Vec<_>>();
    let told =
        commands.iter().filter(|c| matches!(c, Command::Notice(FleetEvent::SetupFailed { .. }))).count();
    assert_eq!(told, 1);
    assert!(commands.iter().any(|c| matches!(c, Command::PutOut { worker: WorkerId(1), .. })));
}

#[test]
fn a_worker_that_names_setups_nobody_knows_is_put_out_before_they_fill_the_memory() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    stage.step(Event::Joined(joining(1, 1)));
    let out = (0..5000_u32).position(|n| {
        let mut setup = [0; 32];
        setup[..4].copy_from_slice(&n.to_le_bytes());
        let commands = stage.step(Event::SetupDone { worker: WorkerId(1), setup });
        commands.iter().any(|c| matches!(c, Command::PutOut { .. }))
    });
    assert_eq!(out, Some(1024 + 100));
}
