//! All workers, with an index of those that may be given work: a choice among a thousand goes through few of them.
//!
//! Whoever changes a worker does so through [`Changing`], which brings the index up to date when it is done: the index is exact
//! after every change, whatever it was. What a worker is stands in [`super::roster`]; who is chosen for what is decided in
//! [`super::schedule`] and [`super::canary`].

mod index;

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

use starlings_proto::SetupId;

use super::message::WorkerId;
use super::roster::Worker;
use index::{Index, Standing};

/// The workers of a fleet, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Workers {
    all: BTreeMap<WorkerId, Entry>,
    index: Index,
    /// The setups of the batch: without one of them a worker is given nothing.
    wanted: Vec<SetupId>,
}

/// A worker, and how it stands in the index.
#[derive(Debug)]
struct Entry {
    worker: Worker,
    standing: Standing,
}

/// A worker that may be changed; the index follows when this is dropped.
pub(super) struct Changing<'a> {
    entry: &'a mut Entry,
    index: &'a mut Index,
    wanted: &'a [SetupId],
}

impl Deref for Changing<'_> {
    type Target = Worker;

    fn deref(&self) -> &Worker {
        &self.entry.worker
    }
}

impl DerefMut for Changing<'_> {
    fn deref_mut(&mut self) -> &mut Worker {
        &mut self.entry.worker
    }
}

impl Drop for Changing<'_> {
    fn drop(&mut self) {
        let now = Standing::of(&self.entry.worker, self.wanted);
        self.index.moves(self.entry.worker.id, &self.entry.standing, &now);
        self.entry.standing = now;
    }
}

impl Workers {
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Number of slots of all workers.
    pub(super) fn slots(&self) -> usize {
        self.index.slots()
    }

    pub(super) fn values(&self) -> impl Iterator<Item = &Worker> {
        self.all.values().map(|entry| &entry.worker)
    }

    pub(super) fn contains_key(&self, id: WorkerId) -> bool {
        self.all.contains_key(&id)
    }

    pub(super) fn get(&self, id: WorkerId) -> Option<&Worker> {
        self.all.get(&id).map(|entry| &entry.worker)
    }

    pub(super) fn get_mut(&mut self, id: WorkerId) -> Option<Changing<'_>> {
        let entry = self.all.get_mut(&id)?;
        Some(Changing { entry, index: &mut self.index, wanted: &self.wanted })
    }

    /// Has a look at every worker, which may change it.
    pub(super) fn for_each(&mut self, mut look: impl FnMut(&mut Worker)) {
        for entry in self.all.values_mut() {
            look(&mut Changing { entry, index: &mut self.index, wanted: &self.wanted });
        }
    }

    pub(super) fn insert(&mut self, worker: Worker) {
        let id = worker.id;
        self.remove(id);
        self.all.insert(id, Entry { worker, standing: Standing::default() });
        // Entered as a change.
        drop(self.get_mut(id));
    }

    pub(super) fn remove(&mut self, id: WorkerId) -> Option<Worker> {
        let Entry { worker, standing } = self.all.remove(&id)?;
        self.index.moves(id, &standing, &Standing::default());
        Some(worker)
    }

    /// Says which setups the jobs have that are given away from now on.
    pub(super) fn want(&mut self, setups: &[SetupId]) {
        self.wanted = setups.to_vec();
        self.for_each(|_| {});
    }

    /// Whether any worker may be given a job of a wanted setup.
    pub(super) fn have_room(&self) -> bool {
        self.index.with_room().next().is_some()
    }

    /// The worker with the fewest leases per slot among those that have built a setup, have room and `may` get the job; the earlier
    /// one of equals.
    pub(super) fn least_loaded(
        &mut self,
        setup: &SetupId,
        may: impl Fn(&Worker) -> bool,
    ) -> Option<Changing<'_>> {
        let fits = |w: &&Worker| w.has_room() && w.is_ready(setup) && may(w);
        let id = self.of(self.index.with_room()).find(fits).map(|w| w.id);
        #[cfg(test)]
        super::tests::plain::same_choice(self.values().filter(fits), id);
        self.get_mut(id?)
    }

    /// The same among workers that are not set aside, with room or, where `crowded`, without.
    pub(super) fn least_loaded_sound(
        &mut self,
        setup: &SetupId,
        crowded: bool,
        may: impl Fn(&Worker) -> bool,
    ) -> Option<Changing<'_>> {
        let fits = |w: &&Worker| (crowded || w.has_room()) && w.takes(setup) && may(w);
        let id = if crowded {
            self.of(self.index.sound()).find(fits).map(|w| w.id)
        } else {
            self.of(self.index.with_room()).find(fits).map(|w| w.id)
        };
        #[cfg(test)]
        super::tests::plain::same_choice(self.values().filter(fits), id);
        self.get_mut(id?)
    }

    /// Whether a worker with room has built a setup.
    pub(super) fn have_room_for(&self, setup: &SetupId) -> bool {
        self.of(self.index.with_room()).any(|w| w.is_ready(setup))
    }

    /// Workers with an idle slot that are not set aside.
    pub(super) fn idle(&self) -> impl Iterator<Item = &Worker> {
        self.of(self.index.idle())
    }

    /// Idle slots of all of these, and leases that are on their way back from any worker.
    pub(super) fn idle_and_returning(&self) -> (usize, usize) {
        self.index.idle_and_returning()
    }

    /// Workers with jobs that wait behind a busy slot and are worth calling back; the fullest first, of equals the later one.
    pub(super) fn overfull(&self) -> impl Iterator<Item = WorkerId> {
        self.index.overfull()
    }

    fn of(&self, ids: impl Iterator<Item = WorkerId>) -> impl Iterator<Item = &Worker> {
        ids.filter_map(|id| self.get(id))
    }

    /// The index as it is, and as it would be were it made anew.
    #[cfg(test)]
    pub(super) fn indexes(&self) -> (&Index, Index) {
        let mut anew = Index::default();
        for worker in self.values() {
            anew.moves(worker.id, &Standing::default(), &Standing::of(worker, &self.wanted));
        }
        (&self.index, anew)
    }
}
