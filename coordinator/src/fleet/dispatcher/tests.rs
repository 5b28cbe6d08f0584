//! Events in, commands compared.

mod chaos;

use std::time::Duration;

use starlings_models::{ParticleError, Prediction};
use starlings_proto::{Answer, Lease, SetupId};

use super::batch::JobName;
use super::{BatchError, Command, Dispatcher, Event, Joining, Rules, WorkerId};
use crate::fleet::{FleetEvent, Outcome};

const SETUP: SetupId = [7; 32];

const RULES: Rules =
    Rules { heartbeat: Duration::from_secs(8), patience: Duration::from_secs(60), max_attempts: 3 };

fn joining(id: u64, slots: u32) -> Joining {
    Joining {
        id: WorkerId(id),
        name: format!("w{id}"),
        host: "here".to_owned(),
        pid: id as u32,
        slots,
        cores: slots,
        nonce: id,
        build: None,
    }
}

fn names(n: u32) -> Vec<JobName> {
    (0..n).map(|particle| JobName { particle, record: 0 }).collect()
}

fn submit(n: u32) -> Event {
    Event::Submit { setup: SETUP, jobs: names(n) }
}

fn prediction(index: usize) -> Prediction {
    Prediction { outputs: vec![index as f64], state: vec![], cost: 0.0 }
}

fn answered(lease: Lease, answer: Answer, cost: f64) -> Event {
    Event::Answered { worker: WorkerId(lease.epoch), lease, answer, cost }
}

fn left(id: u64, clean: bool) -> Event {
    Event::Left { worker: WorkerId(id), reason: "gone".to_owned(), clean }
}

/// A dispatcher with its clock.
struct Stage {
    dispatcher: Dispatcher,
    now: Duration,
}

impl Stage {
    /// Workers 1.. with these slots, the setup built, nothing submitted.
    fn with(slots: &[u32]) -> Self {
        let mut stage = Self { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
        for (i, &slots) in slots.iter().enumerate() {
            let worker = i as u64 + 1;
            stage.step(Event::Joined(joining(worker, slots)));
            stage.step(Event::SetupDone { worker: WorkerId(worker), setup: SETUP });
        }
        stage
    }

    fn step(&mut self, event: Event) -> Vec<Command> {
        self.dispatcher.step(self.now, event)
    }

    fn jobs(&mut self, event: Event) -> Vec<(Lease, usize)> {
        sent(&self.step(event))
    }

    /// Ticks once a second, as heartbeats arrive from `alive`.
    fn seconds(&mut self, n: u64, alive: &[u64]) -> Vec<Command> {
        let mut commands = vec![];
        for _ in 0..n {
            self.now += Duration::from_secs(1);
            for &id in alive {
                commands.extend(self.step(Event::Heard { worker: WorkerId(id) }));
            }
            commands.extend(self.step(Event::Tick));
        }
        commands
    }
}

fn sent(commands: &[Command]) -> Vec<(Lease, usize)> {
    let jobs = commands.iter().filter_map(|command| match command {
        Command::SendJob { lease, index, .. } => Some((*lease, *index)),
        _ => None,
    });
    jobs.collect()
}

fn outcomes(commands: &[Command]) -> Option<&[Outcome]> {
    commands.iter().find_map(|command| match command {
        Command::BatchDone(outcomes) => Some(outcomes.as_slice()),
        _ => None,
    })
}

fn solver(text: &str) -> ParticleError {
    ParticleError::Solver(text.to_owned())
}

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
        last = stage.step(answered(lease, Answer::Ran(Ok(prediction(index))), 1.0));
    }
    let outcomes = outcomes(&last).expect("the last answer ends the batch");
    let results = outcomes.iter().map(|o| o.result.clone().unwrap().outputs[0]).collect::<Vec<_>>();
    assert_eq!(results, [0.0, 1.0, 2.0, 3.0]);
    assert!(outcomes.iter().all(|o| o.attempts == 1));
}

#[test]
fn long_jobs_are_held_two_per_slot_and_short_ones_sixty_four() {
    let mut stage = Stage::with(&[2]);
    let jobs = stage.jobs(submit(1000));
    assert_eq!(jobs.len(), 4, "two per slot before anything is measured");
    let next = stage.jobs(answered(jobs[0].0, Answer::Ran(Ok(prediction(0))), 3.0));
    assert_eq!(next.len(), 1, "one answer frees one place");
    let mut stage = Stage::with(&[2]);
    let jobs = stage.jobs(submit(1000));
    stage.jobs(answered(jobs[0].0, Answer::Ran(Ok(prediction(0))), 1e-6));
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
    stage.step(answered(jobs[0].0, Answer::Ran(Ok(prediction(0))), 1.0));
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
        open.extend(stage.jobs(answered(lease, Answer::Ran(Ok(prediction(index))), 1.0)));
    }
    assert_eq!(done, 4);
}

#[test]
fn only_the_jobs_that_were_running_count_an_attempt_when_their_worker_dies() {
    let mut stage = Stage::with(&[1]);
    let mut last = stage.step(submit(2));
    for id in 2..=4 {
        // Job 0 runs and kills each worker in turn; job 1 only waits behind it.
        let first = sent(&last).first().map(|(_, index)| *index);
        assert_eq!(first, Some(0), "the requeued job is first again");
        let died = stage.step(left(id - 1, false));
        if id == 4 {
            let failed = died.iter().any(|c| {
                matches!(c, Command::Notice(FleetEvent::JobFailed { particle: 0, attempts: 3, .. }))
            });
            assert!(failed, "{died:?}");
        }
        stage.step(Event::Joined(joining(id, 1)));
        last = stage.step(Event::SetupDone { worker: WorkerId(id), setup: SETUP });
    }
    let jobs = sent(&last);
    assert_eq!(jobs.len(), 1);
    let last = stage.step(answered(jobs[0].0, Answer::Ran(Ok(prediction(1))), 1.0));
    let outcomes = outcomes(&last).expect("both jobs ended");
    assert!(matches!(&outcomes[0].result, Err(ParticleError::Lost { attempts: 3, .. })));
    assert_eq!((outcomes[1].attempts, outcomes[1].result.is_ok()), (1, true));
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
    let done = stage.step(answered(last[0].0, Answer::Ran(Ok(prediction(0))), 1.0));
    assert_eq!(outcomes(&done).expect("done")[0].attempts, 1);
}

#[test]
fn a_model_failure_is_tried_once_more_on_another_worker() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(1));
    let again = stage.jobs(answered(jobs[0].0, Answer::Ran(Err(solver("no"))), 1.0));
    assert_eq!(again.len(), 1);
    assert_ne!(again[0].0.epoch, jobs[0].0.epoch);
    let done = stage.step(answered(again[0].0, Answer::Ran(Err(solver("no, again"))), 1.0));
    let outcome = &outcomes(&done).expect("a second failure ends it")[0];
    assert_eq!((outcome.result.clone(), outcome.attempts), (Err(solver("no, again")), 2));
}

#[test]
fn a_model_failure_on_the_only_worker_ends_at_once() {
    let mut stage = Stage::with(&[4]);
    let jobs = stage.jobs(submit(1));
    let done = stage.step(answered(jobs[0].0, Answer::Ran(Err(solver("no"))), 1.0));
    assert_eq!(outcomes(&done).expect("ended")[0].result, Err(solver("no")));
}

#[test]
fn a_failed_job_does_not_wait_for_another_worker_that_left() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(20));
    let on_first = jobs.iter().find(|(lease, _)| lease.epoch == 1).expect("spread").0;
    // The second worker is full, so the failed job waits for it; then it dies.
    assert!(
        stage.jobs(answered(on_first, Answer::Ran(Err(solver("no"))), 1.0)).iter().all(|(l, _)| l.epoch == 1)
    );
    let commands = stage.step(left(2, false));
    assert!(commands.iter().any(|c| matches!(c, Command::Notice(FleetEvent::JobFailed { attempts: 1, .. }))));
}

#[test]
fn late_duplicate_and_foreign_answers_are_ignored() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(2));
    let (lease, _) = jobs[0];
    let late = |commands: Vec<Command>| matches!(commands.as_slice(), [Command::Notice(FleetEvent::LateAnswer { job, .. })] if *job == lease.job);
    let ok = || Answer::Ran(Ok(prediction(9)));
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
fn a_worker_silent_for_two_heartbeats_is_lost_and_a_beating_one_is_not() {
    let mut stage = Stage::with(&[1, 1]);
    stage.step(submit(2));
    assert!(!stage.seconds(16, &[1]).contains(&Command::Close { worker: WorkerId(2) }));
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
fn a_setup_that_every_worker_fails_ends_the_batch_with_their_words() {
    let mut stage = Stage { dispatcher: Dispatcher::new(RULES), now: Duration::ZERO };
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
fn an_aborted_batch_calls_its_jobs_back_and_their_answers_only_free_the_slots() {
    let mut stage = Stage::with(&[1]);
    let jobs = stage.jobs(submit(5));
    let commands = stage.step(Event::Abort(BatchError::Cancelled));
    let leases = jobs.iter().map(|(lease, _)| *lease).collect();
    assert_eq!(
        commands,
        [Command::Cancel { worker: WorkerId(1), leases }, Command::BatchFailed(BatchError::Cancelled)]
    );
    assert_eq!(stage.jobs(submit(5)), [], "both places are still held by withdrawn jobs");
    stage.step(answered(jobs[0].0, Answer::Ran(Ok(prediction(0))), 1.0));
    stage.step(answered(jobs[1].0, Answer::Withdrawn, 0.0));
    assert_eq!(stage.dispatcher.in_flight(WorkerId(1)), 2, "two jobs of the new batch");
}

#[test]
fn a_job_waiting_behind_a_long_one_is_called_back_for_an_idle_slot() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(3));
    let idle = jobs[1].0;
    assert_ne!(idle.epoch, jobs[0].0.epoch);
    let commands = stage.step(answered(idle, Answer::Ran(Ok(prediction(1))), 1.0));
    let waiting = jobs[2].0;
    assert_eq!(commands, [Command::Cancel { worker: WorkerId(waiting.epoch), leases: vec![waiting] }]);
    let moved = stage.jobs(answered(waiting, Answer::Withdrawn, 0.0));
    assert_eq!(moved.len(), 1);
    assert_eq!((moved[0].0.epoch, moved[0].0.attempt), (idle.epoch, 2));
    let done = stage.step(answered(moved[0].0, Answer::Ran(Ok(prediction(2))), 1.0));
    assert!(outcomes(&done).is_none());
    let done = stage.step(answered(jobs[0].0, Answer::Ran(Ok(prediction(0))), 1.0));
    assert_eq!(outcomes(&done).expect("done")[2].attempts, 1, "a move is no attempt");
}

#[test]
fn a_job_is_called_back_only_once() {
    let mut stage = Stage::with(&[1, 1]);
    let jobs = stage.jobs(submit(2));
    // The job that failed on one worker waits behind the other's long one, and may not go where it failed.
    let commands = stage.step(answered(jobs[0].0, Answer::Ran(Err(solver("no"))), 1.0));
    let waiting = sent(&commands)[0].0;
    assert!(commands.contains(&Command::Cancel { worker: WorkerId(waiting.epoch), leases: vec![waiting] }));
    let again = stage.step(answered(waiting, Answer::Withdrawn, 0.0));
    assert_eq!(sent(&again).len(), 1);
    assert_eq!(again.len(), 1, "it stays there now");
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
fn an_empty_batch_is_done_at_once() {
    let mut stage = Stage::with(&[]);
    assert_eq!(stage.step(submit(0)), [Command::BatchDone(vec![])]);
}
