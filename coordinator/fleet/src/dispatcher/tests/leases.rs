//! Who gets which job, in which order, how many at a time, and whose answer counts.

use super::*;

#[test]
fn few_jobs_spread_evenly_over_all_slots() {
    let mut stage = Stage::with(&[1, 2, 1]);
    let jobs = stage.jobs(submit(4));
    let count = |epoch| jobs.iter().filter(|(lease, _)| lease.epoch == epoch).count();
    assert_eq!((count(1), count(2), count(3)), (1, 2, 1));
    assert_eq!(jobs.iter().map(|(_, index)| *index).collect::<Vec<_>>(), [0, 1, 2, 3]);
}

#[test]
fn outcomes_come_in_job_order_whatever_the_order_of_answers() {
    let mut stage = Stage::with(&[2, 2]);
    let mut jobs = stage.jobs(submit(4));
    jobs.reverse();
    let mut last = vec![];
    for (lease, index) in jobs {
        last = stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0));
    }
    let outcomes = outcomes(&last).expect("the last answer ends the batch");
    let results = outcomes.iter().map(|o| o.result.clone().unwrap().outputs[0]).collect::<Vec<_>>();
    assert_eq!(results, [0.0, 1.0, 2.0, 3.0]);
    assert!(outcomes.iter().all(|o| o.attempts == 1));
}

#[test]
fn the_load_tells_jobs_without_an_outcome_and_what_every_worker_holds() {
    let mut stage = Stage::with(&[1, 1]);
    let told = |stage: &Stage| {
        let load = stage.dispatcher.load();
        (load.unfinished, load.workers.iter().map(|w| (w.name.clone(), w.slots, w.jobs)).collect::<Vec<_>>())
    };
    let idle = vec![("w1".to_owned(), 1, 0), ("w2".to_owned(), 1, 0)];
    assert_eq!(told(&stage), (0, idle.clone()));
    let jobs = stage.jobs(submit(2));
    assert_eq!(told(&stage), (2, vec![("w1".to_owned(), 1, 1), ("w2".to_owned(), 1, 1)]));
    for (lease, index) in jobs {
        stage.step(answered(lease, LeaseOutcome::Ran(Ok(prediction(index))), 1.0));
    }
    assert_eq!(told(&stage), (0, idle));
}

#[test]
fn long_jobs_are_held_two_per_slot_and_short_ones_sixty_four() {
    let mut stage = Stage::with(&[2]);
    let jobs = stage.jobs(submit(1000));
    assert_eq!(jobs.len(), 4, "two per slot before anything is measured");
    let next = stage.jobs(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 3.0));
    assert_eq!(next.len(), 1, "one answer frees one place");
    let mut stage = Stage::with(&[2]);
    let jobs = stage.jobs(submit(1000));
    stage.jobs(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1e-6));
    assert_eq!(stage.dispatcher.in_flight(WorkerId(1)), 128);
}

#[test]
fn a_setup_is_sent_once_per_worker_and_before_its_jobs() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
    stage.step(Event::Joined(joining(1, 1)));
    let first = stage.step(submit(1));
    assert_eq!(first, [Command::SendSetup { worker: WorkerId(1), setup: SETUP }]);
    let jobs = stage.jobs(Event::SetupDone { worker: WorkerId(1), setup: SETUP });
    assert_eq!(jobs.len(), 1);
    stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    assert_eq!(stage.step(submit(1)).len(), 1, "the second batch needs only its job");
}

#[test]
fn a_late_worker_gets_the_setup_and_then_waiting_jobs() {
    let mut stage = Stage::with(&[1]);
    stage.step(submit(10));
    let commands = stage.step(Event::Joined(joining(2, 1)));
    assert!(commands.contains(&Command::SendSetup { worker: WorkerId(2), setup: SETUP }));
    let jobs = stage.jobs(Event::SetupDone { worker: WorkerId(2), setup: SETUP });
    assert!(!jobs.is_empty() && jobs.iter().all(|(lease, _)| lease.epoch == 2));
}

#[test]
fn late_duplicate_and_foreign_answers_are_ignored() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(2));
    let (lease, _) = jobs[0];
    let late = |commands: Vec<Command>| matches!(commands.as_slice(), [Command::Notice(FleetEvent::LateAnswer { job, .. })] if *job == lease.job);
    let ok = || LeaseOutcome::Ran(Ok(prediction(9)));
    assert!(late(stage.step(answered(Lease { attempt: 2, ..lease }, ok(), 1.0))), "an attempt never started");
    let past = Lease { epoch: 99, ..lease };
    let from_past = Event::Answered { worker: WorkerId(lease.epoch), lease: past, answer: ok(), cost: 1.0 };
    assert!(late(stage.step(from_past)), "a lease of an earlier stream, on this one");
    let foreign = Event::Answered { worker: WorkerId(jobs[1].0.epoch), lease, answer: ok(), cost: 1.0 };
    assert!(late(stage.step(foreign)), "another stream's lease");
    assert!(!late(stage.step(answered(lease, ok(), 1.0))), "the lease itself");
    assert!(late(stage.step(answered(lease, ok(), 1.0))), "the same answer twice");
    assert_eq!(stage.step(answered(Lease { epoch: 77, ..lease }, ok(), 1.0)), [], "a stream that is gone");
}

#[test]
fn an_aborted_batch_calls_its_jobs_back_and_their_answers_only_free_the_slots() {
    let mut stage = Stage::with(&[1]);
    let jobs = stage.jobs(submit(5));
    let commands = stage.step(Event::Abort(BatchError::Cancelled));
    let leases = jobs.iter().map(|(lease, _)| *lease).collect();
    assert_eq!(
        commands,
        [
            Command::Cancel { worker: WorkerId(1), leases, stop: true },
            Command::BatchFailed(BatchError::Cancelled)
        ]
    );
    assert_eq!(stage.jobs(submit(5)), [], "both places are still held by withdrawn jobs");
    stage.step(answered(jobs[0].0, LeaseOutcome::Ran(Ok(prediction(0))), 1.0));
    stage.step(answered(jobs[1].0, LeaseOutcome::Withdrawn, 0.0));
    assert_eq!(stage.dispatcher.in_flight(WorkerId(1)), 2, "two jobs of the new batch");
}

#[test]
fn an_empty_batch_is_done_at_once() {
    let mut stage = Stage::with(&[]);
    assert_eq!(stage.step(submit(0)), [Command::BatchDone(vec![])]);
}

#[test]
fn outcomes_are_handed_on_once_while_the_batch_goes_on_and_the_rest_when_it_fails() {
    let mut stage = Stage::with(&[4]);
    let jobs = stage.jobs(submit(4));
    let places = |stage: &mut Stage| {
        let arrived = stage.dispatcher.arrived();
        arrived
            .into_iter()
            .map(|(index, outcome)| (index, outcome.result.unwrap().outputs[0]))
            .collect::<Vec<_>>()
    };
    assert_eq!(places(&mut stage), []);
    for at in [2, 0] {
        stage.step(answered(jobs[at].0, LeaseOutcome::Ran(Ok(prediction(at))), 1.0));
    }
    assert_eq!(places(&mut stage), [(2, 2.0), (0, 0.0)]);
    assert_eq!(places(&mut stage), []);
    stage.step(answered(jobs[1].0, LeaseOutcome::Ran(Ok(prediction(1))), 1.0));
    stage.step(Event::Abort(BatchError::Cancelled));
    assert_eq!(places(&mut stage), [(1, 1.0)]);
    assert_eq!(places(&mut stage), []);
}
