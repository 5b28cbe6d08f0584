//! Blocks of rows that workers mix in the shared folder: who has which, and what becomes of those of a lost worker.
//!
//! A block is one piece of the states of all particles. A worker that is lost, cannot make one or answers nothing for too long gives its
//! blocks to the others; where nobody is left the caller makes them, so that every block is told of once. Next file to read: `mixing`.

use std::collections::{BTreeMap, VecDeque};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use starlings_proto::convert::state::{ChunkId, chunk_values, n_chunks};
use starlings_proto::{Bytes, Lease, ToWorker, generated};
use starlings_states::StoredState;

use crate::dispatcher::WorkerId;

/// Blocks that a worker has for each of its slots: one is made, one waits.
const PER_SLOT: usize = 2;

/// How long a worker that has blocks may answer none.
const PATIENCE: Duration = Duration::from_secs(60);

/// What came of a block.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Made {
    pub(crate) block: usize,
    /// Who made it and the names of the new pieces, by particle; or why nobody did.
    pub(crate) by: Result<(WorkerId, Vec<ChunkId>), String>,
}

/// What is to be mixed.
pub(crate) struct Work {
    /// The states of the particles, of one length.
    pub(crate) columns: Vec<StoredState>,
    /// The transform as it travels.
    pub(crate) transform: Bytes,
    /// Who hears of every block.
    pub(crate) made: Sender<Made>,
}

impl Work {
    fn n_state(&self) -> usize {
        self.columns.first().map_or(0, StoredState::n_state)
    }
}

/// Guarded by the hub's lock.
#[derive(Default)]
pub(super) struct Blocks {
    /// Workers that share the folder, with the blocks that each may have.
    sharing: BTreeMap<WorkerId, usize>,
    work: Option<Work>,
    waiting: VecDeque<usize>,
    given: BTreeMap<Lease, (usize, Instant)>,
    /// When workers answered last.
    heard: BTreeMap<WorkerId, Instant>,
    /// Blocks given so far: the number of the next lease.
    count: u64,
}

impl Blocks {
    /// A worker shares the folder; `true` the first time that it says so.
    pub(super) fn joined(&mut self, worker: WorkerId, slots: usize) -> bool {
        self.sharing.insert(worker, PER_SLOT * slots).is_none()
    }

    /// Workers that share the folder.
    pub(super) fn n_sharing(&self) -> usize {
        self.sharing.len()
    }

    /// Has all blocks wait; those of an earlier work are of no use any more.
    pub(super) fn begin(&mut self, work: Work) {
        self.stop();
        self.waiting = (0..n_chunks(work.n_state())).collect();
        self.work = Some(work);
        self.give_up_alone();
    }

    /// Nobody waits for blocks.
    pub(super) fn stop(&mut self) {
        self.work = None;
        self.waiting.clear();
        self.given.clear();
    }

    /// The message that gives the next block to the worker with the least to do, if one has room.
    pub(super) fn give(&mut self) -> Option<(WorkerId, generated::ToWorker)> {
        let work = self.work.as_ref()?;
        let load = |worker: &WorkerId| self.given.keys().filter(|lease| lease.epoch == worker.0).count();
        let loads = self.sharing.iter().map(|(worker, most)| (load(worker), *worker, *most));
        let (_, worker, _) = loads.filter(|(load, _, most)| load < most).min()?;
        let block = self.waiting.pop_front()?;
        self.count += 1;
        let lease = Lease { epoch: worker.0, job: self.count, attempt: 1 };
        let pieces: Vec<ChunkId> = work.columns.iter().map(|state| state.pieces()[block]).collect();
        let rows = chunk_values(work.n_state(), block);
        let message = ToWorker::recombine(lease, rows, &pieces, work.transform.clone());
        self.given.insert(lease, (block, Instant::now()));
        Some((worker, message))
    }

    /// The block that a worker answers for; `None` where it has none under this lease.
    pub(super) fn answered(&mut self, lease: &Lease, now: Instant) -> Option<usize> {
        let (block, _) = self.given.remove(lease)?;
        self.heard.insert(WorkerId(lease.epoch), now);
        Some(block)
    }

    /// Pieces of a block.
    pub(super) fn n_pieces(&self) -> usize {
        self.work.as_ref().map_or(0, |work| work.columns.len())
    }

    /// Tells what came of a block.
    pub(super) fn end(&mut self, block: usize, by: Result<(WorkerId, Vec<ChunkId>), String>) {
        if let Some(work) = &self.work {
            // A caller who has left does not care.
            let _ = work.made.send(Made { block, by });
        }
    }

    /// A worker cannot make a block: another one may do better, and this one is given no more.
    pub(super) fn failed(&mut self, worker: WorkerId, block: usize) {
        self.waiting.push_front(block);
        self.left(worker);
    }

    /// A worker shares the folder no more; its blocks wait again.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.sharing.remove(&worker);
        self.heard.remove(&worker);
        let its = |lease: &Lease| lease.epoch == worker.0;
        let back: Vec<usize> =
            self.given.iter().filter(|(lease, _)| its(lease)).map(|(_, (block, _))| *block).collect();
        self.given.retain(|lease, _| !its(lease));
        back.into_iter().rev().for_each(|block| self.waiting.push_front(block));
        self.give_up_alone();
    }

    /// Without a worker the caller makes what waits.
    fn give_up_alone(&mut self) {
        if self.sharing.is_empty() {
            for block in std::mem::take(&mut self.waiting) {
                self.end(block, Err("no worker shares the folder any more".to_owned()));
            }
        }
    }

    /// Gives up the workers that have blocks and have answered none for long; who they are.
    pub(super) fn overdue(&mut self, now: Instant) -> Vec<WorkerId> {
        let since =
            |worker: &WorkerId, given: Instant| self.heard.get(worker).map_or(given, |at| given.max(*at));
        let late = |(lease, (_, given)): (&Lease, &(usize, Instant))| {
            let worker = WorkerId(lease.epoch);
            (now.saturating_duration_since(since(&worker, *given)) > PATIENCE).then_some(worker)
        };
        let mut late: Vec<WorkerId> = self.given.iter().filter_map(late).collect();
        late.dedup();
        for worker in &late {
            self.left(*worker);
        }
        late
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use starlings_proto::ReceivedWindows;
    use starlings_states::{CHUNK_VALUES, StateStore};

    use super::*;

    const A: WorkerId = WorkerId(1);
    const B: WorkerId = WorkerId(2);

    /// Blocks of a state of so many pieces.
    fn blocks(n: usize, sharing: &[WorkerId]) -> (Blocks, Receiver<Made>) {
        let store = StateStore::new(usize::MAX);
        let columns = vec![store.keep(&vec![0.5; n * CHUNK_VALUES]).expect("room")];
        let (made, heard) = channel();
        let mut blocks = Blocks::default();
        for worker in sharing {
            assert!(blocks.joined(*worker, 1));
        }
        blocks.begin(Work { columns, transform: vec![0; 8].into(), made });
        (blocks, heard)
    }

    /// Gives all that is taken: who got what under which lease.
    fn given(blocks: &mut Blocks) -> Vec<(WorkerId, Lease)> {
        let lease = |message| match ToWorker::decode(message, &mut ReceivedWindows::default()) {
            Ok(ToWorker::Recombine { lease, .. }) => lease,
            other => panic!("{other:?}"),
        };
        std::iter::from_fn(|| blocks.give()).map(|(worker, message)| (worker, lease(message))).collect()
    }

    fn told(heard: &Receiver<Made>) -> Vec<(usize, bool)> {
        heard.try_iter().map(|made| (made.block, made.by.is_ok())).collect()
    }

    #[test]
    fn every_block_is_told_of_once_whoever_is_lost() {
        let (mut blocks, heard) = blocks(5, &[A, B]);
        let first = given(&mut blocks);
        assert_eq!(first.iter().map(|(worker, _)| *worker).collect::<Vec<_>>(), [A, B, A, B]);
        let zero = blocks.answered(&first[0].1, Instant::now()).expect("it was given");
        blocks.end(zero, Ok((A, vec![[0; 32]])));
        assert_eq!(blocks.answered(&first[0].1, Instant::now()), None, "once");
        blocks.left(A);
        assert_eq!(given(&mut blocks), [], "the other one has no room yet");
        for (_, lease) in [first[1], first[3]] {
            let block = blocks.answered(&lease, Instant::now()).expect("it was given");
            blocks.end(block, Ok((B, vec![[0; 32]])));
        }
        assert_eq!(given(&mut blocks).len(), 2);
        assert_eq!(told(&heard), [(0, true), (1, true), (3, true)]);
        assert_eq!(blocks.answered(&first[2].1, Instant::now()), None, "its worker is gone");
        blocks.left(B);
        let mut rest = told(&heard);
        rest.sort_unstable();
        assert_eq!(rest, [(2, false), (4, false)]);
    }

    #[test]
    fn one_that_fails_or_takes_long_does_not_hold_up_the_rest() {
        let (mut blocks, heard) = blocks(3, &[A, B]);
        let first = given(&mut blocks);
        let (worker, lease) = first[0];
        let block = blocks.answered(&lease, Instant::now()).expect("it was given");
        blocks.failed(worker, block);
        assert_eq!(blocks.n_sharing(), 1);
        assert!(given(&mut blocks).iter().all(|(worker, _)| *worker == B));
        let (_, lease) = first[1];
        let later = Instant::now() + 2 * PATIENCE;
        let block = blocks.answered(&lease, later).expect("it was given");
        blocks.end(block, Ok((B, vec![[0; 32]])));
        given(&mut blocks);
        assert_eq!(blocks.overdue(later + PATIENCE), [], "it answers now and then");
        assert_eq!(told(&heard), [(1, true)]);
    }

    #[test]
    fn one_that_answers_nothing_holds_up_neither_its_blocks_nor_those_that_wait() {
        let (mut blocks, heard) = blocks(5, &[A, B]);
        given(&mut blocks);
        // Both are alive, and neither answers.
        assert_eq!(blocks.overdue(Instant::now()), []);
        assert_eq!(blocks.overdue(Instant::now() + 2 * PATIENCE), [A, B]);
        assert_eq!(blocks.n_sharing(), 0);
        let mut all = told(&heard);
        all.sort_unstable();
        assert_eq!(all, (0..5).map(|block| (block, false)).collect::<Vec<_>>(), "the caller makes them");
    }

    #[test]
    fn without_a_worker_nothing_waits() {
        let (mut blocks, heard) = blocks(2, &[]);
        assert_eq!(told(&heard), [(0, false), (1, false)]);
        assert!(given(&mut blocks).is_empty());
        blocks.stop();
        blocks.end(0, Err("late".to_owned()));
        assert!(told(&heard).is_empty());
    }
}
