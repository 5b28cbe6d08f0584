//! Where every worker stands in what a choice looks at: who has room, who idles, who has too much.
//!
//! Only order and sums. Next file to read: [`super::super::schedule`].

use std::cmp::Ordering;
use std::collections::BTreeSet;

use starlings_proto::SetupId;

use crate::dispatcher::message::WorkerId;
use crate::dispatcher::roster::Worker;

/// A worker by its leases per slot; the earlier one of equals comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Loaded {
    load: usize,
    slots: usize,
    id: WorkerId,
}

impl Ord for Loaded {
    fn cmp(&self, other: &Self) -> Ordering {
        // As fractions, without rounding.
        let (own, others) =
            (self.load as u128 * other.slots as u128, other.load as u128 * self.slots as u128);
        own.cmp(&others).then(self.id.cmp(&other.id))
    }
}

impl PartialOrd for Loaded {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// How one worker stands; that of nobody is the default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Standing {
    load: usize,
    slots: usize,
    /// Whether it may be given one more job of a wanted setup.
    has_room: bool,
    /// Whether it has built a wanted setup and is not set aside.
    is_sound: bool,
    idle: usize,
    surplus: usize,
    returning: usize,
}

impl Standing {
    pub(super) fn of(worker: &Worker, wanted: &[SetupId]) -> Self {
        let (load, slots) = (worker.load(), worker.slots);
        let is_sound = worker.aside.is_none();
        let is_ready = wanted.iter().any(|setup| worker.is_ready(setup));
        Self {
            load,
            slots,
            has_room: is_ready && worker.has_room(),
            is_sound: is_ready && is_sound,
            idle: if is_sound { slots.saturating_sub(load) } else { 0 },
            surplus: worker.surplus(),
            returning: worker.n_returning(),
        }
    }
}

/// The workers in the orders in which they are chosen.
#[derive(Debug, Default, PartialEq, Eq)]
pub(in crate::dispatcher) struct Index {
    with_room: BTreeSet<Loaded>,
    sound: BTreeSet<Loaded>,
    idle: BTreeSet<WorkerId>,
    overfull: BTreeSet<(usize, WorkerId)>,
    n_slot: usize,
    n_idle: usize,
    n_returning: usize,
}

impl Index {
    /// Takes note that a worker stands otherwise than it did.
    pub(super) fn moves(&mut self, id: WorkerId, before: &Standing, now: &Standing) {
        if before == now {
            return;
        }
        let loaded = |of: &Standing| Loaded { load: of.load, slots: of.slots, id };
        self.with_room.change(before.has_room.then(|| loaded(before)), now.has_room.then(|| loaded(now)));
        self.sound.change(before.is_sound.then(|| loaded(before)), now.is_sound.then(|| loaded(now)));
        self.idle.change((before.idle > 0).then_some(id), (now.idle > 0).then_some(id));
        let surplus = |of: &Standing| (of.surplus > 0).then_some((of.surplus, id));
        self.overfull.change(surplus(before), surplus(now));
        self.n_slot = self.n_slot + now.slots - before.slots;
        self.n_idle = self.n_idle + now.idle - before.idle;
        self.n_returning = self.n_returning + now.returning - before.returning;
    }

    /// Workers that may be given one more job, the least loaded first.
    pub(super) fn with_room(&self) -> impl Iterator<Item = WorkerId> {
        self.with_room.iter().map(|loaded| loaded.id)
    }

    /// Workers that have built a wanted setup and are not set aside, the least loaded first.
    pub(super) fn sound(&self) -> impl Iterator<Item = WorkerId> {
        self.sound.iter().map(|loaded| loaded.id)
    }

    pub(super) fn idle(&self) -> impl Iterator<Item = WorkerId> {
        self.idle.iter().copied()
    }

    pub(super) fn overfull(&self) -> impl Iterator<Item = WorkerId> {
        self.overfull.iter().rev().map(|(_, id)| *id)
    }

    pub(super) fn slots(&self) -> usize {
        self.n_slot
    }

    pub(super) fn idle_and_returning(&self) -> (usize, usize) {
        (self.n_idle, self.n_returning)
    }
}

/// A set in which what was gives its place to what is.
trait Change<T> {
    fn change(&mut self, before: Option<T>, now: Option<T>);
}

impl<T: Ord> Change<T> for BTreeSet<T> {
    fn change(&mut self, before: Option<T>, now: Option<T>) {
        if before != now {
            before.map(|before| self.remove(&before));
            now.map(|now| self.insert(now));
        }
    }
}
