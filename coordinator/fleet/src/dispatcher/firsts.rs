//! The first result of every worker in a batch, until another worker has compared it.
//!
//! In a large fleet many are open at once: those of which it is known that somebody repeats them, or that they are disputed, are not
//! looked at until that has ended. Only data. Next files to read: [`super::repeats`], [`super::canary`].

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;

use super::message::WorkerId;

/// A worker whose results of this batch nobody has compared yet.
#[derive(Debug)]
pub(super) struct Contributor {
    /// Its name with its build.
    pub(super) name: String,
    /// Its first result.
    pub(super) index: usize,
    /// Who was asked to repeat it and gave no result.
    pub(super) tried: BTreeSet<WorkerId>,
}

/// The workers whose results nobody has compared yet.
#[derive(Debug, Default)]
pub(super) struct Firsts {
    all: BTreeMap<WorkerId, Contributor>,
    /// Those that may have to be repeated: all but the ones that wait.
    due: BTreeSet<WorkerId>,
}

impl Firsts {
    /// Takes note of a worker, unless it is known.
    pub(super) fn add(&mut self, id: WorkerId, new: impl FnOnce() -> Contributor) {
        self.all.entry(id).or_insert_with(|| {
            self.due.insert(id);
            new()
        });
    }

    pub(super) fn get(&self, id: WorkerId) -> Option<&Contributor> {
        self.all.get(&id)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (WorkerId, &Contributor)> {
        self.all.iter().map(|(&id, contributor)| (id, contributor))
    }

    /// Forgets a worker: it is compared, or gone.
    pub(super) fn remove(&mut self, id: WorkerId) {
        self.all.remove(&id);
        self.due.remove(&id);
    }

    /// Forgets all but these.
    pub(super) fn retain(&mut self, is_kept: impl Fn(&Contributor) -> bool) {
        self.all.retain(|_, contributor| is_kept(contributor));
        self.due.retain(|id| self.all.contains_key(id));
    }

    /// The next worker after this one that may have to be repeated, with its first result.
    pub(super) fn next_due(&self, passed: Option<WorkerId>) -> Option<(WorkerId, usize)> {
        let after = (passed.map_or(Bound::Unbounded, Bound::Excluded), Bound::Unbounded);
        let id = *self.due.range(after).next()?;
        Some((id, self.all.get(&id)?.index))
    }

    /// Somebody repeats its result, or there is a dispute: it is not looked at until that ends.
    pub(super) fn wait(&mut self, id: WorkerId) {
        self.due.remove(&id);
    }

    /// What was waited for has ended.
    pub(super) fn look_again(&mut self, index: usize) {
        let of_it = self.all.iter().filter(|(_, contributor)| contributor.index == index);
        self.due.extend(of_it.map(|(id, _)| *id));
    }

    /// One who was asked to repeat a result gave none.
    pub(super) fn no_opinion(&mut self, asked: WorkerId, index: usize) {
        let of_it = self.all.values_mut().filter(|contributor| contributor.index == index);
        of_it.for_each(|contributor| _ = contributor.tried.insert(asked));
    }
}
