//! What is held at the moment, and how it keeps to its limits: what was sent makes room first, then the oldest goes to the disk.
//!
//! Next files to read: [`super::file`] for what is on disk, [`super::large`] for results with large states.

use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use starlings_proto::JobKeys;

use super::file::HeldFile;
use super::kept::{Ended, Kept};
use super::large::Large;

/// How long a result that was sent may still be on its way, or in the coordinator and not written: above the silence at which either
/// side takes the other for gone, and above the time that a coordinator may hold a commit back.
pub(super) const RECENT: Duration = Duration::from_secs(60);

/// How long a coordinator that is connected may take to ask for a large state.
const OWED: Duration = Duration::from_secs(600);

/// What may be held, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HoldLimits {
    /// In memory.
    pub memory: usize,
    /// In files, beyond that.
    pub disk: u64,
}

impl Default for HoldLimits {
    fn default() -> Self {
        Self { memory: 64 << 20, disk: 1 << 30 }
    }
}

/// A run and its start, as the coordinator told it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) id: [u8; 16],
    pub(crate) incarnation: u64,
}

/// What is held.
#[derive(Default)]
pub(super) struct Shared {
    pub(super) run: Option<Run>,
    /// Whether a coordinator of this run is connected.
    pub(super) is_connected: bool,
    /// Oldest first.
    pub(super) runs: VecDeque<Kept>,
    pub(super) file: HeldFile,
    bytes: usize,
}

impl Shared {
    /// Takes a result.
    pub(super) fn add(&mut self, mut kept: Kept) {
        kept.counted = kept.bytes();
        self.bytes += kept.counted;
        self.runs.push_back(kept);
    }

    /// Keeps to the limits: false when that cannot be done without a loss. What it let go of is for the caller to use again.
    pub(super) fn fit(&mut self, limits: &HoldLimits, scratch: &Path) -> (bool, Vec<Arc<Large>>) {
        let mut gone = Vec::new();
        if self.is_connected {
            self.expire(&mut gone);
            self.file.expire(RECENT);
            while self.memory() > limits.memory && self.remove_first(|kept| !kept.is_owed, &mut gone) {}
        }
        while self.memory() > limits.memory {
            let moved = self.on_disk() < limits.disk && self.spill(scratch).unwrap_or(false);
            // Of a coordinator that is there, what it has not asked for is made again.
            let makes_room = moved || self.is_connected && self.remove_first(|_| true, &mut gone);
            if !makes_room {
                return (self.is_connected, gone);
            }
        }
        (true, gone)
    }

    /// A large state is being put, or no more.
    pub(super) fn put(&mut self, large: &Arc<Large>, is_put: bool, is_owed: bool) {
        let is_it = |kept: &Kept| kept.large().is_some_and(|own| Arc::ptr_eq(own, large));
        if let Some(i) = self.runs.iter().position(is_it) {
            let kept = &mut self.runs[i];
            (kept.is_put, kept.is_owed) = (is_put, is_owed);
            self.recount(i);
        }
    }

    fn recount(&mut self, i: usize) {
        let kept = &mut self.runs[i];
        let now = kept.bytes();
        self.bytes = self.bytes + now - kept.counted;
        kept.counted = now;
    }

    /// Drops what was sent long enough ago.
    fn expire(&mut self, gone: &mut Vec<Arc<Large>>) {
        let ends = |kept: &Kept| if kept.is_owed { OWED } else { RECENT };
        // The oldest are first, but for those that are owed.
        while let Some(i) = self.runs.iter().position(|kept| !kept.is_put && !kept.is_owed)
            && self.runs[i].at.elapsed() >= RECENT
        {
            self.remove(i, gone);
        }
        while self.remove_first(|kept| kept.is_owed && kept.at.elapsed() >= ends(kept), gone) {}
    }

    /// Removes the oldest of those that are not being put.
    fn remove_first(&mut self, which: impl Fn(&Kept) -> bool, gone: &mut Vec<Arc<Large>>) -> bool {
        let found = self.runs.iter().position(|kept| !kept.is_put && which(kept));
        found.is_some_and(|i| self.remove(i, gone))
    }

    fn remove(&mut self, i: usize, gone: &mut Vec<Arc<Large>>) -> bool {
        let Some(kept) = self.runs.remove(i) else { return false };
        self.bytes -= kept.counted;
        if let Ended::Large(large) = kept.ended {
            gone.push(large);
        }
        true
    }

    fn memory(&self) -> usize {
        self.bytes + self.file.memory()
    }

    /// Bytes in files.
    fn on_disk(&self) -> u64 {
        let large = self.runs.iter().filter_map(Kept::large);
        self.file.bytes() + large.map(|large| large.bytes().1).sum::<u64>()
    }

    /// Moves the oldest run that is in memory to the disk; false where there is none.
    fn spill(&mut self, scratch: &Path) -> io::Result<bool> {
        let is_in_memory = |kept: &Kept| match &kept.ended {
            Ended::Inside(_) => true,
            Ended::Large(large) => !kept.is_put && large.bytes().0 > 0,
        };
        let Some(i) = self.runs.iter().position(is_in_memory) else { return Ok(false) };
        let kept = &self.runs[i];
        match &kept.ended {
            Ended::Large(large) => {
                large.spill(scratch)?;
                self.recount(i);
            }
            Ended::Inside(ended) => {
                self.file.add(scratch, kept.of.key(&mut JobKeys::default()), ended)?;
                self.remove(i, &mut Vec::new());
            }
        }
        Ok(true)
    }
}
