//! Blocks of rows that this worker mixes in the shared folder: piece k of all particles, X T, piece k of all particles.
//!
//! The product is that of the coordinator, row by row the same bits. Next file to read: [`crate::session`].

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;
use starlings_pieces::{Folder, PieceName};
use starlings_proto::convert::floats;
use starlings_proto::{Block, FromWorker, Lease, digest};
use tokio::sync::Semaphore;

use crate::outbox::Outbox;

/// Blocks that may wait for each slot.
const WAITING: usize = 8;

/// The blocks of one session.
pub(crate) struct Blocks {
    folder: Option<Arc<Folder>>,
    lanes: Arc<Semaphore>,
    given: Arc<AtomicUsize>,
    most: usize,
}

impl Blocks {
    /// None yet, in the folder that is shared, for so many at the same time.
    pub(crate) fn new(folder: Option<Arc<Folder>>, slots: usize) -> Self {
        let (lanes, most) = (Arc::new(Semaphore::new(slots.max(1))), WAITING * slots.max(1));
        Self { folder, lanes, given: Arc::default(), most }
    }

    /// Whether some are being made or wait.
    pub(crate) fn are_given(&self) -> bool {
        self.given.load(Ordering::Relaxed) > 0
    }

    /// Makes a block on a thread of its own, as soon as one of those before is made, and answers.
    pub(crate) fn take(&self, lease: Lease, block: Block, outbox: &Outbox) {
        let Some(folder) = self.folder.clone() else {
            return answer(outbox, lease, Err("it shares no folder for states".to_owned()));
        };
        if self.given.fetch_add(1, Ordering::Relaxed) >= self.most {
            self.given.fetch_sub(1, Ordering::Relaxed);
            return answer(outbox, lease, Err("more blocks were given to it than can wait".to_owned()));
        }
        let (outbox, lanes, given) = (outbox.clone(), Arc::clone(&self.lanes), Arc::clone(&self.given));
        tokio::spawn(async move {
            // It is never closed.
            let _lane = lanes.acquire().await;
            let made = tokio::task::spawn_blocking(move || make(&folder, &block)).await;
            given.fetch_sub(1, Ordering::Relaxed);
            answer(&outbox, lease, made.unwrap_or_else(|_| Err("its thread ended".to_owned())));
        });
    }
}

fn answer(outbox: &Outbox, lease: Lease, made: Result<Vec<PieceName>, String>) {
    outbox.send(FromWorker::Recombined { lease, made });
}

/// The names of the pieces of X T, which stand in the folder then.
fn make(folder: &Folder, block: &Block) -> Result<Vec<PieceName>, String> {
    let (rows, n) = (block.rows, block.pieces.len());
    let mut x = DMatrix::zeros(rows, n);
    for (column, name) in x.as_mut_slice().chunks_mut(rows).zip(&block.pieces) {
        let bytes = folder.read(name).map_err(|error| error.to_string())?;
        let (words, rest) = bytes.as_chunks::<8>();
        if words.len() != rows || !rest.is_empty() {
            return Err(format!("a piece of {} bytes where {rows} values belong", bytes.len()));
        }
        for (value, word) in column.iter_mut().zip(words) {
            *value = f64::from_le_bytes(*word);
        }
    }
    starlings_estimators::recombine(&mut x, &DMatrix::from_column_slice(n, n, &block.transform));
    let piece = |values: &[f64]| {
        let bytes = floats::encode(values);
        let name = digest(&bytes);
        folder.put(&name, &bytes).map(|()| name).map_err(|error| error.to_string())
    };
    x.as_slice().chunks(rows).map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_the_product_and_a_missing_piece_is_named() {
        let scratch = tempfile::tempdir().unwrap();
        let folder = Folder::at(scratch.path());
        let columns = [[1.0, 2.0, -0.0], [0.5, -3.0, 4.0]];
        let pieces: Vec<_> = columns
            .iter()
            .map(|values| {
                let bytes = floats::encode(values);
                folder.put(&digest(&bytes), &bytes).unwrap();
                digest(&bytes)
            })
            .collect();
        let block = Block { rows: 3, pieces, transform: vec![0.5, 0.5, 2.0, 0.25] };
        let made = make(&folder, &block).unwrap();
        let values = made
            .iter()
            .map(|name| floats::decode(&folder.read(name).unwrap(), "piece").unwrap())
            .collect::<Vec<_>>();
        assert_eq!(values, [[0.75, -0.5, 2.0], [2.125, 3.25, 1.0]]);
        assert!(make(&folder, &Block { rows: 2, ..block.clone() }).is_err(), "pieces of another length");
        let gone = Block { pieces: vec![[7; 32], block.pieces[1]], ..block };
        assert!(make(&folder, &gone).unwrap_err().contains(&starlings_pieces::hex(&[7; 32])));
    }
}
