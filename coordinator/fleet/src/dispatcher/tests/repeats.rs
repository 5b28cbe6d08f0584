//! Repeats that are slow, wait or lie: what they hold up, and that no lie becomes an outcome.

use proptest::prelude::*;
use starlings_proto::State;

use super::canary::{assert_right, comparing, failed_with, put_out, scaled};
use super::*;

#[test]
fn large_states_are_compared_by_name_and_that_of_a_repeat_is_needed_by_nobody() {
    let mut stage = comparing(&[1, 1], false);
    let named = |n| Prediction { outputs: vec![1.0], state: State::Named([n; 32]), cost: 0.0 };
    let first = stage.jobs(submit(1));
    let repeats = stage.jobs(ran(first[0].0, Ok(named(1))));
    assert_eq!((first.len(), repeats.len()), (1, 1));
    assert!(stage.dispatcher.needs_state(&[1; 32]) && !stage.dispatcher.needs_state(&[2; 32]));
    let asked_again = stage.jobs(ran(repeats[0].0, Ok(named(2))));
    assert!(!asked_again.is_empty(), "the predicted values agree, the states do not");
    assert!(stage.dispatcher.needs_state(&[1; 32]) && !stage.dispatcher.needs_state(&[2; 32]));
}

#[test]
fn a_dispute_asks_on_when_the_worker_that_it_asked_is_put_out_in_another_dispute() {
    let mut stage = comparing(&[1, 1, 1], false);
    let mut open = stage.jobs(submit(3));
    let mut answers = |worker: u64, index: usize, said| {
        let at = open.iter().position(|(lease, job)| (lease.epoch, *job) == (worker, index));
        let commands = stage.step(ran(open.remove(at.expect("it has the job")).0, said));
        open.extend(sent(&commands));
        commands
    };
    answers(3, 2, Err(solver("no")));
    answers(2, 1, Ok(scaled(1, 1.0)));
    answers(1, 0, Ok(scaled(0, 0.995)));
    // Job 2 has a prediction where the third worker failed: the second is asked.
    answers(1, 2, Ok(scaled(2, 1.0)));
    // The first two differ in job 0: the third is asked.
    let asked = sent(&answers(2, 0, Ok(scaled(0, 1.0))));
    assert!(asked.iter().any(|(lease, index)| (lease.epoch, *index) == (3, 0)), "{asked:?}");
    // Of job 2 the third was wrong, so nobody says any more who is right in job 0: both are asked again, without a tick.
    let mut all = answers(2, 2, Ok(scaled(2, 1.0)));
    assert_eq!(put_out(&all), [3]);
    let mut next = sent(&all);
    assert!(next.iter().any(|(_, index)| *index == 0), "{next:?}");
    while let Some((lease, index)) = next.pop() {
        let commands = stage.step(ran(lease, Ok(scaled(index, 1.0))));
        next.extend(sent(&commands));
        all.extend(commands);
    }
    // The first contradicts itself.
    assert_eq!(put_out(&all), [3, 1]);
    assert_right(&all);
}

#[test]
fn a_repeat_that_never_comes_back_does_not_hold_the_batch() {
    let mut stage = comparing(&[1, 1], false);
    let first = stage.step(submit(2));
    let jobs = sent(&first);
    // The second one only beats.
    let mut open = stage.jobs(ran(jobs[0].0, Ok(scaled(jobs[0].1, 1.0))));
    let mut ended = false;
    for _ in 0..200 {
        for (lease, index) in std::mem::take(&mut open) {
            if lease.epoch == 1 {
                open.extend(stage.jobs(ran(lease, Ok(scaled(index, 1.0)))));
            }
        }
        let commands = stage.seconds(1, &[1, 2]);
        ended |= outcomes(&commands).is_some();
        open.extend(sent(&commands));
    }
    assert!(ended, "the first one made all");
}

#[test]
fn a_repeat_that_waits_behind_a_slow_run_is_not_called_back_and_not_given_up() {
    let mut stage = comparing(&[1, 1], false);
    let jobs = stage.jobs(submit(2));
    // The first one is done and idle; the second one computes for long, and the repeat waits behind that.
    let [(repeat, 0)] = stage.jobs(ran(jobs[0].0, Ok(scaled(0, 0.995))))[..] else { panic!("a repeat") };
    assert_eq!(repeat.epoch, jobs[1].0.epoch);
    let commands = stage.seconds(1, &[1, 2]);
    assert!(!commands.iter().any(|c| matches!(c, Command::Cancel { .. })), "{commands:?}");
    let mut open = stage.jobs(ran(jobs[1].0, Ok(scaled(1, 1.0))));
    open.push((repeat, 0));
    let mut all = vec![];
    while let Some((lease, index)) = open.pop() {
        let lie = if lease.epoch == repeat.epoch { 1.0 } else { 0.995 };
        let commands = stage.step(ran(lease, Ok(scaled(index, lie))));
        open.extend(sent(&commands));
        all.extend(commands);
    }
    assert!(matches!(failed_with(&all), Some(BatchError::Disagreement { .. })), "{all:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Honest workers are more than liars, each lie its own: what comes out is right, and only liars are put out.
    #[test]
    fn liars_never_change_an_outcome(
        n_liar in 0_usize..3,
        slots in prop::collection::vec(1_u32..3, 5),
        n_job in 1_u32..60,
        order in prop::collection::vec(any::<usize>(), 400),
    ) {
        let mut stage = comparing(&slots, false);
        let mut commands = stage.step(submit(n_job));
        let mut open = sent(&commands);
        let mut order = order.into_iter().chain(std::iter::repeat(0));
        let mut out = put_out(&commands);
        while !open.is_empty() {
            let (lease, index) = open.remove(order.next().expect("endless") % open.len());
            let lie = if lease.epoch as usize <= n_liar { 1.0 - 0.001 * lease.epoch as f64 } else { 1.0 };
            commands = stage.step(ran(lease, Ok(scaled(index, lie))));
            out.extend(put_out(&commands));
            open.retain(|(lease, _)| !out.contains(&lease.epoch));
            open.extend(sent(&commands));
        }
        assert_right(&commands);
        prop_assert!(out.iter().all(|who| *who as usize <= n_liar), "{out:?}");
    }
}
