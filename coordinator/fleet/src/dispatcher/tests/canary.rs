//! Results of workers compared: who is asked, who is put out, what is made again.

use super::*;
use crate::dispatcher::{Comparing, Likeness};

/// Workers with results that are compared.
pub(super) fn comparing(slots: &[u32], mixed: bool) -> Stage {
    let mut stage = Stage::with(&[]);
    stage.dispatcher = Dispatcher::new(Rules { comparing: Some(Comparing { seed: 7, mixed }), ..RULES });
    for (i, &slots) in slots.iter().enumerate() {
        stage.step(Event::Joined(joining(i as u64 + 1, slots)));
        stage.step(Event::SetupDone { worker: WorkerId(i as u64 + 1), setup: SETUP });
    }
    stage
}

/// The right answer times a factor.
pub(super) fn scaled(index: usize, factor: f64) -> Prediction {
    Prediction { outputs: vec![(index as f64 + 1.0) * factor], state: vec![].into(), cost: 0.0 }
}

/// Answers all leases, the oldest first, as `answer` says of the worker, the job and how many it answered before; gives all
/// commands until the batch ends.
fn played(
    stage: &mut Stage,
    first: Vec<Command>,
    mut answer: impl FnMut(u64, usize, usize) -> Result<Prediction, ParticleError>,
) -> Vec<Command> {
    let mut open = std::collections::VecDeque::from(sent(&first));
    let mut all = first;
    let mut given = std::collections::BTreeMap::<u64, usize>::new();
    while let Some((lease, index)) = open.pop_front() {
        let n = given.entry(lease.epoch).or_default();
        let commands = stage.step(ran(lease, answer(lease.epoch, index, *n)));
        *n += 1;
        open.extend(sent(&commands));
        all.extend(commands);
    }
    all
}

/// Answers all leases after so many seconds each; the leases beyond the jobs.
fn played_at(stage: &mut Stage, first: &[Command], n: usize, seconds: f64) -> usize {
    let mut open = std::collections::VecDeque::from(sent(first));
    let mut n_lease = 0;
    while let Some((lease, index)) = open.pop_front() {
        n_lease += 1;
        let ran = LeaseOutcome::Ran(Ok(scaled(index, 1.0)));
        open.extend(sent(&stage.step(answered(lease, ran, seconds))));
    }
    n_lease - n
}

#[test]
fn many_short_runs_do_not_pay_for_the_repeats_of_long_ones() {
    let mut stage = comparing(&[1, 1], false);
    let short = stage.step(submit(20_000));
    assert!(played_at(&mut stage, &short, 20_000, 1e-6) > 100, "short runs are repeated");
    // Each setup is new, and the first run of a new one is repeated where that can be paid.
    for i in 0..200 {
        stage.step(Event::SetupDone { worker: WorkerId(1), setup: setup(i) });
        stage.step(Event::SetupDone { worker: WorkerId(2), setup: setup(i) });
    }
    let setups: Vec<u8> = (0..200).collect();
    let long = stage.step(submit_mixed(&setups));
    assert!(played_at(&mut stage, &long, 200, 0.01) < 5);
}

pub(super) fn put_out(commands: &[Command]) -> Vec<u64> {
    let out = commands.iter().filter_map(|command| match command {
        Command::PutOut { worker, .. } => Some(worker.0),
        _ => None,
    });
    out.collect()
}

pub(super) fn failed_with(commands: &[Command]) -> Option<&BatchError> {
    commands.iter().find_map(|c| if let Command::BatchFailed(error) = c { Some(error) } else { None })
}

pub(super) fn assert_right(commands: &[Command]) {
    let outcomes = outcomes(commands).expect("the batch ended");
    for (index, outcome) in outcomes.iter().enumerate() {
        assert_eq!(outcome.result, Ok(scaled(index, 1.0)));
    }
}

#[test]
fn the_first_result_of_every_worker_is_repeated_once() {
    for n in [2, 3, 5] {
        let mut stage = comparing(&vec![1; n], false);
        let first = stage.step(submit(20));
        let all = played(&mut stage, first, |_, index, _| Ok(scaled(index, 1.0)));
        assert_right(&all);
        assert_eq!(sent(&all).len(), 20 + n, "of 20 jobs on {n} workers");
        // Known by now: nothing of the next small batch is repeated.
        let next = stage.step(submit(20));
        let all = played(&mut stage, next, |_, index, _| Ok(scaled(index, 1.0)));
        assert_eq!(sent(&all).len(), 20);
    }
}

#[test]
fn a_worker_whose_outputs_are_half_a_per_cent_too_small_is_put_out_and_its_runs_are_made_again() {
    for liar in 1..=3 {
        let mut stage = comparing(&[1, 1, 1], false);
        let first = stage.step(submit(12));
        let lie = |who| if who == liar { 0.995 } else { 1.0 };
        let all = played(&mut stage, first, |who, index, _| Ok(scaled(index, lie(who))));
        assert_right(&all);
        assert_eq!(put_out(&all), [liar]);
        let told = all.iter().find_map(|c| match c {
            Command::Notice(event @ FleetEvent::WorkerExcluded { .. }) => Some(event.to_string()),
            _ => None,
        });
        let told = told.expect("it is named");
        assert!(
            told.contains(&format!("worker w{liar} is put out")) && told.contains("predicted value 1"),
            "{told}"
        );
        assert_eq!(stage.dispatcher.n_workers(), 2);
    }
}

#[test]
fn of_two_workers_that_differ_and_stay_so_neither_is_believed() {
    let mut stage = comparing(&[1, 1], false);
    let first = stage.step(submit(6));
    let lie = |who| if who == 2 { 0.995 } else { 1.0 };
    let all = played(&mut stage, first, |who, index, _| Ok(scaled(index, lie(who))));
    let error = failed_with(&all).expect("it ends");
    let BatchError::Disagreement { workers, .. } = error else { panic!("{error:?}") };
    assert!(workers.contains("worker w1") && workers.contains("worker w2"), "{workers}");
    assert!(put_out(&all).is_empty() && outcomes(&all).is_none());
}

#[test]
fn of_two_workers_the_one_that_contradicts_itself_is_put_out() {
    let mut stage = comparing(&[1, 1], false);
    let first = stage.step(submit(6));
    let lie = |who, n| if who == 2 && n == 0 { 0.995 } else { 1.0 };
    let all = played(&mut stage, first, |who, index, n| Ok(scaled(index, lie(who, n))));
    assert_right(&all);
    assert_eq!(put_out(&all), [2]);
}

#[test]
fn differences_are_told_once_and_change_nothing_where_they_are_allowed() {
    let mut stage = comparing(&[1, 1], true);
    let first = stage.step(submit(6));
    let lie = |who| if who == 2 { 1.0 + f64::EPSILON } else { 1.0 };
    let all = played(&mut stage, first, |who, index, _| Ok(scaled(index, lie(who))));
    assert!(outcomes(&all).is_some() && put_out(&all).is_empty());
    let told = all.iter().filter(|c| matches!(c, Command::Notice(FleetEvent::WorkersDiffer { .. }))).count();
    assert_eq!(told, 1);
}

#[test]
fn a_failure_where_another_worker_has_a_prediction_is_decided_by_a_third() {
    let mut stage = comparing(&[1, 1, 1], false);
    let first = stage.step(submit(9));
    let all = played(&mut stage, first, |who, index, _| match who {
        2 => Err(solver("k is too small")),
        _ => Ok(scaled(index, 1.0)),
    });
    assert_right(&all);
    assert_eq!(put_out(&all), [2]);
}

#[test]
fn a_program_outside_that_contradicts_itself_is_told_and_accuses_no_worker() {
    let mut stage = comparing(&[1, 1, 1], false);
    stage.step(Event::Likeness { setup: SETUP, likeness: Likeness::Promised });
    let first = stage.step(submit(9));
    let mut n = 0.0;
    let all = played(&mut stage, first, |_, index, _| {
        n += 1.0;
        Ok(scaled(index, 1.0 + 0.01 * n))
    });
    assert!(outcomes(&all).is_some() && put_out(&all).is_empty());
    let told =
        all.iter().filter(|c| matches!(c, Command::Notice(FleetEvent::NotReproducible { .. }))).count();
    assert_eq!(told, 1);
    // Nor is it compared any more.
    let next = stage.step(submit(9));
    let all = played(&mut stage, next, |_, index, _| Ok(scaled(index, 1.0)));
    assert_eq!(sent(&all).len(), 9);
}

#[test]
fn a_program_outside_that_rounds_differently_elsewhere_is_told_and_one_that_lies_is_put_out() {
    let of = |lie: f64| {
        let mut stage = comparing(&[1, 1, 1], false);
        stage.step(Event::Likeness { setup: SETUP, likeness: Likeness::Promised });
        let first = stage.step(submit(9));
        played(&mut stage, first, |who, index, _| Ok(scaled(index, if who == 3 { lie } else { 1.0 })))
    };
    let rounded = of(1.0 + 1e-12);
    assert!(rounded.iter().any(|c| matches!(c, Command::Notice(FleetEvent::WorkersDiffer { .. }))));
    assert!(outcomes(&rounded).is_some() && put_out(&rounded).is_empty());
    let lied = of(0.995);
    assert_right(&lied);
    assert_eq!(put_out(&lied), [3]);
}

#[test]
fn runs_that_need_not_repeat_are_not_repeated() {
    let mut stage = comparing(&[1, 1], false);
    stage.step(Event::Likeness { setup: SETUP, likeness: Likeness::None });
    let first = stage.step(submit(9));
    let all = played(&mut stage, first, |who, index, _| Ok(scaled(index, who as f64)));
    assert!(outcomes(&all).is_some());
    assert_eq!(sent(&all).len(), 9);
}

#[test]
fn results_of_a_worker_that_left_are_compared_all_the_same() {
    let mut stage = comparing(&[1], false);
    let first = stage.jobs(submit(6));
    let mut left_over = stage.jobs(ran(first[0].0, Ok(scaled(0, 0.995))));
    left_over.clear();
    stage.step(left(1, true));
    for id in 2..=3 {
        stage.step(Event::Joined(joining(id, 1)));
    }
    let mut commands = stage.step(Event::SetupDone { worker: WorkerId(2), setup: SETUP });
    commands.extend(stage.step(Event::SetupDone { worker: WorkerId(3), setup: SETUP }));
    let all = played(&mut stage, commands, |_, index, _| Ok(scaled(index, 1.0)));
    assert_right(&all);
    let excluded =
        all.iter().any(|c| matches!(c, Command::Notice(FleetEvent::WorkerExcluded { again: 1, .. })));
    assert!(excluded, "{all:?}");
}

#[test]
fn a_worker_alone_is_compared_with_nobody_and_waits_for_nobody() {
    let mut stage = comparing(&[4], false);
    let first = stage.step(submit(9));
    let all = played(&mut stage, first, |_, index, _| Ok(scaled(index, 1.0)));
    assert_right(&all);
    assert_eq!(sent(&all).len(), 9);
}

#[test]
fn at_most_two_per_cent_of_many_runs_are_repeats_and_a_late_lie_is_found() {
    let mut stage = comparing(&[2, 2, 2], false);
    let first = stage.step(submit(20_000));
    let all = played(&mut stage, first, |_, index, _| Ok(scaled(index, 1.0)));
    assert_right(&all);
    let repeats = sent(&all).len() - 20_000;
    assert!((200..=402).contains(&repeats), "{repeats} of 20 000");
    // A worker that breaks now.
    let next = stage.step(submit(20_000));
    let lie = |who, n| if who == 2 && n > 100 { 0.995 } else { 1.0 };
    let all = played(&mut stage, next, |who, index, n| Ok(scaled(index, lie(who, n))));
    assert_right(&all);
    assert_eq!(put_out(&all), [2]);
}

#[test]
fn workers_of_this_machine_are_sampled_only() {
    let mut stage = comparing(&[1, 1], false);
    stage.step(Event::LocalOnly);
    let first = stage.step(submit(20));
    let all = played(&mut stage, first, |_, index, _| Ok(scaled(index, 1.0)));
    assert_eq!(sent(&all).len(), 20);
}
