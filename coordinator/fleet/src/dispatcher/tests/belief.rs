//! What is handed on before a batch is over: nothing that a worker may still be found to have made up.

use super::canary::{comparing, scaled};
use super::*;

fn told(stage: &mut Stage) -> Vec<usize> {
    let mut indices: Vec<_> = stage.dispatcher.arrived().into_iter().map(|(index, _)| index).collect();
    indices.sort_unstable();
    indices
}

#[test]
fn outcomes_wait_until_the_first_one_of_their_worker_is_compared() {
    let mut stage = comparing(&[1, 2], false);
    let jobs = stage.jobs(submit(4));
    let of = |worker| jobs.iter().copied().filter(move |(lease, _)| lease.epoch == worker);
    let own: Vec<_> = of(1).collect();
    let mut repeats = vec![];
    for &(lease, index) in &own {
        repeats.extend(stage.jobs(ran(lease, Ok(scaled(index, 1.0)))));
    }
    assert_eq!(told(&mut stage), [0; 0]);
    repeats.retain(|(lease, index)| lease.epoch == 2 && *index == own[0].1);
    let [(repeat, index)] = repeats[..] else { panic!("one repeat: {repeats:?}") };
    stage.step(ran(repeat, Ok(scaled(index, 1.0))));
    assert_eq!(told(&mut stage), own.iter().map(|(_, index)| *index).collect::<Vec<_>>());
    // The second one has nothing compared yet.
    let (lease, index) = of(2).next().expect("it has some");
    stage.step(ran(lease, Ok(scaled(index, 1.0))));
    assert_eq!(told(&mut stage), [0; 0]);
}

#[test]
fn where_nobody_can_compare_outcomes_are_handed_on_at_once() {
    let mut stage = comparing(&[1], false);
    let (lease, index) = stage.jobs(submit(3))[0];
    stage.step(ran(lease, Ok(scaled(index, 1.0))));
    assert_eq!(told(&mut stage), [index]);
    // Processes of this machine that were started from one program.
    let mut stage = comparing(&[1, 1], false);
    stage.step(Event::LocalOnly);
    let (lease, index) = stage.jobs(submit(3))[0];
    stage.step(ran(lease, Ok(scaled(index, 1.0))));
    assert_eq!(told(&mut stage), [index]);
}

#[test]
fn what_workers_dispute_about_is_not_handed_on_nor_left_behind() {
    for end in [BatchError::Cancelled, disagreement()] {
        let mut stage = comparing(&[1, 2], false);
        let (lease, index) = stage.jobs(submit(4))[0];
        let repeats = stage.jobs(ran(lease, Ok(scaled(index, 1.0))));
        let (repeat, _) = *repeats.iter().find(|(_, again)| *again == index).expect("its repeat");
        stage.step(ran(repeat, Ok(scaled(index, 0.995))));
        assert_eq!(told(&mut stage), [0; 0]);
        stage.step(Event::Abort(end));
        assert_eq!(told(&mut stage), [0; 0]);
    }
}

#[test]
fn a_batch_that_ends_in_a_disagreement_leaves_nothing_behind() {
    let mut stage = comparing(&[1], false);
    let (lease, index) = stage.jobs(submit(2))[0];
    stage.step(ran(lease, Ok(scaled(index, 1.0))));
    stage.step(Event::Abort(disagreement()));
    assert_eq!(told(&mut stage), [0; 0]);
}

fn disagreement() -> BatchError {
    BatchError::Disagreement { particle: 0, record: 0, workers: "w1 and w2".to_owned() }
}
