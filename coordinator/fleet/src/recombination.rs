//! X T where the states are: workers that share the folder make it block by block, and only names come here.
//!
//! The bits are those that the caller would make: of the blocks of every worker the first one and later one in 64, drawn by the study's seed, are
//! made here too and compared, with what stands in the folder. A worker that made another one is put out, and all blocks of the
//! analysis are made again. A block that nobody made, or of which a piece is not there, is made here. Next file to read: `hub/blocks.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{self, RecvTimeoutError};

use starlings_proto::convert::floats;
use starlings_proto::convert::state::{ChunkId, n_chunks};
use starlings_proto::{Bytes, MAX_MESSAGE};
use starlings_states::{PieceError, StateError, StateWriter, StoredState};

use super::hub::{Made, Work};
use super::{FleetError, GrpcFleet, TELL_EVERY};
use crate::dispatcher::{WorkerId, draws};

/// So many times blocks are made again without the worker that made wrong ones, before all are made here.
const ROUNDS: usize = 3;

/// A piece of a state with its name.
pub type Piece = (ChunkId, Bytes);

/// What is to be made of the states of all particles.
pub struct Recombine<'a> {
    /// The states, by particle; of one length.
    pub columns: &'a [StoredState],
    /// The transform, column by column.
    pub transform: &'a [f64],
    /// Makes a block here: the pieces of this number of the new states, by particle.
    pub own: &'a (dyn Fn(usize) -> Result<Vec<Piece>, StateError> + Sync),
}

/// What was found out about the blocks of workers.
#[derive(Debug)]
pub(crate) struct Compared {
    /// Draws the blocks that are compared.
    seed: u64,
    /// Those of which a block was compared.
    workers: BTreeSet<WorkerId>,
    /// Blocks of earlier analyses, by who made them.
    used: BTreeMap<WorkerId, u64>,
    /// Blocks that are in use once all are there.
    made: BTreeMap<WorkerId, u64>,
    blocks: u64,
}

impl Compared {
    /// Nothing yet.
    pub(crate) fn drawn_by(seed: u64) -> Self {
        Self { seed, workers: BTreeSet::new(), used: BTreeMap::new(), made: BTreeMap::new(), blocks: 0 }
    }

    /// Begins an analysis, or one anew.
    fn begin(&mut self) {
        self.made.clear();
    }

    /// Whether the next block of a worker is to be compared.
    fn is_due(&mut self, worker: WorkerId) -> bool {
        self.blocks += 1;
        *self.made.entry(worker).or_default() += 1;
        self.workers.insert(worker) || draws(self.seed, self.blocks)
    }

    /// All blocks of an analysis are there.
    fn end(&mut self) {
        for (worker, made) in std::mem::take(&mut self.made) {
            *self.used.entry(worker).or_default() += made;
        }
    }

    /// What is said of a worker that made a wrong block.
    fn complaint(&self, worker: WorkerId, block: usize, what: &str) -> String {
        let used = self.used.get(&worker).copied().unwrap_or(0);
        format!(
            "block {block} of the states after an analysis is {what}; {used} of its blocks were used before"
        )
    }
}

/// Why blocks cannot be put together.
enum Broken {
    /// A worker mixes otherwise: all of it is made again without it.
    Wrong,
    Fleet(FleetError),
}

impl<E: Into<FleetError>> From<E> for Broken {
    fn from(error: E) -> Self {
        Self::Fleet(error.into())
    }
}

impl GrpcFleet {
    /// The new states; `None` where no worker shares the folder.
    pub(super) fn mix(&mut self, work: &Recombine<'_>) -> Result<Option<Vec<StoredState>>, FleetError> {
        let travels = size_of_val(work.transform) + 64 * work.columns.len() < MAX_MESSAGE;
        self.hub.states().tidy();
        for _ in 0..ROUNDS {
            if !travels || self.hub.n_sharing() == 0 {
                break;
            }
            self.compared.begin();
            let (made, heard) = mpsc::channel();
            let transform = floats::encode(work.transform);
            self.hub.begin_mixing(Work { columns: work.columns.to_vec(), transform, made });
            let mixed = self.gather(work, &heard);
            self.hub.end_mixing();
            match mixed {
                Ok(states) => {
                    self.compared.end();
                    return Ok(Some(states));
                }
                Err(Broken::Fleet(error)) => return Err(error),
                Err(Broken::Wrong) => {}
            }
        }
        Ok(None)
    }

    /// Whether nothing can be waited for any more.
    fn is_over(&self) -> bool {
        self.cancel.is_cancelled() || self.has_ended()
    }

    /// Why.
    fn why_over(&self) -> FleetError {
        if self.cancel.is_cancelled() {
            FleetError::Cancelled
        } else {
            FleetError::Stopped(self.hub.why_stopped())
        }
    }

    fn gather(
        &mut self,
        work: &Recombine<'_>,
        heard: &mpsc::Receiver<Made>,
    ) -> Result<Vec<StoredState>, Broken> {
        self.network.leave();
        let n_state = work.columns.first().map_or(0, StoredState::n_state);
        let mut writers: Vec<StateWriter> =
            work.columns.iter().map(|_| self.hub.states().writer(n_state)).collect();
        let mut ready: BTreeMap<usize, Vec<ChunkId>> = BTreeMap::new();
        let mut next = 0;
        while next < n_chunks(n_state) {
            if self.is_over() {
                return Err(Broken::Fleet(self.why_over()));
            }
            match heard.recv_timeout(TELL_EVERY) {
                Ok(Made { block, by: Ok((worker, names)) }) => {
                    let names = self.compared(work, block, worker, names)?;
                    ready.insert(block, names);
                }
                Ok(Made { block, by: Err(reason) }) => {
                    tracing::debug!(block, reason, "a block is mixed here");
                    ready.insert(block, Vec::new());
                }
                Err(RecvTimeoutError::Timeout) => self.hub.look_at_blocks(),
                Err(RecvTimeoutError::Disconnected) => return Err(Broken::Fleet(self.why_over())),
            }
            while let Some(names) = ready.remove(&next) {
                take(work, &mut writers, next, &names)?;
                next += 1;
            }
        }
        Ok(writers.into_iter().map(StateWriter::finish).collect::<Result<_, _>>()?)
    }

    /// The names of the pieces of a block, one per particle, once they are as good as those made here.
    fn compared(
        &mut self,
        work: &Recombine<'_>,
        block: usize,
        worker: WorkerId,
        names: Vec<ChunkId>,
    ) -> Result<Vec<ChunkId>, Broken> {
        if !self.compares || self.hub.is_local_only() || !self.compared.is_due(worker) {
            return Ok(names);
        }
        let own = (work.own)(block)?;
        let wrong = if own.iter().map(|(name, _)| name).ne(&names) {
            "another one than here"
        } else if names.iter().any(|name| self.is_spoiled(name)) {
            "not what its names say"
        } else {
            return Ok(names);
        };
        self.hub.mixes_wrong(worker, self.compared.complaint(worker, block, wrong));
        Err(Broken::Wrong)
    }

    /// Whether something else stands in the folder than a name says. What is not seen there yet is made here.
    fn is_spoiled(&self, name: &ChunkId) -> bool {
        matches!(self.hub.states().verify(name), Err(StateError::Piece(PieceError::Damaged { .. })))
    }
}

/// Takes a block into the new states: from the folder, or from here where a piece is not there.
fn take(
    work: &Recombine<'_>,
    writers: &mut [StateWriter],
    block: usize,
    names: &[ChunkId],
) -> Result<(), StateError> {
    let mut taken = 0;
    for (writer, name) in writers.iter_mut().zip(names) {
        if writer.push_existing(*name).is_err() {
            break;
        }
        taken += 1;
    }
    if taken == writers.len() {
        return Ok(());
    }
    let own = (work.own)(block)?;
    for (writer, (name, bytes)) in writers.iter_mut().zip(own).skip(taken) {
        writer.push_named(name, bytes)?;
    }
    Ok(())
}
