//! Results that the coordinator may not have: those of runs that ended while nobody was connected, and those sent last.
//!
//! A coordinator that is killed loses what it had not written yet, and a connection that breaks what was on its way; both come back
//! from here by the keys of their jobs. In memory up to a limit, then in a file without a name in the scratch folder; when that is full
//! too, no further run is started. Results with large states are told of as runs that go on, and put when there is a lease for them
//! ([`large`]). Next files to read: [`shared`] for how it keeps to its limits, [`delivery`] for how results are sent again.

pub(crate) mod delivery;
mod file;
mod kept;
pub(crate) mod large;
mod shared;
#[cfg(test)]
mod tests;

use std::collections::{HashMap, HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use delivery::Delivery;
use kept::Kept;
pub(crate) use kept::{Ended, Of};
use large::Large;
pub use shared::HoldLimits;
pub(crate) use shared::Run;
use shared::Shared;
use starlings_proto::{HeldRun, JobKey, JobKeys};

/// Shared by the threads that compute and the one of the network.
pub(crate) struct Held {
    limits: HoldLimits,
    scratch: PathBuf,
    shared: Mutex<Shared>,
}

impl Held {
    pub(crate) fn new(limits: HoldLimits, scratch: &Path) -> Self {
        Self { limits, scratch: scratch.to_owned(), shared: Mutex::default() }
    }

    /// The run that was connected last.
    pub(crate) fn run(&self) -> Option<Run> {
        self.lock().run
    }

    /// Notes a coordinator; says whether it is of the run that was connected before. What is held for another run is dropped.
    pub(crate) fn connected(&self, run: Run) -> bool {
        let mut shared = self.lock();
        let same = shared.run.is_some_and(|before| before.id == run.id);
        if !same {
            *shared = Shared::default();
        }
        (shared.run, shared.is_connected) = (Some(run), true);
        same
    }

    pub(crate) fn disconnected(&self) {
        let mut shared = self.lock();
        shared.is_connected = false;
        shared.file.was_not_sent();
    }

    /// How many results the coordinator may not have.
    pub(crate) fn len(&self) -> usize {
        let shared = self.lock();
        shared.runs.len() + shared.file.len()
    }

    /// Keeps how a run ended, whose large state `is_put` says to be on its way. False when nothing more can be held.
    pub(crate) fn keep(&self, of: Of, ended: Ended, is_put: bool) -> bool {
        let mut shared = self.lock();
        shared.add(Kept::new(of, ended, is_put));
        shared.fit(&self.limits, &self.scratch).0
    }

    /// A large state has been put, or could not be: then it is held for the next who asks. False when nothing more can be held. The
    /// states that nobody needs any more are for the caller to use again.
    pub(crate) fn was_put(&self, large: &Arc<Large>, has_arrived: bool) -> (bool, Vec<Arc<Large>>) {
        let mut shared = self.lock();
        shared.put(large, false, !has_arrived);
        shared.fit(&self.limits, &self.scratch)
    }

    /// Looks whether something need not be held any more.
    pub(crate) fn look(&self) {
        // The network does not wait for a disk.
        if let Ok(mut shared) = self.shared.try_lock()
            && shared.is_connected
        {
            shared.fit(&self.limits, &self.scratch);
        }
    }

    /// All that is held and fits into messages, for a coordinator of the same run, in portions of about so many bytes. It is held for a
    /// while longer, as what is sent always is.
    pub(crate) fn delivery(self: &Arc<Self>, bytes: usize) -> Delivery {
        let (now, mut keys, mut memory) = (Instant::now(), JobKeys::default(), VecDeque::new());
        for kept in &mut self.lock().runs {
            kept.at = now;
            match &kept.ended {
                Ended::Large(_) => kept.is_owed = true,
                Ended::Inside(ended) => {
                    memory.push_back(HeldRun { key: kept.of.key(&mut keys), ended: Some(ended.clone()) });
                }
            }
        }
        Delivery::new(Arc::clone(self), bytes, memory)
    }

    /// The keys of all that is held with large states.
    pub(crate) fn large(&self) -> Vec<JobKey> {
        let (mut keys, shared) = (JobKeys::default(), self.lock());
        let large = shared.runs.iter().filter(|kept| kept.large().is_some());
        large.map(|kept| kept.of.key(&mut keys)).collect()
    }

    /// How runs ended that are in memory or have large states, by the keys of their jobs; the latter are being put from now on. What is
    /// in the file was not told of as a run that goes on, so nobody asks for it.
    pub(crate) fn claim(&self, wanted: &[JobKey]) -> HashMap<JobKey, Ended> {
        let wanted: HashSet<&JobKey> = wanted.iter().collect();
        if wanted.is_empty() {
            return HashMap::new();
        }
        let (mut keys, mut found, mut shared) = (JobKeys::default(), HashMap::new(), self.lock());
        let mut put = Vec::new();
        for kept in &shared.runs {
            let key = kept.of.key(&mut keys);
            if wanted.contains(&key) {
                put.extend(kept.large().cloned());
                found.insert(key, kept.ended.clone());
            }
        }
        for large in &put {
            shared.put(large, true, true);
        }
        found
    }

    /// The coordinator needs nothing more of what it was told of and did not ask for.
    pub(crate) fn drop_void(&self) {
        let now = Instant::now();
        for kept in self.lock().runs.iter_mut().filter(|kept| kept.is_owed && !kept.is_put) {
            (kept.is_owed, kept.at) = (false, now);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
