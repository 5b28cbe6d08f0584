//! X T where the states are: workers that share the folder make it block by block, and only names come here.
//!
//! The bits are those that the caller would make: of the blocks of every worker the first one and later one in [`SAMPLE`] are made here
//! too and compared. A block that nobody made, or of which a piece is not there, is made here. Next file to read: `hub/blocks.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{self, RecvTimeoutError};

use starlings_proto::convert::floats;
use starlings_proto::convert::state::{ChunkId, n_chunks};
use starlings_proto::{Bytes, MAX_MESSAGE};
use starlings_states::{StateError, StateWriter, StoredState};

use super::hub::{Made, Work};
use super::{FleetError, GrpcFleet, TELL_EVERY};
use crate::dispatcher::WorkerId;

/// One in so many blocks of a worker is compared.
const SAMPLE: u64 = 64;

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
#[derive(Debug, Default)]
pub(crate) struct Compared {
    workers: BTreeSet<WorkerId>,
    blocks: u64,
}

impl Compared {
    /// Whether the next block of a worker is to be compared.
    fn is_due(&mut self, worker: WorkerId) -> bool {
        self.blocks += 1;
        self.workers.insert(worker) || self.blocks.is_multiple_of(SAMPLE)
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
        while travels && self.hub.n_sharing() > 0 {
            let (made, heard) = mpsc::channel();
            let transform = floats::encode(work.transform);
            self.hub.begin_mixing(Work { columns: work.columns.to_vec(), transform, made });
            let mixed = self.gather(work, &heard);
            self.hub.end_mixing();
            match mixed {
                Ok(states) => return Ok(Some(states)),
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
        let n_state = work.columns.first().map_or(0, StoredState::n_state);
        let mut writers: Vec<StateWriter> =
            work.columns.iter().map(|_| self.hub.states().writer(n_state)).collect();
        let mut ready: BTreeMap<usize, Vec<ChunkId>> = BTreeMap::new();
        let mut next = 0;
        while next < n_chunks(n_state) {
            match heard.recv_timeout(TELL_EVERY) {
                Ok(Made { block, by: Ok((worker, names)) }) => {
                    let names = self.compared(work, block, worker, names)?;
                    ready.insert(block, names);
                }
                Ok(Made { block, by: Err(reason) }) => {
                    tracing::debug!(block, reason, "a block is mixed here");
                    ready.insert(block, Vec::new());
                }
                Err(RecvTimeoutError::Timeout) if !self.is_over() => self.hub.look_at_blocks(),
                Err(_) => return Err(Broken::Fleet(self.why_over())),
            }
            while let Some(names) = ready.remove(&next) {
                take(work, &mut writers, next, &names)?;
                next += 1;
            }
        }
        Ok(writers.into_iter().map(StateWriter::finish).collect::<Result<_, _>>()?)
    }

    /// The names of the pieces of a block, or none where it is to be made here.
    fn compared(
        &mut self,
        work: &Recombine<'_>,
        block: usize,
        worker: WorkerId,
        names: Vec<ChunkId>,
    ) -> Result<Vec<ChunkId>, Broken> {
        if names.len() != work.columns.len() {
            return Ok(Vec::new());
        }
        if self.compares && !self.hub.is_local_only() && self.compared.is_due(worker) {
            let own = (work.own)(block)?;
            if !own.iter().map(|(name, _)| name).eq(&names) {
                self.hub.mixes_wrong(worker, block);
                return Err(Broken::Wrong);
            }
        }
        Ok(names)
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
