//! The rule of choice in its plain form, which goes through all workers: the index chooses the same, after every event.

use super::super::message::WorkerId;
use super::super::roster::Worker;
use super::super::workers::Workers;

/// Of the workers that fit, the one with the fewest leases per slot is chosen, the earlier one of equals.
pub(in crate::dispatcher) fn same_choice<'a>(
    fit: impl Iterator<Item = &'a Worker>,
    chosen: Option<WorkerId>,
) {
    let plain = fit.min_by(|a, b| (a.load() * b.slots).cmp(&(b.load() * a.slots)));
    assert_eq!(chosen, plain.map(|w| w.id), "the index chooses as the plain rule does");
}

/// The index is what it would be were it made anew, and its sums are those of the workers.
pub(in crate::dispatcher) fn exact(workers: &Workers) {
    let (index, anew) = workers.indexes();
    assert_eq!(*index, anew, "the index follows every change");
    assert_eq!(workers.slots(), workers.values().map(|w| w.slots).sum::<usize>());
    let idle = |w: &&Worker| w.aside.is_none() && w.load() < w.slots;
    let n_idle = workers.values().filter(idle).map(|w| w.slots - w.load()).sum::<usize>();
    let n_returning = workers.values().map(Worker::n_returning).sum::<usize>();
    assert_eq!(workers.idle_and_returning(), (n_idle, n_returning));
    assert!(workers.idle().map(|w| w.id).eq(workers.values().filter(idle).map(|w| w.id)));
    // The fullest first, the later one of equals.
    let mut overfull =
        workers.values().filter(|w| w.surplus() > 0).map(|w| (w.surplus(), w.id)).collect::<Vec<_>>();
    overfull.sort_unstable();
    assert!(workers.overfull().eq(overfull.into_iter().rev().map(|(_, id)| id)));
}
